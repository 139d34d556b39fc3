"""The page of a study of shooting: the tables and figures of You 2023, ours beside what the paper found."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..data import Trial
from ..engine import SimulationError
from ..files import write_whole
from ..identify.servo import ServoFit
from ..replay import replay
from . import shooting_figures as drawings
from .page import bullets, figure, number, page, table, text
from .sections import along
from .shooting_cases import FULL, RIVAL, TRUTH, Case, Shot
from .shooting_numbers import numbers
from .shooting_scores import HORIZONS, VELOCITIES

_DEGREES = math.degrees(1.0)
_STATES = ("u", "v_m", "r", "x", "y", "psi")
_UNITS = {"u": ("m/s", 1.0), "v_m": ("m/s", 1.0), "r": ("°/s", _DEGREES)}


def write(path: str | Path, shot: Shot, *, provenance: Mapping[str, str]) -> Path:
    """Write the page, and its numbers beside it as .json; whole or not at all."""
    here = Path(path)
    here.parent.mkdir(parents=True, exist_ok=True)
    html = document(shot, provenance=provenance)
    found = json.dumps({**numbers(shot), "provenance": dict(provenance)}, indent=1)
    write_whole(here.with_suffix(".json"), found + "\n")
    write_whole(here, html)
    return here


def document(shot: Shot, *, provenance: Mapping[str, str]) -> str:
    """The whole page."""
    title = shot.study.title or shot.study.name
    entries = "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in provenance.items())
    parts = (
        _head(shot, title), _relative(shot), _horizons(shot), _runs(shot), _parameters(shot), _drive(shot),
        f"<h2>Provenance</h2><dl>{entries}</dl>",
    )  # fmt: skip
    return page(title, "".join(parts))


def _names(shot: Shot) -> dict[str, str]:
    case = shot.cases[0]
    return {TRUTH: "truth"} | {who: f"{len(case.fits[who].free)} parameters" for who in (FULL, RIVAL)}


def _head(shot: Shot, title: str) -> str:
    first, virtual, problem = shot.cases[0], shot.study.virtual, shot.study.problem
    truth, samples = "" if virtual is None else virtual.ship.name, sum(len(t) for t in problem.trials)
    worst = max(first.scores[FULL].beyond(first.scores[TRUTH]).values())
    far, names = int((np.abs(first.away) > 3.0).sum()), _names(shot)
    tiles = (
        (" / ".join(number(first.smaller(v), 2) for v in VELOCITIES),
         f"error of {names[RIVAL]} over that of {names[FULL]}: surge, sway, yaw"),
        (f"{len(first.away) - far} of {len(first.away)}", "parameters within 3 sigma of the truth"),
        (number(worst), f"error after {HORIZONS[-1]} steps over the truth's own, the worst of six states"),
        (f"{number(first.fits[FULL].seconds, 2)} s",
         f"to fit {samples} samples; more on a machine that has nothing compiled"),
    )
    shown = "".join(
        f'<div class="tile{" main" if k == 0 else ""}"><b>{text(value)}</b><span>{text(what)}</span></div>'
        for k, (value, what) in enumerate(tiles)
    )
    lead = (
        f"{names[FULL]} of {problem.ship.name} from {len(problem.trials)} manoeuvres, judged on {len(shot.study.test)} "
        f"others; {names[RIVAL]} fitted beside."
    )
    levels = f'<p>{text(_levels(shot))}</p>' if virtual else ""
    return (
        f'<h1>{text(title)}</h1><p class="lead">{text(lead)}</p><div class="tiles">{shown}</div>'
        f"<p>{text(f'The truth is {truth}: its trials are made, so every estimate has its true value.')}</p>{levels}"
    )


def _levels(shot: Shot) -> str:
    """What the weather and the sensors of the truth are."""
    virtual = shot.study.virtual
    if virtual is None:
        return ""
    wind, found = virtual.wind, list[str]()
    if wind.U_T:
        gusts = f" with gusts ({virtual.gusts})" if virtual.gusts else ""
        found.append(f"wind of {wind.U_T:g} m/s from {_DEGREES * wind.gamma_T:.0f}°{gusts}")
    if wind.U_C:
        found.append(f"a current of {wind.U_C:g} m/s towards {_DEGREES * wind.gamma_C:.0f}°")
    own = [sail.current[0] for sail in virtual.sails.values() if sail.current is not None and sail.current[0]]
    if own:
        span = f"{min(own):g}" if min(own) == max(own) else f"{min(own):g} to {max(own):g}"
        found.append(f"a current of {span} m/s in {len(own)} of {len(virtual.sails)} trials, as each says")
    noise = ", ".join(
        f"{name} {number(_DEGREES * sd, 2)}°" if name[:3] in ("psi", "alp", "r", "del") else f"{name} {sd:g}"
        for name, sd in virtual.sensors.noise.items()
    )
    return f"In it: {' and '.join(found) or 'calm'}. White noise of the sensors (SI, angles in degrees): {noise}."


def _relative(shot: Shot) -> str:
    """Table 5 of the paper."""
    names, published = _names(shot), shot.study.published
    rows: list[list[str]] = []
    for case in shot.cases:
        for who, score in case.scores.items():
            rows.append([f"{case.name}, {names[who]}", *(_percent(score.relative[v]) for v in VELOCITIES), "ours"])
    for who in (FULL, RIVAL):
        if published.get(who):
            found = published[who]
            cells = [f"{found[v]:.4g} %" if v in found else "–" for v in VELOCITIES]
            rows.append([f"published, {names[who]}", *cells, "the paper's"])
    note = (
        "Norm of the error of whole runs, predicted from the first measured state and the logged commands, over the "
        "norm of the measured velocity; all trials kept back together. The truth errs too: sensors are noisy, it "
        "starts from a measured state, and it is not told what no log tells. What a paper found, it found on logs of "
        "its own: compare how the models rank, not the figures."
    )
    cited = f"The paper's: {published['source']}." if published else ""
    source = f'<p class="soft">{text(cited)}</p>'
    ratios = [
        [case.name, *(number(case.smaller(v)) for v in VELOCITIES), case.about] for case in shot.cases
    ]
    return (
        f"<h2>Relative errors (You 2023 Tab. 5)</h2>"
        f"{table(['', 'surge u', 'sway v_m', 'yaw r', 'whose'], rows, words=(4,))}"
        f'<p class="soft">{text(note)}</p>{source}<h3>Error of the rival over that of the model</h3>'
        f"{table(['', 'surge u', 'sway v_m', 'yaw r', 'what the model knows'], ratios, words=(4,))}"
    )


def _percent(share: float) -> str:
    return f"{number(100.0 * share)} %" if math.isfinite(share) else "blows up"


def _horizons(shot: Shot) -> str:
    """Fig. 22 of the paper."""
    names, dt = _names(shot), shot.study.problem.trials[0].dt
    drawn = "".join(
        figure(drawings.steps(case.scores, names, dt, case.name),
               f"{case.name}: error after 1 to {HORIZONS[-1]} steps from {case.scores[FULL].starts} measured states")
        for case in {c.name: c for c in (shot.cases[0], shot.cases[-1])}.values()
    )  # fmt: skip
    rows = [
        [case.name, *(number(case.scores[FULL].beyond(case.scores[TRUTH])[s], 4) for s in _STATES)]
        for case in shot.cases
    ]
    return (
        f'<h2>Errors over the steps predicted (You 2023 Fig. 22)</h2><div class="figures">{drawn}</div>'
        f"<h3>After {HORIZONS[-1]} steps ({HORIZONS[-1] * dt:g} s): {names[FULL]} over the truth's own error</h3>"
        f"{table(['', *_STATES], rows)}"
    )


def _runs(shot: Shot) -> str:
    """Fig. 21 of the paper, and two trials drawn."""
    case, names = shot.cases[0], _names(shot)
    sizes = {who: len(case.fits[who].free) for who in (FULL, RIVAL)}
    head = ["", "trial", *(f"{v} [{_UNITS[v][0]}], {sizes[who]}" for v in VELOCITIES for who in (FULL, RIVAL))]
    rows = [
        [str(k + 1), name, *(number(_UNITS[v][1] * case.scores[who].runs[name][v]) for v in VELOCITIES
                             for who in (FULL, RIVAL))]
        for k, name in enumerate(case.scores[FULL].runs)
    ]  # fmt: skip
    drawing = figure(drawings.runs(case.scores, names), "Root mean square error of each whole run")
    return (
        f'<h2>Errors by manoeuvre (You 2023 Fig. 21)</h2><div class="figures">{drawing}{_drawn(shot, case)}</div>'
        f"{table(head, rows, words=(1,))}"
        f'<p class="soft">By velocity and number of parameters; the truth itself is in the figure.</p>'
    )


def _drawn(shot: Shot, case: Case) -> str:
    """The trial in which the model errs most, measured and predicted."""
    runs = case.scores[FULL].runs
    worst = max(shot.study.test, key=lambda t: runs[t.name]["r"])
    names = {who: name for who, name in _names(shot).items() if who != TRUTH}
    predicted: dict[str, Trial] = {}
    for who in names:
        try:
            predicted[who] = replay(case.fits[who].ship, worst)
        except SimulationError:
            continue
    caption = f"{worst.name}, where {names[FULL]} err most in yaw: predicted from its first state on"
    return figure(drawings.motion(worst, predicted, names), caption)


def _parameters(shot: Shot) -> str:
    """Table 3 of the paper."""
    first, fit = shot.cases[0], shot.fit
    status = {v.subject: v.status for v in fit.verdicts}
    rows = [
        [f.path.rpartition(".")[2], number(float(true), 5), number(f.start, 4), number(float(fit.values[k]), 5),
         number(float(fit.sigma[k]), 2), *(number(float(case.away[k]), 2) for case in shot.cases),
         status.get(f.path, "–")]
        for k, (f, true) in enumerate(zip(fit.free, first.truth, strict=True))
    ]  # fmt: skip
    head = ["parameter", "truth", "start", "estimate", "sigma",
            *(case.name for case in shot.cases), "verdict"]  # fmt: skip
    drawing = figure(drawings.estimates(shot.cases), "How far each estimate is from the truth, in its own sigma")
    words = bullets(f"{v.subject}: {v.text}" for v in fit.verdicts if v.status != "identified")
    told = bullets(_within(case) for case in shot.cases)
    return (
        f'<h2>The parameters (You 2023 Tab. 3)</h2>{told}<div class="figures">{drawing}</div>'
        f"{table(head, rows, words=(len(head) - 1,))}"
        '<p class="soft">SI units. Estimate and sigma are those of the first case; in the columns of the cases: '
        "estimate less truth, in sigma of the case.</p>"
        f"<h3>What the data do not tell apart</h3>{words}{along(fit)}"
    )


def _within(case: Case) -> str:
    off = np.abs(case.away)
    far = [f.path for f, z in zip(case.fits[FULL].free, off, strict=True) if z > 3.0]
    return f"{case.name} ({case.about}): at most {number(float(off.max()))} sigma off" + (
        f"; beyond 3 sigma: {', '.join(far)}" if far else "; all within 3 sigma"
    )


def _drive(shot: Shot) -> str:
    """Section 4.4 of the paper."""
    pulls, pulled = _pulls(shot)
    angles, turned = _angles(shot)
    if not pulled + turned:
        return ""
    drawn = f'<div class="figures">{pulled}{turned}</div>'
    return f"<h2>Thrust and azimuth servos (You 2023 Figs. 14 and 15)</h2>{pulls}{angles}{drawn}"


def _pulls(shot: Shot) -> tuple[str, str]:
    """Table and drawings of the bench."""
    model: Any = shot.drive.truth.model
    rows: list[list[str]] = []
    drawn = ""
    for name, (fit, n, pull) in shot.drive.maps.items():
        true = np.array([float(dict(model.thrusters.items())[name].thrust(float(level))) for level in n])
        far = float(np.abs(fit.thrust(n) - true).max())
        kept = ", ".join(map(str, fit.powers))
        rows.append([f"thruster {name}", kept, number(fit.rmse), f"{fit.R2:.5f}", number(far)])
        drawn += figure(drawings.thrust(fit, n, pull, true), f"Bollard pull of thruster {name}")
    head = ["", "powers of n kept", "RMSE [N]", "R²", "farthest from the truth [N]"]
    return (table(head, rows, words=(1,)) if rows else ""), drawn


def _lag(fit: ServoFit) -> str:
    """The lag with its sigma; none where the logs tell of none."""
    servo: Any = fit.servo
    return f"{number(float(servo.lag), 2)} ± {number(fit.sigma['lag'], 1)}" if "lag" in fit.sigma else "none told"


def _angles(shot: Shot) -> tuple[str, str]:
    """Table and drawings of the servos."""
    published = shot.study.published.get("R2", {})
    rows: list[list[str]] = []
    drawn = ""
    for name, fit in shot.drive.servos.items():
        servo: Any = fit.servo
        true: Any = shot.drive.truth.actuators.of(name)
        paper = f"{published[name]:g}" if name in published else "–"
        rows.append([
            name, f"{servo.rate:.5f} ± {fit.sigma['rate']:.1g}", f"{true.rate:.5f}", _lag(fit),
            number(float(true.lag), 2),
            number(_DEGREES * fit.rmse), f"{fit.R2:.5f}", paper,
        ])  # fmt: skip
        busiest = max(shot.study.problem.trials, key=lambda t, c=name: float(np.abs(np.diff(t[f"{c}_cmd"])).sum()))
        drawn += figure(drawings.servo(fit, busiest), f"{name} in {busiest.name}")
    head = ["", "rate [rad/s]", "truth", "lag [s]", "truth", "RMSE [°]", "R²", "R², the paper's"]
    return (table(head, rows) if rows else ""), drawn

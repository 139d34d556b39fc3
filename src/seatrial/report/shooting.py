"""The page of a study of shooting: the tables and figures of You 2023, ours beside what the paper found.

The figures of You 2023 for a study of shooting: errors by manoeuvre and by steps, servo, thrust, and estimates.

What the page of a study of shooting says in numbers, SI units and radians.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import write_whole
from ..data import Array, Trial
from ..engine import SimulationError
from ..identify.components.servo import ServoFit, answered
from ..identify.components.thrust_map import ThrustMap
from ..simulate.replay import replay
from ..validate.shooting_cases import AS_SAILED, CALM, FULL, IGNORED, RIVAL, TRUTH, WIND_KNOWN, Case, Shot
from ..validate.shooting_scores import HORIZONS, VELOCITIES, Score
from .figures import canvas, svg
from .page import bullets, figure, number, page, table, text
from .sections import along

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
        figure(steps(case.scores, names, dt, case.name),
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
    drawing = figure(runs(case.scores, names), "Root mean square error of each whole run")
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
    return figure(motion(worst, predicted, names), caption)


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
    drawing = figure(estimates(shot.cases), "How far each estimate is from the truth, in its own sigma")
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
        drawn += figure(thrust(fit, n, pull, true), f"Bollard pull of thruster {name}")
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
        found: Any = fit.servo
        true: Any = shot.drive.truth.actuators.of(name)
        paper = f"{published[name]:g}" if name in published else "–"
        rows.append([
            name, f"{found.rate:.5f} ± {fit.sigma['rate']:.1g}", f"{true.rate:.5f}", _lag(fit),
            number(float(true.lag), 2),
            number(_DEGREES * fit.rmse), f"{fit.R2:.5f}", paper,
        ])  # fmt: skip
        busiest = max(shot.study.problem.trials, key=lambda t, c=name: float(np.abs(np.diff(t[f"{c}_cmd"])).sum()))
        drawn += figure(servo(fit, busiest), f"{name} in {busiest.name}")
    head = ["", "rate [rad/s]", "truth", "lag [s]", "truth", "RMSE [°]", "R²", "R², the paper's"]
    return (table(head, rows) if rows else ""), drawn


_IN_DEGREES = math.degrees(1.0)
_AXES = {
    "x": ("x [m]", 1.0), "y": ("y [m]", 1.0), "psi": ("ψ [°]", _IN_DEGREES), "u": ("u [m/s]", 1.0),
    "v_m": ("v_m [m/s]", 1.0), "r": ("r [°/s]", _IN_DEGREES),
}  # fmt: skip
# Okabe and Ito's palette; dashes and marks carry the same distinction in print.
_STYLES: dict[str, dict[str, Any]] = {
    TRUTH: {"color": "#111", "ls": (0, (1, 1.5)), "marker": "x", "zorder": 3},
    FULL: {"color": "#0072B2", "ls": "-", "marker": "o", "zorder": 2.5},
    RIVAL: {"color": "#D55E00", "ls": (0, (6, 2)), "marker": "s"},
}
_FAR = 15.0
"""Errors beyond so many sigma are drawn on a logarithmic scale, so that those within three can be told apart."""
# One and the same in every report, whichever of the cases it has.
_MARKS = {AS_SAILED: ("#0072B2", "o"), WIND_KNOWN: ("#009E73", "D"), IGNORED: ("#E69F00", "^"), CALM: ("#CC79A7", "s")}


def steps(scores: Mapping[str, Score], names: Mapping[str, str], dt: float, what: str) -> str:
    """Root mean square error over the steps predicted (You 2023 Fig. 22); `names` by label of the score."""
    figure, axes = canvas(3, (5.2, 5.4))
    for ax, name in zip(axes, VELOCITIES, strict=True):
        label, factor = _AXES[name]
        for who, score in scores.items():
            ax.plot(HORIZONS, factor * score.steps[name], lw=1.4, ms=4, label=names[who], **_STYLES[who])
        ax.set_ylabel(label)
        ax.set_ylim(bottom=0.0)
    axes[-1].set_xlabel(f"steps predicted, {dt:g} s each")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.align_ylabels(axes)
    return svg(figure, f"steps {what}")


def runs(scores: Mapping[str, Score], names: Mapping[str, str]) -> str:
    """Root mean square error of each run (You 2023 Fig. 21), trials numbered in their order."""
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

    figure, axes = canvas(3, (5.2, 5.4))
    for ax, name in zip(axes, VELOCITIES, strict=True):
        label, factor = _AXES[name]
        for who, score in scores.items():
            values = [factor * run[name] for run in score.runs.values()]
            style = _STYLES[who] | {"ls": "none"}
            ax.plot(range(1, len(values) + 1), values, ms=4.5, label=names[who], **style)
        ax.set_yscale("log")
        ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        ax.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        ax.yaxis.set_minor_formatter(NullFormatter())
        ax.set_ylabel(label)
    axes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[-1].set_xlabel("trial kept back, as numbered below")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.align_ylabels(axes)
    return svg(figure, "runs")


def estimates(cases: Sequence[Case]) -> str:
    """Estimate less truth over its standard deviation, a mark for each case."""
    paths = [f.path for f in cases[0].fits[FULL].free]
    figure, (ax,) = canvas(1, (5.2, 0.24 * len(paths) + 1.2))
    ax.axvspan(-3.0, 3.0, color="#eef2f5", zorder=0.5)
    ax.axvline(0.0, color="#b5bcc2", lw=1.0)
    for k, case in enumerate(cases):
        colour, mark = _MARKS[case.name]
        rows = np.arange(len(paths)) + 0.5 * ((k + 0.5) / len(cases) - 0.5)
        ax.plot(case.away, rows, mark, color=colour, ms=4.5, mfc=colour if k == 0 else "white", ls="none",
                label=case.name)  # fmt: skip
    farthest = max(float(np.abs(case.away).max()) for case in cases)
    if farthest > _FAR:
        ax.set_xscale("symlog", linthresh=3.0, linscale=1.5)
        ticks = [v for v in (0, 1, 3, 10, 30, 100, 300, 1000) if v < 2.0 * farthest]
        ax.set_xticks([-v for v in ticks[:0:-1]] + ticks, [f"{v:g}" for v in [-v for v in ticks[:0:-1]] + ticks])
        ax.minorticks_off()
    ax.set_yticks(range(len(paths)), [path.partition(".")[2] for path in paths])
    ax.set_ylim(len(paths) - 0.5, -0.5)
    ax.set_xlabel("(estimate − truth) / sigma; within 3 is shaded")
    figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center", ncols=4, handletextpad=0.1,
                  columnspacing=1.0, frameon=False)  # fmt: skip
    return svg(figure, "estimates")


def motion(measured: Trial, predicted: Mapping[str, Trial], names: Mapping[str, str]) -> str:
    """Velocities of one trial over time, measured and predicted from its first state."""
    figure, axes = canvas(3, (5.2, 4.4))
    for ax, name in zip(axes, VELOCITIES, strict=True):
        label, factor = _AXES[name]
        ax.plot(measured.t, factor * measured[name], color="#c9d0d6", lw=3.6, label="measured")
        for who, trial in predicted.items():
            ax.plot(trial.t, factor * trial[name], lw=1.4, label=names[who], **_STYLES[who] | {"marker": ""})
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time t [s]")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    figure.align_ylabels(axes)
    return svg(figure, f"motion {measured.name}")


def servo(fit: ServoFit, trial: Trial) -> str:
    """Order, angle measured and angle of the servo over one log, and what is left (You 2023 Fig. 15)."""
    name = fit.control
    order, angle = trial[f"{name}_cmd"], trial[name]
    modelled = answered(fit, trial) + fit.offset
    figure, (above, below) = canvas(2, (5.2, 3.8))
    above.step(trial.t, _IN_DEGREES * order, where="post", color="#8a8a8a", ls=(0, (1, 1.5)), lw=1.2, label="ordered")
    above.plot(trial.t, _IN_DEGREES * angle, color="#111", lw=2.2, label="measured")
    above.plot(trial.t, _IN_DEGREES * modelled, color="#56B4E9", ls=(0, (4, 1.5)), lw=1.4, label="servo")
    above.set_ylabel(f"{name} [°]")
    below.plot(trial.t, _IN_DEGREES * (modelled - angle), color="#0072B2", lw=0.8)
    below.set_ylabel("servo − measured [°]")
    below.set_xlabel("time t [s]")
    figure.legend(*above.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.align_ylabels((above, below))
    return svg(figure, f"servo {name}")


def thrust(fit: ThrustMap, n: Array, pull: Array, true: Array) -> str:
    """Pull by revolutions with the map, and both less the truth (You 2023 Fig. 14); `true` at the rows pulled."""
    figure, (above, below) = canvas(2, (5.2, 3.8))
    fine = np.linspace(0.0, fit.n_max, 200)
    above.plot(n, pull, "o", color="#111", mfc="white", ms=4.5, label="load cell")
    above.plot(fine, fit.thrust(fine), color="#0072B2", lw=1.5, label="map")
    above.set_ylabel("thrust [N]")
    below.axhline(0.0, color="#b5bcc2", lw=1.0)
    below.plot(n, pull - true, "o", color="#111", mfc="white", ms=4.5)
    below.plot(n, fit.thrust(n) - true, color="#0072B2", lw=1.5)
    below.set_ylabel("less the truth [N]")
    below.set_xlabel("revolutions n [1/s]")
    figure.legend(*above.get_legend_handles_labels(), loc="outside lower center", ncols=2, frameon=False)
    figure.align_ylabels((above, below))
    return svg(figure, f"thrust {fit.name}")


SCHEMA = "seatrial-shooting/1"


def numbers(shot: Shot) -> dict[str, Any]:
    """Cases with fits and scores, thrust maps, servos, and what a paper found; what is not finite is null."""
    study = shot.study
    return plain({
        "schema": SCHEMA, "study": study.name, "title": study.title, "ship": study.problem.ship.name,
        "horizons": list(HORIZONS), "trials": [t.name for t in study.problem.trials],
        "test_trials": [t.name for t in study.test], "published": dict(study.published),
        "cases": {case.name: _of_case(case) for case in shot.cases},
        "thrust": {
            name: {"coefficients": fit.coefficients.tolist(), "sigma": fit.sigma.tolist(), "powers": list(fit.powers),
                   "n_max": fit.n_max, "R2": fit.R2, "rmse": fit.rmse, "rows": fit.rows}
            for name, (fit, _, _) in shot.drive.maps.items()
        },
        "servos": {
            name: {**asdict(fit.servo), "sigma": dict(fit.sigma), "offset": fit.offset, "rmse": fit.rmse, "R2": fit.R2,
                   "samples": fit.samples, "cautions": list(fit.cautions)}
            for name, fit in shot.drive.servos.items()
        },
    })  # fmt: skip


def _of_case(case: Case) -> dict[str, Any]:
    fit = case.fits[FULL]
    return {
        "about": case.about,
        "fits": {
            who: {"objective": one.objective, "seconds": one.seconds, "status": one.status, "parameters": {
                f.path: {"start": f.start, "value": float(v), "sigma": float(s)}
                for f, v, s in zip(one.free, one.values, one.sigma, strict=True)
            }} for who, one in case.fits.items()
        },
        "truth": {f.path: float(v) for f, v in zip(fit.free, case.truth, strict=True)},
        "sigmas_off": {f.path: float(z) for f, z in zip(fit.free, case.away, strict=True)},
        "verdicts": [asdict(v) for v in fit.verdicts],
        "scores": {who: _of_score(score) for who, score in case.scores.items()},
        "rival_over_model": {v: case.smaller(v) for v in VELOCITIES},
        "model_over_truth": dict(case.scores[FULL].beyond(case.scores[TRUTH])),
    }  # fmt: skip


def _of_score(score: Score) -> dict[str, Any]:
    return {
        "relative": dict(score.relative), "runs": {name: dict(run) for name, run in score.runs.items()},
        "steps": {name: errors.tolist() for name, errors in score.steps.items()}, "starts": score.starts,
    }


def plain(value: Any) -> Any:
    """The same in what JSON knows; a number that is not finite becomes null."""
    if isinstance(value, Mapping):
        items: Iterable[tuple[Any, Any]] = value.items()
        return {str(key): plain(item) for key, item in items}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

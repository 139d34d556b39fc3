"""Page of a study with a rival on virtual trials: model, rival and truth in several weathers.

Relative errors, errors over the steps predicted, estimates beside their true values, thrust maps and servos.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..identify.components.servo import ServoFit
from ..validate.rivals import (
    AS_SAILED,
    CALM,
    FULL,
    HORIZONS,
    IGNORED,
    RIVAL,
    TRUTH,
    VELOCITIES,
    WIND_KNOWN,
    Case,
    Rivals,
    Score,
)
from . import diagnosis, figures
from .blocks import Body, bullets, fields, figure, gallery, heading, lead, line, number, soft, table, tiles
from .figures import canvas, legend_below, svg
from .page import Page, Section
from .page import provenance as origin
from .report import along

SCHEMA = "seatrial-shooting/1"
_DEGREES = math.degrees(1.0)
_STATES = ("u", "v_m", "r", "x", "y", "psi")
AXES = {"u": ("u [m/s]", 1.0), "v_m": ("v_m [m/s]", 1.0), "r": ("r [°/s]", _DEGREES)}
"""Axis label of each velocity, and its factor from SI units."""

STYLES: Mapping[str, Mapping[str, Any]] = {
    TRUTH: {"color": figures.INK, "ls": (0, (1, 1.5)), "marker": "x", "zorder": 3},
    FULL: {"color": figures.BLUE, "ls": "-", "marker": "o", "zorder": 2.5},
    RIVAL: {"color": figures.VERMILION, "ls": (0, (6, 2)), "marker": "s"},
}
"""Lines of truth, model and rival."""

_FAR = 15.0
"""Errors beyond this many sigma are drawn on a logarithmic scale, so that those within three stay distinct."""
# The same in every report, whichever weathers it has.
_MARKS = {
    AS_SAILED: (figures.BLUE, "o"), WIND_KNOWN: (figures.GREEN, "D"), IGNORED: (figures.ORANGE, "^"),
    CALM: (figures.PINK, "s"),
}  # fmt: skip


def page(found: Rivals, *, provenance: Mapping[str, str]) -> Page:
    """The whole page."""
    parts = (
        Section("", diagnosis.verdict(found.fit) + summary(found)),
        Section("Relative errors", relative(found)),
        Section("Errors over the steps predicted", growth(found)),
        Section("The parameters", parameters(found)),
        Section("Thrust and azimuth servos", drive(found)),
        Section("Residuals of the fit", diagnosis.section(found.fit)),
        origin(provenance),
    )
    return Page(found.study.title or found.study.name, (Section("", fields(numbers(found))), *parts))


def labels(found: Rivals) -> dict[str, str]:
    """Names of truth, model and rival for a reader."""
    case = found.cases[0]
    return {TRUTH: "truth"} | {who: _counted(len(case.fits[who].free)) for who in (FULL, RIVAL)}


def _counted(number: int) -> str:
    return f"{number} parameter{'s' * (number != 1)}"


def summary(found: Rivals) -> Body:
    """Main results, and the truth with its weather and sensors."""
    first, virtual, problem = found.cases[0], found.study.virtual, found.study.problem
    truth, samples = "" if virtual is None else virtual.ship.name, sum(len(t) for t in problem.trials)
    worst = max(first.scores[FULL].beyond(first.scores[TRUTH]).values())
    far, names = int((np.abs(first.away) > 3.0).sum()), labels(found)
    shown = (
        (" / ".join(number(first.smaller(v), 2) for v in VELOCITIES),
         f"error of {names[RIVAL]} over that of {names[FULL]}: surge, sway, yaw"),
        (f"{len(first.away) - far} of {len(first.away)}", "parameters within 3 sigma of the truth"),
        (number(worst), f"error after {HORIZONS[-1]} steps over the truth's own, the worst of six states"),
        (f"{number(first.fits[FULL].seconds, 2)} s",
         f"to fit {samples} samples; more on a machine that has nothing compiled"),
    )  # fmt: skip
    first_line = (
        f"{names[FULL]} of {problem.ship.name} from {len(problem.trials)} manoeuvres, judged on "
        f"{len(found.study.test)} others; {names[RIVAL]} fitted for comparison."
    )
    about = f"The truth is {truth}: its trials are simulated, so every estimate has a true value."
    return lead(first_line) + tiles(shown) + line(about) + (line(_weather(found)) if virtual else ())


def _weather(found: Rivals) -> str:
    """Weather and sensors of the truth."""
    virtual = found.study.virtual
    if virtual is None:
        return ""
    wind, parts = virtual.wind, list[str]()
    if wind.U_T:
        gusts = f" with gusts ({virtual.gusts})" if virtual.gusts else ""
        parts.append(f"wind of {wind.U_T:g} m/s from {_DEGREES * wind.gamma_T:.0f}°{gusts}")
    if wind.U_C:
        parts.append(f"a current of {wind.U_C:g} m/s towards {_DEGREES * wind.gamma_C:.0f}°")
    own = [sail.current[0] for sail in virtual.sails.values() if sail.current is not None and sail.current[0]]
    if own:
        span = f"{min(own):g}" if min(own) == max(own) else f"{min(own):g} to {max(own):g}"
        parts.append(f"a current of {span} m/s in {len(own)} of {len(virtual.sails)} trials, set for each")
    noise = ", ".join(
        f"{name} {number(_DEGREES * sd, 2)}°" if name[:3] in ("psi", "alp", "r", "del") else f"{name} {sd:g}"
        for name, sd in virtual.sensors.noise.items()
    )
    return f"Weather: {' and '.join(parts) or 'calm'}. White noise of the sensors (SI, angles in degrees): {noise}."


def relative(found: Rivals) -> Body:
    """Relative errors of whole runs, with those of a publication if the study has them, and their ratios."""
    names, published = labels(found), found.study.published
    rows: list[list[str]] = []
    for case in found.cases:
        for who, score in case.scores.items():
            rows.append([f"{case.name}, {names[who]}", *(_percent(score.relative[v]) for v in VELOCITIES), "ours"])
    for who in (FULL, RIVAL):
        if published.get(who):
            cited = published[who]
            cells = [f"{cited[v]:.4g} %" if v in cited else "–" for v in VELOCITIES]
            rows.append([f"published, {names[who]}", *cells, "the paper's"])
    remark = (
        "Norm of the error of whole runs, predicted from the first measured state and the logged commands, over the "
        "norm of the measured velocity; all held-out trials together. The truth has errors too: sensors are noisy, it "
        "starts from a measured state, and it lacks what the logs lack. A paper's errors are those of its own logs: "
        "compare how the models rank, not the values."
    )
    source = soft(f"The paper's: {published['source']}." if published else "")
    ratios = [[case.name, *(number(case.smaller(v)) for v in VELOCITIES), case.about] for case in found.cases]
    head = ["", "surge u", "sway v_m", "yaw r"]
    return (table([*head, "whose"], rows, words=(4,)) + soft(remark) + source
            + heading("Error of the rival over that of the model")
            + table([*head, "what the model knows"], ratios, words=(4,)))  # fmt: skip


def _percent(share: float) -> str:
    return f"{number(100.0 * share)} %" if math.isfinite(share) else "diverges"


def growth(found: Rivals) -> Body:
    """Errors over the steps predicted, in the first and the last weather, and those after the longest horizon."""
    names, dt = labels(found), found.study.problem.trials[0].dt
    drawn = (
        figure(steps(case.scores, names, dt, case.name),
               f"{case.name}: error after 1 to {HORIZONS[-1]} steps from {case.scores[FULL].starts} measured states")
        for case in {c.name: c for c in (found.cases[0], found.cases[-1])}.values()
    )  # fmt: skip
    rows = [
        [case.name, *(number(case.scores[FULL].beyond(case.scores[TRUTH])[s], 4) for s in _STATES)]
        for case in found.cases
    ]
    title = f"After {HORIZONS[-1]} steps ({HORIZONS[-1] * dt:g} s): {names[FULL]} over the truth's own error"
    return gallery(*drawn) + heading(title) + table(["", *_STATES], rows)


def parameters(found: Rivals) -> Body:
    """Estimates with sigma and verdict beside their true values."""
    first, fit = found.cases[0], found.fit
    status = {v.subject: v.status for v in fit.verdicts}
    rows = [
        [f.path.rpartition(".")[2], number(float(true), 5), number(f.start, 4), number(float(fit.values[k]), 5),
         number(float(fit.sigma[k]), 2), *(number(float(case.away[k]), 2) for case in found.cases),
         status.get(f.path, "–")]
        for k, (f, true) in enumerate(zip(fit.free, first.truth, strict=True))
    ]  # fmt: skip
    head = ["parameter", "truth", "start", "estimate", "sigma", *(case.name for case in found.cases), "verdict"]
    drawing = figure(estimates(found.cases), "Distance of each estimate from the truth, in its own sigma")
    words = bullets(f"{v.subject}: {v.text}" for v in fit.verdicts if v.status != "identified")
    remark = (
        "SI units. Estimate and sigma are those of the first case; in the columns of the cases: estimate less truth, "
        "in sigma of the case."
    )
    return (bullets(_within(case) for case in found.cases) + gallery(drawing)
            + table(head, rows, words=(len(head) - 1,)) + soft(remark)
            + heading("What the data do not determine separately") + words + along(fit))  # fmt: skip


def _within(case: Case) -> str:
    off = np.abs(case.away)
    far = [f.path for f, z in zip(case.fits[FULL].free, off, strict=True) if z > 3.0]
    return f"{case.name} ({case.about}): at most {number(float(off.max()))} sigma off" + (
        f"; beyond 3 sigma: {', '.join(far)}" if far else "; all within 3 sigma"
    )


def drive(found: Rivals) -> Body:
    """Thrust maps of the bench and servos of the logs beside the truth; empty without either."""
    return _thrust(found) + _servos(found)


def _thrust(found: Rivals) -> Body:
    rows: list[list[str]] = []
    for name, (fit, n, _) in found.drive.maps.items():
        far = float(np.abs(fit.thrust(n) - found.drive.thrust(name)).max())
        kept = ", ".join(map(str, fit.powers))
        rows.append([f"thruster {name}", kept, number(fit.rmse), f"{fit.R2:.5f}", number(far)])
    head = ["", "powers of n kept", "RMSE [N]", "R²", "farthest from the truth [N]"]
    return table(head, rows, words=(1,)) if rows else ()


def _servos(found: Rivals) -> Body:
    published = found.study.published.get("R2", {})
    rows: list[list[str]] = []
    for name, fit in found.drive.servos.items():
        servo: Any = fit.servo
        true: Any = found.drive.truth.actuators.of(name)
        paper = f"{published[name]:g}" if name in published else "–"
        rows.append([
            name, f"{servo.rate:.5f} ± {fit.sigma['rate']:.1g}", f"{true.rate:.5f}", _lag(fit),
            number(float(true.lag), 2), number(_DEGREES * fit.rmse), f"{fit.R2:.5f}", paper,
        ])  # fmt: skip
    head = ["", "rate [rad/s]", "truth", "lag [s]", "truth", "RMSE [°]", "R²", "R², the paper's"]
    return table(head, rows) if rows else ()


def _lag(fit: ServoFit) -> str:
    """The lag with its sigma; none if the logs do not determine it."""
    servo: Any = fit.servo
    return f"{number(float(servo.lag), 2)} ± {number(fit.sigma['lag'], 1)}" if "lag" in fit.sigma else "not determined"


def steps(scores: Mapping[str, Score], names: Mapping[str, str], dt: float, what: str) -> str:
    """Root mean square error of each velocity over the steps predicted; `names` by label of the score."""
    drawn, axes = canvas(3, (5.2, 5.4))
    for ax, (name, (label, factor)) in zip(axes, AXES.items(), strict=True):
        for who, score in scores.items():
            ax.plot(HORIZONS, factor * score.steps[name], lw=1.4, ms=4, label=names[who], **STYLES[who])
        ax.set_ylabel(label)
        ax.set_ylim((0.0, None))
    axes[-1].set_xlabel(f"steps predicted, {dt:g} s each")
    legend_below(drawn, axes[0])
    return svg(drawn, f"steps {what}")


def estimates(cases: Sequence[Case]) -> str:
    """Estimate less truth over its standard deviation, a mark for each case."""
    paths = [f.path for f in cases[0].fits[FULL].free]
    drawn, (ax,) = canvas(1, (5.2, 0.24 * len(paths) + 1.2))
    ax.axvspan(-3.0, 3.0, color=figures.TINT, zorder=0.5)
    ax.axvline(0.0, color=figures.RULE, lw=1.0)
    for k, case in enumerate(cases):
        colour, mark = _MARKS[case.name]
        rows = np.arange(len(paths)) + 0.5 * ((k + 0.5) / len(cases) - 0.5)
        ax.plot(case.away, rows, mark, color=colour, ms=4.5, mfc=colour if k == 0 else "white", ls="none",
                label=case.name)  # fmt: skip
    farthest = max(float(np.abs(case.away).max()) for case in cases)
    if farthest > _FAR:
        ax.set_xscale("symlog", 3.0)
        ticks = [v for v in (0, 1, 3, 10, 30, 100, 300, 1000) if v < 2.0 * farthest]
        ax.set_xticks([-v for v in ticks[:0:-1]] + ticks, [f"{v:g}" for v in [-v for v in ticks[:0:-1]] + ticks])
    names = [path.partition(".")[2] for path in paths]
    figures.rows_of(drawn, ax, names, "(estimate − truth) / sigma; within 3 is shaded", 4)
    return svg(drawn, "estimates")


def numbers(found: Rivals) -> dict[str, Any]:
    """Cases with fits and scores, thrust maps, servos, and published results."""
    study = found.study
    return {
        "schema": SCHEMA, "study": study.name, "title": study.title, "ship": study.problem.ship.name,
        "horizons": list(HORIZONS), "trials": [t.name for t in study.problem.trials],
        "test_trials": [t.name for t in study.test], "published": study.published,
        "cases": {case.name: _of_case(case) for case in found.cases},
        "thrust": {
            name: {"coefficients": fit.coefficients, "sigma": fit.sigma, "powers": fit.powers, "n_max": fit.n_max,
                   "R2": fit.R2, "rmse": fit.rmse, "rows": fit.rows}
            for name, (fit, _, _) in found.drive.maps.items()
        },
        "servos": {
            name: {**vars(fit.servo), "sigma": fit.sigma, "offset": fit.offset, "rmse": fit.rmse, "R2": fit.R2,
                   "samples": fit.samples, "cautions": fit.cautions}
            for name, fit in found.drive.servos.items()
        },
    }  # fmt: skip


def _of_case(case: Case) -> dict[str, Any]:
    fit = case.fits[FULL]
    return {
        "about": case.about,
        "fits": {
            who: {"objective": one.objective, "seconds": one.seconds, "status": one.status, "parameters": {
                f.path: {"start": f.start, "value": v, "sigma": s}
                for f, v, s in zip(one.free, one.values, one.sigma, strict=True)
            }} for who, one in case.fits.items()
        },
        "truth": {f.path: v for f, v in zip(fit.free, case.truth, strict=True)},
        "sigmas_off": {f.path: z for f, z in zip(fit.free, case.away, strict=True)},
        "verdicts": fit.verdicts, "scores": case.scores,
        "rival_over_model": {v: case.smaller(v) for v in VELOCITIES},
        "model_over_truth": case.scores[FULL].beyond(case.scores[TRUTH]),
    }  # fmt: skip

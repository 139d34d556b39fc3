"""Report of a fine-tuning: the chosen range and why, both methods, every range, warnings.

The figures are those of Suyama 2023: search, objective over the range, positions in the range, tracks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..core.parameters import read
from ..data import UNITS, Trial
from ..engine import SimulationError
from ..identify import Fit
from ..identify.tuning.tuned import Method, Range, Tuning, findings
from ..simulate.replay import replay
from . import diagnosis, figures
from .blocks import (
    Body,
    bullets,
    fields,
    figure,
    gallery,
    heading,
    joined,
    lead,
    line,
    note,
    number,
    soft,
    table,
    tiles,
)
from .evidence import TIE
from .figures import canvas, svg
from .page import Page, Section
from .page import provenance as origin

SCHEMA = "seatrial-tuning/1"
_DEGREES = math.degrees(1.0)


def page(
    tuning: Tuning, *, title: str, provenance: Mapping[str, str], method: str = "rk4",
    sections: Sequence[Section] = (), fit: Fit | None = None,
) -> Page:  # fmt: skip
    """The whole page.

    Args:
        method: integrator of the predictions drawn, as that of the fit.
        sections: additional ones, placed before the provenance.
        fit: the chosen fit with its diagnosis; None leaves its residuals out.
    """
    predicted = {trial.name: _predictions(tuning, trial, method) for trial in tuning.tests}
    parts = (
        Section("", (diagnosis.verdict(fit) if fit else ()) + _head(tuning)),
        Section("Two methods, side by side", _methods(tuning)),
        Section("The range", _objectives(tuning)),
        Section("Cross-validation", _left_out(tuning)),
        Section("The parameters", _parameters(tuning)),
        Section("Held-out trials", _tests(tuning, predicted)),
        Section("Residuals", _residuals(tuning)),
        Section("Residuals of the fit", diagnosis.section(fit) if fit else ()),
        *sections,
        origin(provenance),
    )
    return Page(title, (Section("", fields({**numbers(tuning), "title": title})), *parts))


def _head(tuning: Tuning) -> Body:
    best, issues = tuning.best, findings(tuning)
    before, after = (sum(losses.values()) for losses in (tuning.untuned_test, best.test))
    kind = "unseen" if tuning.tests else "tuning"
    if not tuning.tests:
        before, after = sum(tuning.untuned_tune.values()), sum(best.tune.values())
    shown = (
        (f"{best.ratio:g}", "range a_r, chosen by leaving tuning trials out"),
        (number(after / before) if before > 0 else "–", f"loss on the {kind} trials, tuned over untuned"),
        (f"{len(best.at_bound)} of {len(best.free)}", "parameters at an end of their range"),
        (number(max(r.apart for r in tuning.ranges), 2), "largest difference of the two methods, relative"),
    )
    names = [", ".join(t.name for t in trials) for trials in (tuning.problem.trials, tuning.tests)]
    ship, judged = tuning.problem.ship.name, f"judged on {names[1]}" if names[1] else "not judged on any other"
    first = f"{len(best.free)} parameters of {ship}, tuned to {names[0]}; {judged}."
    warnings, remarks = ([f"{f.where}: {f.text}" for f in issues if (f.severity == "warning") == wanted]
                         for wanted in (True, False))  # fmt: skip
    lost = worse_than_start(tuning)
    worse = lead(f"Worse than untuned: loss {number(lost['fitted'])} against {number(lost['untuned'])} on the {kind} "
                 "trials.") if lost else ()  # fmt: skip
    return worse + lead(first) + tiles(shown) + note("Warnings", warnings) + bullets(remarks)


def _methods(tuning: Tuning) -> Body:
    rows: list[list[str]] = []
    for r in tuning.ranges:
        evolution, gradient = r.methods["evolution"], r.methods["gradient"]
        rows.append([
            f"{r.ratio:g}", number(evolution.objective, 6), number(gradient.objective, 6), number(r.apart, 2), r.kept,
            str(evolution.evaluations), str(gradient.evaluations), number(evolution.seconds), number(gradient.seconds),
            f"{_found(evolution.ends, tuning.agreement)} of {len(evolution.ends)}",
            f"{_found(gradient.ends, tuning.agreement)} of {len(gradient.ends)}",
        ])  # fmt: skip
    head = ["a_r", "J, CMA-ES", "J, gradient", "apart", "kept", "evals, C", "evals, g", "s, C", "s, g",
            "runs agreed, C", "starts agreed, g"]  # fmt: skip
    shown = {r.ratio: r for r in (tuning.ranges[0], tuning.best)}
    drawn = (
        figure(search(r.methods["evolution"], f"{ratio:g}"), f"CMA-ES at a_r = {ratio:g}: the objective jumps where a "
               "run ends and the next begins, with a larger population")
        for ratio, r in shown.items()
    )  # fmt: skip
    remark = (
        "Both methods, CMA-ES (C) and bounded Gauss-Newton from many starts (g), solve the same problem. Seconds are "
        "those of a fit while others ran in parallel. Of the gradient method the evaluations are those of its best "
        "start; about one in two comes with exact derivatives."
    )
    return table(head, rows, words=(4,)) + soft(remark) + gallery(*drawn)


def _found(ends: Any, agreement: float) -> int:
    """How many runs ended at the best of them."""
    costs = np.asarray(ends)[:, 0]
    return int((costs <= costs.min() + agreement * abs(costs.min())).sum())


def _objectives(tuning: Tuning) -> Body:
    drawing = figure(objectives(tuning), "Loss over the range, on the tuning and on the test trials")
    remark = (
        "A wider range must fit the tuning trials better; whether it predicts better shows on trials that it was "
        "not fitted to. Soft: a Gaussian about the untuned values in place of the box."
    )
    return line(remark) + gallery(drawing)


def _left_out(tuning: Tuning) -> Body:
    names = [t.name for t in tuning.problem.trials]
    least = [min(r.left_out[n] for r in tuning.ranges) for n in names]
    totals = [sum(r.left_out.values()) for r in tuning.ranges]
    rows = [
        [f"{r.ratio:g}", *(_starred(r.left_out[n], low) for n, low in zip(names, least, strict=True)),
         _starred(total, min(totals)), number(sum(r.soft_left_out.values()), 4)]
        for r, total in zip(tuning.ranges, totals, strict=True)
    ]  # fmt: skip
    head = ["a_r", *(f"J of {n}" for n in names), "together", "soft, together"]
    remark = "Each tuning trial predicted by a fit to the others. This chooses the range. Bold: least of its column."
    return table(head, rows) + soft(remark)


def _starred(value: float, best: float) -> str:
    return ("*" if value <= best else "") + number(value, 4)


def _parameters(tuning: Tuning) -> Body:
    rows: list[list[str]] = []
    for k, f in enumerate(tuning.problem.free):
        value = float(read(tuning.problem.ship.model, f.path))
        tuned = [("*" if f.path in r.at_bound else "") + number(float(r.fit.values[k]), 4) for r in tuning.ranges]
        rows.append([f.path, number(value, 4), *tuned])
    head = ["parameter", "untuned", *(f"a_r {r.ratio:g}" for r in tuning.ranges)]
    caption = "Place of each parameter in its range; filled marks are at its end"
    drawing = figure(positions(tuning.ranges), caption)
    return gallery(drawing) + table(head, rows) + soft("SI units; bold: at an end of the range.")


def _predictions(tuning: Tuning, trial: Trial, method: str) -> dict[str, Trial]:
    """The trial as the untuned ship and each tuned one predict it; one that diverges is left out."""
    ships = {UNTUNED: tuning.problem.ship} | {f"a_r {r.ratio:g}": r.fit.ship for r in tuning.ranges}
    found: dict[str, Trial] = {}
    for label, ship in ships.items():
        try:
            found[label] = replay(ship, trial, method=method)
        except SimulationError:
            continue
    return found


def _tests(tuning: Tuning, predicted: Mapping[str, Mapping[str, Trial]]) -> Body:
    if not tuning.tests:
        return ()
    labels = [UNTUNED, *(f"a_r {r.ratio:g}" for r in tuning.ranges)]
    losses = [tuning.untuned_test, *(r.test for r in tuning.ranges)]
    rows = [[n, *_bolded([loss[n] for loss in losses])] for n in predicted]
    rows.append(["together", *_bolded([sum(loss.values()) for loss in losses])])
    away = [[t.name, *_bolded([_away(t, predicted[t.name].get(label)) for label in labels])] for t in tuning.tests]
    drawn = joined(
        heading(t.name) + gallery(
            figure(tracks(t, predicted[t.name]), "Track, north up, at equal scale; the circle is the start"),
            figure(motions(t, predicted[t.name]), "Heading, speeds, rate of turn and controls; lines as beside"),
        )
        for t in tuning.tests
    )
    return (heading("Loss J") + table(["trial", *labels], rows)
            + heading("Distance from the measured track, root mean square [m]") + table(["trial", *labels], away)
            + drawn)  # fmt: skip


def _bolded(values: Sequence[float]) -> list[str]:
    return [_starred(value, min(values)) if math.isfinite(value) else "–" for value in values]


def _away(measured: Trial, predicted: Trial | None) -> float:
    if predicted is None:
        return math.inf
    first = int(measured.t.searchsorted(predicted.t[0]))
    rows = slice(first, first + len(predicted))
    squares = (measured["x"][rows] - predicted["x"]) ** 2 + (measured["y"][rows] - predicted["y"]) ** 2
    return math.sqrt(float(np.nanmean(squares)))


def _residuals(tuning: Tuning) -> Body:
    left, names = tuning.residuals, [t.name for t in tuning.problem.trials]
    rows: list[list[str]] = []
    for channel, rms in left.rms.items():
        factor, unit = (_DEGREES if channel in ("psi", "r") else 1.0), UNITS[channel].replace("rad", "°")
        biases = [number(factor * left.bias[channel][n], 2) for n in names]
        rows.append([f"{channel} [{unit}]", number(factor * rms), number(factor * left.noise[channel]),
                     number(left.correlation[channel]), *biases])  # fmt: skip
    head = ["state", "RMS", "noise of the sensor", "correlation of neighbours", *(f"bias, {n}" for n in names)]
    remark = (
        "Residuals of the chosen fit on the tuning trials. The noise is that of the second differences of the "
        "measurement. If the model is complete, RMS and noise agree and neighbouring samples are not correlated."
    )
    return table(head, rows) + soft(remark)


def worse_than_start(tuning: Tuning) -> dict[str, Any] | None:
    """Losses of the chosen range and of the untuned ship on the test trials, where the former is larger by over 2 %.

    On the tuning trials where there are no others; None where it is not larger.
    """
    best = tuning.best
    pairs = (best.test, tuning.untuned_test) if tuning.tests else (best.tune, tuning.untuned_tune)
    mine, before = (sum(losses.values()) for losses in pairs)
    return {"fitted": mine, "untuned": before, "what": "loss"} if mine > (1.0 + TIE) * before else None


def numbers(tuning: Tuning) -> dict[str, Any]:
    """The numbers of the page, SI units and radians."""
    return {
        "schema": SCHEMA, "ship": tuning.problem.ship.name, "chosen": tuning.best.ratio,
        "tuning_trials": [t.name for t in tuning.problem.trials], "test_trials": [t.name for t in tuning.tests],
        "untuned": {"tune": tuning.untuned_tune, "test": tuning.untuned_test},
        "worse_than_untuned": worse_than_start(tuning),
        "ranges": [_of_range(r) for r in tuning.ranges],
        "residuals": {**vars(tuning.residuals), "flat_directions": tuning.flat}, "findings": findings(tuning),
    }  # fmt: skip


def _of_range(r: Range) -> dict[str, Any]:
    return {
        "ratio": r.ratio, "kept": r.kept, "apart": r.apart,
        "methods": {
            name: {"objective": m.objective, "evaluations": m.evaluations, "seconds": m.seconds, "status": m.status,
                   "ends": m.ends[:, 0], "values": m.values}
            for name, m in r.methods.items()
        },
        "parameters": {
            f.path: {"value": v, "low": f.low, "high": f.high, "position": p, "at_bound": f.path in r.at_bound}
            for f, v, p in zip(r.free, r.fit.values, r.position, strict=True)
        },
        "tune": r.tune, "test": r.test, "left_out": r.left_out,
        "soft": {"tune": r.soft_tune, "test": r.soft_test, "left_out": r.soft_left_out, "values": r.soft},
    }  # fmt: skip


UNTUNED = "untuned"
"""The name of the model before the fit."""
_LEAST = 1e-14


def search(method: Method, name: str) -> str:
    """Best objective of each generation, and its excess over the best of all (Suyama 2023 Fig. 4)."""
    drawn, (above, below) = canvas(2)
    rows = method.history
    above.plot(rows[:, 0], rows[:, 1], color=figures.BLUE, lw=1.0)
    above.set(yscale="log", ylabel="J, best of generation")
    least = float(rows[:, 1].min())
    over = np.maximum(rows[:, 1] - least, _LEAST * max(abs(least), 1e-300))
    below.plot(rows[:, 0], over, color=figures.BLUE, lw=1.0)
    below.set(yscale="log", ylabel="J − best J")
    below.set_xlabel("generation, all runs one after the other")
    return svg(drawn, f"search {name}")


def objectives(tuning: Tuning) -> str:
    """Loss of the tuning and of the test trials over the range (Suyama 2023 Figs. 5 and 6)."""
    drawn, axes = canvas(2 if tuning.tests else 1)
    ratios, ranges = [r.ratio for r in tuning.ranges], tuning.ranges
    curves = [
        ("tuning trials", (("box", [r.tune for r in ranges]), ("each left out, box", [r.left_out for r in ranges]),
                           ("soft", [r.soft_tune for r in ranges]),
                           ("each left out, soft", [r.soft_left_out for r in ranges])), tuning.untuned_tune),
        ("test trials", (("box", [r.test for r in ranges]), ("soft", [r.soft_test for r in ranges])),
         tuning.untuned_test),
    ]  # fmt: skip
    styles = {"box": 0, "soft": 1, "each left out, box": 2, "each left out, soft": 3}
    for ax, (title, losses_of, untuned) in zip(axes, curves, strict=False):
        for label, losses in losses_of:
            colour, dashes, mark = figures.LINES[styles[label]]
            total = [sum(loss.values()) for loss in losses]
            ax.plot(ratios, total, color=colour, ls=dashes, marker=mark, ms=5, lw=1.4, label=label)
        ax.axhline(sum(untuned.values()), color=figures.GREY, ls=figures.BASELINE[1], lw=1.2, label="untuned")
        ax.axvline(tuning.best.ratio, color=figures.ORANGE, alpha=0.35, lw=6, zorder=0.5)
        ax.set(yscale="log", ylabel=f"J, {title}")
        ax.legend("beside")
    axes[-1].set_xticks(ratios, [f"{r:g}" for r in ratios])
    axes[-1].set_xlabel("range a_r (the chosen one shaded)")
    return svg(drawn, "objectives")


def positions(ranges: Sequence[Range]) -> str:
    """Place of each parameter in its range, -1 to +1 (Suyama 2023 Fig. 7); filled marks are at an end."""
    drawn, (ax,) = canvas(1, (5.2, 0.42 * len(ranges[0].free) + 1.2))
    paths = [f.path for f in ranges[0].free]
    for k, r in enumerate(ranges):
        colour, _, mark = figures.LINES[k % len(figures.LINES)]
        rows = np.arange(len(paths)) + 0.6 * ((k + 0.5) / len(ranges) - 0.5)
        stuck = np.array([path in r.at_bound for path in paths])
        for filled in (True, False):
            some = stuck == filled
            ax.plot(r.position[some], rows[some], mark, color=colour, ms=6, mfc=colour if filled else "white",
                    ls="none", label=f"a_r {r.ratio:g}" if not filled else None)  # fmt: skip
    for end in (-1.0, 1.0):
        ax.axvline(end, color="#555", lw=1.0)
    ax.axvline(0.0, color=figures.RULE, lw=1.0)
    for edge in range(1, len(paths)):
        ax.axhline(edge - 0.5, color=figures.GRID, lw=0.8)
    ax.grid_shown = False
    ax.set_xlim((-1.05, 1.05))
    figures.rows_of(drawn, ax, paths, "place in the range (filled: at its end)", 5)
    return svg(drawn, "positions")


def tracks(measured: Trial, predicted: Mapping[str, Trial]) -> str:
    """North over east at equal scale: measured, untuned and each range (Suyama 2023 Figs. 8 to 11, left)."""
    drawn, (ax,) = canvas(1)
    for label, (colour, dashes) in figures.line_styles(list(predicted), UNTUNED).items():
        if label in predicted:
            ax.plot(predicted[label]["y"], predicted[label]["x"], color=colour, ls=dashes, lw=1.3, label=label)
    figures.measured_track(ax, measured)
    ax.set_aspect("equal", adjustable="datalim")
    ax.legend("beside")
    return svg(drawn, f"tracks {measured.name}")


def motions(measured: Trial, predicted: Mapping[str, Trial]) -> str:
    """Heading, speeds, rate of turn and controls over time (Suyama 2023 Figs. 8 to 11, right)."""
    drawn, axes = figures.motion_canvas(measured)
    styles = figures.line_styles(list(predicted), UNTUNED)
    for ax, (channel, label, factor) in zip(axes, figures.MOTION, strict=False):
        for name, trial in predicted.items():
            colour, dashes = styles[name]
            ax.plot(trial.t, factor * trial[channel], color=colour, ls=dashes, lw=1.3)
        figures.measured_motion(ax, measured, channel, factor)
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time t [s]")
    return svg(drawn, f"motions {measured.name}")

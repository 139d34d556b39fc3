"""The sections of a report page.  Angles in degrees, all else in SI."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..identify import Fit
from . import Comparison, figures
from .caveats import caveats
from .comparison import CONSTANT_VELOCITY
from .metrics import scale_words
from .page import bullets, figure, number, page, table, text
from .report import Report
from .verdict import against, sentence

_UNITS = {"x": "m", "y": "m", "psi": "°", "u": "m/s", "v_m": "m/s", "r": "°/s"}
_DEGREES = math.degrees(1.0)
_GROWTH = (
    ("position error, RMS [m]", ("x", "y"), 1.0),
    ("heading error, RMS [°]", ("psi",), _DEGREES),
)
# Beyond these the page shows the worst trials only, and folds the long table; the JSON has all.
_DRAWN = 12
_LONG = 120

_OPEN = 1e9
"""An interval this wide bounds nothing."""


def document(report: Report) -> str:
    """The whole page."""
    styles = figures.line_styles(report.labels, CONSTANT_VELOCITY)
    parts = [
        _verdict(report),
        _trial_table(report),
        _horizons(report, styles),
        _forecasts(report),
        _trials(report, styles),
        _channels(report),
        _indices(report),
        _fit(report.fit) if report.fit else "",
        _assumptions(report),
        f"<h2>Findings in the data</h2>{bullets(report.findings)}" if report.findings else "",
        _provenance(report.provenance),
    ]
    return page(report.title, "".join(parts))


def _verdict(report: Report) -> str:
    errors = report.pooled
    tiles = "".join(
        f'<div class="tile{" main" if i == 0 else ""}"><b>{number(errors[label])}</b>'
        f"<span>{text(label)}</span></div>"
        for i, label in enumerate(report.labels)
    )
    limits = f'<div class="note"><strong>What this does not show</strong>{bullets(caveats(report))}</div>'
    return (
        f'<h1>{text(report.title)}</h1><p class="lead">{text(sentence(report))}</p>{bullets(against(report))}'
        f'<div class="tiles">{tiles}</div><p class="soft">Standardised mean squared error, summed over the '
        "states and pooled over the trials by samples (Wakita 2022, Eq. 25); 0 is perfect, less is better."
        f"{_scale(report)}</p>{limits}"
    )


def _scale(report: Report) -> str:
    found = {scale_words(c.sigma) for c in report.comparisons}
    return f" Errors divided by: {text(found.pop())}." if len(found) == 1 else ""


def _trial_table(report: Report) -> str:
    rows = []
    for name, found in report.trials.items():
        any_one = next(iter(found.values()))
        best = min(c.standardised for c in found.values())
        cells = [
            ("*" if len(found) > 1 and found[n].standardised == best else "") + number(found[n].standardised)
            if n in found
            else "–"
            for n in report.labels
        ]
        seen = "fitted" if name in report.trained_on else ("unseen" if report.trained_on else "not known")
        kind = str(any_one.measured.meta.get("kind", "–"))
        rows.append([name, kind, seen, f"{any_one.measured.duration:.0f}", str(any_one.samples), *cells])
    head = ["trial", "kind", "in the fit", "length [s]", "samples", *report.labels]
    return f"<h2>Standardised error by trial</h2>{table(head, rows, words=(1, 2))}"


def _horizons(report: Report, styles: figures.Styles) -> str:
    drawings = []
    for what, channels, factor in _GROWTH:
        curves = {label: _pooled_horizon(report, label, channels, factor) for label in report.labels}
        curves = {label: points for label, points in curves.items() if any(v > 0 for v in points.values())}
        if curves:
            drawing = figures.horizon(curves, styles, what)
            drawings.append(figure(drawing, f"{what} against the time since the restart"))
    if not drawings:
        return ""
    return f'<h2>How the error grows</h2><div class="figures">{"".join(drawings)}</div>'


def _pooled_horizon(report: Report, label: str, channels: Sequence[str], factor: float) -> dict[float, float]:
    """Root of the mean square over the trials that every label predicts, by horizon."""
    shared = [found[label] for found in report.trials.values() if len(found) == len(report.labels)]
    squares: dict[float, list[float]] = {}
    for c in shared:
        for end, values in c.horizons.items():
            parts = [values.get(name, math.nan) ** 2 for name in channels]
            if math.isfinite(sum(parts)):
                squares.setdefault(end, []).append(sum(parts))
    return {end: factor * math.sqrt(float(np.mean(values))) for end, values in squares.items()}


def _forecasts(report: Report) -> str:
    """What a filter that runs through the raw log foresees with each model."""
    if not report.forecasts:
        return ""
    rows = [
        [f.trial, f.label, f"{f.horizon:g}", str(f.count),
         number(f.position), number(_DEGREES * f.heading), number(f.end)]
        for f in sorted(report.forecasts, key=lambda f: (f.trial, f.horizon))
    ]  # fmt: skip
    head = ["trial", "label", "horizon [s]", "forecasts", "position [m]", "heading [°]", "position at the end [m]"]
    note = (
        "Root mean square errors against raw fixes and compass. Each forecast begins at what a filter with this model "
        "knew then, holds the disturbances found so far, and takes the controls as logged: in a closed loop these "
        "answer to what came, so all but constant velocity are a little too good."
    )
    return f'<h2>Forecasts</h2>{table(head, rows, words=(1,))}<p class="soft">{note}</p>'


def _assumptions(report: Report) -> str:
    rows = [[a.path, number(a.value, 4), a.unit, a.why] for a in report.assumptions]
    note = "Neither measured nor fitted; in the words of the ship file. What is fitted is right only if these are."
    head = ["number", "value", "unit", "assumed"]
    return f'<h2>Assumptions</h2>{table(head, rows, words=(2, 3))}<p class="soft">{note}</p>' if rows else ""


def _trials(report: Report, styles: figures.Styles) -> str:
    parts = ["<h2>Trials</h2>"] if report.comparisons else []
    drawn = report.trials
    if len(drawn) > _DRAWN:
        drawn = dict(sorted(drawn.items(), key=lambda item: -_first(report, item[1]).standardised)[:_DRAWN])
        worst = f"The {_DRAWN} of {len(report.trials)} trials with the largest error, worst first."
        parts.append(f"<p>{worst}</p>")
    for name, found in drawn.items():
        several = list(found.values())
        drawings: list[str] = []
        if all({"x", "y", "psi"} <= set(c.metrics) for c in several):
            caption = "Track, north up; ticks show the measured heading, the circle the start"
            drawings.append(figure(figures.track(several, styles, name), caption))
        caption = "Heading, speeds and rate of turn over time; colours as beside"
        drawings.append(figure(figures.series(several, styles, name), caption))
        parts.append(f'<h3>{text(name)}</h3><div class="figures">{"".join(drawings)}</div>')
    return "".join(parts)


def _first(report: Report, found: Mapping[str, Comparison]) -> Comparison:
    """The comparison of the foremost label a trial has."""
    return next(found[label] for label in report.labels if label in found)


def _channels(report: Report) -> str:
    rows = [
        [name, label, channel, _UNITS.get(channel, ""), *_of_channel(c, channel)]
        for name, found in report.trials.items()
        for label, c in found.items()
        for channel in c.metrics
    ]
    head = ["trial", "label", "state", "unit", "RMSE", "bias", "R²", "FVU", "samples"]
    note = '<p class="soft">R² = 1 − SSE/SST about the measured mean; FVU = var(error)/var(measured).</p>'
    full = table(head, rows, words=(1, 2, 3))
    if len(rows) > _LONG:
        full = f"<details><summary>{len(rows)} rows</summary>{full}</details>"
    return f"<h2>Error by state</h2>{note}{full}" if rows else ""


def _of_channel(c: Comparison, channel: str) -> list[str]:
    m = c.metrics[channel]
    factor = _DEGREES if channel in ("psi", "r") else 1.0
    return [number(factor * m.rmse), number(factor * m.bias), number(m.r2), number(m.fvu), str(m.samples)]


def _indices(report: Report) -> str:
    rows: list[list[str]] = []
    for c in report.comparisons:
        for name, (measured, predicted) in c.indices.items():
            unit = c.index_units.get(name, "")
            factor, unit = (_DEGREES, "°") if unit == "rad" else (1.0, unit)
            share = 100.0 * (predicted - measured) / abs(measured) if measured else math.nan
            values = [number(factor * value) for value in (measured, predicted, predicted - measured)]
            rows.append([c.measured.name, c.label, name.replace("_", " "), unit, *values, number(share, 2)])
    head = ["trial", "label", "index", "unit", "measured", "predicted", "error", "error [%]"]
    return f"<h2>Manoeuvre indices</h2>{table(head, rows, words=(1, 2, 3))}" if rows else ""


def _fit(fit: Fit) -> str:
    status = {v.subject: v.status for v in fit.verdicts}
    rows = [
        [
            free.path, number(free.start, 4), number(float(fit.values[i]), 4), number(float(fit.sigma[i]), 2),
            f"{number(free.low)} … {number(free.high)}" if free.high - free.low < _OPEN else "–",
            "yes" if free.path in fit.at_bound else "", number(float(fit.shrinkage[i]), 2),
            status.get(free.path, "–"),
        ]
        for i, free in enumerate(fit.free)
    ]  # fmt: skip
    head = ["parameter", "start", "fitted", "sigma", "bounds", "at bound", "shrinkage", "verdict"]
    words = bullets(f"{v.subject}: {v.text}" for v in fit.verdicts if v.status != "identified")
    loss = number(fit.objective, 4)
    cost = f"{fit.status}; {number(fit.seconds)} s, {fit.evaluations} evaluations, loss {loss}."
    drawing = ""
    if len(fit.history) > 1:
        drawing = figure(figures.convergence(fit.history), "Loss over the iterations")
    note = "Shrinkage: what the data added to the prior, 0 nothing, 1 all. Sigma: posterior deviation."
    return (
        f"<h2>The fit of {text(fit.ship.name)}</h2><p>{text(cost)}</p>{table(head, rows, words=(7,))}"
        f'<p class="soft">{note}</p>{words}{along(fit)}<div class="figures">{drawing}</div>'
    )


def along(fit: Fit) -> str:
    """Table of what each trial had of its own; empty where nothing was estimated along."""
    names = list(dict.fromkeys(name for own in fit.nuisances.values() for name in own))
    if not names:
        return ""
    rows = [[trial, *(number(own[name], 3) if name in own else "–" for name in names)]
            for trial, own in fit.nuisances.items()]  # fmt: skip
    note = "SI units, currents towards north (x) and east (y); a bias is what the sensor reads beyond the truth."
    return f'<h3>Estimated along</h3>{table(["trial", *names], rows)}<p class="soft">{note}</p>'


def _provenance(entries: Mapping[str, str]) -> str:
    lines = "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in entries.items())
    return f"<h2>Provenance</h2><dl>{lines}</dl>" if entries else ""

"""Report of a fit or a validation: comparisons, baselines and a fit on one page, and the same numbers as JSON.

The page has angles in degrees, all else in SI units; the JSON has SI units and radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.values import dataclass
from ..identify import Fit
from ..identify.filters import CONSTANT_VELOCITY
from ..models import STATES
from ..validate import Comparison
from ..validate.metrics import scale_words
from . import diagnosis, figures
from .answer import answer
from .blocks import (
    Body,
    bullets,
    entries,
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
from .canvas.frame import label, whole
from .evidence import PUBLISHED, TIE, Evidence, caveats
from .judging import fitness
from .page import Page, ReportError, Section, plain, write

if TYPE_CHECKING:
    from ..belief.sampling.sampled import Sampled
    from .judging.fans import BandsHeld

__all__ = ["PUBLISHED", "Report", "ReportError"]

_UNITS = {"x": "m", "y": "m", "psi": "°", "u": "m/s", "v_m": "m/s", "r": "°/s", "phi": "°", "p": "°/s"}
_DEGREES = math.degrees(1.0)
_GROWTH = (
    ("position error, RMS [m]", ("x", "y"), 1.0),
    ("heading error, RMS [°]", ("psi",), _DEGREES),
)
# Beyond these the page shows the worst trials only, and folds the long table; the JSON has all.
_DRAWN = 12
_LONG = 120

_OPEN = 1e9
"""An interval wider than this is unbounded."""


def sections(report: Evidence) -> tuple[Section, ...]:
    """All sections, in the order to show."""
    styles = figures.line_styles(report.labels, CONSTANT_VELOCITY)
    first = answer(report)
    return (
        Section("", first.body if first else _head(report)),
        Section("Growth of the error", _horizons(report, styles)),
        fitness.section(report.fitness) if report.fitness else Section("", ()),
        Section("Errors", _head(report) if first else ()),
        Section("Standardised error by trial", _trial_table(report)),
        _bands(report.bands) if report.bands else Section("", ()),
        Section("Forecasts", _forecasts(report)),
        Section("Trials", _trials(report, styles)),
        Section("Error by state", _channels(report)),
        Section("Manoeuvre indices", _indices(report)),
        Section(f"Fit of {report.fit.ship.name}", _fit(report.fit)) if report.fit else Section("", ()),
        posterior(report.drawn) if report.drawn else Section("", ()),
        Section("Residuals of the fit", (diagnosis.verdict(report.fit) + diagnosis.section(report.fit))
                if report.fit else ()),
        Section("Assumptions", _assumptions(report)),
        Section("Findings in the data", bullets(report.findings) if report.findings else ()),
        Section("Provenance", entries(report.provenance)),
    )


def _head(report: Evidence) -> Body:
    errors = report.pooled
    remark = (
        "Standardised mean squared error, summed over the states and pooled over the trials by samples (Wakita 2022, "
        f"Eq. 25); 0 is perfect, less is better.{_scale(report)}"
    )
    return (
        note("", worse_words(report)) + lead(sentence(report)) + bullets((*against(report), *report.changes))
        + tiles((number(errors[label]), label) for label in report.labels)
        + soft(remark) + note("What this does not show", caveats(report))
    )


def _scale(report: Evidence) -> str:
    found = {scale_words(c.sigma) for c in report.comparisons}
    return f" Errors divided by: {found.pop()}." if len(found) == 1 else ""


def _trial_table(report: Evidence) -> Body:
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
    return table(head, rows, words=(1, 2))


def _horizons(report: Evidence, styles: figures.Styles) -> Body:
    drawings = []
    for what, channels, factor in _GROWTH:
        curves = {label: _pooled_horizon(report, label, channels, factor) for label in report.labels}
        curves = {label: points for label, points in curves.items() if any(v > 0 for v in points.values())}
        if curves:
            drawing = figures.horizon(curves, styles, what)
            drawings.append(figure(drawing, f"{what} against the time since the restart"))
    return gallery(*drawings)


def _pooled_horizon(report: Evidence, label: str, channels: Sequence[str], factor: float) -> dict[float, float]:
    """Root of the mean square over the trials that every label predicts, by horizon."""
    shared = [found[label] for found in report.trials.values() if len(found) == len(report.labels)]
    squares: dict[float, list[float]] = {}
    for c in shared:
        for end, values in c.horizons.items():
            parts = [values.get(name, math.nan) ** 2 for name in channels]
            if math.isfinite(sum(parts)):
                squares.setdefault(end, []).append(sum(parts))
    return {end: factor * math.sqrt(float(np.mean(values))) for end, values in squares.items()}


def _forecasts(report: Evidence) -> Body:
    """Errors of forecasts by a filter on the raw log with each model."""
    if not report.forecasts:
        return ()
    rows = [
        [f.trial, f.label, f"{f.horizon:g}", str(f.count),
         number(f.position), number(_DEGREES * f.heading), number(f.end)]
        for f in sorted(report.forecasts, key=lambda f: (f.trial, f.horizon))
    ]  # fmt: skip
    head = ["trial", "label", "horizon [s]", "forecasts", "position [m]", "heading [°]", "position at the end [m]"]
    remark = (
        "Root mean square errors against raw fixes and compass. Each forecast starts from the state that a filter "
        "with this model has then, holds the estimated disturbances and uses the logged controls: in a closed loop the "
        "controls react to later motion, so all errors but those of constant velocity are slightly too small."
    )
    return table(head, rows, words=(1,)) + soft(remark)


def _assumptions(report: Evidence) -> Body:
    rows = [[a.path, number(a.value, 4), a.unit, a.why] for a in report.assumptions]
    remark = "Neither measured nor fitted; wording of the ship file. The fitted values are right only if these are."
    head = ["number", "value", "unit", "assumed"]
    return table(head, rows, words=(2, 3)) + soft(remark) if rows else ()


def _trials(report: Evidence, styles: figures.Styles) -> Body:
    parts: list[Body] = []
    drawn = report.trials
    if len(drawn) > _DRAWN:
        drawn = dict(sorted(drawn.items(), key=lambda item: -_first(report, item[1]).standardised)[:_DRAWN])
        worst = f"The {_DRAWN} of {len(report.trials)} trials with the largest error, worst first."
        parts.append(line(worst))
    for name, found in drawn.items():
        several = list(found.values())
        drawings: list[Body] = []
        if all({"x", "y", "psi"} <= set(c.metrics) for c in several):
            caption = "Track, north up; ticks show the measured heading, the circle the start"
            drawings.append(figure(figures.track(several, styles, name), caption))
        caption = "Heading, speeds, rate of turn and controls over time; colours as beside"
        drawings.append(figure(figures.series(several, styles, name), caption))
        parts.append(heading(name) + gallery(*drawings))
    return joined(parts)


def _first(report: Evidence, found: Mapping[str, Comparison]) -> Comparison:
    """The comparison of the foremost label a trial has."""
    return next(found[label] for label in report.labels if label in found)


def _channels(report: Evidence) -> Body:
    rows = [
        [name, label, channel, _UNITS.get(channel, ""), *_of_channel(c, channel)]
        for name, found in report.trials.items()
        for label, c in found.items()
        for channel in c.metrics
    ]
    head = ["trial", "label", "state", "unit", "RMSE", "bias", "R²", "FVU", "samples"]
    remark = soft("R² = 1 − SSE/SST about the measured mean; FVU = var(error)/var(measured).")
    return remark + table(head, rows, words=(1, 2, 3), folded=len(rows) > _LONG) if rows else ()


def _of_channel(c: Comparison, channel: str) -> list[str]:
    m = c.metrics[channel]
    factor = _DEGREES if _UNITS.get(channel, "").startswith("°") else 1.0
    return [number(factor * m.rmse), number(factor * m.bias), number(m.r2), number(m.fvu), str(m.samples)]


def _indices(report: Evidence) -> Body:
    rows: list[list[str]] = []
    for c in report.comparisons:
        for name, (measured, predicted) in c.indices.items():
            unit = c.index_units.get(name, "")
            factor, unit = (_DEGREES, "°") if unit == "rad" else (1.0, unit)
            share = 100.0 * (predicted - measured) / abs(measured) if measured else math.nan
            values = [number(factor * value) for value in (measured, predicted, predicted - measured)]
            rows.append([c.measured.name, c.label, name.replace("_", " "), unit, *values, number(share, 2)])
    head = ["trial", "label", "index", "unit", "measured", "predicted", "error", "error [%]"]
    return table(head, rows, words=(1, 2, 3)) if rows else ()


def _fit(fit: Fit) -> Body:
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
    drawing: Body = ()
    if len(fit.history) > 1:
        drawing = figure(figures.convergence(fit.history), "Loss over the iterations")
    remark = "Shrinkage: information of the data relative to the prior, 0 none, 1 all. Sigma: posterior deviation."
    return line(cost) + table(head, rows, words=(5, 7)) + soft(remark) + words + along(fit) + gallery(drawing)


def along(fit: Fit) -> Body:
    """Nuisance parameters of each trial; empty if none were estimated."""
    names = list(dict.fromkeys(name for own in fit.nuisances.values() for name in own))
    if not names:
        return ()
    rows = [[trial, *(number(own[name], 3) if name in own else "–" for name in names)]
            for trial, own in fit.nuisances.items()]  # fmt: skip
    remark = "SI units, currents towards north (x) and east (y); a bias is the reading of the sensor less the truth."
    return heading("Nuisance parameters of each trial") + table(["trial", *names], rows) + soft(remark)


# Labels of the ship that a fit began from.
_BEFORE = ("untuned", PUBLISHED)
_GROUPS = {"position": ("x", "y"), "heading": ("psi",)}


def sentence(report: Evidence) -> str:
    """Standardised errors of all labels, and the shortest forecasts."""
    if not report.comparisons:
        return "Nothing was compared."
    errors = report.pooled
    shared = sum(len(found) == len(report.labels) for found in report.trials.values())
    restarts = {c.restart for c in report.comparisons}
    every = " or ".join(f"{r:g}" for r in sorted(r for r in restarts if r is not None))
    how = f"reset to the measured state every {every} s"
    if None in restarts:
        free = "free-running from the first sample"
        how = free if len(restarts) == 1 else f"{how} or {free}"
    if report.fit_first is not None:
        how = how.replace("the first sample", "there")
        how = f"after the first {report.fit_first:g} s, on which the start was estimated, {how}"
    scores = ", ".join(f"'{label}' {number(errors[label])}" for label in report.labels)
    return f"Standardised error over {shared} trial{'s' * (shared != 1)}, {how}: {scores}.{_foreseen(report)}"


def against(report: Evidence) -> list[str]:
    """For each other label: in how many trials the subject is better, and where its error is greater."""
    subject, found = report.labels[0] if report.labels else "", list[str]()
    for other in report.labels[1:]:
        both = [f for f in report.trials.values() if subject in f and other in f]
        wins = sum(f[subject].standardised < f[other].standardised for f in both)
        lost = worse(report, other)
        said = f"'{subject}' against '{other}': smaller standardised error in {wins} of {len(both)}"
        found.append(f"{said}, but greater error of {'; of '.join(lost)}" if lost else said)
    return found


def worse_than_start(report: Evidence) -> dict[str, float] | None:
    """Pooled standardised errors of the fitted ship and of that before the fit, where the fitted one's is larger.

    None where it is not, by more than a tie of 2 %, and where they were not both compared.
    """
    errors = report.pooled
    mine = errors.get("fitted", math.nan)
    before = next((errors[label] for label in _BEFORE if label in errors), math.nan)
    return {"fitted": mine, "untuned": before} if _more(mine, before) else None


def worse_words(report: Evidence) -> tuple[str, ...]:
    """The same in words, for the first line of a summary; empty where it is not worse."""
    found = worse_than_start(report)
    if found is None:
        return ()
    seen = report.trained_on and all(name in report.trained_on for name in report.trials)
    which = "the training trials" if seen else "these trials"
    mine, before = (number(found[label]) for label in ("fitted", "untuned"))
    return (f"worse than untuned: standardised error {mine} against {before} before the fit, on {which}",)


def worse(report: Evidence, other: str) -> list[str]:
    """Where the subject has the greater error: position and heading by time since the restart, then each state."""
    subject = report.labels[0]
    both = [(f[subject], f[other]) for f in report.trials.values() if subject in f and other in f]
    found: list[str] = []
    for what, channels in _GROUPS.items():
        ends = [
            end
            for end in sorted({e for mine, _ in both for e in mine.horizons})
            if _more(_grown((a for a, _ in both), end, channels), _grown((b for _, b in both), end, channels))
        ]
        if ends:
            found.append(f"{what} after {', '.join(f'{end:g}' for end in ends)} s")
    for name in STATES:
        mine, yours = (_rms((pair[k] for pair in both), name) for k in (0, 1))
        if _more(mine, yours):
            factor = _DEGREES if name in ("psi", "r") else 1.0
            unit = " " * (not _UNITS[name].startswith("°")) + _UNITS[name]
            found.append(f"{name} ({number(factor * mine)}{unit} against {number(factor * yours)}{unit})")
    return found


def _more(mine: float, yours: float) -> bool:
    return mine > (1.0 + TIE) * yours


def _grown(comparisons: Iterable[Comparison], end: float, channels: tuple[str, ...]) -> float:
    """Root mean square at one time since the restart; not a number where no comparison has it."""
    squares = [sum(c.horizons[end].get(n, math.nan) ** 2 for n in channels) for c in comparisons if end in c.horizons]
    squares = [value for value in squares if math.isfinite(value)]
    return math.sqrt(float(np.mean(squares))) if squares else math.nan


def _rms(comparisons: Iterable[Comparison], name: str) -> float:
    """Root mean square error of a state over the trials, by samples."""
    parts = [(c.metrics[name].rmse, c.metrics[name].samples) for c in comparisons if name in c.metrics]
    count = sum(n for _, n in parts)
    return math.sqrt(sum(n * e * e for e, n in parts) / count) if count else math.nan


def _foreseen(report: Evidence) -> str:
    """The shortest forecasts in one sentence."""
    if not report.forecasts:
        return ""
    first = min(f.horizon for f in report.forecasts)
    rows = [f for f in report.forecasts if f.horizon == first]
    parts: list[str] = []
    for origin in dict.fromkeys(f.label for f in rows):
        own = [f for f in rows if f.label == origin]
        count = sum(f.count for f in own)
        place, turn = (math.sqrt(sum(f.count * e * e for f, e in zip(own, errors, strict=True)) / count)
                       for errors in ([f.position for f in own], [f.heading for f in own]))  # fmt: skip
        parts.append(f"'{origin}' {number(place, 2)} m and {number(_DEGREES * turn, 2)}°")
    return f" Forecasts over {first:g} s, started from the filtered state: {', '.join(parts)}."


@dataclass(frozen=True)
class Report(Evidence):
    """What was compared, with what and on what grounds, as a page with its numbers; attributes as in `Evidence`."""

    @property
    def page(self) -> Page:
        """The sections and the numbers."""
        return Page(self.title, (Section("", fields(self.numbers())), *sections(self)))

    def write(self, path: str | Path) -> Path:
        """Write the page and the numbers beside it as .json, both or neither; returns the path; see `page.write`."""
        return write(path, self.page)

    def numbers(self) -> dict[str, Any]:
        """The numbers of the page, SI units and radians."""
        first = answer(self)
        return plain({
            "schema": "seatrial-report/1", "title": self.title, **({"answer": vars(first)} if first else {}),
            "summary": sentence(self), "standardised": self.pooled,
            "worse_than_untuned": worse_than_start(self), "fit_first": self.fit_first, "changes": self.changes,
            "worse": {other: worse(self, other) for other in self.labels[1:]}, "forecasts": self.forecasts,
            "assumptions": self.assumptions,
            "trials": {name: {label: _of_comparison(c) for label, c in found.items()}
                       for name, found in self.trials.items()},
            "fit": _of_fit(self.fit) if self.fit else None, "trained_on": self.trained_on, "findings": self.findings,
            "caveats": caveats(self), "provenance": self.provenance,
            **({"fitness": fitness.numbers(self.fitness)} if self.fitness else {}),
            **({"posterior": self.drawn.numbers()} if self.drawn else {}),
            **({"bands": _of_bands(self.bands)} if self.bands else {}),
        })  # fmt: skip


def _of_bands(found: BandsHeld) -> Mapping[str, Any]:
    from .judging.fans import numbers

    return numbers(found)


def _of_comparison(c: Comparison) -> dict[str, Any]:
    return {
        "standardised": c.standardised, "samples": c.samples, "restart": c.restart, "sigma": c.sigma,
        "metrics": c.metrics, "horizons": {f"{end:g}": values for end, values in c.horizons.items()},
        "indices": {name: {"measured": a, "predicted": b, "unit": c.index_units.get(name, "")}
                    for name, (a, b) in c.indices.items()},
    }  # fmt: skip


def _of_fit(fit: Fit) -> dict[str, Any]:
    return {
        "ship": fit.ship.name,
        "parameters": {
            free.path: {"start": free.start, "value": fit.values[i], "sigma": fit.sigma[i], "low": free.low,
                        "high": free.high, "shrinkage": fit.shrinkage[i], "at_bound": free.path in fit.at_bound}
            for i, free in enumerate(fit.free)
        },
        "verdicts": fit.verdicts, "objective": fit.objective, "seconds": fit.seconds, "evaluations": fit.evaluations,
        "status": fit.status, "digest": fit.digest,
    }  # fmt: skip


_WIDTH, _HEIGHT, _LEFT, _TOP, _FLOOR = 300.0, 150.0, 12.0, 8.0, 124.0
_BINS, _MARGINALS = 36, 24
_FILL, _LINE = "#8fb3d9", "#b3541e"


def _bands(found: BandsHeld) -> Section:
    from .judging.fans import section  # what draws bands is loaded where there are some

    return section(found)


def posterior(found: Sampled) -> Section:
    """What the draws say, the marginals that differ most from Laplace's, and all of them as a table."""
    words = found.words
    order = np.argsort(-(np.abs(found.shift) + np.abs(np.log(found.ratio))))[:_MARGINALS]
    rows = [
        [path, number(found.best[k], 4), number(found.mean[k], 4), number(found.sigma[k], 2),
         f"{number(found.interval[0, k])} … {number(found.interval[1, k])}", number(found.shift[k], 2),
         number(found.ratio[k], 3), f"{found.rhat[k]:.3f}", f"{found.effective[k]:.0f}"]
        for k, path in enumerate(found.paths)
    ]  # fmt: skip
    head = ["parameter", "best", "mean", "sigma", "95 %", "shift [Laplace sigmas]", "sigma over Laplace's", "R-hat",
            "effective draws"]  # fmt: skip
    remark = (
        "Bars: draws; line: Laplace's approximation about the best values; SI units. "
        f"{found.calls} evaluations of each of {found.draws.shape[1]} chains, {number(found.seconds)} s of CPU time; "
        f"squared residuals are divided by {number(found.variance)}."
    )
    drawings = [figure(_marginal(found, int(k)), found.paths[k]) for k in order]
    shown = f"The {_MARGINALS} parameters that differ most. " if len(found.paths) > _MARGINALS else ""
    body = lead(words[0]) + bullets(words[1:]) + gallery(*drawings, least=280) + soft(shown + remark)
    return Section("Posterior, sampled", body + table(head, rows))


def _marginal(found: Sampled, k: int) -> str:
    """One marginal: histogram of the draws, and Laplace's Gaussian, cut at the bounds as the draws are."""
    values, best = found.flat[:, k], float(found.best[k])
    sd = float(np.sqrt(found.laplace[k, k]))
    low = max(min(float(values.min()), best - 3.0 * sd), found.free[k].low)
    high = min(max(float(values.max()), best + 3.0 * sd), found.free[k].high)
    density, edges = np.histogram(values, _BINS, (low, high), density=True)
    x = np.linspace(low, high, 120)
    bell = np.exp(-0.5 * ((x - best) / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi))
    across = (_WIDTH - 2 * _LEFT) / (high - low)
    up = (_FLOOR - _TOP) / max(float(density.max()), float(bell.max()))
    parts = [
        f'<rect x="{_LEFT + (edges[i] - low) * across:.1f}" y="{_FLOOR - d * up:.1f}" '
        f'width="{(edges[i + 1] - edges[i]) * across:.1f}" height="{d * up:.1f}" fill="{_FILL}"/>'
        for i, d in enumerate(density) if d > 0
    ]  # fmt: skip
    line = " ".join(f"{_LEFT + (a - low) * across:.1f},{_FLOOR - b * up:.1f}" for a, b in zip(x, bell, strict=True))
    parts += [
        f'<polyline points="{line}" fill="none" stroke="{_LINE}" stroke-width="1.6"/>',
        f'<line x1="{_LEFT}" y1="{_FLOOR}" x2="{_WIDTH - _LEFT}" y2="{_FLOOR}" stroke="#888"/>',
        label(_LEFT, _HEIGHT - 8, number(low), "#555"),
        label(_WIDTH - _LEFT, _HEIGHT - 8, number(high), "#555", anchor="end"),
    ]
    return whole(_WIDTH, _HEIGHT, parts)

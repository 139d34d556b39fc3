"""Report of a campaign: criteria with probabilities, distributions, sensitivities, and runs to look at.

The page has angles in degrees, all else in SI units; the JSON has SI units and radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...campaign.analysis import Analysis, Extreme, Figure
from ...campaign.analysis.proportion import runs_to_exclude
from ...campaign.analysis.sensitivity import Sensitivity
from ...campaign.analysis.spread import Histogram
from ..blocks import Body, bullets, entries, fields, figure, gallery, lead, line, note, number, soft, table, tiles
from ..canvas.frame import Frame, label, whole
from ..figures import BLUE, GRID, INK, LINES, SOFT, VERMILION
from ..page import Page, Section
from .shown import Unit, Units, bound, share, unit, worded

SCHEMA = "seatrial-campaign-report/1"

_CHARTS = 4
"""Cases whose sensitivities are drawn; the JSON has all."""

_PRINTED = (0.05, 0.5, 0.95)

_CUT = 0.01
"""Share of runs without an index from which its distribution is that of a selection."""


def page(analysis: Analysis, units: Mapping[str, str], provenance: Mapping[str, str]) -> Page:
    """The whole page.

    Args:
        units: SI unit of each index.
        provenance: campaign file, version and the like.
    """
    printed = {name: Unit.of(si) for name, si in units.items()}
    about = analysis.held.manifest
    document: dict[str, Any] = {
        "schema": SCHEMA, "name": about.name, "design": about.design, "rows": analysis.rows,
        "of": about.rows, "cases": analysis.cases, "units": dict(units), "figures": analysis.figures,
        "histograms": analysis.histograms, "provenance": dict(provenance), "lost": analysis.lost,
        "criteria": [{**vars(one), "probability": one.violated.value, "interval": one.violated.interval,
                      "runs_for_10_percent": one.violated.needed()} for one in analysis.judged],
    }  # fmt: skip
    parts = (
        Section("", fields(document, _head(analysis))),
        Section("Criteria", _criteria(analysis, printed)),
        Section("Distributions", _distributions(analysis, printed)),
        Section("Which inputs matter", _sensitivities(analysis, printed)),
        Section("Worst runs", _worst(analysis, printed)),
        Section("Failed and incomplete runs", _lost(analysis)),
        Section("Provenance", entries(provenance)),
    )
    return Page(f"Campaign: {about.name}", parts)


def _head(analysis: Analysis) -> Body:
    about, several = analysis.held.manifest, len(analysis.cases) > 1
    failed = sum(one.failed.hits for one in analysis.lost)
    shown = [(f"{analysis.rows:,}".replace(",", " "), f"runs of {len(analysis.cases)} case{'s' * several}"),
             (str(failed), "failed")]  # fmt: skip
    shown += [(number(one.violated.value), f"violate {worded(one.name)}{_of(analysis, one.case)}")
              for one in analysis.judged[:4]]  # fmt: skip
    said = f"{', '.join(analysis.cases)}; {len(about.inputs)} inputs, design {about.design}."
    return lead(said) + tiles(shown) + note("Read with care", _warnings(analysis))


def _of(analysis: Analysis, case: int) -> str:
    return f" ({analysis.cases[case]})" if len(analysis.cases) > 1 else ""


def _warnings(analysis: Analysis) -> Iterator[str]:
    about = analysis.held.manifest
    if analysis.rows < about.rows:
        yield f"{about.rows - analysis.rows} of {about.rows} runs are not computed yet."
    if about.design == "grid":
        yield "The runs are a grid, no sample: quantiles, probabilities and their intervals describe the grid alone."
    if about.design in ("sobol", "latin-hypercube"):
        yield "The points fill the space more evenly than random ones: the intervals are wider than they need be."
    if about.design == "saltelli":
        yield ("Distributions and probabilities are those of runs A and B of each block; the runs between them share "
               "their inputs.")  # fmt: skip
    dropped = max((one.sensitivity.dropped for one in analysis.figures if one.sensitivity), default=0)
    if dropped and about.design == "saltelli":
        yield (f"Up to {dropped} blocks hold a run that did not reach an index, and are left out of its "
               "sensitivities.")  # fmt: skip
    cut = {worded(one.index) for one in analysis.figures
           if one.spread.missing > _CUT * (one.spread.missing + one.spread.count)}  # fmt: skip
    if cut:
        yield (f"More than {_CUT:.0%} of the runs did not reach: {', '.join(sorted(cut))}. What is shown of these is a "
               "selection of the quicker runs; a longer duration may show all.")  # fmt: skip
    for one in analysis.judged:
        if one.missing:
            yield (f"{one.missing} runs{_of(analysis, one.case)} did not reach the {worded(one.index)}: its criterion "
                   "is judged without them.")  # fmt: skip


def _criteria(analysis: Analysis, units: Units) -> Body:
    rows = [
        [worded(one.name), analysis.cases[one.case], bound(one, units), str(one.violated.runs), str(one.violated.hits),
         share(one.violated), str(one.missing), "> " * (not one.violated.hits) + number(one.violated.needed(), 2)]
        for one in analysis.judged
    ]  # fmt: skip
    if not rows:
        return ()
    head = ["criterion", "case", "bound", "runs", "violate it", "probability (95 %)", "not reached", "runs for ±10 %"]
    remark = ("Intervals of Clopper and Pearson. Runs for ±10 %: how many a 95 % interval of a tenth of the "
              f"probability takes. Without a violation, {runs_to_exclude(1e-3)} runs show a probability below 0.001, "
              f"{number(runs_to_exclude(1e-6), 2)} one below 1e-6; seatrial campaign --rare needs 1e4.")  # fmt: skip
    return table(head, rows, words=(1, 2)) + soft(remark)


def _distributions(analysis: Analysis, units: Units) -> Body:
    drawn: list[Body] = []
    for name, common in analysis.histograms.items():
        edges = [edge for one in analysis.judged if one.index == name for edge in (one.low, one.high)]
        beyond = max(common.beyond)
        caption = worded(name).capitalize() + (f"; {100 * beyond:.2g} % lie beyond" if beyond > 0 else "")
        drawn.append(figure(distribution(common, analysis.cases, unit(units, name), name, edges), caption))
    rows = [_row(one, analysis, units) for one in analysis.figures if one.spread.count]
    head = ["index", "case", "runs", "mean", "std. dev.", "least", *(f"{100 * q:g} %" for q in _PRINTED), "greatest"]
    remark = ("Quantiles of the runs that reached an index, with a 95 % interval that assumes no distribution; the "
              "JSON has more of them. Dashed lines in the figures: bounds of criteria.")  # fmt: skip
    return gallery(*drawn) + table(head, rows, words=(1,)) + soft(remark) if rows else ()


def _row(one: Figure, analysis: Analysis, units: Units) -> list[str]:
    own, found = unit(units, one.index), one.spread
    quantiles = [f"{own.write(q.value)} ({own.write(q.low)} to {own.write(q.high)})"
                 for q in found.quantiles if q.share in _PRINTED]  # fmt: skip
    return [own.label(one.index), analysis.cases[one.case], str(found.count), own.write(found.mean),
            own.write(found.sigma, 3), own.write(found.least), *quantiles, own.write(found.most)]  # fmt: skip


def _sensitivities(analysis: Analysis, units: Units) -> Body:
    found = [(one, one.sensitivity) for one in analysis.figures if one.sensitivity]
    if not found:
        return ()
    drawn = [figure(shares(one), f"{worded(at.index).capitalize()}{_of(analysis, at.case)}: {one.method}")
             for at, one in found if at.case < _CHARTS]  # fmt: skip
    sobol = analysis.held.manifest.design == "saltelli"
    head = ["index", "case", "input", "alone", "±", *(["with interactions", "±"] if sobol else ["rank correlation"])]
    rows = [
        [worded(at.index), analysis.cases[at.case], e.name, number(e.first), number(e.first_error, 2),
         *([number(e.total), number(e.total_error, 2)] if sobol else [number(e.rank)])]
        for at, one in found for e in one.effects
    ]  # fmt: skip
    return soft(_method(sobol)) + gallery(*drawn) + table(head, rows, words=(1, 2), folded=True)


def _method(sobol: bool) -> str:
    if sobol:
        return ("Sobol indices of first and total order (Saltelli 2010, SALib) with bootstrap intervals of 95 %. For "
                "inputs with a joint distribution, each stands for what those before it leave open.")  # fmt: skip
    return ("Share of the variance that an input explains alone, from the runs as they are (correlation ratio over "
            "classes of the input, jackknife intervals of 95 %). Interactions do not show: design = \"saltelli\" gives "
            "Sobol indices of total order. Shares of correlated inputs overlap.")  # fmt: skip


def _worst(analysis: Analysis, units: Units) -> Body:
    rows = [[f"violates or comes nearest to {worded(one.name)}", analysis.cases[one.case],
             *_named(one.worst, unit(units, one.index))] for one in analysis.judged]  # fmt: skip
    for one in analysis.figures:
        for words, runs in (("largest", one.largest), ("smallest", one.smallest)):
            if runs:
                rows.append([f"{words} {unit(units, one.index).label(one.index)}", analysis.cases[one.case],
                             *_named(runs, unit(units, one.index))])  # fmt: skip
    if not rows:
        return ()
    most = max(map(len, rows))
    rows = [[*row, *[""] * (most - len(row))] for row in rows]
    head = ["", "case", "run: value", *[""] * (most - 3)]
    example = next((one.worst[0].run for one in analysis.judged if one.worst), analysis.figures[0].largest[0].run
                   if analysis.figures[0].largest else 0)  # fmt: skip
    return _replay(analysis, example) + table(head, rows, words=(1,))


def _named(runs: tuple[Extreme, ...], own: Unit) -> list[str]:
    return [f"{one.run}: {own.write(one.value)}" for one in runs]


def _replay(analysis: Analysis, run: int) -> Body:
    command = f"seatrial simulate --from {analysis.held.folder} {run} -o run.csv"
    return line("A run is sailed again by its number:", command=command)


def _lost(analysis: Analysis) -> Body:
    lines: list[str] = []
    for one in analysis.lost:
        name = analysis.cases[one.case]
        if one.failed.hits:
            runs = ", ".join(f"{run.run} (after {number(run.value)} s)" for run in one.first_failed)
            lines.append(f"{name}: {one.failed.hits} runs left the validity of the ship or blew up, probability "
                         f"{share(one.failed)}; earliest: {runs}.")  # fmt: skip
        if one.incomplete.hits:
            runs = ", ".join(map(str, one.first_incomplete))
            lines.append(f"{name}: {one.incomplete.hits} runs do not hold all that their indices need"
                         + (f"; first without a failure: {runs}; a longer duration may." if runs else "."))  # fmt: skip
    return bullets(lines or ["No run failed, and each holds all that its indices need."])


_WIDTH, _HEIGHT = 460, 250
_ROW, _LEFT, _BAR = 24, 150, 270
_TICKS = (0.0, 0.25, 0.5, 0.75, 1.0)


def distribution(drawn: Histogram, cases: Sequence[str], unit: Unit, name: str, bounds: Sequence[float]) -> str:
    """Share of the runs in each bar, an outline a case; dashed lines at the bounds of criteria within the range."""
    edges, most = drawn.edges * unit.factor, 100.0 * float(drawn.shares.max())
    frame = Frame(_WIDTH, _HEIGHT, (float(edges[0]), float(edges[-1])), (0.0, 1.12 * most), left=46, bottom=34)
    parts: list[str] = []
    for case, row in enumerate(drawn.shares * 100.0):
        colour, corners = LINES[case % len(LINES)][0], [float(v) for edge in edges for v in (edge, edge)]
        tops = [0.0, *(float(v) for one in row for v in (one, one)), 0.0]
        if len(cases) == 1:
            parts += [frame.span((float(a), float(b)), (0.0, float(v)), colour, 0.25)
                      for a, b, v in zip(edges, edges[1:], row, strict=False) if v]  # fmt: skip
        dash = "" if case < len(LINES) else "4 2"
        parts.append(frame.line(corners, tops, colour, width=1.5, dash=dash))
        if len(cases) > 1:
            parts.append(label(frame.left + frame.width, 18 + 13 * case, cases[case], colour, anchor="end", weight=600))
    for limit in bounds:
        if edges[0] < limit * unit.factor < edges[-1]:
            parts.append(frame.line([limit * unit.factor] * 2, [0.0, 1.12 * most], VERMILION, width=1.5, dash="5 3"))
    return frame.svg(parts, unit.label(name), "runs [%]")


def shares(found: Sensitivity) -> str:
    """First-order shares as filled bars, total ones as outlines, with intervals; from 0 to 1."""
    effects = sorted(found.effects, key=lambda one: -(one.total if math.isfinite(one.total) else one.first))
    low = len(effects) * _ROW + 8
    parts = [f'<line x1="{_x(v):.1f}" x2="{_x(v):.1f}" y1="8" y2="{low}" stroke="{GRID}"/>'
             + label(_x(v), low + 13, f"{v:g}", SOFT, anchor="middle") for v in _TICKS]  # fmt: skip
    for k, one in enumerate(effects):
        top = 8 + k * _ROW
        parts.append(label(_LEFT - 8, top + 15, one.name, INK, anchor="end"))
        parts.append(f'<rect x="{_x(0):.1f}" y="{top + 4}" width="{_x(one.first) - _x(0):.1f}" height="8" '
                     f'fill="{BLUE}"/>')  # fmt: skip
        parts.append(_whisker(one.first, one.first_error, top + 8))
        if math.isfinite(one.total):
            parts.append(f'<rect x="{_x(0):.1f}" y="{top + 13}" width="{_x(one.total) - _x(0):.1f}" height="7" '
                         f'fill="none" stroke="{VERMILION}"/>')  # fmt: skip
            parts.append(_whisker(one.total, one.total_error, top + 16.5))
    words = "share of variance: alone"
    parts.append(label(_LEFT, low + 30, words, BLUE, weight=600))
    if any(math.isfinite(one.total) for one in effects):
        parts.append(label(_LEFT + 160, low + 30, "with interactions", VERMILION, weight=600))
    return whole(_WIDTH, low + 40, parts)


def _x(value: float) -> float:
    return _LEFT + _BAR * min(max(value, 0.0), 1.08)


def _whisker(value: float, error: float, y: float) -> str:
    if not math.isfinite(error):
        return ""
    return f'<line x1="{_x(value - error):.1f}" x2="{_x(value + error):.1f}" y1="{y}" y2="{y}" stroke="{INK}"/>'

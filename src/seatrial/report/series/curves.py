"""Errors on the tests over the seconds of training: one panel for each test and kind of trial, one line for each model.

A panel of a kind has the models that were trained on all of every other kind, so that only its own seconds differ.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ...study.series import Row, Series
from ...validate.series import Table
from ..blocks import figure, soft
from ..figures import LINES, panels, svg
from ..page import Section

Point = tuple[float, float, float]
"""Seconds, mean error over the seeds and their standard deviation (NaN of a single one)."""

Lines = Mapping[str, Mapping[str, Mapping[str, Sequence[Point]]]]
"""Points in the order of their seconds, by test, kind and model."""

# Share of the seconds of another kind that counts as all of them.
_ALL = 0.99


def learning(series: Series, found: Table) -> Section:
    """The section; empty where the study asks for no curve, or less than two of its fits are done."""
    drawn = lines(series, found)
    if not any(len(some) > 1 for kinds in drawn.values() for by in kinds.values() for some in by.values()):
        return Section("", (), {"learning": {}})
    remark = (
        "Error (Eq. 25) over the seconds of one kind of trial in the training, all of the other kinds with it; bars: "
        "standard deviation over the seeds. The farthest point to the right is the same model in every panel of a row."
    )
    return Section("Errors over the seconds of training", figure(picture(drawn), "Learning curves") + soft(remark),
                   {"learning": drawn})  # fmt: skip


def lines(series: Series, found: Table) -> Lines:
    """Points of every curve, from the fits that are done."""
    rows = [series.row(key) for keys in series.curves.values() for key in keys]
    held = {row.key: seconds(row) for row in rows}
    kinds = list(dict.fromkeys(kind for one in held.values() for kind in one))
    most = {kind: max(one.get(kind, 0.0) for one in held.values()) for kind in kinds}
    out: dict[str, dict[str, dict[str, list[Point]]]] = {}
    for test in series.tests:
        for kind in kinds:
            for label, keys in series.curves.items():
                points = [(held[key].get(kind, 0.0), one.mean(test), one.deviation(test)) for key in keys
                          if (one := found.standing(key)) is not None and one.members
                          and all(held[key].get(k, 0.0) >= _ALL * most[k] for k in kinds if k != kind)]  # fmt: skip
                out.setdefault(test, {}).setdefault(kind, {})[label] = sorted(p for p in points if math.isfinite(p[1]))
    return out


def seconds(row: Row) -> dict[str, float]:
    """Seconds of training by kind of trial."""
    out: dict[str, float] = {}
    for trial in row.cells[0].problem.trials if row.cells else ():
        kind = str(trial.meta.get("kind", "free"))
        out[kind] = out.get(kind, 0.0) + trial.duration
    return out


def picture(drawn: Lines) -> str:
    """Tests as rows of panels, kinds as columns; one logarithmic axis of errors a row."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    tests, kinds = list(drawn), list(next(iter(drawn.values())))
    sheet, axes = panels(len(tests), len(kinds), (2.5 * len(kinds) + 0.6, 2.1 * len(tests) + 0.6))
    for i, test in enumerate(tests):
        for j, kind in enumerate(kinds):
            ax: Any = axes[i, j]
            for k, (label, points) in enumerate(drawn[test][kind].items()):
                colour, dashes, mark = LINES[k % len(LINES)]
                if points:
                    x, y, bar = zip(*points, strict=True)
                    ax.errorbar(x, y, [0.0 if math.isnan(b) else b for b in bar], color=colour, ls=dashes, marker=mark,
                                ms=4, lw=1.4, capsize=2, label=label)  # fmt: skip
            if i == len(tests) - 1:
                ax.set_xlabel(f"{kind} [s]")
            if j == 0:
                ax.set_ylabel(f"error, {test} [-]")
        seen = [p[1] for by in drawn[test].values() for points in by.values() for p in points if p[1] > 0.0]
        for ax in axes[i] if seen else ():
            ax.set_yscale("log")
            ax.set_ylim(0.8 * min(seen), 1.25 * max(seen))
            ax.yaxis.set_major_locator(LogLocator(10.0, (1.0, 2.0, 5.0)))
            ax.yaxis.set_major_formatter(FuncFormatter(_digits))
            ax.yaxis.set_minor_formatter(NullFormatter())
    sheet.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    return svg(sheet, "learning curves")


def _digits(value: float, _position: int) -> str:
    return f"{value:.6g}"

"""Drawings of a campaign: histograms by case, and the shares of the inputs as bars with their intervals."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ...campaign.analysis.sensitivity import Sensitivity
from ...campaign.analysis.spread import Histogram
from ..drawing import Frame, label, whole
from ..figures import BLUE, GRID, INK, LINES, SOFT, VERMILION
from .shown import Unit

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
    for bound in bounds:
        if edges[0] < bound * unit.factor < edges[-1]:
            parts.append(frame.line([bound * unit.factor] * 2, [0.0, 1.12 * most], VERMILION, width=1.5, dash="5 3"))
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

"""What the trials of a fit tested: where a run leaves it, in words, and a picture of what was tested together."""

from __future__ import annotations

import math
from collections.abc import Iterable

from ...study.grounds import Beyond, Grounds
from .. import figures
from ..blocks import number

_DEGREES = math.degrees(1.0)
_SIGNS = {"u": ("surge speed", "m/s", 1.0), "v_m": ("sway speed", "m/s", 1.0), "r": ("rate of turn", "°/s", _DEGREES),
          "delta": ("rudder", "°", _DEGREES), "drift": ("drift angle", "°", _DEGREES), "U_T": ("wind", "m/s", 1.0),
          "H_S": ("wave height", "m", 1.0), "depth": ("depth", "m", 1.0), "n_P": ("propeller", "1/s", 1.0),
          "draught": ("draught", "m", 1.0)}  # fmt: skip
# Planes that are drawn, in rows of so many.
_DRAWN, _ROW = 6, 3
_MOTION = ("u", "v_m", "r")


def channel(name: str) -> tuple[str, str, float]:
    """Words, unit and factor from SI units of a channel of `grounds.covered`."""
    angle = name.startswith(("delta", "alpha"))
    unit = "°" if angle else "1/s" if name.startswith("n_") else ""
    return _SIGNS.get(name, (name, unit, _DEGREES if angle else 1.0))


def span(name: str, ends: tuple[float, float]) -> str:
    """A range of a channel in words, such as ``rudder −20 to 20 °``."""
    words, unit, factor = channel(name)
    low, high = (("deep" if math.isinf(end) else number(factor * end)) for end in ends)
    return f"{words} {low}{'' if low == high else f' to {high}'} {'' if low == high == 'deep' else unit}".strip()


def reach(one: Beyond) -> str:
    """Where a run leaves the trials, in words."""
    words, unit, factor = channel(one.channel)
    reached, covered = (
        " to ".join(dict.fromkeys("deep" if math.isinf(end) else number(factor * end) for end in ends))
        for ends in (one.reached, one.covered)
    )
    beside = "".join(f" at {span(name, (value, value))}" for name, value in one.beside)
    return f"{words} {reached} {unit}".strip() + f" (trials: {covered}{' there' if beside else ''})" + beside


def reached(some: Iterable[Beyond]) -> str:
    """Where a run leaves the trials, all of it in a phrase."""
    return "; ".join(map(reach, some))


def picture(found: Grounds) -> str:
    """The hull of what was tested together in planes of two channels, in the box of their ranges; empty without any."""
    moved = {name for name, (low, high) in found.covered.items() if high > low}
    planes = [one for one in found.tested if {one.x, one.y} <= moved]
    chosen = sorted(planes, key=lambda one: (one.y not in _MOTION, one.x == "v_m", one.x not in _MOTION))[:_DRAWN]
    if not chosen:
        return ""
    rows = -(-len(chosen) // _ROW)
    drawn, axes = figures.panels(rows, min(_ROW, len(chosen)), (7.4, 2.5 * rows), shared=False)
    for ax, one in zip(axes.ravel(), chosen, strict=False):
        (x, x_unit, along), (y, y_unit, up) = channel(one.x), channel(one.y)
        ends = [*one.corners, one.corners[0]]
        (left, right), (low, high) = found.covered[one.x], found.covered[one.y]
        across, above = [along * end[0] for end in ends], [up * end[1] for end in ends]
        ax.fill(across, above, color=figures.SKY, alpha=0.6)
        ax.plot(across, above, color=figures.BLUE, lw=1.0)
        ax.plot([along * end for end in (left, right, right, left, left)],
                [up * end for end in (low, low, high, high, low)], color=figures.GREY, lw=1.0,
                ls=figures.BASELINE[1])  # fmt: skip
        ax.set(xlabel=f"{x} [{x_unit or '-'}]", ylabel=f"{y} [{y_unit or '-'}]")
    for ax in axes.ravel()[len(chosen) :]:
        ax.shown = False
    return figures.svg(drawn, "tested together")


CAPTION = (
    "Tested together: states and controls that the trials of the fit had at one time (filled, their convex hull), "
    "within the ranges of each by itself (dashed). Between the two no trial went"
)
"""What stands below the figure of tested states."""

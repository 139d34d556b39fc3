"""Bands of predictions on a page: how often they held, and each trial as a fan."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...belief.bands.held import GROUPS, Held, unwrapped_to
from ...belief.bands.prediction import Fan
from ...core.values import asdict, dataclass
from ...data import Trial
from .. import figures
from ..blocks import Body, bullets, figure, gallery, number, soft, table
from ..page import Section

SHARE = (
    "Held: share of the measurements within their bands, so long after a start, and in brackets its interval of 95 % "
    "(Clopper and Pearson; windows of one trial count as fewer where trials differ)."
)
"""What a share of bands that held is, in words."""
_HOLDS = 0.9
_DEGREES = math.degrees(1.0)
_UNITS = {"x": ("m", 1.0), "y": ("m", 1.0), "psi": ("°", _DEGREES), "u": ("m/s", 1.0), "v_m": ("m/s", 1.0),
          "r": ("°/s", _DEGREES)}  # fmt: skip
_PLACE = (("x", "north x [m]", 1.0), ("y", "east y [m]", 1.0))
# Beyond so many trials only the first ones are drawn.
_DRAWN = 12


@dataclass(frozen=True)
class BandsHeld:
    """Bands of the predictions of some trials, and how often they held.

    Attributes:
        level: of 0 to 1.
        rows: by kind and horizon.
        fans: each with its trial as measured.
        recordings: behind the calibration.
    """

    level: float
    rows: tuple[Held, ...]
    fans: tuple[tuple[Fan, Trial], ...]
    recordings: int


def section(found: BandsHeld) -> Section:
    """Table of coverage and widths, and fans."""
    remark = (
        f"Bands of {100 * found.level:g} %, calibrated on {found.recordings} recordings that fits left out. {SHARE} "
        "±: mean half width."
    )
    notes = [f"{made.predicted.name}: {line}" for made, _ in found.fans for line in made.notes]
    drawn = gallery(*(figure(fan(made, trial), f"{trial.name}: measured, predicted and its band")
                      for made, trial in found.fans[:_DRAWN]))  # fmt: skip
    return Section("Bands", held_table(found.rows) + soft(remark) + bullets(dict.fromkeys(notes)) + drawn)


def held_table(rows: Sequence[Held]) -> Body:
    """Coverage and widths by kind and horizon."""
    head = ["kind", "ahead [s]", "windows", *(f"{name} held" for name in GROUPS),
            *(f"{name} ± [{unit}]" for name, (unit, _) in _UNITS.items())]  # fmt: skip
    return table(head, ([one.kind, number(one.horizon), str(one.windows),
                         *(share(one, name) for name in GROUPS),
                         *(number(factor * one.width[name], 2) for name, (_, factor) in _UNITS.items())]
                        for one in rows))  # fmt: skip


def share(row: Held, name: str) -> str:
    """How often the bands of a group held, with its interval, such as ``33 % (1–91)``."""
    if not math.isfinite(row.inside[name]):
        return "–"
    low, high = row.between[name]
    return f"{100 * row.inside[name]:.0f} % ({100 * low:.0f}–{100 * high:.0f})"


def narrow(row: Held, level: float) -> str:
    """The group whose bands held least, where that is clearly less often than the level says; else empty.

    Clearly: the whole interval of the share is below the level, and the share is below nine tenths.
    """
    least = min(row.inside, key=lambda name: row.inside[name] if math.isfinite(row.inside[name]) else 1.0)
    return least if row.inside[least] < _HOLDS and row.between[least][1] < level else ""


def fan(made: Fan, measured: Trial) -> str:
    """Position, heading and speeds of a trial over time with the band of the prediction."""
    channels = (*_PLACE, *figures.MOTION)
    drawn, axes = figures.canvas(len(channels), (5.2, 1.35 * len(channels)))
    t, breaks = made.predicted.t, made.since == 0.0
    every = max(1, len(t) // 800)
    for ax, (name, label, factor) in zip(axes, channels, strict=True):
        low, high = (np.where(breaks, np.nan, factor * edge) for edge in made.edges[name])
        middle = np.where(breaks, np.nan, factor * made.predicted[name])
        values = unwrapped_to(made, measured) if name == "psi" else measured[name]
        ax.fill_between(t[::every], low[::every], high[::every], color=figures.SKY, alpha=0.6, label="band")
        ax.plot(t[::every], middle[::every], color=figures.BLUE, lw=1.0, label="predicted")
        ax.plot(measured.t[::every], factor * values[::every], color=figures.INK, lw=1.1, label="measured")
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time t [s]")
    figures.legend_below(drawn, axes[-1])
    return figures.svg(drawn, f"band {made.predicted.name}")


def numbers(found: BandsHeld) -> Mapping[str, Any]:
    """The same for JSON, SI units."""
    return {"level": found.level, "recordings": found.recordings, "held": [asdict(one) for one in found.rows],
            "notes": {made.predicted.name: list(made.notes) for made, _ in found.fans if made.notes}}  # fmt: skip


def words(rows: Sequence[Held], level: float) -> str:
    """One line on how often bands held."""
    last = [one for one in rows if one.kind == rows[-1].kind]
    least = [(one, min(one.inside, key=lambda name: one.inside[name])) for one in last]
    found = ", ".join(f"{share(one, name)} at {one.horizon:.3g} s" for one, name in least)
    less = "; that is less often than they say" if any(narrow(one, level) for one in last) else ""
    return f"bands of {100 * level:g} % held at least in {found} ({rows[-1].kind}){less}"

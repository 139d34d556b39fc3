"""Page of a manoeuvre with bands: indices, a fan of tracks, heading and speeds over time, and what they leave out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...belief.bands.manoeuvring import Bands
from ...belief.posterior import Posterior
from ...core.values import dataclass, replace
from ...data import Trial
from ...manoeuvres import Index
from .. import figures
from ..blocks import fields, figure, gallery, note, number, soft, table
from ..page import Page, Section, provenance


@dataclass(frozen=True)
class Basis:
    """What bands stand on.

    Attributes:
        kind: "calibrated", "left out", "parameters" or "stated".
        words: what they count, one sentence.
        recordings: left-out ones that they are calibrated on; 0 where they are not.
    """

    kind: str
    words: str
    recordings: int = 0

    def on(self, recordings: int) -> Basis:
        """The same with its number of recordings."""
        return replace(self, words=self.words.format(recordings), recordings=recordings)


CALIBRATED = Basis("calibrated", (
    "these bands are calibrated on {} left-out recordings: they count the errors of the model's form, of the weather "
    "and of the instruments as those trials had them"
))  # fmt: skip
"""What bands count where a calibration is beside the model; `on` fills in the number."""
LEFT_OUT = Basis("left out", (
    "these bands are as wide as the errors of trials that were left out of the fit in turn, and so count the error of "
    "the model's form there; weather and instruments count only as those trials had them"
))  # fmt: skip
"""What bands count whose posterior left-out trials have widened."""
PARAMETERS_ONLY = Basis("parameters", (
    "these bands count what the fit leaves open about its parameters, and of the error of the model's form what its "
    "own trials show, not weather or instruments: a real ship may lie outside more often than they say"
))  # fmt: skip
"""What bands count that nothing but the covariance of the fit stands behind."""
STATED = Basis("stated", (
    "these bands count the sigmas that the estimate states of its numbers; no trial of this ship has tested them, nor "
    "the form of the model"
))  # fmt: skip
"""What bands of an estimated ship count."""


def basis_of(held: Posterior) -> Basis:
    """What bands stand on whose draws no calibration moves."""
    return STATED if not held.fitted else PARAMETERS_ONLY if held.power is None else LEFT_OUT


_DEGREES = math.degrees(1.0)
_DRAWN = 60


def page(
    title: str, found: Bands, level: float, run: Trial, indices: Mapping[str, tuple[Index, Index, Index]],
    caveats: Sequence[str], settings: Mapping[str, str], basis: Basis,
) -> Page:  # fmt: skip
    """The whole page; the numbers are those of the indices, SI units."""
    said = f"Heading and speeds: the run and the band of {100 * level:g} %"
    drawn = gallery(figure(_fan(found, level, run), "Track: the run and draws, at equal scale"),
                    figure(_motion(found, level, run), said))  # fmt: skip
    remark = ("A dash: fewer draws than the level reach it, or it is read of single runs only. Quantiles of the draws, "
              "each index and each time by itself.")  # fmt: skip
    about = {"schema": "seatrial-bands/1", "level": level, "basis": numbers(basis), "caveats": list(caveats)}
    counted = note("What these bands count", (line[:1].upper() + line[1:] + "." for line in caveats))
    return Page(title, (
        Section("", fields(about, counted)),
        Section("Indices", fields(
            {"indices": {n: _numbers(*three) for n, three in indices.items()}},
            table(("index", "value", "from", "to", "unit"), map(_row, indices.items()), words=(4,)) + soft(remark))),
        Section("Motion", drawn),
        provenance(settings),
    ))  # fmt: skip


def numbers(basis: Basis) -> dict[str, Any]:
    """What bands stand on, for JSON."""
    return {"kind": basis.kind, "recordings": basis.recordings or None, "words": basis.words}


def _numbers(value: Index, low: Index, high: Index) -> dict[str, Any]:
    return {"value": value.value, "low": low.value, "high": high.value, "unit": value.unit}


def _row(item: tuple[str, tuple[Index, Index, Index]]) -> list[str]:
    name, three = item
    unit = three[0].unit
    factor = _DEGREES if unit.startswith("rad") else 1.0
    return [name.replace("_", " "), *(number(factor * one.value, 5) for one in three), unit.replace("rad", "°")]


def _fan(found: Bands, level: float, run: Trial) -> str:
    drawn, (ax,) = figures.canvas(1)
    chosen = found.tracks[np.linspace(0, len(found.tracks) - 1, min(_DRAWN, len(found.tracks))).astype(int)]
    for k, track in enumerate(chosen):
        ax.plot(track[:, 1], track[:, 0], color=figures.SKY, lw=0.6, alpha=0.5, label=None if k else "draws")
    ax.plot(run["y"], run["x"], color=figures.INK, lw=1.3, label="fitted numbers")
    ax.plot(run["y"][:1], run["x"][:1], "o", color=figures.INK, ms=6, mfc="white", label="start")
    ax.set(xlabel="east y [m]", ylabel="north x [m]")
    ax.set_aspect("equal", adjustable="datalim")
    figures.legend_below(drawn, ax)
    return figures.svg(drawn, f"fan {level:g}")


def _motion(found: Bands, level: float, run: Trial) -> str:
    drawn, axes = figures.canvas(len(figures.MOTION))
    every = max(1, len(run) // 600)
    for ax, (name, label, factor) in zip(axes, figures.MOTION, strict=True):
        low, high = found.band(name, level)
        ax.fill_between(found.t, factor * low, factor * high, color=figures.SKY, alpha=0.6)
        ax.plot(run.t[::every], factor * run[name][::every], color=figures.INK, lw=1.1)
        ax.set_ylabel(label)
    axes[-1].set_xlabel("time t [s]")
    return figures.svg(drawn, f"motion {level:g}")

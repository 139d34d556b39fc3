"""Revolutions against speed: zero, astern while going ahead, or in another unit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ....core.ranks import median, quantile
from ... import Trial
from ..relations import length_of
from ..repairs import step, times
from ..sensors import Fault

# Advance per revolution over the length, u/(n L): .013 to .04 for ships.
_LEAST, _MOST = 0.003, 0.15
# Advance per revolution of a ship of unknown length [m]: the largest propellers screw some ten.
_SCREWED = 20.0


def shaft_faults(trials: Sequence[Trial]) -> Iterator[Fault]:
    """What the speed of some trials of one ship says of its revolutions."""
    azimuths = {name.replace("alpha", "n") for trial in trials for name in trial.channels if name.startswith("alpha_")}
    for name in ("n_P", "n_P_1", "n_P_2", *sorted(azimuths)):
        some = [trial for trial in trials if name in trial and "u" in trial]
        if some:
            yield from _one(some, name)


def _one(trials: Sequence[Trial], name: str) -> Iterator[Fault]:
    steady = [pair for trial in trials if (pair := _ahead(trial, name)) is not None]
    if not steady:
        return
    speeds, turns, greatest, lengths = (np.array(part) for part in zip(*steady, strict=True))
    every = np.concatenate([trial[name][np.isfinite(trial[name])] for trial in trials])
    if not every.any():
        yield Fault(
            "error", name, "no revolutions, and the ship keeps its speed",
            f"0 1/s in {len(steady)} trials at {median(speeds):.3g} m/s",
            step("drop", name, text="take the column of the shaft"), "quality", "zeros",
        )  # fmt: skip
        return
    if every.max() <= 0:
        yield Fault(
            "error", name, "revolutions are negative, and the ship goes ahead",
            f"{median(turns):.3g} 1/s at {median(speeds):.3g} m/s ahead",
            times(-1.0, name), "sign", "sign",
        )  # fmt: skip
        return
    known = (turns > 0) & np.isfinite(lengths)
    if not known.any():
        far = median(speeds / greatest)
        if far > _SCREWED:
            yield Fault(
                "error", name, "revolutions are too few for the speed: converted from rpm, or a share of the most",
                f"{median(greatest):.3g} 1/s at {median(speeds):.3g} m/s: {far:.3g} m a revolution",
                "give the unit in the mapping; a share of the greatest revolutions is no channel", "unit", "unit",
            )  # fmt: skip
        return
    # A berthing coasts with its propeller near rest: revolutions are too few only if the greatest ones are.
    small = median(speeds[known] / (greatest[known] * lengths[known])) > _MOST
    told = greatest if small else turns
    advance = median(speeds[known] / (told[known] * lengths[known]))
    if not small and advance > _LEAST:
        return
    yield Fault(
        "error", name, "revolutions are in 1/s that were converted from rpm" if small
        else "revolutions are in rpm, or in percent",
        f"{median(told[known]):.3g} 1/s at {median(speeds[known]):.3g} m/s: {advance:.2g} lengths "
        f"a revolution ({_LEAST:g} to {_MOST:g} for ships)",
        times(60.0, name, text='unit = "1/s" in the mapping') if small
        else times(1.0 / 60.0, name, text='unit = "rpm" in the mapping'), "unit", "unit",
    )  # fmt: skip


def _ahead(trial: Trial, name: str) -> tuple[float, float, float, float] | None:
    """Speed, revolutions, the greatest ones and length of a trial that keeps its speed ahead; None for others."""
    u, n = trial["u"], trial[name]
    good = np.isfinite(u) & np.isfinite(n)
    if good.sum() < 20:
        return None
    top = quantile(u[good], 0.95)
    fast = good & (u > 0.4 * top)
    length = length_of(trial)
    lasts = fast.mean() * trial.duration * top / (length or 100.0)
    if top <= 0 or lasts < 4.0 or median(u[good]) < 0.3 * top:
        return None
    turns = n[fast]
    greatest = quantile(np.abs(n[good]), 0.95)
    return median(u[fast]), median(turns), greatest, length if length else float("nan")

"""The first three overshoots of a zigzag, its reversals and its initial turning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...core.parameters import Scalar, Scalars
from ...core.symbolic import both, larger, root, where
from ...data import Array
from ...manoeuvres.zigzag import Zigzag
from . import NEVER, Tally, Truth

_ORDINALS = ("first", "second", "third")
# As of `Zigzag.indices`: the heading comes back by this fraction of psi before a peak counts as an overshoot.
_BACK = 0.1
_LOW = -1e9


@dataclass(frozen=True)
class ZigzagTally(Tally, Zigzag):
    """A zigzag that notes the time of four reversals and the peak of the heading after the first three."""

    noted: ClassVar[tuple[str, ...]] = (
        "time_1", "time_2", "time_3", "time_4", "peak_1", "peak_2", "peak_3", "swing", "heading_before", "heading",
        "x", "y", "way_before", "way", "turning",
    )  # fmt: skip
    memory: ClassVar[tuple[str, ...]] = (*Zigzag.memory, "failed", *noted)
    figures: ClassVar[Mapping[str, str]] = {
        **{f"{name}_overshoot": "rad" for name in _ORDINALS}, **{f"{name}_reversal": "s" for name in _ORDINALS},
        "period": "s", "initial_turning_time": "s", "initial_turning_distance": "m",
    }  # fmt: skip

    def first(self, state: Scalars) -> Scalars:
        return (*([NEVER] * 4), *([_LOW] * 3), 0.0, 0.0, 0.0, state[0], state[1], 0.0, 0.0, NEVER)

    def note(
        self, t: Scalar, state: Scalars, turned: tuple[Scalars, Scalars], noted: Scalars, valid: Scalar
    ) -> Scalars:
        (side, psi_0), (after, _) = turned
        times, peaks = noted[:4], noted[4:7]
        last, _, heading, x, y, _, way, turning = noted[7:]
        beyond = state[2] - psi_0
        flip, swing = both(valid, side * after < 0), where(valid, -after * beyond, last)
        begun = (True, *(time >= 0 for time in times))
        now = [both(flip, both(there, time < 0)) for there, time in zip(begun, times, strict=False)]
        times = tuple(where(fresh, t, time) for fresh, time in zip(now, times, strict=True))
        peaks = tuple(
            where(both(one >= 0, other < 0), larger(peak, swing), peak)
            for one, other, peak in zip(times, times[1:], peaks, strict=False)
        )
        open_ = both(valid, turning < 0)
        fresh = both(open_, self.side * beyond >= self.psi)
        chord = root((state[0] - x) * (state[0] - x) + (state[1] - y) * (state[1] - y))
        return (
            *times, *peaks, swing, where(open_, heading, noted[8]), where(open_, self.side * beyond, heading),
            state[0], state[1], where(open_, way, noted[12]), where(open_, way + chord, way), where(fresh, t, turning),
        )  # fmt: skip

    def read(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Mapping[str, Array]:
        psi = np.asarray(varied.get("psi", self.psi))
        out: dict[str, Array] = {}
        for k, name in enumerate(_ORDINALS, 1):
            time, ended = noted[f"time_{k}"], noted[f"time_{k + 1}"]
            peak = noted[f"peak_{k}"]
            whole = (ended >= 0) | ((time >= 0) & (peak - noted["swing"] >= _BACK * psi))
            out[f"{name}_overshoot"] = np.where(whole, peak - psi, np.nan)
            out[f"{name}_reversal"] = np.where(time >= 0, time, np.nan)
        out["period"] = out["second_reversal"]
        # as the manoeuvre reads it: linear between the samples about the moment at which the heading comes up to psi
        before, way, there = noted["heading_before"], noted["way_before"], noted["turning"] >= 0
        share = np.where(there, (psi - before) / np.where(there, noted["heading"] - before, 1.0), np.nan)
        out["initial_turning_time"] = noted["turning"] + (share - 1.0) * self.dt
        out["initial_turning_distance"] = way + share * (noted["way"] - way)
        return out

    def finished(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Truth:
        return np.isfinite(self.read(noted, varied)["third_overshoot"])

"""The first three overshoots of a zigzag, its reversals and its initial turning."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...core.parameters import Scalar, Scalars
from ...core.symbolic import both, larger, where
from ...data import Array
from ...manoeuvres.zigzag import Zigzag
from . import NEVER, Tally, passed, way

_ORDINALS = ("first", "second", "third")
# As of `Zigzag.indices`: the heading comes back by this fraction of psi before a peak counts as an overshoot.
_BACK = 0.1
_LOW = -1e9


@dataclass(frozen=True)
class ZigzagTally(Tally, Zigzag):
    """A zigzag that notes the time of four reversals and the peak of the heading after the first three."""

    noted: ClassVar[tuple[str, ...]] = (
        "time_1", "time_2", "time_3", "time_4", "peak_1", "peak_2", "peak_3", "swing", "heading", "x", "y", "way",
        "turning_time", "turning_way",
    )  # fmt: skip
    memory: ClassVar[tuple[str, ...]] = (*Zigzag.memory, "failed", *noted)
    figures: ClassVar[Mapping[str, str]] = {
        **{f"{name}_overshoot": "rad" for name in _ORDINALS}, **{f"{name}_reversal": "s" for name in _ORDINALS},
        "period": "s", "initial_turning_time": "s", "initial_turning_distance": "m",
    }  # fmt: skip

    def first(self, state: Scalars) -> Scalars:
        return (*([NEVER] * 4), *([_LOW] * 3), 0.0, 0.0, state[0], state[1], 0.0, NEVER, 0.0)

    def note(self, t: Scalar, state: Scalars, turned: tuple[Scalars, Scalars], noted: Scalars) -> Scalars:
        (side, psi_0), (after, _) = turned
        times, peaks = noted[:4], noted[4:7]
        _, before, x, y, gone, moment, reach = noted[7:]
        flip, beyond = side * after < 0, state[2] - psi_0
        swing, heading = -after * beyond, self.side * beyond
        earlier = (0.0, *times[:3])
        times = tuple(
            where(both(both(time < 0, last >= 0), flip), t, time) for last, time in zip(earlier, times, strict=True)
        )
        peaks = tuple(
            where(both(begun >= 0, ended < 0), larger(peak, swing), peak)
            for begun, ended, peak in zip(times[:3], times[1:], peaks, strict=True)
        )
        fresh, share = passed(moment, before, heading, self.psi)
        chord = way(x, y, state)
        return (
            *times, *peaks, swing, heading, state[0], state[1], gone + chord,
            where(fresh, t - self.dt + share * self.dt, moment), where(fresh, gone + share * chord, reach),
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
        turning = noted["turning_time"]
        out["initial_turning_time"] = np.where(turning >= 0, turning, np.nan)
        out["initial_turning_distance"] = np.where(turning >= 0, noted["turning_way"], np.nan)
        return out

    def finished(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Array:
        return np.isfinite(self.read(noted, varied)["third_overshoot"])

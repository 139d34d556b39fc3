"""The first three overshoots of a zigzag, its reversals and its initial turning."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ...core.parameters import Scalar, Scalars
from ...core.symbolic import both, larger, root, where
from ...core.values import dataclass
from ...data import Array
from ...manoeuvres.zigzag import Zigzag
from . import Tally, Truth

_ORDINALS = ("first", "second", "third")
# As of `Zigzag.indices`: the heading comes back by this fraction of psi before a peak counts as an overshoot.
_BACK = 0.1


# Only so many reversals are noted.
_MOST = 4


@dataclass(frozen=True)
class ZigzagTally(Tally, Zigzag):
    """A zigzag that notes four reversals, the heading at each and the peaks between them.

    Times and peaks are shifted by one place at a reversal, the last one first: a selection for each, and no test of
    which reversal it is.  The first reversal is where the heading comes up to psi for the first time; how it came there
    is kept as it was then.
    """

    noted: ClassVar[tuple[str, ...]] = (
        "reversals", "time_a", "time_b", "time_c", "time_d", "peak", "peak_a", "peak_b", "peak_c", "swing",
        "begun", "begun_a", "begun_b", "begun_c", "heading_before", "heading", "x", "y", "way_before", "way",
    )  # fmt: skip
    memory: ClassVar[tuple[str, ...]] = (*Zigzag.memory, "failed", *noted)
    figures: ClassVar[Mapping[str, str]] = {
        **{f"{name}_overshoot": "rad" for name in _ORDINALS}, **{f"{name}_reversal": "s" for name in _ORDINALS},
        "period": "s", "initial_turning_time": "s", "initial_turning_distance": "m",
    }  # fmt: skip

    def first(self, state: Scalars) -> Scalars:
        return (*([0.0] * 14), 0.0, 0.0, state[0], state[1], 0.0, 0.0)

    def note(
        self, t: Scalar, state: Scalars, turned: tuple[Scalars, Scalars], noted: Scalars, valid: Scalar
    ) -> Scalars:
        (side, psi_0), (after, _) = turned
        count, a, b, c, d, peak, peak_a, peak_b, peak_c, last, *noted_on = noted
        begun, begun_a, begun_b, begun_c, heading_0, heading, x, y, way_0, way = noted_on
        beyond = state[2] - psi_0
        flip = both(both(valid, count < _MOST), side * after < 0)
        opening = both(valid, count < 0.5)
        swing = where(valid, -after * beyond, last)
        dx, dy = state[0] - x, state[1] - y
        return (
            where(flip, count + 1.0, count),
            where(flip, t, a), where(flip, a, b), where(flip, b, c), where(flip, c, d),
            where(flip, swing, larger(peak, swing)),
            where(flip, peak, peak_a), where(flip, peak_a, peak_b), where(flip, peak_b, peak_c), swing,
            where(flip, swing, begun),
            where(flip, begun, begun_a), where(flip, begun_a, begun_b), where(flip, begun_b, begun_c),
            where(opening, heading, heading_0), where(opening, self.side * beyond, heading), state[0], state[1],
            where(opening, way, way_0), where(opening, way + root(dx * dx + dy * dy), way),
        )  # fmt: skip

    def read(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Mapping[str, Array]:
        psi, count = np.asarray(varied.get("psi", self.psi)), noted["reversals"]
        out: dict[str, Array] = {}
        for k, name in enumerate(_ORDINALS, 1):
            peak, ended = _placed(noted, "peak", count - k), count > k
            whole = ended | ((count == k) & (peak - noted["swing"] >= _BACK * psi))
            out[f"{name}_overshoot"] = np.where(whole, peak - _placed(noted, "begun", count - k), np.nan)
            out[f"{name}_reversal"] = np.where(count >= k, _placed(noted, "time", count - k + 1), np.nan)
        out["period"] = out["second_reversal"]
        # as the manoeuvre reads it: linear between the samples about the moment at which the heading comes up to psi
        before, way, there = noted["heading_before"], noted["way_before"], count > 0
        share = np.where(there, (psi - before) / np.where(there, noted["heading"] - before, 1.0), np.nan)
        out["initial_turning_time"] = out["first_reversal"] + (share - 1.0) * self.dt
        out["initial_turning_distance"] = way + share * (noted["way"] - way)
        return out

    def finished(self, noted: Mapping[str, Array], varied: Mapping[str, Array]) -> Truth:
        return np.isfinite(self.read(noted, varied)["third_overshoot"])


def _placed(noted: Mapping[str, Array], kind: str, place: Array) -> Array:
    """The time or peak that stands in a place of its row: 0 is the running peak, 1 what was noted last."""
    rows = [noted.get(kind, noted[f"{kind}_a"]), *(noted[f"{kind}_{letter}"] for letter in "abcd"
                                                   if f"{kind}_{letter}" in noted)]  # fmt: skip
    return np.choose(np.clip(place, 0, len(rows) - 1).astype(np.intp), rows)

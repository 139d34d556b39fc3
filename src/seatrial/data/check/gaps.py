"""Checks of what is not there: gaps, slower instruments, rows without data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .. import Array, Trial
from .sensors import EVERY, Fault

_FEW = 10
"""Values that show how often an instrument speaks."""


def gap_faults(trial: Trial) -> Iterator[Fault]:
    """Gaps, those that begin and end together as one; instruments slower than the rows; an empty end."""
    if not trial.channels:
        return
    filled = np.isfinite(trial.stack(*trial.channels)).any(axis=1)
    last = int(np.flatnonzero(filled)[-1]) if filled.any() else -1
    empty = len(trial) - 1 - last
    if last < 0:
        yield Fault("error", EVERY, "no data", f"{len(trial)} rows, all empty", "leave it out")
        return
    if empty:
        yield Fault(
            "warning", EVERY, "rows without data at the end",
            f"the last {empty} of {len(trial)} rows", "prepare.drop_trailing_gaps",
        )  # fmt: skip
    slower: dict[float, list[str]] = {}
    holes: dict[_Holes, list[str]] = {}
    for name, values in trial.channels.items():
        if not np.isnan(values[: last + 1]).any():
            continue
        every = _every(trial.t[: last + 1], values[: last + 1])
        if every:
            slower.setdefault(every, []).append(name)
        else:
            found = _Holes.of(trial.t[: last + 1], values[: last + 1])
            holes.setdefault(next((one for one in holes if one.same(found)), found), []).append(name)
    for found, names in holes.items():
        yield Fault(
            "warning", ", ".join(names), "gaps", found.told(last + 1),
            "fit on prepare.segments, or fill short ones with prepare.interpolate_gaps",
        )  # fmt: skip
    for every, names in slower.items():
        yield Fault(
            "info", ", ".join(names), f"sampled at {1.0 / every:.3g} Hz",
            f"a value every {every:.3g} s, the rows are at {1.0 / trial.dt:.3g} Hz",
            "nothing is missing; prepare.interpolate_gaps where every row must have a value",
        )  # fmt: skip


@dataclass(frozen=True)
class _Holes:
    """Where a channel has no values for longer than it takes from one to the next.

    Attributes:
        spans: begin and end of each hole [s].
        usual: time from one value to the next [s].
        missing: rows without a value.
    """

    spans: tuple[tuple[float, float], ...]
    usual: float
    missing: int

    @staticmethod
    def of(t: Array, values: Array) -> _Holes:
        good = np.isfinite(values)
        at, row = t[good], float(np.median(np.diff(t)))
        usual = float(np.median(np.diff(at))) if at.size > 1 else row
        edges = np.concatenate([[t[0] - row], at, [t[-1] + row]])
        wide = np.flatnonzero(np.diff(edges) > usual + 0.5 * row)
        spans = tuple((max(float(edges[k]), float(t[0])), float(edges[k + 1])) for k in wide.tolist())
        return _Holes(spans, usual, int((~good).sum()))

    def same(self, other: _Holes) -> bool:
        """Whether both tell of the same loss: their holes begin and end together, as far as their steps can show."""
        slack = 1.01 * max(self.usual, other.usual)
        pairs = zip(self.spans, other.spans, strict=False)
        return len(self.spans) == len(other.spans) and all(
            abs(a - c) <= slack and abs(b - d) <= slack for (a, b), (c, d) in pairs
        )

    def told(self, rows: int) -> str:
        """The numbers in words."""
        if not self.spans:
            return f"{self.missing} of {rows} samples, here and there"
        longest, many = max(b - a for a, b in self.spans), "s" if len(self.spans) > 1 else ""
        first = min(a for a, _ in self.spans)
        return (f"{self.missing} of {rows} samples in {len(self.spans)} gap{many} of up to {longest:.3g} s, "
                f"the first after t = {first:g} s")  # fmt: skip


def _every(t: Array, values: Array) -> float:
    """Step of an instrument that is slower than the rows and leaves none of its own out [s]; 0 where it does."""
    at = t[np.isfinite(values)]
    steps = np.diff(at)
    if steps.size < _FEW or not (steps > 0).all():
        return 0.0
    row, every = float(np.median(np.diff(t))), float(np.median(steps))
    even = bool((np.abs(steps - every) <= 0.25 * every + 1.01 * row).all())
    whole = max(at[0] - t[0], t[-1] - at[-1]) <= every + 1.01 * row
    return float(f"{every:.3g}") if every > 1.5 * row and steps.max() < 1.9 * every and even and whole else 0.0

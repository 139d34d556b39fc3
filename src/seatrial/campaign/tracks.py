"""Tracks: samples of every run that are kept beside its row, every so many steps.

Only the kept rows leave the compiled loop.  A run that fails keeps those before it failed, so runs differ in length.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..core.errors import CampaignError
from ..core.parameters import unknown
from ..core.values import dataclass, replace
from ..data import Array
from ..manoeuvres import Policy
from ..ships import Ship
from ..simulate.lanes import Lanes, Steps, run
from ..simulate.loop import logged

Precision = Literal["single", "double"]
Column = NDArray[Any]

FIRST = ("run", "t")
"""Columns of every table of tracks, before those that are chosen."""

# Rows of a part that is cut by itself: a file of some 50 MB; and bytes above which one is refused, as it is held whole.
_ROWS, _MOST = 2_000_000, 4e9
# Lanes of the kernel are a multiple of this.
_LANES = 16
# Numbers of one call of the kernel, which also stores memory: what a cache holds, and what keeps a GPU busy.
_NEAR, _AWAY = 2_000_000, 250_000_000


@dataclass(frozen=True)
class Tracks:
    """Which samples of each run are kept.

    Attributes:
        every: each so many samples one is kept, the first included.
        columns: of them: states, controls as they act, or orders (``delta_cmd``); none given: states and controls.
        precision: "single" (seven digits: a heading to 1e-6 rad, a position of 10 km to 1 mm) or "double".

    Raises:
        CampaignError: no such choice.
    """

    every: int = 1
    columns: tuple[str, ...] = ()
    precision: Precision = "single"

    def __post_init__(self) -> None:
        if self.every < 1:
            raise CampaignError(f"tracks: every is {self.every}; give 1 or more")
        if len(set(self.columns)) < len(self.columns):
            raise CampaignError(f"tracks: columns: one of {', '.join(self.columns)} stands twice")

    @property
    def type(self) -> type[np.floating[Any]]:
        """Of the kept numbers."""
        return np.float32 if self.precision == "single" else np.float64

    def names(self, ship: Ship, policy: Policy) -> tuple[str, ...]:
        """Columns of the tracks of a ship under a policy, after `FIRST`.

        Raises:
            CampaignError: it has no such column.
        """
        usual = (*ship.model.motion, *ship.model.controls)
        known = (*usual, *logged(ship, policy))
        for name in self.columns:
            if name not in known:
                raise CampaignError(f"tracks: columns: {ship.name}: {unknown(name, known, 'column')}")
        return self.columns or usual

    def rows(self, samples: int) -> int:
        """Rows of a run of so many samples that does not fail."""
        return (samples - 1) // self.every + 1

    def chunk(self, samples: int, usual: int) -> int:
        """Runs of a part whose tracks are a file of convenient size, `usual` at most."""
        return min(usual, max(_ROWS // self.rows(samples) // _LANES, 1) * _LANES)

    def check(self, samples: int, columns: int, chunk: int) -> None:
        """Refuse parts whose tracks do not fit the memory.

        Raises:
            CampaignError: how many runs a part may have.
        """
        one = self.rows(samples) * columns * np.dtype(self.type).itemsize
        if chunk * one > _MOST and chunk > 1:
            wanted = f"give chunk = {max(int(_MOST / one), 1)} or less, or a larger every"
            raise CampaignError(f"tracks: a part of {chunk} runs holds {chunk * one / 1e9:.3g} GB; {wanted}")


def sail(
    loop: Lanes, dt: float, steps: int, method: str, threads: int, tracks: Tracks | None, names: tuple[str, ...],
    away: bool = False,
) -> tuple[Array, dict[str, Column]]:  # fmt: skip
    """Row of each lane after its last sample, whose memory has seen all of them, and the samples that are kept.

    Args:
        steps: samples of each run.
        names: of the columns that are kept.
        away: whether the kernel runs on a device.

    Returns:
        Shapes (lanes, stored) and, by name, (lanes, rows).
    """
    # One row more than the run has samples.
    if loop.series.shape[1] > 1:
        loop = replace(loop, series=np.pad(loop.series, ((0, 0), (0, 1), (0, 0)), "edge"))
    if tracks is None:
        return run(loop, Steps(dt, steps + 1, steps, method), None, threads).values[:, -1], {}
    system, lanes = loop.kernel.system, len(loop.state)
    # What a plant remembers is not stored, so such a run cannot be taken up again where the kept rows end.
    stride = 1 if system.hidden else tracks.every
    end, count = steps // stride * stride, tracks.rows(steps)
    kept = {name: np.empty((lanes, count), tracks.type) for name in names}
    last = np.empty((lanes, len(system.stored)))
    most = (_AWAY if away else threads * _NEAR) // ((end // stride + 1) * len(system.stored))
    group = max(most // _LANES, 1) * _LANES
    for low in range(0, lanes, group):
        here = slice(low, min(low + group, lanes))
        rows = run(loop.part(here), Steps(dt, end + 1, stride, method), None, threads).values
        for name, column in kept.items():
            column[here] = rows[:, : count * (tracks.every // stride) : tracks.every // stride,
                                system.stored.index(name)]  # fmt: skip
        last[here] = rows[:, -1]
    if end < steps:
        states, series = len(system.states), loop.series if loop.series.shape[1] == 1 else loop.series[:, end:]
        on = replace(loop, state=last[:, :states], memory=last[:, states : states + len(system.memory)], series=series)
        rest = Steps(dt, steps - end + 1, steps - end, method, end * dt)
        last = run(on, rest, None, threads).values[:, -1]
    return last, kept


def counts(failed: Array, samples: Any, dt: Any, every: int) -> NDArray[np.int64]:
    """Kept samples of each run, shape (runs,): those before it failed.

    Args:
        failed: when each run failed [s]; NaN where it did not.
        samples, dt: of the runs, or of each.
    """
    ends = np.where(np.isfinite(failed), np.round(failed / dt), samples)
    return np.ceil(ends / every).astype(np.int64)


def table(
    kept: Mapping[str, Column], numbers: NDArray[np.int64], own: NDArray[np.int64], every: int, dt: float
) -> dict[str, Column]:
    """Kept samples as columns, run by run.

    Args:
        kept: by name, shape (lanes, rows).
        numbers: of the runs, shape (lanes,).
        own: `counts` of each.
    """
    rows = next(iter(kept.values())).shape[1]
    t = np.arange(rows) * every * dt
    if (own == rows).all():
        return {"run": np.repeat(numbers, rows), "t": np.tile(t, len(numbers)),
                **{name: column.reshape(-1) for name, column in kept.items()}}  # fmt: skip
    there = np.arange(rows) < own[:, None]
    return {"run": np.repeat(numbers, own), "t": np.broadcast_to(t, there.shape)[there],
            **{name: column[there] for name, column in kept.items()}}  # fmt: skip

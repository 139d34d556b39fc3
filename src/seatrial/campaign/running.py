"""Computing what a folder still misses, in threads of this process or on a cluster (`core.executors`).

No more parts are under way than keep the pool busy, so that Ctrl-C ends soon; what a killed process had begun is
computed again, and nothing else.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path

from ..core.executors import Pool
from ..core.values import dataclass
from ..engine import EngineNotice
from ..engine.compilers import no_compiler
from . import Campaign, CampaignError
from .folder import Held, begin, write_part
from .places import Place, place_of

_SLOW = "parts are computed on CasADi's virtual machine, some 30 times slower and with other last digits: {}"


@dataclass(frozen=True)
class Shard:
    """One of several processes or machines that share the parts of a campaign: parts k with k mod `count` = `index`."""

    index: int = 0
    count: int = 1

    def of(self, parts: list[int]) -> list[int]:
        """Its own among these parts."""
        return [part for part in parts if part % self.count == self.index]

    @staticmethod
    def read(text: str) -> Shard:
        """A shard from ``K/N``, K from 1 to N.

        Raises:
            CampaignError: anything else.
        """
        first, slash, last = text.partition("/")
        if not (slash and first.isdecimal() and last.isdecimal() and 1 <= int(first) <= int(last)):
            raise CampaignError(f"--shard is '{text}'; write K/N with K from 1 to N, such as 2/8")
        return Shard(int(first) - 1, int(last))


@dataclass(frozen=True)
class Ran:
    """What one call computed.

    Attributes:
        held: the folder.
        parts, runs: computed now.
        seconds: taken.
    """

    held: Held
    parts: int
    runs: int
    seconds: float


Watch = Callable[[int, int, int, float], object]
"""Told after each part: parts done and of how many, runs computed now, seconds since the start."""


def run(
    campaign: Campaign, where: str | Path, *, pool: Pool, source: Path | None = None, shard: Shard = Shard(),
    watch: Watch | None = None,
) -> Ran:  # fmt: skip
    """Compute the parts that are missing.

    Args:
        where: folder, or URL of a store.
        source: file of the campaign; its text is kept in the manifest.
        shard: which parts are this process's.
        pool: who computes.
        watch: told of the progress.

    Raises:
        CampaignError: see `folder.begin`.
        BusyError: another process computes the same shard of this folder.
        OSError: a part cannot be written.
    """
    held = begin(campaign, place_of(where), source)
    began, runs, done, said = time.monotonic(), 0, 0, ""
    with held.place.alone(f".shards/{shard.index + 1}-of-{shard.count}"):
        todo, place = shard.of(held.missing), held.place.everywhere()
        for count, lacking in pool.each(_part, ((campaign, place, number) for number in todo)):
            runs, done = runs + count, done + 1
            if lacking and pool.away and not said:  # the engine tells it of this process
                said = lacking
                warnings.warn(_SLOW.format(lacking), EngineNotice, stacklevel=2)
            if watch is not None:
                watch(done, len(todo), runs, time.monotonic() - began)
    return Ran(held, done, runs, time.monotonic() - began)


def _part(campaign: Campaign, place: Place, number: int) -> tuple[int, str]:
    """Runs of a part, and why the worker that wrote it compiles no kernels; empty where it does."""
    return write_part(campaign, place, number), no_compiler()

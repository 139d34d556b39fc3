"""Computing what a folder still misses: in threads of this process, or through any executor.

An executor is anything with `submit` as `concurrent.futures` has it.  No more parts are under way than are needed to
keep it busy, so that Ctrl-C ends soon; what a killed process had begun is computed again, and nothing else.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from ..core.files import held_alone
from ..engine.rollout import default_threads
from . import Campaign, CampaignError
from .folder import Held, begin, write_part


class Executor(Protocol):
    """What computes parts: a pool of threads, processes, or a cluster."""

    def submit(self, fn: Callable[..., int], /, *args: Any) -> Future[int]:
        """Compute `fn(*args)` somewhere."""
        ...


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
    campaign: Campaign, folder: Path, *, source: Path | None = None, shard: Shard = Shard(), threads: int | None = None,
    executor: Executor | None = None, width: int | None = None, watch: Watch | None = None,
) -> Ran:  # fmt: skip
    """Compute the parts that are missing.

    Args:
        source: file of the campaign; its text is kept in the manifest.
        shard: which parts are this process's.
        threads: of this process; None takes `engine.rollout.default_threads()`.
        executor: in place of threads.
        width: number of parts that the executor computes at once; None for the number of `threads`.
        watch: told of the progress.

    Raises:
        CampaignError: see `folder.begin`.
        BusyError: another process computes the same shard of this folder.
        OSError: a part cannot be written.
    """
    held = begin(campaign, folder, source)
    began, runs, done = time.monotonic(), 0, 0
    with held_alone(folder / ".shards" / f"{shard.index + 1}-of-{shard.count}"):
        todo = shard.of(held.missing)
        with _pool(executor, threads) as (pool, own):
            for count in _computed(pool, campaign, folder, todo, 2 * (width or own)):
                runs, done = runs + count, done + 1
                if watch is not None:
                    watch(done, len(todo), runs, time.monotonic() - began)
    return Ran(held, done, runs, time.monotonic() - began)


@contextmanager
def _pool(executor: Executor | None, threads: int | None) -> Generator[tuple[Any, int], None, None]:
    number = threads or default_threads()
    if executor is not None:
        yield executor, number
        return
    with ThreadPoolExecutor(number) as pool:
        yield pool, number


def _computed(pool: Any, campaign: Campaign, folder: Path, todo: list[int], most: int) -> Generator[int, None, None]:
    """Runs of each part as it is done, at most `most` under way; what has not begun is dropped on an error."""
    waiting = iter(todo)
    under_way: set[Future[int]] = set()
    try:
        while True:
            for number in waiting:
                under_way.add(pool.submit(write_part, campaign, folder, number))
                if len(under_way) >= most:
                    break
            if not under_way:
                return
            done, under_way = wait(under_way, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    finally:
        for future in under_way:
            future.cancel()

"""Where independent pieces of work are computed: threads of this process, processes, or workers of a Dask cluster.

One door: a `Pool` has `submit` as `concurrent.futures` has it, and knows whether a failed piece was lost with a worker
and may be sent again.  Dask (extra `cluster`) is configured by its own files and variables: TLS, timeouts,
`dask-jobqueue`, dashboards.
"""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from threading import Thread
from typing import Any, Protocol, TypeVar

from .errors import ClusterError, RequestError, RunError, first_line
from .values import dataclass, field
from .version import __version__

Result = TypeVar("Result")

# A piece that is lost so often is not lost by chance.
_TRIES = 100
# How often the cluster is looked at while pieces are under way, and how long a lost scheduler is waited for [s].
_LOOK, _PATIENCE = 5.0, 60.0
_LOCAL = "local:"
_ADDRESS = re.compile(r"[a-z]+://.+:\d+/?")


class Submits(Protocol):
    """Anything with `submit`, as the executors of `concurrent.futures`."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Future[Any]:
        """Compute `fn(*args)` somewhere."""
        ...


@dataclass(frozen=True)
class Pool:
    """An executor, how many pieces it computes at once, and what to do about one that was lost.

    Attributes:
        executor: takes the pieces.
        width: number of pieces at once; asked anew, as workers come and go.
        lost: whether an error says that the piece was lost, not that it failed.
        check: raises `ClusterError` where nobody is left to compute.
        away: whether pieces leave this process: function and arguments are pickled, and files are found by full paths.
    """

    executor: Submits
    width: Callable[[], int]
    lost: Callable[[BaseException], bool] = field(default=lambda error: False)
    check: Callable[[], None] = field(default=lambda: None)
    away: bool = False

    def submit(self, work: Callable[..., Result], /, *piece: Any) -> Future[Result]:
        """Compute `work(*piece)`; away, by the same version of the package or not at all."""
        if not self.away:
            return self.executor.submit(work, *piece)
        return self.executor.submit(at_version, __version__, work, *piece)

    def result(self, future: Future[Result]) -> Result:
        """Of a piece that `submit` has begun.

        Raises:
            ClusterError: it is lost, and the executor has not found another worker for it.
        """
        error = _error(future)
        if error is not None and self.lost(error):
            self.check()
            raise ClusterError(f"a piece of work is lost ({error}); run the same command again") from None
        return future.result()

    def ordered(self, work: Callable[..., Result], pieces: Iterable[tuple[Any, ...]]) -> Iterator[Result]:
        """As `each`, in the order of the pieces."""
        early: dict[int, Result] = {}
        wanted = 0
        for number, found in self.each(_numbered, ((work, piece, k) for k, piece in enumerate(pieces))):
            early[number] = found
            while wanted in early:
                yield early.pop(wanted)
                wanted += 1

    def each(self, work: Callable[..., Result], pieces: Iterable[tuple[Any, ...]]) -> Iterator[Result]:
        """Results of `work(*piece)` as they are done, in any order; at most twice `width` are under way.

        A piece that is lost is sent again; after any other error what has not begun is dropped.
        """
        tries: dict[tuple[Any, ...], int] = {}
        under_way: dict[Future[Result], tuple[Any, ...]] = {}
        again: list[tuple[Any, ...]] = []
        waiting = iter(pieces)
        try:
            while True:
                self._send(work, under_way, again, waiting)
                if not under_way:
                    return
                done, _ = wait(under_way, timeout=_LOOK, return_when=FIRST_COMPLETED)
                if not done:
                    self.check()
                for future in done:
                    piece = under_way.pop(future)
                    error = _error(future)
                    if error is None:
                        yield future.result()
                        continue
                    tries[piece[-1:]] = tries.get(piece[-1:], 0) + 1
                    if not self.lost(error) or tries[piece[-1:]] > _TRIES:
                        raise error
                    self.check()
                    again.append(piece)
        finally:
            for future in under_way:
                future.cancel()

    def _send(
        self, work: Callable[..., Result], under_way: dict[Future[Result], tuple[Any, ...]],
        again: list[tuple[Any, ...]], waiting: Iterator[tuple[Any, ...]],
    ) -> None:  # fmt: skip
        while len(under_way) < 2 * max(self.width(), 1):
            piece = again.pop() if again else next(waiting, None)
            if piece is None:
                return
            under_way[self.submit(work, *piece)] = piece


def at_version(version: str, work: Callable[..., Result], *piece: Any) -> Result:
    """`work(*piece)`, on a worker.

    Raises:
        RunError: the worker has another version of the package, whose numbers may differ.
    """
    if version != __version__:
        raise RunError(f"a worker has seatrial {__version__}, this is {version}; give all the same version")
    return work(*piece)


def _numbered(work: Callable[..., Result], piece: tuple[Any, ...], number: int) -> tuple[int, Result]:
    return number, work(*piece)


def parted(count: int, pool: Pool) -> list[range]:
    """The numbers below `count` in as many runs as the pool has places, none empty."""
    parts = max(min(pool.width(), count), 1)
    return [range(k * count // parts, (k + 1) * count // parts) for k in range(parts)]


def _error(future: Future[Any]) -> BaseException | None:
    try:
        return future.exception()
    except CancelledError as error:
        return error


def processors() -> int:
    """`SEATRIAL_THREADS`, else the processors this process may use."""
    named = os.environ.get("SEATRIAL_THREADS")
    if named:
        return max(int(named), 1)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def threads(number: int | None = None) -> Generator[Pool, None, None]:
    """Threads of this process; None takes `processors()`."""
    count = number or processors()
    executor = ThreadPoolExecutor(count)
    try:
        yield Pool(executor, lambda: count)
    finally:
        executor.shutdown(cancel_futures=True)


@contextmanager
def processes(number: int) -> Generator[Pool, None, None]:
    """Processes of their own, for work that holds Python's lock; they end with this one, also when it is killed.

    Raises:
        RunError: one of them was killed.
    """
    from concurrent.futures import ProcessPoolExecutor  # a fifth of a short command's imports
    from multiprocessing import get_context

    executor = ProcessPoolExecutor(number, get_context("spawn"), initializer=_end_with_parent)
    try:
        yield Pool(executor, lambda: number, away=True)
    except BrokenExecutor:
        raise RunError("a process that computes was killed, or ran out of memory; what is done is kept: "
                       "run the same command again") from None  # fmt: skip
    finally:
        executor.shutdown(cancel_futures=True)


def _end_with_parent() -> None:
    """A killed parent leaves the pipe of its workers open, on which they would wait for ever."""
    from multiprocessing import parent_process

    parent = parent_process()

    def watch() -> None:
        if parent is not None:
            parent.join()
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def dask(address: str, told: Callable[[str], object] = lambda text: None) -> Generator[Pool, None, None]:
    """The workers of a Dask cluster: ``tcp://HOST:PORT`` (or tls) of a scheduler, or ``local:N`` for N processes here.

    Raises:
        RequestError: Dask is not installed, or no scheduler answers at the address.
    """
    try:
        import distributed
    except ImportError:
        raise RequestError("--dask needs Dask: pip install 'seatrial[cluster]'") from None
    count = _local(address)
    if not count and not _ADDRESS.fullmatch(address):
        raise RequestError(f"--dask is '{address}'; write tcp://HOST:PORT of a scheduler, or local:N")
    package: Any = distributed
    cluster: Any = None
    if count:
        cluster = package.LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None,
                                       env={"SEATRIAL_THREADS": "1"})
    try:
        client = package.Client(cluster or address, set_as_default=False)
    except (OSError, ValueError) as error:
        wanted = "write tcp://HOST:PORT or local:N"
        raise RequestError(f"--dask {address}: no scheduler answers ({first_line(error)}); {wanted}") from None
    try:
        told(f"Dask: {_width(client)} threads of workers at {client.scheduler.address}"
             + (f", dashboard {client.dashboard_link}" if not count else ""))  # fmt: skip
        executor = client.get_executor(pure=False)
        yield Pool(executor, lambda: _width(client), _lost, lambda: _answering(client, address), away=True)
    finally:
        client.close(timeout=5)
        if cluster is not None:
            cluster.close(timeout=10)


def _local(address: str) -> int:
    if not address.startswith(_LOCAL):
        return 0
    count = address[len(_LOCAL) :]
    if not (count.isdecimal() and int(count) > 0):
        raise RequestError(f"--dask is '{address}'; write local:N with N of 1 or more, or tcp://HOST:PORT")
    return int(count)


def _width(client: Any) -> int:
    try:
        return sum(client.nthreads().values())
    except OSError:  # the scheduler is being lost
        return 1


def _lost(error: BaseException) -> bool:
    """Whether a piece was lost with its worker or the scheduler."""
    from distributed import KilledWorker
    from distributed.comm.core import CommClosedError

    return isinstance(error, KilledWorker | CommClosedError | CancelledError)


def _answering(client: Any, address: str) -> None:
    """Wait for a scheduler that does not answer.

    Raises:
        ClusterError: it does not come back.
    """
    end = time.monotonic() + _PATIENCE
    while client.status != "running":
        if client.status == "closed" or time.monotonic() > end:
            raise ClusterError(f"--dask {address}: the scheduler is lost; what is done is kept: "
                               "run the same command again")  # fmt: skip
        time.sleep(0.5)

"""A pool of work: how much is under way, what is sent again, and which error ends it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from seatrial.core.errors import ClusterError, RequestError, RunError
from seatrial.core.executors import Pool, at_version, dask, parted, processes, threads
from seatrial.core.version import __version__


class LostError(Exception):
    """A worker went away."""


class Late:
    """An executor that computes a piece when the next one, or none, is asked for; it counts what is under way."""

    def __init__(self, fails: Callable[[int], BaseException | None] = lambda k: None) -> None:
        self.fails, self.sent, self.open, self.most = fails, list[Any](), list[Future[Any]](), 0

    def submit(self, work: Callable[..., Any], /, *piece: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.sent.append(piece)
        self.open = [one for one in self.open if not one.done()] + [future]
        self.most = max(self.most, len(self.open))
        error = self.fails(len(self.sent))
        if error is None:
            future.set_result(work(*piece))
        else:
            future.set_exception(error)
        return future


def test_results_come_in_the_order_of_the_pieces() -> None:
    with ThreadPoolExecutor(3) as threads:
        pool = Pool(threads, lambda: 3)
        assert list(pool.ordered(lambda k: k * k, ((k,) for k in range(20)))) == [k * k for k in range(20)]
        assert sorted(pool.each(lambda a, b: a - b, ((k, 1) for k in range(20)))) == list(range(-1, 19))
        assert pool.result(pool.submit(lambda a, b: a - b, 5, 2)) == 3


@pytest.mark.parametrize(("width", "most"), [(0, 2), (1, 2), (3, 6)])
def test_twice_the_width_is_sent_before_the_first_result_is_taken(width: int, most: int) -> None:
    executor = Late()
    found = Pool(executor, lambda: width).each(lambda k: k, ((k,) for k in range(50)))
    next(found)
    assert len(executor.sent) == most
    found.close()


def test_a_lost_piece_is_sent_again_and_another_error_ends_the_work() -> None:
    checks: list[int] = []
    once = Late(lambda k: LostError() if k == 2 else None)
    pool = Pool(once, lambda: 1, lambda error: isinstance(error, LostError), lambda: checks.append(1))
    assert sorted(pool.each(lambda k: k, ((k,) for k in range(5)))) == [0, 1, 2, 3, 4]
    assert (len(once.sent), len(checks)) == (6, 1)
    with pytest.raises(ZeroDivisionError):
        list(Pool(Late(lambda k: ZeroDivisionError()), lambda: 1).each(lambda k: k, [(1,)]))
    always = Late(lambda k: LostError())
    with pytest.raises(LostError):
        list(Pool(always, lambda: 1, lambda error: isinstance(error, LostError)).each(lambda k: k, [(1,)]))
    assert len(always.sent) > 1


def test_a_worker_of_another_version_computes_nothing() -> None:
    assert at_version(__version__, divmod, 7, 2) == (3, 1)
    with pytest.raises(RunError, match=rf"a worker has seatrial {__version__}, this is 9\.9"):
        at_version("9.9", divmod, 7, 2)
    away = Late()
    assert Pool(away, lambda: 1, away=True).submit(divmod, 7, 2).result() == (3, 1)
    assert away.sent == [(__version__, divmod, 7, 2)]


@pytest.mark.slow
@pytest.mark.parametrize("address", ["local:0", "local:", "local:-1", "local:two", "local:1.5"])
def test_a_local_cluster_has_a_whole_number_of_workers(address: str) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(RequestError, match="local:N with N of 1 or more"), dask(address):
        pass


@pytest.mark.parametrize(("count", "width"), [(0, 2), (1, 3), (7, 2), (100, 3)])
def test_parts_hold_each_number_once_in_their_order(count: int, width: int) -> None:
    found = parted(count, Pool(Late(), lambda: width))
    assert [k for part in found for k in part] == list(range(count))
    sizes = [len(part) for part in found]
    assert len(found) == max(min(width, count), 1)
    assert max(sizes) - min(sizes) <= 1


def test_threads_are_as_many_as_asked_for() -> None:
    with threads(3) as pool:
        assert pool.width() == 3
        assert not pool.away
        assert list(pool.ordered(divmod, [(7, 2), (9, 4)])) == [(3, 1), (2, 1)]


def test_a_piece_may_be_lost_a_hundred_times() -> None:
    for losses, done in ((100, True), (101, False)):
        late = Late(lambda k, losses=losses: LostError() if k <= losses else None)
        pool = Pool(late, lambda: 1, lambda error: isinstance(error, LostError))
        if done:
            assert list(pool.each(lambda k: k, [(1,)])) == [1]
            continue
        with pytest.raises(LostError):
            list(pool.each(lambda k: k, [(1,)]))


def test_a_lost_result_is_told_and_a_failed_one_raises_its_own() -> None:
    checks: list[int] = []
    late = Late(lambda k: LostError("gone") if k == 1 else ZeroDivisionError())
    pool = Pool(late, lambda: 1, lambda error: isinstance(error, LostError), lambda: checks.append(1))
    with pytest.raises(ClusterError, match=r"a piece of work is lost \(gone\); run the same command again"):
        pool.result(pool.submit(divmod, 1, 1))
    assert checks == [1]
    with pytest.raises(ZeroDivisionError):
        pool.result(pool.submit(divmod, 1, 1))
    assert checks == [1]


@pytest.mark.slow
def test_processes_compute_elsewhere_and_one_that_is_killed_is_a_line() -> None:
    with processes(2) as pool:
        pids = set(pool.each(_pid, ((k,) for k in range(6))))
    assert pids
    assert os.getpid() not in pids
    with pytest.raises(RunError, match="was killed, or ran out of memory; what is done is kept"), processes(1) as pool:
        list(pool.each(os.kill, [(next(iter(pool.each(_pid, [(0,)]))), signal.SIGKILL)]))


def _pid(_: int) -> int:
    return os.getpid()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="asks /proc")
def test_processes_do_not_outlive_a_killed_parent() -> None:
    code = ("import os, time\nfrom seatrial.core.executors import processes\nif __name__ == '__main__':\n"
            "    with processes(1) as pool:\n        print(pool.submit(os.getpid).result(), flush=True)\n"
            "        time.sleep(60)\n")  # fmt: skip
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as parent:
        assert parent.stdout is not None
        about = Path(f"/proc/{int(parent.stdout.readline())}/stat")
        assert about.exists()
        parent.kill()
    for _ in range(200):  # it ends by itself, and is waited for here no longer than it has to
        if not about.exists() or about.read_text().split()[2] == "Z":
            return
        time.sleep(0.05)
    pytest.fail(f"{about}: the process is still there")

"""Campaigns on a cluster: lost workers and a lost scheduler cost the parts under way, and change no byte."""

from __future__ import annotations

import math
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from killed import CAMPAIGN, finished, started

from seatrial.campaign.folder import open_folder
from seatrial.core.errors import ClusterError, RequestError
from seatrial.core.executors import Pool, dask


class LostError(Exception):
    """A piece lost with its worker."""


class Unreliable:
    """An executor that loses every third piece."""

    def __init__(self, pool: ThreadPoolExecutor) -> None:
        self.pool, self.count = pool, 0

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Future[Any]:
        self.count += 1
        return self.pool.submit(_lose if self.count % 3 == 0 else fn, *args)


def _lose(*_: object) -> int:
    raise LostError


def square(number: int) -> int:
    if number < 0:
        raise ValueError("negative")
    return number * number


def test_lost_pieces_are_sent_again_and_each_counts_once() -> None:
    with ThreadPoolExecutor(3) as threads:
        pool = Pool(Unreliable(threads), lambda: 3, lambda error: isinstance(error, LostError))
        assert sorted(pool.each(square, ((n,) for n in range(50)))) == [n * n for n in range(50)]


def test_a_piece_that_fails_is_not_sent_again() -> None:
    with ThreadPoolExecutor(1) as threads, pytest.raises(ValueError, match="negative"):
        list(Pool(threads, lambda: 1, lambda error: isinstance(error, LostError)).each(square, [(1,), (-1,), (2,)]))


def test_a_piece_that_is_always_lost_ends_the_work() -> None:
    with ThreadPoolExecutor(1) as threads, pytest.raises(LostError):
        list(Pool(threads, lambda: 1, lambda error: isinstance(error, LostError)).each(_lose, [(1,)]))


def test_a_cluster_that_is_gone_ends_the_work() -> None:
    def gone() -> None:
        raise ClusterError("the scheduler is lost")

    with ThreadPoolExecutor(1) as threads, pytest.raises(ClusterError):
        list(Pool(threads, lambda: 1, lambda error: isinstance(error, LostError), gone).each(_lose, [(1,)]))


@pytest.mark.slow
@pytest.mark.parametrize("address", ["blah", "local:0", "local:two", "127.0.0.1:8786"])
def test_addresses_that_are_none(address: str) -> None:
    pytest.importorskip("distributed")
    with pytest.raises(RequestError, match="--dask"), dask(address):
        pass


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def serving(stack: ExitStack, *command: str) -> subprocess.Popen[bytes]:
    process = subprocess.Popen([sys.executable, "-m", *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def scheduler(stack: ExitStack, port: int) -> subprocess.Popen[bytes]:
    options = ("--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    process = serving(stack, "distributed.cli.dask_scheduler", *options)
    for _ in range(300):
        with socket.socket() as one:
            if one.connect_ex(("127.0.0.1", port)) == 0:
                return process
        time.sleep(0.1)
    raise AssertionError("no scheduler came up")


def worker(stack: ExitStack, address: str) -> subprocess.Popen[bytes]:
    options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "30")
    return serving(stack, "distributed.cli.dask_worker", address, *options)


@pytest.mark.long
def test_lost_workers_and_a_lost_scheduler_change_no_byte(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    file = tmp_path / "campaign.toml"
    file.write_text(CAMPAIGN.format(runs=400_000, chunk=5000, duration=80.0))
    finished(file, tmp_path / "threads")
    out, port = tmp_path / "cluster", free_port()
    address = f"tcp://127.0.0.1:{port}"
    with ExitStack() as stack:
        head = scheduler(stack, port)
        workers = [worker(stack, address) for _ in range(3)]
        process = stack.enter_context(started(file, out, "--dask", address))
        for turn in range(3):
            _until_there_are(out, 5 + 10 * turn)
            workers[turn].kill()
            workers.append(worker(stack, address))
        _until_there_are(out, 40)
        head.kill()
        _, said = process.communicate(timeout=180)
        assert process.returncode == 1, said.decode()
        assert "scheduler is lost" in said.decode()
        done = len(list(out.glob("parts/*/*.parquet")))
        assert 40 <= done < math.ceil(400_000 / 5000)
        scheduler(stack, port)
        for _ in range(3):
            worker(stack, address)
        finished(file, out, "--dask", address)
    assert open_folder(out).digest() == open_folder(tmp_path / "threads").digest()


def _until_there_are(out: Path, parts: int) -> None:
    for _ in range(1200):
        if len(list(out.glob("parts/*/*.parquet"))) >= parts:
            return
        time.sleep(0.1)
    raise AssertionError(f"no {parts} parts")

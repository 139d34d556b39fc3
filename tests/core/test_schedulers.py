"""The workers of a cluster behind the one door: a stand-in for Dask that notes what it is asked for."""

from __future__ import annotations

import os
import sys
from concurrent.futures import CancelledError, ThreadPoolExecutor
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from seatrial.core import executors
from seatrial.core.errors import ClusterError, RequestError
from seatrial.core.executors import _answering, _width, dask, processors, threads


class KilledError(Exception):
    """A worker was killed."""


class ClosedError(OSError):
    """A connection was closed."""


class Client:
    """A scheduler of two machines with three and two threads."""

    def __init__(self, noted: list[Any], status: str = "running") -> None:
        self.noted, self.status = noted, status
        self.scheduler, self.dashboard_link = SimpleNamespace(address="tcp://there:1"), "http://there"

    def nthreads(self) -> dict[str, int]:
        if self.status == "lost":
            raise OSError("gone")
        return {"a": 3, "b": 2}

    def get_executor(self, **given: Any) -> ThreadPoolExecutor:
        self.noted.append(("executor", given))
        return ThreadPoolExecutor(1)

    def close(self, **given: Any) -> None:
        self.noted.append(("client closed", given))


@pytest.fixture
def noted(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    found: list[Any] = []
    package, comm, core = ModuleType("distributed"), ModuleType("distributed.comm"), ModuleType("distributed.comm.core")

    def cluster(**given: Any) -> Any:
        found.append(("cluster", given))
        return SimpleNamespace(name="ours", close=lambda **more: found.append(("cluster closed", more)))

    def client(at: Any, **given: Any) -> Client:
        found.append(("client", at if isinstance(at, str) else at.name, given))
        if at == "tcp://nowhere:1":
            raise OSError("timed out\nand more")
        return Client(found)

    package.__dict__.update(LocalCluster=cluster, Client=client, KilledWorker=KilledError, comm=comm)
    core.__dict__.update(CommClosedError=ClosedError)
    for name, module in (("distributed", package), ("distributed.comm", comm), ("distributed.comm.core", core)):
        monkeypatch.setitem(sys.modules, name, module)
    return found


def test_a_cluster_of_this_machine_is_made_and_closed(noted: list[Any]) -> None:
    said: list[str] = []
    with dask("local:4", said.append) as pool:
        assert pool.width() == 5
        assert pool.away
        assert pool.submit(divmod, 7, 2).result() == (3, 1)
        assert [pool.lost(one) for one in (KilledError(), ClosedError(), CancelledError(), ValueError())] == [
            True, True, True, False
        ]  # fmt: skip
        pool.check()
    assert said == ["Dask: 5 threads of workers at tcp://there:1"]
    assert noted == [
        ("cluster", {"n_workers": 4, "threads_per_worker": 1, "dashboard_address": None,
                     "env": {"SEATRIAL_THREADS": "1"}}),
        ("client", "ours", {"set_as_default": False}), ("executor", {"pure": False}),
        ("client closed", {"timeout": 5}), ("cluster closed", {"timeout": 10}),
    ]  # fmt: skip


def test_a_scheduler_elsewhere_is_found_and_left_there(noted: list[Any]) -> None:
    said: list[str] = []
    with dask("tcp://there:8786", said.append):
        pass
    assert said == ["Dask: 5 threads of workers at tcp://there:1, dashboard http://there"]
    assert [one[0] for one in noted] == ["client", "executor", "client closed"]
    assert noted[0][1] == "tcp://there:8786"
    with pytest.raises(RequestError, match=r"--dask tcp://nowhere:1: no scheduler answers \(timed out\); write"):
        dask("tcp://nowhere:1").__enter__()
    for address in ("there:8786", "tcp://there", "tcp://:1"):
        with pytest.raises(RequestError, match="write tcp://HOST:PORT of a scheduler, or local:N"):
            dask(address).__enter__()


def test_a_lost_scheduler_is_waited_for_a_minute_and_no_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    client, clock = Client([], "connecting"), [0.0]
    monkeypatch.setattr(executors.time, "monotonic", lambda: clock[0])

    def sleep(seconds: float, until: float, status: str) -> None:
        clock[0] += seconds
        client.status = status if clock[0] >= until else client.status

    monkeypatch.setattr(executors.time, "sleep", lambda s: sleep(s, 59.0, "running"))
    _answering(client, "there")
    assert clock[0] == 59.0
    client.status, clock[0] = "connecting", 0.0
    monkeypatch.setattr(executors.time, "sleep", lambda s: sleep(s, 62.0, "running"))
    with pytest.raises(ClusterError, match="--dask there: the scheduler is lost"):
        _answering(client, "there")
    assert 60.0 < clock[0] < 62.0
    client.status = "closed"
    before = clock[0]
    with pytest.raises(ClusterError):
        _answering(client, "there")
    assert clock[0] == before
    assert _width(Client([], "lost")) == 1


def test_threads_are_those_named_or_those_of_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    for said, wanted in (("3", 3), ("0", 1), ("-2", 1)):
        monkeypatch.setenv("SEATRIAL_THREADS", said)
        assert processors() == wanted
        with threads() as pool:
            assert pool.width() == wanted
    monkeypatch.setenv("SEATRIAL_THREADS", "")
    if hasattr(os, "sched_getaffinity"):
        assert processors() == len(os.sched_getaffinity(0))
        monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(os, "cpu_count", lambda: 6)
    assert processors() == 6
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert processors() == 1

"""A table of fits, each on a worker: the same numbers, files in the run folder, and no fit twice."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Generator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.core import executors
from seatrial.core.executors import Pool
from seatrial.study.store import read_summary
from seatrial.workflow import Silent
from seatrial.workflow.identify import identify
from two_zigzags import write_zigzags

pytestmark = pytest.mark.slow

TABLE = """schema = "seatrial-series/1"
[data]
root = "logs"
test = { starboard = "starboard" }
[loss]
sigma = { x = 9.0, y = 9.0, psi = 0.5, u = 0.1, v_m = 0.1, r = 0.1 }
[fits.one]
ship = "kvlcc2_l7"
train = ["port"]
free = { "hull.N_r" = { prior = 0.3 } }
estimator = { type = "shooting:Trajectory", window = 30.0, iterations = 3 }
[fits.two]
like = "one"
free = { "hull.N_v" = { prior = 0.3 } }
"""


class Notes(Silent):
    def __init__(self) -> None:
        self.lines: list[str] = []

    def note(self, line: str) -> None:
        self.lines.append(line)


class Pickling:
    """Sends everything through a pickle, as a worker gets it."""

    def __init__(self, threads: ThreadPoolExecutor) -> None:
        self.threads, self.sent = threads, 0

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Future[Any]:
        self.sent += 1
        return self.threads.submit(lambda piece: _worked(piece), pickle.dumps((fn, args)))


def _worked(piece: bytes) -> Any:
    fn, args = pickle.loads(piece)
    return pickle.loads(pickle.dumps(fn(*args)))


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    at = tmp_path_factory.mktemp("table")
    write_zigzags(at / "logs")
    (at / "table.toml").write_text(TABLE)
    return at / "table.toml"


@pytest.fixture(scope="module")
def here(table: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("here") / "run"
    identify(table, out)
    return out


def same(one: Path, other: Path) -> None:
    for fit in ("one", "two"):
        a, b = (read_summary(out / "fits" / fit / "one") for out in (one, other))
        assert repr(a.parameters) == repr(b.parameters)  # NaN too
        assert (a.objective, a.digest) == (b.objective, b.digest)
        assert np.array_equal(a.covariance, b.covariance)


def test_each_fit_goes_to_a_worker_once(
    table: Path, here: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with ThreadPoolExecutor(2) as threads:
        pickling = Pickling(threads)

        @contextmanager
        def cluster(address: str, told: object = None) -> Generator[Pool, None, None]:
            assert address == "tcp://head:8786"
            yield Pool(pickling, lambda: 2, away=True)

        monkeypatch.setattr(executors, "dask", cluster)
        sink, out = Notes(), tmp_path / "run"
        found = identify(table, out, dask="tcp://head:8786", sink=sink)
        assert set(found.result) == {"one, one", "two, one"}
        assert pickling.sent == 2
        assert any(line.startswith("2 of 2 done") for line in sink.lines)
        same(here, out)
        assert (out / "report.html").exists()
        (out / "fits" / "two" / "one" / "fit.json").unlink()
        identify(table, out, dask="tcp://head:8786")
        assert pickling.sent == 3
        same(here, out)
        for page in ("report.html", "report.json"):  # it is of what is done, whoever did it, and so made anew
            (out / page).unlink()
        identify(table, out, dask="tcp://head:8786")
        assert pickling.sent == 3
        assert (out / "report.html").exists()
        assert (out / "report.json").exists()


@pytest.mark.long
def test_by_dask_from_the_command_line(table: Path, here: Path, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    assert main(["identify", str(table), "-o", str(tmp_path / "run"), "--dask", "local:2"]) == 0
    same(here, tmp_path / "run")


def test_no_address_is_refused_and_nothing_is_fitted(table: Path, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    assert main(["identify", str(table), "-o", str(tmp_path / "run"), "--dask", "blah"]) == 2
    assert not (tmp_path / "run").exists() or not list((tmp_path / "run").rglob("fit.json"))

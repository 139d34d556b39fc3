"""A case that is killed again and again, shared or spread ends in the same bytes as one that is left alone."""

from __future__ import annotations

import random
import shutil
import subprocess
import time
from pathlib import Path

import pytest

from interrupted import seatrial

CASE = """schema = "seatrial-case/1"
claim = "it keeps clear"
ship = "kvlcc2_l7"
stack = "stack.py:good"
traffic = ["rules", "ignores", "late"]
[sensors.radar]
[weather]
wind = [0.0, 2.0]
[encounters]
roles = ["give-way", "stand-on"]
runs = {runs}
duration = 60.0
"""


def written(folder: Path, runs: int) -> Path:
    (folder / "stack.py").write_text("from seatrial.encounters.avoiding import good\n", encoding="utf-8")
    path = folder / "case.toml"
    path.write_text(CASE.format(runs=runs), encoding="utf-8")
    return path


def done(*arguments: str | Path) -> int:
    """The exit status of a command that is left alone, its pipes closed."""
    one = seatrial(*arguments)
    one.communicate()
    return one.returncode


def held(folder: Path) -> dict[str, bytes]:
    """All files of a case but locks and what a killed process left half-written, whose names begin with a dot."""
    return {one.name: one.read_bytes() for one in sorted(folder.iterdir()) if one.is_file() and one.name[0] != "."}


@pytest.mark.long
def test_twenty_kills_at_random_leave_the_bytes_as_they_are(tmp_path: Path) -> None:
    """Parts, page or nothing may be under way at a kill; a case that ends before it is compared and begun anew."""
    path = written(tmp_path, 5000)
    began = time.monotonic()
    assert done("case", path, "-o", tmp_path / "whole") == 0
    taken, rng, kills, whole = time.monotonic() - began, random.Random(38), 0, held(tmp_path / "whole")
    assert len(whole) == 5 + 3
    out = tmp_path / "killed"
    while kills < 20:
        one = seatrial("case", path, "-o", out)
        try:
            one.communicate(timeout=rng.uniform(0.2, 0.9) * taken)
        except subprocess.TimeoutExpired:
            one.kill()
            one.communicate()
            kills += 1
            continue
        assert one.returncode == 0
        assert held(out) == whole
        shutil.rmtree(out)
    assert done("case", path, "-o", out) == 0
    assert held(out) == whole


@pytest.mark.long
def test_shards_processes_and_a_cluster_write_the_bytes_of_one_process(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    path = written(tmp_path, 3_500)
    ways = {"processes": [()], "shards": [("--shard", "1/2"), ("--shard", "2/2")], "dask": [("--dask", "local:2")]}
    for name, calls in ways.items():
        for more in calls:
            assert done("case", path, "-o", tmp_path / name, *more) == 0
    dask = seatrial("case", path, "-o", tmp_path / "killed", "--dask", "local:2")
    for _ in range(600):  # until the first part is there
        time.sleep(0.1)
        if list((tmp_path / "killed").glob("part-*")):
            break
    dask.kill()
    dask.communicate()
    assert done("case", path, "-o", tmp_path / "killed", "--dask", "local:2") == 0
    first, *others = (held(tmp_path / name) for name in (*ways, "killed"))
    assert len(first) == 4 + 3
    assert all(one == first for one in others)

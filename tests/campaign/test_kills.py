"""A campaign that is killed at random moments ends with the same bytes, and computes nothing twice that was done."""

from __future__ import annotations

import random
import signal
import time
from pathlib import Path

import pytest
from killed import CAMPAIGN, started

from seatrial.campaign.folder import Held, open_folder
from seatrial.campaign.tables import wrong_parts
from seatrial.cli.app import main


def here(file: Path, folder: Path, *options: str) -> None:
    """The command to its end, in this process."""
    assert main(["campaign", str(file), "-o", str(folder), "--json", *options]) == 0


def left_by_kills(file: Path, folder: Path, kills: int, longest: float, shards: int) -> Held:
    """The folder after so many kills; parts that a kill has left are never written again."""
    chance, seen = random.Random(1), {}
    for kill in range(kills):
        process = started(file, folder, "--threads", str(1 + kill % 2), "--shard", f"{1 + kill % shards}/{shards}")
        manifest = folder / "campaign.json"
        while process.poll() is None and not manifest.exists():
            time.sleep(0.02)
        time.sleep(chance.uniform(0.0, longest))
        process.send_signal(signal.SIGKILL)
        process.communicate()
        now = {path: path.stat().st_mtime_ns for path in folder.glob("parts/*/*.parquet")}
        assert all(now[path] == at for path, at in seen.items())
        seen = now
    for shard in range(shards):
        here(file, folder, "--shard", f"{1 + shard}/{shards}")
    assert all(path.stat().st_mtime_ns == at for path, at in seen.items())
    assert not list(folder.rglob("*.tmp"))
    return open_folder(folder)


def compare(tmp_path: Path, runs: int, chunk: int, duration: float, kills: int, longest: float, shards: int) -> None:
    file = tmp_path / "campaign.toml"
    file.write_text(CAMPAIGN.format(runs=runs, chunk=chunk, duration=duration))
    here(file, tmp_path / "whole", "--threads", "2")
    killed = left_by_kills(file, tmp_path / "killed", kills, longest, shards)
    assert not list(wrong_parts(killed))
    assert killed.digest() == open_folder(tmp_path / "whole").digest()


@pytest.mark.slow
def test_kills_change_no_byte(tmp_path: Path) -> None:
    compare(tmp_path, 100_000, 2000, 20.0, 2, 0.4, 1)


@pytest.mark.long
@pytest.mark.parametrize("shards", [1, 3])
def test_forty_kills_of_a_million_runs(tmp_path: Path, shards: int) -> None:
    """`benchmarks/kills.py` kills a hundred times in ten million runs."""
    compare(tmp_path, 1_000_000, 8192, 80.0, 20, 2.0, shards)

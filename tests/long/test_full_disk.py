"""A disk that fills while a study runs: one line, exit 1; once there is space, the numbers of an undisturbed run."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.approach import approach
from seatrial.simulate.run import simulate

pytestmark = pytest.mark.long
STUDY = """schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "{root}"
train = ["*"]
[free]
"hull.*" = {{ ratio = 0.5 }}
[estimator]
type = "shooting:Trajectory"
window = 20.0
every = 2
starts = 2
tolerance = 1e-10
"""
SIZES = (4, 8, 16, 24, 36, 48, 72, 96, 128, 192)
"""Kilobytes of the disk: from too small for the claim of the folder to too small for the report."""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    ship, rng = load("kvlcc2_l7"), np.random.default_rng(5)
    n_P, noise = approach(ship)[1], Sensors(noise={"u": 0.01, "v_m": 0.01, "r": 0.002, "psi": 0.005})
    (folder / "trials").mkdir()
    for k, policy in enumerate((Turning(n_P, math.radians(35)), Zigzag(n_P, math.radians(20), math.radians(20)))):
        run = noise.read(simulate(ship, policy, duration=120.0, dt=0.1, name=f"t{k}"), rng)
        write_trial(run, folder / "trials" / f"t{k}.csv")
    (folder / "study.toml").write_text(STUDY.format(root=folder / "trials"))
    return folder / "study.toml"


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of its own, whose size a test sets; skipped where none may be mounted."""
    where = tmp_path / "disk"
    where.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=4k", "tmpfs", str(where)]
    done = subprocess.run(mount, capture_output=True, check=False)
    if done.returncode:
        pytest.skip("mounting a small tmpfs needs root")
    yield where
    subprocess.run(["umount", str(where)], check=True)


def resized(disk: Path, kilobytes: int) -> None:
    subprocess.run(["mount", "-o", f"remount,size={kilobytes}k", str(disk)], check=True)


def identify(study: Path, out: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "seatrial", "identify", str(study), "-o", str(out)]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ)


def numbers(out: Path) -> object:
    return json.loads((out / "fit.json").read_text())["parameters"]


def test_ten_full_disks_end_with_the_same_numbers(study: Path, disk: Path, tmp_path: Path) -> None:
    assert identify(study, tmp_path / "whole").returncode == 0
    model = (tmp_path / "whole" / "model.toml").read_text().splitlines()
    filled = 0
    for size in SIZES:
        resized(disk, size)
        done = identify(study, disk / "run")
        assert "Traceback" not in done.stderr
        if done.returncode:
            filled += 1
            assert done.returncode == 1, done.stderr
            (said,) = [line for line in done.stderr.splitlines() if line.startswith("error:")]
            assert "No space left on device" in said
        resized(disk, 65536)
        again = identify(study, disk / "run")
        assert again.returncode == 0, again.stderr
        assert numbers(disk / "run") == numbers(tmp_path / "whole")
        saved = (disk / "run" / "model.toml").read_text().splitlines()
        assert [line for line in saved if "date" not in line] == [line for line in model if "date" not in line]
        left = [path.name for path in (disk / "run").iterdir()]
        assert not [name for name in left if name.startswith(".") or name.endswith((".tmp", ".partial"))], left
        for path in (disk / "run").iterdir():
            path.unlink()
        (disk / "run").rmdir()
    assert filled >= 8

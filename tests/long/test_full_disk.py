"""A disk that fills while a study runs: one line, exit 1; once there is space, the numbers of an undisturbed run."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from interrupted import STUDY, TRAJECTORY, lasting, seatrial, write_trials

pytestmark = pytest.mark.long
SIZES = (4, 8, 16, 24, 36, 48, 72, 96, 128, 192)
"""Kilobytes of the disk: from too small for the claim of the folder to too small for the report."""


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    write_trials(folder / "trials", 120.0, (35,), (20,))
    (folder / "study.toml").write_text(STUDY + TRAJECTORY)
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


def identify(study: Path, out: Path) -> tuple[int, str]:
    """Exit status and messages."""
    run = seatrial("identify", study, "-o", out)
    _, said = run.communicate()
    return run.returncode, said


def test_ten_full_disks_end_with_the_same_numbers(study: Path, disk: Path, tmp_path: Path) -> None:
    assert identify(study, tmp_path / "whole")[0] == 0
    filled = 0
    for size in SIZES:
        resized(disk, size)
        status, said = identify(study, disk / "run")
        assert "Traceback" not in said
        if status:
            filled += 1
            assert status == 1, said
            (line,) = [line for line in said.splitlines() if line.startswith("error:")]
            assert "No space left on device" in line
        resized(disk, 65536)
        status, said = identify(study, disk / "run")
        assert status == 0, said
        assert lasting(disk / "run") == lasting(tmp_path / "whole")
        for path in (disk / "run").iterdir():
            path.unlink()
        (disk / "run").rmdir()
    assert filled >= 8

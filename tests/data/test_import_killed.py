"""An import leaves all of its trials or none that a reader would take for all, wherever it is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.core import files
from seatrial.data import DataError
from seatrial.data.folder import read_folder
from seatrial.data.importing import import_log
from seatrial.data.trialfile import PART, read_trial, read_trials

TRIALS = 6
MAPPING = """schema = "seatrial-mapping/1"
time = { column = "time", unit = "s" }

[channels]
psi = { column = "heading", unit = "deg" }
"""
# Kills itself before the file of that number is written, or takes its place.
KILLED = """
import os, signal, sys
from seatrial.core import files
from seatrial.data.importing import import_log

where, number, *given = sys.argv[1:]
left = int(number)

def counted(real):
    def call(*arguments):
        global left
        if left == 0:
            os.kill(os.getpid(), signal.SIGKILL)
        left -= 1
        return real(*arguments)
    return call

owner, name = (files.os, "replace") if where == "replace" else (files, "_fill")
setattr(owner, name, counted(getattr(owner, name)))
import_log("csv", *given)
"""


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    folder = tmp_path / "logs"
    folder.mkdir()
    for k in range(TRIALS):
        rows = "\n".join(f"{t},{t * k % 360}" for t in range(30))
        (folder / f"log_{k}.csv").write_text(f"time,heading\n{rows}\n")
    (tmp_path / "mapping.toml").write_text(MAPPING)
    return folder


def content(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def killed(where: str, number: int, logs: Path, out: Path) -> None:
    given = (str(logs), str(out), str(logs.with_name("mapping.toml")))
    ended = subprocess.run([sys.executable, "-c", KILLED, where, str(number), *given], check=False)
    assert ended.returncode == -signal.SIGKILL


def imported(logs: Path, out: Path) -> list[Path]:
    return import_log("csv", logs, out, logs.with_name("mapping.toml"))


def refused(out: Path) -> None:
    """Every way to read the folder says that it is a part."""
    one = next(path for path in sorted(out.glob("*.csv")))
    for read in (lambda: read_trials(out), lambda: read_trial(one), lambda: read_folder(out)):
        with pytest.raises(DataError, match="a part of its trials"):
            read()
    assert main(["check", str(out)]) == 2


@pytest.mark.slow
@pytest.mark.parametrize(("where", "number"), [
    ("fill", 0), ("fill", 5), ("fill", 2 * TRIALS), ("replace", 0), ("replace", 1), ("replace", 2), ("replace", 7),
    ("replace", 2 * TRIALS),
])  # fmt: skip
def test_a_killed_import_is_none_or_is_told_as_a_part(where: str, number: int, logs: Path, tmp_path: Path) -> None:
    whole, out = tmp_path / "whole", tmp_path / "out"
    imported(logs, whole)
    killed(where, number, logs, out)
    there = [path for path in out.glob("*.csv") if not path.name.startswith(".")]
    assert (len(there) > 0) == (where == "replace" and number > 2), there
    if there:
        assert len(there) < TRIALS + 1
        refused(out)
    else:
        with pytest.raises(DataError):
            read_trials(out)
    imported(logs, out)
    files.sweep(out)
    assert content(out) == content(whole)


@pytest.mark.slow
def test_an_import_of_other_logs_removes_what_the_killed_one_left(logs: Path, tmp_path: Path) -> None:
    """But not a trial that was there before it."""
    out = tmp_path / "out"
    old, *rest = sorted(logs.iterdir())
    for path in rest:
        path.rename(tmp_path / path.name)
    imported(logs, out)
    before = content(out)
    for path in rest:
        (tmp_path / path.name).rename(path)
    killed("replace", 9, logs, out)
    refused(out)
    for path in (old, *rest[:-1]):
        path.unlink()
    (last,) = imported(logs, out)
    files.sweep(out)
    assert {name: data for name, data in content(out).items() if not name.startswith(last.stem)} == before
    assert {trial.name for trial in read_trials(out)} == {old.stem, last.stem}


@pytest.mark.slow
def test_a_full_disk_changes_nothing(logs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    imported(logs, out)
    before = content(out)
    for path in logs.iterdir():
        path.write_text(path.read_text().replace("0,0\n", "0,1\n"))
    real, left = os.fsync, [5]

    def full(handle: int) -> None:
        left[0] -= 1
        if left[0] == 0:
            raise OSError(28, "No space left on device")
        real(handle)

    with monkeypatch.context() as patch:
        patch.setattr(files.os, "fsync", full)
        with pytest.raises(DataError, match="No space left"):
            imported(logs, out)
    assert content(out) == before
    assert PART not in before
    imported(logs, out)
    assert content(out) != before


def test_who_keeps_the_part_removes_the_mark(logs: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    imported(logs, out)
    (out / PART).write_text("[]")
    with pytest.raises(DataError, match=f"remove {PART}"):
        read_trials(out)
    (out / PART).unlink()
    assert len(read_trials(out)) == TRIALS

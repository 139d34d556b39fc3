"""Files are whole or absent; leftovers of a kill go; a folder is held by one process; names are no paths."""

from __future__ import annotations

import errno
import os
import re
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.core import files
from seatrial.core.files import BusyError, held_alone, is_plain, packed, set_aside, sweep, write_together, write_whole
from seatrial.ships.files import load
from seatrial.ships.writing import save


@pytest.fixture
def full(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that takes no more bytes."""

    def fsync(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", fsync)


def test_a_full_disk_leaves_the_files_of_before_and_names_the_file(tmp_path: Path, full: None) -> None:
    page, numbers = tmp_path / "page.html", tmp_path / "page.json"
    page.write_text("old")
    with pytest.raises(OSError, match="No space left") as caught:
        write_together({page: "new", numbers: b"1"})
    assert caught.value.filename == str(page)
    assert [p.name for p in tmp_path.iterdir()] == ["page.html"]
    assert page.read_text() == "old"
    ship = load("kvlcc2_l7")
    with pytest.raises(OSError, match="No space left"):
        save(ship, tmp_path / "model.toml")
    assert [p.name for p in tmp_path.iterdir()] == ["page.html"]


@pytest.mark.parametrize(
    "command",
    [pytest.param(["imo", "mariner_nomoto", "-o", "page.html"], marks=pytest.mark.slow),
     pytest.param(["requirements", "mariner_nomoto", "--scope", "collision-avoidance", "-o", "page.html"],
                  marks=pytest.mark.long),
     ["simulate", "mariner_nomoto", "zigzag", "-o", "run.csv"], ["export", "mariner", "--python", "ship.py"]],
    ids=lambda command: command[0],
)  # fmt: skip
def test_a_command_on_a_full_disk_fails_in_one_line_and_leaves_nothing(
    command: list[str], tmp_path: Path, full: None, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    assert main(command) == 1
    (line,) = [one for one in capsys.readouterr().err.splitlines() if one.startswith("error")]
    assert re.match(rf"error: {Path(command[-1]).stem}\.\w+: ", line)
    assert "No space left" in line
    assert not list(tmp_path.iterdir())


def test_what_killed_processes_left_is_swept_and_no_more(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True)
    dead, host = int(done.stdout), files._host()
    gone = [f".run.yaml.{dead}.tmp", f".run.csv.{host}-{dead}-3.tmp"]
    kept = [f".run.csv.{host}-{os.getpid()}-0.tmp", f".run.csv.00000000-{dead}-3.tmp", "run.csv", ".hidden"]
    for name in (*gone, *kept):
        (tmp_path / name).touch()
    write_whole(tmp_path / "other.csv", "1")
    assert {p.name for p in tmp_path.iterdir()} == {*kept, "other.csv"}
    sweep(tmp_path / "absent")


def test_bytes_arrays_and_savers_are_written_whole(tmp_path: Path) -> None:
    def saver(name: str) -> None:
        Path(name).write_text("saved")

    long = tmp_path / f"{'ö' * 120}.csv"
    write_together({tmp_path / "a": b"\x00", tmp_path / "b": saver, tmp_path / "c.npz": packed(x=1), long: "text"})
    assert (tmp_path / "b").read_text() == "saved"
    assert {p.name for p in tmp_path.iterdir()} == {"a", "b", "c.npz", long.name}
    assert set_aside(tmp_path / "a").name == "a.damaged"


def test_a_folder_is_held_by_one_and_the_second_is_told_by_whom(tmp_path: Path) -> None:
    out = tmp_path / "runs" / "one"
    told = pytest.raises(BusyError, match=f"process {os.getpid()} on {socket.gethostname()}")
    with held_alone(out), told, held_alone(out):
        pass
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_hold_of_a_killed_process_is_no_hold(tmp_path: Path) -> None:
    code = f"""
import os, pathlib
from seatrial.core.files import held_alone
with held_alone(pathlib.Path({str(tmp_path)!r})):
    os._exit(9)
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 9
    assert (tmp_path / files.LOCK).exists()
    with held_alone(tmp_path):
        (tmp_path / "result").touch()
    assert [p.name for p in tmp_path.iterdir()] == ["result"]


def test_a_second_identify_on_a_folder_is_refused(tmp_path: Path, capsys) -> None:
    with held_alone(tmp_path / "run"):
        assert main(["identify", "absent.toml", "-o", str(tmp_path / "run")]) == 2
    assert f"process {os.getpid()} on" in capsys.readouterr().err


@pytest.mark.parametrize(
    "name", ["", ".", "..", ".x", "a/b", "../../X", "/abs/x", "a\\b", "a\nb", "\x1b[2J", "a\u202eb", "x" * 300]
)
def test_a_path_is_no_name(name: str) -> None:
    assert not is_plain(name)
    assert is_plain("full, seed 1 (2nd)")

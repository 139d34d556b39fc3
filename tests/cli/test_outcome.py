"""How a command ends: on Ctrl-C, on a reader that leaves, on an output that is closed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from seatrial.cli import outcome as cli_outcome
from seatrial.cli.app import main
from seatrial.workflow.request import Stopped

BUSY = """
import click, signal, sys, time
from seatrial.cli import outcome as cli_outcome

@click.command()
def work():
    print("at work", flush=True)
    {body}

sys.exit(cli_outcome.ended(work, ["--"]))
"""


def interrupted(body: str, times: int = 1) -> tuple[int, str]:
    """Status and words of a command that is sent so many Ctrl-C while it does `body`."""
    code = BUSY.format(body=body.replace("\n", "\n    "))
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", code], stdout=pipe, stderr=pipe, text=True) as run:
        if run.stdout is None:
            raise AssertionError
        run.stdout.readline()
        time.sleep(0.3)
        for _ in range(times):
            run.send_signal(signal.SIGINT)
            time.sleep(0.2)
        _, said = run.communicate(timeout=20)
    return run.returncode, said


@pytest.mark.long
@pytest.mark.parametrize(
    ("body", "times"),
    [("time.sleep(20)", 1), ("try:\n    time.sleep(20)\nfinally:\n    time.sleep(9)", 2),
     ("try:\n    time.sleep(20)\nexcept KeyboardInterrupt:\n    pass\ntime.sleep(20)", 1)],
    ids=["once", "again while it cleans up", "swallowed by a library"],
)  # fmt: skip
def test_ctrl_c_says_one_thing_once_and_exits_130(body: str, times: int) -> None:
    assert interrupted(body, times) == (130, "interrupted\n")


def test_ctrl_c_in_a_fit_says_once_how_to_go_on(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    def read_ship(_: str) -> None:
        raise Stopped("interrupted; run the same command again to go on in run")

    monkeypatch.setattr("seatrial.workflow.request.ship_of", read_ship)
    assert main(["show", "kvlcc2"]) == 130
    said = capsys.readouterr().err
    assert re.fullmatch(r"interrupted\b.*\brun\n", said)


@pytest.mark.long
def test_a_reader_that_leaves_ends_it_without_a_word() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    run = subprocess.run([sys.executable, "-m", "seatrial", "show", "kvlcc2", "--json"], stdout=writing,
                         stderr=subprocess.PIPE, text=True, check=False)  # fmt: skip
    os.close(writing)
    assert (run.returncode, run.stderr) == (cli_outcome.PIPE, "")


def test_an_output_that_is_closed_is_told_before_anything_runs(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    assert main(["ships"]) == 2
    assert re.fullmatch(r"error: standard output\b.*\n", capsys.readouterr().err)


@pytest.mark.long
def test_work_goes_on_where_nobody_reads_the_messages(tmp_path: Path) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    out = tmp_path / "run.csv"
    run = subprocess.run([sys.executable, "-m", "seatrial", "simulate", "kvlcc2_l7", "zigzag", "-o", str(out)],
                         stdout=subprocess.PIPE, stderr=writing, text=True, check=False)  # fmt: skip
    os.close(writing)
    assert (run.returncode, out.exists()) == (0, True)

"""How a command ends, in this process: its status, its one line, Ctrl-C once and twice, and plain values."""

from __future__ import annotations

import errno
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click import Command

from seatrial.cli import outcome, render
from seatrial.cli.app import main
from seatrial.core.errors import RequestError, RunError

Said = pytest.CaptureFixture[str]


@pytest.fixture
def signals(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Handlers as they were, afterwards; an interrupt that is lost is sent again at once."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGALRM)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr(outcome, "_AGAIN", 0.05)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    for number, handler in before.items():
        signal.signal(number, handler)


def ended(body: Any) -> int:
    """The status of a command that does this."""
    return outcome.ended(Command("body", callback=body), ["--"])


def interrupt() -> None:
    signal.raise_signal(signal.SIGINT)


@pytest.mark.usefixtures("signals")
def test_ctrl_c_ends_with_130_and_a_word(capsys: Said) -> None:
    assert ended(interrupt) == 130
    assert capsys.readouterr().err == "interrupted\n"
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


@pytest.mark.usefixtures("signals")
def test_a_command_that_is_done_leaves_ctrl_c_as_it_was() -> None:
    seen: list[Any] = []
    assert ended(lambda: seen.append(signal.getsignal(signal.SIGINT))) == 0
    assert seen[0] is not signal.default_int_handler
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.usefixtures("signals")
@pytest.mark.slow
def test_an_interrupt_that_a_library_swallows_comes_again_and_one_on_its_way_does_not(capsys: Said) -> None:
    def swallowing() -> None:
        with suppress(KeyboardInterrupt):
            interrupt()
        signal.sigtimedwait([], 5.0)

    assert ended(swallowing) == 130
    assert capsys.readouterr().err == "interrupted\n"
    cleaned: list[bool] = []

    def cleaning() -> None:
        try:
            interrupt()
        except KeyboardInterrupt:
            signal.sigtimedwait([], 0.2)
            cleaned.append(True)
            raise

    signal.signal(signal.SIGINT, signal.default_int_handler)
    assert ended(cleaning) == 130
    assert cleaned == [True]


@pytest.mark.usefixtures("signals")
def test_a_second_ctrl_c_ends_the_process_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    left: list[Any] = []

    def leave(status: int) -> None:
        left.append(status)
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "_exit", leave)
    monkeypatch.setattr(os, "write", lambda *given: left.append(given))

    def twice() -> None:
        try:
            interrupt()
        finally:
            interrupt()

    assert ended(twice) == 130
    assert left == [(2, b"interrupted\n"), 130]
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    assert left[2:] == [130]  # without a message: it was answered


@pytest.mark.parametrize(("error", "status", "said"), [
    (RequestError("no such ship"), 2, "error: no such ship\n"), (RunError("it blew up"), 1, "error: it blew up\n"),
    (OSError(errno.EACCES, "Permission denied", "x.csv"), 2, "error: x.csv: Permission denied\n"),
    (OSError(errno.ENOSPC, "No space left on device", "x.csv"), 1, "error: x.csv: No space left on device\n"),
    (OSError(errno.EACCES, "Permission denied"), 2, "error: standard output: Permission denied\n"),
])  # fmt: skip
def test_what_went_wrong_is_one_line_and_a_status(error: Exception, status: int, said: str, capsys: Said) -> None:
    def failing() -> None:
        raise error

    assert ended(failing) == status
    assert capsys.readouterr().err == said


def test_a_full_disk_behind_a_refusal_is_no_wrong_request(capsys: Said) -> None:
    def behind(first: Exception, *, named: bool) -> None:
        try:
            raise first
        except OSError as error:
            if named:
                raise RequestError("cannot write") from error
            raise RequestError("cannot write")  # noqa: B904

    for named in (True, False):
        assert ended(lambda named=named: behind(OSError(errno.EDQUOT, "quota"), named=named)) == 1
        assert ended(lambda named=named: behind(OSError(errno.ENOENT, "none"), named=named)) == 2
    capsys.readouterr()
    assert not outcome._no_room(None)


def test_a_full_standard_output_is_given_up(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    given_up: list[bool] = []
    monkeypatch.setattr(outcome, "_give_up_output", lambda: given_up.append(True))

    def full(name: str | None) -> None:
        raise OSError(errno.ENOSPC, "No space left on device", name)

    assert ended(lambda: full("file")) == 1
    assert given_up == []
    assert ended(lambda: full(None)) == 1
    assert given_up == [True]
    assert "error: standard output: No space" in capsys.readouterr().err


def test_a_reader_that_left_is_141_without_a_word(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    def gone() -> None:
        raise BrokenPipeError

    monkeypatch.setattr(outcome, "_give_up_output", lambda: None)
    assert ended(gone) == 141
    assert capsys.readouterr() == ("", "")


def test_a_fault_of_ours_is_not_hidden() -> None:
    with pytest.raises(ZeroDivisionError):
        ended(lambda: 1 / 0)


def test_without_a_standard_output_nothing_runs(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", None)
        assert ended(lambda: 1 / 0) == 2
    assert "standard output is closed" in capsys.readouterr().err


def test_the_first_screen_and_help_are_no_failure(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    assert main([]) == 0
    assert "seatrial demo" in capsys.readouterr().out
    monkeypatch.setattr(sys, "argv", ["seatrial"])
    assert main() == 0
    assert "seatrial demo" in capsys.readouterr().out
    monkeypatch.setattr(sys, "argv", ["seatrial", "imo", "--help"])
    assert main() == 0
    assert "MSC.137" in capsys.readouterr().out
    assert main(["imo"]) == 2
    assert main(["imo", "no_such_ship"]) == 2


def test_a_shell_is_answered_where_it_asks(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    monkeypatch.setenv("_SEATRIAL_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", "seatrial simul")
    monkeypatch.setenv("COMP_CWORD", "1")
    with pytest.raises(SystemExit):
        main(["simul"])
    assert "simulate" in capsys.readouterr().out


@pytest.mark.parametrize(("text", "value"), [
    ("2", 2.0), ("-2.5", -2.5), (".5", 0.5), ("3.", 3.0), ("1e3", 1000.0), ("+1E-2", 0.01), ("inf", float("inf")),
])  # fmt: skip
def test_plain_numbers_are_read_as_they_are_written(text: str, value: float, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    monkeypatch.setattr("seatrial.workflow.afloat.sail", lambda *given, **_: asked.append(given) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["steer", "kvlcc2", "--nmea", "udp://x", f"--factor={text}", "--seed", "12", "--mmsi", "123456789"])
    _, _, departure, _, _, wire, *_, run = asked[0]
    assert (run.factor, departure.seed, departure.mmsi) == (value, 12, 123456789)
    assert isinstance(run.factor, float)
    assert isinstance(departure.seed, int)
    assert run.out is None
    assert wire.to == ()


@pytest.mark.parametrize("text", ["two", "1,5", "0x10", "1e", "--", ""])
def test_what_is_no_number_is_told(text: str, capsys: Said) -> None:
    assert main(["steer", "kvlcc2", "--nmea", "udp://x", f"--rate={text}"]) == 2
    assert "--rate" in capsys.readouterr().err
    assert main(["steer", "kvlcc2", "--nmea", "udp://x", "--seed", "1.5"]) == 2


def test_classes_of_the_user_are_trusted_while_the_command_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    from seatrial.ships import classes

    trusted: list[Any] = []
    held = classes.trusting

    def trusting(names: Any) -> Any:
        trusted.append(tuple(names))
        return held(names)

    monkeypatch.setattr(classes, "trusting", trusting)
    monkeypatch.setattr("seatrial.workflow.judging.copy", lambda *_: SimpleNamespace(name="a", of="b"))
    assert main(["copy", "kvlcc2", "x.toml", "--trust", "mine", "--trust", "yours"]) == 0
    assert main(["copy", "kvlcc2", "x.toml"]) == 0
    assert trusted == [("mine", "yours")]


def test_a_copy_says_what_of_and_where(monkeypatch: pytest.MonkeyPatch, capsys: Said) -> None:
    monkeypatch.setattr("seatrial.workflow.judging.copy", lambda *_: SimpleNamespace(name="mine", of="kvlcc2"))
    assert main(["copy", "kvlcc2", "x.toml", "--json"]) == 0
    assert capsys.readouterr().out == '{"ship": "mine", "of": "kvlcc2", "file": "x.toml"}\n'
    assert main(["copy", "kvlcc2", str(Path("x.toml"))]) == 0
    assert capsys.readouterr().out == ""


class Lost:
    """A stream whose reader has left, on a file of its own."""

    encoding = "utf-8"

    def __init__(self, file: Any) -> None:
        self._file = file

    def fileno(self) -> int:
        return self._file.fileno()

    def write(self, text: str) -> None:
        raise OSError(errno.EPIPE, "gone")


def test_streams_that_nobody_reads_are_led_to_nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What is written to the file of the stream afterwards does not arrive in it."""
    for stream, lead in (("stderr", lambda: render.note("hello")), ("stdout", outcome._give_up_output)):
        with (tmp_path / stream).open("w") as file, monkeypatch.context() as patch:
            patch.setattr(sys, stream, Lost(file))
            lead()
            os.write(file.fileno(), b"lost")
        assert (tmp_path / stream).read_text() == ""
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", SimpleNamespace(fileno=lambda: int("none")))
        outcome._give_up_output()
        assert sys.stdout is None

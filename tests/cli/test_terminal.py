"""Nothing that a file holds controls the terminal, and a message is one line."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path

import pytest
from rich.console import Console

from seatrial.cli import render
from seatrial.cli.app import main
from seatrial.cli.render import in_json, note, one_line, say, shown
from seatrial.report.blocks import Table

EVIL = "a\x1b]0;owned\x07\x1b[2J\x9b31m\r\u202egnp\u2028b\x7f"
ROOT = Path(__file__).parents[2] / "src" / "seatrial"


def controls(text: str) -> set[str]:
    return {c for c in text if not (c.isprintable() or c == "\n")}


def test_what_controls_is_shown_and_not_sent() -> None:
    assert shown("naïve – m², 10 %\n\tx") == "naïve – m², 10 %\n\tx"
    assert shown("\x1b[2J") == "\\x1b[2J"
    assert not controls(shown(EVIL))
    assert json.loads(in_json(json.dumps({"a": EVIL}, ensure_ascii=False))) == {"a": EVIL}
    assert not controls(in_json(json.dumps({"a": EVIL}, ensure_ascii=False)))


def test_a_message_is_one_line_of_bounded_length() -> None:
    assert one_line("first:\n  second\r\n\x0b third\n") == "first:; second; third"
    assert len(one_line("9" * 5000)) <= 2000
    assert one_line("9" * 5000).endswith("999")


def test_a_stream_that_is_closed_or_narrow_is_no_crash(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    note("nobody hears")
    narrow = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", narrow)
    say("é \udcff\n")
    narrow.flush()
    assert narrow.buffer.getvalue() == b"\\xe9 \\udcff\n"


def test_names_of_files_reach_the_terminal_as_what_they_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ship = tmp_path / "ship.toml"
    ship.write_text(f'schema = "seatrial-ship/1"\nfamily = {json.dumps(EVIL)}\n')
    for arguments in (["show", str(ship)], ["show", "kv\x1b[2J\nlcc2"], ["check", "a\x1b[31m\nb.csv"],
                      ["simulate", "kvlcc2", "\x1b[2J\n"], ["--\x1b[2J\n"]):  # fmt: skip
        assert main(arguments) == 2
        told = capsys.readouterr()
        assert not controls(told.out + told.err)
        assert told.err.count("\n") == 1
        assert told.err.startswith("error: ")


def test_words_reach_a_terminal_through_one_door() -> None:
    doors = {"render.py", "__main__.py"}
    for path in ROOT.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert path.name in doors or not ("sys.stdout.write" in text or "sys.stderr.write" in text), path


@pytest.mark.parametrize("width", [40, 80, 160])
def test_a_narrow_terminal_breaks_no_name_and_no_number(
    width: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    names = ("hull.resistance_of_the_bare_hull", "rudder.gamma_Rp")
    rows = tuple((name, "-0.3150", "0.08300", "12345.678", "turns and zigzags at small and large angles", "identified")
                 for name in names)  # fmt: skip
    head = ("parameter", "start", "estimate", "sigma", "what would help", "verdict")
    monkeypatch.setattr(render, "console", lambda: Console(highlight=False, width=width, soft_wrap=True))
    render.show((Table(head, rows, words=(4, 5)),))
    said = capsys.readouterr().out
    assert [said.count(name) for name in names] == [1, 1]
    for whole in ("-0.3150", "0.08300", "12345.678", "zigzags", "identified"):
        assert said.count(whole) == 2
    longest = max(map(len, said.splitlines()))
    assert longest <= max(width, 100)
    assert width < 160 or "turns and zigzags at small and large angles" in said

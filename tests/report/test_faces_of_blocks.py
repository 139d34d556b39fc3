"""Blocks that JSON has something of: what they say, and that no other face shows it."""

from __future__ import annotations

import json

import pytest

from seatrial.cli.render import answer
from seatrial.report.blocks import Group, document, fields, line, plain_text, table
from seatrial.report.page import Page, Section, html
from seatrial.workflow import Outcome

INNER = fields({"sigma": float("nan")}, table(("what", "value"), [("sigma", "–")]))
BODY = line("the answer") + fields({"value": 2.0, "unit": "m"}, (*line("2 m"), Group(INNER)))


def test_the_document_of_a_body_is_the_fields_of_all_its_blocks_however_deep() -> None:
    assert list(document(BODY)) == ["value", "unit", "sigma"]
    assert document(line("words alone")) == {}
    assert document(fields({"a": 1}, fields({"a": 2})) + fields({"b": 3})) == {"a": 2, "b": 3}


def test_people_see_the_blocks_and_programs_the_fields(capsys: pytest.CaptureFixture[str]) -> None:
    assert list(plain_text(BODY)) == ["the answer", "2 m", "what   value", "sigma      –"]
    assert html(fields({"value": 2.0}, line("2 m"))) == html(line("2 m"))
    answer(BODY, json=True)
    assert json.loads(capsys.readouterr().out) == {"value": 2.0, "unit": "m", "sigma": None}
    answer(BODY, json=False)
    out = capsys.readouterr().out
    assert [line.split() for line in out.splitlines() if "─" not in line and line.strip()] == [
        ["the", "answer"], ["2", "m"], ["what", "value"], ["sigma", "–"]]  # fmt: skip


def test_a_page_and_a_command_have_one_document() -> None:
    sections = (Section("", fields({"schema": "s/1"})), Section("part", fields({"part": 1}, BODY)),
                Section("silent", fields({"silent": [1]})))  # fmt: skip
    page = Page("a page", sections)
    assert page.document == {"schema": "s/1", "part": 1, "value": 2.0, "unit": "m", "sigma": None, "silent": [1]}
    assert "<h2>part</h2>" in page.html
    assert "silent" not in page.html, "what shows nothing has no heading"
    assert Outcome(None, BODY).document == document(BODY)

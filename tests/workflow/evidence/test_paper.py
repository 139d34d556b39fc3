"""A paper run anew: what is refused before the run, what a table is, what the page of a run holds."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.report.blocks import lead
from seatrial.report.page import Page, Section
from seatrial.workflow.evidence.paper import PAPERS, _length_of_wakita, _named, part

ROOT = Path(__file__).parents[3]
SCRIPT = '''
from seatrial.report.blocks import line
from seatrial.report.page import Page, Section
from helping import WORD
COST, TABLES = "a wink", (1, 2, 3, 5)

def made(command):
    return Page("A paper", (Section("", line("head")), Section("Tables 1 and 3 to 5: inputs", line(WORD)),
                            Section("Drive (Table 2)", line("two")), Section("Provenance", line(command))))
'''


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    reports = tmp_path / "studies" / "reports"
    reports.mkdir(parents=True)
    (reports / "you2023.py").write_text(SCRIPT, encoding="utf-8")
    (reports / "helping.py").write_text('WORD = "several"\n', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_page_is_written_after_the_cost_was_told(checkout: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["paper", "you2023", "-o", "page.html", "--json"]) == 0
    said = capsys.readouterr()
    assert said.err.splitlines()[0] == "you2023 takes a wink"
    assert json.loads(said.out)["parts"] == ["Tables 1 and 3 to 5: inputs", "Drive (Table 2)", "Provenance"]
    page = (checkout / "page.html").read_text(encoding="utf-8")
    assert "several" in page
    assert "seatrial paper you2023 -o page.html" in page
    assert (checkout / "page.json").is_file()


def test_one_table_is_the_parts_that_name_it_and_the_provenance(checkout: Path) -> None:
    for table, word, other in ((5, "several", "two"), (2, "two", "several")):
        assert main(["paper", "you2023", "--table", str(table), "-o", "one.html"]) == 0
        page = (checkout / "one.html").read_text(encoding="utf-8")
        assert word in page
        assert f">{other}<" not in page
        assert f"--table {table}" in page  # the command, in the provenance


@pytest.mark.parametrize(("arguments", "said"), [
    (["you2024", "-o", "p.html"], ", ".join(PAPERS)), (["you2023", "-o", "p.pdf"], ".html"),
    (["you2023", "--table", "9", "-o", "p.html"], "1, 2, 3, 5"), (["suyama2023", "-o", "p.html"], "checkout"),
    (["you2023", "-o", "none/p.html"], "no such folder"),
])  # fmt: skip
def test_what_cannot_be_made_is_one_line_before_the_run(
    arguments: list[str], said: str, checkout: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["paper", *arguments]) == 2
    told = capsys.readouterr()
    assert told.err.count("\n") == 1
    assert said in told.err
    assert told.out == ""
    assert not list(checkout.glob("p.*"))


def test_the_report_of_a_study_is_made_whole(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys) -> None:
    monkeypatch.chdir(ROOT)
    assert main(["paper", "wakita2022", "--table", "9", "-o", str(tmp_path / "p.html")]) == 2
    said = capsys.readouterr().err
    assert "wakita2022_printed.toml" in said
    assert "--only NAME" in said


def test_a_table_alone_keeps_what_stands_above_all_sections() -> None:
    page = Page("P", (Section("", lead("what A and B are")), Section("Table 5: errors", lead("5")),
                      Section("Table 6: more", lead("6")), Section("Provenance", lead("who"))))  # fmt: skip
    assert [one.title for one in part(page, 5).sections] == ["", "Table 5: errors", "Provenance"]


@pytest.mark.parametrize(("title", "tables"), [
    ("Table 7 and Fig. 7: the tuned parameters", {7}), ("Tables 1 and 3 to 6: the ship before tuning", {1, 3, 4, 5, 6}),
    ("Figs. 8 to 11: the test trials", set()), ("B: the parameters (You 2023 Tab. 3)", {3}),
    ("Tables 2, 4 and 8", {2, 4, 8}), ("Table", set()),
])  # fmt: skip
def test_titles_name_tables(title: str, tables: set[int]) -> None:
    assert _named(title) == tables


def test_the_length_of_wakita_is_what_its_seconds_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """T V/L by hand: 556.4 + 342.9 + 1301.2 + 335.8 s of a 3 m model at Fr = 0.05."""
    monkeypatch.chdir(ROOT)
    T = 556.4 + 342.9 + 1301.2 + 335.8
    assert _length_of_wakita() == pytest.approx(T * 0.05 * math.sqrt(9.81 / 3.0), rel=1e-12)

"""Pages of the documentation: links lead somewhere, what is read is short, decision pages miss nothing."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from house import REPOSITORY

DOCS = REPOSITORY / "docs"
PAGES = [REPOSITORY / "README.md", *sorted(DOCS.glob("*.md")), *sorted(DOCS.glob("*/*.md"))]
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")
LONGEST = 250
# What is looked things up in, not read from beginning to end.
REFERENCES = {"benchmarks", "data", "decisions", "extending", "papers", "published", "studies", "types"}
CODE = re.compile(r"^```.*?^```", re.MULTILINE | re.DOTALL)


def text(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def cells(page: str, column: int) -> set[str]:
    """Words in backticks of a column of the tables of a page."""
    rows = [line.split("|") for line in text(DOCS / page).splitlines() if line.startswith("|")]
    return {word for row in rows if len(row) > column for word in re.findall(r"`([^`]+)`", row[column])}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_links_within_the_repository_lead_somewhere(page: Path) -> None:
    found = [one for one in LINK.findall(CODE.sub("", text(page))) if "://" not in one and "/made/" not in one]
    dead = [one for one in found if not (page.parent / one).exists()]
    assert not dead, ", ".join(dead)


@pytest.mark.parametrize("page", [page for page in PAGES if page.stem not in REFERENCES], ids=lambda page: page.stem)
def test_a_page_that_is_read_is_short(page: Path) -> None:
    lines = len(text(page).splitlines())
    assert lines <= LONGEST, f"{page.name}: {lines} lines; split it, or make it a reference"


def test_the_page_on_estimators_has_each_that_a_study_may_name() -> None:
    known = {one for one in cells("studies.md", 1) if re.fullmatch(r"[a-z_]+:[A-Z][A-Za-z]+", one)}
    known |= {"shooting:OneStep"}
    offered = {one for one in cells("which-estimator.md", 2) if ":" in one}
    assert len(known) >= 10
    assert offered == known


def test_the_page_on_logs_names_findings_that_there_are() -> None:
    known = cells("data.md", 1)
    named = {one for one in cells("wrong-log.md", 1) if re.fullmatch(r"[a-z_]+", one)}
    assert len(named) > 20
    assert named <= known


@pytest.mark.parametrize("name", ["uncertainty", "which-estimator", "choosing", "wrong-log"])
def test_each_decision_page_can_be_found(name: str) -> None:
    assert re.search(rf"\b{name}\b", text(DOCS / "how-to" / "index.md") + text(DOCS / "explanation" / "index.md"))

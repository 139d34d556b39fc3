"""Every source key of a ship or a formula stands in docs/papers.md."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SHIPS = ROOT / "src" / "seatrial" / "ships"
KEY = re.compile(r"\b[a-z]{3,}(?:19|20)\d\d\b")
SOURCE = re.compile(r"source\s*=\s*\"([^\"]*)\"")
PAPERS = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")

FILES = sorted([*SHIPS.glob("*.toml"), *(SHIPS / "variants").glob("*.toml"), *(SHIPS / "formulas").glob("*.py")])


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_source_key_is_in_the_list_of_papers(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    sources = SOURCE.findall(text) if path.suffix == ".toml" else [text]
    cited = {key for source in sources for key in KEY.findall(source)}
    missing = sorted(key for key in cited if f"| `{key}` |" not in PAPERS)
    assert not missing, f"{', '.join(missing)}: add a row to docs/papers.md, with what was read and what not"


@pytest.mark.parametrize("page", sorted(p.name for p in (ROOT / "docs").glob("*.md")))
def test_pages_name_modules_that_are_there_and_miss_none_that_came_since(page: str) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    rooms = "|".join(p.name for p in SHIPS.parent.iterdir() if p.is_dir() and p.name != "__pycache__")
    for named in re.findall(rf"`((?:{rooms})/[a-z0-9_/]+\.py)", text):
        assert (SHIPS.parent / named).exists(), f"docs/{page} names {named}"
    untrue = r"not implemented in this version|not part of this version|this version has not|no folder yet"
    said = re.search(untrue, text)
    assert said is None, f"docs/{page}: {said[0] if said else ''}"


def test_networks_of_sawada_equation_10_have_their_place() -> None:
    row = next(line for line in PAPERS.splitlines() if line.startswith("| (10) |"))
    assert "`models/network.py`" in row


def test_the_list_names_no_paper_twice() -> None:
    rows = re.findall(r"^\| `(\w+)` \|", PAPERS, flags=re.MULTILINE)
    assert len(rows) == len(set(rows)) > 30

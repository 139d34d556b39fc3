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

FILES = sorted([*SHIPS.glob("*.toml"), *(SHIPS / "formulas").glob("*.py")])


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_source_key_is_in_the_list_of_papers(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    sources = SOURCE.findall(text) if path.suffix == ".toml" else [text]
    cited = {key for source in sources for key in KEY.findall(source)}
    missing = sorted(key for key in cited if f"| `{key}` |" not in PAPERS)
    assert not missing, f"{', '.join(missing)}: add a row to docs/papers.md, with what was read and what not"


def test_the_list_names_no_paper_twice() -> None:
    rows = re.findall(r"^\| `(\w+)` \|", PAPERS, flags=re.MULTILINE)
    assert len(rows) == len(set(rows)) > 30

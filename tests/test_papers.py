"""docs/papers.md: every source key of a ship or a formula, and every item of the four papers."""

from __future__ import annotations

import ast
import importlib.util
import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
_SPEC: Any = importlib.util.spec_from_file_location("make_papers", ROOT / "docs" / "make_papers.py")
make: Any = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(make)
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
    assert not missing, f"{missing}: belong in references.toml (docs/make_papers.py), with what was read and what not"


@pytest.mark.parametrize("page", sorted(p.name for p in (ROOT / "docs").glob("*.md")))
def test_pages_name_modules_that_are_there_and_miss_none_that_came_since(page: str) -> None:
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    rooms = "|".join(p.name for p in SHIPS.parent.iterdir() if p.is_dir() and p.name != "__pycache__")
    for named in re.findall(rf"`((?:{rooms})/[a-z0-9_/]+\.py)", text):
        assert (SHIPS.parent / named).exists(), f"docs/{page} names {named}"
    untrue = r"not implemented in this version|not part of this version|this version has not|no folder yet"
    said = re.search(untrue, text)
    assert said is None, f"docs/{page}: {said[0] if said else ''}"


ROWS = [(paper["key"], kind, *row) for paper in make.papers() for kind, rows in paper["rows"].items() for row in rows]


def test_no_number_of_a_paper_is_missing_or_listed_twice() -> None:
    for paper in make.papers():
        assert set(paper["rows"]) == set(paper["counts"])
        for kind, count in paper["counts"].items():
            listed = [n for span, *_ in paper["rows"][kind] for n in make.numbers(span)]
            assert listed == list(range(1, count + 1)), f"{paper['key']}, {kind}"


def defined(path: Path) -> set[str]:
    """Names that a module or a test file defines or imports at its top level."""
    found: set[str] = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.ImportFrom):
            found |= {alias.asname or alias.name for alias in node.names}
        else:
            found |= {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
    return found


@pytest.mark.slow
def test_every_row_names_what_exists() -> None:
    for key, kind, span, _, _, where, tests, status, why in ROWS:
        row = f"{key}, {kind} {span}"
        assert status in make.STATUS, row
        assert bool(why) == (status in ("departed", "not done")), f"{row}: a departure has a reason, nothing else has"
        assert where != "-" or status == "not done" or kind != "equation", f"{row}: where?"
        for place in where.split() if where != "-" else ():
            module, _, name = place.partition(":")
            path = SHIPS.parent / module.replace(".", "/")
            file = path.with_suffix(".py") if path.with_suffix(".py").exists() else path / "__init__.py"
            assert file.exists(), f"{row}: {place}"
            assert not name or name in defined(file), f"{row}: {place}"
        for test in tests.split() if tests != "-" else ():
            file, _, name = test.partition("::")
            assert (ROOT / file).exists(), f"{row}: {test}"
            assert name in defined(ROOT / file), f"{row}: {test}"


def test_the_page_is_what_the_data_file_says() -> None:
    assert make.page() == make.PAGE.read_text(encoding="utf-8"), "run: python docs/make_papers.py"


def test_the_list_names_no_paper_twice() -> None:
    rows = re.findall(r"^\| `(\w+)` \|", PAPERS, flags=re.MULTILINE)
    assert len(rows) == len(set(rows)) > 30

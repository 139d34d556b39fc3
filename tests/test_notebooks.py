"""The notebooks run from top to bottom, and are kept as they ran: in order, without an error, on virtual trials."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import nbformat
import pytest
from nbclient import NotebookClient

import seatrial
from house import REPOSITORY, ROOT

NOTEBOOKS = sorted((REPOSITORY / "docs" / "notebooks").glob("*.ipynb"))


def read(path: Path) -> Any:
    return nbformat.read(path, as_version=4)


def code(notebook: Any) -> list[Any]:
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def words(cell: Any) -> set[str]:
    """The words that a cell prints: numbers and the order of near equals belong to a machine."""
    shown = [one for one in cell.outputs if one.get("name") != "stderr"]
    texts = [one.get("text") or one.get("data", {}).get("text/plain", "") for one in shown]
    return set(re.findall(r"[A-Za-z_]{3,}", "\n".join(text for text in texts if "Figure" not in text)))


@pytest.mark.long
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs_and_prints_what_it_shows(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(ROOT.parent))  # the package under test, from whichever folder
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "MPLCONFIGDIR"):
        monkeypatch.setenv(name, str(tmp_path))
    kept, fresh = read(path), read(path)
    NotebookClient(fresh, timeout=120, kernel_name="python3", resources={"metadata": {"path": tmp_path}}).execute()
    for before, after in zip(code(kept), code(fresh), strict=True):
        assert words(after) == words(before), before.source


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_is_kept_as_it_ran(path: Path) -> None:
    cells = code(read(path))
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1)), "run it from top to bottom"
    assert not [one for cell in cells for one in cell.outputs if one.output_type == "error"]
    pictures = [one for cell in cells for one in cell.outputs if "image/png" in one.get("data", {})]
    assert len(pictures) >= 2
    source = "\n".join(cell.source for cell in cells)
    assert "SEATRIAL_DATA" not in source
    assert not re.search(r"read_trials?\(", source)  # a log that others may not redistribute


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_names_what_there_is(path: Path) -> None:
    """What running it in the long tier would find first: a public name that was changed."""
    source = "\n".join(cell.source for cell in code(read(path)))
    named = [
        node.attr for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "st"
    ]  # fmt: skip
    assert len(set(named)) > 1
    assert not [name for name in named if not hasattr(seatrial, name)]


def test_there_are_three() -> None:
    assert {path.stem for path in NOTEBOOKS} == {"fine-tuning", "first-fit", "real-time-and-mpc"}

"""The habits of the house, for every module of the package."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1] / "src" / "seatrial"
MODULES = sorted(ROOT.rglob("*.py"))
MODULE_LINES = 500

every_module = pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))


def is_door(path: Path) -> bool:
    """Whether the file is the `__init__.py` of a room."""
    return path.name == "__init__.py" and path.parent != ROOT


@every_module
def test_short_enough_to_read_at_a_sitting(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    lines = len(text.splitlines())
    why = "one idea" in (ast.get_docstring(ast.parse(text)) or "")
    assert lines <= MODULE_LINES or why, (
        f"{lines} lines, over {MODULE_LINES}: split it, or say in its docstring which one idea it is"
    )


@every_module
def test_no_print_and_no_assert(path: Path) -> None:
    in_cli = path.relative_to(ROOT).parts[0].removesuffix(".py") == "cli"
    wrong: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Assert):
            wrong.append(f"line {node.lineno}: assert vanishes under -O; raise an error that says why")
        if isinstance(node, ast.Name) and node.id == "print" and not in_cli:
            wrong.append(f"line {node.lineno}: only the command line prints")
    assert not wrong, "\n".join(wrong)


@every_module
def test_nothing_left_undone(path: Path) -> None:
    mark = "TO" + "DO"
    lines = path.read_text(encoding="utf-8").splitlines()
    assert not [number for number, line in enumerate(lines, 1) if mark in line]

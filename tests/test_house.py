"""The habits of the house: one test a rule, over every module of the package or every page."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from house import MODULES, REPOSITORY, ROOT, short, text, tree

MODULE_LINES, FOLDER, FOLDER_OF_IDENTIFY = 500, 15, 10
CATALOGUES = ("forces", "models", "manoeuvres", "data/formats")
"""Folders of like things, a module each, however many there are."""

PROSE = {".md", ".py", ".toml", ".js", ".html", ".css", ".c", ".h", ".csv", ".yaml"}
FEMININE = re.compile(r"(?<![a-z])(?:s[h]e|h[e]r(?:s|self)?)(?![a-z])")

LATER = pytest.mark.xfail(reason="rooms that are still being put in order")


def prose() -> Iterator[Path]:
    """Every file of the repository that people read: the package, its pages, examples, studies, benchmarks, tests."""
    for name in ("src", "docs", "examples", "studies", "benchmarks", "tests"):
        yield from (path for path in sorted((REPOSITORY / name).rglob("*")) if path.suffix in PROSE)
    yield from sorted(REPOSITORY.glob("*.md"))


def test_modules_are_short_enough_to_read_at_a_sitting() -> None:
    wrong = [
        f"{short(path)}: {lines} lines, over {MODULE_LINES}: split it, or say in its docstring which one idea it is"
        for path in MODULES
        if (lines := len(text(path).splitlines())) > MODULE_LINES
        and "one idea" not in (ast.get_docstring(tree(path)) or "")
    ]
    assert not wrong, "\n".join(wrong)


def test_folders_are_small_enough_to_know() -> None:
    """Modules in one folder, its `__init__.py` among them; subfolders are counted by themselves."""
    wrong: list[str] = []
    for folder, count in sorted(Counter(path.parent for path in MODULES).items()):
        name = folder.relative_to(ROOT).as_posix()
        most = FOLDER_OF_IDENTIFY if name.partition("/")[0] == "identify" else FOLDER
        if name not in CATALOGUES and count > most:
            wrong.append(f"{name}: {count} modules, over {most}: which of them are one idea?")
    assert not wrong, "\n".join(wrong)


def test_no_module_asserts() -> None:
    wrong = [
        f"{short(path)}:{node.lineno}: assert vanishes under -O; raise an error that says why"
        for path in MODULES
        if "assert" in text(path)
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Assert)
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.slow
def test_only_the_command_line_prints() -> None:
    wrong = [
        f"{short(path)}:{node.lineno}: print"
        for path in MODULES
        if "print" in text(path) and path.relative_to(ROOT).parts[0] != "cli"
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Name) and node.id == "print"
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.slow
def test_nothing_is_left_undone() -> None:
    mark = re.compile(r"\b(?:TO" + r"DO|FIX" + r"ME|X" + r"XX)\b")
    wrong = [
        f"{short(path)}:{number}: {line.strip()}"
        for path in MODULES
        for number, line in enumerate(text(path).splitlines(), 1)
        if mark.search(line)
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.slow
def test_a_ship_is_it() -> None:
    """Plain English: no ship is a woman, in prose, comments, messages or names."""
    wrong = [
        f"{path.relative_to(REPOSITORY)}:{number}: {line.strip()}"
        for path in prose()
        if FEMININE.search(whole := path.read_text(encoding="utf-8").lower())
        for number, line in enumerate(whole.splitlines(), 1)
        if FEMININE.search(line)
    ]
    assert not wrong, f"{len(wrong)} lines\n" + "\n".join(wrong)


def test_tests_do_not_import_from_tests() -> None:
    """What two files of tests share is in a module that is no test."""
    line_of_import = re.compile(r"\s*(?:from|import)\s(?:.*[.,\s])?test_\w+")
    wrong = [
        f"{path.relative_to(REPOSITORY)}:{number}: {line.strip()}"
        for path in sorted((REPOSITORY / "tests").rglob("*.py"))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if "test_" in line and line_of_import.match(line)
    ]
    assert not wrong, "\n".join(wrong)


def test_files_of_tests_have_names_of_their_own() -> None:
    """Two of one name in two folders pass alone and cannot be collected together."""
    names = Counter(path.name for path in (REPOSITORY / "tests").rglob("*.py"))
    wrong = {name for name, count in names.items() if count > 1} - {"conftest.py", "__init__.py"}
    assert not wrong, f"rename all but one of each: {', '.join(sorted(wrong))}"


def test_no_rule_of_lint_is_both_selected_and_ignored() -> None:
    lint = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["ruff"]["lint"]
    assert not set(lint["select"]) & set(lint["ignore"])

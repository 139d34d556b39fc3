"""Blocks of code in README.md and docs/ fit the program: commands and options exist, Python names exist, TOML is TOML.

The tutorials and notebooks run whole (test_tutorials.py, test_notebooks.py).
"""

from __future__ import annotations

import ast
import re
import shlex
import textwrap
import tomllib
from pathlib import Path

import pytest

import seatrial
from house import REPOSITORY
from seatrial.cli.app import app

PAGES = [REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").glob("*.md")),
         *sorted((REPOSITORY / "docs" / "tutorials").glob("*.md"))]  # fmt: skip
BLOCK = re.compile(r"^ *```(\w+)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
COMMANDS = app.whole()


def blocks(path: Path, *kinds: str) -> list[str]:
    return [body for kind, body in BLOCK.findall(path.read_text(encoding="utf-8")) if kind in kinds]


def named(path: Path) -> str:
    return path.name


def commands(text: str) -> list[list[str]]:
    """Words of each command of seatrial in a block for a shell."""
    found: list[list[str]] = []
    for line in text.replace("\\\n", " ").splitlines():
        for part in re.split(r"\s(?:&&|\||;)\s|;", line.partition(" # ")[0].removeprefix("$ ")):
            start = re.match(r"\s*(?:\S*/)?seatrial (.*)", part)
            if start:
                found.append(shlex.split(start[1].split("> ")[0], comments=True))
    return found


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_commands_of_the_pages_exist_with_their_options(page: Path) -> None:
    wrong: list[str] = []
    for text in blocks(page, "sh", "console", "bash"):
        for words in commands(text):
            name = words[0] if words else ""
            if name.startswith("-") or not name:
                continue
            command = COMMANDS.get(name)
            known = {opt for one in command.params for opt in (*one.opts, *one.secondary_opts)} if command else set()
            if command is None:
                wrong.append(f"no command: {' '.join(words)}")
                continue
            options = [word.partition("=")[0] for word in words[1:] if re.match(r"--?[a-z]", word)]
            wrong += [f"{' '.join(words)}: {one}" for one in options if one not in known | {"--help"}]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_python_of_the_pages_is_python_with_names_that_exist(page: Path) -> None:
    for text in blocks(page, "python"):
        tree = ast.parse(textwrap.dedent(text))
        alias = {one.asname for node in ast.walk(tree) if isinstance(node, ast.Import) for one in node.names
                 if one.name == "seatrial"}  # fmt: skip
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in alias | {"st"}:
                assert hasattr(seatrial, node.attr), node.attr


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_toml_of_the_pages_is_toml(page: Path) -> None:
    for text in blocks(page, "toml"):
        tomllib.loads(textwrap.dedent(text))

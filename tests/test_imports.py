"""Imports point one way only, and importing the package stays light."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1] / "src" / "seatrial"
ROOMS = (
    "core", "engine", "data", "environment", "forces", "actuators", "models", "ships", "sensors", "manoeuvres",
    "simulate", "identify", "study", "validate", "report", "choosing", "exchange", "realtime", "envs", "bench",
    "testing", "workflow", "cli",
)
"""From left to right: a room may import those before it and itself."""

EXEMPT = {"__init__", "__main__"}
"""The package's own door and its `python -m` entry see every room."""

HEAVY = ("torch", "matplotlib", "polars", "control")


def room(path: Path) -> str:
    """The room of a file: the folder or the module directly below the package."""
    return path.relative_to(ROOT).with_suffix("").parts[0]


def imported(path: Path, tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and room of each import from the package itself, wherever in the file it stands."""
    package = ("seatrial", *path.relative_to(ROOT).parent.parts)
    for node in ast.walk(tree):
        names: list[str] = []
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else ()
            stem = ".".join((*base, *([node.module] if node.module else [])))
            names = [f"{stem}.{alias.name}" for alias in node.names]
        for name in names:
            first, _, rest = name.partition(".")
            if first == "seatrial":
                yield node.lineno, rest.partition(".")[0]


MODULES = sorted(path for path in ROOT.rglob("*.py") if room(path) not in EXEMPT)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_point_left(path: Path) -> None:
    here = room(path)
    assert here in ROOMS, f"{here} has no place in the order of the rooms"
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {there}, which stands to the right of {here}"
        for line, there in imported(path, ast.parse(path.read_text(encoding="utf-8")))
        if there in ROOMS and ROOMS.index(there) > ROOMS.index(here)
    ]
    assert not wrong, "\n".join(wrong)


def test_the_walk_sees_every_form_of_import() -> None:
    source = (
        "import seatrial.cli.app\nfrom seatrial import data\nfrom seatrial.ships.files import a\n"
        "from .. import validate\nfrom ..models.mmg import Mmg\nfrom . import hull\nimport numpy\n"
        "def f():\n    from ..identify import Fit\n"
    )
    found = [name for _, name in imported(ROOT / "forces" / "x.py", ast.parse(source))]
    assert sorted(found) == sorted(["cli", "data", "ships", "validate", "models", "forces", "identify"])


@pytest.mark.parametrize("heavy", HEAVY)
def test_importing_the_package_leaves_out(heavy: str) -> None:
    code = f"import sys, seatrial; sys.exit({heavy!r} in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr or f"`import seatrial` imports {heavy}"

"""The modules of the package, parsed once, and what they import of each other; for the rules of the house."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
ROOT = REPOSITORY / "src" / "seatrial"
MODULES = tuple(sorted(ROOT.rglob("*.py")))


@cache
def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(text(path))


def short(path: Path) -> str:
    """The path of a module below the package."""
    return str(path.relative_to(ROOT))


def dotted(path: Path) -> str:
    """The name of a module below the package; the name of its folder for an `__init__.py`."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def imports(path: Path) -> tuple[tuple[int, str], ...]:
    """What `imported` finds in a module."""
    return tuple(imported(path, tree(path)))


def imported(path: Path, source: ast.AST) -> Iterator[tuple[int, str]]:
    """Line and dotted name, below the package, of each import from the package itself, wherever in the file."""
    package = ("seatrial", *path.relative_to(ROOT).parent.parts) if path.is_relative_to(ROOT) else ()
    for node in _statements(source):
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
                yield node.lineno, rest


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """The statements below a node at any depth; what is within an expression is none."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            yield child
            yield from _statements(child)


def arrows() -> dict[str, set[str]]:
    """For each module the modules of the package that it imports, at the top or in a function."""
    modules = {dotted(path): path for path in MODULES}
    found: dict[str, set[str]] = {}
    for name, path in modules.items():
        wanted = (there if there in modules else there.rpartition(".")[0] for _, there in imports(path))
        found[name] = {there for there in wanted if there in modules and there != name}
    return found


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Sets of names that each lead to every other (strongly connected components of two or more; Tarjan 1972)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[set[str]] = []

    def visit(name: str) -> None:
        index[name] = low[name] = len(index)
        stack.append(name)
        for there in graph[name]:
            if there not in index:
                visit(there)
                low[name] = min(low[name], low[there])
            elif there in stack:
                low[name] = min(low[name], index[there])
        if low[name] == index[name]:
            circle = {stack.pop()}
            while name not in circle:
                circle.add(stack.pop())
            if len(circle) > 1:
                found.append(circle)

    for name in graph:
        if name not in index:
            visit(name)
    return found

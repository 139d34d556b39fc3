"""Names: one module a stem in a room, no module that only one other needs, no name in prose that the code has lost."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from house import MODULES, REPOSITORY, arrows, dotted, short, text, tree

LINES, MODULE_LINES = 100, 500

CATALOGUES = (
    "forces", "models", "manoeuvres", "data.formats", "data.check", "campaign.tallies", "cli", "bench",
    "environment.sea", "ships.formulas", "realtime.bridge", "realtime.range", "identify.diagnosis", "validate.requirements",
)  # fmt: skip
"""Folders of like things, each with a name that is looked for: a force, a format, a check, a part of the bridge."""

OWN = {
    "engine.cuda.source": "the text of a kernel",
    "workflow.folders.drafting": "a command", "workflow.folders.survey": "a command",
    "workflow.installation.bench": "a command", "workflow.sampling.drawing": "a command",
    "workflow.seaway.making": "a command", "workflow.evidence.ahead": "what a command of another folder needs",
}  # fmt: skip
"""Modules that stay by themselves, and why."""


def test_a_room_has_one_module_of_a_stem() -> None:
    """A stem and its room say which module is meant."""
    found: dict[tuple[str, str], list[str]] = defaultdict(list)
    for path in MODULES:
        if path.name != "__init__.py":
            found[dotted(path).partition(".")[0], path.stem].append(short(path))
    wrong = [" and ".join(paths) for paths in found.values() if len(paths) > 1]
    assert not wrong, "\n".join(wrong)


def lone(graph: dict[str, set[str]], lines: dict[str, int]) -> Iterator[tuple[str, str]]:
    """Modules of at most `LINES` that one module imports, of the same folder or the one above, which has room."""
    for name in sorted(graph):
        importers = {other for other, there in graph.items() if name in there}
        if len(importers) != 1 or lines[name] > LINES:
            continue
        (importer,) = importers
        near = {name.rpartition(".")[0], name.rpartition(".")[0].rpartition(".")[0]}
        if importer.rpartition(".")[0] in near and lines[name] + lines[importer] <= MODULE_LINES:
            yield name, importer


@pytest.mark.slow
def test_what_one_module_needs_is_in_it() -> None:
    lines = {dotted(path): len(text(path).splitlines()) for path in MODULES}
    graph = {name: there for name, there in arrows().items() if name}  # the package's own door sees every room
    found = {name: importer for name, importer in lone(graph, lines)
             if not name.startswith(tuple(f"{one}." for one in CATALOGUES)) and name not in OWN}  # fmt: skip
    assert not found, "\n".join(f"{name}: only {importer} imports it; it goes there" for name, importer in found.items())


def test_lone_modules_are_seen() -> None:
    graph = {"a.b": {"a.c", "a.d", "e.f"}, "a.c": {"a.d"}, "a.d": set(), "e.f": set(), "a.b.g": set(), "a.h": {"a.b.g"}}
    assert list(lone(graph, dict.fromkeys(graph, 90))) == [("a.b.g", "a.h"), ("a.c", "a.b")]
    assert not list(lone(graph, {**dict.fromkeys(graph, 90), "a.b": 411, "a.h": 411}))


def prose(path: Path) -> Iterator[tuple[int, str]]:
    """Docstrings and comments of a module, with the line where each begins."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.lineno, node.value.value
    for token in tokenize.generate_tokens(io.StringIO(text(path)).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def quoted(said: str) -> list[str]:
    """Names in backticks: `a`, ``b.c``, `d(...)`."""
    found = (re.sub(r"\(.*\)$", "", mark[1].strip()) for mark in re.findall(r"(`+)([^`\n]+)\1", said))
    return [name for name in found if re.fullmatch(r"[A-Za-z_]\w+(?:\.[A-Za-z_]\w*)*", name)]


@cache
def words() -> frozenset[str]:
    """Every word of the code, prose left out: of the package, its data, its pages in a browser, and its tests."""
    found: set[str] = set()
    for path in MODULES:
        bare = {id(node.value) for node in ast.walk(tree(path)) if isinstance(node, ast.Expr)}
        for token in tokenize.generate_tokens(io.StringIO(text(path)).readline):
            if token.type == tokenize.NAME:
                found.add(token.string)
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in bare:
                found.update(re.findall(r"\w+", node.value))
        found.update(path.parts, (path.stem,))
    for folder, endings in (("src", {".toml", ".js", ".html", ".c", ".h"}), ("tests", {".py"})):
        for path in (REPOSITORY / folder).rglob("*"):
            if path.suffix in endings:
                found.update(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    return frozenset(found)


@cache
def members() -> frozenset[str]:
    """Every dotted end of every name of the package: `hull.Polynomial.Y_v`, `Polynomial.Y_v`; fields by themselves."""
    found: set[str] = set()

    def add(prefix: str, *names: str) -> None:
        for name in names:
            parts = [*prefix.split("."), name]
            found.update(".".join(parts[k:]) for k in range(len(parts)))

    def walk(node: ast.AST, prefix: str) -> None:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                add(prefix, child.name)
                walk(child, prefix if isinstance(child, ast.FunctionDef) else f"{prefix}.{child.name}")
            elif isinstance(child, ast.Import | ast.ImportFrom):
                add(prefix, *(alias.asname or alias.name for alias in child.names))
            elif isinstance(child, ast.Name | ast.Attribute) and isinstance(child.ctx, ast.Store):
                add(prefix, child.id if isinstance(child, ast.Name) else child.attr)
            else:
                walk(child, prefix)

    for path in MODULES:
        add(dotted(path).rpartition(".")[0], dotted(path).rpartition(".")[2])
        walk(tree(path), dotted(path))
    return frozenset(found)


@cache
def stems() -> frozenset[str]:
    """Modules, folders and classes: what a dotted name may begin with."""
    classes = (node.name for path in MODULES for node in ast.walk(tree(path)) if isinstance(node, ast.ClassDef))
    return frozenset(part for path in MODULES for part in dotted(path).split(".")) | frozenset(classes)


@cache
def fields() -> frozenset[str]:
    """Fields of classes: a path of parameters, `rudder.t_R`, or a variable, `windows.series`, ends in one."""
    return frozenset(
        node.target.id
        for path in MODULES
        for body in ast.walk(tree(path))
        if isinstance(body, ast.ClassDef)
        for node in body.body
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)
    )


def variables(path: Path) -> set[str]:
    """Arguments, variables and attributes of a module, by which its prose may begin a name."""
    nodes = list(ast.walk(tree(path)))
    return {node.arg for node in nodes if isinstance(node, ast.arg)} | {
        node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)
    }


def lost(name: str, local: set[str]) -> bool:
    """Whether prose names what the package has not; `local` are the variables of its module."""
    name = name.removeprefix("seatrial.")
    head, _, rest = name.partition(".")
    if not rest:
        return name not in words()
    last = rest.rpartition(".")[2]
    if head not in stems() or head in local or last in fields() or last in ENDINGS:
        return False
    return name not in members()


@pytest.mark.slow
def test_prose_names_what_is_there() -> None:
    """Docstrings and comments outlive the names that they speak of, unless this looks."""
    wrong = [
        f"{short(path)}:{line}: `{name}` is nowhere"
        for path in MODULES
        for line, said in prose(path)
        for name in quoted(said)
        if lost(name, variables(path)) and name not in ELSEWHERE
    ]
    assert not wrong, "\n".join(wrong)


def test_lost_names_are_seen() -> None:
    assert quoted("`a.b` and ``c_d(x)``, not `two words` or `1_000`") == ["a.b", "c_d"]
    assert not any(lost(name, set()) for name in ("Trial", "seatrial.data.Trial", "rudder.t_R", "data.units", "kvlcc2.toml"))
    assert lost("trial_that_was" + "_dropped", set())
    assert lost("data.units.fur" + "longs", set())
    assert not lost("data.units.fur" + "longs", {"data"})


ENDINGS = {"py", "toml", "csv", "json", "yaml", "html", "npz", "js", "c", "h", "zip", "xml", "lock"}
ELSEWHERE: set[str] = set()
"""Names of other programs, and of what a user writes."""

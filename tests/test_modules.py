"""Names: one module a stem in a room, no module that only one other needs, no name in prose that the code has lost."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from house import MODULES, REPOSITORY, arrows, dotted, short, text, tree

LINES, MODULE_LINES = 100, 500
COMMENT = re.compile(r"(?:^|\s)\s*# .*$")

CATALOGUES = (
    "forces", "models", "manoeuvres", "data.formats", "data.check", "campaign.tallies", "cli", "bench",
    "environment.sea", "ships.formulas", "realtime.bridge", "realtime.range", "identify.diagnosis",
    "validate.requirements",
)  # fmt: skip
"""Folders of like things, each with a name that is looked for: a force, a format, a check, a part of the bridge."""

OWN = {
    "engine.cuda.source": "the text of a kernel",
    "workflow.folders.drafting": "a command", "workflow.folders.survey": "a command",
    "workflow.installation.bench": "a command", "workflow.sampling.drawing": "a command",
    "workflow.seaway.making": "a command", "workflow.evidence.carded": "a section of a card, judged by itself",
    "workflow.evidence.ahead": "what a command of another folder needs",
    "identify.networks.pushed": "a benchmark measures it too", "study.drafting.limits": "what physics decides of signs",
    "desk.view": "what is drawn of a trial, beside the door that serves it",
    "encounters.rules.grounding": "a rule, beside the others",
    "data.nmea.carried": "frames of NMEA 2000 in sentences, a layout of its own",
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
    folders = {dotted(path) for path in MODULES if path.name == "__init__.py"}
    graph = {name: there - folders for name, there in arrows().items() if name}  # the package's door sees every room
    found = {name: importer for name, importer in lone(graph, lines)
             if not name.startswith(tuple(f"{one}." for one in CATALOGUES)) and name not in OWN}  # fmt: skip
    assert not found, "\n".join(f"{name}: only {importer} imports it; fold it" for name, importer in found.items())


def test_lone_modules_are_seen() -> None:
    graph = {"a.b": {"a.c", "a.d", "e.f"}, "a.c": {"a.d"}, "a.d": set(), "e.f": set(), "a.b.g": set(), "a.h": {"a.b.g"}}
    assert list(lone(graph, dict.fromkeys(graph, 90))) == [("a.b.g", "a.h"), ("a.c", "a.b")]
    assert not list(lone(graph, {**dict.fromkeys(graph, 90), "a.b": 411, "a.h": 411}))


@cache
def read(path: Path) -> tuple[tuple[tuple[int, str], ...], frozenset[str]]:
    """Docstrings and comments of a module with the line where each begins; its arguments and variables."""
    said: list[tuple[int, str]] = []
    variables: set[str] = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            said.append((node.lineno, node.value.value))
        elif isinstance(node, ast.arg):
            variables.add(node.arg)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            variables.add(node.id)
    for number, line in enumerate(text(path).splitlines(), 1):
        if comment := COMMENT.search(line):
            said.append((number, comment[0]))
    return tuple(said), frozenset(variables)


def quoted(said: str) -> list[str]:
    """Names in backticks: `a`, ``b.c``, `d(...)`."""
    found = (re.sub(r"\(.*\)$", "", mark[1].strip()) for mark in re.findall(r"(`+)([^`\n]+)\1", said))
    return [name for name in found if re.fullmatch(r"[A-Za-z_]\w+(?:\.[A-Za-z_]\w*)*", name)]


@cache
def words() -> frozenset[str]:
    """Every word of the code, prose left out: of the package, its data, its pages in a browser, and its tests."""
    found: set[str] = set()
    for path in MODULES:
        lines = [COMMENT.sub("", line) for line in text(path).splitlines()]
        for first, said in read(path)[0]:
            lines[first - 1 : first + said.count("\n")] = [""] * (said.count("\n") + 1)
        found.update(re.findall(r"\w+", "\n".join(lines)), path.parts, (path.stem,))
    for folder, endings in (("src", {".toml", ".js", ".html", ".c", ".h"}), ("tests", {".py"})):
        for path in (REPOSITORY / folder).rglob("*"):
            if path.suffix in endings and path != Path(__file__):
                found.update(re.findall(r"\w+", path.read_text(encoding="utf-8")))
    return frozenset(found)


def bound(node: ast.stmt) -> list[str]:
    """Names that an import or an assignment binds."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        return [alias.asname or alias.name for alias in node.names]
    parts = ast.walk(node) if isinstance(node, ast.Assign | ast.AnnAssign) else ()
    return [part.id for part in parts if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)]


@cache
def members() -> tuple[frozenset[str], frozenset[str], frozenset[str]]:
    """Names of the package, of three kinds.

    Every dotted end of what a module or a class has, such as `hull.Polynomial.Y_v` and `Polynomial.Y_v`; modules,
    folders and classes, which a dotted name begins with; fields and attributes, in which a path of parameters
    (`rudder.t_R`) or a variable (`windows.series`) ends.
    """
    ends: set[str] = set()
    stems: set[str] = set()
    fields: set[str] = set()

    def add(prefix: str, name: str) -> None:
        parts = [*prefix.split("."), name]
        ends.update(".".join(parts[k:]) for k in range(len(parts)))

    def enter(body: list[ast.stmt], prefix: str, within: bool) -> None:
        for node in body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                add(prefix, node.name)
            elif isinstance(node, ast.ClassDef):
                add(prefix, node.name)
                stems.add(node.name)
                enter(node.body, f"{prefix}.{node.name}", True)
            for part in bound(node):
                add(prefix, part)
                fields.update({part} if within else ())

    for path in MODULES:
        name = dotted(path)
        stems.update(name.split("."))
        add(name.rpartition(".")[0], name.rpartition(".")[2])
        enter(tree(path).body, name, False)
        fields.update(re.findall(r"self\.(\w+)", text(path)))
    return frozenset(ends), frozenset(stems), frozenset(fields)


def lost(name: str, local: frozenset[str]) -> bool:
    """Whether prose names what the package has not; `local` are the variables of its module."""
    name = name.removeprefix("seatrial.")
    head, _, rest = name.partition(".")
    if not rest:
        return name not in words()
    last = rest.rpartition(".")[2]
    ends, stems, fields = members()
    return name not in ends and head in stems - local and last not in fields and last not in ENDINGS


@pytest.mark.slow
def test_prose_names_what_is_there() -> None:
    """Docstrings and comments outlive the names that they speak of, unless this looks."""
    wrong = [
        f"{short(path)}:{line}: `{name}` is nowhere"
        for path in MODULES
        for line, said in read(path)[0]
        for name in quoted(said)
        if lost(name, read(path)[1]) and name not in ELSEWHERE
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.slow
def test_lost_names_are_seen() -> None:
    assert quoted("`ab.c` and ``c_d(x)``, not `two words` or `1_000`") == ["ab.c", "c_d"]
    assert not any(lost(name, frozenset()) for name in ("Trial", "seatrial.data.Trial", "rudder.t_R", "data.units"))
    assert lost("trial_that_was" + "_dropped", frozenset())
    assert lost("data.units.fur" + "longs", frozenset())
    assert not lost("data.units.fur" + "longs", frozenset({"data"}))


ENDINGS = {
    "py", "toml", "csv", "json", "yaml", "html", "npz", "js", "c", "h", "zip", "xml", "lock", "casadi", "parquet",
}  # fmt: skip
ELSEWHERE = {
    "InferenceData", "UdPbC", "n_P_2_cmd", "x_sd", "ship__Heave", "control_cmd", "control.TransferFunction",
    "control.StateSpace", "h1_u_U", "ship.simulate", "miss_time",
}  # fmt: skip
"""Names of other programs, and of what a user writes."""

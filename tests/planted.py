"""Which wrong lines do the tests notice?  Lines are drawn by a seed, made wrong one at a time, and tested.

A wrong line is one change that a tired author makes: a sign, a product for a quotient, a term left out, a constant, a
bound, a comparison turned, two arguments exchanged, a minimum for a maximum, an angle not wrapped, degrees for radians.
The change is made in a copy of the package; the unit tests that reach the line run there, the quickest first, until one
fails.  Which tests reach which line is measured once (`--map`), by the unit tier under coverage.  A line that none of
them notices is tried with slow tests: those named like the module, those that import it, those of its room, in this
order.

    python tests/planted.py --map                # once; some minutes
    python tests/planted.py --seed 1             # all rooms; results/planted.json
    python tests/planted.py --seed 1 --room bands --lines 30
    python tests/planted.py --seed 1 --list      # only shows the lines

A drawn line that changes nothing (an equivalent, or the look of a picture) is listed in planted.toml with the reason.
"""

from __future__ import annotations

import argparse
import ast
import compileall
import json
import os
import py_compile
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from importlib import import_module
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from tiers import left_out

REPOSITORY = Path(__file__).parents[1]
PACKAGE = REPOSITORY / "src" / "seatrial"
RESULTS = REPOSITORY / "benchmarks" / "results" / "planted.json"
LINES_A_PLANT, LEAST = 1200, 4
LIBRARIES = [
    "numpy", "casadi", "scipy.optimize", "scipy.interpolate", "scipy.signal", "scipy.stats", "pandas", "polars",
    "torch", "matplotlib.pyplot", "xarray", "click",
]  # fmt: skip
"""Imported once, before each line's process is made from it: half of a short test is the import of libraries.

Not what pytest rewrites as it is imported (Hypothesis): it warns of that, and ends."""
_HANGS = 600.0
DENSE = ("belief/bands", "realtime/twin", "realtime/range", "identify/diagnosis", "harbour", "campaign", "data/guess")
"""Rooms in rooms that are drawn from twice as densely: those built last."""
LOOK = {
    "figsize", "width", "height", "lw", "linewidth", "alpha", "fontsize", "size", "dpi", "pad", "ms", "zorder", "help",
    "max_length", "indent", "padding", "stacklevel", "labelpad", "rotation", "ncol", "markersize",
}
"""Keyword arguments whose value is the look of a picture or a help text."""
WRAPS = ("wrap", "wrapped", "radians", "degrees", "deg2rad", "rad2deg", "abs", "sqrt", "unwrap")
PAIRS = {
    "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "sin": "cos", "cos": "sin",
    "floor": "ceil", "ceil": "floor", "argmin": "argmax", "argmax": "argmin", "any": "all", "all": "any",
    "nanmin": "nanmax", "nanmax": "nanmin", "fmin": "fmax", "fmax": "fmin", "cumsum": "asarray", "mean": "median",
}
SIGNS = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"), ast.FloorDiv: ("//", "/")}
ORDERS = {
    ast.Lt: ("<", ">"), ast.Gt: (">", "<"), ast.LtE: ("<=", "<"), ast.GtE: (">=", ">"), ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="), ast.In: ("in", "not in"), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
}  # fmt: skip


@dataclass(frozen=True)
class Plant:
    """A wrong line: bytes `start` to `end` of a file become `now`."""

    file: str
    line: int
    kind: str
    start: int
    end: int
    now: str
    was_line: str
    now_line: str

    @property
    def name(self) -> str:
        return f"{self.file}: {self.was_line.strip()} -> {self.now_line.strip()}"


EQUIVALENT: dict[str, str] = tomllib.loads((Path(__file__).parent / "planted.toml").read_text())["equivalent"]
"""Drawn lines that are no fault, by `Plant.name`, with the reason."""


@dataclass(frozen=True)
class Text:
    """The bytes of a module, with the places of the nodes of its tree."""

    source: bytes
    offsets: tuple[int, ...]

    @classmethod
    def of(cls, source: bytes) -> Text:
        offsets = [0]
        for line in source.split(b"\n"):
            offsets.append(offsets[-1] + len(line) + 1)
        return cls(source, tuple(offsets))

    def start(self, node: Any) -> int:
        return self.offsets[node.lineno - 1] + node.col_offset

    def end(self, node: Any) -> int:
        return self.offsets[node.end_lineno - 1] + node.end_col_offset

    def __call__(self, node: Any) -> str:
        return self.source[self.start(node) : self.end(node)].decode()

    def operator(self, left: Any, right: Any, sign: str) -> int | None:
        """Where the sign between two operands stands; None beside a comment."""
        start, between = self.end(left), self.source[self.end(left) : self.start(right)].decode()
        at = between.find(sign)
        return None if at < 0 or "#" in between else start + len(between[:at].encode())


Change = tuple[str, int, int, str]
"""What kind of fault, from which byte, to which, and what stands there then."""


def plants(path: Path) -> list[Plant]:
    """Every wrong line that the operators can make of a module, without docstrings, annotations and messages."""
    text = Text.of(path.read_bytes())
    source, found = text.source, list[Plant]()
    for node in _physics(ast.parse(source)):
        for kind, start, end, now in _changes(node, text):
            first, last = source.rfind(b"\n", 0, start) + 1, source.find(b"\n", end)
            was = source[first:last].decode()
            new = (source[first:start] + now.encode() + source[end:last]).decode()
            line = source[:start].count(b"\n") + 1
            found.append(Plant(str(path.relative_to(PACKAGE)), line, kind, start, end, now, was, new))
    return found


def _physics(tree: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a module whose value matters: no annotations, messages, texts or looks."""
    for field, value in ast.iter_fields(tree):
        if field in ("annotation", "returns", "decorator_list", "bases", "type_params"):
            continue
        for node in value if isinstance(value, list) else [value]:
            if isinstance(node, ast.AST) and not _ignored(node):
                yield node
                yield from _physics(node)


def _ignored(node: ast.AST) -> bool:
    if isinstance(node, ast.keyword):
        return node.arg in LOOK
    if isinstance(node, ast.If):
        return "TYPE_CHECKING" in ast.unparse(node.test)
    return isinstance(node, ast.Raise | ast.JoinedStr | ast.Import | ast.ImportFrom)


def _changes(node: ast.AST, text: Text) -> Iterator[Change]:
    match node:
        case ast.BinOp() if type(node.op) in SIGNS and not _words(node) and not _path(node):
            yield from _arithmetic(node, text)
        case ast.UnaryOp(op=ast.USub()) if not isinstance(node.operand, ast.Constant):
            yield "sign", text.start(node), text.end(node), text(node.operand)
        case ast.UnaryOp(op=ast.Not()):
            yield "logic", text.start(node), text.end(node), f"({text(node.operand)})"
        case ast.Compare() if len(node.ops) == 1 and type(node.ops[0]) in ORDERS:
            yield from _exchange("comparison", node.left, node.comparators[0], ORDERS[type(node.ops[0])], text)
        case ast.BoolOp() if len(node.values) == 2:
            words = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
            yield from _exchange("logic", node.values[0], node.values[1], words, text)
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool) and _meant(value):
            now = value + 1 if isinstance(value, int) else value * 1.5 or 0.5
            yield "constant", text.start(node), text.end(node), repr(now)
        case ast.Call(func=ast.Attribute(attr=name) | ast.Name(id=name)):
            yield from _call(node, name, text)


def _arithmetic(node: ast.BinOp, text: Text) -> Iterator[Change]:
    was, now = SIGNS[type(node.op)]
    yield from _exchange("sign" if was in "+-" else "factor", node.left, node.right, (was, now), text)
    if was in "+-":
        yield "dropped term", text.start(node), text.end(node), text(node.left)


def _exchange(kind: str, left: ast.AST, right: ast.AST, signs: tuple[str, str], text: Text) -> Iterator[Change]:
    at = text.operator(left, right, signs[0])
    if at is not None:
        yield kind, at, at + len(signs[0]), signs[1]


def _call(node: ast.Call, name: str, text: Text) -> Iterator[Change]:
    if name in PAIRS:
        yield "function", text.end(node.func) - len(name), text.end(node.func), PAIRS[name]
    if name in WRAPS and len(node.args) == 1:
        yield "dropped call", text.start(node), text.end(node), f"({text(node.args[0])})"
    if len(node.args) >= 2 and all(isinstance(a, ast.Name | ast.Attribute) for a in node.args[:2]):
        a, b = node.args[:2]
        between = text.source[text.end(a) : text.start(b)].decode()
        yield "exchanged", text.start(a), text.end(b), text(b) + between + text(a)


def _words(node: ast.BinOp) -> bool:
    """Whether a sum joins texts."""
    return any(isinstance(n, ast.JoinedStr) or isinstance(getattr(n, "value", None), str) for n in ast.walk(node))


def _path(node: ast.BinOp) -> bool:
    """Whether a quotient joins a folder and a name."""
    return isinstance(node.op, ast.Div) and any(
        word in ast.unparse(node).lower() for word in ("folder", "path", "parent", "root", "directory", ".txt", "stem")
    )


def _meant(value: float) -> bool:
    """Guards and tolerances say "small" or "large", whatever their digits."""
    return value == 0 or 1e-4 <= abs(value) <= 1e6


def rooms() -> dict[str, list[Path]]:
    """The modules of each room; the rooms of `DENSE` are taken out of those that hold them."""
    found: dict[str, list[Path]] = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        parts = path.relative_to(PACKAGE).parts
        if len(parts) > 1:
            inner = "/".join(parts[:2])
            found.setdefault(inner if inner in DENSE else parts[0], []).append(path)
    return found


def drawn(seed: int, room: str, count: int | None = None) -> list[Plant]:
    """The lines of a room, drawn evenly over its lines of code and over the kinds of fault; one a line."""
    files = rooms()[room]
    lines = sum(path.read_text().count("\n") for path in files)
    wanted = count or max(LEAST, round(lines / LINES_A_PLANT * (2 if room in DENSE else 1)))
    everything = [plant for path in files for plant in plants(path)]
    by_line: dict[tuple[str, int], list[Plant]] = {}
    for plant in everything:
        by_line.setdefault((plant.file, plant.line), []).append(plant)
    chance = random.Random(f"{seed} {room}")
    keys = sorted(by_line)
    chance.shuffle(keys)
    chosen = [chance.choice(by_line[key]) for key in keys]
    sound = (plant for plant in chosen if plant.name not in EQUIVALENT and _differs(plant) and _parses(plant))
    return list(islice(sound, wanted))


def _differs(plant: Plant) -> bool:
    """Whether anything else stands there: two equal arguments exchanged are no fault."""
    return plant.was_line != plant.now_line


def _parses(plant: Plant) -> bool:
    source = (PACKAGE / plant.file).read_bytes()
    try:
        ast.parse(source[: plant.start] + plant.now.encode() + source[plant.end :])
    except SyntaxError:
        return False
    return True


@dataclass(frozen=True)
class Reach:
    """Which tests reach a line, and what a test takes [s]."""

    database: Path
    seconds: dict[str, float]
    broken: frozenset[str]

    def tests(self, plant: Plant, whole_file: bool) -> list[str]:
        """The tests that ran the line (or anything of its file: a traced system is kept from test to test)."""
        with sqlite3.connect(self.database) as base:
            wanted = base.execute("SELECT id FROM file WHERE path LIKE ?", (f"%/seatrial/{plant.file}",)).fetchall()
            rows: list[tuple[str, bytes]] = []
            for (file,) in wanted:
                rows += base.execute(
                    "SELECT context.context, numbits FROM line_bits JOIN context ON context.id = context_id "
                    "WHERE file_id = ?", (file,),
                ).fetchall()  # fmt: skip
        names = {
            name.rpartition("|")[0]
            for name, bits in rows
            if name and (whole_file or _bit(bits, plant.line))
        }
        names = {name for name in names if name not in self.broken}
        return sorted(names, key=lambda name: self.seconds.get(name, 0.005))


def _bit(bits: bytes, line: int) -> bool:
    return len(bits) > line // 8 and bool(bits[line // 8] >> (line % 8) & 1)


def map_tests(folder: Path) -> None:
    """Run the unit tier under coverage, a context a test."""
    folder.mkdir(parents=True, exist_ok=True)
    settings = folder / "coveragerc"
    settings.write_text("[run]\nsource_pkgs = seatrial\nparallel = true\n")
    command = [
        sys.executable, "-m", "pytest", "-q", "-n", "1", "-m", "not slow and not long", "--cov=seatrial",
        f"--cov-config={settings}", "--cov-context=test", "--cov-report=", "--durations=0", "-p", "no:cacheprovider",
    ]  # fmt: skip
    surroundings = os.environ | {"COVERAGE_FILE": str(folder / "map"), "PYTHONPATH": str(REPOSITORY / "src")}
    with (folder / "run.log").open("w") as log:
        subprocess.run(command, cwd=REPOSITORY, env=surroundings, stdout=log, check=False)


def reach(folder: Path) -> Reach:
    seconds: dict[str, float] = {}
    broken: set[str] = set()
    for line in (folder / "run.log").read_text().splitlines():
        words = line.split()
        if len(words) >= 3 and words[1] in ("call", "setup") and words[0].endswith("s"):
            name = " ".join(words[2:])
            seconds[name] = seconds.get(name, 0.0) + float(words[0][:-1])
        if line.startswith(("FAILED ", "ERROR ")):
            broken.add(line.split(" ", 1)[1].split(" - ")[0])
    return Reach(folder / "map", seconds, frozenset(broken))


def compiled(folder: Path) -> Path:
    """A copy of the package with its bytecode, of which each wrong line's is made by links."""
    base = folder / "base"
    shutil.copytree(REPOSITORY / "src", base, ignore=shutil.ignore_patterns("__pycache__"))
    compileall.compile_dir(base, quiet=1, invalidation_mode=py_compile.PycInvalidationMode.UNCHECKED_HASH)
    return base


def noticed(plant: Plant, base: Path, known: Reach, budget: Budget, also: list[str]) -> str | None:
    """The test that notices the line, or None.

    Args:
        base: the package that `compiled` made.
        budget: how long tests may run.
        also: tests newer than the map, which run first.
    """
    with tempfile.TemporaryDirectory(prefix="planted") as scratch:
        overlay = Path(scratch) / "src"
        shutil.copytree(base, overlay, copy_function=os.link)
        path = overlay / "seatrial" / plant.file
        source = path.read_bytes()
        path.unlink()
        path.write_bytes(source[: plant.start] + plant.now.encode() + source[plant.end :])
        for stale in (path.parent / "__pycache__").glob(f"{path.stem}.*.pyc"):
            stale.unlink()
        seen: set[str] = set()
        if also and (found := _first_failure(also, overlay, Path(scratch))):
            return found
        for whole_file in (False, True):
            names = [name for name in known.tests(plant, whole_file) if name not in seen]
            names = _within(names, known, budget.unit)
            seen.update(names)
            for some in _nearest_first(names, plant.file):
                found = _first_failure(some, overlay, Path(scratch))
                if found:
                    return found
        end, tier = time.monotonic() + budget.slow, "slow and not long" if seen else "not long"  # what an import runs
        for module in slow_modules(plant.file) if budget.slow else []:
            marks = ["-m", tier, str(module.relative_to(REPOSITORY))]
            found = _first_failure(marks, overlay, Path(scratch), end - time.monotonic())
            if found:
                return found
            if time.monotonic() > end:
                break
    return None


def _in_common(one: tuple[str, ...], other: tuple[str, ...]) -> int:
    return next((k for k, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), min(len(one), len(other)))


@dataclass(frozen=True)
class Budget:
    """How long the tests of a line may run [s]: unit tests by the map's times (twice), slow tests by the clock."""

    unit: float
    slow: float


def slow_modules(file: str) -> list[Path]:
    """Modules with slow tests that may reach a file of the package, the nearest first."""
    dotted = "seatrial." + file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    parent, _, name = dotted.rpartition(".")
    imports = re.compile(
        rf"^\s*(?:from {re.escape(dotted)}(?:\.\w+)* import|import {re.escape(dotted)}\b"
        rf"|from {re.escape(parent)} import .*\b{name}\b)", re.M,
    )  # fmt: skip
    tests, room = REPOSITORY / "tests", Path(file).parent.parts
    near: list[tuple[int, int, Path]] = []
    for path in sorted(tests.rglob("test_*.py")):
        text = path.read_text()
        if ("mark.slow" not in text and "slow_but" not in text) or left_out(text, "not long"):
            continue
        shared = _in_common(path.relative_to(tests).parent.parts, room)
        alike = room and shared == len(room) and path.stem == f"test_{name}"
        order = 0 if alike else 1 if imports.search(text) else 2 if room and shared == len(room) else 3 if shared else 4
        if order < 4:
            near.append((order, path.stat().st_size, path))
    return [path for _, _, path in sorted(near)]


def _nearest_first(names: list[str], file: str) -> list[list[str]]:
    """The tests of the three modules nearest to a file, and the others: to collect a module costs more than a test."""
    room, stem = Path(file).parent.parts, Path(file).stem
    by_module: dict[str, list[str]] = {}
    for name in names:
        by_module.setdefault(name.partition("::")[0], []).append(name)

    def near(module: str) -> tuple[bool, int, int]:
        at = Path(module.removeprefix("tests/"))
        return at.stem == f"test_{stem}", _in_common(at.parent.parts, room), -len(by_module[module])

    ordered = sorted(by_module, key=near, reverse=True)
    parts = (ordered[:3], ordered[3:])
    return [[name for module in part for name in by_module[module]] for part in parts if part]


def _within(names: list[str], known: Reach, budget: float) -> list[str]:
    kept: list[str] = []
    for name in names:
        budget -= known.seconds.get(name, 0.005)
        if budget < 0:
            break
        kept.append(name)
    return kept


def _first_failure(names: list[str], overlay: Path, scratch: Path, limit: float | None = None) -> str | None:
    """The first that fails; None if all pass, or if `limit` [s] ends first (without one, what hangs has failed)."""
    listed, told = scratch / "tests.txt", scratch / "told.txt"
    listed.write_text("\n".join(names) + "\n")
    child = get_context("forkserver").Process(target=_tested, args=(listed, told, overlay))
    child.start()
    child.join(_HANGS if limit is None else max(limit, 1.0))
    if child.exitcode is None:
        os.killpg(child.pid or 0, signal.SIGKILL)
        child.join()
        return "hangs" if limit is None else None
    if child.exitcode in (0, 5):
        return None
    lines = told.read_text(errors="replace").splitlines()
    gone = {line.rpartition("/tests/")[2] for line in lines if line.startswith("ERROR: not found:")}
    kept = [name for name in names if name.removeprefix("tests/") not in gone]
    if child.exitcode == 4 and len(kept) < len(names):  # tests that were renamed since the map was made
        return _first_failure(kept, overlay, scratch, limit) if kept else None
    failed = [line for line in lines if line.startswith(("FAILED", "ERROR"))]
    return failed[0].split(" ", 1)[1].split(" - ")[0] if failed else f"pytest ends with {child.exitcode}"


def _tested(listed: Path, told: Path, overlay: Path) -> None:
    """In a process of its own group: run the tests of a list on the package of `overlay`."""
    os.setpgid(0, 0)
    out = os.open(told, os.O_CREAT | os.O_WRONLY)
    os.dup2(out, 1)
    os.dup2(out, 2)
    os.chdir(REPOSITORY)
    sys.dont_write_bytecode = True
    os.environ |= {"PYTHONPATH": str(overlay), "PYTHONDONTWRITEBYTECODE": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    sys.path.insert(0, str(overlay))
    options = ["-q", "-x", "-p", "no:cacheprovider", "--no-header", "--assert=plain"]
    os._exit(int(import_module("pytest").main([*options, f"@{listed}"])))


def judge(
    wanted: list[tuple[str, Plant]], base: Path, known: Reach, budget: Budget, workers: int, also: list[str],
    left: Path, most: int | None,
) -> list[dict[str, object]]:
    def one(item: tuple[str, Plant]) -> dict[str, object]:
        room, plant = item
        found = noticed(plant, base, known, budget, also)
        print("caught" if found else "LIVES ", room, plant.line, plant.kind, plant.name, "|", found or "", flush=True)
        row = {"room": room, **asdict(plant), "noticed_by": found}
        with left.open("a") as stream:
            stream.write(json.dumps(row) + "\n")
        return row

    done = [json.loads(line) for line in left.read_text().splitlines()] if left.is_file() else []
    known_rows = {(row["room"], _key(row)) for row in done}
    shuffled = random.Random(len(wanted)).sample(wanted, len(wanted))  # so that what is judged first is a fair part
    ahead = [(room, plant) for room, plant in shuffled if (room, plant.name) not in known_rows][:most]
    with ThreadPoolExecutor(workers) as pool:
        return sorted([*done, *pool.map(one, ahead)], key=lambda row: (row["room"], row["file"], row["line"]))


def living(rows: list[dict[str, object]]) -> list[tuple[str, Plant]]:
    """The lines of an earlier run that lived, where they stand now (a line that is gone is left out)."""
    found: list[tuple[str, Plant]] = []
    for row in rows:
        if not row["noticed_by"]:
            lines = (row["was_line"], row["now_line"])
            same = [p for p in plants(PACKAGE / str(row["file"])) if (p.was_line, p.now_line) == lines][:1]
            found += [(str(row["room"]), plant) for plant in same if plant.name not in EQUIVALENT]
    return found


def since(earlier: list[dict[str, object]], again: list[dict[str, object]]) -> dict[str, Any]:
    """Rows of an earlier run with what has noticed its living lines since; equivalents are no lines any more."""
    now = {_key(row): row["noticed_by"] for row in again}
    rows = [row | {"noticed_since": now.get(_key(row))} for row in earlier if _key(row) not in EQUIVALENT]
    after = [row | {"noticed_by": row["noticed_by"] or row["noticed_since"]} for row in rows]
    return {"caught": summary(rows), "caught_since": summary(after), "lines": rows}


def _key(row: dict[str, object]) -> str:
    return f"{row['file']}: {str(row['was_line']).strip()} -> {str(row['now_line']).strip()}"


def summary(rows: list[dict[str, object]]) -> dict[str, str]:
    table: dict[str, str] = {}
    for room in sorted({str(row["room"]) for row in rows}):
        mine = [row for row in rows if row["room"] == room]
        table[room] = f"{sum(bool(row['noticed_by']) for row in mine)} of {len(mine)}"
    table["all"] = f"{sum(bool(row['noticed_by']) for row in rows)} of {len(rows)}"
    return table


def main() -> None:
    reading = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    reading.add_argument("--seed", type=int, default=1)
    reading.add_argument("--room", action="append", help="a room, or a room in a room, such as realtime/twin")
    reading.add_argument("--lines", type=int, help="how many lines a room")
    reading.add_argument("--map", action="store_true", help="measure which tests reach which line")
    reading.add_argument("--list", action="store_true", help="only show the lines")
    reading.add_argument("--folder", type=Path, default=REPOSITORY / "build" / "planted", help="where the map lies")
    reading.add_argument("--budget", type=float, default=60.0, help="seconds of unit tests a line, twice")
    reading.add_argument("--slow", type=float, default=120.0, help="seconds of slow tests a line; 0 for none")
    reading.add_argument("--from", dest="earlier", type=Path, help="only the lines that live in this result")
    reading.add_argument("--also", nargs="*", default=[], help="tests newer than the map, to run first")
    reading.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    reading.add_argument("--most", type=int, help="lines now; the next run goes on with the others")
    reading.add_argument("-o", type=Path, default=RESULTS)
    asked = reading.parse_args()
    if asked.map:
        map_tests(asked.folder)
        return
    names = asked.room or sorted(rooms())
    earlier = json.loads(asked.earlier.read_text()) if asked.earlier else None
    if earlier:
        wanted = living(earlier["lines"])
    else:
        wanted = [(room, plant) for room in names for plant in drawn(asked.seed, room, asked.lines)]
    if asked.list:
        for room, plant in wanted:
            print(room, plant.line, plant.kind, plant.name)
        print(len(wanted), "lines")
        return
    if not (asked.folder / "map").is_file():
        reading.error(f"{asked.folder}: no map of the tests; make it with --map")
    get_context("forkserver").set_forkserver_preload(LIBRARIES)
    known = reach(asked.folder)
    sound = [*asked.also, *known.tests(wanted[0][1], whole_file=True)[:1]]
    with tempfile.TemporaryDirectory(prefix="planted") as scratch:
        if sound and (failed := _first_failure(sound, REPOSITORY / "src", Path(scratch))):
            reading.error(f"{failed} on the lines as they are: nothing can be said of wrong ones")
        budget = Budget(asked.budget, asked.slow)
        part = asked.o.with_suffix(".part")
        rows = judge(wanted, compiled(Path(scratch)), known, budget, asked.workers, asked.also, part, asked.most)
    if len(rows) < len(wanted):
        print(f"{len(rows)} of {len(wanted)} lines are judged; run it again to go on")
        return
    table = summary(rows)
    print(json.dumps(table, indent=1))
    result = {"seed": asked.seed, "caught": table, "lines": rows}
    if earlier:
        result = earlier | since(earlier["lines"], rows)
        print(json.dumps(result["caught_since"], indent=1))
    asked.o.write_text(json.dumps(result, indent=1) + "\n")
    part.unlink()


if __name__ == "__main__":
    main()

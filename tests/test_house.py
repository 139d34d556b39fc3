"""The habits of the house: one test a rule, over every module of the package or every page."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from house import MODULES, REPOSITORY, ROOT, imported, short, text, tree

MODULE_LINES, FOLDER, FOLDER_OF_IDENTIFY = 500, 15, 10
CATALOGUES = ("forces", "models", "manoeuvres", "data/formats")
"""Folders of like things, a module each, however many there are."""

TESTS = REPOSITORY / "tests"
OF_THE_HOUSE = {"contributed", "garden", "golden", "long", "recovery", "strangers", "twin_faults"}
"""Folders of tests that belong to no room: foreign files, wrong ships, published numbers, long runs,
known truths, ships that no library has, faults for a twin."""

SCENERY = {"core", "data", "environment", "ships", "sensors", "manoeuvres", "simulate"}
"""Rooms whose functions set the scene of a test of any other."""

PROSE = {".md", ".py", ".toml", ".js", ".html", ".css", ".c", ".h", ".csv", ".yaml"}
FEMININE = re.compile(r"(?<![a-z])(?:s[h]e|h[e]r(?:s|self)?)(?![a-z])")


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
        for path in sorted(TESTS.rglob("*.py"))
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if "test_" in line and line_of_import.match(line)
    ]
    assert not wrong, "\n".join(wrong)


def test_files_of_tests_have_names_of_their_own() -> None:
    """Two of one name in two folders pass alone and cannot be collected together; packages tell their modules apart."""
    packed = {path.parent for path in TESTS.rglob("__init__.py")}
    names = Counter(path.name for path in TESTS.rglob("*.py")
                    if path.name.startswith("test_") or path.parent not in packed)  # fmt: skip
    wrong = {name for name, count in names.items() if count > 1} - {"conftest.py", "__init__.py"}
    assert not wrong, f"rename all but one of each: {', '.join(sorted(wrong))}"


def test_folders_of_tests_are_folders_of_the_package() -> None:
    folders = {path.parent.relative_to(TESTS) for path in TESTS.rglob("*.py")}
    wrong = [
        f"tests/{folder.as_posix()}: no such folder in the package"
        for folder in sorted(folders)
        if folder.parts and folder.parts[0] not in OF_THE_HOUSE and not (ROOT / folder).is_dir()
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.slow
def test_a_test_lies_in_the_room_that_it_tests() -> None:
    found = ((path, misplaced(path.relative_to(TESTS), names_used(path))) for path in sorted(TESTS.rglob("test_*.py")))
    wrong = [f"{path.relative_to(REPOSITORY)}: {why}" for path, why in found if why]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize(
    ("path", "names", "told"),
    [
        ("data/check/test_a.py", {"data.check.gaps.gaps"}, ""),
        ("data/test_a.py", {"data.check.gaps.gaps"}, "imports data/check most"),
        ("data/test_a.py", {"data.check.gaps.gaps", "data.prepare.apply.repair", "data.Trial"}, ""),
        ("data/test_a.py", {"core.errors.RequestError"}, "imports nothing of data"),
        ("data/test_a.py", {"cli.app.main"}, ""),
        ("data/test_a.py", set(), ""),
        ("data/test_files.py", {"ships.files.load"}, "imports nothing of data"),
        ("ships/test_files.py", {"core.errors.RequestError"}, ""),
        ("report/test_a.py", {"report.page.html", "validate.imo.a", "validate.imo.b"}, "tests validate"),
        ("report/test_a.py", {"report.page.html", "ships.files.load", "ships.files.save"}, ""),
        ("report/test_a.py", {"report.page.html", "validate.imo.Row", "validate.imo.Table"}, ""),
    ],
)
def test_a_test_in_the_wrong_room_is_seen(path: str, names: set[str], told: str) -> None:
    assert misplaced(Path(path), names) == told


def names_used(path: Path) -> set[str]:
    """Dotted names, below the package, that a file of tests imports; those of the promised API count as the face."""
    found = (name for _, name in imported(path, tree(path)))
    return {name if name and (ROOT / name.partition(".")[0]).is_dir() else "face" for name in found}


def folder_of(name: str) -> str:
    """The deepest folder of the package on the way to a dotted name."""
    while not (ROOT / name.replace(".", "/")).is_dir():
        name = name.rpartition(".")[0]
    return name.replace(".", "/")


def misplaced(path: Path, names: set[str]) -> str:
    """Why a file of tests does not lie where what it tests does; nothing where it does.

    Its room is one from which it imports, or whose module it is named after, unless it imports nothing or goes by the
    command line or the door, which reach every room.  Values of other rooms are what a test is made of, so of these
    only functions count.  Within the room it lies in the folder from which it imports most; where none has the larger
    half, in the room itself.
    """
    folder = path.parent.as_posix()
    room = folder.partition("/")[0]
    if folder == "." or room in OF_THE_HOUSE or (ROOT / folder / path.name.removeprefix("test_")).is_file():
        return ""
    own = [name for name in names if name.partition(".")[0] == room]
    if not own:
        reaching = {"cli", "face"} & {name.partition(".")[0] for name in names}
        return "" if reaching or not names else f"imports nothing of {room}"
    shares = Counter(map(folder_of, own))
    most, count = shares.most_common(1)[0]
    if shares[folder] < count and (folder != room or 2 * count > len(own)):
        return f"imports {most} most"
    for there, functions in Counter(n.partition(".")[0] for n in names if n.rpartition(".")[2].islower()).items():
        if there not in SCENERY and there != room and functions > len(own):
            return f"tests {there}"
    return ""


def test_no_rule_of_lint_is_both_selected_and_ignored() -> None:
    lint = tomllib.loads((REPOSITORY / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["ruff"]["lint"]
    assert not set(lint["select"]) & set(lint["ignore"])


def test_a_knot_and_gravity_are_defined_once() -> None:
    """Published models keep the gravity that they were printed with; all else has one place."""
    again = re.compile(r"\b1852(\.0)?\b|\b9\.80665\b|\b0?\.51444\d*\b|\b1\.9438\d*\b")
    found = [f"{path.relative_to(ROOT)}:{number}" for path in sorted(ROOT.rglob("*.py"))
             if path.name != "constants.py"
             for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
             if again.search(line.partition("#")[0])]  # fmt: skip
    assert found == []

"""Imports point one way only, and importing the package stays light."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys

import pytest

from house import MODULES, REPOSITORY, ROOT, arrows, circles, dotted, imported, imports, short

ROOMS = (
    "core", "engine", "data", "environment", "forces", "harbour", "actuators", "models", "ships", "sensors",
    "manoeuvres", "simulate", "identify", "study", "campaign", "belief", "encounters", "validate", "report",
    "choosing", "exchange", "realtime", "envs", "bench", "testing", "workflow", "face", "desk", "cli",
)
"""From left to right: a room may import those before it and itself."""

EXEMPT = {"", "__main__"}
"""The package's own door and its `python -m` entry see every room."""

HEAVY = ("torch", "matplotlib", "polars", "control", "pandas", "scipy.optimize")


def room(name: str) -> str:
    """The room of a module: the folder or the module directly below the package."""
    return name.partition(".")[0]


@pytest.mark.slow
def test_imports_point_left() -> None:
    wrong: list[str] = []
    for path in MODULES:
        here = room(dotted(path))
        if here in EXEMPT:
            continue
        assert here in ROOMS, f"{short(path)}: {here} has no place in the order of the rooms"
        wrong += [
            f"{short(path)}:{line} imports {there}, which is to the right of {here}"
            for line, there in imports(path)
            if room(there) in ROOMS and ROOMS.index(room(there)) > ROOMS.index(here)
        ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("page", ["development.md", "decisions.md"])
def test_the_order_of_the_rooms_is_told_as_it_is(page: str) -> None:
    words = " ".join((REPOSITORY / "docs" / page).read_text(encoding="utf-8").split())
    told = next(line for line in words.split("`") if line.startswith("core < engine"))
    assert tuple(re.split(r" < |, ", told)) == ROOMS


@pytest.mark.slow
def test_no_circle_of_imports() -> None:
    """Neither at the top of modules nor in functions, where a circle would only show later."""
    found = [" <-> ".join(sorted(circle)) for circle in circles(arrows())]
    assert not found, "\n".join(found)


def test_circles_are_seen() -> None:
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": set(), "e": {"a", "d"}}) == [{"b", "c"}]


def test_every_form_of_import_is_seen() -> None:
    source = (
        "import seatrial.cli.app\nfrom seatrial import data\nfrom seatrial.ships.files import a\n"
        "from .. import validate\nfrom ..models.mmg import Mmg\nfrom . import hull\nimport numpy\n"
        "def f():\n    from ..identify import Fit\n"
    )
    found = [name for _, name in imported(ROOT / "forces" / "x.py", ast.parse(source))]
    assert sorted(map(room, found)) == sorted(["cli", "data", "ships", "validate", "models", "forces", "identify"])
    assert "models.mmg.Mmg" in found


@pytest.mark.slow
def test_importing_the_package_and_its_command_line_is_light() -> None:
    """Cold start: what only some commands need is imported by these."""
    code = (
        "import json, sys\n"
        f"heavy = lambda: [name for name in {HEAVY!r} if name in sys.modules]\n"
        "import seatrial\nfound = {'import seatrial': heavy()}\n"
        "import seatrial.cli.app\nfound['the command line'] = heavy()\n"
        "print(json.dumps(found))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {"import seatrial": [], "the command line": []}


COLD = {
    ("--help",): ("cli core report workflow", "click"),
    ("simulate", "kvlcc2", "turning", "--json"): (
        "actuators cli core data engine environment forces harbour manoeuvres models report ships simulate study "
        "workflow", "casadi click numpy"),
}  # fmt: skip
"""Commands with the rooms and the libraries that they may import."""

NEVER = ("multiprocessing", "concurrent.futures.process", "asyncio", "ssl", "http", "unittest", "threadpoolctl")
"""What costs more to import than a short command may."""


@pytest.mark.slow
@pytest.mark.parametrize("words", COLD, ids=lambda words: words[0])
def test_a_short_command_imports_what_it_needs(words: tuple[str, ...]) -> None:
    code = (
        "import contextlib, io, json, sys\n"
        "from seatrial.cli.app import main\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        "    main(json.loads(sys.argv[1]))\n"
        "print(json.dumps(sorted(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code, json.dumps(words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found, (rooms, libraries) = json.loads(done.stdout), COLD[words]
    own = [name.removeprefix("seatrial.") for name in found if name.startswith("seatrial.")]
    assert {room(name) for name in own} <= set(rooms.split())
    assert not set(NEVER) & set(found)
    known = {*libraries.split(), "seatrial", "swig_runtime_data5", *sys.stdlib_module_names}
    brought = {name.partition(".")[0] for name in found} - known
    assert not {name for name in brought if not name.startswith("_")}, brought


@pytest.mark.slow
def test_a_manoeuvre_is_found_without_the_others() -> None:
    """Most modules are named as their manoeuvre, so that one import answers; an odd one is found among all."""
    code = (
        "import sys\nfrom seatrial.workflow.simulation import find, known\n"
        "found = find('pull-out')\n"
        "there = [name for name in sys.modules if name.startswith('seatrial.manoeuvres.')]\n"
        "assert 'seatrial.manoeuvres.spiral' not in there, there\n"
        "assert found.kind == 'pull-out' and all(find(kind) is cls for kind, cls in known().items())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr

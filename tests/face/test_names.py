"""What `import seatrial as st` offers: names, completion, types, and no time."""

from __future__ import annotations

import ast
import importlib
import inspect
import json
import re
import rlcompleter
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import seatrial as st
from house import MODULES, REPOSITORY, ROOT, dotted, text
from seatrial.face import orders
from seatrial.workflow.simulation import known


def run(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def typed() -> dict[str, str]:
    """Module of each name that a type checker sees in the door."""
    tree = ast.parse((ROOT / "__init__.py").read_text(encoding="utf-8"))
    block = next(n for n in tree.body if isinstance(n, ast.If) and getattr(n.test, "id", "") == "TYPE_CHECKING")
    found = [n for n in block.body if isinstance(n, ast.ImportFrom) and n.level == 1]
    return {(alias.asname or alias.name).lstrip("_"): str(n.module or "") for n in found for alias in n.names}


def test_dir_lists_the_names_and_each_is_there() -> None:
    assert dir(st) == sorted(st.__all__)
    for name in st.__all__:
        assert getattr(st, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'laod'"):
        st.laod  # noqa: B018


def test_a_type_checker_sees_the_names_that_are_loaded() -> None:
    assert {name: module for name, (module, _) in st._names().items()} == typed()


@pytest.mark.slow
def test_a_catalogue_loads_what_is_asked_for() -> None:
    code = (
        "import sys, seatrial as st\nassert 'seatrial.manoeuvres.zigzag' not in sys.modules\n"
        "print(st.manoeuvres.zigzag.Zigzag(1.0, 0.1, 0.2).psi)"
    )
    assert run(code) == "0.2\n"
    with pytest.raises(AttributeError, match="no attribute 'zigzak'"):
        st.manoeuvres.zigzak  # noqa: B018


def test_every_manoeuvre_and_estimator_is_a_name() -> None:
    ordered = {cls.kind for cls in vars(orders).values() if isinstance(cls, type) and issubclass(cls, orders.Order)}
    assert ordered >= set(known())
    assert {cls.__name__ for cls in estimators()} <= set(dir(st))


def estimators() -> Iterator[type]:
    """What fits a problem, wherever in the room: it takes one and a function to tell the progress to."""
    for path in MODULES:
        if not dotted(path).startswith("identify."):
            continue
        module = importlib.import_module(f"seatrial.{dotted(path)}")
        for _, cls in inspect.getmembers(module, inspect.isclass):
            if cls.__module__ == module.__name__ and not getattr(cls, "_is_protocol", False):
                taken = inspect.signature(cls.fit).parameters if callable(getattr(cls, "fit", None)) else {}
                if {"problem", "progress", "checkpoint"} <= set(taken):
                    yield cls


def test_what_is_not_there_is_told_alike() -> None:
    """A channel, an index and a number of a ship: one kind of error, in one line with the near names."""
    done = st.load("zeefakkel").simulate(st.Turning(rudder_deg=20))
    for mapping, name, near in (
        (done, "delte", "near: delta"),
        (done.indices, "advanse", "no index 'advanse'"),
        (done.ship.parameters, "TT", "near: T"),
    ):
        with pytest.raises(st.MissingError, match=near) as told:
            mapping[name]
        assert isinstance(told.value, KeyError)
        assert isinstance(told.value, st.DataError)
        assert str(told.value) == told.value.args[0]
        assert name not in mapping


def written() -> Iterator[tuple[str, str]]:
    """Place and text of all Python that users are shown."""
    for folder in ("docs", "examples", "studies"):
        for path in sorted((REPOSITORY / folder).rglob("*.py")):
            yield path.name, text(path)
        for path in sorted((REPOSITORY / folder).rglob("*.ipynb")):
            for cell in json.loads(text(path))["cells"]:
                yield path.name, "".join(cell["source"]) if cell["cell_type"] == "code" else ""
    for path in (REPOSITORY / "README.md", *sorted((REPOSITORY / "docs").rglob("*.md"))):
        for body in re.findall(r"^ *```python\n(.*?)^ *```", text(path), re.MULTILINE | re.DOTALL):
            yield path.name, textwrap.dedent(body)


def test_what_users_are_shown_imports_nothing_deeper() -> None:
    """Docs, examples, studies, notebooks and README: `import seatrial as st`, and names that it has."""
    deeper = re.compile(r"^\s*(?:from seatrial\.|import seatrial\.).*", re.MULTILINE)
    assert [(place, line) for place, body in written() for line in deeper.findall(body)] == []
    bodies = [(place, body) for place, body in written() if "import seatrial as st" in body]
    shown = [(place, one) for place, body in bodies for one in re.findall(r"(?<![\w.])st((?:\.\w+)+)", body)]
    assert len(shown) > 500
    assert [(place, one) for place, one in shown if not there(one)] == []


def test_what_users_are_told_of_is_in_the_door() -> None:
    """Names in the prose of the pages, but for those on the house itself."""
    of_the_house = ("decisions.md", "development.md")
    pages = [path for path in (REPOSITORY / "docs").rglob("*.md") if path.name not in of_the_house]
    deeper = re.compile(r"`seatrial\.[a-z_]+\.\w+")
    told = re.compile(r"`st((?:\.\w+)+)")
    assert [(path.name, one) for path in pages for one in deeper.findall(text(path))] == []
    assert [(path.name, one) for path in pages for one in told.findall(text(path)) if not there(one)] == []


def there(dotted: str) -> bool:
    """Whether the door has `.a.b.c`, as far as it goes through modules."""
    held: object = st
    for part in dotted.split(".")[1:]:
        if not isinstance(held, ModuleType):
            return True  # an attribute of a value, of which nothing is known here
        if not hasattr(held, part):
            return False
        held = getattr(held, part)
    return True


def test_names_complete() -> None:
    completer = rlcompleter.Completer({"st": st})
    assert {completer.complete("st.read_tr", k) for k in range(2)} == {"st.read_trial(", "st.read_trials("}


def test_the_import_takes_no_time() -> None:
    """Nothing but the door and the version: no room, no NumPy."""
    code = "import sys, json, seatrial\nprint(json.dumps(list(sys.modules)))"
    ours = sorted(name for name in json.loads(run(code)) if name.startswith(("seatrial", "numpy")))
    assert ours == ["seatrial", "seatrial.core", "seatrial.core.version"]


@pytest.mark.slow
@pytest.mark.parametrize("before", ["", "import seatrial.simulate.run; ", "import seatrial as st; st.load; "])
def test_simulate_is_the_function_and_the_room_whatever_came_first(before: str) -> None:
    code = (
        f"{before}from seatrial import simulate\nimport inspect, seatrial.simulate.run as room\n"
        "from seatrial.simulate import SimulationError\nimport seatrial.face.running as face\n"
        "print(callable(simulate), inspect.signature(simulate) == inspect.signature(face.simulate), "
        "room.simulate is not simulate)"
    )
    assert run(code).split() == ["True", "True", "True"]


def test_the_room_that_is_called_runs_a_ship() -> None:
    assert isinstance(st.simulate, ModuleType)
    done = st.simulate("zeefakkel", st.Turning(rudder_deg=20))
    assert isinstance(done, st.Run)
    assert done.indices["advance"].unit == "m"


def test_every_name_says_what_it_is() -> None:
    for name in st.__all__:
        if not name.startswith("_"):
            assert inspect.getdoc(getattr(st, name)), name


@pytest.mark.long
def test_the_names_are_typed(tmp_path: Path) -> None:
    """A user's script in strict mode: no Any, and a slip of a name is an error."""
    script = tmp_path / "script.py"
    script.write_text(
        "import seatrial as st\n"
        "from seatrial import simulate\n"
        'ship = st.load("kvlcc2")\n'
        "run = ship.simulate(st.Zigzag(rudder_deg=20, heading_deg=20))\n"
        "reveal_type(ship)\nreveal_type(run)\nreveal_type(run.indices)\nreveal_type(run.plot())\n"
        'reveal_type(simulate("kvlcc2", st.Turning()))\n'
        'fit = st.fit(st.Problem(ship, st.read_trials("logs"), st.near(ship, "hull.*", ratio=0.5)))\n'
        "reveal_type(fit.summary())\nreveal_type(fit.ship)\nst.laod\n",
        encoding="utf-8",
    )
    (tmp_path / "pyrightconfig.json").write_text(
        json.dumps({"typeCheckingMode": "strict", "extraPaths": [str(ROOT.parent)]}), encoding="utf-8"
    )
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--pythonpath", sys.executable, "--outputjson", "-p", str(tmp_path)],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    told = json.loads(done.stdout)["generalDiagnostics"]
    shown = [one["message"].partition(" is ")[2].strip('"') for one in told if one["severity"] == "information"]
    assert shown == ["Ship", "Run", "Indices", "Axes", "Run", "Summary", "Ship"]
    wrong = [one["message"] for one in told if one["severity"] == "error"]
    assert [line for line in wrong if "laod" not in line] == []
    assert wrong

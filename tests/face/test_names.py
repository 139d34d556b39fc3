"""What `import seatrial as st` offers: names, completion, types, and no time."""

from __future__ import annotations

import ast
import importlib
import inspect
import json
import rlcompleter
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import seatrial as st
from house import ROOT


def run(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def typed() -> dict[str, str]:
    """Module of each name that a type checker sees in the door."""
    tree = ast.parse((ROOT / "__init__.py").read_text(encoding="utf-8"))
    block = next(n for n in tree.body if isinstance(n, ast.If) and getattr(n.test, "id", "") == "TYPE_CHECKING")
    found = [n for n in block.body if isinstance(n, ast.ImportFrom) and n.level == 1]
    return {alias.asname or alias.name: str(n.module) for n in found for alias in n.names}


def test_dir_lists_the_names_and_each_is_there() -> None:
    assert dir(st) == sorted(st.__all__)
    for name in st.__all__:
        assert getattr(st, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'laod'"):
        st.laod  # noqa: B018


def test_a_type_checker_sees_the_names_that_are_loaded() -> None:
    loaded = {name: module for module, names in st._ROOMS.items() for name in names}
    assert typed() == loaded
    for name, module in loaded.items():
        assert hasattr(importlib.import_module(f"seatrial.{module}"), name)


def test_names_complete() -> None:
    completer = rlcompleter.Completer({"st": st})
    assert {completer.complete("st.read_t", k) for k in range(2)} == {"st.read_trial(", "st.read_trials("}


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

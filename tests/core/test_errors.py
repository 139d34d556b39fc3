"""Errors of the package: one base, and the exit status follows from the class."""

from __future__ import annotations

import ast
import importlib
import pickle
import re
from pathlib import Path

import pytest

from seatrial.core import errors
from seatrial.core.errors import RequestError, RunError, SeatrialError

PACKAGE = Path(errors.__file__).parents[1]
ENDS = re.compile(r"class [^:]*(?:Error|Exception)\s*,?\s*\)")  # what may be an error class, before a file is parsed
CLASSES = [one for name in errors.__all__ if isinstance(one := getattr(errors, name), type) and name != "Reason"]
ROOMS = {
    "core.files": ("BusyError", "TomlError"), "core.parameters": ("ParameterError",), "engine": ("SimulationError",),
    "engine.cache": ("CompilerError",), "data": ("DataError",), "data.nmea.sentences": ("NmeaError",),
    "environment.weather": ("WeatherError",), "ships": ("ShipError",), "sensors": ("SensorError",),
    "identify": ("FitError", "StudyError"), "realtime.wire": ("WireError",),
}  # fmt: skip


@pytest.mark.slow
def test_every_error_class_of_the_package_is_defined_in_one_module() -> None:
    elsewhere = [
        f"{path.relative_to(PACKAGE)}: {node.name}"
        for path in PACKAGE.rglob("*.py")
        if path != Path(errors.__file__)
        if ENDS.search(text := path.read_text(encoding="utf-8"))
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.ClassDef) and ast.unparse(node).split(":")[0].endswith(("Error)", "Exception)"))
    ]
    inside = {"data/robot/files.py: _Ended", "data/nmea/columns.py: _DifferError", "data/n2k/groups.py: DifferError"}
    # those end a loop of their own module, and an assertion of tests is none that a command raises
    assert {*elsewhere} - inside == {"testing/discovery.py: ContractError"}


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_an_error_is_a_wrong_request_or_a_failed_run(kind: type[Exception]) -> None:
    assert issubclass(kind, SeatrialError)
    assert kind is SeatrialError or issubclass(kind, RequestError) != issubclass(kind, RunError)


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_export_the_errors_that_they_raise(room: str) -> None:
    module = importlib.import_module(f"seatrial.{room}")
    assert all(getattr(module, name) is getattr(errors, name) for name in ROOMS[room])


def test_a_failed_run_keeps_its_time_between_processes() -> None:
    again = pickle.loads(pickle.dumps(errors.SimulationError("blows up at t = 3 s", 3.0)))
    assert str(again) == "blows up at t = 3 s"
    assert again.time == 3.0


@pytest.mark.parametrize(("error", "told"), [
    (OSError("no such bucket\nand more"), "no such bucket"), (ValueError(), "ValueError"), (KeyError("a"), "'a'"),
    (ValueError("\nlater"), "ValueError"), (ValueError("x" * 500), "x" * 200),
])  # fmt: skip
def test_what_another_program_says_is_one_line(error: Exception, told: str) -> None:
    assert errors.first_line(error) == told
    assert errors.first_line(error, 3) == told[:3]

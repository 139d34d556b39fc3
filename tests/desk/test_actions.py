"""Each action is a command that the command line takes."""

from __future__ import annotations

from pathlib import Path

import click
import pytest

from seatrial.cli.app import app
from seatrial.core.errors import RequestError
from seatrial.desk.actions import ACTIONS, Action, Field, command
from seatrial.desk.shelf import shelf
from seatrial.ships.formulas.reading import read_particulars

ITEMS = {"logs": "logs", "log": "day.nmea", "mapping": "mapping.toml", "trials": "trials", "steps": "steps.toml",
         "study": "study.toml"}  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("logs/1.csv", "trials/a.csv", "trials/a.yaml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
    for name, kind in (("mapping", "mapping"), ("steps", "steps"), ("study", "study"), ("ship", "ship")):
        (tmp_path / f"{name}.toml").write_text(f'schema = "seatrial-{kind}/1"')
    return tmp_path


def value(field: Field) -> str:
    if field.kind == "item":
        return ITEMS[field.kinds[0]]
    return {"ship": "ship.toml", "number": "0.7", "choice": field.kinds[-1] if field.kinds else ""}.get(
        field.kind, field.usual
    )


def parsed(arguments: list[str]) -> click.Context:
    """The command line takes these; click says so without running them."""
    found = app.get_command(click.Context(app), arguments[0])
    assert found is not None
    return found.make_context(arguments[0], arguments[1:])


@pytest.mark.parametrize("action", ACTIONS.values(), ids=ACTIONS)
@pytest.mark.parametrize("whole", [True, False])
def test_every_action_is_a_command(folder: Path, action: Action, whole: bool) -> None:
    given = {field.name: value(field) for field in action.fields if whole or field.needed}
    arguments, written = command(folder, action.key, given)
    parsed(arguments)
    assert set(ITEMS) | {"", "run", "ship"} >= set(action.about)
    assert written is None or written[0] in arguments
    kept = [field.name for field in action.fields if field.kind in ("item", "ship", "new") and field.name in given]
    assert all(given[name] in arguments for name in kept)


def test_the_guess_comes_before_its_import(folder: Path) -> None:
    assert command(folder, "import", {"logs": "logs", "mapping": "mapping.toml", "out": "t"})[0] == [
        "import", "csv", "logs", "--mapping", "mapping.toml", "-o", "t",
    ]  # fmt: skip
    assert command(folder, "import", {"logs": "logs", "format": "nmea", "out": "t"})[0] == [
        "import", "nmea", "logs", "-o", "t",
    ]  # fmt: skip


def test_particulars_are_a_file_that_estimate_takes(folder: Path) -> None:
    given = {"L_pp": "100", "B": 16, "d": "6.0", "C_b": "0.7", "speed": "", "D_P": "3.5", "out": "mine.toml"}
    arguments, written = command(folder, "estimate", given)
    assert written is not None
    assert arguments == ["estimate", written[0], "-o", "mine.toml"]
    (folder / written[0]).write_text(written[1])
    known = read_particulars(folder / written[0])
    assert (known.values["L_pp"], known.values["B"], known.values["d"], known.values["C_b"]) == (100.0, 16.0, 6.0, 0.7)
    assert known.values["D_P"] == 3.5
    assert "speed" in known.assumed


@pytest.mark.parametrize(("key", "given", "told"), [
    ("nothing", {}, "action"),
    ("import", {"logs": "logs"}, "Folder for the trials: is missing"),
    ("import", {"logs": "gone", "out": "t"}, "gone is not there"),
    ("import", {"logs": "logs", "out": "-o"}, "no name"),
    ("import", {"logs": "../logs", "out": "t"}, "no name"),
    ("import", {"logs": "logs", "format": "nmae", "out": "t"}, "choice"),
    ("estimate", {"L_pp": "a hundred", "B": 1, "d": 1, "C_b": 1, "out": "s.toml"}, "no number"),
    ("estimate", {"L_pp": "inf", "B": 1, "d": 1, "C_b": 1, "out": "s.toml"}, "no number"),
    ("study", {"ship": "--trust", "trials": "trials", "out": "s.toml"}, "no name"),
    ("study", {"ship": "other.toml", "trials": "trials", "out": "s.toml"}, "not there"),
    ("identify", {"study": ["study.toml"], "out": "run"}, "is missing"),
])  # fmt: skip
def test_what_cannot_be_is_refused_in_words(folder: Path, key: str, given: dict[str, object], told: str) -> None:
    with pytest.raises(RequestError, match=told):
        command(folder, key, given)


def test_a_library_ship_is_a_name_and_a_file_is_one_of_the_folder(folder: Path) -> None:
    for ship in ("kvlcc2_l7", "ship.toml"):
        assert command(folder, "study", {"ship": ship, "trials": "trials", "out": "s.toml"})[0][2] == ship


def test_kinds_of_items_that_actions_ask_for_are_kinds_of_the_shelf(folder: Path) -> None:
    fields = [field for action in ACTIONS.values() for field in action.fields if field.kind == "item"]
    asked = {kind for field in fields for kind in field.kinds}
    assert {one.kind for one in shelf(folder)} | {"log"} >= asked


@pytest.mark.parametrize(("key", "given", "words"), [
    ("guess", {"logs": "logs", "out": "m.toml"}, "import --guess logs -o m.toml"),
    ("import", {"logs": "logs", "out": "t"}, "import logs -o t"),
    ("check", {"trials": "trials"}, "check trials"),
    ("check", {"trials": "trials", "out": "s.toml"}, "check trials --remedy s.toml"),
    ("trials", {"trials": "trials", "out": "t.html"}, "trials trials -o t.html"),
    ("mend", {"trials": "trials", "steps": "steps.toml", "out": "m"}, "mend trials --by steps.toml -o m"),
    ("copy", {"ship": "kcs", "out": "s.toml"}, "copy kcs s.toml"),
    ("study", {"ship": "kcs", "trials": "trials", "out": "s.toml"}, "study new kcs trials -o s.toml"),
    ("identify", {"study": "study.toml", "out": "run"}, "identify study.toml -o run"),
    ("predict", {"ship": "ship.toml", "trials": "trials", "out": "p"}, "predict ship.toml trials -o p"),
    ("imo", {"ship": "ship.toml", "out": "i.html"}, "imo ship.toml -o i.html"),
    ("requirements", {"ship": "ship.toml", "out": "r.html"}, "requirements ship.toml -o r.html"),
    ("fmu", {"ship": "ship.toml", "out": "s.fmu"}, "export ship.toml --fmu s.fmu"),
])  # fmt: skip
def test_the_commands_are_those_of_the_guide(folder: Path, key: str, given: dict[str, str], words: str) -> None:
    assert command(folder, key, given)[0] == words.split()

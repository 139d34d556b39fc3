"""The actions of the page: each asks for a few values and gives one command of the command line.

`ACTIONS` is the catalogue.  An action may write one small file first, such as the particulars of a ship, which its
command then reads; the file stays, so that the command can be run again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

from ..core.errors import RequestError
from ..core.parameters import unknown
from ..core.values import dataclass
from .shelf import inside

Values = Mapping[str, str]
"""What the page asks for, by the names of the fields; an empty text is not given."""


@dataclass(frozen=True)
class Field:
    """One value that an action asks for.

    Attributes:
        name: the key of the value.
        label: in words, with the unit.
        kind: "item" (one of `kinds`), "ship" (a library ship or a ship file), "new" (a name of a new file or folder),
            "number", or "choice" (one of `kinds`; the first, where it is empty, is none).
        kinds: kinds of item, or the choices.
        usual: what stands there at first.
        needed: whether it must be given.
    """

    name: str
    label: str
    kind: str
    kinds: tuple[str, ...] = ()
    usual: str = ""
    needed: bool = True


@dataclass(frozen=True)
class Action:
    """One thing to do with an item.

    Attributes:
        key, title: its name, and the words of its button.
        about: kinds of item that offer it.
        fields: what it asks for; the first is the item that it is offered with, where it takes one.
        arguments: of the command, from the values.
        before: text of the file that is written first, with its name, from the values.
    """

    key: str
    title: str
    about: tuple[str, ...]
    fields: tuple[Field, ...]
    arguments: Callable[[Values], list[str]]
    before: Callable[[Values], tuple[str, str]] | None = None


def command(folder: Path, key: str, given: Mapping[str, object]) -> tuple[list[str], tuple[str, str] | None]:
    """Arguments of the command of an action, and the file that it reads if it is to be written first.

    Raises:
        RequestError: an unknown action, a value that is missing, none of the choices, or no name in the folder.
    """
    if key not in ACTIONS:
        raise RequestError(unknown(key, ACTIONS, "action"))
    action = ACTIONS[key]
    values = {field.name: _value(folder, field, given.get(field.name)) for field in action.fields}
    written = action.before(values) if action.before else None
    return action.arguments({name: value for name, value in values.items() if value}), written


def _value(folder: Path, field: Field, given: object) -> str:
    text = str(given).strip() if isinstance(given, str | int | float) else ""
    if not text:
        if field.needed:
            raise RequestError(f"{field.label}: is missing")
        return ""
    return _CHECKS[field.kind](folder, field, text)


def _number(folder: Path, field: Field, text: str) -> str:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RequestError(f"{field.label}: '{text}' is no number; write one such as 12.5")
    return repr(value)


def _choice(folder: Path, field: Field, text: str) -> str:
    if text not in field.kinds:
        raise RequestError(f"{field.label}: {unknown(text, field.kinds, 'choice')}")
    return text


def _item(folder: Path, field: Field, text: str) -> str:
    if not inside(folder, text).exists():
        raise RequestError(f"{field.label}: {text} is not there any more")
    return text


def _new(folder: Path, field: Field, text: str) -> str:
    inside(folder, text)
    return text


def _ship(folder: Path, field: Field, text: str) -> str:
    """A file of the folder, or else the name of a ship of the library, which the command judges."""
    return text if text.endswith(".toml") and _item(folder, field, text) else inside(folder, text).name


_CHECKS: Mapping[str, Callable[[Path, Field, str], str]] = {
    "item": _item, "ship": _ship, "new": _new, "number": _number, "choice": _choice,
}  # fmt: skip

_TRIALS = Field("trials", "Folder of trials", "item", ("trials",))
_MODEL = Field("ship", "Ship: of the library, or a file", "ship")
_REQUIRED = (("L_pp", "Length between perpendiculars L_pp [m]"), ("B", "Beam B [m]"), ("d", "Draught d [m]"),
             ("C_b", "Block coefficient C_b [-]"))  # fmt: skip
_KNOWN = (("speed", "Service speed [m/s]"), ("D_P", "Propeller diameter D_P [m]"), ("A_R", "Rudder area A_R [m²]"),
          ("n_P", "Revolutions at that speed [1/s]"))  # fmt: skip


def _import(v: Values) -> list[str]:
    if "mapping" in v:
        return ["import", v.get("format") or "csv", v["logs"], "--mapping", v["mapping"], "-o", v["out"]]
    format = [v["format"]] if "format" in v else []
    return ["import", *format, v["logs"], "-o", v["out"]]


def _beside(out: str) -> str:
    return out.removesuffix(".toml") + "_particulars.toml"


def _particulars(v: Values) -> tuple[str, str]:
    lines = [f"{key} = {v[key]}" for key, _ in (*_REQUIRED, *_KNOWN) if v[key]]
    head = ['schema = "seatrial-particulars/1"', f'name = "{Path(v["out"]).stem}"', "", "[particulars]"]
    return _beside(v["out"]), "\n".join([*head, *lines, ""])


_FORMATS = ("", "nmea", "n2k", "signalk", "mcap", "rosbag1", "rosbag2", "dataflash", "tlog", "ulog", "moos", "gpx")

ACTIONS: Mapping[str, Action] = {one.key: one for one in (
    Action("guess", "Guess the columns of these tables", ("logs",),
           (Field("logs", "Folder of logs", "item", ("logs",)),
            Field("out", "Mapping to write", "new", (), "mapping.toml")),
           lambda v: ["import", "--guess", v["logs"], "-o", v["out"]]),
    Action("import", "Import", ("logs", "log"),
           (Field("logs", "Logs", "item", ("logs", "log")),
            Field("mapping", "Mapping, of tables", "item", ("mapping",), needed=False),
            Field("format", "Format; empty: as recognised", "choice", _FORMATS, needed=False),
            Field("out", "Folder for the trials", "new", (), "trials")),
           _import),
    Action("check", "Check", ("trials",),
           (_TRIALS, Field("out", "Steps of the remedies", "new", (), "steps.toml", needed=False)),
           lambda v: ["check", v["trials"], *(["--remedy", v["out"]] if "out" in v else [])]),
    Action("trials", "Page of all trials", ("trials",),
           (_TRIALS, Field("out", "Page to write", "new", (), "trials.html")),
           lambda v: ["trials", v["trials"], "-o", v["out"]]),
    Action("mend", "Mend by steps", ("trials", "steps"),
           (_TRIALS, Field("steps", "Steps", "item", ("steps",)),
            Field("out", "Folder for the mended trials", "new", (), "mended")),
           lambda v: ["mend", v["trials"], "--by", v["steps"], "-o", v["out"]]),
    Action("copy", "Take a ship of the library", ("", "trials"),
           (Field("ship", "Ship of the library", "ship"), Field("out", "Ship file to write", "new", (), "ship.toml")),
           lambda v: ["copy", v["ship"], v["out"]]),
    Action("estimate", "Estimate a ship from its particulars", ("", "trials"),
           (*(Field(name, label, "number") for name, label in _REQUIRED),
            *(Field(name, label, "number", needed=False) for name, label in _KNOWN),
            Field("out", "Ship file to write", "new", (), "ship.toml")),
           lambda v: ["estimate", _beside(v["out"]), "-o", v["out"]],
           _particulars),
    Action("study", "Write a study", ("trials", "ship"),
           (_MODEL, _TRIALS, Field("out", "Study to write", "new", (), "study.toml")),
           lambda v: ["study", "new", v["ship"], v["trials"], "-o", v["out"]]),
    Action("identify", "Fit", ("study",),
           (Field("study", "Study", "item", ("study",)), Field("out", "Folder of the run", "new", (), "run")),
           lambda v: ["identify", v["study"], "-o", v["out"]]),
    Action("predict", "Predict trials", ("run", "ship"),
           (_MODEL, _TRIALS, Field("out", "Folder for the predictions", "new", (), "predicted")),
           lambda v: ["predict", v["ship"], v["trials"], "-o", v["out"]]),
    Action("imo", "Judge by IMO MSC.137(76)", ("run", "ship"),
           (_MODEL, Field("out", "Page to write", "new", (), "imo.html")),
           lambda v: ["imo", v["ship"], "-o", v["out"]]),
    Action("requirements", "Judge the model", ("run", "ship"),
           (_MODEL, Field("out", "Page to write", "new", (), "requirements.html")),
           lambda v: ["requirements", v["ship"], "-o", v["out"]]),
    Action("fmu", "Export an FMU", ("run", "ship"),
           (_MODEL, Field("out", "FMU to write", "new", (), "ship.fmu")),
           lambda v: ["export", v["ship"], "--fmu", v["out"]]),
)}  # fmt: skip
"""Everything that the page can do, in the order of the work."""

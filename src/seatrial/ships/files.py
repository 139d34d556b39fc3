"""Ship files: `load` reads one, `library` lists those of the package, `save` writes one.

The file is a table a component; see docs/extending.md for the keys.  A component is named
``module:Class``, within `seatrial.forces` (the family: within `seatrial.models`), or in a module that is trusted.
"""

from __future__ import annotations

import inspect
import math
import typing
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from ..core.parameters import ParameterError, Parts, Spec, Terms, unknown, values
from ..core.values import MISSING, dataclass, field, fields, is_dataclass, replace
from ..forces import ThrusterModule
from ..models import Model, unit
from . import Entry, Ship, ShipError
from .actuation import read_actuators
from .classes import Trust, find_class, trusting
from .networks import read_network
from .numbers import PARTICULARS, Yardsticks, number, read_document
from .writing import OWN, save, to_toml

__all__ = ["library", "load", "save", "to_toml", "variants"]

SCHEMA = "seatrial-ship/1"
"""The first key of a ship's file."""
FOLDER = Path(__file__).parent
"""Where the ships of the library lie."""
TOP = ("schema", "like", "name", "of", "family", "model", "particulars", "approach", "actuators", "validity", "notes")
"""Keys of the first level, in the order in which they are written."""

# Ships of the library that are kept.
_KEPT = 64
# Ships displace .3 to .9 of the box around them, pontoons all of it; a slip of unit is a factor of a thousand.
_BLOCK = (0.1, 1.3)
# Radius of gyration in yaw over length: .2 to .3 for ships, .29 for a box, .33 with added inertia.
_GYRATION = (0.1, 0.6)
# Nothing on board is farther from midship than this share of the length.
_REACH = 0.75
# Least share of the length ahead of midship at which a rudder is at the bow.
_BOW = 0.05


def library() -> tuple[str, ...]:
    """Names of the ships that come with the package."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def variants() -> tuple[str, ...]:
    """Names of further parameter sets of ships of the library, which `load` takes as well."""
    return tuple(sorted(path.stem for path in (FOLDER / "variants").glob("*.toml")))


def load(name_or_path: str | Path, *, over: Mapping[str, Any] | None = None, trust: Trust = False) -> Ship:
    """Read a ship of the library by name, or a ship file (a saved fit is one) by path.

    Args:
        over: tables that are laid over those of the file, key by key, as a ship that is `like` it does.
        trust: modules outside the package whose code the file may run by naming their classes; True for any.

    Raises:
        ShipError: no such ship; a key, unit, type or number that cannot be used, in one line.
    """
    path = _find(name_or_path)
    if not over and path.parent in (FOLDER, FOLDER / "variants"):
        return _of_library(path, path.stat().st_mtime_ns)
    document = _over(_whole(path), over or {})
    with trusting(trust):
        made = _Reading(path, document).ship()
    return replace(made, file=None) if over else made


@lru_cache(maxsize=_KEPT)
def _of_library(path: Path, _changed: int) -> Ship:
    """A ship of the library, read once: a fit asks for its own and for published ones again and again."""
    return _Reading(path, _whole(path)).ship()


def _whole(path: Path, above: tuple[Path, ...] = ()) -> dict[str, Any]:
    """The document of a ship file; one that is like another ship holds only what differs from it.

    Raises:
        ShipError: no such ship, or files that are like one another.
    """
    document = read_document(path, SCHEMA)
    if "like" not in document:
        return document
    name, chain = document["like"], (*above, path.resolve())
    if not isinstance(name, str):
        raise ShipError(f"{path}: like is {name!r}; it names a ship of the library, or a file beside this one")
    beside = path.parent / name
    try:
        base = beside if name.endswith(".toml") and beside.is_file() else _find(name)
    except ShipError as error:
        raise ShipError(f"{path}: like: {error}") from None
    if base.resolve() in chain:
        raise ShipError(f"{path}: like: {name} is this ship again; one of the files must be whole")
    inherited = {key: value for key, value in _whole(base, chain).items() if key not in ("name", "of")}
    if isinstance(notes := inherited.get("notes"), Mapping):
        inherited["notes"] = {key: value for key, value in notes.items() if key not in OWN}
    return _over(inherited, document)


def _over(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Tables of `base` with those of `own` over them, key by key; a number is replaced whole."""
    out = dict(base)
    for key, value in own.items():
        known = base.get(key)
        tables = isinstance(known, Mapping) and isinstance(value, Mapping) and not {"value", "prime"} & set(value)
        out[key] = _over(known, value) if tables and known is not None else value
    return out


def _find(name_or_path: str | Path) -> Path:
    text = str(name_or_path)
    path = Path(text).expanduser()
    if (path / "model.toml").is_file() and text not in (*library(), *variants()):
        raise ShipError(f"{path}: a folder, not a ship file; the ship that was fitted there is {path / 'model.toml'}")
    if path.suffix == ".toml" or len(path.parts) > 1 or isinstance(name_or_path, Path):
        if not path.is_file():
            raise ShipError(f"{path}: no such ship file")
        return path
    if text in variants():
        return FOLDER / "variants" / f"{text}.toml"
    if text not in library():
        raise ShipError(unknown(text, (*library(), *variants()), "ship"))
    return FOLDER / f"{text}.toml"


ROLES = {"ForceModule": "force", "PropellerModule": "propeller", "RudderModule": "rudder"}
"""The key of a module in a ship's file by its protocol."""


def role_of(cls: type) -> str:
    """What a class of the forces room is, by what its `force` takes and gives; "" where it has none."""
    force = getattr(cls, "force", None)
    if force is None:
        return ""
    signature = inspect.signature(force)
    if "slipstream" in signature.parameters:
        return "rudder"
    if "control" in signature.parameters:
        return "thruster" if issubclass(cls, ThrusterModule) else "class not derived from forces.ThrusterModule"
    return "propeller" if "Slipstream" in str(signature.return_annotation) else "force"


@dataclass
class _Reading:
    """One pass over a ship file; gathers the entries as it goes."""

    path: Path
    document: Mapping[str, Any]
    entries: dict[str, Entry] = field(default_factory=dict[str, Entry])

    def ship(self) -> Ship:
        family = find_class(self.document.get("family"), "models", f"{self.path}: family")
        if Model not in family.__mro__:
            raise ShipError(f"{self.path}: family: {family.__name__} is not derived from seatrial.models.Model")
        parts = [f.name for f in fields(family) if "spec" not in f.metadata]
        for key in self.document:
            if key not in (*TOP, *parts):
                raise ShipError(f"{self.path}: {unknown(key, (*parts, *TOP), 'key')}")
        particulars = self.numbers("particulars", PARTICULARS, set())
        scale = self.yardsticks(particulars)
        model = self.model(family, scale)
        known = {"speed": Spec("m/s", "approach speed", 1e-3, 100.0), "n_P": Spec("1/s", "revolutions", -1e3, 1e3)}
        start = self.numbers("approach", known, {"speed"})
        length = values(model).get("body.L_pp", particulars.get("L_pp"))
        if length is None:
            raise ShipError(f"{self.path}: particulars.L_pp is missing; every report is in lengths")
        if "provenance" not in self.table("notes"):  # the report of a fit covers what it found
            try:
                plausible(model, length)
            except ShipError as error:
                raise ShipError(f"{self.path}: {error}") from None
        return Ship(
            name=self.text("name", self.path.stem), model=model, actuators=read_actuators(self, model), L_pp=length,
            speed=start["speed"], n_P=start.get("n_P"), validity=self.validity(model), entries=self.entries,
            notes=self.table("notes"), of=self.text("of", "") if "of" in self.document else "",
            file=self.path,
        )  # fmt: skip

    def table(self, dotted: str) -> Mapping[str, Any]:
        found: Any = self.document
        for key in dotted.split("."):
            found = found.get(key, {})
            if not isinstance(found, Mapping):
                part, _, last = dotted.rpartition(".")
                named = f"; parts have names: write [{part}.NAME]" if last == "type" else ""
                raise ShipError(f"{self.path}: {dotted} is not a table{named}")
        return found

    def text(self, key: str, default: str) -> str:
        found = self.document.get(key, default)
        if not isinstance(found, str) or not found or not found.isprintable():
            raise ShipError(f"{self.path}: {key} is {found!a}; it is a text in one line")
        return found

    def numbers(
        self, dotted: str, known: Mapping[str, Spec], required: set[str],
        scale: Yardsticks | None = None, prefix: str | None = None, choices: tuple[str, ...] = (),
    ) -> dict[str, float]:  # fmt: skip
        """The numbers of one table; unknown keys and missing numbers are errors."""
        table = self.table(dotted)
        path = f"{dotted}." if prefix is None else prefix
        for key in table:
            if key not in known and key not in choices and not (key == "type" and dotted != "particulars"):
                raise ShipError(f"{self.path}: {dotted}: {unknown(key, known, 'number')}")
        missing = sorted(required - set(table))
        if missing:
            raise ShipError(f"{self.path}: {dotted}: missing {', '.join(missing)}")
        found: dict[str, float] = {}
        for key, raw in table.items():
            if key in known:
                spot = f"{self.path}: {dotted}.{key}"
                found[key], self.entries[path + key] = number(raw, known[key], spot, scale)
        return found

    def yardsticks(self, particulars: Mapping[str, float]) -> Yardsticks:
        found = dict(particulars)
        body = self.table("body")
        for key in ("rho", "L_pp", "d"):
            raw = body.get(key)
            if isinstance(raw, Mapping) and "value" in raw:
                found[key] = number(raw, PARTICULARS[key], f"{self.path}: body.{key}")[0]
        return Yardsticks(**{key: found[key] for key in ("rho", "L_pp", "d") if key in found})

    def model(self, family: type, scale: Yardsticks) -> Any:
        hints = typing.get_type_hints(family)
        made: dict[str, Any] = {}
        for f in fields(family):
            if "spec" in f.metadata or "choice" in f.metadata:
                continue
            if f.name in self.document:
                made[f.name] = self.field(f.name, f, hints[f.name], scale)
            elif f.default is MISSING and f.default_factory is MISSING:
                raise ShipError(f"{self.path}: table [{f.name}] is missing; {family.__name__} needs it")
        made |= self.parameters("model", family, scale, prefix="")
        return self.made(family, made, "model")

    def field(self, name: str, f: Any, hint: Any, scale: Yardsticks) -> Any:
        """One table of the model: a component, freely named terms or components, or a network."""
        if "network" in f.metadata:
            return read_network(self.path, self.table(name))
        if "terms" in f.metadata:
            return self.terms(name, f.metadata["terms"], scale)
        if "parts" in f.metadata:
            names = tuple(self.table(name))
            role = f.metadata["parts"]
            self.made(Parts, {"names": names}, name)  # before a component of such a name is read
            return Parts(names, tuple(self.component(f"{name}.{part}", None, scale, role) for part in names))
        wanted = next((a for a in typing.get_args(hint) if a is not type(None)), hint)  # with or without `| None`
        return self.component(name, hint, scale, ROLES.get(str(getattr(wanted, "__name__", "")), ""))

    def terms(self, dotted: str, meaning: Any, scale: Yardsticks) -> Terms:
        known: dict[str, Spec] = {}
        for key in self.table(dotted):
            try:
                known[key] = meaning(key)
            except ParameterError as error:
                raise ShipError(f"{self.path}: {dotted}: {error}") from None
        found = self.numbers(dotted, known, set(), scale)
        return Terms(tuple(found), tuple(found.values()))

    def component(self, dotted: str, hint: Any, scale: Yardsticks, role: str = "") -> Any:
        table = self.table(dotted)
        if "type" in table or not (inspect.isclass(hint) and is_dataclass(hint)):
            hint, wanted = find_class(table.get("type"), "forces", f"{self.path}: {dotted}.type"), role
            if wanted and (found := role_of(hint)) and found != wanted:
                spot = f"{self.path}: {dotted}.type"
                raise ShipError(f"{spot}: {hint.__name__} is a {found}; [{dotted}] takes a {wanted}")
        return self.made(hint, self.parameters(dotted, hint, scale, prefix=f"{dotted}."), dotted)

    def made(self, cls: type, given: Mapping[str, Any], dotted: str) -> Any:
        try:
            return cls(**given)
        except ParameterError as error:
            raise ShipError(f"{self.path}: {dotted}: {error}") from None

    def parameters(self, dotted: str, cls: type, scale: Yardsticks, prefix: str) -> dict[str, Any]:
        """Numbers and choices of one class."""
        declared = {f.name: f for f in fields(cls) if "spec" in f.metadata}
        choices = {f.name: f.metadata["choice"] for f in fields(cls) if "choice" in f.metadata}
        required = {name for name, f in declared.items() if f.default is MISSING}
        known = {name: f.metadata["spec"] for name, f in declared.items()}
        if not known and not choices and dotted == "model":
            for key in self.table("model"):
                text = f"{cls.__name__} has no numbers of its own; leave [model] out"
                raise ShipError(f"{self.path}: model: no number '{key}'; {text}")
        chosen = {key: self.table(dotted)[key] for key in choices if key in self.table(dotted)}
        for key, value in chosen.items():
            if value not in choices[key][1]:
                spot = f"{self.path}: {dotted}.{key}: '{value}'"
                raise ShipError(f"{spot} is not one of {', '.join(choices[key][1])}")
        return {**self.numbers(dotted, known, required, scale, prefix, tuple(choices)), **chosen}

    def validity(self, model: Any) -> dict[str, tuple[float, float]]:
        found: dict[str, tuple[float, float]] = {}
        channels = (*model.states, *model.controls)
        for key, pair in self.table("validity").items():
            if key not in channels:
                raise ShipError(f"{self.path}: validity: {unknown(key, channels, 'channel')}")
            spot = f"{self.path}: validity.{key}"
            if not isinstance(pair, list) or len(pair) != 2:
                raise ShipError(f"{spot}: an interval is written [low, high], in {unit(key)}")
            low, high = (number({"value": x, "source": "-"}, Spec("", key), spot)[0] for x in pair)
            if not low < high:
                raise ShipError(f"{spot}: [{low:g}, {high:g}] has no width")
            found[key] = (low, high)
        return found


def plausible(model: Model, L_pp: float) -> None:
    """Refuse masses, inertias, places and dampings that belong to no ship.

    Raises:
        ShipError: names the number and what would be right; the caller adds the file.
    """
    known = {path: float(v) for path, v in values(model).items()}
    _mass(known, L_pp)
    for path, value in known.items():
        last = path.rpartition(".")[2]
        if last in ("x_R", "x_P", "x") and path.count(".") and abs(value) > _REACH * L_pp:
            raise ShipError(f"{path} is {value:g} m, off a ship of {L_pp:g} m: it counts from midship, ahead positive")
        if last == "x_R" and value > _BOW * L_pp:
            raise ShipError(f"{path} is {value:g} m: a rudder at the bow; aft of midship x is negative")
        if path in ("damping.X_u", "derivatives.X_u") and value > 0.0:
            raise ShipError(f"{path} is {value:g}: it drives the ship ahead; the force by u is negative, d_11 = -X_u")


def _mass(known: dict[str, float], L_pp: float) -> None:
    m, box = known.get("body.m", 0.0), math.prod(known.get(f"body.{key}", 0.0) for key in ("rho", "L_pp", "B", "d"))
    if m and box and not _BLOCK[0] <= m / box <= _BLOCK[1]:
        raise ShipError(f"body.m is {m:g} kg, {m / box:.2g} of the box L_pp B d full of water; ships have .4 to .9")
    inertia = known.get("body.I_zG", 0.0)
    if m and inertia:
        radius = math.sqrt(inertia / m) / L_pp
        if not _GYRATION[0] <= radius <= _GYRATION[1]:
            said = f"body.I_zG is {inertia:g} kg m^2, a radius of gyration of {radius:.2g} L_pp"
            raise ShipError(f"{said}; ships have some .25")

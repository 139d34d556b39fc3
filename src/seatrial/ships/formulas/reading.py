"""A file of particulars: known values of a ship, checked, and assumed ones where it has none."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, cast

from ...core.constants import GRAVITY
from ...core.parameters import PRIME, Spec, unknown
from ...core.values import dataclass, fields
from .. import Entry, ShipError
from ..numbers import number, read_document
from . import Air, Particulars, table
from .propeller import straight_wake
from .stability import waterplane

SCHEMA = "seatrial-particulars/1"
"""The first key of a file of particulars."""
TOP = ("schema", "name", "title", "particulars", "wind", "given", "notes")
"""Keys of the first level of a file of particulars."""

MEANING, AIR = (
    {row["name"]: Spec(row["unit"], row["about"], float(row["low"]), float(row["high"]))
     for row in table("particulars") if row["table"] == part}
    for part in ("particulars", "wind")
)  # fmt: skip
"""Meaning of the numbers of [particulars] and [wind]."""
SENSIBLE = {"L_pp/B": (2.0, 12.0), "B/d": (1.0, 10.0), "D_P/d": (0.1, 1.0), "|x_G|/L_pp": (0.0, 0.2)}
"""Ratios outside of which no displacement ship with a propeller lies; a judgement."""

_Rule = tuple[str, Callable[[Mapping[str, float]], float], str, float | None]
ASSUMED: tuple[_Rule, ...] = (
    ("rho", lambda _: 1025.0, "assumed: sea water", None),
    ("nu", lambda _: 1.19e-6, "assumed: sea water of 15 deg C", None),
    ("volume", lambda g: g["C_b"] * g["L_pp"] * g["B"] * g["d"], "C_b L_pp B d", None),
    ("x_G", lambda _: 0.0, "assumed: centre of gravity midship", None),
    ("C_m", lambda g: min(1.006 - 0.0056 * g["C_b"] ** -3.56, 0.995), "Kerlen 1970: 1.006 - 0.0056 C_b^-3.56", None),
    ("C_WP", lambda g: waterplane(g["C_b"]), "assumed: (1 + 2 C_b)/3", None),
    ("A_BT", lambda _: 0.0, "assumed: no bulb", None),
    ("h_B", lambda g: 0.4 * g["d"] if g["A_BT"] else 0.0, "assumed: 0.4 d", None),
    ("A_T", lambda _: 0.0, "assumed: no transom below the water", None),
    ("i_E", lambda _: 0.0, "by Holtrop's formula", None),
    ("speed", lambda g: min(max((1.08 - g["C_b"]) / 1.68, 0.1), 0.35) * math.sqrt(GRAVITY * g["L_pp"]),
     "assumed: Froude number of C_b = 1.08 - 1.68 F_n, a rule of basic ship design for single screws", 0.15),
    ("D_P", lambda g: 0.54 * g["d"], "assumed: 0.54 d, mean of KVLCC2, KCS and Esso Osaka (0.42 to 0.73)", 0.17),
    ("pitch_ratio", lambda _: 0.8, "assumed: mean of KVLCC2, KCS and Esso Osaka (0.72 to 1.0)", 0.2),
    ("blades", lambda _: 4.0, "assumed", None),
    ("area_ratio", lambda _: 0.55, "assumed", None),
    ("A_R", lambda g: 0.01 * g["L_pp"] * g["d"] * (1 + 25 * (g["B"] / g["L_pp"]) ** 2) / g["screws"],
     "DNV 1975 rule, as in a public code: L d/100 (1 + 25 (B/L)^2), over the number of rudders", 0.15),
    ("aspect", lambda g: g["H_R"] ** 2 / g["A_R"] if "H_R" in g else 1.8,
     "H_R^2/A_R; where the height is not given, assumed 1.8, mean of KVLCC2, KCS and Esso Osaka", None),
    ("H_R", lambda g: min(math.sqrt(g["aspect"] * g["A_R"]), 0.95 * g["d"]), "sqrt(aspect A_R), at most 0.95 d", None),
    ("delta_max", lambda _: math.radians(35.0), "assumed: 35 deg", None),
    ("delta_rate", lambda g: math.radians(65.0 / 28.0) * math.sqrt(max(30.0 / g["L_pp"], 1.0)),
     "assumed: 35 deg to 30 deg of the other side in 28 s (SOLAS II-1/29), faster by Froude's law below 30 m", None),
)  # fmt: skip
"""(number, rule, text for the ship file, sigma as a share of the value) in the order they depend on one another."""
SHARES: Mapping[str, float] = {name: share for name, _, _, share in ASSUMED if share is not None}
"""Sigma of particulars that are assumed, as a share of the value: judgements."""


@dataclass(frozen=True)
class Known:
    """A file of particulars as read.

    Attributes:
        values: every number of `MEANING` but n_P that may be absent.
        entries: provenance of each of them.
        given: numbers of the model that are known, as entries by dotted path.
        air: provenance of the shape above water.
    """

    name: str
    title: str
    ship: Particulars
    values: Mapping[str, float]
    entries: Mapping[str, Entry]
    given: Mapping[str, Mapping[str, Any]]
    air: Mapping[str, Entry]
    assumed: tuple[str, ...]
    notes: Mapping[str, Any]


def read_particulars(path: str | Path) -> Known:
    """Read and check a file of particulars.

    Raises:
        ShipError: an unknown key, a missing or impossible number, wind without its areas, in one line.
    """
    path = Path(path)
    document = read_document(path, SCHEMA)
    for key in document:
        if key not in TOP:
            raise ShipError(f"{path}: {unknown(key, TOP, 'key')}")
    values, entries = _numbers(path, document, "particulars", MEANING)
    missing = [key for key in ("L_pp", "B", "d", "C_b") if key not in values]
    if missing:
        raise ShipError(f"{path}: particulars: missing {', '.join(missing)}")
    _screws(path, values, entries)
    assumed = tuple(rule[0] for rule in ASSUMED if rule[0] not in values)
    for name, rule, source, share in ASSUMED:
        if name not in values:
            values[name] = rule(values)
            sigma = None if share is None else share * abs(values[name])
            entries[name] = Entry(source=source, given=values[name], sigma=sigma)
    _check(path, values)
    given = dict(_flat(_table(path, document, "given")))
    made: dict[str, Any] = {f.name: values[f.name] for f in fields(Particulars) if f.name in values}
    air, air_entries = _air(path, document)
    if air and "rho_air" not in _table(path, document, "wind"):
        assumed += ("rho_air",)
    name, title = (document.get(key, default) for key, default in (("name", path.stem), ("title", "")))
    if not isinstance(name, str) or not name or not isinstance(title, str):
        raise ShipError(f"{path}: name and title are texts")
    ship = Particulars(**made, w_P0=_wake(path, given, values), air=air)
    return Known(
        name, title or f"{name}, estimated from its particulars", ship, values, entries, given,
        air_entries, assumed, _table(path, document, "notes"),
    )  # fmt: skip


def _screws(path: Path, values: dict[str, float], entries: dict[str, Entry]) -> None:
    """One screw where the file does not say; of two, the places are given, or the rudders stand behind them."""
    screws = values.setdefault("screws", 1.0)
    entries.setdefault("screws", Entry(source="assumed: a single screw", given=1.0))
    if screws not in (1.0, 2.0):
        raise ShipError(f"{path}: particulars: screws is {screws:g}; the formulas are for 1 or 2")
    off = [key for key in ("y_P", "y_R") if key in values]
    if screws == 1.0 and off:
        raise ShipError(f"{path}: particulars: {off[0]} is given for a single screw; give screws = 2, or leave it out")
    if screws == 2.0 and "y_P" not in values:
        raise ShipError(f"{path}: particulars: missing y_P, the distance of either propeller from the centre line")
    if screws == 2.0 and "y_R" not in values:
        values["y_R"] = values["y_P"]
        entries["y_R"] = Entry(source="assumed: behind the propellers", given=values["y_P"])
    for key, y in ((key, values.get(key, 0.0)) for key in ("y_P", "y_R")):
        if y > 0.5 * values["B"]:
            raise ShipError(f"{path}: particulars: {key} is {y:g} m, beyond the side at {0.5 * values['B']:g} m")


def _table(path: Path, document: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = document.get(key, {})
    if not isinstance(found, Mapping):
        raise ShipError(f"{path}: {key} is not a table")
    return cast("Mapping[str, Any]", found)


_USUALLY = {"n": "n_P", "rpm": "n_P", "revolutions": "n_P", "rps": "n_P", "lpp": "L_pp", "length": "L_pp",
            "lbp": "L_pp", "beam": "B", "breadth": "B", "width": "B", "draught": "d", "draft": "d", "t": "d",
            "cb": "C_b", "diameter": "D_P", "d_prop": "D_P", "rudder_area": "A_R", "v": "speed"}  # fmt: skip
"""What others call the particulars."""


def _numbers(
    path: Path, document: Mapping[str, Any], key: str, known: Mapping[str, Spec]
) -> tuple[dict[str, float], dict[str, Entry]]:
    """The numbers of a table; one written bare is in SI and its source is the file."""
    values: dict[str, float] = {}
    entries: dict[str, Entry] = {}
    for name, raw in _table(path, document, key).items():
        if name not in known:
            usual = _USUALLY.get(name.lower())
            hint = f"no number '{name}'; write {usual}" if usual in known else unknown(name, known, "number")
            raise ShipError(f"{path}: {key}: {hint}")
        given = as_table(raw, known[name].unit, path)
        values[name], entries[name] = number(given, known[name], f"{path}: {key}.{name}")
    return values, entries


def as_table(raw: Any, unit: str, path: Path) -> Any:
    """A number as a table with a source; here, unlike in a ship file, a bare one is in `unit`."""
    source, inside = f"given in {path.name}", {} if unit in ("", "-", PRIME) else {"unit": unit}
    if isinstance(raw, Mapping):
        given = cast("Mapping[str, Any]", raw)
        return {"source": source, **({} if "prime" in given else inside), **given}
    return {"value": raw, "source": source, **inside}


def _check(path: Path, values: Mapping[str, float]) -> None:
    L, B, d = values["L_pp"], values["B"], values["d"]
    found = {"L_pp/B": L / B, "B/d": B / d, "D_P/d": values["D_P"] / d, "|x_G|/L_pp": abs(values["x_G"]) / L}
    for name, (low, high) in SENSIBLE.items():
        if not low <= found[name] <= high:
            raise ShipError(
                f"{path}: particulars: {name} is {found[name]:.3g}; "
                f"a ship these formulas can speak of has {low:g} to {high:g}; of a catamaran, a planing or another "
                "small craft see 'Small craft' in docs/tutorials/estimate.md"
            )
    block = values["volume"] / (L * B * d)
    if abs(block / values["C_b"] - 1) > 0.05:
        raise ShipError(
            f"{path}: particulars: volume makes a block coefficient of {block:.3g}, C_b is {values['C_b']:g}; "
            "correct one, or leave volume out"
        )
    if values["H_R"] > 1.2 * d:
        raise ShipError(f"{path}: particulars: H_R is {values['H_R']:.3g} m, above the draught of {d:g} m")


def _wake(path: Path, given: Mapping[str, Any], values: Mapping[str, float]) -> float:
    raw = given.get("propeller.w_P0")
    if raw is None:
        return straight_wake(values["C_b"], values["screws"])
    return number(as_table(raw, "", path), Spec("", "wake fraction", -0.5, 0.95), f"{path}: given.propeller.w_P0")[0]


def _air(path: Path, document: Mapping[str, Any]) -> tuple[Air | None, Mapping[str, Entry]]:
    if "wind" not in document:
        return None, {}
    values, entries = _numbers(path, document, "wind", AIR)
    missing = [key for key in AIR if key not in values and key != "rho_air"]
    if missing:
        raise ShipError(f"{path}: wind needs the shape above water: missing {', '.join(missing)}; or leave [wind] out")
    if "rho_air" not in values:
        values["rho_air"] = 1.225
        entries["rho_air"] = Entry(source="assumed: standard air", given=1.225)
    return Air(**values), entries


def _flat(found: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, raw in found.items():
        if isinstance(raw, Mapping) and not {"value", "prime"} & set(cast("Mapping[str, Any]", raw)):
            yield from _flat(cast("Mapping[str, Any]", raw), f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", raw

"""Suspects that need no size: signs, axes and units that logs are known to get wrong; and what a suspect is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import Trial, unwrapped
from ..prepare import to_earth
from .relations import has
from .sensors import Kind

Repair = Callable[[Trial], Trial]

_DEG = math.pi / 180.0


@dataclass(frozen=True)
class Suspect:
    """A repair of a log that may explain what is left over.

    Attributes:
        key: the culprit for programs.
        channels: those that are accused.
        what, remedy: for people.
        kind: of the fault.
        repair: the log as it should be.
        evidence: numbers beyond the common ones.
        grave: whether it makes a fit wrong beyond use.
        last: whether it is heard only where nobody else explains anything.
    """

    key: str
    channels: tuple[str, ...]
    what: str
    remedy: str
    kind: Kind
    repair: Repair
    evidence: str = ""
    grave: bool = True
    last: bool = False


def times(factor: float, *names: str) -> Repair:
    return lambda trial: trial.having(**{n: trial[n] * factor for n in names if n in trial})


def _exchange(a: str, b: str) -> Repair:
    return lambda trial: trial.having(**{a: trial[b], b: trial[a]})


def _from_earth(first: str, second: str) -> Repair:
    def repair(trial: Trial) -> Trial:
        u, v = to_earth(trial[first], trial[second], -trial["psi"])
        return trial.having(u=u, v_m=v)

    return repair


def _heading_of_course(trial: Trial) -> Trial:
    return trial.having(psi=unwrapped(trial["psi"]) - np.arctan2(trial["v_m"], trial["u"]))


_UNITS: Mapping[str, Sequence[tuple[str, float]]] = {
    "psi": (("deg", 1 / _DEG), ("rad, converted from deg", _DEG)),
    "r": (("deg/s", 1 / _DEG), ("rad/s, converted from deg/s", _DEG), ("deg/min, taken as deg/s", 60.0),
          ("deg/s, taken as deg/min", 1 / 60.0), ("deg/min", 60.0 / _DEG), ("rad/s, taken as deg/min", _DEG / 60.0)),
    "x, y": (("ft", 3.28084), ("km", 1e-3), ("NM", 1 / 1852.0), ("mm", 1e3), ("cm", 1e2)),
    "u, v_m": (("kn", 1.943844), ("km/h", 3.6), ("cm/s", 100.0), ("m/s, taken as kn", 0.514444),
               ("m/s, taken as km/h", 1 / 3.6)),
    "u": (("kn", 1.943844), ("km/h", 3.6)),
    "v_m": (("kn", 1.943844), ("km/h", 3.6)),
    "t": (("ms", 1e3), ("us", 1e6), ("min", 1 / 60.0), ("h", 1 / 3600.0)),
}  # fmt: skip


def gross(trials: Sequence[Trial]) -> Iterator[Suspect]:
    """Signs, axes and units that a log is known to get wrong."""
    known = {name for trial in trials for name in trial.channels if has(trial, name)}
    if {"x", "y", "u", "v_m", "psi"} <= known:
        yield from _axes()
    for name, what in (("psi", "psi counts counterclockwise"), ("r", "r counts to port")):
        if name in known:
            yield Suspect("sign", (name,), what, f"change its sign: sign = -1 of {name} in the mapping, or "
                          f"trial.having({name}=-trial['{name}'])", "sign", times(-1.0, name))  # fmt: skip
    for names, units in _UNITS.items():
        channels = tuple(names.split(", "))
        if names != "t" and not set(channels) <= known:
            continue
        for unit, factor in units:
            repair = slower(1.0 / factor) if names == "t" else times(1.0 / factor, *channels)
            yield Suspect(
                "unit", channels, f"{names} {'is' if len(channels) == 1 else 'are'} in {unit}",
                f"say so in the unit of the column, or divide by {factor:.6g}", "unit", repair,
            )  # fmt: skip


def _axes() -> Iterator[Suspect]:
    for key, names, what, remedy, repair in (
        ("axes", ("u", "v_m"), "u, v_m are velocities north and east, not surge and sway",
         'turn them into body axes by psi: frame = { velocity = "earth" } in the mapping', _from_earth("u", "v_m")),
        ("axes", ("u", "v_m"), "u, v_m are velocities east and north",
         'exchange the columns, and frame = { velocity = "earth" } in the mapping', _from_earth("v_m", "u")),
        ("axes", ("x", "y"), "x is east and y is north", "exchange the two columns", _exchange("x", "y")),
        ("axes", ("u", "v_m"), "u is sway and v_m is surge", "exchange the two columns", _exchange("u", "v_m")),
        ("sign", ("v_m",), "v_m counts to port", "change its sign", times(-1.0, "v_m")),
        ("sign", ("u",), "u counts astern", "change its sign", times(-1.0, "u")),
        ("sign", ("y",), "y counts to the west", "change its sign", times(-1.0, "y")),
        ("sign", ("x",), "x counts to the south", "change its sign", times(-1.0, "x")),
        ("course_as_heading", ("psi",), "psi is the course over ground, not the heading",
         "take the column of the compass, or subtract the drift angle atan2(v_m, u)", _heading_of_course),
    ):  # fmt: skip
        yield Suspect(key, names, what, remedy, "sign" if key == "sign" else "axes", repair)


def slower(factor: float) -> Repair:
    return lambda trial: replace(trial, t=trial.t[0] + (trial.t - trial.t[0]) * factor, file=None)

"""Suspects that need no size: signs, axes and units that logs are known to get wrong; and what a suspect is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

from ...core.constants import KNOT, MILE
from ...core.values import dataclass
from .. import Trial
from ..prepare import Remedy, Step
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
        what: for people.
        remedy: what repairs the log.
        kind: of the fault.
        evidence: numbers beyond the common ones.
        grave: whether it makes a fit wrong beyond use.
        last: whether it is heard only where nobody else explains nearly as much.
    """

    key: str
    channels: tuple[str, ...]
    what: str
    remedy: Remedy
    kind: Kind
    evidence: str = ""
    grave: bool = True
    last: bool = False

    @property
    def repair(self) -> Repair:
        """The log as it should be."""
        return self.remedy.repair


def step(do: str, *channels: str, amount: tuple[float, ...] = (), unit: str = "", text: str = "") -> Remedy:
    """A remedy of one step, its numbers as they are printed."""
    digits = 6 if do in ("multiply", "clock") else 4
    rounded = tuple(float(f"{number:.{digits}g}") for number in amount)
    return Remedy(text, (Step(do=do, channels=channels, amount=rounded, unit=unit),))


def times(factor: float, *names: str, text: str = "") -> Remedy:
    return step("multiply", *names, amount=(factor,), text=text)


_UNITS: Mapping[str, Sequence[tuple[str, float]]] = {
    "psi": (("deg", 1 / _DEG), ("rad, converted from deg", _DEG)),
    "r": (("deg/s", 1 / _DEG), ("rad/s, converted from deg/s", _DEG), ("deg/min, taken as deg/s", 60.0),
          ("deg/s, taken as deg/min", 1 / 60.0), ("deg/min", 60.0 / _DEG), ("rad/s, taken as deg/min", _DEG / 60.0)),
    "x, y": (("ft", 3.28084), ("km", 1e-3), ("NM", 1 / MILE), ("mm", 1e3), ("cm", 1e2)),
    "u, v_m": (("kn", 1 / KNOT), ("km/h", 3.6), ("cm/s", 100.0), ("m/s, taken as kn", KNOT),
               ("m/s, taken as km/h", 1 / 3.6)),
    "u": (("kn", 1 / KNOT), ("km/h", 3.6)),
    "v_m": (("kn", 1 / KNOT), ("km/h", 3.6)),
    "t": (("ms", 1e3), ("us", 1e6), ("min", 1 / 60.0), ("h", 1 / 3600.0)),
}  # fmt: skip


def gross(trials: Sequence[Trial]) -> Iterator[Suspect]:
    """Signs, axes and units that a log is known to get wrong."""
    known = {name for trial in trials for name in trial.channels if has(trial, name)}
    if {"x", "y", "u", "v_m", "psi"} <= known:
        yield from _axes()
    for name, what in (("psi", "psi counts counterclockwise"), ("r", "r counts to port")):
        if name in known:
            yield Suspect("sign", (name,), what, times(-1.0, name), "sign")
    if {"psi", "r"} <= known:
        yield Suspect("sign", ("psi", "r"), "psi and r count counterclockwise", times(-1.0, "psi", "r"), "sign")
    if {"psi", "x", "y"} <= known:
        turned = (Step(do="multiply", channels=("psi",), amount=(-1.0,)),
                  Step(do="add", channels=("psi",), amount=(90.0,), unit="deg"))  # fmt: skip
        yield Suspect("axes", ("psi",), "psi counts counterclockwise from east", Remedy(steps=turned), "axes")
        turned += (Step(do="multiply", channels=("r",), amount=(-1.0,)),)
        if "r" in known:
            yield Suspect("axes", ("psi", "r"), "psi and r count counterclockwise, psi from east",
                          Remedy(steps=turned), "axes")  # fmt: skip
    for names, units in _UNITS.items():
        channels = tuple(names.split(", "))
        if names != "t" and not set(channels) <= known:
            continue
        for unit, factor in units:
            said = "correct the unit of the column in the mapping"
            remedy = step("clock", amount=(1.0 / factor,), text=said) if names == "t" else times(
                1.0 / factor, *channels, text=said
            )  # fmt: skip
            yield Suspect("unit", channels, f"{names} {'is' if len(channels) == 1 else 'are'} in {unit}", remedy,
                          "unit")  # fmt: skip


def _axes() -> Iterator[Suspect]:
    for key, names, what, remedy in (
        ("axes", ("u", "v_m"), "u, v_m are velocities north and east, not surge and sway",
         step("to_body", "u", "v_m")),
        ("axes", ("u", "v_m"), "u, v_m are velocities east and north", step("to_body", "v_m", "u")),
        ("axes", ("x", "y"), "x is east and y is north", step("exchange", "x", "y")),
        ("axes", ("u", "v_m"), "u is sway and v_m is surge", step("exchange", "u", "v_m")),
        ("sign", ("v_m",), "v_m counts to port", times(-1.0, "v_m")),
        ("sign", ("u",), "u counts astern", times(-1.0, "u")),
        ("sign", ("y",), "y counts to the west", times(-1.0, "y")),
        ("sign", ("x",), "x counts to the south", times(-1.0, "x")),
        ("course_as_heading", ("psi",), "psi is the course over ground, not the heading",
         step("from_course", "psi", text="take the column of the compass")),
    ):  # fmt: skip
        yield Suspect(key, names, what, remedy, "sign" if key == "sign" else "axes")

"""The [actuators] tables of a ship file: one per control, in the words of its kind of servo."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from typing import Any, Protocol

from .. import actuators
from ..actuators import Actuators, table
from ..core.parameters import Spec, unknown
from ..models import Model, unit
from . import Ship, ShipError

KINDS = {"Actuator": actuators.Actuator, "Azimuth": actuators.Azimuth, "Shaft": actuators.Shaft}
"""Kinds of actuator by the name in a ship's file."""
USUAL = "Actuator"
"""The kind where the file names none."""


class Reading(Protocol):
    """What is needed of a pass over a ship file."""

    path: Any

    def table(self, dotted: str) -> Mapping[str, Any]: ...

    def numbers(self, dotted: str, known: Mapping[str, Spec], required: set[str]) -> dict[str, float]: ...


def meanings(kind: type, control: str) -> dict[str, Spec]:
    """The numbers of a servo in the unit of its control: limits in rad, rates in rad/s for an angle."""
    own = unit(control)
    rated = {"1/s": "1/s^2", "rad": "rad/s"}.get(own, f"{own}/s")
    units: dict[str, str] = {"low": own, "high": own, "rate": rated, "rate_down": rated}
    found: dict[str, Spec] = {f.name: f.metadata["spec"] for f in fields(kind)}
    return {name: replace(s, unit=units.get(name, s.unit)) for name, s in found.items()}


def read_actuators(reading: Reading, model: Model) -> Actuators:
    """The servos of a file, by table name.

    Raises:
        ShipError: a table for a control that the ship has not, or an unknown kind of servo.
    """
    controls = {table(name): name for name in model.controls}
    # Rudder and propeller may stand for numbered ones and for what follows their orders.
    shared = {table(order): order for order, _ in model.follows if order in ("n_P", "delta")}
    known = {**shared, **controls}
    found: dict[str, actuators.Servo] = {}
    for key in reading.table("actuators"):
        spot = f"{reading.path}: actuators"
        if key not in known:
            raise ShipError(f"{spot}: {unknown(key, known, 'actuator')}")
        kind = reading.table(f"actuators.{key}").get("type", USUAL)
        if kind not in KINDS:
            raise ShipError(f"{spot}.{key}: {unknown(str(kind), KINDS, 'type')}")
        cls: Any = KINDS[kind]
        found[key] = cls(**reading.numbers(f"actuators.{key}", meanings(cls, known[key]), set()))
        low, high = found[key].low, found[key].high
        if not low < high:
            raise ShipError(f"{spot}.{key}: low {low:g} is not below high {high:g}")
    return Actuators(found)


def listed(ship: Ship) -> Iterator[tuple[str, str, list[tuple[str, float, str]]]]:
    """Table, kind and (key, value, unit) of each servo with values of its own; for writing a file."""
    names = {table(control): control for control in ("n_P", "delta", *ship.model.controls)}
    for name, servo in ship.actuators.by_name.items():
        known = meanings(type(servo), names[name])
        usual = {f.name: f.default for f in fields(type(servo))}  # type: ignore[arg-type]
        own = [(k, float(getattr(servo, k)), s.unit) for k, s in known.items() if getattr(servo, k) != usual[k]]
        if own:
            yield name, type(servo).__name__, own

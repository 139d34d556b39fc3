"""Faults of the own ship: between instruments and their readers, and between orders and the gear.

A recording of the ship has the orders that reached the gear, so a run with faults is reproduced like any other.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ...core.errors import RefusalError
from ...sensors import Reading
from ..loop import Loop
from .scenario import Fault

_DEGREE = math.pi / 180.0

INSTRUMENTS: Mapping[str, Mapping[str, tuple[str, float]]] = {
    "gnss": {"north": ("x", 1.0), "east": ("y", 1.0), "speed": ("U", 1.0), "course": ("chi", _DEGREE)},
    "gyro": {"heading": ("psi", _DEGREE)},
    "rate_gyro": {"rate": ("r", _DEGREE)},
    "speed_log": {"ahead": ("u_w", 1.0), "aside": ("v_w", 1.0)},
    "anemometer": {"speed": ("U_A", 1.0), "direction": ("gamma_A", _DEGREE)},
    "echo_sounder": {"below": ("below", 1.0)},
}
"""Instruments that may fail, and what of each may be wrong: its name in a scenario, in a reading, and its unit."""


class Faults:
    """The faults of one ship of a loop.

    Attributes:
        faults: what may happen.
        since: when each active fault began, by its number [s].
    """

    def __init__(self, loop: Loop, name: str, faults: Sequence[Fault]) -> None:
        """Come between orders, gear and instruments of the ship `name` from the next tick on."""
        self.faults, self._name, self._vessel = tuple(faults), name, loop.vessels[name]
        self._period = 1.0 / loop.rate
        self._controls = {k: self._moved(fault.of) for k, fault in enumerate(self.faults) if fault.of_gear}
        self.reset()
        if self.faults:
            plant = self._vessel.plant
            self._vessel.altered, plant.linkage = self._alter, self._link
            loop.after(self.tick)
            loop.keep(f"the faults of {name}", self)

    def set(self, loop: Loop, number: int, on: bool) -> None:
        """Begin or end a fault by its number; RefusalError: no such fault."""
        if not 0 <= number < len(self.faults):
            raise RefusalError("no such fault")
        if on == (number in self.since):
            return
        fault = self.faults[number]
        if on:
            self.since[number] = loop.t
        else:
            del self.since[number]
            self._held.pop(number, None)
            self._release(number)
        loop.tell(self._name, "fault", f"{fault.label} {'begins' if on else 'ends'}")

    def ordered(self, control: str) -> float:
        """What was ordered of a control, whatever reaches its gear."""
        return self._wanted.get(control, self._vessel.plant[f"{control}_cmd"])

    def tick(self, loop: Loop) -> None:
        """Begin and end what is due, and move slow gear on."""
        before, t = loop.t - self._period, loop.t
        for number, fault in enumerate(self.faults):
            due = None if fault.at is None else max(fault.at, self._period)
            if due is not None and before + 1e-9 < due <= t + 1e-9:
                self.set(loop, number, True)
            if fault.lasts is not None and number in self.since and t >= self.since[number] + fault.lasts - 1e-9:
                self.set(loop, number, False)
        for number in self.since:
            for control in self._controls.get(number, ()):
                self._hold(number, control)
                self._vessel.plant.order(control, self.ordered(control))

    def _moved(self, name: str) -> tuple[str, ...]:
        """Controls that a name means: its own, or those that obey an order of this name."""
        plant = self._vessel.plant
        return (name,) if name in plant.controls else plant.ship.model.obeying(name)

    def _link(self, control: str, value: float) -> float:
        """What reaches the gear of a control; what was ordered is remembered."""
        self._wanted[control] = value
        return self._through.get(control, value)

    def _hold(self, number: int, control: str) -> None:
        """What reaches a failed control during the next tick."""
        fault, plant = self.faults[number], self._vessel.plant
        wanted = self._wanted.setdefault(control, plant[f"{control}_cmd"])
        if fault.kind == "lost":
            self._through[control] = 0.0
        elif fault.kind == "jammed":
            self._through.setdefault(control, plant[control])
        else:
            now, step = self._through.get(control, plant[control]), fault.rate * self._period
            self._through[control] = min(max(wanted, now - step), now + step)

    def _release(self, number: int) -> None:
        for control in self._controls.get(number, ()):
            self._through.pop(control, None)
            if control in self._wanted:
                self._vessel.plant.order(control, self._wanted[control])

    def _alter(self, readings: list[Reading]) -> list[Reading]:
        found: list[Reading] = []
        for reading in readings:
            altered: Reading | None = reading
            for number in self.since:
                fault = self.faults[number]
                if altered is not None and fault.of == altered.kind and not fault.of_gear:
                    altered = self._altered(number, fault, altered)
            self._last[reading.kind] = dict(reading.values)
            if altered is not None:
                found.append(altered)
        return found

    def _altered(self, number: int, fault: Fault, reading: Reading) -> Reading | None:
        if fault.kind == "silent":
            return None
        if fault.kind == "frozen":
            return reading._replace(values=self._held.setdefault(number, self._last.get(reading.kind, reading.values)))
        grown = reading.t - self.since[number] if fault.kind == "drift" else 1.0
        errors = {name: value + max(grown, 0.0) * fault.by[name]
                  for name, value in reading.values.items() if name in fault.by}  # fmt: skip
        return reading._replace(values={**reading.values, **errors})

    def snapshot(self) -> dict[str, Any]:
        numbered = {str(k): dict(values) for k, values in self._held.items()}
        return {"since": {str(k): t for k, t in self.since.items()}, "held": numbered, "last": self._last,
                "wanted": self._wanted, "through": self._through}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        self.since = {int(k): float(t) for k, t in saved["since"].items()}
        self._held = {int(k): dict(values) for k, values in saved["held"].items()}
        self._last = {kind: dict(values) for kind, values in saved["last"].items()}
        self._wanted, self._through = dict(saved["wanted"]), dict(saved["through"])

    def reset(self) -> None:
        """End all."""
        self.since: dict[int, float] = {}
        self._held: dict[int, Mapping[str, float]] = {}
        self._last: dict[str, Mapping[str, float]] = {}
        self._wanted: dict[str, float] = {}
        self._through: dict[str, float] = {}

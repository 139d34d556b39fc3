"""FMUs aboard the own ship: an engine, a steering gear, a governor or a controller of somebody else's, wired by names.

An FMU reads values of the ship, or outputs of another FMU, and gives what a gear does (``n_P``) or an order
(``n_P_cmd``).  Each tick is one communication step of an explicit (Jacobi) master: all FMUs and the ship go from t to
t + h by what the others were at t.  What an order becomes on its way to the gear stands in `Plant.linkage`: first a
fault, then the FMU.

Not every FMU can save its state, so a return to an earlier state is a new instance that is given the same inputs again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..core.values import dataclass, field
from ..exchange.fmi.inside import Archive, Live
from ..models import unit
from .loop import Loop


@dataclass(frozen=True)
class Aboard:
    """An FMU and its wires.

    Attributes:
        name: its own, by which other FMUs read it.
        reads: by input of the FMU the value of the ship, or NAME.OUTPUT of another FMU.
        gives: by output of the FMU the control, or the order to it (``<control>_cmd``).
        start: values of its parameters and inputs at the start, in its own units.
        factors: by input or output, what its value is multiplied by to be in the unit of the ship.
    """

    name: str
    archive: Archive
    reads: Mapping[str, str] = field(default_factory=dict[str, str])
    gives: Mapping[str, str] = field(default_factory=dict[str, str])
    start: Mapping[str, float] = field(default_factory=dict[str, float])
    factors: Mapping[str, float] = field(default_factory=dict[str, float])

    def outputs(self, every: Sequence[Aboard]) -> tuple[str, ...]:
        """Its outputs that the ship or another FMU reads."""
        heard = (source for other in every for source in other.reads.values())
        wanted = [source.partition(".")[2] for source in heard if source.partition(".")[0] == self.name]
        return tuple(dict.fromkeys([*self.gives, *wanted]))


class Machinery:
    """The FMUs of one ship of a loop, stepped with it.

    Attributes:
        steers: whether one of them orders what the ship is steered by: angles, or shafts where there are none.
        heeded: whether orders of those that steer are passed on.
    """

    def __init__(self, loop: Loop, name: str, aboard: Sequence[Aboard]) -> None:
        """Come between orders and gear of the ship `name` from now on.

        Raises:
            RunError: an FMU does not start.
        """
        self._aboard, self._name, self._vessel = tuple(aboard), name, loop.vessels[name]
        self._period = 1.0 / loop.rate
        plant = self._vessel.plant
        self._outputs = {one.name: one.outputs(aboard) for one in aboard}
        self._driven = {control: f"{one.name}.{variable}" for one in aboard for variable, control in one.gives.items()
                        if control in plant.controls}  # fmt: skip
        angles = {control for control in plant.controls if unit(control) == "rad"} or set(plant.controls)
        self._orders = {f"{one.name}.{variable}": to.removesuffix("_cmd") for one in aboard
                        for variable, to in one.gives.items() if to not in self._driven}  # fmt: skip
        self._at_helm = {one.name for one in aboard if angles & {to.removesuffix("_cmd") for to in one.gives.values()
                                                                 if to not in self._driven}}  # fmt: skip
        self.steers, self.heeded = bool(self._at_helm), True
        self._live: dict[str, Live] = {}
        self._inner = plant.linkage
        if self._aboard:
            self.reset()
            plant.linkage = self._link
            self._pass_on()
            loop.after(self.tick)
            loop.keep(f"the machinery of {name}", self)

    def tick(self, loop: Loop) -> None:
        """Step all FMUs over the tick that the ship has made, by what the others were when it began."""
        if self._vessel.failure is not None:
            return
        row = [self._value(source) / one.factors.get(variable, 1.0) for one in self._aboard
               for variable, source in one.reads.items()]  # fmt: skip
        try:
            self._step(row)
        except Exception as error:
            self._vessel.failure = f"{self._failing} failed: {' '.join(str(error).split())[:200]}"
            loop.tell(self._name, "failed", self._vessel.failure)
            return
        self._seen = self._read()
        self._pass_on()
        for source, control in self._orders.items():
            if self.heeded or source.partition(".")[0] not in self._at_helm:
                loop.order(self._name, control, self._said[source])

    def _value(self, source: str) -> float:
        """What an input is given: an order as it stood over the tick, all else as it was when the tick began."""
        if source.endswith("_cmd"):
            return self._through.get(source.removesuffix("_cmd"), self._vessel.plant[source])
        return self._said[source] if "." in source else self._seen[source]

    def _step(self, row: list[float]) -> None:
        """One communication step by the inputs of all, which are kept."""
        values, t = iter(row), len(self._rows) * self._period
        for one in self._aboard:
            self._failing = one.archive.path.name
            live = self._live[one.name]
            live.set({variable: next(values) for variable in one.reads})
            live.step(t, self._period)
        self._rows.append(row)
        self._listen()

    def _listen(self) -> None:
        """Take the outputs of all, in the units of the ship; ValueError: one is not finite."""
        for one in self._aboard:
            self._failing, names = one.archive.path.name, self._outputs[one.name]
            for variable, value in zip(names, self._live[one.name].got(names), strict=True):
                if not math.isfinite(value):
                    raise ValueError(f"{variable} is {value}")
                self._said[f"{one.name}.{variable}"] = value * one.factors.get(variable, 1.0)

    def _read(self) -> dict[str, float]:
        """Values of the ship that FMUs read."""
        wanted = {source for one in self._aboard for source in one.reads.values() if "." not in source}
        return {source: self._vessel.plant[source] for source in wanted}

    def _pass_on(self) -> None:
        """Hand what the FMUs give to the gear, within its limits."""
        for control, source in self._driven.items():
            self._gear[control] = self._vessel.plant.reach[control].taken(self._said[source])
            self._vessel.plant.order(control, self._wanted[control])

    def _link(self, control: str, value: float) -> float:
        """What reaches the gear of a control; what was ordered is remembered."""
        passed = value if self._inner is None else self._inner(control, value)
        if control not in self._driven:
            return passed
        self._wanted[control], self._through[control] = value, passed
        return self._gear[control]

    def snapshot(self) -> dict[str, Any]:
        return {"rows": self._rows, "wanted": self._wanted, "through": self._through, "gear": self._gear}

    def restore(self, saved: Mapping[str, Any]) -> None:
        self._begin()
        for row in saved["rows"]:
            self._step([float(value) for value in row])
        self._wanted, self._through, self._gear = (dict(saved[one]) for one in ("wanted", "through", "gear"))
        self._seen = self._read()

    def reset(self) -> None:
        """Return to the start."""
        plant = self._vessel.plant
        self._wanted: dict[str, float] = {control: plant[f"{control}_cmd"] for control in self._driven}
        self._through: dict[str, float] = dict(self._wanted)
        self._gear: dict[str, float] = dict(self._wanted)
        self._first = self._read()
        self._begin()
        if plant.linkage is not None:
            self._pass_on()

    def _begin(self) -> None:
        """New instances of all FMUs, which begin by what the ship was at the start."""
        for live in self._live.values():
            live.end()
        self._rows: list[list[float]] = []
        self._said: dict[str, float] = {}
        self._seen = self._first
        self._live = {}
        for one in self._aboard:
            here = {variable: self._first[source] / one.factors.get(variable, 1.0)
                    for variable, source in one.reads.items() if source in self._first}  # fmt: skip
            self._live[one.name] = one.archive.live(one.name, 0.0, {**one.start, **here})
        self._listen()

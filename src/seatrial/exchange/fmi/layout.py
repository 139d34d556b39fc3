"""The variables of a co-simulation slave: names, units, where each stands among its values."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np

from ...actuators import table
from ...core.parameters import Spec, walk
from ...core.values import dataclass, replace
from ...environment import CALM
from ...models import unit
from ...models.network import Network
from ...models.neural import Neural
from ...models.settled import settled
from ...ships import Ship, ShipError
from ...simulate.approach import approach, straight
from ..traced import Equations, Number

PLACES = {
    "x": ("ned_position.north", "m", "midship north of the origin"),
    "y": ("ned_position.east", "m", "midship east of the origin"),
    "psi": ("ned_position.yaw", "rad", "heading, clockwise from north"),
    "u": ("body_velocity.surge", "m/s", "velocity ahead over ground"),
    "v_m": ("body_velocity.sway", "m/s", "velocity to starboard over ground, at midship"),
    "r": ("body_velocity.yaw", "rad/s", "yaw rate, to starboard"),
    "phi": ("ned_position.roll", "rad", "heel, starboard side down"),
    "p": ("body_velocity.roll", "rad/s", "roll rate, starboard side down"),
}
"""States as variables of an FMU: name, unit, what it is."""
RATES = (
    ("body_acceleration.surge", "m/s^2", "rate of body_velocity.surge"),
    ("body_acceleration.sway", "m/s^2", "rate of body_velocity.sway"),
    ("body_acceleration.yaw", "rad/s^2", "rate of body_velocity.yaw"),
)
"""Their derivatives, which model exchange wants."""
_SOURCES = {"thrust": "propellers, rudders and thrusters", "wind_forces": "the wind", "wave_forces": "the waves",
            "external_forces": "tugs, lines and all else"}  # fmt: skip
_AXES = (("surge", "N", "force ahead"), ("sway", "N", "force to starboard"),
         ("yaw", "N m", "moment about midship, to starboard"))  # fmt: skip

# Inputs from around the ship: name, unit, meaning, and what each adds to the channels of the environment.
AROUND = (
    (("wind_x", "wind_y"), (("wind.speed", "m/s", "true wind speed"),
                            ("wind.from", "rad", "where the true wind comes from, clockwise from north")),
     ("{0} * cos({1})", "{0} * sin({1})")),
    (("current_x", "current_y"), (("current_velocity.north", "m/s", "velocity of the water northwards"),
                                  ("current_velocity.east", "m/s", "velocity of the water eastwards")),
     ("{0}", "{1}")),
    (("wave_x", "wave_y"), (("waves.height", "m", "significant height of the waves"),
                            ("waves.from", "rad", "where the waves come from, clockwise from north")),
     ("{0} * cos({1})", "{0} * sin({1})")),
    (("wave_T",), (("waves.period", "s", "mean period of the waves; 0 without waves"),), ("{0}",)),
    (("per_depth",), (("water.depth", "m", "depth of the water; 0 where it is deep"),),
     ("{0} > 0.0 ? 1.0 / {0} : 0.0",)),
)  # fmt: skip


@dataclass(frozen=True)
class Real:
    """One variable: its name, SI unit and meaning, what it is to the host, where it starts and between which limits.

    `shown` is False for a number that no host can be given, such as a rate without limit.
    """

    name: str
    unit: str
    about: str
    causality: str
    start: float = 0.0
    low: float = -math.inf
    high: float = math.inf
    shown: bool = True


@dataclass(frozen=True)
class Layout:
    """All variables of a slave in the order of their value references.

    Attributes:
        plant: what is computed.
        outputs, inputs, numbers, servos, starts: the variables, one after the other.
        terms: by control and by channel of the environment, its value in C from the inputs v[].
        step: internal step [s].
        whole: whether orders go in, through the actuators; else forces.
        network: what moves the ship, where no right-hand side does.
    """

    plant: Equations
    outputs: tuple[Real, ...]
    inputs: tuple[Real, ...]
    numbers: tuple[Real, ...]
    servos: tuple[Real, ...]
    starts: tuple[Real, ...]
    terms: tuple[tuple[str, ...], tuple[str, ...]]
    step: float
    whole: bool
    network: Neural | None

    @property
    def all(self) -> tuple[Real, ...]:
        """By value reference."""
        return (*self.outputs, *self.inputs, *self.numbers, *self.servos, *self.starts)


def layout(ship: Ship, made: Equations, step: float) -> Layout:
    """The variables of a ship; the whole one where `made` has actuators, else a hull under forces.

    Raises:
        ShipError: a whole ship without a steady straight run to start from.
    """
    whole = made.servos is not None
    state, control = _beginning(ship, whole)
    network = ship.model if isinstance(ship.model, Neural) else None
    felt = _felt(made) if network is None else _seen(network.network)
    inputs, (orders, channels) = _inputs(made, control, felt, whole)
    states = tuple(_placed(v.name, v.about) for v in made.states)
    adrift = "current_x" in felt  # the model holds within speeds through the water, these are over ground
    outputs = [Real(n, u, about, "output") if adrift and v.name in ("u", "v_m")
               else Real(n, u, about, "output", low=v.low, high=v.high)  # where the model holds
               for (n, u, about), v in zip(states, made.states, strict=True)]  # fmt: skip
    over = "" if network is None else " over the last sample"
    outputs += [Real(n, u, about + over, "output") for n, u, about in RATES]
    starts = [Real(f"initial.{n}", u, f"at the start: {about}", "parameter", v)
              for (n, u, about), v in zip(states, state, strict=True)]  # fmt: skip
    if whole:
        outputs += [Real(f"feedback.{v.name}", v.unit, f"actual {v.name}", "output") for v in made.controls]
        starts += [Real(f"initial.feedback.{v.name}", v.unit, f"actual {v.name} at the start", "parameter", c)
                   for v, c in zip(made.controls, control, strict=True)]  # fmt: skip
    meanings = {path: meaning for path, meaning, _ in walk(ship.model)}
    return Layout(
        plant=made, outputs=tuple(outputs), inputs=inputs,
        numbers=tuple(_number(n, f"ship.{n.path}", n.unit, meanings.get(n.path)) for n in made.numbers),
        servos=tuple(_servo_numbers(ship, made)), starts=tuple(starts), terms=(orders, channels), step=step,
        whole=whole, network=network,
    )  # fmt: skip


def _placed(name: str, about: str) -> tuple[str, str, str]:
    return PLACES.get(name, (f"state.{name}", unit(name), about))


def _beginning(ship: Ship, whole: bool) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """State and controls at the start: a straight run at the approach speed, or a hull at rest."""
    speed, n_P = _approach(ship) if whole else (0.0, 0.0)
    control = tuple(float(c) + 0.0 for c in straight(ship, n_P))  # no zero with a sign
    rest = settled(ship.model, np.array([[*control, *CALM]], dtype=np.float64))[0]
    return (0.0, 0.0, 0.0, float(speed), 0.0, 0.0, *rest.tolist()), control


def _approach(ship: Ship) -> tuple[float, float]:
    """Speed [m/s] and revolutions [1/s] of the straight run; of a network that finds none, those of the ship file."""
    try:
        return approach(ship)
    except ShipError:
        if not isinstance(ship.model, Neural):
            raise
        return ship.speed, ship.n_P or 0.0


def _inputs(
    made: Equations, control: tuple[float, ...], felt: set[str], whole: bool
) -> tuple[tuple[Real, ...], tuple[tuple[str, ...], tuple[str, ...]]]:
    """The inputs that act, and how controls and environment follow from them."""
    if whole:
        found = [_order(v.name, v.unit, v.low, v.high, c) for v, c in zip(made.controls, control, strict=True)]
        acting = [f"v[{k}]" for k in range(len(found))]
    else:
        found = [Real(f"{group}.{axis}", u, f"{about} of {who}", "input")
                 for group, who in _SOURCES.items() for axis, u, about in _AXES]  # fmt: skip
        acting = [" + ".join(f"v[{k}]" for k in range(j, len(found), 3)) for j in range(3)]
    channels = ["0.0"] * len(made.environment)
    at = {v.name: k for k, v in enumerate(made.environment)}
    for names, reals, forms in AROUND:
        if not any(name in felt for name in names):
            continue
        places = [f"v[{len(found) + k}]" for k in range(len(reals))]
        found += [Real(name, u, about, "input") for name, u, about in reals]
        for name, form in zip(names, forms, strict=True):
            channels[at[name]] = form.format(*places)
    return tuple(found), (tuple(acting), tuple(channels))


def _order(name: str, unit_: str, low: float, high: float, start: float) -> Real:
    inside = low <= start <= high
    limits = (low, high) if inside else (-math.inf, math.inf)
    return Real(f"order.{name}", unit_, f"ordered {name}", "input", start, *limits)


def _felt(made: Equations) -> set[str]:
    """Channels of the environment that the ship feels."""
    x, u, e = (ca.SX.sym(k, len(v)) for k, v in zip("xue", (made.states, made.controls, made.environment), strict=True))
    bears = ca.which_depends(made.rates(x, u, e), e, 1, False)
    return {v.name for v, found in zip(made.environment, bears, strict=True) if found}


def _seen(network: Network) -> set[str]:
    """Channels of the environment that a ship with this network feels."""
    return {"current_x", "current_y", *(("wind_x", "wind_y") if network.wind else ())}


def _number(n: Number, name: str, unit_: str, meaning: Spec | None) -> Real:
    """A parameter; its limits are left out where the ship itself stands outside them."""
    found = Real(name, unit_, f"{n.about}; {n.source}", "parameter", n.value, shown=math.isfinite(n.value))
    if meaning is not None and meaning.low <= n.value <= meaning.high:
        found = replace(found, low=meaning.low, high=meaning.high)
    return found


def _servo_numbers(ship: Ship, made: Equations) -> Iterator[Real]:
    """Limits, rates and lags; a limit in the unit of its control, a rate in that per second."""
    units = {table(control): unit(control) for control in ship.model.controls}
    for n in made.servos.numbers if made.servos is not None else ():
        name, _, limit = n.path.rpartition(".")
        own: Any = units.get(name, "")
        per_second = f"{own}^2" if own.endswith("/s") else f"{own}/s"
        known = own if limit in ("low", "high") else per_second if limit.startswith("rate") else n.unit
        yield _number(n, f"actuator.{n.path}", known, None)

"""Subjects of the conformance checks, found by walking the rooms: force modules, ships, families, manoeuvres."""

from __future__ import annotations

import inspect
import itertools
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, is_dataclass, replace
from fnmatch import fnmatchcase
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from .. import forces
from ..core.parameters import ParameterError, Parts, update, walk
from ..core.symbolic import magnitude
from ..environment import CHANNELS, Environment
from ..forces import Flow, Force, Slipstream, ThrusterModule
from ..models import Model, Sampled, unit
from ..ships import Ship
from ..ships.files import library, load
from ..simulate.run import approach, straight
from . import examples


class ContractError(AssertionError):
    """A class that breaks the contract of its room; the text names the rule and the place."""


def require(kept: Any, text: str) -> None:
    """Raise a ContractError with the text unless the condition holds."""
    if not kept:
        raise ContractError(text)


def declared(thing: Any) -> None:
    """Every number is declared with what it is, and lies within what physics allows."""
    for path, meaning, value in walk(thing):
        require(meaning.about, f"{path}: no word on what it is")
        require(meaning.low <= value <= meaning.high, f"{path} is {value:g}, outside its range")


@cache
def ships() -> dict[str, Ship]:
    """Ships of the library, examples of what none of them has, and one for each option of a family's choices."""
    known = {name: load(name) for name in library()} | examples.SHIPS
    return known | _alternatives(known)


def _alternatives(known: Mapping[str, Ship]) -> dict[str, Ship]:
    """The first ship of a family for each option of its choices (not those of its force modules) that none has."""
    found: dict[str, Ship] = {}
    flown = [(name, ship, prefix, part) for name, ship in known.items() for prefix, part in components(ship.model)
             if type(part).__module__.startswith("seatrial.models")]  # fmt: skip
    seen = {(type(part), field, vars(part)[field]) for _, _, _, part in flown for field in choices(part)}
    for name, ship, prefix, part in flown:
        for field, option in options(part):
            if (type(part), field, option) not in seen:
                seen.add((type(part), field, option))
                other = replace(part, **{field: option})
                whole: Any = ship.model
                changed = replace(whole, **{prefix.removesuffix("."): other}) if prefix else other
                found[f"{name}[{field}={option}]"] = replace(ship, model=changed)
    return found


# Numbers that make port and starboard differ: pairs that must be equal, then those that must vanish, by class.
PAIRS = (("gamma_Rp", "gamma_Rn"), ("gamma_P", "gamma_N"), ("C_2p", "C_2n"))
BIASES = {
    "FourQuadrant": ("[AB]_?",),
    "AdvanceAngle": ("[YN]_?",),
    "Polynomial": ("X_v", "X_r", "Y_u", "N_u"),
    "Inertia": ("m_12", "m_21", "m_13", "m_31"),
    "Nomoto": ("delta_r",), "NomotoTable": ("delta_r",), "Nomoto2": ("delta_r",),
    "Arx": ("coefficients.*_constant", "coefficients.u_v_m_*", "coefficients.u_r_*", "coefficients.u_delta_*",
            "coefficients.v_m_u_*", "coefficients.v_m_n_P_*", "coefficients.r_u_*", "coefficients.r_n_P_*"),
}  # fmt: skip


def biases(component: Any) -> tuple[str, ...]:
    """Patterns of the numbers of a component that make port and starboard differ."""
    own = component.asymmetries if hasattr(component, "asymmetries") else ()
    return (*BIASES.get(type(component).__name__, ()), *own)


def key_of(component: Any) -> str:
    """Its file and class, such as ``rudder:Standard``."""
    return f"{type(component).__module__.rsplit('.', 1)[-1]}:{type(component).__name__}"


def components(model: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """`model` and every component within it, with the prefix of its paths."""
    yield prefix, model
    for f in fields(model):
        value = vars(model)[f.name]
        if isinstance(value, Parts):
            for name, part in value.items():
                yield from components(part, f"{prefix}{f.name}.{name}.")
        elif is_dataclass(value) and not f.metadata:
            yield from components(value, f"{prefix}{f.name}.")


def even(model: Any) -> Any:
    """`model` with port and starboard coefficients made equal and its bias to one side taken away."""
    changes: dict[str, float] = {}
    for prefix, component in components(model):
        for a, b in PAIRS:
            if a in vars(component):
                changes[prefix + a] = vars(component)[b]
        nested = hasattr(component, "mirror_symmetric") or "." not in prefix
        known = [path for path, _, _ in walk(component) if nested or "." not in path]
        own = [path for path in known if any(fnmatchcase(path, pattern) for pattern in biases(component))]
        changes |= {prefix + path: 0.0 for path in own}
        if "to_port" in vars(component):
            changes[f"{prefix}to_port"] = 1.0
    return update(model, changes)


def choices(component: Any) -> dict[str, tuple[str, ...]]:
    """Texts of a component that pick a published form, with their options."""
    return {f.name: f.metadata["choice"][1] for f in fields(component) if "choice" in f.metadata}


def options(component: Any) -> Iterator[tuple[str, str]]:
    """Each choice of a component with each of its options."""
    return ((field, option) for field, known in choices(component).items() for option in known)


def variants(component: Any) -> Iterator[tuple[str, Any]]:
    """A component in each of its published forms for which it has the numbers, with a name."""
    known = choices(component)
    for picked in itertools.product(*known.values()):
        named = dict(zip(known, picked, strict=True))
        label = ",".join(f"{field}={option}" for field, option in named.items())
        with suppress(ParameterError):
            yield f"{key_of(component)}[{label}]" if label else key_of(component), replace(component, **named)


def classes_of(room: ModuleType) -> Iterator[type]:
    """Every frozen dataclass of the modules of a room, `ships` and the like left out."""
    for info in iter_modules(room.__path__):
        module = import_module(f"{room.__name__}.{info.name}")
        for cls in vars(module).values():
            if inspect.isclass(cls) and is_dataclass(cls) and cls.__module__ == module.__name__:
                yield cls


def _beside(room: ModuleType) -> Iterator[Any]:
    """The `EXAMPLES` that a module of a room gives beside its classes."""
    for info in iter_modules(room.__path__):
        yield from getattr(import_module(f"{room.__name__}.{info.name}"), "EXAMPLES", ())


INPUTS = len(Flow._fields) - 3
"""Inputs of a force: what it feels besides the density and the size of the ship."""


class Part(NamedTuple):
    """A force module and the ship it is tried on: density, length, draught, speed, revolutions."""

    module: Any
    rho: float
    L_pp: float
    d: float
    U: float
    n: float

    @property
    def prefixes(self) -> tuple[str, ...]:
        """Controls of its own."""
        return self.module.prefixes if isinstance(self.module, ThrusterModule) else ()

    @property
    def size(self) -> np.ndarray:
        """Usual size of each input of `outputs`."""
        U, L = self.U, self.L_pp
        own = [{"n": self.n, "alpha": 1.0}.get(prefix, 100.0) for prefix in self.prefixes]
        waves = (0.01 * L, 0.01 * L, L**0.5)
        place = (1.0, 1.0, 4 / L, 4 / L, 0.3 * L, 0.8 * L, U, L, 0.1 * self.d * L)
        return np.array([U, 0.4 * U, 0.8 * U / L, self.n, 0.7, 3 * U, 3 * U, *waves, 0.8, *place, *own])

    @property
    def mirror(self) -> np.ndarray:
        """Sign of each input in the mirror."""
        signs = (1, -1, -1, 1, -1, 1, -1, 1, -1, 1, 1, 1, -1, 1, -1, 1, -1, 1, 1, 1)
        return np.array([*signs, *(control_sign(prefix, self.module) for prefix in self.prefixes)])

    def outputs(self, x: Any) -> tuple[Any, ...]:
        """X, Y, N and the slipstream where there is one, from flow and own controls."""
        at = INPUTS
        flow = Flow._make((*x[:7], self.rho, self.L_pp, self.d, *x[7:at]))
        if self.prefixes:
            return tuple(self.module.force(flow, tuple(x[at:])))
        if len(inspect.signature(self.module.force).parameters) == 2:  # a rudder
            D = 0.03 * self.L_pp
            race = 0.25 * flow.n_P * magnitude(flow.n_P) * D * D
            return tuple(self.module.force(flow, Slipstream(0.6 * flow.u, race, D)))
        out = self.module.force(flow)
        return tuple(out) if isinstance(out, Force) else (*out[0], *out[1])


def control_sign(prefix: str, part: ThrusterModule | None = None) -> float:
    """Sign of a control in the mirror; revolutions change theirs where the thrust is across the ship."""
    across = prefix == "n" and part is not None and part.prefixes == ("n",) and part.follows[0][0] != "n_P"
    return -1.0 if across or prefix in ("alpha", "delta", "Y", "N") else 1.0


def parts_of(ship: Ship) -> Iterator[tuple[str, Part]]:
    """Every force module of a ship in each form for which it has the numbers, with a name."""
    body: Any = ship.model.part("body")
    U, L = ship.speed, ship.L_pp
    for _, component in components(ship.model):
        if hasattr(component, "force") and not type(component).__module__.startswith("seatrial.models."):
            for name, module in variants(component):
                yield name, Part(module, body.rho, body.L_pp, body.d, U, 40 * U / L)


@cache
def force_modules() -> dict[str, Part]:
    """Every force module of the library, of the modules' own `EXAMPLES` and of ours, each class in each form once."""
    found: dict[str, Part] = {}
    for ship in ships().values():
        for name, part in parts_of(ship):
            found.setdefault(name, part)
    for module in (*examples.MODULES, *_beside(forces)):
        for name, form in variants(module):
            found.setdefault(name, Part(form, 1000.0, 7.0, 0.46, 1.179, 7.0))
    return found


def control_size(ship: Ship) -> tuple[float, ...]:
    """Usual size of each control: that of the approach, and as much again for what is at rest there."""
    running = straight(ship, approach(ship)[1] or 1.0)
    named = {name: abs(x) for name, x in zip(ship.model.controls, running, strict=True)}
    newton = max((x for name, x in named.items() if unit(name) == "N"), default=100.0)
    usual = {"rad": 0.5, "1/s": 10.0, "N": newton, "N m": 0.2 * newton * ship.L_pp, "-": 0.5}
    return tuple(0.5 if unit(name) == "rad" else x or usual[unit(name)] for name, x in named.items())


def state_size(ship: Ship) -> tuple[float, ...]:
    """Usual size of each state."""
    U, L = ship.speed, ship.L_pp
    six, own = (10 * L, 10 * L, 3.0, U, 0.3 * U, 0.5 * U / L), ship.model.states[6:]
    return (*six, *({"phi": 0.4, "p": 0.4 * U / L}.get(name, 0.1 * (U / L) ** 2) for name in own))


def rate_size(ship: Ship) -> np.ndarray:
    """Natural size of the rate of each state: that of the states in the time that the ship needs for its length."""
    U, pace = ship.speed, ship.speed / ship.L_pp
    own = [{"phi": pace, "p": pace * pace}.get(name, 0.1 * pace**3) for name in ship.model.states[6:]]
    return np.array([U, U, pace, U * pace, U * pace, pace * pace, *own])


def environment_size(ship: Ship) -> tuple[float, ...]:
    """Usual size of each channel of the environment; water down to 1.1 draughts."""
    U, L = ship.speed, ship.L_pp
    d = ship.model.draught or L / 15
    return (2 * U, 2 * U, 0.1 * U, 0.1 * U, 0.01 * L, 0.01 * L, L**0.5, 1 / (1.1 * d))


def flat(ship: Ship) -> tuple[Callable[[Any], tuple[Any, ...]], np.ndarray]:
    """All rates of a ship as a function of one vector (states, controls, environment, memory), and its size."""
    model: Any = ship.model
    n, c = len(model.states), len(model.controls)
    memory = len(model.memory) if isinstance(model, Sampled) else 0

    def rates(x: Any) -> tuple[Any, ...]:
        state, control, around = tuple(x[:n]), tuple(x[n : n + c]), Environment(*x[n + c : n + c + len(CHANNELS)])
        out = tuple(model.derivative(state, control, around))
        if not memory:
            return out
        change, after = model.advance(state, control, around, tuple(x[n + c + len(CHANNELS) :]))
        return (*out, *change, *after)

    return rates, np.array([*state_size(ship), *control_size(ship), *environment_size(ship), *([0.1] * memory)])


def mirrored_control(model: Model, control: tuple[Any, ...]) -> tuple[Any, ...]:
    """Controls of the mirror image: sides change places, angles and lateral thrusts change sign."""
    given = dict(zip(model.controls, control, strict=True))
    parts_ = model.thrusters_by_name
    out: list[Any] = []
    for name in model.controls:
        prefix, _, rest = name.partition("_")
        if rest in parts_:
            partner = f"{prefix}_{other_side(parts_, rest)}"
            sign = control_sign(prefix, parts_[rest])
        else:
            partner = re.sub("_[12]$", lambda m: {"_1": "_2", "_2": "_1"}[m[0]], name)
            sign = control_sign(prefix)
        out.append(sign * given[partner])
    return tuple(out)


def other_side(parts_: Mapping[str, Any], name: str) -> str:
    """The thruster that is the mirror image of a thruster; itself on the centre line."""
    part = parts_[name]
    if not vars(part).get("y"):
        return name
    found = [other for other, x in parts_.items() if x == replace(part, y=-part.y)]
    require(found, f"thruster {name} has no partner on the other side")
    return found[0]


def compiled(f: Callable[[Any], tuple[Any, ...]], n: int) -> tuple[ca.Function, ca.Function]:
    """`f` of n symbols, and its Jacobian; both take one input a column."""
    x = ca.SX.sym("x", n)
    y = ca.vertcat(*(ca.SX(e) for e in f(tuple(x[i] for i in range(n)))))
    return ca.Function("f", [x], [y]), ca.Function("j", [x], [ca.densify(ca.jacobian(y, x))])

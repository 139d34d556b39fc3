"""From model to full scale, and back: Froude's law for every number, and the effects of Reynolds number.

By Froude's law lengths go with the scale, times and velocities with its root; primed numbers and ratios stay.  What
does not follow it is friction: the ITTC-1957 line with a form factor and, on the ship, the roughness of its hull change
R_0; the wake fraction follows the friction by the ITTC-1978 performance prediction method; the stream at the rudder,
epsilon (1 - w_P0), follows the wake.  The thrust deduction stays (ITTC 1978), as do open water, the derivatives of
drift and yaw, and the flow straightening.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

from ..actuators import Actuators
from ..core.parameters import PRIME, read, specs, update, values
from ..core.values import dataclass, replace
from ..models import unit as unit_of
from . import Entry, Ship, ShipError
from .actuation import meanings
from .numbers import FACTORS, Yardsticks, resolve
from .writing import OWN

ROUGHNESS = 150e-6
"""Roughness of a new hull k_S [m] (ITTC 1978)."""

RUDDER = ("proportion", "own")
"""How the stream at the rudder follows the wake at the propeller; see `scale`."""

# Density where a file says none [kg/m^3].
_FRESH, _SEA = 1000.0, 1025.0
_VISCOSITY = {"fresh": 1.139e-6, "sea": 1.188e-6}
"""Kinematic viscosity at 15 degC [m^2/s] (ITTC 7.5-02-01-03)."""
# Density above which water is sea water [kg/m^3]; length above which a hull is a ship's, least and greatest length [m].
_SALT, _AT_SEA, _REACH = 1010.0, 30.0, (0.1, 600.0)
_BEHIND = 0.04
"""Part of the rudder in the wake that friction does not change (ITTC 1978)."""
_UNIT = re.compile(r"([A-Za-z]+)(?:\^(\d+))?")
_POWERS = {"m": 1.0, "s": 0.5, "kg": 3.0, "N": 3.0, "rad": 0.0, "W": 3.5}


@dataclass(frozen=True)
class Friction:
    """Frictional resistance at one scale.

    Attributes:
        Re: Reynolds number over L_pp.
        C_F: of the ITTC-1957 line.
        dC_F: of the roughness of the hull.
        form: form factor k.
    """

    Re: float
    C_F: float
    dC_F: float
    form: float

    @property
    def whole(self) -> float:
        """(1 + k) C_F + dC_F."""
        return (1.0 + self.form) * self.C_F + self.dC_F

    @property
    def smooth(self) -> float:
        """(1 + k) C_F."""
        return (1.0 + self.form) * self.C_F


@dataclass(frozen=True)
class Scaled:
    """A ship at another length.

    Attributes:
        ship: at that length.
        before, after: friction at either.
        S: wetted surface of the new ship [m^2].
        effects: numbers that do not follow Froude's law, by path: before, after, and why.
        cautions: what the method does not cover.
    """

    ship: Ship
    before: Friction
    after: Friction
    S: float
    effects: Mapping[str, tuple[float, float, str]]
    cautions: tuple[str, ...]


def line_1957(Re: float) -> float:
    """C_F = 0.075/(log10 Re - 2)^2, the model-ship correlation line of the ITTC (1957)."""
    return 0.075 / (math.log10(Re) - 2.0) ** 2


def roughness(k_S: float, L: float) -> float:
    """dC_F = (105 (k_S/L)^(1/3) - 0.64) 1e-3, ITTC 1978; not below zero."""
    return max(105.0 * (k_S / L) ** (1.0 / 3.0) - 0.64, 0.0) * 1e-3 if k_S > 0 else 0.0


def form_factor(L: float, B: float, d: float, C_b: float) -> float:
    """K = -0.095 + 25.6 C_b/((L/B)^2 sqrt(B/d)) (Watanabe; ITTC 1978 lists it as an approximation)."""
    return -0.095 + 25.6 * C_b / ((L / B) ** 2 * math.sqrt(B / d))


def wake(w: float, t: float, of: float, to: float) -> float:
    """Wake fraction at another friction: (t + 0.04) + (w - t - 0.04) to/of (ITTC 1978), either way round."""
    potential = t + _BEHIND
    return potential + (w - potential) * to / of


def scale(
    ship: Ship, L_pp: float, *, form: float | None = None, k_S: float = ROUGHNESS, rho: float | None = None,
    rudder: str = "proportion", effects: bool = True,
) -> Scaled:  # fmt: skip
    """`ship` at another length.

    Args:
        L_pp: of the new ship [m].
        form: form factor k; that of `form_factor` unless given.
        k_S: roughness of the hull of a ship [m]; a model, below 30 m, is smooth.
        rho: density of its water [kg/m^3]; fresh below 30 m and sea above unless given.
        rudder: "proportion": epsilon stays, so that the stream at the rudder follows the wake at the propeller in
            proportion; "own": the wake at the rudder, 1 - epsilon (1 - w_P0), is scaled like that of the propeller.
        effects: False leaves the effects of Reynolds number out.

    Raises:
        ShipError: a length that no ship has, or a family that has no resistance or wake of its own.
    """
    if not _REACH[0] <= L_pp <= _REACH[1]:
        raise ShipError(f"the length is {L_pp:g} m; a ship or a model has {_REACH[0]:g} to {_REACH[1]:g} m")
    known = values(ship.model)
    if "body.rho" not in known:
        raise ShipError(f"{ship.name}: {type(ship.model).__name__} has no body in water that could be scaled; "
                        "ships of the family MMG have")  # fmt: skip
    if effects and "hull.R_0" not in known:
        raise ShipError(f"{ship.name}: its hull has no R_0 whose friction could be scaled; "
                        "Froude's law alone is --froude (effects = False)")  # fmt: skip
    density = rho if rho is not None else (_SEA if L_pp > _AT_SEA else _FRESH)
    if rho is None and (density > _SALT) == (known["body.rho"] > _SALT):
        density = float(known["body.rho"])
    ratio = L_pp / ship.L_pp
    by_law = _geosim(ship, ratio, density / float(known["body.rho"]))
    k = form if form is not None else _form(known) if effects else 0.0
    S = _wetted(known) * ratio**2
    before, after = _friction(ship, k, k_S), _friction(by_law, k, k_S)
    found = _effects(by_law, before, after, S, rudder) if effects else {}
    about = f"scaled from {ship.name}"
    entries = dict(by_law.entries)
    for path, (_, value, why) in found.items():
        primed, before_it = specs(ship.model)[path].unit == PRIME, entries.get(path)
        entries[path] = Entry(f"{about}: {why}", value, prime=primed, sigma=before_it and before_it.sigma)
    model = update(by_law.model, {path: value for path, (_, value, _) in found.items()})
    cautions = _cautions(ship, found, k, form is None)
    notes = {key: value for key, value in ship.notes.items() if key not in ("provenance", "estimate", *OWN)}
    notes["title"] = f"{ship.notes.get('title', ship.name)}, scaled to {L_pp:g} m"
    notes["cautions"] = [*ship.notes.get("cautions", ()), *cautions]
    made = replace(by_law, model=model, entries=entries, notes=notes, name=f"{ship.name}_{L_pp:g}m".replace(".", "_"),
                   of=ship.of or ship.name)  # fmt: skip
    return Scaled(made, before, after, S, found, cautions)


def power(unit: str) -> tuple[float, float]:
    """Powers of scale and of the density's ratio by which a number in a unit goes, such as (3.0, 1.0) for N.

    Raises:
        ShipError: a unit that is not made of kg, m, s, N, rad and W.
    """
    length, mass = 0.0, 0.0
    over = 1.0
    for part in re.split(r"([ /])", unit.strip()):
        if part == "/":
            over = -1.0
        if part in ("", " ", "/", "1", "-", PRIME):
            continue
        found = _UNIT.fullmatch(part)
        if found is None or found[1] not in _POWERS:
            raise ShipError(f"unit '{unit}' cannot be scaled; known: {', '.join(_POWERS)}")
        times = over * float(found[2] or 1)
        length += times * _POWERS[found[1]]
        mass += times * (found[1] in ("kg", "N", "W"))
    return length, mass


def _geosim(ship: Ship, ratio: float, denser: float) -> Ship:
    """The ship by Froude's law alone."""

    def moved(value: float, unit: str) -> float:
        length, mass = power(unit)
        return value * ratio**length * denser**mass

    known, units = values(ship.model), {path: meaning.unit for path, meaning in specs(ship.model).items()}
    changes = {path: moved(value, units[path]) for path, value in known.items()}
    for path in changes:
        if units[path] == "kg/m^3":  # water as it is there; air is the same everywhere
            changes[path] = known[path] * (denser if path == "body.rho" else 1.0)
    servos: dict[str, Any] = {}
    actuators: dict[str, Any] = dict(ship.actuators.by_name)
    for name, servo in actuators.items():
        control = {"rudder": "delta", "propeller": "n_P"}.get(name, name)
        said = meanings(type(servo), control)
        servos[name] = replace(servo, **{key: moved(getattr(servo, key), one.unit) for key, one in said.items()
                                         if math.isfinite(getattr(servo, key))})  # fmt: skip
    validity = {name: (moved(a, unit_of(name)), moved(b, unit_of(name))) for name, (a, b) in ship.validity.items()}
    yards = Yardsticks(*(float(known.get(f"body.{key}", math.nan)) for key in ("rho", "L_pp", "d")))
    longer = Yardsticks(yards.rho * denser, changes.get("body.L_pp", math.nan), changes.get("body.d", math.nan))
    for path, entry in ship.entries.items():  # a number printed in primes stays so, to the last digit
        if entry.prime and path in known and resolve(entry, units[path], yards) == known[path]:
            changes[path] = resolve(entry, units[path], longer) or 0.0
    entries = {path: _entry(path, entry, ship.name, units.get(path, ""), changes, moved, denser)
               for path, entry in ship.entries.items()}  # fmt: skip
    return replace(
        ship, model=update(ship.model, changes), L_pp=ship.L_pp * ratio, speed=ship.speed * math.sqrt(ratio),
        n_P=None if ship.n_P is None else ship.n_P / math.sqrt(ratio),
        actuators=Actuators(servos), validity=validity, entries=entries,
    )  # fmt: skip


def _entry(
    path: str, entry: Entry, name: str, unit: str, changes: Mapping[str, float],
    moved: Callable[[float, str], float], denser: float,
) -> Entry:  # fmt: skip
    """Where a number comes from once it is scaled; a prime or a ratio is what it was."""
    inside = unit or next((to for of, to in FACTORS if of == entry.unit), entry.unit)
    water = inside == "kg/m^3" and path.endswith(".rho")
    if entry.prime or (power(inside) == (0.0, 0.0) and not water):
        return entry
    if inside == "kg/m^3" and not water:
        return entry
    held = resolve(entry, inside, None)
    old = entry.given if held is None else held
    value = changes.get(path, old * denser if water else moved(old, inside))
    factor = value / old if old else 1.0
    sigma = None if entry.sigma is None else entry.sigma * abs(factor)
    printed = f"{entry.given:g} {entry.unit or inside}".strip()
    source = f"water of {name} is {printed}" if water else f"by Froude's law from {printed} of {name}; {entry.source}"
    return Entry(source, value, unit=inside, sigma=sigma)


def _form(known: Mapping[str, float]) -> float:
    """Form factor from the dimensions and the displacement."""
    L, B, d = (known[f"body.{key}"] for key in ("L_pp", "B", "d"))
    return form_factor(L, B, d, known["body.m"] / (known["body.rho"] * L * B * d))


def _wetted(known: Mapping[str, float]) -> float:
    """Wetted surface 1.7 L d + volume/d (Denny and Mumford) [m^2]; NaN for a hull without draught."""
    d = float(known.get("body.d", 0.0))
    return 1.7 * known["body.L_pp"] * d + known["body.m"] / known["body.rho"] / d if d else math.nan


def _friction(ship: Ship, form: float, k_S: float) -> Friction:
    """Friction at the approach speed."""
    water = "sea" if float(read(ship.model, "body.rho")) > _SALT else "fresh"
    Re = ship.speed * ship.L_pp / _VISCOSITY[water]
    return Friction(Re, line_1957(Re), roughness(k_S if ship.L_pp > _AT_SEA else 0.0, ship.L_pp), form)


def _effects(
    ship: Ship, before: Friction, after: Friction, S: float, rudder: str
) -> dict[str, tuple[float, float, str]]:
    """Numbers that friction changes: before, after, and why."""
    if rudder not in RUDDER:
        raise ShipError(f"the wake at the rudder is '{rudder}'; it is {' or '.join(RUDDER)}")
    known = values(ship.model)
    wetted = S / (ship.L_pp * known["body.d"])
    R_0 = float(known["hull.R_0"])
    resistance = R_0 + wetted * (after.whole - before.whole)  # C_T = (1 + k) C_F + C_R + dC_F, over L d in place of S
    if not resistance > 0:
        text = f"R_0' of {R_0:.3g} is less than the friction that is taken off, {R_0 - resistance:.3g}"
        raise ShipError(f"{ship.name}: {text}; give the form factor of a resistance test (--form-factor)")
    why = "ITTC-1957 friction with form factor and roughness; C_R stays"
    found = {"hull.R_0": (R_0, resistance, why)}
    if "propeller.w_P0" not in known or "propeller.t_P" not in known:
        return found
    w, t = float(known["propeller.w_P0"]), float(known["propeller.t_P"])
    law = "ITTC 1978, (t + .04) + (w - t - .04) by the ratio of friction"
    now = wake(w, t, before.whole, after.whole)
    found["propeller.w_P0"] = (w, now, law)
    if rudder == "own" and "rudder.epsilon" in known:
        epsilon = float(known["rudder.epsilon"])
        at_rudder = wake(1.0 - epsilon * (1.0 - w), t, before.whole, after.whole)
        why = "the wake at the rudder scaled like that of the propeller"
        found["rudder.epsilon"] = (epsilon, (1.0 - at_rudder) / (1.0 - now), why)
    return found


def _cautions(
    ship: Ship, found: Mapping[str, tuple[float, float, str]], form: float, estimated: bool
) -> tuple[str, ...]:
    """What the method does not cover, for this ship."""
    lines = [
        f"Scaled from {ship.name}: derivatives of drift and yaw, t_P, t_R, a_H, gamma_R and K_T are those of the other "
        "scale, as no accepted method corrects them."
    ]
    if found and estimated:
        lines.append(f"Form factor {form:.3f} by Watanabe's formula, some .05 uncertain; a resistance test gives it "
                     "(--form-factor).")  # fmt: skip
    if found and "propeller.w_P0" not in found:
        lines.append("The wake is not scaled: the propeller of this family has no w_P0.")
    return tuple(lines)

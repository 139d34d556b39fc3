"""A gallery of wrong ships: each is a good ship of the library with one defect of its physics.

`GALLERY` names each defect, the requirement that must name it, and words of the reason.  Defects are changed numbers
where a ship file can hold them, else force modules, bodies and actuators of their own, or a model that is wrapped.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any

import numpy as np

from seatrial.actuators import Actuator, Actuators
from seatrial.core.parameters import Parts, update
from seatrial.core.symbolic import both, clip, magnitude, speed, where
from seatrial.environment import Weather
from seatrial.environment.weather import Gust
from seatrial.forces import Force
from seatrial.forces.body import Body
from seatrial.forces.propeller_fourquadrant import FourQuadrant
from seatrial.forces.rudder_lowspeed import LowSpeed
from seatrial.forces.thruster import Tunnel
from seatrial.forces.waves import MeanDrift
from seatrial.forces.wind import Fujiwara
from seatrial.models.mmg import Mmg
from seatrial.models.twin import TwinMmg
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.validate.requirements.probe import Probe

HARBOUR = "esso_osaka_3m_harbour"


@dataclass(frozen=True)
class Wrong:
    """One wrong ship.

    Attributes:
        defect: what is wrong with it.
        item: the requirement that must fail: its number in the scopes of collision avoidance and of berthing.
        words: what a failing value of that item must say.
        probe: makes the ship and the examination of it.
    """

    defect: str
    item: tuple[str, str]
    words: str
    probe: Callable[[], Probe]


RESISTANCE, STABILITY, PLAUSIBLE, TURNING = ("1", "2"), ("2", "3"), ("3", "4"), ("4", "5")
PROPULSION, ANSWER, WEATHER = ("5", "6"), ("6", "7"), ("7", "10")
DELAY, LIMITS, STEP = ("8", "11"), ("9", "12"), ("10", "13")


_good = cache(load)


def _on(name: str, change: Callable[[Ship], Ship]) -> Callable[[], Probe]:
    """A good ship changed."""
    return lambda: Probe.of(change(_good(name)))


def numbers(name: str = HARBOUR, **changes: float | Callable[[float], float]) -> Callable[[], Probe]:
    """Changed numbers, named with two underscores for a dot, whatever their ranges."""

    def change(ship: Ship) -> Ship:
        from seatrial.core.parameters import values

        old, new = values(ship.model), dict[str, float]()
        for key, value in changes.items():
            path = key.replace("__", ".")
            new[path] = value(float(old[path])) if callable(value) else value
        return replace(ship, model=update(ship.model, new))

    return _on(name, change)


def part(role: str, made: type, name: str = HARBOUR, **more: float) -> Callable[[], Probe]:
    """A component of another class, with the numbers of the good one."""

    def change(ship: Ship) -> Ship:
        old: Any = getattr(ship.model, role)
        given = {f.name: getattr(old, f.name) for f in fields(old)} | more
        model: Any = ship.model
        return replace(ship, model=replace(model, **{role: made(**given)}))

    return _on(name, change)


def thruster(made: type | None = None, **more: Any) -> Callable[[], Probe]:
    """Both side thrusters of another class, or with other numbers."""

    def change(ship: Ship) -> Ship:
        model: Any = ship.model
        parts = tuple((made or type(one))(**{f.name: getattr(one, f.name) for f in fields(one)} | more)
                      for one in model.thrusters.components)  # fmt: skip
        return replace(ship, model=replace(model, thrusters=Parts(model.thrusters.names, parts)))

    return _on(HARBOUR, change)


def gear(made: type[Actuator] = Actuator, table: str = "rudder", **more: float) -> Callable[[], Probe]:
    """An actuator of another class, or with other numbers."""

    def change(ship: Ship) -> Ship:
        old = ship.actuators.by_name[table]
        given = {f.name: getattr(old, f.name) for f in fields(old)} | more  # type: ignore[arg-type]
        return replace(ship, actuators=Actuators({**ship.actuators.by_name, table: made(**given)}))

    return _on(HARBOUR, change)


# --- wrapped models ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Bent(Mmg):
    """The model with its rates changed by a defect: (model, state, control, environment, rates) to rates."""

    defect: Any

    def derivative(self, state: Any, control: Any, environment: Any) -> Any:
        return self.defect(super().derivative, state, control, environment)


def bent(defect: Any, name: str = HARBOUR) -> Callable[[], Probe]:
    """A good ship whose rates a defect changes."""

    def change(ship: Ship) -> Ship:
        given = {f.name: getattr(ship.model, f.name) for f in fields(ship.model)}  # type: ignore[arg-type]
        return replace(ship, model=Bent(**given, defect=defect))

    return _on(name, change)


def _plus(rates: Any, u: Any = 0.0, v: Any = 0.0, r: Any = 0.0) -> Any:
    return (*rates[:3], rates[3] + u, rates[4] + v, rates[5] + r, *rates[6:])


_U, _L = 0.397, 3.0  # approach speed [m/s] and length [m] of the Esso Osaka
_A = _U**2 / _L


def current_twice(f: Any, s: Any, c: Any, e: Any) -> Any:
    rates = f(s, c, e)
    return (rates[0] + e.current_x, rates[1] + e.current_y, *rates[2:])


def no_current(f: Any, s: Any, c: Any, e: Any) -> Any:
    return f(s, c, e._replace(current_x=0.0, current_y=0.0))


def true_wind(f: Any, s: Any, c: Any, e: Any) -> Any:
    """The wind over the deck without the ship's own speed."""
    from seatrial.core.symbolic import cos, sin

    north = s[3] * cos(s[2]) - s[4] * sin(s[2])
    east = s[3] * sin(s[2]) + s[4] * cos(s[2])
    return f(s, c, e._replace(wind_x=e.wind_x - north, wind_y=e.wind_y - east))


def wind_of_the_earth(f: Any, s: Any, c: Any, e: Any) -> Any:
    """The wind taken as one of ship axes, whatever the heading."""
    from seatrial.core.symbolic import cos, sin

    k, j = cos(s[2]), sin(s[2])
    return f(s, c, e._replace(wind_x=k * e.wind_x - j * e.wind_y, wind_y=j * e.wind_x + k * e.wind_y))


def no_speed_loss(f: Any, s: Any, c: Any, e: Any) -> Any:
    """Surge as in a straight run: nothing of drift, yaw and rudder."""
    rates = f(s, c, e)
    straight = f((*s[:4], 0.0 * s[4], 0.0 * s[5], *s[6:]), (c[0], 0.0 * c[1], *c[2:]), e)
    return (*rates[:3], straight[3], *rates[4:])


def _adding(change: Callable[..., Any]) -> Any:
    def defect(f: Any, s: Any, c: Any, e: Any) -> Any:
        return _plus(f(s, c, e), **change(*s[3:6], c, s))

    return defect


drifts_from_rest = _adding(lambda u, v, r, c, s: {"v": 1e-4 * _A})
by_heading = _adding(lambda u, v, r, c, s: {"r": 0.05 * _A / _L * s[2] * where(magnitude(s[2]) > 0.5, 1.0, 0.0)})
sway_pushed_to_port = _adding(
    lambda u, v, r, c, s: {"v": where(both(v < 0, u < 0.3 * _U), v, 0.0) * (6.0 * magnitude(v) + 3.0 * u) / _L}
)
yaw_pushed_astern = _adding(lambda u, v, r, c, s: {"r": where(u < 0, 6.0, 0.0) * magnitude(u) * r / _L})
creeping_free = _adding(
    lambda u, v, r, c, s: {"u": where(magnitude(u) < 0.15 * _U, 0.068, 0.0) * u * magnitude(u) / _L}
)
inwards_to_port = _adding(lambda u, v, r, c, s: {"v": where(r < 0, 0.8, 0.0) * u * r})
coriolis_slow = _adding(lambda u, v, r, c, s: {"v": where(magnitude(u) < 0.3 * _U, 0.7, 0.0) * u * r})
falsely_stable = _adding(
    lambda u, v, r, c, s: {
        "r": 2.0 * u * r / _L - where(magnitude(r) < 0.004 * _U / _L, 3.0, 0.0) * magnitude(u) * r / _L
    }
)


# --- components --------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class NoCoriolis(Body):
    """Mass times acceleration is force, in axes that turn."""

    def acceleration(self, force: Force, u: Any, v_m: Any, r: Any) -> Any:
        return super().acceleration(force, 0.0 * u, 0.0 * v_m, 0.0 * r)


@dataclass(frozen=True, kw_only=True)
class SwappedSide(LowSpeed):
    """Side force to the other side, the moment as it was."""

    def force(self, flow: Any, slipstream: Any) -> Force:
        made = super().force(flow, slipstream)
        return Force(made.X, -made.Y, made.N)


@dataclass(frozen=True, kw_only=True)
class DeadWater(LowSpeed):
    """An inflow that never falls below a tenth of a metre per second."""

    def _along(self, flow: Any, slipstream: Any) -> Any:
        return super()._along(flow, slipstream) + 0.1


@dataclass(frozen=True, kw_only=True)
class HalfToPort(LowSpeed):
    """Less than a third of the force to port."""

    def force(self, flow: Any, slipstream: Any) -> Force:
        made, still = super().force(flow, slipstream), super().force(flow._replace(delta=0.0 * flow.delta), slipstream)
        share = where(flow.delta < 0, 0.25, 1.0)
        return Force(*(b + share * (a - b) for a, b in zip(made, still, strict=True)))


@dataclass(frozen=True, kw_only=True)
class Stalled(LowSpeed):
    """Beyond 15 degrees it loses its force: more rudder turns less."""

    def force(self, flow: Any, slipstream: Any) -> Force:
        over = clip(magnitude(flow.delta) - 0.26, 0.0, 1.0)
        return super().force(flow._replace(delta=flow.delta * (1.0 - 2.0 * over)), slipstream)


@dataclass(frozen=True, kw_only=True)
class AsternAsAhead(LowSpeed):
    """With sternway the inflow still comes from ahead."""

    def _along(self, flow: Any, slipstream: Any) -> Any:
        return magnitude(super()._along(flow, slipstream))


@dataclass(frozen=True, kw_only=True)
class AheadUnderWay(FourQuadrant):
    """Reversed, it pushes ahead once the ship makes headway."""

    def force(self, flow: Any) -> Any:
        made, race = super().force(flow)
        return Force(where(both(flow.n_P < 0, flow.u > 0.2), -made.X, made.X), made.Y, made.N), race


@dataclass(frozen=True, kw_only=True)
class StrongAstern(FourQuadrant):
    """Three times the pull astern."""

    def force(self, flow: Any) -> Any:
        made, race = super().force(flow)
        return Force(where(flow.n_P < 0, 3.0, 1.0) * made.X, made.Y, made.N), race


@dataclass(frozen=True, kw_only=True)
class OneThrust(FourQuadrant):
    """The same thrust at any revolutions ahead."""

    def force(self, flow: Any) -> Any:
        return super().force(flow._replace(n_P=where(flow.n_P > 0, 10.0, flow.n_P)))


@dataclass(frozen=True, kw_only=True)
class Saturated(FourQuadrant):
    """More than the usual revolutions give less thrust."""

    def force(self, flow: Any) -> Any:
        return super().force(flow._replace(n_P=flow.n_P - 2.0 * clip(flow.n_P - 10.5, 0.0, 100.0)))


@dataclass(frozen=True, kw_only=True)
class TurnedUnderWay(Tunnel):
    """Pushes to the other side once the ship moves."""

    def force(self, flow: Any, control: Any) -> Force:
        made, side = super().force(flow, control), where(flow.u > 0.15, -1.0, 1.0)
        return Force(made.X, side * made.Y, side * made.N)


@dataclass(frozen=True, kw_only=True)
class GainsAstern(Tunnel):
    """Gains force with sternway."""

    def force(self, flow: Any, control: Any) -> Force:
        made, gain = super().force(flow, control), where(flow.u < 0, 1.5, 1.0)
        return Force(made.X, gain * made.Y, gain * made.N)


@dataclass(frozen=True, kw_only=True)
class OnlyToStarboard(Tunnel):
    """Pushes to starboard whatever its order."""

    def thrust(self, rho: Any, n: Any) -> Any:
        return magnitude(super().thrust(rho, n))


@dataclass(frozen=True, kw_only=True)
class LinearThrust(Tunnel):
    """Thrust in proportion to revolutions."""

    def thrust(self, rho: Any, n: Any) -> Any:
        return self.T_0 * n / self.n_0


@dataclass(frozen=True, kw_only=True)
class WindToPort(Fujiwara):
    """Wind always pushes to port."""

    def force(self, flow: Any) -> Force:
        made = super().force(flow)
        return Force(made.X, -magnitude(made.Y), made.N)


@dataclass(frozen=True, kw_only=True)
class LinearWind(Fujiwara):
    """Force in proportion to the wind speed."""

    def force(self, flow: Any) -> Force:
        made, over = super().force(flow), speed(flow.u_A, flow.v_A)
        return Force(*(x / over for x in made))


@dataclass(frozen=True, kw_only=True)
class Notched(Fujiwara):
    """No force of wind from within three degrees of one angle, of one side."""

    def force(self, flow: Any) -> Force:
        made = super().force(flow)
        aside = (flow.u_A * math.sin(1.13) - flow.v_A * math.cos(1.13)) / speed(flow.u_A, flow.v_A)
        lost = where(both(magnitude(aside) < math.sin(math.radians(3.0)), flow.v_A > 0), 0.0, 1.0)
        return Force(*(lost * x for x in made))


@dataclass(frozen=True, kw_only=True)
class WavesToWindward(MeanDrift):
    """The drift force of waves against their direction."""

    def force(self, flow: Any) -> Force:
        made = super().force(flow)
        return Force(*(-x for x in made))


@dataclass(frozen=True, kw_only=True)
class LinearWaves(MeanDrift):
    """Drift force in proportion to the wave height."""

    def force(self, flow: Any) -> Force:
        made, over = super().force(flow), speed(flow.wave_u, flow.wave_v)
        return Force(*(0.01 * x / over for x in made))


@dataclass(frozen=True, kw_only=True)
class SwingingPair(TwinMmg):
    """A contra-turning pair whose reversed propellers push the stern to port."""

    def force(self, flow: Any, control: Any) -> Force:
        made, side = super().force(flow, control), where(control[0] < 0, -5.0, 0.0)
        return Force(made.X, made.Y + side, made.N - 3.0 * side)


@dataclass(frozen=True, kw_only=True)
class Short(Actuator):
    """Stops at eight tenths of its limit."""

    def target(self, actual: Any, order: Any) -> Any:
        return clip(order, 0.8 * self.low, 0.8 * self.high)


@dataclass(frozen=True, kw_only=True)
class Beyond(Actuator):
    """Passes its limit to port by a fifth."""

    def target(self, actual: Any, order: Any) -> Any:
        return clip(order, 1.2 * self.low, self.high)


@dataclass(frozen=True, kw_only=True)
class FastToPort(Actuator):
    """Twice its rate to port."""

    def advance(self, memory: Any, order: Any, dt: Any) -> Any:
        quick = super().advance(memory, order, 2.0 * dt)
        usual = super().advance(memory, order, dt)
        port = order < memory[0]
        return where(port, quick[0], usual[0]), (where(port, quick[1][0], usual[1][0]),)


@dataclass(frozen=True, kw_only=True)
class Slow(Actuator):
    """Half the rate that its file gives."""

    def advance(self, memory: Any, order: Any, dt: Any) -> Any:
        return super().advance(memory, order, 0.5 * dt)


def _twin(made: type[TwinMmg]) -> Callable[[], Probe]:
    def change(ship: Ship) -> Ship:
        return replace(ship, model=made(**{f.name: getattr(ship.model, f.name) for f in fields(ship.model)}))  # type: ignore[arg-type]

    return _on("twin_virtual", change)


_DRAWN = np.random.default_rng()


def _unseeded(base: Weather, seed: int) -> Weather:
    return Gust(base, seed=int(_DRAWN.integers(1 << 30)))


def _deaf(base: Weather, seed: int) -> Weather:
    return Gust(base, seed=0)


def _probe(**more: Any) -> Callable[[], Probe]:
    return lambda: replace(_on(HARBOUR, lambda ship: ship)(), **more)


def _minus(x: float) -> float:
    return -x


_SWIRL = {f"propeller__{a}_{k}": _minus for a in "AB" for k in range(1, 9)}

GALLERY = (
    Wrong("resistance ahead zero", RESISTANCE, "too little resistance ahead|no resistance in surge",
          numbers(hull__X_0F=0.0)),
    Wrong("resistance ahead zero, hidden by a stopped propeller", RESISTANCE, "too little resistance ahead",
          numbers("kvlcc2", hull__R_0=0.0)),
    Wrong("resistance ahead pulls", RESISTANCE, "resistance ahead pulls", numbers(hull__X_0F=_minus)),
    Wrong("resistance astern pulls the ship", RESISTANCE, "resistance astern pulls", numbers(hull__X_0A=_minus)),
    Wrong("no resistance at creeping speed", RESISTANCE, "too little resistance ahead", bent(creeping_free)),
    Wrong("yaw damping zero", RESISTANCE, "yaw is not damped|pushes along the yaw",
          numbers(hull__N_r=0.0, hull__C_D=0.0)),
    Wrong("yaw damping of the hull reversed, hidden by the rudder", RESISTANCE, "pushes along the yaw",
          numbers("kvlcc2", hull__N_r=0.01, hull__N_rrr=0.001)),
    Wrong("linear sway damping reversed, hidden by the cubic term", RESISTANCE, "sway is not damped|along the sway",
          numbers("kvlcc2", hull__Y_v=0.1)),
    Wrong("cubic sway damping reversed, hidden by the linear term", RESISTANCE, "sway is not damped|along the sway",
          numbers("kvlcc2", hull__Y_vvv=lambda x: -2.0 * x)),
    Wrong("rudder drives the yaw", RESISTANCE, "rudder amidships pushes along the yaw",
          numbers("kvlcc2", rudder__l_R=_minus)),
    Wrong("no resistance in sway", RESISTANCE, "sway is not damped", numbers(hull__Y_v=0.0, hull__C_D=0.0)),
    Wrong("sway driven to port at low speed", RESISTANCE, "sway is not damped", bent(sway_pushed_to_port)),
    Wrong("yaw driven astern", RESISTANCE, "yaw is not damped", bent(yaw_pushed_astern)),
    Wrong("no speed loss in a turn", RESISTANCE, "takes no speed", bent(no_speed_loss)),
    Wrong("unstable, declared stable by its roots", STABILITY, "yet it keeps turning", bent(falsely_stable)),
    Wrong("moves from rest", PLAUSIBLE, "from rest without any order", bent(drifts_from_rest)),
    Wrong("added mass missing in sway", PLAUSIBLE, "added mass in sway", numbers(body__m_y=0.0)),
    Wrong("added mass missing in surge", PLAUSIBLE, "added mass in surge", numbers(body__m_x=0.0)),
    Wrong("added inertia missing in yaw", PLAUSIBLE, "inertia in yaw", numbers(body__I_zG=lambda x: 0.5 * x)),
    Wrong("Coriolis terms dropped", PLAUSIBLE, "Coriolis term is missing", part("body", NoCoriolis)),
    Wrong("Coriolis term wrong at low speed", PLAUSIBLE, "Coriolis term is missing", bent(coriolis_slow)),
    Wrong("thrown inwards in a turn to port", PLAUSIBLE, "Coriolis term is missing", bent(inwards_to_port)),
    Wrong("mass matrix not symmetric", PLAUSIBLE, "mass matrix is not symmetric",
          numbers("milliampere", inertia__m_23=lambda x: x + 500.0)),
    Wrong("added mass missing in sway, Abkowitz", PLAUSIBLE, "added mass in sway",
          numbers("mariner", body__Y_vdot=0.0)),
    Wrong("added mass missing in surge, Abkowitz", PLAUSIBLE, "added mass in surge",
          numbers("mariner", body__X_udot=0.0)),
    Wrong("added inertia missing in yaw, Abkowitz", PLAUSIBLE, "inertia in yaw", numbers("mariner", body__N_rdot=0.0)),
    Wrong("mass matrix not symmetric, Abkowitz", PLAUSIBLE, "mass matrix is not symmetric",
          numbers("mariner", body__N_vdot=lambda x: 10 * x)),
    Wrong("added mass missing in sway, modified Abkowitz", PLAUSIBLE, "added mass in sway",
          numbers("modified_abkowitz_kvlcc2_l7", body__Y_vdot=0.0)),
    Wrong("added mass missing in sway, tanker", PLAUSIBLE, "added mass in sway",
          numbers("esso_190k_tanker", body__m_22=1.0)),
    Wrong("added mass missing in surge, tanker", PLAUSIBLE, "added mass in surge",
          numbers("esso_190k_tanker", body__m_11=1.0)),
    Wrong("added inertia missing in yaw, tanker", PLAUSIBLE, "inertia in yaw",
          numbers("esso_190k_tanker", body__m_33=lambda x: 0.5 * x)),
    Wrong("turns by the heading in calm", PLAUSIBLE, "depends on the heading", bent(by_heading)),
    Wrong("drift by current counted twice", PLAUSIBLE, "current", bent(current_twice)),
    Wrong("current has no force", PLAUSIBLE, "current", bent(no_current)),
    Wrong("propeller hand reversed", PLAUSIBLE, "right-handed propeller", numbers(**_SWIRL)),
    Wrong("moment of the propeller's hand reversed", PLAUSIBLE, "right-handed propeller",
          numbers(**{key: _minus for key in _SWIRL if "__B_" in key})),
    Wrong("stern swing of a contra-turning twin", PLAUSIBLE, "contra-turning pair swings", _twin(SwingingPair)),
    Wrong("thrusters reversed under way", PLAUSIBLE, "changes its side", thruster(TurnedUnderWay)),
    Wrong("thrusters gain force with sternway", PLAUSIBLE, "gains force", thruster(GainsAstern)),
    Wrong("thrusters do not lose force with speed", PLAUSIBLE, "keeps its force at speed", thruster(loss_form="none")),
    Wrong("thrusters push to starboard only", PLAUSIBLE, "side of its order|changes its side",
          thruster(OnlyToStarboard)),
    Wrong("thrusters without the square law", PLAUSIBLE, "square of revolutions", thruster(LinearThrust)),
    Wrong("rudder turns the ship to the other side", TURNING, "own side",
          numbers(rudder__x_R=_minus, rudder__x_H=_minus)),
    Wrong("swapped side force", TURNING, "side force of the rudder is swapped", part("rudder", SwappedSide)),
    Wrong("rudder weak to port", TURNING, "sides turn unlike|turn the ship to its own side",
          part("rudder", HalfToPort)),
    Wrong("more rudder turns less", TURNING, "does not turn tighter", part("rudder", Stalled)),
    Wrong("astern thrust ahead", PROPULSION, "pushes ahead",
          numbers(propeller__C_3=_minus, propeller__C_6=_minus, propeller__C_7=_minus)),
    Wrong("astern thrust ahead under way", PROPULSION, "pushes ahead", part("propeller", AheadUnderWay)),
    Wrong("propeller not reciprocal: three times the pull astern", PROPULSION, "out of proportion",
          part("propeller", StrongAstern)),
    Wrong("thrust does not depend on revolutions", PROPULSION, "more thrust", part("propeller", OneThrust)),
    Wrong("thrust falls above the usual revolutions", PROPULSION, "more thrust", part("propeller", Saturated)),
    Wrong("thrust grows with speed", PROPULSION, "thrust grows with speed", numbers("kvlcc2", propeller__k_1=_minus)),
    Wrong("stopped propeller pushes", PROPULSION, "stopped propeller pushes", numbers("kvlcc2", propeller__k_2=_minus)),
    Wrong("rudder works in dead water", ANSWER, "dead water", part("rudder", DeadWater)),
    Wrong("negative share of revolutions on rudder force", ANSWER, "more revolutions do not",
          numbers("kvlcc2", rudder__kappa=-0.5)),
    Wrong("no race at the rudder", ANSWER, "more revolutions do not|race", numbers("kvlcc2", rudder__kappa=0.0)),
    Wrong("rudder astern as ahead", ANSWER, "with sternway", part("rudder", AsternAsAhead)),
    Wrong("wind always to port", WEATHER, "to windward|mirror", part("wind", WindToPort)),
    Wrong("wind to windward in sway", WEATHER, "to windward",
          numbers(wind__Y_1=_minus, wind__Y_3=_minus, wind__Y_5=_minus)),
    Wrong("head wind pushes ahead", WEATHER, "in surge",
          numbers(wind__X_0=_minus, wind__X_1=_minus, wind__X_3=_minus, wind__X_5=_minus)),
    Wrong("wind with no yaw moment", WEATHER, "yaw moment", numbers(wind__N_1=0.0, wind__N_2=0.0, wind__N_3=0.0)),
    Wrong("yaw moment of wind reversed", WEATHER, "yaw moment of the wind is reversed",
          numbers(wind__N_1=_minus, wind__N_2=_minus, wind__N_3=_minus)),
    Wrong("wind force not with the square", WEATHER, "square of wind speed", part("wind", LinearWind)),
    Wrong("no wind from one angle", WEATHER, "jumps|windward", part("wind", Notched)),
    Wrong("wind without the ship's own speed", WEATHER, "apparent wind", bent(true_wind)),
    Wrong("wind fixed to the earth", WEATHER, "fixed to the earth", bent(wind_of_the_earth)),
    Wrong("gust not seeded", WEATHER, "not seeded", _probe(gusts=_unseeded)),
    Wrong("gust the same for every seed", WEATHER, "do not change with their seed", _probe(gusts=_deaf)),
    Wrong("rudder obeys at once", DELAY, "obey", gear(rate=math.inf)),
    Wrong("rudder at half its rate", DELAY, "in the time", gear(Slow)),
    Wrong("rudder at twice its rate to port", LIMITS, "rate of the ship's file", gear(FastToPort)),
    Wrong("rudder rate of a hundredth", LIMITS, "not that of a steering gear", gear(rate=math.radians(0.2))),
    Wrong("rudder stops short of its limit", LIMITS, "does not reach its limit", gear(Short)),
    Wrong("rudder passes its limit to port", LIMITS, "passes it", gear(Beyond)),
    Wrong("propeller passes its limit astern", LIMITS, "n_P does not reach its limit, or passes it",
          gear(Beyond, "propeller")),
    Wrong("rudder without limit", LIMITS, "greatest angle", gear(high=math.inf)),
    Wrong("time step too coarse", STEP, "too coarse", _probe(dt=0.5)),
)  # fmt: skip

ONLY_WITH_WAVES = (
    Wrong("waves to windward", WEATHER, "to windward", part("waves", WavesToWindward)),
    Wrong("drift force of waves not with the square", WEATHER, "square of wave height", part("waves", LinearWaves)),
)
"""Defects that only the scope with waves in it, collision avoidance, can see."""

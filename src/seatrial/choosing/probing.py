"""Probes: what a ship's model represents, found by asking its right-hand side.

Rates of a ship at any motion and under any orders, without dimension.

Velocities are in units of the approach speed U (yaw rate: U/L_pp), revolutions of those of the straight
run, so that one threshold holds for ships of every size; rates are in U^2/L_pp and U^2/L_pp^2.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any, ClassVar

from ..core.parameters import ParameterError, Parts
from ..core.values import dataclass, fields, is_dataclass, replace
from ..environment import CALM, Environment
from ..forces import Flow, Force
from ..forces.shallow import ShallowPolynomial
from ..forces.thruster import Tunnel
from ..models import STATES, Sampled
from ..models.fossen import Fossen
from ..models.linear import linearise
from ..models.settled import begun
from ..models.trim import Trim, trim
from ..ships import Ship
from . import Finding

# Below this a rate is rounding; above, an effect.
_NOTHING = 1e-9
_RUDDER = 0.2
_AROUND = {
    "wind": {"wind_x": 5.0, "wind_y": 5.0}, "current": {"current_x": 0.1, "current_y": 0.1},
    "waves": {"wave_x": 1.0, "wave_y": 1.0}, "shallow": {"per_depth": 1.0},
}  # fmt: skip
_GRID = tuple(product((0.0, 1.0, -0.5), (0.0, 0.5, -1.0), (0.0, 2.0), (0.0, 1.0, -1.0), (0.0, 0.6)))


@dataclass(frozen=True)
class _Push:
    """A stand-in for a force of wind or waves: it shows whether they reach the ship through a part."""

    mirror_symmetric: ClassVar[bool] = True

    def force(self, flow: Flow) -> Force:
        """Some force to leeward."""
        size = -flow.rho * flow.L_pp * flow.L_pp
        return Force(size * (flow.u_A + flow.wave_u), size * (flow.v_A + flow.wave_v), 0.0)


def findings(probe: Probe) -> dict[str, Finding]:
    """The answer of a ship to every probed capability; without those that this ship cannot settle."""
    ship = probe.ship
    found: dict[str, tuple[str, str]] = {
        **_motion(probe), **_propulsion(probe), **_manners(probe), **_low_speed(probe), **_surroundings(probe),
        **_form(probe), **_drives(probe), **_parts(probe), **_heel(probe),
    }  # fmt: skip
    found |= _beyond(ship, {key for key, (answer, _) in found.items() if answer == "yes"})
    return {key: Finding(answer, f"{ship.name}: {how}") for key, (answer, how) in found.items()}


def _beyond(ship: Ship, able: set[str]) -> dict[str, tuple[str, str]]:
    """What the ship's file holds for outside of the model's validity, whatever the numbers give there."""
    u = ship.validity.get("u", (-math.inf, math.inf))[0]
    turning = [ship.validity[name][0] for name, (order, _) in zip(ship.model.controls, ship.model.follows, strict=True)
               if order == "n_P" and name in ship.validity]  # fmt: skip
    out: dict[str, tuple[str, str]] = {}
    if turning and min(turning) >= 0.0:
        out |= dict.fromkeys(("reversing", "reversing_turns"), ("no", "not valid astern, by its file"))
    if u >= 0.0:
        out["large_drift"] = "no", f"valid from u = {u:g} m/s on, by its file"
    if u > 0.0:
        out["at_rest"] = "partly", f"valid from u = {u:g} m/s on, by its file"
    return {key: answer for key, answer in out.items() if key in able}


def outputs(probe: Probe) -> tuple[str, ...]:
    """The velocities that the model moves at all, then its own states."""
    seen = [probe.rates(*x[:3], n=x[3], delta=x[4]) for x in _GRID]
    moved = [name for k, name in enumerate(STATES[3:]) if any(abs(rates[k]) > _NOTHING for rates in seen)]
    return (*moved, *probe.ship.model.states[len(STATES):])  # fmt: skip


def _says(yes: bool, how: str) -> tuple[str, str]:
    return "yes" if yes else "no", how


def _changed(a: Rates, b: Rates) -> bool:
    return any(abs(x - y) > _NOTHING for x, y in zip(a, b, strict=True))


def _motion(probe: Probe) -> dict[str, tuple[str, str]]:
    """What is damped, and what a turn does."""
    ahead, turned = probe.rates(), probe.rates(delta=_RUDDER)
    surge = probe.rates(u=1.1)[0] - ahead[0]
    sway = probe.rates(v_m=0.1)[1] - probe.rates(v_m=-0.1)[1]
    yaw = probe.rates(r=0.1)[2] - probe.rates(r=-0.1)[2]
    damped = [name for name, x in (("surge", surge), ("sway", sway), ("yaw", yaw)) if x < -_NOTHING]
    turning = [probe.rates(v_m=-0.15 * s, r=0.4 * s, delta=s * 2 * _RUDDER)[0] - ahead[0] for s in (1, -1)]
    steer = turned[2] - ahead[2]
    lateral = max(abs(turned[1] - ahead[1]), abs(probe.rates(r=0.4)[1] - ahead[1]))
    return {
        "turns": _says(steer > _NOTHING, f"yaw acceleration {steer:.2g} by 11 deg of rudder"),
        "resistance": _says(len(damped) == 3, f"damped: {', '.join(damped) or 'nothing'}"),
        "drift": _says(lateral > _NOTHING, f"sway acceleration up to {lateral:.2g} in a turn"),
        "speed_loss": _says(max(turning) < -_NOTHING, f"surge acceleration {max(turning):.2g} in a turn"),
    }  # fmt: skip


def _propulsion(probe: Probe) -> dict[str, tuple[str, str]]:
    """What speed and revolutions do."""
    def steer(u: float, n: float) -> float:
        return probe.rates(u=u, n=n, delta=_RUDDER)[2] - probe.rates(u=u, n=n)[2]

    push = probe.rates(n=1.2)[0] - probe.rates()[0]
    here, slow, race = steer(1.0, 1.0), steer(0.5, 1.0), steer(1.0, 1.5)
    brake = probe.rates(u=0.3, n=-0.5)[0] - probe.rates(u=0.3, n=0.0)[0]
    start, coast = probe.rates(u=0.3, n=-0.7), probe.rates(u=0.3, n=0.0)
    side = max(abs(start[k] - coast[k]) for k in (1, 2))
    found = {
        "revolutions": _says(push > _NOTHING, f"surge acceleration {push:.2g} by 20 % more revolutions"),
        "steering_speed": _says(abs(slow - here) > _NOTHING, f"rudder effect {slow:.2g} at U/2, {here:.2g} at U"),
        "steering_revolutions": _says(
            abs(race - here) > _NOTHING, f"rudder effect {here:.2g}, {race:.2g} at 1.5 times the revolutions"),
        "reversing": _says(brake < -_NOTHING, f"surge acceleration {brake:.2g} by half revolutions astern"),
        "reversing_turns": _says(side > _NOTHING, f"sway or yaw acceleration {side:.2g} by revolutions astern"),
    }  # fmt: skip
    if probe.has("rudder") and probe.ship.model.part("rudder") is None:
        place = "part", "has a place for a propeller and a rudder of the MMG family"
        return {key: place if answer == "no" else (answer, how) for key, (answer, how) in found.items()}
    return found


def _manners(probe: Probe) -> dict[str, tuple[str, str]]:
    """Whether it stays finite, and whether a straight course may be unstable."""
    found: dict[str, tuple[str, str]] = {}
    wrong = sum(not all(map(math.isfinite, probe.rates(*x[:3], n=x[3], delta=x[4]))) for x in _GRID)
    found["plausible"] = _says(not wrong, f"{wrong} of {len(_GRID)} states without a finite answer")
    sampled = isinstance(probe.ship.model, Sampled)
    found["any_step"] = ("partly", "runs at its own sample time") if sampled else ("yes", "continuous time")
    try:
        growth, text = linearise(probe.ship.model, probe.at).stability()
    except ParameterError:
        return found
    return found | {"unstable_hull": ("yes", text.partition(":")[2].strip())} if growth == "unstable" else found


def _low_speed(probe: Probe) -> dict[str, tuple[str, str]]:
    """At rest, sideways, astern and on the spot; machinery stopped, rudder amidships."""
    still = tuple(0.0 for _ in probe.ship.model.controls)

    def slow(u: float, v_m: float, r: float) -> Rates:
        return probe.under(probe.state(u, v_m, r), still)

    silent = all(abs(rate) <= _NOTHING for rate in slow(0.0, 0.0, 0.0))
    settling = {"surge": slow(0.05, 0, 0)[0], "sway": slow(0, 0.05, 0)[1], "yaw": slow(0, 0, 0.05)[2]}
    decays = [name for name, rate in settling.items() if rate < -_NOTHING]
    large = {"sideways": slow(0, 0.5, 0)[1] < -_NOTHING, "on the spot": slow(0, 0, 1.0)[2] < -_NOTHING,
             "astern": slow(-0.5, 0, 0)[0] > _NOTHING}  # fmt: skip
    opposed = [name for name, yes in large.items() if yes]
    rest = "yes" if silent and len(decays) == 3 else "partly" if silent and decays else "no"
    return {
        "at_rest": (rest, f"{'silent' if silent else 'not silent'}; dies out: {', '.join(decays) or 'nothing'}"),
        "large_drift": ("yes" if len(opposed) == 3 else "partly" if opposed else "no",
                        f"opposed: {', '.join(opposed) or 'nothing'}"),
    }  # fmt: skip


def _surroundings(probe: Probe) -> dict[str, tuple[str, str]]:
    """Wind, waves, current and depth, as the ship is or with a part added."""
    return {key: _feels(probe, key) for key in _AROUND}


def _feels(probe: Probe, key: str) -> tuple[str, str]:
    around = Environment(wave_T=2.0 * math.sqrt(probe.ship.L_pp))
    size = {"waves": 0.01 * probe.ship.L_pp, "shallow": 0.5 / _draught(probe.ship)}.get(key, 1.0)
    other = around._replace(**{name: size * value for name, value in _AROUND[key].items()})
    move = {"v_m": 0.1, "r": 0.1}
    if _changed(probe.rates(**move, environment=around), probe.rates(**move, environment=other)):
        return "yes", "changes the motion"
    if key in ("wind", "waves") and probe.has(key):
        pushed = probe.having(**{key: _Push()})
        if _changed(pushed.rates(**move, environment=around), pushed.rates(**move, environment=other)):
            return "part", f"with a [{key}] table in the ship file"
    if key == "shallow" and issubclass(ShallowPolynomial, type(probe.ship.model.part("hull"))):
        return "part", "with the hull shallow:ShallowPolynomial"
    return "no", "does not reach the motion"


def _draught(ship: Ship) -> float:
    return float(ship.model.draught or 0.05 * ship.L_pp)


def _form(probe: Probe) -> dict[str, tuple[str, str]]:
    """Linear at a held speed? Affine in the controls at a held state?"""
    here, bent, curved = probe.rates(), 0.0, 0.0
    for v_m, r, delta in ((0.2, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.4), (-0.2, 0.5, 0.4), (0.2, 0.3, -0.3)):
        there, back = probe.rates(v_m=v_m, r=r, delta=delta), probe.rates(v_m=-v_m, r=-r, delta=-delta)
        bent = max(bent, *(abs(a + b - 2 * c) for a, b, c in zip(there, back, here, strict=True)))
        if delta:
            double = probe.rates(v_m=2 * v_m, r=2 * r, delta=2 * delta)
            bent = max(bent, *(abs(a - 2 * b + c) for a, b, c in zip(double, there, here, strict=True)))
    state, base = probe.state(1.0, 0.1, 0.2), probe.control(1.0, 0.0)
    for n, delta in ((0.5, 0.0), (0.0, 0.4), (0.5, 0.4), (-1.5, 0.3)):
        once, twice = (tuple(b + k * (c - b) for b, c in zip(base, probe.control(1.0 + n, delta), strict=True))
                       for k in (1, 2))  # fmt: skip
        rates = [probe.under(state, control) for control in (base, once, twice)]
        curved = max(curved, *(abs(a - 2 * b + c) for a, b, c in zip(*rates, strict=True)))
    affine = _says(curved < _NOTHING, f"departs from it by up to {curved:.2g}")
    if curved >= _NOTHING and isinstance(probe.ship.model, Fossen):
        affine = "yes", "in the thrusts along and across, by its method `affine`"
    return {"linear": _says(bent < _NOTHING, f"departs from it by up to {bent:.2g}"), "input_affine": affine}


def _drives(probe: Probe) -> dict[str, tuple[str, str]]:
    """Thrusters and more than one screw."""
    ship, controls = probe.ship, probe.ship.model.controls
    own = [name for name, (order, _) in zip(controls, ship.model.follows, strict=True) if name != order or not order]
    several = ("yes", f"controls {', '.join(controls)}") if len(own) > 1 else ("no", "one propeller and one rudder")
    if several[0] == "no" and probe.has("thrusters"):
        several = "part", "with a [thrusters.*] table in the ship file"
    if not probe.has("thrusters"):
        return {"several_drives": several, "side_thrusters": ("no", "has no place for thrusters")}
    given: Any = ship.model.part("thrusters")
    L = ship.L_pp
    tunnel = Tunnel(x=0.4 * L, D=0.01 * L, K_T=0.4, loss_form="jet", c_Y=1.0, c_N=1.0)
    moved = probe.having(thrusters=Parts((*given.names, "probe"), (*given.components, tunnel)))
    pushes = [moved.rates(u=u, tunnel=20.0)[2] - moved.rates(u=u)[2] for u in (0.0, 1.0)]
    fitted = any(isinstance(part, Tunnel) for part in given.components)
    good = pushes[0] > pushes[1] + _NOTHING
    how = f"yaw acceleration {pushes[0]:.2g} at rest, {pushes[1]:.2g} at U"
    answer = "yes" if fitted and good else "part" if good else "no"
    return {"several_drives": several, "side_thrusters": (answer, how)}


def _parts(probe: Probe) -> dict[str, tuple[str, str]]:
    """Which of hull, propeller and rudder can be exchanged by themselves."""
    model: Any = probe.ship.model
    names = {f.name for f in fields(model) if f.name in _EXCHANGED or is_dataclass(getattr(model, f.name))}
    names -= {"body", "coefficients", "derivatives", "wind", "waves", "thrusters", "speed", "K", "T", "network"}
    if names >= {"hull", "propeller", "rudder"}:
        return {"design_changes": ("yes", "hull, propeller and rudder are parts of their own")}
    apart = ", ".join(sorted(names))
    return {"design_changes": ("partly", f"apart: {apart}") if apart else ("no", "one whole")}


def _heel(probe: Probe) -> dict[str, tuple[str, str]]:
    """Whether a turn rolls the ship."""
    ship = probe.ship
    model: Any = ship.model
    if model.motion == STATES:
        return {"heel": ("no", "no state of roll")}
    upright, turning = (begun(model, probe.state(1.0, v_m, r), probe.control(1.0, 0.0), CALM)
                        for v_m, r in ((0.0, 0.0), (-0.1, 0.4)))  # fmt: skip
    at = model.states.index("p")
    rates = [model.derivative(state, probe.control(1.0, 0.0), CALM)[at] for state in (upright, turning)]
    change = float(rates[1] - rates[0]) * (ship.L_pp / ship.speed) ** 2
    return {"heel": _says(abs(change) > _NOTHING, f"roll acceleration {change:.2g} in a turn")}


_EXCHANGED = ("hull", "propeller", "rudder")


Rates = tuple[float, float, float]

TUNNEL = "n_probe"
"""The control of a side thruster that a probe fits: the part is called ``probe``."""


@dataclass(frozen=True)
class Probe:
    """A ship to be probed, and its straight run at the approach speed."""

    ship: Ship
    at: Trim

    @classmethod
    def of(cls, ship: Ship) -> Probe:
        """Find the straight run.

        Raises:
            ParameterError: there is none.
        """
        return cls(ship, trim(ship.model, speed=ship.speed))

    def state(self, u: float, v_m: float, r: float) -> tuple[float, ...]:
        """The motion in SI units, heading aside; what the model has beyond settles to what acts (`under`)."""
        U = self.ship.speed
        return (0.0, 0.0, 0.4, u * U, v_m * U, r * U / self.ship.L_pp)

    def control(self, n: float, delta: float, tunnel: float = 0.0) -> tuple[float, ...]:
        """Controls at `n` times the revolutions of the straight run and `delta` off its rudder."""
        base = self.at.orders
        given = {"n_P": n * (base.get("n_P", 0.0) or 1.0), "delta": delta + base.get("delta", 0.0),
                 TUNNEL: tunnel}  # fmt: skip
        return self.ship.model.obey(given)

    def rates(
        self, u: float = 1.0, v_m: float = 0.0, r: float = 0.0, n: float = 1.0, delta: float = 0.0,
        environment: Environment = CALM, tunnel: float = 0.0,
    ) -> Rates:  # fmt: skip
        """Scaled rates of u, v_m, r."""
        return self.under(self.state(u, v_m, r), self.control(n, delta, tunnel), environment)

    def under(
        self, state: tuple[float, ...], control: tuple[float, ...], environment: Environment = CALM
    ) -> Rates:
        """The same in a motion (six states) under given controls; NaN where the model has no answer."""
        model: Any = self.ship.model
        state = begun(model, state, control, environment)
        try:
            if isinstance(model, Sampled):
                du, dv, dr = model.advance(state, control, environment, model.begin(state, control))[0]
            else:
                du, dv, dr = model.derivative(state, control, environment)[3:6]
        except (ZeroDivisionError, OverflowError, ValueError):
            return math.nan, math.nan, math.nan
        U, L = self.ship.speed, self.ship.L_pp
        return du * L / (U * U), dv * L / (U * U), dr * L * L / (U * U)

    def has(self, name: str) -> bool:
        """Whether the model has a place for a part of that name."""
        model: Any = self.ship.model
        return name in {f.name for f in fields(model)}

    def having(self, **parts: Any) -> Probe:
        """The same ship with other parts, probed at the same straight run."""
        model: Any = self.ship.model
        return replace(self, ship=replace(self.ship, model=replace(model, **parts)))

"""The same ship in shipmmg: its turn, and its zigzag against a campaign of ours in one kernel."""

from __future__ import annotations

import math
from importlib import import_module
from typing import Any

import numpy as np

from ..core.parameters import read
from ..core.values import dataclass
from ..data import Array
from ..manoeuvres.zigzag import Zigzag
from ..simulate.run import campaign
from . import turn
from .timing import best

MODULE = "shipmmg.mmg_3dof"
"""Where shipmmg keeps its MMG of three degrees of freedom."""
SHIPS, SECONDS, ANGLE = 10_000, 80.0, math.radians(20.0)
RANDOM = ("ship.hull.Y_v", "ship.hull.Y_r", "ship.hull.N_v", "ship.hull.N_r", "ship.rudder.t_R", "ship.rudder.a_H",
          "ship.rudder.kappa", "ship.rudder.l_R", "ship.propeller.w_P0", "policy.delta", "policy.psi")  # fmt: skip
"""The numbers that differ from ship to ship in the comparison over a fleet."""
WAYS = (*(("euler", dt) for dt in (0.25, 0.2, 0.1, 0.05)), *(("rk4", dt) for dt in (0.5, 0.4, 0.25, 0.2, 0.1)))
"""Methods and steps among which ours is the cheapest that errs no more than theirs."""


@dataclass(frozen=True)
class Even:
    """Both programs at an error that is no larger than the peer's.

    Attributes:
        error: of the peer at its default settings, of the track [m] or the heading [rad].
        own: ours [same unit].
        method, dt: our quickest way with no larger error.
        ours, theirs: time a ship [s].
    """

    error: float
    own: float
    method: str
    dt: float
    ours: float
    theirs: float


def theirs() -> tuple[Any, Any]:
    """The ship as shipmmg wants it (in its own wake model)."""
    peer: Any = import_module(MODULE)
    model: Any = turn.ship().model
    b, p, r = model.body, model.propeller, model.rudder
    L = b.L_pp
    basic = {"L_pp": L, "B": 1.27, "d": b.d, "x_G": b.x_G, "D_p": p.D_P, "m": b.m, "I_zG": b.I_zG, "A_R": r.A_R,
             "η": r.eta, "m_x": b.m_x, "m_y": b.m_y, "J_z": b.J_z, "f_α": r.f_alpha, "ε": r.epsilon, "t_R": r.t_R,
             "x_R": r.x_R, "a_H": r.a_H, "x_H": r.x_H, "γ_R_minus": r.gamma_Rn, "γ_R_plus": r.gamma_Rp,
             "l_R": -0.71, "κ": r.kappa, "t_P": p.t_P, "w_P0": p.w_P0, "x_P": -0.69}  # fmt: skip
    primes = {"R_0": 0.022, "X_vv": -0.04, "X_vr": 0.002, "X_rr": 0.011, "X_vvvv": 0.771, "Y_v": -0.315,
              "Y_r": 0.083, "Y_vvv": -1.607, "Y_vvr": 0.379, "Y_vrr": -0.391, "Y_rrr": 0.008, "N_v": -0.137,
              "N_r": -0.049, "N_vvv": -0.03, "N_vvr": -0.294, "N_vrr": 0.055, "N_rrr": -0.013}  # fmt: skip
    primed = {f"{k}_dash": v for k, v in primes.items()}
    return peer.Mmg3DofBasicParams(**basic), peer.Mmg3DofManeuveringParams(k_0=p.k_0, k_1=p.k_1, k_2=p.k_2, **primed)


def their_turn(**options: Any) -> Any:
    """The turn by shipmmg."""
    peer: Any = import_module(MODULE)
    model: Any = turn.ship().model
    one: Any = np.ones(2001)
    t: Any = np.linspace(0.0, turn.DURATION, one.size)
    return peer.simulate_mmg_3dof(
        *theirs(), t, turn.DELTA * one, turn.N_P * one, u0=turn.ship().speed, ρ=model.body.rho, **options
    )  # fmt: skip


def their_call() -> float:
    """Time of one right-hand side of shipmmg, its solver with steps of 0.1 s [s]."""
    return best(lambda: their_turn(max_step=0.1), 3.0, 3) / their_turn(max_step=0.1).nfev


def even_turn() -> Even:
    """A whole turn at equal error of the track."""
    t = np.linspace(0.0, turn.DURATION, 2001)
    exact = their_turn(rtol=1e-10, atol=1e-12).sol(t)[3:5]
    error = float(np.hypot(*(their_turn().sol(t)[3:5] - exact)).max())
    dt = turn.widest_step(error)
    return Even(error, error, "rk4", dt, best(lambda: turn.sailed(dt), 1.0) / turn.LANES, best(their_turn, 2.0))


def their_zigzag(samples: int = 801, **options: Any) -> Any:
    """One 20/20 zigzag by shipmmg, on a time grid of 0.1 s."""
    peer: Any = import_module(MODULE)
    ship: Any = turn.ship()
    t: Any = np.linspace(0.0, SECONDS, samples)
    turning: Any = np.full(samples, turn.N_P)
    return peer.zigzag_test_mmg_3dof(
        *theirs(), ANGLE, ANGLE, t, turning, δ_rad_rate=float(ship.actuators.rudder.rate),
        u0=ship.speed, ρ=ship.model.body.rho, **options,
    )  # fmt: skip


def random_ships() -> dict[str, Array]:
    """Parameters within 10 % of the published ones, one column each."""
    rng, model = np.random.default_rng(1), turn.ship().model
    usual = {name: ANGLE if name.startswith("policy.") else read(model, name[5:]) for name in RANDOM}
    return {name: value * rng.uniform(0.9, 1.1, SHIPS) for name, value in usual.items()}


def our_zigzag(vary: dict[str, Array], method: str, dt: float, every: int) -> Any:
    """A 20/20 zigzag of each of the ships, in one kernel."""
    ship = turn.ship()
    return campaign(ship, Zigzag(turn.N_P, ANGLE, ANGLE), vary, speed=ship.speed, duration=SECONDS, dt=dt,
                    method=method, every=every)  # fmt: skip


def even_zigzag(vary: dict[str, Array]) -> Even:
    """A zigzag of each random ship at equal error of the heading."""
    rough, fine = np.array(their_zigzag()[6]), np.array(their_zigzag(16001, rtol=1e-10, atol=1e-12)[6])
    error = float(np.abs(rough[::20] - fine[::400]).max())
    exact = _heading("rk4", 0.001)
    errors = {way: float(np.abs(_heading(*way) - exact).max()) for way in WAYS}
    times = {way: best(lambda way=way: our_zigzag(vary, *way, round(1.0 / way[1])), 1.0, 3)
             for way in WAYS if errors[way] <= error}  # fmt: skip
    method, dt = min(times, key=lambda way: times[way])
    whole = best(lambda: our_zigzag(vary, method, dt, round(1.0 / dt)), 3.0, 3)
    return Even(error, errors[method, dt], method, dt, whole / SHIPS, best(their_zigzag, 3.0, 3))


def _heading(method: str, dt: float) -> Array:
    """Heading of one ship every 2 s [rad]."""
    return np.asarray(our_zigzag({}, method, dt, 1).values[0, :: round(2.0 / dt), 2])

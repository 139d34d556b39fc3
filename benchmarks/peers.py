"""The engine against shipmmg, against our own equations on Python floats, and against scipy on those."""

from __future__ import annotations

import math
import time
import warnings
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from timing import best, publish

from seatrial.engine import floats
from seatrial.engine.rollout import simulator
from seatrial.ships.files import load
from seatrial.simulate import open_loop, open_loop_parameters

LANES, DURATION, N_P, DELTA = 128, 200.0, 11.85, math.radians(35.0)
SHIP: Any = load("kvlcc2_l7")
SYSTEM, P = open_loop(SHIP), open_loop_parameters(SHIP)
START = (0.0, 0.0, 0.0, SHIP.speed, 0.0, 0.0)
HELD = np.tile([N_P, DELTA, *([0.0] * 8)], (LANES, 1, 1))
ENGINE = simulator(SYSTEM, back_end="simd")


def shipmmg_ship() -> tuple[Any, Any]:
    """The same ship as shipmmg wants it (in its own wake model)."""
    from shipmmg.mmg_3dof import Mmg3DofBasicParams, Mmg3DofManeuveringParams

    b, p, r = SHIP.model.body, SHIP.model.propeller, SHIP.model.rudder
    L = b.L_pp
    basic = {"L_pp": L, "B": 1.27, "d": b.d, "x_G": b.x_G, "D_p": p.D_P, "m": b.m, "I_zG": b.I_zG, "A_R": r.A_R,
             "η": r.eta, "m_x": b.m_x, "m_y": b.m_y, "J_z": b.J_z, "f_α": r.f_alpha, "ε": r.epsilon, "t_R": r.t_R,
             "x_R": r.x_R, "a_H": r.a_H, "x_H": r.x_H, "γ_R_minus": r.gamma_Rn, "γ_R_plus": r.gamma_Rp,
             "l_R": -0.71, "κ": r.kappa, "t_P": p.t_P, "w_P0": p.w_P0, "x_P": -0.69}  # fmt: skip
    primes = {"R_0": 0.022, "X_vv": -0.04, "X_vr": 0.002, "X_rr": 0.011, "X_vvvv": 0.771, "Y_v": -0.315,
              "Y_r": 0.083, "Y_vvv": -1.607, "Y_vvr": 0.379, "Y_vrr": -0.391, "Y_rrr": 0.008, "N_v": -0.137,
              "N_r": -0.049, "N_vvv": -0.03, "N_vvr": -0.294, "N_vrr": 0.055, "N_rrr": -0.013}  # fmt: skip
    primed = {f"{k}_dash": v for k, v in primes.items()}
    return Mmg3DofBasicParams(**basic), Mmg3DofManeuveringParams(k_0=p.k_0, k_1=p.k_1, k_2=p.k_2, **primed)


def shipmmg(**options: Any) -> Any:
    """The same turn by shipmmg."""
    from shipmmg.mmg_3dof import simulate_mmg_3dof

    t = np.linspace(0.0, DURATION, 2001)
    return simulate_mmg_3dof(
        *shipmmg_ship(), t, np.full(t.size, DELTA), np.full(t.size, N_P), u0=SHIP.speed, ρ=SHIP.model.body.rho,
        **options,
    )  # fmt: skip


def scipy_floats(**options: Any) -> Any:
    p, a = tuple(P.tolist()), tuple(HELD[0, 0].tolist())
    return solve_ivp(lambda _, z: SYSTEM.derivative(tuple(z.tolist()), a, p), (0.0, DURATION), START, **options)


def ours(dt: float) -> Any:
    z = np.tile(START, (LANES, 1))
    steps = round(DURATION / dt) + 1
    return ENGINE.run(z, HELD, P, dt=dt, steps=steps, every=steps, threads=1)


def track(dt: float) -> Any:
    """States of one ship at every step, shape (steps, 6)."""
    steps = round(DURATION / dt) + 1
    return ENGINE.run(np.array([START]), HELD[:1], P, dt=dt, steps=steps).values[0]


def dense(dt: float, t: Any) -> Any:
    """Track at the times `t`, between steps by the cubic that has the steps' own velocities."""
    z = track(dt)
    c, s = np.cos(z[:, 2]), np.sin(z[:, 2])
    rates = np.column_stack([z[:, 3] * c - z[:, 4] * s, z[:, 3] * s + z[:, 4] * c])
    return CubicHermiteSpline(dt * np.arange(len(z)), z[:, :2], rates)(t)


def widest_step(error: float) -> float:
    """The widest step whose track, at every 0.1 s, is no further than `error` [m] from a fine step of ours."""
    t = np.linspace(0.0, DURATION, 2001)
    fine = track(0.005)[:: round(0.1 / 0.005), :2]
    for dt in (5.0, 4.0, 2.5, 2.0, 1.0, 0.5, 0.2, 0.1):
        if np.hypot(*(dense(dt, t) - fine).T).max() <= error:
            return dt
    raise RuntimeError("no step reaches that error")


def main() -> None:
    begun = time.perf_counter()
    warnings.simplefilter("ignore")
    per_call = best(lambda: ours(0.1), 2.0) / (4 * round(DURATION / 0.1) * LANES)
    fine_calls = shipmmg(max_step=0.1).nfev
    theirs = best(lambda: shipmmg(max_step=0.1), 3.0, 3) / fine_calls
    steps = 500
    row = HELD[0]
    turns = 4 * (steps - 1)
    slow = best(lambda: floats.rollout(SYSTEM, START, row, tuple(P.tolist()), dt=0.1, steps=steps), 3.0, 3) / turns
    of_scipy = scipy_floats(max_step=0.1).nfev
    by_scipy = best(lambda: scipy_floats(max_step=0.1), 2.0, 2) / of_scipy
    model, p, a = SHIP.model, tuple(START), (N_P, DELTA)
    from seatrial.environment import CALM

    bare = best(lambda: [model.derivative(p, a, CALM) for _ in range(1000)], 1.0) / 1000
    t = np.linspace(0.0, DURATION, 2001)
    exact = shipmmg(rtol=1e-10, atol=1e-12).sol(t)[3:5]
    error = float(np.hypot(*(shipmmg().sol(t)[3:5] - exact)).max())
    dt = widest_step(error)
    whole, run = best(shipmmg, 2.0), best(lambda: ours(dt), 1.0) / LANES
    rows = [
        ("our engine, 1 thread, 128 ships", 1e9 * per_call, "ns per RHS and ship", "-"),
        ("shipmmg 0.0.11, its solver with steps of 0.1 s", 1e6 * theirs, "us per RHS", "-"),
        ("shipmmg over ours, per RHS and ship", theirs / per_call, "x", ">= 1000"),
        ("our model's derivative on Python floats, bare", 1e6 * bare, "us per RHS", "-"),
        ("bare floats over ours", bare / per_call, "x", ">= 100"),
        ("engine.floats (parameters put in at each call) over ours", slow / per_call, "x", "-"),
        ("scipy solve_ivp on our floats over ours, per RHS and ship", by_scipy / per_call, "x", "-"),
        ("track error of shipmmg at its default tolerance", error / SHIP.L_pp, "L", "-"),
        ("our widest step with no larger error", dt, "s", "-"),
        ("shipmmg over ours at equal error, a whole turn", whole / run, "x", ">= 50"),
    ]
    publish("peers", [dict(zip(("what", "value", "unit", "bar"), r, strict=True)) for r in rows])
    print(f"{time.perf_counter() - begun:.0f} s in all")


if __name__ == "__main__":
    main()

"""A campaign of 10 000 zigzags of ships with random parameters, against shipmmg's zigzag one by one."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
from peers import N_P, SHIP, shipmmg_ship
from timing import best, publish

from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.simulate import campaign

SHIPS, DURATION, ANGLE = 10_000, 80.0, math.radians(20.0)
RANDOM = ("ship.hull.Y_v", "ship.hull.Y_r", "ship.hull.N_v", "ship.hull.N_r", "ship.rudder.t_R", "ship.rudder.a_H",
          "ship.rudder.kappa", "ship.rudder.l_R", "ship.propeller.w_P0", "policy.delta", "policy.psi")  # fmt: skip


WAYS = (*(("euler", dt) for dt in (0.25, 0.2, 0.1, 0.05)), *(("rk4", dt) for dt in (0.5, 0.4, 0.25, 0.2, 0.1)))


def shipmmg(samples: int = 801, **options: Any) -> Any:
    """One 20/20 zigzag by shipmmg, on a time grid of 0.1 s."""
    from shipmmg.mmg_3dof import zigzag_test_mmg_3dof

    t = np.linspace(0.0, DURATION, samples)
    rate = float(SHIP.actuators.rudder.rate)
    return zigzag_test_mmg_3dof(
        *shipmmg_ship(), ANGLE, ANGLE, t, np.full(t.size, N_P), δ_rad_rate=rate, u0=SHIP.speed,
        ρ=SHIP.model.body.rho, **options,
    )  # fmt: skip


def random_ships() -> dict[str, Any]:
    """Parameters within 10 % of the published ones, one column each."""
    from seatrial.parameters import read

    rng = np.random.default_rng(1)
    usual = {name: ANGLE if name.startswith("policy.") else read(SHIP.model, name[5:]) for name in RANDOM}
    return {name: value * rng.uniform(0.9, 1.1, SHIPS) for name, value in usual.items()}


def ours(vary: dict[str, Any], method: str, dt: float) -> Any:
    return campaign(SHIP, Zigzag(N_P, ANGLE, ANGLE), vary, speed=SHIP.speed, duration=DURATION, dt=dt, method=method,
                    every=round(1.0 / dt))  # fmt: skip


def heading(method: str, dt: float) -> Any:
    """Heading of one ship every 2 s [rad]."""
    run = campaign(SHIP, Zigzag(N_P, ANGLE, ANGLE), {}, speed=SHIP.speed, duration=DURATION, dt=dt, method=method)
    return run.values[0, :: round(2.0 / dt), 2]


def main() -> None:
    """Measure and publish."""
    begun = time.perf_counter()
    vary = random_ships()
    rough, fine = np.array(shipmmg()[6]), np.array(shipmmg(16001, rtol=1e-10, atol=1e-12)[6])
    of_theirs = float(np.abs(rough[::20] - fine[::400]).max())
    exact = heading("rk4", 0.001)
    errors = {way: float(np.abs(heading(*way) - exact).max()) for way in WAYS}
    times = {way: best(lambda way=way: ours(vary, *way), 1.0, 3) for way in WAYS if errors[way] <= of_theirs}
    method, dt = min(times, key=lambda way: times[way])
    run, usual = ours(vary, method, dt), best(lambda: ours(vary, "rk4", 0.1), 2.0, 3)
    whole = best(lambda: ours(vary, method, dt), 6.0, 3)
    theirs = best(shipmmg, 3.0, 3)
    failed = len(run.failures)
    rows = [
        ("greatest heading error of shipmmg at its default settings", math.degrees(of_theirs), "deg", "-"),
        (f"our quickest way with no larger error: {method}, step", dt, "s", "-"),
        ("its heading error", math.degrees(errors[method, dt]), "deg", "-"),
        ("10 000 random ships, each a 20/20 zigzag of 80 s, in one kernel", whole, "s", "-"),
        ("per ship", 1e6 * whole / SHIPS, "us", "-"),
        ("ships that failed", float(failed), "-", "-"),
        ("shipmmg 0.0.11, one zigzag at its default settings", 1e3 * theirs, "ms", "-"),
        ("shipmmg over ours, per ship", theirs * SHIPS / whole, "x", ">= 1000"),
        ("the same with RK4 and steps of 0.1 s", theirs * SHIPS / usual, "x", "-"),
    ]
    publish("campaign", [dict(zip(("what", "value", "unit", "bar"), r, strict=True)) for r in rows])
    print(f"{time.perf_counter() - begun:.0f} s in all")


if __name__ == "__main__":
    main()

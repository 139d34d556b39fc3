"""Logs of a virtual ship for bands: turns and zigzags of many angles, with what the model is not told."""

from __future__ import annotations

import numpy as np

from seatrial.belief.parts import LeftOut
from seatrial.belief.posterior import Posterior
from seatrial.core.parameters import Free, read
from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

DEGREE = np.pi / 180.0
NOISE = {"x": 0.03, "y": 0.03, "psi": 0.002, "u": 0.005, "v_m": 0.005, "r": 0.001}
SPAN = 60.0


def ship() -> Ship:
    """The model: what its trials are of, but for what each test adds."""
    return load("kvlcc2_l7")


def log(truth: Ship, number: int, rng: np.random.Generator, current: tuple[float, float] = (0.0, 0.0)) -> Trial:
    """A turn or a zigzag of some rudder angle, on a heading of its own, in a current that is not logged."""
    U, n_P = approach(ship())
    angle = rng.uniform(8.0, 30.0) * DEGREE
    side = 1 if rng.random() < 0.5 else -1
    policy = Turning(n_P, side * angle) if number % 2 else Zigzag(n_P, angle, angle, side)
    psi, (north, east) = rng.uniform(-np.pi, np.pi), current
    start = (0.0, 0.0, psi, U + north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi), 0.0)
    run = simulate(truth, policy, start=start, duration=SPAN, dt=0.1, every=5,
                   environment=Uniform(U_C=float(np.hypot(north, east)), gamma_C=float(np.arctan2(east, north))))
    kept = {name: values for name, values in run.channels.items() if name not in ("U_C", "gamma_C")}
    noisy = {n: run[n] + s * rng.standard_normal(len(run)) for n, s in NOISE.items()}
    meta = {**run.meta, "source": "test"}
    return Trial(f"{policy.kind}_{number}", run.t, {**kept, **noisy}, units=run.units, meta=meta)


def left_out(trials: list[Trial], parts: int = 4, sigma: float = 0.01) -> list[LeftOut]:
    """The model as fits of it would be, each with trials that it has not seen: the fits themselves are not at issue."""
    who = posterior(sigma)
    return [LeftOut(who, tuple(trials[k::parts])) for k in range(parts)]


def posterior(sigma: float = 0.01) -> Posterior:
    """Of two coefficients, narrow."""
    model = ship()
    free = tuple(Free(path, float(read(model.model, path))) for path in ("hull.Y_v", "hull.N_r"))
    mean = np.array([one.start for one in free])
    return Posterior(model, free, mean, np.diag((sigma * mean) ** 2), "digest")

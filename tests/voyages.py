"""Voyages of a simulated ship under an autopilot, as a log would show them, with drift and planted faults."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from seatrial.environment import Environment, Uniform
from seatrial.environment.weather import Gust
from seatrial.realtime.plant import Compiled, Plant
from seatrial.ships import Ship
from seatrial.ships.files import load

NOISE = {"x": 0.5, "y": 0.5, "psi": 0.0015, "r": 0.0002, "u_w": 0.03, "v_north": 0.03, "v_east": 0.03}
KINDS = ("frozen compass", "gnss jump", "gnss drift", "jammed rudder", "slow rudder", "lost propeller", "log stuck",
         "current step")  # fmt: skip
SEGMENT = 600.0
SEA = np.array([[1.15e-3, 1.1e-4], [1.15e-3, 1.1e-3], [1.4e-5, 1.3e-5]])
"""Of surge, sway and yaw: random walk of the velocity in a second, and slow acceleration, which lasts 500 s."""
Row = tuple[float, dict[str, float]]


@dataclass(frozen=True)
class Voyage:
    """A voyage; rows of readings and, beside them, the truth.

    Attributes:
        fault: one of `KINDS` from time `at` [s] on; empty for none.
        feedback: whether the log holds the rudder's angle; else its order alone, under the name of the angle.
        R_0: factor of the resistance over time.
        current: north and east over time [m/s].
        bias: error of the rate gyro [rad/s].
        pull: steady acceleration to the north-east that no log shows [m/s^2].
        gusty: whether that pull is of a wind with Davenport's gusts, which turns by 90 deg in 12 hours.
        sea: random forces that no log shows, as shares of `SEA`.
    """

    ship: Ship
    hours: float
    dt: float = 1.0
    fault: str = ""
    at: float = math.inf
    feedback: bool = True
    R_0: Callable[[float], float] = lambda t: 1.0
    current: Callable[[float], tuple[float, float]] = lambda t: (0.0, 0.0)
    bias: float = 0.0
    sea: float = 1.0
    pull: float = 0.0
    gusty: bool = False
    seed: int = 1

    def rows(self) -> Iterator[tuple[Row, dict[str, float]]]:
        """Each row with the truth beside it."""
        rng = np.random.default_rng(self.seed)
        base = float(self.ship.model.hull.R_0)
        plant: Plant | None = None
        n_P, course, slow, held = 0.0, 0.0, np.zeros(3), dict[str, float]()
        pulls = self._pulls()
        inner = 2
        for k in range(round(self.hours * 3600.0 / self.dt)):
            t = k * self.dt
            if k % round(SEGMENT / self.dt) == 0:
                compiled = Compiled.of(self.ship.having({"hull.R_0": base * self.R_0(t)}), self.dt / inner)
                fresh = compiled.plant()
                if plant is not None:
                    fresh.restore(plant.snapshot())
                else:
                    n_P = fresh["n_P_cmd"]
                plant = fresh
                course += math.radians(rng.uniform(20.0, 50.0)) * rng.choice([-1.0, 1.0]) if k else 0.0
            assert plant is not None
            faulty = t >= self.at
            north, east = self.current(t)
            if faulty and self.fault == "current step":
                north, east = north + 0.5, east - 0.4
            plant.surround(Environment(current_x=north, current_y=east))
            slow += -slow * self.dt / 500.0 + SEA[:, 1] * math.sqrt(2.0 * self.dt / 500.0) * rng.standard_normal(3)
            if self.pull:
                much, way = pulls[k].tolist()
                c, s = math.cos(plant["psi"] - way), math.sin(plant["psi"] - way)
                pushed(plant, much * self.dt * np.array([c, -s, 0.0]))
            pushed(plant, self.sea * (slow * self.dt + SEA[:, 0] * math.sqrt(self.dt) * rng.standard_normal(3)))
            error = math.remainder(course - plant["psi"], 2.0 * math.pi)
            wanted = min(max(1.0 * error - 25.0 * plant["r"], -0.35), 0.35)
            plant.order("n_P", n_P)
            reach = math.inf
            if faulty and self.fault == "jammed rudder":
                wanted_now = held.setdefault("delta", plant["delta"])
            elif faulty and self.fault == "slow rudder":
                reach = math.radians(0.5) * self.dt
                wanted_now = plant["delta"] + min(max(wanted - plant["delta"], -reach), reach)
            else:
                wanted_now = wanted
            plant.order("delta", wanted_now)
            if faulty and self.fault == "lost propeller":
                plant.order("n_P", 0.25 * n_P)
            truth = {name: plant[name] for name in ("x", "y", "psi", "u", "v_m", "r", "delta", "n_P")}
            truth |= {"current_x": north, "current_y": east, "R_0": base * self.R_0(t)}
            yield (t, self._read(t, truth, wanted, n_P, held, rng)), truth
            for _ in range(inner):
                plant.step()

    def _pulls(self) -> np.ndarray:
        """The pull of each row and where to, shape (rows, 2)."""
        steps = round(self.hours * 3600.0 / self.dt)
        if not self.gusty:
            return np.tile([self.pull, 0.25 * math.pi], (steps, 1))
        wind = Gust(Uniform(U_T=10.0), spectrum="davenport", seed=self.seed).series(self.dt, steps)[:, 0]
        turned = 0.25 * math.pi + 0.5 * math.pi * np.arange(steps) * self.dt / 43200.0
        return np.column_stack([self.pull * (wind / 10.0) ** 2, turned])

    def _read(
        self, t: float, truth: dict[str, float], wanted: float, n_P: float, held: dict[str, float],
        rng: np.random.Generator,
    ) -> dict[str, float]:  # fmt: skip
        c, s = math.cos(truth["psi"]), math.sin(truth["psi"])
        north, east = truth["u"] * c - truth["v_m"] * s, truth["u"] * s + truth["v_m"] * c
        u_w = truth["u"] - truth["current_x"] * c - truth["current_y"] * s
        exact = {"x": truth["x"], "y": truth["y"], "psi": truth["psi"], "r": truth["r"] + self.bias, "u_w": u_w,
                 "v_north": north, "v_east": east}  # fmt: skip
        read = {name: value + NOISE[name] * float(rng.standard_normal()) for name, value in exact.items()}
        since = t - self.at
        if since >= 0.0:
            if self.fault == "gnss jump":
                read["x"] += 20.0
                read["y"] -= 15.0
            elif self.fault == "gnss drift":
                read["x"] += 0.3 * since
                read["y"] += 0.3 * since
            for fault, name in (("frozen compass", "psi"), ("log stuck", "u_w")):
                if self.fault == fault:
                    read[name] = held.setdefault(name, read[name])
        read["psi"] = read["psi"] % (2.0 * math.pi)
        read["n_P"] = n_P
        read["delta_cmd"] = wanted
        read["delta"] = truth["delta"] if self.feedback else wanted
        if not self.feedback:
            del read["delta_cmd"]
        return read


def pushed(plant: Plant, change: np.ndarray) -> None:
    """Change the velocities of a ship at once."""
    head, _, body = plant.snapshot().partition(b"\n")
    values = np.frombuffer(body).copy()
    values[3:6] += change
    plant.restore(head + b"\n" + values.tobytes())


def coaster() -> Ship:
    """The ship of the voyages: 83 m, 6 knots."""
    return load("suzaku")


def drifting(hours: float = 24.0, **given: object) -> Voyage:
    """The voyage of the bar: R_0 grows by a fifth in 12 hours and stays, the current turns once, the gyro is off."""
    return Voyage(
        coaster(), hours, R_0=lambda t: 1.0 + 0.2 * min(t / 43200.0, 1.0),
        current=lambda t: (0.4 * math.cos(2.0 * math.pi * t / 43200.0), 0.4 * math.sin(2.0 * math.pi * t / 43200.0)),
        bias=0.0005, **given,  # type: ignore[arg-type]
    )  # fmt: skip

"""A ship whose motion is linear, so that what a twin computes has closed forms: brute force on stacked matrices."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import expm

from seatrial.identify.filters.measurement import Antenna, Heading, Log, Rate
from seatrial.realtime.twin.follow import Follower, Machine, Step
from seatrial.realtime.twin.settings import HEADING, POSITION, SPEED, TURN, Settings

NAMES = ("x", "y", "psi", "u", "v_m", "r", "environment.current_x", "environment.current_y",
         "slow.u", "slow.v_m", "slow.r")  # fmt: skip
CHANNELS = ("x", "y", "psi", "r", "u_w")
CONTROLS = ("n_P", "delta")
TAU, SPEED_0 = 200.0, 5.0
NOISE = np.array([0.5, 0.5, 0.002, 2e-4, 0.05])
DENSITY = np.array([0, 0, 0, 1e-2, 5e-3, 1e-4, 1e-3, 1e-3, 1e-4, 1e-4, 1e-6]) ** 2


def _system() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rates by states and by controls, and readings by states, about a straight run to the north at 5 m/s."""
    A, B, H = np.zeros((11, 11)), np.zeros((11, 2)), np.zeros((5, 11))
    A[0, [3, 6]] = 1.0
    A[1, [4, 7]], A[1, 2] = 1.0, SPEED_0
    A[2, 5] = 1.0
    A[3, 3], A[3, 8], B[3, 0] = -0.02, 1.0, 0.05
    A[4, 4], A[4, 5], A[4, 9], B[4, 1] = -0.05, -2.0, 1.0, -0.05
    A[5, 5], A[5, 4], A[5, 10], B[5, 1] = -0.06, -2e-4, 1.0, 0.004
    for k in (8, 9, 10):
        A[k, k] = -1.0 / TAU
    H[0, 0] = H[1, 1] = H[2, 2] = H[3, 5] = H[4, 3] = 1.0
    H[4, 6] = -1.0
    return A, B, H


A, B, H = _system()


def step_of(dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Transition of the state over `dt`, and what constant controls do meanwhile."""
    whole = np.zeros((13, 13))
    whole[:11, :11], whole[:11, 11:] = A, B
    found = expm(whole * dt)
    return found[:11, :11], found[:11, 11:]


class Model:
    """What a filter computes with."""

    names, channels, noise = NAMES, CHANNELS, NOISE
    angle = np.array([0.0, 0.0, 1.0, 0.0, 0.0])

    def __init__(self) -> None:
        self._known: dict[float, tuple[np.ndarray, ...]] = {}

    def step(self, z: np.ndarray, acting: np.ndarray, dt: float) -> tuple[np.ndarray, ...]:
        if dt not in self._known:
            self._known[dt] = (*step_of(dt), step_of(0.5 * dt)[0])
        onward, pushed, half = self._known[dt]
        return onward @ z + pushed @ acting[:2], onward.T.copy(), half.T.copy()

    def read(self, z: np.ndarray, acting: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return H @ z, H.T.copy()

    def wrapped(self, innovation: np.ndarray) -> np.ndarray:
        return np.where(self.angle > 0.0, (innovation + math.pi) % math.tau - math.pi, innovation)


@dataclass(frozen=True)
class Nameless:
    """What a model says of itself, with no number that has a name."""

    controls: ClassVar[tuple[str, ...]] = CONTROLS
    stands_for: ClassVar[tuple[tuple[str, float], ...]] = (("n_P", 1.0), ("delta", 1.0))


def machine(**more: Any) -> Machine:
    """The ship, 100 m long, at 5 m/s; its rudder moves at 0.05 rad/s."""
    sensors = {POSITION: Antenna(NOISE[0]), HEADING: Heading(NOISE[2]), TURN: Rate(NOISE[3]),
               SPEED: Log(NOISE[4], channels=("u_w",))}  # fmt: skip
    start = dict(zip(NAMES[6:], (0.5, 0.5, 2e-3, 2e-3, 2e-5), strict=True))
    settings = Settings(sensors, {}, start, dict.fromkeys(NAMES[8:], TAU), step=1.0, **more)
    servos = {"n_P": SimpleNamespace(rate=math.inf), "delta": SimpleNamespace(rate=0.05)}
    ship: Any = SimpleNamespace(
        L_pp=100.0, speed=SPEED_0, name="linear", actuators=SimpleNamespace(of=servos.__getitem__),
        model=Nameless(),
    )  # fmt: skip
    model = Model()
    traced: Any = SimpleNamespace(
        model=model, own=6, names=NAMES, controls=CONTROLS,
        onward=lambda z, acting, dt: (model.step(z, acting, dt)[0],), pushed=lambda z, acting, dt: (step_of(dt)[1].T,),
    )  # fmt: skip
    return Machine(ship, settings, traced, DENSITY, np.full(11, -math.inf), np.full(11, math.inf))


def blur(dt: float) -> np.ndarray:
    """Covariance of the noise that comes in over `dt`, by Van Loan's integral (1978); a long span by halves."""
    if dt > 4.0:
        onward, part = step_of(0.5 * dt)[0], blur(0.5 * dt)
        return onward @ part @ onward.T + part
    whole = np.zeros((22, 22))
    whole[:11, :11], whole[:11, 11:], whole[11:, 11:] = -A, np.diag(DENSITY), A.T
    found = expm(whole * dt)
    return found[11:, 11:].T @ found[:11, 11:]


@dataclass
class Sailed:
    """A run: true states, what acted in each row's interval, and readings."""

    t: np.ndarray
    true: np.ndarray
    acting: np.ndarray
    readings: np.ndarray


def sailed(rows: int, dt: float = 1.0, seed: int = 0, noise: float = 1.0, steer: float = 0.1) -> Sailed:
    """A run from no deviation with process and reading noise as stated; without noise in a turn, else to and fro."""
    rng = np.random.default_rng(seed)
    onward, pushed = step_of(dt)
    root = np.linalg.cholesky(blur(dt) + 1e-18 * np.eye(11))
    acting = np.zeros((rows, 10))
    acting[:, 1] = steer * (np.sign(np.sin(np.arange(rows) * dt / 15.0)) if noise else 1.0)
    acting[:, 0] = 1.0
    z, true = np.zeros(11), []
    for k in range(rows):
        z = onward @ z + pushed @ acting[k, :2] + noise * root @ rng.standard_normal(11)
        true.append(z)
    states = np.array(true)
    readings = states @ H.T + noise * NOISE * rng.standard_normal((rows, 5))
    return Sailed((1.0 + np.arange(rows)) * dt, states, acting, readings)


def followed(follower: Follower, run: Sailed, masked: tuple[int, ...] = ()) -> list[tuple[Follower, Step]]:
    """The filter after each row, and its step."""
    out: list[tuple[Follower, Step]] = []
    for t, acting, readings in zip(run.t.tolist(), run.acting, run.readings, strict=True):
        follower, step = follower.row(t, acting, readings, masked)
        out.append((follower, step))
    return out

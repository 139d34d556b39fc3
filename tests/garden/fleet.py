"""The ships of the garden as a day of trials meets them: manoeuvres, weather, instruments, rate of the log."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from .motion import Controls, Order, Weather, steps, turning, zigzag
from .others import ESSO, TUG, TWIN
from .ships import FULL, MODEL, Ship

DEG = math.pi / 180.0
UNITS = {
    "x": "m", "y": "m", "psi": "rad", "u": "m/s", "v_m": "m/s", "r": "rad/s", "delta": "rad", "n_P": "1/s",
    "U_T": "m/s", "gamma_T": "rad", "U_A": "m/s", "gamma_A": "rad", "delta_cmd": "rad", "n": "1/s", "alpha": "rad",
}  # fmt: skip

# Standard deviation of the noise and steps of the instruments at full scale [SI].
NOISE = {
    "x": 0.5, "y": 0.5, "psi": 0.15 * DEG, "u": 0.05, "v_m": 0.05, "r": 0.1 * DEG / 60.0, "delta": 0.05 * DEG,
    "n_P": 0.001, "U_T": 0.3, "gamma_T": 3.0 * DEG,
}  # fmt: skip
STEPS = {
    "x": 0.01, "y": 0.01, "psi": 0.1 * DEG, "u": 0.01, "v_m": 0.01, "r": 0.1 * DEG / 60.0, "delta": 0.1 * DEG,
    "n_P": 0.1 / 60.0, "U_T": 0.1, "gamma_T": 1.0 * DEG,
}  # fmt: skip
# The same of a model on a pond: two antennas (RTK), a MEMS gyro, encoders, a small anemometer.
POND_NOISE = {
    "x": 0.01, "y": 0.01, "psi": 0.15 * DEG, "u": 0.01, "v_m": 0.01, "r": 0.05 * DEG, "delta": 0.05 * DEG, "n_P": 0.01,
    "n": 0.01, "alpha": 0.2 * DEG, "U_T": 0.1, "gamma_T": 4.0 * DEG,
}  # fmt: skip
POND_STEPS = {
    "x": 0.001, "y": 0.001, "psi": 0.01 * DEG, "u": 0.001, "v_m": 0.001, "r": 0.01 * DEG, "delta": 0.1 * DEG,
    "n_P": 0.01, "n": 0.01, "alpha": 0.1 * DEG, "U_T": 0.01, "gamma_T": 1.0 * DEG,
}  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """One trial: its orders by the heading at its beginning, and how it begins and ends [m/s, s]."""

    name: str
    kind: str
    orders: Callable[[float], Iterator[Order]]
    begin: Controls
    speed: float
    duration: float


@dataclass(frozen=True)
class Vessel:
    """A ship of the garden.

    Attributes:
        ship: with the coefficients of its file.
        plans: trials of a day, for the ship and its revolutions at the speed of approach.
        rate: rows a second.
        weathers: by name.
        noise, steps: of a channel by its name without number, SI.
    """

    ship: Ship
    plans: Callable[[Ship, float], list[Plan]]
    rate: float
    weathers: Mapping[str, Weather]
    noise: Mapping[str, float] = field(default_factory=lambda: POND_NOISE)
    steps: Mapping[str, float] = field(default_factory=lambda: POND_STEPS)


def _weathers(wind: float, current: float) -> dict[str, Weather]:
    return {"calm": Weather(), "wind": Weather(wind=wind, wind_from=240.0 * DEG),
            "current": Weather(current=current, current_to=70.0 * DEG)}  # fmt: skip


def _usual(ship: Ship, n: float, straight: float, by_time: float, angles: tuple[int, int, int] = (10, 20, 35),
           both: bool = True) -> list[Plan]:  # fmt: skip
    """Zigzags and turns to both sides, and an acceleration."""

    def steer(angle: float) -> Controls:
        return ship.steered(angle, n)

    def zig(angle: float, side: int) -> Callable[[float], Iterator[Order]]:
        return lambda psi: zigzag(steer, angle * DEG, angle * DEG, side, psi, straight)

    small, large, hard = angles
    ways = [("s", 1), ("p", -1)]
    zigzags = [(angle, *way) for angle in (small, large) for way in ways]
    if not both:
        zigzags = [zigzags[0], zigzags[3]]
    held, slow = steer(0.0), ship.steered(0.0, 0.6 * n)
    out = [Plan(f"zigzag_{angle}_{letter}", "zigzag", zig(angle, side), held, ship.speed,
                (900.0 if angle == small else 1000.0) * by_time) for angle, letter, side in zigzags]  # fmt: skip
    out += [Plan(f"turning_{hard}_{letter}", "turning",
                 lambda psi, side=side: turning(steer, hard * DEG, side, straight), held, ship.speed, 1200.0 * by_time)
            for letter, side in ways]  # fmt: skip
    begun = 30.0 * straight / 20.0
    out.append(Plan("acceleration", "acceleration", lambda psi: steps((0.0, slow), (begun, held)), slow,
                    0.6 * ship.speed, 900.0 * by_time))  # fmt: skip
    return out


def single(ship: Ship, n: float) -> list[Plan]:
    return _usual(ship, n, 20.0, math.sqrt(ship.length / 320.0))


def slow_model(ship: Ship, n: float) -> list[Plan]:
    """As many lengths as the full scale ship runs."""
    own = ship.length / ship.speed
    return _usual(ship, n, 0.5 * own, own / 40.0)


def twin(ship: Ship, n: float) -> list[Plan]:
    """Also one shaft slower than the other, and the rudders apart."""
    own = ship.length / ship.speed
    apart = lambda a, b: (n, n, a * DEG, b * DEG)  # noqa: E731
    shafts = lambda a, b: (a * n, b * n, 0.0, 0.0)  # noqa: E731
    begin = ship.steered(0.0, n)
    return [
        *_usual(ship, n, 20.0, math.sqrt(ship.length / 320.0), both=False),
        Plan("shafts", "shafts", lambda psi: steps((0.0, begin), (2 * own, shafts(1.0, 0.5)),
                                                  (8 * own, shafts(0.5, 1.0)), (16 * own, begin)),
             begin, ship.speed, 22 * own),
        Plan("rudders", "rudders", lambda psi: steps((0.0, begin), (2 * own, apart(20, 0)), (7 * own, apart(0, -20)),
                                                    (13 * own, apart(-15, 15)), (18 * own, apart(0, 20))),
             begin, ship.speed, 24 * own),
    ]  # fmt: skip


def tug(ship: Ship, n: float) -> list[Plan]:
    """Also azimuths stepped one by one, crabbing as in dynamic positioning, and turning on the spot."""
    own = ship.length / ship.speed

    def at(n_1: float, alpha_1: float, n_2: float, alpha_2: float) -> Controls:
        return n_1 * n, alpha_1 * DEG, n_2 * n, alpha_2 * DEG

    slow = ship.steered(0.0, 0.5 * n)
    # thrust ahead on one side and astern on the other holds the heading while both push the stern aside
    crab = [(0.0, slow), (3 * own, at(1.0, 171, 1.0, 9)), (24 * own, at(1.0, -9, 1.0, -171)),
            (50 * own, at(0.5, 0, 0.5, 0))]  # fmt: skip
    stepped = [(0.0, slow), (3 * own, at(0.5, 30, 0.5, 0)), (8 * own, at(0.5, 0, 0.5, -30)),
               (14 * own, at(0.8, 0, 0.4, 0)), (20 * own, at(0.4, 25, 0.8, -25)), (28 * own, at(0.6, -40, 0.6, 0)),
               (34 * own, at(0.6, 0, 0.3, 40))]  # fmt: skip
    spot = [(0.0, slow), (3 * own, at(0.6, 90, 0.6, 90)), (15 * own, at(0.0, 90, 0.7, -90)),
            (30 * own, at(0.5, -60, 0.5, -90))]  # fmt: skip
    return [
        *_usual(ship, n, 1.5 * own, own / 40.0, (10, 20, 30), both=False),
        Plan("azimuths", "azimuths", lambda psi: steps(*stepped), slow, 0.5 * ship.speed, 40 * own),
        Plan("crabbing", "crabbing", lambda psi: steps(*crab), slow, 0.5 * ship.speed, 56 * own),
        Plan("on_the_spot", "on_the_spot", lambda psi: steps(*spot), slow, 0.5 * ship.speed, 45 * own),
    ]


_BY_FROUDE = math.sqrt(MODEL.length / FULL.length)
FLEET = {
    "full": Vessel(FULL, single, 1.0, _weathers(10.0, 0.5), NOISE, STEPS),
    "model": Vessel(MODEL, single, 5.0, _weathers(10.0 * _BY_FROUDE, 0.5 * _BY_FROUDE), NOISE, STEPS),
    "esso": Vessel(ESSO, slow_model, 5.0, _weathers(0.8, 0.04)),
    "twin": Vessel(TWIN, twin, 5.0, _weathers(1.5, 0.07)),
    "tug": Vessel(TUG, tug, 5.0, _weathers(1.0, 0.05)),
}
"""By the name that `run` and `calibrate` take."""

BY_SHIP = {vessel.ship.name: vessel for vessel in FLEET.values()}
"""By the name of the ship file."""

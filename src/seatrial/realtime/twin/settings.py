"""What a twin assumes: sensors with their noise, process noise, and which parameters drift."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from ...core.parameters import read, specs, unknown, values
from ...identify import StudyError
from ...identify.filters.augmented import BIAS, SLOW
from ...identify.filters.measurement import Antenna, Heading, Log, Rate, Sensor, Track
from ...identify.nuisance import CURRENT
from ...ships import Ship

POSITION, HEADING, TURN, SPEED, VELOCITY = "position", "compass", "rate gyro", "log", "velocity"
"""Sensors of a twin by name."""

NOISE: Mapping[str, float] = {"x": 1.0, "psi": 0.002, "r": 0.0003, "u_w": 0.05, "v_north": 0.05}
"""Noise of the usual instruments of a merchant ship by their first channel, where a log does not show it; assumed."""

EKF, MHE = "ekf", "mhe"
"""Estimators of a twin."""

_DAY = 86400.0


@dataclass(frozen=True)
class Settings:
    """Settings of a twin; everything in SI units and radians.

    Attributes:
        sensors: by name.
        process: random walk of each state, as the standard deviation that it gathers in one second.
        start: standard deviation of each further state at first.
        memory: time constant of each state that returns to zero [s].
        free: paths of the parameters that may drift.
        settle: time in which the twin raises no alarm [s].
        window: time over which faults are sought [s].
        spacing: time between the onsets that are tried [s].
        false_alarms: false alarms a day that are accepted.
        step: longest Runge-Kutta step [s].
        ranges: bounds of the parameters that drift.
        estimator: "ekf", or "mhe": the extended filter corrected once a second by moving horizon estimation.
        horizon: window of the latter [s].
    """

    sensors: Mapping[str, Sensor]
    process: Mapping[str, float]
    start: Mapping[str, float]
    memory: Mapping[str, float]
    free: tuple[str, ...] = ()
    settle: float = 300.0
    window: float = 90.0
    spacing: float = 5.0
    false_alarms: float = 0.2
    step: float = 1.0
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    estimator: str = EKF
    horizon: float = 60.0

    @property
    def more(self) -> tuple[str, ...]:
        """Names of the states beyond those of the ship's model."""
        return tuple(self.start)


def usual(
    ship: Ship, channels: Sequence[str], *, noise: Mapping[str, float] | None = None, free: Sequence[str] = (),
    gyro_bias: bool = True, antenna: tuple[float, float] = (0.0, 0.0), estimator: str = EKF,
) -> Settings:  # fmt: skip
    """Settings for a ship, in proportion to its length and speed.

    Args:
        channels: channels of the log; those of a sensor must all be there.
        noise: standard deviation by channel; `NOISE` fills in.
        free: parameters that may drift: each walks by a fifth of its value in a day.
        gyro_bias: estimate the error of the rate gyro, where there is one and a compass beside it.
        antenna: place of the satellite antenna, forward and to starboard of midship [m].
        estimator: `EKF` or `MHE`.

    Raises:
        StudyError: the log shows neither heading nor position, or a parameter is not known.
    """
    if estimator not in (EKF, MHE):
        raise StudyError(f"--estimator is '{estimator}'; it is {EKF} or {MHE}")
    U, T = max(ship.speed, 1e-3), ship.L_pp / max(ship.speed, 1e-3)
    # no model follows a log more closely than this, whatever the resolution of its instruments
    least = {"x": 2.5e-3 * ship.L_pp, "psi": 1e-3, "r": 5e-4 / T, "u_w": 2e-3 * U, "v_north": 2e-3 * U}
    known = {name: max(value, least.get(name, 0.0)) for name, value in {**NOISE, **(noise or {})}.items()}
    there = {
        POSITION: Antenna(known["x"], *antenna), HEADING: Heading(known["psi"]), TURN: Rate(known["r"]),
        SPEED: Log(known["u_w"], channels=("u_w",)), VELOCITY: Track(known["v_north"], *antenna),
    }  # fmt: skip
    sensors: dict[str, Sensor] = {name: s for name, s in there.items() if all(c in channels for c in s.channels)}
    if HEADING not in sensors or (POSITION not in sensors and VELOCITY not in sensors):
        raise StudyError(f"{ship.name}: a twin needs heading and position; the log has {', '.join(channels)}")
    spans = {name: (spec.low, spec.high) for name, spec in specs(ship.model).items()}
    for path in free:
        if path not in spans:
            raise StudyError(f"{ship.name}: {unknown(path, spans, 'parameter')}")
        if float(read(ship.model, path)) == 0.0:
            raise StudyError(f"--free {path}: it is 0, of which no share can drift; give the ship file a value")
    size = {path: abs(float(values(ship.model)[path])) for path in free}
    white = 0.002 * U / math.sqrt(T)
    slow = {"slow.u": 0.001 * U / T, "slow.v_m": 0.01 * U / T, "slow.r": 0.01 / T**2}
    tau = 20.0 * T
    # a log through the water tells the current from forces; without one, what is called current holds both
    start = dict.fromkeys(CURRENT, 0.1 * U) | slow
    process = {"u": white, "v_m": white, "r": white / ship.L_pp} | dict.fromkeys(CURRENT, 0.01 * U / math.sqrt(tau))
    process |= {name: sd * math.sqrt(2.0 / tau) for name, sd in slow.items()}
    if gyro_bias and TURN in sensors:
        start[f"{BIAS}r"] = 5.0 * known["r"]
        process[f"{BIAS}r"] = 0.1 * known["r"] / math.sqrt(3600.0)
    start |= {path: 0.1 * value for path, value in size.items()}
    process |= {path: 0.2 * value / math.sqrt(_DAY) for path, value in size.items()}
    return Settings(
        sensors, process, start, dict.fromkeys(SLOW, tau), tuple(free), settle=max(120.0, 10.0 * T),
        step=max(0.02 * T, 0.02), ranges={path: spans[path] for path in free}, estimator=estimator,
    )  # fmt: skip


def scaled(settings: Settings, motion: float, slow: float) -> Settings:
    """The same with the random walk of the motion, and with slow forces, times factors."""
    factors: dict[str, float] = {"u": motion, "v_m": motion, "r": motion, **dict.fromkeys(SLOW, slow)}
    process = {name: value * factors.get(name, 1.0) for name, value in settings.process.items()}
    start = {name: value * (slow if name in SLOW else 1.0) for name, value in settings.start.items()}
    return replace(settings, process=process, start=start)

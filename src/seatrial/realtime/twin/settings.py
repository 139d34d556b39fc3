"""What a twin assumes: sensors with their noise, process noise, and which parameters drift."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Any

from ...core.parameters import specs, unknown, values
from ...core.values import dataclass, field, replace
from ...identify import StudyError
from ...identify.filters.augmented import ANTENNA, BIAS, SLOW, WAVES
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
# Standard deviation of a parameter at first, as a share of its value.
_UNCERTAIN = 0.1
ANYWHERE = (0.3, 0.05)
"""Standard deviation of the place of an antenna of which nothing is known, in lengths: forward and to starboard."""
# One that is stated may be off by so much, each way.
_STATED = 0.03


@dataclass(frozen=True)
class Settings:
    """Settings of a twin; everything in SI units and radians.

    Attributes:
        sensors: by name.
        process: random walk of each state, as the standard deviation that it gathers in one second.
        start: standard deviation of each further state at first.
        memory: time constant of each state that returns to zero [s].
        antenna: where the satellite antenna is taken to stand, forward and to starboard of midship [m].
        free: paths of the parameters that may drift.
        settle: time in which the twin raises no alarm [s].
        window: time over which faults are sought [s].
        spacing: time between the onsets that are tried [s].
        false_alarms: false alarms a day that are accepted.
        step: longest Runge-Kutta step [s].
        ranges: bounds of the parameters that drift.
        estimator: "ekf", or "mhe": the extended filter corrected once a second by moving horizon estimation.
        horizon: window of the latter [s].
        placed: whether the place of the antenna is stated; else it is looked for.
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
    antenna: tuple[float, float] = (0.0, 0.0)
    placed: bool = True

    @property
    def more(self) -> tuple[str, ...]:
        """Names of the states beyond those of the ship's model."""
        return tuple(self.start)


def usual(
    ship: Ship, channels: Sequence[str], *, noise: Mapping[str, float] | None = None, free: Sequence[str] = (),
    gyro_bias: bool = True, antenna: tuple[float, float] | None = (0.0, 0.0), estimator: str = EKF,
) -> Settings:  # fmt: skip
    """Settings for a ship, in proportion to its length and speed.

    Args:
        channels: channels of the log; those of a sensor must all be there.
        noise: standard deviation by channel; `NOISE` fills in.
        free: parameters that may drift, or patterns such as hull.*: each walks by a fifth of its value in a day.  A
            share behind it, such as hull.*=0.3, is how uncertain its value is at first; a tenth where none is given.
        gyro_bias: estimate the error of the rate gyro, where there is one and a compass beside it.
        antenna: place of the satellite antenna, forward and to starboard of midship [m]; None is not known: it is
            estimated.
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
    place = antenna or (0.0, 0.0)
    usually = {
        POSITION: Antenna(known["x"], *place), HEADING: Heading(known["psi"]), TURN: Rate(known["r"]),
        SPEED: Log(known["u_w"], channels=("u_w",)), VELOCITY: Track(known["v_north"], *place),
    }  # fmt: skip
    sensors: dict[str, Sensor] = {name: s for name, s in usually.items() if all(c in channels for c in s.channels)}
    if HEADING not in sensors or (POSITION not in sensors and VELOCITY not in sensors):
        raise StudyError(f"{ship.name}: a twin needs heading and position; the log has {', '.join(channels)}")
    spans = {name: (spec.low, spec.high) for name, spec in specs(ship.model).items()}
    uncertain = _freed(ship, free)
    size = {path: abs(float(values(ship.model)[path])) for path in uncertain}
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
    there = ANYWHERE if antenna is None else (_STATED, _STATED)
    start |= {name: share * ship.L_pp for name, share in zip(ANTENNA, there, strict=True)}
    process |= dict.fromkeys(ANTENNA, 0.0)
    start |= {path: uncertain[path] * value for path, value in size.items()}
    process |= {path: 0.2 * value / math.sqrt(_DAY) for path, value in size.items()}
    return Settings(
        sensors, process, start, dict.fromkeys(SLOW, tau), tuple(uncertain), settle=max(120.0, 10.0 * T),
        spacing=min(max(0.25 * T, 1.0), 5.0),
        step=max(0.02 * T, 0.02), ranges={path: spans[path] for path in uncertain}, estimator=estimator, antenna=place,
        placed=antenna is not None,
    )  # fmt: skip


def _freed(ship: Ship, free: Sequence[str]) -> dict[str, float]:
    """Paths of the parameters with their shares of uncertainty; a pattern leaves out those that are 0."""
    known, out = values(ship.model), dict[str, float]()
    for one in free:
        path, equals, text = one.partition("=")
        found = [path] if path in known else [name for name in known if fnmatchcase(name, path) and float(known[name])]
        if not found:
            raise StudyError(f"{ship.name}: {unknown(path, known, 'parameter')}")
        if float(known[found[0]]) == 0.0:
            raise StudyError(f"--free {path}: it is 0, of which no share can drift; give the ship file a value")
        out |= dict.fromkeys(found, _share(one, text) if equals else _UNCERTAIN)
    return out


def _share(given: str, text: str) -> float:
    try:
        share = float(text)
    except ValueError:
        share = math.nan
    if not 0.0 < share <= 1.0:
        raise StudyError(f"--free {given}: '{text}' is not a share above 0 and up to 1, such as hull.R_0=0.1")
    return share


def scaled(settings: Settings, motion: float, slow: float) -> Settings:
    """The same with the random walk of the motion, and with slow forces, times factors."""
    factors: dict[str, float] = {"u": motion, "v_m": motion, "r": motion, **dict.fromkeys(SLOW, slow)}
    process = {name: value * factors.get(name, 1.0) for name, value in settings.process.items()}
    start = {name: value * (slow if name in SLOW else 1.0) for name, value in settings.start.items()}
    return replace(settings, process=process, start=start)


@dataclass(frozen=True)
class Seaway:
    """What waves do that no model of the slow motion has.

    Attributes:
        omega: frequency of their encounter [rad/s]; 0 where none is seen.
        damping: damping ratio of their oscillators, which is half the width of the band by its frequency.
        size: standard deviation of the displacements by `WAVES` [m, rad].
        noise: standard deviation of the sensors that are rougher than stated and are not seen to move with waves.
    """

    omega: float = 0.0
    damping: float = 0.2
    size: Mapping[str, float] = field(default_factory=dict[str, float])
    noise: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def period(self) -> float:
        """Of the encounter [s]; 0 where none is seen."""
        return 2.0 * math.pi / self.omega if self.omega else 0.0


def afloat_in(settings: Settings, sea: Seaway) -> Settings:
    """The same with sensors as rough as the sea makes them, and first-order motion as further states."""
    sensors: dict[str, Any] = dict(settings.sensors)
    sensors |= {name: replace(sensors[name], sd=sd) for name, sd in sea.noise.items()}
    start, process, memory = (dict(one) for one in (settings.start, settings.process, settings.memory))
    for name, sd in sea.size.items():
        rate = WAVES[name]
        start |= {name: sd, rate: sea.omega * sd}
        process |= {name: 0.0, rate: math.sqrt(4.0 * sea.damping * sea.omega**3) * sd}
        memory |= {name: 0.5 / (sea.damping * sea.omega), rate: 1.0 / sea.omega}
    return replace(settings, sensors=sensors, start=start, process=process, memory=memory)


def noisier(settings: Settings, factor: float) -> Settings:
    """The same with the noise of all sensors times a factor."""
    sensors: dict[str, Any] = dict(settings.sensors)
    return replace(settings, sensors={name: replace(one, sd=factor * one.sd) for name, one in sensors.items()})

"""The instruments of a ship together."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.constants import KNOT
from ..core.values import dataclass
from ..models import unit
from ..ships import Ship
from . import Reading, SensorError, Truth
from .instruments import Anemometer, EchoSounder, Feedback, Gnss, Gyro, RateGyro, SpeedLog
from .stream import Errors, Instrument

_DEGREE = math.pi / 180.0


@dataclass(frozen=True)
class Suite:
    """The instruments of a ship, each with its own random sequence from one seed."""

    instruments: tuple[Instrument, ...]

    def fit(self, truth: Truth, ship: str) -> None:
        """Check that the ship has every value that they measure; SensorError: an instrument of one that it lacks."""
        for instrument in self.instruments:
            try:
                instrument.measure(truth)
            except KeyError as error:
                raise SensorError(f"{instrument.kind} of {ship}: {error.args[0]}") from None

    def place(self, kind: type[Gnss | SpeedLog | Anemometer]) -> tuple[float, float]:
        """Where the instrument of a kind stands, forward and to starboard of midship [m]; 0, 0 without one."""
        one = next((one for one in self.instruments if isinstance(one, kind)), None)
        if isinstance(one, Gnss):
            return one.antenna_x, one.antenna_y
        return (0.0, 0.0) if one is None else (one.at_x, one.at_y)

    def start(self, seed: int = 0, ship: int = 0) -> Watch:
        """Start all of them; ships of one seed differ by their number `ship`.  SensorError: a seed below zero."""
        if seed < 0:
            raise SensorError(f"a seed of {seed}; give zero or above")
        return Watch(self, [seed, ship])


class Watch:
    """The running instruments of a ship.

    Attributes:
        suite: their descriptions.
    """

    def __init__(self, suite: Suite, seed: Sequence[int]) -> None:
        self.suite = suite
        seeds = np.random.SeedSequence(seed).generate_state(max(len(suite.instruments), 1))
        self.running = tuple(
            instrument.start(int(own)) for instrument, own in zip(suite.instruments, seeds, strict=False)
        )

    def read(self, t: float, truth: Truth) -> Sequence[Reading]:
        """Readings that are due at time `t` [s]; call once a step."""
        return [one for one in [running.read(t, truth) for running in self.running] if one is not None]

    def reset(self) -> None:
        """Reset all to time 0."""
        for running in self.running:
            running.reset()

    def snapshot(self) -> bytes:
        """Complete state of all."""
        return json.dumps([running.snapshot() for running in self.running]).encode()

    def restore(self, saved: bytes) -> None:
        """Continue from a `snapshot`; SensorError: it is not of these instruments."""
        try:
            states: list[Any] = json.loads(saved)
        except ValueError:
            raise SensorError("not saved instruments; give one of their snapshots") from None
        if len(states) != len(self.running):
            raise SensorError(f"saved state of {len(states)} instruments; there are {len(self.running)}")
        for running, state in zip(self.running, states, strict=True):
            running.restore(state)


def usual(ship: Ship, antenna: tuple[float, float] | None = None) -> Suite:
    """Usual instruments of a merchant ship; every figure is assumed, of the order of makers' statements.

    The anemometer stands 0.4 L aft of midship, the log's transducer 0.3 L ahead, that of the echo sounder in the keel.

    Args:
        antenna: place of the GNSS antenna, forward and to starboard of midship [m]; by default that of the anemometer.
    """
    L = ship.L_pp
    forward, starboard = (-0.4 * L, 0.0) if antenna is None else antenna
    angles = Errors(noise=0.1 * _DEGREE, quantum=0.1 * _DEGREE)
    shown = {name: angles for name in ship.model.controls if unit(name) == "rad"}
    return Suite((
        Gnss(rate=1.0, latency=0.2, antenna_x=forward, antenna_y=starboard,
             position=Errors(noise=0.5, walk=0.05, memory=600.0), velocity=Errors(noise=0.05),
             speed_quantum=0.1 * KNOT, course_quantum=0.1 * _DEGREE),
        Gyro(rate=10.0, latency=0.05, heading=Errors(noise=0.05 * _DEGREE, quantum=0.1 * _DEGREE)),
        RateGyro(rate=10.0, latency=0.05, rate_of_turn=Errors(noise=0.01 * _DEGREE)),
        SpeedLog(rate=1.0, latency=0.1, at_x=0.3 * L, water=Errors(noise=0.03, quantum=0.1 * KNOT)),
        Anemometer(rate=1.0, latency=0.1, at_x=-0.4 * L, wind=Errors(noise=0.3), motion=Errors(noise=0.05),
                   speed_quantum=0.1, direction_quantum=_DEGREE),
        EchoSounder(rate=1.0, latency=0.1, draught=draught(ship), reach=200.0,
                    depth=Errors(noise=0.05, quantum=0.1)),
        Feedback(rate=5.0, latency=0.05, controls=ship.model.controls, of=shown),
    ))  # fmt: skip


def draught(ship: Ship) -> float:
    """Draught of a ship [m]; 0 where its file has none."""
    return float(ship.model.draught)

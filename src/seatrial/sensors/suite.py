"""All the instruments of a ship together."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..models import unit
from ..ships import Ship
from . import Reading, SensorError, Truth
from .instruments import Anemometer, EchoSounder, Feedback, Gnss, Gyro, RateGyro, SpeedLog
from .stream import Errors, Instrument

_DEGREE, _KNOT = math.pi / 180.0, 1852.0 / 3600.0


@dataclass(frozen=True)
class Suite:
    """The instruments of a ship, each a random sequence of its own out of one seed."""

    instruments: tuple[Instrument, ...]

    def fit(self, truth: Truth, ship: str) -> None:
        """See that all of them find aboard what they measure.

        Raises:
            SensorError: an instrument of what this ship does not have; names both.
        """
        for instrument in self.instruments:
            try:
                instrument.measure(truth)
            except KeyError as error:
                raise SensorError(f"{instrument.kind} of {ship}: {error.args[0]}") from None

    def start(self, seed: int = 0, ship: int = 0) -> Watch:
        """All of them at work; ships of one seed tell each their own by number.

        Raises:
            SensorError: a seed below zero.
        """
        if seed < 0:
            raise SensorError(f"a seed of {seed}; give zero or above")
        return Watch(self, [seed, ship])


class Watch:
    """The instruments of a ship at work.

    Attributes:
        suite: what they are.
    """

    def __init__(self, suite: Suite, seed: Sequence[int]) -> None:
        self.suite = suite
        seeds = np.random.SeedSequence(seed).generate_state(max(len(suite.instruments), 1))
        self.running = tuple(
            instrument.start(int(own)) for instrument, own in zip(suite.instruments, seeds, strict=False)
        )

    def read(self, t: float, truth: Truth) -> Sequence[Reading]:
        """What they say at time `t` [s]; ask once a step."""
        return [said for said in [running.read(t, truth) for running in self.running] if said is not None]

    def reset(self) -> None:
        """All back to time 0."""
        for running in self.running:
            running.reset()

    def snapshot(self) -> bytes:
        """All that decides what they say from here on."""
        return json.dumps([running.snapshot() for running in self.running]).encode()

    def restore(self, saved: bytes) -> None:
        """Go on from what `snapshot` gave.

        Raises:
            SensorError: not of these instruments.
        """
        try:
            states: list[Any] = json.loads(saved)
        except ValueError:
            raise SensorError("not saved instruments; give what their snapshot gave") from None
        if len(states) != len(self.running):
            raise SensorError(f"saved state of {len(states)} instruments; there are {len(self.running)}")
        for running, state in zip(self.running, states, strict=True):
            running.restore(state)


def usual(ship: Ship, antenna: tuple[float, float] | None = None) -> Suite:
    """What a merchant ship of today carries; every figure is assumed, of the order that makers state.

    The anemometer stands 0.4 L aft of midship, the log's transducer 0.3 L ahead, that of the echo sounder in the keel.

    Args:
        antenna: where the GNSS antenna stands, forward and to starboard of midship [m]; by default by the anemometer.
    """
    L = ship.L_pp
    forward, starboard = (-0.4 * L, 0.0) if antenna is None else antenna
    angles = Errors(noise=0.1 * _DEGREE, quantum=0.1 * _DEGREE)
    shown = {name: angles for name in ship.model.controls if unit(name) == "rad"}
    return Suite((
        Gnss(rate=1.0, latency=0.2, antenna_x=forward, antenna_y=starboard,
             position=Errors(noise=0.5, walk=0.05, memory=600.0), velocity=Errors(noise=0.05),
             speed_quantum=0.1 * _KNOT, course_quantum=0.1 * _DEGREE),
        Gyro(rate=10.0, latency=0.05, heading=Errors(noise=0.05 * _DEGREE, quantum=0.1 * _DEGREE)),
        RateGyro(rate=10.0, latency=0.05, rate_of_turn=Errors(noise=0.01 * _DEGREE)),
        SpeedLog(rate=1.0, latency=0.1, at_x=0.3 * L, water=Errors(noise=0.03, quantum=0.1 * _KNOT)),
        Anemometer(rate=1.0, latency=0.1, at_x=-0.4 * L, wind=Errors(noise=0.3), motion=Errors(noise=0.05),
                   speed_quantum=0.1, direction_quantum=_DEGREE),
        EchoSounder(rate=1.0, latency=0.1, draught=draught(ship), reach=200.0,
                    depth=Errors(noise=0.05, quantum=0.1)),
        Feedback(rate=5.0, latency=0.05, controls=ship.model.controls, of=shown),
    ))  # fmt: skip


def draught(ship: Ship) -> float:
    """Draught of a ship [m]; 0 where her file has none."""
    return float(ship.model.draught)

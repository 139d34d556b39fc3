"""Instruments of a ship on the wire: which sentences each of them sends, and how often."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any

from ..data.nmea.ship import Fittings, Measured
from ..sensors import Reading
from ..sensors.instruments import Anemometer, EchoSounder, Feedback, Gnss, Gyro, RateGyro, SpeedLog
from ..sensors.stream import EXACT, Instrument
from ..sensors.suite import Suite

RATES: Mapping[str, float] = MappingProxyType({
    "HDT": 10.0, "THS": 10.0, "ROT": 10.0, "RSA": 5.0, "VBW": 5.0, "RMC": 5.0, "GGA": 1.0, "VTG": 1.0, "ZDA": 1.0,
    "RPM": 1.0, "MWV": 1.0, "DPT": 1.0,
})  # fmt: skip
"""Greatest rate of each sentence [Hz of simulated time]; never above the sample rate of its instrument."""

TRANSPONDER, TRANSPONDER_RATE = "VDO", 0.5
"""AIS sentence of the own ship and its rate [Hz]; sent only on request."""

_FED: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "gnss": ("ZDA", "GGA", "RMC", "VTG", TRANSPONDER), "gyro": ("HDT", "THS"), "rate_gyro": ("ROT",),
    "speed_log": ("VBW",), "anemometer": ("MWV",), "echo_sounder": ("DPT",), "feedback": ("RSA", "RPM"),
})  # fmt: skip
"""Sentences of each kind of instrument; the transponder adds the last readings of gyro and rate gyro."""

_FROM = MappingProxyType({kind: instrument for instrument, kinds in _FED.items() for kind in kinds})
_STATIC = 360.0
"""Time between two reports of static data by the transponder [s] (ITU-R M.1371); the first is sent at once."""

_TOGETHER = ("latitude", "chi", "psi", "r")
_SLACK = 1e-6


def exact(controls: Sequence[str], fittings: Fittings, rate: float) -> Suite:
    """Ideal instruments with sample rate `rate` [Hz], at the positions of the fittings."""
    forward, starboard = fittings.antenna
    return Suite((
        Gnss(rate=rate, antenna_x=forward, antenna_y=starboard), Gyro(rate=rate), RateGyro(rate=rate),
        SpeedLog(rate=rate, at_x=fittings.log, stern_x=fittings.stern, ground=EXACT), Anemometer(rate=rate),
        EchoSounder(rate=rate, draught=fittings.transducer), Feedback(rate=rate, controls=tuple(controls)),
    ))  # fmt: skip


def told(reading: Reading, fittings: Fittings) -> dict[str, float]:
    """Values of a reading and its time, by the names of `data.nmea.ship.Measured`."""
    said = {**reading.values, "t": reading.t}
    if reading.kind == "gnss":
        said["latitude"], said["longitude"] = fittings.datum.place(said.pop("x"), said.pop("y"))
    return said


def unsaid(kind: str, suite: Suite, fittings: Fittings) -> str:
    """Why these instruments cannot provide a sentence; empty if they can."""
    present = {instrument.kind for instrument in suite.instruments}
    needed = (_FROM[kind], "gyro", "rate_gyro") if kind == TRANSPONDER else (_FROM[kind],)
    missing = [name for name in needed if name not in present]
    if missing:
        return f"the ship has no {' and no '.join(missing).replace('_', ' ')}"
    if kind == TRANSPONDER and not 0 < fittings.mmsi <= 999_999_999:
        return "the transponder has no MMSI; give nine digits, on the command line by --mmsi"
    if kind == TRANSPONDER and find_spec("pyais") is None:
        return "it needs the extra 'nmea': pip install 'seatrial[nmea]'"
    things = {"RSA": ("rudder", fittings.rudders), "RPM": ("shaft", fittings.shafts)}.get(kind)
    if things is not None and not set(things[1]) & set(_shown(suite.instruments)):
        return f"the ship has no {things[0]} with feedback"
    return ""


def steers(suite: Suite) -> bool:
    """Whether the instruments include those that a steering control needs."""
    return {"gyro", "rate_gyro"} <= {instrument.kind for instrument in suite.instruments}


class Voice:
    """Selects the sentences that are due at each reading, each at its own rate.

    Attributes:
        latest: last value of each quantity, by the names of `data.nmea.ship.Measured`.
    """

    def __init__(self, fittings: Fittings, rates: Mapping[str, float], t: float) -> None:
        """Start at time `t` [s]."""
        self._fittings, self._rates = fittings, rates
        self.latest: dict[str, float] = {}
        self._said = {kind: _number(t, rate) for kind, rate in rates.items()}
        self._static = -1

    def take(self, reading: Reading) -> Iterator[tuple[str, Measured]]:
        """Kinds of sentences that are due at a reading, with their values."""
        said = told(reading, self._fittings)
        self.latest.update(said)
        for kind in _FED.get(reading.kind, ()):
            if kind not in self._rates:
                continue
            number = _number(reading.t, self._rates[kind])
            if number <= self._said[kind]:
                continue
            if kind != TRANSPONDER:
                self._said[kind] = number
                yield kind, said
            elif all(name in self.latest for name in _TOGETHER):
                self._said[kind] = number
                yield kind, {**self.latest, **self._about(reading.t), "t": reading.t}

    def _about(self, t: float) -> dict[str, float]:
        """{"static": 1.0} where static data are due, else empty."""
        number = math.floor(t / _STATIC)
        due, self._static = number != self._static, number
        return {"static": 1.0} if due else {}

    def snapshot(self) -> dict[str, Any]:
        """State of the sentence schedule, for JSON."""
        return {"latest": dict(self.latest), "said": dict(self._said), "static": self._static}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Restore the result of `snapshot`; sentences that it does not contain restart."""
        self.reset()
        self.latest = {str(name): float(value) for name, value in saved["latest"].items()}
        self._static = int(saved["static"])
        self._said |= {kind: int(number) for kind, number in saved["said"].items() if kind in self._said}

    def reset(self) -> None:
        """Return to time 0."""
        self.latest, self._static = {}, -1
        self._said = dict.fromkeys(self._said, 0)


def _number(t: float, rate: float) -> int:
    """Sequence number at a rate [Hz] of the sentence to which a reading of time `t` [s] belongs."""
    return math.floor(t * rate + _SLACK)


def _shown(instruments: tuple[Instrument, ...]) -> list[str]:
    return [name for one in instruments if isinstance(one, Feedback) for name in one.controls]

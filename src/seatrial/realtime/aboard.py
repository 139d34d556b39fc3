"""What a ship on the wire has aboard to speak with: her instruments, and which sentence tells what, and how often."""

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
"""Sentences and how often they are sent at most [Hz of simulated time]; no more than the instrument reads."""

TRANSPONDER, TRANSPONDER_RATE = "VDO", 0.5
"""What is sent only where it is asked for, as other ships' sentences of that kind are no news to her."""

_FED: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "gnss": ("ZDA", "GGA", "RMC", "VTG", TRANSPONDER), "gyro": ("HDT", "THS"), "rate_gyro": ("ROT",),
    "speed_log": ("VBW",), "anemometer": ("MWV",), "echo_sounder": ("DPT",), "feedback": ("RSA", "RPM"),
})  # fmt: skip
"""Sentences that each kind of instrument sends; the transponder adds what gyro and rate gyro said last."""

_FROM = MappingProxyType({kind: instrument for instrument, kinds in _FED.items() for kind in kinds})
_STATIC = 360.0
"""Time between two reports of static data by the transponder [s] (ITU-R M.1371); the first comes at once."""

_TOGETHER = ("latitude", "chi", "psi", "r")
_SLACK = 1e-6


def exact(controls: Sequence[str], fittings: Fittings, rate: float) -> Suite:
    """Instruments without a fault that read `rate` times a second, where the fittings say that they are."""
    forward, starboard = fittings.antenna
    return Suite((
        Gnss(rate=rate, antenna_x=forward, antenna_y=starboard), Gyro(rate=rate), RateGyro(rate=rate),
        SpeedLog(rate=rate, at_x=fittings.log, stern_x=fittings.stern, ground=EXACT), Anemometer(rate=rate),
        EchoSounder(rate=rate, draught=fittings.transducer), Feedback(rate=rate, controls=tuple(controls)),
    ))  # fmt: skip


def told(reading: Reading, fittings: Fittings) -> dict[str, float]:
    """What an instrument says, by the names of `nmea.ship.Measured`; at its time."""
    said = {**reading.values, "t": reading.t}
    if reading.kind == "gnss":
        said["latitude"], said["longitude"] = fittings.datum.place(said.pop("x"), said.pop("y"))
    return said


def unsaid(kind: str, suite: Suite, fittings: Fittings) -> str:
    """Why a sentence cannot be said by these instruments; empty where it can."""
    present = {instrument.kind for instrument in suite.instruments}
    needed = (_FROM[kind], "gyro", "rate_gyro") if kind == TRANSPONDER else (_FROM[kind],)
    missing = [name for name in needed if name not in present]
    if missing:
        return f"she has no {' and no '.join(missing).replace('_', ' ')}"
    if kind == TRANSPONDER and not 0 < fittings.mmsi <= 999_999_999:
        return "the transponder has no MMSI; give one of nine digits, on the command line by --mmsi"
    if kind == TRANSPONDER and find_spec("pyais") is None:
        return "it needs the extra 'nmea': pip install 'seatrial[nmea]'"
    things = {"RSA": ("rudder", fittings.rudders), "RPM": ("shaft", fittings.shafts)}.get(kind)
    if things is not None and not set(things[1]) & set(_shown(suite.instruments)):
        return f"she has no {things[0]} that is shown"
    return ""


def steers(suite: Suite) -> bool:
    """Whether a steering control finds what it steers by."""
    return {"gyro", "rate_gyro"} <= {instrument.kind for instrument in suite.instruments}


class Voice:
    """Which readings go into which sentences, each at its own rate.

    Attributes:
        latest: what the instruments said last, by the names of `nmea.ship.Measured`.
    """

    def __init__(self, fittings: Fittings, rates: Mapping[str, float], t: float) -> None:
        """One that speaks from time `t` [s] on."""
        self._fittings, self._rates = fittings, rates
        self.latest: dict[str, float] = {}
        self._said = {kind: _number(t, rate) for kind, rate in rates.items()}
        self._static = -1

    def take(self, reading: Reading) -> Iterator[tuple[str, Measured]]:
        """Kinds of sentences that are due at a reading, and what they are to say."""
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
        """Whether static data are due."""
        number = math.floor(t / _STATIC)
        due, self._static = number != self._static, number
        return {"static": 1.0} if due else {}

    def snapshot(self) -> dict[str, Any]:
        """All that decides what is said from here on, for JSON."""
        return {"latest": dict(self.latest), "said": dict(self._said), "static": self._static}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on from what `snapshot` gave; sentences that it does not know begin anew."""
        self.reset()
        self.latest = {str(name): float(value) for name, value in saved["latest"].items()}
        self._static = int(saved["static"])
        self._said |= {kind: int(number) for kind, number in saved["said"].items() if kind in self._said}

    def reset(self) -> None:
        """Back to time 0."""
        self.latest, self._static = {}, -1
        self._said = dict.fromkeys(self._said, 0)


def _number(t: float, rate: float) -> int:
    """Number of the sentence at a rate [Hz] that a reading of time `t` [s] belongs to."""
    return math.floor(t * rate + _SLACK)


def _shown(instruments: tuple[Instrument, ...]) -> list[str]:
    return [name for one in instruments if isinstance(one, Feedback) for name in one.controls]

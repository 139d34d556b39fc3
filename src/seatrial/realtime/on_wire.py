"""A ship of a loop on the wire: her instruments talk in sentences, and she obeys sentences."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import BinaryIO

from ..data.nmea import NmeaError
from ..data.nmea_framing import LARGEST, TOKEN, Tag, tag_block
from ..data.nmea_ship import SPOKEN, Fittings, Measured, Truth, lines, measured
from ..parameters import unknown
from ..sensors import Reading
from ..ships import Ship
from .conning import Conning, rudders, shafts
from .loop import Loop
from .wire import Wire, WireError

RATES: Mapping[str, float] = MappingProxyType({
    "HDT": 10.0, "THS": 10.0, "ROT": 10.0, "RSA": 5.0, "VBW": 5.0, "RMC": 5.0, "GGA": 1.0, "VTG": 1.0, "ZDA": 1.0,
    "RPM": 1.0, "MWV": 1.0, "DPT": 1.0,
})  # fmt: skip
"""Sentences and how often they are sent [Hz of simulated time]."""

FED: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "gnss": ("ZDA", "GGA", "RMC", "VTG"), "gyro": ("HDT", "THS"), "rate_gyro": ("ROT",), "speed_log": ("VBW",),
    "anemometer": ("MWV",), "feedback": ("RSA", "RPM"),
})  # fmt: skip
"""Sentences that each kind of instrument sends."""


def fitted(ship: Ship, fittings: Fittings) -> Fittings:
    """The same fittings with the rudders and shafts of this ship."""
    return replace(fittings, rudders=rudders(ship), shafts=shafts(ship))


def told(reading: Reading, fittings: Fittings) -> dict[str, float]:
    """What an instrument says, by the names of `nmea_ship.Measured`; at its time."""
    said = {**reading.values, "t": reading.t}
    if reading.kind == "gnss":
        said["latitude"], said["longitude"] = fittings.datum.place(said.pop("x"), said.pop("y"))
    return said


@dataclass(frozen=True)
class Speech:
    """How a ship talks.

    Attributes:
        fittings: where her instruments are.
        rates: sentences, and how often each is sent [Hz]; where the loop has sensors, these say how often.
        framed: whether in datagrams of IEC 61162-450; plain lines otherwise.
        source: who talks, for the TAG blocks.
    """

    fittings: Fittings
    rates: Mapping[str, float] = field(default_factory=lambda: RATES)
    framed: bool = False
    source: str = "II0001"

    def __post_init__(self) -> None:
        for kind, rate in self.rates.items():
            if kind not in SPOKEN and kind != "VDO":
                raise WireError(unknown(kind, (*SPOKEN, "VDO"), "sentence"))
            if not rate > 0.0:
                raise WireError(f"{kind}: a rate of {rate:g} Hz; it must be above zero")


class OnWire:
    """One ship, her wire, and who steers her through it.

    Attributes:
        conning: who has command, and how she is steered.
        wire: what she listens and talks through.
    """

    def __init__(
        self, loop: Loop, ship: str, wire: Wire, speech: Speech, *, log: BinaryIO | None = None, hold: float = 10.0
    ) -> None:
        """Take a ship of a loop to the wire, from the next tick on.

        Args:
            loop: the loop.
            ship: her name in it.
            wire: an open wire; whoever opened it closes it.
            speech: how she talks.
            log: file for what she says, each sentence behind a TAG block with its time.
            hold: how long a commander may be silent [simulated s].
        """
        self._vessel, self._name = loop.vessels[ship], ship
        self.wire, self._log = wire, log
        fittings = fitted(self._vessel.plant.ship, speech.fittings)
        self._speech = Speech(fittings, speech.rates, speech.framed, speech.source)
        self._every = {kind: max(round(loop.rate / rate), 1) for kind, rate in speech.rates.items()}
        self.conning = Conning(self._vessel.plant.ship, fittings, hold)
        self._number, self._was_stale, self._commander = 0, False, ""
        loop.after(self.tick)

    def tick(self, loop: Loop) -> None:
        """Listen, steer, talk; once after each tick of the loop."""
        plant, conning = self._vessel.plant, self.conning
        for message in self.wire.poll():
            for control, value in conning.take(message.sentence, message.sender, loop.t).items():
                loop.order(self._name, control, value)
        for control, value in conning.steered(plant["psi"], plant["r"], loop.t, 1.0 / loop.rate).items():
            loop.order(self._name, control, value)
        self._report(loop)
        if self._vessel.failure is None:
            self._talk(loop)

    def _report(self, loop: Loop) -> None:
        """Tell who has command, and when it fell silent."""
        conning = self.conning
        if conning.commander != self._commander:
            loop.tell(self._name, "command", f"{conning.commander} has command")
            self._commander = conning.commander
        if conning.stale and not self._was_stale:
            loop.tell(self._name, "stale", f"no order for {conning.hold:g} s; the last ones are held")
        self._was_stale = conning.stale

    def _talk(self, loop: Loop) -> None:
        spoken = [line for kind, said in self._due(loop) for line in self._lines(kind, said)]
        self._keep(loop, spoken)
        for data in self._packed(spoken):
            self.wire.send(data)

    def _due(self, loop: Loop) -> Iterator[tuple[str, Measured]]:
        """Kinds of sentences that are due, and what they are to say."""
        if self._vessel.watch is not None:
            for reading in self._vessel.readings:
                said = told(reading, self._speech.fittings)
                yield from ((kind, said) for kind in FED.get(reading.kind, ()) if kind in self._speech.rates)
            return
        truth: Truth = self._vessel.plant
        kinds = [kind for kind, every in self._every.items() if loop.k % every == 0]
        if kinds:
            said = measured(self._speech.fittings, loop.t, truth)
            yield from ((kind, said) for kind in kinds)

    def _lines(self, kind: str, said: Measured) -> Iterator[tuple[bytes, float]]:
        fittings = self._speech.fittings
        try:
            for line in lines(kind, fittings, said):
                yield line, fittings.epoch + said["t"]
        except NmeaError:  # a value that no sentence has room for, such as 1000 kn of a ship that blows up
            self.wire.counts["unsaid"] += 1

    def _keep(self, loop: Loop, spoken: Iterable[tuple[bytes, float]]) -> None:
        if self._log is None:
            return
        try:
            for line, time in spoken:
                self._log.write(tag_block(Tag(self._speech.source, None, time)) + line)
        except OSError as error:
            self._log = None
            loop.tell(self._name, "dropped", f"the log of sentences ends here: {error.strerror}")

    def _packed(self, spoken: Iterable[tuple[bytes, float]]) -> Iterator[bytes]:
        """As few datagrams as they fit in."""
        head = TOKEN if self._speech.framed else b""
        data = head
        for line, time in spoken:
            part = line
            if self._speech.framed:
                part = tag_block(Tag(self._speech.source, self._number, time)) + line
                self._number = (self._number + 1) % 1000
            if len(data) + len(part) > LARGEST:
                yield data
                data = head
            data += part
        if len(data) > len(head):
            yield data

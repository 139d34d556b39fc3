"""A ship of a loop behind NMEA 0183: what its instruments send and how often, what it obeys."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any, BinaryIO, Literal

from ..core.errors import RunError
from ..core.parameters import unknown
from ..core.values import dataclass, replace
from ..data.nmea.framing import LARGEST, TOKEN, Tag, tag_block
from ..data.nmea.sentences import NmeaError
from ..data.nmea.ship import SPOKEN, Fittings, Measured, lines
from ..sensors import Reading
from ..sensors.instruments import Anemometer, EchoSounder, Feedback, Gnss, Gyro, RateGyro, SpeedLog
from ..sensors.stream import EXACT
from ..sensors.suite import Suite
from ..ships import Ship
from .conning import Conning, rudders, shafts
from .loop import Loop
from .wire import ANYBODY, Authority, Line, Message, WireError

RATES: Mapping[str, float] = MappingProxyType({
    "HDT": 10.0, "THS": 10.0, "ROT": 10.0, "RSA": 5.0, "VBW": 5.0, "RMC": 5.0, "GGA": 1.0, "GLL": 1.0, "VTG": 1.0,
    "ZDA": 1.0, "HDG": 5.0, "VHW": 1.0, "RPM": 1.0, "MWV": 1.0, "DPT": 1.0,
})  # fmt: skip
"""Greatest rate of each sentence [Hz of simulated time]; never above the sample rate of its instrument."""

TRANSPONDER, TRANSPONDER_RATE = "VDO", 0.5
"""AIS sentence of the own ship and its rate [Hz]; sent only on request."""

_FED: Mapping[str, tuple[str, ...]] = MappingProxyType({
    "gnss": ("ZDA", "GGA", "RMC", "VTG", "GLL", TRANSPONDER), "gyro": ("HDT", "THS", "HDG"), "rate_gyro": ("ROT",),
    "speed_log": ("VBW", "VHW"), "anemometer": ("MWV",), "echo_sounder": ("DPT",), "feedback": ("RSA", "RPM"),
})  # fmt: skip
"""Sentences of each kind of instrument; the transponder adds the last readings of gyro and rate gyro."""

_FROM = MappingProxyType({kind: instrument for instrument, kinds in _FED.items() for kind in kinds})
_STATIC = 360.0
"""Time between two reports of static data by the transponder [s] (ITU-R M.1371); the first is sent at once."""

_HELD = 500
"""Largest number of sentences of other sources that wait for a tick; older ones are dropped."""

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
    if kind == "HDG" and fittings.variation is None:
        return "the ship has no magnetic compass; give the variation"
    if kind == TRANSPONDER and find_spec("pyais") is None:
        return "it needs the extra 'nmea': pip install 'seatrial[nmea]'"
    shown = {name for one in suite.instruments if isinstance(one, Feedback) for name in one.controls}
    for report, thing, names in (("RSA", "rudder", fittings.rudders), ("RPM", "shaft", fittings.shafts)):
        if kind == report and not shown.intersection(names):
            return f"the ship has no {thing} with feedback"
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
            number = _number(reading.t, self._rates[kind]) if kind in self._rates else -1
            if number <= self._said.get(kind, -1):
                continue
            if kind != TRANSPONDER:
                self._said[kind] = number
                yield kind, {**self.latest, **said} if kind == "VHW" else said
            elif all(name in self.latest for name in _TOGETHER):
                self._said[kind] = number
                before, self._static = self._static, math.floor(reading.t / _STATIC)
                static = {} if self._static == before else {"static": 1.0}
                yield kind, {**self.latest, **static, "t": reading.t}

    def snapshot(self) -> dict[str, Any]:
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


def fitted(ship: Ship, fittings: Fittings) -> Fittings:
    """The fittings with rudders, shafts, name and size of a ship."""
    return replace(
        fittings, rudders=rudders(ship), shafts=shafts(ship), name=ship.name, length=ship.L_pp,
        breadth=float(ship.model.breadth), draught=float(ship.model.draught),
    )  # fmt: skip


@dataclass(frozen=True)
class Speech:
    """Format and rates of the sentences that a ship sends.

    Attributes:
        fittings: datum, and the positions of ideal instruments; others know their own.
        rates: sentences and the rate of each [Hz], never above the sample rate of its instrument; by default all of
            `RATES` that the instruments can provide, and VDO where the fittings have an MMSI.
        framed: whether to send datagrams of IEC 61162-450 instead of plain lines.
        source: source identifier in the TAG blocks.
    """

    fittings: Fittings
    rates: Mapping[str, float] | None = None
    framed: bool = False
    source: str = "II0001"

    def __post_init__(self) -> None:
        for kind, rate in (self.rates or {}).items():
            if kind not in SPOKEN and kind != TRANSPONDER:
                raise WireError(unknown(kind, (*SPOKEN, TRANSPONDER), "sentence"))
            if not rate > 0.0:
                raise WireError(f"{kind}: a rate of {rate:g} Hz; it must be above zero")


class OnWire:
    """One ship with its wire and its commander; saved, restored and reset with the loop.

    Attributes:
        conning: commander and steering mode.
        wire: the connection.
        fittings: datum, positions of instruments, rudders and shafts.
        authority: senders that may have command.
        speakers: called after each tick for lines of other sources, which go out before the ship's own.
        sends: kinds of the ship's own sentences.
        said: those of the last tick.
        asked: orders of links of other kinds so far, obeyed or refused.
        listeners: called with each valid sentence, whoever has command.
        log: file for the sentences sent, each with a TAG block that has its time; None: no log.
    """

    def __init__(
        self, loop: Loop, ship: str, wire: Line, speech: Speech, *, log: BinaryIO | None = None, hold: float = 10.0,
        authority: Authority = ANYBODY, ticking: bool = True,
    ) -> None:  # fmt: skip
        """Connect a ship of a loop to a wire, from the next tick on.

        A ship without instruments gets ideal ones that are sampled once a tick.

        Args:
            loop: the loop.
            ship: name of the ship in it.
            wire: an open line, which the caller closes.
            speech: format and rates of the sentences.
            log: as the attribute.
            hold: longest silence of a commander [simulated s].
            authority: senders that may have command.
            ticking: whether to call `tick` after each tick from now on; else the caller sees to that.

        Raises:
            WireError: a requested sentence that the instruments cannot provide.
        """
        vessel = self._vessel = loop.vessels[ship]
        self.authority = authority
        self._name, self.wire, self.log, self._speech = ship, wire, log, speech
        fittings = self.fittings = fitted(vessel.plant.ship, speech.fittings)
        plant = vessel.plant
        suite = exact(plant.controls, fittings, loop.rate) if vessel.watch is None else vessel.watch.suite
        rates = speech.rates
        if rates is None:
            known = {**RATES, TRANSPONDER: TRANSPONDER_RATE} if fittings.mmsi else RATES
            rates = {kind: rate for kind, rate in known.items() if not unsaid(kind, suite, fittings)}
        for kind in rates:
            if why := unsaid(kind, suite, fittings):
                raise WireError(f"{kind} cannot be sent: {why}")
        if vessel.watch is None:
            loop.equip(ship, suite)
        self._voice, self.sends = Voice(fittings, rates, loop.t), frozenset(rates)
        self.conning = Conning(plant.ship, fittings, hold, steers=steers(suite), authority=authority)
        self._number, self._was_stale, self._commander = 0, False, ""
        self._line = (0, 0)
        self.speakers: list[Callable[[Loop], Iterable[bytes]]] = []
        self.listeners: list[Callable[[Message, Loop], None]] = []
        self._early: deque[Message] = deque(maxlen=_HELD)
        self.said: frozenset[str] = frozenset()
        self.asked = 0
        if ticking:
            loop.after(self.tick)
        loop.keep(f"the wire of {ship}", self)

    def tick(self, loop: Loop) -> None:
        """Receive, steer and send, once after each tick; a ship that blew up does nothing until it is restored."""
        self.wire.t = loop.t
        early = [self._early.popleft() for _ in range(len(self._early))]
        heard = [*early, *self.wire.poll()]
        if self._vessel.failure is not None:
            return
        for message in heard:
            for listen in self.listeners:
                listen(message, loop)
            for control, value in self.conning.take(message.sentence, message.sender, loop.t).items():
                loop.order(self._name, control, value)
        due = [one for reading in self._vessel.readings for one in self._voice.take(reading)]
        self._steer(loop)
        self._report(loop)
        self.said = frozenset(kind for kind, _ in due)
        due.sort(key=lambda one: one[0] == "ZDA")  # the time comes last: who has it has all of this tick
        now = self.fittings.epoch + loop.t
        others = [(line, now) for speak in self.speakers for line in speak(loop)]
        self._send(loop, [*others, *(line for kind, said in due for line in self._lines(kind, said))])

    def hold(self, messages: Iterable[Message]) -> None:
        """Keep sentences of another source for the next tick; from any thread."""
        self._early.extend(messages)

    @property
    def latest(self) -> Mapping[str, float]:
        """Last value of each instrument, by the names of `data.nmea.ship.Measured`."""
        return self._voice.latest

    def say(self, loop: Loop, lines: Iterable[bytes]) -> None:
        """Send sentences of another source with the present time."""
        self._send(loop, [(line, self.fittings.epoch + loop.t) for line in lines])

    def snapshot(self) -> dict[str, Any]:
        return {"conning": self.conning.snapshot(), "voice": self._voice.snapshot(), "number": self._number,
                "commander": self._commander, "stale": self._was_stale}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        self.conning.restore(saved["conning"])
        self._voice.restore(saved["voice"])
        self._number, self._commander, self._was_stale = saved["number"], saved["commander"], saved["stale"]

    def reset(self) -> None:
        """Remove the commander and restart the sentences."""
        self.conning.reset()
        self._voice.reset()
        self._number, self._was_stale, self._commander = 0, False, ""

    def _steer(self, loop: Loop) -> None:
        """Apply the ship's own steering control, once gyro and rate gyro have been read."""
        latest = self._voice.latest
        if "psi" in latest and "r" in latest:
            for control, value in self.conning.steered(latest["psi"], latest["r"], loop.t, 1.0 / loop.rate).items():
                loop.order(self._name, control, value)
        else:
            self.conning.watch(loop.t)

    def _report(self, loop: Loop) -> None:
        """Record a change of the commander, its silence, and a line that is lost or back."""
        conning, counts = self.conning, self.wire.counts
        if (line := (counts["lost"], counts["reopened"])) != self._line:
            state = "is lost and tried again" if line[0] > line[1] else "is back"
            loop.tell(self._name, "line", f"{self.wire.address} {state}; {counts['unsent']} sentences not sent so far")
            self._line = line
        if conning.commander != self._commander:
            loop.tell(self._name, "command", f"{conning.commander} has command")
            self._commander = conning.commander
        if conning.stale and not self._was_stale:
            loop.tell(self._name, "stale", f"nothing received for {conning.hold:g} s; the last orders hold")
        self._was_stale = conning.stale

    def _send(self, loop: Loop, spoken: Sequence[tuple[bytes, float]]) -> None:
        self._keep(loop, spoken)
        for data in self._packed(spoken):
            self.wire.send(data)

    def _lines(self, kind: str, said: Measured) -> Iterator[tuple[bytes, float]]:
        fittings = self.fittings
        try:
            for line in lines(kind, fittings, said):
                yield line, fittings.epoch + said["t"]
        except NmeaError:  # a value that does not fit in a sentence, such as 1000 kn of a ship that blows up
            self.wire.counts["unsaid"] += 1

    def _keep(self, loop: Loop, spoken: Iterable[tuple[bytes, float]]) -> None:
        if self.log is None:
            return
        try:
            for line, sent in spoken:
                self.log.write(tag_block(Tag(self._speech.source, None, sent)) + line)
        except OSError as error:
            self.log = None
            loop.tell(self._name, "dropped", f"the log of sentences ends here: {error.strerror}")

    def _packed(self, spoken: Iterable[tuple[bytes, float]]) -> Iterator[bytes]:
        """The sentences in as few datagrams as possible."""
        head = TOKEN if self._speech.framed else b""
        data = head
        for line, sent in spoken:
            part = line
            if self._speech.framed:
                part = tag_block(Tag(self._speech.source, self._number, sent)) + line
                self._number = (self._number + 1) % 1000
            if len(data) + len(part) > LARGEST:
                yield data
                data = head
            data += part
        if len(data) > len(head):
            yield data


FIRST = 200_000_001
"""MMSI of the first other ship; no country has the digits 200, so it is never the MMSI of a real ship."""


Answers = Literal["wire", "link", "clock"]
"""What answers in lock step."""

_LOOK = 0.002
"""Wait between two looks for an order of a link [s of the clock]."""


class Lockstep:
    """Lock step with an autopilot: waits in the loop for an answer to each sentence of one kind.

    That is ZDA unless another is named: it is the last of its tick, so whoever has it has all.  Where each answer is
    one datagram or one order, the order of everything is that of the simulated time, whatever the machines are doing:
    the run is the same each time, and as fast as the autopilot answers.

    Attributes:
        failure: why it gave up; empty while it did not.
        answers: answers so far.
        waited: time for which it has waited [s of the clock].
        alive: whether an answer can still come.
    """

    def __init__(
        self, loop: Loop, on_wire: OnWire, to: str = "ZDA", patience: float = 10.0, by: Answers = "wire"
    ) -> None:  # fmt: skip
        """Wait after each tick in which a sentence `to` is sent, at most `patience` seconds of the clock.

        Args:
            by: what answers: a sentence on the wire, an order of a link of another kind, or nothing where another
                clock keeps the step; the first meeting is on the wire whichever it is.

        Raises:
            WireError: the ship sends no such sentence, so that nothing would be waited for.
        """
        if to not in on_wire.sends:
            raise WireError(f"the ship waits for an answer to each {to}, which it does not send; it sends "
                            f"{', '.join(sorted(on_wire.sends))}")  # fmt: skip
        self._on_wire, self._to, self._patience = on_wire, to, patience
        self.failure, self.answers, self.waited, self._asked = "", 0, 0.0, on_wire.asked
        self.alive: Callable[[], bool] = lambda: True
        self._by: Answers = by
        if by != "clock":
            loop.after(self.tick)

    def meet(self) -> None:
        """Wait for the first valid sentence, by which a wire over udp learns where to send.

        Raises:
            RunError: none comes.
        """
        if not self._answered("wire"):
            raise RunError(f"no valid sentence on {self._on_wire.wire.address} within {self._patience:g} s; the "
                           "autopilot has to send one before it hears any, or to be named with --to")  # fmt: skip

    def tick(self, loop: Loop) -> None:
        """Wait, if the sentence was sent; stop the loop where no answer comes.

        An autopilot that has ended is waited for no more: its last orders hold.
        """
        if self._to not in self._on_wire.said or self.failure or not self.alive():
            return
        if self._answered(self._by):
            self.answers += 1
        elif self.alive():
            self.failure = f"no answer within {self._patience:g} s at {loop.t:g} s; each {self._to} is to be answered"
            loop.stop()

    def _answered(self, by: Answers) -> bool:
        wire, begin, before = self._on_wire.wire, time.monotonic(), self._asked
        while True:
            heard = wire.poll()
            self._on_wire.hold(heard)
            self._asked = self._on_wire.asked
            answer = bool(heard) if by == "wire" else self._asked != before
            now = time.monotonic()
            if answer or now - begin > self._patience or not self.alive():
                self.waited += now - begin
                return answer
            # a datagram ends the wait; an order of a link does not, whose thread is given way to
            wire.wait(min(0.2 if by == "wire" else _LOOK, self._patience))

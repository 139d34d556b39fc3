"""What comes in from outside, sifted: only whole, valid, new sentences at a bearable rate get through."""

from __future__ import annotations

from collections import Counter, OrderedDict
from dataclasses import dataclass

from ..data.nmea import NmeaError, Sentence, decode
from ..data.nmea_framing import LARGEST, Tag, read_line, split

_SENDERS = 64
"""Senders that are remembered at a time; the one silent for longest is forgotten first."""

_TOGETHER = 4.0
"""Lines that are taken from all senders together, over those from one: many ports must not stop the loop either."""

_BEHIND, _REMEMBERED = 100, 10.0
"""A TAG line number up to this many behind the last one is a repetition, for this long [s]; later it is a new start."""


@dataclass
class _Sender:
    """What is known of who sends: lines left to it at this moment, and its last TAG block."""

    left: float
    since: float
    number: int | None = None
    time: float | None = None
    heard: float = 0.0


def _refill(who: _Sender, rate: float, now: float) -> None:
    who.left = min(rate, who.left + rate * max(now - who.since, 0.0))
    who.since = now


class Intake:
    """Sifts datagrams; never raises, never grows.

    Attributes:
        counts: datagrams and sentences taken, and what was turned away by reason: oversized, length, form,
            checksum, field, other (valid, but not read here), replayed, flooded.
    """

    def __init__(self, rate: float = 500.0) -> None:
        """So many lines per second from each sender, and as many at once; from all together four times that."""
        self.rate = rate
        self._all = _Sender(_TOGETHER * rate, 0.0)
        self.counts: Counter[str] = Counter()
        self._senders: OrderedDict[str, _Sender] = OrderedDict()

    def take(self, data: bytes, sender: str, now: float) -> list[Sentence]:
        """The valid sentences of a datagram.

        Args:
            data: what came.
            sender: who sent it.
            now: time on a clock that never goes back [s].
        """
        self.counts["datagrams"] += 1
        if len(data) > LARGEST:
            self.counts["oversized"] += 1
            return []
        who = self._sender(sender, now)
        _refill(self._all, _TOGETHER * self.rate, now)
        lines = max(data.count(b"\n"), 1)
        if min(who.left, self._all.left) < lines:
            self.counts["flooded"] += lines
            return []
        who.left -= lines
        self._all.left -= lines
        found = [self._sentence(line, who, now) for line in split(data)]
        return [one for one in found if one is not None]

    def _sender(self, name: str, now: float) -> _Sender:
        who = self._senders.get(name)
        if who is None:
            who = self._senders[name] = _Sender(self.rate, now)
            if len(self._senders) > _SENDERS:
                self._senders.popitem(last=False)
        self._senders.move_to_end(name)
        _refill(who, self.rate, now)
        return who

    def _sentence(self, line: bytes, who: _Sender, now: float) -> Sentence | None:
        try:
            framed = read_line(line)
            sentence = decode(framed.sentence)
        except NmeaError as error:
            self.counts["other" if error.reason == "kind" else error.reason] += 1
            return None
        if framed.tag is not None and self._again(framed.tag, who, now):
            self.counts["replayed"] += 1
            return None
        self.counts["sentences"] += 1
        return sentence

    @staticmethod
    def _again(tag: Tag, who: _Sender, now: float) -> bool:
        """Whether the TAG block is one that came before; remembers it where it is not."""
        fresh = now - who.heard < _REMEMBERED
        if fresh and tag.number is not None and who.number is not None and (who.number - tag.number) % 1000 < _BEHIND:
            return True
        if fresh and tag.time is not None and who.time is not None and tag.time < who.time:
            return True
        who.number, who.time, who.heard = tag.number, tag.time, now
        return False

"""What comes in from outside, sifted: only whole, valid, new sentences at a bearable rate get through."""

from __future__ import annotations

from collections import Counter, OrderedDict
from dataclasses import dataclass, field

from ..data.nmea import NmeaError, Sentence, decode
from ..data.nmea_framing import LARGEST, Tag, read_line, split

OTHER = Sentence("", "other", {})
"""Stands for any valid sentence of a kind that is not read here: it orders nothing, but its sender is alive."""

_SENDERS = 64
"""Senders, and sources of TAG blocks of one sender, that are remembered; who is silent for longest is forgotten."""

_TOGETHER = 4.0
"""Lines that are taken from all senders together, over those from one: many ports must not stop the loop either."""

_BEHIND, _REMEMBERED = 100, 10.0
"""A TAG line number up to this many behind the last one is a repetition, for this long [s]; later it is a new start."""


@dataclass
class _Sender:
    """Who sends: lines left to it at this moment, and the last TAG block with the time it came, by its source."""

    left: float
    since: float
    tags: OrderedDict[str | None, tuple[Tag, float]] = field(default_factory=OrderedDict[str | None, tuple[Tag, float]])


def _refill(who: _Sender, rate: float, now: float) -> None:
    who.left = min(rate, who.left + rate * max(now - who.since, 0.0))
    who.since = now


class Intake:
    """Sifts datagrams; never raises, never grows.

    Attributes:
        counts: datagrams and sentences taken, and what was turned away by reason: oversized, length, form,
            checksum, field, other (valid, but not read here), replayed, flooded.
        ahead: how far the time that the rate counts in is ahead of the clock [s]; grows where ships sail faster than
            it, as whoever answers them does so more often.
    """

    def __init__(self, rate: float = 500.0) -> None:
        """So many lines per second from each sender, and as many at once; from all together four times that."""
        self.rate, self.ahead = rate, 0.0
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
        who = self._sender(sender, now + self.ahead)
        _refill(self._all, _TOGETHER * self.rate, now + self.ahead)
        cost = data.count(b"\n") + (not data.endswith(b"\n"))  # as many lines as `split` makes of it, or more
        if min(who.left, self._all.left) < cost:
            self.counts["flooded"] += cost
            return []
        who.left -= cost
        self._all.left -= cost
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
            sentence = self._decoded(framed.sentence)
        except NmeaError as error:
            self.counts["other" if error.reason == "kind" else error.reason] += 1
            return None
        if framed.tag is not None and self._again(framed.tag, who, now):
            self.counts["replayed"] += 1
            return None
        self.counts["sentences" if sentence is not OTHER else "other"] += 1
        return sentence

    @staticmethod
    def _decoded(sentence: bytes) -> Sentence:
        """A sentence; `OTHER` for a valid one of a kind that is not read here."""
        try:
            return decode(sentence)
        except NmeaError as error:
            if error.reason != "kind":
                raise
            return OTHER

    @staticmethod
    def _again(tag: Tag, who: _Sender, now: float) -> bool:
        """Whether the TAG block is one that came before from its source; remembers it where it is not."""
        last, heard = who.tags.get(tag.source, (Tag(), -_REMEMBERED))
        fresh = now - heard < _REMEMBERED
        if fresh and tag.number is not None and last.number is not None and (last.number - tag.number) % 1000 < _BEHIND:
            return True
        if fresh and tag.time is not None and last.time is not None and tag.time < last.time:
            return True
        who.tags[tag.source] = tag, now
        who.tags.move_to_end(tag.source)
        if len(who.tags) > _SENDERS:
            who.tags.popitem(last=False)
        return False

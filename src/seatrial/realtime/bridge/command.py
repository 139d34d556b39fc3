"""Who commands the ship: one browser at a time."""

from __future__ import annotations

import math


class Command:
    """Which client of the bridge has command.

    The first client has command.  Another one asks for it, and the commander hands it over or keeps it; a commander
    that has been silent for `hold` seconds of the clock is stale, and the next client that asks has command at once.

    Attributes:
        hold: longest silence of a commander [s].
        holder: client in command; empty if there is none.
        asking: client that asks for command; empty if there is none.
        present: connected clients.
    """

    def __init__(self, hold: float) -> None:
        self.hold, self.holder, self.asking = hold, "", ""
        self.present: set[str] = set()
        self._heard = -math.inf

    def come(self, who: str, now: float) -> None:
        """A client connects; a commander that returns still has command."""
        self.present.add(who)
        if not self.holder:
            self.holder = who
        self.beat(who, now)

    def leave(self, who: str) -> None:
        """A client disconnects; it may return."""
        self.present.discard(who)
        if self.asking == who:
            self.asking = ""

    def beat(self, who: str, now: float) -> None:
        """A client was heard of."""
        if who == self.holder:
            self._heard = now

    def stale(self, now: float) -> bool:
        """Whether there is a commander that has been silent for too long."""
        return bool(self.holder) and now - self._heard > self.hold

    def take(self, who: str, now: float) -> bool:
        """Ask for command; whether `who` has it now."""
        if who != self.holder and self.holder and not self.stale(now):
            self.asking = who
            return False
        self._hand_to(who, now)
        return True

    def give(self, who: str, now: float) -> bool:
        """Hand over to the client that asks; whether that was done."""
        if who != self.holder or self.asking not in self.present:
            return False
        self._hand_to(self.asking, now)
        return True

    def keep(self, who: str) -> None:
        """Refuse the client that asks."""
        if who == self.holder:
            self.asking = ""

    def _hand_to(self, who: str, now: float) -> None:
        self.holder, self.asking = who, ""
        self._heard = now

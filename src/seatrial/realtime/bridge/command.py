"""Who has command: one at a time, handed over in so many words."""

from __future__ import annotations

import math


class Command:
    """One commander among several on the bridge.

    The first to come has command.  Another one asks for it, and the commander hands it over or keeps it; a commander
    who has not been heard of for `hold` seconds on the clock is stale, and whoever asks then has command at once.

    Attributes:
        hold: how long a commander may be silent [s].
        holder: who has command; empty while nobody has.
        asking: who asks for it; empty while nobody does.
        present: who is on the bridge.
    """

    def __init__(self, hold: float) -> None:
        self.hold, self.holder, self.asking = hold, "", ""
        self.present: set[str] = set()
        self._heard = -math.inf

    def come(self, who: str, now: float) -> None:
        """Somebody enters; a commander who comes back has command still."""
        self.present.add(who)
        if not self.holder:
            self.holder = who
        self.beat(who, now)

    def leave(self, who: str) -> None:
        """Somebody is gone, perhaps to come back."""
        self.present.discard(who)
        if self.asking == who:
            self.asking = ""

    def beat(self, who: str, now: float) -> None:
        """A sign of life."""
        if who == self.holder:
            self._heard = now

    def stale(self, now: float) -> bool:
        """Whether there is a commander who has been silent for too long."""
        return bool(self.holder) and now - self._heard > self.hold

    def take(self, who: str, now: float) -> bool:
        """Ask for command; whether `who` has it now."""
        if who != self.holder and self.holder and not self.stale(now):
            self.asking = who
            return False
        self._hand_to(who, now)
        return True

    def give(self, who: str, now: float) -> bool:
        """Hand over to who asks; whether that was done."""
        if who != self.holder or self.asking not in self.present:
            return False
        self._hand_to(self.asking, now)
        return True

    def keep(self, who: str) -> None:
        """Turn down who asks."""
        if who == self.holder:
            self.asking = ""

    def _hand_to(self, who: str, now: float) -> None:
        self.holder, self.asking = who, ""
        self._heard = now

"""Who steers the own ship: its track pilot, an FMU aboard, ArduPilot, a sender on the wire, or a mariner at the page.

The mariner overrides at once, whoever steers; all others take over only when the mariner hands over.  While the wire
does not steer, orders on it are refused and counted, and those of an FMU or of ArduPilot are not heeded, so that an
autopilot cannot take the ship back.
"""

from __future__ import annotations

from typing import Protocol

from ...core.errors import RefusalError
from ..loop import Loop
from ..on_wire import OnWire
from .pilots import OwnPilot
from .scenario import Phase

CALLED = {"pilot": "the track pilot", "wire": "the wire", "page": "the mariner", "fmu": "the FMU",
          "ardupilot": "ArduPilot", "nobody": "nobody"}  # fmt: skip
"""Those who can steer, in words."""


class Helmsman(Protocol):
    """Somebody outside who steers as long as it is `heeded`."""

    heeded: bool


class Handover:
    """Who steers.

    Attributes:
        holder: who does.
        known: who can.
    """

    def __init__(self, loop: Loop, own: str, pilot: OwnPilot | None, on_wire: OnWire | None, page: bool) -> None:
        """The wire steers at first where there is one, else the pilot, else the page; nobody where none is there.

        Args:
            page: whether there is a page.
        """
        self._own, self._pilot, self._on_wire = own, pilot, on_wire
        there: dict[Phase, bool] = {"wire": on_wire is not None, "pilot": pilot is not None, "page": page}
        self.known: tuple[Phase, ...] = tuple(name for name, is_there in there.items() if is_there)
        self._outside = dict[Phase, Helmsman]()
        self._first: Phase = self.known[0] if self.known else "nobody"
        self.holder: Phase = self._first
        self._set(self._first)
        loop.keep("who steers", self)

    def join(self, name: Phase, helmsman: Helmsman) -> None:
        """Let somebody else steer from the start on, before all who are known."""
        self._outside[name] = helmsman
        self.known, self._first = (name, *self.known), name
        self._set(name)

    def hand(self, loop: Loop, to: str) -> None:
        """Hand over; RefusalError: to somebody who is not there."""
        found: Phase | None = next((name for name in self.known if name == to), None)
        if found is None:
            raise RefusalError(f"nobody called that can steer; there is {', '.join(self.known)}")
        if found != self.holder:
            self._set(found)
            loop.tell(self._own, "handover", f"{CALLED[found]} steers")

    def _set(self, to: Phase) -> None:
        self.restore(to)
        if self._pilot is not None:
            self._pilot.active = to == "pilot"
        if self._on_wire is not None:
            self._on_wire.conning.listen(to == "wire")

    def snapshot(self) -> Phase:
        return self.holder

    def restore(self, saved: Phase) -> None:
        self.holder = saved  # pilot and wire are restored by themselves
        for name, helmsman in self._outside.items():
            helmsman.heeded = name == saved

    def reset(self) -> None:
        self._set(self._first)

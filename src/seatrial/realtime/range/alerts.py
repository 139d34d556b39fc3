"""Alarms of the own ship, each to be acknowledged: what is wrong now, and what was and nobody has noticed.

States are those of IEC 62923-1 and of the sentence ALF: V active and unacknowledged, A active and acknowledged,
U rectified and unacknowledged, N normal.  Identifiers from 10000 on are those of the maker of the equipment; the
instance tells alarms of one kind apart, such as those of several other ships.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple

from ...core.errors import RefusalError
from ...core.values import dataclass, field
from ...models import unit
from ..loop import Loop
from .contacts import Contacts
from .faults import Faults
from .scenario import Limits

State = Literal["V", "A", "U", "N"]
Priority = Literal["A", "W", "C"]
"""Alarm, warning or caution."""

_SILENT = 5.0
"""Time without a reading after which an instrument counts as lost [s]."""

_STUCK, _MOVED = 5.0, math.radians(2.5)
"""Time for which a rudder apart from its order has to move by this angle at least [s, rad]."""

CPA, GYRO, GNSS, RUDDER, TRACK, PILOT, KEEL = 10001, 10011, 10012, 10021, 10031, 10041, 10051
"""Identifiers: nearest approach, heading lost, position lost, rudder, off track, autopilot silent, little water."""


class Cause(NamedTuple):
    """Something that raises an alarm now."""

    identifier: int
    instance: int
    priority: Priority
    text: str

    @property
    def title(self) -> str:
        """The text as ALF takes it: 16 characters, letters, digits and spaces."""
        plain = (c if c.isascii() and (c.isalnum() or c in " ._/-") else " " for c in self.text)
        return "".join(plain)[:16].strip()


@dataclass
class Alarm:
    """One alarm.

    Attributes:
        cause: what raises it.
        state: as in the sentence ALF.
        changed: simulated time of the last change [s].
        revision: number of changes, 1 to 99 and then 1 again.
        spans: from when to when there was a cause [s]; the last one is open, None, while there is.
    """

    cause: Cause
    state: State
    changed: float
    revision: int = 1
    spans: list[tuple[float, float | None]] = field(default_factory=list[tuple[float, float | None]])

    def turn(self, state: State, t: float) -> None:
        """Change the state."""
        if state != self.state:
            self.state, self.changed, self.revision = state, t, self.revision % 99 + 1


Key = tuple[int, int]
"""Identifier and instance."""

_RAISED: Mapping[State, State] = {"N": "V", "U": "V", "V": "V", "A": "A"}
_ENDED: Mapping[State, State] = {"V": "U", "A": "N", "U": "U", "N": "N"}
_ACKNOWLEDGED: Mapping[State, State] = {"V": "A", "U": "N"}


class Alarms:
    """The alarms of the own ship.

    Attributes:
        alarms: every alarm that there has been, by identifier and instance.
    """

    def __init__(
        self, loop: Loop, own: str, contacts: Contacts, faults: Faults, limits: Limits,
        across: Callable[[], float | None], deaf: Callable[[], bool], keel: Callable[[], float] = lambda: math.inf,
    ) -> None:  # fmt: skip
        """Watch the ship `own` from now on.

        Args:
            across: distance from the route by the instruments [m]; None while it is unknown.
            deaf: whether the autopilot on the wire is silent.
            keel: water under the keel [m].
        """
        self._vessel, self._contacts, self._faults, self._limits = loop.vessels[own], contacts, faults, limits
        self._numbers = {name: k for k, name in enumerate((n for n in loop.vessels if n != own), 1)}
        plant = self._vessel.plant
        self._rudders = tuple(name for name in plant.controls if name.startswith("delta") and unit(name) == "rad")
        self._keel = keel
        self._across, self._deaf, self._every = across, deaf, max(round(loop.rate), 1)
        self.reset()
        loop.after(self.tick)
        loop.keep("the alarms", self)

    def tick(self, loop: Loop) -> None:
        """Listen to the instruments, and once a second look for causes."""
        for reading in self._vessel.readings:
            self._heard[reading.kind] = loop.t
        if loop.k % self._every:
            return
        causes = {(one.identifier, one.instance): one for one in self._causes(loop.t)}
        for key, cause in causes.items():
            if key not in self.alarms:
                self.alarms[key] = Alarm(cause, "V", loop.t)
            alarm = self.alarms[key]
            alarm.turn(_RAISED[alarm.state], loop.t)
            if not alarm.spans or alarm.spans[-1][1] is not None:
                alarm.spans.append((loop.t, None))
        for key, alarm in self.alarms.items():
            if key not in causes:
                alarm.turn(_ENDED[alarm.state], loop.t)
                if alarm.spans and alarm.spans[-1][1] is None:
                    alarm.spans[-1] = alarm.spans[-1][0], loop.t

    def told(self) -> list[dict[str, Any]]:
        """Every alarm that there has been, for JSON: what, when there was a cause [s], and its state now."""
        return [{"identifier": one.cause.identifier, "instance": one.cause.instance, "priority": one.cause.priority,
                 "text": one.cause.text, "state": one.state, "spans": [list(span) for span in one.spans]}
                for one in self.alarms.values()]  # fmt: skip

    def standing(self) -> Sequence[Alarm]:
        """The alarms that are not normal, the latest first."""
        return sorted((one for one in tuple(self.alarms.values()) if one.state != "N"), key=lambda one: -one.changed)

    def acknowledge(self, identifier: int, instance: int, t: float) -> None:
        """Acknowledge an alarm; RefusalError: there is none to acknowledge."""
        alarm = self.alarms.get((identifier, instance))
        if alarm is None or alarm.state not in _ACKNOWLEDGED:
            raise RefusalError("no such alarm to acknowledge")
        alarm.turn(_ACKNOWLEDGED[alarm.state], t)

    def _causes(self, t: float) -> Iterator[Cause]:
        for one in self._contacts.dangerous():
            number = self._numbers[one.name]
            numbered = one.name.partition(" ")[0] == str(number)  # as ships of the command line are
            yield Cause(CPA, number, "A", f"CPA {one.name}" if numbered else f"CPA {number:02d} {one.name}")
        for kind, identifier, text in (("gyro", GYRO, "HEADING LOST"), ("gnss", GNSS, "POSITION LOST")):
            if kind in self._heard and t - self._heard[kind] > _SILENT:
                yield Cause(identifier, 1, "W", text)
        for k, control in enumerate(self._rudders, 1):
            if self._stuck(control, t):
                yield Cause(RUDDER, k, "A", "RUDDER RESPONSE")
        across, most = self._across(), self._limits.cross_track
        if most is not None and across is not None and abs(across) > most:
            yield Cause(TRACK, 1, "W", "OFF TRACK")
        if self._limits.under_keel is not None and self._keel() < self._limits.under_keel:
            yield Cause(KEEL, 1, "A", "UNDER KEEL")
        if self._deaf():
            yield Cause(PILOT, 1, "W", "AUTOPILOT SILENT")

    def _stuck(self, control: str, t: float) -> bool:
        """Whether a rudder has been apart from its order for a while and hardly moves."""
        angle, kept = self._vessel.plant[control], self._angles.setdefault(control, [])
        if abs(self._faults.ordered(control) - angle) <= self._limits.rudder:
            kept.clear()
            return False
        kept.append((t, angle))
        while len(kept) > 1 and kept[1][0] <= t - _STUCK:
            kept.pop(0)
        angles = [one for _, one in kept]
        return t - kept[0][0] >= _STUCK and max(angles) - min(angles) < _MOVED

    def snapshot(self) -> dict[str, Any]:
        return {"alarms": [[*one.cause, one.state, one.changed, one.revision, [list(span) for span in one.spans]]
                           for one in self.alarms.values()],
                "heard": self._heard, "angles": self._angles}  # fmt: skip

    def restore(self, saved: Mapping[str, Any]) -> None:
        found = [Alarm(Cause(*one[:4]), one[4], float(one[5]), int(one[6]), [(a, b) for a, b in one[7]])
                 for one in saved["alarms"]]  # fmt: skip
        self.alarms = {(one.cause.identifier, one.cause.instance): one for one in found}
        self._heard = dict(saved["heard"])
        self._angles = {name: [(t, angle) for t, angle in rows] for name, rows in saved["angles"].items()}

    def reset(self) -> None:
        """Forget all."""
        self.alarms: dict[Key, Alarm] = {}
        self._heard: dict[str, float] = {}
        self._angles: dict[str, list[tuple[float, float]]] = {}

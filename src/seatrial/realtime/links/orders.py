"""Orders of a link, as sentences of one sender on the wire of a stage."""

from __future__ import annotations

import math

from ...core.errors import RefusalError
from ...data.nmea.sentences import SENTENCES, NmeaError, Sentence, Value, decode, encode
from ..loop import Loop
from ..on_wire import OnWire
from ..wire import Message

_DEGREE = 180.0 / math.pi


class Orders:
    """One sender of orders.

    Attributes:
        sender: as the wire names it.
        engaged: whether it renews its command each second without being asked to.
    """

    def __init__(self, loop: Loop, on_wire: OnWire, sender: str) -> None:
        """Send to the ship of this wire; nothing is ordered yet."""
        self.sender, self.engaged, self._on_wire, self._loop = sender, False, on_wire, loop
        self._every = max(round(loop.rate), 1)
        loop.after(self.tick)

    @property
    def commands(self) -> bool:
        """Whether this sender has command."""
        return self._on_wire.conning.commander == self.sender

    @property
    def mode(self) -> str:
        """What this sender steers by: "none", "rudder", "heading" or "track"."""
        return self._on_wire.conning.mode if self.commands else "none"

    @property
    def heading(self) -> float | None:
        """Heading that is steered [rad]; None while none is."""
        return self._on_wire.conning.control.course if self.mode in ("heading", "track") else None

    def tick(self, loop: Loop) -> None:
        """Renew the command."""
        if self.engaged and self.commands and loop.k % self._every == 0:
            self._say("HTC", headingref="T", status="R")

    def steer_heading(self, psi: float) -> None:
        """Steer a heading [rad]; RefusalError: not a direction, or it would not be obeyed."""
        self._order("HTC", override="V", steermode="H", turnmode="N", cmdheading=math.degrees(psi) % 360.0,
                  headingref="T", status="C")  # fmt: skip
        self.engaged = True

    def steer_rudder(self, delta: float) -> None:
        """Order all rudders to an angle [rad], positive turning to starboard.

        Raises:
            RefusalError: beyond half a turn, or it would not be obeyed.
        """
        angle = delta * _DEGREE
        self._order("ROR", stbdrudderorder=angle, stbdrudderstatus="A", portrudderorder=angle, portrudderstatus="A")

    def turn_shafts(self, n: float) -> None:
        """Order all shafts to revolutions [1/s]; RefusalError: beyond what a sentence holds, or not obeyed."""
        self._order("PRC", rpmdemand=60.0 * n, rpmdemandstatus="R")

    def push(self, number: int, share: float | None = None, azimuth: float | None = None) -> None:
        """Order a thruster to a share of its full strength, -1 to 1, or to an azimuth [rad] where it turns.

        Args:
            number: of the thruster, as in `conning.thrusters`.

        Raises:
            RefusalError: not obeyed.
        """
        strength, mode = (None, "V") if share is None else (100.0 * share, "P")
        turned = None if azimuth is None else math.degrees(azimuth) % 360.0
        self._order("TRC", thrusternum=number, dmdrpm=strength, rpmmode=mode, dmdazimuth=turned, status="C")

    def let_go(self) -> None:
        """Rudder midships, and no more renewals: somebody else may take command when the silence is over."""
        self.engaged = False
        if self.commands:
            self.steer_rudder(0.0)

    def _order(self, kind: str, **fields: Value) -> None:
        """Order, where the ship takes orders of this sender now: a request is answered before the next tick."""
        conning = self._on_wire.conning
        self._on_wire.asked += 1
        refused = conning.refusal(self.sender, self._loop.t)
        if why := refused or conning.missing(kind):
            conning.counts["refused" if refused else "unfit"] += 1
            raise RefusalError(why)
        self._say(kind, **fields)

    def _say(self, kind: str, **fields: Value) -> None:
        given = {**dict.fromkeys(SENTENCES[kind].fields), **fields}
        try:
            sentence = decode(encode(Sentence("AG", kind, given)))
        except NmeaError as error:
            raise RefusalError(str(error)) from None
        self._on_wire.hold([Message(sentence, self.sender)])

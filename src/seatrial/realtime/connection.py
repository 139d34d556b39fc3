"""Test of a ship's connection to equipment: it sends and obeys IEC 61162 sentences, in a loop without a socket.

Sawada 2024 section 6.1, item 3: inputs come from standard equipment, outputs are suitable for it.  What
`seatrial steer SHIP --nmea` puts on the wire is decoded again and held against the ship's own state.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from importlib.util import find_spec
from typing import Any

from ..core.constants import KNOT
from ..data.geodesy import Datum
from ..data.nmea.framing import read_line, split
from ..data.nmea.sentences import Sentence, decode, encode
from ..data.nmea.ship import Fittings
from ..ships import Ship
from ..validate.requirements import Finding, Judgement, judged, worst
from ..validate.requirements import thresholds as limit
from .conning import shafts, thrusters
from .helm import limits
from .loop import Loop
from .on_wire import OnWire, Speech
from .plant import Plant
from .wire import Intake, Message

_RATE, _LASTS = 10.0, 4.0
_SENDER = "autopilot under test"
_ORDERED = math.radians(10.0)


class _Line:
    """A wire without a socket: what is sent is kept, what is put in is read at the next tick."""

    def __init__(self) -> None:
        self.intake, self.t = Intake(rate=1e9), 0.0
        self.waiting: list[bytes] = []
        self.sent: list[bytes] = []

    @property
    def counts(self) -> Counter[str]:
        """Outcomes of the input."""
        return self.intake.counts

    def poll(self) -> list[Message]:
        """Valid sentences put in since the last tick."""
        waiting, self.waiting = self.waiting, []
        return [Message(one, _SENDER) for data in waiting for one in self.intake.take(data, _SENDER, 0.0)]

    def send(self, data: bytes) -> None:
        """Keep what the ship sends."""
        self.sent.append(data)


def connection(ship: Ship) -> Judgement:
    """Whether a ship tells its state and obeys orders in IEC 61162-1 sentences, plain and in frames of -450."""
    if find_spec("pynmeagps") is None:
        return Judgement("not judged", "IEC 61162 sentences need the extra 'nmea': pip install 'seatrial[nmea]'")
    orders = [*_rudder(ship), *_revolutions(ship), *_thruster(ship)]
    if not orders:
        wrong = "no order of IEC 61162-1 moves any of its controls: " + ", ".join(ship.model.controls)
        orders = [Finding("controls that obey a sentence", 0.0, "-", limit.ALL_OPEN, wrong)]
    found = [*_told(ship, framed=False), *_told(ship, framed=True), *orders]
    return judged("it sends its state in IEC 61162-1 sentences, plain and in frames of -450, and obeys orders by them "
                  "(seatrial steer SHIP --nmea), not damaged ones", found)  # fmt: skip


def _at_sea(ship: Ship, framed: bool = False) -> tuple[Loop, Plant, Any]:
    from ..simulate.run import time_step

    dt = time_step(ship)
    ticks = max(round(1.0 / (_RATE * dt)), 1)
    plant, line = Plant.of(ship, dt=dt), _Line()
    loop = Loop({"ship": plant}, 1.0 / (ticks * dt), math.inf)
    wire: Any = line
    OnWire(loop, "ship", wire, Speech(Fittings(Datum(35.0, 139.0)), framed=framed))
    return loop, plant, line


def _told(ship: Ship, framed: bool) -> Iterator[Finding]:
    """The last sentence of each kind against the ship's state at its time."""
    loop, plant, line = _at_sea(ship, framed)
    for name in plant.orders:
        if name in ("delta", *(n for n in ship.model.controls if n.startswith("delta"))):
            loop.order("ship", name, 0.5 * _ORDERED)
    loop.run(_LASTS)
    texts = [read_line(one).sentence if framed else one for data in line.sent for one in split(data)]
    said = {one.kind: one for one in map(decode, texts)}
    form = "frames of IEC 61162-450" if framed else "IEC 61162-1"
    yield Finding(f"kinds of sentences sent, {form}", float(len(said)), "-", limit.SENTENCES,
                  f"the ship does not tell its heading, rate of turn, speed and position in {form}")  # fmt: skip
    expected = {
        ("HDT", "headingT"): (math.degrees(plant["psi"]) % 360.0, 0.1),
        ("ROT", "rot"): (math.degrees(plant["r"]) * 60.0, 0.11),
        ("VBW", "longwaterspd"): (plant["u"] / KNOT, 0.011),
        ("VBW", "transwaterspd"): (plant["v_m"] / KNOT, 0.011),
    }  # fmt: skip
    points = [
        (f"{kind} {field}", abs((said[kind].number(field) or 0.0) - value) / (digit + 0.02 * abs(value)))
        for (kind, field), (value, digit) in expected.items() if kind in said
    ]  # fmt: skip
    if points:
        wrong = f"what the ship tells in {form} is not its state: {{at}}"
        yield worst(f"sentences apart from the state, {form}", points, limit.LAST_DIGIT, wrong, "last digits")


def _following(ship: Ship, order: str, prefix: str) -> list[str]:
    return [name for name, (followed, _) in zip(ship.model.controls, ship.model.follows, strict=True)
            if followed == order and name.startswith(prefix)]  # fmt: skip


def _rudder(ship: Ship) -> Iterator[Finding]:
    """A rudder order is obeyed, a damaged one is not."""
    steering = _following(ship, "delta", "delta")
    if not steering:
        return
    fields = dict.fromkeys(("stbdrudderorder", "portrudderorder"), math.degrees(_ORDERED))
    order = _sentence("ROR", **fields, stbdrudderstatus="A", portrudderstatus="A")
    other = order[:-3] + (b"1" if order[-3:-2] == b"0" else b"0") + order[-2:]
    for sent, wanted, what in ((order, _ORDERED, "a rudder order"), (other, 0.0, "one with a wrong checksum")):
        loop, plant, line = _at_sea(ship)
        line.waiting.append(sent)
        loop.run(_LASTS)
        apart = max(abs(plant[f"{name}_cmd"] - wanted) for name in steering)
        wrong = "the ship does not obey a rudder order (ROR)" if wanted else "the ship obeys a damaged rudder order"
        said = f"rudder order after {what} (ROR), from what it should be"
        yield Finding(said, math.degrees(apart), "deg", limit.OBEYED, wrong)


def _revolutions(ship: Ship) -> Iterator[Finding]:
    """An order of half the revolutions."""
    turning = shafts(ship)  # none where revolutions move nothing
    if not turning:
        return
    loop, plant, line = _at_sea(ship)
    wanted = 0.5 * (plant[f"{turning[0]}_cmd"] or 1.0)
    line.waiting.append(_sentence("PRC", rpmdemand=round(60.0 * wanted, 1), rpmdemandstatus="R", engineshaftnum=None))
    loop.run(_LASTS)
    apart = max(abs(plant[f"{name}_cmd"] - wanted) for name in turning)
    yield Finding("revolutions after an order of half of them (PRC), from it", apart, "1/s", limit.OBEYED,
                  "the ship does not obey an order of revolutions (PRC)")  # fmt: skip


def _thruster(ship: Ship) -> Iterator[Finding]:
    """Half strength of the first thruster that has a range, and its azimuth where it turns."""
    for number, (strength, azimuth) in thrusters(ship).items():
        loop, plant, line = _at_sea(ship)
        full = limits(ship, strength)[1]
        if not math.isfinite(full):
            continue
        line.waiting.append(_sentence("TRC", thrusternum=number, dmdrpm=50.0, rpmmode="P", dmdazimuth=30.0, status="C"))
        loop.run(_LASTS)
        apart, wrong = abs(plant[f"{strength}_cmd"] / full - 0.5), f"{strength} does not obey a thruster order (TRC)"
        said = f"{strength} after an order of half its strength (TRC), from it"
        yield Finding(said, apart, "of full", limit.OBEYED, wrong)
        if azimuth is not None:
            apart = abs(math.degrees(plant[f"{azimuth}_cmd"]) - 30.0)
            yield Finding(f"{azimuth} after an order of 30 deg (TRC), from it", apart, "deg", limit.OBEYED,
                          f"{azimuth} does not obey a thruster order (TRC)")  # fmt: skip


def _sentence(kind: str, **fields: object) -> bytes:
    from ..data.nmea.sentences import SENTENCES

    given: Any = dict.fromkeys(SENTENCES[kind].fields) | fields
    return encode(Sentence("AG", kind, given))

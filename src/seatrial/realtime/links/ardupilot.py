"""A ship as the plant of ArduPilot's SITL, by its "JSON" physics: datagrams of pulses in, lines of JSON out.

    sim_vehicle.py -v Rover -f JSON:127.0.0.1     # FRAME_CLASS 2: a boat

SITL sends the pulses of its servos to port 9002 and waits for the motion that answers them, so that both run in lock
step: each new datagram is one tick of the ships, whose clock this link is.  A datagram told twice is answered by the
same line and moves nothing; a count that falls back is a restart, upon which the ships begin anew.  What is sent is the
true motion: the autopilot's own sensor models add their errors.  Layout: ArduPilot, libraries/SITL/SIM_JSON.h.
"""

from __future__ import annotations

import json
import math
import select
import socket
import struct
import time
from collections.abc import Mapping, Sequence
from typing import Any

from ...core.errors import WireError
from ...core.parameters import unknown
from ...core.values import dataclass
from ...models import unit
from ..helm import Range
from ..loop import Loop
from ..plant import Plant
from ..wire import Address

G = 9.81
"""What an accelerometer at rest shows [m/s^2]: the value that SITL has."""

_LAYOUTS: Mapping[int, struct.Struct] = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}
"""By magic number: frame rate [Hz], frame count, pulses [us]."""
_NEUTRAL, _SPAN = 1500.0, 500.0
_SLOWEST = 50.0
"""SITL takes steps of at most 20 ms for time."""
_NAP = 0.05
"""Longest single wait [s], so that a pause or a stop takes effect."""


def check_rate(rate: float) -> None:
    """Refuse a tick that SITL would not take for time.

    Raises:
        WireError: fewer than 50 ticks a second.
    """
    if rate < _SLOWEST:
        raise WireError(f"{rate:g} ticks a second; ArduPilot wants {_SLOWEST:g} to 1200: give --rate 400")


def servos(plant: Plant, given: Mapping[int, str]) -> dict[int, str]:
    """The order of each servo, as ArduPilot's defaults have them, and the `given` ones.

    A rudder is on servo 1 (GroundSteering) and the engine on servo 3 (Throttle); of two shafts without a rudder the
    port one is on servo 1 (ThrottleLeft) and the starboard one on servo 3 (ThrottleRight).

    Raises:
        WireError: a servo that is none, an order that the ship does not have or one without a range, or no order at
            all is known.
    """
    name = plant.ship.name
    for servo, order in given.items():
        if not 1 <= servo <= 32:
            raise WireError(f"servo {servo}: there are 1 to 32")
        if order not in plant.orders:
            raise WireError(f"servo {servo}: {name} has {unknown(order, plant.orders, 'control')}")
    usual = _usual(plant)
    found = {**{k: one for k, one in usual.items() if one not in given.values()}, **given}
    if not found:
        raise WireError(f"{name} has neither rudder and engine nor two shafts; say what is on which servo, "
                        f"such as --servo 1={plant.orders[0]}")  # fmt: skip
    for servo, order in found.items():
        if order not in plant.ranges:
            raise WireError(f"servo {servo}: {name} gives {order} no range that pulses could span")
    return found


def _usual(plant: Plant) -> dict[int, str]:
    if "delta" in plant.ranges:
        return {1: "delta", **({3: "n_P"} if "n_P" in plant.ranges else {})}
    pair = [name for name in plant.controls if name in plant.ranges and unit(name) != "rad"]
    return {1: pair[0], 3: pair[1]} if len(pair) == 2 else {}  # numbered from port to starboard


def ordered(pulse: float, low: float, high: float) -> float:
    """The order of a pulse [us]: 1000 is `low`, 1500 zero, 2000 `high`; no pulse (0) is zero."""
    share = 0.0 if pulse == 0 else min(max((pulse - _NEUTRAL) / _SPAN, -1.0), 1.0)
    return share * (high if share > 0.0 else -low)


def spanned(whole: Range) -> tuple[float, float]:
    """What 1000 and 2000 us order: the limits; without any full astern and ahead, of an azimuth half a turn."""
    if whole.all_round:
        return -math.pi, math.pi
    return (whole.low if math.isfinite(whole.low) else -whole.full,
            whole.high if math.isfinite(whole.high) else whole.full)  # fmt: skip


@dataclass(frozen=True)
class Motion:
    """A ship at one instant, as far as an autopilot senses changes of it.

    Attributes:
        t: time [s].
        phi, psi: heel and heading [rad].
        u, v: ahead and to starboard over ground, in the level plane [m/s].
    """

    t: float
    phi: float
    psi: float
    u: float
    v: float

    @staticmethod
    def of(plant: Plant) -> Motion:
        """That of a plant now; sway of a ship that heels lies along its deck."""
        phi = plant["phi"] if "phi" in plant.names else 0.0
        return Motion(plant.t, phi, plant["psi"], plant["u"], plant["v_m"] * math.cos(phi))


def told(plant: Plant, before: Motion) -> dict[str, Any]:
    """What SITL is told of a ship: body axes forward, starboard, down, earth axes north, east, down.

    Rates and specific force are means over the tick, so that an inertial unit integrates them to the motion that is
    told; the force is that of midship, of which position and velocity are.
    """
    now = Motion.of(plant)
    rates, force = _sensed(before, now)
    c, s = math.cos(now.psi), math.sin(now.psi)
    north, east = now.u * c - now.v * s, now.u * s + now.v * c
    wind = plant["wind_x"], plant["wind_y"]  # where it comes from
    met = wind[0] + north, wind[1] + east
    apparent = math.remainder(math.atan2(met[1], met[0]) - now.psi, 2.0 * math.pi)
    return {
        "timestamp": now.t, "imu": {"gyro": rates, "accel_body": force}, "position": [plant["x"], plant["y"], 0.0],
        "attitude": [now.phi, 0.0, math.remainder(now.psi, 2.0 * math.pi)], "velocity": [north, east, 0.0],
        "velocity_wind": [-wind[0], -wind[1], 0.0], "windvane": {"direction": apparent, "speed": math.hypot(*met)},
    }  # fmt: skip


def _sensed(before: Motion, now: Motion) -> tuple[list[float], list[float]]:
    """Rates [rad/s] and specific force [m/s^2] in the axes of the ship from one instant to another."""
    dt, phi = now.t - before.t, 0.5 * (now.phi + before.phi)
    c, s = math.cos(phi), math.sin(phi)
    if dt <= 0.0:
        return [0.0, 0.0, 0.0], [0.0, -G * s, -G * c]
    turn = math.remainder(now.psi - before.psi, 2.0 * math.pi) / dt
    surge = (now.u - before.u) / dt - turn * 0.5 * (now.v + before.v)
    sway = (now.v - before.v) / dt + turn * 0.5 * (now.u + before.u)
    # heading turns about the vertical, which is no axis of a ship that heels; at rest gravity is what holds it up
    return [(now.phi - before.phi) / dt, turn * s, turn * c], [surge, sway * c - G * s, -sway * s - G * c]


class Sitl:
    """The link, and the clock of the loop that it drives.

    Attributes:
        address: where it listens.
        heeded: whether it steers; else only the clock is its own.
        counts: datagrams: taken, told again, broken; and restarts.
    """

    def __init__(self, text: str, anywhere: bool = False) -> None:
        """Listen at ``udp://127.0.0.1:9002`` or another address.

        Raises:
            WireError: an address that is none, or is in use.
        """
        wanted = Address.parse(text, anywhere)
        if wanted.scheme != "udp":
            raise WireError(f"'{text}': ArduPilot sends datagrams; write udp://127.0.0.1:9002")
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((wanted.host, wanted.port))
        except OSError as error:
            self._socket.close()
            raise WireError(f"{wanted}: {error.strerror or error}; is the port right, and free?") from None
        self._socket.setblocking(False)
        self.address = Address("udp", *self._socket.getsockname())
        self.counts = {"taken": 0, "again": 0, "broken": 0, "restarts": 0}
        self.heeded = True
        self._count = -1
        self._asked: tuple[str, int] | None = None
        self._line = b""
        self._loop: Loop | None = None

    def steer(self, loop: Loop, ship: str, given: Mapping[int, str]) -> None:
        """Take the orders of a ship in a loop whose clock this is.

        Raises:
            WireError: as `servos` and `check_rate`.
        """
        check_rate(loop.rate)
        self._loop, self._ship = loop, ship
        self._plant = loop.vessels[ship].plant
        self._servos = servos(self._plant, given)
        self._before = Motion.of(self._plant)
        loop.after(self._answer)

    @property
    def servos(self) -> Mapping[int, str]:
        """The order of each servo."""
        return self._servos

    def now(self) -> float:
        """Time for which ticks are granted, a tick for each datagram [s]; no rounding holds one back."""
        return self.counts["taken"] * (1.0 + 1e-9) / self._loop.rate if self._loop is not None else 0.0

    def sleep(self, seconds: float, /) -> None:
        """Wait for a datagram, a twentieth of a second of the machine's clock at most."""
        if self._loop is None or self._loop.paused:
            time.sleep(_NAP)
            return
        if not select.select([self._socket], [], [], _NAP)[0]:
            return
        try:
            data, sender = self._socket.recvfrom(2048)
        except OSError:  # an answer to a port that has closed comes back as an error
            return
        self._hear(self._loop, data, sender)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

    def _hear(self, loop: Loop, data: bytes, sender: tuple[str, int]) -> None:
        layout = _LAYOUTS.get(int.from_bytes(data[:2], "little"))
        if layout is None or len(data) != layout.size:
            self.counts["broken"] += 1
            return
        _, rate, count, *pulses = layout.unpack(data)
        if count == self._count:  # the answer was lost, or is still to come
            self.counts["again"] += 1
            if self._asked is None and self._line:
                self._send(sender)
            return
        if count < self._count:
            self.counts["restarts"] += 1
            loop.reset()
            loop.tell(self._ship, "ardupilot", "the autopilot has begun anew, and so do the ships")
            self._before = Motion.of(self._plant)
        elif self._count < 0:
            loop.tell(self._ship, "ardupilot", f"steered by {sender[0]}:{sender[1]}, which asks for {rate} Hz")
        self._count, self._asked = count, sender
        if self.heeded:
            self._order(loop, pulses)
        self.counts["taken"] += 1

    def _order(self, loop: Loop, pulses: Sequence[int]) -> None:
        for servo, order in self._servos.items():
            if servo <= len(pulses):
                loop.order(self._ship, order, ordered(pulses[servo - 1], *spanned(self._plant.ranges[order])))

    def _answer(self, loop: Loop) -> None:
        """Tell the motion after a tick; a ship that failed ends the run."""
        if loop.vessels[self._ship].failure is not None:
            loop.stop()
            return
        said = json.dumps(told(self._plant, self._before), separators=(",", ":"), allow_nan=False)
        self._before = Motion.of(self._plant)
        self._line = f"\n{said}\n".encode()  # older parsers look for both line ends
        if self._asked is not None:
            sender, self._asked = self._asked, None
            self._send(sender)

    def _send(self, sender: tuple[str, int]) -> None:
        try:
            self._socket.sendto(self._line, sender)
        except OSError:
            self.counts["broken"] += 1


def numbered(texts: Sequence[str]) -> dict[int, str]:
    """Orders by servo from texts such as ``3=n_P``.

    Raises:
        WireError: a text that is not of this form, or a servo twice.
    """
    found: dict[int, str] = {}
    for text in texts:
        servo, equals, order = text.partition("=")
        if not (equals and order and servo.isascii() and servo.isdigit()):
            raise WireError(f"'{text}': write SERVO=ORDER, such as 3=n_P")
        if int(servo) in found:
            raise WireError(f"'{text}': servo {servo} has an order already")
        found[int(servo)] = order
    return found

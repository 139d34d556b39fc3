"""The steering control call by call against its law, how datagrams are filled, and when other ships are reported."""

from __future__ import annotations

import math
import random
from collections import Counter

import pytest

from seatrial.data.nmea.framing import LARGEST, TOKEN, split
from seatrial.data.nmea.ship import Fittings
from seatrial.manoeuvres.autopilot import Gains
from seatrial.realtime.conning import SteeringControl
from seatrial.realtime.loop import Loop
from seatrial.realtime.on_wire import OnWire, Speech
from seatrial.realtime.plant import Plant
from seatrial.realtime.wire import Intake, Message
from seatrial.ships.files import load

DEG = math.pi / 180.0
K_P, K_D, K_I = 1.4, 9.0, 0.02


def control(limit: float = 35.0 * DEG) -> SteeringControl:
    return SteeringControl(Gains(K_P, K_D, K_I), 250.0, limit)


def test_the_first_rudder_is_proportional_to_the_error_and_against_the_turn():
    for course, psi, r in ((0.05, 0.0, 0.0), (0.0, 0.06, 0.002), (6.28, 0.02, -0.004), (0.02, 6.28, 0.0)):
        held = control()
        held.steer(course)
        error = math.remainder(course - psi, math.tau)
        assert held.rudder(psi, r, 0.5) == pytest.approx(K_P * error - K_D * r, abs=1e-12)
    assert control().rudder(0.3, 0.1, 0.5) == 0.0


def test_the_integral_grows_by_errors_below_five_degrees_while_the_rudder_is_free():
    held = control()
    held.steer(4.9 * DEG)
    first = held.rudder(0.0, 0.0, 0.5)
    assert held.rudder(0.0, 0.0, 0.5) - first == pytest.approx(K_I * 4.9 * DEG * 0.5, rel=1e-9)
    held = control()
    held.steer(5.1 * DEG)  # an error of a turn, no steady disturbance
    for _ in range(2):
        assert held.rudder(0.0, 0.0, 0.5) == pytest.approx(K_P * 5.1 * DEG, abs=1e-12)
    held = control(limit=4.0 * DEG)
    held.steer(4.0 * DEG)  # asks for 5.6 deg: the rudder is at its limit
    assert held.rudder(0.0, 0.0, 0.5) == held.rudder(0.0, 0.0, 0.5) == pytest.approx(4.0 * DEG)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_smaller_limit_counts_on_either_side(side):
    held = control(limit=20.0 * DEG)
    held.steer(side * 1.5)
    assert held.rudder(0.0, 0.0, 0.1) == pytest.approx(side * 20.0 * DEG)
    assert held.rudder(0.0, 0.0, 0.1, 8.0 * DEG) == pytest.approx(side * 8.0 * DEG)
    assert held.rudder(0.0, 0.0, 0.1, 30.0 * DEG) == pytest.approx(side * 20.0 * DEG)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_limited_rate_moves_the_reference_and_is_fed_forward(side):
    """The reference goes rate times dt each call; the yaw rate is held against that rate until it has arrived."""
    rate, dt, held = 0.01, 0.5, control()
    held.steer(side * 0.012, rate)
    for reference, turning in ((0.005, rate), (0.01, rate), (0.012, 0.0), (0.012, 0.0)):
        before = held._integral
        wanted = K_P * side * reference + K_D * side * turning + K_I * before
        assert held.rudder(0.0, 0.0, dt) == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize(("across", "sign"), [(40.0, -1.0), (-40.0, 1.0)])
def test_a_track_is_steered_for_a_point_ahead(across, sign):
    held = control()
    held.steer(0.3, across=across)
    aim = 0.3 + sign * math.atan(40.0 / 250.0)
    assert held.rudder(0.3, 0.0, 0.1) == pytest.approx(min(K_P * (aim - 0.3), 35.0 * DEG), abs=1e-12)


def test_its_gains_are_those_of_a_nomoto_ship_and_its_sight_is_two_and_a_half_lengths():
    """Poles of T r' + r = K delta under P and D: omega^2 = K K_p / T, 2 zeta omega = (1 + K K_d) / T."""
    ship = load("kvlcc2_l7")
    held = SteeringControl.of(ship, 0.5)
    assert held.ahead == pytest.approx(2.5 * ship.L_pp)
    K, T = 1.8 * ship.speed / ship.L_pp, 2.5 * ship.L_pp / ship.speed
    omega = math.sqrt(K * held.gains.K_p / T)
    assert 0.6 < (1.0 + K * held.gains.K_d) / T / (2.0 * omega) < 1.2  # well damped
    assert held.gains.K_i > 0.0


# --- datagrams ---


class Strings:
    """A wire without a socket."""

    address, peers = "no socket", 1

    def __init__(self) -> None:
        self.intake, self.t, self.out = Intake(rate=1e9), 0.0, list[bytes]()

    @property
    def counts(self) -> Counter[str]:
        return self.intake.counts

    def poll(self) -> list[Message]:
        return []

    def send(self, data: bytes) -> None:
        self.out.append(data)


@pytest.fixture(scope="module")
def ship():
    return load("kvlcc2_l7")


def wired(ship, framed: bool = False, others: int = 0, **fittings) -> tuple[Loop, Strings, OnWire]:
    names = ["own", *(f"o{k}" for k in range(others))]
    plants = {name: Plant.of(ship, dt=0.1, start=(100.0 * k, 50.0 * k, 0.3 * k, ship.speed, 0.0, 0.0))
              for k, name in enumerate(names)}  # fmt: skip
    loop, wire = Loop(plants, 10.0, math.inf), Strings()
    on = OnWire(loop, "own", wire, Speech(Fittings(**fittings), {"ZDA": 1.0}, framed))  # type: ignore[arg-type]
    return loop, wire, on


@pytest.mark.slow
@pytest.mark.parametrize("framed", [True, False])
def test_datagrams_are_full_but_never_too_large_and_nothing_is_left_out(ship, framed):
    loop, wire, on = wired(ship, framed)
    draw = random.Random(2)
    lines = [b"$XX" + bytes([65 + draw.randrange(26)]) * draw.randrange(20, 75) + b"\r\n" for _ in range(1100)]
    on.say(loop, lines)
    assert all(len(data) <= LARGEST for data in wire.out)
    assert all(len(data) > LARGEST - 150 for data in wire.out[:-1])  # the next line had no room
    assert all(data.startswith(TOKEN) is framed for data in wire.out)
    parts = [part for data in wire.out for part in split(data)]
    assert [part[part.rindex(b"$XX") :] for part in parts] == [line.rstrip() for line in lines]
    if framed:
        numbers = [int(part.partition(b"n:")[2].partition(b",")[0].partition(b"*")[0]) for part in parts]
        assert numbers == [(numbers[0] + k) % 1000 for k in range(1100)]

"""ArduPilot's SITL against a peer that speaks its published protocol; its senses by strapdown integration."""

from __future__ import annotations

import json
import math
import socket
import struct
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import RequestError, WireError
from seatrial.environment import Uniform
from seatrial.realtime.afloat import Links, Voyage, afloat
from seatrial.realtime.links.ardupilot import Motion, Sitl, numbered, ordered, servos, told
from seatrial.realtime.plant import Plant
from seatrial.realtime.range.stage import Stage
from seatrial.ships.files import load
from seatrial.simulate.run import approach
from seatrial.workflow.afloat.scenes import alone

RATE = 100.0
NEUTRAL = (1500,) * 16


class Peer:
    """The autopilot's side: servos out, the motion in."""

    def __init__(self, port: int) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(20.0)
        self.to, self.count = ("127.0.0.1", port), 0

    def raw(self, data: bytes) -> bytes:
        self.socket.sendto(data, self.to)
        return self.socket.recv(4096)

    def datagram(self, pulses: Sequence[int], count: int) -> bytes:
        magic = 18458 if len(pulses) == 16 else 29569
        return struct.pack(f"<HHI{len(pulses)}H", magic, int(RATE), count, *pulses)

    def step(self, pulses: Sequence[int] = NEUTRAL) -> dict[str, Any]:
        self.count += 1
        return json.loads(self.raw(self.datagram(pulses, self.count)))


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@contextmanager
def sailing(name: str, seconds: float = 3600.0, given: Sequence[str] = ()) -> Iterator[tuple[Peer, list[Voyage]]]:
    """A ship in another thread as the plant of a peer; it ends after `seconds` of its time."""
    port, ended = free_port(), list[Voyage]()
    scenario = replace(alone(load(name), None), rate=RATE)
    links = Links(ardupilot=f"udp://127.0.0.1:{port}", servos=tuple(given))
    ready = threading.Event()

    def run() -> None:
        ended.append(afloat(scenario, links=links, duration=seconds, note=lambda _: ready.set()))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    assert ready.wait(60.0)
    peer = Peer(port)
    try:
        yield peer, ended
    finally:
        peer.socket.settimeout(0.05)
        for _ in range(100_000):
            if not thread.is_alive():
                break
            try:
                peer.step()
            except TimeoutError:
                thread.join(0.2)
        peer.socket.close()


def test_a_pulse_spans_the_limits_about_its_neutral() -> None:
    assert [ordered(pulse, -0.5, 2.0) for pulse in (1000, 1250, 1500, 1750, 2000)] == [-0.5, -0.25, 0.0, 1.0, 2.0]
    assert ordered(0, -0.5, 2.0) == 0.0  # no output
    assert (ordered(800, -0.5, 2.0), ordered(2200, -0.5, 2.0)) == (-0.5, 2.0)


def test_servos_are_those_of_the_kind_of_ship() -> None:
    tanker = Plant.of(load("kvlcc2_l7"), dt=0.1)
    assert servos(tanker, {}) == {1: "delta", 3: "n_P"}
    assert servos(tanker, {4: "delta"}) == {3: "n_P", 4: "delta"}
    otter = Plant.of(load("otter"), dt=0.1)
    port, starboard = otter.controls
    assert servos(otter, {}) == {1: port, 3: starboard}
    with pytest.raises(WireError, match="servo 40: there are 1 to 32"):
        servos(tanker, {40: "delta"})
    with pytest.raises(WireError, match="servo 2: kvlcc2_l7 has no control 'n_Q'; near: n_P"):
        servos(tanker, {2: "n_Q"})


@pytest.mark.parametrize("text", ["3", "=n_P", "x=n_P", "3="])
def test_a_servo_is_said_by_number_and_order(text: str) -> None:
    with pytest.raises(WireError, match="write SERVO=ORDER"):
        numbered([text])
    assert numbered(["3=n_P", "1=delta"]) == {3: "n_P", 1: "delta"}
    with pytest.raises(WireError, match="servo 3 has an order already"):
        numbered(["3=n_P", "3=delta"])


@pytest.mark.parametrize(("links", "said"), [
    (Links(servos=("3=n_P",)), "--servo is of ArduPilot"),
    (Links(ardupilot="tcp://127.0.0.1:9002"), "ArduPilot sends datagrams"),
    (Links(ardupilot="udp://192.0.2.1:9002"), "allow that with --anywhere"),
    (Links(ardupilot="udp://127.0.0.1:0"), "20 ticks a second; ArduPilot wants"),
])  # fmt: skip
def test_what_cannot_be_is_refused_in_a_line(links: Links, said: str) -> None:
    with pytest.raises(RequestError, match=said):
        afloat(replace(alone(load("kvlcc2_l7"), None), rate=20.0), links=links)


def test_each_datagram_is_a_tick_and_one_told_twice_is_none() -> None:
    with sailing("kvlcc2_l7", seconds=1.0) as (peer, ended):
        times = [peer.step()["timestamp"] for _ in range(20)]
        assert np.diff(times) == pytest.approx(1.0 / RATE, rel=1e-9)
        again = peer.datagram(NEUTRAL, peer.count)
        first, second = peer.raw(again), peer.raw(again)
        assert first == second
        assert json.loads(first)["timestamp"] == times[-1]
        assert (first[:1], first[-1:]) == (b"\n", b"\n")
        assert b": " not in first
        assert first.index(b'"velocity"') < first.index(b'"velocity_wind"')  # older parsers search for text
        peer.socket.sendto(b"\x1aH nonsense", peer.to)  # neither answered nor counted as a tick
        assert peer.step()["timestamp"] == pytest.approx(times[-1] + 1.0 / RATE)
        wide = (1500,) * 32
        assert peer.step(wide)["timestamp"] == pytest.approx(times[-1] + 2.0 / RATE)
    assert ended[0].stage.loop.t == pytest.approx(1.0, abs=1.5 / RATE)


@pytest.mark.slow
def test_an_autopilot_that_begins_anew_finds_the_ship_at_its_start() -> None:
    with sailing("kvlcc2_l7", seconds=5.0) as (peer, _):
        for _ in range(50):
            peer.step((2000, 1500, 2000, *NEUTRAL[3:]))
        peer.count = 0
        said = peer.step()
        assert said["timestamp"] == pytest.approx(1.0 / RATE)
        assert math.hypot(*said["position"][:2]) < 0.05
        assert said["attitude"][2] == pytest.approx(0.0, abs=1e-3)


def turned(about: np.ndarray) -> np.ndarray:
    """Rotation by a vector (Rodrigues)."""
    angle = float(np.linalg.norm(about))
    x, y, z = about / angle if angle > 0 else about
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


@pytest.mark.slow
@pytest.mark.parametrize(("name", "turn"), [("kvlcc2_l7", 30.0), ("container_son_nomoto", 5.0)])
def test_what_it_senses_is_the_motion_by_strapdown_integration(name: str, turn: float) -> None:
    """Gyro and accelerometer alone give attitude, velocity and place again, to the order of the step."""
    helm = (1900, 1500, 1900, *NEUTRAL[3:])
    with sailing(name, seconds=60.0) as (peer, _):
        said = [peer.step(helm) for _ in range(3000)]
    dt, first, last = 1.0 / RATE, said[0], said[-1]
    roll, _, yaw = first["attitude"]
    attitude = turned(np.array([0, 0, yaw])) @ turned(np.array([roll, 0, 0]))
    velocity, place = np.array(first["velocity"]), np.array(first["position"])
    for one in said[1:]:
        step = turned(dt * np.array(one["imu"]["gyro"]))
        middle = attitude @ turned(0.5 * dt * np.array(one["imu"]["gyro"]))
        gained = (middle @ np.array(one["imu"]["accel_body"]) + (0, 0, 9.81)) * dt
        place, velocity, attitude = place + (velocity + 0.5 * gained) * dt, velocity + gained, attitude @ step
    assert last["attitude"][2] > math.radians(turn)  # more than 1500 us turns to starboard
    heading = math.atan2(attitude[1, 0], attitude[0, 0])
    heel = math.atan2(attitude[2, 1], attitude[2, 2])
    assert (heel, heading) == pytest.approx((last["attitude"][0], last["attitude"][2]), abs=1e-4)
    assert velocity == pytest.approx(np.array(last["velocity"]), abs=2e-3)
    assert place == pytest.approx(np.array(last["position"]), abs=3e-2)
    heeled = max(abs(one["attitude"][0]) for one in said)
    assert (heeled > math.radians(1.0)) == (name == "container_son_nomoto")


def test_the_ship_is_that_of_the_loop() -> None:
    """The same orders without the autopilot end in the same state."""
    with sailing("kvlcc2_l7", seconds=1.0) as (peer, ended):
        for _ in range(99):  # and the tick at the start, before any datagram
            peer.step((2000, 1500, 1600, *NEUTRAL[3:]))
    stage = Stage(replace(alone(load("kvlcc2_l7"), None), rate=RATE))
    plant = stage.own.plant
    stage.loop.step()
    stage.loop.order("own", "delta", plant.ranges["delta"].high)
    stage.loop.order("own", "n_P", 0.2 * plant.ranges["n_P"].high)
    for _ in range(99):
        stage.loop.step()
    assert ended[0].plant.snapshot() == plant.snapshot()
    assert ended[0].document()["steered_by"] == "ardupilot"


def test_while_the_mariner_steers_its_pulses_are_ticks_and_no_orders() -> None:
    link = Sitl("udp://127.0.0.1:0")
    scenario = alone(load("kvlcc2_l7"), None)
    stage = Stage(replace(scenario, rate=RATE, own=replace(scenario.own, piloted=False)), page=True, clock=link)
    link.steer(stage.loop, "own", {})
    stage.handover.join("ardupilot", link)
    peer = Peer(link.address.port)
    orders = list[float]()
    for count, to in enumerate(("ardupilot", "page", "ardupilot"), 1):
        stage.handover.hand(stage.loop, to)
        stage.loop.order("own", "delta", 0.0)
        peer.socket.sendto(peer.datagram((2000, *NEUTRAL[1:]), count), peer.to)
        link.sleep(1.0)
        stage.loop.step()
        orders.append(stage.own.plant["delta_cmd"])
    assert link.counts["taken"] == 3
    full = stage.own.plant.ranges["delta"].high
    assert orders == [full, 0.0, full]
    peer.socket.close()
    link.close()


def test_wind_and_heel_are_told_in_its_axes() -> None:
    ship = load("kvlcc2_l7")
    wind = Uniform(U_T=5.0, gamma_T=math.radians(90.0))
    plant = Plant.of(ship, dt=0.01, environment=wind, start=(0, 0, 0, 2.0, 0, 0), n_P=approach(ship)[1])
    said = told(plant, Motion.of(plant))
    assert said["velocity_wind"] == pytest.approx([0.0, -5.0, 0.0], abs=1e-12)  # from the east is towards the west
    assert said["windvane"]["speed"] == pytest.approx(math.hypot(5.0, 2.0))
    assert said["windvane"]["direction"] == pytest.approx(math.atan2(5.0, 2.0))  # from starboard ahead
    assert said["imu"]["accel_body"] == pytest.approx([0.0, 0.0, -9.81])  # no tick, no change of speed

"""Limits of the links: how many clients, how often they may ask, which topics and paths they get."""

from __future__ import annotations

import asyncio
import json
import math
from contextlib import suppress
from dataclasses import replace
from typing import Any

import pytest

from scenes import FERRY, on_wire, scene
from seatrial.core.errors import RefusalError
from seatrial.realtime.links.n2k import identifier

pytest.importorskip("fastapi")
from seatrial.realtime.links import rosbridge, signalk
from seatrial.realtime.links.rosbridge import Rosbridge, _yaw
from seatrial.realtime.links.signalk import SignalK, _shaft, _Wanted, identity, tree


class Socket:
    """A browser's end that says what was put in, and keeps what it is told."""

    def __init__(self, *said: Any, **query: str) -> None:
        self.said, self.told, self.closed, self.accepted = list(said), list[Any](), list[int](), False
        self.query_params, self.headers = query, {"host": "here"}

    async def accept(self) -> None:
        self.accepted = True
        raise ConnectionAbortedError  # nothing more is wanted of it

    async def close(self, code: int = 1000, reason: str = "") -> None:
        self.closed.append(code)

    async def receive_text(self) -> str:
        if not self.said:
            raise ConnectionAbortedError
        return json.dumps(self.said.pop(0))

    async def send_json(self, data: Any) -> None:
        self.told.append(data)


def stage(name: str = "kvlcc2", **more: Any) -> Any:
    found, _ = on_wire(scene(FERRY, name=name, rate=2.0, **more))
    found.loop.run(2.0)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("link", [lambda: Rosbridge(stage()).talk, lambda: SignalK(stage()).stream])
def test_sixteen_clients_are_let_in(link: Any) -> None:
    talk = link()
    for there, let in ((15, True), (16, False)):
        talk.__self__._open = there
        socket = Socket()
        with suppress(ConnectionAbortedError):
            asyncio.run(talk(socket))
        assert socket.accepted is let
        assert socket.closed == ([] if let else [1008])


@pytest.mark.slow
@pytest.mark.parametrize(("count", "pauses"), [(199, 0), (200, 0), (201, 1), (450, 2)])
def test_more_than_two_hundred_requests_a_second_wait_for_the_next(
    count: int, pauses: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An autopilot in lock step may ask as much; nobody has more than its second's share of the ship's process."""
    slept: list[float] = []

    async def sleep(seconds: float) -> None:
        slept.append(seconds)

    monkeypatch.setattr("seatrial.realtime.links.rosbridge.asyncio.sleep", sleep)
    socket, bridge = Socket(*[{"op": "no"}] * count), Rosbridge(stage())
    with suppress(ConnectionAbortedError):
        asyncio.run(bridge._listen(socket, {}))  # type: ignore[arg-type]
    assert len(socket.told) == count
    assert len(slept) == pauses
    assert all(0.5 < one <= 1.0 for one in slept)
    assert socket.told[0] == {"op": "status", "level": "error", "msg": "no such op"}


@pytest.mark.parametrize(("count", "heard"), [(99, 99), (150, 100)])
def test_a_hundred_subscriptions_a_second_end_a_stream(count: int, heard: int) -> None:
    socket = Socket(*[{"subscribe": [{"path": f"a.{k}"}]} for k in range(count)])
    wanted = _Wanted("none")
    with suppress(ConnectionAbortedError):
        asyncio.run(signalk._listen(socket, wanted))  # type: ignore[arg-type]
    assert count - len(socket.said) == heard


@pytest.mark.slow
def test_a_topic_is_told_no_more_often_than_it_was_asked_for() -> None:
    bridge, wanted = Rosbridge(stage()), dict[str, float]()
    for throttle, period in ((0, 0.05), (49, 0.05), (500, 0.5), (-1, 0.05), (True, 0.05), ("x", 0.05), (1e7, 0.05)):
        bridge.obey({"op": "subscribe", "topic": "/odom", "throttle_rate": throttle}, wanted)
        assert wanted == {"/odom": pytest.approx(period)}
    with pytest.raises(RefusalError, match="no such topic"):
        bridge.obey({"op": "subscribe", "topic": "/no"}, wanted)
    bridge.obey({"op": "unsubscribe", "topic": "/odom"}, wanted)
    assert wanted == {}
    answer = bridge.obey({"op": "call_service", "service": "/rosapi/topics", "id": "7"}, wanted)
    assert answer is not None
    assert (answer["id"], answer["result"]) == ("7", True)
    assert len(answer["values"]["topics"]) == len(answer["values"]["types"])
    assert {"/cmd/delta", "/odom", "/delta"} <= set(answer["values"]["topics"])
    assert bridge.obey({"op": "call_service", "service": "/no"}, wanted)["result"] is False  # type: ignore[index]
    for topic, data in (("/odom", 1.0), ("/cmd/delta", True), ("/cmd/delta", 1e6), ("/cmd/delta", "1")):
        with pytest.raises(RefusalError):
            bridge.obey({"op": "publish", "topic": topic, "msg": {"data": data}}, wanted)


@pytest.mark.parametrize("psi", [0.0, 0.5 * math.pi, 2.0, -1.0])
def test_yaw_is_counted_from_east_to_port(psi: float) -> None:
    """The bow in the axes of REP 103: x east, y north."""
    q = _yaw(psi)
    assert (q["x"], q["y"]) == (0.0, 0.0)
    bow = 1.0 - 2.0 * q["z"] ** 2, 2.0 * q["z"] * q["w"]
    assert bow == pytest.approx((math.sin(psi), math.cos(psi)))


def test_odometry_is_of_the_ship_in_its_axes_and_of_the_time_of_the_scenario() -> None:
    here = stage(epoch=1_000_000_000.25)
    said = here.on_wire._voice.latest
    said |= {"psi": 0.4, "r": 0.03, "u": 4.0, "v_m": -0.5}
    said["latitude"], said["longitude"] = here.fittings.datum.place(100.0, -40.0)
    found: Any = Rosbridge(here).message("/odom")
    place = found["pose"]["pose"]["position"]
    assert (place["x"], place["y"]) == pytest.approx((-40.0, 100.0))
    twist = found["twist"]["twist"]
    assert (twist["linear"]["x"], twist["linear"]["y"], twist["angular"]["z"]) == (4.0, 0.5, -0.03)
    assert found["header"]["stamp"] == {"sec": 1_000_000_002, "nanosec": 250_000_000}
    imu: Any = Rosbridge(here).message("/imu")
    assert imu["angular_velocity"] == {"x": 0.0, "y": 0.0, "z": -0.03}
    assert imu["linear_acceleration_covariance"] == [-1.0, *[0.0] * 8]
    assert [len(imu[f"{name}_covariance"]) for name in ("orientation", "angular_velocity")] == [9, 9]
    del said["psi"]
    assert Rosbridge(here).message("/odom") is None


def test_subscriptions_are_patterns_a_hundred_at_most() -> None:
    wanted = _Wanted("self")
    assert wanted.takes("anything.at.all")
    assert not wanted.all
    assert _Wanted("all").all
    none = _Wanted("none")
    assert not none.takes("navigation.position")
    none.change({"subscribe": [{"path": "navigation.*"}, {"path": "x" * 100}, {"path": 3}, "rubble"]})
    assert none.takes("navigation.position")
    assert not none.takes("x" * 100)
    assert not none.all
    none.change({"context": "vessels.*", "subscribe": [{"path": "a"}]})
    assert none.all
    none.change({"unsubscribe": [{"path": "a"}]})
    assert not none.takes("a")
    none.change({"subscribe": [{"path": f"p{k}"} for k in range(200)]})
    assert (none.takes("p98"), none.takes("p99"), none.takes("p199")) == (True, False, False)
    none.change({"unsubscribe": [{"path": "*"}]})
    assert not none.takes("p1")


def test_what_the_full_model_is_made_of() -> None:
    found = tree({"": {"name": "a"}, "x.y": 1.0, "x.z": None, "x.w.v": 2.0}, "now")
    value = lambda one: {"value": one, "timestamp": "now", "$source": "seatrial"}  # noqa: E731
    assert found == {"name": "a", "x": {"y": value(1.0), "w": {"v": value(2.0)}}}
    assert [_shaft(number) for number in range(6)] == ["main", "starboard", "port", "starboard2", "port2", "starboard3"]
    for mmsi, named in ((199_999_999, False), (200_000_000, True), (799_999_999, True), (800_000_000, False)):
        urn, said = identity(mmsi, "a ship")
        assert ("mmsi" in said) is named
        assert urn.startswith("urn:mrn:imo:mmsi:" if named else "urn:mrn:signalk:uuid:")


@pytest.mark.parametrize(("U_A", "gamma_A", "u_w", "v_w"), [(10.0, 0.3, 4.0, 0.0), (6.0, -2.0, 5.0, -0.7)])
def test_wind_over_the_water_is_apparent_wind_less_the_way_of_the_ship(U_A, gamma_A, u_w, v_w) -> None:
    found = dict(signalk._wind({"U_A": U_A, "gamma_A": gamma_A % math.tau, "u_w": u_w, "v_w": v_w, "psi": 1.0,
                                "gamma_T_bow": 5.9}))  # fmt: skip
    over = complex(U_A * math.cos(gamma_A) - u_w, U_A * math.sin(gamma_A) - v_w)
    assert found["speedTrue"] == pytest.approx(abs(over))
    assert found["angleTrueWater"] == pytest.approx(math.atan2(over.imag, over.real))
    assert found["angleApparent"] == pytest.approx(gamma_A)
    assert found["directionTrue"] == pytest.approx((1.0 + 5.9) % math.tau)
    assert found["angleTrueGround"] == pytest.approx(5.9 - math.tau)


def test_a_frame_to_all_has_priority_group_and_source_in_their_bits() -> None:
    """PGN 127250 of source 35 with priority 2 is 0x09F11223."""
    assert identifier(127250) == 0x09F11223
    assert identifier(129025, source=7, priority=6) == 6 << 26 | 129025 << 8 | 7
    assert rosbridge._EVERY == 0.05


def test_of_two_rudders_the_starboard_one_is_told() -> None:
    here = stage()
    here.fittings = replace(here.fittings, rudders=("delta_1", "delta_2"))
    here.on_wire._voice.latest |= {"delta_1": 0.1, "delta_2": 0.2}
    assert signalk.values(here)["steering.rudderAngle"] == 0.2
    here.on_wire = None
    assert signalk.values(here) == {}

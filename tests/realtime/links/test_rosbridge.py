"""A ship as the WAM-V of the Virtual RobotX competition, and what tools of ROS ask, by the published protocol."""

from __future__ import annotations

import json
import math
import threading
from dataclasses import replace
from typing import Any

import pytest

from scenes import on_wire, scene
from seatrial.core.errors import RefusalError
from seatrial.environment import Environment
from seatrial.realtime.links.rosbridge import Rosbridge, pair
from seatrial.realtime.range.scenario import Weather
from seatrial.realtime.range.stage import Stage
from seatrial.ships.files import load

pytest.importorskip("fastapi")
from served import Served, heard

LEFT, RIGHT = (f"/wamv/thrusters/{side}/thrust" for side in ("left", "right"))


def afloat(name: str, **more: Any) -> tuple[Stage, Rosbridge]:
    """A ship at rest with its link."""
    given = scene(name=name, route=(), piloted=False, rate=20.0, **more)
    at_rest = replace(given, own=replace(given.own, sailing=replace(given.own.sailing, speed=0.0)))
    stage, _ = on_wire(at_rest)
    link = Rosbridge(stage)
    stage.loop.run(0.5)
    return stage, link


def push(link: Rosbridge, topic: str, value: float) -> None:
    assert link.obey({"op": "publish", "topic": topic, "msg": {"data": value}}, {}) is None


@pytest.mark.slow
@pytest.mark.parametrize(("name", "wanted"), [
    ("blueboat", 12.0), ("blueboat", -6.0), ("otter", 30.0), ("gunnerus", 9e3), ("revolt_3m", -4.0),
])  # fmt: skip
def test_newtons_of_a_wam_v_are_newtons_of_the_ship_at_rest(name: str, wanted: float) -> None:
    """Equal thrust on both sides drives the ship ahead with that of both, which its surge at rest tells."""
    stage, link = afloat(name)
    plant = stage.own.plant
    for topic in (LEFT, RIGHT):
        push(link, topic, wanted)
    stage.loop.run(0.1 if name == "blueboat" else 20.0)  # until the gear is there
    model: Any = plant.ship.model
    controls = tuple(plant[f"{one}_cmd"] for one in plant.controls)
    surge = float(model.derivative((0.0,) * 6, controls, Environment())[3])
    assert float(model.inertia.m_11) * surge == pytest.approx(2.0 * wanted, rel=2e-3)
    assert stage.on_wire is not None
    assert stage.on_wire.conning.commander == "rosbridge"


@pytest.mark.slow
def test_more_thrust_to_port_turns_to_starboard_and_joints_turn_to_port() -> None:
    stage, link = afloat("revolt_3m")
    push(link, LEFT, 5.0)
    push(link, RIGHT, -5.0)
    stage.loop.run(10.0)
    assert stage.own.plant["r"] > 0.0
    push(link, "/wamv/thrusters/left/pos", 0.4)
    push(link, "/wamv/thrusters/right/pos", -0.3)
    stage.loop.run(1.0)
    assert stage.own.plant["alpha_port_cmd"] == pytest.approx(-0.4, abs=2e-3)
    assert stage.own.plant["alpha_starboard_cmd"] == pytest.approx(0.3, abs=2e-3)
    assert stage.own.plant["f_port_cmd"] == pytest.approx(5.0, rel=1e-3)  # as it was


@pytest.mark.slow
def test_what_a_ship_cannot_do_is_refused_and_the_most_is_given() -> None:
    stage, link = afloat("blueboat")
    push(link, LEFT, 1e4)
    push(link, RIGHT, -1e4)
    push(link, "/wamv/thrusters/left/pos", 0.0)  # a stack that holds its joints straight
    stage.loop.run(0.2)
    assert [stage.own.plant[f"throttle_{side}_cmd"] for side in ("port", "starboard")] == [1.0, -1.0]
    with pytest.raises(RefusalError, match="do not turn"):
        push(link, "/wamv/thrusters/left/pos", 0.2)
    assert pair(load("kvlcc2")) == {} == pair(load("milliampere"))
    _, tanker = afloat("kvlcc2")
    assert not [topic for topic in (*tanker.topics, *tanker._cmd) if "wamv" in topic or "vrx" in topic]
    with pytest.raises(RefusalError, match="no orders on this topic"):
        push(tanker, LEFT, 1.0)


@pytest.mark.slow
def test_a_wam_v_hears_place_motion_time_and_wind() -> None:
    blow = Weather(0.0, 0.0, Environment(wind_x=0.0, wind_y=6.0))  # from the east
    stage, link = afloat("otter", weather=(blow,))
    for theirs, ours in (("/wamv/sensors/gps/gps/fix", "/fix"), ("/wamv/sensors/imu/imu/data", "/imu"),
                         ("/wamv/ground_truth/odometry", "/odom")):  # fmt: skip
        assert link.message(theirs) == link.message(ours) is not None
        assert link.topics[theirs] == link.topics[ours]
    assert link.message("/vrx/debug/wind/speed") == {"data": pytest.approx(6.0)}
    towards = link.message("/vrx/debug/wind/direction")
    assert towards is not None
    assert math.remainder(towards["data"] - 180.0, 360.0) == pytest.approx(0.0, abs=1e-9)  # to the west, from east
    clock = link.message("/clock")
    assert clock is not None
    assert clock["clock"]["sec"] + 1e-9 * clock["clock"]["nanosec"] == pytest.approx(
        stage.fittings.epoch + stage.loop.t, abs=1e-6)  # fmt: skip
    (moved,) = (link.message("/tf") or {})["transforms"]
    odom = (link.message("/odom") or {})["pose"]["pose"]
    assert moved["transform"] == {"translation": odom["position"], "rotation": odom["orientation"]}
    assert (moved["header"]["frame_id"], moved["child_frame_id"]) == ("odom", "base_link")


def asked(link: Rosbridge, service: str, **given: Any) -> dict[str, Any]:
    said = link.obey({"op": "call_service", "id": "a", "service": f"/rosapi/{service}", "args": given}, {})
    assert said is not None
    assert (said["op"], said["id"]) == ("service_response", "a")
    return said


@pytest.mark.slow
def test_rosapi_lists_what_there_is() -> None:
    _, link = afloat("otter")
    told = asked(link, "topics")["values"]
    kinds = dict(zip(told["topics"], told["types"], strict=True))
    assert kinds[LEFT] == kinds["/n_port"] == "std_msgs/msg/Float64"
    assert kinds["/tf"] == "tf2_msgs/msg/TFMessage"
    for topic, kind in kinds.items():
        assert asked(link, "topic_type", topic=topic)["values"] == {"type": kind}
        assert topic in asked(link, "topics_for_type", type=kind)["values"]["topics"]
        hears = topic in link._cmd
        assert asked(link, "publishers", topic=topic)["values"] == {"publishers": [] if hears else ["/seatrial"]}
        assert asked(link, "subscribers", topic=topic)["values"] == {"subscribers": ["/seatrial"] if hears else []}
    assert asked(link, "nodes")["values"] == {"nodes": ["/seatrial"]}
    node = asked(link, "node_details", node="/seatrial")["values"]
    assert {*node["publishing"], *node["subscribing"]} == kinds.keys()
    for service in asked(link, "services")["values"]["services"]:
        assert asked(link, service.removeprefix("/rosapi/"))["result"] is True
    assert asked(link, "get_time")["values"]["time"].keys() == {"sec", "nanosec"}
    for strange in ("fly", "topics/fly"):
        assert asked(link, strange)["result"] is False
    assert asked(link, "topic_type", topic="/none")["values"] == {"type": ""}


@pytest.mark.slow
def test_a_stack_drives_the_ship_over_a_socket() -> None:
    """By the messages that roslibpy sends: advertise, subscribe, publish."""
    stage, _ = afloat("otter")
    with Served(Rosbridge(stage)) as http, http.socket("/rosbridge") as ws:
        for side in ("left", "right"):
            topic = f"/wamv/thrusters/{side}/thrust"
            ws.send(json.dumps({"op": "advertise", "id": f"advertise:{topic}:1", "type": "std_msgs/msg/Float64",
                                "topic": topic, "latch": False, "queue_size": 100}))  # fmt: skip
            ws.send(json.dumps({"op": "publish", "id": f"publish:{topic}:2", "topic": topic, "msg": {"data": 40.0},
                                "latch": False}))  # fmt: skip
        ws.send(json.dumps({"op": "subscribe", "id": "s", "type": "nav_msgs/msg/Odometry", "compression": "none",
                            "topic": "/wamv/ground_truth/odometry", "throttle_rate": 0, "queue_length": 0}))
        assert heard(ws)["msg"]["child_frame_id"] == "base_link"
    stage.loop.run(10.0)
    assert stage.own.plant["u"] > 0.5


@pytest.mark.slow
def test_roslibpy_drives_the_ship() -> None:
    """The published client, where it is installed."""
    roslibpy = pytest.importorskip("roslibpy")
    stage, _ = afloat("otter")
    with Served(Rosbridge(stage)) as http:
        ros = roslibpy.Ros(f"ws://127.0.0.1:{http.port}/rosbridge", None)
        ros.run(timeout=10)
        try:
            assert LEFT in ros.get_topics()
            assert ros.get_topic_type("/tf") == "tf2_msgs/msg/TFMessage"
            fixed, seen = threading.Event(), list[dict[str, Any]]()
            fix = roslibpy.Topic(ros, "/wamv/sensors/gps/gps/fix", "sensor_msgs/msg/NavSatFix")
            fix.subscribe(lambda message: (seen.append(message), fixed.set()))
            for topic in (LEFT, RIGHT):
                roslibpy.Topic(ros, topic, "std_msgs/msg/Float64").publish(roslibpy.Message({"data": 40.0}))
            assert fixed.wait(10.0)
            assert seen[0]["latitude"] == pytest.approx(35.0, abs=1e-3)
        finally:
            ros.close()
    stage.loop.run(10.0)
    assert stage.own.plant["u"] > 0.5

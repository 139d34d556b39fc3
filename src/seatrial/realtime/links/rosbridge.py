"""Topics of ROS 2 by the rosbridge protocol (version 2, JSON) at the server of the page; ROS need not be there.

| topic | type | what |
|---|---|---|
| `/odom` | nav_msgs/msg/Odometry | position east, north; yaw; velocities ahead, to port, turning to port |
| `/imu` | sensor_msgs/msg/Imu | yaw and rate of turn; accelerations are not measured |
| `/fix` | sensor_msgs/msg/NavSatFix | place of the antenna |
| `/delta`, `/n_P`, ... | std_msgs/msg/Float64 | actual controls, with the signs of docs/conventions.md |
| `/cmd/delta`, `/cmd/n_P`, `/cmd/psi` | std_msgs/msg/Float64 | orders: rudder, revolutions, heading; the same signs |
| `/clock` | rosgraph_msgs/msg/Clock | time of the simulation |
| `/tf` | tf2_msgs/msg/TFMessage | `odom` to `base_link`, as REP 105 has them |

A ship with a thruster on either side also speaks as the WAM-V of the Virtual RobotX competition does, so that a stack
which is written for that drives it: `/wamv/sensors/gps/gps/fix`, `/wamv/sensors/imu/imu/data` and
`/wamv/ground_truth/odometry` beside the topics above, `/wamv/thrusters/left/thrust` and `right` [N] with `pos` [rad,
turning to port], and the wind of `/vrx/debug/wind/speed` and `direction`.

Frames are those of REP 103: x east, y north, z up, and of the ship x ahead, y to port.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from fastapi import FastAPI, WebSocket

from ...core.errors import RefusalError
from ...ships import Ship
from ..conning import thrusters
from ..helm import limits, ranges
from ..pages import Task, admitted, converse, hear, same_origin
from ..range.stage import Stage
from .orders import Orders

_EVERY, _MOST, _A_SECOND = 0.05, 16, 200
_ODOM, _IMU, _FIX, _NUMBER, _FLOAT, _CLOCK, _TF = (
    "nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu", "sensor_msgs/msg/NavSatFix", "std_msgs/msg/Float64",
    "std_msgs/msg/Float32", "rosgraph_msgs/msg/Clock", "tf2_msgs/msg/TFMessage",
)  # fmt: skip
_AS = {"/wamv/sensors/gps/gps/fix": "/fix", "/wamv/sensors/imu/imu/data": "/imu",
       "/wamv/ground_truth/odometry": "/odom"}  # fmt: skip
"""Topics of the WAM-V that say the same as ours."""
_WIND = {"/vrx/debug/wind/speed": 0, "/vrx/debug/wind/direction": 1}
_NODE = "/seatrial"
_STRAIGHT = 1e-3
"""A joint that is ordered by less than this is straight [rad]."""


class Rosbridge:
    """The rosbridge server of a stage."""

    def __init__(self, stage: Stage, key: str = "") -> None:
        """Serve a stage with a wire; `key` is required as `token=` where it is not empty."""
        self._stage, self._key, self._open = stage, key, 0
        orders = None if stage.on_wire is None else Orders(stage.loop, stage.on_wire, "rosbridge")
        self._cmd: Mapping[str, Callable[[float], None]] = {} if orders is None else {
            "/cmd/delta": orders.steer_rudder, "/cmd/n_P": orders.turn_shafts, "/cmd/psi": orders.steer_heading,
        }  # fmt: skip
        ship = stage.own.plant.ship
        own = {"/odom": _ODOM, "/imu": _IMU, "/fix": _FIX, "/clock": _CLOCK, "/tf": _TF}
        self.topics = {**own, **{f"/{name}": _NUMBER for name in ship.model.controls}}
        self._pair = pair(ship)
        if self._pair:
            self.topics |= {topic: own[as_] for topic, as_ in _AS.items()} | dict.fromkeys(_WIND, _FLOAT)
        if orders is not None:
            for side, thruster in self._pair.items():
                self._cmd = {**self._cmd, f"/wamv/thrusters/{side}/thrust": partial(_pushed, orders, thruster),
                             f"/wamv/thrusters/{side}/pos": partial(_turned, orders, thruster)}  # fmt: skip

    def routes(self, app: FastAPI) -> None:
        """Add the socket to the server of the page."""
        app.websocket("/rosbridge")(self.talk)

    async def talk(self, ws: WebSocket) -> None:
        """Serve one client until it disconnects."""
        known = admitted(self._key, ws.query_params.get("token"))
        if not same_origin(ws.headers) or not known or self._open >= _MOST:
            await ws.close(1008)
            return
        await ws.accept()
        self._open += 1
        wanted: dict[str, float] = {}
        try:
            await converse(ws, self._listen(ws, wanted), lambda hearing: self._tell(ws, wanted, hearing))
        finally:
            self._open -= 1

    async def _tell(self, ws: WebSocket, wanted: dict[str, float], hearing: Task) -> None:
        due: dict[str, float] = {}
        sent: dict[str, int] = {}
        while not hearing.done():
            now, k = asyncio.get_running_loop().time(), self._stage.loop.k
            for topic, period in tuple(wanted.items()):
                if sent.get(topic) != k and now >= due.get(topic, -math.inf) - 1e-3:
                    message = self.message(topic)
                    due[topic], sent[topic] = now + period, k
                    if message is not None:
                        said = {"op": "publish", "topic": topic, "msg": message}
                        await asyncio.wait_for(ws.send_json(said), 5.0)
            await asyncio.sleep(_EVERY)

    async def _listen(self, ws: WebSocket, wanted: dict[str, float]) -> None:
        loop = asyncio.get_running_loop()
        since, count = loop.time(), 0
        while True:
            said = await hear(ws)
            left, count = since + 1.0 - loop.time(), count + 1
            if count > _A_SECOND and left > 0.0:  # more are let wait, as in lock step a second may have many
                await asyncio.sleep(left)
            if count > _A_SECOND or left <= 0.0:
                since, count = loop.time(), 1
            try:
                answer = self.obey(said, wanted)
            except RefusalError as error:
                answer = {"op": "status", "level": "error", "msg": str(error)}
            if answer is not None:
                await asyncio.wait_for(ws.send_json(answer), 5.0)

    def obey(self, said: Mapping[str, Any], wanted: dict[str, float]) -> dict[str, Any] | None:
        """Carry out a request and return the answer, if there is one; RefusalError: it cannot be carried out."""
        what, topic = said.get("op"), said.get("topic")
        if what in ("advertise", "unadvertise", "set_level", "status", "auth"):
            return None
        if what == "subscribe":
            period = said.get("throttle_rate", 0)
            if not isinstance(topic, str) or topic not in self.topics:
                raise RefusalError(f"no such topic; there are {', '.join(self.topics)}")
            good = isinstance(period, int | float) and not isinstance(period, bool) and 0 <= period <= 1e6
            wanted[topic] = max(float(period) / 1000.0 if good else 0.0, _EVERY)
        elif what == "unsubscribe":
            wanted.pop(topic if isinstance(topic, str) else "", None)
        elif what == "publish":
            self._order(topic, said.get("msg"))
        elif what == "call_service":
            return self._service(said)
        else:
            raise RefusalError("no such op")
        return None

    def message(self, topic: str) -> dict[str, Any] | None:
        """The present message of a topic; None before the instruments have said what it needs."""
        stage, topic = self._stage, _AS.get(topic, topic)
        latest = {} if stage.on_wire is None else stage.on_wire.latest
        if topic == "/clock":
            return {"clock": self._header("")["stamp"]}
        if topic in _WIND:
            plant = stage.own.plant
            x, y = plant["wind_x"], plant["wind_y"]  # where it comes from, north and east
            return {"data": (math.hypot(x, y), math.degrees(math.atan2(-x, -y)))[_WIND[topic]]}
        if topic[1:] in latest and self.topics[topic] == _NUMBER:
            return {"data": latest[topic[1:]]}
        if topic == "/fix" and "latitude" in latest:
            return {"header": self._header("earth"), "status": {"status": 0, "service": 1},
                    "latitude": latest["latitude"], "longitude": latest["longitude"], "altitude": 0.0,
                    "position_covariance": [0.0] * 9, "position_covariance_type": 0}  # fmt: skip
        if topic == "/imu" and {"psi", "r"} <= latest.keys():
            unknown = [-1.0, *[0.0] * 8]  # not measured, as sensor_msgs/Imu says it
            return {"header": self._header("base_link"), "orientation": _yaw(latest["psi"]),
                    "orientation_covariance": [0.0] * 9, "angular_velocity": _vector(z=-latest["r"]),
                    "angular_velocity_covariance": [0.0] * 9, "linear_acceleration": _vector(),
                    "linear_acceleration_covariance": unknown}  # fmt: skip
        if topic == "/odom" and {"latitude", "psi", "r", "u", "v_m"} <= latest.keys():
            pose = self._pose(latest)
            twist = {"linear": _vector(latest["u"], -latest["v_m"]), "angular": _vector(z=-latest["r"])}
            return {"header": self._header("odom"), "child_frame_id": "base_link",
                    "pose": {"pose": pose, "covariance": [0.0] * 36},
                    "twist": {"twist": twist, "covariance": [0.0] * 36}}  # fmt: skip
        if topic == "/tf" and {"latitude", "psi"} <= latest.keys():
            pose = self._pose(latest)
            moved = {"translation": pose["position"], "rotation": pose["orientation"]}
            return {"transforms": [{"header": self._header("odom"), "child_frame_id": "base_link", "transform": moved}]}
        return None

    def _pose(self, latest: Mapping[str, float]) -> dict[str, Any]:
        x, y = self._stage.fittings.datum.north_east(latest["latitude"], latest["longitude"])
        return {"position": _vector(y, x), "orientation": _yaw(latest["psi"])}

    def _order(self, topic: Any, message: Any) -> None:
        value = message.get("data") if isinstance(message, dict) else None
        if not isinstance(topic, str) or topic not in self._cmd:
            raise RefusalError(f"no orders on this topic; there are {', '.join(self._cmd) or 'none'}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
            raise RefusalError(f"{topic}: data must be a number")
        self._cmd[topic](float(value))

    def _service(self, said: Mapping[str, Any]) -> dict[str, Any]:
        service, given = said.get("service"), said.get("args")
        asked = self._asked(str(service), given if isinstance(given, dict) else {})
        answer = {"op": "service_response", "service": str(service)[:200], "result": asked is not None,
                  "values": "no such service" if asked is None else asked}  # fmt: skip
        return answer | ({"id": said["id"]} if isinstance(said.get("id"), str) else {})

    def _asked(self, service: str, given: Mapping[str, Any]) -> dict[str, Any] | None:
        """What the node rosapi answers; None where it has no such service."""
        every = self.topics | dict.fromkeys(self._cmd, _NUMBER)
        wanted = str(given.get("type", ""))
        answers: dict[str, Callable[[], dict[str, Any]]] = {
            "topics": lambda: {"topics": list(every), "types": list(every.values())},
            "topic_type": lambda: {"type": every.get(str(given.get("topic", "")), "")},
            "topics_for_type": lambda: {"topics": [topic for topic, kind in every.items() if kind == wanted]},
            "publishers": lambda: {"publishers": [_NODE] if given.get("topic") in self.topics else []},
            "subscribers": lambda: {"subscribers": [_NODE] if given.get("topic") in self._cmd else []},
            "nodes": lambda: {"nodes": [_NODE]},
            "node_details": lambda: {"publishing": list(self.topics), "subscribing": list(self._cmd), "services": []}
            if given.get("node") == _NODE else {"publishing": [], "subscribing": [], "services": []},
            "services": lambda: {"services": [f"/rosapi/{name}" for name in answers]},
            "get_time": lambda: {"time": self._header("")["stamp"]},
        }  # fmt: skip
        room, _, name = service.rpartition("/")
        return answers[name]() if room == "/rosapi" and name in answers else None

    def _header(self, frame: str) -> dict[str, Any]:
        moment = self._stage.fittings.epoch + self._stage.loop.t
        whole = math.floor(moment)
        return {"stamp": {"sec": whole, "nanosec": round((moment - whole) * 1e9) % 1_000_000_000}, "frame_id": frame}


def _vector(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _yaw(psi: float) -> dict[str, float]:
    """Orientation of a level ship: yaw from east, counter-clockwise."""
    half = 0.5 * (0.5 * math.pi - psi)
    return {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}


@dataclass(frozen=True)
class Thruster:
    """A thruster as it is ordered.

    Attributes:
        number: in a sentence.
        full: what it is ordered to at most ahead and astern, in the unit of its control.
        thrust: what it gives at rest [N], by its control.
        turns: whether it is an azimuth.
    """

    number: int
    full: tuple[float, ...]
    thrust: Callable[[float], float]
    turns: bool

    def share(self, wanted: float) -> float:
        """Share of full at which it gives so much at rest [N], or the nearest that it can; it grows with the order."""
        if not wanted:
            return 0.0
        most, low, high = self.full[0] if wanted > 0.0 else -self.full[1], 0.0, 1.0
        if abs(self.thrust(most)) <= abs(wanted):
            return math.copysign(1.0, wanted)
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if abs(self.thrust(middle * most)) < abs(wanted) else (low, middle)
        return math.copysign(high, wanted)


def pair(ship: Ship) -> Mapping[str, Thruster]:
    """The outermost thrusters to port and to starboard that give thrust ahead; none where a side has none."""
    known, parts, whole = dict[float, Thruster](), ship.model.thrusters_by_name, ranges(ship)
    for number, (control, azimuth) in thrusters(ship).items():
        part = parts.get(control.partition("_")[2])
        place = getattr(part, "y", None)
        if place is None or control not in whole:
            continue
        full = tuple(abs(one) if math.isfinite(one) else whole[control].full for one in reversed(limits(ship, control)))
        known[float(place)] = Thruster(number, full, getattr(part, "thrust", float), azimuth is not None)
    if not known or not min(known) < 0.0 < max(known):
        return {}
    return {"left": known[min(known)], "right": known[max(known)]}


def _pushed(orders: Orders, one: Thruster, wanted: float) -> None:
    orders.push(one.number, one.share(wanted))


def _turned(orders: Orders, one: Thruster, angle: float) -> None:
    """A joint turns to port where ours turn to starboard."""
    if one.turns:
        orders.push(one.number, azimuth=-angle)
    elif abs(angle) > _STRAIGHT:
        raise RefusalError("the thrusters of this ship do not turn")

"""Topics of ROS 2 by the rosbridge protocol (version 2, JSON) at the server of the page; ROS need not be there.

| topic | type | what |
|---|---|---|
| `/odom` | nav_msgs/msg/Odometry | position east, north; yaw; velocities ahead, to port, turning to port |
| `/imu` | sensor_msgs/msg/Imu | yaw and rate of turn; accelerations are not measured |
| `/fix` | sensor_msgs/msg/NavSatFix | place of the antenna |
| `/delta`, `/n_P`, ... | std_msgs/msg/Float64 | actual controls, with the signs of docs/conventions.md |
| `/cmd/delta`, `/cmd/n_P`, `/cmd/psi` | std_msgs/msg/Float64 | orders: rudder, revolutions, heading; the same signs |

Frames are those of REP 103: x east, y north, z up, and of the ship x ahead, y to port.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Mapping
from typing import Any

from fastapi import FastAPI, WebSocket

from ...core.errors import RefusalError
from ..pages import Task, admitted, converse, hear, same_origin
from ..range.stage import Stage
from .orders import Orders

_EVERY, _MOST, _A_SECOND = 0.05, 16, 200
_ODOM, _IMU, _FIX, _NUMBER = (
    "nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu", "sensor_msgs/msg/NavSatFix", "std_msgs/msg/Float64",
)  # fmt: skip


class Rosbridge:
    """The rosbridge server of a stage."""

    def __init__(self, stage: Stage, key: str = "") -> None:
        """Serve a stage with a wire; `key` is required as `token=` where it is not empty."""
        self._stage, self._key, self._open = stage, key, 0
        orders = None if stage.on_wire is None else Orders(stage.loop, stage.on_wire, "rosbridge")
        self._cmd: Mapping[str, Callable[[float], None]] = {} if orders is None else {
            "/cmd/delta": orders.steer_rudder, "/cmd/n_P": orders.turn_shafts, "/cmd/psi": orders.steer_heading,
        }  # fmt: skip
        controls = stage.loop.vessels["own"].plant.controls
        self.topics = {"/odom": _ODOM, "/imu": _IMU, "/fix": _FIX, **{f"/{name}": _NUMBER for name in controls}}

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
        stage = self._stage
        latest = {} if stage.on_wire is None else stage.on_wire.latest
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
            x, y = stage.fittings.datum.north_east(latest["latitude"], latest["longitude"])
            pose = {"position": _vector(y, x), "orientation": _yaw(latest["psi"])}
            twist = {"linear": _vector(latest["u"], -latest["v_m"]), "angular": _vector(z=-latest["r"])}
            return {"header": self._header("odom"), "child_frame_id": "base_link",
                    "pose": {"pose": pose, "covariance": [0.0] * 36},
                    "twist": {"twist": twist, "covariance": [0.0] * 36}}  # fmt: skip
        return None

    def _order(self, topic: Any, message: Any) -> None:
        value = message.get("data") if isinstance(message, dict) else None
        if not isinstance(topic, str) or topic not in self._cmd:
            raise RefusalError(f"no orders on this topic; there are {', '.join(self._cmd) or 'none'}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
            raise RefusalError(f"{topic}: data must be a number")
        self._cmd[topic](float(value))

    def _service(self, said: Mapping[str, Any]) -> dict[str, Any]:
        service = said.get("service")
        known = service == "/rosapi/topics"
        found = {"topics": [*self.topics, *self._cmd], "types": [*self.topics.values(), *[_NUMBER] * len(self._cmd)]}
        answer = {"op": "service_response", "service": str(service)[:200], "result": known,
                  "values": found if known else "no such service"}  # fmt: skip
        return answer | ({"id": said["id"]} if isinstance(said.get("id"), str) else {})

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

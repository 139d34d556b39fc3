"""Signal K at the server of the page: deltas over a WebSocket, the data tree, and the autopilot interface of version 2.

Paths, units and signs are those of the Signal K specification 1.7: SI and radians, rudder positive to starboard, wind
angles positive to starboard.  What is told is what the instruments say; revolutions below zero turn astern, with gear
Reverse.  Full model and messages are valid by the published schema (`@signalk/signalk-schema`).
"""

from __future__ import annotations

import asyncio
import hashlib
import json
import math
import uuid
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from typing import Any

from fastapi import Depends, FastAPI, Request, WebSocket
from starlette.responses import JSONResponse, Response

from ...core.errors import AccessError, RefusalError
from ...core.version import __version__
from ...data.nmea.ais import TYPES, Status, Type
from ..pages import Task, admitted, body, close, converse, hear, same_origin
from ..range.alerts import CPA, GNSS, GYRO, KEEL, PILOT, RUDDER, TRACK, Alarm
from ..range.scenario import Sailing
from ..range.stage import Stage
from .orders import Orders

_API, _V2 = "/signalk/v1/api", "/signalk/v2/api/vessels/self/autopilots"
_PILOT = "seatrial"
_EVERY, _CONTACTS = 0.1, 2.0
"""Time between two looks for new values, and between two reports of other ships [s of the clock, simulated s]."""

_MOST, _LARGEST = 16, 2048
_NUMBERS: Mapping[str, str] = {
    "psi": "navigation.headingTrue", "r": "navigation.rateOfTurn", "U": "navigation.speedOverGround",
    "chi": "navigation.courseOverGroundTrue", "u_w": "navigation.speedThroughWater",
    "U_A": "environment.wind.speedApparent", "U_T": "environment.wind.speedOverGround",
    "below": "environment.depth.belowTransducer",
}  # fmt: skip
"""Paths of values that are told as they are measured."""

_NOTICES: Mapping[int, str] = {
    CPA: "navigation.closestApproach", GYRO: "navigation.headingTrue", GNSS: "navigation.position",
    RUDDER: "steering.rudderAngle", TRACK: "navigation.crossTrackError", PILOT: "steering.autopilot",
    KEEL: "environment.depth.belowKeel",
}  # fmt: skip
"""Paths of alarms below `notifications`; those of which there may be several have their instance as a further part."""

_GRADES = {"A": "alarm", "W": "warn", "C": "alert"}
_STATES: Mapping[Status, str] = {
    "under way": "motoring", "at anchor": "anchored", "restricted": "restricted manouverability",
    "constrained by draught": "constrained by draft",
}  # fmt: skip
"""Navigational status in the words of the schema, where they are others."""
_TYPES: Mapping[Type, str] = {
    "dredging": "Engaged in dredging or underwater operations", "diving": "Engaged in diving operations",
    "military": "Engaged in military operations", "high-speed": "High speed craft", "pilot": "Pilot vessel",
    "rescue": "SAR", "passenger": "Passenger ship", "cargo": "Cargo ship",
}  # fmt: skip
"""Types of ship in the words of the schema, where they are others."""


def values(stage: Stage) -> dict[str, Any]:
    """What the own ship's instruments say, by path."""
    on_wire = stage.on_wire
    said: dict[str, Any] = {}
    if on_wire is None:
        return said
    latest = on_wire.latest
    said.update({path: latest[name] for name, path in _NUMBERS.items() if name in latest})
    if "latitude" in latest:
        said["navigation.position"] = {"latitude": latest["latitude"], "longitude": latest["longitude"]}
    said.update({f"environment.wind.{name}": value for name, value in _wind(latest)})
    if stage.fittings.variation is not None:
        said["navigation.magneticVariation"] = stage.fittings.variation
        if "psi" in latest:
            said["navigation.headingMagnetic"] = (latest["psi"] - stage.fittings.variation) % math.tau
    rudder = "".join(stage.fittings.rudders[-1:])
    if rudder in latest:
        said["steering.rudderAngle"] = latest[rudder]
    for name, number in stage.fittings.numbers.items():
        if name in latest:
            shaft, n = f"propulsion.{_shaft(number)}", latest[name]
            said[f"{shaft}.revolutions"] = n
            said[f"{shaft}.transmission.gear"] = "Forward" if n > 0.0 else "Reverse" if n < 0.0 else "Neutral"
    conning = on_wire.conning
    said["steering.autopilot.state"] = "auto" if conning.mode in ("heading", "track") else "standby"
    said["steering.autopilot.target.headingTrue"] = conning.control.course
    said.update(_transponded(stage.scenario.own.sailing))
    said.update(_notice(alarm) for alarm in tuple(stage.alarms.alarms.values()))
    return said


def _wind(latest: Mapping[str, float]) -> Iterator[tuple[str, float]]:
    """Angles of the wind, and the wind over the water, which no instrument measures: apparent less the ship's speed."""
    for name, path in (("gamma_A", "angleApparent"), ("gamma_T_bow", "angleTrueGround")):
        if name in latest:
            yield path, math.remainder(latest[name], math.tau)
    if {"gamma_T_bow", "psi"} <= latest.keys():
        yield "directionTrue", (latest["psi"] + latest["gamma_T_bow"]) % math.tau
    if {"U_A", "gamma_A", "u_w"} <= latest.keys():
        ahead = latest["U_A"] * math.cos(latest["gamma_A"]) - latest["u_w"]
        aside = latest["U_A"] * math.sin(latest["gamma_A"]) - latest.get("v_w", 0.0)
        yield "speedTrue", math.hypot(ahead, aside)
        yield "angleTrueWater", math.atan2(aside, ahead)


def _shaft(number: int) -> str:
    """Name of a shaft from its number in RPM: 0 amidships, odd to starboard, even to port."""
    row = (number + 1) // 2
    return "main" if number == 0 else ("starboard" if number % 2 else "port") + (str(row) if row > 1 else "")


def _notice(alarm: Alarm) -> tuple[str, dict[str, Any]]:
    """Path and value of an alarm: to be seen until it is acknowledged, and heard while it lasts."""
    cause, over = alarm.cause, alarm.state in ("U", "N")
    several = f".{cause.instance}" if cause.identifier in (CPA, RUDDER) else ""
    method = {"V": ["visual", "sound"], "U": ["visual"], "A": ["visual"]}.get(alarm.state, [])
    state = "normal" if over else _GRADES[cause.priority]
    return f"notifications.{_NOTICES[cause.identifier]}{several}", {
        "state": state, "method": method, "message": cause.text}  # fmt: skip


def _transponded(sailing: Sailing) -> Iterator[tuple[str, Any]]:
    """What a transponder says of its ship, by the names of the schema."""
    yield "navigation.state", _STATES.get(sailing.status, sailing.status)
    if sailing.kind is not None:
        name = _TYPES.get(sailing.kind, sailing.kind.capitalize())
        yield "design.aisShipType", {"id": TYPES[sailing.kind], "name": name}


def contacts(stage: Stage) -> Iterator[tuple[str, dict[str, Any]]]:
    """Context and values of each ship with a transponder."""
    for other in stage.scenario.others:
        seen = stage.contacts.seen.get(other.name)
        if seen is None or other.ais == "none" or stage.on_wire is None:
            continue
        plant = stage.loop.vessels[other.name].plant
        latitude, longitude = stage.fittings.datum.place(plant["x"], plant["y"])
        name, known = identity(stage.mmsi(other.name), f"{stage.scenario.title} {other.name}")
        yield f"vessels.{name}", {
            "": {**known, "name": other.name},
            "navigation.position": {"latitude": latitude, "longitude": longitude},
            "navigation.speedOverGround": seen.U, "navigation.courseOverGroundTrue": seen.chi % math.tau,
            "navigation.headingTrue": plant["psi"] % math.tau, **dict(_transponded(other.sailing)),
        }  # fmt: skip


def identity(mmsi: int, name: str) -> tuple[str, dict[str, str]]:
    """URN of a ship, and what it says of itself: by its MMSI, or else by a UUID that is the same in each run."""
    if 200_000_000 <= mmsi < 800_000_000:  # those of ships; the schema knows no other
        return f"urn:mrn:imo:mmsi:{mmsi}", {"mmsi": str(mmsi)}
    urn = f"urn:mrn:signalk:uuid:{uuid.UUID(bytes=hashlib.sha256(name.encode()).digest()[:16], version=4)}"
    return urn, {"uuid": urn}


def delta(about: str, stamp: str, said: Mapping[str, Any]) -> dict[str, Any]:
    """A delta message."""
    pairs = [{"path": path, "value": value} for path, value in said.items()]
    return {"context": about, "updates": [{"$source": _PILOT, "timestamp": stamp, "values": pairs}]}


def tree(said: Mapping[str, Any], stamp: str) -> dict[str, Any]:
    """Values as the nested data of the full model, which has none for what is not known."""
    found: dict[str, Any] = dict(said.get("", {}))
    for path, value in said.items():
        if path == "" or value is None:
            continue
        here = found
        for part in path.split("."):
            here = here.setdefault(part, {})
        here.update({"value": value, "timestamp": stamp, "$source": _PILOT})
    return found


class SignalK:
    """The Signal K server of a stage."""

    def __init__(self, stage: Stage, key: str = "") -> None:
        """Serve a stage with a wire; `key` is required as bearer token or `token=` where it is not empty."""
        self._stage, self._key = stage, key
        self._orders = None if stage.on_wire is None else Orders(stage.loop, stage.on_wire, "signalk")
        self._open = 0

    def routes(self, app: FastAPI) -> None:
        """Add the routes to the server of the page."""
        app.get("/signalk")(self.endpoints)
        key = [Depends(self._known)]
        app.exception_handler(AccessError)(_refused)
        app.get(f"{_API}/{{path:path}}", dependencies=key)(self.full)
        app.get(_V2, dependencies=key)(self.pilots)
        app.get(f"{_V2}/{{name}}/{{what:path}}", dependencies=key)(self.pilot)
        app.get(f"{_V2}/{{name}}", dependencies=key)(self.pilot)
        app.put(f"{_V2}/{{name}}/{{what:path}}", dependencies=key)(self.order)
        app.post(f"{_V2}/{{name}}/{{what:path}}", dependencies=key)(self.order)
        app.websocket("/signalk/v1/stream")(self.stream)

    async def endpoints(self, request: Request) -> Response:
        host = request.headers.get("host", "localhost")
        v1 = {"version": "1.7.0", "signalk-http": f"http://{host}{_API}/",
              "signalk-ws": f"ws://{host}/signalk/v1/stream"}  # fmt: skip
        return JSONResponse({"endpoints": {"v1": v1, "v2": {"version": "2.0.0", "signalk-http":
                            f"http://{host}/signalk/v2/api/"}}, "server": {"id": _PILOT, "version": __version__}})

    async def full(self, path: str) -> Response:
        own, stamp = self._own, self._stamp()
        ships = [(own, self._said()), *contacts(self._stage)]
        found: Any = {"version": "1.7.0", "self": own, "sources": {_PILOT: {"label": _PILOT, "type": "seatrial"}},
                      "vessels": {about.partition(".")[2]: tree(said, stamp) for about, said in ships}}  # fmt: skip
        parts = [part for part in path.split("/") if part]
        if parts[:2] == ["vessels", "self"]:
            parts[1] = own.partition(".")[2]
        for part in parts:
            if not isinstance(found, dict) or part not in found:
                return _error(404, "no such path")
            found = found[part]
        return JSONResponse(found)

    async def pilots(self) -> Response:
        return JSONResponse({_PILOT: {"provider": _PILOT, "isDefault": True}})

    async def pilot(self, name: str, what: str = "") -> Response:
        if name == "_providers":
            return JSONResponse({"id": _PILOT})
        told = self._told()
        if name not in (_PILOT, "_default") or (what and what not in told):
            return _error(404, "no such autopilot, or nothing of it by that name")
        if what in ("state", "mode", "target"):
            return JSONResponse({"value": told[what]})
        return JSONResponse(told[what] if what else told)

    async def order(self, request: Request, name: str, what: str) -> Response:
        """PUT state, mode, target and target/adjust; POST engage and disengage."""
        if not same_origin(request.headers):
            return _error(403, "orders come from this server's own pages, or from programs")
        if name not in (_PILOT, "_default"):
            return _error(404, "no such autopilot")
        try:
            data = await body(request, _LARGEST)
            given = json.loads(data) if data else {}
            self._obey(request.method, what, given if isinstance(given, dict) else {})
        except RefusalError as error:
            return _error(400, str(error))
        except (ValueError, RecursionError):
            return _error(400, f"the body must be a JSON object of at most {_LARGEST} bytes")
        return JSONResponse({"state": "COMPLETED", "statusCode": 200, "message": "OK"})

    async def stream(self, ws: WebSocket) -> None:
        """Deltas, of the own ship or of all, until the client disconnects."""
        if not same_origin(ws.headers) or self._open >= _MOST:
            await ws.close(1008)
            return
        await ws.accept()
        if not self._allowed(ws):
            await close(ws, "a key is needed")
            return
        self._open += 1
        wanted = _Wanted(ws.query_params.get("subscribe", "self"))
        try:
            await converse(ws, _listen(ws, wanted), lambda hearing: self._tell(ws, wanted, hearing))
        finally:
            self._open -= 1

    async def _tell(self, ws: WebSocket, wanted: _Wanted, hearing: Task) -> None:
        await ws.send_json({"name": _PILOT, "version": "1.7.0", "self": self._own, "roles": ["master", "main"],
                            "timestamp": self._stamp()})  # fmt: skip
        before: dict[str, Any] = {}
        due = -math.inf
        while not hearing.done():
            now, t = values(self._stage), self._stage.loop.t
            fresh = {path: value for path, value in now.items() if before.get(path, before) != value}
            before = now
            told = {path: value for path, value in fresh.items() if wanted.takes(path)}
            if told:
                await asyncio.wait_for(ws.send_json(delta(self._own, self._stamp(), told)), 5.0)
            if wanted.all and t >= due:
                due = t + _CONTACTS
                for about, said in tuple(contacts(self._stage)):
                    await asyncio.wait_for(ws.send_json(delta(about, self._stamp(), said)), 5.0)
            await asyncio.sleep(_EVERY)

    @property
    def _own(self) -> str:
        return f"vessels.{self._identity()[0]}"

    def _identity(self) -> tuple[str, dict[str, str]]:
        own = self._stage.scenario.own
        return identity(own.sailing.mmsi, f"{self._stage.scenario.title} own {own.ship.name}")

    def _said(self) -> dict[str, Any]:
        return {"": {**self._identity()[1], "name": self._stage.scenario.own.ship.name}, **values(self._stage)}

    def _stamp(self) -> str:
        moment = datetime.fromtimestamp(self._stage.fittings.epoch + self._stage.loop.t, UTC)
        return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")

    def _allowed(self, asking: Request | WebSocket) -> bool:
        header = asking.headers.get("authorization", "").removeprefix("Bearer ")
        return admitted(self._key, header or asking.query_params.get("token"))

    async def _known(self, request: Request) -> None:
        """Of every route that reads or orders: whoever asks must have the key."""
        if not self._allowed(request):
            raise AccessError("a key is needed")

    def _told(self) -> dict[str, Any]:
        orders = self._orders
        heading = None if orders is None else orders.heading
        engaged = heading is not None
        states = [{"name": "auto", "engaged": True}, {"name": "standby", "engaged": False}]
        return {"options": {"states": states, "modes": ["compass"], "actions": []},
                "state": "auto" if engaged else "standby", "mode": "compass", "target": heading,
                "engaged": engaged}  # fmt: skip

    def _obey(self, method: str, what: str, given: Mapping[str, Any]) -> None:
        orders = self._orders
        if orders is None:
            raise RefusalError("there is no wire to steer by")
        if what == "state" and method == "PUT":
            what = {"auto": "engage", "standby": "disengage"}.get(str(given.get("value")), "")
        elif what == "mode" and given.get("value") == "compass":
            return
        if what == "engage":
            orders.steer_heading(self._heading() if orders.heading is None else orders.heading)
        elif what == "disengage":
            orders.let_go()
        elif what == "target":
            orders.steer_heading(_angle(given))
        elif what == "target/adjust":
            orders.steer_heading((self._heading() if orders.heading is None else orders.heading) + _angle(given))
        else:
            raise RefusalError("states are auto and standby, the mode is compass, and there are no actions")

    def _heading(self) -> float:
        """The present heading by the compass."""
        on_wire = self._stage.on_wire
        if on_wire is None or "psi" not in on_wire.latest:
            raise RefusalError("there is no heading yet")
        return on_wire.latest["psi"]


def _refused(_: Request, error: Exception) -> Response:
    return _error(401, str(error))


class _Wanted:
    """What a client has subscribed to.

    Attributes:
        all: whether other ships are told too.
    """

    def __init__(self, text: str) -> None:
        self.all = text == "all"
        self._paths: set[str] = set() if text == "none" else {"*"}

    def takes(self, path: str) -> bool:
        """Whether values of a path are told."""
        return any(fnmatchcase(path, pattern) for pattern in self._paths)

    def change(self, said: Mapping[str, Any]) -> None:
        """Subscribe or unsubscribe."""
        for what in ("subscribe", "unsubscribe"):
            rows = said.get(what)
            paths = [row.get("path") for row in rows if isinstance(row, dict)] if isinstance(rows, list) else []
            for path in (path for path in paths if isinstance(path, str) and len(path) < 100):
                if what == "unsubscribe":
                    self._paths = set() if path == "*" else self._paths - {path}
                elif len(self._paths) < 100:
                    self._paths = self._paths | {path}
                    self.all = self.all or said.get("context") in ("*", "vessels.*")


async def _listen(ws: WebSocket, wanted: _Wanted) -> None:
    """Hear subscriptions until the client disconnects, or sends more than a hundred a second."""
    loop = asyncio.get_running_loop()
    since, count = loop.time(), 0
    while count < 100:
        said = await hear(ws)
        count = count + 1 if loop.time() - since < 1.0 else 0
        since = since if count else loop.time()
        wanted.change(said)


def _angle(given: Mapping[str, Any]) -> float:
    """An angle of a request [rad]; given in degrees or radians, radians unless it says so."""
    value, units = given.get("value"), given.get("units", "rad")
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
        raise RefusalError("value must be a number")
    if units not in ("rad", "deg"):
        raise RefusalError("units are rad or deg")
    return math.radians(value) if units == "deg" else float(value)


def _error(code: int, text: str) -> Response:
    """The answer to a request that is refused; the connection ends, with whatever of the request was not read."""
    return JSONResponse({"state": "FAILED", "statusCode": code, "message": text}, code, {"Connection": "close"})

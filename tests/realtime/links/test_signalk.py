"""Signal K by its schema: names, identities, wind, other ships, alarms; refusals say so, and a key keeps all."""

from __future__ import annotations

import json
import math
import os
import re
import socket
from dataclasses import replace
from datetime import datetime
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pytest

from scenes import FERRY, Fault, Weather, on_wire, scene
from seatrial.data.nmea import ais
from seatrial.data.nmea.sentences import Sentence, encode
from seatrial.environment import Environment
from seatrial.realtime.range.scenario import Sailing
from seatrial.realtime.range.stage import Stage
from seatrial.realtime.wire import Authority

pytest.importorskip("fastapi")
from served import Served, heard
from websockets.exceptions import InvalidStatus

from seatrial.realtime.links import signalk
from seatrial.realtime.links.rosbridge import Rosbridge
from seatrial.realtime.links.signalk import SignalK, _shaft, _transponded, identity, values

PILOT = "/signalk/v2/api/vessels/self/autopilots/seatrial"
DEG = math.pi / 180.0


def sailing(*others: Any, seconds: float = 3.0, page: bool = False, **more: Any) -> Stage:
    line = more.pop("line", {})
    stage, _ = on_wire(scene(*others, name=more.pop("name", "kvlcc2"), **more), page, **line)
    stage.loop.run(seconds)
    return stage


def full(stage: Stage) -> Any:
    with Served(SignalK(stage)) as http:
        return http.get("/signalk/v1/api/").json()


# --- the schema ---

UUID = r"[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"
URN = rf"^urn:mrn:(imo:mmsi:[2-7]\d{{8}}|signalk:uuid:{UUID})$"


def _leaf(value: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "required": ["value", "timestamp", "$source"],
            "properties": {"value": value, "timestamp": {"type": "string", "pattern": "Z$"}}}  # fmt: skip


def _branch(only: bool = True, **kinds: Any) -> dict[str, Any]:
    return {"type": "object", "additionalProperties": not only, "properties": kinds}


NUMBER, ANGLE = _leaf({"type": "number"}), _leaf({"type": "number", "minimum": -math.pi, "maximum": math.tau})
NOTICE = _leaf({"type": "object", "required": ["state", "method", "message"], "properties": {
    "state": {"enum": ["nominal", "normal", "alert", "warn", "alarm", "emergency"]},
    "method": {"type": "array", "items": {"enum": ["visual", "sound"]}}}})  # fmt: skip
SHAFT = _branch(revolutions=NUMBER, transmission=_branch(gear=_leaf({"enum": ["Forward", "Neutral", "Reverse"]})))
PLACE = _leaf({"type": "object", "required": ["latitude", "longitude"]})
VESSEL = _branch(
    mmsi={"type": "string", "pattern": r"^[2-7]\d{8}$"}, uuid={"type": "string", "pattern": URN},
    name={"type": "string"},
    navigation=_branch(position=PLACE, rateOfTurn=NUMBER, speedOverGround=NUMBER, speedThroughWater=NUMBER,
                       headingTrue=ANGLE, headingMagnetic=ANGLE, courseOverGroundTrue=ANGLE, magneticVariation=ANGLE,
                       state=_leaf({"enum": [
                           "not under command", "anchored", "moored", "sailing", "motoring", "fishing", "aground",
                           "restricted manouverability", "constrained by draft"]})),
    design=_branch(aisShipType=_leaf({"enum": [{"id": 60, "name": "Passenger ship"}, {"id": 52, "name": "Tug"}]})),
    environment=_branch(
        wind=_branch(speedApparent=NUMBER, speedTrue=NUMBER, speedOverGround=NUMBER, angleApparent=ANGLE,
                     angleTrueWater=ANGLE, angleTrueGround=ANGLE, directionTrue=ANGLE),
        depth=_branch(belowTransducer=NUMBER)),
    steering=_branch(rudderAngle=ANGLE, autopilot=_branch(state=_leaf({"enum": ["auto", "standby"]}),
                                                          target=_branch(headingTrue=ANGLE))),
    propulsion={"type": "object", "patternProperties": {"^[A-Za-z0-9]+$": SHAFT}, "additionalProperties": False},
    notifications={"$ref": "#/definitions/notices"},
)  # fmt: skip
RULES = {
    "type": "object", "required": ["version", "self", "vessels"],
    "properties": {
        "self": {"type": "string", "pattern": URN.replace("^urn", r"^vessels\.urn")},
        "vessels": {"type": "object", "additionalProperties": False, "patternProperties": {
            URN: {"allOf": [VESSEL, {"anyOf": [{"required": ["mmsi"]}, {"required": ["uuid"]}]}]}}}},
    "definitions": {"notices": {"type": "object", "additionalProperties": False, "patternProperties": {
        "^[A-Za-z0-9-]+$": {"oneOf": [NOTICE, {"$ref": "#/definitions/notices"}]}}}},
}  # fmt: skip
"""What the specification says of the branches that seatrial fills (Signal K 1.7, vessel, propulsion, notifications)."""


def sea_of_all() -> tuple[Stage, ...]:
    """Ships with and without MMSI, on one shaft and on two, ahead and astern, with alarms."""
    ferry = replace(FERRY, sailing=replace(FERRY.sailing, kind="passenger", status="restricted"))
    quiet = sailing(ferry, variation=-0.1, faults=(Fault("silent", "gyro", at=1.0),), seconds=9.0)
    twin = sailing(name="gms_110")
    twin.loop.order("own", "n_P", -1.0)
    twin.loop.run(60.0)
    return quiet, twin


@pytest.mark.slow
def test_the_full_model_keeps_the_rules_of_the_specification():
    jsonschema = pytest.importorskip("jsonschema")
    for stage in sea_of_all():
        found = jsonschema.Draft4Validator(RULES).iter_errors(full(stage))
        assert [f"{list(e.absolute_path)}: {e.message}" for e in found] == []


@pytest.mark.slow
def test_the_full_model_hello_and_deltas_are_valid_by_the_published_schema():
    """The schema is CC BY-SA: `npm pack @signalk/signalk-schema`, unpack, and name its folder of schemas."""
    jsonschema, folder = pytest.importorskip("jsonschema"), os.environ.get("SEATRIAL_SIGNALK_SCHEMA", "")
    if not folder or not Path(folder, "signalk.json").exists():
        pytest.skip("SEATRIAL_SIGNALK_SCHEMA is no folder of schemas: npm pack @signalk/signalk-schema")
    referencing = pytest.importorskip("referencing")
    from referencing.jsonschema import DRAFT4

    texts = {path: json.loads(path.read_text()) for path in Path(folder).rglob("*.json")}
    kept = referencing.Registry()
    for path, text in texts.items():
        one = referencing.Resource.from_contents(text, default_specification=DRAFT4)
        base = texts[Path(folder, "signalk.json")]["id"].rpartition("/")[0]
        kept = kept.with_resources([(text.get("id", "").rstrip("#") or str(path), one),
                                    (f"{base}/{path.relative_to(folder).as_posix()}", one)])  # fmt: skip

    def wrong(name: str, said: Any) -> list[str]:
        found = jsonschema.Draft4Validator(texts[Path(folder, name)], registry=kept).iter_errors(said)
        return [f"{list(e.absolute_path)}: {e.message}" for e in found]

    for stage in sea_of_all():
        assert wrong("signalk.json", full(stage)) == []
        with Served(SignalK(stage)) as http, http.socket("/signalk/v1/stream?subscribe=all") as ws:
            assert wrong("hello.json", heard(ws)) == []
            assert wrong("delta.json", heard(ws)) == []
    quiet, told = sea_of_all()[0], full(sea_of_all()[0])
    own = next(one for one in told["vessels"].values() if one["name"] == quiet.scenario.own.ship.name)
    for kind, status in zip_longest(ais.TYPES, ais.STATUSES, fillvalue="under way"):
        leaves = dict(_transponded(Sailing(0.0, 0.0, 0.0, 1.0, kind=kind, status=status)))  # type: ignore[arg-type]
        for path, value in leaves.items():
            branch, _, leaf = path.partition(".")
            own.setdefault(branch, {})[leaf] = {**own["navigation"]["headingTrue"], "value": value}
        assert wrong("signalk.json", told) == [], (kind, status)


@pytest.mark.slow
def test_a_ship_without_an_mmsi_of_a_ship_has_a_uuid_everywhere_the_same():
    stage = sailing(name="gms_110")
    object.__setattr__(stage.scenario.own.sailing, "mmsi", 0)
    with Served(SignalK(stage)) as http, http.socket("/signalk/v1/stream") as ws:
        mine = heard(ws)["self"]
        assert re.fullmatch(URN.replace("^urn", r"^vessels\.urn"), mine)
        assert heard(ws)["context"] == mine
        tree = http.get("/signalk/v1/api/").json()
    assert tree["self"] == mine
    assert tree["vessels"][mine.removeprefix("vessels.")]["uuid"] == mine.removeprefix("vessels.")
    for mmsi in (0, 12, 111_000_001, 970_000_001):
        assert identity(mmsi, "x") == identity(0, "x") != identity(0, "y")
    assert identity(799_999_999, "x") == ("urn:mrn:imo:mmsi:799999999", {"mmsi": "799999999"})


@pytest.mark.slow
def test_other_ships_are_below_vessels_by_their_own_names():
    stage = sailing(FERRY)
    with Served(SignalK(stage)) as http:
        ships = http.get("/signalk/v1/api/vessels").json()
        assert set(ships) == {"urn:mrn:imo:mmsi:211000001", "urn:mrn:imo:mmsi:200000001"}
        there = http.get("/signalk/v1/api/vessels/urn:mrn:imo:mmsi:200000001").json()
        assert there["name"] == "ferry"
        assert there["navigation"]["courseOverGroundTrue"]["value"] == pytest.approx(1.5 * math.pi)
        north, east = stage.fittings.datum.north_east(*there["navigation"]["position"]["value"].values())
        ferry = stage.loop.vessels["ferry"].plant
        assert (north, east) == (pytest.approx(ferry["x"], abs=0.01), pytest.approx(ferry["y"], abs=0.01))
        assert http.get("/signalk/v1/api/vessels/urn:mrn:imo:mmsi:200000009").status_code == 404


@pytest.mark.slow
def test_the_true_wind_is_that_over_the_water_and_the_other_that_over_the_ground():
    """Wind of 12 m/s from 250 deg, current of 1.5 m/s towards 40 deg: the wind over the water is their difference."""
    wind, current, towards, origin = 12.0, 1.5, 40.0 * DEG, 250.0 * DEG
    around = Environment(wind * math.cos(origin), wind * math.sin(origin), current * math.cos(towards),
                         current * math.sin(towards), 0.0, 0.0, 0.0, 0.0)  # fmt: skip
    stage = sailing(weather=(Weather(0.0, 0.0, around),), seconds=20.0)
    said, psi = values(stage), stage.loop.vessels["own"].plant["psi"]
    north = wind * math.cos(origin) + current * math.cos(towards)  # the water goes to meet what comes from there
    east = wind * math.sin(origin) + current * math.sin(towards)
    told = {name.rpartition(".")[2]: value for name, value in said.items() if name.startswith("environment.wind.")}
    assert told["speedOverGround"] == pytest.approx(wind, rel=1e-9)
    assert told["directionTrue"] == pytest.approx(origin, abs=1e-9)
    assert math.remainder(told["angleTrueGround"] - origin + psi, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert told["speedTrue"] == pytest.approx(math.hypot(north, east), rel=1e-6)
    turned = math.remainder(told["angleTrueWater"] + psi - math.atan2(east, north), math.tau)
    assert turned == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
def test_shafts_have_names_of_sides_and_astern_is_told():
    stage = sailing(name="gms_110")
    stage.loop.order("own", "n_P", -1.0)
    stage.loop.run(60.0)
    said, plant = values(stage), stage.loop.vessels["own"].plant
    port, starboard = stage.fittings.shafts
    assert plant[port] < 0.0
    assert said["propulsion.port.revolutions"] == pytest.approx(plant[port])
    assert said["propulsion.starboard.revolutions"] == pytest.approx(plant[starboard])
    assert said["propulsion.port.transmission.gear"] == said["propulsion.starboard.transmission.gear"] == "Reverse"
    assert not [path for path in said if re.search(r"propulsion\.[^.]*[^A-Za-z0-9.]", path)]


def test_shafts_are_counted_from_amidships_to_each_side():
    names = ["main", "starboard", "port", "starboard2", "port2", "starboard3", "port3"]
    assert [_shaft(number) for number in range(7)] == names


@pytest.mark.slow
def test_the_time_of_a_value_is_that_of_the_scenario():
    stage = sailing(seconds=90.0)
    stamp = full(stage)["vessels"]["urn:mrn:imo:mmsi:211000001"]["navigation"]["headingTrue"]["timestamp"]
    moment = datetime.fromisoformat(stamp.replace("Z", "+00:00")).timestamp()
    assert moment == pytest.approx(stage.scenario.epoch + 90.0, abs=0.002)


@pytest.mark.slow
def test_alarms_are_notifications_that_end():
    stage = sailing(FERRY, faults=(Fault("silent", "gyro", at=1.0, lasts=12.0),), seconds=9.0)
    path = "notifications.navigation.headingTrue"
    assert values(stage)[path] == {"state": "warn", "method": ["visual", "sound"], "message": "HEADING LOST"}
    assert values(stage)["notifications.navigation.closestApproach.1"]["state"] == "alarm"
    stage.alarms.acknowledge(10011, 1, stage.loop.t)
    assert values(stage)[path] == {"state": "warn", "method": ["visual"], "message": "HEADING LOST"}
    stage.loop.run(10.0)
    assert values(stage)[path] == {"state": "normal", "method": [], "message": "HEADING LOST"}


# --- orders that are refused ---

ROR = encode(Sentence("AG", "ROR", {"stbdrudderorder": 5.0, "stbdrudderstatus": "A", "portrudderorder": None,
                                    "portrudderstatus": "V", "operatinglocind": None}))  # fmt: skip


def mariner() -> Stage:
    return sailing(page=True, seconds=1.0)


def another() -> Stage:
    stage, wire = on_wire(scene(name="kvlcc2"))
    wire.waiting.append(ROR)
    stage.loop.run(1.0)
    assert stage.on_wire.conning.commander == "test"
    return stage


@pytest.mark.slow
@pytest.mark.parametrize(("of", "why"), [
    (lambda: _handed(mariner()), "somebody else steers"), (another, "test has command"),
    (lambda: sailing(line={"authority": Authority.of(["127.0.0.1:9"])}), "may not have command"),
    (lambda: sailing(name="otter", route=(), piloted=False), "no rudder"),
])  # fmt: skip
def test_an_order_that_is_not_obeyed_is_not_completed(of, why):
    stage = of()
    before = stage.digest
    with Served(SignalK(stage)) as http:
        for method, what, said in (("PUT", "target", {"value": 1.0}), ("PUT", "target/adjust", {"value": 0.1}),
                                   ("POST", "engage", {}), ("PUT", "state", {"value": "auto"})):  # fmt: skip
            answer = http.request(method, f"{PILOT}/{what}", json.dumps(said).encode())
            assert answer.status_code == 400, what
            assert answer.json()["state"] == "FAILED"
            assert why in answer.json()["message"]
        assert http.get(f"{PILOT}/state").json() == {"value": "standby"}
    assert stage.digest == before
    bridge = Rosbridge(stage)
    with pytest.raises(Exception, match=why):
        bridge.obey({"op": "publish", "topic": "/cmd/psi", "msg": {"data": 1.0}}, {})


def _handed(stage: Stage) -> Stage:
    stage.handover.hand(stage.loop, "page")
    stage.loop.run(1.0)
    return stage


# --- who may ask, and how much ---


@pytest.mark.slow
def test_every_read_and_order_wants_the_key():
    stage, key = sailing(), {"Authorization": "Bearer secret"}
    reads = ["/signalk/v1/api/", "/signalk/v1/api/vessels/self", PILOT.rpartition("/")[0], PILOT, f"{PILOT}/state",
             f"{PILOT.rpartition('/')[0]}/_providers/_default", f"{PILOT.rpartition('/')[0]}/no"]  # fmt: skip
    with Served(SignalK(stage, "secret")) as http:
        for path in reads:
            for wrong in ({}, {"Authorization": "Bearer secre"}, {"Authorization": "Bearer "}):
                answer = http.request("GET", path, **wrong)
                assert answer.status_code == 401, path
                assert answer.json()["statusCode"] == 401
            assert http.get(f"{path}?token=wrong").status_code == 401
            assert http.request("GET", path, **key).status_code in (200, 404)
            assert http.get(f"{path}?token=secret").status_code in (200, 404)
        assert http.request("POST", f"{PILOT}/disengage").status_code == 401
        assert http.get("/signalk").status_code == 200  # where things are is no secret


@pytest.mark.slow
@pytest.mark.parametrize(
    "origin", ["http://[", "http://]", "http://[::1", "null", "http://evil.example", "//", "http://[x]"]
)
def test_an_origin_that_is_none_is_refused(origin):
    with Served(SignalK(sailing(seconds=1.0))) as http:
        answer = http.put(f"{PILOT}/target", {"value": 1.0}, Origin=origin)
        assert (answer.status_code, answer.json()["state"]) == (403, "FAILED")
        with pytest.raises(InvalidStatus) as refused:
            http.socket("/signalk/v1/stream", origin)
        assert refused.value.response.status_code == 403


@pytest.mark.slow
def test_a_body_in_chunks_is_read_up_to_its_limit_only():
    """A thousand chunks of 64 kB would be 64 MB; the answer comes after the first, and the connection ends."""
    order = "PUT {} HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n"
    with Served(SignalK(sailing(seconds=1.0))) as http, socket.create_connection(("127.0.0.1", http.port), 9.0) as line:
        line.sendall(order.format(f"{PILOT}/target").encode())
        sent, chunk = 0, b"10000\r\n" + b" " * 65536 + b"\r\n"
        try:
            for _ in range(1000):
                line.sendall(chunk)
                sent += 1
        except OSError:  # closed by the other side
            pass
        assert sent < 300  # what fits in the buffers of both ends
        small = b"2\r\n{}\r\n0\r\n\r\n"
        with socket.create_connection(("127.0.0.1", http.port), 10.0) as other:
            other.sendall(order.format(f"{PILOT}/state").encode() + small)
            assert b"states are auto and standby" in b"".join(iter(lambda: other.recv(65536), b""))
        answer = http.request("PUT", f"{PILOT}/target", b" " * 2100 + b'{"value": 1.0}')
        assert answer.status_code == 400
        assert "at most 2048 bytes" in answer.json()["message"]


WIND = {"gamma_T_bow": 3.5, "psi": 4.0, "U_A": 8.0, "gamma_A": 2.0, "u_w": 5.0}


@pytest.mark.parametrize(("known", "told"), [
    (("gamma_T_bow", "psi"), {"angleTrueGround": 3.5 - math.tau, "directionTrue": 7.5 - math.tau}),
    (("gamma_T_bow",), {"angleTrueGround": 3.5 - math.tau}), (("psi", "U_A", "gamma_A"), {"angleApparent": 2.0}),
    (("U_A", "gamma_A", "u_w"), {
        "angleApparent": 2.0, "speedTrue": math.hypot(8.0 * math.cos(2.0) - 5.0, 8.0 * math.sin(2.0)),
        "angleTrueWater": math.atan2(8.0 * math.sin(2.0), 8.0 * math.cos(2.0) - 5.0)}),
])  # fmt: skip
def test_winds_are_told_as_far_as_what_they_are_made_of_is_known(known, told):
    assert dict(signalk._wind({name: WIND[name] for name in known})) == pytest.approx(told)


def test_a_ship_that_slides_meets_its_own_wind_from_the_side():
    """Air at rest over the water, a ship ahead at 5 m/s and to starboard at 1 m/s."""
    felt = {"U_A": math.hypot(5.0, 1.0), "gamma_A": math.atan2(1.0, 5.0), "u_w": 5.0, "v_w": 1.0}
    assert dict(signalk._wind(felt))["speedTrue"] == pytest.approx(0.0, abs=1e-12)

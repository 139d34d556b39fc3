"""Signal K, rosbridge, NMEA 2000 and a serial line around a stage: what they tell, order and refuse."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest

from scenes import FERRY, on_wire, scene
from seatrial.cli.app import main
from seatrial.core.errors import RefusalError
from seatrial.data.nmea.sentences import Sentence, encode
from seatrial.data.trialfile import read_trial
from seatrial.realtime.links.n2k import GROUPS, Bus, identifier
from seatrial.realtime.range.stage import Line, Stage
from seatrial.realtime.serial_line import SerialLine
from seatrial.realtime.wire import Mute, WireError

fastapi = pytest.importorskip("fastapi")
from served import Served, heard  # noqa: E402
from websockets.exceptions import ConnectionClosed, InvalidStatus  # noqa: E402

from seatrial.realtime.links.rosbridge import Rosbridge  # noqa: E402
from seatrial.realtime.links.signalk import SignalK  # noqa: E402


@pytest.fixture
def stage() -> Stage:
    stage, _ = on_wire(scene(FERRY, name="kvlcc2", variation=-0.1))
    stage.loop.run(3.0)
    return stage


# --- Signal K ---

PILOTS = "/signalk/v2/api/vessels/self/autopilots"


@pytest.mark.slow
def test_signal_k_tells_what_the_instruments_say(stage):
    plant = stage.loop.vessels["own"].plant
    with Served(SignalK(stage)) as http:
        found = http.get("/signalk").json()["endpoints"]["v1"]
        assert found["signalk-ws"] == f"ws://127.0.0.1:{http.port}/signalk/v1/stream"
        own = http.get("/signalk/v1/api/vessels/self").json()
        assert own["mmsi"] == "211000001"
        assert own["navigation"]["speedThroughWater"]["value"] == pytest.approx(plant["u"])
        assert own["navigation"]["headingMagnetic"]["value"] == pytest.approx(0.1, abs=1e-3)
        assert http.get("/signalk/v1/api/vessels/self/steering/rudderAngle").json()["value"] == plant["delta"]
        assert http.get("/signalk/v1/api/vessels/self/navigation/no").status_code == 404


@pytest.mark.slow
def test_signal_k_streams_deltas_of_what_changes_and_of_other_ships(stage):
    with Served(SignalK(stage)) as http, http.socket("/signalk/v1/stream?subscribe=all") as ws:
        assert heard(ws)["self"] == "vessels.urn:mrn:imo:mmsi:211000001"
        first, other = heard(ws), heard(ws)
        told = {one["path"]: one["value"] for one in first["updates"][0]["values"]}
        assert set(told["navigation.position"]) == {"latitude", "longitude"}
        assert told["navigation.rateOfTurn"] == pytest.approx(0.0, abs=1e-4)
        assert other["context"] == "vessels.urn:mrn:imo:mmsi:200000001"
        ferry = {one["path"]: one["value"] for one in other["updates"][0]["values"]}
        assert ferry[""]["name"] == "ferry"
        assert ferry["navigation.courseOverGroundTrue"] == pytest.approx(1.5 * math.pi)
        ws.send(json.dumps({"context": "vessels.self", "unsubscribe": [{"path": "*"}]}))
        ws.send(json.dumps({"context": "vessels.self", "subscribe": [{"path": "navigation.heading*", "period": 9}]}))
        time.sleep(0.3)
        stage.loop.order("own", "delta", 0.5)
        stage.loop.run(15.0)
        while "navigation.headingTrue" not in (paths := _paths(heard(ws))):
            assert not paths or other["context"]
        assert all(path.startswith("navigation.heading") for path in paths)


def _paths(said: dict[str, Any]) -> list[str]:
    """Paths of a delta of the own ship; none of another one."""
    return [one["path"] for one in said["updates"][0]["values"]] if "211000001" in said["context"] else []


@pytest.mark.slow
def test_signal_k_apps_steer_the_ship(stage):
    plant = stage.loop.vessels["own"].plant
    with Served(SignalK(stage)) as http:
        assert http.get(PILOTS).json() == {"seatrial": {"provider": "seatrial", "isDefault": True}}
        assert http.get(f"{PILOTS}/_default/state").json() == {"value": "standby"}
        assert http.put(f"{PILOTS}/_default/target", {"value": 20.0, "units": "deg"}).status_code == 200
        stage.loop.run(20.0)  # longer than the lease of 10 s
        assert http.get(f"{PILOTS}/seatrial").json()["state"] == "auto"
        assert http.get(f"{PILOTS}/seatrial/target").json()["value"] == pytest.approx(math.radians(20.0))
        assert not stage.on_wire.conning.stale
        assert plant["delta"] > 0.05
        assert http.put(f"{PILOTS}/_default/target/adjust", {"value": -30.0, "units": "deg"}).status_code == 200
        stage.loop.run(1.0)
        assert http.get(f"{PILOTS}/seatrial/target").json()["value"] == pytest.approx(math.radians(350.0))
        assert http.request("POST", f"{PILOTS}/_default/disengage").status_code == 200
        stage.loop.run(20.0)
        assert http.get(f"{PILOTS}/_default/state").json() == {"value": "standby"}
    assert plant["delta_cmd"] == 0.0


@pytest.mark.slow
def test_signal_k_refuses(stage):
    cases = [
        ("PUT", "seatrial/target", b'{"value": "north"}', 400), ("PUT", "seatrial/target", b'{"value": NaN}', 400),
        ("PUT", "seatrial/target", b"{", 400), ("PUT", "seatrial/target", b"[" * 2000, 400),
        ("PUT", "seatrial/target", b"x" * 5000, 400), ("PUT", "seatrial/state", b'{"value": "route"}', 400),
        ("POST", "seatrial/tack/port", b"", 400), ("PUT", "other/target", b'{"value": 1}', 404),
        ("PUT", "seatrial/target", b'{"value": 1, "units": "mil"}', 400),
    ]  # fmt: skip
    with Served(SignalK(stage)) as http:
        for method, path, body, code in cases:
            assert http.request(method, f"{PILOTS}/{path}", body).status_code == code, (path, body[:20])
    stage.loop.run(1.0)
    assert stage.on_wire.conning.counts["taken"] == 0


@pytest.mark.slow
def test_signal_k_needs_the_key_and_refuses_foreign_pages(stage):
    base, body, key = f"{PILOTS}/seatrial/target", {"value": 1.0}, {"Authorization": "Bearer secret"}
    with Served(SignalK(stage, "secret")) as http:
        assert http.put(base, body).status_code == 401
        assert http.put(base, body, **key).status_code == 200
        assert http.put(f"{base}?token=secret", body).status_code == 200
        assert http.put(base, body, **key, Origin="http://evil.example").status_code == 403
        with http.socket("/signalk/v1/stream") as ws, pytest.raises(ConnectionClosed):
            heard(ws)
        with pytest.raises(InvalidStatus):
            http.socket("/signalk/v1/stream?token=secret", "http://evil.example")


@pytest.mark.slow
def test_while_the_mariner_steers_a_link_orders_nothing(stage):
    stage.on_wire.conning.listen(False)
    with Served(SignalK(stage)) as http:
        http.put(f"{PILOTS}/seatrial/target", {"value": 1.0})
    stage.loop.run(5.0)
    assert stage.on_wire.conning.counts["refused"] == 1
    assert stage.loop.vessels["own"].plant["delta_cmd"] == 0.0


# --- rosbridge ---


@pytest.mark.slow
def test_rosbridge_publishes_in_the_frames_of_rep_103(stage):
    bridge, plant = Rosbridge(stage), stage.loop.vessels["own"].plant
    stage.loop.order("own", "delta", 0.3)
    stage.loop.run(60.0)
    odom = bridge.message("/odom")
    pose, twist = odom["pose"]["pose"], odom["twist"]["twist"]
    assert pose["position"]["x"] == pytest.approx(plant["y"], abs=0.01)  # east
    assert pose["position"]["y"] == pytest.approx(plant["x"], abs=0.01)  # north
    yaw = 2.0 * math.atan2(pose["orientation"]["z"], pose["orientation"]["w"])
    assert math.remainder(0.5 * math.pi - yaw - plant["psi"], math.tau) == pytest.approx(0.0, abs=1e-6)
    assert plant["r"] > 0.0 > twist["angular"]["z"]
    assert twist["linear"]["y"] == pytest.approx(-plant["v_m"], abs=1e-6)
    assert bridge.message("/imu")["angular_velocity"]["z"] == pytest.approx(-plant["r"])
    assert bridge.message("/delta")["data"] == pytest.approx(plant["delta"])


@pytest.mark.slow
def test_rosbridge_talks_and_obeys(stage):
    with Served(Rosbridge(stage)) as http, http.socket("/rosbridge") as ws:
        ws.send(json.dumps({"op": "call_service", "id": "1", "service": "/rosapi/topics"}))
        assert heard(ws)["values"]["topics"][:3] == ["/odom", "/imu", "/fix"]
        ws.send(json.dumps({"op": "subscribe", "topic": "/odom", "type": "nav_msgs/msg/Odometry"}))
        assert heard(ws)["topic"] == "/odom"
        ws.send(json.dumps({"op": "publish", "topic": "/cmd/delta", "msg": {"data": 0.2}}))
        ws.send(json.dumps({"op": "publish", "topic": "/cmd/n_P", "msg": {"data": 1.0}}))
        for wrong in ({"op": "fly"}, {"op": "publish", "topic": "/cmd/delta", "msg": {"data": "left"}},
                      {"op": "publish", "topic": "/odom", "msg": {}},
                      {"op": "subscribe", "topic": ["/odom"]}):  # fmt: skip
            ws.send(json.dumps(wrong))
            assert heard(ws)["level"] == "error"
    stage.loop.run(1.0)
    plant = stage.loop.vessels["own"].plant
    assert (plant["delta_cmd"], plant["n_P_cmd"]) == (pytest.approx(0.2, abs=1e-4), pytest.approx(1.0, abs=1e-3))
    assert stage.on_wire.conning.commander == "rosbridge"


def test_rosbridge_tells_place_time_and_controls_of_the_instruments(stage):
    stage.loop.run(0.4)
    bridge, latest = Rosbridge(stage), stage.on_wire.latest
    fix = bridge.message("/fix")
    assert (fix["latitude"], fix["longitude"]) == (latest["latitude"], latest["longitude"])
    moment = stage.fittings.epoch + stage.loop.t
    stamp = fix["header"]["stamp"]
    assert 0 <= stamp["nanosec"] < 1_000_000_000
    assert stamp["sec"] + 1e-9 * stamp["nanosec"] == pytest.approx(moment, abs=1e-6)
    assert stamp["sec"] == math.floor(moment + 1e-9)
    imu = bridge.message("/imu")
    assert imu["linear_acceleration_covariance"][0] == -1.0
    quarter = pytest.approx(math.sqrt(0.5))
    east = {"x": 0.0, "y": 0.0, "z": quarter, "w": quarter}
    assert latest["psi"] == pytest.approx(0.0)
    assert imu["orientation"] == east  # north is a quarter turn from east
    assert bridge.message("/n_P") == {"data": latest["n_P"]}
    for wrong in (True, "1", None, math.nan, math.inf, 1e6):
        with pytest.raises(RefusalError, match="must be a number"):
            bridge.obey({"op": "publish", "topic": "/cmd/n_P", "msg": {"data": wrong}}, {})


# --- NMEA 2000 ---


def test_nmea_2000_is_read_by_another_decoder(stage):
    decoder = pytest.importorskip("nmea2000.decoder").NMEA2000Decoder()
    can = pytest.importorskip("can")
    listening = can.Bus(interface="virtual", channel="test n2k")
    bus = Bus(stage, "virtual:test n2k")
    try:
        stage.loop.run(1.0)
        plant, found = stage.loop.vessels["own"].plant, {}
        while (frame := listening.recv(0.05)) is not None:
            pgn = frame.arbitration_id >> 8 & 0x1FFFF
            assert len(frame.data) == 8
            message = decoder.decode(frame)
            if message is None:  # the first frame of two
                continue
            found.setdefault(pgn, {}).update({field.id: field.value for field in message.fields})
    finally:
        bus.close()
        listening.shutdown()
    assert set(found) == set(GROUPS)
    assert bus.sent >= 40
    latest = stage.on_wire.latest
    assert found[127250]["heading"] == pytest.approx(latest["psi"], abs=5.1e-5)
    assert found[127250]["reference"] == "True"
    assert found[127245]["position"] == pytest.approx(plant["delta"], abs=5.1e-5)
    assert found[128259]["speedWaterReferenced"] == pytest.approx(latest["u_w"], abs=0.0051)
    assert found[129025]["latitude"] == pytest.approx(latest["latitude"], abs=5.1e-8)
    assert found[129025]["longitude"] == pytest.approx(latest["longitude"], abs=5.1e-8)
    assert found[129026]["sog"] == pytest.approx(latest["U"], abs=0.0051)
    assert found[127488]["speed"] == pytest.approx(60.0 * latest["n_P"], abs=0.13)
    assert found[130306]["windSpeed"] == pytest.approx(latest["U_T"], abs=0.0051)
    assert identifier(127250) == 0x09F11223


@pytest.mark.slow
def test_each_group_goes_out_at_its_rate(stage):
    """Half a minute of a ship that ticks 20 times a second: the frames of a group are its rate times the time."""
    can = pytest.importorskip("can")
    stage, _ = on_wire(scene(name="kvlcc2", rate=20.0))
    stage.loop.run(1.0)
    listening = can.Bus(interface="virtual", channel="test rates")
    bus, heard, sequence = Bus(stage, "virtual:test rates"), {}, []
    try:
        stage.loop.run(30.0)
        while (frame := listening.recv(0.05)) is not None:
            pgn = frame.arbitration_id >> 8 & 0x1FFFF
            heard[pgn] = heard.get(pgn, 0) + 1
            sequence += [frame.data[0]] if pgn == 127250 else []
            assert (frame.arbitration_id & 0xFF, frame.is_extended_id) == (35, True)
    finally:
        bus.close()
        listening.shutdown()
    twice = {130306, 130578}  # apparent and true; two frames
    for pgn, (rate, _) in GROUPS.items():
        assert heard[pgn] == pytest.approx(30.0 * rate * (2 if pgn in twice else 1), abs=2)
    assert bus.sent == sum(heard.values())
    assert sequence[: len(sequence) - 1] == [(sequence[0] + k) % 253 for k in range(len(sequence) - 1)]
    assert max(sequence) == 252  # 253 to 255 mean something else


def test_a_bus_that_cannot_be_opened_is_refused(stage):
    pytest.importorskip("can")
    for text, message in (("virtual", "write virtual:NAME"), ("socketcan:nocan7", "nocan7"), ("carrier:x", "carrier")):
        with pytest.raises(WireError, match=message):
            Bus(stage, text)


# --- serial ---


@pytest.fixture
def ends():
    pytest.importorskip("serial")
    ours, theirs = os.openpty()
    os.set_blocking(ours, False)
    import tty

    tty.setraw(ours)
    yield ours, os.ttyname(theirs)
    os.close(ours)
    os.close(theirs)


def test_a_ship_on_a_serial_line_tells_and_obeys(ends):
    far, device = ends
    line = SerialLine(f"serial://{device}?baud=38400")
    stage = Stage(scene(name="kvlcc2"), line=Line(line, rates={"HDT": 1.0}))
    order = encode(Sentence("AG", "ROR", {"stbdrudderorder": 10.0, "stbdrudderstatus": "A", "portrudderorder": None,
                                          "portrudderstatus": "V", "operatinglocind": None}))  # fmt: skip
    os.write(far, b"garbage\n" + order[:10])
    stage.loop.run(1.0)
    os.write(far, order[10:] + b"x" * 5000 + b"\n")
    line.wait(0.1)
    stage.loop.run(2.0)
    assert math.degrees(stage.loop.vessels["own"].plant["delta_cmd"]) == pytest.approx(10.0)
    assert line.counts["form"] == 1
    assert line.counts["oversized"] == 1
    assert os.read(far, 4096).startswith(b"$HEHDT,")
    for _ in range(200):  # nobody reads: whole sentences are dropped, none is cut
        line.send(b"$HEHDT,1.00,T*1E\r\n" * 20)
    assert line.counts["unsent"] > 0
    line.close()


@pytest.mark.slow
def test_a_ship_is_steered_on_a_serial_line(ends, tmp_path, capsys):
    """`seatrial steer` with the program beside it told the device; a line has one other end, so --to is refused."""
    far, device = ends
    wire, path = f"serial://{device}?baud=115200", tmp_path / "run.csv"
    order = encode(Sentence("AG", "ROR", {"stbdrudderorder": 10.0, "stbdrudderstatus": "A", "portrudderorder": None,
                                          "portrudderstatus": "V", "operatinglocind": None}))  # fmt: skip
    over = Event()

    def repeated() -> None:  # what came before the line was opened is thrown away
        while not over.wait(0.05):
            os.write(far, order)

    pilot = Thread(target=repeated)
    pilot.start()
    beside = "python -c \"import time; print('beside', '{address}', flush=True); time.sleep(20)\""
    asked = ["steer", "kvlcc2", "--nmea", wire, "--factor", "20", "--duration", "30", "--only", "HDT,ROT"]
    assert main([*asked, "-o", str(path), "--beside", beside]) == 0
    over.set()
    pilot.join()
    told = capsys.readouterr()
    assert f"beside {device}" in told.out
    assert wire in told.err
    run = read_trial(path)
    assert math.degrees(run["delta_cmd"][-1]) == pytest.approx(10.0)
    assert run["r"][-1] > 0.0
    sent = os.read(far, 65536)
    assert sent.startswith(b"$HE")
    assert b"ROT," in sent
    assert main([*asked, "--to", "udp://127.0.0.1:9999"]) == 2
    assert "a serial line has one other end" in capsys.readouterr().err


class Plug:
    """A line that can be unplugged and plugged in again: a link to the far end of a terminal."""

    def __init__(self, path: Path) -> None:
        self.path, self.far = path, -1
        self.plug()

    def plug(self) -> None:
        import tty

        self.far, theirs = os.openpty()
        os.set_blocking(self.far, False)
        tty.setraw(self.far)
        self.path.symlink_to(os.ttyname(theirs))
        os.close(theirs)

    def unplug(self) -> None:
        self.path.unlink()
        os.close(self.far)
        self.far = -1

    def read(self, sentences: int = 0) -> bytes:
        """What has come, at least so many sentences: the kernel passes them on in its own time."""
        found, end = b"", time.monotonic() + 60.0
        while True:
            with suppress(OSError):  # nothing yet, or nobody at the other end
                found += os.read(self.far, 65536)
            if found.count(b"\r\n") >= sentences or time.monotonic() > end:
                return found
            time.sleep(0.002)

    def write(self, data: bytes, line: SerialLine) -> None:
        """Send to the line, and wait until it has all of it."""
        os.write(self.far, data)
        until(lambda: line._port.in_waiting >= len(data))


def until(what: Callable[[], object]) -> None:
    """Wait until something is so, however busy the machine is."""
    end = time.monotonic() + 60.0
    while not what():
        assert time.monotonic() < end
        time.sleep(0.002)


@pytest.fixture
def plug(tmp_path, monkeypatch):
    pytest.importorskip("serial")
    monkeypatch.setattr("seatrial.realtime.serial_line._AGAIN", 0.0)
    plug = Plug(tmp_path / "ttyX")
    yield plug
    if plug.far >= 0:
        os.close(plug.far)


ORDER = encode(Sentence("AG", "ROR", {"stbdrudderorder": 10.0, "stbdrudderstatus": "A", "portrudderorder": None,
                                      "portrudderstatus": "V", "operatinglocind": None}))  # fmt: skip


@pytest.mark.slow
def test_a_line_that_is_unplugged_says_so_counts_and_comes_back(plug):
    line = SerialLine(f"serial://{plug.path}")
    stage = Stage(scene(name="kvlcc2"), line=Line(line, rates={"HDT": 1.0}))
    told = lambda: [event.text for event in stage.loop.events if event.kind == "line"]  # noqa: E731
    stage.loop.run(3.0)
    assert (line.peers, line.counts["unsent"], told()) == (1, 0, [])
    assert line.counts["sent"] == 3
    assert plug.read(3).count(b"$HEHDT,") == 3
    plug.unplug()
    sent = line.counts["sent"]
    stage.loop.run(1.0)
    assert line.peers == 0
    assert len(told()) == 1
    assert "is lost" in told()[0]
    stage.loop.run(9.0)
    assert (line.counts["lost"], line.counts["reopened"], line.counts["sent"] - sent) == (1, 0, 0)
    assert line.counts["unsent"] == 10  # one a second
    plug.plug()
    stage.loop.run(1.0)
    plug.write(ORDER, line)
    stage.loop.run(2.0)
    assert (line.peers, line.counts["reopened"]) == (1, 1)
    assert ["is lost" in text for text in told()] == [True, False]
    assert math.degrees(stage.loop.vessels["own"].plant["delta_cmd"]) == pytest.approx(10.0)
    whole = plug.read(3)
    assert whole.count(b"$HEHDT,") == 3
    assert whole.startswith(b"$HEHDT,")  # no rest of an old sentence
    assert whole.endswith(b"\r\n")
    line.close()


def test_a_sentence_that_the_unplugging_cut_off_is_not_joined_to_the_next_one(plug):
    line = SerialLine(f"serial://{plug.path}")
    plug.write(ORDER[:10], line)
    assert line.poll() == []
    plug.unplug()
    line.poll()
    assert line.peers == 0
    plug.plug()
    line.poll()
    plug.write(ORDER, line)
    assert [one.sentence.kind for one in line.poll()] == ["ROR"]
    line.close()
    line.close()


@pytest.mark.slow
@pytest.mark.parametrize(("back", "status"), [(False, 1), (True, 0)])
def test_a_run_whose_line_is_gone_at_its_end_has_failed(plug, capsys, back, status):
    over = Event()

    def pulled() -> None:
        until(lambda: over.is_set() or plug.read())  # the run has begun
        plug.unplug()
        over.wait(0.4)
        if back:
            plug.plug()

    hand = Thread(target=pulled)
    hand.start()
    asked = ["steer", "kvlcc2_l7", "--nmea", f"serial://{plug.path}", "--factor", "10", "--duration", "25"]
    assert main([*asked, "--only", "HDT"]) == status
    over.set()
    hand.join()
    told = capsys.readouterr()
    assert "line: serial://" in told.err
    assert "is lost" in told.err
    assert ("is back" in told.err) == back
    assert ("error: serial://" in told.err) == (not back)
    assert "not sent" in told.out


@pytest.mark.parametrize("text", ["serial://", "serial:///dev/no-such-line", "serial:///dev/null?baud=7", "serial://[",
                                  "serial:///dev/null?parity=odd", "serial:///dev/x?baud=\u0664"])  # fmt: skip
def test_a_line_that_cannot_be_opened_is_refused(text):
    pytest.importorskip("serial")
    with pytest.raises(WireError, match="serial:") as error:
        SerialLine(text)
    assert "\n" not in str(error.value)


def test_links_of_the_command_line_are_refused_in_one_line(tmp_path, capsys):
    assert main(["bridge", "kvlcc2_l7", "--can", "virtual", "--port", "0", "-o", str(tmp_path)]) == 2
    assert "--can" in capsys.readouterr().err
    assert main(["bridge", "kvlcc2_l7", "--nmea", "serial:///dev/nothing", "--port", "0", "-o", str(tmp_path)]) == 2
    assert "serial:///dev/nothing" in capsys.readouterr().err


@pytest.mark.slow
def test_a_stage_without_a_wire_is_steered_by_links_alone():
    stage = Stage(scene(name="kvlcc2"), line=Line(Mute()))
    with Served(SignalK(stage)) as http:
        http.put(f"{PILOTS}/seatrial/target", {"value": 0.3})
    stage.loop.run(20.0)
    assert stage.loop.vessels["own"].plant["delta_cmd"] != 0.0

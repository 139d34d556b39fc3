"""A ship of a loop on the wire: it sends at the requested rates, obeys valid sentences, and ignores all other input."""

from __future__ import annotations

import errno
import io
import math
import os
import re
import struct
from collections import Counter
from datetime import UTC, datetime

import mutations
import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data.geodesy import Datum
from seatrial.data.importing import import_log
from seatrial.data.nmea.framing import TOKEN, read_line, split
from seatrial.data.nmea.heard import hear
from seatrial.data.nmea.readings import readings
from seatrial.data.nmea.sentences import decode, encode
from seatrial.data.nmea.ship import Fittings
from seatrial.data.trialfile import read_trial
from seatrial.realtime.loop import Loop
from seatrial.realtime.on_wire import RATES, OnWire, Speech
from seatrial.realtime.plant import Plant
from seatrial.realtime.wire import Address, Intake, Message, Wire, WireError
from seatrial.sensors.instruments import Gnss, Gyro, RateGyro
from seatrial.sensors.stream import Errors
from seatrial.sensors.suite import Suite, usual
from seatrial.ships.files import load, save

DEG = math.pi / 180.0


class Strings:
    """A wire without a socket: datagrams are put in by hand, and kept as they go out."""

    def __init__(self) -> None:
        self.intake = Intake(rate=1e9)
        self.waiting: list[bytes] = []
        self.out: list[bytes] = []

    @property
    def counts(self) -> Counter[str]:
        return self.intake.counts

    def poll(self) -> list[Message]:
        waiting, self.waiting = self.waiting, []
        return [Message(one, "test") for data in waiting for one in self.intake.take(data, "test", 0.0)]

    def send(self, data: bytes) -> None:
        self.out.append(data)


@pytest.fixture(scope="module")
def ship():
    return load("kvlcc2_l7")


def at_sea(ship, speech: Speech | None = None, log=None, **more):
    plant = Plant.of(ship, dt=0.02)
    loop, wire = Loop({"s": plant}, 10.0, math.inf, **more), Strings()
    return loop, plant, wire, OnWire(loop, "s", wire, speech or Speech(Fittings(Datum(35.0, 139.0))), log=log)


@pytest.mark.slow
def test_sentences_come_at_their_rates(ship):
    loop, _, wire, _ = at_sea(ship)
    loop.run(10.0)
    kinds = Counter(line[3:6].decode() for data in wire.out for line in split(data))
    assert kinds == {"HDT": 100, "THS": 100, "ROT": 100, "RSA": 50, "VBW": 50, "RMC": 50, "GGA": 10, "VTG": 10,
                     "ZDA": 10, "GLL": 10, "VHW": 10, "RPM": 10, "MWV": 20, "DPT": 10}  # fmt: skip


@pytest.mark.slow
def test_frames_carry_numbers_and_the_time(ship):
    speech = Speech(Fittings(epoch=1.8e9), {"HDT": 10.0, "ROT": 10.0}, framed=True)
    loop, _, wire, _ = at_sea(ship, speech)
    loop.run(60.0)
    assert all(data.startswith(TOKEN) for data in wire.out)
    tags = [read_line(line).tag for data in wire.out for line in split(data)]
    assert [tag.number for tag in tags] == [k % 1000 for k in range(1200)]
    assert tags[-1].time == pytest.approx(1.8e9 + 60.0)


@pytest.mark.slow
def test_an_order_turns_the_ship_and_its_sentences_hold_its_motion(ship):
    loop, plant, wire, _ = at_sea(ship)
    wire.waiting.append(mutations.whole()[0])  # rudder 10 deg to starboard
    loop.run(20.0)
    said = {}
    for data in wire.out:
        for line in split(data):
            said |= readings(hear(line))
    assert plant["delta"] == pytest.approx(10.0 * DEG)
    assert said["delta"] == pytest.approx(10.0 * DEG)
    assert 0.0 < plant["psi"] < 1.0
    assert said["psi"] == pytest.approx(plant["psi"], abs=1e-4)
    assert said["r"] == pytest.approx(plant["r"], abs=2e-6)
    assert said["u_log"] == pytest.approx(plant["u"], abs=3e-4)
    assert [event.kind for event in loop.events] == ["command", "stale"]


def known_to_pynmeagps(data: bytes) -> bool:
    """Whether any line could pass for a sentence with a right checksum; it is more lenient than we are."""
    import pynmeagps

    for line in data.removeprefix(TOKEN).splitlines():
        try:
            if pynmeagps.NMEAReader.parse(line[line.rfind(b"\\") + 1 :]) is not None:
                return True
        except (pynmeagps.NMEAParseError, pynmeagps.NMEAMessageError, pynmeagps.NMEATypeError):
            continue
    return False


@pytest.mark.slow
def test_nothing_but_valid_sentences_moves_the_ship(ship):
    """Every change of orders or of the steering control has a sentence behind it that another reader takes."""
    pytest.importorskip("pynmeagps")
    loop, plant, wire, on = at_sea(ship, Speech(Fittings(), {"HDT": 0.1}))
    con = on.conning

    def settings() -> tuple:
        by_hand = () if con.mode in ("heading", "track") else (plant["delta_cmd"],)
        return (con.mode, con.commander, con.control.course, con.control.across, plant["n_P_cmd"], *by_hand)

    moved = 0
    for data in mutations.datagrams(1000, seed=2):
        loop.step()  # an order acts from the next tick on
        before = settings()
        wire.waiting.append(data)
        loop.step()
        loop.step()
        if settings() != before:
            moved += 1
            assert known_to_pynmeagps(data), data
    assert moved > 30
    assert loop.k == 3000
    assert loop.report.events.get("dropped", 0) == 0
    assert math.isfinite(plant["psi"])


def test_beyond_the_limits_is_clipped_and_told(ship):
    loop, plant, wire, _ = at_sea(ship)
    order = decode(mutations.whole()[0])
    wire.waiting.append(encode(type(order)(order.talker, order.kind, {**order.fields, "stbdrudderorder": 90.0})))
    loop.run(5.0)
    assert plant["delta"] == pytest.approx(35.0 * DEG)
    assert "clipped" in {event.kind for event in loop.events}


@pytest.mark.slow
def test_its_sentences_import_as_the_trial_of_the_run(ship, tmp_path):
    log = io.BytesIO()
    speech = Speech(Fittings(Datum(35.0, 139.0), epoch=1.8e9), dict.fromkeys(("HDT", "ROT", "RMC", "VBW", "RSA"), 10.0))
    loop, plant, wire, _ = at_sea(ship, speech, log)
    wire.waiting.append(mutations.whole()[0])
    truth = []
    loop.after(lambda loop: truth.append([plant[n] for n in ("x", "y", "psi", "u", "v_m", "r", "delta")]))
    loop.run(30.0)
    (tmp_path / "a.nmea").write_bytes(log.getvalue())
    [path] = import_log("nmea", tmp_path / "a.nmea", tmp_path / "out")
    trial = read_trial(path)
    # the first fix is the datum there
    for k, (name, digit) in enumerate({"psi": 9e-5, "u": 3e-4, "v_m": 3e-4, "r": 2e-6, "delta": 9e-5}.items()):
        column = 2 + k
        assert max(abs(trial[name] - [row[column] for row in truth])) <= digit, name
    for k, name in enumerate(("x", "y")):
        assert max(abs(trial[name] - [row[k] - truth[0][k] for row in truth])) <= 6e-4, name


@pytest.mark.slow
def test_through_instruments(ship):
    loop, _, wire, _ = at_sea(ship, sensors=usual(ship))
    loop.run(10.0)
    lines = [line for data in wire.out for line in split(data)]
    kinds = Counter(line[3:6].decode() for line in lines)
    assert kinds["HDT"] == pytest.approx(100, abs=2)
    assert kinds["RMC"] == pytest.approx(10, abs=1)
    assert kinds["RSA"] == pytest.approx(50, abs=2)
    speeds = [decode(line) for line in lines if line[3:6] == b"VBW"]
    assert all(one["longgroundspd"] is None and one["groundspdstatus"] == "V" for one in speeds)


def said_by(wire: Strings) -> Counter[str]:
    return Counter(line[3:6].decode() for data in wire.out for line in split(data))


@pytest.mark.slow
@pytest.mark.parametrize("speed", [0.0, 0.02])
def test_a_ship_that_lies_still_says_as_much_through_noisy_instruments(ship, speed):
    plant = Plant.of(ship, dt=0.1, start=(0.0, 0.0, 0.0, speed, 0.0, 0.0), n_P=0.0)
    loop, wire = Loop({"s": plant}, 10.0, math.inf, sensors=usual(ship)), Strings()
    OnWire(loop, "s", wire, Speech(Fittings(mmsi=211000001, variation=0.1), {**RATES, "VDO": 0.5}))
    loop.run(60.0)
    assert wire.counts["unsaid"] == 0
    said = said_by(wire)
    for kind in ("RMC", "VTG", "GGA", "ZDA", "VBW", "DPT"):
        assert said[kind] == pytest.approx(60, abs=1), kind
    assert said["MWV"] == pytest.approx(120, abs=2)
    assert said["VDO"] == pytest.approx(30, abs=1)


@pytest.mark.slow
def test_through_instruments_it_sends_every_sentence_that_it_sends_without(ship):
    kinds = []
    for sensors in (None, usual(ship)):
        speech = Speech(Fittings(mmsi=211000001, variation=0.1), {**RATES, "VDO": 0.5})
        loop, _, wire, _ = at_sea(ship, speech, sensors=sensors)
        loop.run(5.0)
        lines = [line for data in wire.out for line in split(data)]
        kinds.append({(line[3:6], line.split(b",")[2] if line[3:6] == b"MWV" else b"") for line in lines})
    assert kinds[0] == kinds[1]
    assert {kind.decode() for kind, _ in kinds[0]} == {*RATES, "VDO"}


@pytest.mark.slow
def test_the_antenna_stands_where_it_is_told_with_and_without_faults(ship):
    datum, antenna = Datum(35.0, 139.0), (3.0, -1.0)
    for sensors in (None, usual(ship, antenna)):
        loop, plant, wire, _ = at_sea(ship, Speech(Fittings(datum, antenna=antenna), {"GGA": 1.0}), sensors=sensors)
        away = []
        for _ in range(1200):
            loop.step()
            for data in wire.out:
                fix = readings(hear(split(data)[0]))
                x, y = datum.north_east(fix["latitude"], fix["longitude"])
                away.append((x - plant["x"], y - plant["y"]))
            wire.out.clear()
        north, east = (sum(values) / len(values) for values in zip(*away, strict=True))
        # noise of 0.5 m and a bias that wanders by 0.87 m; late by 0.2 s at 1.18 m/s
        assert north == pytest.approx(3.0, abs=1e-3 if sensors is None else 1.5)
        assert east == pytest.approx(-1.0, abs=1e-3 if sensors is None else 1.5)


def test_what_its_instruments_cannot_say_is_refused(ship):
    loop, wire = Loop({"s": Plant.of(ship, dt=0.1)}, 10.0, math.inf, sensors=Suite((Gyro(), Gnss()))), Strings()
    with pytest.raises(WireError, match=r"DPT .*no echo sounder"):
        OnWire(loop, "s", wire, Speech(Fittings(), {"HDT": 1.0, "DPT": 1.0}))
    with pytest.raises(WireError, match=r"VDO .*no rate gyro"):
        OnWire(loop, "s", wire, Speech(Fittings(), {"VDO": 1.0}))
    OnWire(loop, "s", wire, Speech(Fittings()))  # all that they can, where nothing was asked for
    loop.run(2.0)
    assert set(said_by(wire)) == {"HDT", "THS", "ZDA", "GGA", "GLL", "RMC", "VTG"}


def heading(course: float) -> bytes:
    htc = decode(mutations.whole()[1])
    return encode(type(htc)(htc.talker, htc.kind, {**htc.fields, "cmdheading": course}))


@pytest.mark.slow
def test_its_steering_control_goes_by_its_gyro(ship):
    """A compass that shows 10 degrees too much keeps the ship 10 degrees to port of what was ordered."""
    gyros = Gyro(rate=10.0, heading=Errors(bias=10.0 * DEG)), RateGyro(rate=10.0)
    loop, plant, wire, on = at_sea(ship, Speech(Fittings()), sensors=Suite(gyros))
    wire.waiting.append(heading(20.0))
    loop.run(120.0)
    assert on.conning.mode == "heading"
    assert math.degrees(plant["psi"]) == pytest.approx(10.0, abs=0.2)
    blind, _, wire, on = at_sea(ship, Speech(Fittings()), sensors=Suite((Gnss(),)))
    wire.waiting.append(heading(20.0))
    blind.run(10.0)
    assert on.conning.mode == "none"
    assert on.conning.counts["unfit"] == 1


@pytest.mark.slow
def test_who_steers_is_saved_restored_and_reset_with_the_ship(ship):
    loop, plant, wire, on = at_sea(ship, sensors=usual(ship))

    def onward(seconds):
        wire.out.clear()
        loop.run(seconds)
        return plant["psi"], plant["delta"], list(wire.out), on.conning.mode, on.conning.heard

    wire.waiting.append(heading(20.0))
    loop.run(7.3)
    saved = loop.snapshot()
    there = onward(8.0)
    wire.waiting.append(heading(300.0))
    loop.run(20.0)
    loop.restore(saved)
    assert onward(8.0) == there
    loop.reset()
    assert (on.conning.commander, on.conning.mode, on.conning.heard, on.conning.stale) == ("", "none", None, False)
    loop.run(5.0)
    assert plant["delta_cmd"] == 0.0
    wire.waiting.append(heading(20.0))
    loop.run(5.0)
    assert plant["delta"] > 0.0


def test_after_a_blow_up_the_wire_speaks_again_when_the_ship_is_restored(ship):
    loop, plant, wire, on = at_sea(ship)
    wire.waiting.append(heading(20.0))
    loop.run(1.0)
    saved = loop.snapshot()
    head, body = plant.snapshot().split(b"\n", 1)
    plant.restore(head + b"\n" + struct.pack("<d", math.nan) * (len(body) // 8))
    loop.run(1.0)
    assert loop.vessels["s"].failure is not None
    assert loop.report.events.get("dropped", 0) == 0
    wire.out.clear()
    wire.waiting.append(heading(50.0))
    loop.run(1.0)
    assert wire.out == wire.waiting == []
    loop.restore(saved)
    loop.run(1.0)
    assert said_by(wire)["HDT"] == 10
    assert on.conning.control.course == pytest.approx(20.0 * DEG)
    assert plant["delta"] > 0.0


@pytest.mark.parametrize(("scheme", "framed"), [("udp", True), ("udp", False), ("tcp", False)])
def test_over_a_socket(ship, scheme, framed):
    plant = Plant.of(ship, dt=0.02)
    loop, wire = Loop({"s": plant}, 10.0, math.inf), Wire(Address(scheme, "127.0.0.1", 0))
    on = OnWire(loop, "s", wire, Speech(Fittings(), framed=framed))
    other = Wire(wire.address, connect=True)
    other.send(mutations.whole()[0])
    loop.run(5.0)
    other.wait(1.0)
    kinds = {message.sentence.kind for message in other.poll()}
    assert {"HDT", "ROT", "RMC", "RSA"} <= kinds
    assert on.conning.commander.startswith(scheme)
    assert plant["delta_cmd"] == pytest.approx(10.0 * DEG)
    wire.close()
    other.close()


def test_speech_that_cannot_be():
    with pytest.raises(WireError, match="no sentence 'HDX'; near: HDT"):
        Speech(Fittings(), {"HDX": 1.0})
    with pytest.raises(WireError, match="must be above zero"):
        Speech(Fittings(), {"HDT": 0.0})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--nmea", "udp://0.0.0.0:1"], "beyond this machine"), (["--nmea", "ship"], "'ship'"),
        (["--nmea", "udp://127.0.0.1:0", "--only", "HDX"], "near: HDT"),
        (["--nmea", "udp://127.0.0.1:0", "--factor", "1000"], "time factor 1000; give 0.1 to 100, or inf"),
        (["--nmea", "udp://127.0.0.1:0", "--speed", "1e9"], "--speed is 1e+09 m/s; kvlcc2_l7 goes 1.179 m/s"),
        (["--nmea", "udp://127.0.0.1:0", "--heading", "inf"], "--heading is inf"),
        (["--nmea", "udp://127.0.0.1:0", "--place", "99"], "--place is '99'"),
        (["--nmea", "udp://127.0.0.1:0", "--place", "99,0"], "datum at latitude 99"),
        (["--nmea", "udp://127.0.0.1:0", "--wind", "5,0"], "no force of wind"),
        (["--nmea", "tcp://127.0.0.1:0", "--to", "udp://127.0.0.1:5"], "over udp"),
        (["--nmea", "udp://127.0.0.1:0", "--duration", "-1"], "--duration is -1"),
        (["--nmea", "udp://127.0.0.1:0", "--commander", "here"], "commander 'here': write an IPv4 address"),
    ],
)  # fmt: skip
def test_requests_that_are_wrong(options, message, capsys):
    assert main(["steer", "kvlcc2_l7", *options]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1


def test_no_log_is_written_over_and_none_is_left_behind(tmp_path, capsys):
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "1", "--factor", "inf"]
    (tmp_path / "w.nmea").write_bytes(b"mine")
    assert main(["steer", "kvlcc2_l7", *options, "--log", str(tmp_path / "w.nmea")]) == 2
    assert "w.nmea: is there already; choose another name" in capsys.readouterr().err
    assert (tmp_path / "w.nmea").read_bytes() == b"mine"
    assert main(["steer", "kvlcc2_l7", *options, "--log", str(tmp_path / "b.nmea"), "--beside", "no-such"]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["w.nmea"]


@pytest.mark.slow
def test_a_run_as_fast_as_possible_and_one_that_fails(tmp_path, capsys):
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "5", "--factor", "inf"]
    assert main(["steer", "kvlcc2", *options]) == 0
    assert capsys.readouterr().out.startswith("5 s sailed")
    unstable = save(load("kvlcc2").having({"hull.N_r": 1e9}), tmp_path / "unstable.toml")
    assert main(["steer", str(unstable), *options, "--wind", "20,90"]) == 1
    assert "error: the simulation of kvlcc2 failed: kvlcc2: x = inf" in capsys.readouterr().err


def test_nothing_is_written_where_a_sentence_cannot_be_said(tmp_path, capsys):
    files = ["--log", str(tmp_path / "w.nmea"), "-o", str(tmp_path / "run.csv")]
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "1", "--factor", "100"]
    assert main(["steer", "milliampere", *options, "--only", "HDT,RSA", *files]) == 2
    error = capsys.readouterr().err
    assert re.fullmatch("error: --only: RSA .*no rudder.*\n", error)
    (tmp_path / "run.csv").touch()
    assert main(["steer", "milliampere", *options, *files]) == 2
    assert [path.name for path in tmp_path.iterdir()] == ["run.csv"]


def test_the_command_line_with_sensors_heeds_the_antenna(tmp_path):
    log = tmp_path / "w.nmea"
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "5", "--factor", "100", "--speed", "0.1"]
    aboard = ["--sensors", "--antenna", "500,0", "--place", "35,139", "--only", "GGA,DPT"]
    assert main(["steer", "kvlcc2", *options, *aboard, "--log", str(log)]) == 0
    lines = [read_line(line).sentence for line in log.read_bytes().splitlines(keepends=True)]
    fix = next(readings(hear(line)) for line in lines if line[3:6] == b"GGA")
    assert Datum(35.0, 139.0).north_east(fix["latitude"], fix["longitude"])[0] == pytest.approx(500.0, abs=5.0)
    assert any(line[3:6] == b"DPT" for line in lines)


def messages(log) -> list:
    """AIS messages of a log of sentences, put together from their parts."""
    pyais = pytest.importorskip("pyais")
    found, parts = [], []
    for line in log.read_bytes().splitlines():
        sentence = line[line.rindex(b"\\") + 1 :]
        if sentence.startswith(b"!"):
            parts.append(sentence)
            if sentence.split(b",")[1] == sentence.split(b",")[2]:
                found.append((sentence[3:6].decode(), pyais.decode(*parts).asdict()))
                parts = []
    return found


@pytest.mark.slow
def test_a_transponder_has_a_number_and_tells_name_and_size(tmp_path, capsys):
    log = tmp_path / "w.nmea"
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "400", "--factor", "inf", "--rate", "1"]
    assert main(["steer", "kvlcc2", *options, "--only", "VDO"]) == 2
    assert re.search("VDO .*MMSI", capsys.readouterr().err)
    assert main(["steer", "kvlcc2", *options, "--mmsi", "12"]) == 2
    assert "--mmsi is 12; that of a ship has nine digits" in capsys.readouterr().err
    more = ["--mmsi", "211000001", "--antenna", "-100,5", "--only", "VDO,HDT", "--log", str(log)]
    assert main(["steer", "kvlcc2", *options, *more]) == 0
    said = [message for _, message in messages(log)]
    assert {message["mmsi"] for message in said} == {211000001}
    assert {message["maneuver"] for message in said if message["msg_type"] == 1} == {0}  # not available; 3 is reserved
    static = [message for message in said if message["msg_type"] == 5]
    assert len(static) == 2  # at once, and after six minutes
    assert static[0]["shipname"] == "KVLCC2"
    assert [static[0][name] for name in ("to_bow", "to_stern", "to_port", "to_starboard")] == [260, 60, 34, 24]
    assert static[0]["draught"] == pytest.approx(20.8)


@pytest.mark.slow
def test_talkers_are_those_of_the_standard_and_depth_is_told(tmp_path):
    log = tmp_path / "w.nmea"
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "3", "--factor", "inf", "--depth", "30"]
    assert main(["steer", "kvlcc2_shallow", *options, "--log", str(log)]) == 0
    said = [read_line(line).sentence for line in log.read_bytes().splitlines(keepends=True)]
    assert {line[1:3] for line in said if line[3:6] == b"ZDA"} == {b"GP"}
    depths = [readings(hear(line))["depth"] for line in said if line[3:6] == b"DPT"]
    assert depths
    assert depths == pytest.approx([30.0] * len(depths), abs=0.1)


@pytest.mark.slow
def test_other_ships_hold_their_course_and_are_heard(tmp_path):
    log = tmp_path / "w.nmea"
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "300", "--factor", "inf", "--rate", "1"]
    options += ["--place", "35,139", "--only", "HDT,VDM"]
    assert main(["steer", "kvlcc2", *options, "--other", "mariner@500,500,270", "--log", str(log)]) == 0
    heard = [message for kind, message in messages(log) if kind == "VDM" and message["msg_type"] == 1]
    assert len(heard) == 50  # every 6 s above 14 kn (ITU-R M.1371-5, table 1)
    assert {message["mmsi"] for message in heard} == {200000001}
    assert {message["heading"] for message in heard} <= {269, 270, 271}
    north, east = Datum(35.0, 139.0).north_east(heard[0]["lat"], heard[0]["lon"])
    assert (north, east) == (pytest.approx(500.0, abs=5.0), pytest.approx(500.0, abs=100.0))
    assert heard[-1]["lon"] < heard[0]["lon"]


def test_a_recording_of_steer_says_when_and_where(tmp_path):
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "2", "--factor", "inf", "--place", "35,139.5"]
    before = datetime.now(UTC)
    assert main(["steer", "kvlcc2_l7", *options, "-o", str(tmp_path / "run.csv")]) == 0
    meta = read_trial(tmp_path / "run.csv").meta
    assert meta["datum"] == {"latitude": 35.0, "longitude": 139.5}
    assert abs((datetime.fromisoformat(meta["start"]) - before).total_seconds()) < 5.0


@pytest.mark.slow
def test_a_ship_on_the_wire_feels_gusts_and_waves(tmp_path):
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "20", "--factor", "inf"]
    weather = ["--wind", "10,90", "--gusts", "davenport", "--waves", "3,9,0"]
    assert main(["steer", "kvlcc2", *options, "-o", str(tmp_path / "calm.csv")]) == 0
    assert main(["steer", "kvlcc2", *options, *weather, "-o", str(tmp_path / "rough.csv")]) == 0
    calm, rough = (read_trial(tmp_path / f"{name}.csv") for name in ("calm", "rough"))
    assert np.ptp(rough["U_T"]) > 0.5
    assert rough["U_T"].mean() == pytest.approx(10.0, rel=0.3)
    assert set(rough["H_S"]) == {3.0}
    assert rough["u"][-1] < calm["u"][-1] - 1e-3


def test_a_recording_that_ends_by_itself_is_a_failed_run(tmp_path, monkeypatch, capsys):
    write = os.write
    rows = iter(range(10**9))
    full = OSError(errno.ENOSPC, "No space left on device")

    def limited(file, data):
        if next(rows) < 8:
            return write(file, data)
        raise full

    monkeypatch.setattr(os, "write", limited)
    options = ["--nmea", "udp://127.0.0.1:0", "--duration", "5", "--factor", "inf"]
    assert main(["steer", "kvlcc2_l7", *options, "-o", str(tmp_path / "run.csv")]) == 1
    told = capsys.readouterr().err
    assert "error: the recording is not whole" in told
    assert "No space left on device" in told


@pytest.mark.parametrize(("code", "status"), [("print('{address}')", 0), ("raise SystemExit(3)", 1)])
def test_another_program_beside_it(code, status, capsys):
    options = ["--nmea", "udp://127.0.0.1:0", "--factor", "100", "--duration", "1000"]
    assert main(["steer", "kvlcc2_l7", *options, "--beside", f'python -c "{code}"']) == status
    told = capsys.readouterr()
    if status:
        assert "the program of --beside failed, exit status 3" in told.err
    else:
        assert told.out.startswith("127.0.0.1:")


@pytest.mark.slow
def test_command_line(tmp_path, capsys):
    options = ["--nmea", "tcp://127.0.0.1:0", "--factor", "100", "--duration", "20", "--json"]
    files = ["--log", str(tmp_path / "w.nmea"), "-o", str(tmp_path / "run.csv")]
    assert main(["steer", "kvlcc2_l7", *options, *files]) == 0
    assert '"t": 20.0' in capsys.readouterr().out
    assert len(read_trial(tmp_path / "run.csv")) == 201
    assert main(["import", "nmea", str(tmp_path / "w.nmea"), "-o", str(tmp_path / "out")]) == 0

"""A ship of a loop on the wire: she talks at the rates asked for, obeys valid sentences, and nothing else moves her."""

from __future__ import annotations

import io
import math
from collections import Counter

import mutations
import pytest

from seatrial.cli import main
from seatrial.data.geodesy import Datum
from seatrial.data.importing import import_log
from seatrial.data.nmea import decode, encode
from seatrial.data.nmea_framing import TOKEN, read_line, split
from seatrial.data.nmea_reading import readings
from seatrial.data.nmea_ship import Fittings
from seatrial.data.trialfile import read_trial
from seatrial.realtime.intake import Intake
from seatrial.realtime.loop import Loop
from seatrial.realtime.on_wire import OnWire, Speech
from seatrial.realtime.plant import Plant
from seatrial.realtime.wire import Address, Message, Wire, WireError
from seatrial.ships.files import load

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


def test_sentences_come_at_their_rates(ship):
    loop, _, wire, _ = at_sea(ship)
    loop.run(10.0)
    kinds = Counter(line[3:6].decode() for data in wire.out for line in split(data))
    assert kinds == {"HDT": 100, "THS": 100, "ROT": 100, "RSA": 50, "VBW": 50, "RMC": 50, "GGA": 10, "VTG": 10,
                     "ZDA": 10, "RPM": 10, "MWV": 20, "DPT": 10}  # fmt: skip


def test_frames_carry_numbers_and_the_time(ship):
    speech = Speech(Fittings(epoch=1.8e9), {"HDT": 10.0, "ROT": 10.0}, framed=True)
    loop, _, wire, _ = at_sea(ship, speech)
    loop.run(60.0)
    assert all(data.startswith(TOKEN) for data in wire.out)
    tags = [read_line(line).tag for data in wire.out for line in split(data)]
    assert [tag.number for tag in tags] == [k % 1000 for k in range(1200)]
    assert tags[-1].time == pytest.approx(1.8e9 + 60.0)


def test_an_order_turns_her_and_what_she_says_is_what_she_does(ship):
    loop, plant, wire, _ = at_sea(ship)
    wire.waiting.append(mutations.whole()[0])  # rudder 10 deg to starboard
    loop.run(20.0)
    said = {}
    for data in wire.out:
        for line in split(data):
            said |= readings(decode(line))
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


def test_nothing_but_valid_sentences_moves_her(ship):
    """Every change of orders or of the steering control has a sentence behind it that another reader takes."""
    pytest.importorskip("pynmeagps")
    loop, plant, wire, on = at_sea(ship, Speech(Fittings(), {"HDT": 0.1}))
    con = on.conning

    def settings() -> tuple:
        by_hand = () if con.mode in ("heading", "track") else (plant["delta_cmd"],)
        return (con.mode, con.commander, con.control.course, con.control.across, plant["n_P_cmd"], *by_hand)

    moved = 0
    for data in mutations.datagrams(3000, seed=2):
        loop.step()  # an order acts from the next tick on
        before = settings()
        wire.waiting.append(data)
        loop.step()
        loop.step()
        if settings() != before:
            moved += 1
            assert known_to_pynmeagps(data), data
    assert moved > 100
    assert loop.k == 9000
    assert loop.report.events.get("dropped", 0) == 0
    assert math.isfinite(plant["psi"])


def test_beyond_the_limits_is_clipped_and_told(ship):
    loop, plant, wire, _ = at_sea(ship)
    order = decode(mutations.whole()[0])
    wire.waiting.append(encode(type(order)(order.talker, order.kind, {**order.fields, "stbdrudderorder": 90.0})))
    loop.run(5.0)
    assert plant["delta"] == pytest.approx(35.0 * DEG)
    assert "clipped" in {event.kind for event in loop.events}


def test_what_she_says_imports_as_the_trial_she_was(ship, tmp_path):
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


def test_through_instruments(ship):
    from seatrial.sensors.suite import usual

    loop, _, wire, _ = at_sea(ship, sensors=usual(ship))
    loop.run(10.0)
    lines = [line for data in wire.out for line in split(data)]
    kinds = Counter(line[3:6].decode() for line in lines)
    assert kinds["HDT"] == pytest.approx(100, abs=2)
    assert kinds["RMC"] == pytest.approx(10, abs=1)
    assert kinds["RSA"] == pytest.approx(50, abs=2)
    speeds = [decode(line) for line in lines if line[3:6] == b"VBW"]
    assert all(one["longgroundspd"] is None and one["groundspdstatus"] == "V" for one in speeds)


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
        (["--nmea", "udp://0.0.0.0:1"], "beyond this machine"), (["--nmea", "ship"], "is no address"),
        (["--nmea", "udp://127.0.0.1:0", "--only", "HDX"], "near: HDT"),
        (["--nmea", "udp://127.0.0.1:0", "--factor", "1000"], "time factor 1000"),
        (["--nmea", "udp://127.0.0.1:0", "--place", "99"], "--place is '99'"),
        (["--nmea", "udp://127.0.0.1:0", "--place", "99,0"], "datum at latitude 99"),
        (["--nmea", "udp://127.0.0.1:0", "--wind", "5,0"], "no force of wind"),
        (["--nmea", "tcp://127.0.0.1:0", "--to", "udp://127.0.0.1:5"], "over udp"),
        (["--nmea", "udp://127.0.0.1:0", "--duration", "-1"], "--duration is -1"),
    ],
)  # fmt: skip
def test_requests_that_are_wrong(options, message, capsys):
    assert main(["steer", "kvlcc2_l7", *options]) == 2
    told = capsys.readouterr().err
    assert message in told
    assert told.count("\n") == 1


@pytest.mark.parametrize(("code", "status"), [("print('{address}')", 0), ("raise SystemExit(3)", 1)])
def test_another_program_beside_her(code, status, capsys):
    options = ["--nmea", "udp://127.0.0.1:0", "--factor", "100", "--duration", "1000"]
    assert main(["steer", "kvlcc2_l7", *options, "--beside", f'python -c "{code}"']) == status
    told = capsys.readouterr()
    if status:
        assert "the program beside her failed, exit status 3" in told.err
    else:
        assert told.out.startswith("127.0.0.1:")


def test_command_line(tmp_path, capsys):
    options = ["--nmea", "tcp://127.0.0.1:0", "--factor", "100", "--duration", "20", "--json"]
    files = ["--log", str(tmp_path / "w.nmea"), "-o", str(tmp_path / "run.csv")]
    assert main(["steer", "kvlcc2_l7", *options, *files]) == 0
    assert '"t": 20.0' in capsys.readouterr().out
    assert len(read_trial(tmp_path / "run.csv")) == 201
    assert main(["import", "nmea", str(tmp_path / "w.nmea"), "-o", str(tmp_path / "out")]) == 0

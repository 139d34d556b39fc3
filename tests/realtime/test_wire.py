"""The wire holds: against what is not for it, too much, too large, too old, and against those who do not listen."""

from __future__ import annotations

import math
import socket
import threading
import time

import mutations
import pytest

from seatrial.data.nmea.framing import LARGEST, Line, Tag, datagram, split
from seatrial.data.nmea.ship import Fittings
from seatrial.realtime.loop import Loop
from seatrial.realtime.on_wire import OnWire, Speech
from seatrial.realtime.plant import Plant
from seatrial.realtime.wire import OTHER, Address, Intake, Wire, WireError
from seatrial.ships.files import load

HTC, ROR = mutations.whole()[1], mutations.whole()[0]
UDP, TCP = Address("udp", "127.0.0.1", 0), Address("tcp", "127.0.0.1", 0)


def until(wire: Wire, wanted: int, seconds: float = 5.0) -> list:
    found, end = [], time.monotonic() + seconds
    while len(found) < wanted and time.monotonic() < end:
        wire.wait(0.05)
        found += wire.poll()
    return found


@pytest.fixture
def udp():
    wire = Wire(UDP)
    yield wire
    wire.close()


@pytest.fixture
def tcp():
    wire = Wire(TCP)
    yield wire
    wire.close()


@pytest.mark.parametrize(
    "text", ["", "127.0.0.1:1", "http://127.0.0.1:1", "udp://127.0.0.1", "udp://127.0.0.1:99999", "udp://ship:1",
             "udp://127.0.0.1:1/x", "udp://[::1]:1", "tcp://:1", "udp://a@127.0.0.1:1"],
)  # fmt: skip
def test_addresses_that_cannot_be(text):
    with pytest.raises(WireError) as error:
        Address.parse(text)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.2", "239.192.0.4"])
def test_beyond_this_machine_only_when_asked(host):
    with pytest.raises(WireError, match="--anywhere"):
        Address.parse(f"udp://{host}:60004")
    assert Address.parse(f"udp://{host}:60004", anywhere=True).host == host
    assert Address.parse("tcp://localhost:5").host == "127.0.0.1"


def test_datagrams_there_and_back(udp):
    other = Wire(udp.address, connect=True)
    other.send(HTC)
    [message] = until(udp, 1)
    assert message.sentence.kind == "HTC"
    assert message.sender.startswith("udp 127.0.0.1:")
    assert udp.peers == 1
    udp.send(ROR)
    assert [one.sentence.kind for one in until(other, 1)] == ["ROR"]
    other.close()


@pytest.mark.slow
def test_who_sends_nothing_valid_is_not_answered(udp):
    other = Wire(udp.address, connect=True)
    other.send(b"hello\r\n")
    assert until(udp, 1, 0.3) == []
    assert udp.peers == 0
    assert udp.counts["form"] == 1
    other.close()


def test_nobody_listening_is_no_error(udp):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as gone:
        gone.bind(("127.0.0.1", 0))
        port = gone.getsockname()[1]
    told = Wire(UDP, to=[Address("udp", "127.0.0.1", port)])
    for _ in range(5):
        told.send(HTC)
        assert told.poll() == []
    told.close()


@pytest.mark.long
def test_tcp_lines_in_pieces_and_clients_that_come_and_go(tcp):
    client = socket.create_connection((tcp.address.host, tcp.address.port))
    client.sendall(HTC[:10])
    assert until(tcp, 1, 0.2) == []
    client.sendall(HTC[10:] + ROR + b"$half")
    assert [one.sentence.kind for one in until(tcp, 2)] == ["HTC", "ROR"]
    tcp.send(ROR)
    assert client.recv(200) == ROR
    client.close()
    assert until(tcp, 1, 0.3) == []
    assert tcp.peers == 0
    other = Wire(tcp.address, connect=True)
    other.send(HTC)
    assert len(until(tcp, 1)) == 1
    other.close()


@pytest.mark.slow
def test_a_tcp_line_without_an_end_is_dropped_and_the_next_one_read(tcp):
    client = socket.create_connection((tcp.address.host, tcp.address.port))
    client.sendall(b"x" * 5000)
    until(tcp, 1, 0.3)
    client.sendall(b"y" * 3000 + b"\r\n" + HTC)
    assert [one.sentence.kind for one in until(tcp, 1)] == ["HTC"]
    assert tcp.counts["oversized"] == 1
    client.close()


@pytest.mark.slow
def test_a_client_that_does_not_read_is_dropped_and_the_rest_goes_on(tcp):
    deaf = socket.create_connection((tcp.address.host, tcp.address.port))
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    good = socket.create_connection((tcp.address.host, tcp.address.port))
    good.setblocking(False)
    until(tcp, 1, 0.2)
    assert tcp.peers == 2
    for _ in range(20000):
        tcp.send(ROR * 15)
        try:
            while good.recv(65536):
                pass
        except BlockingIOError:
            pass
        if tcp.counts["dropped"]:
            break
    assert tcp.counts["dropped"] == 1
    assert tcp.peers == 1
    deaf.close()
    good.close()


def test_a_port_in_use_and_a_server_that_is_not_there():
    first = Wire(TCP)
    with pytest.raises(WireError, match="is the port right, and free"):
        Wire(first.address)
    first.close()
    with pytest.raises(WireError, match="is the port right, and free"):
        Wire(first.address, connect=True)
    with pytest.raises(WireError, match="over udp"):
        Wire(TCP, to=[UDP])


def test_repeated_and_older_lines_are_dropped():
    intake = Intake()
    framed = [datagram([Line(ROR, Tag("AG0001", n, 100.0 + n))]) for n in range(5)]
    assert all(intake.take(one, "a", 0.0) for one in framed)
    assert not any(intake.take(one, "a", 1.0) for one in framed)
    assert intake.counts["replayed"] == 5
    assert intake.take(framed[0], "b", 1.0)  # of another sender it is new
    assert intake.take(framed[0], "a", 20.0)  # a new start after a silence
    assert intake.take(datagram([Line(ROR, Tag("AG0001", 999))]), "c", 0.0)
    assert intake.take(datagram([Line(ROR, Tag("AG0001", 0))]), "c", 0.0)  # 999 is followed by 0
    assert intake.take(ROR, "a", 20.0)  # plain lines have no number: an order said twice is an order
    assert intake.take(ROR, "a", 20.0)


def test_a_valid_sentence_that_is_not_read_here_tells_that_its_sender_lives():
    intake = Intake()
    assert intake.take(b"$PSRF103,00,01,00,01*25\r\n$HEHBT,1.0,A,1*00\r\n", "a", 0.0) == [OTHER]
    assert (intake.counts["other"], intake.counts["checksum"], intake.counts["sentences"]) == (1, 1, 0)


def test_a_flood_is_cut_and_others_get_through():
    intake = Intake(rate=100.0)
    taken = sum(len(intake.take(ROR, "flood", 0.001 * k)) for k in range(5000))
    assert taken == pytest.approx(100 + 500, abs=20)
    assert intake.counts["flooded"] > 4000
    assert len(intake.take(ROR, "good", 5.0)) == 1


@pytest.mark.parametrize("end", [b"\r", b"\n", b"\r\n"])
def test_no_line_end_gets_a_flood_past_the_limit(end):
    intake, rubble = Intake(rate=100.0), b"x" + end
    for _ in range(50):
        intake.take(rubble * (LARGEST // len(rubble)), "flood", 0.0)
    looked_at = sum(intake.counts[reason] for reason in ("form", "length", "checksum", "field", "other"))
    assert looked_at <= 100
    assert split(b"a\rb\r\nc\n\r\n\nd") == [b"a\rb", b"c", b"d"]


def test_an_answer_to_each_heading_is_no_flood_where_time_runs_a_hundred_times_as_fast(monkeypatch):
    clock = iter(range(10**9))
    monkeypatch.setattr(time, "monotonic", lambda: next(clock) / 1000.0)  # a tick of 0.1 s in a millisecond
    wire, other = Wire(UDP, intake=Intake(rate=20.0)), socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    taken = 0
    for k in range(400):
        other.sendto(ROR, (wire.address.host, wire.address.port))
        wire.t = 0.1 * k
        taken += len(wire.poll())
    assert taken == 400
    assert wire.counts["flooded"] == 0
    wire.close()
    other.close()


@pytest.mark.slow
def test_sources_behind_one_gateway_have_line_numbers_of_their_own():
    intake = Intake()
    for k in range(20):
        for source, number in (("HE0001", k), ("GP0001", 60 + k)):
            framed = datagram([Line(ROR, Tag(source, number, 100.0 + number))])
            assert intake.take(framed, "gateway", 0.1 * k)
            assert not intake.take(framed, "gateway", 0.1 * k)
    for k in range(5000):
        intake.take(datagram([Line(ROR, Tag(f"S{k}", 1))]), "gateway", 100.0 + k)
    assert len(intake._senders["gateway"].tags) <= 64


def test_a_flood_from_many_ports_is_cut_as_well():
    intake = Intake(rate=100.0)
    taken = sum(len(intake.take(ROR, f"port {k % 50}", 0.0)) for k in range(5000))
    assert taken == 400


def test_it_does_not_grow():
    intake = Intake()
    for k in range(5000):
        intake.take(ROR, f"udp 127.0.0.1:{k}", 0.0)
    assert len(intake._senders) <= 64


@pytest.mark.slow
def test_mutated_datagrams_never_raise():
    intake = Intake(rate=1e9)
    for data in mutations.datagrams(5000, seed=1):
        for one in intake.take(data, "a", 0.0):
            assert one.kind
    assert sum(intake.counts.values()) >= 5000


@pytest.mark.slow
def test_a_flood_over_the_socket_does_not_stop_the_loop(udp):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as flood:
        for _ in range(5000):
            flood.sendto(ROR, (udp.address.host, udp.address.port))
    udp.poll()
    until(udp, 10**9, 0.2)
    assert udp.counts["sentences"] <= 1000


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["udp", "tcp"])
def test_no_step_is_missed_under_fire(scheme):
    """Three seconds of rubble as fast as a sender can: every tick is taken."""
    plant = Plant.of(load("kvlcc2_l7"), dt=0.02)
    loop, wire = Loop({"s": plant}, 10.0, 5.0), Wire(Address(scheme, "127.0.0.1", 0))
    on = OnWire(loop, "s", wire, Speech(Fittings(), {"HDT": 1.0}))
    good = Wire(wire.address, connect=True)
    stop = threading.Event()

    def fire() -> None:
        kind = socket.SOCK_DGRAM if scheme == "udp" else socket.SOCK_STREAM
        with socket.socket(socket.AF_INET, kind) as gun:
            gun.connect((wire.address.host, wire.address.port))
            gun.settimeout(0.1)
            for data in mutations.datagrams(10**9, seed=3):
                if stop.is_set():
                    return
                try:
                    gun.send(data.replace(b"ROR", b"XXX") or b"x")
                except OSError:
                    continue

    firing = threading.Thread(target=fire)
    loop.after(lambda loop: good.send(ROR) if loop.k % 5 == 0 else None)
    firing.start()
    report = loop.run(15.0)
    stop.set()
    firing.join()
    assert report.ticks == 150
    assert report.slipped == 0.0
    assert report.events.get("dropped", 0) == 0
    assert math.isfinite(plant["psi"])
    assert on.wire.counts["datagrams"] > 500
    wire.close()
    good.close()

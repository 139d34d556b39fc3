"""Limits of wire, intake and serial line, each at its edge: sockets, clocks and devices moved by hand."""

from __future__ import annotations

import os
import socket
from collections.abc import Iterator
from typing import Any, ClassVar

import pytest

from seatrial.data.nmea.framing import LARGEST, Line, Tag, datagram
from seatrial.data.nmea.sentences import Sentence, encode
from seatrial.realtime import serial_line, wire
from seatrial.realtime.serial_line import BAUDS, SerialLine, is_serial
from seatrial.realtime.wire import OTHER, Address, Authority, Intake, Mute, Wire, WireError

ROR = encode(Sentence("AG", "ROR", {"stbdrudderorder": 10.0, "stbdrudderstatus": "A", "portrudderorder": None,
                                    "portrudderstatus": "V", "operatinglocind": None}))  # fmt: skip
UDP, TCP = Address("udp", "127.0.0.1", 0), Address("tcp", "127.0.0.1", 0)


class Clock:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.slept: list[float] = []

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    found = Clock()
    for room in (wire, serial_line):
        monkeypatch.setattr(room, "time", found)
    return found


class Plug:
    """A socket that gives what was put in and takes what it is let."""

    def __init__(self, *pieces: bytes, room: int = 10**9) -> None:
        self.pieces, self.room, self.sent, self.closed, self.asked = list(pieces), room, b"", False, list[int]()

    def recv(self, most: int) -> bytes:
        self.asked.append(most)
        if not self.pieces:
            raise BlockingIOError
        return self.pieces.pop(0)

    def recvfrom(self, most: int) -> tuple[bytes, tuple[str, int]]:
        return self.recv(most), ("127.0.0.1", 7)

    def send(self, data: bytes) -> int:
        if not self.room:
            raise BlockingIOError
        some = data[: self.room]
        self.room -= len(some)
        self.sent += some
        return len(some)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def tcp() -> Iterator[Wire]:
    found = Wire(TCP)
    yield found
    found.close()


def with_client(tcp: Wire, plug: Any) -> Any:
    client = wire._Client(plug, "tcp 127.0.0.1:9")
    tcp._clients.append(client)
    return client


# --- the wire ---


def test_a_sender_is_answered_for_half_a_minute(clock: Clock) -> None:
    one = Wire(UDP)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(ROR, (one.address.host, one.address.port))
        one.wait(5.0)
        assert len(one.poll()) == 1
    for later, peers in ((29.9, 1), (0.2, 0)):
        clock.now += later
        one.poll()
        assert one.peers == peers
    one.close()


def test_sixteen_senders_are_answered_and_as_many_clients_let_in(tcp: Wire) -> None:
    one, others = Wire(UDP), [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(17)]
    for other in others:
        other.sendto(ROR, (one.address.host, one.address.port))
    heard = 0
    while heard < 17:
        one.wait(5.0)
        heard += len(one.poll())
    assert (heard, one.peers) == (17, 16)
    one.close()
    clients = [socket.create_connection((tcp.address.host, tcp.address.port)) for _ in range(17)]
    while sum(tcp.counts[name] for name in ("clients", "refused")) < 17:
        tcp.wait(5.0)
        tcp.poll()
    assert (tcp.counts["clients"], tcp.counts["refused"], tcp.peers) == (16, 1, 16)
    for end in (*others, *clients):
        end.close()


@pytest.mark.slow
def test_a_poll_reads_a_thousand_datagrams_or_eight_pieces_and_leaves_the_rest(tcp: Wire) -> None:
    one, plug = Wire(UDP, intake=Intake(rate=1e9)), Plug(*[ROR] * 1005)
    one._socket.close()
    one._socket = plug  # type: ignore[assignment]
    assert [len(one.poll()), len(one.poll())] == [1000, 5]
    assert set(plug.asked) == {LARGEST + 1}
    one.close()
    pieces = Plug(*[ROR] * 10)
    with_client(tcp, pieces)
    assert [len(tcp.poll()), len(tcp.poll())] == [8, 2]
    assert set(pieces.asked) == {4096}
    assert tcp.counts["dropped"] == 0


def test_an_error_of_an_earlier_datagram_is_no_end_of_the_poll() -> None:
    class Broken(Plug):
        def recvfrom(self, most: int) -> tuple[bytes, tuple[str, int]]:
            if len(self.pieces) == 2:
                self.pieces.pop()
                raise ConnectionRefusedError
            return super().recvfrom(most)

        def sendto(self, data: bytes, peer: object) -> None:
            raise OSError

    one = Wire(UDP, to=[Address("udp", "127.0.0.1", 9)])
    one._socket.close()
    one._socket = Broken(ROR, b"")  # type: ignore[assignment]
    assert len(one.poll()) == 1
    assert one.peers == 2  # the one given and the one heard
    one.send(ROR)
    assert (one.counts["sent"], one.counts["unsent"]) == (1, 2)
    one.close()


@pytest.mark.parametrize(("length", "kept"), [(1024, True), (1025, False)])
def test_a_line_without_an_end_is_kept_up_to_a_kilobyte(tcp: Wire, length: int, kept: bool) -> None:
    plug = Plug(b"x" * length)
    client = with_client(tcp, plug)
    tcp.poll()
    assert (len(client.unfinished), client.skipping) == ((length, False) if kept else (0, True))
    assert tcp.counts["oversized"] == (not kept)
    plug.pieces = [b"y" * 2000, b"z\r\n" + ROR]
    assert [one.sentence.kind for one in tcp.poll()] == ["ROR"]
    assert tcp.counts["oversized"] == 1  # one line, however long
    assert tcp.poll() == []


def test_a_client_that_reads_slowly_gets_all_and_one_that_does_not_read_is_dropped(tcp: Wire) -> None:
    slow, deaf = Plug(room=10), Plug(room=0)
    first = with_client(tcp, slow)
    tcp.send(ROR)
    assert slow.sent == ROR[:10]
    slow.room = 1000
    tcp.poll()
    assert (slow.sent, first.unsent) == (ROR, b"")
    tcp._clients.clear()
    with_client(tcp, deaf)
    tcp.send(b"x" * 65536)
    assert (tcp.peers, tcp.counts["dropped"]) == (1, 0)
    tcp.send(b"x")
    assert (tcp.peers, tcp.counts["dropped"], deaf.closed) == (0, 1, True)


def test_a_client_that_has_gone_is_dropped_once(tcp: Wire) -> None:
    class Gone(Plug):
        def send(self, data: bytes) -> int:
            raise BrokenPipeError

        def recv(self, most: int) -> bytes:
            raise ConnectionResetError

    for plug in (Plug(b""), Gone()):
        with_client(tcp, plug)
        tcp.poll()
        assert (tcp.peers, plug.closed) == (0, True)
    with_client(tcp, Gone())
    tcp.send(ROR)
    assert tcp.counts["dropped"] == 3


def test_it_waits_for_its_sockets_and_no_longer_than_it_may(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> None:
    waited: list[tuple[int, float]] = []
    monkeypatch.setattr(wire.select, "select", lambda r, w, x, s: waited.append((len(r), s)) or ([], [], []))
    one, two = Wire(UDP), Wire(TCP)
    one.wait(0.3)
    one.wait(-1.0)
    two.wait(0.2)
    with_client(two, Plug())
    two.wait(0.1)
    two._listening = False
    two.wait(0.1)
    assert waited == [(1, 0.3), (1, 0.0), (1, 0.2), (2, 0.1), (1, 0.1)]
    two._clients.clear()
    two.wait(0.4)
    Mute().wait(0.7)
    Mute().wait(-0.7)
    assert clock.slept == [0.4, 0.7, 0.0]
    one.close()
    two.close()


def test_datagrams_to_a_group_stay_in_their_network() -> None:
    one = Wire(UDP)
    assert one._socket.getsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL) == 1
    assert not one._socket.getblocking()
    assert str(one.address) == f"udp://127.0.0.1:{one.address.port}"
    one.close()


def test_the_limit_of_the_input_grows_by_what_simulated_time_is_ahead(clock: Clock) -> None:
    one = Wire(UDP)
    for t, now, ahead in ((10.0, 1.0, 9.0), (10.5, 2.0, 9.0), (15.0, 2.5, 13.0), (15.0, 99.0, 13.0)):
        one.t, clock.now = t, 1000.0 + now
        one.poll()
        assert one.intake.ahead == pytest.approx(ahead)
    one.close()


def test_a_line_to_nobody_says_and_hears_nothing() -> None:
    mute = Mute()
    mute.send(ROR)
    assert (mute.poll(), mute.peers, mute.t, sum(mute.counts.values())) == ([], 0, 0.0, 0)


# --- the intake ---


@pytest.mark.slow
def test_a_sender_may_say_as_many_lines_at_once_as_in_a_second() -> None:
    """500 lines, unless told otherwise; each line counts, with or without an end."""
    intake = Intake()
    assert sum(len(intake.take(ROR, "a", 0.0)) for _ in range(600)) == 500
    assert intake.counts["flooded"] == 100
    assert len(intake.take(ROR * 6, "a", 0.011)) == 0  # 5.5 lines are left
    assert len(intake.take(ROR * 5, "a", 0.011)) == 5
    assert len(intake.take(ROR.rstrip() + b"\r\n" + ROR.rstrip(), "a", 0.0141)) == 2
    assert intake.counts["datagrams"] == 603
    assert len(intake.take(ROR * 2, "a", 0.0141)) == 0
    assert intake.counts["flooded"] == 108
    assert sum(len(intake.take(ROR, "a", 5.0)) for _ in range(600)) == 500  # a silence saves no more than that


def test_all_together_may_say_four_times_as_much() -> None:
    intake = Intake(rate=10.0)
    assert sum(len(intake.take(ROR, f"p{k}", 0.0)) for k in range(60)) == 40
    assert sum(len(intake.take(ROR, f"q{k}", 0.1)) for k in range(60)) == 4
    intake.ahead = 0.26  # simulated time that is ahead of the clock counts too
    assert sum(len(intake.take(ROR, f"r{k}", 0.1)) for k in range(60)) == 10


def test_a_datagram_is_as_large_as_the_standard_allows() -> None:
    intake = Intake()
    whole = ROR + b"x" * (LARGEST - len(ROR))
    assert len(intake.take(whole, "a", 0.0)) == 1
    assert intake.counts["oversized"] == 0
    assert intake.take(whole + b"x", "a", 0.0) == []
    assert intake.counts["oversized"] == 1


def framed(number: int | None, time: float | None = None, source: str = "AG0001") -> bytes:
    return datagram([Line(ROR, Tag(source, number, time))])


@pytest.mark.parametrize(("number", "later", "taken"), [
    (500, 1.0, False), (499, 1.0, False), (401, 1.0, False), (400, 1.0, True), (501, 1.0, True),
    (500, 9.9, False), (500, 10.1, True),
])  # fmt: skip
def test_a_number_up_to_a_hundred_behind_is_a_repetition_for_ten_seconds(number, later, taken) -> None:
    intake = Intake()
    assert intake.take(framed(500), "a", 0.0)
    assert bool(intake.take(framed(number), "a", later)) is taken
    assert intake.counts["replayed"] == (not taken)


def test_numbers_begin_again_after_999() -> None:
    intake = Intake()
    assert intake.take(framed(30), "a", 0.0)
    assert not intake.take(framed(999), "a", 1.0)  # 31 behind
    assert intake.take(framed(930), "a", 1.0)  # 100 behind


@pytest.mark.parametrize(("time", "later", "taken"), [(99.0, 1.0, False), (100.0, 1.0, True), (99.0, 10.1, True)])
def test_an_older_time_is_a_repetition(time, later, taken) -> None:
    intake = Intake()
    assert intake.take(framed(None, 100.0), "a", 0.0)
    assert bool(intake.take(framed(None, time), "a", later)) is taken


def test_the_longest_silent_sender_is_forgotten_first() -> None:
    intake = Intake(rate=1e6)
    for k in range(64):
        intake.take(framed(1), f"p{k}", 0.0)
    assert not intake.take(framed(1), "p0", 0.1)  # heard again: now p1 is the oldest
    intake.take(framed(1), "new", 0.2)
    assert (len(intake._senders), "p0" in intake._senders, "p1" in intake._senders) == (64, True, False)
    for k in range(64):
        intake.take(framed(1, source=f"S{k}"), "b", 0.0)
    assert not intake.take(framed(1, source="S0"), "b", 0.1)
    assert intake.take(framed(2, source="S0"), "b", 0.1)
    intake.take(framed(1, source="S64"), "b", 0.2)
    tags = intake._senders["b"].tags
    assert (len(tags), "S0" in tags, "S1" in tags) == (64, True, False)


def test_outcomes_are_counted_one_by_one() -> None:
    intake = Intake()
    found = intake.take(b"$PSRF103,00,01,00,01*25\r\n" + ROR + b"rubble\r\n", "a", 0.0)
    assert found == [OTHER, *intake.take(ROR, "b", 0.0)]
    assert intake.counts == {"datagrams": 2, "other": 1, "sentences": 2, "form": 1}


@pytest.mark.parametrize(("allowed", "sender", "may"), [
    ((), "udp 10.0.0.1:5", True), (("10.0.0.1",), "udp 10.0.0.1:5", True), (("10.0.0.1",), "udp 10.0.0.11:5", False),
    (("10.0.0.1:5",), "tcp 10.0.0.1:5", True), (("10.0.0.1:5",), "tcp 10.0.0.1:6", False),
    (("10.0.0.2", "localhost"), "udp 127.0.0.1:9", True), (("10.0.0.1",), "signalk", False),
])  # fmt: skip
def test_who_may_have_command(allowed, sender, may) -> None:
    assert Authority.of(allowed).may(sender) is may


@pytest.mark.parametrize("text", ["10.0.0.1:0", "10.0.0.1:65536", "10.0.0.1:", "10.0.0.1:x", "ship", ":5",
                                  "10.0.0.1:\u0664"])  # fmt: skip
def test_no_address_of_a_commander(text: str) -> None:
    with pytest.raises(WireError, match="write an IPv4 address"):
        Authority.of([text])


def test_addresses_of_commanders_with_the_least_and_the_largest_port() -> None:
    assert Authority.of(["10.0.0.1:1", "10.0.0.1:65535"]).allowed == ("10.0.0.1:1", "10.0.0.1:65535")


# --- the serial line ---


class Port:
    """A device that takes and gives what it is let; `gone` says that it was unplugged."""

    opened: ClassVar[list[tuple[Any, ...]]] = []
    there: ClassVar[bool] = True

    def __init__(self, path: str, baud: int, *, timeout: float, write_timeout: float) -> None:
        self.opened.append((path, baud, timeout, write_timeout))
        if not self.there:
            raise OSError("no such device")
        self.incoming, self.gone, self.closed = b"", False, False
        self.reading, self.writing = os.pipe()
        os.set_blocking(self.writing, False)

    def fileno(self) -> int:
        if self.gone:
            raise OSError("gone")
        return self.writing

    def read(self, most: int) -> bytes:
        if self.gone:
            raise OSError("gone")
        data, self.incoming = self.incoming[:most], self.incoming[most:]
        return data

    @property
    def in_waiting(self) -> int:
        if self.gone:
            raise OSError("gone")
        return len(self.incoming)

    def close(self) -> None:
        self.closed = True
        os.close(self.reading)
        os.close(self.writing)


@pytest.fixture
def line(monkeypatch: pytest.MonkeyPatch, clock: Clock) -> Iterator[SerialLine]:
    serial = pytest.importorskip("serial")
    monkeypatch.setattr(serial, "Serial", Port)
    monkeypatch.setattr(Port, "opened", [])
    monkeypatch.setattr(Port, "there", True)
    found = SerialLine("serial:///dev/ttyX?baud=38400")
    yield found
    found.close()


def test_a_serial_line_is_opened_as_it_was_told(line: SerialLine) -> None:
    assert Port.opened == [("/dev/ttyX", 38400, 0, 0)]
    assert (line.path, line.address, line.t, line.peers) == ("/dev/ttyX", "serial:///dev/ttyX?baud=38400", 0.0, 1)
    assert serial_line._parsed("serial:///dev/x") == ("/dev/x", 4800)
    assert BAUDS == (4800, 9600, 19200, 38400, 57600, 115200)
    assert is_serial("serial:///dev/x")
    assert not is_serial("udp://127.0.0.1:1")


def test_sentences_that_do_not_fit_behind_what_waits_are_dropped_whole(line: SerialLine) -> None:
    """4096 bytes may wait, which are 41 lines of 99 bytes and one of 37."""
    port, text = line._port, b"x" * 97 + b"\r\n"
    while True:  # fill the pipe, so that nothing goes out
        try:
            os.write(port.writing, b"." * 65536)
        except BlockingIOError:
            break
    line.send(text * 50)
    assert (line.counts["sent"], line.counts["unsent"], len(line._unsent)) == (1, 9, 41 * 99)
    line.send(b"y" * 36 + b"\n")
    assert (line.counts["unsent"], len(line._unsent)) == (9, 4096)
    line.send(b"\n")
    assert (line.counts["sent"], line.counts["unsent"]) == (3, 10)
    while os.read(port.reading, 65536)[-1:] == b".":
        line.poll()
        if len(line._unsent) < 4096:
            break
    assert (text * 41 + b"y" * 36 + b"\n").endswith(line._unsent)


def test_a_serial_line_reads_as_a_wire_does(line: SerialLine) -> None:
    port = line._port
    port.incoming = ROR + ROR[:9]
    assert [one.sender for one in line.poll()] == ["serial /dev/ttyX"]
    port.incoming = ROR[9:]
    assert len(line.poll()) == 1
    port.incoming = b"x" * 1024
    assert (line.poll(), line.counts["oversized"]) == ([], 0)
    port.incoming = b"x" + b"y" * 3000
    assert (line.poll(), line.counts["oversized"], line._unfinished) == ([], 1, b"")
    port.incoming = b"y" * 2000
    line.poll()
    port.incoming = b"z\r\n" + ROR
    assert (len(line.poll()), line.counts["oversized"]) == (1, 1)
    port.incoming = ROR * 200
    found = len(line.poll())
    assert found == 4096 // len(ROR)
    assert found + len(line.poll()) + len(line.poll()) == 200


def test_a_lost_line_is_tried_again_each_half_second_and_counts_what_it_could_not_send(
    line: SerialLine, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    line._unsent = b"half\r\nwhole\r\nand a rest"
    line._port.gone = True
    monkeypatch.setattr(Port, "there", False)
    assert line.poll() == []
    assert (line.peers, line.counts["lost"], line.counts["unsent"]) == (0, 1, 2)
    line.send(ROR * 3)
    assert (line.counts["unsent"], line.counts["sent"], len(Port.opened)) == (5, 0, 1)
    for later, tries in ((0.49, 1), (0.02, 2), (0.3, 2), (0.21, 3)):
        clock.now += later
        line.poll()
        assert len(Port.opened) == tries
    monkeypatch.setattr(Port, "there", True)
    clock.now += 0.51
    line.send(ROR)
    assert (line.peers, line.counts["reopened"], line.counts["sent"], line.counts["lost"]) == (1, 1, 1, 1)
    assert os.read(line._port.reading, 1000) == ROR


def test_waiting_ends_when_something_comes_or_its_time_is_over(line: SerialLine, clock: Clock) -> None:
    line.wait(0.02)
    assert clock.now == pytest.approx(1000.02, abs=0.0051)
    assert set(clock.slept) == {0.005}
    line._port.incoming = b"x"
    count = len(clock.slept)
    line.wait(0.02)
    assert len(clock.slept) == count
    line._port.gone = True
    line.wait(0.01)
    assert line.peers == 0


def test_a_device_without_an_end_is_closed_quietly(line: SerialLine, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> None:
        raise OSError

    port, shut = line._port, line._port.close
    monkeypatch.setattr(port, "close", broken)
    line.close()
    monkeypatch.setattr(port, "close", shut)
    assert not port.closed

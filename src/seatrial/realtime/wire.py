"""Sentences over UDP and TCP, on this machine unless told otherwise; asked at each tick, never waiting, never failing.

A `Wire` that listens takes datagrams, or TCP clients; it sends to whoever sent it a valid sentence of late, and to
addresses it was told.  One that connects is the other end.  What comes in goes through an `Intake`.

What comes in from outside, sifted: only whole, valid, new sentences at a bearable rate get through.

Who may have command by wire.
"""

from __future__ import annotations

import ipaddress
import select
import socket
import time
from collections import Counter, OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from ..core.errors import WireError as WireError
from ..data.nmea.framing import LARGEST, Tag, read_line, split
from ..data.nmea.sentences import NmeaError, Sentence, decode

_CLIENTS = 16
"""TCP clients, or senders of datagrams that are answered, at a time."""

_ANSWERED = 30.0
"""How long a sender of datagrams is answered after its last valid sentence [s]."""

_BUDGET, _PIECES = 1000, 8
"""Datagrams, and pieces of 4096 bytes from a TCP client, taken in at a time; what is beyond waits in the socket."""

_UNFINISHED, _UNSENT = 1024, 65536
"""Bytes of a TCP line without an end, and of what a TCP client has not read, at most."""


@dataclass(frozen=True)
class Address:
    """Where to listen or to send: "udp" or "tcp", host and port."""

    scheme: str
    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.scheme}://{self.host}:{self.port}"

    @staticmethod
    def parse(text: str, anywhere: bool = False) -> Address:
        """An address such as ``udp://127.0.0.1:10110``.

        Args:
            text: scheme, host and port; the port 0 takes a free one.
            anywhere: whether a host that is not this machine is allowed.

        Raises:
            WireError: not of this form, or a host beyond this machine without leave.
        """
        try:
            parts = urlsplit(text)
            scheme, host, port = parts.scheme, parts.hostname or "", parts.port
            extra = parts.path or parts.query or parts.fragment or parts.username
        except ValueError:
            raise WireError(f"'{text}' is no address; write udp://127.0.0.1:10110 or tcp://127.0.0.1:10110") from None
        if scheme not in ("udp", "tcp") or port is None or extra:
            raise WireError(f"'{text}' is no address; write udp://127.0.0.1:10110 or tcp://127.0.0.1:10110")
        try:
            ip = ipaddress.IPv4Address("127.0.0.1" if host == "localhost" else host)
        except ValueError:
            raise WireError(f"'{text}': host '{host}' is no IPv4 address; write it as numbers") from None
        if not ip.is_loopback and not anywhere:
            raise WireError(f"'{text}': {host} is beyond this machine; allow that with --anywhere")
        return Address(scheme, str(ip), port)


@dataclass(frozen=True)
class Message:
    """A valid sentence and who sent it ("udp 127.0.0.1:4711")."""

    sentence: Sentence
    sender: str


@dataclass
class _Client:
    """One TCP connection."""

    socket: socket.socket
    name: str
    unfinished: bytes = b""
    unsent: bytes = b""
    skipping: bool = False


class Wire:
    """One port, polled.

    Attributes:
        address: where it listens, or whom it is connected to; the port is the true one.
        intake: what sifts; its `counts` also tell datagrams sent, clients taken and dropped.
        t: simulated time [s], as whoever sails tells it before each `poll`: where that runs faster than the clock,
            so does the rate at which sentences are taken.
    """

    def __init__(
        self, address: Address, *, connect: bool = False, to: Sequence[Address] = (), intake: Intake | None = None
    ) -> None:
        """Listen at an address, or connect to it.

        Args:
            address: where.
            connect: whether to be the other end of a wire that listens there.
            to: addresses that datagrams are always sent to, of the scheme udp.
            intake: limits of what comes in.

        Raises:
            WireError: the port is in use, nobody listens there, or `to` over TCP.
        """
        self.intake, self.t = intake or Intake(), 0.0
        self._polled = self.t, time.monotonic()
        self._tcp = address.scheme == "tcp"
        if to and (self._tcp or any(one.scheme != "udp" for one in to)):
            raise WireError("only a wire over udp sends to addresses of its own accord; TCP clients come and ask")
        self._to = [(one.host, one.port) for one in to]
        self._peers: dict[tuple[str, int], float] = {}
        self._clients: list[_Client] = []
        self._listening = not connect
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM if self._tcp else socket.SOCK_DGRAM)
        try:
            self._open(address, connect)
        except OSError as error:
            self._socket.close()
            raise WireError(f"{address}: {error.strerror or error}; is the port right, and free?") from None
        self.address = address if connect else Address(address.scheme, *self._socket.getsockname())

    def _open(self, address: Address, connect: bool) -> None:
        if not self._tcp:
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 1)
        if connect and self._tcp:
            self._socket.settimeout(5.0)
            self._socket.connect((address.host, address.port))
            self._clients = [_Client(self._socket, f"tcp {address.host}:{address.port}")]
        elif connect:
            self._socket.bind(("127.0.0.1" if ipaddress.ip_address(address.host).is_loopback else "", 0))
            self._to = [(address.host, address.port)]
        else:
            if self._tcp:
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._socket.bind((address.host, address.port))
            if self._tcp:
                self._socket.listen(_CLIENTS)
        self._socket.setblocking(False)

    @property
    def counts(self) -> Counter[str]:
        """What came, what was turned away and why, what was sent."""
        return self.intake.counts

    @property
    def peers(self) -> int:
        """How many are sent to."""
        return len(self._clients) if self._tcp else len({*self._to, *self._peers})

    def poll(self) -> list[Message]:
        """Valid sentences that have come since the last time, `_BUDGET` datagrams' worth at most."""
        (t, before), now = self._polled, time.monotonic()
        self.intake.ahead += max((self.t - t) - (now - before), 0.0)
        self._polled = self.t, now
        return self._poll_clients(now) if self._tcp else self._poll_datagrams(now)

    def wait(self, seconds: float) -> None:
        """Wait until something comes, at most that long."""
        sockets = [client.socket for client in self._clients] if self._tcp else [self._socket]
        if self._tcp and self._listening:
            sockets.append(self._socket)
        if sockets:
            select.select(sockets, [], [], max(seconds, 0.0))
        else:
            time.sleep(max(seconds, 0.0))

    def send(self, data: bytes) -> None:
        """Send to all; who cannot take it misses it, a TCP client that does not read is dropped."""
        self.counts["sent"] += 1
        if self._tcp:
            for client in tuple(self._clients):
                self._push(client, data)
            return
        for peer in {*self._to, *self._peers}:
            try:
                self._socket.sendto(data, peer)
            except OSError:
                self.counts["unsent"] += 1

    def close(self) -> None:
        """Let go of the port and of all clients."""
        for client in self._clients:
            client.socket.close()
        self._clients.clear()
        self._socket.close()

    def _poll_datagrams(self, now: float) -> list[Message]:
        found: list[Message] = []
        for _ in range(_BUDGET):
            try:
                data, peer = self._socket.recvfrom(LARGEST + 1)
            except BlockingIOError:
                break
            except OSError:  # what was sent before found nobody there
                continue
            name = f"udp {peer[0]}:{peer[1]}"
            said = self.intake.take(data, name, now)
            if said and self._listening and (peer in self._peers or len(self._peers) < _CLIENTS):
                self._peers[peer] = now
            found += [Message(one, name) for one in said]
        for peer in [peer for peer, heard in self._peers.items() if now - heard > _ANSWERED]:
            del self._peers[peer]
        return found

    def _poll_clients(self, now: float) -> list[Message]:
        if self._listening:
            self._accept()
        found: list[Message] = []
        for client in tuple(self._clients):
            self._push(client, b"")
            for _ in range(_PIECES):
                try:
                    data = client.socket.recv(4096)
                except BlockingIOError:
                    break
                except OSError:
                    data = b""
                if not data:
                    self._drop(client)
                    break
                found += [Message(one, client.name) for one in self._lines(client, data, now)]
        return found

    def _lines(self, client: _Client, data: bytes, now: float) -> list[Sentence]:
        *whole, rest = (client.unfinished + data).split(b"\n")
        found: list[Sentence] = []
        for line in whole:
            if client.skipping:  # the end of a line that was too long
                client.skipping = False
            else:
                found += self.intake.take(line, client.name, now)
        if len(rest) > _UNFINISHED:
            self.counts["oversized"] += not client.skipping
            client.skipping, rest = True, b""
        client.unfinished = rest
        return found

    def _accept(self) -> None:
        for _ in range(_CLIENTS):
            try:
                connection, peer = self._socket.accept()
            except OSError:
                return
            if len(self._clients) >= _CLIENTS:
                self.counts["refused"] += 1
                connection.close()
                continue
            connection.setblocking(False)
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._clients.append(_Client(connection, f"tcp {peer[0]}:{peer[1]}"))
            self.counts["clients"] += 1

    def _push(self, client: _Client, data: bytes) -> None:
        client.unsent += data
        if not client.unsent or client not in self._clients:
            return
        try:
            client.unsent = client.unsent[client.socket.send(client.unsent) :]
        except BlockingIOError:
            pass
        except OSError:
            self._drop(client)
        if len(client.unsent) > _UNSENT:
            self._drop(client)

    def _drop(self, client: _Client) -> None:
        if client in self._clients:
            client.socket.close()
            self._clients.remove(client)
            self.counts["dropped"] += 1


OTHER = Sentence("", "other", {})
"""Stands for any valid sentence of a kind that is not read here: it orders nothing, but its sender is alive."""

_SENDERS = 64
"""Senders, and sources of TAG blocks of one sender, that are remembered; who is silent for longest is forgotten."""

_TOGETHER = 4.0
"""Lines that are taken from all senders together, over those from one: many ports must not stop the loop either."""

_BEHIND, _REMEMBERED = 100, 10.0
"""A TAG line number up to this many behind the last one is a repetition, for this long [s]; later it is a new start."""


@dataclass
class _Sender:
    """Who sends: lines left to it at this moment, and the last TAG block with the time it came, by its source."""

    left: float
    since: float
    tags: OrderedDict[str | None, tuple[Tag, float]] = field(default_factory=OrderedDict[str | None, tuple[Tag, float]])


def _refill(who: _Sender, rate: float, now: float) -> None:
    who.left = min(rate, who.left + rate * max(now - who.since, 0.0))
    who.since = now


class Intake:
    """Sifts datagrams; never raises, never grows.

    Attributes:
        counts: datagrams and sentences taken, and what was turned away by reason: oversized, length, form,
            checksum, field, other (valid, but not read here), replayed, flooded.
        ahead: how far the time that the rate counts in is ahead of the clock [s]; grows where ships sail faster than
            it, as whoever answers them does so more often.
    """

    def __init__(self, rate: float = 500.0) -> None:
        """So many lines per second from each sender, and as many at once; from all together four times that."""
        self.rate, self.ahead = rate, 0.0
        self._all = _Sender(_TOGETHER * rate, 0.0)
        self.counts: Counter[str] = Counter()
        self._senders: OrderedDict[str, _Sender] = OrderedDict()

    def take(self, data: bytes, sender: str, now: float) -> list[Sentence]:
        """The valid sentences of a datagram.

        Args:
            data: what came.
            sender: who sent it.
            now: time on a clock that never goes back [s].
        """
        self.counts["datagrams"] += 1
        if len(data) > LARGEST:
            self.counts["oversized"] += 1
            return []
        who = self._sender(sender, now + self.ahead)
        _refill(self._all, _TOGETHER * self.rate, now + self.ahead)
        cost = data.count(b"\n") + (not data.endswith(b"\n"))  # as many lines as `split` makes of it, or more
        if min(who.left, self._all.left) < cost:
            self.counts["flooded"] += cost
            return []
        who.left -= cost
        self._all.left -= cost
        found = [self._sentence(line, who, now) for line in split(data)]
        return [one for one in found if one is not None]

    def _sender(self, name: str, now: float) -> _Sender:
        who = self._senders.get(name)
        if who is None:
            who = self._senders[name] = _Sender(self.rate, now)
            if len(self._senders) > _SENDERS:
                self._senders.popitem(last=False)
        self._senders.move_to_end(name)
        _refill(who, self.rate, now)
        return who

    def _sentence(self, line: bytes, who: _Sender, now: float) -> Sentence | None:
        try:
            framed = read_line(line)
            sentence = self._decoded(framed.sentence)
        except NmeaError as error:
            self.counts["other" if error.reason == "kind" else error.reason] += 1
            return None
        if framed.tag is not None and self._again(framed.tag, who, now):
            self.counts["replayed"] += 1
            return None
        self.counts["sentences" if sentence is not OTHER else "other"] += 1
        return sentence

    @staticmethod
    def _decoded(sentence: bytes) -> Sentence:
        """A sentence; `OTHER` for a valid one of a kind that is not read here."""
        try:
            return decode(sentence)
        except NmeaError as error:
            if error.reason != "kind":
                raise
            return OTHER

    @staticmethod
    def _again(tag: Tag, who: _Sender, now: float) -> bool:
        """Whether the TAG block is one that came before from its source; remembers it where it is not."""
        last, heard = who.tags.get(tag.source, (Tag(), -_REMEMBERED))
        fresh = now - heard < _REMEMBERED
        if fresh and tag.number is not None and last.number is not None and (last.number - tag.number) % 1000 < _BEHIND:
            return True
        if fresh and tag.time is not None and last.time is not None and tag.time < last.time:
            return True
        who.tags[tag.source] = tag, now
        who.tags.move_to_end(tag.source)
        if len(who.tags) > _SENDERS:
            who.tags.popitem(last=False)
        return False


@dataclass(frozen=True)
class Authority:
    """Addresses that may have command: hosts, or one port of a host; without any, whoever comes."""

    allowed: tuple[str, ...] = ()

    @staticmethod
    def of(texts: Sequence[str]) -> Authority:
        """From addresses such as ``192.168.1.5`` or ``127.0.0.1:4711``.

        Raises:
            WireError: one that is none.
        """
        return Authority(tuple(_address(text) for text in texts))

    def may(self, sender: str) -> bool:
        """Whether a sender, as messages name it ("udp 127.0.0.1:4711"), may have command."""
        address = sender.partition(" ")[2]
        return not self.allowed or address in self.allowed or address.rpartition(":")[0] in self.allowed


ANYBODY = Authority()


def _address(text: str) -> str:
    host, colon, port = text.partition(":")
    try:
        ip = ipaddress.IPv4Address("127.0.0.1" if host == "localhost" else host)
    except ValueError:
        ip = None
    if ip is None or (colon and not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535)):
        raise WireError(f"commander '{text}': write an IPv4 address such as 192.168.1.5, or 192.168.1.5:4711")
    return f"{ip}:{int(port)}" if colon else str(ip)

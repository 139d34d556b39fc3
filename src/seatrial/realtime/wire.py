"""NMEA sentences over UDP and TCP, by default on this machine only; polled at each tick without blocking or raising.

A `Wire` that listens receives datagrams, or accepts TCP clients; it sends to every address that recently sent a valid
sentence, and to given addresses.  A wire that connects is the other end.  All input passes an `Intake`, which lets only
complete, valid, new sentences through, at a limited rate.  An `Authority` lists the senders that may have command.
"""

from __future__ import annotations

import ipaddress
import select
import socket
import time
from collections import Counter, OrderedDict
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple, Protocol
from urllib.parse import urlsplit

from ..core.errors import WireError as WireError
from ..core.values import dataclass, field
from ..data.nmea.framing import LARGEST, Tag, read_line, split
from ..data.nmea.sentences import NmeaError, Sentence, decode

_CLIENTS = 16
"""Largest number of TCP clients, or of senders of datagrams that are answered."""

_ANSWERED = 30.0
"""Time for which a sender of datagrams is answered after its last valid sentence [s]."""

_BUDGET, _PIECES = 1000, 8
"""Datagrams, and pieces of 4096 bytes from a TCP client, read in one poll; the rest waits in the socket."""

_UNFINISHED, _UNSENT = 1024, 65536
"""Largest size of an unfinished TCP line, and of data that a TCP client has not read [bytes]."""


@dataclass(frozen=True)
class Address:
    """Address to listen at or send to: "udp" or "tcp", host and port."""

    scheme: str
    host: str
    port: int

    def __str__(self) -> str:
        return f"{self.scheme}://{self.host}:{self.port}"

    @staticmethod
    def parse(text: str, anywhere: bool = False) -> Address:
        """An address such as ``udp://127.0.0.1:10110``; port 0 selects a free one.

        Raises:
            WireError: not of this form, or a host beyond this machine without `anywhere`.
        """
        try:
            parts = urlsplit(text)
            scheme, host, port = parts.scheme, parts.hostname or "", parts.port
            extra = parts.path or parts.query or parts.fragment or parts.username
        except ValueError:
            scheme, host, port, extra = "", "", None, ""
        if scheme not in ("udp", "tcp") or port is None or extra:
            raise WireError(f"'{text}': not an address; write udp://127.0.0.1:10110 or tcp://127.0.0.1:10110")
        ip = _ipv4(host)
        if ip is None:
            raise WireError(f"'{text}': host '{host}' is not an IPv4 address; write it as numbers")
        if not ip.is_loopback and not anywhere:
            raise WireError(f"'{text}': {host} is beyond this machine; allow that with --anywhere")
        return Address(scheme, str(ip), port)


class Message(NamedTuple):
    """A valid sentence and its sender ("udp 127.0.0.1:4711")."""

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


class Line(Protocol):
    """A line of sentences that is polled: a `Wire`, a serial line, or none at all."""

    intake: Intake
    t: float

    @property
    def counts(self) -> Counter[str]:
        """Counts of the input by outcome, and of the output."""
        ...

    @property
    def address(self) -> object:
        """Where it is, for messages."""
        ...

    @property
    def peers(self) -> int:
        """Number of receivers."""
        ...

    def poll(self) -> list[Message]:
        """Valid sentences received since the last call."""
        ...

    def wait(self, seconds: float) -> None:
        """Wait for input, at most so many seconds."""

    def send(self, data: bytes) -> None:
        """Send to all receivers."""

    def close(self) -> None:
        """Close it."""


class Mute:
    """A line to nobody, for a ship that is steered by links of other kinds only."""

    address, peers = "no line", 0

    def __init__(self) -> None:
        self.intake, self.t = Intake(), 0.0

    @property
    def counts(self) -> Counter[str]:
        """Nothing but what is counted elsewhere."""
        return self.intake.counts

    def poll(self) -> list[Message]:
        """Nothing."""
        return []

    def wait(self, seconds: float) -> None:
        """Wait."""
        time.sleep(max(seconds, 0.0))

    def send(self, data: bytes) -> None:
        """Nobody hears it."""

    def close(self) -> None:
        """There is nothing to close."""


class Wire:
    """One port, polled.

    Attributes:
        address: local address, or the address it is connected to, with the actual port.
        intake: filter of the input; its `counts` also have datagrams sent, clients accepted and dropped.
        t: simulated time [s], set before each `poll`: where it runs faster than the clock, the rate limit of the input
            scales with it.
    """

    def __init__(
        self, address: Address, *, connect: bool = False, to: Sequence[Address] = (), intake: Intake | None = None
    ) -> None:
        """Listen at an address, or connect to a wire that listens there.

        Args:
            address: to listen at, or to connect to.
            connect: whether to connect.
            to: addresses to which datagrams are always sent, of the scheme udp.
            intake: limits of the input.

        Raises:
            WireError: the port is in use, nothing listens there, or `to` over TCP.
        """
        self.intake, self.t = intake or Intake(), 0.0
        self._polled = self.t, time.monotonic()
        self._tcp = address.scheme == "tcp"
        if to and (self._tcp or any(one.scheme != "udp" for one in to)):
            raise WireError("only a wire over udp sends to given addresses; TCP clients connect by themselves")
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
        """Counts of the input by outcome, and of the output."""
        return self.intake.counts

    @property
    def peers(self) -> int:
        """Number of receivers."""
        return len(self._clients) if self._tcp else len({*self._to, *self._peers})

    def poll(self) -> list[Message]:
        """Valid sentences received since the last call, at most `_BUDGET` datagrams."""
        (t, before), now = self._polled, time.monotonic()
        self.intake.ahead += max((self.t - t) - (now - before), 0.0)
        self._polled = self.t, now
        return self._poll_clients(now) if self._tcp else self._poll_datagrams(now)

    def wait(self, seconds: float) -> None:
        """Wait for input, at most so many seconds."""
        sockets = [client.socket for client in self._clients] if self._tcp else [self._socket]
        if self._tcp and self._listening:
            sockets.append(self._socket)
        if sockets:
            select.select(sockets, [], [], max(seconds, 0.0))
        else:
            time.sleep(max(seconds, 0.0))

    def send(self, data: bytes) -> None:
        """Send to all receivers; a datagram may be lost, a TCP client that does not read is dropped."""
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
        """Close the port and all clients."""
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
            except OSError:  # an earlier datagram found no receiver
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
            if not client.skipping:
                found += self.intake.take(line, client.name, now)
            client.skipping = False  # after the end of a line that was too long
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
            with suppress(BlockingIOError):
                client.unsent = client.unsent[client.socket.send(client.unsent) :]
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
"""Stands for a valid sentence of a kind that is not read here: no order, but a sign that its sender is alive."""

_SENDERS = 64
"""Number of senders, and of TAG sources of a sender, that are remembered; the longest silent one is removed."""

_TOGETHER = 4.0
"""Rate limit of all senders together relative to that of one, so that many ports cannot stop the loop either."""

_BEHIND, _REMEMBERED = 100, 10.0
"""A TAG line number at most this far behind the last one is a repetition for this long [s]; later it is a restart."""


@dataclass
class _Sender:
    """A sender: lines left in its rate limit, and the last TAG block of each source with its time."""

    left: float
    since: float
    tags: OrderedDict[str | None, tuple[Tag, float]] = field(default_factory=OrderedDict[str | None, tuple[Tag, float]])

    def refill(self, rate: float, now: float) -> None:
        self.left = min(rate, self.left + rate * max(now - self.since, 0.0))
        self.since = now


class Intake:
    """Filter of the input; never raises, and its memory is bounded.

    Attributes:
        counts: datagrams and sentences accepted, and those refused by reason: oversized, length, form, checksum, field,
            other (valid, but not read here), replayed, flooded.
        ahead: lead of the time of the rate limit over the clock [s]; grows where the simulation runs faster than the
            clock, since controllers then answer more often.
    """

    def __init__(self, rate: float = 500.0) -> None:
        """Accept `rate` lines per second from each sender, as many at once, and four times that from all together."""
        self.rate, self.ahead = rate, 0.0
        self._all = _Sender(_TOGETHER * rate, 0.0)
        self.counts: Counter[str] = Counter()
        self._senders: OrderedDict[str, _Sender] = OrderedDict()

    def take(self, data: bytes, sender: str, now: float) -> list[Sentence]:
        """The valid sentences of a datagram of `sender`, at the time `now` of a monotonic clock [s]."""
        self.counts["datagrams"] += 1
        if len(data) > LARGEST:
            self.counts["oversized"] += 1
            return []
        who = self._sender(sender, now + self.ahead)
        self._all.refill(_TOGETHER * self.rate, now + self.ahead)
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
        who.refill(self.rate, now)
        return who

    def _sentence(self, line: bytes, who: _Sender, now: float) -> Sentence | None:
        """The sentence, if it is valid and new; `OTHER` for one of a kind that is not read here."""
        tag, sentence = None, OTHER
        try:
            framed = read_line(line)
            tag = framed.tag
            sentence = decode(framed.sentence)
        except NmeaError as error:
            if error.reason != "kind":
                self.counts[error.reason] += 1
                return None
        if tag is not None and self._again(tag, who, now):
            self.counts["replayed"] += 1
            return None
        self.counts["sentences" if sentence is not OTHER else "other"] += 1
        return sentence

    @staticmethod
    def _again(tag: Tag, who: _Sender, now: float) -> bool:
        """Whether the TAG block repeats an earlier one of its source; remembers it if not."""
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
    """Addresses that may have command: hosts, or one port of a host; empty allows all."""

    allowed: tuple[str, ...] = ()

    @staticmethod
    def of(texts: Sequence[str]) -> Authority:
        """From addresses such as ``192.168.1.5`` or ``127.0.0.1:4711``; WireError: not an IPv4 address."""
        return Authority(tuple(_address(text) for text in texts))

    def may(self, sender: str) -> bool:
        """Whether a sender, as messages name it ("udp 127.0.0.1:4711"), may have command."""
        address = sender.partition(" ")[2]
        return not self.allowed or address in self.allowed or address.rpartition(":")[0] in self.allowed


ANYBODY = Authority()
"""No address is named, so anybody may steer."""


def _ipv4(host: str) -> ipaddress.IPv4Address | None:
    """An address given as numbers, or as localhost; None for any other text."""
    try:
        return ipaddress.IPv4Address("127.0.0.1" if host == "localhost" else host)
    except ValueError:
        return None


def _address(text: str) -> str:
    host, colon, port = text.partition(":")
    ip = _ipv4(host)
    if ip is None or (colon and not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535)):
        raise WireError(f"commander '{text}': write an IPv4 address such as 192.168.1.5, or 192.168.1.5:4711")
    return f"{ip}:{int(port)}" if colon else str(ip)

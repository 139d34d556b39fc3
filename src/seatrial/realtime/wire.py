"""Sentences over UDP and TCP, on this machine unless told otherwise; asked at each tick, never waiting, never failing.

A `Wire` that listens takes datagrams, or TCP clients; it sends to whoever sent it a valid sentence of late, and to
addresses it was told.  One that connects is the other end.  What comes in goes through an `Intake`.
"""

from __future__ import annotations

import ipaddress
import select
import socket
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from urllib.parse import urlsplit

from ..data.nmea import Sentence
from ..data.nmea_framing import LARGEST
from .intake import Intake

_CLIENTS = 16
"""TCP clients, or senders of datagrams that are answered, at a time."""

_ANSWERED = 30.0
"""How long a sender of datagrams is answered after its last valid sentence [s]."""

_BUDGET, _PIECES = 1000, 8
"""Datagrams, and pieces of 4096 bytes from a TCP client, taken in at a time; what is beyond waits in the socket."""

_UNFINISHED, _UNSENT = 1024, 65536
"""Bytes of a TCP line without an end, and of what a TCP client has not read, at most."""


class WireError(ValueError):
    """An address that cannot be used; the text says what would be right."""


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

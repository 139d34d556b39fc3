"""Who is let in: connections that say nothing, names that lead here from elsewhere, keys, and one socket a browser."""

from __future__ import annotations

import json
import re
import resource
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi")
from bridges import ask, hear, read_to_the_end
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from fetched import get
from seatrial.realtime import pages
from seatrial.realtime.bridge import server
from seatrial.realtime.bridge.deck import Deck, Outfit
from seatrial.realtime.bridge.server import application
from seatrial.realtime.bridge.view import OWN
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Plant
from seatrial.ships.files import load

SOCKET = (b"GET /line HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
          b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n")  # fmt: skip


def a_deck() -> Deck:
    return Deck(Loop({OWN: Plant.of(load("kvlcc2_l7"), dt=0.05)}, 20.0, float("inf")), Outfit(hold=1e6))


@contextmanager
def served(hosts: tuple[str, ...] = pages.LOCAL, key: str = "") -> Iterator[tuple[int, Deck]]:
    """A page in this process, at a free port."""
    import asyncio

    deck = a_deck()
    serving = pages.server(application(deck, hosts, key))
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen(64)
        thread = threading.Thread(target=lambda: asyncio.run(pages.attend(serving, listening)))
        thread.start()
        end = time.monotonic() + 5.0
        while not serving.started and time.monotonic() < end:
            time.sleep(0.005)
        try:
            yield listening.getsockname()[1], deck
        finally:
            serving.should_exit = True
            thread.join(10.0)


@contextmanager
def greeted(port: int, **said: Any) -> Iterator[ClientConnection]:
    with connect(f"ws://127.0.0.1:{port}/line", proxy=None, max_size=None, close_timeout=0.2) as ws:
        ws.send(json.dumps({"hello": "a" * 16, **said}))
        yield ws


def idle(port: int, stack: ExitStack, said: bytes = b"") -> socket.socket:
    one = stack.enter_context(socket.create_connection(("127.0.0.1", port), timeout=5.0))
    one.sendall(said)
    return one


@pytest.mark.slow
def test_a_connection_that_says_nothing_is_let_go_in_good_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "PATIENCE", 0.2)
    with served() as (port, _), ExitStack() as stack:
        slow = b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: "
        again = f"{'GET /shared/units.js HTTP/1.1'}\r\nHost: localhost\r\n\r\nGET / HT".encode()
        for one in (idle(port, stack), idle(port, stack, slow), idle(port, stack, again)):
            one.settimeout(2.0)
            try:
                while one.recv(65536):
                    pass
            except ConnectionResetError:
                pass
        assert get(port, "/")[0] == 200


@pytest.mark.slow
def test_the_oldest_silent_connection_makes_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "CONNECTIONS", 8)
    with served() as (port, _), greeted(port) as ws, ExitStack() as stack:
        json.loads(ws.recv(timeout=5))
        for _ in range(20):
            idle(port, stack)
        assert get(port, "/")[0] == 200  # whoever comes is served
        ws.send('{"do": "sink"}')
        hear(ws, "note")  # and who is there stays


@pytest.mark.slow
def test_sockets_that_never_say_hello_leave_room_for_those_that_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "_STRANGERS", 4)
    with served() as (port, _), ExitStack() as stack:
        address = f"ws://127.0.0.1:{port}/line"
        silent = [stack.enter_context(connect(address, proxy=None, close_timeout=0.1)) for _ in range(6)]
        with greeted(port) as ws:
            hear(ws, "hello")
        for one in silent[:2]:
            with pytest.raises(ConnectionClosed, match="say hello first"):
                one.recv(timeout=2)


@pytest.mark.slow
def test_sockets_that_were_told_to_go_and_stay_keep_nobody_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "CONNECTIONS", 10)
    monkeypatch.setattr(server, "_STRANGERS", 4)
    with served() as (port, _), ExitStack() as stack:
        for _ in range(24):
            idle(port, stack, SOCKET)  # which never answers a close
        assert asked_again(port) == 200
        with greeted(port) as ws:
            hear(ws, "hello")
            assert get(port, "/")[0] == 200


def asked_again(port: int) -> int:
    """Status of the page as a browser gets it, which asks again where the server was about to let sockets go."""
    for _ in range(20):
        with suppress(ConnectionResetError):
            return get(port, "/")[0]
        time.sleep(0.05)
    return get(port, "/")[0]


@pytest.mark.long
@pytest.mark.parametrize("said", [b"", b"GET / HTTP/1.1\r\nHost: local", SOCKET], ids=["silent", "half", "socket"])
def test_320_idle_connections_at_256_descriptors_leave_the_page_alive(tmp_path: Path, said: bytes) -> None:
    command = [sys.executable, "-m", "seatrial", "bridge", "kvlcc2_l7", "--port", "0", "-o", str(tmp_path)]
    log = tmp_path / "log"
    with log.open("w") as errors, subprocess.Popen(
        command, stderr=errors, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (256, 256))
    ) as process, ExitStack() as stack:
        stack.callback(process.kill)
        end = time.monotonic() + 20.0
        while not (found := re.search(r":(\d+)/", log.read_text())) and time.monotonic() < end:
            time.sleep(0.05)
        assert found
        port = int(found[1])
        ws = stack.enter_context(greeted(port))
        hear(ws, "t")
        for k in range(320):
            with suppress(OSError):  # turned away at once
                idle(port, stack, said)
            if k % 20 == 0:
                ask(ws, do="beat", read=hear(ws, "t")["n"])
        began = time.monotonic()
        while time.monotonic() < began + 12.0:
            frame = hear(ws, "t")
            ask(ws, do="beat", read=frame["n"])
        assert frame["t"] > 10.0
        assert get(port, "/")[0] == 200
        ask(ws, do="record")
        while not (record := hear(ws, "t")["record"]) or record[1] < 5:
            pass
        assert len(log.read_text().splitlines()) < 10
    assert list(tmp_path.glob("*.csv"))


@pytest.mark.slow
def test_a_page_for_other_machines_answers_to_addresses_and_its_own_names_only() -> None:
    own = socket.gethostname()
    with served(pages.anywhere()) as (port, _):
        for host in ("evil.example", f"evil.example:{port}", "addresses", "", "127.0.0.1.evil.example", "["):
            assert get(port, "/", host=host)[0] == 400, host
        for host in ("127.0.0.1", f"192.0.2.7:{port}", "[::1]:80", "localhost", own):
            assert get(port, "/", host=host)[0] == 200, host
        evil = f"evil.example:{port}"  # a page of a foreign name that leads here: Host and Origin agree
        with pytest.raises(InvalidStatus, match="403"), socket.create_connection(("127.0.0.1", port)) as sock, connect(
            f"ws://{evil}/line", sock=sock, proxy=None, origin=Origin(f"http://{evil}")
        ):
            pytest.fail("let in")


@pytest.mark.slow
def test_who_has_not_the_key_neither_sees_nor_steers() -> None:
    with served(pages.anywhere(), "right key") as (port, deck):
        for said in ({}, {"key": "wrong"}, {"key": 3}, {"key": "right key "}):
            with greeted(port, **said) as ws, pytest.raises(ConnectionClosed, match="4003"):
                ws.recv(timeout=5)
        assert deck.command.holder == ""
        with greeted(port, key="right key") as ws:
            assert hear(ws, "hello")["hello"] == "Bridge 1"


@pytest.mark.parametrize(("origin", "same"), [
    ("http://localhost:8020", True), ("https://localhost:8020", True), (None, True), ("http://localhost", False),
    ("http://localhost:8021", False), ("http://evil.example", False), ("null", False), ("", False), ("http://[", False),
    ("http://[::1", False), ("http://]", False), ("http://localhost:8020@evil.example", False),
])  # fmt: skip
def test_only_pages_of_this_server_are_of_the_same_origin(origin: str | None, same: bool) -> None:
    given = {"host": "localhost:8020"} | ({} if origin is None else {"origin": origin})
    assert pages.same_origin(given) is same


@pytest.mark.parametrize(("said", "known"), [
    ("secret", True), ("secre", False), ("secrets", False), ("", False), (None, False), (7, False), (["secret"], False),
    ("\ud800", False), ("sécret", False),
])  # fmt: skip
def test_the_key_is_a_text_that_is_the_same(said: object, known: bool) -> None:
    assert pages.admitted("secret", said) is known
    assert pages.admitted("", said)


@pytest.mark.slow
def test_a_key_of_half_characters_and_an_origin_that_is_none_are_refused_at_the_socket() -> None:
    with served(key="secret") as (port, _):
        with greeted(port, hello="somebody", key="\ud800") as ws, pytest.raises(ConnectionClosed) as refused:
            ws.recv(timeout=5)
        assert refused.value.rcvd is not None
        assert refused.value.rcvd.code == server.KEYLESS
        with pytest.raises(InvalidStatus):
            connect(f"ws://127.0.0.1:{port}/line", proxy=None, origin=Origin("http://["))


@pytest.mark.long
def test_anywhere_prints_an_address_with_a_key(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "seatrial", "bridge", "kvlcc2_l7", "--port", "0", "--anywhere"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, cwd=tmp_path) as process:
        found = re.search(r"http://127\.0\.0\.1:(\d+)/#(\S{16,}) ", process.stderr.readline() if process.stderr else "")
        assert found
        with greeted(int(found[1]), key=found[2]) as ws:
            hear(ws, "hello")
        process.kill()


@pytest.mark.slow
def test_two_sockets_of_one_browser_do_not_both_steer() -> None:
    with served() as (port, deck), greeted(port) as first:
        hear(first, "hello")
        with greeted(port) as second:
            hear(second, "hello")
            read_to_the_end(first)
            assert (first.close_code, first.close_reason) == (4001, "this page was opened again in another window")
            ask(second, do="order", name="delta", value="x")
            hear(second, "note")
            assert deck.command.present == {"Bridge 1"}
            assert deck.command.holder == "Bridge 1"


@pytest.mark.slow
def test_the_commander_who_reloads_a_full_bridge_is_let_in(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MOST", 3)
    with served() as (port, deck), ExitStack() as stack:
        first = stack.enter_context(greeted(port))
        hear(first, "hello")
        for token in "bc":
            hear(stack.enter_context(greeted(port, hello=token * 16)), "hello")
        hear(stack.enter_context(greeted(port)), "hello")  # before the old socket is known to be gone
        read_to_the_end(first)
        assert deck.command.holder == "Bridge 1"
        with greeted(port, hello="d" * 16) as late, pytest.raises(ConnectionClosed, match="too many browsers"):
            late.recv(timeout=5)


@pytest.mark.slow
def test_the_commander_comes_back_though_others_took_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MOST", 3)
    with served() as (port, deck), ExitStack() as stack:
        with greeted(port) as first:
            hear(first, "hello")
        end = time.monotonic() + 5.0
        while deck.command.present and time.monotonic() < end:
            time.sleep(0.01)
        for token in "bcd":
            hear(stack.enter_context(greeted(port, hello=token * 16)), "hello")
        assert hear(stack.enter_context(greeted(port)), "hello")["hello"] == "Bridge 1"



"""The server of pages: who is let in, who is thrown out, what a page that only shows is told."""

from __future__ import annotations

import asyncio
import json
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi")
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from seatrial.realtime.pages import MOST, Watched, converse


class Counted:
    """A source that gives each browser its own numbers, and the last one when it closes."""

    looked = False

    def pictures(self) -> Callable[[bool], Mapping[str, Any] | None]:
        given = iter(range(3))
        return lambda closing: {"k": next(given, -1), "over": closing}


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[tuple[Counted, Callable[[], ClientConnection], Watched]]:
    (tmp_path / "index.html").write_text("a page")
    source = Counted()
    with socket.create_server(("127.0.0.1", 0)) as listening:
        url = f"ws://127.0.0.1:{listening.getsockname()[1]}/line"
        with Watched(source, tmp_path, listening) as page:
            yield source, lambda: connect(url, proxy=None, close_timeout=0.5), page


def until(what: Callable[[], bool]) -> None:
    end = time.monotonic() + 10.0
    while not what():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.slow
def test_so_many_browsers_are_served_and_no_more(watched: Any) -> None:
    source, line, _ = watched
    with ExitStack() as stack:
        open_ones = [stack.enter_context(line()) for _ in range(MOST)]
        assert [json.loads(one.recv(timeout=5))["k"] for one in open_ones] == [0] * MOST
        with line() as late, pytest.raises(ConnectionClosed, match="too many browsers"):
            late.recv(timeout=5)
        assert source.looked
    until(lambda: not source.looked)
    with line() as again:
        assert json.loads(again.recv(timeout=5)) == {"n": 0, "k": 0, "over": False}


@pytest.mark.slow
def test_a_flood_ends_its_sender_alone(watched: Any) -> None:
    _, line, _ = watched
    with line() as good, line() as bad:
        with suppress(ConnectionClosed):
            for _ in range(400):
                bad.send("{}")
        with pytest.raises(ConnectionClosed):
            heard_out(bad)
        assert json.loads(good.recv(timeout=5))["k"] == 0


def heard_out(ws: ClientConnection) -> None:
    """Everything of a few seconds; the source never ends by itself."""
    end = time.monotonic() + 10.0
    while time.monotonic() < end:
        ws.recv(timeout=5)


class Socket:
    """What `converse` asks of a socket."""

    def __init__(self) -> None:
        self.closed: list[int] = []

    async def close(self, code: int, reason: str) -> None:
        self.closed.append(code)


@pytest.mark.parametrize("error", [TimeoutError(), RuntimeError("closed"), None])
def test_a_slow_reader_is_left_and_not_heard_to_its_end(error: Exception | None) -> None:
    ws, heard = Socket(), list[str]()

    async def hearing() -> None:
        try:
            await asyncio.sleep(60.0)
        finally:
            heard.append("cancelled")

    async def tell(task: Any) -> None:
        await asyncio.sleep(0)
        assert not task.done()
        if error is not None:
            raise error

    asyncio.run(asyncio.wait_for(converse(ws, hearing(), tell), 5.0))
    assert (ws.closed, heard) == ([1000], ["cancelled"])


def test_another_fault_of_who_tells_is_not_hidden() -> None:
    ws = Socket()

    async def tell(task: Any) -> None:
        raise KeyError("psi")

    with pytest.raises(KeyError):
        asyncio.run(converse(ws, asyncio.sleep(60.0), tell))
    assert ws.closed == [1000]

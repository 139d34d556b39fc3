"""The bridge in a browser: one static page and one socket; needs the extra `web`."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
import time
from collections import deque
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import uvicorn
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.staticfiles import StaticFiles
from starlette.middleware.trustedhost import TrustedHostMiddleware

from ..loop import Loop
from .deck import PERIOD, Deck

STATIC = Path(__file__).with_name("static")
LOCAL = ("127.0.0.1", "localhost")

_CLIENTS, _NAMES, _LARGEST = 16, 200, 2048
"""Browsers at a time, browsers that are known again, bytes of a request: at most."""

_A_SECOND = 200
"""Requests a second that one browser may send; more of them and it is dropped."""

_BEHIND, _IDLE = 200, 0.25
"""Pictures that a browser may be behind before it is dropped, and the time between two while nothing moves [s]."""

_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'",
    "Cache-Control": "no-cache", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
}  # fmt: skip


@dataclass(eq=False)
class _Client:
    """One browser on the line."""

    socket: WebSocket
    name: str
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    sent: int = 0
    read: int = 0
    times: deque[float] = field(default_factory=lambda: deque[float](maxlen=_A_SECOND))

    def floods(self) -> bool:
        """Whether this request is one too many."""
        now = time.monotonic()
        full = len(self.times) == _A_SECOND and now - self.times[0] < 1.0
        self.times.append(now)
        return full


class _Line:
    """All browsers, and the pictures that go to them."""

    def __init__(self, deck: Deck) -> None:
        self._deck = deck
        self.clients: set[_Client] = set()
        self._names: dict[str, str] = {}

    def name(self, token: str) -> str:
        """What a browser is called; the same after a reload."""
        if token not in self._names and len(self._names) >= _NAMES:
            self._names.pop(next(iter(self._names)))
        return self._names.setdefault(token, f"Bridge {len(self._names) + 1}")

    def ring(self) -> None:
        """There is a new picture."""
        for client in self.clients:
            client.ready.set()

    async def serve(self, ws: WebSocket) -> None:
        """One browser, from its first word to its last."""
        await ws.accept()
        try:
            said = await asyncio.wait_for(_said(ws), 5.0)
        except (TimeoutError, WebSocketDisconnect):
            await _closed(ws, "say hello first")
            return
        token = said.get("hello")
        if not isinstance(token, str) or not 8 <= len(token) <= 64 or len(self.clients) >= _CLIENTS:
            await _closed(ws, "no hello, or too many browsers")
            return
        client = _Client(ws, self.name(token))
        self._deck.command.come(client.name, time.monotonic())
        await ws.send_json(self._deck.hello(client.name))
        self.clients.add(client)
        pictures = asyncio.create_task(self._send(client))
        listening = asyncio.create_task(self._listen(client))
        try:
            await asyncio.wait((pictures, listening), return_when=asyncio.FIRST_COMPLETED)
        finally:
            self.clients.discard(client)
            for task in (pictures, listening):
                task.cancel()
            await asyncio.gather(pictures, listening, return_exceptions=True)
            if all(one.name != client.name for one in self.clients):
                self._deck.command.leave(client.name)
            await _closed(ws, "")

    async def _send(self, client: _Client) -> None:
        while client.sent - client.read <= _BEHIND:
            with suppress(TimeoutError):
                await asyncio.wait_for(client.ready.wait(), _IDLE)
            client.ready.clear()
            picture = json.dumps({"n": client.sent, **self._deck.frame()}, separators=(",", ":"))
            await asyncio.wait_for(client.socket.send_text(picture), 100 * PERIOD)
            client.sent += 1

    async def _listen(self, client: _Client) -> None:
        while not client.floods():
            said = await _said(client.socket)
            read = said.get("read")
            if isinstance(read, int):
                client.read = min(max(read, client.read), client.sent)
            refused = self._deck.ask(client.name, said)
            if refused:
                await client.socket.send_json({"note": refused})


def application(deck: Deck, hosts: tuple[str, ...] = LOCAL) -> FastAPI:
    """The page and its socket.

    Args:
        hosts: names that the page may be asked for by; "*" for any.
    """
    line = _Line(deck)
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=list(hosts))
    app.state.line = line

    @app.middleware("http")
    async def headers(request: Request, go_on: Callable[[Request], Awaitable[Response]]) -> Response:
        response = await go_on(request)
        response.headers.update(_HEADERS)
        return response

    @app.websocket("/line")
    async def talk(ws: WebSocket) -> None:
        origin = ws.headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != ws.headers.get("host"):
            await ws.close(1008)
            return
        await line.serve(ws)

    app.mount("/", StaticFiles(directory=STATIC, html=True))
    return app


def serve(deck: Deck, loop: Loop, listening: socket.socket, hosts: tuple[str, ...]) -> None:
    """Sail and serve until the user has had enough."""
    app = application(deck, hosts)
    settings = uvicorn.Config(app, log_level="error", access_log=False, ws="websockets-sansio", ws_max_size=_LARGEST,
                              ws_per_message_deflate=False, lifespan="off", timeout_graceful_shutdown=1)  # fmt: skip
    server = uvicorn.Server(settings)
    sailing = threading.Thread(target=loop.run, name="loop", daemon=True)

    async def both() -> None:
        events = asyncio.get_running_loop()

        def fresh() -> None:
            with suppress(RuntimeError):  # the server has ended before the loop
                events.call_soon_threadsafe(app.state.line.ring)

        deck.fresh = fresh
        sailing.start()
        await server.serve(sockets=[listening])

    try:
        asyncio.run(both())
    finally:
        loop.stop()
        sailing.join(2.0)


async def _said(ws: WebSocket) -> Mapping[str, Any]:
    """The next request; what is none is an empty one."""
    try:
        said = json.loads(await ws.receive_text())
    except (ValueError, KeyError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}


async def _closed(ws: WebSocket, reason: str) -> None:
    with suppress(RuntimeError, WebSocketDisconnect):
        await ws.close(1008 if reason else 1000, reason)

"""What all pages have in common: static files, one socket, who is let in, who is dropped; needs the extra `web`."""

from __future__ import annotations

import asyncio
import errno
import ipaddress
import json
import os
import socket
import time
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import uvicorn
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.staticfiles import StaticFiles
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

SHARED = Path(__file__).with_name("static")
"""What the pages share: served below /shared."""

LOCAL = ("127.0.0.1", "localhost")
"""Names of a page that serves this machine only."""

ADDRESSES = "addresses"
"""Stands among the names of a page for any address in figures."""

MOST = 16
"""Browsers at a time."""

_LARGEST = 2048
"""Bytes of a request: at most."""

_A_SECOND = 200
"""Requests a second that one browser may send; more of them and it is dropped."""

_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'",
    "Cache-Control": "no-cache", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
}  # fmt: skip


@dataclass(eq=False)
class Client:
    """One browser on the line.

    Attributes:
        behind: pictures that it may be behind before it is `deaf`.
        over: set where it is to go.
        sent, read: pictures that went out, and the last that it says it has read.
    """

    socket: WebSocket
    behind: int
    name: str = ""
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    over: asyncio.Event = field(default_factory=asyncio.Event)
    sent: int = 0
    read: int = 0
    times: deque[float] = field(default_factory=lambda: deque[float](maxlen=_A_SECOND))

    @property
    def deaf(self) -> bool:
        """Whether it has stopped reading."""
        return self.sent - self.read > self.behind

    def floods(self) -> bool:
        """Whether this request is one too many."""
        now = time.monotonic()
        full = len(self.times) == _A_SECOND and now - self.times[0] < 1.0
        self.times.append(now)
        return full

    async def show(self, picture: Mapping[str, Any], patience: float) -> None:
        """Send a picture; TimeoutError where it does not get out for so many seconds."""
        text = json.dumps({"n": self.sent, **picture}, separators=(",", ":"), allow_nan=False)
        await asyncio.wait_for(self.socket.send_text(text), patience)
        self.sent += 1

    async def hear(self) -> Mapping[str, Any]:
        """The next request; what is none is an empty one."""
        said = await hear(self.socket)
        read = said.get("read")
        if isinstance(read, int):
            self.read = min(max(read, self.read), self.sent)
        return said

    async def attend(self, showing: Coroutine[Any, Any, None], hearing: Coroutine[Any, Any, None]) -> None:
        """Show and hear until one of the two ends, or it is to go."""
        tasks = [asyncio.ensure_future(one) for one in (showing, hearing, self.over.wait())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


def application(static: Path, talk: Callable[[WebSocket], Awaitable[None]], hosts: tuple[str, ...] = LOCAL) -> FastAPI:
    """A page and its socket.

    Args:
        static: folder of the page's own files.
        talk: one browser on the socket, from its first word to its last.
        hosts: names that the page may be asked for by, `ADDRESSES` among them or not.
    """
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    app.add_middleware(_Named, hosts=hosts)

    @app.middleware("http")
    async def headers(request: Request, go_on: Callable[[Request], Awaitable[Response]]) -> Response:
        response = await go_on(request)
        response.headers.update(_HEADERS)
        return response

    @app.websocket("/line")
    async def line(ws: WebSocket) -> None:
        origin = ws.headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != ws.headers.get("host"):
            await ws.close(1008)
            return
        await talk(ws)

    app.mount("/shared", StaticFiles(directory=SHARED))
    app.mount("/", StaticFiles(directory=static, html=True))
    return app


class _Named:
    """Answers only where it is asked for by a name of its own.

    A page from elsewhere whose name is made to lead here, once it is loaded, is the same origin to a browser: it is
    told by the name alone.  An address in figures cannot be made to lead anywhere else.
    """

    def __init__(self, app: ASGIApp, hosts: tuple[str, ...]) -> None:
        self._app, self._hosts = app, hosts

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        said = next((value for name, value in scope.get("headers", ()) if name == b"host"), b"").decode("latin-1")
        if scope["type"] not in ("http", "websocket") or known(said, self._hosts):
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await PlainTextResponse("not a name of this page", 400)(scope, receive, send)


def known(host: str, hosts: tuple[str, ...]) -> bool:
    """Whether a page of these names is asked for by what stands in a Host header, with a port or without."""
    try:
        name = urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return False
    if name in hosts:
        return name != ADDRESSES
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return ADDRESSES in hosts


def anywhere() -> tuple[str, ...]:
    """Names of a page that serves other machines as well: addresses in figures, and what this machine is called."""
    own = socket.gethostname().lower()
    return (*LOCAL, own, f"{own.partition('.')[0]}.local", ADDRESSES)


def server(app: FastAPI) -> uvicorn.Server:
    """The server of a page, for `attend`."""
    return uvicorn.Server(uvicorn.Config(
        app, log_level="error", access_log=False, ws="websockets-sansio", ws_max_size=_LARGEST, http=Guarded,
        ws_per_message_deflate=False, lifespan="off", timeout_graceful_shutdown=1, backlog=AT_ONCE,
    ))  # fmt: skip


async def attend(serving: uvicorn.Server, listening: socket.socket) -> None:
    """Serve at a socket that listens, until the server is told to end."""
    with Door.at(listening) as door:
        await serving.serve(sockets=[door])


async def hear(ws: WebSocket) -> Mapping[str, Any]:
    """The next request; what is none is an empty one."""
    try:
        said = json.loads(await ws.receive_text())
    except (ValueError, KeyError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}


async def close(ws: WebSocket, reason: str = "", code: int = 1008) -> None:
    """Hang up; for a reason, if it is the browser's fault."""
    with suppress(RuntimeError, WebSocketDisconnect):
        await ws.close(code if reason else 1000, reason)


CONNECTIONS = 96
"""Connections at a time: more than the browsers that are let in need while they load the page."""

PATIENCE = 10.0
"""Time for a request, from the connection or the answer before to the end of its own answer [s]."""

AT_ONCE = 16
"""Connections that are taken in between two looks at all others."""

_FULL = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_PAUSE, _QUEUE = 0.01, 256


class Guarded(H11Protocol):
    """A connection that is aborted where it takes too long, or has to make way."""

    _since = 0.0
    _limit: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Somebody comes; the oldest without an open socket makes way where there are too many."""
        super().connection_made(transport)
        self._since = self.loop.time()
        self._wind()
        there: list[Any] = [one for one in self.connections if not one.transport.is_closing()]
        if len(there) > CONNECTIONS:
            self._least(there).transport.abort()

    def _least(self, there: list[Any]) -> Any:
        """Who makes way: a socket that was told to go and stays, else the oldest that asks for nothing, else this."""
        going = [one for one in there if getattr(one, "close_sent", False)]
        others = [one for one in there if isinstance(one, Guarded) and one is not self]
        return going[0] if going else min(others, key=lambda one: one._since, default=self)

    def connection_lost(self, exc: Exception | None) -> None:
        """It is gone."""
        self._unwind()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """It becomes the socket of a page, which has limits of its own."""
        self._unwind()
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        """One request is answered; the next has as long."""
        super().on_response_complete()
        if not self.transport.is_closing():
            self._wind()

    def _wind(self) -> None:
        self._unwind()
        self._limit = self.loop.call_later(PATIENCE, self.transport.abort)

    def _unwind(self) -> None:
        if self._limit is not None:
            self._limit.cancel()


class Door(socket.socket):
    """A socket that listens, and does so still where there is no descriptor left for who comes."""

    _spare = -1

    @staticmethod
    def at(listening: socket.socket) -> Door:
        """The door at a socket that listens already; both are to be closed."""
        door = Door(listening.family, listening.type, listening.proto, os.dup(listening.fileno()))
        door._spare = os.open(os.devnull, os.O_RDONLY)
        return door

    def listen(self, backlog: int = _QUEUE, /) -> None:
        """Listen; who comes may wait in a long queue, however few are taken in at once."""
        super().listen(max(backlog, _QUEUE))

    def accept(self) -> tuple[socket.socket, Any]:
        """The next connection.

        Raises:
            BlockingIOError: there is none, or no descriptor for it: it is then closed again.
        """
        try:
            return super().accept()
        except OSError as error:
            if error.errno not in _FULL:
                raise
        self._turn_away()
        raise BlockingIOError(errno.EAGAIN, "no descriptor left")

    def close(self) -> None:
        """Close the door, and give the reserve back."""
        if self._spare >= 0:
            os.close(self._spare)
            self._spare = -1
        super().close()

    def _turn_away(self) -> None:
        if self._spare >= 0:
            os.close(self._spare)
            self._spare = -1
        with suppress(OSError):
            super().accept()[0].close()
        with suppress(OSError):  # where somebody else was quicker, the next one that comes gives another chance
            self._spare = os.open(os.devnull, os.O_RDONLY)
        time.sleep(_PAUSE)

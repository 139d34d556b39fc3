"""Server for pages in a browser: static files, one WebSocket, access checks, limits on connections; extra `web`.

Idle connections could use up the descriptors of the process; then neither the page nor a recording could be opened.
Three limits prevent that.  A connection has `PATIENCE` seconds for each request, until the end of the answer.  Beyond
`CONNECTIONS` connections, the oldest that is not an open socket of a page is closed.  If the process still has no
descriptors left, a new connection is accepted with a reserved descriptor and closed, so that accepting does not spin.
"""

from __future__ import annotations

import asyncio
import errno
import ipaddress
import json
import os
import secrets
import socket
import threading
import time
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

import uvicorn
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.staticfiles import StaticFiles
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from ..core.values import dataclass, field

SHARED = Path(__file__).with_name("static")
"""Files that the pages share, served below /shared."""

LOCAL = ("127.0.0.1", "localhost")
"""Host names of a page that is served to this machine only."""

ADDRESSES = "addresses"
"""Stands among the host names of a page for any numeric address."""

MOST = 16
"""Largest number of browsers at a time."""

_LARGEST = 2048
"""Largest size of a request [bytes]."""

_A_SECOND = 200
"""Largest number of requests per second of one browser; above it the browser is disconnected."""

Task = asyncio.Future[None]

_PERIOD = 0.25
"""Time between two pictures of a page that asks nothing [s]."""

_BEHIND = 40
"""Unread pictures after which a browser of such a page is disconnected."""

_HEADERS = {
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; base-uri 'none'",
    "Cache-Control": "no-cache", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
}  # fmt: skip


@dataclass(eq=False)
class Client:
    """One connected browser.

    Attributes:
        behind: unread pictures after which it counts as `deaf`.
        over: set when it must disconnect.
        sent, read: number of pictures sent, and the last one that the browser confirmed.
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
        """Whether the browser has stopped reading."""
        return self.sent - self.read > self.behind

    def floods(self) -> bool:
        """Whether this request exceeds the rate limit."""
        now = time.monotonic()
        full = len(self.times) == _A_SECOND and now - self.times[0] < 1.0
        self.times.append(now)
        return full

    async def show(self, picture: Mapping[str, Any], patience: float) -> None:
        """Send a picture; TimeoutError if that takes more than `patience` seconds."""
        text = json.dumps({"n": self.sent, **picture}, separators=(",", ":"), allow_nan=False)
        await asyncio.wait_for(self.socket.send_text(text), patience)
        self.sent += 1

    async def hear(self) -> Mapping[str, Any]:
        """The next request; invalid input gives an empty one."""
        said = await hear(self.socket)
        read = said.get("read")
        if isinstance(read, int):
            self.read = min(max(read, self.read), self.sent)
        return said

    async def attend(self, showing: Coroutine[Any, Any, None], hearing: Coroutine[Any, Any, None]) -> None:
        """Run both tasks until one of them ends or `over` is set."""
        tasks = [asyncio.ensure_future(one) for one in (showing, hearing, self.over.wait())]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


def application(
    static: Path, talk: Callable[[WebSocket], Awaitable[None]], hosts: tuple[str, ...] = LOCAL,
    links: Sequence[Callable[[FastAPI], None]] = (),
) -> FastAPI:  # fmt: skip
    """A page and its socket.

    Args:
        static: folder of the page's own files.
        talk: serves one browser on the socket until it disconnects.
        hosts: host names under which the page is served; may include `ADDRESSES`.
        links: each adds further routes.
    """
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    app.add_middleware(_Named, hosts=hosts)

    @app.middleware("http")
    async def headers(request: Request, go_on: Callable[[Request], Awaitable[Response]]) -> Response:
        response = await go_on(request)
        for name, value in _HEADERS.items():
            response.headers.setdefault(name, value)
        return response

    @app.websocket("/line")
    async def line(ws: WebSocket) -> None:
        if not same_origin(ws.headers):
            await ws.close(1008)
            return
        await talk(ws)

    for link in links:
        link(app)
    app.mount("/shared", StaticFiles(directory=SHARED))
    app.mount("/", StaticFiles(directory=static, html=True))
    return app


def same_origin(headers: Mapping[str, str]) -> bool:
    """Whether a request is of a page of this server, or of no page at all."""
    origin = headers.get("origin")
    try:
        return origin is None or urlsplit(origin).netloc == headers.get("host")
    except ValueError:  # no address at all, such as "http://["
        return False


def admitted(key: str, said: object) -> bool:
    """Whether what a client says is the key; anything is where no key is needed."""
    return not key or (isinstance(said, str) and secrets.compare_digest(said.encode(errors="replace"), key.encode()))


async def body(request: Request, most: int) -> bytes:
    """The body of a request, of a declared length or in chunks; ValueError: more than `most` bytes, the rest unread."""
    data = b""
    async for part in request.stream():
        data += part
        if len(data) > most:
            raise ValueError(f"a body of more than {most} bytes")
    return data


class _Named:
    """Serves only requests whose Host header has a name of this page.

    This prevents DNS rebinding: a foreign page whose name is made to resolve to this machine counts as the same origin
    in a browser, and only the name reveals it.  A numeric address cannot be rebound.
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
            await PlainTextResponse("unknown host name", 400)(scope, receive, send)


def known(host: str, hosts: tuple[str, ...]) -> bool:
    """Whether a Host header, with or without a port, has one of these names."""
    try:
        name = urlsplit(f"//{host}").hostname or ""
        if name in hosts:
            return name != ADDRESSES
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return ADDRESSES in hosts


def anywhere() -> tuple[str, ...]:
    """Host names of a page that is also served to other machines: numeric addresses, and the names of this machine."""
    own = socket.gethostname().lower()
    return (*LOCAL, own, f"{own.partition('.')[0]}.local", ADDRESSES)


def server(app: FastAPI) -> uvicorn.Server:
    """The server of a page, for `attend`."""
    return uvicorn.Server(uvicorn.Config(
        app, log_level="error", access_log=False, ws="websockets-sansio", ws_max_size=_LARGEST, http=Guarded,
        ws_per_message_deflate=False, lifespan="off", timeout_graceful_shutdown=1, backlog=AT_ONCE,
    ))  # fmt: skip


async def attend(serving: uvicorn.Server, listening: socket.socket) -> None:
    """Serve at a listening socket until the server is told to exit."""
    with Door.at(listening) as door:
        await serving.serve(sockets=[door])


async def converse(ws: WebSocket, hearing: Coroutine[Any, Any, None], tell: Callable[[Task], Awaitable[None]]) -> None:
    """Hear a client while `tell` speaks; closes the socket of one that leaves or reads too slowly."""
    task = asyncio.ensure_future(hearing)
    try:
        await tell(task)
    except (RuntimeError, TimeoutError):
        pass
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        await close(ws)


async def hear(ws: WebSocket) -> Mapping[str, Any]:
    """The next request; invalid input gives an empty one."""
    try:
        said = json.loads(await ws.receive_text())
    except (ValueError, KeyError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}


async def close(ws: WebSocket, reason: str = "", code: int = 1008) -> None:
    """Close a socket; with `code` if a reason is given, else normally."""
    with suppress(RuntimeError, WebSocketDisconnect):
        await ws.close(code if reason else 1000, reason)


class Source(Protocol):
    """What a page shows that asks nothing.

    Attributes:
        looked: whether a browser is connected; the page keeps it.
    """

    looked: bool

    def pictures(self) -> Callable[[bool], Mapping[str, Any] | None]:
        """For one browser: gives its next picture, or None without news; told whether it will be the last."""
        ...


class Watched:
    """Shows a source at a listening socket while its context lasts, by a server in a thread of its own.

    What is shown never waits for it, and is not affected by its failures.

    Args:
        source: of the pictures.
        static: folder of the page's own files.
    """

    def __init__(self, source: Source, static: Path, listening: socket.socket) -> None:
        self._source, self._listening = source, listening
        self._clients: set[Client] = set()
        self._closing = False
        self._server = server(application(static, self._talk))
        self._thread = threading.Thread(target=self._serve, name="page", daemon=True)

    def __enter__(self) -> Watched:
        """Start the server; returns when it has started, so that this does not slow the first pictures."""
        self._thread.start()
        end = time.monotonic() + 5.0
        while not self._server.started and self._thread.is_alive() and time.monotonic() < end:
            time.sleep(0.01)
        return self

    def __exit__(self, *_: object) -> None:
        """Show the last picture to connected browsers, and end."""
        self._closing = True
        end = time.monotonic() + 4.0 * _PERIOD
        while self._clients and time.monotonic() < end:
            time.sleep(0.02)
        self._server.should_exit = True
        self._thread.join(3.0)

    def _serve(self) -> None:
        asyncio.run(attend(self._server, self._listening))

    async def _talk(self, ws: WebSocket) -> None:
        await ws.accept()
        if len(self._clients) >= MOST:
            await close(ws, "too many browsers")
            return
        client = Client(ws, _BEHIND)
        self._clients.add(client)
        self._source.looked = True
        try:
            await client.attend(self._show(client), self._hear(client))
        finally:
            self._clients.discard(client)
            self._source.looked = bool(self._clients)
            await close(ws)

    async def _show(self, client: Client) -> None:
        following = self._source.pictures()
        while not client.deaf:
            closing = self._closing
            if (picture := following(closing)) is not None:
                await client.show(picture, 5.0)
            if closing:
                return
            await asyncio.sleep(_PERIOD)

    async def _hear(self, client: Client) -> None:
        while not client.floods():
            await client.hear()


CONNECTIONS = 96
"""Largest number of connections: more than the admitted browsers need while they load the page."""

PATIENCE = 10.0
"""Time for a request, from the connection or the previous answer to the end of its own answer [s]."""

AT_ONCE = 16
"""Connections that are accepted in one go before others are served."""

_FULL = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
_PAUSE, _QUEUE = 0.01, 256


class Guarded(H11Protocol):
    """A connection that is aborted when it takes too long or when there are too many."""

    _since = 0.0
    _limit: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:
        """Accept a connection; if there are too many, abort the oldest without an open socket."""
        super().connection_made(transport)
        self._since = self.loop.time()
        self._wind()
        there: list[Any] = [one for one in self.connections if not one.transport.is_closing()]
        if len(there) > CONNECTIONS:
            self._least(there).transport.abort()

    def _least(self, there: list[Any]) -> Any:
        """Connection to abort: a socket that was closed but stays, else the oldest idle connection, else this one."""
        going = [one for one in there if getattr(one, "close_sent", False)]
        others = [one for one in there if isinstance(one, Guarded) and one is not self]
        return going[0] if going else min(others, key=lambda one: one._since, default=self)

    def connection_lost(self, exc: Exception | None) -> None:
        self._unwind()
        super().connection_lost(exc)

    def handle_websocket_upgrade(self, event: Any) -> None:
        """The connection becomes the socket of a page, which has its own limits."""
        self._unwind()
        super().handle_websocket_upgrade(event)

    def on_response_complete(self) -> None:
        """A request is answered; restart the time limit for the next one."""
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
    """A listening socket that keeps accepting when the process has no descriptor left."""

    _spare = -1

    @staticmethod
    def at(listening: socket.socket) -> Door:
        """A door at a socket that already listens; both must be closed."""
        door = Door(listening.family, listening.type, listening.proto, os.dup(listening.fileno()))
        door._spare = os.open(os.devnull, os.O_RDONLY)
        return door

    def listen(self, backlog: int = _QUEUE, /) -> None:
        """Listen with a long queue, however few connections are accepted at once."""
        super().listen(max(backlog, _QUEUE))

    def accept(self) -> tuple[socket.socket, Any]:
        """The next connection; BlockingIOError: there is none, or no descriptor for it, and it is then closed."""
        try:
            return super().accept()
        except OSError as error:
            if error.errno not in _FULL:
                raise
        self._turn_away()
        raise BlockingIOError(errno.EAGAIN, "no descriptor left")

    def close(self) -> None:
        """Close the socket and the reserved descriptor."""
        self._give_up_spare()
        super().close()

    def _give_up_spare(self) -> None:
        if self._spare >= 0:
            os.close(self._spare)
            self._spare = -1

    def _turn_away(self) -> None:
        self._give_up_spare()
        with suppress(OSError):
            super().accept()[0].close()
        with suppress(OSError):  # if another thread took the descriptor, the next connection gives another chance
            self._spare = os.open(os.devnull, os.O_RDONLY)
        time.sleep(_PAUSE)

"""What all pages have in common: static files, one socket, who is let in, who is dropped; needs the extra `web`."""

from __future__ import annotations

import asyncio
import json
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
from starlette.middleware.trustedhost import TrustedHostMiddleware

SHARED = Path(__file__).with_name("static")
"""What the pages share: served below /shared."""

LOCAL = ("127.0.0.1", "localhost")

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
        sent, read: pictures that went out, and the last that it says it has read.
    """

    socket: WebSocket
    behind: int
    name: str = ""
    ready: asyncio.Event = field(default_factory=asyncio.Event)
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
        """Show and hear until one of the two ends."""
        tasks = asyncio.create_task(showing), asyncio.create_task(hearing)
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
        hosts: names that the page may be asked for by; "*" for any.
    """
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    app.add_middleware(TrustedHostMiddleware, allowed_hosts=list(hosts))

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


def server(app: FastAPI) -> uvicorn.Server:
    """The server of a page; the socket it listens at is given to it when it begins."""
    return uvicorn.Server(uvicorn.Config(
        app, log_level="error", access_log=False, ws="websockets-sansio", ws_max_size=_LARGEST,
        ws_per_message_deflate=False, lifespan="off", timeout_graceful_shutdown=1,
    ))  # fmt: skip


async def hear(ws: WebSocket) -> Mapping[str, Any]:
    """The next request; what is none is an empty one."""
    try:
        said = json.loads(await ws.receive_text())
    except (ValueError, KeyError, RecursionError):
        return {}
    return said if isinstance(said, dict) else {}


async def close(ws: WebSocket, reason: str = "") -> None:
    """Hang up; for a reason, if it is the browser's fault."""
    with suppress(RuntimeError, WebSocketDisconnect):
        await ws.close(1008 if reason else 1000, reason)

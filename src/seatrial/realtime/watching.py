"""A page that shows and asks nothing: pictures of one source for every browser; needs the extra `web`.

The server runs in a thread of its own.  What is shown never waits for it, and is not affected by its failures.
"""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Protocol

from fastapi import WebSocket

from .pages import MOST, Client, application, attend, close, server

_PERIOD = 0.25
"""Time between two pictures [s]."""

_BEHIND = 40
"""Unread pictures after which a browser is disconnected."""


class Source(Protocol):
    """What a page shows.

    Attributes:
        looked: whether a browser is connected; the page keeps it.
    """

    looked: bool

    def pictures(self) -> Callable[[bool], Mapping[str, Any] | None]:
        """For one browser: gives its next picture, or None without news; told whether it will be the last."""
        ...


class Watched:
    """Shows a source at a listening socket while its context lasts.

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

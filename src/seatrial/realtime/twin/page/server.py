"""The page of a twin: a server in a thread of its own; needs the extra `web`."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from pathlib import Path
from typing import Any

from fastapi import WebSocket

from ...pages import MOST, Client, application, attend, close, server
from .screen import Screen

STATIC = Path(__file__).with_name("static")

_PERIOD = 0.25
"""Time between two pictures [s]."""

_BEHIND = 40
"""Unread pictures after which a browser is disconnected."""


class Server:
    """Shows the pictures of a screen at a listening socket while its context lasts; the twin never waits for it."""

    def __init__(self, screen: Screen, listening: socket.socket) -> None:
        self._screen, self._listening = screen, listening
        self._clients: set[Client] = set()
        self._closing = False
        self._server = server(application(STATIC, self._talk))
        self._thread = threading.Thread(target=self._serve, name="twin page", daemon=True)

    def __enter__(self) -> Server:
        """Start it."""
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
        self._screen.looked = True
        try:
            await client.attend(self._show(client), self._hear(client))
        finally:
            self._clients.discard(client)
            self._screen.looked = bool(self._clients)
            await close(ws)

    async def _show(self, client: Client) -> None:
        last: dict[str, Any] | None = None
        while not client.deaf:
            closing, picture = self._closing, self._screen.picture
            if picture and (picture is not last or closing):
                await client.show({**picture, "over": picture["over"] or closing}, 5.0)
                last = picture
            if closing:
                return
            await asyncio.sleep(_PERIOD)

    async def _hear(self, client: Client) -> None:
        while not client.floods():
            await client.hear()

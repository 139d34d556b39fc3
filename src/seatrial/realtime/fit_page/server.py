"""The page of a running fit: a server in a thread of its own; needs the extra `web`."""

from __future__ import annotations

import asyncio
import socket
import threading
import time
from pathlib import Path
from typing import Any

from fastapi import WebSocket

from ..pages import MOST, Client, application, attend, close, server
from .board import Board, Seen, Tracker

STATIC = Path(__file__).with_name("static")

PERIOD, _QUIET = 0.25, 2.0
"""Time between two pictures, and between two without news [s]."""

_BEHIND = 40
"""Unread pictures after which a browser is disconnected."""


class Page:
    """Shows a board to browsers at a listening socket; failures here do not affect the fit."""

    def __init__(self, board: Board, listening: socket.socket) -> None:
        self._board, self._listening = board, listening
        self._clients: set[Client] = set()
        self._closing = False
        self._tracker = Tracker(board)
        self._server = server(application(STATIC, self._talk))
        self._thread = threading.Thread(target=self._serve, name="fit page", daemon=True)

    def start(self) -> None:
        """Start the server; returns when it has started, so that this does not slow the fit."""
        self._thread.start()
        end = time.monotonic() + 5.0
        while not self._server.started and self._thread.is_alive() and time.monotonic() < end:
            time.sleep(0.01)
        self._tracker.start()

    def close(self) -> None:
        """Show the last state to connected browsers, and end."""
        self._tracker.close()
        self._closing = True
        end = time.monotonic() + 4.0 * PERIOD
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
        self._board.looked = True
        try:
            await client.attend(self._show(client), self._hear(client))
        finally:
            self._clients.discard(client)
            self._board.looked = bool(self._clients)
            await close(ws)

    async def _show(self, client: Client) -> None:
        seen, last, told = Seen(), dict[str, Any](), 0.0
        while not client.deaf:
            closing = self._closing
            news = self._board.news(seen)
            now = time.monotonic()
            if _new(news, last) or closing or now > told + _QUIET:
                await client.show({**news, "over": closing}, 5.0)
                last, told = news, now
            if closing:
                return
            await asyncio.sleep(PERIOD)

    async def _hear(self, client: Client) -> None:
        while not client.floods():
            await client.hear()


def _new(news: dict[str, Any], last: dict[str, Any]) -> bool:
    """Whether more than the clock has changed."""
    return {**news, "elapsed": 0.0} != {**last, "elapsed": 0.0}

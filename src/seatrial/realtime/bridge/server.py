"""The bridge in a browser: one static page and one socket; needs the extra `web`."""

from __future__ import annotations

import asyncio
import itertools
import socket
import threading
import time
from contextlib import suppress
from pathlib import Path

from fastapi import FastAPI, WebSocket, WebSocketDisconnect

from ..loop import Loop
from ..pages import LOCAL, MOST, Client, close, hear, server
from ..pages import application as page
from .deck import PERIOD, Deck

STATIC = Path(__file__).with_name("static")

_NAMES = 200
"""Browsers that are known again: at most."""

_BEHIND, _IDLE = 200, 0.25
"""Pictures that a browser may be behind before it is dropped, and the time between two while nothing moves [s]."""


class _Line:
    """All browsers, and the pictures that go to them."""

    def __init__(self, deck: Deck) -> None:
        self._deck = deck
        self.clients: set[Client] = set()
        self._names: dict[str, str] = {}
        self._count = itertools.count(1)

    def name(self, token: str) -> str:
        """What a browser is called; the same after a reload, and no one else's as long as the bridge runs."""
        if token not in self._names:
            command = self._deck.command
            needed = {*command.present, command.holder}
            if len(self._names) >= _NAMES:
                self._names.pop(next(known for known, name in self._names.items() if name not in needed))
            self._names[token] = f"Bridge {next(self._count)}"
        return self._names[token]

    def ring(self) -> None:
        """There is a new picture."""
        for client in self.clients:
            client.ready.set()

    async def serve(self, ws: WebSocket) -> None:
        """One browser, from its first word to its last."""
        await ws.accept()
        try:
            said = await asyncio.wait_for(hear(ws), 5.0)
        except (TimeoutError, WebSocketDisconnect):
            await close(ws, "say hello first")
            return
        token = said.get("hello")
        if not isinstance(token, str) or not 8 <= len(token) <= 64 or len(self.clients) >= MOST:
            await close(ws, "no hello, or too many browsers")
            return
        client = Client(ws, _BEHIND, self.name(token))
        self._deck.command.come(client.name, time.monotonic())
        await ws.send_json(self._deck.hello(client.name))
        self.clients.add(client)
        try:
            await client.attend(self._send(client), self._listen(client))
        finally:
            self.clients.discard(client)
            if all(one.name != client.name for one in self.clients):
                self._deck.command.leave(client.name)
            await close(ws)

    async def _send(self, client: Client) -> None:
        leaps = self._deck.leaps
        while not client.deaf:
            with suppress(TimeoutError):
                await asyncio.wait_for(client.ready.wait(), _IDLE)
            client.ready.clear()
            if self._deck.leaps != leaps:  # the way so far is another one
                leaps = self._deck.leaps
                await client.socket.send_json(self._deck.hello(client.name))
            await client.show(self._deck.frame(), 100 * PERIOD)

    async def _listen(self, client: Client) -> None:
        while not client.floods():
            refused = self._deck.ask(client.name, await client.hear())
            if refused:
                await client.socket.send_json({"note": refused})


def application(deck: Deck, hosts: tuple[str, ...] = LOCAL) -> FastAPI:
    """The page and its socket; `hosts` are the names it may be asked for by, "*" for any."""
    line = _Line(deck)
    app = page(STATIC, line.serve, hosts)
    app.state.line = line
    return app


def serve(deck: Deck, loop: Loop, listening: socket.socket, hosts: tuple[str, ...]) -> None:
    """Sail and serve until the user has had enough."""
    app = application(deck, hosts)
    serving = server(app)
    sailing = threading.Thread(target=loop.run, name="loop", daemon=True)

    async def both() -> None:
        events = asyncio.get_running_loop()

        def fresh() -> None:
            with suppress(RuntimeError):  # the server has ended before the loop
                events.call_soon_threadsafe(app.state.line.ring)

        deck.fresh = fresh
        sailing.start()
        await serving.serve(sockets=[listening])

    try:
        asyncio.run(both())
    finally:
        loop.stop()
        sailing.join(2.0)

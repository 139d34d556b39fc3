"""Server of the bridge: one static page and one WebSocket for each browser; needs the extra `web`."""

from __future__ import annotations

import asyncio
import itertools
import math
import socket
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from fastapi import FastAPI, WebSocket

from ..loop import Loop
from ..pages import LOCAL, MOST, Client, admitted, attend, close, hear, server
from ..pages import application as page
from .deck import PERIOD, Deck

STATIC = Path(__file__).with_name("static")
"""The page's own files; nothing is fetched from elsewhere."""

_NAMES = 200
"""Largest number of browsers that are recognised when they return."""

_BEHIND, _IDLE = 200, 0.25
"""Unread pictures after which a browser is disconnected; time between two pictures while nothing moves [s]."""

_STRANGERS = 16
"""Largest number of sockets without a hello; beyond it the oldest is closed."""

REPLACED, KEYLESS = 4001, 4003
"""Codes of a socket that is closed because its page was opened again or lacks the key; it must not reconnect."""


class _Line:
    """All connected browsers, and sending the pictures to them."""

    def __init__(self, deck: Deck, key: str) -> None:
        self._deck, self._key = deck, key
        self._strangers: list[asyncio.Future[Mapping[str, Any]]] = []
        self.clients: set[Client] = set()
        self._names: dict[str, str] = {}
        self._count = itertools.count(1)

    def name(self, token: str) -> str:
        """Name of a browser; the same after a reload, and unique as long as the bridge runs."""
        if token not in self._names:
            command = self._deck.command
            needed = {*command.present, command.holder}
            if len(self._names) >= _NAMES:
                self._names.pop(next(known for known, name in self._names.items() if name not in needed))
            self._names[token] = f"Bridge {next(self._count)}"
        return self._names[token]

    def ring(self) -> None:
        """Notify all browsers of a new picture."""
        for client in self.clients:
            client.ready.set()

    async def serve(self, ws: WebSocket) -> None:
        """Serve one browser until it disconnects."""
        await ws.accept()
        token = await self._greeted(ws)
        if token is None:
            return
        client = Client(ws, _BEHIND, self.name(token))
        for before in [one for one in self.clients if one.name == client.name]:
            self.clients.discard(before)
            before.over.set()
        self._deck.command.come(client.name, time.monotonic())
        self.clients.add(client)
        try:
            await ws.send_json(self._deck.hello(client.name))
            await client.attend(self._send(client), self._listen(client))
        finally:
            self.clients.discard(client)
            if all(one.name != client.name for one in self.clients):
                self._deck.command.leave(client.name)
            reason = "this page was opened again in another window" if client.over.is_set() else ""
            await close(ws, reason, REPLACED)

    async def _greeted(self, ws: WebSocket) -> str | None:
        """Token of a browser with a valid hello; None of one that was refused."""
        waiting = asyncio.ensure_future(hear(ws))
        self._strangers.append(waiting)
        if len(self._strangers) > _STRANGERS:  # close the one that has been silent for longest
            self._strangers[0].cancel()
        try:
            await asyncio.wait({waiting}, timeout=5.0)
        finally:
            self._strangers.remove(waiting)
            waiting.cancel()
        if not waiting.done() or waiting.cancelled() or waiting.exception() is not None:
            await close(ws, "say hello first")
            return None
        said = waiting.result()
        token, key = said.get("hello"), said.get("key")
        if not admitted(self._key, key):
            await close(ws, "open the address that the terminal shows, with its key", KEYLESS)
        elif not isinstance(token, str) or not 8 <= len(token) <= 64:
            await close(ws, "no hello")
        elif not self._room(token):
            await close(ws, "too many browsers", 1013)
        else:
            return token
        return None

    def _room(self, token: str) -> bool:
        """Whether a browser is admitted; one that returns keeps its place, and the commander always has one."""
        name = self._names.get(token, "")
        others = {one.name for one in self.clients} - {name}
        return len(others) < MOST or (name != "" and name == self._deck.command.holder)

    async def _send(self, client: Client) -> None:
        leaps = self._deck.leaps
        while not client.deaf:
            with suppress(TimeoutError):
                await asyncio.wait_for(client.ready.wait(), _IDLE)
            client.ready.clear()
            if self._deck.leaps != leaps:  # the trail has changed
                leaps = self._deck.leaps
                await client.socket.send_json(self._deck.hello(client.name))
            await client.show(self._deck.frame(), 100 * PERIOD)

    async def _listen(self, client: Client) -> None:
        while not client.floods():
            said = await client.hear()
            if client not in self.clients:  # replaced by a newer page
                return
            refused = self._deck.ask(client.name, said)
            if refused:
                await client.socket.send_json({"note": refused})


def application(
    deck: Deck, hosts: tuple[str, ...] = LOCAL, key: str = "", links: Sequence[Callable[[FastAPI], None]] = ()
) -> FastAPI:  # fmt: skip
    """The page and its socket; `hosts` are the host names it is served under, `key` is required of each browser.

    `links` add further routes.
    """
    line = _Line(deck, key)
    app = page(STATIC, line.serve, hosts, links)
    app.state.line = line
    return app


def serve(
    deck: Deck, loop: Loop, listening: socket.socket, hosts: tuple[str, ...] = LOCAL, key: str = "",
    links: Sequence[Callable[[FastAPI], None]] = (), duration: float = math.inf,
) -> None:  # fmt: skip
    """Run the loop and serve the page until interrupted, or the loop stops, at the latest after `duration` [s].

    `hosts`, `key` and `links` as in `application`.
    """
    app = application(deck, hosts, key, links)
    serving = server(app)

    def sail() -> None:
        loop.run(duration)
        serving.should_exit = True

    sailing = threading.Thread(target=sail, name="loop", daemon=True)

    async def both() -> None:
        events = asyncio.get_running_loop()

        def fresh() -> None:
            with suppress(RuntimeError):  # the server has ended before the loop
                events.call_soon_threadsafe(app.state.line.ring)

        deck.fresh = fresh
        sailing.start()
        await attend(serving, listening)

    try:
        asyncio.run(both())
    finally:
        loop.stop()
        sailing.join(2.0)

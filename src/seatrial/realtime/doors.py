"""The door of a page: so many connections at a time, each with its request in good time; needs the extra `web`.

A server that takes whatever comes can be put out of action by connections that say nothing: they use up the
descriptors of the process, and then neither the page nor a recording can be opened.  Three things stand against that.
A connection has `PATIENCE` seconds for each request, up to the end of the answer.  Where there are `MOST` of them, the
oldest that is no open socket of a page makes way for the one that comes.  And where the process has no descriptors
left all the same, who comes is turned away with one kept in reserve, so that nothing is tried over and over.
"""

from __future__ import annotations

import asyncio
import errno
import os
import socket
import time
from contextlib import suppress
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

MOST = 96
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
        if len(there) > MOST:
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

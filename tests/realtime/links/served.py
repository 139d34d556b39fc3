"""A server of links in a thread, asked over real sockets."""

from __future__ import annotations

import asyncio
import http.client
import json
import socket
import threading
from typing import Any, NamedTuple, Self

from fastapi import FastAPI
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from seatrial.realtime.pages import attend, server


class Answer(NamedTuple):
    """An answer: status and body."""

    status_code: int
    body: bytes

    def json(self) -> Any:
        return json.loads(self.body)


class Served:
    """The routes of a link at a free port."""

    def __init__(self, link: Any) -> None:
        app = FastAPI()
        link.routes(app)
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = int(self._listening.getsockname()[1])
        self._serving = server(app)
        self._thread = threading.Thread(target=lambda: asyncio.run(attend(self._serving, self._listening)), daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._serving.should_exit = True
        self._thread.join(5.0)
        self._listening.close()

    def request(self, method: str, path: str, content: bytes | None = None, **headers: str) -> Answer:
        line = http.client.HTTPConnection("127.0.0.1", self.port, timeout=10.0)
        try:
            line.request(method, path, content, headers)
            answer = line.getresponse()
            return Answer(answer.status, answer.read())
        finally:
            line.close()

    def get(self, path: str) -> Answer:
        return self.request("GET", path)

    def put(self, path: str, said: Any, **headers: str) -> Answer:
        return self.request("PUT", path, json.dumps(said).encode(), **headers)

    def socket(self, path: str, origin: str | None = None) -> ClientConnection:
        given = None if origin is None else Origin(origin)
        return connect(f"ws://127.0.0.1:{self.port}{path}", proxy=None, origin=given, close_timeout=0.5)


def heard(ws: ClientConnection) -> Any:
    return json.loads(ws.recv(timeout=10.0))

"""A bridge in a process of its own, and talk with one over a socket."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from fetched import get


class Running:
    """A bridge in a process of its own."""

    def __init__(self, folder: Path, *more: str, ship: str = "kvlcc2_l7") -> None:
        command = [sys.executable, "-m", "seatrial", "bridge", ship, "--port", "0", "-o", str(folder), *more]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        self.open = ExitStack()
        if self.process.stderr:
            self.open.enter_context(self.process.stderr)
        found = re.search(r":(\d+)/", self.process.stderr.readline() if self.process.stderr else "")
        assert found
        self.port = int(found[1])

    def get(self, path: str, host: str = "localhost") -> tuple[int, dict[str, str], str]:
        return get(self.port, path, host)

    def raw(self, origin: str | None = None) -> ClientConnection:
        given = None if origin is None else Origin(origin)
        address = f"ws://127.0.0.1:{self.port}/line"
        return self.open.enter_context(connect(address, proxy=None, max_size=None, origin=given, close_timeout=0.5))

    def close(self) -> None:
        self.process.kill()
        self.process.wait(10)
        self.open.close()

    def line(self, token: str) -> ClientConnection:
        ws = self.raw()
        ws.send(json.dumps({"hello": token}))
        return ws


def hear(ws: ClientConnection, key: str, seconds: float = 10.0) -> dict[str, Any]:
    """The next message that has this key."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        said = json.loads(ws.recv(timeout=seconds))
        if key in said:
            return said
    raise TimeoutError(key)


def read_to_the_end(ws: ClientConnection) -> None:
    """Until the other side hangs up; fails where it never does."""
    end = time.monotonic() + 10.0
    with suppress(ConnectionClosed):
        while time.monotonic() < end:
            ws.recv(timeout=5)
        pytest.fail("still on the line")


def ask(ws: ClientConnection, **said: Any) -> None:
    ws.send(json.dumps(said))

"""A headless browser over its own wire, for tests that must see the page."""

from __future__ import annotations

import base64
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

from websockets.sync.client import connect

import qt_browser

_NAMES = ("chromium", "chromium-browser", "google-chrome", "chromium-headless-shell")
_INSTALLED = next(filter(None, map(shutil.which, _NAMES)), None)
CHROMIUM = _INSTALLED or (qt_browser.__file__ if qt_browser.there() else None)
"""A browser to test with: Chromium of the system, or that of QtWebEngine; None where there is neither."""
_FLAGS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--mute-audio",
          "--disable-background-networking", "--disable-component-update", "--remote-debugging-port=0")  # fmt: skip


def _free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


class Browser:
    """One page of a headless Chromium."""

    def __init__(self, folder: Path, width: int = 1280, height: int = 800) -> None:
        flags = (*_FLAGS, f"--user-data-dir={folder}", f"--window-size={width},{height}", "about:blank")
        qt = (sys.executable, str(CHROMIUM), str(_free_port()), str(width), str(height))
        self._process = subprocess.Popen((_INSTALLED, *flags) if _INSTALLED else qt, stderr=subprocess.PIPE, text=True,
                                         start_new_session=True)  # fmt: skip
        port = self._port()
        with connect(port, max_size=None, proxy=None) as ws:
            ws.send(json.dumps({"id": 1, "method": "Target.getTargets"}))
            targets = json.loads(ws.recv())["result"]["targetInfos"]
        page = next(one["targetId"] for one in targets if one["type"] == "page")
        self._open = ExitStack()
        address = f"{port.partition('/devtools')[0]}/devtools/page/{page}"
        self._ws = self._open.enter_context(connect(address, max_size=None, proxy=None))
        self._id = 0
        self.requests: list[str] = []
        self.errors: list[str] = []
        for domain in ("Page", "Network", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def _port(self) -> str:
        for line in self._process.stderr or ():
            found = re.search(r"(ws://\S+)", line)
            if found:
                return found[1]
        raise RuntimeError("the browser said nothing of its port")

    def call(self, method: str, **given: Any) -> dict[str, Any]:
        self._id += 1
        self._ws.send(json.dumps({"id": self._id, "method": method, "params": given}))
        while True:
            said = json.loads(self._ws.recv(timeout=30))
            if said.get("id") == self._id:
                if "error" in said:
                    raise RuntimeError(said["error"])
                return said["result"]
            self._note(said)

    def _note(self, said: dict[str, Any]) -> None:
        given = said.get("params", {})
        if said["method"] == "Network.requestWillBeSent":
            self.requests.append(given["request"]["url"])
        elif said["method"] == "Network.webSocketCreated":
            self.requests.append(given["url"])
        elif said["method"] == "Runtime.exceptionThrown":
            self.errors.append(json.dumps(given["exceptionDetails"])[:400])
        elif said["method"] == "Log.entryAdded" and given["entry"]["level"] == "error":
            self.errors.append(given["entry"]["text"])

    def size(self, width: int, height: int, scale: float = 1.0, mobile: bool = False) -> None:
        given = {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": mobile}
        self.call("Emulation.setDeviceMetricsOverride", **given)

    def open(self, url: str) -> None:
        self.call("Page.navigate", url=url)

    def says(self, expression: str) -> Any:
        done = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in done:
            raise RuntimeError(json.dumps(done["exceptionDetails"])[:400])
        return done["result"].get("value")

    def until(self, expression: str, seconds: float = 15.0) -> None:
        end = time.monotonic() + seconds
        while not self.says(f"Boolean({expression})"):
            if time.monotonic() > end:
                raise TimeoutError(f"never came: {expression}; {self.errors}")
            time.sleep(0.05)

    def key(self, key: str, code: int, text: str = "") -> None:
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=code,
                      **({"text": text} if text and kind == "keyDown" else {}))  # fmt: skip

    def picture(self, path: Path, whole: bool = False) -> None:
        data = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)["data"]
        path.write_bytes(base64.b64decode(data))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()
        os.killpg(self._process.pid, signal.SIGKILL)  # the installed program may be a script around the browser
        self._process.wait(10)
        if self._process.stderr:
            self._process.stderr.close()

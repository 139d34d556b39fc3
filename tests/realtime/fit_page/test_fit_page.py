"""The page as it is served: who is let in, who is dropped, what is said when the fit has ended."""

from __future__ import annotations

import json
import math
import os
import pty
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fastapi")
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from fetched import get
from seatrial.cli.app import main
from seatrial.core.parameters import Free
from seatrial.data.trialfile import write_trial
from seatrial.identify import Problem
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.realtime import pages
from seatrial.realtime.fit_page.board import DONE, STATIC, Board, Tracker
from seatrial.realtime.pages import SHARED
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

SHIP = load("kvlcc2_l7")
RUN = simulate(SHIP, Zigzag(10.42, 0.35, 0.35), dt=0.5, duration=120.0, name="zigzag_20_20")
PROBLEM = Problem(SHIP, (RUN,), (Free("rudder.t_R", 0.5, 0.1, 0.9),))
STUDY = """
schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "."
train = ["zigzag*.csv"]
[free]
"hull.Y_v" = { prior = 0.3 }
[estimator]
type = "shooting:Trajectory"
window = 30.0
iterations = 3
"""


class Served:
    """A board on a page of its own."""

    def __init__(self) -> None:
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.port = self.listening.getsockname()[1]
        self.board = Board("a run")
        self.page = ExitStack()
        self.page.enter_context(pages.Watched(self.board, STATIC, self.listening))
        self.page.enter_context(Tracker(self.board))

    def line(self, origin: str | None = None) -> ClientConnection:
        given = None if origin is None else Origin(origin)
        return connect(f"ws://127.0.0.1:{self.port}/line", proxy=None, origin=given, close_timeout=0.5)

    def get(self, path: str, host: str = "localhost") -> tuple[int, dict[str, str], str]:
        return get(self.port, path, host)


@pytest.fixture
def served() -> Iterator[Served]:
    made = Served()
    yield made
    made.page.close()
    made.listening.close()


@pytest.fixture
def study(tmp_path: Path) -> Path:
    write_trial(RUN, tmp_path / "zigzag_20_20.csv")
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def hear(ws: ClientConnection, key: str, seconds: float = 10.0) -> dict[str, Any]:
    """The next message that has this key; all are said to be read."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        said = json.loads(ws.recv(timeout=seconds))
        with suppress(ConnectionClosed):  # after the last one
            ws.send(json.dumps({"read": said["n"]}))
        if said.get(key):
            return said
    raise TimeoutError(key)


@pytest.mark.slow
def test_every_file_is_there_and_nothing_comes_from_elsewhere(served: Served) -> None:
    for folder, files in ((STATIC, "/"), (SHARED, "/shared/")):
        for path in folder.iterdir():
            status, headers, body = served.get(f"{files}{path.name}")
            assert status == 200
            assert "default-src 'self'" in headers["content-security-policy"]
            assert body == path.read_text(encoding="utf-8")
            assert not re.findall(r"https?://", body), path.name
            assert len(body.splitlines()) <= 300
    assert served.get("/../board.py")[0] == 404
    assert served.get("/", host="evil.example")[0] == 400
    with pytest.raises(InvalidStatus, match="403"):
        served.line("http://evil.example")


@pytest.mark.slow
def test_a_running_fit_a_reload_and_the_last_state(served: Served) -> None:
    part = served.board.begin("fit", PROBLEM, 60.0)
    for k in range(1, 4):
        part.at(lambda: SHIP)
        part(k, 10.0 / k, math.nan)
    with served.line() as first:
        news = hear(first, "part")
        assert news["part"]["measured"][0]["name"] == "zigzag_20_20"
        assert [row[0] for row in news["rows"]] == [1, 2, 3]
        assert len(news["values"]) == 1
        part(4, 2.0, 0.5)
        assert [row[:3] for row in hear(first, "rows")["rows"]] == [[4, 2.0, 0.5]]
        assert hear(first, "tracks")["tracks"]["predicted"][0]["track"]
    with served.line() as again:
        assert [row[0] for row in hear(again, "part")["rows"]] == [1, 2, 3, 4]
        served.board.end(DONE, "converged")
        served.page.close()
        last = hear(again, "over")
        assert (last["state"], last["text"]) == ("done", "converged")
        with pytest.raises(ConnectionClosed):
            again.recv(timeout=5)


@pytest.mark.slow
def test_who_stops_reading_is_dropped_and_the_fit_does_not_wait(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pages, "_BEHIND", 8)
    monkeypatch.setattr(pages, "_PERIOD", 0.02)
    part, row = served.board.begin("fit", PROBLEM, None), 0
    end, gone = time.monotonic() + 15.0, False
    with served.line() as deaf, served.line() as good:
        while time.monotonic() < end and not gone:
            row += 1
            part(row, 1.0 / row, math.nan)  # never returns if it waits for the deaf one
            hear(good, "last")
            try:
                deaf.recv(timeout=0.001)  # read, and never say so
            except TimeoutError:
                pass
            except ConnectionClosed:
                gone = True
        hear(good, "last")
    assert gone


@pytest.mark.slow
def test_junk_and_floods_drop_their_sender_alone(served: Served) -> None:
    served.board.begin("fit", PROBLEM, None)(1, 1.0, math.nan)
    with served.line() as good, served.line() as giant:
        for junk in ("[", "[1]", '"x"', "{}", '{"read":"x"}', '{"read":1e400}', "[" * 1900):
            good.send(junk)
        giant.send("x" * 100_000)
        to_the_end(giant)
        assert hear(good, "last")["last"][1] == 1.0


def to_the_end(ws: ClientConnection) -> None:
    """Until the other side hangs up; a TimeoutError where it never does."""
    with suppress(ConnectionClosed):
        while True:
            ws.recv(timeout=5)


def wrong(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["identify", *arguments]) == 2
    said = capsys.readouterr().err.strip()
    assert "\n" not in said
    return said


def test_wrong_requests_are_told_before_anything_is_done(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "run"
    asked = str(study), "-o", str(out), "--page"
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert f"port {port} of 127.0.0.1" in wrong(capsys, *asked, "--port", port)
    assert "--port is 70000" in wrong(capsys, *asked, "--port", "70000")
    assert "add --page" in wrong(capsys, *asked[:-1], "--port", "8021")
    for name in [n for n in sys.modules if n.startswith("seatrial.realtime.pages")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "uvicorn", None)
    assert "--page needs uvicorn; pip install 'seatrial[web]'" in wrong(capsys, *asked, "--port", "0")
    assert not out.exists()


@pytest.mark.long
def test_without_a_terminal_the_page_ends_with_the_fit(
    study: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ["identify", str(study), "-o", str(tmp_path / "run"), "--json"]
    assert main([*asked, "--page", "--port", "0"]) == 0
    said = capsys.readouterr()
    assert re.search(r"^page: http://127\.0\.0\.1:\d+/$", said.err, re.MULTILINE)
    with_page = json.loads(said.out)["parameters"]
    asked[3] = str(tmp_path / "other")
    assert main(asked) == 0
    assert json.loads(capsys.readouterr().out)["parameters"] == with_page
    assert main([*asked, "--page", "--port", "0"]) == 0
    said = capsys.readouterr().err
    assert "done already" in said
    assert "page:" not in said


@pytest.mark.long
@pytest.mark.parametrize("bad", [False, True], ids=["good", "failing"])
def test_at_a_terminal_the_last_state_stays_until_ctrl_c(study: Path, tmp_path: Path, bad: bool) -> None:
    if bad:
        study.write_text(STUDY.replace('{ prior = 0.3 }', '{ start = 1e9, sigma = 1.0, prior = 1e9 }'))
    mine, its = pty.openpty()
    command = [sys.executable, "-m", "seatrial", "identify", str(study), "-o", str(tmp_path / "run")]
    running = subprocess.Popen([*command, "--page", "--port", "0"], stderr=its, stdout=subprocess.DEVNULL)
    os.close(its)
    said, end = b"", time.monotonic() + 60.0
    while b"stays until Ctrl-C" not in said and time.monotonic() < end:
        try:
            said += os.read(mine, 4096)
        except OSError:  # it has ended
            break
    if bad:
        assert running.wait(20) in (1, 2)
    else:
        assert (tmp_path / "run" / "report.html").exists()
        found = re.search(rb"127\.0\.0\.1:(\d+)", said)
        assert found
        with connect(f"ws://127.0.0.1:{found[1].decode()}/line", proxy=None) as ws:
            news = hear(ws, "part")
            assert news["state"] == "done"
            assert len(news["rows"]) >= 1
        running.send_signal(signal.SIGINT)
        assert running.wait(20) == 0
    os.close(mine)

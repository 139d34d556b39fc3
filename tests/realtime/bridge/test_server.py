"""The page as it is served: what it is made of, who is let in, who is dropped."""

from __future__ import annotations

import math
import re
import signal
import socket
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

pytest.importorskip("fastapi")
from bridges import Running, ask, hear, read_to_the_end
from websockets.exceptions import ConnectionClosed, InvalidStatus

from seatrial.cli.app import main
from seatrial.data.trialfile import read_trial
from seatrial.realtime.bridge.deck import Deck, Outfit
from seatrial.realtime.bridge.server import STATIC, application
from seatrial.realtime.bridge.view import OWN
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Plant
from seatrial.ships.files import load

pytestmark = pytest.mark.slow


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Running]:
    made = Running(tmp_path, "--hold", "1")
    yield made
    made.close()


def test_every_file_of_the_page_is_there_and_nothing_comes_from_elsewhere(running: Running) -> None:
    for path in STATIC.iterdir():
        status, headers, body = running.get(f"/{path.name}")
        assert status == 200
        assert "default-src 'self'" in headers["content-security-policy"]
        text = path.read_text(encoding="utf-8")
        assert body == text
        assert not re.findall(r"https?://", text), path.name
        assert len(text.splitlines()) <= 300
    assert running.get("/")[2] == running.get("/index.html")[2]
    assert running.get("/docs")[0] == 404
    assert running.get("/../server.py")[0] == 404
    assert running.get("/%2e%2e/server.py")[0] == 404
    # a page under a foreign name, or a socket from elsewhere, is turned away
    assert running.get("/", host="evil.example")[0] == 400
    with pytest.raises(InvalidStatus, match="403"):
        running.raw(origin="http://evil.example")


def test_pages_make_elements_and_never_text_that_is_read_as_html() -> None:
    folders = STATIC, STATIC.parents[1] / "static", STATIC.parents[1] / "fit_page" / "static"
    for path in (path for folder in folders for path in folder.glob("*.js")):
        found = re.findall(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|DOMParser", path.read_text())
        assert not found, path.name


@pytest.mark.long
def test_twenty_pictures_a_second_a_reload_and_a_hand_over(running: Running) -> None:
    first = running.line("a" * 16)
    assert hear(first, "hello")["hello"] == "Bridge 1"
    ask(first, do="order", name="delta", value=0.3)
    t, began = hear(first, "t")["t"], time.monotonic()
    frames = [hear(first, "t") for _ in range(40)]
    assert 1.5 < time.monotonic() - began < 3.5
    assert 1.5 < frames[-1]["t"] - t < 3.5
    assert frames[-1]["own"][2] > 0.0
    first.close()
    again = running.line("a" * 16)
    hello = hear(again, "hello")
    assert hello["hello"] == "Bridge 1"
    assert hello["trail"]
    frame = hear(again, "t")
    assert frame["t"] > frames[-1]["t"]
    assert frame["command"][0] == "Bridge 1"
    assert frame["ord"]["delta"] == pytest.approx(0.3)

    second = running.line("b" * 16)
    assert hear(second, "hello")["hello"] == "Bridge 2"
    ask(second, do="order", name="delta", value=0.0)
    assert "Bridge 1 has command" in hear(second, "note")["note"]
    ask(again, do="beat")
    ask(second, do="take")
    assert "asked" in hear(second, "note")["note"]
    ask(again, do="give")
    time.sleep(0.3)
    ask(second, do="order", name="delta", value=-0.1)
    time.sleep(0.5)
    ask(second, do="beat")
    while (frame := hear(second, "t"))["ord"]["delta"] > 0.0:
        pass
    assert frame["command"][0] == "Bridge 2"
    time.sleep(1.5)  # and now silence
    while not (frame := hear(again, "t"))["command"][2]:
        pass
    ask(again, do="take")
    while (frame := hear(again, "t"))["command"][0] != "Bridge 1":
        pass
    for ws in (again, second):
        ws.close()


@pytest.mark.long
def test_nonsense_floods_and_giants_drop_their_sender_alone(running: Running) -> None:
    good = running.line("g" * 16)
    hear(good, "t")
    nan = '{"do":"order","name":"delta","value":NaN}'
    for junk in ("[", "[1]", '"x"', "{}", '{"do":{}}', '{"read":"x"}', "[" * 1900, nan):
        good.send(junk)
    hear(good, "note")
    giant = running.line("h" * 16)
    hear(giant, "hello")
    giant.send("x" * 100_000)
    flood = running.line("i" * 16)
    hear(flood, "hello")
    with suppress(ConnectionClosed):
        for _ in range(2000):
            flood.send('{"do":"beat"}')
    for ws in (giant, flood):
        read_to_the_end(ws)
    nobody = running.raw()
    nobody.send('{"hello": 3}')
    with pytest.raises(ConnectionClosed):
        nobody.recv(timeout=5)
    t = hear(good, "t")["t"]
    for _ in range(20):
        frame = hear(good, "t")
    assert frame["t"] > t
    assert frame["command"][0] == "Bridge 1"
    good.close()


@pytest.mark.long
def test_who_stops_reading_is_dropped_and_the_rest_goes_on(running: Running) -> None:
    good, deaf = running.line("g" * 16), running.line("d" * 16)
    end, gone = time.monotonic() + 20.0, False
    while time.monotonic() < end and not gone:
        frame = hear(good, "n")
        ask(good, do="beat", read=frame["n"])
        gone = frame["n"] > 100 and frame["command"][3] == ["Bridge 1"]
    assert gone
    read_to_the_end(deaf)
    good.close()


@pytest.mark.long
def test_killed_in_mid_run_the_recording_is_a_trial(running: Running, tmp_path: Path) -> None:
    ws = running.line("a" * 16)
    hear(ws, "t")
    ask(ws, do="record")
    while not (record := hear(ws, "t")["record"]) or record[1] < 10:
        pass
    running.process.send_signal(signal.SIGKILL)
    running.process.wait(10)
    (path,) = tmp_path.glob("*.csv")
    assert len(read_trial(path)) >= 10


def test_no_two_browsers_are_ever_called_the_same() -> None:
    deck = Deck(Loop({OWN: Plant.of(load("kvlcc2_l7"), dt=0.05)}, 20.0, math.inf), Outfit())
    line = application(deck).state.line
    first = line.name("first")
    deck.command.come(first, 0.0)
    names = [line.name(f"token {k}") for k in range(1000)]
    assert len({first, *names}) == 1001
    assert line.name("first") == first  # who has command is known whatever else comes
    assert line.name("token 999") == names[-1]


def test_a_port_in_use_and_addresses_beyond_this_machine(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        for arguments, words in (
            (("--port", port), f"port {port} of 127.0.0.1: Address already in use; choose another with --port"),
            (("--host", "0.0.0.0"), "beyond this machine; allow that with --anywhere"),
            (("--host", "here"), "write an IPv4 address"),
            (("--port", "70000"), "1 to 65535"),
            (("--port", "0", "-o", str(tmp_path / "none")), "no such folder"),
            (("--port", "0", "-o", __file__), "test_server.py: a file; recordings go into a folder"),
            (("--port", "0", "--factor", "nan"), "time factor nan"),
            (("--port", "0", "--other", "kcs@1,2"), "write SHIP@NORTH,EAST,HEADING"),
            (("--port", "0", "--factor", "1000"), "time factor 1000"),
            (("--port", "0", "--speed", "1e9"), "--speed is 1e+09 m/s; kvlcc2_l7 goes 1.179 m/s"),
            (("--port", "0", "--other", "kcs@0,0,0,1e9"), "--other kcs: speed is 1e+09 m/s"),
            (("--port", "0", "--ghost", str(tmp_path / "none.csv")), "none.csv"),
        ):
            assert main(["bridge", "kvlcc2_l7", *arguments]) == 2
            said = capsys.readouterr().err.strip()
            assert words in said
            assert "\n" not in said

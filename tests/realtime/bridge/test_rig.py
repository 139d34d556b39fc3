"""Page and wire on one loop: a bridge with a scenario, asked from a browser's socket and from the wire."""

from __future__ import annotations

import json
import re
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from bridges import Running, hear

from seatrial.cli.app import main

pytestmark = pytest.mark.slow

pytest.importorskip("fastapi")

SCENARIO = """schema = "seatrial-scenario/1"
duration = 600.0
place = [35.0, 139.7]
[own]
ship = "kvlcc2_l7"
route = [[500.0, 0.0]]
[traffic.other]
length = 10.0
speed = 1.0
at = [100.0, 5.0]
heading = 180.0
[[faults]]
kind = "jammed"
of = "delta"
label = "Jam"
[alarms]
cpa = 20.0
tcpa = 120.0
"""


def order(degrees: float) -> bytes:
    body, total = f"AGHTC,V,,,H,N,,,,,{degrees:.1f},,,T,C", 0
    for byte in body.encode():
        total ^= byte
    return f"${body}*{total:02X}\r\n".encode()


class Rig(Running):
    """A bridge with a scenario and a wire."""

    def __init__(self, folder: Path) -> None:
        path = folder / "scenario.toml"
        path.write_text(SCENARIO)
        super().__init__(folder, "--scenario", str(path), "--nmea", "udp://127.0.0.1:0", "--factor", "10")
        said = self.process.stderr.readline() if self.process.stderr else ""
        found = re.search(r"udp://127\.0\.0\.1:(\d+)", said)
        assert found, said
        self.link = self.open.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        self.link.connect(("127.0.0.1", int(found[1])))
        self.link.settimeout(10.0)


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    made = Rig(tmp_path)
    yield made
    made.close()


def until(ws: Any, fits: Any, seconds: float = 20.0) -> dict[str, Any]:
    """The first picture of which something holds."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        picture = hear(ws, "own")
        if fits(picture):
            return picture
    raise TimeoutError("no such picture")


def test_the_wire_steers_until_the_mariner_takes_over(rig: Rig) -> None:
    ws = rig.line("one browser")
    assert hear(ws, "hello")["range"]["known"] == ["wire", "pilot", "page"]
    rig.link.send(order(30.0))
    picture = until(ws, lambda one: one["range"]["wire"][1] == "heading")
    assert picture["range"]["steers"] == "wire"
    assert any(line.startswith(b"$RATTM") for line in _lines(rig))
    ws.send(json.dumps({"do": "order", "name": "delta", "value": 0.1}))
    assert hear(ws, "note")["note"] == "the wire steers; take over first"
    ws.send(json.dumps({"do": "hand", "to": "page"}))
    ws.send(json.dumps({"do": "order", "name": "delta", "value": 0.1}))
    picture = until(ws, lambda one: abs(one["ord"]["delta"] - 0.1) < 1e-6)
    assert picture["range"]["steers"] == "page"
    rig.link.send(order(90.0))
    time.sleep(0.3)
    assert abs(hear(ws, "own")["ord"]["delta"] - 0.1) < 1e-6


def test_alarms_and_faults_are_on_the_page(rig: Rig) -> None:
    ws = rig.line("one browser")
    assert hear(ws, "hello")["range"]["faults"] == ["Jam"]
    picture = until(ws, lambda one: one["range"]["alarms"])
    identifier, instance, priority, state, text, _ = picture["range"]["alarms"][0]
    assert (identifier, priority, state, text) == (10001, "A", "V", "CPA 01 other")
    ws.send(json.dumps({"do": "acknowledge", "identifier": identifier, "instance": instance}))
    until(ws, lambda one: [row[3] for row in one["range"]["alarms"]] != ["V"])
    ws.send(json.dumps({"do": "fault", "number": 0, "on": True}))
    until(ws, lambda one: one["range"]["faults"] == [True])
    assert hear(ws, "own")["range"]["contacts"][0][0] == "other"


def _lines(rig: Rig) -> list[bytes]:
    """What comes over the wire within some datagrams."""
    return [line for _ in range(60) for line in rig.link.recv(2048).splitlines()]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["--scenario", "none.toml"], "none.toml"), (["--scenario", "S", "--ghost", "x.csv"], "--ghost"),
        (["--only", "HDT"], "give --nmea"), (["--scenario", "S", "--speed", "99"], "--speed is 99 m/s"),
        (["--scenario", "S", "--to", "udp://127.0.0.1:1"], "give --nmea"), (["--nmea", "tcp://x:1"], "not an IPv4"),
    ],
)  # fmt: skip
def test_wrong_rigs_are_refused(tmp_path: Path, capsys: Any, given: list[str], message: str) -> None:
    path = tmp_path / "s.toml"
    path.write_text(SCENARIO)
    arguments = [str(path) if one == "S" else one for one in given]
    assert main(["bridge", "kvlcc2_l7", "--port", "0", "-o", str(tmp_path), *arguments]) == 2
    assert message in capsys.readouterr().err

"""The loop closed through the wire: an autopilot in a process of its own, which speaks only NMEA, steers a ship."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from seatrial.data.geodesy import Datum
from seatrial.data.nmea.ship import Fittings
from seatrial.environment import Uniform
from seatrial.realtime.loop import Loop
from seatrial.realtime.on_wire import OnWire, Speech
from seatrial.realtime.plant import Plant
from seatrial.realtime.wire import Address, Wire
from seatrial.ships.files import load

ROOT = Path(__file__).parents[2]
AUTOPILOT = ROOT / "examples" / "autopilot_nmea.py"
DATUM = Datum(35.0, 139.5)
FACTOR = 50.0
WEATHER = {
    "calm": Uniform(), "wind": Uniform(U_T=12.0, gamma_T=math.radians(270.0)),
    "current": Uniform(U_C=0.8, gamma_C=math.radians(90.0)),
}  # fmt: skip
CORNER = math.radians(60.0)
LEGS = [(0.0, 0.0), (4000.0, 0.0), (4000.0 + 5000.0 * math.cos(CORNER), 5000.0 * math.sin(CORNER))]

pytestmark = pytest.mark.long
pytest.importorskip("pynmeagps")


def sail(weather: Uniform, *task: str) -> tuple[dict, np.ndarray, OnWire]:
    """Let the autopilot do its task; what it says of it, and x, y, psi, delta of the ship [per second]."""
    ship = load("kvlcc2")
    plant = Plant.of(ship, dt=0.1, environment=weather)
    loop, wire = Loop({"s": plant}, 2.0, FACTOR), Wire(Address("udp", "127.0.0.1", 0))
    on = OnWire(loop, "s", wire, Speech(Fittings(DATUM)))
    rows: list[list[float]] = []
    loop.after(lambda loop: rows.append([plant[n] for n in ("x", "y", "psi", "delta")]))
    sailing = threading.Thread(target=loop.run)
    sailing.start()
    try:
        command = [sys.executable, str(AUTOPILOT), f"127.0.0.1:{wire.address.port}", "--length", "320", *task]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    finally:
        loop.stop()
        sailing.join()
        wire.close()
    assert done.returncode == 0, done.stderr
    assert loop.report.events.get("dropped", 0) == 0
    return json.loads(done.stdout), np.array(rows), on


@pytest.mark.parametrize("by", ["rudder", "heading"])
@pytest.mark.parametrize("weather", WEATHER)
def test_course_change_of_20_degrees(weather, by):
    told, rows, on = sail(WEATHER[weather], "--course", "20", "--by", by, "--duration", "1500")
    assert told["arrived"]
    assert told["heading"] == pytest.approx(20.0, abs=0.6)
    assert on.conning.mode == by
    assert on.conning.counts["refused"] == on.conning.counts["unfit"] == 0
    heading = np.degrees(rows[:, 2])
    assert heading.max() < 20.0 + 8.0
    assert heading.min() > -3.0
    assert np.degrees(np.abs(rows[:, 3])).max() <= 35.0


@pytest.mark.parametrize("weather", WEATHER)
def test_track_with_a_turn(weather):
    points = [f"{latitude:.6f},{longitude:.6f}" for latitude, longitude in (DATUM.place(*point) for point in LEGS)]
    told, rows, _ = sail(WEATHER[weather], "--track", *points, "--duration", "2000")
    assert told["arrived"]
    assert told["leg"] == 1
    x, y = rows[:, 0], rows[:, 1]
    start = LEGS[1]
    across = (y - start[1]) * math.cos(CORNER) - (x - start[0]) * math.sin(CORNER)
    along = (x - start[0]) * math.cos(CORNER) + (y - start[1]) * math.sin(CORNER)
    last = (along > 3500.0) & (along < 5000.0)
    assert last.any()
    assert np.abs(across[last]).max() < 0.25 * 320.0
    first = (x > 0.0) & (x < 3000.0) & (along < -100.0)
    assert np.abs(y[first]).max() < 0.4 * 320.0  # in a current that the ship is put into without drift

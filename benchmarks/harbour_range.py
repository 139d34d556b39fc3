"""A harbour at 20 Hz: ten ships on one chart with forty fenders, two of them moored by six lines each.

    python benchmarks/harbour_range.py [SECONDS] [-o results/harbour_range.json]

Ships under way keep their course past the quays, two lie alongside under gusts off the quay.  Processor time over
simulated time is the share of a core at real time, everything of the loop included.
"""

from __future__ import annotations

import argparse
import json
import math
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from seatrial.environment import Uniform
from seatrial.environment.chart import Chart
from seatrial.environment.geojson import load_chart
from seatrial.environment.weather import Gust
from seatrial.harbour.contact import Line
from seatrial.manoeuvres.track import Leg
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import plant_of
from seatrial.realtime.range.pilots import TrafficPilot
from seatrial.ships.files import load
from seatrial.simulate.place import place_of

RATE, SPACING, FENDERS = 20.0, 20.0, 20
FENDER = {"curve": "cone", "height": 2.0, "reaction": 2.6e6, "spacing": SPACING, "mu": 0.2, "chi": 5.0}
MOORED = (250.0, 1250.0)
# Midship lies by half the beam and the height of a fender off the quay at east 0.
OFF = -31.0


def chart() -> Chart:
    """Two quays of twenty fenders each, in line, and a depth all over."""
    def quay(north: float) -> dict[str, Any]:
        ends = [[0.0, north + SPACING * FENDERS], [0.0, north]]
        return {"type": "Feature", "properties": {"kind": "quay", "fender": FENDER},
                "geometry": {"type": "LineString", "coordinates": ends}}  # fmt: skip

    said = {"type": "FeatureCollection", "schema": "seatrial-chart/1", "name": "harbour", "frame": "metres",
            "depth": 30.0, "source": "made for a benchmark", "features": [quay(50.0), quay(1050.0)]}  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "harbour.geojson")
        path.write_text(json.dumps(said), encoding="utf-8")
        return load_chart(path)


def lines(north: float) -> tuple[Line, ...]:
    """Head, breast and stern lines and two springs of a ship alongside, and one more breast line."""
    leads = ((150.0, 60.0), (140.0, 10.0), (120.0, -60.0), (-120.0, 60.0), (-140.0, -10.0), (-150.0, -60.0))
    found: list[Line] = []
    for a, ahead in leads:
        bollard, lead = (north + a + ahead, 2.0), (north + a, OFF + 25.0)
        length = math.hypot(bollard[0] - lead[0], bollard[1] - lead[1])
        found.append(Line(*bollard, a, 25.0, 0.99 * length, 2.0e7))
    return tuple(found)


def main() -> None:
    """Sail and measure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=300.0)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args()
    ship, water, ships = load("kvlcc2_harbour"), chart(), {}
    wind = Gust(Uniform(U_T=12.0, gamma_T=math.radians(90.0)), spectrum="davenport", seed=3)
    for k, north in enumerate(MOORED):
        place = place_of(ship, water, lines=lines(north))
        ships[f"moored {k + 1}"] = plant_of(ship, RATE, wind, (north, OFF, 0.0, 0.0, 0.0, 0.0), 1, True, place)
    open_water = place_of(ship, water)
    for k in range(10 - len(MOORED)):
        course = 0.0 if k % 2 else math.pi
        start = (-2000.0 + 450.0 * k, -400.0 - 250.0 * (k % 4), course, 3.0, 0.0, 0.0)
        ships[f"under way {k + 1}"] = plant_of(ship, RATE, wind, start, 1, True, open_water)
    loop = Loop(ships, RATE, math.inf)
    for name in ships:
        if name.startswith("under way"):
            plant = ships[name]
            TrafficPilot(loop, name, [Leg(plant["x"], plant["y"], plant["psi"], math.inf)])
    for _ in range(20):
        loop.step()
    begun, ticks, tracks = time.process_time(), round(given.seconds * RATE), []
    for k in range(ticks):
        loop.step()
        if k % 20 == 0:
            tracks.append([[plant["x"], plant["y"]] for plant in ships.values()])
    spent = time.process_time() - begun
    moved = np.ptp(np.array(tracks)[:, : len(MOORED)], axis=0)
    failed = [name for name, vessel in loop.vessels.items() if vessel.failure]
    result = {"ships": len(ships), "fenders": 2 * FENDERS, "lines": 6 * len(MOORED), "rate": RATE,
              "seconds": given.seconds, "share_of_a_core": round(spent / given.seconds, 4), "failed": failed,
              "moored_moved_m": np.round(moved, 3).tolist()}  # fmt: skip
    print(json.dumps(result, indent=1))
    if given.out:
        given.out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

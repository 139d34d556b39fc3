"""A campaign of 10 000 zigzags of ships with random parameters, against shipmmg's zigzag one by one."""

from __future__ import annotations

import math
import time

from timing import best, publish

from seatrial.bench import shipmmg
from seatrial.bench.shipmmg import SHIPS


def main() -> None:
    """Measure and publish."""
    begun = time.perf_counter()
    vary = shipmmg.random_ships()
    even = shipmmg.even_zigzag(vary)
    usual = best(lambda: shipmmg.our_zigzag(vary, "rk4", 0.1, 10), 2.0, 3)
    failed = len(shipmmg.our_zigzag(vary, even.method, even.dt, round(1.0 / even.dt)).failures)
    rows = [
        ("greatest heading error of shipmmg at its default settings", math.degrees(even.error), "deg", "-"),
        (f"our quickest way with no larger error: {even.method}, step", even.dt, "s", "-"),
        ("its heading error", math.degrees(even.own), "deg", "-"),
        ("10 000 random ships, each a 20/20 zigzag of 80 s, in one kernel", even.ours * SHIPS, "s", "-"),
        ("per ship", 1e6 * even.ours, "us", "-"),
        ("ships that failed", float(failed), "-", "-"),
        ("shipmmg 0.0.11, one zigzag at its default settings", 1e3 * even.theirs, "ms", "-"),
        ("shipmmg over ours, per ship", even.theirs / even.ours, "x", ">= 1000"),
        ("the same with RK4 and steps of 0.1 s", even.theirs * SHIPS / usual, "x", "-"),
    ]
    publish("campaign", [dict(zip(("what", "value", "unit", "bar"), r, strict=True)) for r in rows])
    print(f"{time.perf_counter() - begun:.0f} s in all")


if __name__ == "__main__":
    main()

"""Zigzags of ships with random parameters: in one kernel, against shipmmg's one by one, and a million to Parquet."""

from __future__ import annotations

import math
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from timing import best, publish

from seatrial.bench import shipmmg, turn
from seatrial.bench.shipmmg import ANGLE, RANDOM, SECONDS, SHIPS
from seatrial.campaign import CHUNK, Campaign, Case
from seatrial.campaign.chunk import ready
from seatrial.campaign.folder import begin, write_part
from seatrial.campaign.inputs import Input
from seatrial.campaign.running import run
from seatrial.core import executors
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.simulate.lanes import prepare

MILLION, CORES, TRIES = 1_000_000, 2, 7


def million() -> list[tuple[str, float, str, str]]:
    """A million zigzags with their indices to Parquet; CPU time a run beside the same loop without indices."""
    ship = turn.ship()
    case = Case("zigzag", ship, Zigzag(turn.N_P, ANGLE, ANGLE), ship.speed, SECONDS, 0.1, "euler")
    inputs = {name: Input("uniform", (0.9, 1.1), factor=True) for name in RANDOM}
    plan = Campaign("random ships", (case,), MILLION, inputs)
    runs = ready(plan, 0, 0, CHUNK)

    def bare() -> None:
        loop = prepare(ship, case.manoeuvre, case.dt, runs.vary, runs.start, runs.around, CHUNK)
        loop.simulator.stored(
            loop.state, loop.series, loop.shared, memory0=loop.memory, lanewise=loop.lanewise, dt=case.dt,
            steps=runs.steps, every=runs.steps - 1, method=case.method, threads=1,
        )  # fmt: skip

    with tempfile.TemporaryDirectory() as there:
        parts = Path(there) / "parts"
        begin(plan, parts)
        alone, whole = _processor(bare), _processor(lambda: write_part(plan, parts, 0))
        began, spent = time.perf_counter(), time.process_time()
        with executors.threads(CORES) as pool:
            run(plan, Path(there) / "run", pool=pool)
        took, spent = time.perf_counter() - began, time.process_time() - spent
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return [
        ("1 000 000 zigzags with indices to Parquet, two threads", took, "s", "<= 20"),
        ("the same, processor time of two cores", spent / CORES, "s", "<= 20"),
        ("most memory of the process", memory, "GB", "<= 1"),
        ("processor time a run, with indices and Parquet", 1e6 * whole / CHUNK, "us", "-"),
        ("the same loop without indices", 1e6 * alone / CHUNK, "us", "-"),
        ("rate of the former over that of the latter", alone / whole, "-", ">= 0.85"),
    ]


def _processor(work: Callable[[], object]) -> float:
    """Least processor time of some calls [s]: other processes do not count."""
    work()
    times: list[float] = []
    for _ in range(TRIES):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return min(times)


def main() -> None:
    """Measure and publish."""
    begun = time.perf_counter()
    large = million()
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
    publish("campaign", [dict(zip(("what", "value", "unit", "bar"), r, strict=True)) for r in [*rows, *large]])
    print(f"{time.perf_counter() - begun:.0f} s in all")


if __name__ == "__main__":
    main()

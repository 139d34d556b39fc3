"""Zigzags of ships with random parameters: in one kernel against shipmmg's, a million to Parquet, tracks, a cluster.

    python benchmarks/campaign.py [--only peer|million|tracks|cluster ...]

Processor times and ratios within one run of this script hold on a busy machine; what is compared takes turns.
"""

from __future__ import annotations

import argparse
import math
import resource
import tempfile
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

from timing import best, publish

from seatrial.bench import shipmmg, turn
from seatrial.bench.shipmmg import ANGLE, RANDOM, SECONDS, SHIPS
from seatrial.campaign import CHUNK, Campaign, Case, Tracks, usual_chunk
from seatrial.campaign.chunk import ready
from seatrial.campaign.folder import begin, write_part
from seatrial.campaign.inputs import Input
from seatrial.campaign.running import run
from seatrial.core import executors
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.simulate import lanes
from seatrial.simulate.lanes import Steps, steered

MILLION, CORES, TRIES = 1_000_000, 2, 15
TRACKED, LONG, FEW, EVERY = 200_000, 384.0, 10_000, 10
CLUSTERED, TURNS, WARM = 1_000_000, 3, 40_000

Row = tuple[str, float, str, str]


def zigzags(runs: int, seconds: float = SECONDS, method: str = "euler", tracks: Tracks | None = None) -> Campaign:
    """Zigzags of ships that differ in all coefficients of the hull."""
    ship = turn.ship()
    case = Case("zigzag", ship, Zigzag(turn.N_P, ANGLE, ANGLE), ship.speed, seconds, 0.1, method)
    inputs = {name: Input("uniform", (0.9, 1.1), factor=True) for name in RANDOM}
    return Campaign("random ships", (case,), runs, inputs, chunk=usual_chunk((case,), tracks), tracks=tracks)


def peer() -> list[Row]:
    """Ten thousand zigzags in one kernel against shipmmg's one by one; nothing where that is not installed."""
    try:
        shipmmg.theirs()
    except ImportError as error:
        print(f"left out: {error}; pip install shipmmg")
        return []
    vary = shipmmg.random_ships()
    even = shipmmg.even_zigzag(vary)
    usual = best(lambda: shipmmg.our_zigzag(vary, "rk4", 0.1, 10), 2.0, 3)
    failed = len(shipmmg.our_zigzag(vary, even.method, even.dt, round(1.0 / even.dt)).failures)
    return [
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


def million() -> list[Row]:
    """A million zigzags with their indices to Parquet; CPU time a run beside the same loop without indices."""
    plan = zigzags(MILLION)
    (case,), runs = plan.cases, ready(plan, 0, 0, CHUNK)

    def bare() -> None:
        loop = steered(case.ship, case.manoeuvre, case.dt, runs.vary, runs.start, runs.around, CHUNK)
        lanes.run(loop, Steps(case.dt, runs.steps, runs.steps - 1, case.method), None, threads=1)

    with tempfile.TemporaryDirectory() as there:
        parts = Path(there) / "parts"
        begin(plan, parts)
        alone, whole = by_turns(bare, lambda: write_part(plan, parts, 0))
        with executors.threads(CORES) as pool:
            took, spent = elapsed(lambda: run(plan, Path(there) / "run", pool=pool))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return [
        ("1 000 000 zigzags with indices to Parquet, two threads", took, "s", "<= 20"),
        ("the same, processor time of two cores", spent / CORES, "s", "<= 20"),
        ("most memory of the process", memory, "GB", "<= 1"),
        ("processor time a run, with indices and Parquet", 1e6 * whole / CHUNK, "us", "-"),
        ("the same loop without indices", 1e6 * alone / CHUNK, "us", "-"),
        ("rate of the former over that of the latter", alone / whole, "-", ">= 0.85"),
    ]


def tracks() -> list[Row]:
    """Ships of random parameters at 10 Hz by Runge-Kutta, every tenth sample kept; all samples of fewer ships."""
    found: list[Row] = []
    for ships, every in ((TRACKED, EVERY), (FEW, 1)):
        plan = zigzags(ships, LONG, "rk4", Tracks(every))
        with tempfile.TemporaryDirectory() as there, executors.threads(CORES) as pool:
            write_part(replace(plan, runs=1024, chunk=1024), Path(there) / "first", 0)
            out = Path(there) / "run"
            took, spent = elapsed(lambda plan=plan, out=out, pool=pool: run(plan, out, pool=pool))
            size = sum(path.stat().st_size for path in out.rglob("*.parquet"))
        many, what = TRACKED / ships, f"{ships} ships, 384 s at 10 Hz, every {every}. sample kept"
        found += [
            (f"{what}, two threads", took, "s", "<= 60" if many == 1 else "-"),
            (f"{what}: processor time of two cores", spent / CORES, "s", "<= 60" if many == 1 else "-"),
            (f"{what}: on the disk, x y psi u v_m r n_P delta", size / 1e9, "GB", "-"),
        ]
        if many > 1:
            scaled = f"200 000 ships with all samples, by {ships}"
            found += [(f"{scaled}: two threads", many * took, "s", "-"),
                      (f"{scaled}: processor time of two cores", many * spent / CORES, "s", "-"),
                      (f"{scaled}: on the disk", many * size / 1e9, "GB", "-")]  # fmt: skip
    return found


def cluster() -> list[Row]:
    """Zigzags by two worker processes of Dask and by two threads, in turns."""
    import psutil

    plan, few = zigzags(CLUSTERED), zigzags(WARM)
    pools: dict[str, Callable[[], AbstractContextManager[executors.Pool]]] = {
        "threads": lambda: executors.threads(CORES), "Dask": lambda: executors.dask(f"local:{CORES}")}  # fmt: skip
    took: dict[str, list[float]] = {name: [] for name in pools}
    spent: dict[str, list[float]] = {name: [] for name in pools}
    for _ in range(TURNS):
        for name, opened in pools.items():
            with tempfile.TemporaryDirectory() as there, opened() as pool:
                run(few, Path(there) / "few", pool=pool)  # kernels are loaded, workers have imported
                here = psutil.Process()
                all_of_us = [here, *here.children(recursive=True)]
                begun, spent_before = time.perf_counter(), processor(all_of_us)
                run(plan, Path(there) / "run", pool=pool)
                took[name].append(time.perf_counter() - begun)
                spent[name].append(processor(all_of_us) - spent_before)
    least, cpu = ({name: min(times) for name, times in of.items()} for of in (took, spent))
    return [
        (f"{CLUSTERED} zigzags by two worker processes of Dask", least["Dask"], "s", "-"),
        ("the same by two threads, in turns with these", least["threads"], "s", "-"),
        ("rate of Dask over that of threads, best of some turns", least["threads"] / least["Dask"], "-", ">= 0.9"),
        ("the same by processor time of all processes", cpu["threads"] / cpu["Dask"], "-", ">= 0.9"),
    ]


def processor(processes: list[object]) -> float:
    """Processor time of processes [s]."""
    return sum(sum(one.cpu_times()[:2]) for one in processes)  # type: ignore[attr-defined]


def elapsed(work: Callable[[], object]) -> tuple[float, float]:
    """Seconds by the clock, and of the processor."""
    began, spent = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - began, time.process_time() - spent


def by_turns(*works: Callable[[], object]) -> list[float]:
    """Least processor time of each [s]; they take turns, so that a busy neighbour slows all of them."""
    for work in works:
        work()
    times: list[list[float]] = [[] for _ in works]
    for _ in range(TRIES):
        for work, own in zip(works, times, strict=True):
            own.append(elapsed(work)[1])
    return [min(own) for own in times]


SECTIONS: dict[str, Callable[[], list[Row]]] = {
    "peer": peer, "million": million, "tracks": tracks, "cluster": cluster,
}  # fmt: skip


def main() -> None:
    """Measure and publish; rows that are not measured now stay as they were."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS))
    for name in parser.parse_args().only:
        begun = time.perf_counter()
        rows = SECTIONS[name]()
        publish("campaign", [dict(zip(("what", "value", "unit", "bar"), r, strict=True)) for r in rows], kept=True)
        print(f"{name}: {time.perf_counter() - begun:.0f} s")


if __name__ == "__main__":
    main()

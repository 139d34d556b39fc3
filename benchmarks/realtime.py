"""Real time: one step of one ship, a hundred ships together, a recording beside them."""

from __future__ import annotations

import math
import resource
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from timing import best, publish

from seatrial.data import Array
from seatrial.environment import CHANNELS, Uniform
from seatrial.environment.weather import Gust
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Compiled, Plant
from seatrial.realtime.recording import Recording
from seatrial.sensors.suite import Suite, usual
from seatrial.ships.files import load

STEPS, SHIPS, SECONDS = 100_000, 100, 10.0


def spent(job: Callable[[], None], clock: Callable[[], float] = time.perf_counter, steps: int = STEPS) -> Array:
    """Time of each call [microseconds], of the wall or of this thread's own processor."""
    found = np.empty(steps)
    for k in range(steps):
        start = clock()
        job()
        found[k] = clock() - start
    return 1e6 * found


def one_ship(plant: Plant, suite: Suite) -> Callable[[], None]:
    """A step with its instruments, and an order now and then."""
    watch = suite.start(1)

    def job() -> None:
        if plant.k % 50 == 0:
            plant.order("delta", 0.3 * math.sin(0.05 * plant.t))
        plant.step()
        watch.read(plant.t, plant)

    return job


def marshalled(compiled: Compiled) -> float:
    """The same step through the interface of whole runs, which packs its arrays each time [microseconds]."""
    simulator, ship = compiled.kernel.forward, compiled.ship
    system = simulator.system
    state, memory = np.array([[0.0, 0.0, 0.0, ship.speed, 0.0, 0.0]]), np.zeros((1, len(system.memory)))
    series, numbers = np.zeros((1, 1, len(CHANNELS) + 2)), np.ones(len(system.parameters))
    return 1e6 * best(lambda: simulator.run(state, series, numbers, memory0=memory, dt=0.01, steps=2, threads=1))


def together(compiled: Compiled, folder: Path | None) -> tuple[float, Any]:
    """A hundred ships at 10 Hz on the clock of the machine: share of a core [%], and the loop's report."""
    suite = usual(compiled.ship)
    loop = Loop([compiled.plant(seed=k) for k in range(SHIPS)], 10.0, sensors=suite)
    for name in loop.vessels:
        loop.order(name, "delta", 0.1)
        if folder is not None:
            loop.witness(name, Recording(loop.vessels[name].plant, folder / f"{name}.csv"))
    loop.run(1.0)
    before, start = time.process_time(), time.perf_counter()
    report = loop.run(SECONDS)
    return 100.0 * (time.process_time() - before) / (time.perf_counter() - start), report


def row(what: str, value: Any, unit: str, bar: str) -> dict[str, Any]:
    """One line of the table."""
    return {"what": what, "value": float(value), "unit": unit, "bar": bar}


def main() -> None:
    """Measure and publish."""
    ship = load("kvlcc2")
    compiled = Compiled.of(ship, 0.01)
    every_step = Suite(tuple(replace(instrument, rate=100.0) for instrument in usual(ship).instruments))
    bare, own, all_on = compiled.plant(), compiled.plant(), compiled.plant()
    plain = spent(bare.step)
    carried = spent(one_ship(own, usual(ship)))
    worst = spent(one_ship(all_on, every_step))
    own_time = spent(one_ship(own, usual(ship)), time.thread_time)
    gusty = one_ship(compiled.plant(environment=Gust(Uniform(U_T=8.0), seed=1)), usual(ship))
    in_gusts, in_gusts_own = spent(gusty), spent(gusty, time.thread_time)
    slow = Compiled.of(ship, 0.1)
    share, report = together(slow, None)
    with tempfile.TemporaryDirectory() as folder:
        recorded, _ = together(slow, Path(folder))
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    ready = 1e3 * best(lambda: Plant.of(ship, dt=0.01))
    rows = [
        row("step of one ship, RK4 at 100 Hz, median", np.median(plain), "us", "<= 20"),
        row("the same with the usual instruments, median", np.median(carried), "us", "<= 20"),
        row("the same, 99.9 % of the steps, wall", np.percentile(carried, 99.9), "us", "<= 1000"),
        row("the same, 99.9 % of the steps, processor", np.percentile(own_time, 99.9), "us", "<= 1000"),
        row("with all instruments at 100 Hz too, median", np.median(worst), "us", "none"),
        row("in gusts with the usual instruments, median", np.median(in_gusts), "us", "<= 20"),
        row("the same, 99.9 % of the steps, wall", np.percentile(in_gusts, 99.9), "us", "<= 1000"),
        row("the same, 99.9 % of the steps, processor", np.percentile(in_gusts_own, 99.9), "us", "<= 1000"),
        row("that step through the interface of whole runs", marshalled(compiled), "us", "none"),
        row("100 ships at 10 Hz with instruments, share of a core", share, "%", "< 20"),
        row("late ticks of that loop", report.overruns, "of 110", "none"),
        row("the same with each ship recorded, share of a core", recorded, "%", "none"),
        row("a ship made ready, kernel in the cache", ready, "ms", "none"),
        row("memory of the process", memory, "MB", "none"),
    ]
    publish("realtime", rows)


if __name__ == "__main__":
    main()

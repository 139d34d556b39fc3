"""A soak in real time: 20 Hz beside a loaded core; schedule, steps and memory at the end.

    python tests/long/soak.py [SECONDS]

30 seconds by default, 1800 for the full one.  Exits with 1 where a bar is not met.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import tempfile
import threading
import time
from pathlib import Path

from seatrial.data.trialfile import read_trial
from seatrial.environment import Uniform
from seatrial.environment.weather import Gust
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Plant
from seatrial.realtime.recording import Recording, rerun
from seatrial.sensors.suite import usual
from seatrial.ships.files import load

RATE, DT, MEGABYTE = 20.0, 0.01, 1024.0 * 1024.0
WEATHER = Gust(Uniform(U_T=8.0, gamma_T=0.6, U_C=0.5, gamma_C=1.0), seed=5)


def resident() -> float:
    """Memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / MEGABYTE


def burn() -> None:
    """Keep a core busy until killed."""
    x = 0.0
    while True:
        x = (x + 1.0) % 3.0


def commanded(loop: Loop, done: threading.Event) -> None:
    """Orders from another thread, some beyond the limits."""
    k = 0
    while not done.wait(0.1):
        k += 1
        loop.order("own", "delta", 0.8 * (-1) ** (k // 100))
        loop.order("own", "n_P", 1.5 + 0.1 * (k % 3))


def soak(seconds: float, folder: Path) -> dict[str, float]:
    """Run it, and say how it went."""
    ship = load("kvlcc2")
    plant = Plant.of(ship, dt=DT, environment=WEATHER)
    loop = Loop({"own": plant}, RATE, sensors=usual(ship), patience=5.0)
    recording = Recording(plant, folder / "soak.csv")
    loop.witness("own", recording)
    memory: list[tuple[float, float]] = []
    loop.after(lambda loop: memory.append((loop.t, resident())) if loop.k % int(RATE) == 0 else None)
    done = threading.Event()
    commander = threading.Thread(target=commanded, args=(loop, done))
    commander.start()
    start = time.perf_counter()
    report = loop.run(seconds)
    took = time.perf_counter() - start
    done.set()
    commander.join()
    recording.close()
    span = min(300.0, seconds / 4.0)
    warm = min(60.0, seconds / 4.0)
    first = [m for t, m in memory if warm <= t <= warm + span]
    last = [m for t, m in memory if t >= seconds - span]
    trial, again = read_trial(folder / "soak.csv"), rerun(folder / "soak.csv", ship, WEATHER)
    same = all(again[name].tolist() == trial[name].tolist() for name in trial.channels)
    return {
        "ticks_wanted": seconds * RATE, "ticks": report.ticks, "steps": plant.k, "steps_wanted": seconds / DT,
        "schedule_error_s": took - (seconds - 1.0 / RATE), "late_at_the_end_s": report.late,
        "worst_late_s": report.worst_late, "overruns": report.overruns, "slipped_s": report.slipped,
        "memory_growth_MB": sum(last) / len(last) - sum(first) / len(first), "rows": len(trial),
        "clipped": report.events.get("clipped", 0), "same_again": float(same),
    }  # fmt: skip


def main() -> int:
    """Soak beside a loaded core."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seconds", nargs="?", type=float, default=30.0)
    seconds = parser.parse_args().seconds
    busy = multiprocessing.get_context("fork").Process(target=burn, daemon=True)
    busy.start()
    try:
        with tempfile.TemporaryDirectory() as folder:
            found = soak(seconds, Path(folder))
    finally:
        busy.kill()
    taken = found["ticks"] == found["ticks_wanted"] and found["steps"] == found["steps_wanted"]
    in_time = abs(found["schedule_error_s"]) < 1.0 / RATE
    met = taken and in_time and found["memory_growth_MB"] < 2.0 and found["same_again"] == 1.0
    sys.stdout.write(json.dumps(found | {"met": met}, indent=1) + "\n")
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main())

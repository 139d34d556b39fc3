"""What a campaign costs, as a model fitted to measurements, and what 1e9 and 1e12 runs would take.

CPU seconds of a process = start + per_part * parts + per_run * runs + per_step * runs * steps, by non-negative least
squares over three numbers of runs, three sizes of parts and three durations; a larger campaign that was not fitted is
predicted.  What grows with the number of files or of points is measured at three sizes each and fitted by a power law.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls
from timing import HERE, machine, publish

from seatrial.campaign.designs import points
from seatrial.campaign.folder import Held, part_name
from seatrial.campaign.places import Folder

DT, CHUNK = 0.1, 16384
# runs, runs a part, duration [s]: one of the three is varied at a time.
FITTED = [
    (8_192, CHUNK, 80.0), (32_768, CHUNK, 80.0), (65_536, CHUNK, 80.0), (32_768, 2048, 80.0), (32_768, 256, 80.0),
    (32_768, CHUNK, 40.0), (32_768, CHUNK, 160.0),
]  # fmt: skip
PREDICTED = (131_072, CHUNK, 80.0)
INPUTS = ("Y_v", "Y_r", "N_v", "N_r", "X_vv")
FILES, PLACES = (1_000, 4_000, 16_000), (2**18, 2**20, 2**22)
REPEATS = 1


def document(runs: int, chunk: int, duration: float) -> str:
    """Zigzags of a random tanker."""
    inputs = "\n".join(f'"ship.hull.{name}" = {{ uniform = [0.9, 1.1], factor = true }}' for name in INPUTS)
    ordered = f'kind = "zigzag"\nrudder = 20.0\nheading = 20.0\nduration = {duration}\ndt = {DT}'
    drawn = f'schema = "seatrial-campaign/1"\nships = ["kvlcc2_l7"]\nruns = {runs}\nchunk = {chunk}'
    return f"{drawn}\n[manoeuvre]\n{ordered}\n[inputs]\n{inputs}\n"


def spent(runs: int, chunk: int, duration: float) -> tuple[float, float]:
    """CPU seconds of the command, least of the repetitions, and bytes a run on the disk."""
    least, size = np.inf, 0
    for _ in range(REPEATS):
        with tempfile.TemporaryDirectory() as folder:
            file, out = Path(folder) / "c.toml", Path(folder) / "out"
            file.write_text(document(runs, chunk, duration))
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            subprocess.run([sys.executable, "-m", "seatrial", "campaign", str(file), "-o", str(out), "--threads", "1"],
                           check=True, stdout=subprocess.DEVNULL)  # fmt: skip
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            least = min(least, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
            size = sum(path.stat().st_size for path in out.rglob("*.parquet"))
    return least, size / runs


def terms(runs: int, chunk: int, duration: float) -> list[float]:
    """What the CPU seconds are linear in."""
    return [1.0, -(-runs // chunk), runs, runs * duration / DT]


def power(sizes: tuple[int, ...], task: Callable[[int], None]) -> tuple[list[float], float, float]:
    """CPU seconds at each size, and factor and exponent of the power law through them."""
    taken = []
    for size in sizes:
        best = np.inf
        for _ in range(3):
            begun = time.process_time()
            task(size)
            best = min(best, time.process_time() - begun)
        taken.append(best)
    exponent, logarithm = np.polyfit(np.log(sizes), np.log(taken), 1)
    return taken, float(np.exp(logarithm)), float(exponent)


def listing() -> tuple[list[float], float, float]:
    """Which parts are missing, of a folder in which all but one are there."""
    with tempfile.TemporaryDirectory() as folder:
        for number in range(1, max(FILES)):
            path = Path(folder) / part_name(number)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        # of a smaller folder only the first files are listed, as its tree has no more
        taken = power(FILES, lambda count: _missing(Path(folder), count))
    return taken


def _missing(folder: Path, count: int) -> None:
    with tempfile.TemporaryDirectory() as small:
        tree = Path(small) / "parts"
        tree.mkdir()
        for k in range(-(-count // 1000)):
            (tree / f"{k:04d}").symlink_to(folder / "parts" / f"{k:04d}")
        found = Held(Folder(Path(small)), {"parts": count}).missing
    if len(found) > 1:
        raise RuntimeError(f"{len(found)} of {count} files were not listed")


def rows(fit: np.ndarray[Any, Any], size: float, told: tuple[float, float]) -> list[tuple[str, float, str, str]]:
    """The model, its check, and what large campaigns take by it."""
    start, part, run, step = fit
    each = part / CHUNK + run + step * 80.0 / DT
    out = [
        ("start of a process: imports, reading, first kernels from the cache", start, "s", "-"),
        (f"a part ({CHUNK} runs unless set)", 1e3 * part, "ms", "-"),
        ("a run, besides its steps", 1e6 * run, "us", "-"),
        ("a step (RK4, closed loop, tally)", 1e9 * step, "ns", "-"),
        ("a run of 80 s at 10 Hz, all in all", 1e6 * each, "us", "-"),
        ("share of the parts in that", 100.0 * part / CHUNK / each, "%", "-"),
        ("on the disk, 5 inputs and 11 other columns", size, "bytes a run", "-"),
        ("131 072 runs, not fitted: measured over predicted CPU time", told[0] / told[1], "x", "0.9 to 1.1"),
    ]
    for runs in (1e9, 1e12):
        out.append((f"{runs:.0e} runs", each * runs / 3600.0, "core hours", "-"))
        out.append((f"{runs:.0e} runs on the disk", size * runs / 1e12, "TB", "-"))
    return out


def main() -> None:
    """Measure, fit, predict and publish."""
    spent(1000, CHUNK, 80.0)  # kernels are compiled and cached
    found = [spent(*one) for one in FITTED]
    cost = np.array([one[0] for one in found])
    fit, _ = nnls(np.array([terms(*one) for one in FITTED]) / cost[:, None], np.ones(len(cost)))
    measured, size = spent(*PREDICTED)
    table = rows(fit, size, (measured, float(np.dot(terms(*PREDICTED), fit))))
    few = PLACES[:2]
    laws = {
        "listing the parts that are missing": (FILES, listing()),
        "entering a Sobol sequence of 10 inputs": (PLACES, power(PLACES, lambda n: _draw("sobol", n, n + 1, 2**30))),
        "drawing a Latin hypercube of 5 inputs": (few, power(few, lambda n: _draw("latin-hypercube", 0, 1, n))),
    }  # fmt: skip
    for what, (sizes, (taken, factor, exponent)) in laws.items():
        table.append((f"{what}: {sizes[-1]}", taken[-1], "s", "-"))
        table.append((f"{what}: grows with the power", exponent, "-", "-"))
        table.append((f"{what}: at 1e9 by the fit", factor * 1e9**exponent, "s", "-"))
    points_ = [(*one, *two) for one, two in zip([*FITTED, PREDICTED], [*found, (measured, size)], strict=True)]
    (HERE / "results").mkdir(exist_ok=True)
    about = {"machine": machine(), "date": time.strftime("%Y-%m-%d"), "load": os.getloadavg(), "measured": points_}
    (HERE / "results" / "scaling_points.json").write_text(json.dumps(about, indent=1) + "\n")
    publish("scaling", [dict(zip(("what", "value", "unit", "bar"), row, strict=True)) for row in table])


def _draw(design: Any, first: int, last: int, runs: int) -> None:
    points(design, int(time.monotonic_ns() % 2**40), 10 if design == "sobol" else 5, runs, first, last)


if __name__ == "__main__":
    main()

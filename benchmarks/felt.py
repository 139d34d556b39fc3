"""What a user waits for: whole commands as processes, their processor time and their memory.

    python benchmarks/felt.py [NAME...]

names: help, simulate, identify, check, rows.  Compiled modules and kernels are kept, as after a first use.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from timing import HERE, publish

import seatrial as st

FILES, ROWS, TRIALS = 1000, 10_000, 100
STUDY = HERE.parent / "studies" / "esso_osaka_mmg.toml"
LONG = """schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
train = [{names}]
[virtual]
ship = "kvlcc2_l7"
seed = 1
duration = {duration}
sample = 0.1
noise = {{ x = 0.05, y = 0.05, psi = 0.2, u = 0.01, v_m = 0.01, r = 0.05 }}
[virtual.trials]
{trials}
[free]
"hull.Y_v" = {{ sigma = 0.1 }}
"hull.N_r" = {{ sigma = 0.1 }}
"""


def files(folder: Path) -> None:
    """A thousand noisy zigzags of a model ship."""
    rng, ship = np.random.default_rng(1), st.load("kvlcc2_l7")
    runs = [st.simulate(ship, st.Zigzag(rudder_deg=angle, heading_deg=angle), duration=60.0)
            for angle in (5.0, 10.0, 15.0, 20.0, 25.0)]  # fmt: skip
    sizes = {"x": 0.02, "y": 0.02, "psi": 0.003, "u": 0.005, "v_m": 0.005, "r": 0.001}
    for k in range(FILES):
        run = runs[k % len(runs)].rows(slice(None, None, 5))
        noisy = {name: run[name] + size * rng.normal(size=len(run)) for name, size in sizes.items()}
        run.having(**noisy).save(folder / f"zigzag_{k}.csv")


def study(folder: Path) -> None:
    """A study of two parameters and a million rows."""
    names = [f"z{k}" for k in range(TRIALS)]
    made = "\n".join(f'"{name}" = {{ type = "zigzag:Zigzag", rudder = {5 + k % 20}, heading = {5 + k % 15} }}'
                     for k, name in enumerate(names))  # fmt: skip
    quoted = ", ".join(f'"{name}"' for name in names)
    (folder / "long.toml").write_text(LONG.format(names=quoted, duration=0.1 * ROWS, trials=made))


RUNS: dict[str, tuple[str, Callable[[Path], object], tuple[str, ...], int, float]] = {
    "help": ("seatrial --help", lambda _: None, ("--help",), 9, 0.08),
    "simulate": ("seatrial simulate kvlcc2 turning --json", lambda _: None,
                 ("simulate", "kvlcc2", "turning", "--json"), 9, 0.25),
    "identify": ("seatrial identify studies/esso_osaka_mmg.toml", lambda _: None,
                 ("identify", str(STUDY), "-o", "{}/run"), 3, 3.0),
    "check": (f"seatrial check of {FILES} files of 600 rows", files, ("check", "{}"), 1, 6.0),
    "rows": ("seatrial identify of 1e6 rows, two parameters", study, ("identify", "{}/long.toml", "-o", "{}/run"), 1,
             12.0),
}  # fmt: skip
"""By name: what it is, what it needs, its words, how often it is run, and its bar on a fast machine [s]."""


def spent(words: tuple[str, ...], around: dict[str, str]) -> tuple[float, float]:
    """Processor time of one process [s] and its memory [MB]."""
    process = subprocess.Popen([sys.executable, "-m", "seatrial", *words], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL, env=around)  # fmt: skip
    _, status, used = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) not in (0, 1):
        raise SystemExit(f"seatrial {' '.join(words)} failed")
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0


def main() -> None:
    """Measure what is named, else all."""
    rows: list[dict[str, Any]] = []
    for name in sys.argv[1:] or RUNS:
        what, made, words, times, bar = RUNS[name]
        with tempfile.TemporaryDirectory() as kept:
            folder = Path(kept, "made")
            folder.mkdir()
            made(folder)
            around = {**os.environ, "PYTHONPYCACHEPREFIX": str(HERE.parent / "build" / "felt")}
            around.pop("PYTHONDONTWRITEBYTECODE", None)
            told = tuple(word.format(folder) for word in words)
            found = [spent(told, around) for _ in range(times + (times > 1))]
        seconds, memory = min(one[0] for one in found), max(one[1] for one in found)
        rows.append({"what": what, "value": seconds, "unit": "s", "bar": f"{bar} on a faster machine"})
        if bar > 1.0:  # a short command takes less than the process that it is started from
            rows.append({"what": f"{what}: memory", "value": memory, "unit": "MB", "bar": "-"})
    publish("felt", rows, kept=True)


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    main()

"""Cold start of the command line: processor time of whole processes, also over that of the bare imports."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from typing import Any

from timing import publish

ROUNDS = 15
BARE = ("-c", "import numpy, casadi")
COMMANDS = {
    "seatrial --help": (("--help",), 0.2),
    "seatrial simulate kvlcc2 turning --json": (("simulate", "kvlcc2", "turning", "--json"), 0.4),
}
"""Commands with their bars on an idle machine [s]."""


def spent(folder: str, *arguments: str) -> float:
    """Processor time of one process [s], by the clock of an idle machine; compiled modules lie in `folder`."""
    around = {**os.environ, "PYTHONPYCACHEPREFIX": folder}
    around.pop("PYTHONDONTWRITEBYTECODE", None)  # an installed package is compiled
    before = os.times()
    subprocess.run([sys.executable, *arguments], stdout=subprocess.DEVNULL, env=around, check=True)
    after = os.times()
    return after.children_user + after.children_system - before.children_user - before.children_system


def main() -> None:
    """Interleave the processes, so that all see the same machine; publish the shortest of each."""
    calls = {"bare": BARE, **{name: ("-m", "seatrial", *words) for name, (words, _) in COMMANDS.items()}}
    times: dict[str, list[float]] = {name: [] for name in calls}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(ROUNDS):
            for name, arguments in calls.items():
                times[name].append(spent(folder, *arguments))
    bare = min(times["bare"])
    rows: list[dict[str, Any]] = []
    for name, (_, bar) in COMMANDS.items():
        least = min(times[name])
        rows.append({"what": name, "value": least, "unit": "s", "bar": f"{bar} on an idle machine"})
        rows.append({"what": f"the same over `python -c 'import numpy, casadi'` ({bare:.2f} s)",
                     "value": least / bare, "unit": "x", "bar": "none"})  # fmt: skip
    publish("cold_start", rows)


if __name__ == "__main__":
    main()

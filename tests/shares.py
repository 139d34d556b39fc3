"""The unit tier, a process for each core: every one is dealt modules of its own, and imports and collects only these.

usage: python tests/shares.py [-m MARKS] [--processes N] [pytest arguments]

Thousands of small tests cost less than handing them round does: each worker of pytest-xdist collects them all, and
sends every phase of every test to the process that started it.  That pays for the slow tests, of which nobody knows in
advance how long they take; here the length of a module tells enough.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path

from tiers import left_out

ROOT = Path(__file__).parents[1]
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "SEATRIAL_THREADS")
"""Processes share the cores already: threads of NumPy, PyTorch and kernels in each would only wait for one another."""
_HEAVY = ("torch", "xarray", "distributed", "hypothesis", "fastapi", "matplotlib", "nbclient", r"scipy\.stats",
          r"scipy import .*\bstats")  # fmt: skip
HEAVY = re.compile(rf"\b(?:{'|'.join(_HEAVY)})\b")
"""Libraries that take seconds to import: one process does it for all modules that name one."""


def modules(expression: str, folder: Path) -> dict[Path, str]:
    """Path and text of the modules below `folder` of which `-m expression` takes some test."""
    texts = {path: path.read_text(encoding="utf-8") for path in sorted(folder.rglob("test_*.py"))}
    return {path: text for path, text in texts.items() if not left_out(text, expression)}


def dealt(texts: Mapping[Path, str], processes: int) -> list[list[Path]]:
    """The modules of each process: the longest first, to the one that has least (Graham 1969).

    Those that need the same dear imports are dealt as one.
    """
    heavy = [path for path, text in texts.items() if HEAVY.search(text)]
    lots = [heavy, *([path] for path in texts if path not in heavy)]
    weights = [sum(len(texts[path]) for path in lot) for lot in lots]
    shares: list[list[Path]] = [[] for _ in range(processes)]
    loads = [0] * processes
    for weight, lot in sorted(zip(weights, lots, strict=True), reverse=True):
        least = loads.index(min(loads))
        shares[least] += lot
        loads[least] += weight
    return [sorted(share) for share in shares if share]


def run(shares: Sequence[Sequence[Path]], arguments: Sequence[str], root: Path) -> int:
    """Run each share, the first before the user's eyes and the others told as they end; 1 if one fails, else 0.

    Explaining assertions takes a tenth of the whole on a fresh clone, so only what fails is run again with that.
    """
    around = {**dict.fromkeys(THREADS, "1"), **os.environ}
    commands = [
        [sys.executable, "-m", "pytest", "-q", "-o", f"cache_dir=.pytest_cache/{k}", *arguments,
         *(str(path.relative_to(root)) for path in share)]
        for k, share in enumerate(shares)
    ]  # fmt: skip
    with ExitStack() as open_files:
        kept = [None, *(open_files.enter_context(tempfile.TemporaryFile()) for _ in shares[1:])]
        started = [
            subprocess.Popen([*one, "--assert=plain"], cwd=root, env=around, stdout=told,
                             stderr=told and subprocess.STDOUT)
            for one, told in zip(commands, kept, strict=True)
        ]  # fmt: skip
        for process, told in zip(started, kept, strict=True):
            process.wait()
            if told:
                told.seek(0)
                sys.stdout.buffer.write(told.read())
                sys.stdout.flush()
    for process, one in zip(started, commands, strict=True):
        if process.returncode == 1:
            subprocess.run([*one, "--last-failed"], cwd=root, env=around, check=False)
    return int(any(process.returncode for process in started))


def main(arguments: Sequence[str], root: Path = ROOT) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-m", default="", help="marks, as pytest takes them")
    parser.add_argument("--processes", type=int, default=len(os.sched_getaffinity(0)))
    asked, rest = parser.parse_known_args(arguments)
    return run(dealt(modules(asked.m, root / "tests"), asked.processes), ["-m", asked.m, *rest], root)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

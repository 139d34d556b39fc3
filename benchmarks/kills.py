"""A campaign of ten million runs under kills: the same bytes whatever is killed, and nothing computed twice.

Processes of the command, shards, workers and the scheduler of a Dask cluster get SIGKILL at random moments.  A part
that a kill has left must never be written again; the runs that were computed beyond those of the table are those of
parts under way.  `SEATRIAL_RUNS` and `SEATRIAL_KILLS` change the size, and the folder of results keeps the last figures.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from timing import publish

from seatrial.campaign.folder import open_folder
from seatrial.campaign.tables import wrong_parts

RUNS, KILLS = int(float(os.environ.get("SEATRIAL_RUNS", "1e7"))), int(os.environ.get("SEATRIAL_KILLS", "100"))
CHUNK, WORKERS, EVERY = 16384, 3, 20.0
FILE = f"""
schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = {RUNS}
chunk = {CHUNK}
tracks = {{ every = 20, columns = ["psi"] }}
[manoeuvre]
kind = "zigzag"
rudder = 20.0
heading = 10.0
duration = 20.0
dt = 0.25
method = "euler"
[inputs]
"ship.hull.N_r" = {{ normal = [1.0, 0.1], factor = true }}
"ship.hull.Y_v" = {{ uniform = [0.9, 1.1], factor = true }}
"policy.delta" = {{ uniform = [18, 22], unit = "deg" }}
"""
COMMAND = [sys.executable, "-m", "seatrial", "campaign"]


@dataclass
class Counted:
    """What the folder of a campaign has been seen to hold, and what came of the kills."""

    folder: Path
    kills: int = 0
    again: int = 0
    lost: int = 0

    def __post_init__(self) -> None:
        self.seen: dict[Path, int] = {}

    def look(self) -> int:
        """Parts that are there; those that were written again are counted."""
        now = {path: path.stat().st_mtime_ns for path in self.folder.glob("*/*/*.parquet")}
        self.again += sum(now.get(path) != at for path, at in self.seen.items())
        self.seen = now
        return len(now) // 2

    def killed(self, width: int) -> None:
        """Another kill, of a process with that many parts under way at most."""
        self.kills, self.lost = self.kills + 1, self.lost + width
        self.look()


def begun(file: Path, out: Path, *options: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([*COMMAND, str(file), "-o", str(out), "--json", *options], stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)  # fmt: skip


def to_its_end(file: Path, out: Path, *options: str) -> float:
    """The command, and the seconds that it took; RuntimeError: it failed."""
    start = time.perf_counter()
    if begun(file, out, *options).wait():
        raise RuntimeError(f"{out.name}: the command failed")
    return time.perf_counter() - start


def by_shards(file: Path, out: Path, shards: int, kills: int, longest: float) -> Counted:
    """A folder after so many kills of processes with one and two threads, each one shard; then to its end."""
    chance, found = random.Random(shards), Counted(out)
    for kill in range(kills):
        threads = 1 + kill % 2
        process = begun(file, out, "--threads", str(threads), "--shard", f"{1 + kill % shards}/{shards}")
        until(lambda: (out / "campaign.json").exists() or process.poll() is not None)
        time.sleep(chance.uniform(0.0, longest))
        process.send_signal(signal.SIGKILL)
        process.wait()
        found.killed(threads)
    for shard in range(shards):
        to_its_end(file, out, "--shard", f"{1 + shard}/{shards}")
    found.look()
    return found


def until(true: Callable[[], bool], patience: float = 600.0) -> None:
    """Wait; RuntimeError: in vain."""
    end = time.monotonic() + patience
    while not true():
        if time.monotonic() > end:
            raise RuntimeError("waited in vain")
        time.sleep(0.05)


def serving(stack: ExitStack, *command: str) -> subprocess.Popen[bytes]:
    process = subprocess.Popen([sys.executable, "-m", *command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    stack.callback(process.wait)
    stack.callback(process.kill)
    return process


def scheduler(stack: ExitStack, port: int) -> subprocess.Popen[bytes]:
    options = ("--host", "127.0.0.1", "--port", str(port), "--no-dashboard")
    return serving(stack, "distributed.cli.dask_scheduler", *options)


def worker(stack: ExitStack, port: int) -> subprocess.Popen[bytes]:
    options = ("--nthreads", "1", "--no-nanny", "--no-dashboard", "--death-timeout", "120")
    return serving(stack, "distributed.cli.dask_worker", f"tcp://127.0.0.1:{port}", *options)


def by_dask(file: Path, out: Path, port: int) -> tuple[Counted, int]:
    """A folder that workers fill, one of which is killed every 20 s, and the scheduler once; workers killed."""
    found, chance, address = Counted(out), random.Random(port), f"tcp://127.0.0.1:{port}"
    with ExitStack() as stack:
        head, workers = scheduler(stack, port), [worker(stack, port) for _ in range(WORKERS)]
        time.sleep(5.0)
        process, last, down = stack.enter_context(begun(file, out, "--dask", address)), time.monotonic(), False
        while True:
            time.sleep(0.2)
            if process.poll() is not None:
                if process.returncode == 0:
                    break
                if not down:
                    raise RuntimeError("the command failed with its scheduler alive")
                head, down = scheduler(stack, port), False
                workers = [worker(stack, port) for _ in range(WORKERS)]
                time.sleep(5.0)
                process = stack.enter_context(begun(file, out, "--dask", address))
            if not down and found.kills < 10**6 and time.monotonic() - last > EVERY:
                last = time.monotonic()
                gone = workers.pop(chance.randrange(len(workers)))
                gone.kill()
                gone.wait()
                found.killed(2)  # one that it computes, and one that waits in it
                workers.append(worker(stack, port))
                if head.poll() is None and found.kills == 2:
                    head.kill()
                    head.wait()
                    down = True
                    found.killed(2 * WORKERS)
        found.look()
    return found, found.kills - 1


def main() -> None:
    """Measure and publish."""
    rows: list[dict[str, Any]] = []

    def row(what: str, value: float, unit: str = "-", bar: str = "-") -> None:
        rows.append({"what": what, "value": float(value), "unit": unit, "bar": bar})

    with tempfile.TemporaryDirectory(dir=os.environ.get("SEATRIAL_SCRATCH")) as there:
        folder, file = Path(there), Path(there) / "campaign.toml"
        file.write_text(FILE)
        took = to_its_end(file, folder / "whole", "--threads", "2")
        wanted = open_folder(folder / "whole").digest()
        parts = open_folder(folder / "whole").parts
        row("runs, a kept sample in twenty", RUNS)
        row("parts, each with its tracks", parts)
        row("without a kill, two threads", took, "s")
        made = {
            f"{shards} shard{'s' * (shards > 1)}, one and two threads": by_shards(
                file, folder / f"shards{shards}", shards, KILLS // 2, 3.0 * took / (KILLS // 2))
            for shards in (1, 3)
        }  # fmt: skip
        made[f"Dask, {WORKERS} workers"], workers = by_dask(file, folder / "dask", 18786)
        row("kills in all", sum(one.kills for one in made.values()), bar=">= 100")
        row("of these workers of a cluster", workers)
        for name, one in made.items():
            held = open_folder(one.folder)
            row(f"{name}: kills", one.kills)
            row(f"{name}: the digest of the data set is that without a kill", held.digest() == wanted, bar="1")
            row(f"{name}: faults that --verify finds", len(list(wrong_parts(held))), bar="0")
            row(f"{name}: files left half-written", len(list(one.folder.rglob("*.tmp"))), bar="0")
            row(f"{name}: parts that were there and were written again", one.again, bar="0")
            row(f"{name}: parts under way at the kills, at most", one.lost)
    publish("kills", rows)


if __name__ == "__main__":
    main()

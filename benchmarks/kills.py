"""A campaign of ten million runs under kills: the same bytes whatever is killed, and nothing computed twice.

Processes of the command, shards, workers and the scheduler of a Dask cluster get SIGKILL at random moments.  A part
that a kill has left must never be written again; the runs that were computed beyond those of the table are those of
parts under way.  `SEATRIAL_RUNS` and `SEATRIAL_KILLS` change the size, and `SEATRIAL_SCRATCH` the disk.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from timing import publish

from seatrial.campaign.folder import open_folder
from seatrial.campaign.tables import wrong_parts

RUNS, KILLS = int(float(os.environ.get("SEATRIAL_RUNS", "1e7"))), int(os.environ.get("SEATRIAL_KILLS", "100"))
CHUNK, LAYOUTS, WORKERS, EVERY, PORT = 16384, (1, 3), 3, 20.0, 18786
SCHEDULER = 2
"""The scheduler is killed with the second worker."""
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
        """Number of files that are there; those that were written again are counted."""
        now = {path: path.stat().st_mtime_ns for path in self.folder.glob("*/*/*.parquet")}
        self.again += sum(now.get(path) != at for path, at in self.seen.items())
        self.seen = now
        return len(now)

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
        wait_for(out / "campaign.json", process)
        time.sleep(chance.uniform(0.0, longest))
        process.send_signal(signal.SIGKILL)
        process.wait()
        found.killed(threads)
    for shard in range(shards):
        to_its_end(file, out, "--shard", f"{1 + shard}/{shards}")
    found.look()
    return found


def wait_for(path: Path, process: subprocess.Popen[bytes]) -> None:
    """Until a file is there, or the process has ended."""
    while not path.exists() and process.poll() is None:
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


def by_dask(file: Path, out: Path, port: int) -> Counted:
    """A folder that workers fill, one of which is killed every 20 s, and once the scheduler."""
    found, chance, address = Counted(out), random.Random(port), f"tcp://127.0.0.1:{port}"
    with ExitStack() as stack:
        head, workers = scheduler(stack, port), [worker(stack, port) for _ in range(WORKERS)]
        process, last, lost = stack.enter_context(begun(file, out, "--dask", address)), time.monotonic(), False
        while process.poll() is None or process.returncode:
            time.sleep(0.2)
            if process.poll():
                if lost:
                    raise RuntimeError("the command failed with its scheduler alive")
                lost, last = True, time.monotonic()
                head, workers = scheduler(stack, port), [worker(stack, port) for _ in range(WORKERS)]
                process = stack.enter_context(begun(file, out, "--dask", address))
            if head.poll() is None and time.monotonic() - last > EVERY and found.look():
                last = time.monotonic()
                gone = workers.pop(chance.randrange(WORKERS))
                gone.kill()
                gone.wait()
                found.killed(2)  # the part that it computes, and one that waits for its answer
                workers.append(worker(stack, port))
                if not lost and found.kills == SCHEDULER:
                    head.kill()
                    head.wait()
                    found.killed(2 * WORKERS)
        found.look()
    return found


def figures(name: str, one: Counted, wanted: str) -> list[tuple[str, float, str]]:
    """What became of a folder."""
    held = open_folder(one.folder)
    return [
        (f"{name}: kills", one.kills, "-"),
        (f"{name}: the digest of the data set is that without a kill", held.digest() == wanted, "1"),
        (f"{name}: faults that --verify finds", len(list(wrong_parts(held))), "0"),
        (f"{name}: files left half-written", len(list(one.folder.rglob("*.tmp"))), "-"),
        (f"{name}: parts that were there and were written again", one.again, f"<= {one.lost}"),
        (f"{name}: parts under way at the kills, at most", one.lost, "-"),
    ]


def main() -> None:
    """Measure, and publish after each folder."""
    rows: list[tuple[str, float, str]] = []

    def told(*more: tuple[str, float, str]) -> None:
        rows.extend(more)
        publish("kills", [{"what": what, "value": float(value), "unit": "-", "bar": bar} for what, value, bar in rows])

    with tempfile.TemporaryDirectory(dir=os.environ.get("SEATRIAL_SCRATCH")) as there:
        folder, file = Path(there), Path(there) / "campaign.toml"
        file.write_text(FILE)
        took = to_its_end(file, folder / "whole", "--threads", "2")
        whole = open_folder(folder / "whole")
        told(("runs, each with five samples of its track", RUNS, "1e7"), ("parts", whole.parts, "-"),
             ("without a kill, two threads [s]", took, "-"))  # fmt: skip
        for shards in LAYOUTS:
            name, each = f"shards: {shards}, threads: 1 and 2", KILLS // len(LAYOUTS)
            one = by_shards(file, folder / f"of{shards}", shards, each, 2.0 * took / each)
            told(*figures(name, one, whole.digest()))
        one = by_dask(file, folder / "dask", PORT)
        told(*figures(f"Dask, {WORKERS} workers and their scheduler", one, whole.digest()))


if __name__ == "__main__":
    main()

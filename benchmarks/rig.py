"""A rig for an hour: page, wire, Signal K, twenty ships with radar and AIS at 20 Hz; steps missed, memory, delays.

    python benchmarks/rig.py [SECONDS] [-o results/rig.json]

The rig is `seatrial bridge` in a process of its own, asked from outside: a browser's socket that reads every picture,
an autopilot that orders a heading each second, and a Signal K client.  Steps are missed if simulated time falls behind
the clock for good; `late` counts ticks that began more than a period late and were made up for.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

SHIPS = 20


def scenario() -> str:
    """Twenty ships on all courses, gusts, a current that turns, a fault now and then."""
    said = ['schema = "seatrial-scenario/1"', 'title = "Rig"', "duration = 100000.0", "place = [35.0, 139.7]",
            "variation = -7.5", 'gusts = "davenport"', "[own]", 'ship = "kvlcc2"', 'instruments = "usual"',
            "mmsi = 211000001", "route = [[100000.0, 0.0]]", "[[weather]]", 'wind = "10,300"', 'current = "0.5,90"',
            "[[weather]]", "at = 120.0", "over = 3000.0", 'current = "0.5,270"', "[[faults]]", 'kind = "silent"',
            'of = "gnss"', "at = 60.0", "lasts = 30.0"]  # fmt: skip
    for k in range(SHIPS):
        said += [f"[traffic.ship{k + 1}]", f"at = [{3000 + 900 * k}, {(-1) ** k * (1500 + 400 * k)}]",
                 f"heading = {(53 * k) % 360}", f'ais = "{("class A", "class B")[k % 2]}"']  # fmt: skip
        said += ['ship = "kcs"'] if k % 5 == 0 else [f"length = {60 + 10 * k}", f"speed = {4 + 0.2 * k}"]
    return "\n".join(said) + "\n"


class Ends:
    """The other ends of the rig, each in a thread."""

    def __init__(self, page: int, wire: int) -> None:
        self.page, self.wire, self.over = page, wire, threading.Event()
        self.count: Counter[str] = Counter()
        self.gap, self.late, self.behind, self.events = 0.0, 0, 0.0, 0
        self._threads = [threading.Thread(target=one, daemon=True) for one in (self._browser, self._pilot, self._app)]

    def run(self) -> None:
        for thread in self._threads:
            thread.start()

    def _browser(self) -> None:
        address = f"ws://127.0.0.1:{self.page}/line"
        with connect(address, proxy=None, max_size=None) as ws, suppress(ConnectionClosed):
            ws.send(json.dumps({"hello": "rig-browser"}))
            first: tuple[float, float] | None = None
            last = time.monotonic()
            while not self.over.is_set():
                said: dict[str, Any] = json.loads(ws.recv(timeout=60))
                if "own" not in said:
                    continue
                now = time.monotonic()
                if first is not None:
                    self.gap = max(self.gap, now - last)
                    self.behind = (now - first[1]) - (said["t"] - first[0])
                first, last = first or (said["t"], now), now
                self.late, self.events = said["late"], said["told"]
                self.count["pictures"] += 1
                if said["n"] % 10 == 0:
                    ws.send(json.dumps({"do": "beat", "read": said["n"]}))

    def _pilot(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.connect(("127.0.0.1", self.wire))
            link.settimeout(0.2)
            due = 0.0
            while not self.over.is_set():
                if time.monotonic() >= due:
                    due = time.monotonic() + 1.0
                    body = f"AGHTC,V,,,H,N,,,,,{10 if int(due) % 60 < 30 else 350}.0,,,T,C"
                    total = 0
                    for byte in body.encode():
                        total ^= byte
                    link.send(f"${body}*{total:02X}\r\n".encode())
                try:
                    data = link.recv(4096)
                except TimeoutError:
                    continue
                for line in data.splitlines():
                    self.count[line[3:6].decode(errors="replace")] += 1

    def _app(self) -> None:
        address = f"ws://127.0.0.1:{self.page}/signalk/v1/stream?subscribe=all"
        with connect(address, proxy=None, max_size=None) as ws, suppress(ConnectionClosed):
            while not self.over.is_set():
                ws.recv(timeout=60)
                self.count["deltas"] += 1


def port(pattern: str, line: str) -> int:
    """The port that the rig names."""
    found = re.search(pattern, line)
    if found is None:
        raise SystemExit(f"the rig did not start: {line}")
    return int(found[1])


def memory(pid: int) -> float:
    """Resident memory [MB]."""
    return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text())[1]) / 1024.0  # type: ignore[index]


def seconds(pid: int) -> float:
    """Processor time so far [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seconds", nargs="?", type=float, default=3600.0)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "rig.toml")
        path.write_text(scenario())
        command = [sys.executable, "-m", "seatrial", "bridge", "kvlcc2", "--nmea", "udp://127.0.0.1:0", "--scenario",
                   str(path), "--port", "0", "--signalk", "-o", folder]  # fmt: skip
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as rig:
            told: Any = rig.stderr
            ends = Ends(port(r":(\d+)/", told.readline()), port(r"udp://[\d.]+:(\d+)", told.readline()))
            time.sleep(2.0)
            ends.run()
            kept: list[float] = []
            end = time.monotonic() + given.seconds
            while time.monotonic() < end and rig.poll() is None:
                time.sleep(min(10.0, given.seconds / 20.0))
                kept.append(memory(rig.pid))
            alive, cpu = rig.poll() is None, seconds(rig.pid)
            ends.over.set()
            rig.terminate()
    third = max(len(kept) // 3, 1)
    grown = sum(kept[-third:]) / third - sum(kept[third : 2 * third] or kept[:third]) / third
    found = {"seconds": given.seconds, "alive": alive, "behind_s": ends.behind, "late_ticks": ends.late,
             "greatest_gap_s": ends.gap, "memory_mb": kept[-1], "memory_grown_mb": grown, "cpu_s": cpu,
             "load": os.getloadavg()[1], "received": dict(ends.count)}  # fmt: skip
    print(json.dumps(found, indent=1))
    if given.out:
        given.out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()

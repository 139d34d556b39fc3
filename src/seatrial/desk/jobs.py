"""Commands that were run in a folder: each in a process of its own, its words and its end in files.

A job is `NNNN.json` (what was run, when, by which process, how it ended) and `NNNN.txt` (what it said), below the
folder's `.seatrial`.  A page that is closed, or a second one, therefore sees the same.
"""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..core.errors import RequestError
from ..core.files import write_whole
from ..core.values import asdict, dataclass, replace
from .shelf import JOBS

AT_ONCE = 4
"""Largest number of commands that run at the same time."""
_PIECE = 65536
"""Bytes of what a job said that are given at once."""
_COLUMNS = "62"
"""Width of the tables that a command prints: that of its column on the page."""
_PATIENCE = 5.0
"""Time that commands have to end when the page does [s]: a fit keeps what it has."""


@dataclass(frozen=True)
class Job:
    """One command.

    Attributes:
        number: from 1, in the order in which they began.
        arguments: of `seatrial`.
        began, ended: seconds since 1970; None while it runs.
        status: exit status; None while it runs, and where the page ended before the command.
        pid: its process.
    """

    number: int
    arguments: tuple[str, ...]
    began: float
    pid: int
    ended: float | None = None
    status: int | None = None

    @property
    def command(self) -> str:
        """What does the same in a shell."""
        return shlex.join(("seatrial", *self.arguments))

    def told(self, running: bool) -> dict[str, Any]:
        """For the page."""
        lost = self.ended is None and not running
        state = "running" if running else "ended with its page" if lost else "done" if self.status == 0 else "failed"
        return {**asdict(self), "command": self.command, "state": state}


class Jobs:
    """The jobs of one folder, and those of them that this process has started.

    Args:
        folder: where the commands run.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._where = folder, folder / JOBS
        self._running: dict[int, subprocess.Popen[bytes]] = {}
        self._lock = threading.Lock()

    def start(self, arguments: Sequence[str]) -> Job:
        """Run a command in the folder.

        Raises:
            RequestError: too many run already.
        """
        with self._lock:
            if sum(one.poll() is None for one in self._running.values()) >= AT_ONCE:
                raise RequestError(f"{AT_ONCE} commands run already; wait for one, or stop it")
            self._where.mkdir(exist_ok=True)
            number = max((int(path.stem) for path in self._where.glob("[0-9]*.json")), default=0) + 1
            with self._words(number).open("wb") as words:
                process = subprocess.Popen(
                    [sys.executable, "-m", "seatrial", *arguments], cwd=self._folder, stdin=subprocess.DEVNULL,
                    stdout=words, stderr=subprocess.STDOUT, start_new_session=True,
                    env={**os.environ, "PYTHONUNBUFFERED": "1", "NO_COLOR": "1", "COLUMNS": _COLUMNS},
                )  # fmt: skip
            job = Job(number, tuple(arguments), time.time(), process.pid)
            self._running[number] = process
            self._keep(job)
        threading.Thread(target=self._wait, args=(job, process), name=f"job {number}", daemon=True).start()
        return job

    def every(self) -> list[dict[str, Any]]:
        """All jobs, the last one first."""
        found = [self._read(path) for path in sorted(self._where.glob("[0-9]*.json"), reverse=True)]
        return [job.told(self._runs(job)) for job in found if job is not None]

    def said(self, number: int, since: int) -> dict[str, Any]:
        """How a job stands, and what it said after the first `since` bytes.

        Raises:
            RequestError: there is no such job.
        """
        job = self._read(self._where / f"{number:04d}.json")
        if job is None:
            raise RequestError(f"there is no command {number}")
        told = job.told(self._runs(job))  # before its words, so that none are missed at its end
        with self._words(number).open("rb") as words:
            words.seek(max(since, 0))
            text = words.read(_PIECE)
        return {**told, "text": text.decode("utf-8", errors="replace"), "read": max(since, 0) + len(text)}

    def stop(self, number: int) -> None:
        """Interrupt a job, as Ctrl-C does; one that does not run is left alone."""
        with self._lock:
            process = self._running.get(number)
        if process is not None and process.poll() is None:
            _interrupt(process)

    def close(self) -> None:
        """Interrupt all that run, and end what does not end by itself."""
        with self._lock:
            going = [one for one in self._running.values() if one.poll() is None]
        for process in going:
            _interrupt(process)
        end = time.monotonic() + _PATIENCE
        for process in going:
            try:
                process.wait(max(end - time.monotonic(), 0.0))
            except subprocess.TimeoutExpired:
                process.kill()

    def _wait(self, job: Job, process: subprocess.Popen[bytes]) -> None:
        status = process.wait()
        with suppress(OSError):  # the folder is gone
            self._keep(replace(job, ended=time.time(), status=status))

    def _runs(self, job: Job) -> bool:
        process = self._running.get(job.number)
        return job.ended is None and process is not None and process.pid == job.pid

    def _keep(self, job: Job) -> None:
        write_whole(self._where / f"{job.number:04d}.json", json.dumps(asdict(job)))

    def _read(self, path: Path) -> Job | None:
        try:
            said = json.loads(path.read_text(encoding="utf-8"))
            return Job(int(said["number"]), tuple(map(str, said["arguments"])), float(said["began"]),
                       int(said["pid"]), said["ended"], said["status"])  # fmt: skip
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def _words(self, number: int) -> Path:
        return self._where / f"{number:04d}.txt"


def _interrupt(process: subprocess.Popen[bytes]) -> None:
    """As Ctrl-C; Windows has no such signal for a process of another group."""
    with suppress(OSError):
        process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)

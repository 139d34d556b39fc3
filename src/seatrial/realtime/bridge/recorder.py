"""Recordings of the own ship, one after the other."""

from __future__ import annotations

import re
from collections.abc import Generator
from contextlib import contextmanager, suppress
from datetime import datetime
from itertools import count
from pathlib import Path

from ...data import DataError
from ..loop import Loop
from ..recording import Recording, orders_path
from .requests import RefusalError
from .view import OWN


@contextmanager
def still(loop: Loop) -> Generator[None, None, None]:
    """No tick meanwhile."""
    paused = loop.paused
    loop.pause()
    try:
        yield
    finally:
        if not paused:
            loop.resume()


def plain(name: str) -> str:
    """A name as part of that of a file, whatever it holds: no separators, no control characters, no leading dot."""
    return re.sub(r"[^\w.+-]+", "_", name).lstrip("._-")[:80] or "ship"


class Recorder:
    """Writes one trial at a time into a folder, under the name of the ship and the time of the clock.

    Attributes:
        record: the one under way, if any.
    """

    def __init__(self, loop: Loop, folder: Path) -> None:
        self._loop, self._folder = loop, folder
        self.record: Recording | None = None

    @property
    def told(self) -> tuple[str, int, str] | None:
        """The file, empty before its first rows, its rows, and why it ended by itself; None where nothing was begun."""
        record = self.record
        if record is None:
            return None
        return str(record.paths[-1]) if record.paths else "", record.rows, record.failure

    def start(self) -> None:
        """Begin a trial.

        Raises:
            RefusalError: one is under way.
            DataError: it cannot be written there.
        """
        if self.record is not None and not self.record.failure:
            raise RefusalError("recording already")
        self.stop()
        plant = self._loop.vessels[OWN].plant
        stem = f"{plain(plant.ship.name)}_{datetime.now():%Y%m%d_%H%M%S}"
        self.record = Recording(plant, self._free(stem), kind="bridge")
        self._loop.witness(OWN, self.record)

    def stop(self) -> list[Path]:
        """End the trial; the files of it, none where nothing is recorded."""
        record, self.record = self.record, None
        if record is None:
            return []
        self._loop.dismiss(record)
        before = record.failure
        with still(self._loop), suppress(DataError):  # no tick while the last row is written
            record.close()
        if record.failure != before:
            self._loop.tell(OWN, "dropped", f"the recording lacks its last row: {record.failure}")
        return record.paths

    def _free(self, stem: str) -> Path:
        """A name that is not taken: the second of one second is number 2."""
        paths = (self._folder / f"{stem}{'' if n == 1 else f'_{n}'}.csv" for n in count(1))
        return next(path for path in paths if not (path.exists() or orders_path(path).exists()))

"""Recordings of the bridge, one at a time."""

from __future__ import annotations

import re
from collections.abc import Generator, Mapping
from contextlib import contextmanager, suppress
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import Any

from ...core.errors import RefusalError
from ...data import DataError
from ..loop import Loop
from ..recording import Recording, orders_path
from .view import OWN


@contextmanager
def still(loop: Loop) -> Generator[None, None, None]:
    """Pause the loop within a block."""
    paused = loop.paused
    loop.pause()
    try:
        yield
    finally:
        if not paused:
            loop.resume()


def plain(name: str) -> str:
    """A name made safe for a file name: no separators, no control characters, no leading dot."""
    return re.sub(r"[^\w.+-]+", "_", name).lstrip("._-")[:80] or "ship"


class Recorder:
    """Records one trial at a time into a folder, named by the ship and the time of the clock.

    Attributes:
        record: the recording in progress, if any.
    """

    def __init__(self, loop: Loop, folder: Path, meta: Mapping[str, Any]) -> None:
        self._loop, self._folder, self._meta = loop, folder, meta
        self.record: Recording | None = None

    @property
    def told(self) -> tuple[str, int, str] | None:
        """File (empty before its first rows), number of rows, and why it ended by itself; None without a recording."""
        record = self.record
        if record is None:
            return None
        return str(record.paths[-1]) if record.paths else "", record.rows, record.failure

    def start(self) -> None:
        """Start a recording; RefusalError: one is in progress. DataError: the file cannot be written."""
        if self.record is not None and not self.record.failure:
            raise RefusalError("a recording is already in progress")
        self.stop()
        plant = self._loop.vessels[OWN].plant
        stem = f"{plain(plant.ship.name)}_{datetime.now():%Y%m%d_%H%M%S}"
        # a second recording in the same second gets the number 2
        paths = (self._folder / f"{stem}{'' if n == 1 else f'_{n}'}.csv" for n in count(1))
        free = next(path for path in paths if not (path.exists() or orders_path(path).exists()))
        self.record = Recording(plant, free, kind="bridge", meta=self._meta)
        self._loop.witness(OWN, self.record)

    def stop(self) -> list[Path]:
        """End the recording; returns its files, none if nothing was recorded."""
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

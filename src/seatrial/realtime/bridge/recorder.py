"""Recordings of the own ship, one after the other."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from datetime import datetime
from itertools import count
from pathlib import Path

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


class Recorder:
    """Writes one trial at a time into a folder, under the name of the ship and the time of the clock.

    Attributes:
        record: the one under way, if any.
    """

    def __init__(self, loop: Loop, folder: Path) -> None:
        self._loop, self._folder = loop, folder
        self.record: Recording | None = None

    @property
    def told(self) -> tuple[str, int] | None:
        """The file, empty before its first rows, and its rows; None while nothing is recorded."""
        record = self.record
        return None if record is None else (str(record.paths[-1]) if record.paths else "", record.rows)

    def start(self) -> None:
        """Begin a trial.

        Raises:
            RefusalError: one is under way.
            DataError: it cannot be written there.
        """
        if self.record is not None:
            raise RefusalError("recording already")
        plant = self._loop.vessels[OWN].plant
        self.record = Recording(plant, self._free(f"{plant.ship.name}_{datetime.now():%Y%m%d_%H%M%S}"), kind="bridge")
        self._loop.witness(OWN, self.record)

    def stop(self) -> list[Path]:
        """End the trial; the files of it, none where nothing is recorded."""
        record, self.record = self.record, None
        if record is None:
            return []
        self._loop.dismiss(record)
        with still(self._loop):  # no tick while the last row is written
            record.close()
        return record.paths

    def _free(self, stem: str) -> Path:
        """A name that is not taken: the second of one second is number 2."""
        paths = (self._folder / f"{stem}{'' if n == 1 else f'_{n}'}.csv" for n in count(1))
        return next(path for path in paths if not (path.exists() or orders_path(path).exists()))

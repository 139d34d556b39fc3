"""A file that only grows, by whole lines."""

from __future__ import annotations

import os
from pathlib import Path

from ..data import DataError


class Appender:
    """A new text file to which lines are added, each in one piece: killed at any moment, it ends with a whole line."""

    def __init__(self, path: Path) -> None:
        """Make the file.

        Raises:
            DataError: it is there already, or cannot be made.
        """
        self._path, self._size = path, 0
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except FileExistsError:
            raise DataError(f"{path}: is there already; a recording overwrites nothing") from None
        except OSError as error:
            raise DataError(f"{path}: cannot be written: {error.strerror}") from error

    def add(self, line: str) -> None:
        """Add a line, or several that belong together.

        Raises:
            DataError: there is no room; the file is then as it was.
        """
        data = line.encode() + b"\n"
        try:
            written, reason = os.write(self._file, data), "no room left"
        except OSError as error:
            written, reason = 0, error.strerror or "it failed"
        if written == len(data):
            self._size += written
            return
        os.ftruncate(self._file, self._size)
        raise DataError(f"{self._path}: cannot be written: {reason}; what was written before is whole")

    def close(self) -> None:
        """No more lines."""
        os.close(self._file)

    def withdraw(self) -> None:
        """Remove the file again."""
        self.close()
        self._path.unlink(missing_ok=True)

"""The record of a search by generations: what each scored, appended as it comes, read back after a kill.

The search itself is a function of its seed and of these numbers, so replaying them restores it bit for
bit, and nothing of the strategy's inner state is ever stored.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, Self

import numpy as np

from ..data import Array
from ..files import write_whole
from .resume import ResumeError, begin_anew


@dataclass
class Record:
    """Generations in order; the one mutable thing of a search.

    Attributes:
        old: numbers of an earlier process that were not used yet.
        stream: where new ones go; None keeps nothing.
        began: start of the clock, seconds already spent included.
    """

    old: Array
    stream: BinaryIO | None
    began: float = field(default_factory=time.perf_counter)

    @staticmethod
    def open(path: Path | None, digest: str) -> Record:
        """Read `path` where it holds this problem; start afresh where there is none.

        Raises:
            ResumeError: the file belongs to another problem.
        """
        if path is None:
            return Record(np.zeros(0), None)
        head = (json.dumps({"digest": digest}) + "\n").encode()
        if not path.exists() or path.stat().st_size < len(head):
            write_whole(path, head)
            return Record(np.zeros(0), path.open("ab"))
        whole = path.read_bytes()
        if not whole.startswith(head):
            if not whole.startswith(b'{"digest": '):
                begin_anew(path)
                return Record.open(path, digest)
            raise ResumeError(f"{path} belongs to another problem; choose another output folder")
        numbers = np.frombuffer(whole[len(head) : len(head) + (len(whole) - len(head)) // 8 * 8], dtype="<f8").copy()
        return Record(numbers, path.open("r+b"))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self.stream is not None:
            self.stream.close()

    def next(self, size: int, score: Callable[[], tuple[Array, float]]) -> tuple[Array, float, float]:
        """Scores of the next generation, its validation and the seconds so far; `score` is asked where none is kept.

        A generation is kept as (seconds, validation, scores...); one that was cut short by a kill is scored anew.
        """
        if self.old.size >= size + 2:
            row, self.old = self.old[: size + 2], self.old[size + 2 :]
            self.began = time.perf_counter() - float(row[0])
            self._at(8 * (size + 2))
            return row[2:], float(row[1]), float(row[0])
        if self.stream is not None and self.old.size:
            self.stream.truncate(self.stream.tell() or None)
        self.old = np.zeros(0)
        costs, validation = score()
        seconds = time.perf_counter() - self.began
        if self.stream is not None:
            try:
                self.stream.write(np.array([seconds, validation, *costs], dtype="<f8").tobytes())
                self.stream.flush()
            except OSError as error:
                raise OSError(error.errno, error.strerror, self.stream.name) from error
        return costs, validation, seconds

    def _at(self, step: int) -> None:
        """Move past a generation that was read back, so that a torn one after it is overwritten."""
        if self.stream is not None:
            if self.stream.tell() == 0:
                self.stream.readline()
            self.stream.seek(step, os.SEEK_CUR)

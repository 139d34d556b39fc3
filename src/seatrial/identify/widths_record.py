"""Scores of the widths of a prior, kept beside a checkpoint: a run that was killed does not ask again."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

from ..files import write_whole
from .resume import ResumeError, begin_anew


@dataclass
class Scores:
    """What each width has scored; the one mutable record of the choice.

    Attributes:
        path: file of the scores, or None to keep nothing.
        digest: fingerprint of the problem they belong to.
        found: score by width; infinite where the model blew up.
    """

    path: Path | None
    digest: str
    found: dict[float, float] = field(default_factory=dict[float, float])

    @staticmethod
    def beside(checkpoint: Path | None, digest: str) -> Scores:
        """Read what stands beside `checkpoint` where it is of this problem; start afresh where there is none.

        Raises:
            ResumeError: the file belongs to another problem.
        """
        if checkpoint is None:
            return Scores(None, digest)
        path = checkpoint.with_suffix(".widths.json")
        if not path.exists():
            return Scores(path, digest)
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
            found = {float(width): float(score) for width, score in told["scores"]}
            same = told["digest"] == digest
        except (ValueError, KeyError, TypeError):
            begin_anew(path)
            return Scores(path, digest)
        if not same:
            raise ResumeError(f"{path} belongs to another problem; choose another output folder")
        return Scores(path, digest, found)

    def note(self, width: float, score: float) -> None:
        """Note what a width has scored, and write all in one step."""
        self.found[width] = score
        if self.path is None:
            return
        told = {"digest": self.digest, "scores": list(self.found.items())}
        write_whole(self.path, json.dumps(told))  # Infinity is JSON of Python's own

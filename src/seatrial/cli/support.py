"""Progress of fits in words, and how a run of `identify` is stopped and resumed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from ..identify import StudyError
from ..workflow import RequestError as UsageError
from ..workflow.request import DEGREE, Stopped, make_folder, obeyed, positive, separate
from ..workflow.request import ship_of as read_ship
from .render import emit, figure, live, note, say, show_table

__all__ = ["DEGREE", "Spoken", "UsageError", "claimed", "emit", "figure", "fitting", "live", "make_folder", "note",
           "obeyed", "positive", "read_ship", "say", "separate", "show_table"]  # fmt: skip

# Where no terminal is attached: a line for every so many rows of a history, or after a silence of so many seconds.
_EVERY, _SILENCE = 10, 10.0


class Spoken:
    """Progress of fits in words.

    Args:
        say: takes each line.
        words: of iteration, objective and validation (or NaN).
        seldom: say only the first row, every tenth, and one after a silence.
    """

    def __init__(
        self, say: Callable[[str], object], words: Callable[[int, float, float], str], seldom: bool = False
    ) -> None:
        self.stage, self._words, self._seldom, self._said = say, words, seldom, -math.inf

    def __call__(self, iteration: int, objective: float, validation: float) -> None:
        """A row of the history."""
        now = time.monotonic()
        if self._seldom and iteration != 1 and iteration % _EVERY and now - self._said < _SILENCE:
            return
        self._said = now
        self.stage(self._words(iteration, objective, validation))


@contextmanager
def fitting(study: Path, again: str) -> Generator[None, None, None]:
    """Say what to do after Ctrl-C, and which file it is that an estimator refuses."""
    try:
        yield
    except KeyboardInterrupt:
        raise Stopped(f"interrupted; run the same command again{again}") from None
    except StudyError as error:  # of an estimator, which knows no file
        raise StudyError(str(error) if str(study) in str(error) else f"{study}: {error}") from None


def claimed(out: Path, page: str, digest: str, name: str) -> tuple[bool, bool]:
    """Whether the folder of a study with a page of its own is new, and whether the study is done in it."""
    from ..study.store import claim

    fresh, done = claim(out, digest, name), (out / page).exists()
    if done:
        note(f"{out}: this study is done already, with the same data and settings; nothing was run")
    return fresh, done

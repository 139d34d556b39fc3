"""Breaches too rare to be counted: their probability by levels, and what the error of the ship adds to it.

Encounters and weather are points of a cube (`encounters.space`), so of standard normal space, which subset simulation
samples level by level (`campaign.rare.subset`).  The ship is one of many draws of its posterior, in the order of their
widest direction along one more side of the cube, so that near points have ships that are alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from ...campaign.rare.levels import cube_of
from ...campaign.rare.subset import MOST, SHARE, beginning, estimate, onward
from ...core.errors import RequestError
from ...core.files import write_whole
from ...core.records import Limits, digest
from ...core.values import dataclass
from ...data import Array
from ...encounters.rules import Judged
from ...report.blocks import Body, bullets, number, table
from .. import SILENT, Sink

SHIPS = 32768
"""Draws of the ship among which one is taken: so many that the rare ones by which a breach comes are among them."""
UNDER_WAY = ".levels"
"""Folder, in that of a case, of what a search by levels has sailed; it is there until the search ends."""
_NO_PART = 10.0
"""Margin of a rule that does not apply in a run: farther off than any run that it applies to."""

Breach = Literal["contact", "8(a)", "8(b)", "8(d)", "13", "14", "15", "16", "17(a)(i)", "17(b)", "17(c)", "18"]

Margin = Callable[[Array, Array], Array]
"""Of points of the cube and places among the ships, 0 to 1 (NaN: as fitted): how far each run is from the breach,
below zero in it, NaN where the model failed."""


@dataclass(frozen=True, kw_only=True)
class Seldom:
    """What is sought: contact, or a rule by its number, with so many runs in each level."""

    breach: Breach = "contact"
    runs: Annotated[int, Limits(least=10 * SHARE, most=1_000_000)] = 1000


@dataclass(frozen=True)
class Reached:
    """Probability of a breach.

    Attributes:
        probability: estimate; where `reached` is false, that of the last level, which is above it.
        low, high: interval of confidence .95; 0 and 1 where it was not reached.
        runs: of all levels.
    """

    probability: float
    low: float
    high: float
    runs: int
    reached: bool


@dataclass(frozen=True)
class Rarely:
    """The same with the ships that the posterior holds possible, and on the ship as it was fitted.

    Attributes:
        case: digest of the case.
        fitted: on the ship as its file has it.
        drawn: on ships of the posterior; None without one.
    """

    case: str
    fitted: Reached
    drawn: Reached | None


def margins(own: Sequence[Judged], breach: str) -> Array:
    """How far runs are from a breach: least gap of hulls [m] for contact, else the least margin of the rule."""
    if breach == "contact":
        return np.min([one.gap for one in own], axis=0)
    said = np.array([one.margins[breach] for one in own])
    return np.where(np.isfinite(said), said, _NO_PART).min(axis=0)


def ordered(draws: Array) -> Array:
    """Draws of a ship in the order of their widest direction, in units of their spread; shape (draws, parameters)."""
    spread = draws.std(axis=0)
    scaled = (draws - draws.mean(axis=0)) / np.where(spread > 0.0, spread, 1.0)
    widest = np.linalg.svd(scaled, full_matrices=False)[2][0]
    widest = widest * np.sign(widest[np.abs(widest).argmax()])  # either sign is one
    return draws[np.argsort(scaled @ widest, kind="stable")]


def rarely(
    margin: Margin, asked: Seldom, dims: int, *, case: str, seed: int, posterior: bool, kept: Path | None = None,
    sink: Sink = SILENT,
) -> Rarely:  # fmt: skip
    """Probability of a breach with ships as fitted, and drawn.

    Both searches ask for their runs at once, as a hundred runs take nearly as long as two hundred.

    Args:
        dims: sides of the cube of encounters and weather.
        kept: a folder for the margins of runs that are done, so that a search which is cut off goes on with the next
            ones; the caller removes it.

    Raises:
        RequestError: a number of runs that levels do not take, or nearly all runs as far from the breach.
    """
    if asked.runs % SHARE:
        raise RequestError(f"rare.runs is {asked.runs}; a level takes a multiple of {SHARE}, such as 1000")
    searches = [_reached(asked, seed, dims, sink, "ship as fitted")]
    if posterior:
        searches.append(_reached(asked, seed + 1, dims + 1, sink, "ships drawn"))
    found = _together(searches, lambda points: _remembered(margin, points, dims, case, kept))
    return Rarely(case, found[0], found[1] if posterior else None)


_Search = Generator[Array, Array, Reached]


def _together(searches: Sequence[_Search], margin: Callable[[Array], Array]) -> list[Reached]:
    """What searches find that are answered in one go, of points as wide as the widest; the last side is the ship's."""
    waiting, found = {k: next(one) for k, one in enumerate(searches)}, dict[int, Reached]()
    while waiting:
        widest = max(points.shape[1] for points in waiting.values())
        answers = margin(np.concatenate([np.pad(points, ((0, 0), (0, widest - points.shape[1])), constant_values=np.nan)
                                         for points in waiting.values()]))  # fmt: skip
        edges = np.cumsum([len(points) for points in waiting.values()])[:-1]
        for k, some in zip(tuple(waiting), np.split(answers, edges), strict=True):
            try:
                waiting[k] = searches[k].send(some)
            except StopIteration as ended:
                found[k] = ended.value
                del waiting[k]
    return [found[k] for k in range(len(searches))]


def _remembered(margin: Margin, points: Array, dims: int, case: str, kept: Path | None) -> Array:
    """Margins of points, sailed or as they were kept."""
    place = None if kept is None else kept / digest([case, points.tobytes().hex()])
    if place is not None and place.is_file() and len(known := place.read_bytes()) == 8 * len(points):
        return np.frombuffer(known)
    cube = cube_of(points)
    found = margin(cube[:, :dims], cube[:, dims] if cube.shape[1] > dims else np.full(len(cube), np.nan))
    if place is not None:
        place.parent.mkdir(exist_ok=True)
        write_whole(place, np.asarray(found, dtype=np.float64).tobytes())
    return found


def _reached(asked: Seldom, seed: int, dims: int, sink: Sink, name: str) -> _Search:
    levels = [(yield from beginning(seed, asked.runs, dims))]
    while not levels[-1].last and len(levels) < MOST:
        if levels[-1].stalled:
            raise RequestError(f"rare.breach: {asked.breach}: nine tenths of level {len(levels)} are equally far from "
                               "it, or their models fail; other roles or more rare.runs")  # fmt: skip
        least = math.prod(one.share for one in levels)
        sink.note(f"{name}: level {len(levels)} of {MOST} at most is done, {asked.breach} is less probable than "
                  f"{number(least, 2)}")  # fmt: skip
        levels.append((yield from onward(seed, len(levels), levels[-1])))
    runs = asked.runs + (len(levels) - 1) * (asked.runs - asked.runs // SHARE)
    if not levels[-1].last:
        return Reached(math.prod(one.share for one in levels[:-1]), 0.0, 1.0, runs, False)
    found = estimate(levels)
    return Reached(found.probability, *found.interval, runs, True)


def told(found: Rarely, asked: Seldom) -> Body:
    """A table for a page, and what the ship's error adds."""
    rows = [_row("ship as fitted: encounters, weather, conducts, stack", found.fitted)]
    said = ["without a posterior the ship is taken as known exactly"]
    if found.drawn is not None:
        rows.append(_row("the same, ships drawn from the posterior", found.drawn))
        said = [_split(found.fitted, found.drawn)]
    what = asked.breach if asked.breach == "contact" else f"Rule {asked.breach}"
    said.append("a probability by encounter as drawn here, by subset simulation; its interval held in 90 "
                "of 100 repetitions of known cases")  # fmt: skip
    head = (f"probability of {what}", "a run", "from", "to (95 %)", "runs")
    return table(head, rows, words=(0,), wide=True) + bullets(said)


def _row(name: str, one: Reached) -> tuple[str, ...]:
    least = "" if one.reached else "below "
    return name, f"{least}{number(one.probability, 2)}", number(one.low, 2), number(one.high, 2), str(one.runs)


def _split(fitted: Reached, drawn: Reached) -> str:
    if not (fitted.reached and drawn.reached):
        return "one of both was not reached in the levels there are: what the ship's error adds is not told"
    added = drawn.probability - fitted.probability
    apart = fitted.high < drawn.low or drawn.high < fitted.low
    sure = "the intervals lie apart" if apart else "less than the intervals tell apart"
    return (f"{number(fitted.probability, 2)} are the stack's among these encounters; the error of the ship adds "
            f"{number(added, 2)} ({sure})")  # fmt: skip

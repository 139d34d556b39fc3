"""What stands behind the model of a case's ship in the manoeuvres of the case: bands, what trials tested, its card.

The band of the model is that of what the case asks it for, how near ships come: the same encounters on ships drawn from
the posterior and on the ship as it was fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...belief.bands.calibration import beside
from ...core.errors import SeatrialError
from ...data import Array
from ...encounters import Tracks
from ...encounters.rules import Judged
from ...environment import through_water
from ...report.blocks import Body, bullets, number, table
from ...ships import Ship
from ...study.grounds import DRIFT, Grounds
from ...study.store import read_summary
from ...validate.fitness import Fitness
from ...validate.requirements import Table
from ..judging import requirements
from .claimed import Case

_LEVEL = 0.95


def grounds_of(path: Path) -> Grounds | None:
    """What the trials of a fit tested; None of a ship without a fit, or of one of before that was kept."""
    try:
        found = read_summary(path.parent).grounds
    except SeatrialError:
        return None
    return found if found.tested else None


def required(ship: Ship) -> Table | None:
    """A ship by what collision avoidance asks of a model; None for one that cannot be judged so."""
    try:
        return requirements(ship)
    except SeatrialError:
        return None


def closest(own: Sequence[Judged]) -> Array:
    """Least gap of the own hull to any other [m], shape (runs,)."""
    return np.min([np.atleast_1d(one.gap) for one in own], axis=0)


def untested(tracks: Tracks, grounds: Grounds | None, around: tuple[Array, Array]) -> list[str]:
    """By run, the channels with which the own ship leaves what the trials of its fit tested; empty where it does not.

    Args:
        around: current north and east of each run [m/s].
    """
    psi, u, v_m = (np.atleast_2d(one[..., 0, :]) for one in (tracks.psi, tracks.u, tracks.v_m))
    if grounds is None:
        return [""] * len(psi)
    north, east = (np.atleast_1d(one)[:, None] for one in around)
    u, v_m = through_water(u, v_m, north, east, np.cos(psi), np.sin(psi))
    r = np.gradient(np.unwrap(psi), tracks.t, axis=-1)
    found: list[str] = []
    for k in range(len(psi)):
        one = {"u": u[k], "v_m": v_m[k], "r": r[k], DRIFT: np.arctan2(-v_m[k], u[k])}
        names = {channel for out in grounds.left_by(one) for channel in (out.channel, *(x for x, _ in out.beside))}
        found.append(", ".join(sorted(names)))
    return found


def band(found: Case) -> tuple[float, float] | None:
    """How much nearer and farther drawn ships pass than the ship as fitted, in `_LEVEL` of the runs [m]."""
    pairs = [(a, b) for part in found.parts for a, b in zip(part.closest, part.plain_closest, strict=False)
             if a is not None and b is not None]  # fmt: skip
    if len(pairs) < 20:
        return None
    apart = np.array([a - b for a, b in pairs])
    low, high = np.quantile(apart, (0.5 - 0.5 * _LEVEL, 0.5 + 0.5 * _LEVEL))
    return float(low), float(high)


def told(found: Case, path: Path) -> Body:
    """Lines of the page about the model of a fitted ship.

    Args:
        path: of its file; a ship without a fit has none of this.
    """
    if not found.posterior:
        return ()
    said = [_widened(path)]
    if (edges := band(found)) is not None:
        said.append(f"band of the model here: ships that are drawn pass {number(edges[0])} to {number(edges[1])} m "
                    f"farther off (nearer below zero) than the ship as fitted, in {100.0 * _LEVEL:g} % of the runs")
    runs = [one for part in found.parts for one in part.untested]
    if grounds_of(path) is None:
        said.append("what the trials of its fit tested was not kept: fit it again to know where these runs leave it")
    elif runs:
        out = [one for one in runs if one]
        names = ", ".join(sorted({channel for one in out for channel in one.split(", ")}))
        said.append(f"validity here: {len(out)} of {len(runs)} runs leave what the trials of its fit tested"
                    f"{f', in {names}' if names else ''}, by its motion through the water")  # fmt: skip
    return bullets(said) + _card(path)


def _widened(path: Path) -> str:
    """Whether draws have what trials left out of the fit say of its form."""
    if beside(path).is_file():
        return "draws are as wide as trials that were left out of the fit need them (seatrial calibrate)"
    return ("draws are of the fit alone: how wrong the form of its model is they do not have (seatrial calibrate "
            f"{path} widens them by trials left out)")  # fmt: skip


def _because(one: Fitness) -> str:
    """The limit that decides, and why."""
    found = next((each for each in one.found if each.verdict == one.verdict), None)
    return "" if found is None else f": {found.limit.about}, {found.reason}"


def _card(path: Path) -> Body:
    """Verdicts of its card, and where the whole is."""
    from ..evidence.card import card

    try:
        found = card(str(path)).result
    except SeatrialError as error:
        return bullets((f"its card cannot be made: {error}",))
    rows = [(one.title, f"{one.verdict}{_because(one)}") for one in found.uses]
    rows += [(title, f"not judged: {why}") for title, why in found.unjudged.items()]
    where = bullets((f"its card, whole: seatrial card {path}", *found.missing[:2]))
    return where + (table(("fitness by unseen trials", ""), rows, words=(0, 1), wide=True) if rows else ())

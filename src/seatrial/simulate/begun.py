"""States for a prediction to start from where a trial did not log all six: read, else made of what was read.

What is made up is no measurement: it is where the search for an initial state begins, and no residual compares with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..core.once import by_identity
from ..data import Array, DataError, Trial, unwrapped
from ..data.prepare import derived, measured
from ..models import STATES

# A slope is taken over this share of a trial to either side: what it is for is a first value.
_SHARE = 0.02
# Headings tell a current apart where their terms differ from a common one by this share.
_TOLD = 0.1


def untold(trial: Trial) -> tuple[str, ...]:
    """States of which the trial has no reading, or only one that is made from others.

    Raises:
        DataError: the trial tells nothing of the speed, or nothing of the turning.
    """
    lacking = tuple(name for name in STATES if not measured(trial, name))
    track = "x" not in lacking and "y" not in lacking
    if "u" in lacking and not track:
        raise DataError(f"{trial.name}: no channel {', '.join(lacking)}; log the speed u, or positions x and y")
    if "psi" in lacking and "r" in lacking and not track:
        raise DataError(f"{trial.name}: no channel {', '.join(lacking)}; log the heading psi, or the rate of turn r")
    return lacking


def too_little(trial: Trial) -> str:
    """Why no prediction can start from what the trial tells; empty where one can."""
    try:
        untold(trial)
    except DataError as error:
        return str(error).removeprefix(f"{trial.name}: ")
    return ""


@by_identity
def begun(trial: Trial) -> tuple[Array, NDArray[np.bool_]]:
    """States to start from, and the rows at which a prediction may start.

    These are the rows in which each state that the trial tells was read; where no two have all of them, as of
    instruments that report by turns, the rows between the first and the last readings, with straight lines between
    readings.  What is made from others stands as it is, gaps bridged.  Positions that are not told begin at zero, a
    heading as the course over ground or the integral of r, a rate of turn as the slope of the heading, velocities as
    those of the track, and a sway without a track at zero.

    Returns:
        Shapes (rows, 6), heading unwrapped, NaN for a gap of a state that is told, and (rows,).

    Raises:
        DataError: as of `untold`.
    """
    lacking = untold(trial)
    told = {name: unwrapped(trial[name]) if name == "psi" else np.asarray(trial[name])
            for name in STATES if name not in lacking}  # fmt: skip
    read = np.isfinite(np.column_stack(list(told.values())))
    good = np.asarray(read.all(axis=1))
    if good.sum() < 2 and lacking:
        told = {name: _line(trial.t, values) for name, values in told.items()}
        good = np.asarray(np.maximum.accumulate(read).all(axis=1) & np.maximum.accumulate(read[::-1])[::-1].all(axis=1))
    others = {name: trial[name] for name in lacking if name in derived(trial) and np.isfinite(trial[name]).any()}
    made = _made(trial.t, {**told, **others})
    states = np.column_stack([told.get(name, made[name]) for name in STATES])
    states.flags.writeable = good.flags.writeable = False  # shared by all that ask
    return states, good


def drift(trials: Iterable[Trial]) -> tuple[float, float]:
    """A current north and east [m/s] that all trials share, as their sway over ground says it.

    A ship that turns sways against its turn, about as its rate of turn; what it sways besides follows the heading as a
    current does: v_m = a r + C_e cos psi - C_n sin psi, by least squares over all rows.  Zero where the headings are
    too alike to tell.
    """
    rows = [states[good] for states, good in map(begun, trials)]
    _, _, psi, _, sway, r = np.concatenate(rows).T
    terms = np.column_stack([r, -np.sin(psi), np.cos(psi)])
    size = np.sqrt((terms**2).mean(axis=0))
    terms = terms / np.where(size > 0.0, size, 1.0)
    found, _, rank, _ = np.linalg.lstsq(terms, sway, rcond=_TOLD)
    if rank < np.count_nonzero(size):
        return 0.0, 0.0
    north, east = (found / np.where(size > 0.0, size, 1.0))[1:]
    return float(north), float(east)


def _made(t: Array, told: Mapping[str, Array]) -> dict[str, Array]:
    """Every state from what is told of it or of others, gaps bridged, each shape (rows,)."""
    known = {name: _line(t, values) for name, values in told.items()}
    none = np.zeros(t.size)
    north, east = (_slope(t, told[name]) if "x" in known and "y" in known else none for name in ("x", "y"))
    if "psi" in known:
        psi = known["psi"]
    elif "x" in known and "y" in known:
        psi = np.unwrap(np.arctan2(east, north))
    else:
        psi = np.append(0.0, np.cumsum(0.5 * np.diff(t) * (known["r"][1:] + known["r"][:-1])))
    made = {"x": none, "y": none, "psi": psi, "u": north * np.cos(psi) + east * np.sin(psi),
            "v_m": east * np.cos(psi) - north * np.sin(psi), "r": _slope(t, told.get("psi", psi))}  # fmt: skip
    return {**made, **known}


def _line(t: Array, values: Array) -> Array:
    """Straight lines between readings, the first and the last held."""
    good = np.isfinite(values)
    return np.interp(t, t[good], values[good])


def _slope(t: Array, values: Array) -> Array:
    """Slope between the rows some way before and after, both between the first reading and the last."""
    read = np.flatnonzero(np.isfinite(values))
    if read.size < 2:
        return np.zeros(t.size)
    line, rows, reach = _line(t, values), np.arange(t.size), max(round(_SHARE * t.size), 1)
    before = np.clip(rows - reach, read[0], read[-1] - 1)
    after = np.clip(rows + reach, before + 1, read[-1])
    return np.asarray((line[after] - line[before]) / (t[after] - t[before]))

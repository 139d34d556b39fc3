"""What recordings share that nobody recorded, and what they show of their instruments before a fit.

Current: estimated about zero, unless one is on record or all head one way.

Compass.  Its deviation is estimated where the sway under way shows one (`data.check.symmetry.swung`).

Antenna.  Positions and speeds of one that is far from midship agree with each other, and a fit takes its sway for that
of the hull: told where the pivot of the turns is none of a ship of this length (`data.check.pivot`), and not estimated,
as no equation of sway and yaw tells one point of a hull from another.

Errors that the logs show without any model (`identify.diagnosis.blame.witness`) are estimated from the first fit on:
one that is held at zero throws numbers of the ship so far off that no step from there finds it (a heading 4 deg off
read as -2.7 deg, and the flow at the rudder was fourteen times its value).

Smoothed channels.  The noise of a sensor is read off the roughness of its log (`identify.noise`).  Where the logger has
passed the heading through a filter, little of that is left, and it would weigh hundreds of times more than the track:
the fit then follows it alone.  No compass and no gyro reads to a hundredth of a degree on a craft that turns about (the
carriage of a tank does, whose models turn little meanwhile).  Where one seems to, track and heading count as far as a
model can be right at all, a two-hundredth of what they change by in a prediction; speeds and rates of such a log are
made of them by the filter, and are no second measurement.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from ...data import Trial
from ...data.check.pivot import pivot, told
from ...data.check.symmetry import swung
from ...data.prepare.made import measured
from ...identify.diagnosis.blame.witness import witnesses
from ...identify.noise import channel, noise
from ...identify.trajectory.suspects import Suspect

_ONE_WAY = 0.8
"""Mean of the unit vectors of all headings from which on a current cannot be told from the ship's own speed."""

_CURRENT = 0.5, 0.25
"""Prior of a current: a tide at sea [m/s], and on a pond at most a share of the speed of the ship."""

_BIAS, _DEVIATION = 0.1, 0.2
"""Priors of the heading's bias and of each half of a cycle of deviation [rad]: a compass that nobody has swung."""

_WIDE = 2.0
"""Prior of an error that the logs show, over its size there: so wide that the fit decides."""

_PLACES = ("x", "y", "psi")
_FINEST, _TURNED, _RIGHT = 2e-4, 0.5, 5e-3
"""Noise of the best heading, the turn in a prediction [rad], and how right a model is, as a share of the motion."""


def shared(
    trials: Sequence[Trial], L_pp: float, clock: float, known: Iterable[Suspect] = ()
) -> tuple[dict[str, float], tuple[str, ...]]:
    """Standard deviations of a current and of errors of instruments that all trials share, SI units; and notes.

    Args:
        trials: the recordings.
        L_pp: length of the ship [m].
        clock: time in which it covers its length in these trials [s].
        known: errors that a fit can estimate.
    """
    size = _current(trials, L_pp / clock)
    out: dict[str, float] = {"current.north": size, "current.east": size} if size else {}
    found = swung(trials)
    if found is not None and found.told:
        out |= {"bias.psi": _BIAS, "deviation.north": _DEVIATION, "deviation.east": _DEVIATION}
    notes: list[str] = []
    log = witnesses(trials, L_pp)
    for one in known:
        said = log.get(one.name)
        # a heading that deviates is off already
        if said is None or not said.leads or one.name in out or ("bias.psi" in out and one.name == "bias.psi_speed"):
            continue
        kind, _, way = one.name.partition(".")
        both = (f"{kind}.north", f"{kind}.east") if way in ("north", "east") else (one.name,)
        out |= dict.fromkeys(both, _WIDE * abs(said.size))
        notes.append(f"{one.name}: the logs show {one.words} of {said.size / one.per:.2g} {one.unit} by themselves; "
                     "it is estimated")  # fmt: skip
    return out, (*notes, *_antenna(trials, L_pp))


def _antenna(trials: Sequence[Trial], L_pp: float) -> tuple[str, ...]:
    """What `check` cannot say of logs that do not tell the length of their ship."""
    found = pivot(trials, L_pp)
    place = found.antenna(L_pp) if found else None
    if found is None or place is None:
        return ()
    what, evidence, remedy = told(found, L_pp, place)
    return (f"{what} ({evidence}); {remedy}",)


def _current(trials: Sequence[Trial], speed: float) -> float:
    """Standard deviation of each component of a current that was not recorded [m/s].

    Zero where one is on record, and where all head one way, as in a basin: there it is a part of the speed.  Headings
    that are not on record say nothing of a current.
    """
    if any("U_C" in trial or "psi" not in trial for trial in trials):
        return 0.0
    if abs(np.nanmean(np.exp(1j * np.concatenate([trial["psi"] for trial in trials])))) > _ONE_WAY:
        return 0.0
    most, share = _CURRENT
    return min(most, share * speed)


def smoothed(trials: Sequence[Trial], window: float) -> dict[str, float]:
    """Scale of the errors of each state that counts where the heading was smoothed, SI units; empty where it was not.

    Args:
        trials: the recordings.
        window: length of a prediction [s].
    """
    levels = noise(trials)
    moves = {name: _moves([one for one in trials if measured(one, name)], name, window) for name in levels}
    if not levels.get("psi", math.inf) < _FINEST or moves["psi"] < _TURNED:
        return {}
    if set(_PLACES) <= set(levels):
        levels = {name: levels[name] for name in _PLACES}
    if {"x", "y"} <= set(moves):  # one receiver
        moves |= dict.fromkeys("xy", math.hypot(moves["x"], moves["y"]) / math.sqrt(2.0))
    return {name: math.hypot(level, _RIGHT * moves[name]) for name, level in levels.items()}


def _moves(trials: Sequence[Trial], name: str, window: float) -> float:
    """Root mean square of what a state changes by in a prediction."""
    changes = [np.zeros(0)]
    for trial in trials:
        values, far = channel(trial, name), max(round(window / trial.dt), 1)
        changes.append(np.asarray(values[far:] - values[:-far], dtype=np.float64))
    every = np.concatenate(changes)
    known = every[np.isfinite(every)]
    return float(np.sqrt(np.mean(known**2))) if known.size else 0.0

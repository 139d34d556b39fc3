"""The sense of the rudder: whether it, or everything else, counts to the other side.

A trial accuses its rudder where the ship turns against it.  That a rudder of the other sign is the cause is told only
where nothing else does it as well: a rudder that is late (`effect`) or stuck, and a motion whose axes are mirrored (x
east, y north, headings and rates counterclockwise), after which a right rudder seems to be the wrong one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ....core.values import dataclass, replace
from ... import Array, Trial, unwrapped
from ...prepare import Remedy, Step, complete, integral, segments
from ..relations import has, length_of, window_of
from ..repairs import times
from ..sensors import Fault
from ..track import track_miss
from .effect import Effect, ahead, effect, windows
from .rudder import stuck_faults

# Rate of turn r L/u that a radian of a held rudder makes at least.
_TURNS = 0.1
# Standard errors from which on a moving rudder accuses, or clears, itself.
_CERTAIN = 4.0
# A witness says what fits so much better, and misses the other by so much [rad].
_FITS, _MISSES = 0.5, 0.2


@dataclass(frozen=True)
class Sensed:
    """Faults of each trial by its name, and the trials as far as they could be repaired."""

    faults: dict[str, list[Fault]]
    trials: list[Trial]


def sense_faults(trials: Sequence[Trial]) -> Sensed:
    """What trials of one ship say of the sense of `delta`, heard together."""
    told = {trial.name: [*rudder_faults(trial)] for trial in trials}
    wrong = [trial for trial in trials if any(one.severity == "error" for one in told[trial.name])]
    if not wrong:
        return Sensed(told, [*trials])
    some = [trial for trial in trials if has(trial, "delta", "r") and "u" in trial]
    shown = effect(some)
    excused = {step.trials[0] for fault in stuck_faults(trials) if isinstance(fault.remedy, Remedy)
               for step in fault.remedy.steps}  # fmt: skip
    if shown is not None and shown.late:
        excused |= {trial.name for trial in wrong}
    wrong = [trial for trial in wrong if trial.name not in excused]
    others = any(_cleared(trial) for trial in trials)
    alike = effect([trial for trial in wrong if trial in some]) if others else shown
    remedy, axes = _verdict(wrong, trials, alike, others) if wrong else (None, "")
    accused = {trial.name for trial in wrong}
    for name, faults in told.items():
        told[name] = [_with(one, remedy, axes) if one.severity == "error" else one for one in faults
                      if one.severity != "error" or name in accused]  # fmt: skip
    return Sensed(told, [remedy.repair(trial) for trial in trials] if remedy and axes else [*trials])


def _with(fault: Fault, remedy: Remedy | None, axes: str) -> Fault:
    """An accusation with another remedy, of the rudder or of the axes of the motion."""
    if not axes:
        return replace(fault, remedy=remedy or fault.remedy)
    return replace(fault, where=axes, what="axes of the motion are mirrored: the rudder seems to turn it to port",
                   remedy=remedy or fault.remedy, kind="axes", key="axes")  # fmt: skip


def _verdict(
    wrong: Sequence[Trial], trials: Sequence[Trial], shown: Effect | None, others: bool
) -> tuple[Remedy | None, str]:
    """The remedy of accusations, in words where several causes are left, None where it is the sign; mirrored axes."""
    sign = "sign = -1 under delta in the mapping, if it counts to port"
    if others and not (shown and shown.opposed):
        return Remedy(f"{sign} in these trials and not in the others; or it was stuck or exchanged there"), ""
    if shown is not None and not shown.opposed:
        return Remedy(f"{sign}; or it is late or stuck: the yaw shows neither clearly"), ""
    if not any("psi" in trial for trial in wrong):
        return Remedy("sign = -1 in the mapping, under delta or under r: one of the two counts to port"), ""
    witness, steps = _witness(trials)
    if witness > 0 or others:
        return None, ""
    if witness < 0:
        return Remedy(steps=steps), ", ".join(name for name in ("x", "y", "psi", "v_m", "r") if name in trials[0])
    return Remedy(f"{sign}; or x is east, y is north, and psi and r count counterclockwise: then turn these"), ""


def _witness(trials: Sequence[Trial]) -> tuple[float, tuple[Step, ...]]:
    """1 where something else says that the motion is right, -1 where it is mirrored, with what turns it back."""
    for judge in (_by_course, _by_wind):
        misses = np.array([found for trial in trials if (found := judge(trial)) is not None])
        if misses.size:
            as_told, east, west = np.median(misses, axis=0)
            if as_told < _FITS * min(east, west) and min(east, west) > _MISSES:
                return 1.0, ()
            if min(east, west) < _FITS * as_told and as_told > _MISSES:
                return -1.0, _turned_back(trials[0], east < west)
    if any(trial.meta.get("datum") for trial in trials):
        return 1.0, ()  # positions were made of latitude and longitude
    return 0.0, ()


def _turned_back(trial: Trial, east: bool) -> tuple[Step, ...]:
    """X east and y north, or x north and y west; headings and rates counterclockwise from x, sway to port."""
    held = {"x", "y"} <= set(trial.channels)
    names = tuple(name for name in ("psi", "v_m", "r") if name in trial)
    steps: list[Step] = []
    if held:
        steps.append(Step(do="exchange", channels=("x", "y")) if east
                     else Step(do="multiply", channels=("y",), amount=(-1.0,)))  # fmt: skip
    steps.append(Step(do="multiply", channels=names, amount=(-1.0,)))
    if east and "psi" in names:
        steps.append(Step(do="add", channels=("psi",), amount=(90.0,), unit="deg"))
    return tuple(steps)


def _by_course(trial: Trial) -> tuple[float, float, float] | None:
    """How far the course over ground [rad], clockwise from north, misses that of the track, as it is or mirrored."""
    if "gamma_G" not in trial or not has(trial, "x", "y"):
        return None
    views = trial, trial.having(x=trial["y"], y=trial["x"]), trial.having(y=-trial["y"])
    found = tuple(track_miss(view, "gamma_G") for view in views)
    return None if any(math.isnan(one) for one in found) else (found[0], found[1], found[2])


def _by_wind(trial: Trial) -> tuple[float, float, float] | None:
    """How far the winds miss each other, as a part of the true one, with the motion as it is or mirrored."""
    names = ("U_A", "gamma_A", "U_T", "gamma_T", "psi", "u", "v_m")
    if not all(name in trial for name in names):
        return None
    rows = trial.rows(complete(trial, names))
    if len(rows) < 20 or float(np.median(rows["U_T"])) <= 0.0:
        return None
    u, v, U = rows["u"], rows["v_m"], rows["U_T"]
    felt = rows["U_A"] * np.cos(rows["gamma_A"]), rows["U_A"] * np.sin(rows["gamma_A"])

    def miss(psi: Array, v: Array) -> float:
        angle = rows["gamma_T"] - psi
        off = np.hypot(felt[0] - U * np.cos(angle) - u, felt[1] - U * np.sin(angle) - v)
        return float(np.median(off) / np.median(U))

    psi = unwrapped(rows["psi"])
    return miss(psi, v), miss(0.5 * math.pi - psi, -v), miss(-psi, -v)


def _steady_turn(trial: Trial) -> tuple[float, float] | None:
    """Mean rudder [rad] and mean yaw rate [rad/s] of a run ahead with the rudder held over.

    With a constant rudder the yaw acceleration carries no information on its sign; the rate of turn does.

    Returns:
        None where the rudder varies, or stays near midships, or the ship does not turn by it.
    """
    going = ahead(trial)
    rudder, rate = trial["delta"][going], trial["r"][going]
    known = np.isfinite(rudder) & np.isfinite(rate)
    if known.sum() < 10:
        return None
    mean, spread = float(np.mean(rudder[known])), float(np.std(rudder[known]))
    if abs(mean) < max(2.0 * spread, 0.1):
        return None
    turn, swing = float(np.mean(rate[known])), float(np.std(rate[known]))
    speed = float(np.median(trial["u"][going][known]))
    least = max(0.5 * swing, _TURNS * abs(mean) * speed / (length_of(trial) or 100.0))
    return (mean, turn) if abs(turn) > least else None


def _rudder_effect(trial: Trial, length: float) -> tuple[float, float, float] | None:
    """Effect of the rudder on the yaw rate going ahead: dr/dt = a r + b delta + c, fitted over windows.

    Returns:
        b [1/s^2], b over its standard error, and the correlation of delta with r; None without data.
    """
    marked = trial.having(ahead_=np.where(ahead(trial), 1.0, np.nan))
    rows, gains, pairs = [], [], []
    for run in segments(marked, ("r", "delta", "ahead_")):
        if len(run) < 20:
            continue
        a, b = windows(run, length)
        parts = [integral(run.t, part) for part in (run["r"], run["delta"], np.ones(len(run)))]
        rows.append(np.column_stack([part[b] - part[a] for part in parts]))
        gains.append(run["r"][b] - run["r"][a])
        pairs.append(run.stack("r", "delta"))
    if not rows or sum(map(len, rows)) < 8:
        return None
    matrix, gain, both = np.concatenate(rows), np.concatenate(gains), np.concatenate(pairs)
    if float(np.std(both[:, 1])) < 1e-3 or float(np.std(both[:, 0])) <= 0:
        return None
    factor, *_ = np.linalg.lstsq(matrix, gain, rcond=None)
    left = gain - matrix @ factor
    covariance = np.linalg.pinv(matrix.T @ matrix) * float(left @ left) / max(len(gain) - 3, 1)
    error = math.sqrt(max(float(covariance[1, 1]), 1e-300))
    return float(factor[1]), float(factor[1]) / error, float(np.corrcoef(both.T)[0, 1])


def rudder_faults(trial: Trial) -> Iterator[Fault]:
    """Going ahead, a rudder above zero turns the bow to starboard; what a trial says by itself."""
    if not all(name in trial for name in ("u", "r", "delta")):
        return
    witnessed = "psi" in trial
    wrong, remedy = "rudder sign: above zero turns to port", times(-1.0, "delta")
    if not witnessed:
        wrong = "rudder sign, or that of r: above zero turns to port"
    turn = _steady_turn(trial)
    if turn is not None:
        if turn[0] * turn[1] < 0:
            yield Fault(
                "error", "delta", wrong,
                f"going ahead with {turn[0]:+.3g} rad of rudder held, r is {turn[1]:+.3g} rad/s in the mean",
                remedy, "sign", "sign",
            )  # fmt: skip
        return
    effect = _rudder_effect(trial, 0.5 * window_of(trial))
    if effect is None:
        return
    gain, certainty, _ = effect
    if certainty < -_CERTAIN:
        yield Fault(
            "error", "delta", wrong,
            f"dr/dt changes by {gain:.3g} 1/s^2 per rad of rudder going ahead, "
            f"{-certainty:.0f} standard errors below zero",
            remedy, "sign", "sign",
        )  # fmt: skip
    elif abs(certainty) < 2:
        yield Fault(
            "info", "delta", "rudder hardly shows in r",
            f"dr/dt changes by {gain:.3g} 1/s^2 per rad, {abs(certainty):.1f} standard errors",
            "do not expect rudder parameters from this trial", "quality", "weak_rudder",
        )  # fmt: skip


def _cleared(trial: Trial) -> bool:
    """Whether a trial by itself says that its rudder is right."""
    if not all(name in trial for name in ("u", "r", "delta")):
        return False
    turn = _steady_turn(trial)
    if turn is not None:
        return turn[0] * turn[1] > 0
    found = _rudder_effect(trial, 0.5 * window_of(trial))
    return found is not None and found[1] > _CERTAIN

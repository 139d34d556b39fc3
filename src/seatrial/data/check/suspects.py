"""Who is the odd one out: causes compete to explain what track, heading, rates and speeds leave over of each other.

Each suspect is a repair of the log: of a sign, of axes, of a unit, or by an amount that is fitted.  The one after which
least is left over is named, once, with its size; the log is repaired by it, and the rest is judged again.  Suspects
that explain the same are named together, unless a third witness decides (`_third_witness`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from .. import Array, Trial
from .relations import Window, has, left_over, window_of
from .repairs import Repair, Suspect, gross
from .sensors import Fault
from .sizes import FITTED, Make, length

# A gross suspect must leave at most this part of the squares, and there must be this much to explain (rms in noise).
_GROSS, _MUCH = 0.1, 4.0
# ... and these parts of what was moved, of the track and of the heading.
_ASTRAY, _TURNED = 0.04, 0.25
# A fine one must take away this part of what is beyond noise, and be this many standard errors from none.
_SHARE, _SURE = 0.5, 8.0
_QUIET = 0.3
# Suspects whose logarithm of the squares differ by less than this part of the windows are told together.
_TIE = 0.02
_ROUNDS = 3
# Without any explanation it is told from this many times the noise on.
_LOST = 60.0
_ROWS, _WINDOWS, _TRIALS = 16, 60, 6


def differing(trials: Sequence[Trial]) -> list[int]:
    """Indices of trials that fit together much worse than the others."""
    own = [_rms(found.left) if (found := left_over([trial], causes=False)) else 0.0 for trial in trials]
    usual = float(np.median([one for one in own if one] or [0.0]))
    return [k for k, one in enumerate(own) if one > max(1.5 * usual, 1.5)]


def accused(trials: Sequence[Trial]) -> tuple[list[Fault], list[Trial]]:
    """Faults of channels that some trials of one ship have in common, and the trials repaired."""
    repaired = list(trials)
    found: list[Fault] = []
    for _ in range(_ROUNDS):
        fault, repair = _worst(repaired, {key for one in found for key in (one.key,)})
        if fault is None or repair is None:
            break
        found.append(fault)
        repaired = [repair(trial) for trial in repaired]
    return found, repaired


def _worst(trials: Sequence[Trial], told: set[str]) -> tuple[Fault | None, Repair | None]:
    now = left_over(trials)
    if now is None or _rms(now.left) < _QUIET:
        return None, None
    squares = _squares(now.left)
    rivals: list[tuple[float, Suspect]] = []
    if _rms(now.left) > _MUCH and _astray(now):
        thin = [_thinned(trial) for trial in _turning_most(trials)]
        before = left_over(thin, causes=False)
        for suspect in gross(trials) if before is not None else ():
            after = left_over([suspect.repair(trial) for trial in thin], causes=False)
            if after is not None and _rms(after.left) ** 2 < _GROSS * _rms(before.left if before else now.left) ** 2:
                rivals.append((_squares(after.left), suspect))
    rivals += [pair for pair in _fine(trials, now) if pair[1].key not in told]
    if not rivals:
        return (_unexplained(now) if _gross_misfit(trials) and not told else None), None
    rivals = [pair for pair in rivals if not pair[1].last] or rivals
    rivals.sort(key=lambda pair: pair[0])
    best = rivals[0]
    even = [s for left, s in rivals if math.log(left / best[0]) < _TIE and s.key not in ("",)]
    if not np.isfinite(now.left[:, :2]).any():  # psi and r alone: either may be the one
        either = [s for _, s in rivals if s.channels in (("psi",), ("r",)) and s.kind == even[0].kind]
        even = [next((s for s in either if s.channels == one), even[0]) for one in (("psi",), ("r",))]
    even = _third_witness(trials, even)
    return _told(even, _rms(now.left), math.sqrt(best[0] / squares)), even[0].repair


def _told(even: Sequence[Suspect], rms: float, part: float) -> Fault:
    first = even[0]
    names = list(dict.fromkeys(name for one in even for name in one.channels))
    what = " or ".join(dict.fromkeys(one.what for one in even))
    rest = [said for said in dict.fromkeys(str(one.remedy) for one in even[1:]) if said != str(first.remedy)]
    remedy = replace(first.remedy, text="; or ".join(filter(None, [first.remedy.text, *rest])))
    about = [one.evidence for one in even if one.evidence]
    about.append(f"track, heading, rates and speeds differ by {rms:.3g} times their noise, by {rms * part:.2g} after")
    return Fault("error" if first.grave else "warning", ", ".join(names), what, "; ".join(about), remedy,
                 first.kind, first.key)  # fmt: skip


def _astray(now: Window) -> bool:
    """Whether what is left over is a large part of what was moved."""
    track, turn = (_rms(now.left[:, part]) / max(_rms(now.moved[:, part]), 1e-9) for part in (slice(0, 2), slice(2, 3)))
    return track > _ASTRAY or turn > _TURNED


def _gross_misfit(trials: Sequence[Trial]) -> bool:
    """Whether positions do not follow the velocities at all."""
    for trial in trials:
        if has(trial, "x", "y", "u", "psi"):
            lost = left_over([trial], causes=False)
            if lost is not None and _rms(lost.left) > _LOST:
                return True
    return False


def _unexplained(now: Window) -> Fault:
    return Fault("warning", "x, y, psi, u, v_m, r", "track, heading, rates and speeds do not fit together",
                 f"they differ by {_rms(now.left):.3g} times their noise, and no single cause explains it",
                 "check axes, reference point and time of the sensors", "quality", "inconsistent")  # fmt: skip


def _turning_most(trials: Sequence[Trial]) -> list[Trial]:
    """The few trials whose heading changes most."""

    def turned(trial: Trial) -> float:
        return -float(np.nanmax(trial["psi"]) - np.nanmin(trial["psi"])) if has(trial, "psi") else 0.0

    return sorted(trials, key=turned)[:_TRIALS]


def _thinned(trial: Trial) -> Trial:
    """Few rows a window and few windows, which is enough for signs, axes and units."""
    every = max(int(window_of(trial) / (_ROWS * trial.dt)), 1)
    return trial.rows(slice(0, _WINDOWS * _ROWS * every, every))


def _rms(left: Array) -> float:
    good = left[np.isfinite(left)]
    return float(np.sqrt(np.mean(good**2))) if good.size else 0.0


def _squares(left: Array) -> float:
    good = left[np.isfinite(left)]
    return float(good @ good) / max(good.size, 1) + 0.05


# -- suspects whose size is fitted



def _fine(trials: Sequence[Trial], now: Window) -> Iterator[tuple[float, Suspect]]:
    squares, beyond = _squares(now.left), _rms(now.left) ** 2 - 1.0
    for columns, make in FITTED:
        fitted = _fit(now, columns)
        if fitted is None:
            continue
        sizes, errors, rms = fitted
        if columns[0].endswith("_scale"):  # what is left over is counted in what was shown, not in what was true
            if sizes[0] > 0.98:
                continue
            sizes, errors = [sizes[0] / (1.0 - sizes[0])], [errors[0] / (1.0 - sizes[0]) ** 2]
        sure = max(abs(size) / error for size, error in zip(sizes, errors, strict=True))
        removed = _rms(now.left) ** 2 - rms**2
        if sure < _SURE or removed < _SHARE * beyond:
            continue
        suspect = make(trials, sizes, errors)
        if suspect is not None and max(abs(one) for one in sizes) > 0 and not columns[0].endswith("_scale"):
            suspect = _refined(trials, columns, make, sizes, errors, suspect)
        if suspect is not None:
            yield min(rms**2 + 0.05 + 0.01 * (len(columns) - 1) * squares, squares), suspect


def _refined(
    trials: Sequence[Trial], columns: Sequence[str], make: Make, sizes: list[float], errors: list[float],
    suspect: Suspect,
) -> Suspect:  # fmt: skip
    """The suspect with its size from the repaired logs: large faults are not linear."""
    after = left_over([suspect.repair(trial) for trial in trials])
    more = None if after is None else _fit(after, columns)
    if more is None:
        return suspect
    return make(trials, [a + b for a, b in zip(sizes, more[0], strict=True)], errors) or suspect


def _fit(now: Window, columns: Sequence[str]) -> tuple[list[float], list[float], float] | None:
    """Sizes of some causes, their standard errors with what is left as noise, and the rms that is left."""
    left = now.left.ravel()
    matrix = np.column_stack([now.columns[name].ravel() for name in columns])
    good = np.isfinite(left) & np.isfinite(matrix).all(axis=1)
    left, matrix = left[good], matrix[good]
    if len(left) < 20 or not (np.abs(matrix) > 0).any(axis=0).all():
        return None
    normal = matrix.T @ matrix
    if np.linalg.cond(normal / np.sqrt(np.outer(np.diag(normal), np.diag(normal)))) > 1e6:
        return None
    sizes = np.linalg.solve(normal, matrix.T @ left)
    rest = left - matrix @ sizes
    rms = float(np.sqrt(np.mean(rest**2)))
    # windows overlap by three quarters
    errors = np.sqrt(np.diag(np.linalg.inv(normal)) * 4.0) * max(rms, 0.5)
    return sizes.tolist(), errors.tolist(), rms


def _third_witness(trials: Sequence[Trial], even: list[Suspect]) -> list[Suspect]:
    """Decide between suspects that explain the same, where something else in the logs can."""
    points = [one for one in even if one.key == "lever_arm"]
    if len(points) == 2 and even[0].key == "lever_arm":
        # a turning ship pivots a quarter to half its length ahead of midship, where there is no sway
        pivots = [pivot for trial in trials if (pivot := _pivot(trial)) is not None]
        inside = not pivots or 0.1 < float(np.median(pivots)) / length(trials) < 0.8
        return [one for one in points if ("x" in one.channels) == inside]
    if even[0].key == "log_scale":
        return even[:1]
    return even


def _pivot(trial: Trial) -> float | None:
    """Distance of the point without sway ahead of midship in turns [m]."""
    if not has(trial, "r", "v_m"):
        return None
    r, v = trial["r"], trial["v_m"]
    hard = np.isfinite(r) & np.isfinite(v)
    hard &= np.abs(r) > 0.5 * float(np.nanmax(np.abs(r)))
    return float(-(v[hard] @ r[hard]) / (r[hard] @ r[hard])) if hard.sum() > 20 else None

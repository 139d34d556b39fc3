"""Channels that are constant while the ship moves: a frozen sensor, or a steady run without noise.

The other channels distinguish the two.  Heading and rate of turn, positions and velocities are
redundant; where both agree better than instruments can, the run is simulated and no sensor is frozen.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ....core.ranks import median, quantile
from ... import Trial
from ...prepare import Remedy, Step, integral
from ..sensors import MEASURED, Fault, gaps_of

_LEAST = 20
"""Rows that repeat one value before it counts."""

_OFTEN = 0.25
"""Part of a run of rows that another run of a rounded channel lasts at least."""

_MOTION = ("x", "y", "psi", "u", "v_m", "r")

_EXACT = 3e-4
"""Share of the usual speed and rate of turn by which redundant channels may differ without noise.

Integration over rows of a simulated run and the digits of a sentence are below; noise, a heading error of a
fiftieth of a degree, or a log error of a thousandth are above."""


def still_faults(trial: Trial) -> tuple[list[Fault], Trial]:
    """Frozen sensors one by one, sensors slower than the log, and one note of what a steady run holds still.

    Returns:
        The faults, and the trial with gaps in the place of stretches that a sensor did not measure.
    """
    steady: list[str] = []
    stuck: dict[tuple[tuple[int, int], ...], list[str]] = {}
    gone: dict[str, NDArray[np.float64]] = {}
    found: list[Fault] = []
    longest, since = 0.0, 0.0
    speed = _speed(trial)
    for name in MEASURED:
        if name not in trial:
            continue
        same = _same(trial, name, speed)
        if same is None:
            continue
        runs = _runs(same)
        held = [(k, n) for k, n in runs if _matters(trial, name, k, n) and not _rounded(trial, name, k, n, runs)]
        frozen = [(k, n) for k, n in held if not _exact(trial, k, n)]
        if frozen:
            stuck.setdefault(tuple(frozen), []).append(name)
            gone[name] = _without(trial[name], [run for run in frozen if run[1] < 0.9 * len(trial)])
        elif held:
            steady.append(name)
            k, n = max(held, key=lambda run: run[1])
            if (lasts := _lasts(trial, k, n)) > longest:
                longest, since = lasts, float(trial.t[k])
        elif name in ("x", "y", "psi") and 0.25 < float(np.mean(same)) < 0.98 and not _by_digits(trial, name):
            found.append(Fault(
                "warning", name, "repeated values",
                f"{100 * float(np.mean(same)):.0f} % of the samples repeat the one before while under way",
                Remedy(steps=(Step(do="unrepeat", channels=(name,)),)), "quality", "repeated",
            ))  # fmt: skip
    found += _stuck(trial, stuck)
    if steady:
        found.append(Fault(
            "info", ", ".join(steady), "steady values without noise",
            f"the same for up to {longest:.3g} s from t = {since:g} s, while positions, velocities, heading and rate "
            f"of turn agree to {100 * _EXACT:g} %",
            "no action in a simulated run; a frozen sensor would disagree with the others", "quality", "steady",
        ))  # fmt: skip
    return found, trial.having(**gone)


def _without(values: NDArray[np.float64], runs: list[tuple[int, int]]) -> NDArray[np.float64]:
    out = values.copy()
    for k, n in runs:
        out[k : k + n + 1] = np.nan
    return out


def _stuck(trial: Trial, stuck: dict[tuple[tuple[int, int], ...], list[str]]) -> Iterator[Fault]:
    """Frozen sensors, the two channels of one instrument together."""
    for runs, names in stuck.items():
        left = list(names)
        for pair in (("x", "y"), ("u", "v_m"), *((name,) for name in names)):
            if set(pair) <= set(left):
                yield _frozen(trial, [*pair], runs)
                left = [name for name in left if name not in pair]


def _frozen(trial: Trial, names: list[str], runs: tuple[tuple[int, int], ...]) -> Fault:
    start, length = max(runs, key=lambda run: run[1])
    value = trial[names[0]][start]
    zero, whole = value == 0.0, length > 0.98 * len(trial)
    rows = np.zeros(len(trial), dtype=np.bool_)
    for k, n in runs:
        rows[k : k + n + 1] = True
    return Fault(
        "warning", ", ".join(names), "zeros where a sensor should be" if zero else "frozen sensor",
        f"the same value {value:.6g} for {_lasts(trial, start, length):.3g} s "
        f"from t = {trial.t[start]:g} s",
        _replaced(trial, names) if whole else gaps_of(trial, rows, *names), "quality",
        "zeros" if zero else "frozen",
    )  # fmt: skip


def _speed(trial: Trial) -> NDArray[np.float64] | None:
    """Speed ahead at every row; None without any."""
    known = np.isfinite(trial["u"]) if "u" in trial else np.zeros(0, dtype=np.bool_)
    if not known.any():
        return None
    return np.interp(trial.t, trial.t[known], np.abs(trial["u"][known]))  # a log may be slower than the rows


def _replaced(trial: Trial, names: list[str]) -> Remedy:
    """Velocities and rate that were not measured follow from track and heading; other channels are left out."""
    derived = set(names) <= {"u", "v_m", "r"} and all(name in trial for name in ("x", "y", "psi"))
    return Remedy(steps=(Step(do="derive" if derived else "drop", channels=tuple(names)),))


def _same(trial: Trial, name: str, speed: NDArray[np.float64] | None) -> NDArray[np.bool_] | None:
    """Steps that repeat the value before, under way; None where that is legitimate for the whole trial."""
    same = np.diff(trial[name]) == 0
    if same.all() and name not in _MOTION:
        return None  # a steady wind or an upright ship is legitimate, as in a simulated run
    if speed is not None:
        same &= speed[1:] > 0.2 * speed.max()
    return same


def _runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First index and length of the runs of true flags that are long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [(k, end - k) for k, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True) if end - k >= _LEAST]


def _lasts(trial: Trial, start: int, length: int) -> float:
    return float(trial.t[start + length] - trial.t[start])


def _matters(trial: Trial, name: str, start: int, length: int) -> bool:
    """Whether a run is long, and another channel varies during it."""
    if _lasts(trial, start, length) < max(2.0, 0.01 * trial.duration):
        return False
    others = (trial[n][start : start + length + 1] for n in MEASURED if n != name and n in trial)
    return any(np.unique(values).size > length // 2 for values in others)


def _rounded(trial: Trial, name: str, start: int, length: int, runs: list[tuple[int, int]]) -> bool:
    """Whether a position or heading hardly moves during a run: less, by the rates, than its digits show.

    A heading that is rounded rests on one number while the ship meets its rudder, and not only once.  The step of the
    digits is the smaller of the leaps into the run and out of it.
    """
    if not any(n >= _OFTEN * length for k, n in runs if k != start):
        return False
    values, stop = trial[name], start + length
    leaps = [abs(float(values[k + 1] - values[k])) for k in (start - 1, stop) if 0 <= k < values.size - 1]
    step = min((leap for leap in leaps if leap > 0), default=0.0)
    part = slice(start, stop + 1)
    if name == "psi" and "r" in trial:
        rate = trial["r"][part]
    elif name in ("x", "y") and all(n in trial for n in ("u", "v_m", "psi")):
        c, s = np.cos(trial["psi"][part]), np.sin(trial["psi"][part])
        u, v = trial["u"][part], trial["v_m"][part]
        rate = u * c - v * s if name == "x" else u * s + v * c
    else:
        return False
    return bool(step > 0 and np.ptp(integral(trial.t[part], rate)) < 1.5 * step)


def _by_digits(trial: Trial, name: str) -> bool:
    """Whether a channel repeats values as it is rounded: its steps are alike, and last as long as the motion is slow.

    Those of a sensor that is slower than the log are as large as the motion is fast, and all last its period; they are
    many digits.
    """
    values = trial[name]
    shown = np.degrees(values) if name == "psi" else values
    moved = np.abs(np.diff(shown))
    moved = moved[moved > 0]
    if moved.size and (digit := _digit(shown)) and median(moved) < 2.5 * digit:
        return True
    at = np.flatnonzero(np.diff(values) != 0)
    leaps, lasts = np.abs(np.diff(values))[at[1:]], np.diff(at)
    leaps, lasts = leaps[lasts > 1], lasts[lasts > 1]
    if lasts.size < 10 or not np.isfinite(leaps).all():
        return False
    spreads = [float(np.ptp(np.quantile(one, [0.1, 0.9])) / median(one)) for one in (leaps, lasts)]
    return spreads[0] < spreads[1]


def _exact(trial: Trial, start: int, length: int) -> bool:
    """Whether redundant channels of the motion agree better than instruments can, throughout a run of rows."""
    if not all(name in trial for name in _MOTION):
        return False
    if _made_of_psi(trial):
        return False  # r is not independent of psi
    table = np.column_stack([trial.t, trial.stack(*_MOTION)])[start : start + length + 1]
    table = table[np.isfinite(table).all(axis=1)]
    if len(table) <= _LEAST // 2:
        return False
    steps, means = np.diff(table, axis=0).T, 0.5 * (table[1:] + table[:-1]).T
    step, moved_x, moved_y, turned = steps[:4]
    course, u, v, r = means[3:]
    chord = step * np.sinc(turned / (2.0 * math.pi))  # over the arc, exact where u, v_m and r are steady
    gap_x = moved_x - chord * (u * np.cos(course) - v * np.sin(course))
    gap_y = moved_y - chord * (u * np.sin(course) + v * np.cos(course))
    size = min(_LEAST, len(step))
    whole = len(step) - len(step) % size
    lasts, off_x, off_y, off_psi = (
        one[:whole].reshape(-1, size).sum(axis=1) for one in (step, gap_x, gap_y, turned - r * step)
    )
    speed, rate = _usual(np.hypot(trial["u"], trial["v_m"])), _usual(trial["r"])
    agree = np.hypot(off_x, off_y) <= _EXACT * speed * lasts + 1e-9
    agree &= np.abs(off_psi) <= _EXACT * rate * lasts + 1e-9
    # a kink affects one block, a frozen sensor all later ones
    return float(np.mean(agree)) > 0.5 and bool((agree[1:] | agree[:-1]).all())


def _made_of_psi(trial: Trial) -> bool:
    """Whether r is the central difference of a heading that changes."""
    off = np.abs(np.gradient(trial["psi"], trial.t) - trial["r"])
    off = off[np.isfinite(off)]
    return np.unique(trial["psi"]).size > 1 and off.size > 0 and float(off.max()) < 1e-9


def _usual(values: NDArray[np.float64]) -> float:
    good = np.abs(values[np.isfinite(values)])
    return quantile(good, 0.95) if good.size else 0.0


def _digit(values: NDArray[np.float64]) -> float:
    """The decimal step in which values are written; 0 where they have more than five decimals."""
    known = values[np.isfinite(values)]
    steps = (10.0**-k for k in range(6))
    return next((one for one in steps if (np.abs(known / one - np.round(known / one)) < 1e-6 / one).all()), 0.0)

"""Channels that are constant while the ship moves: a frozen sensor, or a steady run without noise.

The other channels distinguish the two.  Heading and rate of turn, positions and velocities are
redundant; where both agree better than instruments can, the run is simulated and no sensor is frozen.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .. import Trial
from .sensors import MEASURED, Fault

_LEAST = 20
"""Rows that repeat one value before it counts."""

_DIGITS = 2.5
"""A sensor slower than the log leaps by more digits than this from one of its samples to the next."""

_MOTION = ("x", "y", "psi", "u", "v_m", "r")

_EXACT = 3e-4
"""Share of the usual speed and rate of turn by which redundant channels may differ without noise.

Integration over rows of a simulated run and the digits of a sentence are below; noise, a heading error of a
fiftieth of a degree, or a log error of a thousandth are above."""


def still_faults(trial: Trial) -> Iterator[Fault]:
    """Frozen sensors one by one, sensors slower than the log, and one note of what a steady run holds still."""
    steady: list[str] = []
    stuck: dict[tuple[int, int], list[str]] = {}
    longest, since = 0.0, 0.0
    for name in MEASURED:
        if name not in trial:
            continue
        same = _same(trial, name)
        if same is None:
            continue
        held = [(k, n) for k, n in _runs(same) if _matters(trial, name, k, n)]
        frozen = [(k, n) for k, n in held if not _exact(trial, k, n)]
        if frozen:
            stuck.setdefault(max(frozen, key=lambda run: run[1]), []).append(name)
        elif held:
            steady.append(name)
            k, n = max(held, key=lambda run: run[1])
            if (lasts := _lasts(trial, k, n)) > longest:
                longest, since = lasts, float(trial.t[k])
        elif name in ("x", "y", "psi") and 0.25 < float(np.mean(same)) < 0.98 and not _rounded(trial[name], same):
            yield Fault(
                "warning", name, "repeated values",
                f"{100 * float(np.mean(same)):.0f} % of the samples repeat the one before while under way",
                "the sensor is slower than the log: keep its own samples, or smooth", "quality", "repeated",
            )  # fmt: skip
    yield from _stuck(trial, stuck)
    if steady:
        yield Fault(
            "info", ", ".join(steady), "steady values without noise",
            f"the same for up to {longest:.3g} s from t = {since:g} s, while positions, velocities, heading and rate "
            f"of turn agree to {100 * _EXACT:g} %",
            "no action in a simulated run; a frozen sensor would disagree with the others", "quality", "steady",
        )  # fmt: skip


def _rounded(values: NDArray[np.float64], same: NDArray[np.bool_]) -> bool:
    """Whether values repeat because they are rounded: the others differ by hardly more than one digit."""
    moved = np.abs(np.diff(values))[~same]
    moved = moved[np.isfinite(moved) & (moved > 0)]
    return moved.size > 0 and float(np.median(moved)) < _DIGITS * float(np.quantile(moved, 0.05))


def _stuck(trial: Trial, stuck: dict[tuple[int, int], list[str]]) -> Iterator[Fault]:
    """Frozen sensors, the two channels of one instrument together."""
    for run, names in stuck.items():
        left = list(names)
        for pair in (("x", "y"), ("u", "v_m"), *((name,) for name in names)):
            if set(pair) <= set(left):
                yield _frozen(trial, [*pair], *run)
                left = [name for name in left if name not in pair]


def _frozen(trial: Trial, names: list[str], start: int, length: int) -> Fault:
    value = trial[names[0]][start]
    zero, whole = value == 0.0, length > 0.98 * len(trial)
    return Fault(
        "warning", ", ".join(names), "zeros where a sensor should be" if zero else "frozen sensor",
        f"the same value {value:.6g} for {_lasts(trial, start, length):.3g} s "
        f"from t = {trial.t[start]:g} s",
        "leave the channel out of the mapping" if whole else "set these rows to gaps (NaN) or cut them", "quality",
        "zeros" if zero else "frozen",
    )  # fmt: skip


def without_frozen(trial: Trial) -> Trial:
    """The trial with gaps in the place of stretches that a sensor did not measure."""
    gone: dict[str, NDArray[np.float64]] = {}
    for name in MEASURED:
        same = _same(trial, name) if name in trial else None
        if same is None:
            continue
        values = trial[name].copy()
        for k, n in _runs(same):
            if n < 0.9 * len(trial) and _matters(trial, name, k, n) and not _exact(trial, k, n):
                values[k : k + n + 1] = np.nan
        gone[name] = values
    return trial.having(**gone)


def _same(trial: Trial, name: str) -> NDArray[np.bool_] | None:
    """Steps that repeat the value before, under way; None where that is legitimate for the whole trial."""
    same = np.diff(trial[name]) == 0
    if same.all() and name not in _MOTION:
        return None  # a steady wind or an upright ship is legitimate, as in a simulated run
    known = np.isfinite(trial["u"]) if "u" in trial else np.zeros(0, dtype=np.bool_)
    if known.any():
        speed = np.interp(trial.t, trial.t[known], np.abs(trial["u"][known]))  # a log may be slower than the rows
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
    others = (trial[n][start : start + length + 1] for n in MEASURED if n != name and n in trial)
    long = _lasts(trial, start, length) >= max(2.0, 0.01 * trial.duration)
    return long and any(np.unique(values).size > length // 2 for values in others)


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
    return float(np.quantile(good, 0.95)) if good.size else 0.0

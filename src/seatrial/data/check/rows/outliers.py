"""Single rows and blocks of rows that no instrument measured: spikes, sentinels, zeros; and the log without them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ....core.ranks import median, quantile
from ... import Array, Trial
from ...prepare import ANGLES
from ...prepare.cutting import LEAP
from ..relations import length_of, noise_of
from ..sensors import MEASURED, Fault, gaps_of

_TURN = 2.0 * math.pi
# A spike is this many times the noise, this part of the span of its channel, and rises this much above other kinks.
_NOISE, _SPAN, _KINKS = 12.0, 0.05, 4.0
# ... and above the steps beside it.
_FLANKS = 2.0
# Rows that are spikes at most; beyond, it is what the channel does.
_SHARE = 0.06
_LONGEST = 0.2

_GUSTY = ("U_A", "gamma_A", "U_T", "gamma_T")
"""Channels that may leap from row to row."""

# A stray is this many times farther from the others than they span, and no more than this part of the rows.
_ALOOF, _MINORITY = 3.0, 0.4
# Spans that any log may have at least, by channel [SI].
_LEAST_SPAN = {"x": 100.0, "y": 100.0, "u": 5.0, "v_m": 5.0, "r": 0.1, "p": 0.1, "phi": 0.5, "U_G": 5.0, "u_w": 5.0,
               "U_A": 20.0, "U_T": 20.0, "U_C": 3.0, "delta": 0.5 * math.pi, "depth": 100.0}  # fmt: skip
_OF_RECEIVER = ("U_G", "gamma_G", "u", "v_m")
# Part of the other rows that may have the number of a receiver without a fix.
_RARELY = 0.01
# Numbers for no value that a channel may have; rows of a stray that need not be alike; rows of a channel at least.
_SORTS, _SHORT, _FEWEST = 4, 3, 20

Flags = NDArray[np.bool_]


def outlier_faults(trial: Trial) -> tuple[list[Fault], Trial]:
    """Faults of single rows, and the trial with gaps in their place."""
    groups: dict[tuple[str, bytes], tuple[list[str], Flags]] = {}
    words: dict[str, Fault] = {}
    strays = _strays(trial)
    apart = trial.having(**{name: np.where(bad, np.nan, trial[name]) for name, bad in strays.items()})
    for name in dict.fromkeys([*_names(trial), *strays]):
        bad = strays.get(name, np.zeros(len(trial), dtype=np.bool_))
        if name in _names(trial):
            bad = bad | _blocks(apart, name)
            if name not in _GUSTY:
                bad |= _spikes(apart, name)
        if not bad.any():
            continue
        fault = _fault(trial, name, bad)
        words[name] = fault
        groups.setdefault((fault.key, bad.tobytes()), ([], bad))[0].append(name)
    clean, found = trial, []
    for names, bad in groups.values():
        first = words[names[0]]
        remedy = gaps_of(trial, bad, *names)
        found.append(Fault(first.severity, ", ".join(names), first.what, first.evidence, remedy, first.kind,
                           first.key))  # fmt: skip
        clean = clean.having(**{name: np.where(bad, np.nan, clean[name]) for name in names})
    return found, clean


def _strays(trial: Trial) -> dict[str, Flags]:
    """Rows far outside all the others of their channel: numbers for no value, fixes at latitude and longitude 0.

    A receiver without a fix repeats one number in its speed and course as well.
    """
    found = {name: bad for name in _LEAST_SPAN if name in trial and (bad := _aloof(trial, name)).any()}
    lost = np.zeros(len(trial), dtype=np.bool_)
    for name in ("x", "y"):
        lost |= found.get(name, lost)
    if not lost.any():
        return found
    found |= {name: lost for name in ("x", "y") if name in trial}
    for name in _OF_RECEIVER:
        held = trial[name][lost] if name in trial else np.zeros(0)
        rare = held.size and np.mean(trial[name][~lost] == held[0]) < _RARELY
        if held.size and (held == held[0]).all() and (rare or (name == "v_m" and "u" in found)):
            found[name] = lost | found.get(name, lost)
    return found


def _aloof(trial: Trial, name: str) -> Flags:
    """Rows of a channel that lie farther from all others than a multiple of what these span, by steps of one row."""
    bad = np.zeros(len(trial), dtype=np.bool_)
    for _ in range(_SORTS):
        at = np.flatnonzero(np.isfinite(trial[name]) & ~bad)
        if at.size < _FEWEST:
            break
        values = trial[name][at]
        rising = np.sort(values)
        k = int(np.argmax(np.diff(rising)))
        if (far := float(rising[k + 1] - rising[k])) == 0.0:
            break
        outside = values <= rising[k] if 2 * (k + 1) < values.size else values > rising[k]
        rest = values[~outside]
        middle = 0.0 if name in ("x", "y") else abs(median(rest))
        span = max(float(np.ptp(rest)), middle, _LEAST_SPAN[name])
        if outside.mean() > _MINORITY or far < _ALOOF * span:
            break
        rows = np.zeros(len(trial), dtype=np.bool_)
        rows[at[outside]] = True
        taken = _leaping(trial, name, rows, 0.01 * far)
        if not taken.any():
            break
        bad |= taken
    return bad


def _leaping(trial: Trial, name: str, rows: Flags, same: float) -> Flags:
    """Those of the runs of rows that are short or repeat a number to within `same`, without a leap of time beside."""
    taken = np.zeros(len(trial), dtype=np.bool_)
    late = np.concatenate([[False], np.diff(trial.t) > LEAP * trial.dt, [False]])
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rows.astype(np.int8), [0]])))
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        alike = b - a <= _SHORT or float(np.ptp(trial[name][a:b])) < same
        taken[a:b] = alike and not (late[a] and late[b]) and not ((a == 0 and late[b]) or (b == len(rows) and late[a]))
    return taken


def _names(trial: Trial) -> Iterator[str]:
    for name in trial.channels:
        if name in MEASURED or name.split("_")[0] == "delta" or name.startswith("n_P"):
            yield name


def _known(trial: Trial, name: str, at: NDArray[np.intp]) -> Array:
    """Values of these rows; of all of them the channel itself, of which the noise is known already."""
    return trial[name] if at.size == len(trial) else trial[name][at]


def _differences(name: str, values: Array) -> Array:
    steps = np.diff(values)
    return (steps + math.pi) % _TURN - math.pi if name in ANGLES else steps


def _beyond(trial: Trial, name: str, values: Array, out: Array) -> Flags:
    """Which are far enough out: beyond noise, and beyond a part of what the channel usually spans."""
    if name in ("x", "y"):
        least = _SPAN * (length_of(trial) or 10.0)
    else:
        low, high = quantile(values, 0.05), quantile(values, 0.95)
        least = max(_SPAN * (min(float(high - low), math.pi) if name in ANGLES else float(high - low)), 1e-9)
    far = out > least
    # the noise is dear, and seldom asked for
    return far & (out > _NOISE * noise_of(values)) if far.any() else far


def _spikes(trial: Trial, name: str) -> Flags:
    """Rows that leave their neighbours and come back at once, far beyond every other kink of the channel."""
    bad = np.zeros(len(trial), dtype=np.bool_)
    at = np.flatnonzero(np.isfinite(trial[name]))
    if at.size < 50:
        return bad
    values = _known(trial, name, at)
    steps = _differences(name, values)
    there, back = steps[:-1], steps[1:]
    out = np.where(there * back < 0, np.minimum(np.abs(there), np.abs(back)), 0.0)
    out = np.where(np.abs(there + back) < 0.5 * out, out, 0.0)
    far = _beyond(trial, name, values, out)
    if not far.any() or not (far := far & (out > _KINKS * quantile(out, 1.0 - _SHARE))).any():
        return bad
    rest = out[~far]
    # a control that moves all the time is not spoilt by it, nor is a sensor by a peak whose flanks are as steep
    far &= _calm_about(values, out, far) if name not in MEASURED else out > _FLANKS * _flank(steps)
    if far.any() and float(out[far].min()) > 3.0 * float(rest.max(initial=0.0)):
        bad[at[1:-1][far]] = True
    return bad


def _flank(steps: Array) -> Array:
    """The smaller of the steps before the one that leads to a row and after the one that leads away from it."""
    wide = np.abs(np.concatenate([[0.0], steps, [0.0]]))
    return np.minimum(wide[:-3], wide[3:])


def _calm_about(values: Array, out: Array, which: Flags) -> Flags:
    """Of some rows (not the first and the last), those about which the channel moves little within four rows."""
    calm = np.zeros(out.size, dtype=np.bool_)
    for k in np.flatnonzero(which).tolist():
        near = np.delete(values[max(k - 3, 0) : k + 6], min(k, 3) + 1)
        calm[k] = float(np.ptp(near)) < 0.25 * out[k]
    return calm


def _blocks(trial: Trial, name: str) -> Flags:
    """Rows that repeat one value, into which and out of which the channel leaps: zeros and other fillings."""
    bad = np.zeros(len(trial), dtype=np.bool_)
    at = np.flatnonzero(np.isfinite(trial[name]))
    steered = name not in MEASURED
    if at.size < 50:
        return bad
    values = _known(trial, name, at)
    edges = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0, [True]]))
    first, last = edges[:-1], edges[1:]
    repeats = (first > 0) & (last < at.size) & (last - first > 1) & (last - first < _LONGEST * at.size)
    if repeats.any():  # that leap in and out by more than most steps of the channel
        steps = np.abs(_differences(name, values))
        usual = quantile(steps, 0.95)
        into, out = steps[np.maximum(first - 1, 0)], steps[np.minimum(last - 1, steps.size - 1)]
        repeats &= np.minimum(into, out) > 8.0 * usual
    if not repeats.any():
        return bad
    first, last = first[repeats], last[repeats]
    into, out = values[first] - values[first - 1], values[last] - values[first]
    if name in ANGLES:
        into, out = ((one + math.pi) % _TURN - math.pi for one in (into, out))
    leaps = np.where(into * out < 0, np.minimum(np.abs(into), np.abs(out)), 0.0)
    for k in np.flatnonzero(_beyond(trial, name, values, 0.5 * leaps)).tolist():
        if not steered or _elsewhere(values, float(values[first[k]])):
            bad[at[first[k] : last[k]]] = True
    return bad


def _elsewhere(values: Array, value: float) -> bool:
    """Whether a value lies far outside of everything else that a control does."""
    rest = values[values != value]
    low, high = float(rest.min()), float(rest.max())
    return not low - (high - low) < value < high + (high - low)


def _fault(trial: Trial, name: str, bad: Flags) -> Fault:
    values, count = trial[name][bad], int(bad.sum())
    unit, since = trial.unit(name), float(trial.t[np.flatnonzero(bad)[0]])
    same = np.unique(values % _TURN if name in ANGLES else values)
    where = f"{count} of {len(trial)} rows, the first at t = {since:g} s"
    remedy = gaps_of(trial, bad, name)
    if count > 1 and np.ptp(same) <= 1e-6 * max(abs(float(same[0])), 1.0):
        if same[0] == 0.0:
            return Fault("warning", name, "zeros where there was no value", f"0 in {where}", remedy, "quality", "zeros")
        return Fault("warning", name, "a number that stands for no value", f"{values[0]:.6g} {unit} in {where}",
                     remedy, "quality", "sentinel")  # fmt: skip
    beside = np.interp(np.flatnonzero(bad), np.flatnonzero(~bad & np.isfinite(trial[name])),
                       trial[name][~bad & np.isfinite(trial[name])])  # fmt: skip
    far = float(np.max(np.abs(values - beside)))
    return Fault("warning", name, "spikes" if count > 1 else "a spike",
                 f"{where}, up to {far:.3g} {unit} off the rows beside", remedy, "quality", "spike")  # fmt: skip

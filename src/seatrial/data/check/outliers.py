"""Single rows and blocks of rows that no instrument measured: spikes, sentinels, zeros; and the log without them."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .. import Array, Trial
from ..prepare import ANGLES
from .relations import length_of, noise_of
from .sensors import MEASURED, Fault, gaps_of

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

Flags = NDArray[np.bool_]


def outlier_faults(trial: Trial) -> tuple[list[Fault], Trial]:
    """Faults of single rows, and the trial with gaps in their place."""
    groups: dict[tuple[str, bytes], tuple[list[str], Flags]] = {}
    words: dict[str, Fault] = {}
    for name in _names(trial):
        bad = _blocks(trial, name)
        if name not in _GUSTY:
            bad |= _spikes(trial, name)
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


def _names(trial: Trial) -> Iterator[str]:
    for name in trial.channels:
        if name in MEASURED or name.split("_")[0] == "delta" or name.startswith("n_P"):
            yield name


def _differences(name: str, values: Array) -> Array:
    steps = np.diff(values)
    return (steps + math.pi) % _TURN - math.pi if name in ANGLES else steps


def _threshold(trial: Trial, name: str, values: Array) -> float:
    """How far out a value must be: beyond noise, and beyond a part of what the channel usually spans."""
    if name in ("x", "y"):
        return max(_NOISE * noise_of(values), _SPAN * (length_of(trial) or 10.0))
    low, high = np.quantile(values, [0.05, 0.95])
    span = min(float(high - low), math.pi) if name in ANGLES else float(high - low)
    return max(_NOISE * noise_of(values), _SPAN * span, 1e-9)


def _spikes(trial: Trial, name: str) -> Flags:
    """Rows that leave their neighbours and come back at once, far beyond every other kink of the channel."""
    bad = np.zeros(len(trial), dtype=np.bool_)
    at = np.flatnonzero(np.isfinite(trial[name]))
    if at.size < 50:
        return bad
    values = trial[name][at]
    steps = _differences(name, values)
    there, back = steps[:-1], steps[1:]
    out = np.where(there * back < 0, np.minimum(np.abs(there), np.abs(back)), 0.0)
    out = np.where(np.abs(there + back) < 0.5 * out, out, 0.0)
    far = out > _KINKS * float(np.quantile(out, 1.0 - _SHARE))
    if not far.any() or not (far := far & (out > _threshold(trial, name, values))).any():
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
    values = trial[name][at]
    edges = np.flatnonzero(np.concatenate([[True], np.diff(values) != 0, [True]]))
    first, last = edges[:-1], edges[1:]
    repeats = (first > 0) & (last < at.size) & (last - first > 1) & (last - first < _LONGEST * at.size)
    if repeats.any():  # that leap in and out by more than most steps of the channel
        steps = np.abs(_differences(name, values))
        usual = float(np.quantile(steps, 0.95))
        into, out = steps[np.maximum(first - 1, 0)], steps[np.minimum(last - 1, steps.size - 1)]
        repeats &= np.minimum(into, out) > 8.0 * usual
    if not repeats.any():
        return bad
    least = _threshold(trial, name, values)
    for a, b in zip(first[repeats].tolist(), last[repeats].tolist(), strict=True):
        into, out = values[a] - values[a - 1], values[b] - values[a]
        if name in ANGLES:
            into, out = ((one + math.pi) % _TURN - math.pi for one in (into, out))
        leaps = into * out < 0 and min(abs(into), abs(out)) > 2.0 * least
        if leaps and (not steered or _elsewhere(values, float(values[a]))):
            bad[at[a:b]] = True
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

"""Findings about trials: the checks of one trial, and recordings that two sets share."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...core.once import by_identity
from ...core.values import dataclass, replace
from .. import Array, Trial
from ..prepare import Remedy, Step, at_one_rate
from .attitude.heel import heel_faults
from .bounds import scale_faults, whirl_faults
from .controls.numbered import numbered_faults
from .controls.rudder import helm_faults
from .controls.sense import sense_faults
from .controls.shaft import shaft_faults
from .drift import drift_faults
from .pivot import pivot_faults
from .rows.drawn import line_faults
from .rows.outliers import outlier_faults
from .rows.still import still_faults
from .sensors import EVERY, Fault, Kind, beyond_faults, gap_faults, sensor_faults, wind_faults
from .suspects import Judged, Named, accused
from .symmetry import symmetry_faults
from .track import made_faults, surge_faults, track_faults

Severity = Literal["error", "warning", "info"]
_MOTION = ("x", "y", "psi", "u", "v_m", "r")
"""Channels whose slowest one sets the steps on which logs are held against each other."""
_COMMON = ("x", "y", "psi", "u", "v_m", "r", "delta")
_FEWEST = 10
"""Rows in common that exclude coincidence."""
_COPIED = 0.5
"""Part of the rows of a recording that another one holds too; simulated runs without noise share their approach."""

_Placed = list[tuple[int, Trial]]


@dataclass(frozen=True)
class Finding:
    """One thing about a trial that its user should know.

    Attributes:
        severity: "error" (do not use it as it is), "warning" or "info".
        what: the fault in a few words.
        where: trial and channel.
        evidence: the numbers that show it.
        remedy: what to do.
        kind: of the fault, see `Kind`.
        trials, channels: those it is about, the trial under test last.
        key: name of the culprit for programs; the kind where no culprit is known.
        steps: what the remedy does to the logs; empty where it is no change of them.
        nuisance: keys of [nuisance] of a study and their values that it asks for.
    """

    severity: Severity
    what: str
    where: str
    evidence: str
    remedy: str
    kind: Kind = "quality"
    trials: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()
    key: str = ""
    steps: tuple[Step, ...] = ()
    nuisance: tuple[tuple[str, float], ...] = ()

    def __str__(self) -> str:
        return f"{self.severity}: {self.where}: {self.what} ({self.evidence}); {self.remedy}"


def check(trial: Trial) -> tuple[Finding, ...]:
    """All findings of one trial, errors first; none means that no known fault was found."""
    return check_folder((trial,))


def check_folder(trials: Sequence[Trial]) -> tuple[Finding, ...]:
    """All findings of the trials of a day, errors first.

    Logs of one ship judge each other: a compass that is wrong is wrong in each of them, and only several headings tell
    it from a current.  What is wrong in several trials is told once, with all of their names.

    They are kept as long as the trials live: a fit asks for them in its lint, before it starts and in its report.
    """
    return _judged(*trials)


@by_identity
def _judged(*trials: Trial) -> tuple[Finding, ...]:
    told: dict[str, list[Fault]] = {trial.name: [] for trial in trials}
    alike: dict[object, list[Trial]] = {}
    for trial in trials:
        own, sound = _alone(trial)
        told[trial.name] += own
        if sound is not None:
            alike.setdefault((sound.meta.get("L_pp"), sound.meta.get("ship")), []).append(sound)
    for some in alike.values():
        _together(some, told)
        for a, b, rows, part in _pairs(some, some):
            if a < b and some[a].name != some[b].name and part > _COPIED:
                told[some[b].name].append(Fault(
                    "warning", EVERY, f"the same recording as {some[a].name}",
                    f"{rows} rows are the same, {100 * part:.0f} % of {some[b].name}, whatever their clocks say",
                    "leave one of the two out: it would count twice", "overlap", "overlap",
                ))  # fmt: skip
    coarse = {name: one for faults in told.values() for one in faults if one.key == "coarse" for name in one.channels}
    for name, faults in told.items():  # a channel in coarse steps repeats itself
        told[name] = [next((coarse[n] for n in one.channels if n in coarse), one)
                      if one.key in ("frozen", "zeros") else one for one in faults]  # fmt: skip
    order = {trial.name: k for k, trial in enumerate(trials)}
    merged: dict[tuple[str, ...], list[tuple[str, Fault]]] = {}
    for name, faults in told.items():
        for fault in faults:
            merged.setdefault((fault.severity, fault.where, fault.what), []).append((name, fault))
    found = [_finding(same) for same in merged.values()]
    rank = ("error", "warning", "info")
    return tuple(sorted(found, key=lambda f: (rank.index(f.severity), order[f.trials[0]])))


def _alone(trial: Trial) -> tuple[list[Fault], Trial | None]:
    """Faults that a trial shows by itself, and the trial without rows that nothing measured; None if unusable."""
    if len(trial) < 20:
        return [Fault("error", "t", "too short to judge", f"{len(trial)} rows", "record at least 20 rows", "short",
                      "short")], None  # fmt: skip
    if beyond := [*beyond_faults(trial)]:
        return beyond, None
    if not bool((np.diff(trial.t) > 0).all()):
        faults = [*gap_faults(trial), *sensor_faults(trial)]
        return [one for one in faults if one.severity == "error" or not _repeats(one, faults)], None
    outliers, clean = outlier_faults(trial)
    faults = [*gap_faults(trial), *sensor_faults(clean)]
    faults = [one for one in faults if one.severity == "error" or not _repeats(one, faults)]
    spoilt = {name for one in outliers for name in one.channels}
    faults = [one for one in faults if one.key != "wraps" or not spoilt & set(one.channels)]
    drawn, clean = line_faults(clean)
    still, sound = still_faults(clean)
    return [*faults, *outliers, *drawn, *still, *made_faults(clean)], sound


def _together(trials: list[Trial], told: dict[str, list[Fault]]) -> None:
    """Add what the logs of one ship say of each other."""
    judged = accused([at_one_rate(trial, _MOTION) for trial in trials])
    common, sound = judged.faults, judged.trials
    for trial in trials:
        told[trial.name] = [one for one in told[trial.name] if not _repeats(one, common)] + common
    if len(trials) > 1:
        _by_some(judged, sound, told)
    sensed = sense_faults(sound)
    sound = sensed.trials
    for trial in sound:
        told[trial.name] += [fault for fault in sensed.faults[trial.name] if not _repeats(fault, told[trial.name])]
        for found in (whirl_faults(trial), scale_faults(trial), track_faults(trial, sound), wind_faults(trial),
                      heel_faults(trial)):  # fmt: skip
            told[trial.name] += [fault for fault in found if not _repeats(fault, told[trial.name])]
    wrong = {name for trial in sound for one in told[trial.name] if one.severity == "error" for name in one.channels}
    shared = [*surge_faults(sound)]
    if not any(one.key == "length" for trial in sound for one in told[trial.name]):
        shared += shaft_faults(sound)
    if "delta" not in wrong:
        shared += helm_faults(sound)
    shared += [fault for fault in numbered_faults(sound) if not wrong & set(fault.channels)]
    if not any(one.key in ("through_water", "heading_bias", "inconsistent") for one in common):
        shared += drift_faults(sound)
        drifts = {one.key for one in shared}
        shared += () if "heading_bias" in drifts else symmetry_faults(sound, "current" in drifts)
        if not any(one.key == "lever_arm" for one in common) and not wrong & {"delta", "psi", "u", "v_m", "r"}:
            shared += pivot_faults(sound)
    for trial in sound:
        told[trial.name] = [one for one in told[trial.name] if not _repeats(one, shared)] + shared


def _by_some(judged: Judged, sound: list[Trial], told: dict[str, list[Fault]]) -> None:
    """Add what the logs say that differ from the others, and mend them; others that show the same with them."""
    known = {(one.key, one.channels) for one in judged.faults}
    alone: dict[int, set[tuple[str, tuple[str, ...]]]] = {}
    named: dict[tuple[str, tuple[str, ...]], Named] = {}
    for k in judged.differing:
        own = accused([sound[k]])
        sound[k] = own.trials[0]
        new = {(one.fault.key, one.fault.channels): one for one in own.named}
        told[sound[k].name] += [one.fault for key, one in new.items() if key not in known]
        alone[k], named = set(new), {**new, **named}
    for key, one in named.items():
        for k, left in enumerate(judged.left):
            if key not in known | alone.get(k, set()) and one.repair and one.shared_by(left):
                sound[k] = one.repair(sound[k])
                told[sound[k].name].append(one.fault)


_SHADOWS = ("wraps", "unit", "coarse", "length", "time_scale", "sign", "zeros", "frozen")


def _repeats(fault: Fault, told: Sequence[Fault]) -> bool:
    """Whether a fault is the shadow of one that is told already: the same channels in the wrong unit."""
    known = {name for one in told if one.severity == "error" and one is not fault for name in one.channels}
    return fault.key in _SHADOWS and bool(known & set(fault.channels))


def check_set(train: Iterable[Trial], test: Iterable[Trial]) -> tuple[Finding, ...]:
    """Recordings that training and test share, whole or in part, whatever their names.

    Returns:
        An error for each pair of trials of which at least ten rows are the same.
    """
    ours, theirs = tuple(train), tuple(test)
    return tuple(
        Finding(
            "error", "training and test share a recording", f"{ours[a].name} and {theirs[b].name}",
            f"{rows} rows are the same, {100 * part:.0f} % of {theirs[b].name}",
            "keep both in training or both in test", "overlap", (ours[a].name, theirs[b].name), (), "overlap",
        )
        for a, b, rows, part in _pairs(ours, theirs)
    )  # fmt: skip


def _finding(same: Sequence[tuple[str, Fault]]) -> Finding:
    """One finding of a fault that one trial shows, or several."""
    fault, names = same[0][1], tuple(dict.fromkeys(name for name, _ in same))
    about = f"{names[0]}: {fault.where}" if len(names) == 1 else f"{len(names)} trials: {fault.where}"
    evidence = fault.evidence
    if len(names) > 1 and len({one.evidence for _, one in same}) > 1:
        evidence = f"{names[0]}: {evidence}"
    alike: dict[Remedy, list[str]] = {}
    for name, one in same:
        remedy = one.remedy if isinstance(one.remedy, Remedy) else Remedy(one.remedy)
        alike.setdefault(remedy, []).append(name)
    first = next(iter(alike))
    steps = tuple(step if step.trials else replace(step, trials=tuple(dict.fromkeys(some)))
                  for one, some in alike.items() for step in one.steps)  # fmt: skip
    told = f"in {same[0][0]} {first}; likewise in {len(names) - 1} more" if len(alike) > 1 else str(first)
    said = (fault.severity, fault.what, about, evidence, told, fault.kind)
    return Finding(*said, names, fault.channels, fault.key or fault.kind, steps, first.nuisance)


def _pairs(train: Sequence[Trial], test: Sequence[Trial]) -> list[tuple[int, int, int, float]]:
    """Pairs of recordings with at least ten rows in common.

    Returns:
        Sorted tuples: index in `train`, index in `test`, number of shared rows, their share of the rows of the latter.
    """
    found: list[tuple[int, int, int, float]] = []
    for (mine, some), (yours, others) in product(_by_channels(train).items(), _by_channels(test).items()):
        if names := [name for name in mine if name in yours]:
            found += _shared(names, some, others)
    return sorted(found)


def _by_channels(trials: Sequence[Trial]) -> dict[tuple[str, ...], _Placed]:
    """Trials with their indices, grouped by the common channels that they have."""
    found: dict[tuple[str, ...], _Placed] = {}
    for k, trial in enumerate(trials):
        found.setdefault(tuple(name for name in _COMMON if name in trial), []).append((k, trial))
    return found


def _shared(names: list[str], some: _Placed, others: _Placed) -> Iterator[tuple[int, int, int, float]]:
    """Pairs of one group each: the rows of `some` are sorted once, those of each other trial are looked up."""
    own = [_rows(trial, tuple(names)) for _, trial in some]
    rows, owner = np.concatenate(own), np.repeat(np.arange(len(own)), [len(one) for one in own])
    order = np.argsort(rows, kind="stable")
    rows, owner = rows[order], owner[order]
    for place, other in others:
        wanted = _rows(other, tuple(names))
        first, last = np.searchsorted(rows, wanted, "left"), np.searchsorted(rows, wanted, "right")
        alike = last - first
        total = int(alike.sum())
        if not total:
            continue
        # the places from `first` to `last` of each row, one after the other
        held = owner[np.repeat(first - np.cumsum(alike) + alike, alike) + np.arange(total)]
        counts = np.bincount(held, minlength=len(some))
        for k in np.flatnonzero(counts >= _FEWEST).tolist():
            yield some[k][0], place, int(counts[k]), float(counts[k] / len(wanted))


@by_identity
def _hashed(_trial: Trial) -> dict[tuple[str, ...], NDArray[np.uint64]]:
    """What is known of the rows of a trial, by channels."""
    return {}


def _rows(trial: Trial, names: tuple[str, ...]) -> NDArray[np.uint64]:
    """Hashes of the distinct complete rows, sorted: each set of trials asks for them again."""
    known = _hashed(trial)
    if names not in known:
        known[names] = _mixed(trial.stack(*names))
    return known[names]


def _mixed(table: Array) -> NDArray[np.uint64]:
    table = table[np.isfinite(table).all(axis=1)]
    # nine digits: the same recording written by two programs is still the same
    bits = (np.round(table, 9) + 0.0).view(np.uint64).reshape(table.shape)
    mixed = np.zeros(len(bits), dtype=np.uint64)
    for column in bits.T:  # splitmix64: the chance of a collision is about 1 in 10^19
        mixed = (mixed ^ column) + np.uint64(0x9E3779B97F4A7C15)
        mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        mixed ^= mixed >> np.uint64(31)
    return np.unique(mixed)

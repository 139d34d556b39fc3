"""Rudders, shafts and azimuths of which a ship has several: `delta_1`, `n_2`, `alpha_1`.

Each rudder is looked at as if it were the only one.  Its sense shows where all of them move together; an azimuth
turns a ship one way at the stern and the other at the bow, so that of an azimuth is left to a fit.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ... import Trial
from ...prepare import Remedy
from ..relations import has
from ..repairs import step
from ..sensors import Fault
from .rudder import helm_faults, stuck_faults
from .sense import sense_faults

_NUMBERED = re.compile(r"^(delta|alpha)_\d+$")
# Rudders move together from this correlation on.
_TOGETHER = 0.8


def numbered_faults(trials: Sequence[Trial]) -> Iterator[Fault]:
    """What some trials of one ship say of each of its rudders and azimuths."""
    names = sorted({name for trial in trials for name in trial.channels if _NUMBERED.match(name)})
    for name in names:
        some = [trial for trial in trials if name in trial]
        others = [one for one in names if one != name and one.split("_")[0] == name.split("_")[0]]
        if dead := _dead(some, name, others):
            yield dead
        elif name.startswith("alpha"):
            views = [trial.having(delta=trial[name]) for trial in some]
            yield from (_of(name, fault) for fault in stuck_faults(views))
        else:
            yield from _of_rudder(some, name, others)
    yield from _astern(trials)


def _of(name: str, fault: Fault) -> Fault:
    """The same of a numbered control."""
    words = {"delta": name, "rudder": f"rudder {name.rpartition('_')[2]}"}
    if name.startswith("alpha"):
        words["rudder"] = f"azimuth {name.rpartition('_')[2]}"
    remedy = fault.remedy
    text = remedy.text if isinstance(remedy, Remedy) else remedy
    told = [fault.what, fault.evidence, text]
    for word, other in words.items():
        told = [re.sub(rf"\b{word}\b", other, one) for one in told]
    if isinstance(remedy, Remedy):
        steps = tuple(replace(one, channels=tuple(name if c == "delta" else c for c in one.channels))
                      for one in remedy.steps)  # fmt: skip
        freed = tuple((key.replace(".delta", f".{name}"), value) for key, value in remedy.nuisance)
        remedy = Remedy(told[2], steps, freed)
    else:
        remedy = told[2]
    return replace(fault, where=name, what=told[0], evidence=told[1], remedy=remedy)


def _dead(trials: Sequence[Trial], name: str, others: Sequence[str]) -> Fault | None:
    """A control of one value throughout, while its fellow moves."""
    if any(has(trial, name) for trial in trials):
        return None
    levels = {float(np.nanmedian(trial[name])) for trial in trials if np.isfinite(trial[name]).any()}
    if len(levels) != 1 or not any(has(trial, one) for trial in trials for one in others):
        return None
    value = levels.pop()
    return Fault(
        "warning", name, f"{name} never moves, while {others[0]} does",
        f"{value:g} rad in every row of {len(trials)} trials", "take its own column, or check that it was locked there",
        "quality", "zeros" if value == 0.0 else "frozen",
    )  # fmt: skip


def _of_rudder(trials: Sequence[Trial], name: str, others: Sequence[str]) -> Iterator[Fault]:
    views = [trial.having(delta=trial[name]) for trial in trials]
    together = [view for view in views if all(_alike(view, name, one) for one in others)]
    heard = sense_faults(together).faults.values()
    wrong = {fault.what: fault for faults in heard for fault in faults if fault.severity == "error"}
    for fault in wrong.values():
        yield _of(name, fault)
    if not wrong:
        yield from (_of(name, fault) for fault in helm_faults(views))


def _alike(trial: Trial, name: str, other: str) -> bool:
    if other not in trial or not (has(trial, name) and has(trial, other)):
        return False
    good = np.isfinite(trial[name]) & np.isfinite(trial[other])
    return good.sum() > 20 and abs(float(np.corrcoef(trial[name][good], trial[other][good])[0, 1])) > _TOGETHER


def _astern(trials: Sequence[Trial]) -> Iterator[Fault]:
    """Azimuths that all push astern while the ship keeps going ahead: their zero is astern."""
    astern, ahead = 0, 0
    names: set[str] = set()
    for trial in trials:
        own = [name for name in trial.channels if re.match(r"^alpha_\d+$", name) and f"n{name[5:]}" in trial]
        if not own or not has(trial, "u"):
            continue
        u = trial["u"]
        fast = u > 0.7 * float(np.nanquantile(np.abs(u), 0.95))
        if fast.mean() < 0.5:
            continue
        names |= set(own)
        pushes = [trial[f"n{name[5:]}"] * np.abs(trial[f"n{name[5:]}"]) * np.cos(trial[name]) for name in own]
        push = np.sum(pushes, axis=0)
        back = float(np.nanmean(push[fast] < 0.0))
        astern, ahead = astern + (back > 0.9), ahead + (back < 0.5)
    if astern > 1 and not ahead:
        yield Fault(
            "error", ", ".join(sorted(names)), "azimuths push astern, and the ship goes ahead",
            f"in {astern} trials", step("add", *sorted(names), amount=(180.0,), unit="deg"), "sign", "sign",
        )  # fmt: skip

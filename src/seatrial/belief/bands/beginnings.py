"""Calibrations of predictions that know more than a measured start: the seconds before it, or a fit of the first."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ...core.errors import RequestError
from ...data import Array, DataError
from ...identify.record import Record, even
from ...models import STATES
from ...simulate.lanes import run
from ..fit_first import fit_first
from ..power import LEAST
from .calibrating import Part, Withheld, spread_of
from .calibration import Calibration, begin_of
from .learning import Windows, joined, windows_of
from .past import ENOUGH, LAWS, Filter, Past, disturbing, together
from .sailing import FreeRuns

# Factors of the noise of the filter's readings, of which the likeliest is taken.
_DOUBTS = (1.0, 3.0, 10.0, 30.0, 100.0)


def by_history(withheld: Withheld, span: float) -> Calibration:
    """Of predictions with what the seconds before each start tell (`past`); windows without them are left out.

    Args:
        span: seconds before a start.

    Raises:
        RequestError: too few recordings last longer.
    """
    cuts: list[Windows] = []
    errors: dict[str, list[Array]] = {law: [] for law in LAWS}
    spreads: list[Array] = []
    surprise = 0.0
    whole = [Filter.of(part.out.held.ship, lacks, withheld.sigma, span)
             for part, lacks in zip(withheld.parts, withheld.lacks, strict=True)]  # fmt: skip
    doubt = min(_DOUBTS, key=lambda one: _unlikely(withheld, [replace(who, doubt=one) for who in whole]))
    for part, who in zip(withheld.parts, whole, strict=True):
        filters = replace(who, doubt=doubt)
        past = _past(filters, part, withheld.dt)
        known = past.seconds >= ENOUGH * span * (1.0 - 1e-6)
        if not known.any():
            continue
        cut, past = part.cut.some(known), past.rows(known)
        cuts.append(cut)
        for law, own in errors.items():
            own.append(cut.reached(_predicted(filters, cut.lanes, past, law)) - cut.measured)
        lacks = who.disturbance
        spreads.append(cut.reached(spread_of(part.out, cut.lanes, lacks, withheld.sigma, past)))
        surprise = max(surprise, float(past.surprise.max()))
    _check(cuts, f"--history {span:g}")
    made = {law: withheld.made(begin_of(span, None), cuts, own, spreads) for law, own in errors.items()}
    first = made[LAWS[0]].left.usual
    best = min(LAWS, key=lambda law: float(np.nanmean(np.log(made[law].left.usual / first))))
    return replace(made[best], surprise=surprise, law=best, doubt=doubt)


def _unlikely(withheld: Withheld, filters: list[Filter]) -> float:
    """How unlikely the innovations of a usual left-out past are; the median, as some are much unlike the others."""
    every = [_past(who, part, withheld.dt) for who, part in zip(filters, withheld.parts, strict=True)]
    found = np.concatenate([past.unlikely[past.seconds > 0.0] for past in every])
    return float(np.median(found)) if found.size else 0.0


def _past(filters: Filter, part: Part, dt: float) -> Past:
    """What is known at the start of each window of a part."""
    found: list[Past] = []
    for trial in part.out.trials:
        rows = part.cut.begins[[name == trial.name for name in part.cut.trials]]
        found += [filters.before(Record.of(even(trial, dt, filters.ship.model), filters.ship.model), dt, rows.tolist())]
    return together(found)


def _predicted(filters: Filter, lanes: FreeRuns, past: Past, law: str) -> Array:
    """States with what acted before acting on, shape (lanes, rows, 6)."""
    with np.errstate(all="ignore"):
        rows = run(filters.lanes(lanes.state0, filters.ahead(lanes, past, law)), lanes.grid(), None).values
    return rows[:, :, : len(STATES)]


def by_first(withheld: Withheld, span: float, differing: Mapping[str, float]) -> Calibration:
    """Of predictions whose start, current and biases are estimated on the first seconds of a trial (`fit_first`).

    Args:
        span: those seconds; trials that are no longer are left out.
        differing: as of `fit_first`.

    Raises:
        RequestError: too few recordings last longer.
    """
    cuts: list[Windows] = []
    spreads: list[Array] = []
    for part, lacks in zip(withheld.parts, withheld.lacks, strict=True):
        own: list[Windows] = []
        for trial in part.out.trials:
            try:
                one = fit_first(part.out.held.ship, trial, span, differing=differing)
                cut = windows_of(part.out.held.ship, [one.rest], withheld.horizons, withheld.dt,
                                 {trial.name: one.state})  # fmt: skip
            except DataError:  # too short: it says nothing of such predictions
                continue
            own.append(cut)
            runs = spread_of(part.out, cut.lanes, disturbing(lacks, one.current), withheld.sigma)
            spreads.append(cut.reached(runs))
        cuts += [joined(own)] if own else []
    _check(cuts, f"--fit-first {span:g}")
    return withheld.made(begin_of(None, span), cuts, [cut.error for cut in cuts], spreads)


def _check(cuts: list[Windows], option: str) -> None:
    """Refuse what too few trials are long enough for."""
    count = len({name for cut in cuts for name in cut.trials})
    if count < LEAST:
        raise RequestError(f"{option}: {count} of the left-out trials last longer, and bands take at least {LEAST}; "
                           "take fewer seconds")  # fmt: skip

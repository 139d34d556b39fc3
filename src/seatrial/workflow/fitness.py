"""Fitness for a purpose, of `seatrial validate --for`: limits, refusals before any work, and the summary."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from ..core.parameters import unknown
from ..data import Trial
from ..ships import Ship
from . import RequestError, Table, figure

if TYPE_CHECKING:
    from ..choosing.purposes import Purpose
    from ..validate.fitness import Fitness, Found

STATUS = {"fit": 0, "not fit": 3, "cannot tell": 4}
"""Exit status by verdict; 1 and 2 keep their meaning, a run that failed and a request that was wrong."""


def asked(purpose: str, limits: str | None) -> Purpose:
    """A purpose by its key, with the limits of ``name=value,...`` in place of its own, each in the unit it has there.

    Raises:
        RequestError: a purpose without limits, an unknown limit, or a value that is no number above zero.
    """
    from ..choosing.purposes import PURPOSES

    known = {one.key: one for one in PURPOSES if one.accuracy}
    if purpose not in known:
        raise RequestError(f"--for is '{purpose}'; errors are judged for: {', '.join(known)}")
    found = {limit.key: limit for limit in known[purpose].accuracy}
    for part in limits.split(",") if limits else ():
        name, _, value = part.strip().partition("=")
        if name not in found:
            raise RequestError(f"--limit: {unknown(name, found, 'limit')}")
        try:
            size = float(value)
        except ValueError:
            size = math.nan
        if not (size > 0.0 and math.isfinite(size)):
            raise RequestError(f"--limit: '{part.strip()}'; write {name}={found[name].size:g}, in {found[name].unit}")
        found[name] = replace(found[name], size=size, source="as asked for by --limit")
    return replace(known[purpose], accuracy=tuple(found.values()))


def refuse(purpose: Purpose, ship: Ship, trials: Sequence[Trial], trained_on: Sequence[str]) -> None:
    """Refuse trials that cannot show whether a model is fit for a purpose, before anything is predicted.

    Raises:
        RequestError: every trial was used in the fit, or none shows what the purpose is about.
    """
    from ..validate.fitness import shows

    unseen = [trial for trial in trials if trial.name not in trained_on]
    if not unseen:
        raise RequestError(f"--for {purpose.key}: the model was fitted to every one of these trials; give others")
    for limit in purpose.accuracy:
        if limit.must and not any(shows(limit, ship, trial) for trial in unseen):
            seconds = limit.horizon * ship.L_pp / ship.speed
            what = f"{limit.when} over {seconds:.3g} s or more" if limit.when else limit.about
            raise RequestError(f"--for {purpose.key}: no trial shows {limit.about} ({what}); give trials that do")


def judged(
    purpose: Purpose, ship: Ship, trials: Sequence[Trial], trained_on: Sequence[str], smooth_start: float | None
) -> Fitness:
    """The verdicts on trials that `refuse` let pass."""
    from ..validate.fitness import judge

    return judge(ship, trials, purpose.accuracy, purpose=purpose.key, title=purpose.title,
                 trained_on=trained_on, smooth_start=smooth_start)  # fmt: skip


def summary(fitness: Fitness) -> tuple[Table, str]:
    """The table and the verdict for a terminal."""
    rows = tuple(_row(one) for one in fitness.found)
    head = ("error", "accepted", "found", "from", "to", "unit", "trials", "errors", "verdict", "why")
    table = Table(head, rows, right=(1, 2, 3, 4, 6, 7))
    return table, f"for {fitness.purpose}: {fitness.verdict}"


def _row(one: Found) -> tuple[str, ...]:
    counts = (str(len(one.errors)), str(sum(map(len, one.errors.values()))))
    sizes = (figure(value, 3) if not math.isinf(value) else "∞" for value in (one.value, one.low, one.high))
    limit = one.limit
    return (f"{limit.key}: {limit.about}", figure(limit.size, 3), *sizes, limit.unit, *counts, one.verdict, one.reason)

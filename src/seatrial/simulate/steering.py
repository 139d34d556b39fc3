"""How the controls of a trial move between their readings: the same in replays, fits and the twin.

It is a property of the channel.  What moves at a finite rate is on the straight line between two readings, whatever
rows lie between them; what a trial lists in `meta["held"]`, as orders, counts until its next reading.  A long gap is
bridged the same way and told as one: neither law knows what happened there.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from ..data import DataError, Trial
from ..data.prepare import between_readings
from ..models import Model


def logged(trial: Trial, name: str) -> bool:
    """Whether a trial has a channel with a value in some row."""
    return name in trial and bool(np.isfinite(trial[name]).any())


def sources(trial: Trial, model: Model) -> tuple[tuple[str, float], ...]:
    """For each control the channel that it is read from, and the factor: its own, else that of its order.

    Raises:
        DataError: the trial has neither.
    """
    for name, (order, _) in zip(model.controls, model.stands_for, strict=True):
        if name not in trial and order not in trial:
            raise DataError(f"{trial.name}: no channel {name}; the model needs {', '.join(model.controls)}")
    both = zip(model.controls, model.stands_for, strict=True)
    return tuple((name, 1.0) if name in trial else stand_in for name, stand_in in both)


def steered(trial: Trial, model: Model, held_too: Collection[str] = ()) -> Trial:
    """The trial with its controls at every row, as they move between their readings.

    Args:
        held_too: controls that hold besides those of its `meta["held"]`.
    """
    read = [name for name, _ in sources(trial, model) if logged(trial, name)]
    return trial.having(**{
        name: between_readings(name, trial.t, trial[name], trial.t, held=name in held_too or is_held(trial, name))
        for name in read
    })  # fmt: skip


def is_held(trial: Trial, name: str) -> bool:
    """Whether a control counts until its next reading; what is not listed in `meta["held"]` moves along a line."""
    return name in trial.meta.get("held", ())


def filled_words(trial: Trial, model: Model, missing: Mapping[str, NDArray[np.bool_]]) -> str:
    """What acts in the rows of such gaps, in words."""
    moving = {source for source, _ in sources(trial, model) if not is_held(trial, source)} & missing.keys()
    if moving == {*missing}:
        return "a straight line joins the readings on either side"
    held_only = "the last value before is held"
    return f"{held_only}, {', '.join(sorted(moving))} by a straight line" if moving else held_only

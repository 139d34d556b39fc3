"""The columns of a campaign's table: their types and units; what a run does not have is null."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.parameters import PRIME, Spec
from ..environment import RANGES, Uniform
from ..models import STATES, unit
from ..simulate.loop import loop_specs
from . import Campaign, Case
from .reading import usual_units
from .tallies import tally_of

if TYPE_CHECKING:
    import polars as pl

WHOLE = ("run", "case")
"""Columns of whole numbers."""

UNITS_KEY = "seatrial.units"
"""Key of the metadata of each file: the unit of each column, as a JSON object; "-" of those that have none."""


def typed(columns: Mapping[str, Any], campaign: Campaign) -> pl.DataFrame:
    """The columns of a part: whole numbers, booleans (`complete`, ``<criterion>_met``) and doubles.

    Null stands where a run has no value: an index that it did not reach, a verdict on it, the time of a failure.
    """
    import polars as pl

    verdicts = {"complete", *(f"{name}_met" for name in campaign.criteria)}
    frame = pl.DataFrame({
        name: column.astype(np.int64 if name in WHOLE else np.float64) for name, column in columns.items()
    })  # fmt: skip
    doubles = [name for name in frame.columns if name not in WHOLE]
    frame = frame.with_columns(pl.col(doubles).fill_nan(None))
    return frame.with_columns((pl.col(name) != 0.0).alias(name) for name in frame.columns if name in verdicts)


def about(units: Mapping[str, str]) -> dict[str, str]:
    """Units as an entry of the metadata of a Parquet file."""
    return {UNITS_KEY: json.dumps(dict(units))}


def units_of(campaign: Campaign) -> dict[str, str]:
    """SI unit of each column, of the table and of its tracks."""
    found = {"run": "-", "case": "-", "t": "s", "failed": "s", "complete": "-",
             **{f"{name}_met": "-" for name in campaign.criteria}}  # fmt: skip
    given = (*campaign.inputs, *(campaign.correlated.names if campaign.correlated else ()), "policy.n_P")
    for case in campaign.cases:
        known = meanings(case)
        found |= {name: shown(known[name].unit) for name in given if name in known}
        found |= index_units(case, campaign.weather)
    return found | {name: unit(name) for name in campaign.kept}


def shown(text: str) -> str:
    """A unit as a column has it."""
    return "-" if text in ("", PRIME) else text


def meanings(case: Case) -> dict[str, Spec]:
    """Meaning and range of all that can be an input of a case, by name."""
    return {**{name: Spec(unit(name), "initial value") for name in STATES}, **RANGES,
            **loop_specs(case.ship, case.manoeuvre)}  # fmt: skip


def index_units(case: Case, around: Uniform) -> dict[str, str]:
    """Unit of each index that the runs of a case have."""
    tally = None if case.stored else tally_of(case.manoeuvre, case.dt, {}, flowing=False)
    if tally is not None:
        return dict(tally.figures)
    return usual_units(case, around.series(case.dt, case.samples)[None], case.samples)

"""Bands of a calibrated model on days that its fit and its factors have not seen: coverage and width.

    seatrial identify studies/esso_osaka_hybrid.toml -o RUN && seatrial calibrate RUN/model.toml --folds day
    python benchmarks/coverage.py RUN/model.toml [-o benchmarks/results/coverage.json]

A fit to the other days predicts each day, and factors from the other days judge it (`bands.crossed`); what
accelerations the model lacks, and the power of novelty, are learnt from all days together.  The width is compared with
the narrowest band that is constant at each horizon and covers 95 % of all errors: a band that knows the answer.
"""

from __future__ import annotations

import argparse
import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from seatrial.belief.bands.calibration import Calibration, beside, crossed_half, read_calibration
from seatrial.belief.bands.held import ALL, GROUPS
from seatrial.data import Array
from seatrial.models import STATES

LEVEL = 0.95
HORIZONS = (10.0, 50.0, 100.0)


def halves(found: Calibration) -> tuple[list[float], Array, Array]:
    """The horizons next to `HORIZONS` [s], and errors and half widths there, each shape (windows, horizons, 6)."""
    left, unit = found.left, np.array(found.left.days)
    half = np.full(left.error.shape, np.nan)
    for one in dict.fromkeys(left.days):
        half[unit == one] = crossed_half(left, found.share, LEVEL, found.novel, unit == one)
    rows = [int(np.argmin(np.abs(left.horizons - h))) for h in HORIZONS]
    return left.horizons[rows].tolist(), np.where(np.isfinite(half), left.error, np.nan)[:, rows], half[:, rows]


def mean(inside: Array) -> float:
    return round(float(np.nanmean(inside)), 4)


def told(inside: Array, trials: Array, horizons: list[float]) -> dict[str, Any]:
    """Coverage by group and horizon, with the number of windows and trials."""
    known = np.isfinite(inside).any(axis=(1, 2))
    out: dict[str, Any] = {"trials": len(set(trials[known])), "windows": int(known.sum())}
    for name, group in GROUPS.items():
        where = [STATES.index(one) for one in group]
        out[name] = {f"{h:.3g} s": mean(inside[:, j][:, where]) for j, h in enumerate(horizons)}
    return out | {"together": mean(inside)}


def main() -> None:
    """Measure, print and write."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("model", type=Path)
    asked.add_argument("-o", "--out", type=Path, default=Path(__file__).parent / "results" / "coverage.json")
    said = asked.parse_args()
    found = read_calibration(beside(said.model))
    horizons, error, half = halves(found)
    inside = np.where(np.isfinite(error), np.abs(error) <= half, np.nan)
    trials, kinds, days = (np.array(some) for some in (found.left.trials, found.left.kinds, found.left.days))
    rows = {kind: told(inside[kinds == kind], trials[kinds == kind], horizons) for kind in sorted(set(kinds))}
    rows[ALL] = told(inside, trials, horizons)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # no window of a trial may reach a horizon
        cells = np.array([np.nanmean(inside[trials == one], axis=(0, 1)) for one in dict.fromkeys(trials)])
    few = [f"{trial} {STATES[k]} {cells[j, k]:.2f}" for j, trial in enumerate(dict.fromkeys(trials))
           for k in np.flatnonzero(cells[j] < 0.8)]  # fmt: skip
    least = np.nanquantile(np.abs(error), LEVEL, axis=0)
    width = np.nanmean(np.where(np.isfinite(error), half, np.nan), axis=0) / least
    wide = {f"{h:.3g} s": dict(zip(STATES, row.round(2).tolist(), strict=True))
            for h, row in zip(horizons, width, strict=True)}  # fmt: skip
    out = {"what": "coverage of 95 % bands on days that fit and factors have not seen, started as measured",
           "command": "python benchmarks/coverage.py RUN/model.toml", "level": LEVEL, "coverage": rows,
           "by day": {day: mean(inside[days == day]) for day in sorted(set(days))},
           "trials and channels": {"count": int(np.isfinite(cells).sum()), "under 80 %": few},
           "width over the narrowest constant band": wide}  # fmt: skip
    said.out.write_text(json.dumps(out, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(out, indent=1))


if __name__ == "__main__":
    main()

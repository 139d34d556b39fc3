"""What of the controls and the environment a trial did not log, row by row: where a prediction has to fill in."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from .data import Array, Trial
from .models import STATES, Model, follows
from .simulate import SIMULATED

VECTORS: Mapping[str, tuple[str, str]] = {
    "wind_x": ("U_T", "gamma_T"), "current_x": ("U_C", "gamma_C"), "wave_x": ("H_S", "gamma_W"),
}  # fmt: skip
"""Size and direction, as logged, of what stands at a channel of the environment and the one behind it."""
APPARENT = ("U_A", "gamma_A")


def logged(trial: Trial, name: str) -> bool:
    """Whether a trial has a channel, and a value of it in some row."""
    return name in trial and bool(np.isfinite(trial[name]).any())


def from_apparent(trial: Trial) -> bool:
    """Whether the true wind is known by the apparent one (U_A, gamma_A) and the measured motion only."""
    told = all(logged(trial, name) for name in VECTORS["wind_x"])
    return not told and all(logged(trial, name) for name in (*APPARENT, "psi", "u", "v_m"))


def wind_of(trial: Trial) -> tuple[Array, Array] | None:
    """North and east components of where the true wind comes from [m/s], shape (samples,); None without a wind.

    An apparent wind is turned into the true one by heading and velocity over ground at midship; the lever of the
    mast, which is not known, is left out.
    """
    if not from_apparent(trial):
        if not all(logged(trial, name) for name in VECTORS["wind_x"]):
            return None
        return trial["U_T"] * np.cos(trial["gamma_T"]), trial["U_T"] * np.sin(trial["gamma_T"])
    ahead = trial["U_A"] * np.cos(trial["gamma_A"]) - trial["u"]
    aside = trial["U_A"] * np.sin(trial["gamma_A"]) - trial["v_m"]
    c, s = np.cos(trial["psi"]), np.sin(trial["psi"])
    return ahead * c - aside * s, ahead * s + aside * c


def wind_words(trial: Trial, felt: bool) -> str:
    """What is done with an apparent wind, in one line; empty where there is none, or a true one.

    Args:
        felt: whether the wind moves the ship.
    """
    blows = logged(trial, "U_A") and float(np.nanmax(np.abs(trial["U_A"]))) > 0.0
    if not blows or all(logged(trial, name) for name in VECTORS["wind_x"]):
        return ""
    if not felt:
        return "its apparent wind (U_A) is left out: the model has no force of wind"
    if from_apparent(trial):
        return "its true wind is reckoned from U_A, gamma_A and the measured motion"
    return ""


def gaps(trial: Trial, model: Model) -> dict[str, NDArray[np.bool_]]:
    """Where `replay.inputs` fills in what acts: rows without a value, shape (samples,), by channel."""
    steering = (name if name in trial else order for name, (order, _) in zip(
        model.controls, follows(model), strict=True))  # fmt: skip
    pairs = (*VECTORS.values(), *((APPARENT,) if from_apparent(trial) else ()))
    around = (name for pair in pairs if all(logged(trial, one) for one in pair) for name in pair)
    acting = [name for name in (*steering, *around, "T_W", "depth") if logged(trial, name)]
    missing = {name: np.asarray(~np.isfinite(trial[name])) for name in acting}
    return {name: rows for name, rows in missing.items() if rows.any()}


def no_wind(trial: Trial, model: Model) -> bool:
    """Whether a trial is taken as in still air for want of wind; a model that needs it refuses (`replay.inputs`)."""
    refused = bool(getattr(model, "needed", ())) and trial.meta.get("source") != SIMULATED
    return not refused and wind_of(trial) is None


def gap_words(trial: Trial, missing: Mapping[str, NDArray[np.bool_]]) -> str:
    """Channels with gaps, how many of the rows they are, and the longest stretch [s] of each."""
    return ", ".join(
        f"{name} has no value in {int(rows.sum())} of {rows.size} rows (up to {_longest(rows) * trial.dt:.3g} s on end)"
        for name, rows in missing.items()
    )


def predicted(trial: Trial) -> slice:
    """Rows that are predicted: from the first complete state to the last; all, where there is none."""
    if not all(name in trial for name in STATES):
        return slice(None)
    good = np.flatnonzero(np.isfinite(trial.stack(*STATES)).all(axis=1))
    return slice(int(good[0]), int(good[-1]) + 1) if good.size else slice(None)


def _longest(rows: NDArray[np.bool_]) -> int:
    return max((sum(1 for _ in run) for missing, run in groupby(rows.tolist()) if missing), default=0)

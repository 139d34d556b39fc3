"""The turning circle: rudder hard over from a straight run, and the figures of the circle.

All lengths are measured from the execute point, along and across the heading *at execute*, so that
a drift during the approach does not enter (IMO MSC.137(76), MSC/Circ.1053).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..data import Array, DataError, Trial, unwrapped
from ..parameters import Scalar, spec
from . import Index

_QUARTER = 0.5 * math.pi
# The steady part is read off the last quarter turn of a run that went round at least once.
_STEADY_AFTER = 2.0 * math.pi
_COMPLETE = 3.0 * math.pi
# Departure, as a fraction of the set angle, that no noise of a rudder sensor is taken for.
_DEPARTURE = 0.05


@dataclass(frozen=True)
class Turning:
    """Rudder over at t = 0 and held there; the sign of `delta` is the side."""

    kind: ClassVar[str] = "turning"
    memory: ClassVar[tuple[str, ...]] = ()

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    delta: Scalar = spec("rad", "rudder angle, positive to starboard", (-math.pi, math.pi))

    def begin(self, state: tuple[Scalar, ...]) -> tuple[Scalar, ...]:
        """Nothing to remember."""
        return ()

    def command(
        self, t: Scalar, state: tuple[Scalar, ...], memory: tuple[Scalar, ...]
    ) -> tuple[tuple[Scalar, ...], tuple[Scalar, ...]]:
        """Constant revolutions [1/s] and rudder [rad] from t = 0 on."""
        return (self.n_P, self.delta), memory

    def complete(self, trial: Trial) -> bool:
        """Whether the heading has changed by 540 deg or more since the execute."""
        change = self._change(after(trial, self.delta))
        return bool(change.size and np.nanmax(change) >= _COMPLETE)

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Advance, transfer and diameters [m], times [s], speed loss [-] and drift angle [rad].

        A figure whose heading the run never reaches, or whose channels it lacks, is left out.
        Lengths are positive towards the side of the rudder; the drift angle is positive with the
        bow inside the circle.

        Raises:
            DataError: the rudder never leaves its initial angle, or position or heading is absent.
        """
        run = after(trial, self.delta)
        change = self._change(run)
        along, across = track(run)
        across = self._side * across
        out: dict[str, Index] = {}
        for angle, name, lengths in (
            (1.0, "time_90", {"advance": along, "transfer": across}),
            (2.0, "time_180", {"tactical_diameter": across}),
        ):
            moment = reached(change, angle * _QUARTER)
            if moment is None:
                continue
            for length, values in lengths.items():
                out[length] = in_lengths(at(values, moment), L_pp)
            out[name] = Index(at(run.t, moment) - float(run.t[0]), "s")
        return {**out, **self._steady(run, change, L_pp)}

    def _steady(self, run: Trial, change: Array, L_pp: float) -> dict[str, Index]:
        if not all(name in run for name in ("u", "v_m", "r")) or np.nanmax(change) < _STEADY_AFTER:
            return {}
        last = change >= np.nanmax(change) - _QUARTER
        U = np.hypot(run["u"], run["v_m"])
        U_end = float(np.nanmean(U[last]))
        r_end = abs(float(np.nanmean(run["r"][last])))
        drift = float(np.nanmean(np.arctan2(-run["v_m"][last], run["u"][last])))
        start = U[np.isfinite(U)][0]
        out = {"speed_loss": Index(1.0 - U_end / float(start), "-")} if start > 0 else {}
        out["drift"] = Index(self._side * drift, "rad")
        return {"steady_diameter": in_lengths(2.0 * U_end / r_end, L_pp), **out} if r_end > 0 else out

    @property
    def _side(self) -> float:
        return math.copysign(1.0, self.delta)

    def _change(self, run: Trial) -> Array:
        """Heading change since the execute, positive towards the rudder's side [rad]."""
        return self._side * turned(run)


def after(trial: Trial, delta: float) -> Trial:
    """The run from its execute on: where the rudder first leaves its initial angle.

    The execute is the first sample with the new order; where only the rudder's answer was
    recorded, the last sample before it moves.  A run that begins with the order on, or with the
    rudder over, executes at its first sample.

    Args:
        trial: the run, with `delta_cmd` or `delta` [rad].
        delta: set rudder angle, positive to starboard [rad].

    Raises:
        DataError: the rudder never leaves its initial angle.
    """
    name = "delta_cmd" if "delta_cmd" in trial else "delta"
    known = np.isfinite(trial[name]) & np.isfinite(trial["psi"])
    run = trial.rows(known)
    rudder = run[name]
    side = math.copysign(1.0, delta)
    if rudder.size and side * rudder[0] >= 0.5 * abs(delta):
        return run
    departure = np.abs(rudder - rudder[:1])
    moved = np.flatnonzero(departure > _DEPARTURE * abs(delta))
    if not moved.size:
        raise DataError(f"{trial.name}: {name} never leaves its initial angle; no execute to measure from")
    first = int(moved[0])
    return run.rows(slice(first if name == "delta_cmd" else _foot(departure, first), None))


def _foot(departure: Array, row: int) -> int:
    """Row at the foot of the ramp that climbs to `row`."""
    while row > 0 and departure[row - 1] < departure[row]:
        row -= 1
    return row


def turned(run: Trial) -> Array:
    """Heading relative to that of the first sample, positive to starboard, unwrapped [rad]."""
    psi = unwrapped(run["psi"])
    return psi - psi[0]


def track(run: Trial) -> tuple[Array, Array]:
    """Distance along and to starboard of the heading at the first sample [m]."""
    c, s = math.cos(run["psi"][0]), math.sin(run["psi"][0])
    north, east = run["x"] - run["x"][0], run["y"] - run["y"][0]
    return c * north + s * east, c * east - s * north


def reached(values: Array, level: float) -> float | None:
    """Row, as a fraction, at which `values` first comes up to `level`; None where it never does."""
    beyond = np.flatnonzero(values >= level)
    if not beyond.size:
        return None
    i = int(beyond[0])
    if i == 0:
        return 0.0
    return i - 1 + float((level - values[i - 1]) / (values[i] - values[i - 1]))


def at(values: Array, row: float) -> float:
    """Value at a fractional row, linear between samples."""
    i = min(int(row), values.size - 1)
    j = min(i + 1, values.size - 1)
    return float(values[i] + (row - i) * (values[j] - values[i]))


def in_lengths(value: float, L_pp: float) -> Index:
    """A length [m], in ship lengths too."""
    return Index(value, "m", value / L_pp)

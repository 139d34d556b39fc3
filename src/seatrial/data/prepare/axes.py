"""Axes, running integrals and Froude scale of a trial's channels."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from .. import Array, DataError, Trial
from ..units import standard_unit


def to_body(dx: Array, dy: Array, psi: Array) -> tuple[Array, Array]:
    """Velocities north and east [m/s] as surge and sway [m/s] of a ship heading psi [rad]."""
    c, s = np.cos(psi), np.sin(psi)
    return dx * c + dy * s, dy * c - dx * s


def to_earth(u: Array, v_m: Array, psi: Array) -> tuple[Array, Array]:
    """Surge and sway [m/s] of a ship heading psi [rad] as velocities north and east [m/s]."""
    c, s = np.cos(psi), np.sin(psi)
    return u * c - v_m * s, u * s + v_m * c


def true_wind(U_A: Array, gamma_A: Array, psi: Array, u: Array, v_m: Array) -> tuple[Array, Array]:
    """Where the true wind comes from, north and east [m/s], by the apparent one of a point that moves with u, v_m."""
    return to_earth(U_A * np.cos(gamma_A) - u, U_A * np.sin(gamma_A) - v_m, psi)


def integral(t: Array, rate: Array) -> Array:
    """Running integral of `rate` over t from zero, by trapezia; same shape."""
    return np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])


def froude_scaled(trial: Trial, ratio: float) -> Trial:
    """The trial of a geometrically similar ship `ratio` times as long, at the same Froude number.

    Lengths grow with the ratio, times and velocities with its root; angles stay.  Channels of other
    units (forces, say) are left out: their scaling needs the water too.
    """
    if not (ratio > 0 and math.isfinite(ratio)):
        raise DataError(f"{trial.name}: a scale ratio of {ratio:g}; it must be above zero")
    root = math.sqrt(ratio)
    factors = {"m": ratio, "s": root, "m/s": root, "rad/s": 1 / root, "1/s": 1 / root, "rad": 1.0, "-": 1.0}
    channels = {
        name: values * factors[unit]
        for name, values in trial.channels.items()
        if (unit := standard_unit(name) or trial.unit(name)) in factors
    }
    units = {name: unit for name, unit in trial.units.items() if name in channels}
    meta = dict(trial.meta)
    if "L_pp" in meta:
        meta["L_pp"] = meta["L_pp"] * ratio
    if "scale" in meta:
        meta["scale"] = meta["scale"] / ratio
    out = replace(trial, t=trial.t * root, channels=channels, units=units, meta=meta, file=None)
    return out.noting(f"scaled to a ship {ratio:g} times as long at equal Froude number")

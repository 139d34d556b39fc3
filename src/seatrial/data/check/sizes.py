"""Suspects whose size is fitted: biases, scales, lags, lever arms, speeds through the water; what is told of each."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ...core.constants import GRAVITY
from .. import Trial
from ..prepare import Remedy, Step
from .relations import has, length_of
from .repairs import Suspect, step, times

_DEG = math.pi / 180.0
# A factor beyond this is a unit, if one explains it.
_LARGE = 0.3

Make = Callable[[Sequence[Trial], list[float], list[float]], Suspect | None]
"""The suspect of sizes and their standard errors, where they matter."""


def length(trials: Sequence[Trial]) -> float:
    return next((size for trial in trials if (size := length_of(trial))), 100.0)


def _speed(trials: Sequence[Trial]) -> float:
    tops = [float(np.nanquantile(np.abs(t["u"]), 0.9)) for t in trials if "u" in t and np.isfinite(t["u"]).any()]
    return max(tops, default=1.0)


def _heading_bias(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    degrees = sizes[0] / _DEG
    if abs(degrees) < 0.4:
        return None
    return Suspect(
        "heading_bias", ("psi",), f"heading bias of {degrees:+.2f} deg (or magnetic heading)",
        step("add", "psi", amount=(-degrees,), unit="deg"), "quality",
        f"the track lies {-degrees:+.2f} +- {errors[0] / _DEG:.2f} deg from heading and drift, on every heading", False,
    )  # fmt: skip


def _log_scale(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    if abs(sizes[0]) < 0.02:
        return None
    return Suspect(
        "log_scale", ("u", "v_m"), f"speeds are {100 * sizes[0]:+.1f} % off the track",
        times(1.0 / (1.0 + sizes[0]), "u", "v_m"), "scale" if abs(sizes[0]) > 0.15 else "quality",
        f"{100 * sizes[0]:+.2f} +- {100 * errors[0]:.2f} %",
        abs(sizes[0]) > 0.15, abs(sizes[0]) > _LARGE,
    )  # fmt: skip


def _log_bias(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    speed = _speed(trials)
    if max(map(abs, sizes)) < 0.01 * speed:
        return None
    names = ("u", "v_m")[: len(sizes)]
    words = ", ".join(f"{n} {size:+.3g} m/s" for n, size in zip(names, sizes, strict=True))
    return Suspect(
        "log_bias", names, f"speed log has a bias: {words}",
        Remedy(steps=tuple(Step(do="add", channels=(n,), amount=(float(f"{-size:.4g}"),), unit="m/s")
                           for n, size in zip(names, sizes, strict=True))), "quality",
        ", ".join(f"{size:+.3g} +- {error:.2g} m/s" for size, error in zip(sizes, errors, strict=True)), False,
    )  # fmt: skip


def _lever(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    if math.hypot(*sizes) < 0.03 * length(trials):
        return None
    ahead, aside = sizes
    where = f"{abs(ahead):.3g} m {'ahead' if ahead > 0 else 'abaft'}, {abs(aside):.3g} m to " + (
        "starboard" if aside > 0 else "port"
    )
    return Suspect(
        "lever_arm", ("x", "y"), f"x, y are those of an antenna {where} of midship",
        step("move", "x", "y", amount=(ahead, aside)), "quality",
        f"{ahead:+.3g} +- {errors[0]:.2g} m ahead, {aside:+.3g} +- {errors[1]:.2g} m to starboard", False,
    )  # fmt: skip


def _sway_lever(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    ahead, aside = -sizes[0], -sizes[1]
    if math.hypot(ahead, aside) < 0.03 * length(trials) or not has(trials[0], "r"):
        return None
    return Suspect(
        "lever_arm", ("u", "v_m"), f"u, v_m are those of a point {ahead:+.3g} m ahead and {aside:+.3g} m to starboard "
        "of midship", step("move", "u", "v_m", amount=(ahead, aside)), "quality",
        f"{ahead:+.3g} +- {errors[0]:.2g} m ahead", False,
    )  # fmt: skip


def _late(*names: str) -> Callable[[Sequence[Trial], list[float], list[float]], Suspect | None]:
    def make(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
        lag, dt = sizes[0], float(np.median([trial.dt for trial in trials]))
        if abs(lag) < max(0.3 * dt, 0.05 * math.sqrt(length(trials) / GRAVITY)):
            return None
        which = ", ".join(names)
        if names[0] == "x" and lag < 0:
            return _early(lag, errors[0])
        return Suspect(
            "lag", names, f"{which} {'is' if len(names) == 1 else 'are'} {'late' if lag > 0 else 'early'} by "
            f"{abs(lag):.2g} s",
            step("shift", *names, amount=(-lag,)), "quality",
            f"{lag:+.3g} +- {errors[0]:.2g} s against "
            f"{'heading and speeds' if names[0] == 'x' else 'the others'}", False,
        )  # fmt: skip

    return make


def _early(lag: float, error: float) -> Suspect:
    """A receiver is not early: rather the velocity over ground was smoothed before psi turned it into u and v_m."""
    return Suspect(
        "lag", ("x", "y", "u", "v_m"), f"u, v_m are late by {-lag:.2g} s, both over ground, or x, y are early",
        step("shift", "x", "y", amount=(-lag,), text="take u, v_m from track and heading, which is better"), "quality",
        f"x, y {lag:+.3g} +- {error:.2g} s against heading and speeds", False,
    )  # fmt: skip


def _water(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    speed, towards = math.hypot(*sizes), math.degrees(math.atan2(sizes[1], sizes[0])) % 360.0
    if speed < 0.015 * _speed(trials):
        return None
    return Suspect(
        "through_water", ("u", "v_m"), f"speeds are through the water, in a current of {speed:.3g} m/s towards "
        f"{towards:.0f} deg", step("to_ground", "u", "v_m", amount=(speed, towards)), "quality",
        f"the track drifts {sizes[0]:+.3g} +- {errors[0]:.2g} m/s north, {sizes[1]:+.3g} +- {errors[1]:.2g} m/s east",
        False,
    )  # fmt: skip


def _gyro_bias(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    ship_time = math.sqrt(length(trials) / GRAVITY)
    if abs(sizes[0]) * ship_time < 1e-3:
        return None
    a_minute = sizes[0] / _DEG * 60.0
    return Suspect(
        "gyro_bias", ("r",), f"rate of turn has a bias of {a_minute:+.3g} deg/min",
        step("add", "r", amount=(-a_minute,), unit="deg/min"), "quality",
        f"heading turns {-a_minute:+.3g} +- {errors[0] / _DEG * 60:.2g} deg/min more than r gives", False,
    )  # fmt: skip


def _gyro_scale(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    if abs(sizes[0]) < 0.02:
        return None
    return Suspect(
        "gyro_scale", ("r",), f"rate of turn is {100 * sizes[0]:+.1f} % off the heading",
        times(1.0 / (1.0 + sizes[0]), "r"), "scale" if abs(sizes[0]) > 0.15 else "quality",
        f"{100 * sizes[0]:+.2f} +- {100 * errors[0]:.2f} %", abs(sizes[0]) > 0.15,
        abs(sizes[0]) > _LARGE,
    )  # fmt: skip


def _time_scale(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    if abs(sizes[0]) < 0.004 or not any(has(trial, "r", "psi") for trial in trials):
        return None
    dt, factor = float(np.median([trial.dt for trial in trials])), 1.0 / (1.0 + sizes[0])
    return Suspect(
        "time_scale", ("t",), "the time step is not the true one",
        step("clock", amount=(factor,), text=f"use the clock of the log, the true step is about {dt * factor:.4g} s "
             f"instead of {dt:.4g} s"), "step",
        f"positions move and heading turns {factor:.4f} +- {errors[0]:.1g} times as much as u, v_m, r give",
        abs(sizes[0]) > 0.04, abs(sizes[0]) > _LARGE,
    )  # fmt: skip


def _stretched(name: str) -> Make:
    """Positions of one direction longer than the speeds make them; east by longitudes that were taken as latitudes."""

    def make(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
        size = sizes[0]
        if abs(size) < 0.02 or size <= -1.0:
            return None
        least, most = sorted((1.0, 1.0 + size))
        latitude = round(math.degrees(math.acos(least / most)))
        cosine = f", as by the cosine of {latitude} deg of latitude" if name == "y" else ""
        return Suspect(
            "stretch", (name,), f"{name} is {100 * size:+.1f} % off the speeds, the other direction is not",
            times(1.0 / (1.0 + size), name, text="compute positions from latitude and longitude"), "scale",
            f"{100 * size:+.2f} +- {100 * errors[0]:.2f} %{cosine}", abs(size) > 0.04,
        )  # fmt: skip

    return make


FITTED: tuple[tuple[tuple[str, ...], Make], ...] = (
    (("heading_bias",), _heading_bias),
    (("log_scale",), _log_scale),
    (("log_bias",), _log_bias),
    (("log_bias", "sway_bias"), _log_bias),
    (("lever_ahead", "lever_aside"), _lever),
    (("lever_ahead", "lever_aside"), _sway_lever),
    (("lag_x",), _late("x", "y")),
    (("lag_psi",), _late("psi")),
    (("lag_u",), _late("u", "v_m")),
    (("lag_r",), _late("r")),
    (("water_north", "water_east"), _water),
    (("gyro_bias",), _gyro_bias),
    (("gyro_scale",), _gyro_scale),
    (("time_scale",), _time_scale),
    (("north_stretch",), _stretched("x")),
    (("east_stretch",), _stretched("y")),
)
"""Errors of instruments whose size is fitted, the keys of the instruments that each tells, and the fit."""

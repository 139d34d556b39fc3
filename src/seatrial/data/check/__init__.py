"""What is wrong with a trial: findings with numbers, and what to do about each.

Each check is a function of a trial that yields findings; `check` runs them all.  Thresholds are set
such that the 35 files of FRT-DS-ESSO and the SIMMAN 2008 files, read rightly, give no error, and
each known fault of a public log does (tests/data/test_check.py).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from .. import Trial
from .evidence import Slope, motion_slopes, rate_slope, rudder_effect, steady_turn
from .gaps import gap_faults
from .overlap import shared
from .sensors import Fault, Kind, beyond_faults, sensor_faults, wind_faults
from .still import still_faults
from .track import track_faults

Severity = Literal["error", "warning", "info"]
_G = 9.81
# Controls of thrusters that can turn a ship without way.
_ON_THE_SPOT = ("alpha", "n_bow", "n_stern", "f_")
_MEANT = {
    "earth": ("u, v_m are velocities north and east, not surge and sway", "turn them into body axes by psi"),
    "earth, east first": ("u, v_m are velocities east and north", "swap and turn them into body axes by psi"),
    "sway to port": ("v_m counts to port", "change its sign"),
    "heading counterclockwise": ("psi counts counterclockwise", "change its sign"),
    "x east, y north": ("x is east and y is north", "swap them"),
}
_UNITS_APART = 40.0  # from here on two readings of one motion differ by a unit, not by a poor instrument


@dataclass(frozen=True)
class Finding:
    """One thing about a trial that its user should know.

    Attributes:
        severity: "error" (do not use it as it is), "warning" or "info".
        what: the fault in a few words.
        where: trial and channel.
        evidence: the numbers that show it.
        remedy: what to do.
        kind: of the fault, see `sensor_checks.Kind`.
        trials, channels: those it is about, the trial under test last.
    """

    severity: Severity
    what: str
    where: str
    evidence: str
    remedy: str
    kind: Kind = "quality"
    trials: tuple[str, ...] = ()
    channels: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.severity}: {self.where}: {self.what} ({self.evidence}); {self.remedy}"


def check(trial: Trial) -> tuple[Finding, ...]:
    """All findings of one trial, errors first; none means that no known fault was seen."""
    if len(trial) < 20:
        few = Fault("error", "t", "too short to judge", f"{len(trial)} rows", "record at least 20 rows", "short")
        return (_finding(trial, few),)
    if beyond := [*beyond_faults(trial)]:
        return tuple(_finding(trial, fault) for fault in beyond)
    faults = [*gap_faults(trial), *sensor_faults(trial)]
    if bool((np.diff(trial.t) > 0).all()):
        heading = [*_yaw_faults(trial)]
        faults += heading
        for one in (still_faults, _rudder_faults, _scale_faults, track_faults):
            faults += one(trial)
        # while nobody knows what psi is in, what it makes of other channels accuses none of them
        unknown_heading = any(fault.kind == "unit" for fault in heading)
        for one in (_motion_faults, wind_faults):
            faults += [fault for fault in one(trial) if fault.severity != "warning" or not unknown_heading]
    found = [_finding(trial, fault) for fault in faults]
    return tuple(sorted(found, key=lambda f: ("error", "warning", "info").index(f.severity)))


def check_set(train: Iterable[Trial], test: Iterable[Trial]) -> tuple[Finding, ...]:
    """Recordings that training and test share, whole or in part, under whatever names.

    Returns:
        An error for each pair of trials of which at least ten rows are the same.
    """
    ours, theirs = tuple(train), tuple(test)
    return tuple(
        Finding(
            "error", "training and test share a recording", f"{ours[a].name} and {theirs[b].name}",
            f"{rows} rows are the same, {100 * part:.0f} % of {theirs[b].name}",
            "keep both in training or both in test", "overlap", (ours[a].name, theirs[b].name),
        )
        for a, b, rows, part in shared(ours, theirs)
    )  # fmt: skip


def _finding(trial: Trial, fault: Fault) -> Finding:
    about = f"{trial.name}: {fault.where}"
    said = (fault.severity, fault.what, about, fault.evidence, fault.remedy, fault.kind)
    return Finding(*said, (trial.name,), fault.channels)


def _length(trial: Trial) -> float | None:
    value: Any = trial.meta.get("L_pp")
    return float(value) if isinstance(value, int | float) and value > 0 else None


def _window(trial: Trial) -> float:
    """Length of the comparison windows [s]: ten ship times, or a part of the trial."""
    ship = _length(trial)
    wanted = 10.0 * math.sqrt(ship / _G) if ship else 0.05 * trial.duration
    return float(np.clip(wanted, 10 * trial.dt, max(0.2 * trial.duration, 10 * trial.dt)))


def _has(trial: Trial, *names: str) -> bool:
    return all(name in trial for name in names)


def _motion_faults(trial: Trial) -> Iterator[Fault]:
    """Positions against velocities: axes, signs, scale, and the time step."""
    if not _has(trial, "x", "y", "u", "v_m", "psi"):
        return
    slopes = motion_slopes(trial, _window(trial))
    if "body" not in slopes:
        return
    ours = slopes["body"]
    best = min(slopes, key=lambda name: slopes[name].rms)
    # a fault shows where another reading is right and ours is not
    if slopes[best].correlation > 0.97 and slopes[best].rms < 0.4 * ours.rms:
        what, remedy = _MEANT[best]
        yield Fault(
            "error", "u, v_m", what,
            f"displacement misses by {ours.rms:.3g} m rms as body velocities, by {slopes[best].rms:.3g} m so",
            remedy, "axes",
        )  # fmt: skip
    elif ours.correlation < 0.9:
        yield Fault(
            "warning", "x, y, u, v_m", "positions do not follow the velocities",
            f"correlation {ours.correlation:.3f}", "check axes, reference point and time of the sensors",
        )  # fmt: skip
    elif abs(ours.value - 1.0) > 0.04:
        yield _stretched(trial, ours.value)


def _stretched(trial: Trial, value: float) -> Fault:
    """Positions and velocities differ by a factor: the time step where the heading says so too."""
    yaw = rate_slope(trial, "psi", "r", _window(trial)) if _has(trial, "psi", "r") else None
    same = yaw is not None and yaw.correlation > 0.9 and abs(yaw.value / value - 1.0) < 0.03
    far = "error" if abs(value - 1.0) > 0.15 or same else "warning"
    if same and yaw is not None:
        return Fault(
            far, "t", "the time step is not the true one",
            f"positions move {value:.3f} and heading turns {yaw.value:.3f} times as much as u, v_m, r say",
            f"true step about {trial.dt * value:.4g} s instead of {trial.dt:.4g} s; use the clock of the log", "step",
        )  # fmt: skip
    return Fault(
        far, "x, y, u, v_m", "positions and velocities have different scales",
        f"positions move {value:.3f} times as far as u, v_m say",
        "check units (kn, km/h), the model scale, and the time step",
    )  # fmt: skip


def _yaw(trial: Trial) -> Slope | None:
    """How fast psi turns for what r says; None where they have too little to do with each other."""
    slope = rate_slope(trial, "psi", "r", _window(trial)) if _has(trial, "psi", "r") else None
    return None if slope is None or abs(slope.correlation) < 0.8 else slope


def _yaw_faults(trial: Trial) -> Iterator[Fault]:
    """The heading's rate against r: sign, units, scale; which of the two is wrong, they do not say."""
    slope = _yaw(trial)
    if slope is None:
        return
    numbers = f"psi turns {slope.value:.3g} times as much as r says, correlation {slope.correlation:.3f}"
    apart = max(abs(slope.value), 1.0 / abs(slope.value))
    if slope.value < 0:
        yield Fault("error", "psi, r", "psi and r have opposite signs", numbers, "change the sign of one", "sign")
    elif apart > _UNITS_APART:
        yield Fault(
            "error", "psi, r", f"heading and rate of turn disagree by a factor of {apart:.3g}", numbers,
            "one of them is in degrees or per minute: say which in its unit", "unit",
        )  # fmt: skip
    elif apart > 1.1:
        yield Fault("warning", "psi, r", "psi and r have different scales", numbers,
                    "check units and time step")  # fmt: skip


def _rudder_faults(trial: Trial) -> Iterator[Fault]:
    """Going ahead, a rudder above zero turns the bow to starboard."""
    if not _has(trial, "u", "r", "delta"):
        return
    yaw = _yaw(trial)
    wrong, remedy = "rudder sign: above zero turns to port", "change the sign of delta"
    if yaw is not None and yaw.value < 0:
        return  # first it must be known which way the ship turns
    if yaw is None:
        wrong, remedy = "rudder sign, or that of r: above zero turns to port", "change the sign of delta, or of r"
    turn = steady_turn(trial)
    if turn is not None:
        if turn[0] * turn[1] < 0:
            yield Fault(
                "error", "delta", wrong,
                f"going ahead with {turn[0]:+.3g} rad of rudder held, r is {turn[1]:+.3g} rad/s in the mean",
                remedy, "sign",
            )  # fmt: skip
        return
    effect = rudder_effect(trial, 0.5 * _window(trial))
    if effect is None:
        return
    gain, certainty, _ = effect
    if certainty < -4:
        yield Fault(
            "error", "delta", wrong,
            f"dr/dt changes by {gain:.3g} 1/s^2 per rad of rudder going ahead, "
            f"{-certainty:.0f} standard errors below zero",
            remedy, "sign",
        )  # fmt: skip
    elif abs(certainty) < 2:
        yield Fault(
            "info", "delta", "rudder hardly shows in r",
            f"dr/dt changes by {gain:.3g} 1/s^2 per rad, {abs(certainty):.1f} standard errors",
            "do not expect rudder parameters from this trial",
        )  # fmt: skip


def _scale_faults(trial: Trial) -> Iterator[Fault]:
    """Speed and yaw rate against the length: a model's log with a ship's length, or the reverse."""
    length = _length(trial)
    if length is None or not _has(trial, "u"):
        return
    u = np.abs(trial["u"])
    speed = float(np.nanquantile(u, 0.95)) if np.isfinite(u).any() else 0.0
    froude = speed / math.sqrt(_G * length)
    if froude > 0.6:
        yield Fault(
            "error", "u", "wrong scale or unit: too fast for its length",
            f"Froude number {froude:.2f} at {speed:.3g} m/s and L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of the speed", "scale",
        )  # fmt: skip
    if "r" not in trial or speed <= 0:
        return
    fast = u > 0.5 * speed
    turn = np.abs(trial["r"][fast]) * length / u[fast]
    sharp = float(np.nanquantile(turn, 0.95)) if np.isfinite(turn).any() else 0.0
    if sharp > 3.0:
        spot = any(name.startswith(_ON_THE_SPOT) for name in trial.channels)
        yield Fault(
            "warning" if spot else "error", "r", "wrong scale or unit: turns too sharply for its length",
            f"r L/u is {sharp:.2g} in the fastest rows (ships stay below about 1.5), L_pp {length:g} m",
            "check L_pp and scale in the sidecar and the unit of r", "scale",
        )  # fmt: skip

"""Kinds told by speed and engine: at rest, one place held, astern, sideways, stopping, berthing, straight runs."""

from __future__ import annotations

import math

import numpy as np

from ...core.constants import GRAVITY
from ...core.ranks import median, quantile
from .kind import Kind
from .signals import DEGREE, Signals, both_ways

# Midships: all but a twentieth of the samples within this of their median.
_CALM, _STILL_RUDDER = 3.0 * DEGREE, 1.5 * DEGREE
# Shares of the time.
_MOSTLY, _OFTEN = 0.6, 0.5
# Speeds as shares of the highest.
_REST, _LOST, _STEADY = 0.3, 0.35, 0.75
# A held course: heading within this, for this share of the time; a straight run keeps all within.
_COURSE, _STRAIGHT, _CHANGES = 4.0 * DEGREE, 6.0 * DEGREE, 8
# So far an unsteered ship may turn of itself and still be on a straight run.
_DRIFT = 360.0 * DEGREE
# A place held: lengths of the ship; Froude number of a ship that only keeps its place.
_PLACE, _SLOW, _STILL = 1.0, 0.03, 5e-4


def resting(seen: Signals) -> Kind | None:
    """No motion, or one place held by thrusters."""
    if seen.U is None or seen.reach is None:
        return None
    size = np.ptp(seen.reach, axis=0)
    extent = float(np.max(size))
    if not math.isfinite(seen.L_pp):
        return None
    froude = quantile(seen.U, 0.9) / math.sqrt(GRAVITY * seen.L_pp)
    busy = seen.n is not None and quantile(np.abs(seen.n), 0.9) > 0.0
    slow = f"speed below {quantile(seen.U, 0.9):.2g} m/s"
    told = f"positions within {extent:.3g} m, {extent / seen.L_pp:.2g} L; {slow}"
    if froude < _STILL and extent < 0.1 * seen.L_pp and not busy:
        return Kind("at rest", evidence=(told,))
    if extent < _PLACE * seen.L_pp and froude < _SLOW:
        return Kind("station", evidence=(told,)).doubting(
            "" if np.ptp(seen.psi) < 20.0 * DEGREE else f"the heading changes by {np.ptp(seen.psi) / DEGREE:.0f} deg"
        )
    return None


def backwards(seen: Signals) -> Kind | None:
    """Astern, or sideways, for most of the time in which the ship moves."""
    if seen.u is None or seen.v_m is None or seen.U is None:
        return None
    moving = 0.1 * seen.top < seen.U
    if not moving.any():
        return None
    back = float(np.mean(seen.u[moving] < -0.05 * seen.top))
    aside = float(np.mean(np.abs(seen.v_m[moving]) > 2.0 * np.abs(seen.u[moving])))
    if back > _MOSTLY:
        return Kind("astern", evidence=(f"astern in {100 * back:.0f} % of the time under way",))
    if aside > _MOSTLY and abs(seen.turned(0, -1)) < 90.0 * DEGREE:
        side = math.copysign(1.0, median(seen.v_m[moving]))
        return Kind("sideways", {"side": side}, (f"more aside than ahead in {100 * aside:.0f} % of the way",))
    return None


def stopping(seen: Signals) -> Kind | None:
    """The way is lost, once, with the engine stopped or reversed and the rudder left alone."""
    U = seen.U
    if U is None or seen.u is None or not _rudder_calm(seen):
        return None
    first = median(U[: max(3, len(U) // 20)])
    last = median(seen.u[-max(3, len(U) // 50) :])
    if first < 0.6 * seen.top or last > _LOST * first + 0.15 * first * (seen.n is not None):
        return None
    told = f"the speed falls from {first:.3g} to {last:.2g} m/s"
    if seen.n is None:
        return Kind("stopping", evidence=(told,), doubts=("no revolutions are recorded",))
    ahead = quantile(seen.n, 0.98)
    end = median(seen.n[len(seen.n) // 3 :])
    if end > 0.3 * ahead and ahead > 0:
        return None
    least = quantile(seen.n, 0.02)
    how = f"astern ({least:.3g} 1/s)" if least < -0.1 * abs(ahead) else "stopped"
    return Kind("stopping", evidence=(told, f"engine {how}")).doubting(
        "" if last < _LOST * first else "the ship has not stopped yet"
    )


def berthing(seen: Signals) -> Kind | None:
    """A heading about held, engine both ways or stopped, and little way at the end."""
    if seen.U is None or seen.n is None or np.ptp(seen.psi) > 75.0 * DEGREE:
        return None
    ahead, astern = quantile(seen.n, 0.98), quantile(seen.n, 0.02)
    last = median(seen.U[-max(3, len(seen.U) // 30) :])
    if not (ahead > 0 and astern < -0.2 * ahead) or last > 0.6 * seen.top or abs(seen.turned(0, -1)) > 40.0 * DEGREE:
        return None
    return Kind("berthing", evidence=(
        f"revolutions {astern:.3g} to {ahead:.3g} 1/s, heading within {np.ptp(seen.psi) / DEGREE:.0f} deg",
        f"speed {last:.2g} of {seen.top:.2g} m/s at the end")).doubting(
        "" if last < _LOST * seen.top else "it still has way at the end")  # fmt: skip


def straight(seen: Signals) -> Kind | None:
    """Rudder midships: a speed run, or an acceleration."""
    held = float(np.ptp(seen.psi))
    still = seen.delta is not None and _rudder_span(seen) < _STILL_RUDDER
    if not _rudder_calm(seen) or both_ways(seen) or held > (_DRIFT if still else _STRAIGHT):
        return None
    told = (f"heading within {held / DEGREE:.1f} deg",)
    doubt = f"the heading drifts by {held / DEGREE:.0f} deg" if held > _STRAIGHT else ""
    if seen.U is None:
        return Kind("straight", evidence=told, doubts=("no speed is recorded",)).doubting(doubt)
    part = max(3, len(seen.U) // 20)
    first, last = median(seen.U[:part]), median(seen.U[-part:])
    if first < _REST * seen.top and last > _STEADY * seen.top:
        return Kind("acceleration", evidence=(*told, f"from {first:.2g} to {last:.3g} m/s")).doubting(doubt)
    even = quantile(seen.U, 0.05) > _STEADY * seen.top
    return Kind("straight", evidence=(*told, f"speed {first:.3g} to {last:.3g} m/s")).doubting(
        doubt, "" if even else "the speed is not steady"
    )


def courses(seen: Signals) -> Kind | None:
    """Courses held for most of the time, whatever the rudder does for it."""
    held = seen.held(seen.psi, _COURSE, 2.0)
    share = sum(seen.lasts(one) for one in held) / seen.duration
    changes = len(held) - 1
    if share < _MOSTLY or not 0 <= changes <= _CHANGES or both_ways(seen):
        return None
    return Kind("course-keeping", evidence=(
        f"{len(held)} course{'s' * (changes > 0)} held within {_COURSE / DEGREE:.0f} deg, "
        f"{100 * share:.0f} % of the time",))  # fmt: skip


def _rudder_calm(seen: Signals) -> bool:
    if seen.delta is None:
        return True
    return _rudder_span(seen) < 2.0 * _CALM and abs(median(seen.delta)) < 2.0 * _CALM


def _rudder_span(seen: Signals) -> float:
    """Range of the rudder but for a twentieth of the samples [rad]."""
    return 0.0 if seen.delta is None else float(np.ptp(np.quantile(seen.delta, [0.025, 0.975])))


MOTION = (resting, backwards, stopping, straight, courses, berthing)
"""Descriptions of kinds by speed and engine, in the order to try; the first two before those by the rudder."""

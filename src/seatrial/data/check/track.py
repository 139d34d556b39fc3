"""What the track over ground says of the other channels: compass against course, clock against speed.

`gamma_G` [rad] and `U_G` [m/s] are course and speed over ground as a receiver gives them, besides positions.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from .. import Array, Trial, unwrapped
from ..prepare import Remedy, Step, complete, integral, unsaid
from .relations import has, noise_of, slides_unseen, window_of
from .repairs import step, times
from .sensors import Fault

# Course from displacements over this many fixes either way; not defined below this share of top speed.
_EITHER_WAY, _MOVING = 2, 0.3
# A heading that follows the track this much better than the course is the course.
_BETTER, _CLEAR = 0.7, math.radians(0.5)
# Stretches over which distances are compared [s], and by how much they may differ.
_STRETCH, _CLOSE, _CLOCK = 5.0, 0.04, 1.34
# A clock is denied where heading and rate agree to this part of what it would be off, of a ship that turns [rad].
_HALF, _TURNS = 0.3, math.radians(5.0)
# Distances between fixes are this many times their noise, or they would be longer than the track.
_ABOVE_NOISE = 20.0


def made_faults(trial: Trial) -> Iterator[Fault]:
    """Channels that the logger has made from others, which no step of the processing tells."""
    for one in unsaid(trial):
        unit = trial.unit(one.name)
        yield Fault(
            "warning", one.name, f"made from {one.source}, no measurement of its own",
            f"{one.words} give it to {one.left:.2g} {unit}, a sensor's would differ by {one.least:.2g} {unit} at least",
            Remedy(steps=(Step(do="mark", channels=(one.name,), names=(one.source,)),)), "quality", "derived",
        )  # fmt: skip


def fixes(trial: Trial) -> NDArray[np.intp]:
    """Rows with a new position; others repeat the last, as the log is faster than the receiver."""
    x, y = trial["x"], trial["y"]
    new = np.concatenate([[True], (np.diff(x) != 0) | (np.diff(y) != 0)])
    return np.flatnonzero(new & np.isfinite(x) & np.isfinite(y))


def own_samples(trial: Trial) -> Trial:
    """The trial with gaps where position, heading, course or speed only repeat the row of the last fix.

    These readings are as old as the fix; a filter must not take a repetition for a new reading.
    """
    rows = fixes(trial)
    again = np.ones(len(trial), dtype=np.bool_)
    again[rows] = False
    kept: dict[str, Array] = {}
    for name in ("x", "y", "psi", "gamma_G", "U_G"):
        if name in trial:
            still = np.concatenate([[False], np.diff(trial[name]) == 0])
            kept[name] = np.where(again & still, np.nan, trial[name])
    return trial.having(**kept).noting(f"{int(again.sum())} rows that repeat the last fix made gaps")


def track_miss(trial: Trial, name: str) -> float:
    """How far a direction lies from that of the track, root mean square [rad]; NaN for a ship at rest."""
    course, _, rows = _track(trial)
    if rows.size < 10:
        return math.nan
    off = (trial[name][rows] - course + math.pi) % (2.0 * math.pi) - math.pi
    return float(np.sqrt(np.nanmean(off**2))) if np.isfinite(off).any() else math.nan


def surge_faults(trials: Sequence[Trial]) -> Iterator[Fault]:
    """Where no sway was logged: whether what is called surge is the whole speed over ground.

    Over short windows the displacement makes an angle beta with the heading, and is U cos beta ahead.
    """
    ahead, whole, said = [], [], []
    for trial in trials:
        if not (slides_unseen(trial) and has(trial, "x", "y", "u", "psi")) or trial["v_m"][0] != 0.0:
            continue
        rows = trial.rows(complete(trial, ("x", "y", "u", "psi")))
        n = max(round(0.25 * window_of(rows) / rows.dt), 3)
        psi, a = unwrapped(rows["psi"]), np.arange(0, len(rows) - n, n)
        total, mean = integral(rows.t, rows["u"]), integral(rows.t, psi)
        span = rows.t[a + n] - rows.t[a]
        north, east = rows["x"][a + n] - rows["x"][a], rows["y"][a + n] - rows["y"][a]
        arc = np.sinc(0.5 * (psi[a + n] - psi[a]) / math.pi)
        heading = (mean[a + n] - mean[a]) / span
        ahead.append((north * np.cos(heading) + east * np.sin(heading)) / arc)
        whole.append(np.hypot(north, east) / arc)
        said.append(total[a + n] - total[a])
    if not said:
        return
    along, far, log = (np.concatenate(part) for part in (ahead, whole, said))
    gap, off = far - along, log - along
    share = float(gap @ off / max(gap @ gap, 1e-12))
    error = float(np.std(off - share * gap) / math.sqrt(max(gap @ gap, 1e-12)))
    if share > 0.6 and share > 6.0 * error:
        yield Fault(
            "error", "u, v_m", "the speed over ground is logged as surge, and no sway",
            f"u is the distance over ground to {share:.2f} +- {error:.1g} of the difference that drift makes",
            step("from_track", "u", "v_m"), "axes", "speed_as_surge",
        )  # fmt: skip


def track_faults(trial: Trial, others: Iterable[Trial] = ()) -> Iterator[Fault]:
    """Compass and course exchanged; a clock, or a speed, that contradicts the distances."""
    if not all(name in trial for name in ("x", "y")):
        return
    if "psi" in trial and "gamma_G" in trial:
        psi, course = track_miss(trial, "psi"), track_miss(trial, "gamma_G")
        if psi < _BETTER * course and course - psi > _CLEAR:
            yield Fault(
                "error", "psi, gamma_G", "heading and course over ground are exchanged",
                f"psi follows the track within {math.degrees(psi):.2g} deg, gamma_G within "
                f"{math.degrees(course):.2g} deg",
                step("exchange", "psi", "gamma_G"), "quality", "course_as_heading",
            )  # fmt: skip
    ratio = _distance_ratio(trial) if "U_G" in trial else math.nan
    near = 1.0 / _CLOCK < ratio < _CLOCK
    if abs(ratio - 1.0) > _CLOSE and near and _only_speed(trial, ratio, others):
        yield Fault(
            "warning", "U_G", f"the speed over ground is {1.0 / ratio - 1.0:+.1%} off the track",
            "heading and rate of turn agree on the clock, and positions are those of latitude and longitude",
            times(ratio, "U_G"), "quality", "log_scale",
        )  # fmt: skip
    elif abs(ratio - 1.0) > _CLOSE:
        yield Fault(
            "error", "t, x, y" if near else "x, y, U_G",
            "the time step is not the true one, or x and y are stretched" if near
            else "wrong scale or unit: speed over ground and positions",
            f"positions move {ratio:.3f} times as far as U_G gives in the time",
            step("clock", amount=(ratio,), text="compute positions from latitude and longitude") if near
            else "check the unit of the speed (kn, km/h) and of the positions",
            *(("step", "time_scale") if near else ("scale", "unit")),
        )  # fmt: skip


def _only_speed(trial: Trial, ratio: float, others: Iterable[Trial]) -> bool:
    """Whether neither the clock nor the positions can be off by this ratio: a speed is left, which a fit can estimate.

    Places on the earth are not stretched, and the clock is denied by this trial, or, where it turns too little to tell,
    by another of the same ship whose speed is as far off: one logger has one clock.
    """
    if "datum" not in trial.meta:
        return False
    agrees = _clocked(trial, ratio)
    if agrees is not None:
        return agrees
    alike = (one for one in others if one is not trial and "U_G" in one and _clocked(one, ratio))
    return any(abs(_distance_ratio(one) - ratio) < _HALF * abs(ratio - 1.0) for one in alike)


def _clocked(trial: Trial, ratio: float) -> bool | None:
    """Whether the change of the heading is the integral of the rate of turn by the clock; None of a turn too small."""
    if not has(trial, "psi", "r"):
        return None
    rows = trial.rows(complete(trial, ("psi", "r")))
    psi, turned = unwrapped(rows["psi"]), integral(rows.t, rows["r"])
    n = max(round(window_of(rows) / rows.dt), 1)
    there, given = psi[n:] - psi[:-n], turned[n:] - turned[:-n]
    power = float(given @ given)
    if not power > _TURNS**2 * given.size:
        return None
    return abs(float(given @ there) / power - 1.0) < _HALF * abs(ratio - 1.0)


def _track(trial: Trial) -> tuple[Array, Array, NDArray[np.intp]]:
    """Direction [rad] and speed [m/s] of the track at fixes in motion, and their rows."""
    rows, n = fixes(trial), _EITHER_WAY
    if rows.size < 2 * n + 1:
        return np.zeros(0), np.zeros(0), rows[:0]
    north, east, time = (trial[name][rows[2 * n :]] - trial[name][rows[: -2 * n]] for name in ("x", "y", "t"))
    speed = np.hypot(north, east) / time
    moving = speed > _MOVING * float(np.max(speed))
    return np.arctan2(east, north)[moving], speed[moving], rows[n:-n][moving]


def _distance_ratio(trial: Trial) -> float:
    """Distance by positions over distance by speed, the median of stretches; NaN without enough of either."""
    rows = fixes(trial)
    rows = rows[np.isfinite(trial["U_G"][rows])]
    if rows.size < 20:
        return math.nan
    # between neighbours the noise of fixes would be counted as distance
    noise = max(noise_of(trial["x"][rows]), noise_of(trial["y"][rows]))
    step = float(np.median(trial["U_G"][rows][1:] * np.diff(trial.t[rows])))
    rows = rows[:: max(math.ceil(_ABOVE_NOISE * noise / max(step, 1e-9)), 1)] if step > 0.0 else rows
    if rows.size < 20:
        return math.nan
    t = trial.t[rows]
    moved = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(trial["x"][rows]), np.diff(trial["y"][rows])))])
    said = integral(t, trial["U_G"][rows])
    ends = np.flatnonzero(np.diff(np.floor((t - t[0]) / _STRETCH), prepend=-1.0))  # first fix of each stretch
    there, given = np.diff(moved[ends]), np.diff(said[ends])
    some = given > _MOVING * float(np.max(given, initial=0.0))
    return float(np.median(there[some] / given[some])) if some.sum() >= 3 else math.nan

"""Track, heading, rates and speeds held against each other: what the displacement of one says of the others.

Over windows of some ship times, the displacement of a position is the integral of the speeds turned by the heading, and
the change of heading is the integral of the rate of turn.  What is left over, divided by what the noise of the sensors
makes of it, is explained by at most a few causes; each has a *column*, what it leaves over per unit of its size.
Speeds u, v_m are those over ground.  Causes linear in their size are `CAUSES`; `suspects` lets them compete.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from ...core.constants import GRAVITY
from ...core.once import by_identity
from ...core.ranks import quantile
from ...core.values import dataclass
from .. import Array, Trial
from ..prepare import integral, segments
from ..prepare.smooth import sensor_noise

_LEAST = 20
# Moves below this part of the larger ones are none of a grid; its steps are alike to this part.
_TILT, _EVEN = 0.02, 0.4
# No two instruments agree better than this part of what they show, over a window.
_FLOOR = 2e-3


@dataclass(frozen=True)
class Window:
    """One stretch of rows, and what each window of it leaves over.

    Attributes:
        left: left over in x, y and psi, in their noise, shape (windows, 3); NaN where a channel lacks.
        moved: what the windows moved, in the same noise, same shape.
        columns: what is left over per unit of each cause.
    """

    left: Array
    moved: Array
    columns: Mapping[str, Array]


def length_of(trial: Trial) -> float | None:
    """Length of the ship [m], where the sidecar has it."""
    value: Any = trial.meta.get("L_pp")
    return float(value) if isinstance(value, int | float) and value > 0 else None


def window_of(trial: Trial) -> float:
    """Length of the windows [s]: ten ship times, or a part of the trial."""
    ship = length_of(trial)
    wanted = 10.0 * math.sqrt(ship / GRAVITY) if ship else 0.05 * trial.duration
    return float(np.clip(wanted, 10 * trial.dt, max(0.2 * trial.duration, 10 * trial.dt)))


def has(trial: Trial, *names: str) -> bool:
    """Whether channels are there and say something: constant ones do not."""
    return all(name in trial and _alive(trial[name]) for name in names)


@by_identity
def _alive(values: Array) -> bool:
    good = values[np.isfinite(values)]
    return good.size >= _LEAST and bool(good.min() < good.max())


def slides_unseen(trial: Trial) -> bool:
    """Whether sway is constant although the ship turns: no instrument measured it."""
    turned = np.ptp(trial["psi"][np.isfinite(trial["psi"])]) if has(trial, "psi") else 0.0
    return "v_m" in trial and not has(trial, "v_m") and bool(turned > 0.2)


@by_identity
def noise_of(values: Array) -> float:
    """Standard deviation of the noise of a channel; that of its steps at least.

    Kept as long as the channel lives: the competition of suspects asks some twenty times.
    """
    good = values[np.isfinite(values)]
    if good.size < _LEAST:
        return 0.0
    moves = np.abs(np.diff(good))
    step = max(_grid(moves, 0.0, 0.0), _grid(moves, _TILT * quantile(moves, 0.9), _EVEN))
    return max(float(np.nan_to_num(sensor_noise(values))), 0.3 * step)


def _grid(moves: Array, least: float, even: float) -> float:
    """Step of a channel that stands still between steps; 0 where it moves at nearly every row, or by uneven ones.

    Coarse degrees are a grid that the plane tilts: north moves by millimetres where only the longitude is a new one.
    """
    some = moves[moves > least]
    if not 2 < some.size < 0.95 * moves.size:
        return 0.0
    step = quantile(some, 0.05)
    return step if step >= even * quantile(some, 0.9) else 0.0


def left_over(trials: Iterable[Trial], causes: bool = True) -> Window | None:
    """What all windows of some trials leave over; None where no trial has two sources."""
    return joined([part for trial in trials for part in _of(trial, causes)])


def joined(parts: Sequence[Window]) -> Window | None:
    """The windows of some parts as one; None without any."""
    if not parts:
        return None
    names = parts[0].columns
    return Window(
        np.concatenate([part.left for part in parts]),
        np.concatenate([part.moved for part in parts]),
        {name: np.concatenate([part.columns[name] for part in parts]) for name in names},
    )


def _of(trial: Trial, causes: bool) -> Iterable[Window]:
    track = has(trial, "x", "y", "psi", "u") and "v_m" in trial and not slides_unseen(trial)
    turn = has(trial, "psi", "r")
    if not (track or turn):
        return
    names = [n for n in ("x", "y", "u", "v_m") if track] + ["psi"] + (["r"] if turn else [])
    whole = trial.having(psi=trial.heading)
    noise = {n: noise_of(whole[n]) for n in names}
    for run in segments(whole, names):
        if len(run) >= _LEAST:
            yield _run(run, noise, track, turn, causes)


def _run(run: Trial, noise: Mapping[str, float], track: bool, turn: bool, causes: bool) -> Window:
    t, psi = run.t, run["psi"]
    count = len(run)
    width = min(max(round(window_of(run) / run.dt), 4), count // 3)
    a = np.arange(0, count - width, max(width // 4, 1))
    b = a + width

    def over(rate: Array) -> Array:
        total = integral(t, rate)
        return total[b] - total[a]

    def change(value: Array) -> Array:
        return value[b] - value[a]

    span, zero, gap = t[b] - t[a], np.zeros(a.size), np.full(a.size, np.nan)
    left, weight, went = [gap, gap, gap], [1.0 + zero] * 3, [gap, gap, gap]
    r = run["r"] if turn else np.gradient(psi, t)
    parts: _Parts = {}
    if turn:
        left[2], went[2] = change(psi) - over(r), change(psi)
        spread = 2.0 * noise["psi"] ** 2 + span * run.dt * noise["r"] ** 2
        weight[2] = np.sqrt(spread + (_FLOOR * np.abs(change(psi))) ** 2 + 1e-12)
    if track:
        c, s, u, v = np.cos(psi), np.sin(psi), run["u"], run["v_m"]
        moved = over(u * c - v * s), over(u * s + v * c)
        left[0], left[1] = change(run["x"]) - moved[0], change(run["y"]) - moved[1]
        went[0], went[1] = change(run["x"]), change(run["y"])
        weight[0] = weight[1] = _track_noise(np.hypot(*moved), span, run.dt, noise)
        parts = _track_columns(over, change, (c, s), (u, v, r), span) if causes else {}
    if causes and turn:
        parts |= _turn_columns(over, change, r, span, parts)
    scale = np.column_stack(weight)
    columns = {name: np.column_stack(parts.get(name, (zero, zero, zero))) / scale for name in CAUSES if causes}
    return Window(np.column_stack(left) / scale, np.column_stack(went) / scale, columns)


def _track_noise(far: Array, span: Array, dt: float, noise: Mapping[str, float]) -> Array:
    """Standard deviation of what is left over of a displacement [m]: fixes, speeds, heading, and the floor."""
    aside = (far * noise["psi"]) ** 2 * dt / np.maximum(span, dt)
    speeds = span * dt * max(noise["u"], noise["v_m"]) ** 2
    fixes = 2.0 * max(noise["x"], noise["y"]) ** 2
    return np.sqrt(fixes + speeds + aside + (_FLOOR * far) ** 2 + 1e-12)


_Over = Callable[[Array], Array]
_Parts = dict[str, tuple[Array, Array, Array]]


def _track_columns(
    over: _Over, change: _Over, turned: tuple[Array, Array], motion: tuple[Array, Array, Array], span: Array
) -> _Parts:
    (c, s), (u, v, r) = turned, motion
    north, east = u * c - v * s, u * s + v * c
    zero = 0.0 * span
    n, e = over(north), over(east)
    calm = [_smoothed(one) for one in (north, east)]
    swing = over(r * east), -over(r * north)
    moved = change(calm[0]), change(calm[1])
    return {
        "heading_bias": (e, -n, zero),
        "deviation_north": (over(east * c), -over(north * c), change(c)),
        "deviation_east": (over(east * s), -over(north * s), change(s)),
        "log_scale": (-n, -e, zero),
        "log_bias": (-over(c), -over(s), zero),
        "sway_bias": (over(s), -over(c), zero),
        "lever_ahead": (change(c), change(s), zero),
        "lever_aside": (-change(s), change(c), zero),
        "lag_x": (-moved[0], -moved[1], zero),
        "lag_psi": (-swing[0], -swing[1], zero),
        "lag_u": (moved[0] + swing[0], moved[1] + swing[1], zero),
        "lag_gnss": (swing[0], swing[1], zero),
        "water_north": (span, zero, zero),
        "water_east": (zero, span, zero),
        "time_scale": (-n, -e, zero),
        "north_stretch": (n, zero, zero),
        "east_stretch": (zero, e, zero),
    }


def _turn_columns(over: _Over, change: _Over, r: Array, span: Array, parts: _Parts) -> _Parts:
    turned, zero = over(r), 0.0 * span
    moved = change(_smoothed(r))
    ahead = {name: parts.get(name, (zero, zero, zero))[:2] for name in ("lag_psi", "time_scale")}
    return {
        "lag_psi": (*ahead["lag_psi"], -moved),
        "lag_r": (zero, zero, moved),
        "gyro_bias": (zero, zero, -span),
        "gyro_scale": (zero, zero, -turned),
        "time_scale": (*ahead["time_scale"], -turned),
    }


def _smoothed(values: Array) -> Array:
    """Mean over five rows, fewer at the ends."""
    weight = np.convolve(np.ones(values.size), np.ones(5), "same")
    return np.convolve(values, np.ones(5), "same") / weight


CAUSES: Mapping[str, str] = MappingProxyType({
    "heading_bias": "rad", "deviation_north": "rad", "deviation_east": "rad", "log_scale": "-", "log_bias": "m/s",
    "sway_bias": "m/s", "lever_ahead": "m", "lever_aside": "m", "lag_x": "s", "lag_psi": "s", "lag_u": "s",
    "lag_gnss": "s", "lag_r": "s", "water_north": "m/s", "water_east": "m/s", "gyro_bias": "rad/s", "gyro_scale": "-",
    "time_scale": "-", "north_stretch": "-", "east_stretch": "-",
})  # fmt: skip
"""Causes, and the unit of their size."""

"""What logs would be with two columns exchanged, or the sense of one turned: errors that are whole or not at all.

Half an exchange is no exchange, and no derivative points from one to the other; so each is done, and a few steps of
the fit are made from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from ...core.values import dataclass, replace
from ...data import Array
from ...models import unit
from .. import Problem
from ..trajectory.gauss_newton import State, minimise
from ..trajectory.objective import TrajectoryObjective
from .findings import Suspicion

# Angles at which a rudder may have jammed [deg], tried where residuals are so many times the noise, squared.
_ANGLES, _GROSS = (-10.0, -5.0, 0.0, 5.0, 10.0), 100.0
# Share of the objective that an alternative must remove, and the steps it gets.
_MOST, _STEPS = 0.5, 6


@dataclass(frozen=True)
class _Alternative:
    """A name, words, and inputs (lanes, steps, inputs) as they would be."""

    name: str
    words: str
    of: Callable[[Array], Array]


def alternatives(
    objective: TrajectoryObjective, p: Array, eta: Array, sigma: Array, problem: Problem
) -> tuple[Suspicion, ...]:
    """Alternatives that explain most of what a fit leaves over, the best first.

    Args:
        objective: of the finished fit.
        p, eta: where it ended.
        sigma: of each entry of `p`, to count its moves in.
        problem: its controls and free parameters.
    """
    before = objective.cost(p, eta)
    found: list[Suspicion] = []
    still = _stuck(problem.ship.model.controls) if before > _GROSS * objective.windows.entries else ()
    for one in (*_of(problem.ship.model.controls), *still):
        series = one.of(objective.windows.series)
        if np.array_equal(series, objective.windows.series):
            continue
        other = replace(objective, windows=replace(objective.windows, series=series))
        cost = other.cost(p, eta)
        if not np.isfinite(cost):
            continue
        end = minimise(other, State(p, eta, cost), *other.bounds(), iterations=_STEPS, tolerance=1e-2,
                       each=lambda _: None)  # fmt: skip
        share = 1.0 - end.cost / before
        if share > _MOST:
            moves = ((end.p - p) / np.maximum(sigma, 1e-300)).tolist()
            found.append(Suspicion(
                one.name, one.words, "", 1.0, share * objective.windows.entries, share, 1.0, 0.0,
                dict(zip(problem.vector.paths, moves, strict=False)), whole=True,
            ))  # fmt: skip
    best: dict[str, Suspicion] = {}
    for one in sorted(found, key=lambda one: -one.drop):
        best.setdefault(one.name, one)
    return tuple(best.values())


def _of(controls: tuple[str, ...]) -> Iterator[_Alternative]:
    """Of ships with several rudders, shafts or azimuths; the sense of a single rudder is for `data.check`."""
    kinds: dict[str, list[int]] = {}
    for at, name in enumerate(controls):
        kinds.setdefault(name.rpartition("_")[0], []).append(at)
        if "_" in name and unit(name) == "rad":
            yield _Alternative(f"sign.{name}", f"{name} counted the other way", partial(_turned, places=[at]))
    for kind, places in kinds.items():
        if not kind or len(places) != 2:
            continue
        names = f"{controls[places[0]]} and {controls[places[1]]}"
        yield _Alternative(f"exchange.{kind}", f"an exchange of {names}", partial(_exchanged, places=places))
        if unit(controls[places[0]]) == "rad":
            yield _Alternative(f"sign.{kind}", f"{names} counted the other way", partial(_turned, places=places))
    pairs = [places for kind, places in kinds.items() if kind and len(places) == 2]
    if len(pairs) == 2:
        yield _Alternative("exchange", "all columns of both sides exchanged",
                           lambda series: _exchanged(_exchanged(series, pairs[0]), pairs[1]))  # fmt: skip


def _stuck(controls: tuple[str, ...]) -> Iterator[_Alternative]:
    """One rudder or azimuth of several that stands still near one of some angles."""
    for at, name in enumerate(controls):
        if "_" in name and unit(name) == "rad":
            for angle in _ANGLES:
                yield _Alternative(f"stuck.{name}", f"{name} standing still near {angle:.0f} deg whatever its log says",
                                   partial(_held, place=at, angle=math.radians(angle)))  # fmt: skip


def _held(series: Array, place: int, angle: float) -> Array:
    out = series.copy()
    out[..., place] = angle
    return out


def _exchanged(series: Array, places: list[int]) -> Array:
    out = series.copy()
    out[..., places] = series[..., places[::-1]]
    return out


def _turned(series: Array, places: list[int]) -> Array:
    out = series.copy()
    out[..., places] *= -1.0
    return out

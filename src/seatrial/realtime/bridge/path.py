"""Where the ship will be if its orders hold: its path, and how far from it draws of what is not known of it are.

The path is that of the model under the present orders, wind and current, actuators included; draws of a fitted ship
sail it with the same controls.  A thread of its own works, about once a second, on a copy of the ship.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from statistics import NormalDist
from typing import Any

import numpy as np

from ...belief.bands.calibrating import spread
from ...belief.bands.calibration import Calibration
from ...belief.bands.learning import quiet
from ...belief.bands.novel import acting
from ...belief.bands.prediction import uncertain
from ...belief.bands.sailing import FreeRuns, Uncertain, check_traced, sailed
from ...belief.posterior import Posterior
from ...core.values import dataclass
from ...data import Array, Trial
from ...engine import SimulationError
from ...models import STATES
from ...ships import Ship
from ...simulate.approach import substeps
from ...simulate.loop import open_loop
from ..plant import Plant

PERIOD = 1.0
"""Least time between two paths [s of the clock]; a path takes a tenth of the time at most."""

_LENGTHS, _MARKS = 6.0, 24
"""Length of the path in ship lengths at the usual speed, and least number of places on it."""

_STRIDES = (10, 5, 4, 3, 2, 1)
_EVERY_KIND = ""
"""Which manoeuvre is under way is not known beforehand: the widest factor of all kinds holds."""


@dataclass(frozen=True)
class Open:
    """What is not known of a ship, and the level of its bands.

    Attributes:
        held: posterior of its fit.
        found: calibration; None where the draws of the posterior are all there is.
        level: of 0 to 1.
        draws: number of them.
        refusal: why a run has no bands; empty where it has.
    """

    held: Posterior
    found: Calibration | None
    level: float
    draws: int
    refusal: Callable[[Trial], str]

    def drawn(self, ship: Ship, seed: int) -> Uncertain:
        """The draws; all begin where the ship is."""
        if self.found is None:
            calm = quiet(ship, self.draws).disturbance
            return Uncertain(self.held.names, self.held.draws(self.draws, seed), np.zeros(len(STATES)), calm)
        made = uncertain(self.held, self.found, self.draws, seed)
        return Uncertain(made.names, made.draws, np.zeros(len(STATES)), made.disturbance)


class Ahead:
    """The path of a ship with its bands.

    Attributes:
        known: what is not known of the ship.
        draws: of it.
        span: time ahead that the path reaches [s].
        told: the last path as the page draws it; None before the first.
    """

    def __init__(self, plant: Plant, known: Open, span: float | None = None, seed: int = 1) -> None:
        """A path of the ship of `plant`, `span` [s] long: six ship lengths unless given, as far as bands hold at most.

        Raises:
            ShipError: a model in discrete time, or a network.
        """
        ship = plant.ship
        check_traced(ship)
        far = math.inf if known.found is None else known.found.reach(known.level)
        wanted = _LENGTHS * ship.L_pp / max(ship.speed, 1e-3) if span is None else span
        self._plant, self.known, self._seed = plant.another(), known, seed
        self._stride = next(k for k in _STRIDES if k == 1 or substeps(ship, k * plant.dt) == 1)
        step = self._stride * plant.dt
        steps = max(int(min(wanted, far) / step + 1e-9), 1)
        self._every = max(steps // _MARKS, 1)
        self._marks = steps // self._every
        self.span = self._marks * self._every * step
        self.draws = known.drawn(ship, seed)
        self.told: dict[str, Any] | None = None
        self._saved: bytes | None = None
        self._due, self._over, self._leaps = -math.inf, False, 0
        self._wake = threading.Condition()
        self._worker: threading.Thread | None = None

    def hello(self) -> dict[str, Any]:
        """Constant data: level [%] and length [s]."""
        return {"level": 100.0 * self.known.level, "span": self.span, "calibrated": self.known.found is not None}

    def see(self, plant: Plant, now: float) -> None:
        """Take the present state, if a path is due; called after each tick."""
        if now < self._due or self._saved is not None:
            return
        self._due = now + PERIOD
        with self._wake:
            self._saved = plant.snapshot()
            self._wake.notify()
        if self._worker is None:
            self._worker = threading.Thread(target=self._work, name="path ahead", daemon=True)
            self._worker.start()

    def forget(self) -> None:
        """The ship was set elsewhere."""
        self.told, self._due = None, -math.inf
        self._leaps += 1

    def close(self) -> None:
        """End the thread."""
        with self._wake:
            self._over = True
            self._wake.notify()
        if self._worker is not None:
            self._worker.join(2.0)

    def _work(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._over or self._saved is not None)
                if self._over or self._saved is None:
                    return
                saved = self._saved
            began, leaps = time.thread_time(), self._leaps
            try:
                told = self.look(saved)
            except (ArithmeticError, ValueError, RuntimeError) as error:  # no old path is the present one
                told = {"t": 0.0, "rows": [], "why": str(error)}
            if self._leaps == leaps:
                self.told = told
            self._due += 9.0 * (time.thread_time() - began)
            self._saved = None

    def look(self, saved: bytes) -> dict[str, Any]:
        """The path from a saved state on.

        Returns:
            "rows": time from now [s], x, y [m], heading [rad], and half extents of the ellipse that holds the position
            at the level: xx, xy, yy [m^2] of its matrix; "why" there are none, else an empty text.
        """
        plant = self._plant
        plant.restore(saved)
        begun = plant.t
        try:
            path, lanes = self.sail(plant)
        except SimulationError as error:
            return {"t": round(begun, 3), "rows": [], "why": str(error)}
        why, matrix = self.known.refusal(path), np.full((len(path), 3), np.nan)
        if not why:
            why, matrix = self._ellipses(lanes)
        rows = np.column_stack([path.t, path["x"], path["y"], path["psi"], matrix])
        shown = rows[np.isfinite(rows).all(axis=1)] if not why else rows[:, :4]
        return {"t": round(begun, 3), "rows": [[float(f"{v:.7g}") for v in row] for row in shown.tolist()],
                "why": why}  # fmt: skip

    def sail(self, plant: Plant) -> tuple[Trial, FreeRuns]:
        """The path at its marks from the present state of `plant` on, and the same run as lanes for the draws.

        Raises:
            SimulationError: it blows up on the way.
        """
        system, names = open_loop(plant.ship), (*STATES, *plant.controls)
        states = [plant[name] for name in system.states]
        series = np.empty((1, self._marks * self._every + 1, len(system.series)))
        marks, around = np.empty((self._marks + 1, len(names))), np.empty((self._marks + 1, 3))
        for k in range(series.shape[1]):
            series[0, k] = [plant[name] for name in system.series]
            if k % self._every == 0:
                marks[k // self._every] = [plant[name] for name in names]
                around[k // self._every] = [plant[name] for name in ("wind_x", "wind_y", "per_depth")]
            if k < series.shape[1] - 1:
                for _ in range(self._stride):
                    plant.step()
        lanes = FreeRuns(np.array([states]), series, self._stride * plant.dt, self._every)
        with np.errstate(divide="ignore"):
            depth = 1.0 / around[:, 2]
        channels = {**dict(zip(names, marks.T, strict=True)), "U_T": np.hypot(around[:, 0], around[:, 1]),
                    "depth": depth}  # fmt: skip
        return Trial("path ahead", lanes.t, channels), lanes

    def _ellipses(self, lanes: FreeRuns) -> tuple[str, Array]:
        """Why there are none, and the matrix of the ellipse about each place, xx, xy, yy [m^2], shape (marks, 3)."""
        runs = sailed(self._plant.ship, lanes, self.draws, self._seed)[:, 0]
        with np.errstate(all="ignore"):
            good = np.isfinite(runs).all(axis=(1, 2))
        # those that blow up are the farthest: the others do not tell where so large a share of all would be
        if (lost := int((~good).sum())) > (1.0 - self.known.level) * len(runs):
            return f"{lost} of {len(runs)} draws blow up on the way", np.full((runs.shape[1], 3), np.nan)
        runs = runs[good]
        away = (runs - runs.mean(axis=0))[:, :, :2] * self._scale(lanes, runs)
        # the position is within c at the level: chi-squared of two degrees of freedom
        size = -2.0 * math.log(1.0 - self.known.level) / len(away)
        x, y = away[:, :, 0], away[:, :, 1]
        return "", size * np.column_stack([(x * x).sum(axis=0), (x * y).sum(axis=0), (y * y).sum(axis=0)])

    def _scale(self, lanes: FreeRuns, runs: Array) -> Array:
        """By how much draws must be farther apart for their bands to be the calibrated ones, shape (marks, 2)."""
        found, level, t = self.known.found, self.known.level, lanes.t
        if found is None:
            return np.ones((len(t), 2))
        new = found.novelty(acting(self._plant.ship, runs.mean(axis=0)[None], lanes), t)
        width = spread(runs[:, None], np.zeros(len(STATES)))[0]
        half = found.half(t, width, _EVERY_KIND, level, None if new is None else new[0])
        with np.errstate(all="ignore"):
            factor = half / (NormalDist().inv_cdf(0.5 * (1.0 + level)) * width)
        factor[0] = 1.0  # all draws begin in one place
        return factor[:, :2]

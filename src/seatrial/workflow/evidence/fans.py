"""Predictions of trials with bands, their files, and how often these held."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ...belief.bands.calibration import Calibration, begin_of, load
from ...belief.bands.held import SHARES, held, windows
from ...belief.bands.past import Filter, carried
from ...belief.bands.prediction import Fan, fan
from ...belief.fit_first import Beginning
from ...belief.posterior import Posterior
from ...belief.reading import posterior
from ...core.values import dataclass
from ...data import Trial
from ...data.trialfile import write_trial
from ...report.judging.fans import BandsHeld
from ...report.judging.tested import reached
from ...simulate.replay import replay
from .. import RequestError
from ..asked import Bands, Predicting
from ..request import DEGREE, Note, as_steered, level_of, make_folder

FOLDER = "bands"
"""Folder of the bands, below that of the predictions."""

DRAWS, _MOST = 1000, 20_000
_FEWEST = 50
DEGREES = {"psi": 1.0 / DEGREE, "r": 1.0 / DEGREE}
"""Factors of the states that people read in degrees."""


@dataclass(frozen=True)
class Banding:
    """What bands are made with.

    Attributes:
        level: of 0 to 1.
        draws: number of runs.
        extrapolate: whether bands are given beyond the ranges of the trials of the fit.
        plain: calibration of starts without a past, and the filter that reads it; None without --history.
    """

    held: Posterior
    found: Calibration
    level: float
    draws: int
    extrapolate: bool
    plain: Calibration | None = None
    filters: Filter | None = None

    @staticmethod
    def of(
        model: str, bands: Bands, how: Predicting = Predicting()
    ) -> Banding:
        """From the options.

        Args:
            bands: those that are asked for; 1000 draws unless it says another number.
            how: predictions begin; bands do not know a smooth start.

        Raises:
            RequestError: a level or number of draws that makes no band, or too few recordings for it.
            StudyError: the model has no posterior or calibration; says which command makes one.
        """
        level, many = level_of(bands), DRAWS if bands.count is None else bands.count
        if not _FEWEST <= many <= _MOST:
            raise RequestError(f"--draws is {many}; bands take {_FEWEST} to {_MOST}")
        if how.smooth_start is not None:
            raise RequestError("--bands: they are calibrated on starts as measured; leave --smooth-start out")
        if how.history is not None and how.fit_first is not None:
            raise RequestError("--history: --fit-first already estimates how a trial begins; give one of the two")
        held = posterior(model)
        found = load(model, held, begin_of(how.history, how.fit_first))
        found.factors(0.01 * level)
        if how.history is None:
            return Banding(held, found, 0.01 * level, many, bands.extrapolate)
        filters = Filter.of(held.ship, found.disturbance, found.noise, how.history, found.doubt)
        return Banding(held, found, 0.01 * level, many, bands.extrapolate, load(model, held), filters)

    def refuse(self, trial: Trial, predicted: Trial) -> None:
        """Refuse a prediction that leaves the ranges of the trials of the fit, before anything is written.

        Raises:
            RequestError: it does, and that was not accepted.
        """
        if self.extrapolate:
            return
        if out := self.held.grounds.beyond(as_steered(trial, predicted), self.held.ship.model.controls):
            raise RequestError(
                f"--bands: {trial.name} leaves the trials of the fit: {reached(out)}; nothing is known "
                "of the error there; accept it with --extrapolate"
            )

    def replay(self, trial: Trial, *, restart: float | None, smooth_start: float | None = None) -> Trial:
        """Prediction with the past, as its bands are about it; `smooth_start` is None, as bands do not know it.

        Raises:
            DataError, SimulationError: as `simulate.replay.replay`.
        """
        if self.filters is None:
            return replay(self.held.ship, trial, restart=restart, smooth_start=smooth_start)
        return carried(self.filters, self.found.law, trial, restart=restart)[0]

    def predicted(
        self, trial: Trial, restart: float | None, note: Note, first: Beginning | None = None
    ) -> tuple[Trial, Fan]:  # fmt: skip
        """A prediction with its bands, and a note on what a reader must know.

        Args:
            first: how the trial begins, of --fit-first.

        Raises:
            RequestError: it leaves the trials of the fit.
            SimulationError: it blows up.
        """
        begin, past, ship = None if first is None else (first.t, first.state), None, self.held.ship
        if self.filters is None:
            run = replay(ship, trial, restart=restart, begin=begin)
        else:
            run, past = carried(self.filters, self.found.law, trial, restart=restart)
        self.refuse(trial, run)
        made = fan(self.held, self.found, trial, run, self.level, restart=restart, draws=self.draws, past=past,
                   plain=self.plain, begin=begin, current=math.inf if first is None else first.current)  # fmt: skip
        for one in made.notes:
            note(f"warning: {trial.name}: {one}")
        return run, made


def write_fan(made: Fan, out: Path) -> Path:
    """Write the edges of a prediction as a trial file in the folder `bands` below `out`."""
    make_folder(out / FOLDER)
    edges, units = dict[str, Any](), dict[str, str]()
    for name, both in made.edges.items():
        for side, values in zip(("low", "high"), both, strict=True):
            edges[f"{name}_{side}"] = values
            units[f"{name}_{side}"] = made.predicted.unit(name)
    meta = {"schema": "manoeuvre-trial/1", "ship": made.predicted.meta.get("ship", ""), "kind": made.kind,
            "source": f"bands of {100 * made.level:g} %"}  # fmt: skip
    path = out / FOLDER / f"{made.predicted.name}.csv"
    write_trial(Trial(made.predicted.name, made.predicted.t, edges, units=units, meta=meta), path)
    return path


def judged(made: Sequence[tuple[Fan, Trial]], asked: Banding, restart: float | None) -> BandsHeld | None:
    """How often the bands of some predictions held; None where no row has a band.

    Args:
        made: each with its trial as measured.
        restart: seconds between restarts.
    """
    longest = min(asked.found.reach(asked.level), restart or max(float(one.since.max(initial=0.0)) for one, _ in made))
    horizons = [share * longest for share in SHARES]
    rows = held(windows(one, trial, horizons) for one, trial in made)
    recordings = len(set(asked.found.left.groups))
    return BandsHeld(asked.level, rows, tuple(made), recordings) if rows else None

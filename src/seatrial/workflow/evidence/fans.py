"""Predictions of trials with bands, their files, and how often these held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...bands.calibration import Calibration, load
from ...bands.held import GROUPS, SHARES, held, windows
from ...bands.prediction import Fan, fan
from ...data import Trial
from ...data.trialfile import write_trial
from ...models import STATES
from ...report.judging.bands import reach
from ...report.judging.fans import BandsHeld, words
from ...study.grounds import beyond
from ...study.stored import Posterior, posterior
from .. import RequestError, Table, figure
from ..request import DEGREE, Note, make_folder

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
    """

    held: Posterior
    found: Calibration
    level: float
    draws: int
    extrapolate: bool

    @staticmethod
    def of(
        model: str, level: float | None, *, draws: int | None, extrapolate: bool, begun: float | None
    ) -> Banding | None:  # fmt: skip
        """From the options; None where no bands are asked for.

        Args:
            level: of the bands [%].
            begun: --fit-first, --history or --smooth-start, which bands do not know.

        Raises:
            RequestError: a level or number of draws that makes no band, or too few recordings for it.
            StudyError: the model has no posterior or calibration; says which command makes one.
        """
        if level is None:
            if draws is not None or extrapolate:
                raise RequestError("--draws and --extrapolate are of bands; ask for them with --bands 95")
            return None
        if not 0.0 < level < 100.0:
            raise RequestError(f"--bands is {level:g} percent; it is above 0 and below 100, such as 95")
        many = DRAWS if draws is None else draws
        if not _FEWEST <= many <= _MOST:
            raise RequestError(f"--draws is {many}; bands take {_FEWEST} to {_MOST}")
        if begun is not None:
            raise RequestError("--bands: they are calibrated on predictions from measured states; leave --fit-first, "
                               "--history and --smooth-start out")  # fmt: skip
        held = posterior(model)
        found = load(model, held)
        found.factors(0.01 * level)
        return Banding(held, found, 0.01 * level, many, extrapolate)

    def refuse(self, trial: Trial, predicted: Trial) -> None:
        """Refuse a prediction that leaves the ranges of the trials of the fit, before anything is written.

        Raises:
            RequestError: it does, and that was not accepted.
        """
        if self.extrapolate:
            return
        rows = np.clip(np.searchsorted(trial.t, predicted.t - 1e-9), 0, len(trial) - 1)
        run = trial.rows(rows).having(**{name: predicted[name] for name in STATES})
        if out := beyond(self.held.covered, run, self.held.ship.model.controls):
            raise RequestError(
                f"--bands: {trial.name} leaves the trials of the fit: {'; '.join(map(reach, out))}; nothing is known "
                "of the error there; accept it with --extrapolate"
            )

    def fan(self, trial: Trial, predicted: Trial, restart: float | None, note: Note) -> Fan:
        """The bands of a prediction, with a note on what a reader must know.

        Raises:
            RequestError: it leaves the trials of the fit.
        """
        self.refuse(trial, predicted)
        made = fan(self.held, self.found, trial, predicted, self.level, restart=restart, draws=self.draws)
        for line in made.notes:
            note(f"warning: {trial.name}: {line}")
        return made


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
    rows = held([windows(one, trial, horizons) for one, trial in made], horizons)
    recordings = len(set(asked.found.left.groups))
    return BandsHeld(asked.level, rows, tuple(made), recordings) if rows else None


def held_table(found: BandsHeld) -> tuple[Table | str, ...]:
    """Coverage and widths for a terminal."""
    rows = tuple(
        (one.kind, figure(one.horizon, 3), str(one.trials), str(one.windows),
         *(f"{100 * share:.0f} %" for share in one.inside.values()),
         *(figure(DEGREES.get(name, 1.0) * width, 2) for name, width in one.width.items()))
        for one in found.rows
    )  # fmt: skip
    units = ("x [m]", "y [m]", "psi [deg]", "u [m/s]", "v_m [m/s]", "r [deg/s]")
    held_as = (f"{name} held" for name in GROUPS)
    head = (f"bands of {100 * found.level:g} %", "ahead [s]", "trials", "windows", *held_as, *units)
    return Table(head, rows, tuple(range(1, len(head)))), words(found.rows, found.level)

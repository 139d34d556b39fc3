"""Problems and fits with verbs: fit, summary, residuals, save and read."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import identify
from ..core.errors import StudyError
from ..core.parameters import Free, specs
from ..core.parameters import near as near_values
from ..core.values import dataclass, field, fields, replace
from ..identify import Estimator, Progress
from ..identify.lint import lines, lint
from ..identify.trajectory.shooting import Trajectory
from ..models import Model
from ..ships import Ship as AnyShip
from ..ships.classes import Trust
from ..study import study
from ..study.store import save_fit
from ..study.stored import load_fit
from .ships import Ship, ship_of
from .tables import Cell, Table, Tabular, html, table_of
from .trials import Trial, trial_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LIMIT = 1.959963984540054
"""Half width of an interval that holds 95 % of a Gaussian, in its standard deviations."""

_TOLD, _LINES = 4, 6
"""As many verdicts on combinations, and lines on the residuals, as a summary shows."""


@dataclass(frozen=True, eq=False, repr=False)
class Problem(identify.Problem):
    """The parameters of a ship to be estimated from trials; attributes are those of `seatrial.identify.Problem`.

    A ship and trials without verbs are given theirs.
    """

    ship: Ship
    trials: tuple[Trial, ...]
    validation: tuple[Trial, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "ship", ship_of(self.ship))
        for name in ("trials", "validation"):
            object.__setattr__(self, name, tuple(map(trial_of, getattr(self, name))))

    def lint(self) -> tuple[str, ...]:
        """What speaks against fitting it as it is, a line each, errors first; empty where nothing does."""
        return lines(lint(self))

    @property
    def table(self) -> Table:
        """Start, interval and prior of each free parameter."""
        units = specs(self.ship.model)
        rows = tuple((f.path, units[f.path].unit if f.path in units else "", f.start, _finite(f.low), _finite(f.high),
                      _finite(f.prior), _finite(f.sigma)) for f in self.free)  # fmt: skip
        head = ("parameter", "unit", "start", "low", "high", "prior", "sigma of the prior")
        named = ", ".join(trial.name for trial in self.trials[:_TOLD])
        more = f" and {len(self.trials) - _TOLD} more" if len(self.trials) > _TOLD else ""
        return table_of(repr(self), head, rows, (f"trials: {named}{more}",))

    def _repr_html_(self) -> str:
        return html((self.table,))


@dataclass(frozen=True, repr=False)
class Summary(Tabular):
    """What a fit has found, parameter by parameter."""

    fit: identify.Fit

    @property
    def table(self) -> Table:
        """Start, estimate, sigma, 95 % interval and verdict of each parameter; below, what the residuals say."""
        fit, units = self.fit, specs(self.fit.ship.model)
        verdicts = {verdict.subject: verdict.status for verdict in fit.verdicts}

        def row(k: int, free: Free) -> tuple[Cell, ...]:
            value, sigma = float(fit.values[k]), float(fit.sigma[k])
            return (free.path, units[free.path].unit if free.path in units else "", free.start, value, _finite(sigma),
                    _finite(value - _LIMIT * sigma), _finite(value + _LIMIT * sigma),
                    verdicts.get(free.path, ""))  # fmt: skip

        paths = {free.path for free in fit.free}
        others = [f"{one.subject}: {one.text}" for one in fit.verdicts if one.subject not in paths]
        more = [f"... and {len(others) - _TOLD} more verdicts"] if len(others) > _TOLD else []
        told = fit.diagnosis.lines if fit.diagnosis else ("the residuals were not tested",)
        left = [f"... and {len(told) - _LINES} more: fit.diagnosis.lines"] if len(told) > _LINES else []
        return table_of(
            f"{fit.ship.name}: {len(fit.free)} parameters, objective {fit.objective:.4g}, {fit.status}",
            ("parameter", "unit", "start", "estimate", "sigma", "low 95 %", "high 95 %", "verdict"),
            tuple(row(k, free) for k, free in enumerate(fit.free)), (*told[:_LINES], *left, *others[:_TOLD], *more),
        )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Fit(identify.Fit):
    """The outcome of an estimation; attributes are those of `seatrial.identify.Fit` and two more.

    Attributes:
        ship: the fitted ship, to simulate, predict or save.
        problem: what was fitted; None for one that was read from a folder, which holds no trials.
        folder: where it was read from; None for one that was just made.
    """

    ship: Ship
    problem: identify.Problem | None = field(default=None, kw_only=True)
    folder: Path | None = field(default=None, kw_only=True)

    def summary(self) -> Summary:
        """Start, estimate, sigma, interval and verdict of each parameter, as a table."""
        return Summary(self)

    def plot_residuals(self, axes: Axes | Sequence[Axes] | None = None) -> Sequence[Axes]:
        """Draw the residuals over the sensor noise, an axes a channel, the trials one after the other.

        Args:
            axes: axes to draw on, one a channel; None makes new ones.

        Raises:
            StudyError: the estimator has not tested its residuals.
        """
        from .plots import residuals

        if self.diagnosis is None or not self.diagnosis.residuals:
            raise StudyError("this fit has no residuals: its estimator does not test them, or they were not saved; "
                             "draw a trial beside fit.ship.predict(trial)")  # fmt: skip
        return residuals(self.diagnosis, axes)

    def save(self, folder: str | Path, *, name: str = "notebook") -> Path:
        """Write model.toml (a ship file), fit.json, history.csv and fit.npz, each whole or not at all.

        Args:
            folder: made where there is none; files of these names in it are replaced.
            name: of the study, the source of the fitted numbers in the ship file.

        Returns:
            The path of model.toml.

        Raises:
            StudyError: a fit that was read from a folder; it is there already, to be copied.
        """
        if self.problem is None:
            raise StudyError(f"this fit was read from {self.folder}; copy that folder")
        Path(folder).mkdir(parents=True, exist_ok=True)
        return save_fit(self, folder, self.problem, study=name)

    def _repr_html_(self) -> str:
        return html((self.summary().table,))


def near(ship: AnyShip | Model, *paths: str, ratio: float) -> tuple[Free, ...]:
    """Parameters that are free within `ratio` of their values: [P - a|P|, P + a|P|] (Suyama 2023 Eq. 38).

    Args:
        ship: a ship, or the model of one.
        paths: dotted paths such as ``rudder.t_R``, or shell-style patterns such as ``hull.Y_*``.
        ratio: a, .3 for 30 %.

    Raises:
        ParameterError: an unknown path, a value of zero, an interval outside the parameter's range.
    """
    return near_values(ship.model if isinstance(ship, AnyShip) else ship, *paths, ratio=ratio)


def fit(problem: identify.Problem, estimator: Estimator | None = None, *, progress: Progress | None = None) -> Fit:
    """Estimate the free parameters of a problem.

    Args:
        problem: ship, trials and free parameters.
        estimator: None takes `Trajectory()`: least squares through simulated windows of 100 s, initial states
            estimated, residuals weighed by the noise of each sensor and tested.
        progress: called with (iteration, objective, validation or NaN) after each iteration.

    Raises:
        StudyError: the first error of `Problem.lint`.
        FitError: the model blows up at every start.
    """
    found = (estimator or Trajectory()).fit(problem, progress=progress)
    return replace(fit_of(found), problem=problem)


def fit_of(found: identify.Fit) -> Fit:
    """Any fit as one with verbs."""
    if isinstance(found, Fit):
        return found
    given: dict[str, Any] = {f.name: getattr(found, f.name) for f in fields(identify.Fit)}
    given["ship"] = ship_of(found.ship)
    return Fit(**given)


@dataclass(frozen=True)
class Study(study.Study):
    """A study, read and ready: ``st.fit(study.problem, study.estimator)``; attributes as of `seatrial.study.study`."""

    problem: Problem
    test: tuple[Trial, ...]


def read_study(path: str | Path, *, trust: Trust = False) -> Study:
    """Read a study file with its ship and trials.

    Args:
        trust: modules outside the package whose code the study and its ship may run by naming their classes;
            True for any.

    Raises:
        StudyError: naming the file, the key and what would be right.
        ShipError, DataError, ParameterError: from what the study names.
    """
    found = study.read_study(path, trust=trust)
    given: dict[str, Any] = {f.name: getattr(found, f.name) for f in fields(study.Study)}
    given["problem"] = Problem(*(getattr(found.problem, f.name) for f in fields(identify.Problem)))
    given["test"] = tuple(map(trial_of, found.test))
    return Study(**given)


def read_fit(folder: str | Path) -> Fit:
    """Read a fit that `Fit.save` or ``seatrial identify`` has written.

    Everything is as it was, to the last bit, but for the trials and for what only its estimator knows (`details`).

    Raises:
        StudyError: no fit in that folder, or one that cannot be used; names file and key.
    """
    return replace(fit_of(load_fit(folder)), folder=Path(folder))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None

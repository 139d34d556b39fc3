"""A fit in stages: without outliers, tested, with the errors of instruments that matter, and weighed by what it leaves.

Where the model explains the data one fit is enough: the residuals are weighed by sensor noise.  Where it does not, the
errors of a prediction exceed the noise and last for many samples.  Then the residual weights are estimated from the
residuals, channel by channel, with the time over which they are alike (the output-error method of aircraft system
identification, Maine and Iliff 1985, with an effective number of samples), while the initial state of each window stays
within the noise of its measurement.  A search (population, many starts, ranges, multiple shooting) finds the optimum;
new weights shift it a little, so Gauss-Newton steps on the same windows follow it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ...core.values import dataclass, replace
from .. import Fit, FitError, Loss, Problem, Progress, StudyError
from ..noise import noise, screened
from ..nuisance import EVERY, unread
from ..record import Settings, compared_as, scales
from ..trajectory.local import WINDOW, Cut, local
from .apart import refuse_copies
from .channels import Channel
from .diagnose import diagnosed
from .findings import Suspicion

# Most errors of instruments that are estimated because the residuals call for them, and rounds of residual weights.
_MOST, _ROUNDS = 5, 2
# Longer windows than this many of `Trajectory` are too long for one Gauss-Newton step to predict what a suspect does.
_LONG = 1.5


def in_stages(
    fit: Callable[..., Fit], estimator: Any, problem: Problem, *, progress: Progress | None = None,
    checkpoint: Path | None = None,
) -> Fit:  # fmt: skip
    """A fit of `problem` by the function `fit` of an estimator, tested against noise and errors of instruments.

    With `nuisance.suspects = "auto"` the error that the residuals call for most is estimated too, one after the other,
    each in a fit that starts where the last one ended: as long as one of them matters (`Suspicion.matters`) and its
    drop pays for a parameter by Schwarz's criterion (BIC), at most five.  Where the loss leaves weights open (no sigma,
    no correlation time) and the model does not explain the data, the weights are estimated in two rounds.

    Raises:
        StudyError: suspects are to be estimated, and the estimator cannot; an error of an instrument that no data tell
            apart from a free parameter.
    """
    own, able = problem.nuisance, getattr(estimator, "estimates_common", False)
    _refuse(own.suspects, able)
    # A declared sigma may be wider than the noise, or, as a weight, narrower.
    level, wide = noise(problem.trials, problem.ship.model.motion), scales(problem)
    clean = screened(problem.trials, {name: max(sd, wide.get(name, sd)) for name, sd in level.items()})
    problem = replace(problem, trials=clean.trials)
    refuse_copies(problem, compared_as(estimator))
    stages = 0
    regresses = getattr(estimator, "regresses", False)
    test = _Test(compared_as(estimator), clean.rejected, problem.loss.correlation is None, regresses)

    def again(posed: Problem, last: Fit | None = None) -> Fit:
        nonlocal stages
        further = checkpoint.with_suffix(f".{stages}{checkpoint.suffix}") if checkpoint and stages else checkpoint
        stages += 1
        return _as_declared(fit(estimator, started(posed, last), progress=progress, checkpoint=further), posed)

    found = test.suspected(again(problem), problem)
    while own.suspects and stages <= _MOST and (name := _worth(found)):
        common = {**problem.nuisance.common, **dict.fromkeys(_whole(name), math.inf)}
        problem = replace(problem, nuisance=replace(problem.nuisance, common=common))
        found = test.suspected(again(problem, found), problem)
    open_weights = not problem.loss.sigma and problem.loss.scale == "noise" and problem.loss.correlation is None
    by_noise = found.diagnosis
    stay = regresses or getattr(estimator, "weights_stay", False)
    if not (open_weights and by_noise and by_noise.lacking) or stay:
        return found
    searched = found
    for _ in range(_ROUNDS):
        if found.diagnosis:
            problem = _weighed(problem, found.diagnosis.channels)
            then = again(problem, found) if able else test.followed(found, problem)
            found = test.of(then, problem)
    # Suspects are tested where the noise decides: weights that a fault has made small would hide it.
    said = found.diagnosis and replace(
        found.diagnosis, suspicions=by_noise.suspicions, contradictions=by_noise.contradictions,
        differing=by_noise.differing, terms=by_noise.terms,
    )  # fmt: skip
    found = replace(found, diagnosis=said, loss=problem.loss)
    return found if able else _of_search(found, searched)


@dataclass(frozen=True)
class _Test:
    """Tests of the fits of one problem.

    Attributes:
        settings: how trajectories are cut and compared.
        rejected: outliers, for the record.
        widen: whether sigma follows from the residuals.
        regresses: see `OneStep.regresses`.
    """

    settings: Settings
    rejected: Mapping[str, Mapping[str, int]]
    widen: bool
    regresses: bool

    def of(self, fit: Fit, problem: Problem) -> Fit:
        """The fit with its diagnosis."""
        return diagnosed(
            fit, problem, self.settings, self.rejected, widen=self.widen and not self.regresses,
            regresses=self.regresses,
        )  # fmt: skip

    def suspected(self, fit: Fit, problem: Problem) -> Fit:
        """The same; suspects of a model that does not explain long windows are tested in those of `Trajectory`."""
        found = self.of(fit, problem)
        if found.diagnosis is None or not found.diagnosis.lacking or not (some := self._in_windows(found, problem)):
            return found
        return replace(found, diagnosis=replace(found.diagnosis, suspicions=some))

    def _in_windows(self, fit: Fit, problem: Problem) -> tuple[Suspicion, ...]:
        """Suspects of a fit to the windows that `Trajectory` has by default; empty where these are not shorter."""
        if self._window(problem) <= _LONG * WINDOW:
            return ()
        short = self._cut(WINDOW, None)
        try:
            then = local(started(problem, fit), short)
        except FitError:
            return ()
        tested = diagnosed(then, problem, short, self.rejected, widen=self.widen).diagnosis
        return tested.suspicions if tested else ()

    def _window(self, problem: Problem) -> float:
        return self.settings.window or max(trial.duration for trial in problem.trials)

    def followed(self, fit: Fit, problem: Problem) -> Fit:
        """The optimum of a search under other weights, by Gauss-Newton steps on the same windows."""
        own = replace(problem, free=fit.free)
        return _as_declared(local(started(own, fit), self._cut(self._window(problem), self.settings.every)), own)

    def _cut(self, window: float, every: int | None) -> Cut:
        own = self.settings
        return Cut(window, every, own.dt, own.method, own.threads, getattr(own, "initial", "free"))


def started(posed: Problem, last: Fit | None) -> Problem:
    """The problem, started where the last fit ended, with the errors of instruments that it found."""
    if last is None:
        return posed
    common = {name: value for name, value in last.nuisances.get(EVERY, {}).items() if name in posed.nuisance.common}
    return replace(posed, free=posed.vector.started(last.vector.by_path(last.values)),
                   nuisance=replace(posed.nuisance, begun=common))  # fmt: skip


def _as_declared(fit: Fit, posed: Problem) -> Fit:
    """The fit with its parameters as declared, not as started."""
    declared = {f.path: f for f in posed.free}
    return replace(fit, free=tuple(declared.get(f.path, f) for f in fit.free))


def _of_search(fit: Fit, searched: Fit) -> Fit:
    """The fit under other weights, with the account of the search that led there."""
    return replace(
        fit, history=searched.history, seconds=searched.seconds + fit.seconds, ends=searched.ends,
        evaluations=searched.evaluations + fit.evaluations, digest=searched.digest, details=searched.details,
        status=f"{searched.status}; weights by what it leaves",
    )  # fmt: skip


def _refuse(suspects: str, able: bool) -> None:
    if suspects not in ("", "auto"):
        raise StudyError(f"nuisance.suspects is '{suspects}'; it is \"auto\", or left out")
    if suspects and not able:
        raise StudyError('nuisance.suspects = "auto" needs the estimator shooting:Trajectory')


def _worth(fit: Fit) -> str:
    """The error of an instrument that the residuals call for most; empty where none pays for a parameter."""
    if fit.diagnosis is None or not fit.diagnosis.causes:
        return ""
    sized = [one for one in fit.diagnosis.causes if not (one.whole or one.instead)]
    if not sized:
        return ""
    first, rows = sized[0], sum(one.count for one in fit.diagnosis.channels.values())
    return first.name if first.drop > math.log(max(rows, 2)) else ""


def _whole(name: str) -> tuple[str, ...]:
    """An error with the other component of the same vector."""
    kind, _, way = name.partition(".")
    return (f"{kind}.north", f"{kind}.east") if way in ("north", "east") else (name,)


def _weighed(problem: Problem, channels: Mapping[str, Channel]) -> Problem:
    """The problem with the residual weights and the correlation time that a fit has left.

    A channel weighs by how long its own errors last: a fix wanders for a minute while a gyro forgets within a second,
    and one time for both would leave the track too sure of itself and the gyro unheard.
    """
    times = sorted(one.lasting for one in channels.values())
    lasting = times[len(times) // 2]
    sigma = {name: one.noise * max(one.size, 1.0) * math.sqrt(one.lasting / lasting) for name, one in channels.items()}
    level = noise(problem.trials, problem.ship.model.motion)
    initial = dict(problem.nuisance.initial) or (
        unread(problem) | {name: level[name] for name in channels})  # fmt: skip
    return replace(
        problem, loss=Loss(sigma, lasting, problem.loss.weights),
        nuisance=replace(problem.nuisance, initial=initial),
    )  # fmt: skip

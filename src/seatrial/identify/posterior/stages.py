"""A fit in stages: without outliers, tested, with the errors of instruments that matter, and weighed by what it leaves.

Where the model explains the data one fit is enough: the residuals are weighed by sensor noise.  Where it does not, the
errors of a prediction exceed the noise and last for many samples.  Then the residual weights are estimated from the
residuals, channel by channel, with the time over which they are alike (the output-error method of aircraft system
identification, Maine and Iliff 1985, with an effective number of samples), while the initial state of each window stays
within the noise of its measurement.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import Fit, Loss, Problem, Progress, StudyError
from ..noise import noise, screened
from ..record import scales
from .diagnose import diagnosed
from .diagnosis import Channel

# Most errors of instruments that are estimated because the residuals call for them, and rounds of residual weights.
_MOST, _ROUNDS = 5, 2


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
        StudyError: suspects are to be estimated, and the estimator cannot.
    """
    own, able = problem.nuisance, getattr(estimator, "estimates_common", False)
    _refuse(own.suspects, able)
    # A declared sigma may be wider than the noise, or, as a weight, narrower.
    level, wide = noise(problem.trials), scales(problem)
    clean = screened(problem.trials, {name: max(sd, wide.get(name, sd)) for name, sd in level.items()})
    problem = replace(problem, trials=clean.trials)
    stages, widen = 0, problem.loss.correlation is None

    def again(posed: Problem, last: Fit | None = None) -> Fit:
        nonlocal stages
        begun = posed if last is None else replace(
            posed, free=posed.vector.started(last.vector.by_path(last.values))
        )  # fmt: skip
        further = checkpoint.with_suffix(f".{stages}{checkpoint.suffix}") if checkpoint and stages else checkpoint
        stages += 1
        then = fit(estimator, begun, progress=progress, checkpoint=further)
        if last is not None:  # as declared, not as started
            declared = {f.path: f for f in posed.free}
            then = replace(then, free=tuple(declared[f.path] for f in then.free))
        return diagnosed(then, posed, estimator, clean.rejected, widen=widen)

    found = again(problem)
    while own.suspects and stages <= _MOST and (name := _worth(found)):
        common = {**problem.nuisance.common, **dict.fromkeys(_whole(name), math.inf)}
        problem = replace(problem, nuisance=replace(problem.nuisance, common=common))
        found = again(problem, found)
    open_weights = not problem.loss.sigma and problem.loss.scale == "noise" and problem.loss.correlation is None
    by_noise = found.diagnosis
    if not (able and open_weights and by_noise and by_noise.lacking):
        return found
    for _ in range(_ROUNDS):
        if found.diagnosis:
            problem = _weighed(problem, found.diagnosis.channels)
            found = again(problem, found)
    # Suspects are tested where the noise decides: weights that a fault has made small would hide it.
    said = found.diagnosis and replace(found.diagnosis, suspicions=by_noise.suspicions)
    return replace(found, diagnosis=said, loss=problem.loss)


def _refuse(suspects: str, able: bool) -> None:
    if suspects not in ("", "auto"):
        raise StudyError(f"nuisance.suspects is '{suspects}'; it is \"auto\", or left out")
    if suspects and not able:
        raise StudyError('nuisance.suspects = "auto" needs the estimator shooting:Trajectory')


def _worth(fit: Fit) -> str:
    """The error of an instrument that the residuals call for most; empty where none pays for a parameter."""
    if fit.diagnosis is None or not fit.diagnosis.causes:
        return ""
    sized = [one for one in fit.diagnosis.causes if not one.whole]
    if not sized:
        return ""
    first, rows = sized[0], sum(one.count for one in fit.diagnosis.channels.values())
    return first.name if first.drop > math.log(max(rows, 2)) else ""


def _whole(name: str) -> tuple[str, ...]:
    """An error with the other component of the same vector."""
    kind, _, way = name.partition(".")
    return (f"{kind}.north", f"{kind}.east") if way in ("north", "east") else (name,)


def _weighed(problem: Problem, channels: Mapping[str, Channel]) -> Problem:
    """The problem with the residual weights and the correlation time that a fit has left."""
    sigma = {name: one.noise * max(one.size, 1.0) for name, one in channels.items()}
    lasting = sorted(one.lasting for one in channels.values())
    level = noise(problem.trials)
    initial = dict(problem.nuisance.initial) or {name: level[name] for name in channels}
    return replace(
        problem, loss=Loss(sigma, lasting[len(lasting) // 2], problem.loss.weights),
        nuisance=replace(problem.nuisance, initial=initial),
    )  # fmt: skip

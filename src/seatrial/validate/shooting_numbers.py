"""What the page of a study of shooting says in numbers, SI units and radians."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from .shooting_cases import FULL, TRUTH, Case, Shot
from .shooting_scores import HORIZONS, VELOCITIES, Score

SCHEMA = "seatrial-shooting/1"


def numbers(shot: Shot) -> dict[str, Any]:
    """Cases with fits and scores, thrust maps, servos, and what a paper found; what is not finite is null."""
    study = shot.study
    return plain({
        "schema": SCHEMA, "study": study.name, "title": study.title, "ship": study.problem.ship.name,
        "horizons": list(HORIZONS), "trials": [t.name for t in study.problem.trials],
        "test_trials": [t.name for t in study.test], "published": dict(study.published),
        "cases": {case.name: _of_case(case) for case in shot.cases},
        "thrust": {
            name: {"coefficients": fit.coefficients.tolist(), "sigma": fit.sigma.tolist(), "powers": list(fit.powers),
                   "n_max": fit.n_max, "R2": fit.R2, "rmse": fit.rmse, "rows": fit.rows}
            for name, (fit, _, _) in shot.drive.maps.items()
        },
        "servos": {
            name: {**asdict(fit.servo), "sigma": dict(fit.sigma), "offset": fit.offset, "rmse": fit.rmse, "R2": fit.R2,
                   "samples": fit.samples, "cautions": list(fit.cautions)}
            for name, fit in shot.drive.servos.items()
        },
    })  # fmt: skip


def _of_case(case: Case) -> dict[str, Any]:
    fit = case.fits[FULL]
    return {
        "about": case.about,
        "fits": {
            who: {"objective": one.objective, "seconds": one.seconds, "status": one.status, "parameters": {
                f.path: {"start": f.start, "value": float(v), "sigma": float(s)}
                for f, v, s in zip(one.free, one.values, one.sigma, strict=True)
            }} for who, one in case.fits.items()
        },
        "truth": {f.path: float(v) for f, v in zip(fit.free, case.truth, strict=True)},
        "sigmas_off": {f.path: float(z) for f, z in zip(fit.free, case.away, strict=True)},
        "verdicts": [asdict(v) for v in fit.verdicts],
        "scores": {who: _of_score(score) for who, score in case.scores.items()},
        "rival_over_model": {v: case.smaller(v) for v in VELOCITIES},
        "model_over_truth": dict(case.scores[FULL].beyond(case.scores[TRUTH])),
    }  # fmt: skip


def _of_score(score: Score) -> dict[str, Any]:
    return {
        "relative": dict(score.relative), "runs": {name: dict(run) for name, run in score.runs.items()},
        "steps": {name: errors.tolist() for name, errors in score.steps.items()}, "starts": score.starts,
    }


def plain(value: Any) -> Any:
    """The same in what JSON knows; a number that is not finite becomes null."""
    if isinstance(value, Mapping):
        items: Iterable[tuple[Any, Any]] = value.items()
        return {str(key): plain(item) for key, item in items}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

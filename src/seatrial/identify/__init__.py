"""Identification: from trials to parameters, with a verdict on each.

Contract: a `Problem` is a document (ship, free parameters, trials, loss) that `lint.lint` can judge before anything
is run; an `Estimator` turns it into a `Fit`: a ship ready to simulate, with the covariance and the digest of its
problem.  All of these are frozen values of `problem`.

What every estimator uses: `vector` (free parameters as arrays), `record` (a trial as a model sees it, and its
windows), `nuisance` (nuisance parameters as arrays), `lint`, `watch` (progress), `resume` and `digest`.  The
estimators live by school: `trajectory`, `shooting`, `population`, `tuning`, `networks`, `regression`, `filters`;
`components` fits thrust maps and servos, `posterior` judges a fit, `design` plans trials.
"""

from .problem import (
    Estimator,
    Fit,
    FitError,
    Issue,
    Loss,
    Nuisance,
    Problem,
    Progress,
    Spread,
    StudyError,
    Verdict,
)

__all__ = [
    "Estimator", "Fit", "FitError", "Issue", "Loss", "Nuisance", "Problem", "Progress", "Spread", "StudyError",
    "Verdict",
]  # fmt: skip

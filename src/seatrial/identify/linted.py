"""What a study refuses, an estimator called from Python refuses: the lint in front of every fit."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Concatenate, ParamSpec, TypeVar

from . import Fit, Problem

_P = ParamSpec("_P")
_E = TypeVar("_E")


def linted(
    fit: Callable[Concatenate[_E, Problem, _P], Fit],
) -> Callable[Concatenate[_E, Problem, _P], Fit]:
    """The `fit` of an estimator that raises a StudyError on the first error of `lint` before it begins.

    A problem is looked at once: what an estimator derives from it, for a stage, a fold or a start, is not looked at
    again. Whether any trial feels a parameter is left to `lint` itself and to the verdict of the fit: it takes a
    compilation.
    """

    @functools.wraps(fit)
    def checked(self: _E, problem: Problem, *args: _P.args, **options: _P.kwargs) -> Fit:
        from .lint import lint, raise_on_errors

        if not problem.linted:
            given: Any = self
            raise_on_errors(lint(problem, estimator=given, felt=False))
            problem = replace(problem, linted=True)
        return fit(self, problem, *args, **options)

    return checked

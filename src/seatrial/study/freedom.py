"""The table [free] of a study: patterns over parameter paths to `Free`, the more specific pattern first."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..core.parameters import MOST, Free, ParameterError, Spec, far, match, specs, unknown, values
from ..identify import Estimator, Problem, StudyError
from ..identify.lint import tested_by

KEYS = ("prior", "ratio", "low", "high", "start", "sigma", "floor")


def freedom(model: Any, table: Mapping[str, Any]) -> tuple[tuple[Free, ...], tuple[str, ...]]:
    """Free parameters in the order of the model, and what was left fixed although a pattern fits it.

    An entry says one of: ``{prior = 0.3}`` (a Gaussian about the value, relative; `floor` is its
    least absolute sigma), ``{sigma = ...}`` (the same, absolute), ``{ratio = 0.5}`` (an interval),
    ``{low = ..., high = ...}``; intervals go with priors, `start` with all; ``false`` keeps fixed.

    Raises:
        StudyError: an unknown path or key, or an entry that gives no freedom.
        ParameterError: an interval without width, or that excludes the start.
    """
    chosen: dict[str, tuple[str, Any]] = {}
    for pattern in sorted(table, key=_specificity):
        try:
            paths = match(model, pattern)
        except ParameterError as error:
            raise StudyError(f"free: {error}") from None
        chosen |= dict.fromkeys(paths, (pattern, table[pattern]))
    meanings, known = specs(model), values(model)
    free: list[Free] = []
    fixed: list[str] = []
    for path in known:
        pattern, entry = chosen.get(path, ("", False))
        if entry is False:
            continue
        one = _free(path, float(known[path]), meanings[path], _entry(pattern, entry))
        if one is not None:
            free.append(one)
        elif any(c in pattern for c in "*?["):
            fixed.append(path)
        else:
            raise StudyError(f"free: {path} is zero: 'prior' and 'ratio' leave it no room; give sigma, or low and high")
    return tuple(free), tuple(fixed)


def suspected(where: str, problem: Problem, estimator: Estimator, asked: bool) -> Problem:
    """The problem, with `nuisance.suspects = "auto"` where it is asked for.

    Args:
        where: the study file, and the fit in a table of fits.
        asked: by the option --free-suspects; the study may ask for it too.

    Raises:
        StudyError: it is asked for, and the estimator cannot estimate errors of instruments.
    """
    if asked:
        problem = replace(problem, nuisance=replace(problem.nuisance, suspects="auto"))
    able = getattr(estimator, "estimates_common", False) and tested_by(problem, estimator)
    if problem.nuisance.suspects and not able:
        option = "--free-suspects" if asked else 'nuisance.suspects = "auto"'
        raise StudyError(
            f"{where}: {option} needs the estimator shooting:Trajectory and a model in continuous time; "
            f"this is {type(estimator).__name__} with {type(problem.ship.model).__name__}"
        )
    return problem


def _specificity(pattern: str) -> tuple[bool, int]:
    """A full path counts more than a pattern, a long pattern more than a short one."""
    wild = any(c in pattern for c in "*?[")
    return not wild, len(pattern.replace("*", ""))


def _entry(pattern: str, entry: Any) -> Mapping[str, float]:
    if not isinstance(entry, Mapping):
        raise StudyError(f"free: '{pattern}' is {entry!r}; write a table such as {{ prior = 0.3 }}, or false")
    for key, value in entry.items():
        if key not in KEYS:
            raise StudyError(f"free: '{pattern}': {unknown(key, KEYS, 'key')}")
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise StudyError(f"free: '{pattern}': {key} is {value!r}; it must be a number")
    for key in ("prior", "ratio", "sigma", "floor"):
        if key in entry and not entry[key] > 0:
            raise ParameterError(f"free: '{pattern}': {key} is {entry[key]:g}; an interval or a prior needs a width")
    for key in ("prior", "ratio"):
        if entry.get(key, 0.0) > MOST:
            raise ParameterError(f"free: '{pattern}': {far(key, entry[key])}")
    if not ({"prior", "sigma", "ratio"} & set(entry) or {"low", "high"} <= set(entry)):
        raise StudyError(f"free: '{pattern}': give prior, sigma or ratio, or low and high")
    return entry


def _free(path: str, value: float, meaning: Spec, entry: Mapping[str, float]) -> Free | None:
    """The parameter as the entry frees it; None where a relative width of zero leaves no room."""
    low, high = entry.get("low", meaning.low), entry.get("high", meaning.high)
    _within(path, meaning, low, high, "give low and high within it")
    if "ratio" in entry:
        half = entry["ratio"] * abs(value)
        if not half:
            return None
        room = min(meaning.high - value, value - meaning.low) / abs(value)
        remedy = f"a ratio up to {math.floor(100.0 * min(room, 9.0)) / 100.0:g} stays within, or give low and high too"
        _within(path, meaning, entry.get("low", value - half), entry.get("high", value + half), remedy)
        low, high = max(low, value - half), min(high, value + half)
    sigma = entry.get("sigma", math.inf)
    if "prior" in entry:
        sigma = max(entry["prior"] * abs(value), entry.get("floor", 0.0))
        if not sigma:
            return None
    prior = value if math.isfinite(sigma) else math.nan
    return Free(path, entry.get("start", value), low, high, prior, sigma)


def _within(path: str, meaning: Spec, low: float, high: float, remedy: str) -> None:
    """Refuse a range that leaves what the parameter can be, rather than cut it in silence."""
    if low < meaning.low or high > meaning.high:
        raise StudyError(
            f"free: {path}: the range [{low:g}, {high:g}] leaves what it can be, "
            f"[{meaning.low:g}, {meaning.high:g}]; {remedy}"
        )

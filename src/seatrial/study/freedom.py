"""The table [free] of a study: patterns over parameter paths to `Free`, the more specific pattern first."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import SeatrialError
from ..core.parameters import MOST, Free, ParameterError, Spec, far, match, specs, unknown, values
from ..identify import Estimator, Problem, StudyError
from ..identify.lint import tested_by
from ..identify.regression.captive import USUAL, CaptiveFit, fit_captive, priors
from ..identify.vector import Vector
from ..ships import Ship
from .data import named_path
from .schema import CaptiveTable

KEYS = ("prior", "ratio", "low", "high", "start", "sigma", "floor")
"""What a study may say of a free parameter."""


def stated(ship: Ship) -> dict[str, float]:
    """Sigmas by path that a ship file states and a fit takes as priors: of captive tests, and of particulars.

    A ship that `estimate` made from particulars states all of its own.  The sigma of a number fitted to trials is left
    out: as a prior it would count the same trials twice.
    """
    if not any(entry.source.startswith("estimated:") for entry in ship.entries.values()):
        return priors(ship)
    return {path: entry.sigma for path, entry in ship.entries.items()
            if entry.sigma and not entry.source.startswith("fitted ")}  # fmt: skip


def taken(model: Any, table: Mapping[str, Any], sigmas: Mapping[str, float]) -> tuple[str, ...]:
    """Paths whose prior is that of the ship file, since the table gives none and does not refuse it."""
    return tuple(path for path, (_, entry) in _chosen(model, table).items()
                 if path in sigmas and isinstance(entry, Mapping) and not {"prior", "sigma"} & set(entry))  # fmt: skip


def tested(path: Path, table: CaptiveTable, ship: Ship) -> CaptiveFit:
    """The captive tests of the study at `path`, fitted from its ship.

    Raises:
        StudyError: tables that cannot be read, or that do not determine what they are asked for.
    """
    from ..data.captive import read_captive  # its tables may be mapped, which most studies do without

    try:
        files = [named_path(path, "captive.tables", name) for name in table.tables]
        mapping = named_path(path, "captive.mapping", table.mapping) if table.mapping else None
        rho = float(values(ship.model).get("body.rho", 1000.0))
        return fit_captive(ship, read_captive(files, mapping, L_pp=ship.L_pp, rho=rho), tuple(table.fit) or USUAL)
    except SeatrialError as error:
        text = str(error)
        raise StudyError(text if text.startswith(str(path)) else f"{path}: captive: {text}") from None


def joint(free: tuple[Free, ...], tests: CaptiveFit, scatter: float, paths: tuple[str, ...]) -> tuple[Free, ...]:
    """The free parameters with prior and captive tests together as the prior of those that the tests determine.

    A Gaussian likelihood of the tests times the prior, times the likelihood of the trials, is that of all, where the
    loads are linear in the coefficients as far as their sigmas reach.

    Args:
        scatter: factor of all sigmas of the tests; correlations stay.
        paths: which parameters have no prior but the tests.
    """
    mine = [replace(f, prior=math.nan, sigma=math.inf) if f.path in paths else f
            for f in free if f.path in tests.paths]  # fmt: skip
    at, own = [tests.paths.index(f.path) for f in mine], Vector.of(mine)
    told = np.linalg.inv(scatter**2 * tests.covariance[np.ix_(at, at)])
    covariance = np.linalg.inv(own.precision + told)
    mean = covariance @ (own.precision @ own.mean + told @ tests.values[at])
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)

    def tied(f: Free) -> Free:
        if f.path not in own.paths:
            return f
        k = own.paths.index(f.path)
        start = min(max(float(mean[k]), f.low), f.high)
        pairs = tuple(zip(own.paths[:k], correlation[k, :k].tolist(), strict=True))
        return replace(f, start=start, prior=float(mean[k]), sigma=float(sigma[k]), tied=pairs)

    return tuple(map(tied, free))


def freedom(
    model: Any, table: Mapping[str, Any], sigmas: Mapping[str, float] | None = None
) -> tuple[tuple[Free, ...], tuple[str, ...]]:
    """Free parameters in the order of the model, and what was left fixed although a pattern fits it.

    An entry says one of: ``{prior = 0.3}`` (a Gaussian about the value, relative; `floor` is its
    least absolute sigma), ``{sigma = ...}`` (the same, absolute), ``{ratio = 0.5}`` (an interval),
    ``{low = ..., high = ...}``; intervals go with priors, `start` with all; ``false`` keeps fixed.  An entry without a
    prior takes that of `sigmas`, if there is one and it does not say ``prior = false``; then ``{}`` is enough.

    Raises:
        StudyError: an unknown path or key, or an entry that gives no freedom.
        ParameterError: an interval without width, or that excludes the start.
    """
    chosen, sigmas = _chosen(model, table), sigmas or {}
    meanings, known = specs(model), values(model)
    free: list[Free] = []
    fixed: list[str] = []
    for path in known:
        pattern, entry = chosen.get(path, ("", False))
        if entry is False:
            continue
        one = _free(path, float(known[path]), meanings[path], _entry(pattern, entry, sigmas.get(path)))
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


def _chosen(model: Any, table: Mapping[str, Any]) -> dict[str, tuple[str, Any]]:
    """The pattern and the entry that hold for each path."""
    chosen: dict[str, tuple[str, Any]] = {}
    for pattern in sorted(table, key=_specificity):
        try:
            paths = match(model, pattern)
        except ParameterError as error:
            raise StudyError(f"free: {error}") from None
        chosen |= dict.fromkeys(paths, (pattern, table[pattern]))
    return chosen


def _specificity(pattern: str) -> tuple[bool, int]:
    """A full path counts more than a pattern, a long pattern more than a short one."""
    wild = any(c in pattern for c in "*?[")
    return not wild, len(pattern.replace("*", ""))


def _entry(pattern: str, entry: Any, sigma: float | None) -> Mapping[str, float]:
    """The entry, checked; `sigma` of the ship file stands in where it gives no prior."""
    if not isinstance(entry, Mapping):
        raise StudyError(f"free: '{pattern}' is {entry!r}; write a table such as {{ prior = 0.3 }}, or false")
    entry = _completed(entry, sigma)
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


def _completed(entry: Mapping[str, Any], sigma: float | None) -> Mapping[str, Any]:
    """The entry with the prior of the ship file, or without any where it says ``prior = false``."""
    if entry.get("prior") is False:
        return {key: value for key, value in entry.items() if key != "prior"}
    return entry if sigma is None or {"prior", "sigma"} & set(entry) else {**entry, "sigma": sigma}


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

"""What a fine-tuning found: both methods in each range, the range chosen, and what that is worth in plain words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import pairwise

import numpy as np

from ...core.parameters import Free
from ...core.values import dataclass
from ...data import Array, Trial
from .. import Fit, Issue, Problem
from ..vector import Vector
from .ranges import Residuals

# A value this near to an end of its range, over the range, is taken to be at it.
_AT_END = 1e-6
# Test trials whose loss is larger than in the best range by more than this factor are reported as a warning.
_WORSE = 1.05

info, warning = partial(Issue, "info"), partial(Issue, "warning")


@dataclass(frozen=True)
class Method:
    """What one way of searching found in one range."""

    objective: float
    values: Array
    evaluations: int
    seconds: float
    status: str
    ends: Array
    history: Array

    @staticmethod
    def of(fit: Fit) -> Method:
        """The parts of a fit that tell the ways apart."""
        return Method(fit.objective, fit.values, fit.evaluations, fit.seconds, fit.status, fit.ends, fit.history)


@dataclass(frozen=True)
class Range:
    """One range of the sweep.

    Attributes:
        ratio: a_r.
        free: the parameters with their ranges.
        fit: the better of the two fits.
        kept: "evolution" or "gradient".
        methods: both, by those names.
        tune, test: loss of each trial by name.
        left_out: loss of each tuning trial predicted from a fit to the others.
        soft: values of the fit with a Gaussian about the untuned values instead of the box.
        soft_tune, soft_test, soft_left_out: the same of it, the prior not counted.
    """

    ratio: float
    free: tuple[Free, ...]
    fit: Fit
    kept: str
    methods: Mapping[str, Method]
    tune: Mapping[str, float]
    test: Mapping[str, float]
    left_out: Mapping[str, float]
    soft: Array
    soft_tune: Mapping[str, float]
    soft_test: Mapping[str, float]
    soft_left_out: Mapping[str, float]

    @property
    def apart(self) -> float:
        """Relative difference of the objectives of the two methods."""
        costs = [m.objective for m in self.methods.values()]
        return (max(costs) - min(costs)) / max(abs(min(costs)), 1e-300)

    @property
    def position(self) -> Array:
        """Where each value lies in its range, -1 the lower end, +1 the upper."""
        low, high = Vector.of(self.free).low, Vector.of(self.free).high
        return 2.0 * (self.fit.values - low) / (high - low) - 1.0

    @property
    def at_bound(self) -> tuple[str, ...]:
        """Paths of the parameters at an end of their range."""
        near = np.abs(self.position) > 1.0 - 2.0 * _AT_END
        return tuple(f.path for f, yes in zip(self.free, near, strict=True) if yes)


@dataclass(frozen=True)
class Tuning:
    """The whole study.

    Attributes:
        problem: what was tuned, with the ranges as declared.
        tests: trials that no decision has seen.
        ranges: by ratio, the narrowest first.
        chosen: index of the range that predicts tuning trials left out best.
        untuned_tune, untuned_test: loss of each trial with the ship as given.
        residuals: what the chosen fit leaves of the tuning trials.
        flat: combinations of parameters that the tuning trials leave as wide as the chosen range.
        agreement: the two methods are held to agree below this relative difference.
    """

    problem: Problem
    tests: tuple[Trial, ...]
    ranges: tuple[Range, ...]
    chosen: int
    untuned_tune: Mapping[str, float]
    untuned_test: Mapping[str, float]
    residuals: Residuals
    flat: int
    agreement: float

    @property
    def best(self) -> Range:
        """The chosen range."""
        return self.ranges[self.chosen]

    @property
    def fit(self) -> Fit:
        """The fit within the chosen range: what a study saves."""
        return self.best.fit

    @property
    def best_test(self) -> float:
        """Ratio of the range that predicts the test trials best, known afterwards only; NaN without tests."""
        if not self.tests:
            return math.nan
        return min(self.ranges, key=lambda r: sum(r.test.values())).ratio


def findings(tuning: Tuning) -> tuple[Issue, ...]:
    """Findings in words: "info" for what is as expected, "warning" for what needs care."""
    left = (warning("residuals", line) for line in tuning.residuals.warnings)
    return (*_choice(tuning), *_data(tuning), *_search(tuning), *_tests(tuning), *left)


def _choice(tuning: Tuning) -> Iterator[Issue]:
    best, others = tuning.best, [r for r in tuning.ranges if r is not tuning.best]
    total, names = sum(best.left_out.values()), list(best.left_out)
    yield info("range", f"a_r = {best.ratio:g} is chosen: it predicts the tuning trials left out best, with a loss of "
               f"{total:.4g}; no test trial was used")  # fmt: skip
    if others and best is tuning.ranges[-1]:
        yield warning("range", "the widest range tried is the best: a wider one may be better still, or the "
                      "parameters make up for something that the model lacks")  # fmt: skip
    unclear: list[str] = []
    for other in others:
        more = np.array([other.left_out[n] - best.left_out[n] for n in names])
        if more.sum() <= more.std(ddof=1) * math.sqrt(len(names)):
            unclear.append(f"{other.ratio:g}")
    if unclear:
        yield warning("range", f"the {len(names)} trials left out cannot distinguish a_r = {best.ratio:g} from "
                      f"{', '.join(unclear)}: the difference is within its own scatter")  # fmt: skip
    wins = {n: min(tuning.ranges, key=lambda r: r.left_out[n]).ratio for n in names}
    if len(set(wins.values())) > 1:
        said = ", ".join(f"{n} {a:g}" for n, a in wins.items())
        yield warning("range", f"the trials left out do not agree on a range: {said}")
    softest = min(tuning.ranges, key=lambda r: sum(r.soft_left_out.values()))
    soft = sum(softest.soft_left_out.values())
    word = "better than" if soft < total else "no better than"
    yield info("soft range", f"the best soft range, a Gaussian in place of the box of a_r = {softest.ratio:g}, "
               f"predicts the trials left out {word} the chosen box ({soft:.4g} to {total:.4g})")  # fmt: skip


def _data(tuning: Tuning) -> Iterator[Issue]:
    p, left, widest = len(tuning.problem.free), tuning.residuals, tuning.ranges[-1]
    said = (f"the errors of the fit last {left.time:.0f} samples, so the trials hold some {left.independent:.0f} "
            f"independent ones for {p} parameters")  # fmt: skip
    yield info("data", said) if left.independent >= p else warning("data", f"too few data: {said}")
    if tuning.flat:
        yield warning("parameters", f"{tuning.flat} of {p} combinations of the parameters are left as wide as their "
                      "ranges: the values are not to be read as physics, nor trusted for manoeuvres of another "
                      "kind")  # fmt: skip
    wanted = 2.0 * widest.ratio * np.abs(tuning.problem.vector.current(tuning.problem.ship.model))
    cut = [f.path for f, width in zip(widest.free, wanted, strict=True) if f.high - f.low < width * (1.0 - 1e-9)]
    if cut:
        yield warning("range", f"a_r = {widest.ratio:g} would leave what [free] declares, or what is physically "
                      f"possible, and is cut there: {', '.join(cut)}")  # fmt: skip
    if stuck := tuning.best.at_bound:
        yield warning("parameters", f"{len(stuck)} of {p} end at a bound of their range ({', '.join(stuck)}): the "
                      "trials want them further out, or the model lacks something")  # fmt: skip


def _search(tuning: Tuning) -> Iterator[Issue]:
    apart = max(r.apart for r in tuning.ranges)
    if apart <= tuning.agreement:
        yield info("search", f"both methods find the same objective in every range, to {apart:.1g} at worst")
    for r in tuning.ranges:
        if r.apart > tuning.agreement:
            text = f"the methods end {r.apart:.2g} apart; the better, {r.kept}, is kept"
            yield warning(f"a_r {r.ratio:g}", text)
    for a, b in pairwise(tuning.ranges):
        if b.fit.objective > a.fit.objective * (1.0 + tuning.agreement):
            yield warning(f"a_r {b.ratio:g}", f"fits the tuning trials worse than the narrower a_r {a.ratio:g}: the "
                          "search has missed the optimum; give it more runs or starts")  # fmt: skip


def _tests(tuning: Tuning) -> Iterator[Issue]:
    where = "test trials"
    if not tuning.tests:
        yield warning(where, "there are none: nothing is known of manoeuvres that were not tuned to")
        return
    before = tuning.untuned_test
    lost = [f"{n} at {r.ratio:g}" for r in tuning.ranges for n, cost in r.test.items() if cost >= before[n]]
    if lost:
        yield warning(where, f"predicted no better than untuned: {', '.join(lost)}")
    else:
        yield info(where, "tuned beats untuned on every test trial, in every range")
    after, ratio = sum(tuning.best.test.values()), tuning.best_test
    least = min(sum(r.test.values()) for r in tuning.ranges)
    said = f"afterwards, a_r = {ratio:g} is seen to predict the test trials best"
    if after == least:
        yield info(where, f"{said}: it is the chosen one")
    elif after <= _WORSE * least:
        yield info(where, f"{said}; the loss in the chosen one is {100.0 * (after / least - 1.0):.2g} % above it")
    else:
        yield warning(where, f"{said}; the chosen one has {after / least:.3g} times its loss")
    if any(r.ratio > ratio for r in tuning.ranges):
        yield warning(where, f"beyond a_r = {ratio:g} the loss of the test trials rises while that of the tuning "
                      "trials falls: overfitting")  # fmt: skip

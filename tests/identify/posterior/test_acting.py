"""Sums, products, ratios and parameters without influence: by derivatives in closed form, and on a ship."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest

import seatrial as st
from seatrial.data import Array, Trial
from seatrial.identify import Problem
from seatrial.identify.lint import lint
from seatrial.identify.posterior.acting import Acting, acting
from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.simulate.run import simulate

VALUES = np.array([2.0, 0.7, -1.3, 40.0])
Map = Callable[..., Sequence[float]]


def _information(function: Map, values: Array, count: int = 400) -> Array:
    """Of y(t) = sum_k w_k(t) f_k(a, b, ...) with independent signals w, from derivatives by complex steps."""
    n = values.size
    slope = np.array([np.imag(np.asarray(function(*(values + 1e-30j * np.eye(n)[k])))) / 1e-30 for k in range(n)])
    signals = np.random.default_rng(1).normal(size=(count, slope.shape[1]))
    J = signals @ slope.T
    return np.asarray(J.T @ J, dtype=np.float64)


def _found(function: Map, count: int) -> tuple[Acting, ...]:
    values = VALUES[:count]
    return acting("abcd"[:count], _information(function, values), values, lambda v: _information(function, v))


CASES: list[tuple[str, Map, int, tuple[str, ...]]] = [
    ("sum", lambda a, b: [a + b], 2, ("only a + b acts: fix one of them",)),
    ("difference", lambda a, b: [a - b], 2, ("only a - b acts: fix one of them",)),
    ("weighted sum", lambda a, b: [a + 0.25 * b], 2, ("only 4 a + b acts: fix one of them",)),
    ("sum within", lambda a, b: [np.exp(0.1 * (a + b))], 2, ("only a + b acts: fix one of them",)),
    ("product", lambda a, b: [a * b], 2, ("only a * b acts: fix one of them",)),
    ("product of signs", lambda a, b, c: [a * c, b], 3, ("only a * c acts: fix one of them",)),
    ("ratio", lambda a, b: [a / b], 2, ("only a / b acts: fix one of them",)),
    ("inverse ratio", lambda a, b: [b / a], 2, ("only a / b acts: fix one of them",)),
    ("power", lambda a, b: [a**2 * b], 2, ("only a^2 * b acts: fix one of them",)),
    ("thrust", lambda a, b: [a * b**4], 2, ("only a * b^4 acts: fix one of them",)),
    ("root", lambda a, b: [np.sqrt(a / b)], 2, ("only a / b acts: fix one of them",)),
    ("three summands", lambda a, b, c: [a + b + c], 3, ("only a + b + c acts: fix two of them",)),
    ("three factors", lambda a, b, d: [a * b * d], 3, ("only a * b * c acts: fix two of them",)),
    ("quotient of three", lambda a, b, c: [a * b / c], 3, ("only a * b / c acts: fix two of them",)),
    ("sum beside others", lambda a, b, c, d: [a + d, b, c * b], 4, ("only a + d acts: fix one of them",)),
    ("a product and a sum", lambda a, b, c, d: [a * b, c + d], 4,
     ("only a * b acts: fix one of them", "only c + d acts: fix one of them")),
    ("two of three", lambda a, b, c: [a * b, b * c], 3, ("only 2 combinations of a, b and c act: fix one of them",)),
    ("of no simple form", lambda a, b: [a + b * b], 2, ("only one combination of a and b acts: fix one of them",)),
    ("without influence", lambda a, b, c: [a, c + 0 * b], 3, ("has no influence in these trials: fix it",)),
    ("nothing at all", lambda a, b: [0 * a, 0 * b], 2, ("has no influence in these trials: fix it",) * 2),
    ("each of them", lambda a, b, c, d: [a + b, a - b, c * d, c / d], 4, ()),
    ("nearly a sum", lambda a, b: [a + b, 1e-5 * a], 2, ()),
]  # fmt: skip


@pytest.mark.parametrize(("function", "count", "words"), [case[1:] for case in CASES], ids=[case[0] for case in CASES])
def test_what_acts_is_named(function: Map, count: int, words: tuple[str, ...]) -> None:
    assert tuple(one.words for one in _found(function, count)) == words


def test_units_change_no_group_and_no_form_of_a_product() -> None:
    for scale in (1e-6, 1e6):
        values = VALUES[:2] * (1.0, scale)
        found = acting("ab", _information(lambda a, b: [a * b], values), values,
                       lambda v: _information(lambda a, b: [a * b], v))  # fmt: skip
        assert [one.form for one in found] == ["a * b"]


def test_at_one_point_only_equal_weights_have_a_form() -> None:
    def at(function: Map, *values: float) -> str:
        v = np.array(values)
        (one,) = acting("ab", _information(function, v), v)
        return one.form

    assert at(lambda a, b: [a + b], 2.0, 0.7) == "a + b"
    assert at(lambda a, b: [a * b], 2.0, 0.7) == "a * b"
    assert not at(lambda a, b: [a + 3 * b], 2.0, 0.7)
    assert not at(lambda a, b: [a * b], 2.0, 2.0)  # a sum has the same derivatives there


def test_a_value_of_zero_has_no_product() -> None:
    values = np.array([0.0, 3.0])
    found = acting("ab", _information(lambda a, b: [a + b], values), values,
                   lambda v: _information(lambda a, b: [a + b], v))  # fmt: skip
    assert [one.form for one in found] == ["a + b"]


def test_many_parameters_are_named_by_their_number() -> None:
    names = [f"p{k}" for k in range(9)]
    values = np.arange(1.0, 10.0)
    (one,) = acting(names, np.outer(values, values), values)
    assert one.subject == "p0, p1, p2, p3, p4, p5 and 3 more"
    assert one.words == f"only one combination of {one.subject} acts: fix 8 of them"


def test_a_model_that_blew_up_has_no_groups() -> None:
    assert acting("ab", np.full((2, 2), math.nan), np.ones(2)) == ()


SHIP = st.load("kvlcc2_l7")
DEG, N_P = math.radians(1.0), 10.4
NOISE = {"psi": 0.003, "x": 0.02, "y": 0.02, "u": 0.01, "v_m": 0.01, "r": 0.002}


def _read(trial: Trial, seed: int) -> Trial:
    rng = np.random.default_rng(seed)
    noisy = {name: trial[name] + rng.normal(0.0, level, len(trial)) for name, level in NOISE.items()}
    return Trial(trial.name, trial.t, {**noisy, "delta": trial["delta"], "n_P": trial["n_P"]}, meta=dict(trial.meta))


@pytest.fixture(scope="module")
def trials() -> tuple[Trial, ...]:
    truth = SHIP.having({"body.I_zG": 1.15 * SHIP.parameters["body.I_zG"]})
    runs = (Zigzag(N_P, 20.0 * DEG, 20.0 * DEG), Turning(N_P, 35.0 * DEG))
    return tuple(_read(simulate(truth, m, duration=60.0, dt=0.2, name=f"t{k}"), k) for k, m in enumerate(runs))


@pytest.mark.slow
@pytest.mark.parametrize(("paths", "form"), [
    (("body.I_zG", "body.J_z"), "body.I_zG + body.J_z"),
    (("rudder.A_R", "rudder.f_alpha", "hull.N_r"), "rudder.A_R * rudder.f_alpha"),
])  # fmt: skip
@pytest.mark.parametrize("sigma", [math.inf, 0.3])
def test_a_fit_says_the_same_before_and_after_it(
    trials: tuple[Trial, ...], paths: tuple[str, ...], form: str, sigma: float
) -> None:
    free = tuple(replace(one, sigma=sigma * abs(one.start)) for one in st.near(SHIP, *paths, ratio=0.5))
    problem = Problem(SHIP, trials, free)
    words = f"only {form} acts: fix one of them"
    assert [(one.severity, one.text) for one in lint(problem) if one.where == "free"] == [("warning", words)]
    fit = st.fit(problem)
    status = {one.subject: one.status for one in fit.verdicts}
    first, second = paths[:2]
    assert {status[first], status[second], status[f"{first} and {second}"]} == {"not identified"}
    assert [one.text for one in fit.verdicts if one.subject == f"{first} and {second}"] == [words]
    assert all(status[path] != "not identified" for path in paths[2:])


@pytest.mark.slow
def test_what_a_straight_run_hardly_excites_is_told_before_the_fit_and_stays_at_its_start() -> None:
    run = _read(simulate(SHIP, Straight(N_P), duration=60.0, dt=0.2, name="straight"), 3)
    problem = Problem(SHIP, (run,), st.near(SHIP, "hull.N_rrr", "hull.R_0", ratio=0.5))
    told = {one.where: one.text for one in lint(problem)}
    assert told["hull.N_rrr"].startswith("hardly acts in these trials")
    assert "hull.R_0" not in told
    fit = st.fit(problem)
    assert fit.values[0] == SHIP.parameters["hull.N_rrr"]
    assert fit.verdicts[0].status == "not identified"

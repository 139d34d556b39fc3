"""Designs and distributions: a point is a function of seed and number; quantiles are those of the distribution."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from seatrial.campaign.designs import DESIGNS, Design, check_runs, points, uniform
from seatrial.campaign.inputs import Input, Kind
from seatrial.core.parameters import ParameterError

LEVELS = (4, 5, 6)


def runs_of(design: Design) -> int:
    return {"grid": math.prod(LEVELS), "saltelli": 24 * 5}.get(design, 128)


@pytest.mark.parametrize("design", DESIGNS)
def test_a_point_depends_on_its_number_alone(design: Design) -> None:
    runs = runs_of(design)
    whole = points(design, 7, 3, runs, 0, runs, LEVELS)
    cuts = [0, 1, 17, 63, runs]
    parts = [points(design, 7, 3, runs, a, b, LEVELS) for a, b in pairwise(cuts)]
    np.testing.assert_array_equal(np.vstack(parts), whole)
    assert whole.shape == (runs, 3)
    assert np.all((whole > 0) & (whole < 1))
    if design != "grid":
        assert not np.array_equal(points(design, 8, 3, runs, 0, runs), whole)


def test_random_points_are_uniform_and_independent() -> None:
    from scipy import stats

    found = uniform(3, 5, 0, 20000)
    assert min(stats.kstest(column, "uniform").pvalue for column in found.T) > 1e-3
    assert np.abs(np.corrcoef(found.T) - np.eye(5)).max() < 0.03
    assert abs(np.corrcoef(found[:-1, 0], found[1:, 0])[0, 1]) < 0.03


def test_a_saltelli_block_replaces_one_input_at_a_time() -> None:
    A, *mixed, B = points("saltelli", 1, 3, 50, 5, 10)
    for i, row in enumerate(mixed):
        assert row[i] == B[i]
        assert [row[k] == A[k] for k in range(3) if k != i] == [True, True]


def test_a_grid_has_every_combination_once() -> None:
    found = points("grid", 1, 3, 120, 0, 120, LEVELS)
    assert len({tuple(row) for row in found.tolist()}) == 120
    assert found[0, 2] != found[1, 2]


SHARE = (np.arange(20001) + 0.5) / 20001


@pytest.mark.parametrize(
    ("one", "law"),
    [
        (Input("uniform", (2.0, 5.0)), ("uniform", 2, 3)),
        (Input("normal", (1.0, 0.3)), ("norm", 1, 0.3)),
        (Input("lognormal", (2.0, 0.5)), ("lognorm", 0.5, 0, 2)),
        (Input("triangular", (1.0, 2.0, 4.0)), ("triang", 1 / 3, 1, 3)),
        (Input("normal", (0.0, 1.0), within=(-0.5, 2.0)), ("truncnorm", -0.5, 2.0)),
        (Input("normal", (0.0, 1.0), within=(9.0, 10.0)), ("truncnorm", 9.0, 10.0)),
    ],
)
def test_quantiles(one: Input, law: tuple[str, *tuple[float, ...]]) -> None:
    from scipy import stats

    name, *numbers = law
    np.testing.assert_allclose(one.of(SHARE), getattr(stats, name)(*numbers).ppf(SHARE), rtol=1e-9, atol=1e-12)


def test_a_choice_has_its_weights() -> None:
    found = Input("choice", (1.0, 2.0, 3.0), weights=(1.0, 0.0, 3.0)).of(SHARE)
    assert (np.mean(found == 1.0), np.mean(found == 2.0)) == (pytest.approx(0.25, abs=1e-4), 0.0)


@pytest.mark.parametrize(
    ("kind", "numbers", "said"),
    [("uniform", (2.0, 1.0), "rising"), ("normal", (1.0, -1.0), "above zero"), ("uniform", (1.0,), "2 numbers"),
     ("lognormal", (-1.0, 1.0), "median"),
     ("triangular", (0.0, 5.0, 2.0), "rising"), ("normal", (math.nan, 1.0), "finite")],
)  # fmt: skip
def test_numbers_that_are_no_distribution(kind: Kind, numbers: tuple[float, ...], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        Input(kind, numbers)


def test_numbers_of_runs_that_a_design_cannot_have() -> None:
    wrong: tuple[tuple[Design, int, str], ...] = (
        ("saltelli", 11, "multiple of 5"), ("grid", 7, "4 x 5 x 6"), ("random", 0, "1 or more"),
    )  # fmt: skip
    for design, runs, said in wrong:
        with pytest.raises(ParameterError, match=said):
            check_runs(design, 3, runs, LEVELS)


@pytest.mark.parametrize("design", ["random", "sobol", "latin-hypercube", "grid"])
def test_runs_of_which_nothing_is_drawn_have_no_columns(design: Design) -> None:
    assert points(design, 1, 0, 8, 2, 7).shape == (5, 0)

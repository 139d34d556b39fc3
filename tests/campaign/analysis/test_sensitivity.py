"""Shares of the variance: the function of Ishigami, whose shares are known, through our own order of runs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.campaign.analysis.sensitivity import given_data, saltelli
from seatrial.campaign.designs import points, uniform
from seatrial.campaign.inputs import Input
from seatrial.data import Array

NAMES = ("a", "b", "c")
A, B = 7.0, 0.1


def ishigami(x: Array) -> Array:
    return np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])


def known() -> tuple[list[float], list[float]]:
    """Shares of first and total order (Ishigami and Homma 1990)."""
    one = 0.5 * (1.0 + B * math.pi**4 / 5.0) ** 2
    two = A**2 / 8.0
    both = B**2 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    whole = one + two + both
    return [one / whole, two / whole, 0.0], [(one + both) / whole, two / whole, both / whole]


def sampled(design: str, runs: int) -> Array:
    cube = points(design, 3, 3, runs, 0, runs)  # type: ignore[arg-type]
    return Input("uniform", (-math.pi, math.pi)).of(cube)


@pytest.mark.slow
def test_the_shares_of_ishigami() -> None:
    pytest.importorskip("SALib")
    found = saltelli(NAMES, ishigami(sampled("saltelli", 4096 * 5)))
    assert found is not None
    assert (found.used, found.dropped) == (4096, 0)
    for one, first, total in zip(found.effects, *known(), strict=True):
        assert one.first == pytest.approx(first, abs=0.02)
        assert one.total == pytest.approx(total, abs=0.02)
        assert abs(one.first - first) < 1.5 * one.first_error + 1e-3
        assert 0.0 < one.total_error < 0.05


def test_the_order_of_runs_is_that_of_salib() -> None:
    sobol = pytest.importorskip("SALib.sample.sobol")
    problem = {"num_vars": 3, "names": list(NAMES), "bounds": [[0.0, 1.0]] * 3}
    theirs = sobol.sample(problem, 8, calc_second_order=False, seed=1).reshape(8, 5, 3)
    for block in (*theirs, *points("saltelli", 1, 3, 40, 0, 40).reshape(8, 5, 3)):
        for i in range(3):
            mixed = block[0].copy()
            mixed[i] = block[-1, i]
            np.testing.assert_array_equal(block[1 + i], mixed)


@pytest.mark.slow
def test_another_order_of_runs_gives_other_shares() -> None:
    pytest.importorskip("SALib")
    values = ishigami(sampled("saltelli", 4096 * 5)).reshape(-1, 5)
    found = saltelli(NAMES, np.roll(values, 1, axis=1).ravel())
    assert found is not None
    assert abs(found.effects[0].first - known()[0][0]) > 0.1


def test_a_block_without_one_of_its_runs_is_left_out_whole() -> None:
    pytest.importorskip("SALib")
    values = ishigami(sampled("saltelli", 1024 * 5))
    values[[7, 8, 5003]] = math.nan
    found = saltelli(NAMES, values)
    assert found is not None
    assert (found.used, found.dropped) == (1022, 2)
    assert found.effects[1].first == pytest.approx(known()[0][1], abs=0.05)


@pytest.mark.parametrize("design", ["random", "sobol", "latin-hypercube"])
def test_first_shares_of_any_runs(design: str) -> None:
    x = sampled(design, 20000)
    found = given_data(dict(zip(NAMES, x.T, strict=True)), ishigami(x))
    assert found is not None
    assert all(math.isnan(one.total) for one in found.effects)
    for one, first in zip(found.effects, known()[0], strict=True):
        assert abs(one.first - first) < max(2.0 * one.first_error, 0.01)
    # rising on the whole in the first input, even in the second: the correlation says nothing of it
    assert found.effects[0].rank > 0.3
    assert abs(found.effects[1].rank) < 0.03


@pytest.mark.slow
def test_an_input_without_effect_has_no_share_on_average() -> None:
    """Few runs a class make class means scatter; the share is not to grow from it."""
    shares = []
    for seed in range(60):
        x = uniform(seed, 2, 0, 300)
        found = given_data({"a": x[:, 0]}, x[:, 1])
        assert found is not None
        shares.append(found.effects[0].first)
    assert abs(np.mean(shares)) < 3.0 * np.std(shares) / math.sqrt(60)
    assert np.std(shares) < 0.05


def test_inputs_of_few_values_have_these_as_classes() -> None:
    x = uniform(1, 2, 0, 5000)
    choice = Input("choice", (1.0, 2.0, 5.0), (3.0, 1.0, 1.0)).of(x[:, 0])
    found = given_data({"choice": choice, "other": x[:, 1], "same": np.ones(5000)}, choice + 0.5 * x[:, 1])
    assert found is not None
    variance = [float(choice.var()), 0.25 / 12.0]
    assert found.effects[0].first == pytest.approx(variance[0] / sum(variance), abs=0.005)
    assert found.effects[1].first == pytest.approx(variance[1] / sum(variance), abs=0.01)
    assert (found.effects[2].first, found.effects[2].rank) == (0.0, 0.0)


def test_what_does_not_vary_has_no_shares() -> None:
    assert given_data({"a": uniform(1, 1, 0, 100)[:, 0]}, np.full(100, 3.0)) is None
    assert given_data({"a": uniform(1, 1, 0, 100)[:, 0]}, np.full(100, math.nan)) is None
    assert saltelli(NAMES, np.zeros(50)) is None

"""Forecasts put together: shares that are known are found, and bands hold what they state where they are fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seatrial.data import Array
from seatrial.identify.filters.ahead import CONSTANT_VELOCITY, MODEL, STAYING, Ahead, joined
from seatrial.identify.filters.stacking import Bands, Stack, banded, chosen, crossed

STATED = 0.9


def moored(seed: int, count: int = 400, spread: float = 0.05) -> Ahead:
    """Forecasts beside a berth (x = 0), where the ship makes 0.3 of the model's way, and out of it, where all."""
    rng = np.random.default_rng(seed)
    state, way = np.zeros((count, 6)), rng.normal(0.0, 1.0, (count, 3))
    state[:, 0] = rng.integers(0, 2, count)
    true = np.where(state[:, :1] > 0.5, 1.0, 0.3) * way + rng.normal(0.0, spread, (count, 3)) * (2.0 - state[:, :1])
    errors = {MODEL: way - true, STAYING: -true, CONSTANT_VELOCITY: 3.0 * rng.normal(0.0, 1.0, (count, 3)) - true}
    names = ("a",) * count
    return Ahead(
        10.0,
        names,
        np.arange(float(count), dtype=np.float64),
        errors,
        np.full((count, 3), spread),
        state,
        np.ones(count),
    )


def ones(some: Ahead) -> Array:
    return np.ones((len(some.trial), 1))


def by_place(some: Ahead) -> Array:
    return np.column_stack([np.ones(len(some.trial)), 1.0 - some.state[:, 0]])


def regime(some: Ahead) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    return some.state[:, 0].astype(np.intp)


def nowhere(some: Ahead) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    return np.zeros(len(some.trial), dtype=np.intp)


def test_the_share_of_the_way_in_the_berth_is_found() -> None:
    stack = Stack.fitted(moored(1), by_place)
    for of_model, of_constant in stack.shares:
        assert 1.0 + of_model[0] == pytest.approx(1.0, abs=0.03)
        assert 1.0 + of_model.sum() == pytest.approx(0.3, abs=0.03)
        assert of_constant == pytest.approx(np.zeros(2), abs=0.02)
    fresh = moored(2)
    assert stack.of(fresh).rms()[0] < 0.3 * fresh.rms()[0]
    assert stack.of(fresh).rms(STAYING) == fresh.rms(STAYING)


def test_one_share_for_all_is_worse_and_is_not_chosen() -> None:
    groups = [moored(seed, 150) for seed in range(3)]
    assert (
        Stack.fitted(groups[0], ones).of(groups[1]).rms()[0] > Stack.fitted(groups[0], by_place).of(groups[1]).rms()[0]
    )
    score = {name: joined(crossed(groups, found)).rms()[0] for name, found in (("ones", ones), ("place", by_place))}
    assert score["place"] < score["ones"] < joined(crossed(groups, None)).rms()[0]
    assert chosen([groups], {"none": None, "ones": ones, "place": by_place}, ("a",)) == "place"


def test_a_model_that_is_right_is_left_alone() -> None:
    rng = np.random.default_rng(5)
    some = moored(3)
    right = rng.normal(0.0, 0.01, (400, 3))
    some = replace(some, errors={**some.errors, MODEL: right})
    assert np.abs(Stack.fitted(some, by_place).shares).max() < 0.01


def test_what_is_crossed_has_not_seen_the_group_it_forecasts() -> None:
    groups = [moored(seed, 100) for seed in range(3)]
    moved = replace(groups[0], errors={who: 5.0 * e for who, e in groups[0].errors.items()})
    before, after = crossed(groups, by_place), crossed([moved, *groups[1:]], by_place)
    assert after[0].errors[MODEL] == pytest.approx(5.0 * before[0].errors[MODEL])
    assert np.abs(after[1].errors[MODEL] - before[1].errors[MODEL]).max() > 1e-6


def test_bands_by_regime_hold_in_each_and_one_factor_does_not() -> None:
    train, test = (Stack.fitted(moored(1), by_place).of(moored(seed, 2000)) for seed in (6, 7))
    each, one = (Bands.fitted(train, which, STATED) for which in (regime, nowhere))
    for k in (0.0, 1.0):
        berth = test._where(test.state[:, 0] == k)  # pyright: ignore[reportPrivateUsage]
        assert each.of(berth).covered(STATED) == pytest.approx((STATED, STATED), abs=0.03)
        assert max(abs(share - STATED) for share in one.of(berth).covered(STATED)) > 0.04
    alone = Bands.fitted(train, regime, STATED, alone=True).of(test)
    assert alone.covered(STATED) == pytest.approx((STATED, STATED), abs=0.02)
    assert joined([test, test]).covered(STATED) == test.covered(STATED)
    groups = [Stack.fitted(moored(1), by_place).of(moored(seed, 300)) for seed in range(8, 11)]
    assert banded([groups], {"one": (nowhere, False), "each": (regime, False)}, STATED) == "each"

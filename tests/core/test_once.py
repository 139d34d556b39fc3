"""Work on the same objects is done once, and anew for others, also where one takes the place of another in memory."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from seatrial.core.once import by_identity


def test_the_same_objects_are_asked_once_and_equal_ones_by_themselves() -> None:
    asked: list[float] = []

    @by_identity
    def total(a: np.ndarray, b: np.ndarray) -> float:
        asked.append(1.0)
        return float(a.sum() + 10.0 * b.sum())

    one, two = np.ones(3), np.ones(3)
    assert (total(one, two), total(one, two)) == (33.0, 33.0)
    assert len(asked) == 1
    assert total(two, one) == 33.0
    assert (total(one, two), len(asked)) == (33.0, 2), "another order is another question, and the first is kept"


def test_an_answer_goes_with_its_objects() -> None:
    @by_identity
    def first(a: np.ndarray) -> float:
        return float(a[0])

    for k in range(200):  # memory of one is that of the next
        assert first(np.full(4, float(k))) == k
    gc.collect()
    known = next(cell.cell_contents for cell in first.__closure__ or () if isinstance(cell.cell_contents, dict))
    assert not known


def test_numbers_and_texts_are_told_apart_by_value_and_names_of_arguments_count() -> None:
    asked: list[object] = []

    @by_identity
    def scaled(a: np.ndarray, by: float | None = None, how: str = "plus") -> float:
        asked.append((by, how))
        return float(a.sum() * (by or 1.0)) * (1.0 if how == "plus" else -1.0)

    one = np.ones(2)
    assert [scaled(one, 2.0), scaled(one, float("2")), scaled(one, 3.0), scaled(one, None)] == [4.0, 4.0, 6.0, 2.0]
    assert [scaled(one, by=2.0), *(scaled(one, by=2.0, how="minus") for _ in range(2))] == [4.0, -4.0, -4.0]
    assert asked == [(2.0, "plus"), (3.0, "plus"), (None, "plus"), (2.0, "plus"), (2.0, "minus")]
    assert scaled(np.ones(3), 2.0) == 6.0


def test_what_fails_is_asked_again() -> None:
    asked: list[int] = []

    @by_identity
    def fails(_: np.ndarray) -> float:
        asked.append(1)
        if len(asked) < 2:
            raise ValueError("not yet")
        return 1.0

    one = np.ones(2)
    with pytest.raises(ValueError, match="not yet"):
        fails(one)
    assert (fails(one), len(asked)) == (1.0, 2)


def test_an_answer_goes_with_any_of_its_objects() -> None:
    @by_identity
    def total(a: np.ndarray, b: np.ndarray) -> float:
        return float(a[0] + b[0])

    one = np.ones(4)
    for k in range(200):  # memory of one is that of the next
        assert total(one, np.full(4, float(k))) == k + 1.0
        assert total(np.full(4, float(k)), one) == k + 1.0

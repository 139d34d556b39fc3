"""Work on the same objects is done once, and anew for others, also where one takes the place of another in memory."""

from __future__ import annotations

import gc

import numpy as np

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
    assert len(asked) == 2, "another order is another question"


def test_an_answer_goes_with_its_objects() -> None:
    @by_identity
    def first(a: np.ndarray) -> float:
        return float(a[0])

    for k in range(200):  # memory of one is that of the next
        assert first(np.full(4, float(k))) == k
    gc.collect()
    known = next(cell.cell_contents for cell in first.__closure__ or () if isinstance(cell.cell_contents, dict))
    assert not known

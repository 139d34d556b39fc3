"""Fields: looked up by kernel and virtual machine alike, linear between nodes, held within a cell, the edge beyond."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from seatrial.engine import System
from seatrial.engine.field import Field
from seatrial.engine.rollout import simulator


def field() -> Field:
    """a = 2 x + 3 y, b = x y on a grid of 10 m; in one cell a row of 7 and 8."""
    x, y = np.meshgrid(np.arange(-20.0, 31.0, 10.0), np.arange(0.0, 41.0, 10.0), indexing="ij")
    which = np.zeros((5, 4), dtype=np.int64)
    which[2, 1] = 1
    return Field(("a", "b"), ("c", "d"), -20.0, 0.0, 10.0, np.stack([2 * x + 3 * y, x * y], axis=-1), which,
                 np.array([[0.0, 0.0], [7.0, 8.0]]))  # fmt: skip


def seen(places: Any, back_end: str) -> Any:
    """What the equations get at these places, as rates of four states."""

    def before(t: Any, dt: Any, z: Any, m: Any, s: Any, p: Any) -> Any:
        return s, (), s

    names = ("given", "a", "b", "c", "d")
    system = System(("x", "y"), names, (), lambda z, a, p: (0.0 * z[0], 0.0 * z[1]), acting=names,
                    logged=tuple(f"saw_{name}" for name in names), before=before, field=field())  # fmt: skip
    assert system.given == ("given",)
    rows = simulator(system, back_end=back_end).run(
        np.asarray(places, dtype=float), np.full((len(places), 1, 1), 5.0), np.zeros(0), dt=1.0, steps=2
    )
    return rows.values[:, 0, 2:]


@pytest.mark.parametrize("back_end", ["auto", "virtual"])
def test_a_field_is_linear_between_its_nodes_and_holds_in_a_cell(back_end: str) -> None:
    inner = np.vstack([np.random.default_rng(2).uniform((-20.0, 0.0), (30.0, 40.0), (37, 2)), [[3.0, 12.0]]])
    found = seen(inner, back_end)
    assert (found[:, 0] == 5.0).all()
    assert found[:, 1] == pytest.approx(2 * inner[:, 0] + 3 * inner[:, 1])
    assert found[:, 2] == pytest.approx(inner[:, 0] * inner[:, 1])  # bilinear itself
    there = (np.floor(inner[:, 0] / 10.0) == 0) & (np.floor(inner[:, 1] / 10.0) == 1)
    assert there.any()
    assert (found[there, 3:] == (7.0, 8.0)).all()
    assert not found[~there, 3:].any()


@pytest.mark.parametrize("back_end", ["auto", "virtual"])
def test_beyond_the_grid_its_edge_holds(back_end: str) -> None:
    found = seen([[-500.0, 20.0], [1e6, -1e6], [30.0, 40.0]], back_end)
    assert found[:, 1] == pytest.approx([2 * -20.0 + 60.0, 60.0, 180.0])


def test_series_are_those_given_from_outside() -> None:
    names = ("given", "a", "b", "c", "d")
    system = System(("x", "y"), names, (), lambda z, a, p: (z[0], z[1]), acting=names,
                    before=lambda t, dt, z, m, s, p: (s, (), ()), field=field())  # fmt: skip
    compiled = simulator(system)
    with pytest.raises(ValueError, match="the system takes given"):
        compiled.run(np.zeros((1, 2)), np.zeros((1, 1, 5)), np.zeros(0), dt=1.0, steps=2)


def test_a_field_that_does_not_fit_is_refused() -> None:
    good = field()
    for table, sets in ((good.table[:1], good.sets), (good.table[..., :1], good.sets), (good.table, good.sets + 1.0)):
        with pytest.raises(ValueError, match="field"):
            Field(good.names, good.near, 0.0, 0.0, 1.0, table, good.which, sets)

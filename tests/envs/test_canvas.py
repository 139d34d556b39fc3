"""Pictures of an episode by geometry: where lines and hulls are, which way they point, what is cut off."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gymnasium")

from seatrial.envs.picture import SIZE, Canvas, Painter
from seatrial.envs.tasks import Scale

SHIP = Scale(80.0, 12.0, 5.0, 4.0)
PER = 400.0 / (14.0 * 80.0)  # pixels a metre
RED, BLUE, GREY, ORANGE = (255, 0, 0), (0, 107, 164), (150, 165, 175), (217, 95, 2)


def drawn(canvas: Any, colour: tuple[int, int, int]) -> Any:
    """North and east of the pixels of a colour, from the middle of the picture [m]."""
    row, column = np.nonzero((canvas == colour).all(axis=2))
    return (199.5 - row) / PER, (column - 199.5) / PER


def test_a_line_joins_its_points_and_is_cut_at_the_edge() -> None:
    canvas = Canvas(SHIP, 1000.0, -500.0)
    canvas.line(((1100.0, -500.0), (1100.0, -300.0), (900.0, -300.0)), RED)
    north, east = drawn(canvas.pixels, RED)
    at_top = np.abs(north - 100.0) < 2.0 / PER
    assert (east[at_top].min(), east[at_top].max()) == pytest.approx((0.0, 200.0), abs=2.0 / PER)
    assert np.unique(np.floor(east[at_top] * PER)).size == round(200.0 * PER) + 1  # without a gap
    assert (north[~at_top].min(), north[~at_top].max()) == pytest.approx((-100.0, 100.0), abs=3.0 / PER)
    assert east[~at_top] == pytest.approx(200.0, abs=1.0 / PER)
    wide = Canvas(SHIP, 0.0, 0.0)
    wide.line(((-900.0, 0.0), (900.0, 0.0)), RED, 3)
    north, east = drawn(wide.pixels, RED)
    assert np.unique(np.floor(east * PER)).size == 3
    far = Canvas(SHIP, 0.0, 0.0)
    far.line(((700.0, -500.0), (700.0, 500.0)), RED)
    assert drawn(far.pixels, RED)[0].size == 0


@pytest.mark.parametrize("psi", [0.0, 0.6, 2.0, -2.5])
def test_a_hull_has_its_area_its_place_and_its_bow_ahead(psi: float) -> None:
    """The outline is a rectangle of three quarters of the length and a triangle of the rest."""
    big = Scale(80.0, 40.0, 5.0, 4.0)
    canvas = Canvas(big, 10.0, 20.0)
    canvas.ship(110.0, -80.0, psi)
    north, east = drawn(canvas.pixels, BLUE)
    area = 0.75 * 80.0 * 40.0 + 0.5 * 0.25 * 80.0 * 40.0
    assert north.size / PER**2 == pytest.approx(area, rel=0.06)
    ahead = (north - 100.0) * math.cos(psi) + (east + 100.0) * math.sin(psi)
    aside = (east + 100.0) * math.cos(psi) - (north - 100.0) * math.sin(psi)
    assert (ahead.min(), ahead.max()) == pytest.approx((-40.0, 40.0), abs=2.0 / PER)
    assert (aside.min(), aside.max()) == pytest.approx((-20.0, 20.0), abs=2.0 / PER)
    # of the rectangle and the triangle, whose centre is a third of its height from its base
    centre = (0.75 * 0.5 * (0.25 - 0.5) + 0.125 * (0.25 + 0.25 / 3)) / 0.875 * 80.0
    assert ahead.mean() == pytest.approx(centre, abs=1.0)
    assert aside.mean() == pytest.approx(0.0, abs=1.0)


def test_a_picture_has_the_track_of_its_episode_alone_and_what_is_asked_for() -> None:
    class Asked:
        def guide(self, scale: Scale, goal: Any, x: float, y: float) -> Any:
            return (((x, y + goal[0]), (x + 200.0, y + goal[0])),)

    painter = Painter(Asked(), SHIP)
    painter.see(300.0, 300.0)
    painter.see(300.0, 400.0)
    painter.begin()
    for x in (-300.0, -100.0):
        painter.see(x, 0.0)
    pixels = painter.picture(0.0, 0.0, 0.0, (250.0,))
    assert pixels.shape == (SIZE, SIZE, 3)
    north, east = drawn(pixels, GREY)
    assert (north.min(), north.max()) == pytest.approx((-300.0, -100.0), abs=3.0 / PER)
    assert np.abs(east).max() < 3.0 / PER
    north, east = drawn(pixels, ORANGE)
    assert (north.min(), north.max()) == pytest.approx((0.0, 200.0), abs=3.0 / PER)
    assert east == pytest.approx(250.0, abs=3.0 / PER)
    bare = Painter(object(), SHIP)
    assert drawn(bare.picture(0.0, 0.0, 0.0, ()), ORANGE)[0].size == 0
    for k in range(4100):
        bare.see(float(k), 0.0)
    assert len(bare._track) == 4000

"""Charts, grids and fenders against brute force: points along lines, crossings of rays, integrals, counts of cells."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import ChartError
from seatrial.environment import CALM, CHANNELS, RANGES, Charted, Environment, Uniform, through_water, to_body, to_earth
from seatrial.environment.chart import Area, Bank, Chart, Quay, crosses, inside, nearest, offshore, sides, spaced
from seatrial.environment.fenders import CURVES, Curve, Fender
from seatrial.environment.grid import _NONE, SMOOTH, Size, Stop, Wall, grid_of, suction

SHIP = Size(100.0, 20.0, 6.0)
Array = np.ndarray


def zigzag(count: int, seed: int = 2) -> Array:
    """A line that does not cross itself, with long and short sides."""
    draw = np.random.default_rng(seed)
    return np.column_stack([draw.uniform(-60.0, 60.0, count), np.cumsum(draw.uniform(2.0, 40.0, count)) - 8.0 * count])


def along(line: Array, every: float = 0.05) -> Array:
    """Points of a line, close together."""
    return np.concatenate(
        [p + (q - p) * np.linspace(0.0, 1.0, int(np.hypot(*(q - p)) / every) + 2)[:, None] for p, q in pairwise(line)]
    )


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(40,), (5, 8), (20, 40)])
def test_the_nearest_point_of_a_line_is_that_of_all_its_points(shape: tuple[int, ...]) -> None:
    line, draw = zigzag(9), np.random.default_rng(5)
    north, east = draw.uniform(-150.0, 150.0, shape), draw.uniform(-150.0, 300.0, shape)
    if len(shape) == 2:  # a grid, which is looked at tile by tile
        rows, columns = np.linspace(-150.0, 150.0, shape[0]), np.linspace(-90.0, 90.0, shape[1])
        north, east = np.meshgrid(rows, columns, indexing="ij")
    off, x, y = nearest(line, north, east)
    points = along(line)
    for k in np.ndindex(*shape):
        apart = points - [north[k], east[k]]
        best = apart[np.hypot(*apart.T).argmin()]
        assert off[k] == pytest.approx(np.hypot(*best), abs=0.05)
        assert np.hypot(x[k], y[k]) == pytest.approx(1.0)
        assert (off[k] * x[k], off[k] * y[k]) == pytest.approx(tuple(best), abs=1.0)
    signed = offshore(line, north, east)
    np.testing.assert_allclose(np.abs(signed), off, atol=1e-9)
    assert offshore(line[::-1].copy(), north, east) == pytest.approx(-signed)


def test_a_place_on_the_line_has_no_way_to_it_and_water_is_to_starboard() -> None:
    line = np.array([[0.0, 0.0], [10.0, 0.0]])  # northwards: the east is to starboard
    off, x, y = nearest(line, np.array([3.0]), np.array([0.0]))
    assert (off[0], x[0], y[0]) == (0.0, 0.0, 0.0)
    north, east = np.array([5.0, 5.0, 13.0, -3.0]), np.array([2.0, -2.0, 4.0, 4.0])
    assert offshore(line, north, east) == pytest.approx([2.0, -2.0, 5.0, 5.0])
    # at a corner the side that is seen more squarely has the say: a right angle to starboard, seen from within
    corner = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    assert offshore(corner, np.array([9.0, 14.0, 11.0]), np.array([1.0, -3.0, 5.0])) == pytest.approx([1.0, -5.0, -1.0])
    _, unit, length = sides(np.array([[1.0, 2.0], [4.0, 6.0]]))
    assert (unit[0].tolist(), length.tolist()) == ([0.6, 0.8], [5.0])


def winds(outline: Array, p: Array) -> bool:
    """Whether a polygon goes round a point: the sum of the angles under which its sides are seen."""
    a = outline - p
    angles = np.arctan2(a[:, 1], a[:, 0])
    turns = np.mod(np.diff(np.append(angles, angles[0])) + math.pi, math.tau) - math.pi
    return abs(turns.sum()) > 3.0


@pytest.mark.parametrize("corners", [7, 60])
def test_a_place_is_within_a_polygon_that_goes_round_it(corners: int) -> None:
    """Also by rows, as an outline of many sides is filled on a grid."""
    draw = np.random.default_rng(corners)
    angle = np.sort(draw.uniform(0.0, math.tau, corners))
    far = draw.uniform(20.0, 100.0, corners)
    outline = np.column_stack([far * np.cos(angle), far * np.sin(angle)])
    N, E = np.meshgrid(np.linspace(-95.3, 97.1, 23), np.linspace(-96.7, 99.2, 31), indexing="ij")
    wanted = np.array([winds(outline, np.array(p)) for p in zip(N.ravel(), E.ravel(), strict=True)]).reshape(N.shape)
    assert wanted.any()
    assert not wanted.all()
    np.testing.assert_array_equal(inside(outline, N, E), wanted)
    np.testing.assert_array_equal(inside(outline, N.ravel(), E.ravel()), wanted.ravel())
    np.testing.assert_array_equal(inside(outline, N.T, E.T), wanted.T)


@pytest.mark.parametrize("count", [4, 70, 150])
def test_sides_that_cross_are_found_wherever_they_are(count: int) -> None:
    line = zigzag(count)
    assert crosses(line) is None
    for first, last in ((0, count - 2), (count // 2 - 1, count - 2), (0, 2)):
        bent = line.copy()
        middle = 0.5 * (line[first] + line[first + 1])
        way = line[first + 1] - line[first]
        across = np.array([-way[1], way[0]]) * 1e-3
        bent = np.insert(line, last + 1, [middle + across, middle - across], axis=0)
        a, b = crosses(bent) or (0, 0)
        p, q, r, s = bent[a - 1], bent[a], bent[b - 1], bent[b]
        at = np.linalg.solve(np.column_stack([q - p, r - s]), r - p)
        assert ((at > 0.0) & (at < 1.0)).all()
        assert b > a + 1


def test_posts_are_evenly_along_each_side_and_look_into_the_water() -> None:
    points, normals = spaced(np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 1.0]]), 2.0)
    assert points.tolist() == pytest.approx(np.array([[1.125 + 2.25 * k, 0.0] for k in range(4)] + [[9.0, 0.5]]))
    assert normals.tolist() == [[0.0, 1.0]] * 4 + [[-1.0, 0.0]]
    assert len(Quay(np.array([[0.0, 0.0], [9.0, 0.0]]), bollards=3.0).posts()) == 3
    assert Quay(np.array([[0.0, 0.0], [9.0, 0.0]])).posts().shape == (0, 2)


# --- charts ---

LINE = np.array([[0.0, 0.0], [100.0, 0.0]])


def test_the_depth_is_that_of_the_last_area_or_of_a_slope_and_the_extent_that_of_all() -> None:
    square = np.array([[0.0, 0.0], [0.0, 50.0], [50.0, 50.0], [50.0, 0.0]])
    bank = Bank(np.array([[-80.0, -10.0], [90.0, -10.0]]), 0.5)
    fairway = np.array([[0.0, 0.0], [10.0, 70.0]])
    chart = Chart("a", 30.0, (Area(square, 9.0), Area(0.5 * square, 4.0)), (bank,), fairways=(fairway,))
    found = chart.depth_at(np.array([10.0, 40.0, 80.0, 80.0, 10.0]), np.array([10.0, 40.0, 10.0, -4.0, -11.0]))
    assert found == pytest.approx([4.0, 9.0, 10.0, 3.0, 0.0])
    assert chart.extent == (-80.0, 90.0, -10.0, 70.0)
    wall = Chart("a", 30.0, banks=(Bank(LINE),))
    assert wall.depth_at(np.array([50.0, 50.0]), np.array([0.1, -0.1])) == pytest.approx([30.0, 0.0])
    with pytest.raises(ChartError, match="empty"):
        _ = Chart("a").extent


@pytest.mark.parametrize(("make", "about"), [
    (lambda: Chart("a", -0.5), "a depth of -0.5 m"), (lambda: Chart("a", 5.0, (Area(LINE, -1.0),)), "a depth of -1 m"),
    (lambda: Chart("a", banks=(Bank(LINE), Bank(LINE, 0.0))), "bank 2 has a slope of 0"),
    (lambda: Chart("a", quays=(Quay(LINE), Quay(LINE[:1]))), "quay 2 needs two points"),
    (lambda: Chart("a", quays=(Quay(np.repeat(LINE, 2, axis=0)),)), "no two alike"),
    (lambda: Chart("a", fairways=(np.zeros((200_001, 2)),)), "200001 points; 200000 are the most"),
    (lambda: Chart("a", quays=(Quay(LINE, bollards=0.0499),)), "bollards 0.0499 m apart"),
    (lambda: Chart("a", quays=(Quay(LINE, Fender(CURVES["cone"], 1.0, 1e6, 0.0499)),)), "fenders 0.0499 m apart"),
])  # fmt: skip
def test_charts_that_cannot_be(make: Any, about: str) -> None:
    with pytest.raises(ChartError, match=about):
        make()


def test_charts_at_the_bounds_can_be() -> None:
    assert Chart("a", fairways=(np.zeros((5000, 2)),)).fairways[0].shape == (5000, 2)
    (quay,) = Chart("a", quays=(Quay(LINE, Fender(CURVES["cone"], 1.0, 1e6, 0.0501), bollards=0.0501),)).quays
    assert quay.fender is not None
    assert (quay.fender.spacing, quay.bollards) == (0.0501, 0.0501)


# --- fenders ---


@pytest.mark.parametrize("name", CURVES)
def test_the_energy_of_a_fender_is_the_integral_of_its_reaction(name: str) -> None:
    curve = CURVES[name]
    s = np.linspace(0.0, curve.deflections[-1] * 1.1, 1101)
    force, energy = (np.array(one) for one in zip(*(curve.both(float(x)) for x in s), strict=True))
    inner = s <= curve.deflections[-1]
    np.testing.assert_allclose(force[inner], np.interp(s[inner], curve.deflections, curve.reactions), atol=1e-12)
    np.testing.assert_allclose(energy[1:], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(s)), atol=2e-5)
    (a, b), (low, high) = curve.deflections[-2:], curve.reactions[-2:]
    assert force[-1] == pytest.approx(high + (high - low) / (b - a) * 0.1 * b)  # on along the last branch
    fender = Fender(curve, 2.0, 1e6, 10.0)
    assert fender.energy == pytest.approx(float(np.interp(curve.rated, s, energy)) * 2e6, rel=1e-4)
    steepest = max((h - g) / (q - p) for (p, q), (g, h) in
                   zip(pairwise(curve.deflections), pairwise(curve.reactions), strict=True))  # fmt: skip
    assert curve.stiffest == pytest.approx(steepest)


@pytest.mark.parametrize(("s", "R", "about"), [
    ((0.0, 0.5), (0.0,), "as many reactions"), ((0.0,), (0.0,), "as many"), ((0.1, 0.5), (0.0, 1.0), "from 0"),
    ((0.0, 0.5), (0.1, 1.0), "from 0"), ((0.0, 0.5, 0.5), (0.0, 1.0, 1.1), "deflections rise"),
    ((0.0, 0.5), (0.0, 0.0), "never pulls"), ((0.0, 0.5, 0.6), (0.0, 1.0, 1.0), "falls at its end"),
])  # fmt: skip
def test_curves_that_cannot_be(s: Any, R: Any, about: str) -> None:
    with pytest.raises(ChartError, match=about):
        Curve(s, R)


@pytest.mark.parametrize("wrong", [{"height": 0.0}, {"reaction": -1.0}, {"spacing": 0.0}, {"mu": -0.1}, {"chi": -0.1},
                                   {"height": 1e12}])  # fmt: skip
def test_fenders_that_cannot_be(wrong: dict[str, float]) -> None:
    with pytest.raises(ChartError, match=next(iter(wrong))):
        Fender(**{"curve": CURVES["cone"], "height": 1.0, "reaction": 1e6, "spacing": 10.0, **wrong})  # type: ignore
    Fender(CURVES["cone"], 1.0, 1e6, 10.0, 0.0, 0.0)


# --- grids ---


def at(grid: Any, north: float, east: float) -> dict[str, float]:
    row = grid.field.look(np.array([north]), np.array([east]))[0][0]
    return dict(zip(SMOOTH, row, strict=False))


def test_a_grid_reaches_a_length_about_the_chart_with_cells_of_a_quarter_breadth() -> None:
    grid = grid_of(Chart("a", 10.0, fairways=(LINE,)), SHIP)
    field = grid.field
    assert field.cell == 5.0  # .25 B; .02 L is less
    assert (field.north, field.east) == (-100.0, -100.0)
    assert grid_of(Chart("a", 10.0, fairways=(LINE,)), Size(400.0, 20.0, 6.0)).field.cell == 8.0  # .02 L
    assert (grid.curve, grid.stiffness, grid.bare, grid.stops, grid.walls) == (CURVES["linear"], 0.0, False, 0, 0)
    assert at(grid, 50.0, 0.0)["chart.quay"] == _NONE
    assert at(grid, 50.0, 0.0)["chart.per_depth"] == pytest.approx(0.1)


@pytest.mark.slow
def test_dry_land_is_a_decimetre_deep_and_the_quay_no_nearer_than_half_the_breadth() -> None:
    chart = Chart("a", 10.0, banks=(Bank(np.array([[-300.0, -60.0], [300.0, -60.0]])),),
                  quays=(Quay(np.array([[300.0, 60.0], [-300.0, 60.0]])),))  # fmt: skip
    grid = grid_of(chart, SHIP)
    assert at(grid, 0.0, -80.0)["chart.per_depth"] == pytest.approx(10.0)
    assert at(grid, 0.0, 55.0)["chart.quay"] == pytest.approx(10.0)
    assert at(grid, 0.0, 20.0)["chart.quay"] == pytest.approx(40.0)
    assert (at(grid, 0.0, 20.0)["chart.quay_x"], at(grid, 0.0, 20.0)["chart.quay_y"]) == pytest.approx((0.0, 1.0))
    # of two quays the nearer one: the other is at 200 m in the north
    two = Chart("a", 10.0, quays=(*chart.quays, Quay(np.array([[200.0, -300.0], [200.0, 300.0]]))))
    assert at(grid_of(two, SHIP), 190.0, -100.0)["chart.quay_x"] == pytest.approx(1.0)
    assert at(grid_of(two, SHIP), 0.0, 0.0)["chart.quay_y"] == pytest.approx(1.0)


@pytest.mark.slow
def test_suction_of_walls_is_that_of_each_and_none_of_a_deck_on_piles() -> None:
    """Midway between two walls it vanishes; nearer than half of breadth and draught it grows no more."""
    wall = np.array([[900.0, 80.0], [-900.0, 80.0]])
    closed, open_ = (grid_of(Chart("a", 10.0, quays=(Quay(wall, closed=one),)), SHIP) for one in (True, False))
    assert at(open_, 0.0, 0.0)["chart.bank_y"] == 0.0
    for east, away in ((0.0, 80.0), (40.0, 40.0), (70.0, 13.0), (75.0, 13.0)):
        wanted = float(suction(np.array(away), np.array(10.0), SHIP.L))
        assert at(closed, 0.0, east)["chart.bank_y"] == pytest.approx(wanted, rel=1e-6)
    both = Chart("a", 10.0, quays=(Quay(wall), Quay(wall[::-1] * [1.0, -1.0])))
    assert at(grid_of(both, SHIP), 0.0, 0.0)["chart.bank_y"] == pytest.approx(0.0, abs=1e-12)
    shallow = grid_of(Chart("a", 6.05, quays=(Quay(wall),)), SHIP)  # no shallower than 1.02 of the draught
    assert at(shallow, 0.0, 0.0)["chart.bank_y"] == pytest.approx(float(suction(np.array(80.0), np.array(6.12), 100.0)))


@pytest.mark.slow
def test_each_cell_holds_the_stops_and_walls_that_a_hull_in_it_may_reach() -> None:
    """All fenders and sides within half a diagonal of the hull and a fender's height, and none far off."""
    line = np.array([[0.0, 0.0], [120.0, 0.0], [160.0, 40.0]])
    fender = Fender(CURVES["cone"], 1.5, 2e6, 12.0, mu=0.3, chi=0.1)
    grid = grid_of(Chart("a", 10.0, quays=(Quay(line, fender),)), SHIP)
    points, _ = spaced(line, 12.0)
    begin, draw = len(SMOOTH), np.random.default_rng(3)
    least, most = 0.5 * math.hypot(100.0, 20.0) + 1.5, 0.5 * math.hypot(100.0, 20.0) + 1.5 + 2.0 * grid.field.cell
    for north, east in draw.uniform(-90.0, 200.0, (40, 2)):
        if east > 130.0:
            continue
        row = grid.field.look(np.array([north]), np.array([east]))[0][0][begin:]
        held = [Stop(*one) for one in row[: grid.stops * 6].reshape(-1, 6) if one.any()]
        off = {tuple(np.round(p, 6)): float(np.hypot(*(p - [north, east]))) for p in points}
        got = {(round(one.north, 6), round(one.east, 6)) for one in held}
        assert {p for p, far in off.items() if far <= least} <= got
        assert all(off[p] <= most for p in got)
        assert {(one.height, one.reaction, one.mu, one.chi) for one in held} <= {(1.5, 2e6, 0.3, 0.1)}
        walls = [Wall(*one) for one in row[grid.stops * 6 :].reshape(-1, 5) if one.any()]
        for start, way, length in zip(*sides(line), strict=True):
            far = float(nearest(np.array([start, start + length * way]), np.array([north]), np.array([east]))[0][0])
            there = any(np.allclose(one, [*start, *way, length]) for one in walls)
            assert there or far > least - 1.5
            assert not there or far < most
    assert grid.stiffness == pytest.approx(2e6 / 1.5 * 0.27 / 0.05 * 100.0 / 12.0)
    assert not grid.bare


def test_the_corners_of_a_bare_wall_are_as_stiff_as_it_is() -> None:
    grid = grid_of(Chart("a", 10.0, quays=(Quay(LINE),)), SHIP, hard=3e7)
    row = grid.field.look(np.array([50.0]), np.array([-5.0]))[0][0][len(SMOOTH) :]
    stops = sorted(Stop(*one) for one in row[: grid.stops * 6].reshape(-1, 6))
    assert [(one.north, one.east) for one in stops] == [(0.0, 0.0), (100.0, 0.0)]
    for one in stops:
        assert (one.height, one.mu, one.chi) == (0.5, 0.3, 0.0)
        assert one.reaction / one.height * grid.curve.both(1e-6)[0] / 1e-6 == pytest.approx(3e7)
    assert (grid.bare, grid.walls) == (True, 1)
    assert Wall(*row[grid.stops * 6 :]) == (0.0, 0.0, 1.0, 0.0, 100.0)


def test_a_cell_holds_a_hundred_fenders_at_most() -> None:
    """From the middle of a cell 20 m wide and 10 m off, 51 + 15 + 1 m of reach are 132.5 m of the quay."""
    for spacing, good in ((1.38, True), (1.27, False)):
        fender = Fender(CURVES["cone"], 1.0, 1e6, spacing)
        chart = Chart("a", 10.0, quays=(Quay(np.array([[500.0, 0.0], [0.0, 0.0]]), fender),))
        if good:
            assert grid_of(chart, SHIP, cell=20.0).stops in (96, 97)
        else:
            with pytest.raises(ChartError, match="over 100 fenders"):
                grid_of(chart, SHIP, cell=20.0)


# --- channels ---


def test_vectors_turn_into_the_ship_and_back_as_complex_numbers_do() -> None:
    for psi in (0.0, 0.7, -2.0, 4.0):
        c, s = math.cos(psi), math.sin(psi)
        north, east = to_earth(3.0, -1.5, c, s)
        assert complex(north, east) == pytest.approx(complex(3.0, -1.5) * complex(c, s))
        assert to_body(north, east, c, s) == pytest.approx((3.0, -1.5))
        u, v = through_water(3.0, -1.5, 0.4, 0.2, c, s)
        assert complex(u, v) == pytest.approx(complex(3.0, -1.5) - complex(0.4, 0.2) * complex(c, -s))


def test_steady_weather_has_each_channel_in_its_place() -> None:
    found = Uniform(10.0, 0.3, 1.5, -0.4, 3.0, 8.0, 2.0, 25.0).series(0.1, 5)
    assert found.shape == (1, len(CHANNELS))
    wind, current, waves = (size * np.exp(1j * way) for size, way in ((10.0, 0.3), (1.5, -0.4), (3.0, 2.0)))
    wanted = [wind.real, wind.imag, current.real, current.imag, waves.real, waves.imag, 8.0, 0.04]
    assert found[0] == pytest.approx(wanted)
    assert (RANGES["gamma_T"].low, RANGES["gamma_T"].high) == pytest.approx((-4.0 * math.pi, 4.0 * math.pi))
    for name, (low, high) in {"U_T": (0, 150), "U_C": (0, 15), "H_S": (0, 40), "T_W": (0, 100)}.items():
        assert (RANGES[name].low, RANGES[name].high) == (low, high)


def test_without_a_word_it_is_calm_and_open_water() -> None:
    assert Environment() == CALM == (0.0,) * 8
    assert Charted() == (0.0,) * 18
    assert Uniform().now() == CALM

"""Contact: what a fender takes of a ship, no energy out of nothing, no way through, no creep; lines that pull only."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import ChartError
from seatrial.engine import Kicks, System
from seatrial.engine.field import Field
from seatrial.engine.rollout import simulator
from seatrial.environment.fenders import CURVES, Curve, Fender
from seatrial.environment.grid import Stop, Wall
from seatrial.harbour.contact import Contact, Line, distance, outline

L, B, M = 170.0, 26.4, 39.0e6
MASS = (M, 1.84 * M, 1.84 * M * 43.57**2)
"""The ship of the appendix of PIANC WG33: surge, sway with added mass, and yaw with K = 43.57 m."""
BOX = ((-0.5 * L, 0.0), (-0.5 * L, 0.5 * B), (0.5 * L, 0.5 * B), (0.5 * L, 0.0))


def push(force: Any) -> Any:
    return tuple(f / m for f, m in zip(force, MASS, strict=True))


def floating(contact: Contact, sets: Any, substeps: int = 1) -> System:
    """A ship without water: mass, a steady force [N] north and east, and contact; logs energy and compression."""
    near = tuple(f"near_{k}" for k in range(len(sets)))
    field = Field((), near, -1e4, -1e4, 2e4, np.zeros((2, 2, 0)), np.array([[1]]), np.array([[0.0] * len(near), sets]))

    def derivative(state: Any, acting: Any, parameters: Any) -> Any:
        _, _, psi, u, v, r = state
        import casadi as ca

        c, s = ca.cos(psi), ca.sin(psi)
        north, east = parameters
        X, Y = north * c + east * s, east * c - north * s
        return u * c - v * s, u * s + v * c, r, X / MASS[0], Y / MASS[1], 0.0

    def before(t: Any, dt: Any, state: Any, memory: Any, series: Any, parameters: Any) -> Any:
        touches, _, stored = contact.elastic(state, series)
        deepest = 0.0
        for touch in touches:
            import casadi as ca

            deepest = ca.fmax(deepest, touch.delta)
        return series, (), (stored, deepest)

    return System(
        ("x", "y", "psi", "u", "v", "r"), near, ("north", "east"), derivative, acting=near,
        logged=("stored", "deepest"), before=before, field=field,
        kicks=Kicks(contact.touched, lambda h, z, k, a, t, p: contact.first(h, z, k, a, t, push),
                    lambda h, z, e, a, t, p: contact.last(h, z, e, a, t, push), contact.size, substeps),
    )  # fmt: skip


def energy(rows: Any) -> Any:
    """Kinetic and stored energy of each row [J]."""
    return 0.5 * sum(m * rows[..., 3 + k] ** 2 for k, m in enumerate(MASS)) + rows[..., 6]


def run(
    system: System, start: Any, dt: float, seconds: float, every: int = 1, back_end: str = "auto",
    wind: tuple[float, float] = (0.0, 0.0),
) -> Any:  # fmt: skip
    start = np.atleast_2d(np.asarray(start, dtype=float))
    done = simulator(system, back_end=back_end).run(
        start, np.zeros((len(start), 1, 0)), np.array(wind), dt=dt, steps=round(seconds / dt) + 1, every=every
    )
    assert not done.failures
    return done.values


def test_a_frictionless_fender_takes_what_theory_says() -> None:
    """One end of the ship meets two fenders at 6 cm/s: K^2/(K^2 + x^2) of its energy, as by an independent run."""
    stop = Stop(0.25 * L, 0.5 * B + 1.051, 1.05, 1426.8e3, 0.0, 0.0)
    system = floating(Contact(BOX, CURVES["cone72"], 1, 0, 1e8), stop)
    rows = run(system, [0.0, 0.0, 0.0, 0.0, 0.06, 0.0], 0.02, 14.0)[0]
    K2, lever = 43.57**2, 0.25 * L
    assert rows[:, 6].max() / energy(rows)[0] == pytest.approx(K2 / (K2 + lever**2), abs=1e-4)
    assert energy(rows)[0] == pytest.approx(129.2e3, rel=1e-3)
    assert rows[:, 7].max() == pytest.approx(0.158, abs=5e-4)
    assert rows[-1, 4] == pytest.approx(-0.00149, abs=5e-5)  # there the force stays square to the quay
    assert math.degrees(rows[-1, 5]) == pytest.approx(-0.0789, abs=1e-4)
    assert (rows[:, 7] > 0.0).sum() * 0.02 == pytest.approx(8.30, abs=0.05)
    assert energy(rows)[-1] == pytest.approx(energy(rows)[0], rel=1e-4)


@pytest.mark.slow
def test_the_back_ends_agree() -> None:
    stop = Stop(0.25 * L, 0.5 * B + 1.051, 1.05, 1426.8e3, 0.2, 2.0)
    system = floating(Contact(BOX, CURVES["cone72"], 1, 0, 1e8), stop)
    start = [[0.0, 0.0, 0.02, 0.01, 0.1, 0.001], [0.0, -0.5, -0.1, 0.2, 0.3, 0.0]]
    fast, slow = (run(system, start, 0.1, 10.0, back_end=name) for name in ("auto", "virtual"))
    assert np.abs(fast - slow).max() <= 1e-9 * np.abs(fast).max()


QUAY = [Wall(200.0, 0.0, -1.0, 0.0, 400.0)]
"""A face from north to south along east = 0, the water to the west of it."""
FENDERS = [Stop(float(k), 0.0, 1.0, 700e3, 0.2, 0.0) for k in (-60, 0, 60)]


def impacts(count: int) -> Any:
    """Ships off the quay that come at up to 1 m/s, 30 deg, turning."""
    rng = np.random.default_rng(3)
    psi = rng.uniform(-1.0, 1.0, count) * math.pi / 6.0
    speed, way = rng.uniform(0.02, 1.0, count), rng.uniform(-1.0, 1.0, count) * math.pi / 6.0
    c, s = np.cos(psi), np.sin(psi)
    north, east = speed * np.sin(way), speed * np.cos(way)
    y = -1.5 - 0.5 * (np.abs(s) * L + c * B)
    return np.column_stack([rng.uniform(-30, 30, count), y, psi, north * c + east * s, east * c - north * s,
                            rng.uniform(-0.002, 0.002, count)])  # fmt: skip


def harbour(mu: float, chi: float, substeps: int) -> System:
    stops = [stop._replace(mu=mu, chi=chi) for stop in FENDERS]
    sets = [value for one in (*stops, *QUAY) for value in one]
    return floating(Contact(outline(L, B), CURVES["cone"], len(stops), len(QUAY), 4.0 * M), sets, substeps)


@pytest.mark.slow
@pytest.mark.parametrize(("mu", "chi"), [(0.0, 0.0), (0.2, 2.0)])
@pytest.mark.parametrize("count", [200, pytest.param(10_000, marks=pytest.mark.long)])
def test_no_impact_gains_energy_or_passes_through(count: int, mu: float, chi: float) -> None:
    """Kinetic and stored energy never rise, by 1e-9 of the first; no corner gets through the wall."""
    rows = run(harbour(mu, chi, 5), impacts(count), 0.1, 120.0)
    whole = energy(rows)
    assert (np.diff(whole, axis=1).max(axis=1) <= 1e-9 * whole[:, 0]).all()
    touched = rows[..., 7].max(axis=1) > 0.0
    assert touched.mean() > 0.95
    assert rows[..., 7].max() < 2.5  # of five metres of wall
    if mu:
        assert (whole[touched, -1] < whole[touched, 0]).all()


@pytest.mark.slow
def test_lanes_do_not_see_their_neighbours() -> None:
    """Bit by bit the same alone, in a block with ships far off, and in another place of it."""
    system, start = harbour(0.2, 2.0, 5), impacts(40)
    start[::3, 1] -= 500.0
    together = run(system, start, 0.1, 20.0)
    assert (run(system, start[::-1], 0.1, 20.0)[::-1] == together).all()
    for k in (0, 1, 17, 39):
        assert (run(system, start[k : k + 1], 0.1, 20.0)[0] == together[k]).all()


@pytest.mark.slow
def test_a_ship_pressed_on_its_fenders_by_wind_does_not_creep() -> None:
    """Ten minutes under a force on the quay and one along it, within friction: a millimetre."""
    start = [0.0, -0.5 * B - 0.95, 0.0, 0.0, 0.0, 0.0]
    rows = run(harbour(0.3, 5.0, 5), start, 0.1, 2400.0, every=100, wind=(60e3, 400e3))[0]
    moved = np.abs(rows[-60:, :2] - rows[-1, :2]).max(axis=0)
    assert moved[0] < 1e-3
    assert moved[1] < 1e-3
    assert rows[-1, 7] > 0.01


@pytest.mark.slow
def test_friction_lets_go_beyond_its_limit() -> None:
    """Along the quay with more than mu times the pressure the ship slides away."""
    start = [0.0, -0.5 * B - 0.95, 0.0, 0.0, 0.0, 0.0]
    rows = run(harbour(0.1, 5.0, 5), start, 0.1, 300.0, every=10, wind=(80e3, 400e3))[0]
    assert rows[-1, 0] == pytest.approx(0.5 * (80e3 - 0.1 * 400e3) / M * 300.0**2, rel=0.1)


def test_distance_from_a_hull() -> None:
    half = outline(100.0, 20.0)
    gap, a, b, n_a, n_b = distance(half, 10.0, -15.0)
    assert (gap, a, b, n_a, n_b) == pytest.approx((5.0, 10.0, -10.0, 0.0, -1.0))
    assert distance(half, 55.0, 0.0)[0] == pytest.approx(5.0)
    assert distance(half, 0.0, 4.0)[0] == pytest.approx(-6.0)
    rng = np.random.default_rng(1)
    for a, b in rng.uniform(-80.0, 80.0, (200, 2)).tolist():
        gap, at_a, at_b, n_a, n_b = distance(half, a, b)
        assert math.hypot(n_a, n_b) == pytest.approx(1.0, abs=1e-6)
        assert (at_a + gap * n_a, at_b + gap * n_b) == pytest.approx((a, b), abs=1e-6)
        mirrored = distance(half, a, -b)
        assert mirrored == pytest.approx((gap, at_a, -at_b, n_a, -n_b))


HALVES = (
    outline(100.0, 20.0), ((-50.0, 0.0), (-50.0, 10.0), (50.0, 10.0), (50.0, 0.0)),  # a ship, a pontoon
    ((-50.0, 0.0), (-50.0, 12.0), (50.0, 0.0)), ((-50.0, 0.0), (40.0, 12.0), (50.0, 0.0)),  # widest at an end
    ((-50.0, 0.0), (-50.0, 12.0), (50.0, 5.0), (50.0, 0.0)), ((-50.0, 0.0), (-20.0, 9.0), (0.0, 12.0), (50.0, 0.0)),
)  # fmt: skip


@pytest.mark.parametrize("half", HALVES)
def test_the_distance_is_that_to_the_nearest_of_all_sides(half: tuple[tuple[float, float], ...]) -> None:
    """Along the sides from the widest point, as by trying every side; on the outline itself it is zero."""
    rng = np.random.default_rng(2)
    corners = np.array([*half, *((a, -b) for a, b in reversed(half))])
    from_, to = corners, np.roll(corners, -1, axis=0)
    for a, b in [*rng.uniform((-80.0, -30.0), (80.0, 30.0), (300, 2)), *(0.5 * (from_ + to)), *corners]:
        sides = to - from_
        length = np.maximum((sides**2).sum(axis=1), 1e-12)
        t = np.clip(((np.array([a, b]) - from_) * sides).sum(axis=1) / length, 0.0, 1.0)
        far = np.hypot(*(np.array([a, b]) - from_ - t[:, None] * sides).T).min()
        gap = distance(half, float(a), float(b))[0]
        assert abs(gap) == pytest.approx(far, abs=1e-6)
        turned = [(x - a) * (y_2 - b) - (x_2 - a) * (y - b) for (x, y), (x_2, y_2) in zip(from_, to, strict=True)]
        inside = max(turned) <= 1e-9 or min(turned) >= -1e-9
        assert gap <= 1e-6 if inside else gap >= -1e-6


def test_a_line_pulls_and_never_pushes_and_its_energy_is_its_work() -> None:
    line = Line(50.0, 20.0, 40.0, 8.0, 15.0, 2e6, holds=2e5)
    slack = line.pull(0.0, 0.0, 1.0, 0.0)
    assert line.pull(4.0, 5.0, 1.0, 0.0)[:2] == (0.0, 0.0)
    assert slack[0] == pytest.approx(min(2e6 / 15.0 * (math.hypot(10.0, 12.0) - 15.0), 2e5))
    for x in np.linspace(-8.0, 4.0, 13):
        h = 1e-4
        low, high = (line.pull(x + k * h, 0.3, math.cos(0.2), math.sin(0.2)) for k in (-1.0, 1.0))
        T, _, a, b = line.pull(x, 0.3, math.cos(0.2), math.sin(0.2))
        north = T * (a * math.cos(0.2) - b * math.sin(0.2))
        assert -(high[1] - low[1]) / (2 * h) == pytest.approx(north, rel=1e-4, abs=1.0)
    assert line.pull(-30.0, 0.0, 1.0, 0.0)[0] == pytest.approx(2e5)


def test_fender_curves() -> None:
    """The energy is the integral of the reaction: .5245 and .5581 of rated reaction times height."""
    assert CURVES["cone"].both(0.70)[1] == pytest.approx(0.5245, abs=1e-4)
    assert CURVES["cone72"].both(0.72)[1] == pytest.approx(0.5581, abs=1e-4)
    for curve in CURVES.values():
        for s, R in zip(curve.deflections, curve.reactions, strict=True):
            assert curve.both(s)[0] == pytest.approx(R, abs=1e-12)
        end = curve.deflections[-1]
        assert curve.both(1.1 * end)[0] > curve.both(end)[0] > curve.both(0.99 * end)[0]
    assert CURVES["cone"].both(-0.1) == (0.0, 0.0)
    assert Fender(CURVES["cone"], 2.0, 1e6, 20.0).energy == pytest.approx(0.5245 * 2e6, rel=1e-3)


@pytest.mark.parametrize(
    ("deflections", "reactions", "about"),
    [((0.0, 0.5, 0.4), (0.0, 1.0, 2.0), "falls: deflection"), ((0.0, 0.5, 0.7), (0.0, 1.0, 0.8), "falls at its end"),
     ((0.0, 0.5, 0.7), (0.0, -1.0, 0.8), "falls to -1"), ((0.1, 0.5), (0.0, 1.0), "from 0 and 0 on")],
)  # fmt: skip
def test_a_curve_that_falls_is_refused(deflections: Any, reactions: Any, about: str) -> None:
    with pytest.raises(ChartError, match=about) as error:
        Curve(deflections, reactions)
    assert "\n" not in str(error.value)


SHIP = outline(100.0, 20.0)
BERTH = [
    Stop(5.0, 12.0, 1.6, 5e5, 0.3, 4.0), Stop(-42.0, 11.0, 1.2, 8e5, 0.2, 0.0), Stop(53.0, -3.0, 2.0, 3e5, 0.0, 9.0)
]  # fmt: skip
FACES = [Wall(60.0, 5.0, -math.cos(0.1), math.sin(0.1), 70.0), Wall(-30.0, -4.0, math.cos(0.3), math.sin(0.3), 40.0)]
MOORED = (Line(80.0, 30.0, 45.0, 4.0, 30.0, 2e6), Line(-60.0, 25.0, -45.0, 8.0, 24.0, 3e6, holds=1e5))
NEAR = tuple(value for one in (*BERTH, *FACES) for value in one)
MOOR = Contact(SHIP, CURVES["cone"], len(BERTH), len(FACES), 3e5, MOORED)
COUPLED = np.array([[4e6, 0.0, 0.0], [0.0, 7e6, 3e7], [0.0, 3e7, 6e9]])
"""Mass of a ship whose sway and yaw are coupled, about midship."""


def coupled(force: Any) -> Any:
    return tuple(np.linalg.solve(COUPLED, np.array(force)).tolist())


def kinetic(v: Any) -> float:
    return 0.5 * float(np.array(v) @ COUPLED @ np.array(v))


def poses(count: int) -> Any:
    """Ships that lie in the berth, athwart at most, drawn."""
    rng = np.random.default_rng(11)
    return rng.uniform((-6.0, -6.0, -0.3), (6.0, 6.0, 0.3), (count, 3)).tolist()


def placed(pose: Any, a: float, b: float) -> tuple[float, float]:
    """Where a point of the ship is, north and east [m]."""
    x, y, psi = pose
    return x + a * math.cos(psi) - b * math.sin(psi), y + a * math.sin(psi) + b * math.cos(psi)


@pytest.mark.parametrize("part", ["fenders", "walls", "lines", pytest.param("all", marks=pytest.mark.slow)])
def test_what_is_elastic_is_the_slope_of_what_it_stores(part: str) -> None:
    """X, Y, N are -dP/dx, -dP/dy, -dP/dpsi of each kind of contact by itself and of all together."""
    stops, walls = (BERTH if part in ("fenders", "all") else []), (FACES if part in ("walls", "all") else [])
    contact = Contact(SHIP, CURVES["cone"], len(stops), len(walls), 3e5, MOORED if part in ("lines", "all") else ())
    near, acting = tuple(value for one in (*stops, *walls) for value in one), 0
    for pose in poses(40):
        force, h = contact.elastic(pose, near)[1], 1e-6
        slopes = []
        for k in range(3):
            low, high = (contact.elastic([p + s * h * (i == k) for i, p in enumerate(pose)], near)[2] for s in (-1, 1))
            slopes.append(-(high - low) / (2.0 * h))
        north, east, N = slopes
        c, s = math.cos(pose[2]), math.sin(pose[2])
        wanted = (north * c + east * s, east * c - north * s, N)
        assert force == pytest.approx(wanted, rel=1e-4, abs=1e-5 * sum(map(abs, wanted)) + 1.0)
        acting += contact.elastic(pose, near)[2] > 0.0
    assert acting >= 15


def test_a_corner_is_pushed_out_of_a_wall_by_the_shortest_way() -> None:
    """How deep each corner of both sides is, and its energy, by the four faces of the block as lines on the chart."""
    contact, deep = Contact(SHIP, CURVES["linear"], 0, len(FACES), 3e5), 0
    corners = [(a, b) for a, b in SHIP] + [(a, -b) for a, b in SHIP if b]
    assert len(corners) == 10
    assert sum(b < 0.0 for _, b in corners) == 4
    for pose in poses(100):
        found = sorted(touch.delta for touch in contact.touches(pose, [v for one in FACES for v in one]))
        wanted = []
        for wall in FACES:
            start, way = np.array([wall.north, wall.east]), np.array([wall.along_x, wall.along_y])
            port = np.array([way[1], -way[0]])  # the land lies to port of the direction
            faces = ((start, port), (start, way), (start + wall.length * way, -way), (start + 5.0 * port, -port))
            for a, b in corners:
                depth = min(float((np.array(placed(pose, a, b)) - at) @ inwards) for at, inwards in faces)
                wanted.append(max(depth, 0.0))
        assert found == pytest.approx(sorted(wanted), abs=1e-9)
        assert contact.elastic(pose, [v for one in FACES for v in one])[2] == pytest.approx(
            sum(0.5 * 3e5 * d * d for d in wanted), rel=1e-9
        )
        deep += sum(d > 0.0 for d in wanted)
    assert deep > 50


def test_a_fender_is_compressed_by_what_it_lacks_of_the_nearest_point() -> None:
    """Compression, place and reaction of a fender off the midship body; the push is square to the side."""
    for b, side in ((11.0, 1.0), (-11.2, -1.0)):
        stop = Stop(*placed((3.0, -2.0, 0.4), 7.0, b), 2.0, 5e5, 0.3, 4.0)
        (touch,) = Contact(SHIP, CURVES["linear"], 1, 0, 1e5).touches((3.0, -2.0, 0.4), stop)
        delta = 2.0 - (abs(b) - 10.0)
        assert (touch.delta, touch.R, touch.E) == pytest.approx((delta, 5e5 * delta / 2.0, 5e5 * delta**2 / 4.0))
        assert (touch.a, touch.b, touch.n_a, touch.n_b) == pytest.approx((7.0, 10.0 * side, 0.0, -side), abs=1e-9)
        assert touch.pressed.across == pytest.approx((0.0, -side, -7.0 * side), abs=1e-9)
        assert touch.pressed.along == pytest.approx((side, 0.0, -10.0), abs=1e-9)


def moving(count: int) -> Any:
    """Poses in the berth, each with velocities."""
    rng = np.random.default_rng(12)
    speeds = rng.uniform((-0.5, -0.5, -0.01), (0.5, 0.5, 0.01), (count, 3)).tolist()
    return zip(poses(count), speeds, strict=True)


def test_half_an_impulse_gives_the_momentum_of_its_force_and_tells_what_it_gave() -> None:
    """Without friction: M dv is half a step of the force, and what is kept is what is stored less the energy given."""
    h, smooth = 0.4, tuple(v for one in (*(s._replace(mu=0.0, chi=0.0) for s in BERTH), *FACES) for v in one)
    for pose, v in moving(30):
        touched = MOOR.touched(pose, smooth)
        *after, kept = MOOR.first(h, (*pose, *v, 7.0), (0.3,) * 7, smooth, touched, coupled)
        assert (after[:3], after[6]) == (pose, 7.0)
        gained = COUPLED @ (np.array(after[3:6]) - v)
        assert gained == pytest.approx(0.5 * h * np.array(touched[:3]), rel=1e-9, abs=1.0)
        assert kept == pytest.approx(touched[3] - (kinetic(after[3:6]) - kinetic(v)), rel=1e-9, abs=1.0)


def test_a_step_ends_with_no_more_energy_than_was_left_to_it() -> None:
    """Kinetic and stored energy together end at what was there, or below where less is there without a correction."""
    h, smooth = 0.4, tuple(v for one in (*(s._replace(mu=0.0, chi=0.0) for s in BERTH), *FACES) for v in one)
    corrected = 0
    for pose, v in moving(30):
        touched = MOOR.touched(pose, smooth)
        free = np.array(v) + np.linalg.solve(COUPLED, 0.5 * h * np.array(touched[:3]))
        for share in (0.8, 1.2):
            left = kinetic(free) * share + touched[3]
            kept = left - kinetic(v)  # before the impulse the ship has its energy of motion
            *after, tail = MOOR.last(h, (*pose, *v, 7.0), kept, smooth, touched, coupled)
            assert (after[:3], tail) == (pose, 7.0)
            assert kinetic(after[3:6]) + touched[3] == pytest.approx(min(left, kinetic(free) + touched[3]), rel=1e-9)
            assert np.cross(after[3:6], free) == pytest.approx(0.0, abs=1e-9)
            corrected += share < 1.0
    assert corrected == 30


def alone(a: float, b: float, mu: float, chi: float) -> tuple[Contact, Stop]:
    """One fender that presses at a point of the side of a ship at the origin."""
    return Contact(SHIP, CURVES["linear"], 1, 0, 1e5), Stop(a, b + math.copysign(0.5, b), 1.5, 4e5, mu, chi)


@pytest.mark.parametrize(("a", "b"), [(20.0, 10.0), (-30.0, -10.0)])
def test_friction_stops_the_sliding_or_takes_its_limit_and_looks_half_a_step_ahead(a: float, b: float) -> None:
    """At the point of contact, about midship: sticking, no sliding is left; slipping, an impulse of mu R h/2."""
    h, rates = 0.2, (0.0, 0.0, 0.0, 0.02, -0.01, 1e-4)
    for mu, sticks in ((100.0, True), (0.01, False)):
        contact, stop = alone(a, b, mu, 0.0)
        touched = contact.touched((0.0, 0.0, 0.0), stop)
        X, Y, N = touched[:3]
        pressed = -math.copysign(4e5 / 1.5, b)
        assert touched[:3] == pytest.approx((0.0, pressed, pressed * a), abs=1.0)
        v = np.array([0.1, 0.2, 0.003])
        *after, _ = contact.first(h, (0.0, 0.0, 0.0, *v), rates, stop, touched, coupled)
        friction = COUPLED @ (np.array(after[3:6]) - v) - 0.5 * h * np.array([X, Y, N])
        assert friction == pytest.approx(friction[0] * np.array([1.0, 0.0, -b]), abs=1e-2)
        ahead = np.array(after[3:6]) + 0.5 * h * np.array(rates[3:])
        if sticks:
            assert ahead[0] - b * ahead[2] == pytest.approx(0.0, abs=1e-12)
        else:
            assert friction[0] == pytest.approx(-math.copysign(0.5 * h * mu * abs(Y), v[0] - b * v[2]))
        (*after,) = contact.last(h, (0.0, 0.0, 0.0, *v), 1e12, stop, touched, coupled)  # with nothing ahead
        friction = COUPLED @ (np.array(after[3:6]) - v) - 0.5 * h * np.array([X, Y, N])
        if sticks:
            assert after[3] - b * after[5] == pytest.approx(0.0, abs=1e-12)
        else:
            assert friction[0] == pytest.approx(-math.copysign(0.5 * h * mu * abs(Y), v[0] - b * v[2]))


@pytest.mark.parametrize(("a", "b"), [(20.0, 10.0), (-30.0, -10.0)])
def test_rubber_takes_its_share_of_the_closing_speed_and_never_pulls(a: float, b: float) -> None:
    """Hunt and Crossley: R chi times the closing speed at the end of the step; opening, at most what R gives."""
    h, chi = 0.3, 8.0
    contact, stop = alone(a, b, 0.0, chi)
    touched = contact.touched((0.0, 0.0, 0.0), stop)
    Y = touched[1]
    for closing in (0.3, -0.3):
        v = np.array([0.1, math.copysign(closing, b * closing), 0.0])
        free = v + np.linalg.solve(COUPLED, 0.5 * h * np.array(touched[:3]))
        (*after,) = contact.last(h, (0.0, 0.0, 0.0, *v), 1e12, stop, touched, coupled)
        lost = COUPLED @ (np.array(after[3:6]) - free)
        assert lost == pytest.approx(lost[1] * np.array([0.0, 1.0, a]), abs=1e-2)
        speed = math.copysign(1.0, b) * (after[4] + a * after[5])
        wanted = max(h * chi * abs(Y) * speed, -h * abs(Y))
        assert lost[1] == pytest.approx(-math.copysign(1.0, b) * wanted, rel=1e-9)


def test_a_ship_has_its_usual_outline() -> None:
    """Full breadth amidships, narrower at the ends; the area by the trapezoids."""
    half = np.array(outline(200.0, 30.0))
    assert (half.min(axis=0).tolist(), half.max(axis=0).tolist()) == ([-100.0, 0.0], [100.0, 15.0])
    assert 2.0 * np.trapezoid(half[:, 1], half[:, 0]) == pytest.approx(0.9012 * 200.0 * 30.0, rel=1e-3)


@pytest.mark.parametrize(("along", "way"), [(0.4, -1.0), (69.7, 1.0)])
def test_a_corner_near_the_end_of_a_wall_is_pushed_out_past_that_end(along: float, way: float) -> None:
    """The force is along the face, away from its middle, whatever the heading; the moment is that of the corner."""
    face = FACES[0]
    ahead, port = np.array([face.along_x, face.along_y]), np.array([face.along_y, -face.along_x])
    corner = np.array([face.north, face.east]) + along * ahead + 2.0 * port
    a, b = SHIP[1]
    for psi in (0.2, 2.5):
        c, s = math.cos(psi), math.sin(psi)
        pose = (*(corner - (a * c - b * s, a * s + b * c)), psi)
        touches = [touch for touch in Contact(SHIP, CURVES["linear"], 0, 1, 3e5).touches(pose, face) if touch.R > 0.0]
        (touch,) = [touch for touch in touches if (touch.a, touch.b) == (a, b)]
        north, east = touch.n_a * c - touch.n_b * s, touch.n_a * s + touch.n_b * c
        assert (north, east) == pytest.approx(tuple(way * ahead), abs=1e-9)
        assert touch.force[2] == pytest.approx(touch.R * (a * touch.n_b - b * touch.n_a))

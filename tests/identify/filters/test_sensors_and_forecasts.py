"""Readings by geometry, and forecasts, shares and bands against sums by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.environment import Environment
from seatrial.identify import StudyError
from seatrial.identify.filters.ahead import (
    CONSTANT_VELOCITY,
    MODEL,
    STAYING,
    Ahead,
    _blind,
    _errors,
    _row,
    _surprise,
    joined,
)
from seatrial.identify.filters.filtering import begin
from seatrial.identify.filters.forecast import forecasts
from seatrial.identify.filters.kalman import over, substeps
from seatrial.identify.filters.measurement import Antenna, Heading, Log, Rate, Track
from seatrial.identify.filters.stacking import Bands, Stack, interval_score
from seatrial.manoeuvres.turning import Turning
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate

STILL = Environment(*[0.0] * len(Environment._fields))
STATE = (10.0, 20.0, 0.5, 1.5, -0.3, 0.04)


def test_an_instrument_reads_where_it_stands() -> None:
    x, y, psi, u, v_m, r = STATE
    ahead, side = np.array([math.cos(psi), math.sin(psi)]), np.array([-math.sin(psi), math.cos(psi)])
    place = np.array([x, y]) + 3.0 * ahead - 2.0 * side
    assert Antenna(0.1, x=3.0, y=-2.0).read(STATE, STILL) == pytest.approx(tuple(place))
    # by the derivative of the place of the antenna
    way = u * ahead + v_m * side + r * (3.0 * side + 2.0 * ahead)
    assert Track(0.1, x=3.0, y=-2.0).read(STATE, STILL) == pytest.approx(tuple(way))
    assert Heading(0.1).read(STATE, STILL) == (psi,)
    assert Rate(0.1).read(STATE, STILL) == (r,)
    current = STILL._replace(current_x=0.2, current_y=-0.1)
    assert Log(0.1, y=1.5, water=False).read(STATE, current) == pytest.approx((u - 1.5 * r,))
    drift = 0.2 * math.cos(psi) - 0.1 * math.sin(psi)
    assert Log(0.1, y=1.5).read(STATE, current) == pytest.approx((u - 1.5 * r - drift,))
    assert [one.angle for one in (Antenna(1.0), Heading(1.0), Rate(1.0), Log(1.0))] == [False, True, False, False]
    assert {one(1.0).delay for one in (Antenna, Heading, Rate, Log, Track)} == {0.0}
    assert (Antenna(1.0).x, Antenna(1.0).y, Log(1.0).y, Log(1.0).water) == (0.0, 0.0, 0.0, True)


@pytest.mark.parametrize("make", [lambda: Rate(0.0), lambda: Heading(-1.0), lambda: Log(math.nan),
                                  lambda: Track(1.0, delay=-0.1), lambda: Antenna(1.0, channels=("x",))])  # fmt: skip
def test_instruments_that_cannot_be_are_refused(make: Any) -> None:
    with pytest.raises(StudyError):
        make()


def test_steps_of_a_filter_are_none_longer_than_stated() -> None:
    for span, step, count in ((1.0, 0.25, 4), (1.0, 0.3, 4), (0.1, 0.3, 1), (0.30000000001, 0.1, 3), (0.0, 0.1, 1)):
        assert substeps(span, step) == count


def test_a_product_with_an_inverse_covariance_has_no_unit() -> None:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(4, 4)) * [[1e-6], [1.0], [1e3], [1.0]]
    b, spread = rng.normal(size=(3, 4)), root @ root.T
    np.testing.assert_allclose(over(b, spread) @ spread, b, rtol=1e-4)
    dead = np.diag([4.0, 0.0])
    assert over(np.array([[2.0, 0.0]]), dead)[0] == pytest.approx([0.5, 0.0])


# One forecast after another


@pytest.mark.slow
def test_a_forecast_holds_the_current_and_the_numbers_known_at_its_start() -> None:
    ship = load("kvlcc2_l7")
    run = simulate(ship, Turning(10.4, 0.3), duration=60.0, dt=0.5)
    growing = run.having(U_C=0.02 * run.t, gamma_C=0.01 * run.t)
    psi = run["psi"] + np.where(run.t > 30, 2.0 * math.pi, 0.0) + 0.02
    source = Trial("log", run.t, {"x": run["x"] + 0.3, "y": run["y"] - 0.4, "psi": psi})
    walked = np.linspace(-0.3, -0.1, len(run))
    found: Any = SimpleNamespace(smooth=False, t=run.t, trial=lambda: growing, free=(Free("hull.Y_v", -0.3),),
                                 names=("x", "hull.Y_v"), states=np.column_stack([run["x"], walked]), ship=ship,
                                 source=source)  # fmt: skip
    far = forecasts(found, 20.0, every=10.0, begin=10.0)
    assert far.starts.tolist() == [10.0, 20.0, 30.0]
    for start, position, heading, end in zip(far.starts, far.position, far.heading, far.end, strict=True):
        k = round(2 * start)
        rows = slice(k, k + 41)
        window = run.rows(rows)
        held = window.having(U_C=0.02 * start + 0.0 * window.t, gamma_C=0.01 * start + 0.0 * window.t)
        guess = replay(ship.having({"hull.Y_v": float(walked[k])}), held)
        off = np.hypot(guess["x"] - run["x"][rows] - 0.3, guess["y"] - run["y"][rows] + 0.4)
        turned = guess["psi"] - run["psi"][rows] - 0.02
        assert position == pytest.approx(math.sqrt(np.mean(off[1:] ** 2)), rel=1e-9)
        assert heading == pytest.approx(math.sqrt(np.mean(turned[1:] ** 2)), rel=1e-9)
        assert end == pytest.approx(off[-1], rel=1e-9)
    assert far.rms() == pytest.approx(tuple(math.sqrt(np.mean(v**2)) for v in (far.position, far.heading, far.end)))


def ahead(seed: int = 0, count: int = 400) -> Ahead:
    rng = np.random.default_rng(seed)
    errors = {who: rng.normal(size=(count, 3)) * [3.0, 3.0, 0.2] for who in (MODEL, STAYING, CONSTANT_VELOCITY)}
    names = tuple("ab"[k % 2] + str(k) for k in range(count))
    return Ahead(10.0, names, np.arange(count) * 1.0, errors, np.tile([2.0, 4.0, 0.1], (count, 1)),
                 rng.normal(size=(count, 6)), rng.random(count))


def test_errors_are_pooled_and_held_against_the_better_rival() -> None:
    some = ahead()
    place = {who: math.sqrt(np.mean(e[:, 0] ** 2 + e[:, 1] ** 2)) for who, e in some.errors.items()}
    turn = {who: math.sqrt(np.mean(e[:, 2] ** 2)) for who, e in some.errors.items()}
    assert some.rms() == pytest.approx((place[MODEL], turn[MODEL]))
    assert some.ratio() == pytest.approx((place[MODEL] / min(place[STAYING], place[CONSTANT_VELOCITY]),
                                          turn[MODEL] / min(turn[STAYING], turn[CONSTANT_VELOCITY])))
    assert np.array_equal(some.north, some.errors[MODEL][:, 0])
    assert np.array_equal(some.east, some.errors[MODEL][:, 1])
    z = np.abs(some.errors[MODEL]) / (1.5 * some.sigma)
    inside = z <= stats.norm.ppf(0.95)
    assert some.covered(0.9, 1.5) == pytest.approx((inside[:, :2].mean(), inside[:, 2].mean()))
    part = some.of("a")
    assert len(part.trial) == 200
    assert np.array_equal(part.start, some.start[::2])
    both = joined([part, some.of("b")])
    assert np.array_equal(both.errors[MODEL], np.concatenate([some.errors[MODEL][::2], some.errors[MODEL][1::2]]))
    assert np.array_equal(both.surprise, np.concatenate([some.surprise[::2], some.surprise[1::2]]))


def test_shares_are_least_squares_on_the_ways_of_model_and_rival() -> None:
    """Truth is half of the model's way north and east, and all of constant velocity's turn."""
    rng = np.random.default_rng(1)
    count = 3000
    way, other = rng.normal(size=(count, 3)), rng.normal(size=(count, 3))
    true = np.column_stack([0.5 * way[:, :2], other[:, 2]])
    errors = {MODEL: way - true, STAYING: -true, CONSTANT_VELOCITY: other - true}
    some = replace(ahead(count=count), errors=errors)
    stack = Stack.fitted(some, lambda one: np.ones((len(one.start), 1)))
    # what is added to the model: of its own way, and of the other's; drawn to zero by a hundredth
    np.testing.assert_allclose(stack.shares[0, :, 0], [-0.5 / 1.01, 0.0], atol=5e-3)
    np.testing.assert_allclose(stack.shares[1, :, 0], [-1.0 / 1.01, 1.0 / 1.01], atol=5e-3)
    found = stack.of(some).errors[MODEL]
    assert np.abs(found).max() < 0.08
    assert np.array_equal(stack.of(some).errors[STAYING], errors[STAYING])


def test_bands_hold_their_share_by_regime() -> None:
    some = ahead(count=4000)
    regime = lambda one: (one.start >= 2000).astype(int)  # noqa: E731
    wide = replace(some, errors={**some.errors, MODEL: some.errors[MODEL] * np.where(some.start >= 2000, 2.0, 1.0)[:,
        None]})
    for alone in (False, True):
        bands = Bands.fitted(wide, regime, 0.8, alone=alone)
        size = np.abs(wide.errors[MODEL]) / (1.0 if alone else wide.sigma)
        for k, rows in enumerate((slice(None, 2000), slice(2000, None))):
            for target, part in enumerate((slice(0, 2), slice(2, 3))):
                wanted = np.quantile(size[rows, part], 0.8) / stats.norm.ppf(0.9)
                assert bands.scale[k, target] == pytest.approx(wanted)
        held = bands.of(wide)
        assert held.covered(0.8) == pytest.approx((0.8, 0.8), abs=1e-3)
        factor = bands.scale[0, [0, 0, 1]]
        np.testing.assert_allclose(held.sigma[5], factor if alone else factor * wide.sigma[5])
    few = Bands.fitted(wide, lambda one: np.full(len(one.start), 1), 0.8)
    assert few.scale.shape == (2, 2)
    np.testing.assert_allclose(few.scale[0], few.scale[1])


def test_the_interval_score_is_width_and_what_lies_outside() -> None:
    one = replace(ahead(count=1), errors={MODEL: np.array([[5.0, 0.0, 0.3]])}, sigma=np.array([[1.0, 2.0, 0.1]]))
    z = stats.norm.ppf(0.95)
    place = 0.5 * (2 * z + 20.0 * (5.0 - z) + 4 * z)
    assert interval_score(one, 0.9) == pytest.approx((place, 0.2 * z + 20.0 * (0.3 - 0.1 * z)))
    # least for the bands that hold their share
    many = ahead(count=20_000)
    scores = [interval_score(replace(many, sigma=np.tile([s, s, 0.2], (20_000, 1))), 0.9)[0] for s in (2.5, 3.0, 3.5)]
    assert min(scores) == scores[1]


def test_a_forecast_is_held_against_the_rows_of_its_horizon() -> None:
    t = np.arange(0.0, 20.0, 0.5)
    part = Trial("a", t, {"x": 2.0 * t, "y": -1.0 * t, "psi": 0.1 * t})
    read = np.column_stack([part["x"], part["y"], part["psi"]])
    states = read + np.array([0.3, -0.2, 0.05])
    states[:, 2] += 2.0 * math.pi
    covs = np.tile(np.diag([0.04, 0.09, 0.01, 1.0, 1.0, 1.0]), (len(t), 1, 1))
    found: Any = SimpleNamespace(states=np.hstack([states, states]), covariances=covs)
    settings: Any = SimpleNamespace(measurement={"gnss": Antenna(0.5), "compass": Heading(0.1)})
    read[:10] += 100.0  # more than a second before the start: no part of the slope
    out = _errors(part, read, found, 12, [16, 20], settings)
    np.testing.assert_allclose(out[:, 0], [[0.3, -0.2, 0.05]] * 2, atol=1e-9)
    np.testing.assert_allclose(out[0, 1], read[12] - read[16])
    np.testing.assert_allclose(out[:, 2], 0.0, atol=1e-9)
    np.testing.assert_allclose(out[:, 3], [[0.04 + 0.25, 0.09 + 0.25, 0.01 + 0.01]] * 2)
    assert (_row(part, 6.0, 2.0), _row(part, 6.1, 2.0)) == (16, 16)
    blind = _blind(part, 12)
    assert np.isfinite(blind["x"]).sum() == 13
    assert np.isnan(blind["psi"][13:]).all()


def test_surprise_is_the_innovation_per_reading_of_the_last_seconds() -> None:
    t = np.arange(0.0, 31.0)
    innovations = np.ones((31, 3))
    innovations[25, 1:] = math.nan
    found: Any = SimpleNamespace(innovation_t=t, nis=np.where(t > 20, 6.0, 99.0), innovations=innovations)
    assert _surprise(found, 30.0) == pytest.approx(10 * 6.0 / 28)
    assert _surprise(found, 200.0) == 0.0


@pytest.mark.parametrize(("delay", "silent"), [(0.0, 0), (0.6, 0), (0.0, 3), (0.6, 3)])
def test_a_ship_that_turns_steadily_begins_where_it_was_though_its_instruments_are_late_and_silent_at_first(
    delay: float, silent: int
) -> None:
    ship, dt, r, U = load("kvlcc2_l7"), 0.2, 0.05, 1.5
    t = 7.0 + dt * np.arange(40)
    then = t - 7.0 - delay  # what the instruments show is so old
    psi, heard = 0.8 + r * then, np.where(np.arange(40) < silent, np.nan, 1.0)
    place = np.array([U * math.cos(0.8) * then + 30.0, U * math.sin(0.8) * then - 20.0])
    trial = Trial("a", t, {"psi": psi * heard, "x": place[0] * heard, "y": place[1] * heard}, {}, {})
    sensors = [Heading(1e-3, delay=delay), Antenna(0.1, delay=delay)]
    names = ("x", "y", "psi", "u", "v_m", "r")
    mean, sd = begin(ship, trial, sensors, names, {})
    assert mean == pytest.approx([30.0, -20.0, 0.8, U, 0.0, r], abs=1e-9)
    assert (sd > 0.0).all()


def test_what_no_instrument_shows_begins_at_rest_within_what_the_ship_can_do() -> None:
    ship = load("kvlcc2_l7")
    trial = Trial("a", np.arange(9.0), {}, {}, {})
    mean, sd = begin(ship, trial, [], ("x", "y", "psi", "u", "v_m", "r"), {"psi": (0.4, 0.1)})
    U, L = ship.speed, ship.L_pp
    assert mean == pytest.approx([0.0, 0.0, 0.4, U, 0.0, 0.0])
    assert sd == pytest.approx([L, L, 0.1, U, U, U / L])

"""Contacts through radar and AIS: errors by statistics, lags by closed forms, and ships of which nothing is known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.core.constants import KNOT, MILE
from seatrial.encounters.conduct import Orders, Scene
from seatrial.encounters.sensing import UNSEEN, Ais, Eyes, Radar, Sensing, Tracker, interval, looking

RUNS = 400


def scene(t: float, x: float = 5000.0, y: float = 3000.0, north: float = 0.0, east: float = -6.0) -> Scene:
    """An own ship at rest in the origin, and another on its way."""
    def row(own: float, other: float) -> Any:
        return np.tile([own, other], (RUNS, 1))

    psi = math.atan2(east, north)
    return Scene(t, row(0.0, x + north * t), row(0.0, y + east * t), row(0.0, psi), row(0.0, north), row(0.0, east),
                 np.array([100.0, 100.0]))  # fmt: skip


def seen(sensing: Sensing, times: Any, seed: int = 1, **where: float) -> list[Scene]:
    eyes = Eyes(sensing, scene(0.0, **where), np.random.default_rng(seed))
    return [eyes.look(scene(float(t), **where)) for t in times]


EXACT = Radar(bearing=0.0, distance=0.0, share=0.0, missed=0.0)


@pytest.mark.slow
def test_a_radar_without_errors_tells_place_and_velocity_after_three_time_constants() -> None:
    shown = seen(Sensing(radar=EXACT), np.arange(0.0, 80.0, 0.5))
    told = [one.t for one in shown if one.x[0, 1] > 0.0]
    assert told[0] == pytest.approx(60.0, abs=3.0)  # 3 x 20 s of sweeps
    assert told == [one.t for one in shown if one.t >= told[0]]
    for one in shown[-10:]:
        assert one.x[:, 1] == pytest.approx(np.full(RUNS, 5000.0))
        assert one.y[:, 1] == pytest.approx(np.full(RUNS, 3000.0 - 6.0 * one.t))  # also between sweeps
        assert (one.north[0, 1], one.east[0, 1]) == (pytest.approx(0.0, abs=1e-9), pytest.approx(-6.0))
        assert one.psi[0, 1] == pytest.approx(-0.5 * math.pi)  # the course


def test_plots_have_the_errors_that_are_asked_for() -> None:
    """Before a line is fitted, the first plot is where the track is: its spread is that of the plot."""
    tracker = Tracker(Radar(bearing=1.0, distance=30.0, share=0.01, missed=0.0), (20000,))
    none = np.zeros(20000)
    tracker.sweep(0.0, (none, none), (none + 8000.0, none), np.random.default_rng(2))
    assert tracker.x.std() == pytest.approx(80.0, rel=0.03)  # 1 % of 8 km, above 30 m
    assert tracker.y.std() == pytest.approx(8000.0 * math.radians(1.0), rel=0.03)
    assert tracker.x.mean() == pytest.approx(8000.0, abs=3.0)
    near = Tracker(Radar(bearing=0.0, distance=30.0, share=0.01, missed=0.0), (20000,))
    near.sweep(0.0, (none, none), (none + 1000.0, none), np.random.default_rng(2))
    assert near.x.std() == pytest.approx(30.0, rel=0.03)


def test_noise_of_a_track_is_that_of_a_filter_with_fading_memory() -> None:
    """Steady variance of an alpha-beta filter over that of a plot: (2a^2 + 2b - 3ab) / (a(4 - 2a - b)) (Kalata)."""
    radar = Radar(bearing=0.0, distance=30.0, share=0.0, missed=0.0, memory=12.0)
    tracker, none, rng = Tracker(radar, (4000,)), np.zeros(4000), np.random.default_rng(3)
    for k in range(60):
        tracker.sweep(3.0 * k, (none, none), (none + 8000.0 + 5.0 * 3.0 * k, none), rng)
    theta = math.exp(-3.0 / 12.0)
    a, b = 1.0 - theta**2, (1.0 - theta) ** 2
    ratio = (2.0 * a**2 + 2.0 * b - 3.0 * a * b) / (a * (4.0 - 2.0 * a - b))
    assert tracker.x.std() == pytest.approx(30.0 * math.sqrt(ratio), rel=0.05)
    assert tracker.north.mean() == pytest.approx(5.0, abs=0.05)


@pytest.mark.slow
def test_ships_beyond_the_range_or_without_plots_are_no_tracks() -> None:
    far = seen(Sensing(radar=Radar(range=4000.0, missed=0.0)), np.arange(0.0, 120.0, 1.0))
    assert all((one.x[:, 1] == -UNSEEN).all() for one in far)
    shown = seen(Sensing(radar=Radar(missed=1.0)), np.arange(0.0, 120.0, 1.0))
    assert (shown[-1].x[:, 1] == -UNSEEN).all()
    assert np.cos(shown[-1].psi[:, 1]) == pytest.approx(-np.ones(RUNS))  # and going away
    eyes = Eyes(Sensing(radar=EXACT), scene(0.0), np.random.default_rng(1))
    for t in np.arange(0.0, 90.0, 1.0):
        now = eyes.look(scene(float(t)))
    assert (now.x[:, 1] > 0.0).all()
    for t in np.arange(90.0, 120.0, 1.0):  # it goes out of the range at once, and the track is dropped
        now = eyes.look(scene(float(t), x=60000.0))
    assert (now.x[:, 1] == -UNSEEN).all()


def test_a_turn_is_followed_late() -> None:
    """A step of the velocity is half known after about the time constant, and all of it after some of them."""
    tracker, none, rng = Tracker(EXACT, (1,)), np.zeros(1), np.random.default_rng(1)
    for k in range(100):
        tracker.sweep(3.0 * k, (none, none), (none + 5000.0, none), rng)
    way = []
    for k in range(1, 60):
        tracker.sweep(300.0 + 3.0 * (k - 1), (none, none), (none + 5000.0 + 15.0 * k, none), rng)
        way.append(float(tracker.north[0]))
    half = 3.0 * next(k for k, one in enumerate(way, 1) if one > 2.5)
    assert 15.0 < half < 60.0
    assert way[-1] == pytest.approx(5.0, abs=0.1)


@pytest.mark.slow
def test_reports_come_at_their_intervals_late_and_with_their_errors() -> None:
    ais = Ais(missed=0.0, delay=4.0, place=7.0)
    times = np.arange(0.0, 60.0, 0.5)
    shown = seen(Sensing(ais=ais), times, north=4.0, east=0.0)
    first = [min((one.t for one in shown if one.x[run, 1] > 0.0), default=math.nan) for run in range(RUNS)]
    assert min(first) >= 4.0
    assert max(first) <= 14.5  # an interval of ten seconds and the delay
    assert np.mean(first) == pytest.approx(9.0, abs=0.6)
    error = np.array([one.y[:, 1] - 3000.0 for one in shown[-60:]])
    assert error.std() == pytest.approx(7.0, rel=0.06)
    along = shown[-1].x[:, 1] - (5000.0 + 4.0 * times[-1])
    assert along.mean() == pytest.approx(0.0, abs=1.2)  # moved on since the measurement, in spite of the delay


@pytest.mark.slow
def test_a_ship_that_falls_silent_is_forgotten_when_its_report_is_old() -> None:
    eyes = Eyes(Sensing(ais=Ais(missed=0.0, old=30.0)), scene(0.0), np.random.default_rng(1))
    for t in np.arange(0.0, 40.0, 0.5):
        eyes.look(scene(float(t)))
    gone = [eyes.look(scene(float(t), x=90000.0)).x[:, 1] for t in np.arange(40.0, 75.0, 0.5)]
    assert (gone[0] > 0.0).all()
    assert (gone[-1] == -UNSEEN).all()


@pytest.mark.slow
def test_some_send_nothing_and_some_reports_are_lost() -> None:
    shown = seen(Sensing(ais=Ais(silent=0.25, missed=0.0)), np.arange(0.0, 30.0, 0.5))
    assert (shown[-1].x[:, 1] > 0.0).mean() == pytest.approx(0.75, abs=0.08)
    ais, rng = Ais(missed=0.3), np.random.default_rng(1)
    assert ais.heard(np.full(20000, 1000.0), rng).mean() == pytest.approx(0.7, abs=0.015)
    assert not ais.heard(np.full(100, 21.0 * MILE), rng).any()


@pytest.mark.slow
def test_of_both_ais_is_believed_and_the_own_ship_knows_itself() -> None:
    both = Sensing(radar=Radar(bearing=5.0, missed=0.0), ais=Ais(place=0.0, missed=0.0, delay=0.0))
    now = seen(both, np.arange(0.0, 100.0, 0.5))[-1]
    assert now.y[:, 1] == pytest.approx(scene(99.5).y[:, 1])
    for name in ("x", "y", "psi", "north", "east"):
        assert (getattr(now, name)[:, 0] == getattr(scene(99.5), name)[:, 0]).all()


def test_intervals_of_class_a_by_speed() -> None:
    assert interval(np.array([0.0, 14.0, 14.1, 23.0, 23.1]) * KNOT).tolist() == [10.0, 10.0, 6.0, 6.0, 2.0]


def test_who_looks_is_shown_what_is_known_alone() -> None:
    looked: list[Scene] = []

    class Master:
        def look(self, one: Scene) -> Orders:
            looked.append(one)
            return Orders(one.psi[:, 0], np.ones(len(one.x)))

    master = looking(lambda one: looked.append(one) or Master(), Sensing(), np.random.default_rng(1))(scene(0.0))
    master.look(scene(1.0))
    assert len(looked) == 2
    assert all((one.x[:, 1] == -UNSEEN).all() for one in looked)

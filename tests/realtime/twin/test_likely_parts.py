"""The search for the noise of sea and sensors: each part against matrices, counts and a score whose best is known."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from linear_ship import CHANNELS, NOISE, blur, followed, machine, sailed, step_of
from seatrial.realtime.twin import follow, likely
from seatrial.realtime.twin.faults.acting import between_rows
from seatrial.realtime.twin.faults.stuck import JAMMED, SLOW, Repeats, Steering
from seatrial.realtime.twin.follow import Follower, Step
from seatrial.realtime.twin.likely import Factors

SHIP = machine().ship
"""It sails its 100 m in 20 s."""


@lru_cache
def _taken(rows: int, noise: float) -> tuple[Any, ...]:
    run = sailed(rows, noise=noise, seed=3)
    start = Follower(machine(), 0.0, np.zeros(11), np.diag(np.linspace(0.1, 1e-3, 11)))
    steps = followed(start, run)
    return tuple(likely._Row(acting, readings, after, step)
                 for acting, readings, (after, step) in zip(run.acting, run.readings, steps, strict=True))  # fmt: skip


def taken(rows: int, noise: float = 0.0) -> list[Any]:
    """Rows as the filter has taken them in, the rudder at one angle."""
    return list(_taken(rows, noise))


def spread_ahead(start: Follower, span: float) -> np.ndarray:
    onward = step_of(span)[0]
    H = np.eye(11)[:3]
    return H @ (onward @ start.cov @ onward.T + blur(span)) @ H.T + np.diag(NOISE[:3] ** 2)


@pytest.mark.slow
@pytest.mark.parametrize("seen", [(0, 1, 2), (2,), (0, 1), ()])
def test_a_forecast_is_as_likely_as_the_normal_law_says(seen: tuple[int, ...]) -> None:
    """Of position and heading 24 s ahead, by matrix exponentials; without its constant, which all share."""
    way = taken(25)
    last, start, span = way[-1], way[0].after, 24.0
    readings = np.full(5, math.nan)
    readings[list(seen)] = last.readings[list(seen)] + np.array([3.0, -2.0, 0.01])[list(seen)]
    readings[3:] = last.readings[3:] + 1.0  # rate and speed are not what is forecast
    way[-1] = last._replace(readings=readings)
    onward, pushed = step_of(span)
    mean = (onward @ start.mean + pushed @ last.acting[:2])[list(seen)]
    spread = spread_ahead(start, span)[np.ix_(seen, seen)]
    wanted = multivariate_normal.logpdf(readings[list(seen)], mean, spread) if seen else 0.0
    found = likely._forecast(way) - 0.5 * len(seen) * math.log(math.tau)
    assert found == pytest.approx(float(wanted), abs=0.02)


def test_an_outlier_counts_as_five_standard_deviations_of_each_reading() -> None:
    way = taken(25)
    far = way[-1].readings + np.array([1e4, 0.0, 0.0, 0.0, 0.0])
    way[-1] = way[-1]._replace(readings=far)
    wanted = -0.5 * (3 * 25.0 + np.linalg.slogdet(spread_ahead(way[0].after, 24.0))[1])
    assert likely._forecast(way) == pytest.approx(wanted, abs=0.02)


@pytest.mark.slow
def test_a_forecast_goes_by_the_controls_that_were_logged_on_its_way() -> None:
    """A rudder that goes over half way: the mean of each stretch of four seconds acts, the last one shorter."""
    way = taken(19)
    acting = [np.array([1.0, 0.1 if k < 7 else -0.2, *[0.0] * 8]) for k in range(19)]
    z = way[0].after.mean
    for one in acting[1:]:
        onward, pushed = step_of(1.0)
        z = onward @ z + pushed @ one[:2]
    way = [row._replace(acting=one) for row, one in zip(way, acting, strict=True)]
    way[-1] = way[-1]._replace(readings=z[[0, 1, 2, 5, 3]])
    best = -0.5 * np.linalg.slogdet(spread_ahead(way[0].after, 18.0))[1]
    assert best - 0.02 < likely._forecast(way) < best + 0.02


def test_innovations_are_as_likely_as_the_normal_law_says() -> None:
    step = taken(3, noise=1.0)[-1].step
    wanted = multivariate_normal.logpdf(step.innovation, np.zeros(5), step.spread) + 2.5 * math.log(math.tau)
    assert likely._innovation(step) == pytest.approx(float(wanted))
    far = step._replace(innovation=step.innovation + 1e5)
    assert likely._innovation(far) == pytest.approx(-0.5 * (125.0 + np.linalg.slogdet(step.spread)[1]))
    assert likely._innovation(step._replace(rows=np.zeros(0, dtype=np.intp))) == 0.0


@pytest.mark.parametrize(("last", "starts"), [
    (1000.0, range(200, 901, 20)),  # after ten lengths, each length, five lengths far
    (450.0, range(150, 351, 20)),  # a third of a short log
    (240.0, range(100, 141, 20)),  # no less than five lengths
    (199.0, ()),
])  # fmt: skip
def test_forecasts_begin_each_length_and_reach_five(last: float, starts: Any) -> None:
    here = machine()
    run: Any = [SimpleNamespace(after=SimpleNamespace(t=50.0 + t, machine=here)) for t in np.arange(0.0, last + 0.5)]
    ways = list(likely._ways(run))
    assert [(way[0].after.t - 50.0, way[-1].after.t - 50.0) for way in ways] == [(k, k + 100.0) for k in starts]
    assert all(len(way) == 101 for way in ways)
    assert list(likely._ways([])) == []


def test_the_first_rows_are_sixty_lengths_without_a_clock_that_goes_back() -> None:
    """60 lengths are 1200 s; of more than 1500 rows each second one is taken, or each third."""
    first = lambda times: [t for t, _ in likely._first(SHIP, [(float(t), {}) for t in times])]  # noqa: E731
    assert first(range(5, 5000)) == list(range(5, 1206))
    assert first([0, 1, 2, 2, 3]) == [0, 1, 2]
    assert first([0, 1, 2, 1, 3]) == [0, 1, 2]
    assert first(np.arange(0.0, 2000.0, 0.4)) == pytest.approx(np.arange(0.0, 1200.1, 0.8))
    assert first(np.arange(0.0, 2000.0, 0.2)) == pytest.approx(np.arange(0.0, 1200.1, 0.8))
    assert len(first(np.arange(0.0, 1199.0, 0.8))) == 1499


@pytest.mark.parametrize(("count", "left"), [(0, 100), (1, 40), (3, 40), (4, 100)])
def test_rows_count_until_the_first_of_few_faults(monkeypatch: pytest.MonkeyPatch, count: int, left: int) -> None:
    class Watching:
        def __init__(self, *_: object, held: tuple[str, ...]) -> None:
            assert held == ("n_P",)
            self.alarms: list[Any] = []

        def feed(self, t: float, values: object) -> None:
            if t >= 60.0 and len(self.alarms) < count:  # the one that is named first set in last
                self.alarms.append(SimpleNamespace(since=max(50.0 - 10.0 * len(self.alarms), 40.0) - (count == 1) * 10))

    monkeypatch.setattr(likely, "Live", Watching)
    rows: Any = [(float(k), {}) for k in range(100)]
    kept = likely._sound(SHIP, machine().settings, rows, ["n_P"])
    if count == 3:
        assert [t for t, _ in kept] == list(range(40))
    assert len(kept) == left


@pytest.mark.slow
def test_rows_are_taken_in_with_the_mean_of_controls_and_anew_after_a_gap_of_five_lengths(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(follow, "values", lambda model: {})
    here, run = machine(), sailed(40, seed=5)
    t = run.t + np.where(np.arange(40) < 10, 0.0, np.where(np.arange(40) < 25, 99.0, 300.0))
    rows: list[Any] = [
        (float(at), dict(zip((*CHANNELS, "n_P", "delta"), (*one, 1.0, angle), strict=True)))
        for at, one, angle in zip(t, run.readings, np.linspace(0.0, 0.2, 40), strict=True)
    ]
    del rows[0][1]["x"]  # no position: the motion begins at the next row
    found = likely._runs(here, rows, ("n_P",))
    assert [len(one) for one in found] == [0, 23, 14]
    assert [found[1][0].after.t, found[1][-1].after.t, found[2][0].after.t] == [t[2], t[24], t[26]]
    step = 0.2 / 39.0
    np.testing.assert_allclose([one.acting[1] for one in found[2]], (np.arange(26, 40) - 0.5) * step)
    np.testing.assert_allclose([one.acting[0] for one in found[2]], 1.0)
    np.testing.assert_array_equal(found[2][3].readings, run.readings[29])
    again, row = found[2][3].after.row(float(t[30]), found[2][4].acting, run.readings[30])
    np.testing.assert_array_equal(again.mean, found[2][4].after.mean)
    assert isinstance(row, Step)


def test_controls_between_rows_are_means_the_shorter_way_round() -> None:
    before, now = np.array([1.0, 3.0, math.nan, 2.0]), np.array([2.0, -3.0, 5.0, 4.0])
    kept, turning = np.array([True, False, False, False]), np.array([False, True, False, False])
    found = between_rows(before, now, kept, turning)
    np.testing.assert_allclose(found, [1.0, math.pi, 5.0, 3.0])


@pytest.mark.parametrize("forecasts", [True, False])
def test_the_best_factors_are_found_although_one_depends_on_another(
    monkeypatch: pytest.MonkeyPatch, forecasts: bool
) -> None:
    """The best motion is 3 times while slow forces are as usual, and 10 times with those of ten times: two rounds."""
    usual = machine().settings

    def score(settings: Any) -> float:
        noise = settings.sensors["compass"].sd / usual.sensors["compass"].sd
        motion, slow = settings.memory["motion"], settings.start["slow.u"] / usual.start["slow.u"]
        if motion == 30.0:
            return math.nan  # a filter that ran away is none
        wanted = 3.0 if slow < 5.0 else 10.0
        off = abs(math.log(motion / wanted)) + 10.0 * abs(math.log(slow / 10.0)) + abs(math.log(noise / 4.0))
        return -off

    def made(ship: object, settings: Any) -> Any:
        motion = settings.process["u"] / 2.0
        assert settings.process["r"] == pytest.approx(0.5 * motion)
        return replace(settings, memory={"motion": round(motion, 9)})

    monkeypatch.setattr(likely, "_sound", lambda ship, settings, rows, held: rows)
    monkeypatch.setattr(likely, "made", made)
    monkeypatch.setattr(likely, "_runs", lambda machine, rows, held: [[SimpleNamespace(step=machine)]])
    monkeypatch.setattr(likely, "_ways", lambda run: [run] if forecasts else [])
    monkeypatch.setattr(likely, "_forecast", lambda way: score(way[0].step))
    monkeypatch.setattr(likely, "_innovation", score)
    start = replace(usual, process={"u": 2.0, "v_m": 2.0, "r": 0.5, "slow.u": 0.3})
    settings, factors = likely.likeliest(SHIP, start, [(0.0, {})])
    assert factors == Factors(10.0, 10.0, 4.0)
    assert settings.process == pytest.approx({"u": 20.0, "v_m": 20.0, "r": 5.0, "slow.u": 3.0})
    assert settings.sensors["compass"].sd == pytest.approx(4.0 * usual.sensors["compass"].sd)


# --- faults that a log shows without a model ---


def test_a_rudder_is_judged_over_twenty_seconds() -> None:
    """Always called to move at its rate; after it jams, half of the way is missing at ten, nearly all at twenty."""
    steering, angle, first = Steering("delta", 0.04, 0.0), 0.0, dict[str, tuple[float, float]]()
    for k in range(200):
        t = 0.5 * k
        steering.note(t, {"delta": angle, "delta_cmd": angle + (0.2 if (k // 20) % 2 else -0.2)})
        if (found := steering.verdict()) is not None:
            first.setdefault(found[0], (t, found[1]))
        if t < 50.0:
            angle += 0.02 if (k // 20) % 2 else -0.02
    assert first["follows"][0] == pytest.approx(2.0, abs=0.01)  # four rows of 1.15 deg are the first beyond 4 deg
    assert first[SLOW][0] == pytest.approx(60.5, abs=0.51)
    assert first[JAMMED][0] == pytest.approx(69.5, abs=0.51)
    assert first[JAMMED][1] == pytest.approx(first[JAMMED][0] - 20.0)


@pytest.mark.parametrize(("off", "verdicts"), [(0.9, 0), (1.1, 20)])
def test_an_order_near_the_angle_calls_for_nothing(off: float, verdicts: int) -> None:
    """An order 1.1 deg from where a rudder rests calls for that much each row; one of 10 deg for a second did, too."""
    steering, angle, order = Steering("delta", 0.5, 0.0), 0.0, math.radians(off)
    for t, before in ((-2.0, order), (-1.0, math.radians(10.0))):
        steering.note(t, {"delta": angle, "delta_cmd": before})
    found = []
    for k in range(21):
        steering.note(float(k), {"delta": angle, "delta_cmd": order})
        found.append(steering.verdict())
    assert sum(one is not None for one in found) == verdicts
    assert {one[0] for one in found if one is not None} <= {JAMMED}


@pytest.mark.parametrize(("by", "jams"), [(6.0, False), (1.9, True)])
def test_a_quick_rudder_whose_angle_leaves_an_order_that_stands_still_is_not_jammed(by: float, jams: bool) -> None:
    """15.8 deg/s each .5 s: 6 deg are within its reach, but nothing called for them; it goes on beside its order.

    Within 2 deg, and never moving again, it is jammed beside the next order.
    """
    steering, found, order = Steering("delta", math.radians(15.8), 0.0), set[str](), 0.0
    for k in range(120):
        t = 0.5 * k
        order = math.radians(10.0 * math.sin(0.05 * max(t - 25.0, 0.0)) if by > 2.0 else 8.0 * (t > 25.0))
        angle = math.radians(by) * (t >= 20.0) + (order if by > 2.0 else 0.0)
        steering.note(t, {"delta": angle, "delta_cmd": order})
        verdict = steering.verdict()
        found |= {verdict[0]} if verdict is not None else set()
    assert (JAMMED in found) is jams


def test_a_servo_with_a_lag_is_called_to_move_by_its_share() -> None:
    """A lag of 10 s calls for a tenth of the way a second: 20 deg make 2 deg a row, so two rows are 4 deg, three count.

    A clock that is set back begins the count anew.
    """
    steering, order = Steering("delta", 1.0, 10.0), math.radians(20.0)
    steering.note(-20.0, {"delta_cmd": 0.0, "delta": 0.0})
    steering.note(-11.0, {"delta_cmd": order})
    found = []
    for k in range(8):
        steering.note(float(k), {"delta": 0.0, "delta_cmd": order})
        found.append(steering.verdict())
    assert [one is not None for one in found] == [False] * 3 + [True] * 5
    assert found[-1] == (JAMMED, 1.0)
    steering.note(3.0, {"delta": 0.0, "delta_cmd": order})
    assert steering.verdict() is None


@pytest.mark.parametrize(("changes", "repeats", "since"), [(30, 6, 30.0), (30, 5, None), (29, 50, None), (200, 5, None),
                                                           (200, 6, 200.0)])  # fmt: skip
def test_six_repetitions_of_what_never_repeated_are_a_fault(changes: int, repeats: int, since: float | None) -> None:
    """After 31 readings without one a repetition has a chance of one in 33: six of them 8e-10."""
    watch, t = Repeats(), 0
    for t in range(changes + 1):
        watch.note(float(t), {"psi": 0.1 * t, "r": math.nan})
    for k in range(1, repeats + 1):
        watch.note(float(t + k), {"psi": 0.1 * t})
    assert watch.stuck("psi") == since
    assert watch.stuck("r") is None
    assert watch.repeated("psi", float(t))
    assert not watch.repeated("psi", t - 0.5)

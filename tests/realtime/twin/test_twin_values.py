"""What a twin begins with, shows and leaves behind: deviations at the first row, points of the page, provenance."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from linear_ship import CHANNELS, NOISE, machine
from seatrial.identify.filters.augmented import ANTENNA
from seatrial.realtime.twin import follow
from seatrial.realtime.twin.ahead import forecast
from seatrial.realtime.twin.card import unseen
from seatrial.realtime.twin.faults.acting import Override
from seatrial.realtime.twin.faults.alarms import STEERING, Alarm
from seatrial.realtime.twin.faults.cases import History
from seatrial.realtime.twin.faults.stuck import FOLLOWS
from seatrial.realtime.twin.faults.suspects import LAZY, threshold
from seatrial.realtime.twin.follow import Step, begun
from seatrial.realtime.twin.live import Counts, Live
from seatrial.realtime.twin.page import screen
from seatrial.realtime.twin.page.screen import Screen, _none, _round
from seatrial.realtime.twin.saved import provenance
from seatrial.realtime.twin.tally import Tally


def test_at_the_first_row_motion_is_as_read_and_as_uncertain_as_its_instruments(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ten times the noise of a fix, five of a compass, a quarter of the speed, half of U/L; 100 m at 5 m/s."""
    monkeypatch.setattr(follow, "values", lambda model: {})
    here = machine()
    readings = np.array([10.0, -20.0, 0.3, 0.02, 4.0])
    found = begun(here, 7.0, readings)
    assert found.t == 7.0
    np.testing.assert_allclose(found.mean[:6], [10.0, -20.0, 0.3, 4.0, 0.0, 0.02])
    sd = np.sqrt(np.diagonal(found.cov))
    np.testing.assert_allclose(sd[:6], [*(10.0 * NOISE[:2]), 5.0 * NOISE[2], 1.25, 1.25, 0.5 * 5.0 / 100.0])
    np.testing.assert_allclose(sd[6:], [here.settings.start[name] for name in here.names[6:]])
    readings[4] = math.nan  # without a log the usual speed, and all of it uncertain
    blind = begun(here, 7.0, readings)
    assert (blind.mean[3], math.sqrt(blind.cov[3, 3])) == pytest.approx((5.0, 5.0))
    known = begun(here, 7.0, readings, (np.arange(5.0), np.diag(np.arange(1.0, 6.0))))
    np.testing.assert_allclose(known.mean[6:], np.arange(5.0))
    np.testing.assert_allclose(np.diagonal(known.cov)[6:], np.arange(1.0, 6.0))


def a_live(**more: Any) -> Any:
    ship = SimpleNamespace(L_pp=100.0, speed=5.0, name="s", model=SimpleNamespace(controls=("delta",), breadth=0.0))
    machine = SimpleNamespace(ship=ship, channels=CHANNELS, settings=SimpleNamespace(free=("a.b",), estimator="ekf"))
    follower = SimpleNamespace(mean=np.arange(11.0), t=3.0)
    return SimpleNamespace(machine=machine, follower=follower, last=None, alarms=[], **more)


def test_the_page_keeps_a_point_each_tenth_of_a_length_and_strips_of_misses() -> None:
    """100 m at 5 m/s: each two seconds; misses in standard deviations, 99 at most, of what was read."""
    live = a_live()
    shown = Screen(live, "log")
    for k in range(900):
        t = 0.5 * k
        rows = np.array([0, 3])
        live.last = SimpleNamespace(t=t, rows=rows, innovation=np.array([2.0, -1e6]), spread=np.diag([4.0, 1.0]))
        shown.heard(t, {"x": 1.23456 + k, "y": 2.0} if k < 400 else {"x": 1.0})
    assert len(shown._estimated) == 225
    assert len(shown._measured) == 100
    assert shown._measured[1] == [1.235 + 4.0, 2.0]
    assert shown._estimated[-1] == [0.0, 1.0]
    assert list(shown._misses["x"])[:2] == [[0.0, 1.0], [2.0, 1.0]]
    assert shown._misses["r"][0] == [0.0, -99.0]
    assert not shown._misses["psi"]
    assert (shown._measured.maxlen, shown._misses["x"].maxlen) == (400, 240)
    shown.heard(1e6, {})  # another row than the last one
    assert len(shown._estimated) == 225
    assert (_round(1.23456789), _none(math.nan), _none(2.0)) == (1.23457, None, 2.0)


def test_a_picture_is_made_four_times_a_second_while_somebody_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    now, made = [100.0], list[float]()
    monkeypatch.setattr(screen, "time", SimpleNamespace(monotonic=lambda: now[0]))
    shown = Screen(a_live(), "log")
    monkeypatch.setattr(shown, "_picture", lambda follower, at, force: made.append(at) or {})
    shown.look()
    assert made == []
    shown.looked = True
    for later in (0.0, 0.24, 0.02, 0.1, 0.2):
        now[0] += later
        shown.look()
    assert made == pytest.approx([100.0, 100.26, 100.56])
    shown.looked = False
    shown.look(force=True)
    assert len(made) == 4


def test_a_forecast_is_made_anew_after_two_seconds_of_the_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures in between show the last one; one that is forced has its own."""
    made: list[int] = []
    monkeypatch.setattr(screen, "forecast", lambda follower, acting, scores: made.append(len(made)))
    monkeypatch.setattr(screen, "_points", lambda ahead: [[float(len(made))]])
    monkeypatch.setattr(screen, "unseen", lambda live: [])
    monkeypatch.setattr(screen, "parameters", lambda live: [])
    live = a_live(acting=np.array([0.1]), masked=(), tally=Tally(), trust=SimpleNamespace(scores={}), counts=Counts())
    follower = SimpleNamespace(mean=np.arange(11.0), cov=np.diag(np.arange(11.0) ** 2), t=7201.26)
    shown = Screen(live, "log")
    times = (100.0, 101.99, 102.01, 104.0, 104.02)
    assert [shown._picture(follower, now, False)["ahead"][0][0] for now in times] == [1, 1, 2, 2, 3]
    picture = shown._picture(follower, 104.03, True)
    assert picture["ahead"] == [[4.0]]
    assert (picture["t"], picture["L"], picture["B"]) == (7201.3, 100.0, 15.0)
    assert picture["state"]["u"] == [3.0, 3.0]
    assert picture["controls"] == {"delta": 0.1}
    live.tally.note(7200.0, 6.0, 4)
    live.alarms = [Alarm(f"a {k}", "jump", ("x",), 0.0, 1.0) for k in range(25)]
    picture = shown._picture(follower, 104.04, False)
    assert picture["hours"][0][:2] == [2.0, 1.5]
    assert [one["cause"] for one in picture["alarms"]] == [f"a {k}" for k in range(5, 25)]


def test_what_a_twin_leaves_behind_names_twenty_alarms_at_most() -> None:
    live = a_live(tally=SimpleNamespace(hours=[1, 2]))
    live.alarms = [SimpleNamespace(text=f"alarm {k}") for k in range(25)]
    found = provenance(live, "a log")
    assert found["alarms"] == [f"alarm {k}" for k in range(20)]
    assert (found["until"], found["hours"], found["log"], found["parameters"]) == (3.0, 2, "a log", ["a.b"])
    live.follower = None
    assert provenance(live, "a log")["until"] == 0.0
    assert vars(Counts()) == dict.fromkeys(("late", "waiting", "gaps", "restarts"), 0)


def test_faults_are_sought_over_a_minute_and_a_half_each_five_seconds() -> None:
    settings = machine().settings
    assert (settings.window, settings.spacing, settings.settle, settings.horizon) == (90.0, 5.0, 300.0, 60.0)
    assert settings.false_alarms == 0.2
    assert machine().patience == 10.0  # half of L/U


def test_a_fault_is_there_from_as_many_tests_a_day_over_the_false_alarms_that_are_accepted() -> None:
    """Twenty suspects each five seconds are 345 600 tests: of 1 / 5 a day, 2 ln 1.7e6."""
    assert threshold(20, 5.0, 0.2) == pytest.approx(2.0 * math.log(86400.0 / 5.0 * 20.0 / 0.2))
    assert threshold(1, 86400.0, 1.0) == pytest.approx(2.0 * math.log(2.0))


def test_the_level_follows_the_innovations_and_is_no_less_than_one() -> None:
    tally = Tally()
    tally.note(0.0, 3.0 * 400, 400)  # a tenth of what it remembers
    assert tally.level == pytest.approx(1.2)
    tally.note(1.0, 2.0 * 9000, 9000)
    assert tally.level == pytest.approx(2.0)
    tally.note(2.0, 0.0, 4000)
    assert tally.level == 1.0
    tally.note(3599.0, 5.0, 0)
    tally.note(3600.0, 5.0, 2)
    assert [(one.start, one.readings) for one in tally.hours] == [(0.0, 13400), (3600.0, 2)]
    assert tally.hours[1].mean == 2.5


def test_innovations_squared_are_of_what_was_taken_in() -> None:
    spread = np.array([[2.0, 0.5, 0.1], [0.5, 3.0, 0.2], [0.1, 0.2, 1.0]])
    innovation, empty = np.array([1.0, -2.0, 50.0]), np.zeros(0)
    for taken in ([True, True, True], [True, True, False], [False, True, False], [False] * 3):
        kept = np.flatnonzero(taken)
        inverse = np.linalg.inv(spread)
        step = Step(1.0, 1.0, np.arange(3), np.array(taken), innovation, spread, inverse, *[empty] * 6)
        some = innovation[kept]
        wanted = float(some @ np.linalg.solve(spread[np.ix_(kept, kept)], some)) if kept.size else 0.0
        assert step.nis == pytest.approx(wanted)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_slow_control_goes_its_rate_times_the_time_either_way(side: float) -> None:
    slow = Override(LAZY, 0.1 * side, 0.02)
    assert slow.acts(-0.3 * side, 2.0) == pytest.approx(0.06 * side)
    assert slow.acts(-0.3 * side, 2.0) == pytest.approx(0.02 * side)
    assert slow.acts(-0.3 * side, 60.0) == pytest.approx(-0.3 * side)
    assert slow.acts(0.3 * side, 5.0) == pytest.approx(-0.2 * side)


def test_forecasts_step_four_times_as_far_as_the_filter(monkeypatch: pytest.MonkeyPatch) -> None:
    steps: list[Any] = []
    here = follow.Follower(machine(), 10.0, np.zeros(11), np.eye(11))
    here = replace(here, machine=replace(here.machine, settings=replace(here.machine.settings, step=0.5)))
    monkeypatch.setattr(follow.Follower, "ahead", lambda self, t, acting, step: (steps.append((t, step)) or self, None))
    found = forecast(here, np.zeros(10), 80.0)
    assert {step for _, step in steps} == {2.0}
    assert found.t == pytest.approx(10.0 + 80.0 * (np.arange(41) / 40.0) ** 1.5)
    assert [t for t, _ in steps] == pytest.approx(found.t[1:])
    assert found.half[0] == pytest.approx([1.6449] * 3)


def bare(alarms: list[Alarm]) -> Any:
    """A twin that has nothing but its alarms, and notes what it does about one."""
    one: Any = Live.__new__(Live)
    one.alarms, one.done = alarms, []
    for name in ("_explain", "_give_up", "_forget"):
        setattr(one, name, lambda *_, name=name: one.done.append(name))
    one.machine = SimpleNamespace(unit=20.0)
    return one


@pytest.mark.parametrize(("first", "count", "done"), [(3599.0, 6, "_give_up"), (3601.0, 6, "_explain"),
                                                      (3599.0, 5, "_explain")])  # fmt: skip
def test_more_than_six_alarms_in_an_hour_are_no_sensors(first: float, count: int, done: str) -> None:
    t = 9000.0
    before = [Alarm(f"cause {k}", "jump", ("x",), 0.0, t - first + 100.0 * k, over=t - 100.0) for k in range(count)]
    one = bare(before)
    one._raise(Alarm("another", "jump", ("x",), t - 10.0, t))
    assert one.done[0] == done
    assert len(one.alarms) == count + 1


@pytest.mark.parametrize(("hows", "ago", "done"), [
    (("grows", "impulse"), 100.0, "_give_up"), (("carried", "carried"), 100.0, "_give_up"),
    (("grows",), 100.0, "_explain"), (("grows", "jump"), 100.0, "_explain"), (("grows", "impulse"), 241.0, "_explain"),
])  # fmt: skip
def test_a_current_that_changes_three_times_in_four_minutes_is_a_wrong_model(
    hows: tuple[str, ...], ago: float, done: str
) -> None:  # fmt: skip
    before = [Alarm(f"cause {k}", how, ("a",), 0.0, 1000.0 - ago, over=1000.0 - ago) for k, how in enumerate(hows)]
    one = bare(before)
    one._history = History()  # of no rows that would tell which of them is needed
    one._raise(Alarm("current changed", "carried", ("a",), 990.0, 1000.0))
    assert one.done[0] == done


def test_an_alarm_of_a_minute_ago_goes_on_and_steering_that_follows_ends_its_own() -> None:
    one = bare([Alarm("a", "jump", ("x",), 1.0, 2.0, over=50.0)])
    one._raise(Alarm("a", "jump", ("x",), 95.0, 100.0))
    assert [(a.since, a.named) for a in one.alarms] == [(1.0, 2.0)]
    one._raise(Alarm("a", "jump", ("x",), 195.0, 200.0))  # it lasts, as it was raised again
    assert len(one.alarms) == 1
    one.alarms[0] = one.alarms[0].ended(220.0)
    one._raise(Alarm("a", "jump", ("x",), 295.0, 300.0))
    assert len(one.alarms) == 2
    steering = [Alarm(f"{name} slow", how, (name,), 1.0, 2.0) for name, how in
                (("delta", "model"), ("delta", STEERING), ("other", STEERING))]  # fmt: skip
    one = bare(steering)
    one._steering = (SimpleNamespace(control="delta", verdict=lambda: (FOLLOWS, 70.0)),)  # type: ignore[assignment]
    one._judge_steering(77.0)
    assert [a.over for a in one.alarms] == [math.inf, 77.0, math.inf]
    assert [a.cause for a in one.active] == ["delta slow", "other slow"]


def test_each_browser_gets_a_picture_once_and_the_last_one_at_the_end() -> None:
    shown = Screen(a_live(), "log")
    first, second = shown.pictures(), shown.pictures()
    assert first(True) is None  # before there is any
    shown.picture = {"t": 1.0, "over": False}
    assert first(False) == {"t": 1.0, "over": False}
    assert first(False) is None
    assert second(False) == {"t": 1.0, "over": False}
    assert first(True) == {"t": 1.0, "over": True}
    shown.picture = {"t": 2.0, "over": True}
    assert first(False) == {"t": 2.0, "over": True}  # the log has ended, the page goes on


def test_what_is_unseen_is_told_by_its_own_name_unit_value_and_deviation() -> None:
    names = ("u", ANTENNA[0], ANTENNA[1], "bias.r", "slow.r", "environment.current_y")
    told = {name: (float(k), 0.1 * k) for k, name in enumerate(names)}
    live: Any = SimpleNamespace(machine=SimpleNamespace(names=names), follower=SimpleNamespace(value=told.get))
    rows = [(row["name"], row["unit"], row["value"], row["sd"]) for row in unseen(live)]
    assert rows == [
        ("antenna, forward of midship", "m", 1.0, 0.1), ("antenna, to starboard", "m", 2.0, 0.2),
        ("error of the rate gyro", "rad/s", 3.0, pytest.approx(0.3)), ("slow moment, yaw", "rad/s²", 4.0, 0.4),
        ("current east", "m/s", 5.0, 0.5),
    ]  # fmt: skip
    assert unseen(SimpleNamespace(follower=None)) == []  # type: ignore[arg-type]

"""One cause, one alarm: which of the faults that were named together are needed, and alarms of new kinds on a ship."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from linear_ship import CHANNELS, Sailed, machine, sailed
from sea_logs import Bridge
from sea_logs import sailed as at_sea
from seatrial.realtime.twin.faults import cases
from seatrial.realtime.twin.faults.alarms import FROZEN, STEERING, WRONG, Alarm, strayed
from seatrial.realtime.twin.faults.cases import CASE, History, Kept, Verdict, judged, together
from seatrial.realtime.twin.faults.suspects import IMPULSE, JUMP, MISREAD, Bank, suspects
from seatrial.realtime.twin.follow import Follower, Step, lever
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.settings import usual
from seatrial.ships.files import load

P_0 = np.diag([4.0, 4.0, 1e-4, 0.04, 0.01, 1e-6, 0.1, 0.1, 1e-6, 1e-6, 1e-10])
AT, ROWS = 40.0, 90


def kept(run: Sailed) -> History:
    """The rows as a twin without any alarm keeps them."""
    follower, history = Follower(machine(), 0.0, np.zeros(11), P_0), History()
    for t, acting, readings in zip(run.t.tolist(), run.acting, run.readings, strict=True):
        history.note(Kept(t, acting, readings), follower)
        follower, _ = follower.row(t, acting, readings)
    return history


def spoilt(**by: float) -> History:
    """A run whose channels are off from `AT` on."""
    run = sailed(ROWS)
    for name, much in by.items():
        run.readings[run.t > AT, CHANNELS.index(name)] += much
    return kept(run)


LOG = Alarm("log jumped", JUMP, ("u_w",), AT, 70.0, (1.0,), "m/s")
CURRENT = Alarm("current changed", IMPULSE, ("environment.current_x", "environment.current_y"), AT, 50.0, (-1.0, 0.1))
COMPASS = Alarm("compass jumped", JUMP, ("psi",), AT, 55.0, (0.1,), "rad")
RUDDER = Alarm("delta sensor jumped", MISREAD, ("delta",), AT, 60.0, (0.05,), "rad")


def verdict(history: History, *alarms: Alarm) -> Verdict:
    found = judged(history, alarms)
    assert found is not None
    return found


def test_a_fault_that_was_named_too_early_is_a_consequence_of_the_one_that_explains_it() -> None:
    found = verdict(spoilt(u_w=1.0), CURRENT, LOG)
    assert (found.causes, found.consequences) == ((LOG,), (CURRENT,))
    again = verdict(spoilt(u_w=1.0), LOG)
    np.testing.assert_allclose(found.follower.mean, again.follower.mean)  # as if it had never been named


def test_a_fault_that_follows_from_the_one_before_is_no_cause() -> None:
    """A rudder beside its sensor explains nothing where the compass alone is off."""
    found = verdict(spoilt(psi=0.1), COMPASS, RUDDER)
    assert (found.causes, found.consequences) == ((COMPASS,), (RUDDER,))


@pytest.mark.slow
def test_two_faults_that_both_are_there_are_both_causes() -> None:
    found = verdict(spoilt(u_w=1.0, psi=0.1), COMPASS, LOG)
    assert (found.causes, found.consequences) == ((COMPASS, LOG), ())
    three = verdict(spoilt(u_w=1.0, psi=0.1), CURRENT, COMPASS, LOG)
    assert (three.causes, three.consequences) == ((COMPASS, LOG), (CURRENT,))


@pytest.mark.parametrize(("without", "needed"), [(114.0, False), (116.0, True)])
def test_a_fault_is_needed_where_the_rows_are_less_likely_by_fifteen(
    monkeypatch: pytest.MonkeyPatch, without: float, needed: bool
) -> None:
    history = spoilt()
    said = {2: 100.0, 1: without}
    monkeypatch.setattr(cases, "_again", lambda history, start, alarms: (said[len(alarms)], start))
    assert (CURRENT in verdict(history, CURRENT, LOG).causes) is needed


def test_a_reading_that_is_taken_out_counts_as_one_as_far_off_as_expected() -> None:
    """Three readings: one at two deviations, one taken out, one cut at six deviations."""
    empty, variance = np.zeros(0), np.array([4.0, 0.25, 1.0])
    step = Step(1.0, 1.0, np.array([0, 2, 3]), np.ones(3, dtype=bool), np.array([4.0, 30.0, 20.0]), np.diag(variance),
                empty, empty, empty, empty, empty, empty, empty)  # fmt: skip
    assert cases._unlikely(step, {2}) == pytest.approx(4.0 + 1.0 + 36.0 + float(np.log(variance).sum()))


def test_what_sets_in_before_all_that_is_kept_cannot_be_judged() -> None:
    history = spoilt()
    assert judged(history, [Alarm("a", JUMP, ("u_w",), -1.0, 50.0, (1.0,)), LOG]) is None
    history.clear()
    assert judged(history, [CURRENT, LOG]) is None


def test_rows_are_kept_for_a_time_and_an_estimate_from_before_each_onset() -> None:
    follower, history = Follower(machine(), 0.0, np.zeros(11), P_0), History()
    for k in range(2000):
        row = Kept(float(k + 1), np.zeros(10), np.zeros(5))
        history.note(row, Follower(follower.machine, float(k), follower.mean, P_0))
    assert history.rows[-1].t - history.rows[0].t == pytest.approx(1.5 * CASE)
    start = history.start(2000.0 - CASE)
    assert start is not None
    assert 2000.0 - CASE - 5.0 <= start.t <= 2000.0 - CASE
    assert history.marks[0].t <= history.rows[0].t


def test_alarms_of_the_last_minutes_may_have_one_cause() -> None:
    def one(named: float, how: str = JUMP, of: str = "") -> Alarm:
        return Alarm("a", how, ("x",), named - 5.0, named, of=of)

    every = [one(100.0), one(400.0), one(410.0, STEERING), one(420.0, FROZEN), one(430.0, of="b")]
    assert [a.named for a in together(every, 500.0, lambda a: False)] == [400.0, 420.0]
    assert [a.named for a in together(every, 500.0, lambda a: a.how == FROZEN)] == [400.0]


def test_a_cause_says_what_it_explains_and_a_consequence_of_what() -> None:
    cause = Alarm("log jumped", JUMP, ("u_w",), AT, 70.0, (1.0,), "m/s", explains=("current changed", "a"))
    assert cause.text == "log jumped by 1 m/s, since t = 40 s; explains also: current changed, a"
    assert Alarm("a", JUMP, ("x",), 1.0, 2.0, of="b").text == "a, since t = 1 s; a consequence of: b"


@pytest.mark.parametrize("psi", [0.0, 0.7, -2.0])
def test_a_fix_moves_with_its_antenna_by_the_heading(psi: float) -> None:
    turned = np.array([[math.cos(psi), -math.sin(psi)], [math.sin(psi), math.cos(psi)]])
    np.testing.assert_allclose(np.column_stack([lever("antenna.x", psi), lever("antenna.y", psi)]), turned)


@pytest.mark.parametrize(("value", "sd", "placed", "said"), [
    (7.6, 1.4, True, True), (7.4, 1.4, True, False), (-7.6, 1.4, True, True), (7.6, 1.6, True, False),
    (90.0, 0.1, False, False),
])  # fmt: skip
def test_an_antenna_far_from_its_stated_place_by_both_measures_is_told(
    value: float, sd: float, placed: bool, said: bool
) -> None:
    """2.5 deviations of the place, 3 m each, and 5 of the estimate; where nothing was stated, nothing is elsewhere."""
    settings = SimpleNamespace(placed=placed, start={"antenna.x": 3.0, "antenna.y": 3.0})
    known = {"antenna.x": (value, sd), "antenna.y": (0.5, 0.2)}
    about = SimpleNamespace(t=90.0, value=known.get, machine=SimpleNamespace(settings=settings))
    found = strayed(about)  # type: ignore[arg-type]
    assert bool(found) is said
    if found:
        assert (found[0].size, found[0].over, found[0].named) == ((value, 0.5), 90.0, 90.0)
    assert strayed(None) == ()


@pytest.mark.parametrize(("surge", "sway", "said"), [
    ((4.1, 1.0), (1.0, 0.4), ["resistance or wind changed"]), ((3.9, 0.7), (1.0, 0.4), []),
    ((4.1, 1.1), (0.0, 0.4), []), ((0.0, 0.7), (-4.1, 0.4), ["wind or another force changed"]),
    ((-9.0, 0.7), (9.0, 0.4), ["resistance or wind changed", "wind or another force changed"]),
])  # fmt: skip
def test_a_force_that_came_little_by_little_is_told_from_four_deviations_on(
    surge: tuple[float, float], sway: tuple[float, float], said: list[str]
) -> None:
    """By both measures: those of the usual forces, 1 each, and of the estimate."""
    start = {"slow.u": 1.0, "slow.v_m": 1.0, "slow.r": 1.0}
    known = {"slow.u": surge, "slow.v_m": sway, "slow.r": (0.1, 0.5)}
    settings = SimpleNamespace(placed=False, start=start)
    about = SimpleNamespace(t=5.0, value=known.get, machine=SimpleNamespace(settings=settings))
    found = strayed(about)  # type: ignore[arg-type]
    assert [one.cause for one in found] == said
    assert all(one.over == 5.0 for one in found)


@pytest.mark.parametrize(("off", "kept"), [
    ([90.0, -60.0], [25.0, -25.0 * 60.0 / 90.0]), ([20.0, -24.0], [20.0, -24.0]), ([0.0, 100.0], [0.0, 25.0]),
])  # fmt: skip
def test_a_fix_far_off_counts_as_one_less_far_in_the_same_direction(off: list[float], kept: list[float]) -> None:
    """Fifty deviations of .5 m; cut at each axis for itself, a late fix was one that had jumped aside."""
    bank, empty = Bank(machine(), suspects(machine())), np.zeros(0)
    step = Step(1.0, 1.0, np.arange(3), np.ones(3, dtype=bool), np.array([*off, 0.01]), np.diag([0.25, 0.25, 1e-4]),
                empty, empty, empty, empty, empty, empty, empty)  # fmt: skip
    np.testing.assert_allclose(bank._within(step, np.array([0.5, 0.5, 0.01])), [*kept, 0.01])


# --- on the tanker, by the simulator of the garden ---

SHIP = load("kvlcc2")
READ = ("x", "y", "psi", "r", "u_w", "v_north", "v_east", "n_P", "delta")
Row = Mapping[str, float]


def followed(bridge: Bridge, until: float, **more: Any) -> Live:
    noise = {"x": 0.5, "y": 0.5, "psi": 0.001, "r": 1e-4, "u_w": 0.03, "v_north": 0.03, "v_east": 0.03}
    live = Live(SHIP, usual(SHIP, READ, noise=noise, **more), READ)
    for t, row in bridge.rows(until):
        live.feed(t, row)
    return live


@pytest.mark.slow
@pytest.mark.parametrize("place", [(60.0, 0.0), (-110.0, 5.0)])
def test_a_wrong_antenna_is_one_alarm_and_the_fix_is_taken_from_where_it_stands(place: tuple[float, float]) -> None:
    """It was told as a position that jumped, a jammed rudder and another ship at once."""
    live = followed(Bridge(at_sea(), antenna=place), 800.0, antenna=(0.0, 0.0))
    causes = [one for one in live.alarms if not one.of]
    assert [one.cause for one in causes] == ["antenna elsewhere than stated"]
    assert live.follower is not None
    for name, true in zip(("antenna.x", "antenna.y"), place, strict=True):
        value, sd = live.follower.value(name)
        assert abs(value - true) < 4.0 * sd + 1.0
    assert live.follower.value("antenna.x")[1] < 0.01 * SHIP.L_pp
    assert not live.masked


@pytest.mark.slow
def test_an_antenna_that_nothing_states_is_looked_for_and_no_alarm() -> None:
    live = followed(Bridge(at_sea(), antenna=(20.0, 60.0)), 700.0, antenna=None)
    assert not live.alarms


def late(*channels: str) -> Callable[[list[Any], int], Row]:
    return lambda rows, k: rows[k][1] | {name: rows[k - 4][1][name] for name in channels}


def drifting(name: str, each: float) -> Callable[[list[Any], int], Row]:
    return lambda rows, k: rows[k][1] | {name: rows[k][1][name] + each * (rows[k][0] - 600.0)}


KINDS = {
    "position late": late("x", "y"), "compass late": late("psi"), "log drifts": drifting("u_w", 0.01),
    "rate gyro drifts": drifting("r", 2e-5),
    "rate gyro scaled": lambda rows, k: rows[k][1] | {"r": 1.4 * rows[k][1]["r"]},
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("cause", KINDS)
def test_a_reading_that_is_late_drifts_or_is_scaled_is_named_as_that(cause: str) -> None:
    noise = {"x": 0.5, "y": 0.5, "psi": 0.001, "r": 1e-4, "u_w": 0.03, "v_north": 0.03, "v_east": 0.03}
    live, rows = Live(SHIP, usual(SHIP, READ, noise=noise), READ), Bridge(at_sea(current=(0.0, 0.3))).rows(780.0)
    for k, (t, row) in enumerate(rows):
        live.feed(t, KINDS[cause](rows, k) if t >= 600.0 else row)
    assert [one.cause for one in live.alarms if not one.of] == [cause]
    assert 600.0 < live.alarms[0].named <= 720.0


@pytest.mark.slow
@pytest.mark.parametrize("pace", [0.03, -0.03])
def test_a_clock_off_its_pace_is_one_alarm_with_its_size(pace: float) -> None:
    noise = {"x": 0.5, "y": 0.5, "psi": 0.001, "r": 1e-4, "u_w": 0.03, "v_north": 0.03, "v_east": 0.03}
    live = Live(SHIP, usual(SHIP, READ, noise=noise), READ)
    for t, row in Bridge(at_sea()).rows(900.0):
        live.feed(t if t < 600.0 else t + pace * (t - 600.0), row)
    (alarm,) = [one for one in live.alarms if not one.of]
    assert alarm.cause == "clock of the log off its pace"
    assert alarm.size[0] == pytest.approx(pace, rel=0.3)


def test_faults_without_end_are_consequences_of_a_wrong_model() -> None:
    one: Any = Live.__new__(Live)
    one.machine, one.follower, one._rows, one._masked, one._agreed, one._overrides = machine(), None, [], {}, {}, {}
    one.alarms = [Alarm(f"fault {k}", JUMP, ("x",), 10.0 * k, 10.0 * k + 5.0) for k in range(7)]
    one._forget = lambda t, quiet: None
    one._give_up(list(one.alarms), 100.0)
    *others, last = one.alarms
    assert (last.cause, last.explains) == (WRONG, tuple(f"fault {k}" for k in range(6)))
    assert all(a.of == WRONG for a in others)

"""Parts of a twin by themselves: what acts, what is assumed, what a log says, what is named when, what is kept."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from linear_ship import CHANNELS, NOISE, Sailed, machine, sailed, step_of
from seatrial.data import Trial
from seatrial.environment import CHANNELS as AROUND
from seatrial.identify import StudyError
from seatrial.realtime.twin import follow, live
from seatrial.realtime.twin.ahead import Forecast, Score
from seatrial.realtime.twin.card import page, parameters
from seatrial.realtime.twin.faults.acting import Acting, Override
from seatrial.realtime.twin.faults.alarms import WRONG, Alarm, Judge, alarm_of
from seatrial.realtime.twin.faults.stuck import FOLLOWS, JAMMED, SLOW, Steering
from seatrial.realtime.twin.faults.suspects import JUMP, LAZY, LOST, MISREAD, REVERSED, SCALED, STUCK, Evidence, Suspect
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.page.screen import _points
from seatrial.realtime.twin.saved import load_state, save_state
from seatrial.realtime.twin.settings import usual
from seatrial.realtime.twin.sources import channels_of, moving, noise_of, rows_of
from seatrial.realtime.twin.tally import Hour, Tally
from seatrial.ships.files import load

SHIP = load("kvlcc2")
ALL = ("x", "y", "psi", "r", "u_w", "v_north", "v_east", "n_P", "delta")


def acting(*held: str) -> Acting:
    model: Any = SimpleNamespace(controls=("n_P", "delta"), stands_for=(("n_P", 1.0), ("rudder", -1.0)))
    return Acting(model, held)


def around(one: Acting) -> dict[str, float]:
    return dict(zip(AROUND, one.now[2:].tolist(), strict=True))


def test_apparent_wind_is_true_wind_and_motion() -> None:
    """A wind of 12 m/s from 200 deg, felt on a ship that goes and drifts on 70 deg, is found again."""
    one, way, psi, u, v = acting(), math.radians(200.0), math.radians(70.0), 6.0, -0.8
    ahead, aside = 12.0 * math.cos(way - psi) + u, 12.0 * math.sin(way - psi) + v
    felt = {"U_A": math.hypot(ahead, aside), "gamma_A": math.atan2(aside, ahead)}
    one.heed(felt, None)
    assert around(one)["wind_x"] == 0.0
    one.heed(felt, np.array([5.0, 7.0, psi, u, v, 0.01]))
    assert around(one)["wind_x"] == pytest.approx(12.0 * math.cos(way))
    assert around(one)["wind_y"] == pytest.approx(12.0 * math.sin(way))
    one.heed({"U_T": 3.0, "gamma_T": 1.0}, None)
    assert (around(one)["wind_x"], around(one)["wind_y"]) == pytest.approx((3.0 * math.cos(1.0), 3.0 * math.sin(1.0)))


def test_current_waves_and_depth_are_as_logged_and_stay() -> None:
    one = acting()
    one.heed({"U_C": 0.5, "gamma_C": 2.0, "H_S": 3.0, "gamma_W": -1.0, "T_W": 8.0, "depth": 25.0}, None)
    one.heed({"depth": math.nan}, None)
    found = around(one)
    assert (found["current_x"], found["current_y"]) == pytest.approx((0.5 * math.cos(2.0), 0.5 * math.sin(2.0)))
    assert (found["wave_x"], found["wave_y"]) == pytest.approx((3.0 * math.cos(1.0), -3.0 * math.sin(1.0)))
    assert (found["wave_T"], found["per_depth"]) == pytest.approx((8.0, 0.04))


def test_controls_move_along_a_line_or_are_held_and_orders_stand_for_them() -> None:
    one = acting("n_P")
    assert not one.known
    one.heed({"n_P": 1.0, "rudder": 0.2}, None)
    assert one.known
    assert one.now[:2].tolist() == [1.0, -0.2]
    before = one.now.copy()
    np.testing.assert_array_equal(one.between(np.full(10, math.nan))[:2], [1.0, -0.2])
    one.heed({"n_P": 2.0, "delta": 0.4, "rudder": 9.0}, None)
    assert one.now[:2].tolist() == [2.0, 0.4]
    np.testing.assert_allclose(one.between(before)[:2], [1.0, 0.1])


def test_a_control_at_fault_acts_as_its_fault_says() -> None:
    assert Override(STUCK, 0.1).acts(0.3, 1.0) == 0.1
    assert Override(REVERSED, 0.0).acts(0.3, 1.0) == -0.3
    assert Override(MISREAD, 0.05).acts(0.3, 1.0) == pytest.approx(0.25)
    assert Override(SCALED, 0.1).acts(2.0, 1.0) == pytest.approx(1.8)
    # thrust goes with the square of the revolutions
    assert Override(LOST, 0.36).acts(2.0, 1.0) ** 2 == pytest.approx(0.64 * 4.0)
    slow = Override(LAZY, 0.0, rate=0.02)
    assert [round(slow.acts(0.1, 2.0), 9) for _ in range(4)] == [0.04, 0.08, 0.1, 0.1]


def test_settings_go_by_length_and_speed_and_say_what_they_mean() -> None:
    """Stationary spreads, walks and times as the docs state them, in lengths and lengths over speed."""
    L, U = SHIP.L_pp, SHIP.speed
    T = L / U
    some = usual(SHIP, ALL, noise={"r": 1e-4}, free=("hull.R_0",))
    assert set(some.memory.values()) == {20.0 * T}
    for name, size in (("slow.u", 0.001 * U / T), ("slow.v_m", 0.01 * U / T), ("slow.r", 0.01 / T**2)):
        assert some.start[name] == pytest.approx(size)
        # a force that returns to zero has the spread that it begins with, for good
        assert some.process[name] ** 2 * some.memory[name] / 2.0 == pytest.approx(some.start[name] ** 2)
    current = "environment.current_x"
    assert some.start[current] == pytest.approx(0.1 * U)
    assert some.process[current] * math.sqrt(20.0 * T) == pytest.approx(0.01 * U)
    assert some.process["u"] * math.sqrt(T) == pytest.approx(0.002 * U)
    assert some.process["r"] * L == pytest.approx(some.process["u"])
    R_0 = float(SHIP.model.hull.R_0)
    assert some.start["hull.R_0"] == pytest.approx(0.1 * R_0)
    assert some.process["hull.R_0"] * math.sqrt(24 * 3600.0) == pytest.approx(0.2 * R_0)
    noise = some.sensors["rate gyro"].sd
    assert some.start["bias.r"] == pytest.approx(5.0 * noise)
    assert some.process["bias.r"] * 60.0 == pytest.approx(0.1 * noise)
    assert some.settle == pytest.approx(10.0 * T)
    assert some.step == pytest.approx(0.02 * T)
    assert (some.false_alarms, some.window, some.spacing) == (0.2, 90.0, 5.0)
    assert usual(load("suzaku"), ALL).settle >= 120.0
    assert "bias.r" not in usual(SHIP, ALL, gyro_bias=False).start
    loud = usual(SHIP, ALL, noise={"x": 7.0, "psi": 0.05})
    assert (loud.sensors["position"].sd, loud.sensors["compass"].sd) == (7.0, 0.05)


def test_noise_is_that_of_the_scatter_and_of_a_pair_the_larger() -> None:
    """Noise on smooth motion, a heading that passes north, and steps of a coarse instrument."""
    rng, t = np.random.default_rng(3), np.arange(1200.0)
    smooth = {"x": 5.0 * t, "y": 40.0 * np.sin(t / 90.0), "psi": 0.01 * t, "r": 0.01 + 0 * t, "u_w": 5.0 + 0 * t}
    noise = {"x": 0.3, "y": 0.6, "psi": 0.002, "r": 1e-4, "u_w": 0.05}
    channels = {name: values + noise[name] * rng.standard_normal(t.size) for name, values in smooth.items()}
    channels["psi"] %= math.tau
    channels["u_w"] = np.round(channels["u_w"] / 0.4) * 0.4
    channels["U_G"], channels["gamma_G"] = 5.0 + 0.02 * rng.standard_normal(t.size), 2.0 + 0 * t
    found = noise_of(Trial("a", t, channels, {}, {}))
    assert found["x"] == found["y"] == pytest.approx(0.6, rel=0.15)
    assert found["psi"] == pytest.approx(0.002, rel=0.15)
    assert found["r"] == pytest.approx(1e-4, rel=0.15)
    assert 0.19 < found["u_w"] < 0.5
    assert found["v_north"] == found["v_east"] == pytest.approx(0.02 * math.sin(2.0), rel=0.2)


def test_rows_have_course_and_speed_as_components_and_no_gaps() -> None:
    trial = Trial("a", np.arange(3.0), {"x": np.array([0.0, math.nan, 2.0]), "U_G": np.array([2.0, 2.0, 3.0]),
                                        "gamma_G": np.array([0.0, 0.5, 2.0])}, {}, {})  # fmt: skip
    rows = list(rows_of(trial))
    assert [t for t, _ in rows] == [0.0, 1.0, 2.0]
    assert "x" not in rows[1][1]
    assert rows[1][1]["v_north"] == pytest.approx(2.0 * math.cos(0.5))
    assert rows[2][1]["v_east"] == pytest.approx(3.0 * math.sin(2.0))
    assert set(moving(trial.channels)) == {"x", "U_G", "gamma_G", "v_north", "v_east"}
    assert channels_of(trial, ("x",)) == ("x", "U_G", "gamma_G", "v_north", "v_east")


def named(cause: str, score: float, how: str = JUMP, size: tuple[float, ...] = (5.0,), held: float = 0.2) -> Evidence:
    what = ("delta",) * len(size) if how != JUMP else (f"x of {cause}",)
    return Evidence(Suspect(cause, how, what, (10.0,) * len(size), "m"), score, 7.0, size, (0.1,), held)


def test_a_fault_is_named_after_an_outlier_would_be_gone_and_without_a_rival_at_once() -> None:
    judge = Judge(30.0)
    times = [t for t in np.arange(0.0, 40.0, 0.5).tolist() if judge.named(t, [named("a", 60.0)]) is not None]
    assert times[0] == 2.5
    judge.clear()
    close = [named("a", 60.0), named("b", 51.0), named("a", 59.0)]
    times = [t for t in np.arange(0.0, 40.0, 0.5).tolist() if judge.named(t, close) is not None]
    assert times[0] == 20.0
    judge.clear()
    assert judge.named(0.0, [named("a", 60.0)]) is None
    assert judge.named(1.0, [named("a", 29.0)]) is None
    assert judge.named(3.0, [named("a", 60.0)]) is None  # it was below the limit meanwhile
    found = judge.named(30.0, [named("a", 60.0), named("b", 56.5), named("c", 55.5)])
    assert found is not None
    assert found[1] == ("b",)
    judge.clear()
    for t in (0.0, 30.0):  # a tenth of its usual size matters, and thrust is not lost by less than nothing
        assert judge.named(t, [named("a", 60.0, size=(0.9,))]) is None
        assert judge.named(t, [named("a", 60.0, LOST, (-3.0,))]) is None
    judge.clear()
    assert [judge.named(t, [named("a", 60.0, LOST, (3.0,))]) is not None for t in (0.0, 30.0)] == [False, True]


def test_an_alarm_says_what_where_and_how_much() -> None:
    jammed = alarm_of(named("delta jammed", 60.0, STUCK, (1.0, 0.05)), 9.0, ("b",), False)
    assert (jammed.held, jammed.size, jammed.what, jammed.since, jammed.named) == (0.25, (), ("delta",), 7.0, 9.0)
    assert jammed.text == "delta jammed, since t = 7 s; cannot be told from: b"
    frozen = alarm_of(named("x jumped", 60.0), 9.0, (), True)
    assert (frozen.cause, frozen.how) == ("x frozen", "frozen")
    turned = Alarm("compass jumped", JUMP, ("psi",), 7.0, 9.0, (math.radians(3.0),), "rad")
    assert turned.text == "compass jumped by 3 deg, since t = 7 s"
    assert turned.ended(50.0).over == 50.0
    assert alarm_of(named("x jumped", 60.0), 9.0, (), False).text == "x jumped by 5 m, since t = 7 s"


@pytest.mark.slow
def test_an_hour_is_right_as_often_as_its_band_says() -> None:
    """The band of the mean of n normal squares, by the distribution of scipy; hours begin at full hours of the log."""
    hour = Hour(0.0, 1000.0, 1000)
    low, high = hour.band(0.95)
    assert (low, high) == pytest.approx((chi2.ppf(0.025, 1000) / 1000.0, chi2.ppf(0.975, 1000) / 1000.0))
    rng, tally = np.random.default_rng(5), Tally()
    for k in range(4 * 3600):
        tally.note(k + 1800.0, float(np.sum(rng.standard_normal(3) ** 2)), 3)
    assert [one.start for one in tally.hours] == [0.0, 3600.0, 7200.0, 10800.0, 14400.0]
    assert [one.readings for one in tally.hours] == [5400, 10800, 10800, 10800, 5400]
    assert all(one.inside(0.999) for one in tally.hours)
    assert tally.level == pytest.approx(1.0, abs=0.1)
    assert tally.level >= 1.0
    for k in range(1000):
        tally.note(20000.0 + k, 36.0, 4)  # one time constant of 4000 readings
    assert tally.level == pytest.approx(9.0 - 8.0 * math.exp(-1.0), rel=0.03)


@pytest.mark.parametrize(("lag", "share", "word"), [(0.0, 1.0, FOLLOWS), (6.0, 1.0, FOLLOWS), (0.0, 0.3, SLOW),
                                                    (6.0, 0.3, SLOW), (6.0, 0.0, JAMMED)])  # fmt: skip
def test_a_rudder_is_judged_after_the_lag_of_its_servo(lag: float, share: float, word: str) -> None:
    """Orders of 20 deg either way each 25 s, rows of half a second, a dead time of six seconds."""
    steering, angle, words, orders = Steering("delta", 0.04, lag), 0.0, [], list[float]()
    for k in range(240):
        orders.append(0.35 * (1.0 if (k // 50) % 2 else -1.0))
        steering.note(0.5 * k, {"delta": angle, "delta_cmd": orders[-1]})
        wanted = orders[max(0, k - int(2.0 * lag))]
        angle += min(max(wanted - angle, -0.02 * share), 0.02 * share)
        if (verdict := steering.verdict()) is not None and k > 60:
            words.append(verdict[0])
    assert len(words) > 60
    assert words.count(word) > 0.9 * len(words)


@pytest.fixture
def twin(monkeypatch: pytest.MonkeyPatch):
    """A twin of the linear ship, which needs no compiled model: 20 s to its length, settled after 60 s."""
    here = machine(settle=60.0)
    monkeypatch.setattr(live, "made", lambda ship, settings: here)
    monkeypatch.setattr(follow, "values", lambda model: {})
    return lambda: Live(here.ship, here.settings)


def fed(one: Live, run: Sailed, first: int = 0, last: int | None = None) -> Live:
    for t, controls, readings in zip(run.t[first:last], run.acting[first:last], run.readings[first:last], strict=True):
        values = dict(zip(CHANNELS, readings.tolist(), strict=True)) | {"n_P": controls[0], "delta": controls[1]}
        one.feed(float(t), {name: value for name, value in values.items() if math.isfinite(value)})
    return one


@pytest.mark.slow
def test_a_sound_log_gets_no_alarm_and_each_sensor_that_jumps_its_own(twin) -> None:
    for name, by in {"": 0.0, "x": 15.0, "psi": 0.05, "r": 4e-3, "u_w": 0.9}.items():
        run = sailed(260, seed=4)
        if name:
            run.readings[150:, CHANNELS.index(name)] += by
        one = fed(twin(), run)
        causes = {"x": "position jumped", "psi": "compass jumped", "r": "rate gyro jumped", "u_w": "log jumped"}
        assert [alarm.cause for alarm in one.alarms] == ([causes[name]] if name else [])
        if name:
            # a step of the log and its scale are two faults of one instrument, which are waited for
            assert name in one.masked
            assert math.isinf(one.alarms[0].over)
            assert one.follower is not None
            k = ("x", "y", "psi", "u", "v_m", "r").index({"u_w": "u"}.get(name, name))
            assert abs(one.follower.mean[k] - run.true[-1, k]) < 5.0 * math.sqrt(one.follower.cov[k, k])


@pytest.mark.slow
def test_a_sensor_is_believed_again_a_minute_after_it_agrees_and_a_new_datum_after_five(twin) -> None:
    run = sailed(700, seed=4)
    run.readings[150:250, CHANNELS.index("u_w")] += 0.9
    one = fed(twin(), run)
    (alarm,) = one.alarms
    assert 310.0 <= alarm.over < 325.0
    assert one.masked == ()
    run = sailed(700, seed=4)
    run.readings[150:, :2] += [40.0, -30.0]
    one = fed(twin(), run)
    assert one.alarms[0].cause == "position jumped"
    assert 300.0 < one.alarms[0].over - one.alarms[0].named < 310.0
    assert one.follower is not None
    np.testing.assert_allclose(one.follower.mean[:2], run.readings[-1, :2], atol=5.0)
    run = sailed(700, seed=4)
    run.readings[150:, CHANNELS.index("u_w")] += 0.9
    one = fed(twin(), run)
    assert [math.isinf(alarm.over) for alarm in one.alarms] == [True]


@pytest.mark.slow
def test_a_control_at_fault_is_lived_with_until_it_heals(twin) -> None:
    """A rudder shown 0.08 rad too far to starboard from 180 s to 400 s: the estimate stays right throughout."""
    run = sailed(600, seed=4)
    shown = Sailed(run.t, run.true, run.acting.copy(), run.readings)
    shown.acting[180:400, 1] += 0.08
    one = fed(twin(), shown)
    assert one.alarms[0].cause == "delta sensor jumped"
    assert one.alarms[0].size[0] == pytest.approx(0.08, rel=0.25)
    assert 400.0 < one.alarms[0].over < 460.0
    assert len(one.alarms) == 1
    middle = fed(twin(), shown, 0, 399)
    assert middle.acting[1] == pytest.approx(run.acting[398, 1], abs=0.02)


@pytest.mark.slow
def test_a_shaft_without_thrust_acts_as_one_that_rests(twin) -> None:
    run = sailed(260, seed=4)
    onward, pushed = step_of(1.0)
    z = np.zeros(11)
    for k in range(150, 260):
        z = onward @ z + pushed @ [-1.0, 0.0]
        run.readings[k] += np.array([z[0], z[1], z[2], z[5], z[3] - z[6]])
    one = fed(twin(), run)
    assert one.alarms[0].cause == "n_P without its thrust"
    assert one.alarms[0].size[0] == pytest.approx(1.0, abs=0.2)
    assert abs(one.acting[0]) < 0.45


@pytest.mark.slow
def test_gaps_and_clocks_that_go_back_begin_the_motion_anew_and_keep_what_is_known(twin) -> None:
    run = sailed(500, seed=4)
    one = fed(twin(), run, 0, 200)
    assert one.follower is not None
    before = one.follower
    fed(one, run, 290, 291)  # 90 s are less than five lengths
    assert one.counts.gaps == 0
    one = fed(twin(), run, 0, 200)
    fed(one, run, 310, 311)  # 110 s are more
    assert one.counts.gaps == 1
    walked = before.cov[6:, 6:] + np.diag(one.machine.density[6:]) * 111.0
    np.testing.assert_allclose(one.follower.cov[6:, 6:], walked, rtol=1e-9)
    np.testing.assert_allclose(one.follower.mean[6:], before.mean[6:])
    np.testing.assert_allclose(one.follower.mean[:3], run.readings[310, :3])
    assert one.last is None
    fed(one, run, 300, 301)  # less than a length late
    assert (one.counts.late, one.counts.restarts) == (1, 0)
    fed(one, run, 100, 101)
    assert (one.counts.late, one.counts.restarts) == (1, 1)
    assert one.alarms[-1].cause == "the clock was set back"


@pytest.mark.slow
def test_more_than_six_faults_in_an_hour_are_a_wrong_model(twin) -> None:
    """A receiver that jumps to and fro each 200 s: six are its own; the seventh means that nothing is believed."""
    run, state = sailed(2600, seed=4), 1.0
    for k in range(100, 2600, 130):
        state = -state
        run.readings[k : k + 130, CHANNELS.index("u_w" if state < 0.0 else "psi")] += 1.2 if state < 0.0 else 0.08
    one = fed(twin(), run)
    assert one.alarms[-1].cause == WRONG
    assert len(one.alarms) == 7
    assert one.masked == ()
    assert one.active == ()


@pytest.mark.slow
def test_a_saved_twin_is_the_same_twin(twin, tmp_path: Path) -> None:
    """All that a card shows and all that goes on, with an alarm that lasts."""
    run = sailed(400, seed=4)
    run.readings[150:, CHANNELS.index("u_w")] += 0.9
    one, other = fed(twin(), run, 0, 300), twin()
    one.tally.level = 1.25
    save_state(one, tmp_path / "a.json")
    assert load_state(other, tmp_path / "a.json") == one.follower.t
    assert repr(other.alarms) == repr(one.alarms)  # NaN is no equal
    assert other.tally.hours == one.tally.hours
    assert other.tally.level == 1.25
    assert other.trust.scores == one.trust.scores
    assert other.trust.scores[30.0].count > 0
    assert other.masked == one.masked == ("u_w",)
    np.testing.assert_array_equal(other.follower.cov, one.follower.cov)
    about = json.loads((tmp_path / "a.json").read_text())
    about["alarms"][0] |= {"held": 0.5, "rate": 0.25, "over": 9.0, "score": 3.0}
    (tmp_path / "a.json").write_text(json.dumps(about))
    load_state(other, tmp_path / "a.json")
    (alarm,) = other.alarms
    assert (alarm.held, alarm.rate, alarm.over, alarm.score) == (0.5, 0.25, 9.0, 3.0)
    assert NOISE.shape == (5,)
    for change, said in (
        ({"masked": {"u_w": 1}}, "masked.u_w is no channel"), ({"masked": {"z": 0}}, "masked.z is no channel"),
        ({"mean": about["mean"][1:]}, "mean, cov and acting must be of"), ({"level": "1"}, "level is '1'"),
        ({"levle": 1.0}, "no key 'levle'; near: level"),
    ):  # fmt: skip
        (tmp_path / "b.json").write_text(json.dumps({**about, **change}))
        with pytest.raises(StudyError, match=rf"b\.json: .*{said}.*; remove it, or give another folder"):
            load_state(other, tmp_path / "b.json")


@pytest.mark.slow
def test_a_card_shows_what_changed_by_how_much_and_the_hours_of_the_log() -> None:
    """Resistance a fifth up is +20 %; hours count from the beginning of the log; forecasts by horizon."""
    one = Live(SHIP, usual(SHIP, ALL, free=("hull.R_0",), antenna=None))
    one.feed(7200.0, dict.fromkeys(ALL, 0.0) | {"u_w": 7.0, "v_north": 7.0, "n_P": 1.5})
    assert one.follower is not None
    mean = one.follower.mean.copy()
    mean[one.machine.names.index("hull.R_0")] *= 1.2
    one.follower = replace(one.follower, mean=mean)
    one.tally.hours = [Hour(7200.0, 330.0, 300)]
    one.trust.scores[120.0] = Score(4, [400.0, 1600.0], 6)
    (learnt,) = parameters(one)
    assert learnt["value"] == pytest.approx(1.2 * learnt["before"])
    document, text = page(one, "a.csv").document, page(one, "a.csv").html
    assert "+20.0 %" in text
    assert document["hours"][0]["nis"] == pytest.approx(1.1)
    assert document["forecasts"]["120.0"] == {"count": 4, "rms": 10.0, "constant": 20.0, "held": 0.75}
    hours = text[text.index("Consistency") :]
    assert "<td>2</td>" in hours.replace(' class="number"', "")
    names = {each["name"]: each for each in document["unseen"]}
    assert names["antenna, forward of midship"]["sd"] == pytest.approx(0.3 * SHIP.L_pp)


def test_bands_of_the_page_are_across_and_along_the_course() -> None:
    """An ellipse of 30 m ahead and 4 m across a course of 40 deg, at a drift of 10 deg."""
    psi, beta = math.radians(30.0), math.radians(10.0)
    c, s = math.cos(psi + beta), math.sin(psi + beta)
    turn = np.array([[c, -s], [s, c]])
    cov = np.zeros((1, 3, 3))
    cov[0, :2, :2], cov[0, 2, 2] = turn @ np.diag([900.0, 16.0]) @ turn.T, 1e-4
    mean = np.array([[1.0, 2.0, psi, math.cos(beta), math.sin(beta), 0.0]])
    ((t, x, y, across, along, heading, wide),) = _points(Forecast(np.array([5.0]), mean, cov))
    assert (t, x, y, heading) == pytest.approx((0.0, 1.0, 2.0, psi), rel=1e-5)
    assert (across, along, wide) == pytest.approx((1.6449 * 4.0, 1.6449 * 30.0, 1.6449 * 0.01), rel=1e-4)

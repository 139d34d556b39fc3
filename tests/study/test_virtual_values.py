"""A source of virtual trials from its table: degrees to radians, whose speed and current count, levels of a bench."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.core.records import filled
from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.environment.weather import Gust
from seatrial.identify import StudyError
from seatrial.ships.files import load
from seatrial.simulate.approach import approach
from seatrial.study import data as reading
from seatrial.study import virtual
from seatrial.study.schema import SmootherTable, VirtualTable
from seatrial.study.virtual import Bench, Sail, VirtualTrials

DEG = math.pi / 180.0
L7 = load("kvlcc2_l7")
TURN = {"type": "turning:Turning", "rudder": 20.0}


def made(trials: dict[str, Any] | None = None, **more: Any) -> VirtualTrials:
    table = {"ship": "kvlcc2_l7", "seed": 3, "trials": {"a": TURN} if trials is None else trials, **more}
    return virtual.read(filled(VirtualTable, table, "s.toml", StudyError))


def refused(told: str, trials: dict[str, Any] | None = None, **more: Any) -> None:
    with pytest.raises(StudyError, match=told):
        made(trials, **more)


def policy(**one: Any) -> Any:
    return made({"a": {"type": "zigzag:Zigzag", **one}}).sails["a"].policy


@pytest.mark.slow
def test_a_manoeuvre_has_the_side_of_its_rudder_and_angles_in_radians() -> None:
    port, starboard = policy(rudder=-15.0, heading=12.0), policy(rudder=15.0)
    assert (port.delta, port.psi, port.side) == (pytest.approx(15 * DEG), pytest.approx(12 * DEG), -1.0)
    assert (starboard.delta, starboard.psi, starboard.side) == (pytest.approx(15 * DEG), pytest.approx(10 * DEG), 1.0)
    assert starboard.n_P == pytest.approx(approach(L7)[1])
    assert policy(revolutions=8.0).n_P == 8.0
    assert policy(set={"psi": 0.5}).psi == 0.5
    assert policy(rudder=35.0).delta == pytest.approx(35 * DEG)


@pytest.mark.parametrize(("one", "told"), [
    ({"rudder": 35.1}, "rudder is 35.1 deg; the rudder of kvlcc2_l7 goes to 35 deg"),
    ({"rudder": -35.1}, "rudder is -35.1 deg"), ({"set": {"psy": 1.0}}, "set: no setting 'psy'"),
    ({"type": "turning:Nothing"}, "virtual.trials.a.type"), ({"set": {"psi": -5.0}}, "virtual.trials.a: "),
    ({"type": "autopilot:usual_gains"}, "virtual.trials.a.type"),
])  # fmt: skip
def test_a_manoeuvre_that_cannot_be_is_refused(one: dict[str, Any], told: str) -> None:
    refused(told, {"a": {"type": "zigzag:Zigzag", **one}})


@pytest.mark.slow
def test_revolutions_are_those_that_a_thruster_was_tested_at() -> None:
    from seatrial.identify.lint import tested

    otter = load("otter")
    low, high = tested(otter)["n_port"]
    straight = {"type": "straight:Straight"}
    assert made({"a": {**straight, "revolutions": high}}, ship="otter").sails["a"].policy is not None
    for n in (low - 0.1, 1.01 * high):
        refused(rf"revolutions is {n:g} 1/s; thrust by n_port of otter", {"a": {**straight, "revolutions": n}},
                ship="otter")  # fmt: skip


@pytest.mark.slow
def test_a_trial_has_its_own_speed_duration_and_current_else_those_of_all() -> None:
    flow = {"speed": 0.4, "towards": 90.0}
    found = made({"a": {**TURN, "speed": 0.9, "duration": 5.0, "current": flow}, "b": TURN}, speed=1.1, duration=3.0,
                 sample=0.5, current={"speed": 0.2, "towards": 180.0},
                 wind={"speed": 0.0, "from": 30.0})  # fmt: skip
    assert found.sails["a"] == Sail(found.sails["a"].policy, 0.9, 5.0, (0.4, pytest.approx(0.5 * math.pi)))
    assert (found.sails["b"].speed, found.sails["b"].duration, found.sails["b"].current) == (None, None, None)
    one, other = (found.weather(k).now() for k in (0, 1))
    assert (one.current_x, one.current_y) == pytest.approx((0.0, 0.4), abs=1e-12)
    assert (other.current_x, other.current_y) == pytest.approx((-0.2, 0.0), abs=1e-12)
    a, b = found.run()
    assert (a.duration, b.duration) == (pytest.approx(5.0), pytest.approx(3.0))
    assert (a["u"][0], b["u"][0]) == (pytest.approx(0.9, abs=1e-6), pytest.approx(0.9, abs=1e-6))
    assert np.diff(a.t) == pytest.approx(0.5)
    assert a.meta["source"] == "virtual trial of kvlcc2_l7, seed 3; controls as ordered"
    assert set(a.channels) == {"x", "y", "psi", "u", "v_m", "r", "n_P", "delta"}


@pytest.mark.slow
def test_the_log_tells_order_and_angle_where_it_is_asked_to() -> None:
    both = made(orders=False, duration=4.0, lag={"rudder": 2.0})
    (trial,) = both.run()
    assert {"delta", "delta_cmd", "n_P"} <= set(trial.channels)
    assert trial["delta_cmd"][-1] == pytest.approx(20 * DEG)
    assert trial["delta"][1] < 0.7 * trial["delta_cmd"][1]
    assert trial.meta["source"].endswith("controls as acting")
    (ordered,) = made(duration=4.0, lag={"rudder": 2.0}).run()
    assert ordered["delta"] == pytest.approx(20 * DEG)
    assert "delta_cmd" not in ordered.channels
    refused("virtual.lag: no actuator 'helm'", lag={"helm": 1.0})


@pytest.mark.slow
def test_noise_is_in_degrees_where_it_is_an_angle_and_differs_by_trial_and_seed() -> None:
    noise = {"x": 0.2, "psi": 2.0, "r": 1.0, "delta": 3.0, "n_P": 0.1}
    found = made({"a": TURN, "b": TURN}, noise=noise, duration=60.0, sample=0.2)
    assert found.sensors.noise \
        == pytest.approx({"x": 0.2, "psi": 2 * DEG, "r": DEG, "delta": 3 * DEG, "n_P": 0.1})
    clean = replace(found, sensors=replace(found.sensors, noise={})).run()[0]
    a, b = found.run()
    for name, size in (("x", 0.2), ("psi", 2 * DEG), ("delta", 3 * DEG)):
        errors = a[name] - clean[name]
        assert errors.std() == pytest.approx(size, rel=0.2)
        assert abs(np.corrcoef(errors, b[name] - clean[name])[0, 1]) < 0.25
    again = found.run()[0]
    assert again["x"].tolist() == a["x"].tolist()
    assert replace(found, seed=4).run()[0]["x"].tolist() != a["x"].tolist()
    refused("virtual.noise: no channel 'depth'", noise={"depth": 1.0})


def test_times_are_above_zero_and_samples_whole_steps() -> None:
    for key in ("duration", "sample", "step"):
        refused(f"virtual.{key} is 0 s; it must be above zero", **{key: 0.0})
    refused(r"virtual\.sample is 0\.25 s; a whole number of steps of 0\.1 s", sample=0.25)
    refused(r"virtual\.sample is 0\.05 s", sample=0.05)
    assert made(sample=0.1).sample == 0.1
    assert made(sample=0.3).sample == 0.3


@pytest.mark.slow
def test_wind_blows_on_a_ship_that_feels_it_with_gusts_of_each_trial() -> None:
    refused("virtual.wind: kvlcc2_l7 has no force of wind", wind={"speed": 5.0})
    found = made({"a": TURN, "b": TURN}, ship="kvlcc2", wind={"speed": 5.0, "from": 90.0, "gusts": "davenport"},
                 known=True)  # fmt: skip
    assert found.wind == Uniform(5.0, pytest.approx(0.5 * math.pi), 0.0, 0.0)
    assert found.known == ("wind", "current")
    a, b, again = (found.weather(k) for k in (0, 1, 0))
    assert isinstance(a, Gust)
    series = [one.series(1.0, 20)[:, 1].tolist() for one in (a, b, again)]
    assert series[0] == series[2] != series[1]
    assert made(known=["current"]).known == ("current",)
    assert made().known == ()


@pytest.mark.parametrize(("force", "told"), [
    ({"type": "wind:Nothing"}, "virtual.wind_force.type"),
    ({"type": "wind:Fujiwara", "colour": 1.0}, "virtual.wind_force: no key 'colour'"),
])  # fmt: skip
def test_a_force_of_wind_that_is_none_is_refused(force: dict[str, Any], told: str) -> None:
    refused(told, ship="kvlcc2", wind_force=force)
    refused("takes no force of wind", ship="mariner", wind_force={"type": "wind:Fujiwara"})


def thrust(n: float) -> float:
    return 2.0 * n * abs(n)


def test_a_bench_pulls_each_thruster_at_each_level_so_often() -> None:
    part = type("Part", (), {"thrust": staticmethod(thrust)})()
    model = type("Model", (), {"thrusters": {"port": part, "starboard": part}})()
    ship: Any = type("Ship", (), {"model": model})()
    bench = Bench((1.0, 2.0, 3.0), 400, 0.5)
    found = VirtualTrials(ship, {}, bench=bench, seed=5).pulled()
    assert list(found) == ["port", "starboard"]
    errors = []
    for n, pull in found.values():
        assert n.tolist() == [1.0] * 400 + [2.0] * 400 + [3.0] * 400
        errors.append(pull - 2.0 * n * n)
        assert errors[-1].std() == pytest.approx(0.5, rel=0.1)
    assert abs(np.corrcoef(errors)[0, 1]) < 0.15
    exact = VirtualTrials(ship, {}, bench=Bench((-1.0, 2.0)), seed=5).pulled()["port"]
    assert exact[1].tolist() == [-2.0, 8.0]
    assert VirtualTrials(ship, {}).pulled() == {}


def test_a_bench_has_three_levels_ahead_and_thrusters_to_pull_at() -> None:
    refused("virtual.bench: mariner has no thrusters", ship="mariner", bench={"revolutions": [1.0, 2.0, 3.0]})
    ship = {"ship": "otter", "trials": {"a": {"type": "straight:Straight"}}}
    found = made(**ship, bench={"revolutions": [-1.0, 1.0, 2.0, 3.0], "repeats": 2, "noise": 0.5})
    assert found.bench == Bench((-1.0, 1.0, 2.0, 3.0), 2, 0.5)
    refused("has 2 levels ahead; a map needs 3", bench={"revolutions": [-1.0, 0.0, 1.0, 1.0, 2.0]}, **ship)


def test_a_smoother_has_the_noises_and_the_disturbances_of_its_table() -> None:
    said = SmootherTable(position=0.5, heading=0.02, antenna=(1.0, -2.0), delay=0.3, current=0.01,
                         process={"u": 0.1}, parameters={"hull.N_r": 0.004})  # fmt: skip
    found = reading.kalman(said, L7)
    antenna: Any = found.measurement["gnss"]
    compass: Any = found.measurement["compass"]
    assert (antenna.sd, antenna.x, antenna.y, antenna.delay) == (0.5, 1.0, -2.0, 0.3)
    assert (compass.sd, compass.delay) == (0.02, 0.3)
    assert found.process == {"u": 0.1, "current": 0.01}
    assert found.current is True
    (free,) = found.parameters
    assert (free.path, free.sigma, free.start) == ("hull.N_r", 0.004, free.prior)
    still = reading.kalman(replace(said, current=0.0), L7)
    assert still.process == {"u": 0.1}
    assert still.current is False
    with pytest.raises(StudyError, match=r"no parameter|hull\.N_x"):
        reading.kalman(replace(said, parameters={"hull.N_x": 1.0}), L7)


def test_a_smoothed_trial_keeps_its_own_current_and_takes_none_from_the_filter(monkeypatch: pytest.MonkeyPatch) -> None:
    t = np.arange(4.0)
    log = Trial("a", t, {"x": t, "U_C": 0.5 + 0.0 * t})
    smooth = Trial("a", t, {"x": 2.0 * t, "U_C": 9.0 + 0.0 * t, "gamma_C": 0.0 * t})
    chain = type("Found", (), {"smoothed": lambda self: self, "trial": lambda self: smooth})()
    monkeypatch.setattr(reading, "kalman", lambda said, ship: type("K", (), {"run": lambda self, s, x: chain})())
    monkeypatch.setattr(reading, "own_samples", lambda trial: trial)
    found = reading.smoothed(None, L7, log)
    assert found["x"].tolist() == [0.0, 2.0, 4.0, 6.0]
    assert found["U_C"].tolist() == [0.5] * 4
    assert "gamma_C" not in found.channels

"""A manoeuvre as it is ordered: degrees and percent become radians and shares, and a run ends where the ship does."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import RequestError, SimulationError
from seatrial.data import DataError, Trial
from seatrial.environment.weather import Gust
from seatrial.forces import HARD_OVER
from seatrial.forces.shallow import SHALLOWEST
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.workflow import simulation
from seatrial.workflow.asked import Approach, Around, Orders, Span
from seatrial.workflow.request import check_output, make_folder, separate, surroundings
from seatrial.workflow.simulation import ahead_of, helm_of, lacks, order, simulate

DEG = math.pi / 180.0
L7, NOMOTO, CATAMARAN, OTTER = load("kvlcc2_l7"), load("mariner_nomoto"), load("wamv_16"), load("otter")


def test_set_points_of_a_zigzag_are_radians_on_the_side_that_is_asked_for() -> None:
    for side, sign in (("starboard", 1.0), ("port", -1.0)):
        made: Any = order("zigzag", L7, 1.2, 10.0, {"rudder": 20.0, "heading": 10.0, "side": side})
        assert (made.delta, made.psi, made.side) == (pytest.approx(20 * DEG), pytest.approx(10 * DEG), sign)
        assert made.n_P == 10.0
    turn: Any = order("turning", L7, 1.2, 10.0, {"side": "port"})
    assert turn.delta == pytest.approx(-35 * DEG)


def test_a_rudder_reaches_the_limit_of_the_ship_and_not_beyond() -> None:
    most = 35.0  # of kvlcc2_l7
    assert order("turning", L7, 1.2, 10.0, {"rudder": most}) is not None
    with pytest.raises(RequestError, match=r"--rudder is 35\.1 deg; the rudder of kvlcc2_l7 goes to 35 deg"):
        order("turning", L7, 1.2, 10.0, {"rudder": 35.1})


@pytest.mark.parametrize(("given", "told"), [
    ({"rudder": 0.0}, "--rudder is 0 deg"), ({"rudder": -5.0}, "--rudder is -5 deg"),
    ({"heading": 361.0}, "--heading is 361 deg"), ({"heading": math.nan}, "--heading is nan"),
    ({"side": "left"}, "--side is 'left'; known: port, starboard"),
    ({"seed": 3}, "zigzag takes no --seed; it takes --rudder, --heading, --side"),
])  # fmt: skip
def test_an_order_that_cannot_be_is_refused(given: dict[str, Any], told: str) -> None:
    with pytest.raises(RequestError, match=told):
        order("zigzag", L7, 1.2, 10.0, given)


def test_what_takes_no_option_says_so_and_a_whole_turn_is_a_heading() -> None:
    with pytest.raises(RequestError, match="straight takes no --side; it takes none of --rudder, --heading, --side, "):
        order("straight", L7, 1.2, 10.0, {"side": "port"})
    assert order("single-turn", L7, 1.2, 10.0, {"heading": 360.0}) is not None


def test_a_manoeuvre_by_the_engine_needs_one() -> None:
    kinds = simulation.known()
    assert lacks(NOMOTO, kinds["stopping"]) == "no revolutions move mariner_nomoto; its model has no engine"
    assert lacks(NOMOTO, kinds["turning"]) is None
    assert lacks(L7, kinds["stopping"]) is None
    with pytest.raises(RequestError, match="stopping: no revolutions move mariner_nomoto"):
        order("stopping", NOMOTO, 7.0, 1.0, {})


def test_a_demand_stands_for_a_rudder_angle_and_a_throttle_for_revolutions() -> None:
    assert helm_of(OTTER, "turning", Orders(steer=100.0)) == pytest.approx(HARD_OVER / DEG)
    assert helm_of(OTTER, "turning", Orders(steer=40.0)) == pytest.approx(0.4 * HARD_OVER / DEG)
    assert helm_of(L7, "turning", Orders(12.0)) == 12.0
    assert helm_of(OTTER, "turning", Orders()) is None
    assert ahead_of(CATAMARAN, Approach(throttle=40.0)) == pytest.approx(0.4)
    assert ahead_of(CATAMARAN, Approach(throttle=-100.0)) == -1.0
    assert ahead_of(L7, Approach(rps=9.0)) == 9.0
    assert ahead_of(CATAMARAN, Approach()) is None


@pytest.mark.parametrize(("ship", "rudder", "steer", "kind", "told"), [
    (OTTER, 10.0, None, "turning", "--rudder: otter has no rudder"),
    (L7, None, 10.0, "turning", "--steer: kvlcc2_l7 is steered by an angle"),
    (OTTER, None, 10.0, "straight", "straight takes no --steer"),
    (OTTER, None, 0.0, "turning", "--steer is 0 percent"),
    (OTTER, None, 101.0, "turning", "--steer is 101 percent"),
])  # fmt: skip
def test_a_helm_of_the_wrong_kind_is_refused(
    ship: Ship, rudder: float | None, steer: float | None, kind: str, told: str
) -> None:
    with pytest.raises(RequestError, match=told):
        helm_of(ship, kind, Orders(rudder, steer))


@pytest.mark.parametrize(("ship", "rps", "throttle", "told"), [
    (CATAMARAN, 1.0, None, "--rps: wamv_16 is driven by throttle"),
    (L7, None, 10.0, "--throttle: kvlcc2_l7 is driven by revolutions"),
    (CATAMARAN, None, 100.5, "--throttle is 100.5 percent"),
    (CATAMARAN, None, -100.5, "--throttle is -100.5 percent"),
])  # fmt: skip
def test_an_order_ahead_of_the_wrong_kind_is_refused(
    ship: Ship, rps: float | None, throttle: float | None, told: str
) -> None:
    with pytest.raises(RequestError, match=told):
        ahead_of(ship, Approach(None, rps, throttle))


@pytest.mark.slow
def test_settings_say_what_was_sailed_in_the_units_of_the_request() -> None:
    ran = simulate(L7, "zigzag", orders=Orders(15.0, heading=5.0, side="port"), span=Span(3.0, 0.2),
                   begin=Approach(1.0, rps=9.0))  # fmt: skip
    assert ran.settings["speed"] == 1.0
    assert ran.settings["rps"] == 9.0
    assert "throttle" not in ran.settings
    assert (ran.settings["rudder"], ran.settings["heading"]) == (pytest.approx(15.0), pytest.approx(5.0))
    assert (ran.settings["side"], ran.settings["dt"]) == ("port", 0.2)
    assert ran.settings["duration"] == pytest.approx(3.0)
    assert not ran.complete
    assert ran.reason == "not over after 3 s"
    assert ran.trial["u"][0] == 1.0
    by_throttle = simulate(CATAMARAN, "turning", orders=Orders(steer=50.0), begin=Approach(throttle=40.0),
                           span=Span(2.0))  # fmt: skip
    assert by_throttle.settings["throttle"] == pytest.approx(40.0)
    assert by_throttle.settings["steer"] == pytest.approx(50.0)
    assert by_throttle.settings["side"] == "starboard"
    assert "rudder" not in by_throttle.settings
    assert "side" not in simulate(L7, "straight", span=Span(1.0)).settings


def test_a_timed_manoeuvre_is_complete_when_its_time_is_over() -> None:
    ran = simulate(L7, "straight", span=Span(4.0))
    assert ran.complete
    assert ran.reason is None
    assert ran.trial.duration == pytest.approx(4.0)


def test_a_craft_that_starts_from_rest_does() -> None:
    assert simulate(L7, "acceleration", span=Span(2.0)).trial["u"][0] == 0.0


class Lengths:
    """Runs in place of the integrator: how long each was asked to be, and where it fails."""

    def __init__(self, fails_at: float = math.inf) -> None:
        self.asked: list[float] = []
        self.fails_at = fails_at

    def __call__(self, ship: Ship, policy: object, *, duration: float, **more: object) -> Trial:
        self.asked.append(duration)
        if duration > self.fails_at:
            raise SimulationError("left its validity", time=self.fails_at)
        t = np.linspace(0.0, duration, 3)
        rest = dict.fromkeys(("x", "y", "psi", "u", "v_m", "r", "n_P"), 0.0 * t)
        return Trial("run", t, {**rest, "delta": np.where(t > 0.0, 0.6, 0.0)})


@pytest.fixture
def lengths(monkeypatch: pytest.MonkeyPatch) -> Iterator[Lengths]:
    made = Lengths()
    monkeypatch.setattr("seatrial.simulate.run.simulate", made)
    return made


def test_a_run_without_a_duration_doubles_until_it_can_never_be_over(lengths: Lengths) -> None:
    """It begins with 30 ship lengths of way and ends before 2000 are exceeded."""
    ran = simulate(L7, "turning", begin=Approach(1.0))
    assert lengths.asked[0] == pytest.approx(30.0 * L7.L_pp)
    assert np.diff(np.log2(lengths.asked)) == pytest.approx(np.ones(len(lengths.asked) - 1))
    assert lengths.asked[-1] <= 2000.0 * L7.L_pp < 2.0 * lengths.asked[-1]
    assert ran.reason == f"not over after {ran.trial.duration:g} s"


def test_a_run_with_a_duration_is_made_once(lengths: Lengths) -> None:
    simulate(L7, "turning", begin=Approach(1.0), span=Span(50.0))
    assert lengths.asked == [50.0]


def test_a_run_that_leaves_the_ship_s_validity_ends_a_step_before(lengths: Lengths) -> None:
    lengths.fails_at = 40.0
    ran = simulate(L7, "turning", begin=Approach(1.0), span=Span(dt=0.5))
    assert lengths.asked == [pytest.approx(30.0 * L7.L_pp), pytest.approx(39.5)]
    assert not ran.complete
    assert ran.reason == "left its validity"
    lengths.fails_at = 1.0  # less than two steps are whole
    with pytest.raises(SimulationError, match="left its validity"):
        simulate(L7, "turning", begin=Approach(1.0), span=Span(dt=0.8))
    lengths.fails_at = 3.0
    assert simulate(L7, "turning", begin=Approach(1.0), span=Span(dt=1.0)).reason == "left its validity"


def test_a_ship_without_a_file_step_ends_its_own_step_before(lengths: Lengths) -> None:
    from seatrial.simulate.approach import time_step

    lengths.fails_at = 40.0
    simulate(L7, "turning", begin=Approach(1.0))
    assert lengths.asked[-1] == pytest.approx(40.0 - time_step(L7))


@pytest.mark.slow
def test_what_the_model_does_not_feel_or_hold_for_is_said() -> None:
    notes: list[str] = []
    simulate(NOMOTO, "turning", begin=Approach(rps=1.0), span=Span(20.0), note=notes.append)
    assert any("--rps: revolutions do not enter the model of mariner_nomoto" in line for line in notes)
    notes.clear()
    simulate(L7, "turning", begin=Approach(rps=10.0), span=Span(3.0), note=notes.append)
    assert not any("--rps" in line for line in notes)
    narrow = replace(L7, validity={**L7.validity, "delta": (-0.1, 0.1)})
    simulate(narrow, "turning", span=Span(8.0), note=notes.append)
    (line,) = notes
    assert line.startswith("note: delta went from 0 to 0.6109; the file of kvlcc2_l7 claims to hold within [-0.1, 0.1]")
    notes.clear()
    simulate(narrow, "turning", orders=Orders(side="port"), span=Span(8.0), note=notes.append)
    assert "from -0.6109 to 0" in notes[0]


@pytest.mark.slow
def test_thrust_is_asked_for_where_it_was_measured() -> None:
    from seatrial.identify.lint import tested

    low, high = tested(OTTER)["n_port"]
    for rps in (low - 1.0, high + 1.0):
        with pytest.raises(RequestError, match=f"--rps is {rps:g}; thrust by n_port of otter was tested from"):
            simulate(OTTER, "turning", begin=Approach(rps=rps), span=Span(1.0))
    assert simulate(OTTER, "straight", begin=Approach(rps=high), span=Span(0.2)).settings["rps"] == high


@pytest.mark.slow
def test_a_seed_is_zero_or_above() -> None:
    with pytest.raises(RequestError, match="--seed is -1"):
        simulate(L7, "random", orders=Orders(seed=-1), span=Span(1.0))
    assert simulate(L7, "random", orders=Orders(seed=0), span=Span(1.0)).complete


@pytest.mark.slow
def test_gusts_take_the_seed_and_blow_about_a_mean_wind() -> None:
    ship = load("kvlcc2")
    one, same, other = (surroundings(ship, Around(wind="10,0", gusts="davenport"), seed).weather for seed in (3, 3, 4))
    a, b, c = (weather.series(1.0, 50) for weather in (one, same, other))
    assert isinstance(one, Gust)
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a, c)
    with pytest.raises(RequestError, match="--gusts need a mean wind"):
        surroundings(ship, Around(gusts="davenport"))
    ran = simulate(ship, "straight", orders=Orders(seed=3), span=Span(2.0),
                   around=Around("10,0", "davenport"))  # a seed of the gusts
    assert ran.settings["gusts"] == "davenport"


def test_surroundings_are_told_back_in_degrees() -> None:
    made = surroundings(load("kvlcc2_shallow"), Around("10,30", current="0.5,-90", waves="2,8,45", depth=30.0))
    assert made.settings == {
        "wind": {"speed": 10.0, "from": pytest.approx(30.0)},
        "current": {"speed": 0.5, "towards": pytest.approx(-90.0)},
        "waves": {"height": 2.0, "period": 8.0, "from": pytest.approx(45.0)}, "depth": 30.0, "gusts": None,
    }  # fmt: skip
    now = made.weather.now()
    assert now.per_depth == pytest.approx(1.0 / 30.0)
    assert (now.wave_x, now.wave_y, now.wave_T) == pytest.approx((math.sqrt(2.0), math.sqrt(2.0), 8.0))
    assert surroundings(L7).weather.now().per_depth == 0.0


@pytest.mark.parametrize(("given", "told"), [
    ({"wind": "151,0"}, "is beyond any on record"), ({"current": "15.1,0"}, "is beyond any on record"),
    ({"waves": "-1,8,0"}, "the height is zero or above"), ({"waves": "1,0,0"}, "the period above zero"),
    ({"waves": "1,8"}, "--waves is '1,8'; write M,S,DEG"), ({"waves": "1,nan,0"}, "the period above zero"),
    ({"depth": 20.8}, "draws 20.8 m and would be aground"),
])  # fmt: skip
def test_surroundings_that_cannot_be_are_refused(given: dict[str, Any], told: str) -> None:
    with pytest.raises(RequestError, match=told):
        surroundings(load("kvlcc2_shallow"), Around(**given))


def test_edges_of_what_surrounds_a_ship_are_taken() -> None:
    ship = load("kvlcc2_shallow")
    notes: list[str] = []
    surroundings(ship, Around("150,0", None, "15,0", "0,8,0", 1.001 * SHALLOWEST * 20.8), note=notes.append)
    assert notes == []
    surroundings(ship, Around(depth=0.999 * SHALLOWEST * 20.8), note=notes.append)
    assert notes[0].startswith(f"note: --depth: h/d is {0.999 * SHALLOWEST:.3g}; corrections end at {SHALLOWEST:g}")
    for option, given in (("--wind", {"wind": "5,0"}), ("--waves", {"waves": "1,8,0"}), ("--depth", {"depth": 9.0})):
        with pytest.raises(RequestError, match=f"{option}: kvlcc2_l7 has no force of"):
            surroundings(L7, Around(**given))


def test_a_folder_of_results_is_not_that_of_the_trials(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    for source in (tmp_path / "logs", tmp_path / "logs" / "a.csv"):
        source.suffix and source.write_text("")
        with pytest.raises(DataError, match="holds the trials themselves"):
            separate(tmp_path / "logs", [tmp_path, source])
        separate(tmp_path / "out", [source])


def test_an_output_is_refused_before_the_work_begins(tmp_path: Path) -> None:
    (tmp_path / "in.toml").write_text("")
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "same.toml").symlink_to(tmp_path / "in.toml")
    check_output(None, (".toml",), "a ship file")
    check_output(tmp_path / "OUT.TOML", (".toml",), "a ship file", tmp_path / "in.toml")
    check_output(tmp_path / "in.toml", (".toml",), "a ship file", tmp_path / "gone.toml")
    for out, told in ((tmp_path / "x.html", "a ship file ends in .toml"),
                      (tmp_path / "no" / "x.toml", "no such folder"),
                      (tmp_path / "folder.toml", "is a folder; name a file"),
                      (tmp_path / "same.toml", "is an input")):  # fmt: skip
        with pytest.raises(RequestError, match=told):
            check_output(out, (".toml",), "a ship file", tmp_path / "in.toml")
    with pytest.raises(RequestError, match="not a folder that can be made"):
        make_folder(tmp_path / "in.toml" / "x")

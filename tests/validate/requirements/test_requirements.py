"""The requirements of Sawada 2024 section 6: who passes, who must fail, and that each check can fail."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.actuators import Actuator, Actuators
from seatrial.cli.app import main
from seatrial.core.parameters import Parts, update
from seatrial.models.mmg import Mmg
from seatrial.report.judging.requirements import page as page_of
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import load
from seatrial.validate.requirements import Judgement
from seatrial.validate.requirements.probe import Probe
from seatrial.validate.requirements.scopes import BERTHING, COLLISION_AVOIDANCE, FUNCTIONAL, checked, judge


class Clock:
    """A clock that stands `step` seconds further at each look."""

    def __init__(self, step: float) -> None:
        self.now, self.step = 0.0, step

    def __call__(self) -> float:
        self.now += self.step
        return self.now


def item(ship: Ship, number: str, scope: tuple[Any, ...] = BERTHING, clock: Any = None) -> Judgement:
    probe = Probe.of(ship) if clock is None else Probe.of(ship, clock)
    return next(i.check(probe) for i in scope if i.number == number)


def test_the_scopes_have_the_items_of_the_paper() -> None:
    assert [len(s) for s in (COLLISION_AVOIDANCE, BERTHING)] == [11, 14]
    assert [i.number for i in FUNCTIONAL] == ["1a", "1b", "1c", "1d", "1e", "1f", "2", "3", "4", "N1", "N2"]


@pytest.mark.slow
def test_kvlcc2_meets_all_of_collision_avoidance() -> None:
    found = judge(load("kvlcc2"), "collision-avoidance")
    assert found.failed == ()
    assert found.count("pass") == 11


def test_interfaces_are_not_passed_unseen() -> None:
    """The examination of motion does not try them; the command does."""
    for number in ("3", "4", "N2"):
        assert item(load("kvlcc2_l7"), number, FUNCTIONAL).verdict == "not judged"


@pytest.mark.parametrize(("share", "verdict"), [(0.9, "pass"), (1.1, "fail")])
def test_a_ship_left_alone_comes_to_rest_as_fast_as_the_least_resistance_makes_it(share: float, verdict: str) -> None:
    """Motion that fades evenly, to a little less or more than u' = -0.01 u |u|/L leaves after 300 L/U."""
    probe = Probe.of(load("mariner_nomoto"))

    class Fading:
        def __getattr__(self, name: str) -> Any:
            return getattr(probe, name)

        def drift(self, states: Any, controls: Any, duration: float) -> Any:
            t, begun = np.linspace(0.0, duration, 101), np.array(states)
            size = np.sqrt(begun[:, 3] ** 2 + begun[:, 4] ** 2 + (0.3 * probe.ship.L_pp * begun[:, 5]) ** 2)
            left = share / (1.0 + 0.01 * 300.0 * size / probe.U)
            return t, begun[:, None, :] * (left[:, None] ** (t / duration))[:, :, None]

    fading: Any = Fading()
    check = next(one.check for one in BERTHING if one.number == "1")
    assert check(fading).verdict == verdict


@pytest.mark.slow
def test_a_slick_hull_comes_to_rest_slowly_and_passes() -> None:
    """A resistance of R_0' = .008, a third of a tanker's, is still one."""
    assert item(load("kvlcc2").having({"hull.R_0": 0.008}), "1").verdict == "pass"


@pytest.mark.long
def test_esso_osaka_meets_berthing_but_for_the_thrusters_it_lacks() -> None:
    found = judge(load("esso_osaka_3m"), "berthing")
    assert found.failed == ()
    aside = {i.number: j.reason for i, j in found.rows if j.verdict == "not applicable"}
    assert list(aside) == ["8"]
    assert "no side thruster" in aside["8"]
    assert judge(load("esso_osaka_3m_harbour"), "berthing").count("pass") == 14


@pytest.mark.parametrize("name", ["mariner_nomoto", "zeefakkel"])
@pytest.mark.long
def test_a_response_model_fails_exactly_what_it_cannot_represent(name: str) -> None:
    """No surge and sway resistance, no revolutions, no wind or waves; steering is what it is made for."""
    assert judge(load(name), "collision-avoidance").failed == ("1", "5", "6", "7")
    assert judge(load(name), "berthing").failed == ("1", "2", "6", "7", "9", "10")


@pytest.mark.long
def test_an_expansion_about_a_speed_does_not_come_to_rest() -> None:
    assert {"1", "4", "6"} <= set(judge(load("mariner"), "berthing").failed)


@pytest.mark.slow
def test_a_hull_without_damping_fails() -> None:
    ship = load("esso_osaka_3m")
    slippery = ship.having({"hull.Y_v": 0.0, "hull.C_D": 0.0})
    assert item(ship, "2").verdict == "pass"
    found = item(slippery, "2")
    assert found.verdict == "fail"
    assert "sway" in found.reason


@pytest.mark.long
def test_a_hull_that_pushes_is_found_out() -> None:
    """The wrong sign of the resistance: motion without engines, and never at rest."""
    ship = load("esso_osaka_3m")
    pushing = replace(ship.having({"hull.X_0F": -ship.model.hull.X_0F}), validity={})  # type: ignore[attr-defined]
    probe = Probe(pushing, ship.speed, 10.0)
    items = {i.number: i for i in BERTHING}
    assert [checked(items[n], probe).verdict for n in ("1", "2", "4")] == ["fail"] * 3


@pytest.mark.slow
def test_a_rudder_of_the_wrong_sign_fails() -> None:
    ship = load("kvlcc2_l7")
    model: Any = ship.model
    wrong = replace(ship, model=update(model, {"rudder.x_R": -model.rudder.x_R, "rudder.x_H": -model.rudder.x_H}))
    assert item(ship, "5").verdict == "pass"
    assert item(wrong, "5").verdict == "fail"


@pytest.mark.slow
def test_thrusters_without_loss_fail() -> None:
    ship = load("esso_osaka_3m_harbour")
    model: Mmg = ship.model  # type: ignore[assignment]
    lossless = tuple(replace(part, loss_form="none") for part in model.thrusters.components)
    kept = replace(ship, model=replace(model, thrusters=Parts(model.thrusters.names, lossless)))
    assert item(kept, "8").verdict == "fail"
    share = item(ship, "8").evidence["n_bow: yaw and sway left at 0.5 U (starboard)"][0]
    assert 0.3 < share < 0.95


@pytest.mark.slow
def test_a_screw_without_a_hand_fails() -> None:
    ship = load("esso_osaka_3m")
    sided = [f"propeller.{a}_{k}" for a in "AB" for k in range(1, 9)]
    assert item(ship, "9").verdict == "pass"
    assert item(ship.having(dict.fromkeys(sided, 0.0)), "9").verdict == "fail"


def test_no_wind_force_fails_and_calm_is_as_published() -> None:
    ship = load("esso_osaka_3m")
    model: Mmg = ship.model  # type: ignore[assignment]
    assert item(replace(ship, model=replace(model, wind=None)), "10").verdict == "fail"
    kvlcc2: Any = load("kvlcc2")
    bare = replace(kvlcc2.model, wind=None, waves=None)
    state, control = (0.0, 0.0, 0.4, 7.0, -0.8, 0.01), (1.7, 0.3)
    from seatrial.environment import CALM

    published = bare.derivative(state, control, CALM)
    assert kvlcc2.model.derivative(state, control, CALM) == pytest.approx(published, rel=1e-14)


@pytest.mark.slow
def test_a_wind_that_blows_to_windward_is_found_out() -> None:
    ship = load("esso_osaka_3m")
    wind = [f"wind.{name}" for name in ("Y_1", "Y_3", "Y_5")]
    model: Any = ship.model
    wrong = ship.having({name: -getattr(model.wind, name[5:]) for name in wind})
    assert item(wrong, "10").verdict == "fail"


class Sliding(Probe):
    """A ship whose bow points out of its turning circle."""

    def run(self, *args: Any, **kwargs: Any) -> Any:
        trial = super().run(*args, **kwargs)
        return trial.having(v_m=-trial["v_m"])


@pytest.mark.slow
def test_a_bow_outside_the_turn_is_found_out() -> None:
    ship = load("esso_osaka_3m")
    check = next(i.check for i in FUNCTIONAL if i.number == "1f")
    assert check(Probe(ship, ship.speed, 10.0)).verdict == "pass"
    assert check(Sliding(ship, ship.speed, 10.0)).verdict == "fail"


def test_what_orders_are_followed_by_cannot_differ_from_lane_to_lane() -> None:
    from seatrial.manoeuvres.turning import Turning
    from seatrial.simulate.run import campaign

    ship = load("milliampere")
    vary = {"ship.thrusters.bow.f_per_n": np.array([10.0, 30.0])}
    with pytest.raises(ShipError, match="cannot differ by lane"):
        campaign(ship, Turning(10.0, 0.1), vary, speed=1.0, duration=1.0)


def test_a_servo_without_limits_fails() -> None:
    ship = replace(load("esso_osaka_3m"), actuators=Actuators({"rudder": Actuator(high=0.6)}))
    assert item(ship, "11").verdict == "fail"
    found = item(ship, "12")
    assert found.verdict == "fail"
    assert "rate" in found.reason


@pytest.mark.slow
def test_real_time_is_a_hundred_lengths_over_the_time_they_took() -> None:
    """Computed in one second by the clock, the factor is the time of a hundred ship lengths in seconds."""
    ship = load("kvlcc2_l7")
    found = item(ship, "14", clock=Clock(1.0))
    factor, _ = found.evidence["real-time factor, one ship"]
    assert factor == pytest.approx(100 * ship.L_pp / ship.speed, rel=1e-3)


@pytest.mark.slow
def test_real_time_is_judged_by_the_clock() -> None:
    ship = load("esso_osaka_3m")
    assert item(ship, "14", clock=Clock(1.0)).verdict == "pass"
    slow = item(ship, "14", clock=Clock(1e4))
    assert slow.verdict == "fail"
    assert slow.evidence["real-time factor, one ship"][0] < 1.0


def test_unstable_ships_are_told_and_the_tanker_is_one() -> None:
    assert "unstable on course" in item(load("tanker_nomoto"), "2", COLLISION_AVOIDANCE).reason


@pytest.mark.long
def test_the_page_shows_every_item_with_its_figures(tmp_path: Any, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "page.html"
    assert main(["requirements", "esso_osaka_3m", "--scope", "berthing", "-o", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    page = out.read_text(encoding="utf-8")
    assert page.count("<h2>") == 15 == 1 + len(told["items"])
    assert page.count("<svg") >= 9
    assert "http" not in page.replace("http://www.w3.org", "")
    for one in told["items"]:
        assert all(np.isfinite(e["value"]) for e in one["evidence"].values()), one["item"]
    assert page_of(judge(load("zeefakkel"), "functional")).html.count("✗ fail") >= 3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["requirements", "kvlcc2", "--scope", "docking"], "known: collision-avoidance, berthing, functional"),
        (["requirements", "kvlcc2", "-o", "page.json"], "ends in .html"),
        (["requirements", "kvlcc", "-o", "page.html"], "kvlcc2"),
    ],
)
def test_wrong_requests(arguments: list[str], words: str, capsys, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    assert words in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_an_unknown_scope_is_named() -> None:
    with pytest.raises(ShipError, match="near: berthing"):
        judge(load("kvlcc2_l7"), "berthin")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["naval_blanke", "container_son_nomoto"])
def test_ships_whose_hull_rolls_are_judged_too(name: str) -> None:
    """Their hulls take heel and its rate besides the flow."""
    found = judge(load(name), "collision-avoidance")
    assert len(found.rows) == 11


@pytest.mark.slow
@pytest.mark.parametrize("name", ["supply_76m", "supply_83m", "cybership2", "otter"])
def test_no_side_force_of_a_rudder_is_asked_of_a_ship_without_one(name: str) -> None:
    from seatrial.validate.requirements.steering import turning

    found = turning(Probe.of(load(name)))
    told = [one for one in found.findings if one.what.startswith("side force of the rudder")]
    assert [one.bound for one in told] == [None]
    assert "not applicable" in told[0].what
    assert "swapped" not in found.reason


@pytest.mark.slow
def test_a_swapped_side_force_of_an_azimuth_or_a_rudder_is_still_found() -> None:
    """Ships whose steering pushes the stern keep the check: its figure is there, with its bound."""
    from seatrial.validate.requirements.steering import turning

    for name in ("kvlcc2_l7", "qiuxin5"):
        found = turning(Probe.of(load(name)))
        assert [one.bound is not None for one in found.findings if one.what.startswith("sway by the rudder")] == [True]


@pytest.mark.slow
def test_engines_are_not_stopped_on_a_ship_that_has_none() -> None:
    found = item(load("mariner"), "4")
    told = [one for one in found.findings if "engine" in one.what]
    assert told
    assert all(one.bound is None for one in told)
    assert "engines" not in found.reason
    kept = item(load("kvlcc2_l7"), "4")
    assert any(one.bound is not None for one in kept.findings if "after the engines stop" in one.what)


def test_a_ship_whose_thrust_is_ordered_in_newtons_is_not_asked_for_the_hand_of_a_propeller() -> None:
    found = item(load("supply_76m"), "9")
    assert found.verdict == "not applicable"
    assert "newtons" in found.reason

"""Ships with one number, area or gear that no ship has, and good ships moved within what is published."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.actuators import Actuators
from seatrial.core.parameters import update, values
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import load
from seatrial.validate.requirements import Finding, Item, judged, plausible, steering, typical, whole
from seatrial.validate.requirements import thresholds as limit
from seatrial.validate.requirements.probe import Probe
from seatrial.validate.requirements.scopes import SCOPES, checked, judge
from seatrial.validate.requirements.thresholds import most


def changed(**numbers: float | Callable[[float], float]) -> Ship:
    """KVLCC2 with some of its numbers changed, named with two underscores for a dot."""
    ship = load("kvlcc2")
    old, new = values(ship.model), dict[str, float]()
    for key, value in numbers.items():
        path = key.replace("__", ".")
        new[path] = value(float(old[path])) if callable(value) else value
    return replace(ship, model=update(ship.model, new))


def told(found: Any) -> list[Finding]:
    return [one for one in found if not one.holds]


def munk_twice() -> Ship:
    """The moment of the added masses, (m_y - m_x) u v, counted in N_v as well, primed by 0.5 rho L^2 d."""
    v = values(load("kvlcc2").model)
    unit = 0.5 * v["body.rho"] * v["body.L_pp"] ** 2 * v["body.d"]
    return changed(hull__N_v=v["hull.N_v"] - (v["body.m_y"] - v["body.m_x"]) / unit)


@pytest.mark.parametrize(("ship", "words", "certain"), [
    (lambda: changed(hull__Y_r=lambda x: -x), "hull.Y_r is -5.", True),
    (lambda: changed(body__x_G=lambda x: -x), "body.x_G is -4.", False),
    (munk_twice, "hull.N_v is -5.", True),
])  # fmt: skip
def test_a_number_that_no_regression_knows_is_told_how_far_it_is(
    ship: Callable[[], Ship], words: str, certain: bool
) -> None:
    found = told(typical.numbers(Probe.of(ship())))
    assert any(words in one.wrong for one in found), [one.wrong for one in found]
    verdict = judged("good", [*found, Finding("x", 0.0, "-", most(1.0, ""))]).verdict
    assert verdict == ("fail" if certain else "doubt")


PUBLISHED = {"hull.Y_v": 0.15, "hull.Y_r": 0.2, "hull.N_v": 0.1, "hull.N_r": 0.1, "hull.Y_vvv": 0.2,
             "hull.N_vvr": 0.3, "rudder.a_H": 0.2, "body.m_y": 0.1, "body.J_z": 0.15}  # fmt: skip
"""Scatter of published sets about one hull, as shares."""


@pytest.mark.parametrize("seed", range(12))
def test_good_ships_moved_within_what_is_published_are_not_doubted(seed: int) -> None:
    random, known = np.random.default_rng(seed), values(load("kvlcc2").model)
    moved = {path.replace(".", "__"): float(known[path]) * (1.0 + share * float(random.uniform(-1.0, 1.0)))
             for path, share in PUBLISHED.items()}  # fmt: skip
    assert not told(typical.numbers(Probe.of(changed(**moved))))


@pytest.mark.parametrize("name", ["kvlcc2", "kvlcc2_l7", "kcs", "seiun_maru", "twin_virtual", "mariner", "suzaku"])
def test_ships_of_the_library_are_not_failed(name: str) -> None:
    p = Probe.of(load(name))
    found = [*typical.position(p), *typical.numbers(p), *typical.waiting(p), *typical.areas(p)]
    assert not [one for one in told(found) if not one.doubt]


def test_a_position_that_moves_with_the_sway_of_another_point_is_wrong() -> None:
    ship = load("kvlcc2")

    class AtG(type(ship.model)):  # type: ignore[misc]
        """Position of midship, moved by the sway at the centre of gravity, 11 m ahead."""

        def derivative(self, state: Any, control: Any, around: Any) -> Any:
            rates = list(super().derivative(state, control, around))
            psi, r = state[2], state[5]
            rates[0] -= 11.2 * r * math.sin(psi)
            rates[1] += 11.2 * r * math.cos(psi)
            return tuple(rates)

    wrong = AtG(**{name: getattr(ship.model, name) for name in ship.model.__dataclass_fields__})
    (found,) = typical.position(replace(Probe.of(ship), ship=replace(ship, model=wrong)))
    assert found.value == pytest.approx(11.2 / ship.L_pp)
    assert "turning on the spot" in found.wrong
    (right,) = typical.position(Probe.of(ship))
    assert right.holds


def test_a_heading_that_turns_faster_than_the_ship_is_wrong_by_the_way_of_its_ends() -> None:
    ship = load("kvlcc2")

    class Fast(type(ship.model)):  # type: ignore[misc]
        """Heading two parts in a hundred ahead of the yaw rate."""

        def derivative(self, state: Any, control: Any, around: Any) -> Any:
            rates = list(super().derivative(state, control, around))
            rates[2] *= 1.02
            return tuple(rates)

    wrong = Fast(**{name: getattr(ship.model, name) for name in ship.model.__dataclass_fields__})
    (found,) = typical.position(replace(Probe.of(ship), ship=replace(ship, model=wrong)))
    assert found.value == pytest.approx(0.02)  # of r = U/L, at a length


@pytest.mark.slow
def test_a_rudder_too_weak_to_steer_and_a_gear_that_waits() -> None:
    weak = told(typical.zigzag(Probe.of(changed(rudder__f_alpha=lambda x: x / 57.0))))
    assert any("too weak a rudder" in one.wrong for one in weak)
    assert not told(typical.zigzag(Probe.of(load("kvlcc2"))))
    loose = told(typical.zigzag(Probe.of(munk_twice())))
    assert [one.doubt for one in loose] == [True]
    ship = load("kvlcc2")
    late = Actuators({**ship.actuators.by_name, "rudder": replace(ship.actuators.rudder, dead_time=60.0)})
    found, lag = typical.waiting(Probe.of(replace(ship, actuators=late)))
    assert lag.holds
    assert found.value == pytest.approx(60.0 / (ship.L_pp / ship.speed), rel=0.01)
    assert not found.holds


def test_areas_exchanged_or_in_square_feet() -> None:
    assert not told(typical.areas(Probe.of(load("kvlcc2"))))
    swapped = told(typical.areas(Probe.of(changed(wind__A_T=3330.0, wind__A_L=1540.0))))
    assert "exchanged" in swapped[0].wrong
    assert not swapped[0].doubt
    (far,) = told(typical.areas(Probe.of(changed(wind__s_L=lambda x: x / 0.3048))))
    assert far.value == pytest.approx(-15.0 / 0.3048 / 320.0)
    assert "s_L" in far.wrong
    feet = told(typical.areas(Probe.of(changed(wind__A_T=lambda x: 10.764 * x, wind__A_L=lambda x: 10.764 * x))))
    assert ["square feet" in one.wrong and not one.doubt for one in feet] == [True, True]


def test_a_doubt_is_no_failure_and_a_failure_outweighs_it() -> None:
    bound = most(1.0, "")
    good, odd = Finding("a", 0.0, "-", bound, "no"), Finding("b", 2.0, "-", bound, "unusual", doubt=True)
    wrong = Finding("c", 2.0, "-", bound, "wrong")
    assert judged("good", [good]).verdict == "pass"
    assert (judged("good", [good, odd]).verdict, judged("good", [good, odd]).reason) == ("doubt", "unusual")
    assert (judged("good", [good, odd, wrong]).verdict, judged("good", [good, odd, wrong]).reason) == ("fail", "wrong")
    assert limit.FAR_FROM_USUAL.low == -limit.FAR_FROM_USUAL.high


@pytest.mark.parametrize(("name", "part", "value", "words"), [
    ("kvlcc2", "w_P0", 0.65, "wake fraction"), ("kvlcc2", "w_P0", 0.49, ""), ("kvlcc2", "t_P", 0.3, ""),
    ("kvlcc2", "t_P", 0.392, "thrust deduction"), ("kvlcc2_l7", "w_P0", 0.6, ""),
    ("kvlcc2_l7", "w_P0", 0.75, "wake fraction"), ("kvlcc2", "w_P0", -0.1, "wake fraction"),
])  # fmt: skip
def test_a_wake_as_one_less_and_a_deduction_taken_twice_are_doubted(
    name: str, part: str, value: float, words: str
) -> None:
    """1 - 0.35 and 1 - 0.78^2; in the wake of a model friction has a larger part."""
    ship = load(name)
    found = told(typical.stern(Probe.of(replace(ship, model=update(ship.model, {f"propeller.{part}": value})))))
    assert [(one.what, one.doubt) for one in found] == ([(words, True)] if words else [])


def first_answer(ship: Ship) -> Finding:
    (found,) = typical.at_first(Probe.of(ship))
    return found


@pytest.mark.slow
@pytest.mark.parametrize(("name", "by"), [("mariner_nomoto", 1.0), ("frigate_100m", 1.0), ("mariner_nomoto", 0.02)])
def test_the_first_answer_of_a_nomoto_ship_is_that_of_its_step_response(name: str, by: float) -> None:
    """Heading over rudder after one length: K' (1 - T' (1 - exp(-1/T'))); Norrbin's term takes little of it."""
    ship = load(name)
    known = values(ship.model)
    ship = replace(ship, model=update(ship.model, {"T": by * float(known["T"])}))
    K, T = (float(known[key]) * power for key, power in (("K", ship.L_pp / ship.speed), ("T", ship.speed / ship.L_pp)))
    due = K * (1.0 - by * T * (1.0 - math.exp(-1.0 / (by * T))))
    found = first_answer(ship)
    assert found.value == pytest.approx(due, rel=0.05 if name == "frigate_100m" else 2e-3)
    assert found.holds == (by == 1.0)


@pytest.mark.slow
def test_the_first_answer_has_no_swing_in_it_and_fails_for_a_rudder_fifty_seven_times_too_weak() -> None:
    """KVLCC2 at 320 m, heading after one length of a rudder over at once: .43 a radian of rudder to either side."""
    assert first_answer(load("kvlcc2")).value == pytest.approx(0.428, abs=0.002)
    weak = first_answer(changed(rudder__f_alpha=math.radians))
    assert not weak.holds
    assert not weak.doubt
    assert not list(typical.at_first(Probe.of(load("supply_83m"))))  # ordered moments are no rudder


def test_the_fastest_motion_of_a_first_order_ship_is_its_time_constant() -> None:
    ship = load("frigate_100m")
    assert Probe.of(ship).quickest == pytest.approx(1.0 / 27.0 * ship.L_pp / ship.speed, rel=1e-3)
    assert Probe.of(load("kvlcc2_l7_arx")).quickest == 0.0


@pytest.mark.slow
def test_a_ship_of_no_inertia_is_told_by_its_forces_and_not_run(monkeypatch: pytest.MonkeyPatch) -> None:
    ship = load("supply_83m")
    known = values(ship.model)
    ship = replace(ship, model=update(ship.model, {"inertia.m_33": float(known["inertia.m_33"]) / 6.4e6}))
    runs: list[float] = []
    monkeypatch.setattr(Probe, "drift", lambda *_, **__: runs.append(1.0))
    monkeypatch.setattr(Probe, "sail", lambda *_, **__: runs.append(1.0))
    table = judge(ship, "berthing", Probe.of(ship))
    assert not runs
    assert table.failed == ("4",)
    assert table.count("not judged") == 13
    (reason,) = (judgement.reason for item, judgement in table.rows if item.check is plausible.plausible)
    assert "inertia" in reason
    assert all("not run" in one.reason for item, one in table.rows if item.number != "4")


def test_a_run_that_is_refused_fails_its_item() -> None:
    def refused(p: Any) -> Any:
        raise ShipError("2e6 rows")

    found = checked(Item("1", "a run", refused), SimpleNamespace(quickest=1.0))  # type: ignore[arg-type]
    assert found.verdict == "fail"
    assert "2e6 rows" in found.reason


@pytest.mark.parametrize(("factor", "holds"), [(1.0, True), (0.01, False), (0.4, False), (3.0, False)])
def test_the_share_of_the_rudder_in_the_race_is_that_of_its_height(factor: float, holds: bool) -> None:
    """eta is D_P over the height: 9.86 m over 15.8 m, of 20.8 m of draught."""
    p = Probe.of(changed(rudder__eta=lambda x: factor * x))
    found = next(one for one in typical.stern(p) if one.what.startswith("height of the rudder"))
    assert found.value == pytest.approx(15.8 / 20.8 / factor)
    assert found.holds == holds
    assert "eta" in found.wrong


@pytest.mark.slow
def test_a_full_ship_is_doubted_at_the_speed_of_a_fast_one() -> None:
    """A Rhine vessel of C_b .88 at 7.8 m/s, F_n .24: fuller by a quarter than ships as fast (Watson and Gilfillan)."""
    ship = load("gms_110")
    slow, fast = (Probe.of(replace(ship, speed=u)) for u in (4.0, 7.776))
    blocks = {p.U: next(one for one in whole.findings(p) if "ships as fast" in one.what) for p in (slow, fast)}
    assert blocks[4.0].holds
    assert blocks[7.776].doubt
    assert not blocks[7.776].holds
    assert blocks[7.776].value == pytest.approx(0.8836 / (0.7 + 0.125 * math.atan(-0.1708)), rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "most"), [("mariner_nomoto", 60.0), ("kvlcc2", 35.0)])
def test_overshoots_of_a_response_model_are_held_against_those_of_its_kind(name: str, most: float) -> None:
    """A first-order Mariner overshoots by 41 deg: nothing slows it in a turn."""
    usual = next(one for one in typical.zigzag(Probe.of(load(name))) if one.what.endswith("usually"))
    assert usual.bound is not None
    assert usual.bound.high == most
    assert usual.holds


@pytest.mark.slow
def test_the_item_on_turning_tells_a_gain_in_degrees() -> None:
    """K times 57.3: Norrbin's term keeps the circle a ship's, and the first answer is not."""
    ship = load("frigate_100m")
    ship = replace(ship, model=update(ship.model, {"K": math.degrees(float(values(ship.model)["K"]))}))
    (item,) = (one for one in SCOPES["berthing"] if one.check is steering.turning)
    found = checked(item, Probe.of(ship))
    assert found.verdict == "fail"
    assert "first answer of yaw" in found.reason


@pytest.mark.slow
def test_what_physics_rules_out_is_asked_of_forces_and_of_runs() -> None:
    found = plausible.plausible(Probe.of(load("container_son_nomoto"))).findings
    asked = {one.what.partition(" (")[0] for one in found}
    assert {
        "greatest speed under any steady orders", "motion left 20 L/U after the engines stop, at most",
        "turn in a current, drift taken off", "square of the roll frequency over g/B", "fastest motion at the approach",
    } <= asked  # fmt: skip

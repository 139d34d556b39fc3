"""Rudders and shafts against the motion: each bound from both sides, each sign and unit, on logs of a few lines."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array, Trial
from seatrial.data.check.bounds import scale_faults, whirl_faults
from seatrial.data.check.controls import rudder
from seatrial.data.check.controls.effect import effect
from seatrial.data.check.controls.numbered import numbered_faults
from seatrial.data.check.controls.rudder import (
    _balance,
    _clusters,
    _dead,
    _round_scale,
    _roundness,
    _small,
    _step_at,
    held_angles,
    helm_faults,
    stuck_faults,
)
from seatrial.data.check.controls.sense import rudder_faults
from seatrial.data.check.controls.shaft import shaft_faults
from seatrial.data.check.sensors import Fault
from seatrial.data.prepare import Remedy, shifted
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

DEGREE = math.pi / 180.0
L = 98.1  # a ship time is 3.162 s


def log(rows: int = 100, dt: float = 1.0, length: float | None = L, name: str = "a", **channels: Any) -> Trial:
    wide = {key: np.broadcast_to(np.asarray(value, dtype=np.float64), rows) for key, value in channels.items()}
    return Trial(name, dt * np.arange(float(rows)), wide, meta={} if length is None else {"L_pp": length})


def wavy(size: float, rows: int = 100, period: float = 20.0) -> Array:
    return size * np.sin(2.0 * np.pi * np.arange(rows) / period)


def amount(fault: Fault) -> tuple[float, ...]:
    assert isinstance(fault.remedy, Remedy)
    return fault.remedy.steps[0].amount


# -- the sense of a rudder


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_held_rudder_turns_the_ship_to_its_side(side: float) -> None:
    held = log(u=5.0, delta=side * 0.2, r=side * 0.02, psi=wavy(1.0))
    assert not list(rudder_faults(held))
    (fault,) = rudder_faults(held.having(r=np.full(100, -side * 0.02)))
    assert (fault.severity, fault.key, fault.channels, amount(fault)) == ("error", "sign", ("delta",), (-1.0,))
    assert f"{side * 0.2:+.3g} rad" in fault.evidence
    assert f"r is {-side * 0.02:+.3g} rad/s" in fault.evidence
    (fault,) = rudder_faults(log(u=5.0, delta=side * 0.2, r=-side * 0.02))
    assert "or that of r" in fault.what


@pytest.mark.parametrize(("mean", "spread", "judged"), [
    (0.11, 0.0, True), (0.09, 0.0, False), (0.2, 0.095, True), (0.2, 0.105, False),
])  # fmt: skip
def test_a_rudder_is_held_where_it_is_far_over_and_hardly_varies(mean: float, spread: float, judged: bool) -> None:
    delta = mean + spread * np.where(np.arange(100) % 2, 1.0, -1.0)
    # one that is not held is judged by its effect, which a constant rate does not show
    found = [one for one in rudder_faults(log(u=5.0, delta=delta, r=-0.02)) if "held" in one.evidence]
    assert bool(found) == judged


def test_only_rows_ahead_with_the_propeller_ahead_show_the_sense_of_a_rudder() -> None:
    half = np.arange(100) < 50
    for slow, counts in ((1.4, False), (1.6, True)):
        trial = log(u=np.where(half, slow, 5.0), delta=0.3, r=np.where(half, -0.05, 0.01))
        assert bool(list(rudder_faults(trial))) == counts
    astern = log(u=5.0, delta=0.3, r=np.where(half, -0.05, 0.01), n_P=np.where(half, -1.0, 1.0))
    assert not list(rudder_faults(astern))
    rest = log(u=5.0, delta=0.3, r=np.where(half, -0.05, 0.01), n_P=np.where(half, 0.0, 1.0))
    assert not list(rudder_faults(rest))
    few = np.where(np.arange(100) < 10, -0.02, np.nan)
    assert list(rudder_faults(log(u=5.0, delta=0.3, r=few)))
    assert not list(rudder_faults(log(u=5.0, delta=0.3, r=np.where(np.arange(100) < 9, -0.02, np.nan))))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rudder_that_moves_is_judged_by_what_the_rate_does_after_it(side: float) -> None:
    t = np.arange(400.0)
    delta = 0.2 * np.sign(np.sin(2.0 * np.pi * (t + 0.5) / 80.0))
    r = np.zeros(400)
    for k in range(399):
        r[k + 1] = r[k] + (0.05 * delta[k] - r[k]) / 8.0
    trial = log(400, u=5.0, delta=side * delta, r=r, psi=np.cumsum(r))
    found = list(rudder_faults(trial))
    assert [one.key for one in found] == ([] if side > 0 else ["sign"])
    rng = np.random.default_rng(0)
    (weak,) = rudder_faults(trial.having(r=rng.normal(0.0, 0.01, 400)))
    assert (weak.key, weak.severity) == ("weak_rudder", "info")


# -- speed and length


def test_a_froude_number_beyond_six_tenths_is_another_scale() -> None:
    root = math.sqrt(9.81 * 10.0)
    assert not list(scale_faults(log(length=10.0, u=0.59 * root)))
    (fault,) = scale_faults(log(length=10.0, u=-0.61 * root))
    assert (fault.key, fault.severity) == ("length", "error")
    assert "Froude number 0.61" in fault.evidence
    assert not list(scale_faults(log(length=None, u=99.0)))
    top = np.where(np.arange(100) < 6, 0.7, 0.1) * root  # a twentieth of the rows
    assert len(list(scale_faults(log(length=10.0, u=top)))) == 1
    assert not list(scale_faults(log(length=10.0, u=np.where(np.arange(100) < 4, 0.7, 0.1) * root)))


def test_a_small_craft_may_plane_and_a_large_ship_under_its_length_turns_too_wide() -> None:
    root, psi = math.sqrt(9.81 * 5.0), 0.02 * np.arange(100)
    (fault,) = scale_faults(log(length=5.0, u=root, r=0.2, psi=psi))  # r L/u = .14
    assert fault.severity == "warning"
    (fault,) = scale_faults(log(length=5.0, u=root, r=0.1, psi=psi))
    assert fault.severity == "error"
    (fault,) = scale_faults(log(length=5.0, u=root, r=0.1, psi=0.4 * psi))  # hardly turned
    assert fault.severity == "warning"
    (fault,) = scale_faults(log(length=5.0, u=2.6 * root, r=0.6, psi=psi))
    assert fault.severity == "error"
    (fault,) = scale_faults(log(length=11.0, u=1.0 * root, r=0.2, psi=psi))
    assert fault.severity == "error"


def test_no_bow_is_thrown_aside_by_more_than_its_weight() -> None:
    most = math.sqrt(2.0 * 9.81 / 50.0)
    assert not list(whirl_faults(log(length=50.0, r=0.99 * most)))
    (fault,) = whirl_faults(log(length=50.0, r=np.where(np.arange(100) == 7, -1.01 * most, 0.0)))
    assert (fault.severity, fault.channels) == ("error", ("r",))
    assert isinstance(fault.remedy, Remedy)
    assert fault.remedy.steps[0].where == ((7.0, 7.0),)
    (fault,) = whirl_faults(log(length=50.0, r=757.0))
    assert isinstance(fault.remedy, str)
    assert not list(whirl_faults(log(length=None, r=4.4)))  # of 1 m
    assert list(whirl_faults(log(length=None, r=4.5)))


def test_a_turn_of_more_than_three_lengths_is_another_scale_unless_thrusters_turn_the_ship() -> None:
    assert not list(scale_faults(log(length=10.0, u=2.0, r=0.59)))
    (fault,) = scale_faults(log(length=10.0, u=2.0, r=-0.61))
    assert (fault.severity, fault.channels) == ("error", ("r",))
    slow = np.where(np.arange(100) < 30, 0.9, 2.0)  # rows below half the speed are no turns
    assert not list(scale_faults(log(length=10.0, u=slow, r=np.where(slow < 1.0, 0.7, 0.1))))
    assert list(scale_faults(log(length=10.0, u=np.where(slow < 1.0, 1.1, 2.0), r=np.where(slow < 1.0, 0.7, 0.1))))
    per = math.sqrt(9.81 / 10.0)
    for rate, judged in ((0.79, False), (0.81, True)):  # r sqrt(L/g)
        found = list(scale_faults(log(length=10.0, u=2.0, r=rate * per, n_bow=0.0)))
        assert [one.severity for one in found] == ["warning"] * judged


# -- the shaft


def steady(n: Any, u: float = 5.0, **more: Any) -> Trial:
    return log(200, u=u, n_P=n, **more)


def test_revolutions_by_the_lengths_that_the_ship_goes_in_one() -> None:
    for advance, unit in ((0.0029, 60.0), (0.0031, None), (0.149, None), (0.151, 1 / 60.0)):
        found = list(shaft_faults([steady(5.0 / (L * advance))]))
        assert len(found) == (unit is not None)
        if unit:
            assert amount(found[0]) == (pytest.approx(1.0 / unit, rel=1e-5),)
            assert found[0].key == "unit"


def test_a_shaft_that_stands_or_goes_astern_of_a_ship_ahead() -> None:
    (zero,) = shaft_faults([steady(0.0)])
    assert (zero.key, zero.severity) == ("zeros", "error")
    (astern,) = shaft_faults([steady(-1.6)])
    assert (astern.key, amount(astern)) == ("sign", (-1.0,))
    assert not list(shaft_faults([steady(1.6)]))
    assert not list(shaft_faults([steady(-1.6, u=-5.0)]))
    assert not list(shaft_faults([steady(0.0).rows(slice(0, 19))]))
    # four lengths under way, at three tenths of the speed for half of the time
    assert list(shaft_faults([steady(0.0).rows(slice(0, 80))]))
    assert not list(shaft_faults([steady(0.0).rows(slice(0, 78))]))
    coasting = np.where(np.arange(200) < 90, 5.0, 1.6)
    assert list(shaft_faults([steady(0.0).having(u=coasting)]))
    assert not list(shaft_faults([steady(0.0).having(u=np.where(coasting < 2.0, 1.4, 5.0))]))
    azimuth = log(200, u=5.0, n_2=0.0, alpha_2=0.1)
    assert [one.where for one in shaft_faults([azimuth])] == ["n_2"]


# -- a rudder against its angles


def test_an_indicator_that_never_moves_while_the_ship_turns_is_dead() -> None:
    turning = {"u": 5.0, "r": wavy(0.02)}
    dead = [log(delta=0.0, **turning)]
    (fault,) = _dead(dead)
    assert (fault.key, fault.evidence) == ("zeros", "0 rad in every row of 1 trial")
    assert not list(_dead([log(delta=0.1, **turning)]))  # logged from its execute on
    assert not list(_dead([log(delta=0.1, **turning)] * 2))
    (fault,) = _dead([log(delta=0.1, **turning)] * 3)
    assert fault.key == "frozen"
    assert not list(_dead([log(delta=0.0, n_bow=1.0, **turning)]))
    assert not list(_dead([log(delta=0.1, **turning)] * 3 + [log(delta=wavy(0.1), **turning)]))
    most = 0.1 * 5.0 / L / float(np.quantile(np.abs(wavy(1.0)), 0.9))
    assert list(_dead([log(delta=0.0, u=5.0, r=wavy(1.02 * most))]))
    assert not list(_dead([log(delta=0.0, u=5.0, r=wavy(0.98 * most))]))


def test_a_rudder_of_an_angle_too_small_for_its_turns_was_converted_twice() -> None:
    def trial(turn: float, per: float) -> Trial:
        """r L/u of that size, so many times the rudder."""
        return log(u=5.0, r=wavy(turn * 5.0 / L), delta=wavy(turn / per))

    high = float(np.quantile(np.abs(wavy(1.0)), 0.9))
    (fault,) = _small([trial(0.5, 12.2)])
    assert (fault.key, amount(fault)) == ("unit", (pytest.approx(180.0 / math.pi, rel=1e-5),))
    assert not list(_small([trial(0.5, 11.8)]))
    assert not list(_small([trial(0.5, 40.0), trial(0.5, 11.8)]))
    assert list(_small([trial(0.152 / high, 40.0)]))
    assert not list(_small([trial(0.148 / high, 40.0)]))
    slow = trial(0.5, 40.0)
    slow = slow.having(u=np.where(np.arange(100) < 50, 5.0, 1.4), r=np.where(np.arange(100) < 50, 0.0, slow["r"]))
    assert not list(_small([slow]))


def test_held_angles_last_some_ship_times_and_move_less_than_a_degree() -> None:
    # 1.5 ship times are 4.74 s: 6 steps at least of 1 s
    def held(rows: int, drift: float = 0.0) -> list[float]:
        part = np.linspace(10.0 - 0.5 * drift, 10.0 + 0.5 * drift, rows)
        delta = np.concatenate([np.linspace(0.0, 8.0, 9), part, np.linspace(12.0, 20.0, 9)]) * DEGREE
        return held_angles(log(delta.size, delta=delta))

    assert held(7) == [pytest.approx(10.0 * DEGREE)]
    assert held(6) == []
    assert held(9, 0.98) == [pytest.approx(10.0 * DEGREE)]
    assert held(9, 1.02) == []
    assert held_angles(log(20, dt=0.5, delta=np.r_[np.zeros(10), np.linspace(0.1, 0.5, 10)])) == []  # 4.5 s
    assert held_angles(log(21, dt=0.5, delta=np.r_[np.zeros(11), np.linspace(0.1, 0.5, 10)])) == [0.0]


def test_levels_that_are_alike_are_one_and_round_ones_are_multiples_of_five_degrees() -> None:
    assert _clusters([10.5 * DEGREE, 20.0 * DEGREE, 10.0 * DEGREE]) == pytest.approx([10.25 * DEGREE, 20.0 * DEGREE])
    assert len(_clusters([10.0 * DEGREE, 10.7 * DEGREE])) == 2
    assert _roundness([10.3 * DEGREE, 20.2 * DEGREE, 14.9 * DEGREE]) == pytest.approx(0.2 * DEGREE)
    assert _roundness([12.4 * DEGREE]) == pytest.approx(2.4 * DEGREE)
    degrees = np.array([10.0, 20.0, 30.0])
    for scale, found in ((1.1, 1.1), (0.9, 0.9), (1.24, 1.24), (1.02, None), (1.0, None)):
        assert _round_scale((scale * degrees * DEGREE).tolist()) == (found and pytest.approx(found, abs=2e-3))
    assert _round_scale((1.1 * degrees[:2] * DEGREE).tolist()) is None
    assert _round_scale([11.0 * DEGREE, 22.0 * DEGREE, 34.0 * DEGREE]) is None  # not all alike


def test_the_step_of_an_indicator_is_that_of_its_decade() -> None:
    shown = np.array([1.0, 1.2, 1.3, 5.0, 10.0, 12.0, 13.0, 20.0]) * DEGREE
    assert _step_at(shown, 0) == pytest.approx(0.1 * DEGREE)
    assert _step_at(shown, 4) == pytest.approx(1.0 * DEGREE)
    assert _step_at(-shown, 5) == pytest.approx(1.0 * DEGREE)
    assert _step_at(np.array([1.0, 1.0]), 0) == 0.0


def balanced(starboard: Sequence[float], port: Sequence[float], ahead: float = 0.0, straight: int = 1) -> list[Fault]:
    """Turns at these held angles [deg], after a straight stretch with the rudder at `ahead`."""
    logs = [log(60, u=5.0, r=np.where(np.arange(60) < 20, 0.0, 0.02),
                delta=np.where(np.arange(60) < 20, ahead, angle) * DEGREE, name=str(k)) for k, angle in
            enumerate([*starboard, *(-one for one in port)])]  # fmt: skip
    plain = [log(60, u=5.0, r=np.full(60, 0.02), delta=one["delta"]) for one in logs]
    return list(_balance([*logs[:straight], *plain[straight:]]))


def test_an_offset_shows_by_as_many_degrees_more_to_one_side() -> None:
    (fault,) = balanced([10.5, 20.5], [9.5, 19.5], 0.5)
    assert (fault.key, amount(fault)) == ("rudder_offset", (pytest.approx(-0.5),))
    (fault,) = balanced([9.5, 19.5], [10.5, 20.5], -0.5)
    assert amount(fault) == (pytest.approx(0.5),)
    assert not balanced([10.44, 20.44], [9.56, 19.56], 0.44)
    assert balanced([10.46, 20.46], [9.54, 19.54], 0.46)
    assert not balanced([10.5, 20.5], [9.5, 19.5], 0.2)  # straight ahead contradicts it by .3 of .225
    assert balanced([10.5, 20.5], [9.5, 19.5], 0.3)
    assert balanced([10.5, 20.5], [9.5, 19.5], straight=0)
    assert not [one for one in balanced([10.5], [9.5], straight=0) if one.key == "rudder_offset"]


def test_a_side_whose_angles_are_larger_by_a_part_is_off() -> None:
    (fault,) = balanced([10.5, 21.0], [10.0, 20.0])
    assert fault.key == "rudder_sides"
    assert isinstance(fault.remedy, Remedy)
    assert (fault.remedy.steps[0].do, amount(fault)) == ("multiply_starboard", (pytest.approx(1 / 1.05, rel=1e-3),))
    (fault,) = balanced([10.0, 20.0], [10.5, 21.0])
    assert isinstance(fault.remedy, Remedy)
    assert (fault.remedy.steps[0].do, amount(fault)) == ("multiply_port", (pytest.approx(1 / 1.05, rel=1e-3),))
    assert balanced([10.41, 20.82], [10.0, 20.0])
    assert not balanced([10.39, 20.78], [10.0, 20.0])
    assert not balanced([10.5, 20.4], [10.0, 20.0], straight=0)  # not by one part
    assert not balanced([10.5, 21.0], [10.0, 20.0], 0.26)


def test_other_round_angles_to_either_side_were_ordered_so() -> None:
    """A circle of 20 deg to starboard, one of 25 deg to port; an indicator that is off shows no two round ones."""
    assert balanced([20.0], [25.0]) == []
    assert balanced([35.0, 20.0], [30.0]) == []
    assert [one.key for one in balanced([20.0], [25.4])] == ["rudder_sides"]
    assert [one.key for one in balanced([20.4], [25.0])] == ["rudder_sides"]


def test_a_rudder_that_is_aside_on_every_straight_course_has_an_offset() -> None:
    assert not balanced([12.0, 21.0, 33.0], [], 1.1, straight=2)
    (fault,) = balanced([12.0, 21.0, 33.0], [], -1.1, straight=3)
    assert amount(fault) == (pytest.approx(1.1),)
    assert not balanced([12.0, 21.0, 33.0], [], 0.9, straight=3)


# -- several rudders


def test_a_rudder_that_never_moves_while_its_fellow_does_is_dead() -> None:
    both = {"u": 5.0, "r": wavy(0.01), "delta_1": wavy(0.2)}
    faults = {one.key: one for one in numbered_faults([log(delta_2=0.0, **both)])}
    assert faults["zeros"].where == "delta_2"
    assert "while delta_1 does" in faults["zeros"].what
    assert any(one.key == "frozen" for one in numbered_faults([log(delta_2=0.1, **both)]))
    mixed = [log(delta_2=0.1, **both), log(delta_2=0.2, name="b", **both)]
    assert not any(one.key in ("zeros", "frozen") for one in numbered_faults(mixed))


def azimuths(alpha: float, share: float = 1.0, u: float = 3.0) -> list[Trial]:
    back = np.where(np.arange(100) < 100.0 * share, alpha, 0.0) + wavy(1e-3)
    one = {"u": u + wavy(0.01), "alpha_1": back, "n_1": 2.0, "alpha_2": back, "n_2": 2.0}
    return [log(**one), log(name="b", **one)]


def test_azimuths_that_push_astern_of_a_ship_ahead_have_their_zero_astern() -> None:
    found = [one for one in numbered_faults(azimuths(math.pi)) if "astern" in one.what]
    assert [(one.channels, amount(one), one.evidence) for one in found] == [
        (("alpha_1", "alpha_2"), (180.0,), "in 2 trials")
    ]
    for trials in (azimuths(0.3), azimuths(math.pi)[:1], azimuths(math.pi, 0.88), azimuths(math.pi, u=-3.0)):
        assert not [one for one in numbered_faults(trials) if "astern" in one.what]
    assert [one for one in numbered_faults(azimuths(math.pi, 0.92)) if "astern" in one.what]
    assert not [one for one in numbered_faults([*azimuths(math.pi), *azimuths(math.pi, 0.45)]) if "astern" in one.what]
    assert [one for one in numbered_faults([*azimuths(math.pi), *azimuths(math.pi, 0.55)]) if "astern" in one.what]
    assert [one for one in numbered_faults(azimuths(0.55 * math.pi)) if "astern" in one.what]
    assert not [one for one in numbered_faults(azimuths(0.45 * math.pi)) if "astern" in one.what]


# -- a rudder that is late, frozen, or an order


def helm(t: Array) -> Array:
    """Ten degrees to either side in turn every 40 s, at 3 deg/s."""
    return np.interp(np.mod(t, 80.0), [0, 20, 26.67, 60, 66.67, 80], [10, 10, -10, -10, 10, 10]) * DEGREE


def late(by: float, dt: float = 0.5, rows: int = 1000, **more: Any) -> list[Fault]:
    """A hull without damping, r' = K delta, whose indicator is late by so many seconds."""
    t = dt * np.arange(float(rows))
    fine = np.arange(0.0, t[-1] + 0.05, 0.05)
    turned = np.concatenate([[0.0], np.cumsum(0.025 * (helm(fine)[1:] + helm(fine)[:-1]))])
    r = 0.01 * np.interp(t, fine, turned) - 0.01
    trial = Trial("a", t, {"u": np.full(rows, 5.0), "r": r, "delta": helm(t - by), **more}, meta={"L_pp": L})
    return [one for one in helm_faults([trial]) if one.key == "lag"]


@pytest.mark.parametrize("by", [1.9, 2.6, -0.9, -1.6])
def test_a_late_rudder_is_told_by_when_the_yaw_bends(by: float) -> None:
    """A hull adds .18 ship times by its damping, which is taken off; lags are .63 s apart, a parabola between."""
    (fault,) = late(by)
    wanted = by - 0.18 * math.sqrt(L / 9.81)
    assert amount(fault)[0] == pytest.approx(-wanted, abs=0.11)
    assert fault.what == f"the rudder is {'late' if by > 0 else 'early'} by {abs(amount(fault)[0]):.2g} s"
    assert isinstance(fault.remedy, Remedy)
    assert ("it is the order" in fault.remedy.text) == (by < 0)
    assert f"{-amount(fault)[0]:+.3g} +-" in fault.evidence
    assert ("before the one" in fault.evidence) == (by > 0)


@pytest.mark.slow
def test_a_lag_of_a_third_of_a_ship_time_by_three_moves_counts() -> None:
    assert late(0.35 * 3.162 + 0.57 + 0.15)
    assert not late(0.35 * 3.162 + 0.57 - 0.15)
    assert not late(-0.35 * 3.162 + 0.57 + 0.15)
    assert late(-0.35 * 3.162 + 0.57 - 0.15)
    assert late(1.9, rows=240)  # at 20, 60 and 100 s
    assert not late(1.9, rows=200)
    astern = np.where(np.arange(1000) < 800, -1.0, 1.0)
    assert not late(1.9, n_P=astern)
    assert not late(1.9, n_P=np.maximum(astern, 0.0))


def test_orders_called_the_angle_are_followed_at_the_rate_of_solas() -> None:
    t = np.arange(100.0)
    steps = np.where(t // 20 % 2 == 0, 10.0, -10.0) * DEGREE
    (fault,) = [one for one in helm_faults([log(u=5.0, r=wavy(0.01), delta=steps)]) if "orders" in one.what]
    assert (fault.key, amount(fault)) == ("order_as_measured", (2.32,))
    assert fault.evidence.startswith("4 leaps, up to 20 deg/s")


def flickering(held: int, usual: int = 3, step: float = 0.1, rows: int = 1200) -> list[Fault]:
    """An indicator in steps that repeats a value a few rows, and once for many."""
    rng = np.random.default_rng(0)
    levels = np.cumsum(rng.choice([-step, step], rows)) * DEGREE
    values = np.repeat(levels, usual)[:rows]
    values[600 : 600 + held] = values[600]
    return [one for one in stuck_faults([log(rows, delta=values + 1e-9)]) if one.key == "frozen"]


def test_a_frozen_indicator_repeats_four_times_as_long_as_ever() -> None:
    (fault,) = flickering(200)
    assert isinstance(fault.remedy, Remedy)
    ((first, last),) = fault.remedy.steps[0].where
    assert (first, last) == (pytest.approx(600.0, abs=3.0), pytest.approx(800.0, abs=3.0))
    assert fault.remedy.steps[0].trials == ("a",)
    assert not flickering(28)
    assert not flickering(200, usual=16)
    assert not stuck_faults_of_few()


def stuck_faults_of_few() -> list[Fault]:
    """Nine stretches that repeat are too few to say what is usual."""
    values = np.repeat(np.arange(8.0), 4) * DEGREE
    return [*stuck_faults([log(132, delta=np.concatenate([values, np.full(100, 0.3)]))])]


# -- findings of one of several rudders


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_sense_of_each_of_two_rudders_shows_where_they_move_together(side: float) -> None:
    t = np.arange(400.0)
    delta = 0.2 * np.sign(np.sin(2.0 * np.pi * (t + 0.5) / 80.0))
    r = np.zeros(400)
    for k in range(399):
        r[k + 1] = r[k] + (0.05 * delta[k] - r[k]) / 8.0
    both = {"u": 5.0, "psi": np.cumsum(r), "r": r, "delta_1": side * delta, "delta_2": side * delta + wavy(0.01, 400)}
    wrong = [one for one in numbered_faults([log(400, **both)]) if one.key == "sign"]
    assert [one.where for one in wrong] == ([] if side > 0 else ["delta_1", "delta_2"])
    for one in wrong:
        assert isinstance(one.remedy, Remedy)
        assert one.remedy.steps == ()  # nothing says that the motion is not mirrored instead
        assert f"rudder {one.where[-1]} sign" in one.what
    apart = np.random.default_rng(0).permutation(both["delta_2"])
    assert not [one for one in numbered_faults([log(400, **{**both, "delta_2": apart})]) if one.key == "sign"]


@pytest.mark.slow
@pytest.mark.parametrize("late", [0.0, 2.0, 3.0])
def test_a_late_rudder_of_a_ship_of_unknown_length_is_told_and_a_sound_one_is_not(late: float) -> None:
    ship = load("kcs")
    _, n_P = approach(ship)
    runs = [simulate(ship, Zigzag(n_P, a, a), duration=400.0, dt=0.05, every=6) for a in (0.175, 0.35)]
    logs = [shifted(replace(run, meta={**run.meta, "L_pp": None}), -late, "delta") for run in runs]
    found = [fault for fault in rudder.helm_faults(logs) if fault.key == "lag"]
    assert len(found) == (late > 0.0)
    for fault in found:
        assert "late" in fault.what
        assert fault.remedy.steps[0].amount[0] == pytest.approx(-late, abs=0.35 * math.sqrt(100.0 / 9.81))


@pytest.mark.parametrize(("sizes", "told"), [((-4.0, -4.0, -4.0), True), ((-4.0, -4.0, 1.3), False),
                                             ((-4.0, 1.4, -4.0), False), ((-4.0, -4.9, -3.1), True)])  # fmt: skip
def test_a_lag_that_hangs_on_an_assumed_length_is_none(
    sizes: tuple[float, float, float], told: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rudder of a boat of 24 m was called 4.1 s early by the windows of 100 m, and 1.3 s late by those of 200 m."""
    of = dict(zip((None, 50.0, 200.0), sizes, strict=True))
    monkeypatch.setattr(rudder, "rudder_lag", lambda some: rudder.Lag(of[some[0].meta.get("L_pp")], 0.1, 1.0, True))
    trial = log(length=None, u=1.0, r=0.0, delta=0.0)
    found = rudder._whatever_its_length((trial,))
    assert (found is not None) == told
    assert rudder._whatever_its_length((replace(trial, meta={"L_pp": 200.0}),)) is not None


@pytest.mark.parametrize(("turns", "told"), [(0.014, True), (0.2, True), (0.3, False), (2.0, False), (200.0, False)])
def test_revolutions_of_a_ship_of_unknown_length_screw_some_metres(turns: float, told: bool) -> None:
    """At 5 m/s: 25 m a revolution are none, 17 m would be; how many are too many only a length tells."""
    t = np.arange(400.0)
    trial = Trial("a", t, {"u": np.full(400, 5.0), "n_P": np.full(400, turns)})
    found = list(shaft_faults([trial]))
    assert [one.key for one in found] == ["unit"] * told


def test_a_yaw_that_is_explained_exactly_is_judged() -> None:
    """Nothing is left over of it at any delay, and rounding leaves less: no logarithm is taken of that."""
    t = np.arange(241.0)
    r = np.gradient(np.radians(20.0 + np.maximum(t - 60.0, 0.0)), t)
    rudder = np.where(t >= 60.0, math.radians(12.0), 0.0)
    exact = log(241, length=None, u=5.0004, r=np.where(t < 60.0, np.nan, r), delta=rudder)
    found = effect([exact])
    assert found is not None
    assert found.left.min() == pytest.approx(1e-9)
    assert found.late == 0.0
    assert not found.opposed


def test_angles_that_are_all_too_large_are_divided_by_as_much() -> None:
    """Three angles to each side, 1.1 times round ones: no offset, no other side, no neutral."""
    logs = [log(60, name=f"t{k}", delta=1.1 * side * degrees * DEGREE, r=side * 0.01, u=5.0)
            for k, (side, degrees) in enumerate([(s, d) for s in (1, -1) for d in (10, 20, 30)])]  # fmt: skip
    (found,) = _balance(logs)
    assert (found.key, found.what) == ("rudder_scale", "rudder angles are +10.0 % off")
    assert amount(found) == pytest.approx((1.0 / 1.1,), rel=3e-3)

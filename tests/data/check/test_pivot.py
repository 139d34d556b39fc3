"""A ship that is steered by a rudder pivots within bounds; a track that does not is that of another point of it."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.check import check_folder
from seatrial.data.check.pivot import _STRETCH, PIVOTS, Pivot, pivot, pivot_faults
from seatrial.data.check.symmetry import Least

L, MID = 60.0, 0.42
LOW, HIGH = PIVOTS


def swinging(
    at: float = 0.0, *, pivot: float = MID, course: float = 0.4, water: tuple[float, float] = (0.0, 0.0),
    askew: float = 0.0, period: float = 90.0, name: str = "a", **more: np.ndarray,
) -> Trial:  # fmt: skip
    """Zigzags whose sway is -pivot L r, of a point `at` lengths ahead of midship, in water that moves [m/s].

    Args:
        askew: what the heading is too large by [rad], which turned the velocity over ground.
    """
    t, rng = np.arange(0.0, 900.0, 0.5), np.random.default_rng(3)
    turn = 2.0 * math.pi / period
    r = math.radians(25.0) * turn * np.cos(turn * t) + math.radians(0.2)
    psi = course + math.radians(25.0) * np.sin(turn * t) + math.radians(0.2) * t
    u, v = 5.0 - 30.0 * r**2, (at - pivot) * L * r
    c, s = np.cos(psi), np.sin(psi)
    north, east = u * c - v * s + water[0], u * s + v * c + water[1]
    shown = psi + askew
    table = {
        "psi": shown, "u": north * np.cos(shown) + east * np.sin(shown),
        "v_m": east * np.cos(shown) - north * np.sin(shown), "r": r, "delta": 0.3 * np.sign(np.cos(turn * t + 0.6)),
        "x": (np.cumsum(north) - 0.5 * north) * 0.5, "y": (np.cumsum(east) - 0.5 * east) * 0.5,
    }  # fmt: skip
    noise = {"u": 0.02, "v_m": 0.02, "r": 1e-4, "psi": 1e-3, "x": 0.2, "y": 0.2}
    table |= {key: table[key] + rng.normal(0.0, size, t.size) for key, size in noise.items()} | more
    return Trial(name, t, table, {}, {"L_pp": L})


@pytest.mark.parametrize("at", [-0.4, 0.0, 0.35])
def test_the_pivot_is_found_beside_a_current_and_a_compass_that_is_off(at: float) -> None:
    other = swinging(at, course=2.9, water=(-0.2, 0.3), askew=0.06, name="b")
    found = pivot([swinging(at, water=(0.4, -0.3), askew=0.06), other], L)
    assert found is not None
    assert found.ahead == pytest.approx((MID - at) * L, abs=0.6)
    assert 0.0 < found.error < 0.5


def test_an_antenna_is_told_with_the_place_that_it_may_have() -> None:
    [fault] = pivot_faults([swinging(-0.45)])
    assert (fault.severity, fault.key, fault.where) == ("warning", "lever_arm", "x, y, u, v_m")
    assert "some 27 m abaft of midship" in fault.what
    assert "0.87 +- " in fault.evidence
    assert "antenna = [ahead, to starboard]" in str(fault.remedy)
    assert "-40 to -13 m ahead" in str(fault.remedy)
    [fault] = pivot_faults([swinging(0.4)])
    assert "some 24 m ahead of midship" in fault.what


@pytest.mark.parametrize("late", [4.0, -4.0])
def test_a_heading_that_lags_looks_like_an_antenna_and_is_named_beside_it(late: float) -> None:
    """It turns a velocity of 5 m/s by r times the lag: 20 m, a third of the length."""
    trial = swinging(0.0)
    psi = np.interp(trial.t - late, trial.t, trial["psi"])
    c, s = np.cos(trial["psi"] - psi), np.sin(trial["psi"] - psi)
    u, v = trial["u"], trial["v_m"]
    [fault] = pivot_faults([trial.having(psi=psi, u=u * c - v * s, v_m=u * s + v * c)])
    assert f"antenna some {'2' if late > 0 else '1'}" in fault.what
    assert f"{'ahead' if late > 0 else 'abaft'} of midship" in fault.what
    found = re.search(r"a heading that is (late|early) by ([\d.]+) s", fault.evidence)
    assert found is not None
    assert found[1] == ("late" if late > 0 else "early")
    assert float(found[2]) == pytest.approx(4.0, abs=0.6)


@pytest.mark.parametrize("at", [-0.15, 0.0, 0.15])
def test_ships_within_the_bounds_are_left_in_peace(at: float) -> None:
    assert [*pivot_faults([swinging(at)])] == []


def test_a_place_is_told_four_standard_errors_beyond_the_bounds() -> None:
    edge = HIGH * L + 4.0
    assert Pivot(edge - 1e-6, 1.0).antenna(L) is None
    assert Pivot(edge + 1e-6, 1.0).antenna(L) == pytest.approx(((LOW - HIGH) * L - 4.0, -4.0))
    assert Pivot(LOW * L - 4.0 + 1e-6, 1.0).antenna(L) is None
    assert Pivot(LOW * L - 5.0, 1.0).antenna(L) == pytest.approx((5.0, (HIGH - LOW) * L + 5.0))


@pytest.mark.parametrize("control", ["alpha_1", "n_bow", "throttle_port", "f_side"])
def test_what_turns_without_a_rudder_pivots_where_it_likes(control: str) -> None:
    wave = np.sin(np.arange(1800.0))
    assert pivot([swinging(-0.45)], L) is not None
    assert pivot([swinging(-0.45, **{control: wave})], L) is None
    # a thruster that rests turns nothing
    assert pivot([swinging(-0.45, **{control: 0.0 * wave})], L) is not None


def test_nothing_is_told_without_a_rudder_a_length_or_a_turn() -> None:
    trial = swinging(-0.45)
    assert pivot([trial.having(delta=np.zeros(len(trial)))], L) is None
    assert [*pivot_faults([Trial("a", trial.t, {name: trial[name] for name in trial.channels})])] == []
    assert pivot([trial.rows(slice(0, 19))], L) is None
    straight = trial.having(r=1e-4 * np.sin(trial.t), psi=1e-3 * np.sin(trial.t))
    assert pivot([straight], L) is None
    assert pivot([], L) is None


def test_a_rate_that_only_a_current_tells_apart_is_none() -> None:
    """A turn that is a function of the heading alone: the current would have the same sway."""
    t = np.arange(0.0, 300.0, 0.5)
    psi = 0.3 * np.sin(0.02 * t)
    r = 0.01 * np.cos(psi)
    table = {"psi": psi, "u": 5.0 + 0.01 * np.sin(t), "v_m": -25.0 * r, "r": r, "delta": np.sin(t)}
    assert pivot([Trial("a", t, table)], L) is None


def test_the_currents_of_all_trials_are_those_of_one_fit() -> None:
    """Brute force: least squares with two columns of a current a trial beside the turn and the compass."""
    trials = [swinging(0.1, course=c, water=(0.1 * k, 0.2 - 0.1 * k), name=str(k))
              for k, c in enumerate((0.4, 1.9, 3.0))]  # fmt: skip
    rows, sway, stretch = [], [], []
    for k, trial in enumerate(trials):
        u, psi, r = (trial[name] for name in ("u", "psi", "r"))
        own = np.zeros((len(trial), 6))
        own[:, 2 * k], own[:, 2 * k + 1] = -np.sin(psi), np.cos(psi)
        rows.append(np.column_stack([-r, -u, own]))
        sway.append(trial["v_m"])
        stretch.append(1000 * (k + 1) + np.floor(np.cumsum(u) * trial.dt / (_STRETCH * L)))
    columns, y, part = np.concatenate(rows), np.concatenate(sway), np.concatenate(stretch)
    whole, found = Least.of(columns, y, part), pivot(trials, L)
    assert found is not None
    assert found.ahead == pytest.approx(np.linalg.lstsq(columns, y, rcond=None)[0][0], rel=1e-9)
    assert found.error == pytest.approx(math.sqrt(whole.first(1)[1][0, 0]), rel=1e-6)
    others = np.linalg.qr(columns[:, 2:])[0]
    rest, left = columns[:, :2] - others @ (others.T @ columns[:, :2]), y - others @ (others.T @ y)
    few = Least.of(rest, left, part, np.linalg.norm(columns[:, :2], axis=0))
    assert few.apart(1) == pytest.approx(whole.apart(1), rel=1e-6)
    assert few.first(1)[1] == pytest.approx(whole.first(1)[1], rel=1e-6)


def test_slow_rows_and_rows_astern_do_not_count() -> None:
    trial = swinging(0.0)
    slow = trial.t > 600.0
    for u in (0.35, -1.0):
        sway = np.where(slow, 3.0 * trial["r"] * L, trial["v_m"])
        odd = trial.having(u=np.where(slow, u * 5.0, trial["u"]), v_m=sway)
        found = pivot([odd], L)
        assert found is not None
        assert found.ahead == pytest.approx(MID * L, abs=0.5)


@pytest.mark.slow
def test_the_folder_says_it_once_of_all_trials() -> None:
    trials = [swinging(-0.45, name="a"), swinging(-0.45, course=2.0, name="b")]
    [found] = [one for one in check_folder(trials) if one.key == "lever_arm"]
    assert found.trials == ("a", "b")
    assert [one for one in check_folder([swinging(0.0)]) if one.key == "lever_arm"] == []

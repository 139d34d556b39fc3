"""Errors of instruments that a fit estimated are taken out of a log: what is left is what right instruments log."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.belief.corrected import as_logged, corrected, of_trial, shared_by_all, summed, words
from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.identify.nuisance import EVERY
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

SHIP = load("kvlcc2")
DEG = math.radians(1.0)


@pytest.fixture(scope="module")
def right() -> Trial:
    run = simulate(SHIP, Zigzag(approach(SHIP)[1], 20 * DEG, 20 * DEG), duration=300.0, dt=0.1, every=10, name="a",
                   environment=Uniform(U_T=10.0, gamma_T=1.0))  # fmt: skip
    return replace(run, meta={**run.meta, "source": "a log"})


def late(trial: Trial, lag: float, *names: str) -> Trial:
    """What the log shows where channels are late."""
    moved = {n: np.interp(trial.t - lag, trial.t, np.unwrap(trial[n]) if n == "psi" else trial[n]) for n in names}
    return trial.having(**moved)


def ahead(trial: Trial, metres: float, aside: float) -> Trial:
    c, s = np.cos(trial["psi"]), np.sin(trial["psi"])
    return trial.having(x=trial["x"] + metres * c - aside * s, y=trial["y"] + metres * s + aside * c)


def received(trial: Trial, metres: float, aside: float) -> Trial:
    """Position and speeds of another point of the hull."""
    moved = ahead(trial, metres, aside)
    return moved.having(u=trial["u"] - aside * trial["r"], v_m=trial["v_m"] + metres * trial["r"])


PLANTED = {
    "offset.delta": (1.5 * DEG, lambda t, c: t.having(delta=t["delta"] + c)),
    "scale.delta": (0.1, lambda t, c: t.having(delta=t["delta"] / (1.0 - c))),
    "port.delta": (0.1, lambda t, c: t.having(delta=np.where(t["delta"] < 0, t["delta"] / (1.0 - c), t["delta"]))),
    "scale.n_P": (-0.05, lambda t, c: t.having(n_P=t["n_P"] / (1.0 - c))),
    "delay.delta": (2.0, lambda t, c: late(t, c, "delta")),
    "delay.position": (3.0, lambda t, c: late(t, c, "x", "y")),
    "delay.speed": (2.0, lambda t, c: late(t, c, "u", "v_m")),
    "bias.psi": (3 * DEG, lambda t, c: t.having(psi=t["psi"] + c)),
    "bias.r": (0.02 * DEG, lambda t, c: t.having(r=t["r"] + c)),
    "scale.u": (0.05, lambda t, c: t.having(u=(1.0 + c) * t["u"])),
    "antenna.ahead": (-100.0, lambda t, c: ahead(t, c, 0.0)),
    "antenna.starboard": (12.0, lambda t, c: ahead(t, 0.0, c)),
    "receiver.ahead": (-100.0, lambda t, c: received(t, c, 0.0)),
    "receiver.starboard": (12.0, lambda t, c: received(t, 0.0, c)),
    "delay.receiver": (3.0, lambda t, c: late(t, c, "x", "y", "u", "v_m")),
    "scale.wind": (0.2, lambda t, c: t.having(U_T=t["U_T"] / (1.0 - c))),
}


@pytest.mark.parametrize("name", PLANTED)
def test_the_log_of_a_wrong_instrument_becomes_that_of_a_right_one(right: Trial, name: str) -> None:
    size, plant = PLANTED[name]
    wrong = plant(right, size)
    again = corrected(wrong, {name: size}, SHIP.model)
    right = right.rows(np.isin(right.t, again.t))  # a shift in time leaves rows out at an end
    inner = slice(5, -5)
    for channel in (*STATES, "delta", "n_P", "U_T", "gamma_T"):
        wanted = right[channel][inner]
        assert (np.abs(again[channel][inner] - wanted) <= 1e-9 * np.maximum(np.abs(wanted), 1.0)).all(), channel
    before = wrong.rows(np.isin(wrong.t, again.t))
    assert any(not np.allclose(before[c], right[c], rtol=1e-6) for c in (*STATES, "delta", "n_P", "U_T"))
    assert again.meta["processing"][-1] == f"corrected by {name}, as estimated"


def test_an_error_of_all_controls_of_one_kind_is_taken_out_of_each() -> None:
    model, t = load("twin_virtual").model, np.arange(0.0, 60.0)
    zero = dict.fromkeys(("x", "y", "psi", "v_m", "r"), 0.0 * t)
    true = {**zero, "u": 3.0 + 0.0 * t, "n_P_1": 2.0 + np.sin(t / 9.0), "n_P_2": 2.0 + np.cos(t / 9.0),
            "delta_1": 0.1 * np.sin(t / 9.0), "delta_2": 0.1 * np.sin(t / 9.0)}  # fmt: skip
    right = Trial("a", t, true, {}, {})
    for name, wrong in (
        ("scale.n_P", right.having(n_P_1=true["n_P_1"] / 0.9, n_P_2=true["n_P_2"] / 0.9)),
        ("delay.delta", right.having(delta_1=0.1 * np.sin((t - 2.0) / 9.0), delta_2=0.1 * np.sin((t - 2.0) / 9.0))),
    ):
        again = corrected(wrong, {name: 0.1 if name == "scale.n_P" else 2.0}, model)
        rows = np.isin(right.t, again.t)
        for channel in ("n_P_1", "n_P_2", "delta_1", "delta_2"):
            np.testing.assert_allclose(again[channel][5:-5], right[channel][rows][5:-5], atol=1e-9, err_msg=name)


def test_errors_of_heading_and_antenna_are_taken_out_together(right: Trial) -> None:
    both = {"antenna.ahead": 50.0, "bias.psi": 2 * DEG}
    wrong = ahead(right, 50.0, 0.0)
    again = corrected(wrong.having(psi=wrong["psi"] + 2 * DEG), both, SHIP.model)
    for name in ("x", "y", "psi"):
        assert again[name] == pytest.approx(right[name], abs=1e-8)


def as_made(trial: Trial, *names: str) -> Trial:
    """The trial with speeds and a rate of turn that a logger differences from its track and heading."""
    psi, t = np.unwrap(trial["psi"]), trial.t
    moved = (np.gradient(trial["x"], t) + 1j * np.gradient(trial["y"], t)) * np.exp(-1j * psi)
    made = {"u": moved.real, "v_m": moved.imag, "r": np.gradient(psi, t)}
    channels = {name: made[name] for name in names}
    return replace(trial.having(**channels), meta={**trial.meta, "derived": dict.fromkeys(names, "x, y, psi")})


def test_speeds_and_turns_that_were_made_from_track_and_heading_follow_their_correction(right: Trial) -> None:
    north, east, size = 5 * DEG, -4 * DEG, 60.0
    psi = np.unwrap(right["psi"])
    compass = right.having(psi=psi + north * np.cos(psi) + east * np.sin(psi))
    for wrong, errors in (
        (compass, {"deviation.north": north, "deviation.east": east}),
        (ahead(right, size, 0.0), {"antenna.ahead": size}),
        (ahead(right, size, 0.0).having(psi=right["psi"] + 40 * DEG), {"antenna.ahead": size, "bias.psi": 40 * DEG}),
    ):
        made, wanted = as_made(wrong, "u", "v_m", "r"), as_made(right, "u", "v_m", "r")
        again = corrected(made, errors, SHIP.model)
        np.testing.assert_allclose(np.unwrap(again["psi"]), psi, atol=1e-9)
        for name in ("u", "v_m", "r"):
            before = np.abs(made[name] - wanted[name])[2:-2].max()
            assert np.abs(again[name] - wanted[name])[2:-2].max() <= 2e-3 * before + 1e-12, (name, errors)
        measured = corrected(wrong, errors, SHIP.model)
        for name in ("u", "v_m", "r"):
            assert np.array_equal(measured[name], right[name]), "what an instrument read is no matter of the others"


def test_a_gap_of_the_heading_leaves_the_speeds_beside_it_as_they_are_made(right: Trial) -> None:
    made = as_made(right.having(psi=right["psi"] + 20 * DEG), "u", "v_m")
    gap = np.where((right.t > 100.0) & (right.t < 110.0), np.nan, made["psi"])
    whole, cut = (corrected(one, {"bias.psi": 20 * DEG}, SHIP.model) for one in (made, made.having(psi=gap)))
    for name in ("u", "v_m"):
        np.testing.assert_allclose(cut[name], whole[name], atol=1e-9)
    assert np.abs(whole["v_m"] - right["v_m"])[2:-2].max() < 0.02 * np.abs(made["v_m"]).max()


def test_a_trial_without_errors_or_without_the_channel_stays_as_it_is(right: Trial) -> None:
    assert corrected(right, {}, SHIP.model) is right
    calm = replace(right, channels={k: v for k, v in right.channels.items() if k not in ("U_T", "gamma_T")})
    assert set(corrected(calm, {"scale.wind": 0.2}, SHIP.model).channels) == set(calm.channels)


def test_currents_and_biases_stay_with_their_trial_and_errors_of_instruments_with_the_instruments(right: Trial) -> None:
    found = {EVERY: {"offset.delta": 1.5 * DEG, "current.north": 0.3},
             "a": {"current_x": 0.1, "current_y": -0.2, "bias_u": 0.05}}  # fmt: skip
    mine = of_trial("a", found, ("a",))
    all_of_it = {"offset.delta": 1.5 * DEG, "current.north": 0.4, "current.east": -0.2, "bias.u": 0.05}
    assert mine == pytest.approx(all_of_it)
    assert of_trial("b", found, ("a",)) == {}
    there = corrected(right, mine, SHIP.model)
    assert np.allclose(there["U_C"] * np.cos(there["gamma_C"]), 0.4)
    assert np.allclose(there["u"], right["u"] - 0.05)
    told = words(mine, SHIP.model, right)
    assert "an offset of delta of 1.5 deg" in told
    assert "a current of 0.447 m/s towards 333 deg" in told


def test_what_all_trials_share_holds_for_those_kept_back_the_current_included() -> None:
    found = {EVERY: {"offset.delta": 1.5 * DEG, "current.north": 0.3}, "a": {"current_x": 0.1}}
    assert of_trial("kept", found, ("a", "kept")) == shared_by_all(found) == found[EVERY]
    assert of_trial("elsewhere", found, ("a", "kept")) == {}
    own = {"current.north": 0.1, "bias.u": 0.05}
    assert summed(shared_by_all(found), own) == pytest.approx({**found[EVERY], "current.north": 0.4, "bias.u": 0.05})


def test_a_motion_as_instruments_with_errors_log_it_is_right_once_it_is_corrected(right: Trial) -> None:
    errors = {"deviation.north": -0.12, "deviation.east": 0.05, "bias.psi": 0.03, "scale.u": 0.04, "bias.r": 1e-4,
              "antenna.ahead": 20.0}  # fmt: skip
    log = as_logged(right, errors, SHIP.model)
    turn = -0.12 * np.cos(right["psi"]) + 0.05 * np.sin(right["psi"]) + 0.03
    assert log["psi"] - right["psi"] == pytest.approx(turn)
    assert log["u"] == pytest.approx(1.04 * right["u"])
    assert np.hypot(log["x"] - right["x"], log["y"] - right["y"]) == pytest.approx(20.0)
    back = corrected(log, errors, SHIP.model)
    for name in STATES:
        assert back[name] == pytest.approx(right[name], abs=1e-6), name
    assert as_logged(right, {"offset.delta": 0.1, "current.north": 1.0}, SHIP.model)["u"] is not None


def test_speeds_that_are_made_by_a_compass_turn_with_it_and_the_track_stays(right: Trial) -> None:
    log = as_logged(right, {"bias.psi": 0.2}, SHIP.model, ("u", "v_m", "r"))
    before, after = ((one["u"] + 1j * one["v_m"]) * np.exp(1j * one["psi"]) for one in (right, log))
    assert after == pytest.approx(before)
    assert log["r"] == pytest.approx(right["r"])
    assert not np.allclose(log["v_m"], right["v_m"])

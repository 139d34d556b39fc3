"""Kinds of manoeuvre told from the data: trials of known kind, and trials that look like another."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from sailed import L_PP, autopilot, deg, sail, steps, zigzag

from seatrial.data import Trial
from seatrial.data.kinds import ABOUT, compared, recognised

TURN = steps((0.0, 0.0), (20.0, 20.0))


def without(trial: Trial, *names: str) -> Trial:
    return replace(trial, channels={name: v for name, v in trial.channels.items() if name not in names})


@pytest.mark.parametrize(("rudder", "heading", "side"), [(10, 10, 1.0), (20, 20, -1.0), (20, 10, 1.0), (5, 1, -1.0)])
def test_a_zigzag_has_its_angles_and_its_first_side(rudder: float, heading: float, side: float) -> None:
    found = recognised(sail(zigzag(rudder, heading, side), 250.0))
    assert found.name == "zigzag"
    assert found.settings["side"] == side
    assert found.settings["rudder"] == pytest.approx(deg(rudder), abs=deg(0.5))
    assert found.settings["heading"] == pytest.approx(deg(heading), abs=deg(1.5))
    assert not found.doubts


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_turn_has_rudder_and_side(side: float) -> None:
    found = recognised(sail(steps((0.0, 0.0), (20.0, 20.0 * side)), 300.0))
    assert (found.label, found.doubts) == (f"turning 20 {'starboard' if side > 0 else 'port'}", ())


def test_a_turn_is_one_in_other_units_of_time_and_length() -> None:
    model = sail(TURN, 300.0)
    scaled = {name: v * {"x": 45.7, "y": 45.7, "u": 6.76, "v_m": 6.76, "r": 1 / 6.76, "n_P": 1 / 6.76}.get(name, 1.0)
              for name, v in model.channels.items()}  # fmt: skip
    ship = replace(model, t=6.76 * model.t, channels=scaled, meta={"L_pp": 45.7 * L_PP})
    assert recognised(ship).label == recognised(model).label


def test_headings_that_wrap_change_nothing() -> None:
    trial = sail(TURN, 300.0)
    wrapped = trial.having(psi=(trial["psi"] + math.pi) % (2 * math.pi) - math.pi)
    assert recognised(wrapped).label == recognised(trial).label


OTHERS = {
    "straight": partial(sail, steps((0.0, 0.0)), 200.0),
    "acceleration": partial(sail, steps((0.0, 0.0)), 120.0, start=0.02),
    "stopping": partial(sail, steps((0.0, 0.0)), 100.0, engine=lambda t: 10.0 if t < 10 else 0.0),
    "astern": partial(sail, steps((0.0, 0.0)), 150.0, engine=lambda t: -6.0, start=0.0),
    "course-keeping": partial(sail, autopilot(lambda t: 0.0 if t < 100 else 30.0 if t < 200 else 0.0), 300.0),
    "initial-turning": partial(sail, steps((0.0, 10.0)), 35.0),
    "pull-out": partial(sail, steps((0.0, 0.0), (10.0, 15.0), (150.0, 0.0), (220.0, -15.0), (360.0, 0.0)), 430.0),
    "recovery": partial(sail, lambda t, psi, r: deg(0 if t < 10 else 35 if t < 36 else -35 if t < 125 else 0), 150.0),
    "spiral": partial(
        sail, lambda t, psi, r: deg(20 - 4 * int(t / 80) if t < 880 else 4 * int((t - 880) / 80) - 20), 1700.0),
    "berthing": partial(sail, autopilot(lambda t: 5.0 * math.sin(t / 7), 30.0), 120.0, start=0.05,
                        engine=lambda t: 8.0 if t < 60 else -7.0 if t < 75 else 0.0),
}  # fmt: skip


@pytest.mark.parametrize("kind", OTHERS)
def test_other_kinds(kind: str) -> None:
    found = recognised(OTHERS[kind]())
    assert found.name == kind, (found.evidence, found.doubts)
    assert found.evidence
    assert kind in ABOUT


def test_a_place_held_and_a_ship_at_rest() -> None:
    rng = np.random.default_rng(2)
    t = np.arange(0.0, 600.0, 1.0)
    place = {"x": 0.2 * np.sin(t / 30), "y": 0.2 * np.cos(t / 50), "psi": 0.03 * np.sin(t / 40),
             "u": 0.01 * np.cos(t / 30), "v_m": 0.0 * t, "f_1": 20.0 * rng.standard_normal(t.size)}  # fmt: skip
    still = {name: 1e-6 * v for name, v in place.items() if name != "f_1"}
    assert recognised(Trial("dp", t, place, meta={"L_pp": 5.0})).name == "station"
    assert recognised(Trial("quay", t, still, meta={"L_pp": 5.0})).name == "at rest"


def _random(seed: int) -> Trial:
    rng = np.random.default_rng(seed)
    angles = rng.choice([-20.0, -10.0, 0.0, 10.0, 20.0], 60)
    return sail(lambda t, psi, r: deg(float(angles[int(t / 9)])), 500.0, seed=seed)


@pytest.mark.parametrize("seed", range(6))
def test_random_orders_are_no_zigzag(seed: int) -> None:
    assert recognised(_random(seed)).name == "mixed"


@pytest.mark.parametrize("seed", range(4))
def test_a_rudder_that_is_reversed_by_the_clock_is_no_zigzag(seed: int) -> None:
    """Binary orders: the same angles to either side as in a zigzag, at headings that nothing fixes."""
    signs = np.sign(np.random.default_rng(seed).standard_normal(40))
    found = recognised(sail(lambda t, psi, r: deg(20.0) * float(signs[int(t / 12)]), 400.0))
    assert found.name == "mixed"


def test_a_rudder_of_the_wrong_sign_is_doubted() -> None:
    trial = sail(TURN, 300.0)
    found = recognised(trial.having(delta=-trial["delta"]))
    assert found.name == "turning"
    assert any("against the rudder" in doubt for doubt in found.doubts)


def test_a_part_of_a_circle_is_doubted() -> None:
    found = recognised(sail(TURN, 95.0))
    assert found.name == "turning"
    assert any("no full circle" in doubt for doubt in found.doubts)


def test_one_reversal_is_a_doubtful_zigzag_or_none() -> None:
    found = recognised(sail(zigzag(15.0, 15.0), 55.0))
    assert found.name == "zigzag"
    assert "one reversal only" in found.doubts


def test_without_a_rudder_the_motion_tells_with_a_doubt() -> None:
    found = recognised(without(sail(TURN, 300.0), "delta"))
    assert found.label == "turning starboard"
    assert any("no rudder" in doubt for doubt in found.doubts)


def test_positions_alone_tell_a_turn() -> None:
    found = recognised(without(sail(TURN, 400.0, noise=0.0), "delta", "psi", "u", "v_m", "r"))
    assert found.name == "turning"


def test_yaw_rate_and_rudder_alone_tell_a_zigzag() -> None:
    found = recognised(without(sail(zigzag(20.0, 20.0), 250.0), "psi", "u", "v_m", "x", "y"))
    assert found.label == "zigzag 20/20 starboard"


def test_gaps_and_spikes_do_not_change_the_kind() -> None:
    trial = sail(zigzag(20.0, 20.0), 250.0)
    rng = np.random.default_rng(4)
    holes = rng.random(len(trial)) < 0.1
    delta = trial["delta"].copy()
    delta[rng.integers(0, delta.size, 8)] = deg(35.0)
    found = recognised(trial.having(psi=np.where(holes, np.nan, trial["psi"]), delta=delta))
    assert found.label == "zigzag 20/20 starboard"


def test_a_channel_that_is_mostly_missing_is_doubted() -> None:
    trial = sail(TURN, 300.0)
    third = (trial.t > 200.0) & (trial.t <= 300.0)
    found = recognised(trial.having(delta=np.where(third, np.nan, trial["delta"])))
    assert found.name == "turning"
    assert any("delta is missing for 33 %" in doubt for doubt in found.doubts)


@pytest.mark.parametrize("every", [2, 3, 5, 10])
def test_a_slower_instrument_is_not_missing_between_its_readings(every: int) -> None:
    trial = sail(TURN, 300.0)
    slow = {name: np.where(np.arange(len(trial)) % every == 1, trial[name], np.nan) for name in ("delta", "u", "v_m")}
    found = recognised(trial.having(**slow))
    assert found.name == "turning"
    assert not any("missing" in doubt for doubt in found.doubts)


def test_too_little_is_unknown() -> None:
    trial = sail(TURN, 300.0)
    assert recognised(trial.rows(slice(0, 10))).name == "unknown"
    bare = without(trial, "psi", "r", "x", "y")
    assert (recognised(bare).name, compared(bare, recognised(bare))) == ("unknown", "")


@pytest.mark.parametrize(
    ("told", "verdict"),
    [
        ("turning", "agrees"),
        ("pull-out", "close"),
        ("zigzag", "differs"),
        ("random", "differs"),
        ("", ""),
        ("trip 7", ""),
    ],
)
def test_what_the_sidecar_says_is_compared(told: str, verdict: str) -> None:
    trial = sail(TURN, 300.0, kind=told)
    assert compared(trial, recognised(trial)) == verdict


def test_the_name_of_the_file_tells_nothing() -> None:
    assert recognised(sail(TURN, 300.0, name="zigzag_10_10")).name == "turning"

"""Every tally agrees with the indices that its manoeuvre reads off the stored run."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.campaign import Campaign, Case
from seatrial.campaign.chunk import compute
from seatrial.campaign.inputs import Input
from seatrial.environment import Uniform
from seatrial.manoeuvres import Manoeuvre
from seatrial.manoeuvres.stopping import CrashAstern, Stopping
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load

N_P, TEN, FULL = 11.85, math.radians(10.0), math.radians(35.0)
CASES = {
    "zigzag": (Zigzag(N_P, TEN, TEN), 90.0),
    "zigzag to port": (Zigzag(N_P, 2 * TEN, TEN, -1.0), 60.0),
    "turning": (Turning(N_P, -FULL), 90.0),
    "stopping": (Stopping(N_P), 900.0),
    "crash astern": (CrashAstern(N_P, -N_P), 180.0),
}
ROUGH = {
    "U_C": Input("uniform", (0.0, 0.2)), "gamma_C": Input("uniform", (0.0, 6.0)), "psi": Input("uniform", (-3.0, 3.0)),
    "x": Input("normal", (0.0, 50.0)), "ship.hull.N_r": Input("normal", (1.0, 0.1), factor=True),
    "policy.n_P": Input("normal", (1.0, 0.02), factor=True),
}  # fmt: skip


def campaign(policy: Manoeuvre, duration: float, *, whole: bool, validity: dict[str, tuple[float, float]]) -> Campaign:
    ship = load("kvlcc2_l7")
    ship = replace(ship, validity={**ship.validity, **validity})
    case = Case("case", ship, policy, ship.speed, duration, 0.2, whole=whole)
    return Campaign("test", (case,), 24, ROUGH, weather=Uniform(U_C=0.1))


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_tally_agrees_with_the_stored_run(name: str) -> None:
    policy, duration = CASES[name]
    kernel = compute(campaign(policy, duration, whole=False, validity={}), 0).columns
    stored = compute(campaign(policy, duration, whole=True, validity={}), 0).columns
    tallied = set(kernel) & set(stored)
    assert len(tallied) > len(ROUGH) + 5
    for column in tallied:
        np.testing.assert_allclose(kernel[column], stored[column], rtol=1e-9, atol=1e-9, err_msg=column)


@pytest.mark.slow
def test_a_run_that_leaves_its_validity_keeps_what_it_reached_and_no_more() -> None:
    policy, duration = CASES["turning"]
    tight = {"u": (0.55, 2.0)}
    kernel = compute(campaign(policy, duration, whole=False, validity=tight), 0).columns
    stored = compute(campaign(policy, duration, whole=True, validity=tight), 0).columns
    assert np.isfinite(kernel["failed"]).sum() > 4
    np.testing.assert_allclose(kernel["failed"], stored["failed"], atol=1e-9)
    for column in ("advance", "tactical_diameter", "complete"):
        np.testing.assert_allclose(kernel[column], stored[column], rtol=1e-9, err_msg=column)


def test_validity_is_judged_by_the_speed_through_the_water() -> None:
    """In a following current a ship is fast over ground, not through the water."""
    policy, duration = CASES["stopping"]
    ship = load("kvlcc2_l7")
    ship = replace(ship, validity={"u": (-0.5, ship.speed + 0.05)})
    case = Case("case", ship, policy, ship.speed, duration, 0.1)
    following = Campaign("test", (case,), 4, {"gamma_C": Input("uniform", (0.0, 6.0))}, weather=Uniform(U_C=0.5))
    assert np.isnan(compute(following, 0).columns["failed"]).all()
    straight = replace(case, ship=replace(ship, validity={"v_m": (-0.02, 0.02)}))  # the stream takes it aside by .5
    across = Campaign("test", (straight,), 4, {"gamma_C": Input("uniform", (1.0, 2.0))}, weather=Uniform(U_C=0.5))
    assert np.isnan(compute(across, 0).columns["failed"]).all()


def test_a_zigzag_of_a_ship_that_never_turns_has_no_overshoot() -> None:
    ship = load("kvlcc2_l7")
    case = Case("case", ship, Zigzag(N_P, TEN, math.radians(170.0)), ship.speed, 20.0, 0.1)
    inputs = {"ship.hull.N_r": Input("uniform", (0.9, 1.1), factor=True)}
    found = compute(Campaign("test", (case,), 2, inputs), 0).columns
    assert np.isnan(found["first_overshoot"]).all()
    assert np.isnan(found["initial_turning_time"]).all()
    assert not found["complete"].any()

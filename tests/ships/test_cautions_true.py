"""What the cautions of ship files say of failed requirements is true of their numbers."""

import math

import numpy as np
import pytest

from seatrial.environment import CALM
from seatrial.models.tanker import Tanker
from seatrial.ships.files import load
from seatrial.validate.requirements.probe import Probe
from seatrial.validate.requirements.scopes import BERTHING, COLLISION_AVOIDANCE, checked


def said(name):
    return " ".join(load(name).notes["cautions"])


@pytest.mark.parametrize("name", ["qiuxin5", "cybership2", "esso_190k_tanker", "modified_abkowitz_kvlcc2_l7"])
def test_no_wind_and_no_waves(name):
    ship = load(name)
    assert not ship.model.feels_wind
    assert ship.model.part("waves") is None
    assert "No wind and no waves" in said(name)


def test_radius_of_gyration_of_the_tug():
    ship = load("qiuxin5")
    radius = math.sqrt(ship.model.inertia.m_33 / ship.model.body.m) / ship.L_pp
    assert f"{radius:.3f} L_pp" in said("qiuxin5")
    assert radius < 0.25


def test_damping_of_cybership_2_feeds_energy_in_a_slow_drifting_turn():
    model = load("cybership2").model
    D = np.array(model.damping.matrix(0.0, 0.0, 0.0), dtype=float)
    values, vectors = np.linalg.eigh(0.5 * (D + D.T))
    assert f"an eigenvalue of {values[0]:.1f}" in said("cybership2")
    nu = 1e-3 * vectors[:, 0]  # so slow that the linear part decides
    M = np.array(model.inertia.matrix)
    rates = model.derivative((0.0, 0.0, 0.0, *nu), (0.0, 0.0, 0.0), CALM)[3:6]
    assert nu @ M @ np.array(rates, dtype=float) > 0.0


def test_the_tanker_is_not_damped_on_the_spot():
    ship = load("esso_190k_tanker")
    assert isinstance(ship.model, Tanker)
    assert ship.model.derivative((0.0, 0.0, 0.0, 0.0, 0.0, 0.01), (0.0, 0.0), CALM)[5] == 0.0
    assert "No damping of a turn on the spot" in said("esso_190k_tanker")


def test_the_modified_abkowitz_ship_begins_where_its_caution_says():
    low, high = load("modified_abkowitz_kvlcc2_l7").validity["u"]
    assert f"from {low:g} to {high:g} m/s" in said("modified_abkowitz_kvlcc2_l7")


def test_a_moment_as_ordered_is_not_called_a_rudder():
    item = next(one for one in COLLISION_AVOIDANCE if one.number == "6")
    judgement = checked(item, Probe.of(load("cybership2")))
    assert judgement.verdict == "fail"
    assert "no rudder: N_tau is a moment as ordered" in judgement.reason
    assert "the rudder works" not in judgement.reason


@pytest.mark.parametrize(
    ("name", "number", "words"),
    [
        pytest.param("qiuxin5", "4", "added mass in surge", marks=pytest.mark.slow),
        pytest.param("cybership2", "4", "gains energy", marks=pytest.mark.slow),
        ("esso_190k_tanker", "2", "yaw is not damped, at 0 U"),
        ("modified_abkowitz_kvlcc2_l7", "1", "not valid at rest, but from 0.3 to 1.42 m/s"),
    ],
)
def test_the_printed_reason_is_that_of_the_caution(name, number, words):
    item = next(one for one in BERTHING if one.number == number)
    judgement = checked(item, Probe.of(load(name)))
    assert judgement.verdict == "fail"
    assert words in judgement.reason

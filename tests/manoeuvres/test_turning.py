import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import ParameterError
from seatrial.data import DataError, Trial
from seatrial.manoeuvres.initial_turning import InitialTurning
from seatrial.manoeuvres.reading import through_water
from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag

SHARED = Path(__file__).parents[3] / "shared" / "refs"


def circle(side=1.0, psi_0=0.3, radius=50.0, U=2.0, approach=20.0, dt=0.1, turns=2.0, **extra):
    """A straight approach, then at once a circle: advance R, transfer R, tactical diameter 2 R."""
    t = np.arange(0.0, approach + turns * 2 * math.pi * radius / U, dt)
    since = np.maximum(t - approach, 0.0)
    r = side * U / radius
    along = U * np.minimum(t, approach) + radius * np.sin(U / radius * since)
    across = side * radius * (1 - np.cos(U / radius * since))
    c, s = math.cos(psi_0), math.sin(psi_0)
    psi = psi_0 + r * since
    delta = np.where(t >= approach, side * 0.6, 0.0)
    channels = {
        "x": 7.0 + c * along - s * across, "y": -3.0 + s * along + c * across,
        "psi": np.angle(np.exp(1j * psi)), "u": np.full_like(t, U), "v_m": 0 * t,
        "r": np.where(t >= approach, r, 0.0), "delta_cmd": delta, **extra,
    }  # fmt: skip
    return Trial("circle", t, channels)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("psi_0", [0.0, 0.3, 3.0])
def test_circle_of_known_radius(side, psi_0):
    trial = circle(side, psi_0)
    policy = Turning(10.0, side * 0.6)
    found = policy.indices(trial, 25.0)
    assert policy.complete(trial)
    assert found["advance"].value == pytest.approx(50.0, rel=1e-3)
    assert found["transfer"].value == pytest.approx(50.0, rel=1e-3)
    assert found["tactical_diameter"].value == pytest.approx(100.0, rel=1e-3)
    assert found["tactical_diameter"].over_L == pytest.approx(4.0, rel=1e-3)
    assert found["steady_diameter"].value == pytest.approx(100.0, rel=1e-6)
    assert found["time_90"].value == pytest.approx(0.5 * math.pi * 25.0, abs=0.02)
    assert found["time_180"].value == pytest.approx(math.pi * 25.0, abs=0.02)
    assert found["speed_loss"].value == pytest.approx(0.0, abs=1e-12)


def test_a_current_is_taken_off_before_drift_is_told():
    """Over ground a ship that only floats along moves with the current, whichever way it heads."""
    psi = np.linspace(0.0, 2 * math.pi, 60)
    u_C, v_C = 0.8 * np.cos(1.1 - psi), 0.8 * np.sin(1.1 - psi)
    channels = {"psi": psi, "u": 3.0 + u_C, "v_m": -0.2 + v_C, "U_C": np.full(60, 0.8), "gamma_C": np.full(60, 1.1)}
    u, v_m = through_water(Trial("afloat", np.arange(60.0), channels))
    assert u == pytest.approx(3.0)
    assert v_m == pytest.approx(-0.2)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_speed_loss_and_drift_of_the_steady_part(side):
    trial = circle(side)
    steady = trial.t > 21.0
    slow = trial.having(u=np.where(steady, 1.2, 2.0), v_m=np.where(steady, -side * 0.5, 0.0))
    found = Turning(10.0, side * 0.6).indices(slow, 25.0)
    assert found["speed_loss"].value == pytest.approx(1 - 1.3 / 2.0)
    assert found["drift"].value == pytest.approx(math.atan2(0.5, 1.2))


def test_execute_from_a_noisy_rudder_without_order():
    trial = circle()
    t = trial.t
    noise = 0.004 * np.sin(37.0 * t)
    channels = {k: v for k, v in trial.channels.items() if k != "delta_cmd"}
    measured = Trial("m", t, {**channels, "delta": np.clip(0.3 * (t - 20.0), 0, 0.6) + noise})
    found = Turning(10.0, 0.6).indices(measured, 25.0)
    assert found["advance"].value == pytest.approx(50.0, abs=1.0)  # 2 m/s, 0.3 s of noise


def test_order_on_from_the_first_sample():
    trial = circle(approach=0.0)
    assert Turning(10.0, 0.6).indices(trial, 25.0)["advance"].value == pytest.approx(50.0, rel=1e-3)


def test_short_run_gives_what_it_holds():
    found = Turning(10.0, 0.6).indices(circle(turns=0.4), 25.0)
    assert set(found) == {"advance", "transfer", "time_90"}
    assert not Turning(10.0, 0.6).complete(circle(turns=0.4))


def test_rudder_that_never_moves():
    trial = circle()
    with pytest.raises(DataError, match=r"^circle: delta_cmd\b"):
        Turning(10.0, 0.6).indices(trial.having(delta_cmd=0 * trial.t), 25.0)


def test_command_is_the_order_from_the_start():
    policy = Turning(9.0, -0.6)
    memory = policy.begin((0.0,) * 6)
    assert policy.command(0.0, (0.0,) * 6, memory) == ((9.0, -0.6), ())


@pytest.mark.skipif(not SHARED.exists(), reason="reference runs absent: ../shared/refs")
@pytest.mark.parametrize("side", ["+35", "-35"])
def test_reference_kvlcc2(side):
    table = np.loadtxt(SHARED / f"kvlcc2_L7_turn{side}.csv", delimiter=",", comments="#")
    names = ("u", "v_m", "r", "x", "y", "psi", "delta")
    trial = Trial("ref", table[:, 0], {n: table[:, i + 1] for i, n in enumerate(names)})
    found = Turning(11.85, math.radians(float(side))).indices(trial, 7.0)
    truth = json.loads((SHARED / "kvlcc2_reference_metrics.json").read_text())[f"L7_paper_turn{side}"]
    assert found["advance"].over_L == pytest.approx(truth["advance_L"], abs=2e-3)
    assert found["transfer"].over_L == pytest.approx(truth["transfer_L"], abs=2e-3)
    assert found["tactical_diameter"].over_L == pytest.approx(truth["tactical_L"], abs=2e-3)
    assert math.degrees(found["drift"].value) == pytest.approx(abs(truth["drift_end_deg"]), abs=0.1)


@pytest.mark.parametrize("make", [
    lambda: Turning(10.0, 10.0), lambda: Turning(10.0, -35.0), lambda: Zigzag(10.0, 10, 10),
    lambda: Zigzag(10.0, 0.1, 20), lambda: Zigzag(10.0, -0.1, 0.1), lambda: Straight(10.0, 5.0),
    lambda: InitialTurning(10.0, 10.0, 0.1),
])  # fmt: skip
def test_angles_in_degrees_are_refused(make: Any) -> None:
    """Ten radians are one and a half turns of the rudder; a zigzag of 10/10 came back without a figure."""
    with pytest.raises(ParameterError, match=r"is -?[\d.]+ rad; .*\b180 deg\b"):
        make()

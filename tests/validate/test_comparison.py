import math
from pathlib import Path

import numpy as np
import pytest

from example_report import arc
from seatrial.data import DataError, Trial
from seatrial.validate.comparison import compare, constant_velocity, manoeuvre, pooled
from seatrial.validate.metrics import ESSO_OSAKA_SIGMA

DATA = Path(__file__).parents[3] / "shared" / "data" / "esso_osaka_frt" / "data"


@pytest.mark.parametrize("restart", [None, 7.0])
def test_constant_velocity_is_exact_on_an_arc(restart):
    trial = arc()
    baseline = constant_velocity(trial, restart)
    found = compare(trial, baseline, label="cv", restart=restart, sigma=ESSO_OSAKA_SIGMA)
    assert found.standardised == pytest.approx(0.0, abs=1e-20)


def test_constant_velocity_goes_straight_without_turning():
    trial = arc().having(r=np.zeros(301))
    found = constant_velocity(trial, None)
    assert np.hypot(found["x"][-1], found["y"][-1]) == pytest.approx(30.0 * math.hypot(1.5, 0.2))


def test_constant_velocity_waits_for_a_complete_sample():
    trial = arc()
    u = trial["u"].copy()
    u[100:103] = np.nan
    found = constant_velocity(trial.having(u=u), 10.0)
    assert np.isnan(found["x"][100:103]).all()
    assert found["x"][103] == trial["x"][103]


def test_rows_are_matched_by_time():
    trial = arc()
    part = trial.rows(slice(50, 250, 3))
    found = compare(trial, part, label="same", sigma=ESSO_OSAKA_SIGMA)
    assert len(found.measured) == len(found.predicted) == len(part)
    assert found.standardised == 0.0
    assert found.metrics["x"].rmse == 0.0
    assert found.samples == len(part)


def test_no_common_time():
    trial = arc()
    late = Trial("late", trial.t + 1000.0, trial.channels)
    with pytest.raises(DataError, match="shares no time"):
        compare(trial, late, label="late")


def test_pooled_weighs_by_samples():
    trial = arc()
    off = trial.having(u=trial["u"] + 0.5)
    sigma = {"u": 0.5}
    one = compare(trial, off, label="a", sigma=sigma)
    two = compare(trial.rows(slice(0, 100)), trial, label="b", sigma=sigma)
    assert one.standardised == pytest.approx(1.0)
    assert pooled([one, two]) == pytest.approx(301 / 401)
    assert math.isnan(pooled([]))


def test_turning_indices_measured_and_predicted():
    trial = arc(1500, meta={"kind": "turning", "set_points": {"delta [deg]": 20.0}})
    wide = trial.having(x=1.1 * trial["x"], y=1.1 * trial["y"])
    found = compare(trial, wide, label="wide", L_pp=3.0)
    assert found.index_units["tactical_diameter"] == "m"
    measured, predicted = found.indices["tactical_diameter"]
    assert predicted == pytest.approx(1.1 * measured)
    assert not compare(trial, wide, label="wide", L_pp=3.0, restart=10.0).indices


def test_manoeuvre_from_meta():
    points = {"delta": 0.1, "psi": 0.2, "side": "port"}
    found = manoeuvre(arc(meta={"kind": "zigzag", "set_points": points}))
    assert (found.delta, found.psi, found.side) == (0.1, 0.2, -1.0)
    assert manoeuvre(arc(meta={"kind": "zigzag", "set_points": {"delta": 0.1}})) is None
    assert manoeuvre(arc(meta={"kind": "random"})) is None
    port = arc(meta={"kind": "zigzag", "set_points": {"rudder": 0.3, "heading": 0.2}})
    found = manoeuvre(port.having(delta=-port["delta"]))
    assert (found.delta, found.psi, found.side) == (0.3, 0.2, -1.0)


NAMES = {"x": "x_position_mid [m]", "y": "y_position_mid [m]", "psi": "psi_hat [rad]", "u": "u_velo [m/s]",
         "v_m": "vm_velo [m/s]", "r": "r_angvelo [rad/s]"}  # fmt: skip


@pytest.mark.skipif(not DATA.exists(), reason="Esso Osaka data absent: see ../shared/data/esso_osaka_frt")
def test_evaluator_on_measured_data_against_a_plain_loop():
    """notes/esso_osaka.md: sum over states, mean over samples, restart every 100 s, Euler 0.1 s."""
    path = DATA / "turning" / "turn_14-Oct-2020_14_29_49.csv"
    table = np.genfromtxt(path, delimiter=",", names=True, deletechars="", replace_space=" ")
    trial = Trial("turning", table["t [s]"], {k: table[v] for k, v in NAMES.items()})
    found = compare(trial, constant_velocity(trial, 100.0), label="cv", restart=100.0, sigma=ESSO_OSAKA_SIGMA)
    truth = np.column_stack([np.unwrap(table[v]) if k == "psi" else table[v] for k, v in NAMES.items()])
    scale = np.array(list(ESSO_OSAKA_SIGMA.values()))
    total = 0.0
    for i, row in enumerate(truth):
        if i % 1000 == 0:
            x, y, psi, u, v, r = row
        total += float(np.sum(((row - (x, y, psi, u, v, r)) / scale) ** 2))
        x, y = x + 0.1 * (u * np.cos(psi) - v * np.sin(psi)), y + 0.1 * (u * np.sin(psi) + v * np.cos(psi))
        psi += 0.1 * r
    assert found.standardised == pytest.approx(total / len(truth), rel=2e-3)

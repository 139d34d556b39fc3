"""The account of noise: each part recovered where it was put, and the figures of the Esso Osaka set."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "studies" / "reports"))
import noise_disturbances as disturbances
import noise_windows as windows

from esso_osaka import ROOT, by_kind
from seatrial.data import DataError, Trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import approach, simulate
from seatrial.validate.comparison import compare, pooled
from seatrial.validate.metrics import ESSO_OSAKA_SIGMA

FIGURES = Path(__file__).parents[1] / "benchmarks" / "results" / "noise_esso_osaka.json"
SD = np.array([0.01, 0.01, 0.002, 0.004, 0.004, 0.001])
DRIFTING = (0.012, -0.008)


@pytest.fixture(scope="module")
def ship():
    return load("esso_osaka_3m")


@pytest.fixture(scope="module")
def calm(ship) -> Trial:
    """A zigzag in a steady wind and no current, Euler's rule at the step of the set."""
    n = approach(ship)[1]
    trial = simulate(ship, Zigzag(n, 0.35, 0.35), duration=250.0, dt=0.1, name="calm")
    t = trial.t
    windy = trial.having(U_T=1.0 + 0.5 * np.sin(t / 7.0), gamma_T=0.3 + 0.4 * np.sin(t / 11.0))
    return blown(ship, windy)


def blown(ship, trial: Trial, **more: np.ndarray) -> Trial:
    """The trial as the ship would have gone under the controls and the environment that it holds."""
    around = trial.having(**more)
    predicted = replay(ship, around, method="euler")
    return replace(trial, channels={**trial.channels, **predicted.channels})


def cut_of(ship, *trials: Trial) -> tuple[windows.Cut, windows.Predictor]:
    return windows.Cut.of({"zigzag": trials}, ship, ESSO_OSAKA_SIGMA, 100.0), windows.Predictor.of([ship])[0]


@pytest.mark.slow
def test_windows_are_predicted_as_replay_predicts_them(ship, calm):
    noisy = calm.having(u=calm["u"] + 0.02)
    cut, predictor = cut_of(ship, noisy)
    predicted = replay(ship, noisy, restart=100.0, method="euler")
    wanted = compare(noisy, predicted, label="", restart=100.0, sigma=ESSO_OSAKA_SIGMA)
    found = windows.loss(cut, predictor.errors(cut))
    assert found["zigzag"] == found["all"] == pytest.approx(pooled([wanted]), rel=1e-9)
    assert found["all"] > 0.01


def test_sensor_noise_is_read_back(calm):
    rng = np.random.default_rng(1)
    noisy = calm.having(**{
        n: calm[n] + sd * rng.normal(size=len(calm))
        for n, sd in zip(("x", "y", "psi", "u", "v_m", "r"), SD, strict=True)
    })  # fmt: skip
    assert windows.white_noise([noisy]) == pytest.approx(SD, rel=0.15)
    assert windows.scatter([noisy]) == pytest.approx(SD, rel=0.2)
    assert (windows.slow_velocity_error([noisy]) < SD[3:]).all()
    assert windows.sensor_floor(SD, ESSO_OSAKA_SIGMA) == pytest.approx(
        sum((sd / s) ** 2 for sd, s in zip(SD, ESSO_OSAKA_SIGMA.values(), strict=True))
    )


def test_velocities_that_fit_the_positions_leave_no_kinematic_error(ship, calm):
    cut, _ = cut_of(ship, calm)
    assert windows.kinematic_floor(cut)["all"] < 1e-12
    biased, _ = cut_of(ship, calm.having(u=calm["u"] + 0.01))
    assert windows.kinematic_floor(biased)["all"] > 1e-4


@pytest.mark.slow
def test_the_error_of_a_start_is_carried_as_a_thousand_noisy_starts_carry_it(ship, calm):
    cut, predictor = cut_of(ship, calm)
    rng = np.random.default_rng(3)
    squares = [(predictor.errors(cut.starting(cut.state0 + SD * rng.normal(size=cut.state0.shape))) ** 2).sum()
               for _ in range(300)]  # fmt: skip
    assert windows.start_floor(cut, predictor, SD).sum() == pytest.approx(np.mean(squares), rel=0.2)


def test_a_smoothed_start_is_nearer_to_the_truth(ship, calm):
    rng = np.random.default_rng(5)
    noisy = calm.having(**{
        n: calm[n] + sd * rng.normal(size=len(calm))
        for n, sd in zip(("x", "y", "psi", "u", "v_m", "r"), SD, strict=True)
    })  # fmt: skip
    cut, _ = cut_of(ship, noisy)
    truth = windows.states(calm)[cut.row]
    better = windows.smoothed(cut, [noisy], 3.0)
    assert np.abs(better.state0 - truth)[1:].sum() < np.abs(cut.state0 - truth)[1:].sum()
    assert (better.state0[0] == cut.state0[0]).all()


@pytest.mark.slow
def test_a_current_is_found_in_its_window_and_carried_to_the_next(ship, calm):
    n, (north, east) = len(calm), DRIFTING
    trial = blown(ship, calm, U_C=np.full(n, np.hypot(north, east)), gamma_C=np.full(n, np.arctan2(east, north)))
    cut, predictor = cut_of(ship, trial)
    found = disturbances.fitted(cut, predictor, windows.CURRENT, 0.05)
    assert found[:2] == pytest.approx(np.array([DRIFTING] * 2), abs=1e-3)
    plain = windows.loss(cut, predictor.errors(cut))["all"]
    assert windows.loss(cut, predictor.errors(cut.adding(windows.CURRENT, found)))["all"] < 0.02 * plain
    carried = disturbances.previous(cut, found)
    assert (carried[0] == 0.0).all()
    assert (carried[1:] == found[:-1]).all()
    assert disturbances.memory(cut, found) == pytest.approx([1.0, 1.0], abs=0.05)


def test_a_drift_is_filtered_from_the_past_alone(ship, calm):
    cut, predictor = cut_of(ship, calm)
    assert max(np.abs(m[1:]).max() for m in disturbances.missing_acceleration(cut, predictor)) < 1e-9
    # a model that lacks a steady moment: the measured ship has it
    pushed = calm.having(r=calm["r"] + 1e-4 * calm.t)
    cut, predictor = cut_of(ship, pushed)
    missing = disturbances.missing_acceleration(cut, predictor)
    drift = disturbances.Drift(filter=10.0, forget=20.0, share=1.0)
    series = drift.carried(cut, missing).series[:, :, cut.at(windows.BODY)]
    assert (series[0] == 0.0).all()
    assert series[1, 0, 2] > 5e-5
    assert series[1, 200, 2] == pytest.approx(series[1, 0, 2] * np.exp(-1.0), rel=1e-9)
    later = [m.copy() for m in missing]
    later[0][1001:] = 9.0
    assert (drift.carried(cut, later).series[1] == drift.carried(cut, missing).series[1]).all()


def test_correlation_of_means():
    rng = np.random.default_rng(0)
    white = [rng.normal(size=(20_000, 2)) for _ in range(2)]
    assert disturbances.correlation(white, 0.1, 5.0, (5.0, 50.0)) == pytest.approx(np.zeros((2, 2)), abs=0.15)
    slow = [np.sin(np.arange(20_000) * 0.1 * 2 * np.pi / 100.0)[:, None]]
    assert disturbances.correlation(slow, 0.1, 5.0, (50.0, 100.0))[:, 0] == pytest.approx([-1.0, 1.0], abs=0.1)


def test_other_winds(calm):
    assert disturbances.lagged(calm, 2.0)["U_T"][20:] == pytest.approx(calm["U_T"][:-20])
    assert disturbances.lagged(calm, -2.0)["U_T"][:-20] == pytest.approx(calm["U_T"][20:])
    steady = disturbances.averaged(calm, np.inf)
    assert np.ptp(steady["U_T"]) < 1e-12
    north = calm["U_T"] * np.cos(calm["gamma_T"])
    some = disturbances.averaged(calm, 3.0)
    assert (some["U_T"] * np.cos(some["gamma_T"]))[200] == pytest.approx(north[171:201].mean())
    current = disturbances.drifted(calm.having(U_T=np.ones(len(calm)), gamma_T=np.zeros(len(calm))), 0.01, 100.0)
    assert current["U_C"] == pytest.approx(np.full(len(calm), 0.01))
    assert np.cos(current["gamma_C"]) == pytest.approx(-np.ones(len(calm)))


def test_coherence_is_whole_where_the_wind_explains_all(ship, calm):
    cut, predictor = cut_of(ship, calm)
    found = disturbances.coherence(cut, predictor, ((0.0, 0.05),))
    assert found.before == pytest.approx(np.ones((1, 3)), abs=1e-6)
    assert found.left == pytest.approx(np.zeros((1, 3)), abs=1e-9)
    assert found.chance == 0.5
    still = disturbances.fitted(cut, predictor, windows.WIND, 0.5)
    assert still == pytest.approx(np.zeros_like(still), abs=1e-6)


def test_uneven_steps_are_refused(ship, calm):
    bent = replace(calm, t=np.concatenate([calm.t[:100], calm.t[100:] + 0.05]))
    with pytest.raises(DataError, match="resample"):
        cut_of(ship, bent)
    gap = calm.having(u=np.where(np.arange(len(calm)) == 1000, np.nan, calm["u"]))
    with pytest.raises(DataError, match="where a window starts"):
        cut_of(ship, gap)


@pytest.mark.skipif(not ROOT.is_dir(), reason="Esso Osaka data absent: set SEATRIAL_DATA (NAOE-5thLab/FRT-DS-ESSO)")
@pytest.mark.long
def test_sensors_and_starts_of_the_esso_osaka_set_are_not_what_limits_a_prediction(ship):
    """With the published coefficients; the fitted ones are in studies/reports/noise_esso_osaka.py."""
    trials = by_kind()["berthing"]
    cut, predictor = cut_of(ship, *trials)
    plain = windows.loss(cut, predictor.errors(cut))["all"]
    assert plain == pytest.approx(0.223, abs=0.002)
    kinematic, start = windows.kinematic_floor(cut)["all"], windows.start_floor(cut, predictor, windows.scatter(trials))
    assert kinematic == pytest.approx(0.0014, abs=0.0002)
    assert windows.loss(cut, np.sqrt(start))["all"] < 0.002
    assert abs(windows.loss(cut, predictor.errors(windows.smoothed(cut, trials, 5.0)))["all"] - plain) < 0.005


def test_the_page_shows_the_figures_that_the_command_wrote():
    found = json.loads(FIGURES.read_text(encoding="utf-8"))
    page = (Path(__file__).parents[1] / "docs" / "noise-esso-osaka.md").read_text(encoding="utf-8")

    def row(values: dict[str, float]) -> str:
        return " | ".join(f"{values[k]:.3f}" for k in ("random", "turning", "zigzag", "berthing", "all"))

    sensors, others, kinds = found["sensors"], found["disturbances"], ("current", "wind", "acceleration", "earth")
    shown = [
        found["fitted MMG"], sensors["kinematics"], *sensors["start propagated"].values(),
        *sensors["start smoothed"].values(), others["drift"]["filtered"],
        *(others[name][when] for name in kinds for when in ("window itself", "window before")),
        *found["wind"]["fitted anew"].values(),
        *(found["current driven by the wind"][name] for name in ("current", "current and drift")),
        found["tracked current"]["carried"], found["current driven and tracked"]["carried"],
    ]  # fmt: skip
    missing = [row(values) for values in shown if row(values) not in page]
    assert not missing

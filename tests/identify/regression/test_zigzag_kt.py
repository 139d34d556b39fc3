"""K and T from a zigzag: by hand and by least squares, with noise, with a residual rudder, from real hydrodynamics."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.actuators import Actuator, Actuators
from seatrial.data import DataError, Trial
from seatrial.identify.regression.zigzag_kt import KT, _peaks, classical, fitted
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load, save
from seatrial.simulate.run import simulate

GEAR = Actuators({"rudder": Actuator(rate=math.radians(3.0))})
L = 160.93
CASES = [(0.185, 107.3, 0.0), (0.08, 25.0, 0.01), (0.06, 40.0, -0.02)]


def zigzag(K: float, T: float, delta_r: float, angle: float = 10.0) -> Trial:
    ship = replace(load("mariner_nomoto").having({"K": K, "T": T, "delta_r": delta_r}), actuators=GEAR)
    order = math.radians(angle)
    return simulate(ship, Zigzag(n_P=0.0, delta=order, psi=order), duration=900.0, dt=0.5)


RUNS = {case: zigzag(*case) for case in CASES}


def noisy(trial: Trial, seed: int) -> Trial:
    rng = np.random.default_rng(seed)
    psi = trial["psi"] + math.radians(0.1) * rng.standard_normal(len(trial))
    return trial.having(psi=psi, r=trial["r"] + math.radians(0.02) * rng.standard_normal(len(trial)))


@pytest.mark.parametrize("case", CASES)
def test_clean_records_give_back_what_they_were_made_of(case: tuple[float, float, float]) -> None:
    by_hand, by_computer = classical(RUNS[case], L), fitted(RUNS[case], L)
    assert pytest.approx(list(case[:2]), rel=1e-4) == [by_computer.K, by_computer.T]
    assert by_computer.delta_r == pytest.approx(case[2], abs=1e-5)
    assert pytest.approx(list(case[:2]), rel=2e-3) == [by_hand.K, by_hand.T]
    assert by_hand.delta_r == pytest.approx(case[2], abs=1e-5)
    assert by_computer.speed == pytest.approx(7.7175, rel=1e-6)
    assert by_computer.prime == pytest.approx((case[0] * L / 7.7175, case[1] * 7.7175 / L), rel=1e-4)


@pytest.mark.long
@pytest.mark.parametrize("way", [fitted, classical])
def test_noise_is_told_by_the_deviations(way: Any) -> None:
    off = []
    for case in CASES:
        for seed in range(8):
            found: KT = way(noisy(RUNS[case], seed), L)
            off.append((np.array([found.K, found.T, found.delta_r]) - case) / found.sigma)
    size = np.sqrt(np.mean(np.square(off), axis=0))
    # Hand analysis knows its spread from a few half periods only: Student's t, and a peak is read off a cubic.
    assert size.max() < (1.4 if way is fitted else 2.0)
    assert size.min() > 0.4
    if way is fitted:
        assert np.abs(off).max() < 3.5
        assert np.mean(np.abs(off) < 3.0) > 0.98


@pytest.mark.slow
def test_mariner_step_of_five_degrees_as_mss_fits_it() -> None:
    ship = replace(load("mariner"), actuators=Actuators({"rudder": Actuator(rate=math.radians(5.0))}))
    run = simulate(ship, Turning(n_P=0.0, delta=math.radians(5.0)), duration=200.0, dt=0.1, method="euler")
    order = run.having(delta=np.full(len(run), math.radians(5.0)))
    found = fitted(order, L, bias=False)
    assert (round(found.K, 4), round(found.T, 1)) == (0.0906, 22.2)
    prime = replace(found, speed=7.7175).prime
    assert round(prime[0], 2) == 1.89
    assert prime[1] == pytest.approx(22.2 * 7.7175 / L, rel=2e-3)


def test_a_ship_of_the_result_saves_and_repeats_the_zigzag(tmp_path: Any) -> None:
    case = CASES[1]
    ship = load(save(fitted(noisy(RUNS[case], 1), L).ship("fitted", GEAR), tmp_path / "fitted.toml"))
    order = math.radians(10.0)
    policy = Zigzag(n_P=0.0, delta=order, psi=order)
    again = simulate(ship, policy, duration=300.0, dt=0.5)
    first, was = (policy.indices(t, L)["first_overshoot"].value for t in (again, RUNS[case]))
    assert first == pytest.approx(was, rel=0.02)
    assert ship.entries["T"].sigma is not None
    assert "analysis of a zigzag" in ship.entries["K"].source


@pytest.mark.slow
def test_an_unstable_ship_has_a_negative_time_constant() -> None:
    found = fitted(zigzag(-0.06, -60.0, 0.0), L)
    assert pytest.approx([-0.06, -60.0], rel=1e-3) == [found.K, found.T]


def test_records_that_cannot_be_analysed_are_refused() -> None:
    run = RUNS[CASES[1]]
    with pytest.raises(DataError, match="heading peaks"):
        classical(run.rows(slice(0, 150)), L)
    with pytest.raises(DataError, match="no channel r"):
        fitted(replace(run, channels={k: v for k, v in run.channels.items() if k != "r"}), L)
    gap = run["r"].copy()
    gap[50] = math.nan
    with pytest.raises(DataError, match="gaps"):
        fitted(run.having(r=gap), L)
    with pytest.raises(DataError, match="speed"):
        fitted(replace(run, channels={k: v for k, v in run.channels.items() if k not in ("u", "v_m")}), L)
    with pytest.raises(DataError, match="excited"):
        fitted(run.having(delta=np.zeros(len(run))), L)


def test_four_peaks_are_enough_for_the_analysis_by_hand_and_three_are_not() -> None:
    run = RUNS[CASES[1]]
    at = [when for when, _ in _peaks(run.t, run["psi"])]
    found = classical(run.rows(run.t < 0.5 * (at[3] + at[4])), L)
    assert pytest.approx(CASES[1][:2], rel=0.01) == [found.K, found.T]
    with pytest.raises(DataError, match="3 heading peaks"):
        classical(run.rows(run.t < 0.5 * (at[2] + at[3])), L)

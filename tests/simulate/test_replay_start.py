"""Starts estimated from the past: better than one reading under noise, exact without, and blind to what comes after."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.trialfile import read_trial, write_trial
from seatrial.manoeuvres.turning import Turning
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import approach, simulate
from seatrial.simulate.starts import smoothed_starts

NOISE = np.array([0.02, 0.02, 0.003, 0.01, 0.01, 0.002])


@pytest.fixture(scope="module")
def turn() -> Trial:
    ship = load("esso_osaka_3m")
    return simulate(ship, Turning(approach(ship)[1], 0.35), duration=120.0, dt=0.1, name="turn")


def table(trial: Trial) -> np.ndarray:
    return trial.stack("x", "y", "psi", "u", "v_m", "r")


def test_without_noise_the_start_is_the_reading(turn):
    found = smoothed_starts(turn.t, table(turn), [300, 600, 900], 2.0)
    assert found == pytest.approx(table(turn)[[300, 600, 900]], abs=2e-4)


def test_noise_is_halved_at_least(turn):
    rng = np.random.default_rng(1)
    rows = list(range(200, 1200, 20))
    noisy = table(turn) + NOISE * rng.normal(size=(len(turn), 6))
    truth = table(turn)[rows]
    before = np.sqrt(np.mean((noisy[rows] - truth) ** 2, axis=0))
    after = np.sqrt(np.mean((smoothed_starts(turn.t, noisy, rows, 5.0) - truth) ** 2, axis=0))
    assert (after < 0.5 * before).all()


def test_nothing_after_the_start_matters(turn):
    state = table(turn)
    other = state.copy()
    other[601:] += 5.0
    assert (smoothed_starts(turn.t, state, [600], 5.0) == smoothed_starts(turn.t, other, [600], 5.0)).all()


def test_nothing_before_the_past_matters(turn):
    state = table(turn)
    other = state.copy()
    other[:540] = 7.0
    assert (smoothed_starts(turn.t, state, [600], 5.0) == smoothed_starts(turn.t, other, [600], 5.0)).all()


def test_without_a_past_the_reading_is_taken(turn):
    state = table(turn)
    assert (smoothed_starts(turn.t, state, [0, 3], 5.0) == state[[0, 3]]).all()
    state[560:600] = np.nan
    assert (smoothed_starts(turn.t, state, [600], 3.0) == state[600]).all()


def test_a_past_that_is_none_is_refused(turn):
    with pytest.raises(DataError, match="above zero"):
        smoothed_starts(turn.t, table(turn), [10], 0.0)


def test_replay_starts_from_the_past_where_asked(turn):
    ship, rng = load("esso_osaka_3m"), np.random.default_rng(2)
    noise = dict(zip(("x", "y", "psi", "u", "v_m", "r"), NOISE, strict=True))
    noisy = turn.having(**{n: turn[n] + sd * rng.normal(size=len(turn)) for n, sd in noise.items()})
    plain = replay(ship, noisy, restart=30.0, method="euler")
    better = replay(ship, noisy, restart=30.0, method="euler", smooth_start=5.0)

    def miss(one: Trial) -> float:
        rows = slice(300, None)
        return float(np.hypot(one["x"] - turn["x"], one["y"] - turn["y"])[rows].mean())

    assert miss(better) < 0.6 * miss(plain)
    assert (better["u"][:300] == plain["u"][:300]).all()


@pytest.mark.slow
def test_the_command_takes_the_past(turn, tmp_path, capsys):
    noisy = turn.having(u=turn["u"] + 0.01 * np.random.default_rng(3).normal(size=len(turn)))
    write_trial(noisy, tmp_path / "turn.csv")
    asked = ["predict", "esso_osaka_3m", str(tmp_path / "turn.csv"), "--restart", "50"]
    assert main([*asked, "-o", str(tmp_path / "a")]) == 0
    assert main([*asked, "--smooth-start", "5", "-o", str(tmp_path / "b")]) == 0
    plain, better = (read_trial(tmp_path / name / "turn.csv") for name in "ab")
    assert better["u"][500] != plain["u"][500]
    assert better["u"][:500] == pytest.approx(plain["u"][:500])
    assert main([*asked, "--smooth-start", "-1", "-o", str(tmp_path / "c")]) == 2
    assert "--smooth-start is -1" in capsys.readouterr().err

"""The real milliAmpere: what a fit to one recording says of the other, up to 50 s ahead."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.parameters import read
from seatrial.data import Array, Trial
from seatrial.simulate.replay import replay
from seatrial.study.study import read_study

HOME = Path(__file__).parents[2]
ROOT = Path(os.environ.get("SEATRIAL_DATA", HOME.parent / "shared" / "data")) / "milliampere_2025"
RECORDINGS = ("nlp1", "qp1")
HORIZONS, EVERY = (10.0, 20.0, 50.0), 3.0
THRUSTERS = ((1.8, -0.8), (1.8, 0.8), (-1.8, 0.8), (-1.8, -0.8))

pytestmark = pytest.mark.skipif(
    not ROOT.is_dir(), reason="milliAmpere absent: set SEATRIAL_DATA (github.com/Andeshog/milliampere_data)"
)

Predict = Callable[[Trial], Array]
"""Places and headings of the rows of a trial from the state of its first, shape (rows, 3)."""


def whole(trials: Sequence[Trial]) -> Trial:
    """Minutes that follow each other as one trial."""
    names = trials[0].channels
    channels = {name: np.concatenate([one[name] for one in trials]) for name in names}
    channels["psi"] = np.unwrap(channels["psi"])
    return replace(trials[0], t=np.concatenate([one.t for one in trials]), channels=channels)


def stretches(trial: Trial) -> Iterator[Trial]:
    for begin in np.arange(trial.t[0], trial.t[-1] - HORIZONS[-1] - 0.1, EVERY):
        rows = (trial.t >= begin - 1e-6) & (trial.t <= begin + HORIZONS[-1] + 0.15)
        yield trial.rows(rows)


def errors(trial: Trial, predict: Predict) -> Array:
    """Root mean square errors of position [m] and heading [rad] at each horizon, shape (2, horizons); laps count."""
    found: list[Array] = []
    for one in stretches(trial):
        there = [int(np.argmin(np.abs(one.t - one.t[0] - ahead))) for ahead in HORIZONS]
        found.append((predict(one) - one.stack("x", "y", "psi"))[there])
    squares = np.mean(np.square(found), axis=0)
    return np.sqrt([squares[:, 0] + squares[:, 1], squares[:, 2]])


def constant_velocity(trial: Trial) -> Array:
    x, y, psi, u, v, r = (float(trial[name][0]) for name in ("x", "y", "psi", "u", "v_m", "r"))
    ahead, c, s = trial.t - trial.t[0], math.cos(psi), math.sin(psi)
    return np.column_stack([x + ahead * (u * c - v * s), y + ahead * (u * s + v * c), psi + ahead * r])


def thrust(trial: Trial) -> Array:
    """n |n| of the thrusters as forces ahead and to starboard and a moment, shape (rows, 3)."""
    total = np.zeros((len(trial), 3))
    for k, (x, y) in enumerate(THRUSTERS, 1):
        n, alpha = np.clip(trial[f"n_{k}"], -12.5, 12.5), trial[f"alpha_{k}"]
        ahead, side = n * np.abs(n) * np.cos(alpha), n * np.abs(n) * np.sin(alpha)
        total += np.column_stack([ahead, side, x * side - y * ahead])
    return np.nan_to_num(total)


def six_numbers(trials: Sequence[Trial], over: int = 10) -> Predict:
    """Each acceleration is a share of the thrust and one of the velocity, by least squares over differences of 1 s."""
    left, right = ([list[Array]() for _ in range(3)] for _ in range(2))
    for trial in trials:
        force, motion = thrust(trial), trial.stack("u", "v_m", "r")
        turning = np.column_stack([motion[:, 1] * motion[:, 2], -motion[:, 0] * motion[:, 2], 0.0 * motion[:, 0]])
        for k in range(3):
            sums = np.cumsum(np.column_stack([force[:, k], motion[:, k], turning[:, k]]), axis=0)
            mean = (sums[over:] - sums[:-over]) / over
            rate = (motion[over:, k] - motion[:-over, k]) / (trial.t[over:] - trial.t[:-over])
            left[k].append(mean[:, :2])
            right[k].append(rate - mean[:, 2])
    a, b = np.array([np.linalg.lstsq(np.vstack(m), np.concatenate(y), rcond=None)[0]
                     for m, y in zip(left, right, strict=True)]).T  # fmt: skip

    def predict(trial: Trial) -> Array:
        force, state = thrust(trial), trial.stack("x", "y", "psi", "u", "v_m", "r")[0]
        track = [state[:3]]
        for k, dt in enumerate(np.diff(trial.t)):
            psi, (u, v, r) = state[2], state[3:]
            over_ground = (u * math.cos(psi) - v * math.sin(psi), u * math.sin(psi) + v * math.cos(psi), r)
            rates = a * force[k] + b * state[3:] + np.array([v * r, -u * r, 0.0])
            state = state + dt * np.array([*over_ground, *rates])
            track.append(state[:3])
        return np.array(track)

    return predict


@pytest.mark.long
def test_the_other_recording_is_predicted_better_than_by_six_numbers_and_by_constant_velocity() -> None:
    study = read_study(HOME / "studies" / "milliampere_real.toml")
    better = {"constant velocity": 0, "six numbers": 0}
    for kept, left in (RECORDINGS, RECORDINGS[::-1]):
        known, other = ([t for t in study.problem.trials if t.name.startswith(name)] for name in (kept, left))
        ship = study.estimator.fit(replace(study.problem, trials=tuple(known))).ship
        unseen = whole(other)
        ours = errors(unseen, lambda one, ship=ship: replay(ship, one).stack("x", "y", "psi"))
        for name, rival in (("constant velocity", constant_velocity), ("six numbers", six_numbers(known))):
            theirs = errors(unseen, rival)
            better[name] += int((ours < theirs).sum())
            assert ours[1, -1] < 0.6 * theirs[1, -1], f"the heading of {left} does not run away within 50 s"
        assert float(read(ship.model, "damping.N_ur")) < 0.0
    assert better == {"constant velocity": 12, "six numbers": 12}

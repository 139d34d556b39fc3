"""Members of a saved hybrid: they drift apart where no trial was, and the command line says so."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from seatrial.belief.spread import NAME, Members, load_members, members, save_members, spreads
from seatrial.cli.app import app
from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.data.trialfile import write_trial
from seatrial.identify import Loss, Problem
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.ships import ShipError
from seatrial.ships.files import load, save
from seatrial.simulate.run import simulate

BARE = load("esso_osaka_3m_hybrid")
SIGMA = dict(zip(STATES, (10.0, 4.0, 3.0, 0.1, 0.04, 0.02), strict=True))

pytestmark = pytest.mark.long


def turn(delta: float, n_P: float, speed: float, seconds: float = 100.0) -> Trial:
    made = simulate(BARE, Turning(delta=delta, n_P=n_P), speed=speed, duration=seconds, dt=0.1, method="euler")
    rng = np.random.default_rng(0)
    noisy = {n: made[n] + 0.02 * s * rng.standard_normal(len(made)) for n, s in SIGMA.items()}
    return replace(made.having(**noisy), name=f"turn_{delta:g}_{n_P:g}")


USUAL = tuple(turn(delta, 9.0, 0.3) for delta in (-0.2, -0.1, 0.0, 0.1, 0.2))


@pytest.fixture(scope="module")
def found() -> Members:
    Y_v = BARE.model.hull.Y_v
    free = (Free("hull.Y_v", Y_v, prior=Y_v, sigma=0.3 * abs(Y_v)),)
    problem, estimator = Problem(BARE, USUAL, free, Loss(SIGMA)), Trajectory(window=50.0, threads=1)
    return members(estimator.fit(problem), problem, estimator, SIGMA, restart=50.0, count=8)


def test_members_agree_on_what_was_sailed_and_part_elsewhere(found: Members) -> None:
    inside, astern, hard = spreads(
        found, BARE, [turn(0.15, 9.0, 0.3), turn(-0.2, -9.0, -0.2), turn(0.6, 18.0, 0.5)]
    )  # fmt: skip
    assert inside.verdict == "inside"
    assert inside.ratio < 3.0
    for far in (astern, hard):
        assert far.verdict == "leaves"
        assert far.standardised > 5.0 * inside.standardised
    assert "stays within the training data (spread" in str(inside)
    assert "this manoeuvre leaves the training data (spread" in str(astern)


def test_the_deviation_grows_from_every_restart(found: Members) -> None:
    (told,) = spreads(found, BARE, [turn(0.15, 9.0, 0.3)])
    assert told.deviation.shape == (2, 51, 6)
    assert told.deviation[:, 0] == pytest.approx(np.zeros((2, 6)), abs=1e-12)
    assert (told.deviation[:, 50, :2] > told.deviation[:, 5, :2]).all()


def test_saved_members_say_the_same(found: Members, tmp_path: Path) -> None:
    ship = load(save(BARE.having(dict(zip(found.paths[:1], found.fitted[:1], strict=True))), tmp_path / "model.toml"))
    again, trial = load_members(save_members(found, tmp_path / NAME), ship), turn(0.4, 12.0, 0.4)
    assert spreads(again, ship, [trial])[0].numbers() == spreads(found, ship, [trial])[0].numbers()
    with pytest.raises(ShipError, match="belongs to another fit"):
        load_members(tmp_path / NAME, BARE.having({"hull.Y_v": -0.1}))
    (tmp_path / NAME).write_bytes(b"nothing")
    with pytest.raises(ShipError, match=r"spread.npz: cannot be read"):
        load_members(tmp_path / NAME, ship)


def test_predict_tells(found: Members, tmp_path: Path) -> None:
    ship = BARE.having(dict(zip(found.paths[:1], found.fitted[:1], strict=True)))
    model = save(ship, tmp_path / "model.toml")
    save_members(found, tmp_path / NAME)
    trial = tmp_path / "fast.csv"
    write_trial(turn(0.6, 18.0, 0.5), trial)
    run = CliRunner().invoke(app, ["predict", str(model), str(trial), "-o", str(tmp_path / "out"), "--json"])
    assert run.exit_code == 0, run.output
    assert "this manoeuvre leaves the training data" in run.stderr
    (numbers,) = json.loads(run.stdout)["spread"].values()
    assert numbers["verdict"] == "leaves"
    assert numbers["ratio"] > 1.0
    page = tmp_path / "page.html"
    run = CliRunner().invoke(app, ["validate", str(model), str(trial), "-o", str(page), "--restart", "50", "--json"])
    assert run.exit_code == 0, run.output
    assert "this manoeuvre leaves the training data" in page.read_text()
    assert list(json.loads(run.stdout)["spread"]) == ["fast"]


@pytest.mark.parametrize("damaged", [False, True])
def test_a_prediction_stands_without_that_advice(damaged: bool, found: Members, tmp_path: Path) -> None:
    ship = BARE.having(dict(zip(found.paths[:1], found.fitted[:1], strict=True)))
    model = save(ship, tmp_path / "model.toml")
    save_members(found, tmp_path / NAME)
    if damaged:
        (tmp_path / NAME).write_bytes(b"nothing")
    trials = tmp_path / "trials"
    trials.mkdir()
    long = turn(0.6, 18.0, 0.5)
    write_trial(long, trials / "long.csv")
    write_trial(long.rows(slice(0, 3)), trials / "short.csv")  # less than the second between its samples
    run = CliRunner().invoke(app, ["predict", str(model), str(trials), "-o", str(tmp_path / "out"), "--json"])
    assert run.exit_code == 0, run.output
    assert sorted(f.name for f in (tmp_path / "out").glob("*.csv")) == ["long.csv", "short.csv"]
    told = [line for line in run.stderr.splitlines() if "not known whether" in line]
    assert len(told) == 1
    assert ("spread.npz: cannot be read" if damaged else "warning: short: ") in told[0]
    assert ("spread" in json.loads(run.stdout)) is not damaged

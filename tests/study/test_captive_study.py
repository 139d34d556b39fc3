"""The table [captive] of a study: what captive tests determine is the joint prior of the fit to trials."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from seatrial.data.captive import read_captive
from seatrial.data.trialfile import write_trial
from seatrial.forces import Flow
from seatrial.identify import StudyError
from seatrial.identify.regression.captive import fit_captive
from seatrial.manoeuvres.turning import Turning
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate
from seatrial.study.store import save_fit
from seatrial.study.stored import load_fit
from seatrial.study.study import read_study

SHIP = load("kvlcc2_l7")
N_VVV = -0.03
FIT = ("hull.Y_v", "hull.Y_vvv", "hull.N_v", "hull.N_vvv")
STUDY = """
schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[captive]
tables = ["$TANK/drift.csv"]
fit = ["hull.[YN]_v", "hull.[YN]_vvv"]
scatter = 2.0
[data]
root = "logs"
train = ["*"]
[free]
"hull.[YN]_v" = {}
"hull.Y_vvv" = {}
"hull.N_vvv" = { sigma = 0.05 }
"hull.N_r" = { prior = 0.3 }
[loss]
correlation = 5.0
[estimator]
type = "shooting:Trajectory"
window = 20
every = 10
"""


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A study beside a table of drift with noise, N tenfold, and one turn of the same ship."""
    rng, L, rho, d = np.random.default_rng(7), SHIP.L_pp, 1000.0, float(SHIP.model.draught)
    monkeypatch.setenv("TANK", str(tmp_path / "tank"))
    (tmp_path / "tank").mkdir()
    with (tmp_path / "tank" / "drift.csv").open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["U [m/s]", "beta [deg]", "n_P [rpm]", "delta [deg]", "Y [N]", "N [N m]"])
        for beta in (*range(-20, 21, 4), -14, -6, 6, 14):
            u, v = math.cos(math.radians(beta)), -math.sin(math.radians(beta))
            _, Y, N, *_ = SHIP.model.loads(Flow(u, v, 0.0, 9.0, 0.0, u, v, rho, L, d), (0.0, 0.0, 0.0))
            rows.writerow([1.0, beta, 540.0, 0.0, Y + 4.0 * rng.standard_normal(), N + 9.0 * rng.standard_normal()])
    run = simulate(SHIP, Turning(approach(SHIP)[1], 0.3), duration=40.0, dt=0.1, name="turn")
    (tmp_path / "logs").mkdir()
    write_trial(run.having(psi=run["psi"] + 0.002 * rng.standard_normal(len(run))), tmp_path / "logs" / "turn.csv")
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


def test_prior_and_tests_together_are_the_prior_of_the_fit(study: Path) -> None:
    """The product of two Gaussians; of what has no prior of its own the posterior of the tests, correlated as it is."""
    tests = fit_captive(SHIP, read_captive([study.parent / "tank" / "drift.csv"], L_pp=SHIP.L_pp, rho=1000.0), FIT)
    found = read_study(study)
    vector = found.problem.vector
    assert set(tests.paths) == set(FIT)
    mine, theirs = (list(map(paths.index, FIT)) for paths in (vector.paths, tests.paths))
    covariance = 2.0**2 * tests.covariance[np.ix_(theirs, theirs)]
    own = np.diag([0.0, 0.0, 0.0, 0.05**-2])  # [free] states that of N_vvv alone
    both = np.linalg.inv(covariance) + own
    np.testing.assert_allclose(vector.precision[np.ix_(mine, mine)], both, rtol=1e-7, atol=1e-9 * both.max())
    mean = np.linalg.solve(both, np.linalg.solve(covariance, tests.values[theirs]) + own @ (0, 0, 0, N_VVV))
    np.testing.assert_allclose(vector.mean[mine], mean, rtol=1e-9)
    np.testing.assert_allclose(vector.start, vector.mean, rtol=1e-12)
    assert abs(vector.correlation[mine[0], mine[1]]) > 0.5  # linear and cubic damping trade off over a range of drift
    # what the tests do not know has the prior of the study alone, about the number of the ship file
    by = {f.path: f for f in found.problem.free}
    assert (by["hull.N_r"].prior, by["hull.N_r"].tied) == (-0.049, ())
    assert by["hull.N_r"].sigma == pytest.approx(0.3 * 0.049)
    [told] = [note for note in found.notes if note.startswith("priors from 15 captive tests")]
    assert f"hull.Y_v +- {by['hull.Y_v'].sigma:.2g}" in told
    assert "N_r" not in told


def test_an_interval_holds_beside_the_tests(study: Path) -> None:
    study.write_text(STUDY.replace('"hull.Y_vvv" = {}', '"hull.Y_vvv" = { low = -0.5, high = 0.0, start = -0.2 }'))
    [one] = [f for f in read_study(study).problem.free if f.path == "hull.Y_vvv"]
    assert (one.low, one.high, one.start) == (-0.5, 0.0, -0.5)
    assert one.prior < -1.0
    assert one.tied


@pytest.mark.slow
def test_a_study_answers_to_its_tests(study: Path) -> None:
    before = read_study(study).digest
    table = study.parent / "tank" / "drift.csv"
    table.write_text(table.read_text().replace("-20,540", "-20.1,540"))
    assert read_study(study).digest != before
    study.write_text(STUDY.replace("scatter = 2.0", ""))
    assert read_study(study).problem.vector.sigma[0] == pytest.approx(read_study(study).problem.ship.entries[
        "hull.Y_v"].sigma)  # fmt: skip


@pytest.mark.slow
def test_a_fit_is_stored_with_the_covariance_of_its_priors(study: Path, tmp_path: Path) -> None:
    found = read_study(study)
    fit = found.estimator.fit(found.problem)
    (tmp_path / "run").mkdir()
    save_fit(fit, tmp_path / "run", found.problem, study="s")
    again = load_fit(tmp_path / "run")
    assert again.free == fit.free
    np.testing.assert_array_equal(again.vector.precision, found.problem.vector.precision)


@pytest.mark.parametrize(("old", "new", "said"), [
    ("$TANK/drift.csv", "$TANK/drifts.csv", r"study\.toml: captive: .*drifts\.csv"),
    ("$TANK/drift.csv", "$TONK/drift.csv", r"study\.toml: captive\.tables: the variable TONK is not set"),
    ("scatter = 2.0", "scatter = 0.5", r"captive\.scatter is 0\.5; it must be .*1"),
    ("scatter = 2.0", "scater = 2.0", "near: scatter"),
    ('tables = ["$TANK/drift.csv"]', "tables = []", r"captive\.tables"),
    ("scatter = 2.0", 'mapping = "none.toml"', r"study\.toml: captive: .*none\.toml"),
    ('"hull.[YN]_v", ', '"hull.[YN]_q", ', r"study\.toml: captive: .*hull\.\[YN\]_q"),
])  # fmt: skip
def test_tests_that_cannot_be_used_are_refused_in_one_line(study: Path, old: str, new: str, said: str) -> None:
    study.write_text(STUDY.replace(old, new))
    with pytest.raises(StudyError, match=said) as refused:
        read_study(study)
    assert "\n" not in str(refused.value)

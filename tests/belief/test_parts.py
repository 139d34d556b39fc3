"""Parts that are left out: fits without them, and what is kept of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.belief.parts import left_out
from seatrial.belief.posterior import Posterior
from seatrial.core.executors import threads
from seatrial.core.parameters import Free, read
from seatrial.identify import Loss, Problem
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.study.folds import folds
from virtual_logs import log, ship


@pytest.mark.long
def test_a_part_is_predicted_by_a_fit_that_has_not_seen_it_and_a_killed_run_goes_on(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    trials = tuple(replace(log(ship(), k, rng), name=f"t{k:02d}x") for k in range(6))
    value = float(read(ship().model, "hull.N_r"))
    free = (Free("hull.N_r", 0.8 * value, prior=value, sigma=0.3 * abs(value)),)
    problem = Problem(ship(), trials, free, Loss({"psi": 0.002, "u": 0.005, "r": 0.001}, 0.0))
    who = Trajectory(window=20.0, every=4)
    whole = who.fit(problem)
    held = Posterior(whole.ship, whole.free, whole.values, whole.covariance)
    out = folds(trials, "recording", 3)
    found = list(left_out(who, problem, whole, held, out=out, folder=tmp_path))
    assert sorted(t.name for one in found for t in one.trials) == [t.name for t in trials]
    for one in found:
        assert one.held.mean[0] == pytest.approx(value, rel=0.1)
        seen = tuple(t for t in trials if t.name not in {u.name for u in one.trials})
        again = who.fit(replace(problem, trials=seen))
        assert one.held.mean == pytest.approx(again.values, rel=1e-3)
        assert one.held.covariance == pytest.approx(again.covariance, rel=0.05)
    (tmp_path / "part-2-of-3.npz").unlink()
    with threads(1) as pool:
        resumed = list(left_out(who, problem, whole, held, out=out, folder=tmp_path, pool=pool))
    assert [one.held.mean.tolist() for one in resumed] == [one.held.mean.tolist() for one in found]

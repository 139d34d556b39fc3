"""Parts that are left out: whole recordings, every kind in every part; fits without them, and what is kept of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.belief.parts import left_out, parted
from seatrial.belief.posterior import Posterior
from seatrial.core.executors import threads
from seatrial.core.parameters import Free, read
from seatrial.data import Trial
from seatrial.identify import Loss, Problem, StudyError
from seatrial.identify.trajectory.shooting import Trajectory
from virtual_logs import log, ship


def stub(name: str, kind: str) -> Trial:
    """A straight run that its sidecar calls otherwise."""
    t = np.arange(30.0)
    still = {n: np.zeros(30) for n in ("y", "psi", "v_m", "r", "delta")}
    return Trial(name, t, {**still, "x": t, "u": np.ones(30), "n_P": np.ones(30)}, meta={"kind": kind})


def test_parts_hold_whole_recordings_of_every_kind() -> None:
    trials = [stub(f"{kind}_{day:02d}-Jul-2020_10_{minute}_00_{piece}", kind)
              for kind, minute in (("turning", 10), ("zigzag", 40)) for day in range(1, 7) for piece in (1, 2)]
    parts = parted(trials, 3)
    assert sorted(t.name for part in parts for t in part) == sorted(t.name for t in trials)
    for part in parts:
        names = {t.name for t in part}
        assert all(name[:-1] + other in names for name in names for other in "12")
        assert {name.partition("_")[0] for name in names} == {"turning", "zigzag"}
    with pytest.raises(StudyError, match="12 recordings"):
        parted(trials, 13)


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
    found = list(left_out(who, problem, whole, held, parts=3, folder=tmp_path))
    assert sorted(t.name for one in found for t in one.trials) == [t.name for t in trials]
    for one in found:
        assert one.held.mean[0] == pytest.approx(value, rel=0.1)
        seen = tuple(t for t in trials if t.name not in {u.name for u in one.trials})
        again = who.fit(replace(problem, trials=seen))
        assert one.held.mean == pytest.approx(again.values, rel=1e-3)
        assert one.held.covariance == pytest.approx(again.covariance, rel=0.05)
    (tmp_path / "part-2-of-3.npz").unlink()
    with threads(1) as pool:
        resumed = list(left_out(who, problem, whole, held, parts=3, folder=tmp_path, pool=pool))
    assert [one.held.mean.tolist() for one in resumed] == [one.held.mean.tolist() for one in found]

"""Where descents ended when one problem and many had an objective each, by different code: one objective ends there.

The numbers are of the two earlier implementations, which agreed; a descent that stops at a tolerance repeats its steps
to rounding, times the condition of its normal equations: 1e-7 here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.belief.ensemble import ensemble
from seatrial.core.parameters import Free
from seatrial.identify import FitError, Nuisance, Problem
from seatrial.identify.posterior.profile import profiles
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.shooting import Trajectory
from suzaku_turns import problem

PATHS = ("hull.R_0", "rudder.kappa", "rudder.a_H", "propeller.w_P0")
ADRIFT = Nuisance(current=0.1, bias={"psi": 0.01}, common={"scale.u": 0.02, "offset.delta": 0.02})
STARTS = Trajectory(window=100.0, starts=3, threads=2)


def near(expected: Sequence[float]) -> object:
    return pytest.approx(expected, rel=1e-7)


@pytest.fixture(scope="module")
def turns() -> Problem:
    """Two turns of 300 s to fit, one to watch."""
    told = problem(paths=PATHS, duration=300.0)
    return replace(told, trials=told.trials[:2], validation=told.trials[3:])


@pytest.mark.slow
def test_a_fit_at_values_of_another_search_keeps_them_and_judges_them(turns) -> None:
    way = Trajectory(window=60.0, threads=2)
    best = way.fit(turns)
    there = way.at(turns, best.values)
    np.testing.assert_array_equal(there.values, best.values)
    np.testing.assert_allclose(there.sigma, best.sigma, rtol=1e-3)  # starts are sought anew
    assert there.objective == pytest.approx(best.objective, rel=1e-3)
    away = best.values * 0.99  # one of them is at the upper end of its range
    moved = way.at(turns, away)
    np.testing.assert_array_equal(moved.values, away)
    assert moved.free == turns.free, "their starts and priors stay those of the problem"
    assert moved.objective > best.objective
    for wrong in (best.values[:-1], best.values * np.nan):
        with pytest.raises(FitError, match="one finite number for each"):
            way.at(turns, wrong)



@pytest.mark.slow
def test_one_start(turns: Problem) -> None:
    fit = Trajectory(window=60.0, threads=2).fit(turns)
    assert fit.values == near([0.01968289553, 0.2748815485, 0.2528, 0.6095514008])
    assert fit.diagnosis is not None
    widened = np.array([fit.diagnosis.widened.get(path, 1.0) for path in fit.vector.paths])  # by the residuals
    assert fit.sigma / widened == near([0.0005682924206, 0.04073411436, 0.09832674043, 0.01743069458])
    assert fit.objective == near(99544.8853)


@pytest.mark.slow
def test_one_start_with_currents_biases_and_errors_of_instruments(turns: Problem) -> None:
    """Also where trials of validation are watched, whose instruments are taken to be right.

    The speed is not compared, but each window starts with it as recorded: its scale error acts there, since the start
    is what would have been read, as the bias of the heading does.  Then the track alone tells that bias, so that the
    descent has to go on to where the objective no longer falls (the two earlier implementations, in which neither
    acted on a start, came within 1e-5 of these values at the usual tolerance).
    """
    fit = Trajectory(window=100.0, threads=2, tolerance=1e-12).fit(replace(turns, nuisance=ADRIFT))
    assert fit.values == near([0.019575937294, 0.330049908773, 0.2528, 0.625233929298])
    assert fit.nuisances["*"] == near({"scale.u": 0.00062121449648, "offset.delta": -0.01938458988939})
    assert fit.nuisances["turn +10"] == pytest.approx({
        "current_x": 0.03397065362620, "current_y": -0.02677170108669, "bias_psi": -0.00020498083298,
    }, rel=1e-6)  # fmt: skip
    assert np.isfinite(fit.history[:, 2]).all()


@pytest.mark.slow
def test_several_starts(turns: Problem) -> None:
    """Drawn one start after the other, or one parameter after the other."""
    fit = STARTS.fit(turns)
    assert fit.values == near([0.01973419048, 0.2958628592, 0.2283621362, 0.6130184034])
    assert fit.status == "3 of 3 starts converged"
    search = MultiStart(starts=5, method="euler", initial="measured", threads=2)
    assert np.array_equal(search.drawn(turns.vector)[0], turns.vector.start)
    many = search.fit(turns)
    assert many.values == near([0.01811237164, 0.3471584707, 0.0632, 0.5683590068])
    assert many.objective == near(704556.8121)


@pytest.mark.slow
def test_a_profile_and_repetitions(turns: Problem) -> None:
    settings = MultiStart(starts=1, method="euler", threads=2)
    tight = Trajectory(window=300.0, every=1, method="euler", tolerance=1e-12, iterations=80, threads=2)
    found = profiles(tight.fit(turns), turns, settings).profiles
    assert found[0].interval == pytest.approx([0.01748264035, 0.01897157568], rel=1e-6)
    assert found[1].interval == pytest.approx([0.3026381777, 0.370170715], rel=1e-6)
    two = replace(turns, free=turns.free[:2])
    group = ensemble(tight.fit(two), two, settings, members=6)
    members = [0.01112607703, 0.2, 0.01112485729, 0.2009270753, 0.01106370136, 0.2]
    assert group.values[:3].ravel() == pytest.approx(members, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("settings", [
    replace(STARTS, tolerance=1e-8, threads=1), MultiStart(starts=3, window=100.0, every=2, threads=1),
], ids=["one still step", "two"])  # fmt: skip
def test_starts_that_go_down_together_go_on_after_a_kill_to_the_same_numbers(
    turns: Problem, settings: Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed after every iteration: some are done then, some between two tries, and none looks at its neighbours."""

    path, told = tmp_path / "checkpoint.npz", replace(turns, free=turns.free[:2])
    monkeypatch.setattr("seatrial.identify.resume._PAUSE", 0.0)
    whole = settings.fit(told)
    for last in range(1, len(whole.history) + 1):
        def kill(iteration: int, *_: float, last: int = last) -> None:
            if iteration >= last:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            settings.fit(told, checkpoint=path, progress=kill)
    again = settings.fit(told, checkpoint=path)
    assert np.array_equal(again.ends, whole.ends)
    assert np.array_equal(again.history[:, :3], whole.history[:, :3])
    assert again.evaluations == whole.evaluations


@pytest.mark.slow
def test_many_starts_take_parameters_later_and_windows_that_overlap(turns: Problem) -> None:
    """What one start could do, many can: the same optimum, whoever joined late."""
    told = replace(turns, validation=())
    how = {"window": 100.0, "stride": 50.0, "every": 2, "starts": 2, "threads": 2, "method": "euler"}
    late, at_once = (MultiStart(**how, later=patterns).fit(told) for patterns in (("rudder.*",), ()))
    assert late.objective == pytest.approx(at_once.objective, rel=1e-9)
    assert late.values == pytest.approx(at_once.values, rel=1e-4)
    assert not np.array_equal(late.history, at_once.history)
    free: tuple[Free, ...] = late.free
    assert free == told.free

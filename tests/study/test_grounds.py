from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fitted_run import DEGREE, PATHS, covariance, saved, trial
from seatrial.belief.reading import posterior
from seatrial.data import Trial
from seatrial.identify import Loss, Problem, StudyError
from seatrial.study.grounds import Beyond, covered, of_trials, trial_digest
from seatrial.study.store import _stood_on, write_summary
from seatrial.study.stored import load_fit

CONTROLS = ("n_P", "delta")


def test_a_digest_follows_the_readings_and_not_the_name() -> None:
    one = trial(20)
    assert trial_digest(replace(one, name="another")) == trial_digest(one)
    assert trial_digest(one.having(u=one["u"] + 1e-9)) != trial_digest(one)


def test_a_run_of_greater_rudder_angle_is_beyond_the_trials() -> None:
    found = of_trials([trial(20), trial(20, side=-1)], CONTROLS)
    assert not found.beyond(trial(20, seed=1), CONTROLS)
    out = {one.channel: one for one in found.beyond(trial(35), CONTROLS)}
    assert out["delta"].reached[1] == pytest.approx(35 * DEGREE)
    assert "r" in out


def test_trials_to_one_side_do_not_cover_the_other() -> None:
    found = of_trials([trial(20)], CONTROLS)
    assert {"delta", "r"} <= {one.channel for one in found.beyond(trial(20, side=-1), CONTROLS)}


@pytest.mark.parametrize("channel", ["U_T", "H_S", "depth"])
def test_what_no_trial_had_around_it_is_beyond(channel: str) -> None:
    run = trial(20)
    around = run.having(**{channel: np.full(len(run), 5.0)})
    assert [one.channel for one in of_trials([run], CONTROLS).beyond(around, CONTROLS)] == [channel]
    # and trials in shallow water, such as those, do not cover deep water
    if channel == "depth":
        (one,) = of_trials([around], CONTROLS).beyond(run, CONTROLS)
        assert one.channel == "depth"
        assert math.isinf(one.reached[0])


def test_one_wrong_reading_does_not_widen_a_range() -> None:
    run = trial(20, duration=600.0)
    u = run["u"].copy()
    u[100] = 50.0
    assert covered([run.having(u=u)], CONTROLS)["u"][1] < 2.0


def test_a_posterior_comes_back_with_its_ranges(tmp_path: Path) -> None:
    held = posterior(saved(tmp_path, [trial(20)]))
    assert [one.path for one in held.free] == list(PATHS)
    assert held.covered["delta"][1] == pytest.approx(20 * DEGREE)
    assert math.isinf(held.covered["depth"][0])
    assert held.grounds.kinds == ("turning",)
    drawn = held.draws(4000, 1)
    assert np.std(drawn, axis=0) == pytest.approx(np.sqrt(np.diag(covariance(0.01))), rel=0.05)
    assert np.array_equal(drawn, held.draws(4000, 1))


@pytest.mark.slow
def test_ranges_are_of_the_rudder_that_acted_and_not_of_its_offset(tmp_path: Path) -> None:
    """A rudder that reads 2.5 deg too much has turned the ship at 17.5 deg where it read 20; digests are of the log."""
    log = trial(20)
    plain = posterior(saved(tmp_path / "plain", [log])).grounds
    errors = {"offset.delta": 2.5 * DEGREE, "bias.r": 1e-3, "bias.psi": 0.1, "scale.u": 0.5}
    found = posterior(saved(tmp_path / "off", [log], errors=errors)).grounds
    assert found.covered["delta"][1] == pytest.approx(plain.covered["delta"][1] - 2.5 * DEGREE)
    assert found.covered["r"] == pytest.approx([end - 1e-3 for end in plain.covered["r"]])
    assert found.covered["u"] == plain.covered["u"]
    assert found.trials == plain.trials
    assert found.kinds == plain.kinds
    [had], [has] = ([one for one in some.tested if (one.x, one.y) == ("u", "delta")] for some in (plain, found))
    assert max(y for _, y in has.corners) == pytest.approx(max(y for _, y in had.corners) - 2.5 * DEGREE)
    fit = load_fit(tmp_path / "off")
    by_track = Problem(fit.ship, (log,), fit.free, loss=Loss(dict.fromkeys(("x", "y", "psi"), 1.0)))
    assert _stood_on(fit, by_track, ()).made == _stood_on(replace(fit, nuisances={}), by_track, ()).made != ()


def test_what_the_form_lacks_comes_back_with_a_posterior(tmp_path: Path) -> None:
    assert posterior(saved(tmp_path / "a", [trial(20)], form=0.4)).form == 0.4
    assert posterior(saved(tmp_path / "b", [trial(20)])).form == 0.0


def test_draws_stay_within_the_bounds_of_the_study(tmp_path: Path) -> None:
    held = posterior(saved(tmp_path, [trial(20)]))
    # the search ended on a bound: half of the normal density is beyond it
    free = tuple(replace(one, low=value) for one, value in zip(held.free, held.mean.tolist(), strict=True))
    drawn = replace(held, free=free).draws(300, 1)
    assert drawn.shape == (300, 3)
    assert np.all(drawn >= held.mean)
    far = tuple(replace(one, low=one.start, start=1e3 * abs(one.start), high=math.inf) for one in held.free)
    far = tuple(replace(one, low=0.5 * one.start) for one in far)
    drawn = replace(held, free=far).draws(10, 1)  # of the tail, however far it is
    assert np.all(drawn[:, :2] >= [one.low for one in far[:2]])  # kappa cannot be so large: its physical bound holds


@pytest.mark.parametrize(("change", "said"), [
    ({"digest": "of-another-fit"}, "of fit digest-of-this-fit, the fit.json beside it of fit of-another-fit"),
    ({"covariance": [[0.0] * 3] * 3}, "no covariance"),
    ({"covariance": [[None] * 3] * 3}, "no covariance"),
])  # fmt: skip
def test_a_posterior_of_another_fit_is_refused(change: dict[str, object], said: str, tmp_path: Path) -> None:
    model = saved(tmp_path, [trial(20)])
    file = tmp_path / "fit.json"
    write_summary(file.parent, {**json.loads(file.read_text()), **change})
    with pytest.raises(StudyError, match=said):
        posterior(model)


def test_an_edited_model_is_refused(tmp_path: Path) -> None:
    model = saved(tmp_path, [trial(20)])
    document = json.loads((tmp_path / "fit.json").read_text())
    document["parameters"]["hull.Y_v"]["value"] *= 1.01
    write_summary(tmp_path, document)
    with pytest.raises(StudyError, match=r"hull.Y_v is .* edited after the fit"):
        posterior(model)


def test_a_ship_without_a_posterior_names_the_command_that_makes_one(tmp_path: Path) -> None:
    for model in ("kvlcc2_l7", tmp_path / "model.toml"):
        with pytest.raises(StudyError, match=r"no posterior.*seatrial identify STUDY.toml -o RUN"):
            posterior(model)
    model = saved(tmp_path, [trial(20)])
    (tmp_path / "fit.json").unlink()
    with pytest.raises(StudyError, match=r"no posterior.*seatrial identify"):
        posterior(model)


def test_a_log_without_speeds_covers_what_it_has() -> None:
    run = Trial("a", np.arange(10.0), {"delta": np.linspace(0, 0.1, 10)})
    assert set(covered([run], CONTROLS)) == {"delta", "U_T", "H_S", "depth"}


def test_a_run_goes_as_many_times_as_far_as_its_farthest_end_over_that_of_the_trials() -> None:
    """To either side, as ships are alike on both; wind and depth are no reach of the ship."""
    assert Beyond("delta", (-0.2, 0.4), (-0.6, 0.1)).times == pytest.approx(1.5)
    assert Beyond("delta", (-0.5, 0.1), (0.0, 0.4)).times == 1.0, "to port so far"
    assert Beyond("u", (2.0, 8.0), (1.0, 7.0)).times == 1.0
    assert Beyond("r", (0.0, 0.0), (0.0, 0.1)).times == math.inf
    assert Beyond("U_T", (2.0, 4.0), (0.0, 9.0)).times == 1.0
    assert Beyond("r", (0.0, 0.01), (0.02, 0.02), (("u", 7.5),)).times == 1.0

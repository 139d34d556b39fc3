"""Numbers of a fit on disk: what is taken, what is refused, ranges and digests by hand; settings against trials."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fitted_run import PATHS, saved, trial, truth
from seatrial.belief.posterior import Posterior
from seatrial.belief.reading import posterior
from seatrial.data import Trial
from seatrial.identify import StudyError
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.models import STATES
from seatrial.study import grounds, study
from seatrial.study.grounds import Beyond, Grounds, Ranges, covered, kind_of
from seatrial.study.store import (
    Parameter,
    check_covariance,
    claim,
    fitted_scale,
    kept,
    read_summary,
    summary_beside,
    write_summary,
)
from seatrial.study.stored import load_fit, read_history

T = np.arange(10.0)


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return saved(tmp_path / "run", [trial(20)], test=[trial(35)])


def rewritten(run: Path, **more: object) -> str:
    write_summary(run.parent, {**json.loads((run.parent / "fit.json").read_text()), **more})
    return str(run)


@pytest.mark.slow
def test_scales_of_a_fit_are_of_all_states_and_above_zero(run: Path) -> None:
    assert fitted_scale(run) == {}
    scale = {name: 0.5 + k for k, name in enumerate(STATES)}
    assert fitted_scale(rewritten(run, scale=scale)) == scale
    for wrong in ({"x": 1.0}, {**scale, "more": 1.0}):
        assert fitted_scale(rewritten(run, scale=wrong)) == {}
    for value in (0.0, -1.0, 1e31, 1e-31, "1", True, None):
        with pytest.raises(StudyError, match=r"scale\.u is .*; it must be a (positive )?number"):
            fitted_scale(rewritten(run, scale={**scale, "u": value}))
    assert fitted_scale(rewritten(run, scale={**scale, "u": 1e-30}))["u"] == 1e-30
    assert fitted_scale(rewritten(run, scale={**scale, "u": 1e30}))["u"] == 1e30
    assert fitted_scale(run.with_name("other.toml")) == {}


@pytest.mark.slow
def test_nuisances_of_a_fit_are_finite(run: Path) -> None:
    found = summary_beside(rewritten(run, nuisances={"a": {"bias_u": -0.5, "current_x": 0}}))
    assert found is not None
    assert found.nuisances == {"a": {"bias_u": -0.5, "current_x": 0.0}}
    for wrong in ([1], {"b": 3}):
        with pytest.raises(StudyError, match=r"nuisances.* is .*; it must be a table"):
            summary_beside(rewritten(run, nuisances=wrong))
    for value in (None, "x", True, 1e31):
        with pytest.raises(StudyError, match=r"nuisances\.a\.bias_u is .*; it must be a number from -1e\+30 to 1e\+30"):
            summary_beside(rewritten(run, nuisances={"a": {"bias_u": value}}))


def test_trials_of_a_study_are_those_of_the_fit_and_those_kept_back(run: Path) -> None:
    found = read_summary(run.parent).grounds
    assert [(one.name, one.role) for one in found.trials] == [("turning_20_+1", "fit"), ("turning_35_+1", "kept back")]
    assert list(found.digests("fit")) == ["turning_20_+1"]
    with pytest.raises(StudyError, match=r"grounds\.trials\.1 is 3; it must be a table"):
        summary_beside(rewritten(run, grounds={"trials": [vars(found.trials[0]), 3]}))
    assert summary_beside(run.with_name("none.toml")) is None


def test_a_folder_that_was_only_just_claimed_is_released_where_the_study_is_refused(tmp_path: Path) -> None:
    for fresh, there in ((True, False), (False, True)):
        folder = tmp_path / str(fresh)
        assert claim(folder, "d", "s") is True
        assert claim(folder, "d", "s") is False
        with pytest.raises(StudyError), kept(folder, fresh):
            raise StudyError("no")
        assert folder.exists() is there
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").write_text("")
    claim(tmp_path / "other", "d", "s")
    with pytest.raises(StudyError), kept(tmp_path / "other", True):
        raise StudyError("no")
    assert [one.name for one in (tmp_path / "other").iterdir()] == ["mine.txt"]


def test_a_history_has_four_columns(tmp_path: Path) -> None:
    path = tmp_path / "history.csv"
    head = "iteration,objective,validation,seconds\n"
    path.write_text(head + "0,2.5,,0.1\n1,1.5,0.25,0.2\n")
    found = read_history(path)
    assert found[1].tolist() == [1.0, 1.5, 0.25, 0.2]
    assert math.isnan(found[0, 2])
    path.write_text(head)
    assert read_history(path).shape == (0, 4)
    for wrong in ("", "a,b\n", head + "0,1,2\n", head + "0,x,,1\n"):
        path.write_text(wrong)
        with pytest.raises(StudyError, match="cannot be read"):
            read_history(path)


def test_a_covariance_is_one_of_some_density() -> None:
    """Symmetric, no variance below zero, no correlation beyond one; rounding is let pass, and what is not known."""
    for good in ([[1.0, 0.999], [0.999, 1.0]], [[1e-12, 1e-7], [1e-7, 1.0]], [[0.0, 0.0], [0.0, 1.0]],
                 [[1.0, 1.0 + 1e-7], [1.0 + 1e-7, 1.0]], [[np.nan, np.nan], [np.nan, 1.0]],
                 [[4.0, 1.0], [1.0 + 1e-6, 4.0]]):  # fmt: skip
        check_covariance(np.array(good), 2, Path("f"))
    for bad, told in (([[1.0, 0.5], [0.4, 1.0]], "must be symmetric"), ([[-1.0, 0.0], [0.0, 1.0]], "negative variance"),
                      ([[1.0, 1.1], [1.1, 1.0]], "negative variance"),
                      ([[1e-12, 1.1e-6], [1.1e-6, 1.0]], "negative variance")):  # fmt: skip
        with pytest.raises(StudyError, match=told):
            check_covariance(np.array(bad), 2, Path("f"))


@pytest.mark.slow
def test_an_estimate_is_a_number_and_its_sigma_above_zero_or_unknown(run: Path) -> None:
    found = read_summary(run.parent)
    path, one = next(iter(found.parameters.items()))

    def checked(changed: Parameter) -> None:
        replace(found, parameters={**found.parameters, path: changed}).check(Path("f"))

    for value, sigma, told in ((math.inf, 0.1, "value is inf"), (1.0, 0.0, "sigma is 0"), (1.0, -1.0, "sigma is -1")):
        with pytest.raises(StudyError, match=rf"f: parameters\.hull\.Y_v\.{told}"):
            checked(replace(one, value=value, sigma=sigma))
    checked(replace(one, sigma=math.nan))


def test_draws_have_the_covariance_of_the_fit_correlations_included() -> None:
    from seatrial.core.parameters import Free

    ship = truth()
    sizes = np.array([0.01, 0.002, 0.03])
    correlation = np.array([[1.0, -0.8, 0.3], [-0.8, 1.0, 0.0], [0.3, 0.0, 1.0]])
    C = correlation * np.outer(sizes, sizes)
    mean = np.array([-0.3, -0.05, 0.6])
    own = Posterior(ship, tuple(Free(path, m) for path, m in zip(PATHS, mean.tolist(), strict=True)), mean, C, "d")
    drawn = own.draws(20_000, 3)
    assert np.corrcoef(drawn.T) == pytest.approx(correlation, abs=0.03)
    assert drawn.std(axis=0) == pytest.approx(sizes, rel=0.03)
    assert drawn.mean(axis=0) == pytest.approx(mean, abs=5.0 * sizes.max() / math.sqrt(20_000))
    samples = np.array([mean, mean + sizes])
    among = replace(own, samples=samples).draws(400, 1)
    assert {tuple(row) for row in among.tolist()} == {tuple(row) for row in samples.tolist()}
    assert among[:, 0].mean() == pytest.approx(mean[0] + 0.5 * sizes[0], abs=0.1 * sizes[0])


@pytest.mark.parametrize(("change", "told"), [
    (lambda d: {**d, "digest": "other"}, "is of fit digest-of-this-fit"),
    (lambda d: {**d, "covariance": [[0.0] * 3] * 3}, "its fit has no covariance"),
    (lambda d: {**d, "covariance": [[None] * 3] * 3}, "its fit has no covariance"),
])  # fmt: skip
def test_a_posterior_is_of_the_fit_beside_the_model(
    run: Path, change: Callable[[dict[str, Any]], dict[str, Any]], told: str
) -> None:
    write_summary(run.parent, change(json.loads((run.parent / "fit.json").read_text())))
    (run.parent / "fit.npz").unlink(missing_ok=True)
    with pytest.raises(StudyError, match=told):
        posterior(run)


def test_a_fit_is_read_with_what_json_has_no_number_for(run: Path) -> None:
    document = json.loads((run.parent / "fit.json").read_text())
    own = document["parameters"][PATHS[0]]
    own |= {"low": None, "high": None, "prior": None, "prior_sigma": None, "shrinkage": None}
    write_summary(run.parent, document)
    found = load_fit(run.parent)
    free = found.free[0]
    assert (free.low, free.high, free.sigma) == (-math.inf, math.inf, math.inf)
    assert math.isnan(free.prior)
    assert math.isnan(found.shrinkage[0])
    assert json.loads((run.parent / "fit.json").read_text())["seal"]["model"] is not None


def moved(**channels: Any) -> Trial:
    usual: dict[str, Any] = {"x": 0.0, "y": 0.0, "psi": 0.0, "u": 1.0, "v_m": 0.0, "r": 0.0, "n_P": 10.0, "delta": 0.1}
    found = {name: np.asarray(value, dtype=float) for name, value in (usual | channels).items()}
    return Trial("a", T, {name: np.broadcast_to(values, T.shape) for name, values in found.items()})


def test_a_range_is_that_of_all_trials_without_a_thousandth_at_either_end() -> None:
    t = np.arange(2001.0)
    made = Trial("a", t, {"u": t})
    low, high = covered([made], ())["u"]
    assert (low, high) == pytest.approx((2.0, 1998.0))
    two = covered([moved(u=1.0), moved(u=3.0)], ())["u"]
    assert two == pytest.approx((1.0, 3.0))
    assert covered([moved(u=np.nan)], ()).get("u") is None
    assert covered([moved()], ("delta",))["delta"] == pytest.approx((0.1, 0.1))
    assert "n_P" not in covered([moved()], ("delta",))


def beyond(found: Ranges, **channels: Any) -> tuple[Beyond, ...]:
    return Grounds(covered=found).beyond(moved(**channels), ())


def test_a_run_may_leave_a_range_by_a_tenth_of_its_width_or_a_twentieth_of_its_size() -> None:
    for span, outside, inside in (((0.0, 2.0), 2.21, 2.19), ((10.0, 10.2), 10.72, 10.70), ((-2.0, 0.0), -2.21, -2.19),
                                  ((-10.2, -10.0), -10.72, -10.70)):  # fmt: skip
        found = {"u": span}
        middle = sum(span) / 2.0
        assert beyond(found, u=np.where(T == 4, inside, middle)) == ()
        (one,) = beyond(found, u=np.where(T == 4, outside, middle))
        assert one == Beyond("u", span, (min(middle, outside), max(middle, outside)))
    gap = np.where(T == 4, np.nan, 1.0)
    assert beyond({"u": (0.0, 2.0)}, u=gap) == ()
    assert beyond({"v_m": (0.0, 0.0)}, v_m=2e-9)[0].channel == "v_m"
    assert beyond({"v_m": (0.0, 0.0)}, v_m=5e-10) == ()
    deep = {"depth": (math.inf, math.inf)}
    assert beyond(deep) == ()
    assert beyond(deep, depth=20.0)[0].reached == (20.0, 20.0)


def test_drift_is_the_angle_of_the_way_and_counts_above_a_tenth_of_the_greatest_speed() -> None:
    """atan2(-v_m, u): positive where the flow meets the port bow."""
    found = covered([moved(u=1.0, v_m=-1.0)], ())
    assert found[grounds.DRIFT] == pytest.approx((math.pi / 4, math.pi / 4))
    u = np.where(T < 5, 10.0, 0.8)
    v_m = np.where(T < 5, 0.0, 0.5)
    assert covered([moved(u=u, v_m=v_m)], ())[grounds.DRIFT] == pytest.approx((0.0, 0.0))
    v_m = np.where(T < 5, 0.0, 0.8)  # hypot(.8, .8) = 1.13 is above a tenth of 10
    assert covered([moved(u=u, v_m=v_m)], ())[grounds.DRIFT][0] == pytest.approx(-math.pi / 4)


def test_what_is_not_logged_is_still_air_flat_sea_and_deep_water() -> None:
    found = covered([moved()], ())
    assert (found["U_T"], found["H_S"], found["depth"]) == ((0.0, 0.0), (0.0, 0.0), (math.inf, math.inf))
    some = covered([moved(U_T=np.where(T == 3, np.nan, 5.0))], ())
    assert some["U_T"][0] == pytest.approx(0.0, abs=0.1)
    assert some["U_T"][1] == 5.0
    kept_back = grounds.grounds([moved()], [replace(moved(), name="b")], [replace(moved(), name="c")], ("delta",))
    assert [(one.name, one.role) for one in kept_back.trials] \
        == [("a", "fit"), ("b", "validation"), ("c", "kept back")]
    assert kept_back.trials[0].rows == 10
    assert kept_back.trials[0].duration == pytest.approx(9.0, abs=1.0)
    assert kept_back.kinds == (kind_of(moved()),)


def test_a_kind_is_as_the_data_show_it_else_as_the_sidecar_says() -> None:
    turn = trial(35)
    assert kind_of(replace(turn, meta={**turn.meta, "kind": "zigzag"})) == "turning"
    vague = Trial("v", T, {"u": np.sin(T)}, meta={"kind": "docking"})
    assert kind_of(vague) == "docking"
    assert kind_of(replace(vague, meta={})) == "unknown"


def steps(trials: list[Trial], **table: Any) -> list[str]:
    return study._steps(Path("s.toml"), trials, table)


def test_windows_and_steps_of_an_estimator_fit_the_trials() -> None:
    one = Trial("a", np.arange(101.0), {"u": np.zeros(101)})  # 100 s; with the step after its last row 101 s
    assert steps([one], window=112.0) == []
    with pytest.raises(StudyError, match=r"a lasts 100 s, estimator\.window is 112\.5 s"):
        steps([one], window=112.5)
    assert steps([one]) == []
    for key, most, more in (("dt", 25.0, 25.1), ("every", 25, 26)):
        steps([one], **{key: most})
        with pytest.raises(StudyError, match=rf"estimator\.{key} is {more:g}"):
            steps([one], **{key: more})
    with pytest.raises(StudyError, match=r"estimator\.every is 13, which leaves a row each 26 s"):
        steps([one], dt=2.0, every=13)
    assert steps([one, one], dt=10.0) == []
    (line,) = steps([one, one], dt=10.5)
    assert line == "warning: estimator.dt is 10.5 s, a is logged every 1 s"


def test_a_trial_is_split_at_long_leaps_of_time() -> None:
    from seatrial.data.prepare import BREAK

    t = np.concatenate([np.arange(50.0), 50.0 + 2.0 * BREAK + np.arange(50.0)])
    torn = Trial("a", t, {"u": np.zeros(100)})
    parts, notes = study._whole((torn, moved()))
    assert [len(one) for one in parts] == [50, 50, 10]
    assert notes == [f"warning: a leaps over {int(BREAK)} steps of time; taken as 2 trials"]
    whole, short = moved(), Trial("b", np.array([0.0, 1e6]), {"u": np.zeros(2)})
    same, none = study._whole((whole, short))
    assert none == []
    assert len(same) == 2
    assert same[0] is whole
    assert same[1] is short


def test_a_channel_that_the_fit_needs_has_values_the_order_where_the_control_is_not_logged() -> None:
    ship, empty = truth(), np.full(10, np.nan)
    study._filled(Path("s.toml"), ship, [moved()])
    for name in ("delta", "n_P"):
        with pytest.raises(StudyError, match=f"a: channel {name} has no values"):
            study._filled(Path("s.toml"), ship, [moved(**{name: empty})])
    study._filled(Path("s.toml"), ship, [moved(u=empty)])  # a state that nothing reads is estimated
    study._filled(Path("s.toml"), ship, [moved(U_T=empty, u=np.where(T < 9, np.nan, 1.0))])
    ordered = moved(delta_cmd=empty)
    study._filled(Path("s.toml"), ship, [ordered])


@pytest.mark.parametrize(("document", "told"), [
    ({"loss": {"sigma": {"u": 0.0}}}, r"loss\.sigma\.u is 0"), ({"loss": {"sigma": {"u": math.inf}}}, "is inf"),
    ({"nuisance": {"bias": {"u": -1.0}}}, r"nuisance\.bias\.u is -1"),
    ({"nuisance": {"current": math.inf}}, r"nuisance\.current is inf; it must be a finite number"),
    ({"nuisance": {"common": {"a": -math.inf}}}, r"nuisance\.common\.a is -inf"),
    ({"estimator": {"window": math.nan}}, r"estimator\.window is nan"),
    ({"estimator": {"threads": 0}}, r"estimator\.threads is 0; it must be 1 or more"),
    ({"estimator": {"threads": True}}, r"estimator\.threads is True"),
    ({"estimator": {"threads": 2.0}}, r"estimator\.threads is 2\.0"),
    ({"estimator": {"weights": {"u": "a"}}}, r"estimator\.weights\.u is 'a'"),
    ({"estimator": {"weights": {"u": True}}}, r"estimator\.weights\.u is True"),
    ({"free": {"hull.Y_v": {"prior": math.inf}}}, r"free\.hull\.Y_v\.prior is inf"),
])  # fmt: skip
def test_numbers_of_a_study_that_are_none_are_named(document: dict[str, Any], told: str) -> None:
    with pytest.raises(StudyError, match=told):
        study._check_numbers(Path("s.toml"), document)


def test_numbers_of_a_study_may_be_open_where_that_means_something() -> None:
    study._check_numbers(Path("s.toml"), {
        "nuisance": {"common": {"offset.delta": math.inf}, "initial": {"u": math.inf}, "bias": {"u": 0.1}},
        "free": {"hull.Y_v": {"low": -math.inf, "high": math.inf}}, "loss": {"sigma": {"u": 0.1}},
        "estimator": {"threads": 1, "weights": {"u": 2}, "seeds": [1, 2]}, "data": {"x": math.nan},
    })  # fmt: skip
    assert list(study._leaves({"a": [{"b": 1}, {"b": 2}], "c": 3})) == [(("a", "b"), 1), (("a", "b"), 2), (("c",), 3)]


def test_settings_of_an_estimator_have_the_types_of_their_defaults() -> None:
    made: Any = study.read_estimator(Path("s.toml"), {"type": "shooting:Trajectory", "window": 30, "every": 2})
    assert isinstance(made, Trajectory)
    assert (made.window, type(made.window), made.every) == (30.0, float, 2)
    for key, value, told in (("iterations", 2.0, "must be a whole number"), ("tolerance", "x", "must be a number"),
                             ("method", 4, "must be a text"), ("tolerance", True, "must be a number")):  # fmt: skip
        with pytest.raises(StudyError, match=rf"estimator\.{key} is .*{told}"):
            study.read_estimator(Path("s.toml"), {"type": "shooting:Trajectory", key: value})
    with pytest.raises(StudyError, match=r"fits\.A\.estimator: no key 'windov'"):
        study.read_estimator(Path("s.toml"), {"type": "shooting:Trajectory", "windov": 1.0}, "fits.A.estimator")


@pytest.mark.parametrize("unknown", [[np.nan, np.nan, np.nan], [np.inf, 0.0, 0.0], [np.inf, np.nan, np.nan]])
def test_beside_what_is_not_known_the_rest_of_a_covariance_is_checked(unknown: list[float]) -> None:
    def beside(rest: list[list[float]]) -> np.ndarray:
        whole = np.full((3, 3), 0.0)
        whole[0], whole[:, 0], whole[1:, 1:] = unknown, unknown, rest
        return whole

    check_covariance(beside([[1.0, 0.5], [0.5, 1.0]]), 3, Path("f"))
    with pytest.raises(StudyError, match="must be symmetric"):
        check_covariance(beside([[1.0, 0.5], [0.4, 1.0]]), 3, Path("f"))
    with pytest.raises(StudyError, match="negative variance"):
        check_covariance(beside([[1.0, 0.0], [0.0, -1.0]]), 3, Path("f"))

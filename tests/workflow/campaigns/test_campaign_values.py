"""What each key of a campaign becomes: SI units, bounds, distributions, the root of a posterior."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest

from fitted_run import PATHS, covariance, saved, trial
from seatrial.campaign import Campaign, CampaignError
from seatrial.campaign.running import Shard
from seatrial.core.errors import RequestError
from seatrial.ships.files import load
from seatrial.simulate.approach import approach, time_step
from seatrial.study.stored import load_fit
from seatrial.workflow.asked import Approach, Orders, Span
from seatrial.workflow.campaigns import campaign, on_devices, shard_of
from seatrial.workflow.campaigns.reading import campaign_of

DEG = math.pi / 180.0
ZIGZAG: Mapping[str, Any] = MappingProxyType({"kind": "zigzag", "rudder": 10.0, "heading": 10.0, "duration": 30.0,
                                              "dt": 0.2})  # fmt: skip


def made(at: Path = Path("here") / "many.toml", **more: Any) -> Campaign:
    return campaign_of(copy.deepcopy({"schema": "seatrial-campaign/1", "ships": ["kvlcc2_l7"], "runs": 4,
                                      "manoeuvre": dict(ZIGZAG), **more}), at)  # fmt: skip


def refused(text: str, **more: Any) -> None:
    with pytest.raises(RequestError, match=text):
        made(**more)


@pytest.mark.slow
def test_a_case_is_the_manoeuvre_as_simulate_orders_it() -> None:
    found = made(title="T", seed=3, design="sobol", chunk=2)
    (case,) = found.cases
    policy: Any = case.manoeuvre
    assert (found.name, found.runs, found.seed, found.design, found.chunk) == ("T", 4, 3, "sobol", 2)
    assert (policy.delta, policy.psi, policy.side) == (pytest.approx(10 * DEG), pytest.approx(10 * DEG), 1.0)
    assert (case.name, case.duration, case.dt, case.method) == ("kvlcc2_l7", 30.0, 0.2, "rk4")
    ship = load("kvlcc2_l7")
    assert (case.speed, policy.n_P) == (pytest.approx(approach(ship)[0]), pytest.approx(approach(ship)[1]))
    assert made().name == "many"
    slower: Any = made(manoeuvre={**ZIGZAG, "speed": 0.8, "rps": 7.0, "side": "port"}).cases[0]
    assert (slower.speed, slower.manoeuvre.n_P, slower.manoeuvre.side) == (0.8, 7.0, -1.0)


def test_cases_are_named_by_what_tells_them_apart() -> None:
    turn = {"kind": "turning", "duration": 20.0, "dt": 0.2, "name": "hard over"}
    assert [c.name for c in made(ships=["kvlcc2_l7", "kvlcc2"]).cases] == ["kvlcc2_l7", "kvlcc2"]
    assert [c.name for c in made(manoeuvre=[dict(ZIGZAG), turn]).cases] == ["zigzag", "hard over"]
    both = made(ships=["kvlcc2_l7", "kvlcc2"], manoeuvre=[dict(ZIGZAG), turn])
    assert [c.name for c in both.cases] == ["kvlcc2_l7 zigzag", "kvlcc2_l7 hard over", "kvlcc2 zigzag",
                                           "kvlcc2 hard over"]  # fmt: skip


def test_a_manoeuvre_from_rest_begins_at_rest_with_the_step_of_the_ship() -> None:
    (case,) = made(manoeuvre={"kind": "acceleration", "duration": 20.0}).cases
    assert case.speed == 0.0
    assert case.dt == time_step(load("kvlcc2_l7"))


@pytest.mark.slow
def test_a_case_without_a_duration_lasts_as_long_as_simulate_lets_it() -> None:
    from seatrial.workflow.simulation import simulate

    (case,) = made(manoeuvre={"kind": "zigzag", "rudder": 20.0, "heading": 15.0, "side": "port", "speed": 1.0,
                              "dt": 0.2}).cases  # fmt: skip
    run = simulate("kvlcc2_l7", "zigzag", orders=Orders(20.0, heading=15.0, side="port"), begin=Approach(1.0),
                   span=Span(dt=0.2))  # fmt: skip
    assert case.duration == run.trial.duration


def test_inputs_are_in_si_units_but_for_the_spread_of_a_logarithm() -> None:
    found = made(inputs={
        "policy.delta": {"uniform": [9.0, 11.0], "unit": "deg"}, "policy.psi": {"value": 12.0, "unit": "deg"},
        "u": {"lognormal": [2.0, 0.1], "unit": "kn", "within": [1.0, 3.0]},
        "ship.hull.N_r": {"normal": [1.0, 0.1], "factor": True},
        "ship.rudder.t_R": {"choice": [0.3, 0.4], "weights": [1.0, 3.0]},
    }).inputs  # fmt: skip
    knot = 1852.0 / 3600.0
    assert found["policy.delta"].numbers == pytest.approx((9 * DEG, 11 * DEG))
    assert (found["policy.psi"].kind, found["policy.psi"].numbers) == ("constant", pytest.approx((12 * DEG,)))
    assert found["u"].numbers == pytest.approx((2.0 * knot, 0.1))
    assert found["u"].within == pytest.approx((knot, 3.0 * knot))
    assert (found["ship.hull.N_r"].numbers, found["ship.hull.N_r"].factor) == ((1.0, 0.1), True)
    assert (found["ship.rudder.t_R"].numbers, found["ship.rudder.t_R"].weights) == ((0.3, 0.4), (1.0, 3.0))
    assert found["policy.delta"].within is None
    assert not found["policy.delta"].factor


@pytest.mark.parametrize(("one", "told"), [
    ({"unit": "deg"}, "give one of value, uniform, .*; it has 0"),
    ({"uniform": [1.0, 2.0], "value": 1.5}, "give one of .*; it has 2"),
    ({"uniform": [1.0, 2.0], "unit": "furlong"}, "inputs.policy.delta.unit: no unit 'furlong'"),
    ({"uniform": [1.0, 2.0], "unit": "m"}, "'m' cannot measure it; it is in rad"),
    ({"uniform": [1.0, 2.0], "unit": "deg", "factor": True}, "'deg' cannot measure it; it has none"),
    ({"uniform": [2.0, 1.0]}, "inputs.policy.delta: "),
])  # fmt: skip
def test_an_input_that_is_none_is_refused(one: dict[str, Any], told: str) -> None:
    refused(told, inputs={"policy.delta": one})


def test_a_criterion_is_open_where_it_has_no_bound() -> None:
    found = made(criteria={"first_overshoot": {"at_most": 10.0, "unit": "deg"},
                           "second_overshoot": {"at_least": 2.0, "at_most": 0.5},
                           "period": {"at_least": 20.0}}).criteria  # fmt: skip
    assert (found["first_overshoot"].low, found["first_overshoot"].high) == (-math.inf, pytest.approx(10 * DEG))
    assert (found["second_overshoot"].low, found["second_overshoot"].high) == (2.0, 0.5)
    assert (found["period"].low, found["period"].high) == (20.0, math.inf)
    assert found["period"].index == "period"
    refused("criteria.advance: no index 'advance'", criteria={"advance": {"at_most": 1.0}})
    refused("criteria.period: give at_most, at_least or both", criteria={"period": {"unit": "s"}})
    refused("criteria.period.unit: 'deg' cannot measure it; it is in s",
            criteria={"period": {"at_most": 1.0, "unit": "deg"}})  # fmt: skip


def test_weather_is_that_of_simulate_and_gusts_need_a_wind() -> None:
    around = made(ships=["kvlcc2"], weather={"wind": "10,90", "current": "0.5,0"}).weather.now()
    assert (around.wind_x, around.wind_y) == pytest.approx((0.0, 10.0), abs=1e-12)
    assert (around.current_x, around.current_y) == pytest.approx((0.5, 0.0), abs=1e-12)
    assert made(ships=["kvlcc2"], weather={"wind": "10,90", "gusts": "davenport"}).gusts == "davenport"
    blown = {"inputs": {"U_T": {"uniform": [5.0, 9.0]}}, "weather": {"gusts": "davenport"}}
    assert made(ships=["kvlcc2"], **blown).gusts == "davenport"
    refused("weather.gusts need a mean wind", ships=["kvlcc2"], weather={"gusts": "davenport"})


@pytest.mark.slow
def test_a_posterior_has_the_covariance_of_the_fit(tmp_path: Path) -> None:
    saved(tmp_path / "run", [trial(20, 20)], share=0.05, off=0.02)
    for file in ("run/fit.json", str(tmp_path / "run" / "fit.json")):
        found = made(tmp_path / "many.toml", posterior={"fit": file, "widen": 2.0}).correlated
        assert found is not None
        assert found.names == tuple(f"ship.{path}" for path in PATHS)
        assert found.mean == pytest.approx(load_fit(tmp_path / "run").values)
        assert found.root @ found.root.T == pytest.approx(4.0 * covariance(0.05), rel=1e-9, abs=1e-15)
        assert np.all(np.diag(found.root) > 0.0)
        assert found.draws is None
    with pytest.raises(RequestError, match=r"posterior\.fit: .*no"):
        made(tmp_path / "many.toml", posterior={"fit": "gone/fit.json"})


def test_a_correlated_posterior_keeps_its_correlation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The root of a covariance is lower triangular, whatever the covariance: of one flat direction too."""
    import seatrial.workflow.campaigns.reading as module

    saved(tmp_path / "run", [trial(20, 20)])
    held = module.posterior(tmp_path / "run" / "model.toml")
    rng = np.random.default_rng(2)
    factor = 1e-3 * rng.standard_normal((3, 3)) @ np.diag([1.0, 1.0, 0.0])
    monkeypatch.setattr(module, "posterior", lambda _: replace(held, covariance=factor @ factor.T))
    found = made(tmp_path / "many.toml", posterior={"fit": "run"}).correlated
    assert found is not None
    assert found.root @ found.root.T == pytest.approx(factor @ factor.T, abs=1e-12)
    assert np.allclose(found.root, np.tril(found.root))


def test_a_posterior_that_is_not_normal_gives_its_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import seatrial.workflow.campaigns.reading as module

    saved(tmp_path / "run", [trial(20, 20)])
    held = module.posterior(tmp_path / "run" / "model.toml")
    samples = held.mean * np.array([[0.9, 1.2, 1.0], [1.1, 0.8, 1.0], [1.0, 1.0, 1.1]])
    monkeypatch.setattr(module, "posterior", lambda _: replace(held, samples=samples))
    found = made(tmp_path / "many.toml", posterior={"fit": "run/fit.json", "widen": 1.5}).correlated
    assert found is not None
    assert found.mean == pytest.approx(held.mean)
    assert found.draws is not None
    wide = held.mean + 1.5 * (samples - held.mean)
    assert np.unique(found.draws, axis=0) == pytest.approx(np.unique(wide, axis=0))
    assert np.mean(np.isclose(found.draws[:, 0], wide[0, 0])) == pytest.approx(1.0 / 3.0, abs=0.02)
    tight = tuple(replace(f, high=f.start + 1e-3 * abs(f.start)) for f in held.free)
    monkeypatch.setattr(module, "posterior", lambda _: replace(held, free=tight))
    cut = made(tmp_path / "many.toml", posterior={"fit": "run"}).correlated
    assert cut is not None
    assert cut.draws is not None
    assert (cut.draws <= np.array([f.high for f in tight])).all()


def test_a_file_of_another_kind_is_named() -> None:
    with pytest.raises(RequestError, match=r"many\.toml"):
        campaign_of({"schema": "seatrial-study/1"}, Path("many.toml"))


def test_a_shard_is_as_told_else_that_of_an_array_task(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ID", "COUNT", "MIN"):
        monkeypatch.delenv(f"SLURM_ARRAY_TASK_{name}", raising=False)
    assert shard_of("2/8") == Shard(1, 8)
    assert shard_of(None) == Shard()
    monkeypatch.setenv("SLURM_ARRAY_TASK_ID", "3")
    assert shard_of(None) == Shard()  # a task alone, without an array
    monkeypatch.setenv("SLURM_ARRAY_TASK_COUNT", "5")
    assert shard_of(None) == Shard(3, 5)  # numbered from 0
    monkeypatch.setenv("SLURM_ARRAY_TASK_MIN", "1")
    assert shard_of(None) == Shard(2, 5)
    assert shard_of("1/2") == Shard(0, 2)
    with pytest.raises(CampaignError, match="--shard is '9/8'"):
        shard_of("9/8")


def test_workers_are_threads_or_a_cluster(tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="--threads is 0; give 1 or more"):
        campaign(tmp_path / "none.toml", tmp_path / "out", threads=0)
    with pytest.raises(RequestError, match="--threads and --dask: give one"):
        campaign(tmp_path / "none.toml", tmp_path / "out", threads=1, dask="local:1")
    with pytest.raises(RequestError, match="cannot be read"):
        campaign(tmp_path / "none.toml", tmp_path / "out", threads=1)
    (tmp_path / "bad.toml").write_text("a = [")
    with pytest.raises(RequestError, match=r"bad\.toml: "):
        campaign(tmp_path / "bad.toml", tmp_path / "out")


def test_each_case_has_the_device_that_is_named() -> None:
    two = made(ships=["kvlcc2_l7", "kvlcc2"])
    assert [case.device for case in on_devices(two, ["cpu", "cuda"]).cases] == ["cpu", "cuda"]
    assert [case.device for case in two.cases] == ["cpu", "cpu"]

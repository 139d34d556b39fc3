"""Trials as a fit sees them: even steps, gaps, windows and weights, by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.identify import Loss, Nuisance, StudyError
from seatrial.identify import record as records
from seatrial.identify.noise import between_rows, resolution, sensor_noise
from seatrial.identify.nuisance import Nuisances, with_current
from seatrial.identify.record import (
    Record,
    even,
    every_of,
    measured,
    root_weights,
    scales,
    share,
    spread,
    step_of,
    windows,
)
from seatrial.models import STATES
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")


def sailed(t: Any, name: str = "a", **changes: Any) -> Trial:
    t = np.asarray(t, dtype=float)
    own = {"x": t, "y": 2.0 * t, "psi": 0.1 * t, "u": 1.0 + 0.0 * t, "v_m": 0.01 * t, "r": 0.1 + 0.0 * t,
           "delta": 0.02 * t, "n_P": 10.0 + 0.0 * t}  # fmt: skip
    return Trial(name, t, {**own, **changes})


@pytest.mark.parametrize(("share_", "same"), [(0.019, True), (0.021, False)])
def test_steps_within_two_per_cent_are_even(share_: float, same: bool) -> None:
    t = np.arange(20.0)
    t[7] += share_
    trial = sailed(t)
    assert (even(trial, 1.0) is trial) == same
    out = even(trial, 1.0)
    assert np.abs(np.diff(out.t) - 1.0).max() <= 0.02
    late = sailed(np.arange(20.0) * 1.03)
    assert even(late, 1.0) is not late
    np.testing.assert_allclose(np.diff(even(late, 1.0).t), 1.0)


def test_a_control_goes_on_between_its_readings_and_not_beyond_half_a_step() -> None:
    t = np.array([0.0, 1.0, 2.0, 6.0, 7.0, 8.0])
    out = even(sailed(t), 1.0, SHIP.model)
    steered = out["delta"]
    for row, there in ((0, True), (1, True), (2, True), (3, False), (4, False), (6, True), (7, True), (8, True)):
        assert np.isfinite(steered[row]) == there
        if there:
            assert steered[row] == pytest.approx(0.02 * row)


def test_the_scale_of_errors_is_the_deviation_over_all_trials() -> None:
    t = np.arange(50.0)
    one, two = sailed(t, u=np.sin(t), psi=0.2 * t), sailed(t, "b", u=3.0 + np.cos(t), psi=-0.2 * t)
    found = spread([one, two], ("u", "psi"))
    assert found["u"] == pytest.approx(np.std(np.concatenate([np.sin(t), 3.0 + np.cos(t)])))
    wrapped = one.having(psi=np.angle(np.exp(1j * one["psi"])))
    assert spread([wrapped], ("psi",))["psi"] == pytest.approx(np.std(0.2 * t))
    gap = one.having(u=np.where(t == 3, math.nan, one["u"]))
    assert spread([gap], ("u",))["u"] == pytest.approx(np.std(np.delete(one["u"], 3)))
    with pytest.raises(DataError, match="channel v_m is constant"):
        spread([one.having(v_m=0.0 * t)], ("u", "v_m"))
    assert "phi" not in spread([one], ("u", "phi"))
    heeled = two.having(phi=0.1 * np.sin(t))
    assert spread([one, heeled], ("phi",))["phi"] == pytest.approx(np.std(0.1 * np.sin(t)))


def test_a_loss_names_its_scale() -> None:
    trials = (sailed(np.arange(50.0), u=np.sin(np.arange(50.0)), v_m=np.cos(np.arange(50.0)),
        r=np.sin(np.arange(50.0))),)
    problem: Any = SimpleNamespace(loss=Loss({"u": 0.5}), trials=trials, ship=SHIP)
    assert scales(problem) == {"u": 0.5}
    problem.loss = Loss(scale="spread")
    assert scales(problem) == spread(trials)
    problem.loss = Loss(scale="noise")
    assert scales(problem) != spread(trials)
    problem.loss = Loss(scale="else")
    with pytest.raises(StudyError, match=r"loss\.scale is 'else'"):
        scales(problem)


def test_steps_and_strides() -> None:
    trials = [sailed(np.arange(5) * dt) for dt in (0.1, 0.2, 0.5)]
    assert step_of(trials) == pytest.approx(0.2)
    assert step_of(trials, 0.3) == 0.3
    assert (every_of(None, 0.2), every_of(None, 3.0), every_of(7, 0.2)) == (5, 1, 7)
    assert (share(Loss(correlation=None), 2.0), share(Loss(correlation=10.0), 2.0), share(Loss(correlation=1.0),
        2.0)) == (
        1.0, 0.2, 1.0)
    np.testing.assert_allclose(root_weights({"x": 2.0, "r": 0.5}, 0.25, STATES), [0.25, 0, 0, 0, 0, 1.0])
    loss = Loss(weights={"zig*": 3.0, "z*": 2.0})
    assert (loss.weight("zigzag"), loss.weight("zero"), loss.weight("turn")) == (3.0, 2.0, 1.0)


def test_measured_states_stand_side_by_side_with_the_heading_unwrapped() -> None:
    trial = sailed(np.arange(60.0), psi=np.angle(np.exp(0.2j * np.arange(60.0))))
    state = measured(trial)
    assert state.shape == (60, 6)
    np.testing.assert_allclose(state[:, 2], 0.2 * np.arange(60.0))
    np.testing.assert_allclose(state[:, 1], 2.0 * np.arange(60.0))
    assert np.isnan(measured(trial, (*STATES, "phi", "p"))[:, 6:]).all()
    bare = Trial("b", trial.t, {"x": trial.t})
    with pytest.raises(DataError, match="no channel y, psi, u, v_m, r"):
        measured(bare)


def kept(gaps: Any = ()) -> Record:
    t = np.arange(21.0)
    state = np.column_stack([t + k for k in range(6)])
    state[list(gaps)] = math.nan
    complete = np.flatnonzero(np.isfinite(state).all(axis=1))
    series = np.column_stack([100.0 + t, 200.0 + t])
    return Record(state, series, np.zeros((21, 0)), state, complete, np.ones((21, 1), dtype=np.bool_))


def test_windows_begin_at_complete_rows() -> None:
    assert list(kept().begins(5)) == [0, 5, 10, 15]
    assert list(kept().begins(7)) == [0, 7, 14]
    assert list(kept((0, 5, 6)).begins(5)) == [1, 7, 12, 17]
    assert list(kept((20,)).begins(19)) == [0]
    assert kept((20, 19)).last == 18
    bridged = kept((3, 4)).bridged
    np.testing.assert_allclose(bridged[:, 2], np.arange(21.0) + 2.0)


def test_a_window_holds_what_acts_beyond_the_end_and_weighs_gaps_nothing() -> None:
    scale = np.array([1.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    piece = kept((8,)).window(6, 7, 2, scale)
    assert piece.rows.tolist() == [6, 8, 10, 12]
    assert piece.inside.all()
    assert piece.state0.tolist() == [6.0, 7.0, 8.0, 9.0, 10.0, 11.0]
    np.testing.assert_array_equal(piece.scale[:, 0], [1.0, 0.0, 1.0, 1.0])
    np.testing.assert_array_equal(piece.scale[:, 2], [2.0, 0.0, 2.0, 2.0])
    np.testing.assert_array_equal(piece.measured[:, 0], [6.0, 0.0, 10.0, 12.0])
    assert not piece.measured[:, 1].any(), "what is not compared is zero"
    assert piece.series[:, 0].tolist() == [106.0 + k for k in range(7)]
    joined = kept().window(6, 7, 2, scale, joined=True)
    assert joined.scale[:, 0].tolist() == [0.0, 1.0, 1.0, 1.0]
    late = kept((20,)).window(16, 7, 2, scale)
    assert late.rows.tolist() == [16, 18, 19, 19]
    assert late.inside.tolist() == [True, True, False, False]
    assert late.scale[:, 0].tolist() == [1.0, 1.0, 0.0, 0.0]
    assert late.series[:, 0].tolist() == [116.0, 117.0, 118.0, 119.0, 119.0, 119.0, 119.0]


def test_trials_are_cut_into_lanes_with_their_weights() -> None:
    t = np.arange(31.0)
    trials = (sailed(t), sailed(t, "zigzag"))
    loss = Loss(correlation=10.0, weights={"zig*": 4.0})
    cut = windows(trials, SHIP.model, loss, {"x": 2.0}, window=10.0, dt=1.0, every=2, substeps=3)
    assert cut.trial.tolist() == [0, 0, 0, 1, 1, 1]
    assert cut.state0[:, 0].tolist() == [0.0, 10.0, 20.0] * 2
    assert (cut.dt, cut.steps, cut.every, cut.weight) == (pytest.approx(1.0 / 3.0), 31, 6, pytest.approx(0.2))
    np.testing.assert_allclose(cut.scale[0, :, 0], math.sqrt(0.2) / 2.0)
    np.testing.assert_allclose(cut.scale[3, :, 0], 2.0 * math.sqrt(0.2) / 2.0)
    assert (cut.width, cut.samples, cut.entries) == (6, 36, 36)
    np.testing.assert_allclose(cut.measured[1, :, 0], 10.0 + 2.0 * np.arange(6))
    over = windows(trials[:1], SHIP.model, Loss(), {"x": 2.0}, window=10.0, dt=1.0, every=2, stride=5.0)
    assert over.state0[:, 0].tolist() == [0.0, 5.0, 10.0, 15.0, 20.0, 25.0]
    with pytest.raises(DataError, match="no window of 10 s"):
        windows((sailed(t, x=np.where(t > 0, math.nan, 0.0)),), SHIP.model, Loss(), {"x": 1.0}, window=10.0, dt=1.0,
            every=1)


def test_the_settings_of_an_estimator_cut_as_they_say() -> None:
    settings = SimpleNamespace(window=None, dt=None, every=None, method="rk4", threads=2)
    problem: Any = SimpleNamespace(loss=Loss({"u": 1.0}), trials=(sailed(np.arange(11) * 0.25),
        sailed(np.arange(81) * 0.25)),
                                   ship=SHIP)  # fmt: skip
    sigma, cut = records.cut_as(problem, settings)  # type: ignore[arg-type]
    assert sigma == {"u": 1.0}
    assert cut == {"window": 20.0, "dt": 0.25, "every": 4, "method": "rk4", "threads": 2}


# Noise of sensors and inputs


def test_noise_is_found_whatever_the_motion_and_rounding_is_its_floor() -> None:
    rng, t = np.random.default_rng(3), np.arange(4000) * 0.1
    for level in (0.01, 0.3):
        assert sensor_noise(np.sin(0.1 * t) * 3.0 + level * rng.standard_normal(t.size)) == pytest.approx(level,
            rel=0.06)
    steps = np.round(np.sin(0.01 * t) * 5.0, 1)
    assert resolution(steps) == pytest.approx(0.1)
    assert resolution(rng.standard_normal(100)) == 0.0
    assert resolution(np.ones(10)) == 0.0
    assert sensor_noise(np.repeat(np.arange(40.0), 100)) >= 1.0 / math.sqrt(12.0) - 1e-12
    assert math.isnan(sensor_noise(np.array([1.0, math.nan] * 20)))


def test_an_input_that_bends_between_readings_leaves_its_mean_open() -> None:
    """Moves at a steady rate that begin or end between two rows: by their lines; begun and ended: a uniform time."""
    rows, level = 40, np.array([1e-3])

    def opened(value: Any) -> Any:
        return between_rows(0.5 * (value[1:] + value[:-1])[None, :, None], level)[0, :, 0]

    t = np.arange(rows + 1.0)
    ramp = opened(np.clip(t - 20.5, 0.0, 8.0))
    # begins in the middle of the interval from 20 to 21: lines of slope 0 and 1 cross there, at half of it
    assert np.flatnonzero(ramp).tolist() == [20, 28]
    assert ramp[20] == pytest.approx(0.5 * 0.5 * 0.5 * 1.0)
    step = opened(np.where(t > 20, 1.0, 0.0))
    assert np.flatnonzero(step).tolist() == [20]
    assert step[20] == pytest.approx(1.0 / math.sqrt(12.0))
    assert not opened(1e-3 * np.where(t > 20, 1.0, 0.0)).any()
    assert not opened(0.3 * t).any()
    assert not between_rows(np.ones((1, 5, 1)), level).any()


# Nuisance parameters


def test_nuisances_of_a_trial_are_its_current_and_its_biases() -> None:
    own = Nuisances.of(Nuisance(current=0.2, bias={"r": 0.01, "u": 0.05}, initial={"x": 1.0, "psi": 0.1}))
    assert own.deviation.tolist() == [0.2, 0.2, 0.01, 0.05]
    assert (own.count, own.currents, own.bias.tolist(), own.initial.tolist()) == (4, 2, [5, 3], [0, 2])
    none = Nuisances.of(Nuisance())
    assert (none.count, none.currents) == (0, 0)
    with pytest.raises(StudyError, match="bias names 'w'"):
        Nuisances.of(Nuisance(bias={"w": 1.0}))
    with pytest.raises(StudyError, match="bias of u is 0"):
        Nuisances.of(Nuisance(bias={"u": 0.0}))


def test_an_estimated_current_adds_to_the_logged_one() -> None:
    trial = sailed(np.arange(5.0))
    found = {"a": {"current_x": 0.3, "current_y": -0.4}}
    one = with_current(trial, found)
    np.testing.assert_allclose(one["U_C"], 0.5)
    np.testing.assert_allclose(one["gamma_C"], math.atan2(-0.4, 0.3))
    assert with_current(trial, {"b": found["a"]}) is trial
    angle = np.array([0.0, 0.5, 1.0, 1.5, 2.0])
    logged = trial.having(U_C=0.2 + 0.1 * angle, gamma_C=angle)
    both = with_current(logged, found)
    north = 0.3 + (0.2 + 0.1 * angle) * np.cos(angle)
    east = -0.4 + (0.2 + 0.1 * angle) * np.sin(angle)
    np.testing.assert_allclose(both["U_C"] * np.cos(both["gamma_C"]), north)
    np.testing.assert_allclose(both["U_C"] * np.sin(both["gamma_C"]), east)

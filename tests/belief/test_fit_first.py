"""Current, biases and state from the first seconds of a trial, the model held; the rest is predicted from there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.belief.fit_first import Beginning, between_trials, fit_first
from seatrial.data import DataError, Trial
from seatrial.environment import Uniform
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import approach, simulate
from seatrial.validate.comparison import constant_velocity

SHIP = load("kvlcc2_l7")
NOISE = {"x": 0.01, "y": 0.01, "psi": 0.002, "u": 0.005, "v_m": 0.005, "r": 0.0005}
TRUE = {"current.north": 0.05 * math.cos(1.0), "current.east": 0.05 * math.sin(1.0), "bias.psi": 0.03, "bias.u": 0.02}


def zigzag(seed: int, *, faulty: bool = True) -> Trial:
    around = Uniform(U_C=0.05 * faulty, gamma_C=1.0)
    run = simulate(SHIP, Zigzag(approach(SHIP)[1], 0.35, 0.35), duration=120.0, dt=0.1, every=5, environment=around)
    run = Sensors(NOISE).read(run, np.random.default_rng(seed))
    return run.having(U_C=np.zeros(len(run)), gamma_C=np.zeros(len(run)), psi=run["psi"] + 0.03 * faulty,
                      u=run["u"] + 0.02 * faulty)  # fmt: skip


def far(predicted: Trial, measured: Trial, since: float) -> float:
    """Root mean square distance [m] after a time."""
    rows = measured.t >= since
    off = [np.interp(measured.t, predicted.t, predicted[c]) - measured[c] for c in ("x", "y")]
    return float(np.sqrt(np.mean(np.hypot(*off)[rows] ** 2)))


@pytest.mark.slow
def test_what_is_planted_comes_back_and_the_rest_is_predicted() -> None:
    z = []
    for seed in range(4):
        log = zigzag(seed)
        found = fit_first(SHIP, log, 40.0)
        z += [(found.found[name] - true) / found.sigma[name] for name, true in {"bias.v_m": 0.0, **TRUE}.items()]
        assert found.size == pytest.approx(1.0, abs=0.15)
        assert found.t == 40.0
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.5)
    begun = replay(SHIP, found.trial, begin=(found.t, found.state))
    assert begun.t[0] == 40.0
    assert far(begun, found.trial, 40.0) < 0.05 * far(replay(SHIP, log), log, 40.0)
    steady = constant_velocity(found.trial.rows(log.t >= 40.0), None, found.state)
    assert [steady[name][0] for name in ("x", "u", "psi")] == pytest.approx(found.state[[0, 3, 2]].tolist())


@pytest.mark.slow
def test_a_sound_log_is_hardly_changed_and_a_known_current_is_not_estimated() -> None:
    found = fit_first(SHIP, zigzag(1, faulty=False), 40.0, current=False)
    assert set(found.found) == {"bias.psi", "bias.u", "bias.v_m", "bias.r"}
    assert all(abs(size) < 4.0 * found.sigma[name] for name, size in found.found.items())


@pytest.mark.slow
def test_errors_of_the_model_do_not_pass_for_a_strong_current() -> None:
    """A model that turns a third less: nothing is estimated, and the prediction starts from the readings."""
    model = SHIP.model
    wrong = SHIP.having({"rudder.a_H": 0.3 * float(model.rudder.a_H), "hull.N_r": 1.5 * float(model.hull.N_r)})
    log = zigzag(2, faulty=False)
    found = fit_first(wrong, log, 60.0)
    assert found.size > 1.3
    assert set(found.found.values()) == {0.0}
    row = int(np.searchsorted(log.t, found.t))
    for name, value in zip(("x", "y", "psi", "u", "v_m", "r"), found.state, strict=True):
        assert value == pytest.approx(log[name][row], abs=4.0 * NOISE[name])


@pytest.mark.slow
def test_a_fit_that_found_currents_in_its_trials_lets_one_be_found_by_a_model_that_is_not_perfect() -> None:
    """The current is that of the test above; so is the prior, what trials of such a fit differ by."""
    wrong = SHIP.having({"hull.N_r": 1.1 * float(SHIP.model.hull.N_r)})
    found = {"a": {"current_x": 0.05, "current_y": -0.02}, "b": {"current_x": -0.03, "current_y": 0.04}}
    differing = between_trials({"*": {"offset.delta": 0.01}, **found})
    assert differing == {"current.north": pytest.approx(math.sqrt(0.0017)),
                         "current.east": pytest.approx(math.sqrt(0.001))}  # fmt: skip
    assert between_trials({"a": found["a"]}) == {}
    begun = fit_first(wrong, zigzag(0), 60.0, differing=differing)
    assert begun.size > 1.3
    assert set(begun.found) == set(differing)
    off = math.hypot(begun.found["current.north"] - TRUE["current.north"],
                     begun.found["current.east"] - TRUE["current.east"])  # fmt: skip
    assert off < 0.05
    assert set(fit_first(wrong, zigzag(0), 60.0, differing=differing, current=False).found) == set()


def test_too_few_rows_before_or_after_are_refused() -> None:
    log = zigzag(3)
    with pytest.raises(DataError, match="8 complete rows within 4 s; 10 are needed"):
        fit_first(SHIP, log, 4.0)
    with pytest.raises(DataError, match="lasts 120 s; the first 120 s leave nothing"):
        fit_first(SHIP, log, 120.0)


@pytest.mark.slow
def test_gaps_and_outliers_at_the_start_do_no_harm() -> None:
    log = zigzag(4)
    psi, x = log["psi"].copy(), log["x"].copy()
    psi[:4], x[30], x[80:83] = np.nan, x[30] + 50.0, np.nan
    found = fit_first(SHIP, log.having(psi=psi, x=x), 40.0)
    assert found.t == pytest.approx(42.0)
    assert all(abs(found.found[name] - true) < 4.0 * found.sigma[name] for name, true in TRUE.items())


def begun(t: float = 0.0, **sigma: float) -> Beginning:
    """One that has estimated what has a deviation here."""
    named = {name.replace("_at_", "."): value for name, value in sigma.items()}
    trial = Trial("a", np.arange(5) * 2.5, {"u": np.ones(5)})
    return Beginning(trial, t, np.zeros(6), dict.fromkeys(named, 0.2), named, 1.0)


def test_the_uncertainty_of_a_current_is_that_of_its_components() -> None:
    both = begun(current_at_north=0.03, current_at_east=0.04)
    assert both.current == pytest.approx(np.sqrt((0.03**2 + 0.04**2) / 2))
    assert begun(current_at_north=0.03, bias_at_psi=9.0).current == pytest.approx(0.03)
    assert begun(bias_at_psi=9.0).current == np.inf
    still = Beginning(both.trial, 0.0, both.state, {**both.found, "current.east": 0.0}, both.sigma, 1.0)
    assert still.current == pytest.approx(0.03)  # one that was held at nothing


def test_the_rest_of_a_trial_begins_where_its_first_seconds_end() -> None:
    assert begun(5.0).rest.t.tolist() == [5.0, 7.5, 10.0]
    assert begun(5.0 + 1e-8).rest.t[0] == 5.0
    assert begun(5.1).rest.t[0] == 7.5

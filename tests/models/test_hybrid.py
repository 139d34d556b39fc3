"""The hybrid family: the MMG ship where nothing was fitted, bounded where nothing was measured."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "studies" / "reports"))
from noise_windows import Cut, Predictor

from seatrial.core.parameters import Free, ParameterError, Terms, match, values
from seatrial.data import Trial
from seatrial.engine.rollout import simulator
from seatrial.environment import Environment, Uniform
from seatrial.forces import Flow
from seatrial.identify import Loss, Problem, StudyError
from seatrial.identify.record import windows
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.models.residual import meaning, odd
from seatrial.realtime.plant import Plant
from seatrial.ships import ShipError
from seatrial.ships.files import load, save
from seatrial.simulate.loop import closed_loop, open_loop, open_loop_parameters
from seatrial.simulate.replay import inputs, replay, unseen
from seatrial.simulate.run import campaign, simulate, surge_balance, time_step
from seatrial.validate.requirements.probe import Probe

MMG, BARE = load("esso_osaka_3m"), load("esso_osaka_3m_hybrid")
WEIGHTS = {p: 0.1 * float(np.sin(k)) for k, p in enumerate(values(BARE.model)) if p.startswith("residual_")}
DRAWN = BARE.having(WEIGHTS | {"drift_along": 0.006, "drift_across": -0.002})


def flow(**changes: float) -> Flow:
    return Flow(0.2, 0.03, -0.01, 9.0, 0.3, 1.5, -0.7, 998.0, 3.0, 0.2)._replace(**changes)


def residual(at: Flow, slow_n: float = 8.0) -> np.ndarray:
    return np.array(DRAWN.model.residual(at, slow_n), dtype=float)


def test_unfitted_it_is_the_mmg_ship() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        state, control = rng.normal(size=6) * 0.2, (float(rng.normal() * 8), float(rng.normal() * 0.3))
        around = Environment(*rng.normal(size=4))
        rates = BARE.model.derivative((*state, 1.0, -2.0, 5.0), control, around)
        assert rates[:6] == pytest.approx(MMG.model.derivative(tuple(state), control, around), rel=1e-14, abs=1e-300)
        wind = (around.wind_x + around.current_x - 1.0) / 60.0, (around.wind_y + around.current_y + 2.0) / 60.0
        assert rates[6:] == pytest.approx((*wind, (control[0] - 5.0) / 8.0))


def test_a_term_is_the_product_of_its_factors_over_their_typical_sizes() -> None:
    scale = BARE.model.scale
    sway = Terms(("d_n_N", "b_w"), (1.0, -1.0))
    force = scale.force(scale.factors(flow(), 8.0), Terms(("u_U",), (2.0,)), sway, Terms(("m",), (3.0,)))
    assert pytest.approx(scale.X_0 * 2.0 * (0.2 / 0.3) ** 2) == force.X
    a, b = 1.5 / 2.0, -0.7 / 2.0
    assert pytest.approx(scale.Y_0 * (0.3 / 0.5 * 0.9 * 0.9 - b * np.hypot(a, b)), rel=1e-5) == force.Y
    assert pytest.approx(scale.N_0 * 3.0 * 0.8) == force.N


@pytest.mark.parametrize(("name", "told"), [
    ("q_u", "no factor 'q'"), ("uu", "no factor 'uu'"), ("W", "no factor 'W'"), ("", "no factor ''"),
    ("u_u_u_u_u_u", "5 at most"), ("d_D", "rudder at rest"),
])  # fmt: skip
def test_names_that_cannot_be_terms(name: str, told: str) -> None:
    with pytest.raises(ParameterError, match=told):
        meaning(name)


def test_what_changes_sides_in_the_mirror() -> None:
    assert all(odd(name) for name in ("v", "u_v", "d_n_N", "v_V", "b_w", "a_b", "r_R"))
    assert not any(odd(name) for name in ("u_U", "v_r", "V", "n_N", "d_d_n_n", "m_M"))
    assert "residual_N.n_N" in BARE.model.asymmetries
    assert "residual_N.d_n_N" not in BARE.model.asymmetries


def test_beyond_the_data_the_residual_stays_what_it_was_at_their_edge() -> None:
    edge = flow(u=0.6, v_m=-0.22, r=0.1, n_P=20.0, delta=0.625, u_A=8.0, v_A=-8.0)
    beyond = flow(u=60.0, v_m=-22.0, r=10.0, n_P=200.0, delta=1.5, u_A=80.0, v_A=-80.0)
    assert residual(beyond, 500.0) == pytest.approx(residual(edge, 20.0), rel=1e-12)
    assert np.abs(residual(edge)).max() > 1.0


@pytest.mark.slow
def test_memory_is_the_model_s_own_lag_of_the_log_before() -> None:
    """`recall` gives at each row what the equation of the states has made of them, held inputs from row to row."""
    rng = np.random.default_rng(1)
    series = np.zeros((200, 10))
    series[:, :4] = rng.normal(size=(200, 4))
    found = unseen(BARE.model, series, 0.1)
    slow = np.array([series[0, 2], series[0, 3], series[0, 0]])
    for k, row in enumerate(series):
        assert found[k] == pytest.approx(slow, abs=1e-7)
        many, step = 10, 0.01
        for _ in range(many):  # the middle of each short step
            rates = BARE.model.derivative((*[0.0] * 6, *slow), tuple(row[:2]), Environment(*row[2:]))
            middle = slow + 0.5 * step * np.array(rates[6:], dtype=float)
            rates = BARE.model.derivative((*[0.0] * 6, *middle), tuple(row[:2]), Environment(*row[2:]))
            slow = slow + step * np.array(rates[6:], dtype=float)
    settled = np.tile(series[:1], (50, 1))
    assert unseen(BARE.model, settled, 0.1) == pytest.approx(np.tile(series[0, [2, 3, 0]], (50, 1)))


def turning() -> Trial:
    return simulate(DRAWN, Turning(delta=0.4, n_P=9.0), speed=0.3, duration=400.0, dt=0.1, method="euler",
                    environment=Uniform(U_T=2.0, gamma_T=1.0))  # fmt: skip


@pytest.mark.slow
def test_a_restarted_prediction_remembers_what_came_before_it() -> None:
    """The wind of the minutes before the restart has set the water moving: the prediction knows."""
    trial = turning()
    predicted = replay(DRAWN, trial, restart=100.0, method="euler")
    later = trial.t >= 300.0
    for name in STATES:
        assert predicted[name][later] == pytest.approx(trial[name][later], abs=2e-3 * np.ptp(trial[name])), name
    forgetful = replay(DRAWN.having({"drift_along": 0.0, "drift_across": 0.0}), trial, restart=100.0, method="euler")
    assert np.abs(forgetful["x"] - trial["x"])[later].max() > 10 * np.abs(predicted["x"] - trial["x"])[later].max()


def test_a_simulation_starts_settled_to_what_it_begins_with() -> None:
    wind, policy = Uniform(U_T=2.0, gamma_T=1.0), Turning(delta=0.4, n_P=9.0)
    lanes = campaign(DRAWN, policy, {"policy.delta": np.array([0.1, 0.3])}, speed=0.3, duration=1.0, dt=0.1,
                     environment=wind)  # fmt: skip
    columns = closed_loop(DRAWN, policy, 0.1).stored
    first = lanes.values[:, 0, [columns.index(name) for name in DRAWN.model.states[6:]]]
    assert first == pytest.approx(np.tile((2.0 * np.cos(1.0), 2.0 * np.sin(1.0), 9.0), (2, 1)))


def test_a_ship_to_be_steered_starts_settled() -> None:
    wind = Uniform(U_T=2.0, gamma_T=1.0)
    plant = Plant.of(DRAWN, dt=0.1, environment=wind, start=(0.0, 0.0, 0.0, 0.3, 0.0, 0.0), n_P=9.0)
    begun = (2.0 * np.cos(1.0), 2.0 * np.sin(1.0), 9.0)
    assert [plant[name] for name in DRAWN.model.states[6:]] == pytest.approx(begun)
    plant.step()
    plant.reset()
    assert [plant[name] for name in DRAWN.model.states[6:]] == pytest.approx(begun)


def test_the_balance_of_a_straight_run_is_that_of_water_that_knows_the_shaft() -> None:
    control, u = (9.0, 0.0), 0.3
    known = DRAWN.model.derivative((0.0, 0.0, 0.0, u, 0.0, 0.0, 0.0, 0.0, 9.0), control, Environment())[3]
    assert surge_balance(DRAWN, u, 9.0) == pytest.approx(float(known), rel=1e-12)


@pytest.mark.slow
def test_an_examination_settles_the_ship_to_what_acts() -> None:
    around, control = Environment(wind_x=2.0, wind_y=-1.0), (9.0, 0.1)
    probe = Probe(DRAWN, 0.3, 9.0)
    known = DRAWN.model.derivative((0.0, 0.0, 0.0, 0.3, 0.05, 0.01, 2.0, -1.0, 9.0), control, around)[3:6]
    assert probe.rates(0.3, 0.05, 0.01, control, around) == pytest.approx(np.array(known, dtype=float))
    t, runs = probe.drift([probe.state(u=0.3)], [control], 20.0, around)
    held, alone = np.array([[*control, *around]]), simulator(open_loop(DRAWN))
    for dt, within in ((float(t[1]), None), (time_step(DRAWN), 1e-3)):  # its own step, and one that a log would have
        every = max(round(float(t[1]) / dt), 1)
        again = alone.run(
            np.array([[0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 2.0, -1.0, 9.0]]), held[None], open_loop_parameters(DRAWN),
            dt=float(t[1]) / every, steps=every * (len(t) - 1) + 1, every=every,
        )  # fmt: skip
        assert runs[0] == pytest.approx(again.values[0, :, :6], rel=within, abs=within)


def test_windows_under_disturbances_remember_the_log_before_them() -> None:
    trial = turning()
    cut = Cut.of({"turn": [trial]}, DRAWN, dict.fromkeys(STATES, 1.0), 100.0)
    known = unseen(DRAWN.model, inputs(trial, DRAWN.model), trial.dt)
    assert cut.hidden[:, 0] == pytest.approx(known[cut.row])
    assert cut.lanes(cut.row > 0).hidden.shape[0] == len(cut.row) - 1
    predictor = Predictor.of([DRAWN])[0]
    blank = replace(cut, hidden=np.zeros_like(cut.hidden))
    later = cut.row > 0
    ours, without = (np.abs(predictor.errors(some)[later]).max() for some in (cut, blank))
    assert without > 10 * ours


def test_a_saved_hybrid_reads_back(tmp_path) -> None:
    again = load(save(DRAWN, tmp_path / "model.toml"))
    assert values(again.model) == values(DRAWN.model)
    assert again.model.states == DRAWN.model.states
    assert again.of == "esso_osaka_3m"


def test_a_ship_file_with_a_term_that_cannot_be_is_refused_in_one_line(tmp_path) -> None:
    path = tmp_path / "ship.toml"
    text = save(BARE, tmp_path / "model.toml").read_text().replace("[residual_X]\nu = ", "[residual_X]\nu_k = ")
    path.write_text(text)
    with pytest.raises(ShipError, match="residual_X: no factor 'k' in 'u_k'") as told:
        load(path)
    assert "\n" not in str(told.value)


@pytest.mark.long
def test_a_thousand_random_runs_stay_bounded_and_rest_stays_rest() -> None:
    """300 s of random orders and gales from random states: with weights of no meaning, physics still decides."""
    rng, lanes, steps = np.random.default_rng(2), 1000, 3001

    def drawn(low: float, high: float, hold: int) -> np.ndarray:
        return np.repeat(rng.uniform(low, high, (lanes, -(-steps // hold))), hold, axis=1)[:, :steps]

    series = np.zeros((lanes, steps, 10))
    series[:, :, 0], series[:, :, 1] = drawn(-20.0, 20.0, 100), drawn(-0.61, 0.61, 70)
    speed, angle = drawn(0.0, 8.0, 300), drawn(-np.pi, np.pi, 300)
    series[:, :, 2], series[:, :, 3] = speed * np.cos(angle), speed * np.sin(angle)
    state = np.zeros((lanes, 9))
    state[:, 2:6] = rng.uniform(-1.0, 1.0, (lanes, 4)) * (3.0, 0.8, 0.4, 0.3)
    run, p = simulator(open_loop(DRAWN)), open_loop_parameters(DRAWN)
    moved = run.run(state, series, p, dt=0.1, steps=steps, method="euler", every=10)
    assert not moved.failures
    assert (np.abs(moved.values[:, :, 3:6]).max(axis=(0, 1)) < (2.0, 1.5, 1.0)).all()
    rest = run.run(np.zeros((1, 9)), np.zeros((1, 1, 10)), p, dt=0.1, steps=steps)
    assert np.abs(rest.values).max() <= 1e-9


def test_windows_may_overlap_and_trials_may_count_more() -> None:
    trial, sigma = turning(), dict.fromkeys(STATES, 1.0)
    heavy = Loss(weights={"nothing*": 9.0, "*": 4.0})
    plain = windows((trial,), BARE.model, Loss(), sigma, window=100.0, dt=0.1, every=10)
    half = windows((trial,), BARE.model, heavy, sigma, window=100.0, dt=0.1, every=10, stride=50.0)
    assert (plain.state0.shape[0], half.state0.shape[0]) == (4, 8)
    assert half.state0[::2] == pytest.approx(plain.state0)
    assert half.scale.max() == pytest.approx(2.0 * plain.scale.max())
    assert plain.state0[2, 6:] == pytest.approx(unseen(BARE.model, inputs(trial, BARE.model), 0.1)[2000])


def test_every_weight_answers_to_its_name() -> None:
    assert len(match(BARE.model, "residual_*")) == len(WEIGHTS) == 110
    assert replace(BARE.model, residual_X=Terms()).residual_X.items() == ()


@pytest.mark.long
def test_later_parameters_join_a_fit_of_the_others() -> None:
    """The search of all of them starts where the others fit best alone, and ends no worse than there."""
    trial = turning()
    free = (Free("hull.Y_v", BARE.model.hull.Y_v, prior=BARE.model.hull.Y_v, sigma=0.1),
            Free("residual_Y.u_v", 0.0, prior=0.0, sigma=1.0))  # fmt: skip
    problem = Problem(BARE, (trial,), free, Loss(dict.fromkeys(STATES, 0.1)))
    alone = Trajectory(window=50.0, threads=1).fit(replace(problem, free=free[:1]))
    both = Trajectory(window=50.0, threads=1, later=("residual_*",)).fit(problem)
    assert both.objective <= alone.objective
    assert both.free == free
    assert both.digest != Trajectory(window=50.0, threads=1).fit(problem).digest


@pytest.mark.slow
def test_later_takes_a_list_of_patterns_that_fit() -> None:
    free = (Free("hull.Y_v", BARE.model.hull.Y_v, prior=BARE.model.hull.Y_v, sigma=0.1),)
    with pytest.raises(StudyError, match="later fits no free parameter"):
        Trajectory(later=("rudder.*",)).fit(Problem(BARE, (turning(),), free))
    with pytest.raises(StudyError, match="write a list"):
        Trajectory(later="residual_*")  # type: ignore[arg-type]

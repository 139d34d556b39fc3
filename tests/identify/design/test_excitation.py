"""Excitation design: what Fisher promises is what repeated fits give, and a designed set beats plain turns."""

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.actuators import Actuator, Actuators
from seatrial.cli import judging as cli_design
from seatrial.core.parameters import Free, ParameterError, read, values
from seatrial.data import Trial
from seatrial.identify import Loss, Nuisance, Problem, StudyError
from seatrial.identify.design.excitation import (
    TABLE_1,
    Candidate,
    Information,
    choose,
    dimensionless_length,
    expected,
    informations,
    plan,
    usual,
    usual_noise,
    wanted,
)
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres import Settings
from seatrial.manoeuvres.pseudo_random import PseudoRandom
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate
from seatrial.workflow import RequestError
from seatrial.workflow.asked import Draws

TEN = math.radians(10.0)
NOISE = {"x": 2.0, "y": 2.0, "psi": math.radians(0.5), "u": 0.05, "v_m": 0.05, "r": math.radians(0.02)}


@pytest.fixture(scope="module")
def mariner():
    """With a rate of its rudder, so that a replay of recorded angles is exact."""
    gear = Actuator(low=-0.7, high=0.7, rate=math.radians(5.0))
    return replace(load("mariner_nomoto"), actuators=Actuators({"rudder": gear}))


@pytest.fixture(scope="module")
def l7():
    return load("kvlcc2_l7")


@pytest.mark.long
def test_predicted_deviations_are_the_scatter_of_repeated_fits(mariner):
    """Sixty fits to one noisy zigzag: the sample deviation of sixty is known to 9 % (one sigma)."""
    free = tuple(Free(p, float(read(mariner.model, p)), prior=math.nan) for p in ("K", "T"))
    clean = simulate(mariner, Zigzag(0.0, TEN, TEN), duration=400.0, dt=1.0)
    (told,) = informations(mariner, free, [(clean, mariner.speed)], NOISE, interval=5.0, window=200.0)
    promised = np.sqrt(np.diag(np.linalg.inv(told.matrix)))
    found = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        trial = clean.having(**{n: clean[n] + s * rng.standard_normal(len(clean)) for n, s in NOISE.items()})
        # The start is estimated freely: a wide deviation lets its own readings decide, as theory has it.
        problem = Problem(mariner, (trial,), free, Loss(NOISE, correlation=0.0),
                          Nuisance(initial={n: 100 * s for n, s in NOISE.items()}))  # fmt: skip
        found.append(Trajectory(window=200.0, every=5, method="rk4", tolerance=1e-9, threads=1).fit(problem).values)
    scatter, mean = np.std(found, axis=0, ddof=1), np.mean(found, axis=0)
    assert scatter == pytest.approx(promised, rel=0.25)
    assert np.all(np.abs(mean - [f.start for f in free]) < 3 * promised / math.sqrt(60))


def test_information_is_that_of_finite_differences(mariner):
    """J is the derivative of the run, less what the unknown first yaw rate does; the speed is read exactly."""
    free = wanted(mariner, ["K", "T"])
    run = simulate(mariner, Turning(0.0, 0.3), duration=200.0, dt=0.5)
    (told,) = informations(mariner, free, [(run, mariner.speed)], {"r": 1e-3, "u": 1e-7}, interval=5.0, window=200.0)
    columns = []
    for f in free:
        h = 1e-4 * f.start
        up, down = (simulate(mariner.having({f.path: f.start + s * h}), Turning(0.0, 0.3), duration=200.0, dt=0.5)
                    for s in (1, -1))  # fmt: skip
        columns.append((up["r"] - down["r"])[::10] / (2 * h) / 1e-3)
    J = np.column_stack(columns)
    start = np.exp(-run.t[::10] / mariner.model.T) / 1e-3  # what the unknown first yaw rate does
    J = J - np.outer(start, start @ J) / (start @ start)
    assert told.matrix == pytest.approx(J.T @ J, rel=1e-3)


@pytest.mark.long
def test_a_designed_set_beats_turns_of_the_same_length(l7):
    free = wanted(l7, ["hull.Y_v", "hull.Y_r", "hull.N_v", "hull.N_r", "hull.N_vvr", "rudder.t_R", "rudder.a_H"])
    every = usual(l7, seeds=1)
    designed = plan(l7, free, every, 60.0)
    turns = plan(l7, free, [one for one in every if one.name.startswith("turning")], 60.0)
    assert designed.length <= 60.0 + 1e-6
    assert turns.length == pytest.approx(60.0, abs=0.1)  # five turns: all of the budget
    assert designed.length <= turns.length + 0.1
    assert designed.log_det > turns.log_det
    ratio = designed.sigma / turns.sigma
    assert np.exp(np.mean(np.log(ratio))) < 0.8
    assert np.sum(ratio < 1) >= 6  # of seven: the determinant counts, not each parameter
    assert ratio.max() < 1.3


def test_greedy_takes_the_best_first_and_keeps_to_the_budget():
    eye = np.eye(2)
    found = [
        Information("a", np.diag([9.0, 0.0]), 10.0), Information("b", np.diag([0.0, 9.0]), 10.0),
        Information("both", 8.0 * eye, 10.0), Information("long", 100.0 * eye, 40.0),
    ]  # fmt: skip
    assert choose(found, np.ones(2), 10.0)[0] == (2,)
    order, reached = choose(found, np.ones(2), 30.0)
    assert set(order) == {0, 1, 2}
    assert reached[-1] == pytest.approx(2 * math.log(18.0))
    assert choose(found, np.ones(2), 40.0)[0] == (3,)  # one long run beats three short ones
    assert choose(found, np.ones(2), 20.0, repeats=2)[0] == (2, 2)


def test_what_to_expect_of_a_set_is_the_posterior():
    free = (Free("K", 1.0, prior=1.0, sigma=2.0), Free("T", 5.0, prior=5.0, sigma=1.0))
    matrix = np.array([[3.0, 1.0], [1.0, 2.0]])
    found = expected(free, [Information("a", matrix, 4.0), Information("b", matrix, 5.0)])
    covariance = np.linalg.inv(2 * matrix + np.diag([0.25, 1.0]))
    assert found.sigma == pytest.approx(np.sqrt(np.diag(covariance)))
    assert found.share == pytest.approx(1 - np.diag(covariance) / [4.0, 1.0])
    assert found.length == 9.0
    assert found.log_det == pytest.approx(math.log(4.0 / np.linalg.det(covariance)))
    assert sum(gain for _, _, gain in found.chosen) == pytest.approx(found.log_det)


def test_what_stays_open_is_named_with_its_combination(mariner):
    """A steady turn fixes r = K delta and nothing of T; a rudder never moved fixes nothing at all."""
    free = (Free("K", 0.185, prior=0.185, sigma=0.1), Free("T", 107.3, prior=107.3, sigma=50.0))
    steady = Information("steady", np.diag([1e6, 0.0]), 10.0)
    status = {v.subject: v.status for v in expected(free, [steady]).verdicts}
    assert status == {"K": "identified", "T": "not identified"}
    ratio = np.array([1 / 0.185, -1 / 107.3])  # only K/T shows
    found = expected(free, [Information("short", 1e4 * np.outer(ratio, ratio), 10.0)])
    last = found.verdicts[-1]
    assert set(last.subject.split(" and ")) == {"K", "T"}
    assert "rises" in last.text
    assert "falls" not in last.text  # both rise together: their ratio stays


def test_length_is_that_of_sawada_and_so_is_the_table():
    """Abkowitz: a zigzag of a 325 m ship at 7 knots, T' = 17.7 (Sawada 2024 section 5)."""
    T = 17.7 * 325.0 / (7 * 1852 / 3600)
    trial = Trial("z", np.linspace(0.0, T, 100), {})
    assert dimensionless_length([trial], 7 * 1852 / 3600, 325.0) == pytest.approx(17.7)
    assert dimensionless_length([trial, trial], 7 * 1852 / 3600, 325.0) == pytest.approx(35.4)
    assert [(p.reference, p.parameters, p.length) for p in TABLE_1] == [
        (104, (2,), (14.0, 14.0)), (69, (15,), (17.7, 17.7)), (105, (21, 30), (8.8, 50.8)),
        (106, (7, 18), (25.9, 25.9)), (73, (57,), (258.0, 269.5)), (65, (122600,), (256.3, 256.3)),
    ]  # fmt: skip
    with pytest.raises(StudyError, match="above zero"):
        dimensionless_length([trial], 0.0, 325.0)


def test_wanted_takes_patterns_and_free_parameters(l7):
    own = Free("rudder.t_R", 0.4, 0.1, 0.9)
    found = wanted(l7, ["hull.N_*", own])
    assert found[-1] is own
    assert {f.path for f in found[:-1]} == {f"hull.N_{term}" for term in ("v", "r", "vvv", "vvr", "vrr", "rrr")}
    assert all(f.sigma == abs(f.start) for f in found[:-1])
    zero = l7.having({"hull.N_rrr": 0.0})
    assert wanted(zero, ["hull.N_rrr"])[0].sigma > 0
    with pytest.raises(ParameterError, match="near"):
        wanted(l7, ["hull.N_vvw"])


def test_a_candidate_that_cannot_be_run_is_left_out_with_its_reason(mariner):
    narrow = replace(mariner, validity={"r": (-0.01, 0.01)})
    U, _ = approach(mariner)
    hard = Candidate("hard over", Turning(0.0, 0.6), 200.0, U)
    soft = Candidate("soft", Turning(0.0, 0.02), 200.0, U)
    found = plan(narrow, wanted(narrow, ["K"]), [hard, soft], 20.0)
    assert [name for name, _, _ in found.chosen] == ["soft"]
    assert found.left_out[0].startswith("hard over: mariner_nomoto: r = ")
    with pytest.raises(StudyError, match="no candidate can be run"):
        plan(narrow, wanted(narrow, ["K"]), [hard], 20.0)


def test_requests_that_cannot_be_are_refused(mariner):
    U, _ = approach(mariner)
    some = [Candidate("t", Turning(0.0, 0.3), 200.0, U)]
    with pytest.raises(StudyError, match="less than the shortest"):
        plan(mariner, wanted(mariner, ["K"]), some, 1.0)
    with pytest.raises(StudyError, match="no free parameter"):
        plan(mariner, (), some, 50.0)
    with pytest.raises(StudyError, match="noise"):
        plan(mariner, wanted(mariner, ["K"]), some, 50.0, noise={"z": 1.0})


def test_usual_candidates_keep_to_the_rudder_and_name_their_lengths(l7):
    every = usual(l7)
    assert len({one.name for one in every}) == len(every)
    for one in every:
        assert 10 < one.duration * one.speed / l7.L_pp < 30
        assert abs(getattr(one.policy, "delta", 0.0)) <= float(l7.actuators.rudder.high) + 1e-12
    assert set(usual_noise(l7)) == {"x", "y", "psi", "u", "v_m", "r"}
    assert PseudoRandom.ordered(Settings(10.0, 1.0, 7.0, 0.2)).delta == 0.2


@pytest.mark.slow
def test_the_command_prints_a_plan_and_refuses_bad_words(capsys):
    cli_design.design("mariner_nomoto", ["K", "T"], bands=Draws(), budget=30.0)
    out = capsys.readouterr()
    assert "together" in out.out
    assert "[104]" in out.out
    assert "good sensors are assumed" in out.err
    cli_design.design("mariner_nomoto", ["*"], bands=Draws(), budget=30.0, noise="psi=0.2,r=0.01", json=True)
    import json

    document = json.loads(capsys.readouterr().out)
    assert document["length"] <= 30.0
    assert document["noise"]["psi"] == pytest.approx(math.radians(0.2))
    assert set(document["parameters"]) == set(values(load("mariner_nomoto").model))
    with pytest.raises(RequestError, match="no channel 'z'"):
        cli_design.design("mariner_nomoto", ["K"], bands=Draws(), noise="z=1")
    with pytest.raises(RequestError, match="above zero"):
        cli_design.design("mariner_nomoto", ["K"], bands=Draws(), budget=-1.0)
    with pytest.raises(RequestError, match="no deviation"):
        cli_design.design("mariner_nomoto", ["K"], bands=Draws(), noise="psi=a")

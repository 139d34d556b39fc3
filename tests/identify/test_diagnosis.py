"""Tests of a finished fit: clean logs pass, and each planted error of an instrument is named with its size."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from seatrial.core.parameters import Free, values
from seatrial.data import Array, Trial
from seatrial.environment import Uniform
from seatrial.identify import Estimator, Fit, Loss, Nuisance, Problem, StudyError
from seatrial.identify.diagnosis.linear import linearised
from seatrial.identify.diagnosis.stages import started
from seatrial.identify.population.evolution import Evolution
from seatrial.identify.shooting.logo import Shooting
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.identify.tuning.fine_tuning import FineTuning
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

pytestmark = pytest.mark.slow

Channels = dict[str, Array]
PATHS = ("hull.Y_v", "hull.N_v", "hull.N_r", "hull.R_0")
SENSORS = {"x": 0.5, "y": 0.5, "psi": math.radians(0.1), "u": 0.05, "v_m": 0.05, "r": math.radians(0.5 / 60.0)}
DEG = math.radians(1.0)
TRUTH = dict(zip(PATHS, (1.1, 0.9, 1.08, 0.95), strict=True))
RUNS: dict[tuple[bool, float], list[Trial]] = {}


def _logs(
    plant: Callable[[Channels], None] | None = None, current: bool = False, seed: int = 0, wind: float = 0.0
) -> tuple[Trial, ...]:
    """Trials of a tanker logged at 1 Hz by ordinary sensors, its coefficients up to 10 % off the file's."""
    tanker, n_P = load("kvlcc2"), 1.7
    if (current, wind) not in RUNS:
        known = values(tanker.model)
        true = tanker.having({path: factor * known[path] for path, factor in TRUTH.items()})
        around = Uniform(U_T=wind, gamma_T=2.0, U_C=0.5 * current, gamma_C=1.0) if current or wind else None
        RUNS[current, wind] = [
            simulate(true, policy, duration=600.0, dt=0.1, every=10, name=name, environment=around)
            for name, policy in (("zigzag", Zigzag(n_P, 20.0 * DEG, 20.0 * DEG)), ("turn", Turning(n_P, 35.0 * DEG)),
                                 ("port", Turning(n_P, -35.0 * DEG)))
        ]  # fmt: skip
    rng, out = np.random.default_rng(seed), list[Trial]()
    for run in RUNS[current, wind]:
        channels = {name: run[name].copy() for name in (*SENSORS, "delta", "n_P")}
        for name, level in SENSORS.items():
            channels[name] += rng.normal(0.0, level, len(run))
        if plant:
            plant(channels)
        out.append(Trial(run.name, run.t, channels, meta={"L_pp": tanker.L_pp}))
    return tuple(out)


def _problem(trials: tuple[Trial, ...], nuisance: Nuisance | None = None) -> Problem:
    tanker = load("kvlcc2")
    known = values(tanker.model)
    return Problem(tanker, trials, tuple(Free(path, known[path]) for path in PATHS), nuisance=nuisance or Nuisance())


def _z(fit: Fit) -> Array:
    known = values(load("kvlcc2").model)
    return (fit.values - np.array([TRUTH[path] * known[path] for path in PATHS])) / fit.sigma


def _shifted(name: str, by: float) -> Callable[[Channels], None]:
    def plant(channels: Channels) -> None:
        channels[name] += by

    return plant


def _scaled(name: str, by: float) -> Callable[[Channels], None]:
    def plant(channels: Channels) -> None:
        channels[name] *= by

    return plant


def _aft(channels: Channels) -> None:
    channels["x"] -= 100.0 * np.cos(channels["psi"])
    channels["y"] -= 100.0 * np.sin(channels["psi"])


def _spike(channels: Channels) -> None:
    channels["psi"][200] += 0.8


@pytest.fixture(scope="module")
def clean() -> Fit:
    return Trajectory().fit(_problem(_logs()))


def test_a_clean_log_passes(clean: Fit) -> None:
    assert clean.diagnosis is not None
    assert not clean.diagnosis.lacking
    assert clean.diagnosis.lines[0] == "the residuals look like sensor noise"
    assert "takes the fixed numbers as right" in clean.diagnosis.lines[1]
    assert {verdict.status for verdict in clean.verdicts if verdict.subject in PATHS} == {"identified"}
    assert np.abs(_z(clean)).max() < 3.5
    assert all(channel.size == pytest.approx(1.0, abs=0.15) for channel in clean.diagnosis.channels.values())


PLANTED = [
    pytest.param("offset.delta", _shifted("delta", 1.5 * DEG), 1.5, 0.15, id="offset.delta"),
    pytest.param("bias.psi", _shifted("psi", 3.0 * DEG), 3.0, 0.6, id="bias.psi", marks=pytest.mark.long),
    pytest.param("bias.r", _shifted("r", 0.05 * DEG), 0.05, 0.005, id="bias.r", marks=pytest.mark.long),
    pytest.param("scale.n_P", _scaled("n_P", 1.03), 3.0, 0.6, id="scale.n_P", marks=pytest.mark.long),
    pytest.param("scale.u", _scaled("u", 1.03), 3.0, 0.3, id="scale.u", marks=pytest.mark.long),
    pytest.param("antenna.ahead", _aft, -100.0, 10.0, id="antenna.ahead"),
]


@pytest.mark.parametrize(("name", "plant", "size", "within"), PLANTED)
def test_a_planted_error_is_named_first_and_nothing_is_identified(
    name: str, plant: Callable[[Channels], None], size: float, within: float
) -> None:
    fit = Trajectory().fit(_problem(_logs(plant)))
    assert fit.diagnosis is not None
    assert fit.diagnosis.lacking
    first = fit.diagnosis.causes[0]
    assert first.name == name
    assert float(first.value.split()[0]) == pytest.approx(size, abs=within)
    assert "identified" not in {verdict.status for verdict in fit.verdicts}
    assert first.words in " ".join(fit.diagnosis.lines)
    assert all(factor >= 1.0 for factor in fit.diagnosis.widened.values())


def test_the_slopes_of_a_fit_are_those_of_its_objective_with_the_starts_at_their_best() -> None:
    """What the prior of a start asks is a part: without it a fit at its optimum would seem to be on a slope."""
    problem = _problem(_logs(), Nuisance(initial=SENSORS))
    objective = TrajectoryObjective.like(problem, Trajectory())
    p = problem.vector.start
    linear = linearised(objective, p, objective.begun(p), (), {}, problem)
    wanted, tiny = np.zeros(len(p)), 1e-4 * np.abs(p)
    for k, by in enumerate(tiny):
        ends = p + np.outer([1.0, -1.0], by * np.eye(len(p))[k])
        there, back = (float(objective.settled(end[None])[0].cost[0]) for end in ends)
        wanted[k] = (there - back) / (4.0 * by)  # of half the objective
    assert linear.slope.sum(axis=0) == pytest.approx(wanted, rel=0.02)


def _wandering(seed: int) -> Callable[[Channels], None]:
    """Fixes that wander by 3 m within two minutes, three times as far as they scatter."""
    rng = np.random.default_rng(100 + seed)

    def plant(channels: Channels) -> None:
        for name in ("x", "y"):
            drawn, now = rng.standard_normal(len(channels[name])), 0.0
            keep = math.exp(-1.0 / 120.0)
            for k, one in enumerate(drawn):
                now = keep * now + math.sqrt(1.0 - keep * keep) * one if k else one
                channels[name][k] += 3.0 * now

    return plant


def test_fixes_that_wander_leave_the_ranges_of_a_fit_right() -> None:
    found: list[float] = []
    for seed in range(6):
        fit = Trajectory().fit(_problem(_logs(_wandering(seed), seed=seed)))
        found += _z(fit).tolist()
        assert fit.diagnosis is not None
        assert fit.diagnosis.channels["x"].lasting > 5.0 * fit.diagnosis.channels["r"].lasting
    assert np.sqrt(np.mean(np.square(found))) < 1.4
    assert np.mean(np.abs(found) < 1.96) >= 0.85


def test_a_stated_error_model_is_no_more_certain_than_what_is_wrong_allows() -> None:
    """Trials disagree by a rudder 1.5 deg off, and a suspect moves the numbers: both count beside a stated time."""
    problem = _problem(_logs(_shifted("delta", 1.5 * DEG)))
    fit = Trajectory().fit(replace(problem, loss=replace(problem.loss, correlation=10.0)))
    assert fit.diagnosis is not None
    wider = np.array([fit.diagnosis.widened[path] for path in PATHS])
    assert wider.min() >= 1.0
    assert wider.max() > 2.0
    assert 0.3 < fit.diagnosis.form < 1.0
    assert np.abs(_z(fit)).max() < 1.96
    assert {one.status for one in fit.verdicts if one.subject in PATHS} <= {"graded", "weak", "not identified"}
    clean = Trajectory().fit(replace(_problem(_logs()), loss=replace(problem.loss, correlation=10.0)))
    assert clean.diagnosis is not None
    assert set(clean.diagnosis.widened.values()) == {1.0}
    assert clean.diagnosis.form == 0.0


def test_suspects_that_matter_are_estimated_on_request_and_the_truth_comes_back() -> None:
    drifting = _logs(current=True)
    fit = Trajectory().fit(_problem(drifting, Nuisance(suspects="auto")))
    assert fit.diagnosis is not None
    assert not fit.diagnosis.lacking
    found = fit.nuisances["*"]
    assert set(found) == {"current.north", "current.east"}
    assert found["current.north"] == pytest.approx(0.5 * math.cos(1.0), abs=0.02)
    assert found["current.east"] == pytest.approx(0.5 * math.sin(1.0), abs=0.02)
    assert np.abs(_z(fit)).max() < 3.5
    assert all(error.sigma < 0.05 for error in fit.diagnosis.errors)


def test_a_named_error_is_estimated_with_its_prior() -> None:
    trials = _logs(_shifted("delta", 1.5 * DEG))
    fit = Trajectory().fit(_problem(trials, Nuisance(common={"offset.delta": math.radians(5.0)})))
    assert fit.nuisances["*"]["offset.delta"] == pytest.approx(1.5 * DEG, rel=0.05)
    assert np.abs(_z(fit)).max() < 3.5
    held = Trajectory().fit(_problem(trials, Nuisance(common={"offset.delta": 1e-6})))
    assert abs(held.nuisances["*"]["offset.delta"]) < 0.1 * DEG


def test_a_fit_that_goes_on_begins_with_the_errors_that_the_last_one_found() -> None:
    """From parameters of a fit with a rudder offset, without it: the fit would begin anew, or blow up."""
    trials = _logs(_shifted("delta", 3.0 * DEG))
    posed = _problem(trials, Nuisance(common={"offset.delta": math.inf}))
    fit = Trajectory().fit(posed)
    on = started(posed, fit)
    objective = TrajectoryObjective.like(on, Trajectory())
    p = objective.extended(on.vector.start, begun=True)
    assert p[-1] == fit.nuisances["*"]["offset.delta"] != 0.0
    eta = np.zeros((1, objective.nuisances))
    there = fit.objective
    (end,) = objective.settled(p[None], eta)[0].cost
    assert end == pytest.approx(there, rel=1e-3)
    (without,) = objective.settled(objective.extended(on.vector.start)[None], eta)[0].cost
    assert without > 2.0 * there


def test_an_outlier_is_left_out_and_listed() -> None:
    fit = Trajectory().fit(_problem(_logs(_spike)))
    assert fit.diagnosis is not None
    assert {trial: dict(found) for trial, found in fit.diagnosis.rejected.items()} == {
        name: {"psi": 1} for name in ("zigzag", "turn", "port")
    }
    assert not fit.diagnosis.lacking
    assert np.abs(_z(fit)).max() < 3.5


@pytest.mark.long
def test_an_estimator_by_population_is_tested_as_well() -> None:
    problem = _problem(_logs(_shifted("psi", 3.0 * DEG)))
    fit = Evolution(population=8, largest=8, agree=1, threads=1, every=10, window=100.0).fit(
        replace(problem, free=tuple(replace(f, low=2.0 * f.start, high=0.5 * f.start) for f in problem.free[:1]))
    )
    assert fit.diagnosis is not None
    assert fit.diagnosis.causes[0].name == "bias.psi"


@pytest.mark.long
@pytest.mark.parametrize("estimator", [MultiStart(starts=1), Shooting()], ids=["starts", "shooting"])
def test_whole_trajectories_name_the_planted_error_first(estimator: Estimator) -> None:
    """A step from a poor optimum of long predictions ranks the suspects wrongly; shorter windows do not."""
    fit = estimator.fit(_problem(_logs(_shifted("delta", 1.5 * DEG))))
    assert fit.diagnosis is not None
    assert fit.diagnosis.causes[0].name == "offset.delta"
    assert "identified" not in {verdict.status for verdict in fit.verdicts}
    assert fit.loss is not None  # weights by the residuals, as of every estimator
    assert fit.loss.sigma["r"] > 2.0 * SENSORS["r"]


LACKING = {
    "no nonlinear terms": dict.fromkeys(("hull.Y_vvv", "hull.Y_vvr", "hull.Y_vrr", "hull.N_vvr", "hull.N_vrr"), 0.0),
    "mass": {"body.m": 1.15, "body.I_zG": 1.15},
    "rudder position": {"rudder.x_R": 0.8, "rudder.x_H": 0.8},
    "propeller": {"propeller.k_0": 0.85, "propeller.k_1": 0.85, "propeller.k_2": 0.85},
}
ESTIMATORS = {
    "trajectory": Trajectory(), "starts": MultiStart(starts=1), "shooting": Shooting(),
    "evolution": Evolution(population=8, largest=8, agree=1, runs=1, every=5),
    "tuning": FineTuning(ratios=(0.2, 0.3), starts=1, fold_starts=1, agree=1),
}  # fmt: skip


def _lacking(model: str, trials: tuple[Trial, ...]) -> Problem:
    """The problem with a model that is wrong in what is fixed, or lacks a wind that blows."""
    problem = _problem(trials)
    known = values(problem.ship.model)
    ship = problem.ship.having({path: factor * known[path] for path, factor in LACKING.get(model, {}).items()})
    free = (Free(f.path, f.start, *sorted((0.6 * f.start, 1.4 * f.start))) for f in problem.free)
    return replace(problem, ship=ship, free=tuple(free))


@pytest.mark.long
@pytest.mark.parametrize(("model", "name"), [
    *((model, "trajectory") for model in [*LACKING, "no wind"]), *(("mass", name) for name in list(ESTIMATORS)[1:]),
])  # fmt: skip
def test_nothing_is_identified_with_a_wrong_model(model: str, name: str) -> None:
    """Each wrong model by one estimator, and each estimator with one of them: the test after the fit is the same."""
    fit = ESTIMATORS[name].fit(_lacking(model, _logs(wind=12.0 if model == "no wind" else 0.0)))
    assert fit.diagnosis is not None
    assert fit.diagnosis.lacking
    assert "identified" not in {verdict.status for verdict in fit.verdicts}
    assert fit.diagnosis.lines[0].startswith("the model does not explain the data")


def test_a_declared_error_model_keeps_its_sigma_but_not_its_verdicts() -> None:
    problem = _problem(_logs(_shifted("delta", 1.5 * DEG)))
    own = replace(problem, loss=Loss(SENSORS, correlation=10.0))
    fit = Trajectory().fit(own)
    assert fit.diagnosis is not None
    assert fit.diagnosis.causes[0].name == "offset.delta"
    assert "identified" not in {verdict.status for verdict in fit.verdicts}


@pytest.mark.parametrize(("nuisance", "words"), [
    (Nuisance(common={"offset.dleta": 0.1}), "offset.dleta"), (Nuisance(suspects="all"), "auto"),
])  # fmt: skip
def test_unknown_suspects_are_refused(nuisance: Nuisance, words: str) -> None:
    with pytest.raises(StudyError, match=words):
        Trajectory().fit(_problem(_logs(), nuisance))


def test_a_fixed_parameter_counts_by_the_sigma_of_the_ship_file(clean: Fit) -> None:
    problem, plain = _problem(_logs()), clean.diagnosis
    assert plain is not None
    assert set(plain.shares.values()) == {0.1}
    assert not plain.carried
    path, free, moved = next(row for row in plain.fixed if row[0].startswith(("propeller", "rudder", "hull")))
    entry, value = problem.ship.entries[path], values(problem.ship.model)[path]
    known = replace(problem.ship, entries={**problem.ship.entries, path: replace(entry, sigma=0.2 * abs(value))})
    stated = Trajectory().fit(replace(problem, ship=known)).diagnosis
    assert stated is not None
    assert stated.shares[path] == pytest.approx(0.2)
    assert next(row for row in stated.fixed if row[0] == path) == (path, free, pytest.approx(2.0 * moved, rel=1e-6))
    assert stated.carried[free] == pytest.approx(abs(2.0 * moved), rel=1e-6)


def test_residuals_stand_beside_the_rudder(clean: Fit) -> None:
    assert clean.diagnosis is not None
    assert clean.diagnosis.control == ("delta", "rad")
    most = max(float(np.abs(one.control).max()) for one in clean.diagnosis.residuals.values())
    assert most == pytest.approx(35.0 * DEG)


@pytest.mark.long
def test_a_trial_of_another_ship_is_named_before_its_residuals_show() -> None:
    """The parameters adapt to all five, so that the residuals look like noise; the trials disagree."""
    logs, tanker = list(_logs()), load("kvlcc2")
    known = values(tanker.model)
    true = {path: factor * known[path] for path, factor in TRUTH.items()}
    other = tanker.having({**true, "hull.R_0": 1.1 * true["hull.R_0"], "hull.N_r": 0.97 * true["hull.N_r"]})
    rng = np.random.default_rng(9)
    for name, rudder, ship in (("slow", -20.0, other), ("gentle", 10.0, tanker.having(true))):
        run = simulate(ship, Turning(1.7, rudder * DEG), duration=600.0, dt=0.1, every=10, name=name)
        read = {c: run[c] + rng.normal(0.0, SENSORS.get(c, 0.0), len(run)) for c in (*SENSORS, "delta", "n_P")}
        logs.append(Trial(name, run.t, read, meta={"L_pp": tanker.L_pp}))
    fit = Trajectory().fit(_problem(tuple(logs)))
    assert fit.diagnosis is not None
    assert [one.trial for one in fit.diagnosis.apart] == ["slow"]
    assert "trial slow contradicts the others" in "; ".join(fit.diagnosis.lines)
    assert not any(verdict.status == "identified" for verdict in fit.verdicts)


def test_an_error_of_one_trial_is_named_with_the_trial() -> None:
    logs = _logs()
    turned = {**logs[1].channels, "psi": logs[1]["psi"] + 1.5 * DEG}
    fit = Trajectory().fit(_problem((logs[0], Trial("turn", logs[1].t, turned, meta=logs[1].meta), logs[2])))
    assert fit.diagnosis is not None
    found = {one.name: one for one in fit.diagnosis.differing}["bias.psi"]
    assert list(found.each) == ["turn"]
    assert found.each["turn"].size == pytest.approx(1.5 * DEG, rel=0.15)


@pytest.mark.long
def test_a_deviation_that_turns_with_the_heading_is_named_with_its_size() -> None:
    def plant(channels: Channels) -> None:
        channels["psi"] += 0.8 * DEG * np.cos(channels["psi"])

    fit = Trajectory().fit(_problem(_logs(plant)))
    assert fit.diagnosis is not None
    first = fit.diagnosis.causes[0]
    assert first.name == "deviation.north"
    assert first.size == pytest.approx(0.8 * DEG, rel=0.1)


@pytest.mark.long
def test_a_wrong_number_of_the_ship_file_is_named_with_its_error() -> None:
    problem = _problem(_logs())
    tanker = problem.ship
    wrong = replace(problem, ship=tanker.having({"body.m_y": 1.15 * values(tanker.model)["body.m_y"]}))
    fit = Trajectory().fit(wrong)
    assert fit.diagnosis is not None
    assert fit.diagnosis.terms[0].name == "body.m_y"
    assert fit.diagnosis.terms[0].size == pytest.approx(1.0 / 1.15 - 1.0, rel=0.2)
    assert "or the ship: an error of body.m_y" in "; ".join(fit.diagnosis.lines)

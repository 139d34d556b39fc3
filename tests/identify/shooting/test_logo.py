"""The shooting estimator: schedules agree, derivatives are exact, constraints hold, bad input is told."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.parameters import Free
from seatrial.data import DataError
from seatrial.identify import FitError, Loss, Nuisance, StudyError
from seatrial.identify.shooting.balance import smoothed
from seatrial.identify.shooting.chains import FirstStates, chains
from seatrial.identify.shooting.condensed import Condensed
from seatrial.identify.shooting.constraints import Inequalities, Penalty
from seatrial.identify.shooting.logo import Shooting
from seatrial.identify.trajectory.objective import TrajectoryObjective
from seatrial.models import STATES
from seatrial.ships.files import load
from tug_trials import COLD, NAMES, NOISE, TRUE, TRUTH, problem


@pytest.fixture(scope="module")
def told():
    return problem()


@pytest.fixture(scope="module")
def fit(told):
    return Shooting().fit(told)


def objective(told, *, count, freed, window=5.0):
    part = replace(told, trials=told.trials[4 : 4 + count])
    cut = chains(part.trials, TRUTH.model, part.loss, part.loss.sigma, window=window, dt=0.2, every=1, weights={})
    none = Penalty(Inequalities.none(part), 1.0, np.zeros(0))
    return Condensed.build(part, cut, anchor=np.array([TRUE, np.zeros(22)]), penalty=none, freed=freed,
                           span=np.array(list(NOISE.values())), method="rk4", threads=2)  # fmt: skip


@pytest.mark.slow
def test_the_chains_hold_every_sample_once(told):
    cut = objective(told, count=8, freed=True).chains
    assert cut.entries == 6 * sum(len(t) for t in told.trials[4:])
    lane = np.flatnonzero(cut.trial == 1)
    np.testing.assert_allclose(cut.state0[lane[1:]], cut.motion[lane[:-1], -1])


@pytest.mark.slow
def test_condensed_slopes_are_those_of_the_objective(told):
    """Along a step that closes gaps, half the objective changes as the condensed gradient says."""
    o = objective(told, count=2, freed=True)
    point = o.start(TRUE * 1.05)
    linear, wide = o.linear(point), np.full(22, np.inf)
    d = o.step(linear, point.p, 1e-3, -wide, wide)
    t = 1e-5
    up, down = (o.cost(o.moved(linear, point, d, s, -wide, wide)) for s in (t, -t))
    nothing = np.zeros_like(linear.gaps)
    assert 0.25 * (up[0] - down[0]) / t == pytest.approx(linear.slope(d, nothing), rel=1e-5)
    # Gaps shrink by the share of the step.
    np.testing.assert_allclose(up[1], (1 - t) * linear.gaps, atol=1e-7)


@pytest.mark.long
def test_windows_that_join_are_one_trajectory(told, fit):
    """Cutting does not change the optimum: windows of 5 s and of 20 s end at the same place."""
    longer = Shooting(window=20.0).fit(told)
    assert longer.objective == pytest.approx(fit.objective, rel=1e-9)


@pytest.mark.long
def test_from_zero_damping_with_and_without_lo_the_same_optimum(told, fit):
    cold = Shooting(schedule="go").fit(told)
    assert fit.status == cold.status == "converged"
    assert cold.objective == pytest.approx(fit.objective, rel=1e-8)
    np.testing.assert_allclose(cold.values, fit.values, rtol=1e-3, atol=1e-2)


@pytest.mark.long
def test_trials_added_by_groups_end_at_the_same_optimum(told, fit):
    assert Shooting(growth=6).fit(told).objective == pytest.approx(fit.objective, rel=1e-8)


@pytest.mark.long
def test_lo_alone_is_near_and_needs_no_start(told):
    lo = Shooting(schedule="lo")
    values = lo.fit(told).values
    np.testing.assert_allclose(values[[0, 1]], TRUE[[0, 1]], rtol=0.05)
    far = problem(start=COLD + 5.0, recorded=told.trials)
    np.testing.assert_allclose(lo.fit(far).values, values, rtol=1e-3, atol=0.5)


@pytest.mark.long
def test_a_model_without_momentum_balance_falls_back_on_short_predictions():
    from seatrial.core.parameters import read
    from seatrial.manoeuvres.zigzag import Zigzag
    from seatrial.simulate.run import approach, simulate

    ship = load("kvlcc2_l7")
    speed, n_P = approach(ship)
    run = simulate(ship, Zigzag(n_P=n_P, delta=0.35, psi=0.35), speed=speed, duration=80.0, dt=0.2, name="z")
    paths = ("hull.Y_v", "hull.N_r")
    free = tuple(Free(p, 0.5 * read(ship.model, p)) for p in paths)
    from seatrial.identify import Problem

    fit = Shooting(initial="measured").fit(Problem(ship.having({f.path: f.start for f in free}), (run,), free))
    np.testing.assert_allclose(fit.values, [read(ship.model, p) for p in paths], rtol=1e-3)


@pytest.mark.long
def test_ridge_pulls_to_the_start_and_weights_weigh(told, fit):
    start = TRUE * 1.1
    ends = [Shooting(ridge=r).fit(problem(start=start, recorded=told.trials)) for r in (0.0, 1e2, 1e4)]
    away = [np.linalg.norm(end.values / start - 1) for end in ends]
    assert [end.status for end in ends] == ["converged"] * 3
    assert away[0] > 1.5 * away[1] > 1.5 * away[2]
    doubled = Shooting(weights={t.name: 2.0 for t in told.trials}).fit(told)
    assert doubled.objective == pytest.approx(2 * fit.objective, rel=1e-8)


def four(told, start):
    """Four runs and four parameters."""
    few = ("inertia.m_11", "inertia.m_33", "damping.X_u", "damping.N_r")
    values = {name: start * TRUE[NAMES.index(name)] for name in few}
    free = tuple(Free(name, value) for name, value in values.items())
    return replace(told, ship=TRUTH.having(values), free=free, trials=tuple(told.trials[k] for k in (1, 5, 8, 11)))


@pytest.mark.long
def test_a_ridge_about_zero_is_that_of_equation_13(told):
    """lambda |P|^2 in SI units is part of the objective and shrinks the parameters; one about the start does not."""
    part = four(told, 1.0)
    plain, printed = (Shooting(ridge=r, ridge_about="zero").fit(part) for r in (0.0, 0.5))
    spent, most = (0.5 * float(fit.values @ fit.values) for fit in (printed, plain))
    assert spent < most
    assert plain.objective + spent < printed.objective < plain.objective + most
    near = Shooting(ridge=1e6).fit(part)
    np.testing.assert_allclose(near.values, [f.start for f in part.free], rtol=0.02)


@pytest.mark.long
def test_a_search_that_grew_to_a_poor_optimum_is_beaten_by_one_from_the_balance(told):
    """Six parameters, four trials at a time in the order line, zigzag, turn: one search ends with m_33 at its bound.

    All ends are kept, and the status says that they differ.
    """
    from seatrial.environment import Uniform
    from seatrial.study.study import read_study

    study = read_study(Path(__file__).parents[3] / "studies" / "you2023.toml")
    calm = replace(study.virtual, wind=Uniform(), gusts="", ship=replace(
        study.virtual.ship, model=replace(study.virtual.ship.model, wind=None)))  # fmt: skip
    made = {trial.name: trial for trial in calm.run()}
    part = replace(study.problem, trials=tuple(made[t.name] for t in study.problem.trials), nuisance=Nuisance(),
                   free=study.problem.vector.started({"inertia.m_11": 196.98, "inertia.m_22": 254.0454,
                                                      "inertia.m_33": 220.1974}))  # fmt: skip
    six = [f.path for f in study.rival]
    part = replace(part, free=tuple(f for f in part.free if f.path in six))
    settings = {"schedule": "go", "growth": 4, "initial": "measured"}
    alone, best = Shooting(**settings, starts=1).fit(part), Shooting(initial="measured").fit(part)
    assert alone.status == "converged"
    assert alone.objective > 1.01 * best.objective
    for starts, same in ((2, 1), (4, 3)):
        found = Shooting(**settings, starts=starts).fit(part)
        assert found.objective == pytest.approx(best.objective, rel=1e-8)
        assert found.status == f"converged; {same} of {starts} starts end there"
        assert found.ends[0, 0] == pytest.approx(alone.objective, rel=1e-6)
        assert found.ends.shape == (starts, 7)


def test_constraints_of_equation_19_hold_where_the_data_would_break_them(told):
    """The truth is stable with -X_u > 0; a bound that binds is met exactly by the multipliers."""
    inequalities = Inequalities.of(told)
    assert inequalities.names == ("-X_u", "Y_v N_r - Y_r N_v", "m_11", "m_11 m_22 - m_12^2", "det M")
    assert (inequalities.at(TRUE)[0] > 0).all()
    bad = TRUE.copy()
    bad[NAMES.index("damping.X_u")] = 3.0
    penalty = Penalty(inequalities, 10.0, np.zeros(5))
    z, dz = penalty.rows(bad)
    assert z[0] > 0
    assert np.count_nonzero(z) == 1
    step = np.zeros(22)
    step[NAMES.index("damping.X_u")] = 1e-6
    assert (penalty.rows(bad + step)[0] - z)[0] == pytest.approx((dz @ step)[0], rel=1e-6)
    assert penalty.pushed(bad).push[0] == pytest.approx(z[0] / np.sqrt(10.0))


@pytest.mark.parametrize(("settings", "wanted"), [
    pytest.param({"growth": 5}, [5, 10], marks=pytest.mark.slow), ({"growth": 4}, [4, 8]),
    pytest.param({"growth": 12}, [], marks=pytest.mark.slow), pytest.param({}, [], marks=pytest.mark.slow),
    ({"growth": 4, "schedule": "lo"}, []),
])  # fmt: skip
def test_trials_join_by_groups_each_from_where_the_last_ended(told, monkeypatch, settings, wanted):
    """You 2023 Algorithm 1: so many trials at a time, until the last fit takes all twelve."""
    from seatrial.identify.shooting import logo as logo_run

    seen = []

    def early(run, trials, p):
        seen.append((len(trials), p[0]))
        return p + 1.0

    def last(run, stage, p, *_):
        seen.append((stage.chains.trials, p[0]))
        raise FitError("enough")

    monkeypatch.setattr(logo_run.Run, "early", early)
    monkeypatch.setattr(logo_run.Run, "whole", last)
    monkeypatch.setattr(logo_run.Run, "local", last)
    with pytest.raises(FitError, match="enough"):
        Shooting(**settings, starts=1).fit(told)
    assert [count for count, _ in seen] == [*wanted, 12]
    assert [p for _, p in seen] == pytest.approx([told.free[0].start + k for k in range(len(seen))])


def test_smoothing_keeps_a_parabola():
    t = np.linspace(0, 1, 30)
    values = np.column_stack([t * t, 1 - t])
    np.testing.assert_allclose(smoothed(values, 3), values, atol=1e-12)


@pytest.mark.parametrize(("fields", "words"), [
    ({"schedule": "og"}, "known: lo, go, logo"), ({"window": 0.0}, "above zero"),
    ({"initial": "known"}, "free, measured"),
    ({"ridge": -1.0}, "zero or above"), ({"starts": 0}, "above zero"),
    ({"ridge_about": "mean"}, "start, zero"), ({"weights": {"a": 0.0}}, "weights of a"),
])  # fmt: skip
def test_bad_settings_are_told(fields, words):
    with pytest.raises(StudyError, match=words):
        Shooting(**fields)


@pytest.mark.slow
def test_bad_problems_are_told(told):
    with pytest.raises(StudyError, match="weights names 'nobody'"):
        Shooting(weights={"nobody": 2.0}).fit(told)
    other = replace(told, ship=load("kvlcc2_l7"), free=(Free("hull.Y_v", -0.3),), loss=Loss())
    with pytest.raises(StudyError, match="mass matrix"):
        Inequalities.of(other)
    # a track alone may be missing, the speeds tell it; nothing that a model moves may
    short = told.trials[0].having(**{n: told.trials[0][n] * np.nan for n in STATES})
    with pytest.raises(StudyError, match="no channel x, y, psi, u, v_m, r; log the speed u, or positions x and y"):
        Shooting().fit(replace(told, trials=(short,)))
    with pytest.raises(DataError, match="fewer than the 501 of one window"):
        Shooting(window=100.0).fit(told)


@pytest.mark.long
def test_validation_is_watched_as_the_fit_goes_on(told):
    """Whole trials from measured starts, in every row of the history; it does not change the fit."""
    rest, held = (*told.trials[:9], *told.trials[10:]), told.trials[9:10]
    plain, seen = Shooting().fit(replace(told, trials=rest)), []
    whole = replace(told, trials=rest, validation=held)
    fit = Shooting().fit(whole, progress=lambda *row: seen.append(row))
    assert np.isnan(plain.history[:, 2]).all()
    np.testing.assert_array_equal(fit.values, plain.values)
    assert [row[2] for row in seen] == list(fit.history[:, 2])
    # What is left is the noise of the start: the truth does no better.
    whole_trials = TrajectoryObjective.build(
        replace(told, trials=held), held, told.loss.sigma, window=100.0, dt=0.2, every=1,
        method="rk4", threads=1,
    )  # fmt: skip
    assert fit.history[-1, 2] == pytest.approx(whole_trials.standardised(TRUE), rel=0.2)
    assert fit.history[-1, 2] == pytest.approx(whole_trials.standardised(fit.values), rel=1e-9)
    assert len(Shooting(schedule="lo").fit(whole).history) == 1


@pytest.mark.long
def test_short_predictions_walk_back_a_start_that_blows_up_in_a_step(told, fit, monkeypatch):
    """A random start: m_22 and m_33 next to nothing, other signs; no momentum balance helps."""
    from seatrial.identify.shooting import logo as logo_run

    monkeypatch.setattr(logo_run, "momentum_guess", lambda *_, **__: None)
    start = TRUE * (1.0 + np.random.default_rng(7).uniform(-2.0, 2.0, (2, TRUE.size))[1])
    assert (start[1:3] < 0).all()  # taken at their lower bound, 1e-9
    cold = Shooting(schedule="go").fit(problem(start=start, recorded=told.trials))
    # The integrator's steps from row to row are those that suit the ship the search starts from: not the same here.
    assert cold.objective == pytest.approx(fit.objective, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("compared", [
    ("u", "v_m", "r"), ("x", "y"), pytest.param(("x", "y", "psi"), marks=pytest.mark.long),
    pytest.param(("psi", "u"), marks=pytest.mark.long),
])  # fmt: skip
def test_first_states_that_no_reading_tells_do_no_harm(told, compared):
    """Four runs and four parameters, by some channels only; positions start as measured where they are not compared."""
    few = ("inertia.m_11", "inertia.m_33", "damping.X_u", "damping.N_r")
    start = {name: 0.8 * TRUE[NAMES.index(name)] for name in few}
    ship = TRUTH.having(start)
    loss = Loss({name: told.loss.sigma[name] for name in compared}, correlation=0.0)
    free = tuple(Free(name, value) for name, value in start.items())
    part = replace(told, ship=ship, free=free, loss=loss, trials=tuple(told.trials[k] for k in (1, 5, 8, 11)))
    fit = Shooting().fit(part)
    assert fit.status == "converged"
    true = np.array([TRUE[NAMES.index(name)] for name in few])
    assert np.abs((fit.values - true) / fit.sigma).max() < 3.5
    ship = part.ship.having(dict(zip(few, true, strict=True)))
    held = Shooting().fit(replace(part, ship=ship, free=tuple(replace(f, start=start[f.path] / 0.8) for f in free)))
    assert held.objective == pytest.approx(fit.objective, rel=1e-8)


@pytest.mark.parametrize(("compared", "free"), [
    (("x", "y", "psi", "u", "v_m", "r"), [0, 1, 2, 3, 4, 5]), (("u", "v_m", "r"), [3, 4, 5]),
    (("x", "y"), [0, 1, 2, 3, 4, 5]), (("psi", "u"), [2, 3, 4, 5]),
])  # fmt: skip
def test_what_is_free_of_a_first_state(told, compared, free):
    part = replace(told, loss=Loss({name: told.loss.sigma[name] for name in compared}, correlation=0.0))
    span = np.arange(1.0, 7.0)
    cut = chains(part.trials[4:6], TRUTH.model, part.loss, part.loss.sigma, window=5.0, dt=0.2, every=1, weights={})
    begun = FirstStates.of(cut, span)
    assert begun.free.tolist() == free
    seen = [STATES.index(name) for name in compared]
    np.testing.assert_array_equal(begun.weight, [0.0 if k in seen else span[k] ** -2.0 for k in free])
    nodes = cut.state0.copy()
    assert begun.prior(nodes) == 0.0
    nodes[cut.levels[0], 3] += 2.0
    assert begun.prior(nodes) == pytest.approx(0.0 if 3 in seen else 2 * 4.0 / 16.0)


def test_slopes_hold_where_first_states_are_drawn(told):
    """Positions alone: the speeds at the start have a prior, which counts in objective and slope."""
    part = replace(told, loss=Loss({name: told.loss.sigma[name] for name in ("x", "y")}, correlation=0.0))
    o = objective(part, count=2, freed=True)
    o = replace(o, begun=replace(o.begun, weight=np.where(o.begun.weight > 0, 1e4, 0.0)))
    point, wide = o.start(TRUE * 1.05), np.full(22, np.inf)
    point.nodes[o.chains.levels[0], 3] += 0.1
    linear = o.linear(point)
    assert linear.cost == pytest.approx(o.cost(point)[0], rel=1e-10)
    d = o.step(linear, point.p, 1e-3, -wide, wide)
    t = 1e-5
    up, down = (o.cost(o.moved(linear, point, d, s, -wide, wide)) for s in (t, -t))
    slope = linear.slope(d, np.zeros_like(linear.gaps))
    assert 0.25 * (up[0] - down[0]) / t == pytest.approx(slope, rel=1e-5)


@pytest.mark.parametrize("schedule", ["logo", "go"])
@pytest.mark.long
def test_where_no_trajectory_joins_the_answer_is_that_of_short_predictions(told, monkeypatch, schedule):
    """GO comes to nothing from either way in: the fit is LO's, and says so."""
    from seatrial.identify.shooting import logo as logo_run

    def never(run, stage, start):
        return logo_run.Search(start, np.inf, done="no further decrease")

    monkeypatch.setattr(logo_run.Run, "joined", never)
    few = replace(told, trials=tuple(told.trials[k] for k in (1, 5, 8, 11)))
    fit = Shooting(schedule=schedule, growth=2).fit(few)
    assert fit.status == logo_run.UNJOINED
    assert np.isfinite(fit.sigma).all()
    lo = Shooting(schedule="lo").fit(few)
    assert fit.objective <= lo.objective * (1 + 1e-12)

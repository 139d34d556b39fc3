from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import Free, ParameterError, near
from seatrial.data import Trial
from seatrial.data.check import Finding
from seatrial.identify import Issue, Loss, Nuisance, Problem, StudyError
from seatrial.identify.lint import headlines, lines, lint, linted, raise_on_errors
from seatrial.identify.population.evolution import Evolution
from seatrial.identify.shooting.logo import Shooting
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.shooting import OneStep, Trajectory
from seatrial.identify.tuning.fine_tuning import FineTuning
from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate
from seatrial.study.freedom import freedom

MANY = ("body.m_x", "body.m_y", "body.J_z", "hull.R_0", "hull.X_vv", "hull.X_rr", "hull.Y_v", "hull.Y_r", "hull.Y_vvv",
        "hull.Y_vvr", "hull.Y_vrr", "hull.N_v", "hull.N_r", "hull.N_vvv", "hull.N_vvr", "hull.N_vrr", "hull.N_rrr",
        "propeller.t_P", "propeller.w_P0", "propeller.k_0", "rudder.t_R", "rudder.a_H", "rudder.epsilon",
        "rudder.kappa", "rudder.gamma_Rp", "rudder.gamma_Rn")  # fmt: skip


@pytest.fixture(scope="module")
def problem() -> Problem:
    ship = load("kvlcc2_l7")
    run = simulate(ship, Zigzag(approach(ship)[1], 0.35, 0.35), duration=120, dt=0.02, every=5, name="a")
    return Problem(ship, (run,), near(ship.model, "hull.Y_v", ratio=0.3))


def _without(trial: Trial, name: str) -> Trial:
    return replace(trial, channels={n: v for n, v in trial.channels.items() if n != name})


CASES = {
    "no free": (lambda p: replace(p, free=()), "no free parameter"),
    "unknown path": (lambda p: replace(p, free=(Free("hull.Y_w", 0.0),)), "hull.Y_v"),
    "no trials": (lambda p: replace(p, trials=()), "no trial"),
    "no rudder": (lambda p: replace(p, trials=(_without(p.trials[0], "delta"),)), "no channel delta"),
    "sigma": (lambda p: replace(p, loss=Loss({"w": 1.0})), "no channel 'w'"),
    "both": (lambda p: replace(p, validation=p.trials), "in training and in validation"),
    "overlap": (lambda p: replace(p, validation=(replace(p.trials[0], name="b"),)), "share a recording"),
    "scale": (lambda p: replace(p, trials=(replace(p.trials[0], meta={"L_pp": 320.0}),)), "320 m"),
    "sign": (
        lambda p: replace(p, trials=(p.trials[0].having(delta=-p.trials[0]["delta"]),)), "rudder sign"),
}  # fmt: skip


@pytest.mark.slow
def test_an_infinite_deviation_frees_an_initial_state_and_is_wrong_elsewhere(problem: Problem) -> None:
    free = Nuisance(initial={"x": np.inf, "psi": np.inf})
    assert not [i for i in lint(replace(problem, nuisance=free), felt=False) if i.severity == "error"]
    for wrong in (replace(problem, nuisance=Nuisance(bias={"x": np.inf})), replace(problem, loss=Loss({"x": np.inf}))):
        assert any(i.severity == "error" and i.where.endswith(".x") for i in lint(wrong, felt=False))


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_errors(problem: Problem, case: str) -> None:
    change, words = CASES[case]
    issues = lint(change(problem))
    assert any(issue.severity == "error" and words in issue.text for issue in issues), issues
    with pytest.raises(StudyError):
        raise_on_errors(issues)


@pytest.mark.slow
def test_a_sound_problem_has_no_errors(problem: Problem) -> None:
    issues = lint(problem)
    assert [issue for issue in issues if issue.severity == "error"] == []
    assert any((issue.severity, issue.where) == ("warning", "validation") for issue in issues)


@pytest.mark.slow
def test_white_noise_and_measured_starts_make_sigma_too_small(problem: Problem) -> None:
    sure, measured = replace(problem, loss=Loss(correlation=0.0)), Trajectory(initial="measured")
    assert any((i.severity, i.where) == ("warning", "estimator.initial") for i in lint(sure, (), measured))
    assert not any(i.where == "estimator.initial" for i in lint(sure, (), Trajectory()))
    alike = replace(problem, loss=Loss(correlation=5.0))
    assert not any(i.where == "estimator.initial" for i in lint(alike, (), measured))


@pytest.mark.slow
def test_test_trials_that_overlap_are_refused(problem: Problem) -> None:
    again = replace(problem.trials[0], name="b")
    for trials, words in ((problem.trials, "in training and in test"), ((again,), "training and test share")):
        assert any(i.severity == "error" and words in i.text for i in lint(problem, trials))
    watched = replace(problem, validation=(again,), trials=())
    assert any("in validation and in test" in i.text for i in lint(watched, (again,)))


@pytest.mark.slow
def test_a_recording_under_two_names_counts_twice(problem: Problem) -> None:
    again = replace(problem.trials[0], name="copy")
    told = [i for i in lint(replace(problem, trials=(*problem.trials, again))) if "counted twice" in i.text]
    assert [i.severity for i in told] == ["warning"]
    assert "copy" in told[0].where
    assert not [i for i in lint(problem) if "counted twice" in i.text]


@pytest.mark.slow
def test_a_part_of_the_recording_is_the_recording(problem: Problem) -> None:
    part = replace(problem.trials[0].rows(slice(100, 400)), name="later")
    assert any(i.severity == "error" and "share a recording" in i.text for i in lint(problem, (part,)))


@pytest.mark.slow
def test_fewer_samples_than_parameters_is_a_warning(problem: Problem) -> None:
    short = replace(problem.trials[0].rows(slice(0, 25)), name="short")
    many = replace(problem, trials=(short,), free=near(problem.ship.model, *MANY, ratio=0.3))
    found = [i for i in lint(many) if "complete samples" in i.text]
    assert [i.severity for i in found] == ["warning"]
    assert "25 complete samples for 26 free parameters" in found[0].text


@pytest.mark.slow
def test_parameters_to_which_the_data_are_insensitive_are_named(problem: Problem) -> None:
    straight = simulate(problem.ship, Straight(approach(problem.ship)[1]), duration=60, dt=0.1, name="straight")
    paths = ("hull.R_0", "hull.N_v")
    loss = Loss({"psi": 0.03, "u": 0.02, "v_m": 0.01, "r": 0.003})
    boxed = replace(problem, trials=(straight,), free=near(problem.ship.model, *paths, ratio=0.3), loss=loss)
    found = [i for i in lint(boxed) if i.where in paths]
    assert [(i.severity, i.where) for i in found] == [("error", "hull.N_v")]
    softly = replace(boxed, free=tuple(replace(f, prior=f.start, sigma=0.1) for f in boxed.free))
    found = [i for i in lint(softly) if i.where in paths]
    assert [(i.severity, i.where) for i in found] == [("warning", "hull.N_v")]


@pytest.fixture(scope="module")
def tug() -> Problem:
    ship = load("qiuxin5")
    run = simulate(ship, Zigzag(approach(ship)[1], 0.35, 0.35), speed=ship.speed, duration=60, dt=0.2, name="a")
    return Problem(ship, (run,), near(ship.model, "damping.Y_v", ratio=0.3))


def _said(problem: Problem, severity: str) -> str:
    return "\n".join(f"{i.where}: {i.text}" for i in lint(problem) if i.severity == severity)


@pytest.mark.slow
def test_a_mass_matrix_of_no_body_is_accepted_with_a_warning(tug: Problem) -> None:
    assert _said(tug, "error") == ""
    words = "inertia: M is not symmetric (m_23 = 1.1254, m_32 = -16.0598): no body has such a mass"
    assert words in _said(tug, "warning")
    assert "inertia: m_11 = 138.057 kg is below the displaced 187.6 kg" in _said(tug, "warning")
    indefinite = replace(tug, ship=tug.ship.having({"inertia.m_23": 60.0, "inertia.m_32": 60.0}))
    assert "not positive definite: some motion has no kinetic energy" in _said(indefinite, "warning")


@pytest.mark.slow
def test_commands_beyond_the_thrust_map_are_refused_unless_asked(tug: Problem) -> None:
    (trial,) = tug.trials
    fast = replace(tug, trials=(trial.having(n_1=trial["n_1"] + 5.0),))
    assert "a: n_1 goes from 12.03 to 12.03 1/s, thrust was tested from 0 to 10 1/s" in _said(fast, "error")
    assert "extrapolated" in _said(replace(fast, extrapolate=True), "warning")
    assert "thrust was tested" not in _said(replace(fast, extrapolate=True), "error")
    back = replace(tug, trials=(trial.having(n_2=-trial["n_2"]),))
    assert "n_2 goes from -7.03" in _said(back, "error")
    noisy = replace(tug, trials=(trial.having(n_1=trial["n_1"] * 10.05 / trial["n_1"].max()),))
    assert "thrust was tested" not in _said(noisy, "error")


@pytest.mark.slow
def test_more_columns_than_thrusters(tug: Problem) -> None:
    (trial,) = tug.trials
    spare = replace(tug, trials=(trial.having(n_3=trial["n_1"], alpha_3=trial["alpha_1"]),))
    assert "commands thrusters by n_3, alpha_3 that qiuxin5 lacks (it has 1, 2)" in _said(spare, "error")
    still = replace(tug, trials=(trial.having(n_3=0 * trial["n_1"]),))
    assert _said(still, "error") == ""


@pytest.mark.slow
def test_uneven_sampling_is_told(tug: Problem) -> None:
    (trial,) = tug.trials
    kept = [k for k in range(len(trial)) if k % 7 != 3]
    uneven = replace(tug, trials=(trial.rows(np.array(kept, dtype=np.intp)),))
    assert "steps differ from 0.2 s (from 0.2 to 0.4 s)" in _said(uneven, "warning")
    assert "steps differ" not in _said(tug, "warning")


@pytest.mark.slow
def test_directions_in_degrees_are_refused(tug: Problem) -> None:
    (trial,) = tug.trials
    wrong = replace(tug, trials=(trial.having(alpha_1=np.degrees(trial["alpha_1"])),))
    assert "direction of the thrust is in degrees" in _said(wrong, "error")


@pytest.mark.parametrize(("estimator", "where", "words"), [
    (Trajectory(), "", ""), (Trajectory(initial="measured"), "estimator.initial", 'say "free"'),
    (OneStep(), "nuisance.initial", "give its deviations"),
    (Shooting(), "", ""), (Shooting(initial="measured"), "estimator.initial", 'say "free"'),
    (Shooting(schedule="lo"), "loss.correlation", "errors are alike"),
    (MultiStart(), "", ""), (MultiStart(initial="measured"), "estimator.initial", 'say "free"'),
    (Evolution(), "", ""), (Evolution(initial="measured"), "estimator.initial", 'say "free"'),
    (FineTuning(), "", ""),
])  # fmt: skip
def test_the_remedy_against_measured_starts_is_one_that_the_estimator_takes(
    problem: Problem, estimator: Any, where: str, words: str
) -> None:
    sure = replace(problem, loss=Loss(correlation=0.0))
    found = [i for i in lint(sure, (), estimator) if "too small" in i.text]
    assert [i.where for i in found] == [where] * bool(where)
    assert all(i.text.endswith(words) for i in found)


@pytest.mark.slow
def test_a_log_may_name_the_ship_that_this_is_another_model_of(problem: Problem) -> None:
    log = replace(problem.trials[0], meta={**problem.trials[0].meta, "ship": "the_tanker"})
    of_others = replace(problem, trials=(log,))
    assert any("is of ship 'the_tanker'" in issue.text for issue in lint(of_others))
    ours = replace(of_others, ship=replace(problem.ship, of="the_tanker"))
    assert not any("is of ship" in issue.text for issue in lint(ours))


def test_what_holds_of_many_trials_is_one_line() -> None:
    many = [Issue("warning", name, "has no wind") for name in "abc"]
    assert lines([*many, Issue("warning", "free", "odd")]) == (
        "warning: a and 2 more: has no wind", "warning: free: odd")  # fmt: skip
    assert lines(many[:1]) == ("warning: a: has no wind",)


ESTIMATORS = (Trajectory(window=60.0), OneStep(), Evolution(), MultiStart(), Shooting(), FineTuning())


@pytest.mark.parametrize("estimator", ESTIMATORS)
@pytest.mark.parametrize("case", [pytest.param("sign", marks=pytest.mark.slow), "unknown path", "both", "scale"])
def test_an_estimator_refuses_in_python_what_a_study_refuses(problem: Problem, estimator: Any, case: str) -> None:
    change, words = CASES[case]
    with pytest.raises(StudyError, match=words):
        estimator.fit(change(problem))


def test_a_problem_is_looked_at_once(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Problem] = []

    @linted
    def fit(estimator: Any, problem: Problem) -> Any:
        return problem if estimator is None else fit(None, replace(problem, free=()))

    def counted(problem: Problem, **_: Any) -> tuple[Issue, ...]:
        asked.append(problem)
        return ()

    monkeypatch.setattr("seatrial.identify.lint.lint", counted)
    assert fit("outer", problem).linted
    assert asked == [problem]
    assert replace(problem, linted=True) == problem


def test_near_refuses_what_it_would_have_to_cut(problem: Problem) -> None:
    model = problem.ship.model
    with pytest.raises(ParameterError, match=r"rudder.eta: the range \[0.125, 1.13\] leaves what it can be, \[0, 1\]"):
        near(model, "rudder.eta", ratio=0.8)
    (free,) = near(model, "rudder.eta", ratio=0.5)
    assert (free.low, free.high) == pytest.approx((0.313, 0.939), abs=1e-3)


def test_shares_in_percent_and_a_sigma_in_degrees_are_refused(problem: Problem) -> None:
    model = problem.ship.model
    for key in ("ratio", "prior"):
        with pytest.raises(ParameterError, match=rf"{key} is 50: 50 times the value either way; 50 % is 0.5"):
            freedom(model, {"hull.Y_v": {key: 50.0}})
    with pytest.raises(ParameterError, match=r"50 % is 0\.5"):
        near(model, "hull.Y_v", ratio=50.0)
    told = [issue for issue in lint(replace(problem, loss=Loss({"psi": 6.0}))) if issue.severity == "error"]
    assert [(issue.where, issue.text) for issue in told] == [
        ("loss.sigma.psi", "is 6 rad, more than half a turn; 6 deg is 0.105 rad")]
    assert not [i for i in lint(replace(problem, loss=Loss({"psi": 2.859}))) if i.severity == "error"]
@pytest.mark.parametrize(("kind", "severity"), [("scale", "error"), ("quality", "warning")])
def test_no_words_decide_whether_a_finding_forbids_the_fit(
    problem: Problem, kind: Any, severity: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = "bad" if kind == "scale" else "wrong scale, degrees"
    told = Finding("error", words, "a: u", "1 of 2", "mend it", kind, ("a",))
    monkeypatch.setattr("seatrial.identify.lint.check_folder", lambda _: (told,))
    (issue,) = [issue for issue in lint(replace(problem)) if "mend it" in issue.text]
    assert issue.severity == severity


@pytest.mark.slow
def test_what_only_several_logs_show_is_told_once_and_not_if_the_fit_estimates_it() -> None:
    """A rudder offset shows in the balance of port and starboard of all manoeuvres."""
    from garden.faults import BY_NAME
    from garden.logs import clean

    logs = BY_NAME["rudder_offset"].plant(clean())
    trials = tuple(Trial(log.name, log.t, dict(log.table), {}, dict(logs.meta)) for log in logs.logs)
    ship = load("kvlcc2")
    own = Problem(ship, trials[:-2], near(ship.model, "hull.N_r", ratio=0.5), validation=trials[-2:])
    [told] = [issue for issue in lint(own, felt=False) if "rudder offset" in issue.text]
    assert told.severity == "warning"
    assert told.where == f"{len(trials)} trials: delta"
    answered = replace(own, nuisance=Nuisance(common={"offset.delta": 0.05}))
    assert not [issue for issue in lint(answered, felt=False) if "rudder offset" in issue.text]


@pytest.mark.parametrize(("name", "size", "words"), [
    ("bias.psi", 5.0, "is 5 rad, more than half a turn; 5 deg is 0.0873 rad"),
    ("offset.delta", 10.0, "more than half a turn"), ("offset.delta", 0.0, "above zero"),
])  # fmt: skip
def test_errors_of_instruments_in_degrees_are_refused(problem: Problem, name: str, size: float, words: str) -> None:
    own = replace(problem, nuisance=Nuisance(common={name: size}))
    found = [issue for issue in lint(own, felt=False) if issue.severity == "error"]
    assert [issue.where for issue in found] == [f"nuisance.common.{name}"]
    assert words in found[0].text
    wide = replace(problem, nuisance=Nuisance(common={"scale.u": 5.0, "bias.psi": float("inf")}))
    assert not [issue for issue in lint(wide, felt=False) if issue.severity == "error"]


def _many(faint: int, other: int) -> list[Issue]:
    late = (Issue("warning", f"trial-{k}", f"u is late by {k} s (evidence {k}); shift u") for k in range(other))
    return [*late, *(Issue("warning", f"hull.N_{k}", f"hardly acts: {k} times", faint=True) for k in range(faint))]


@pytest.mark.parametrize(("faint", "other"), [(0, 0), (1, 2), (3, 0)])
def test_few_warnings_stand_whole_on_the_first_screen(faint: int, other: int) -> None:
    issues = _many(faint, other)
    assert headlines(issues) == lines(issues)
    assert len(headlines(issues)) == faint + other


@pytest.mark.parametrize(("faint", "other", "count"), [(14, 5, 2), (1, 3, 2), (4, 0, 1), (0, 9, 1), (4, 1, 2)])
def test_many_warnings_take_a_line_a_kind_on_the_first_screen(faint: int, other: int, count: int) -> None:
    told = headlines(_many(faint, other))
    assert len(told) == count
    text = " ".join(told)
    for k in range(other):
        assert f"trial-{k}: u is late by {k} s" in text  # each doubt is named,
    assert ("evidence" in text) == (other == 1)  # its evidence is left to the page
    assert ("hull.N_0" in text) == (faint > 0)
    assert (f"and {faint - 3} more" in text) == (faint > 3)
    assert told[-1].endswith("--details and the page tell each with its remedy")


def test_other_test_trials_and_other_estimators_are_other_questions(problem: Problem) -> None:
    posed = replace(problem)
    (own,) = posed.trials
    assert not [issue for issue in lint(posed) if "is in training and in test" in issue.text]
    assert [issue.where for issue in lint(posed, (own,)) if "is in training and in test" in issue.text] == [own.name]
    assert lint(posed, felt=False) == lint(posed, felt=False)
    assert [issue for issue in lint(posed) if issue.where == "validation"]
    assert not [issue for issue in lint(posed, (replace(own, name="b"),)) if issue.where == "validation"]

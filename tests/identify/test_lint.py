from __future__ import annotations

from dataclasses import replace

import pytest

from seatrial.data import Trial
from seatrial.identify import Loss, Problem, StudyError
from seatrial.identify.lint import lint, raise_on_errors
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.parameters import Free, near
from seatrial.ships.files import load
from seatrial.simulate import approach, simulate


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


@pytest.mark.parametrize("case", CASES)
def test_errors(problem: Problem, case: str) -> None:
    change, words = CASES[case]
    issues = lint(change(problem))
    assert any(issue.severity == "error" and words in issue.text for issue in issues), issues
    with pytest.raises(StudyError):
        raise_on_errors(issues)


def test_a_sound_problem_has_no_errors(problem: Problem) -> None:
    issues = lint(problem)
    assert [issue for issue in issues if issue.severity == "error"] == []
    assert any("kept back" in issue.text for issue in issues)


def test_white_noise_and_measured_starts_make_sigma_too_small(problem: Problem) -> None:
    sure = replace(problem, loss=Loss(correlation=0.0))
    assert any("sigma comes out too small" in i.text and i.severity == "warning" for i in lint(sure))
    assert not any("too small" in i.text for i in lint(problem))

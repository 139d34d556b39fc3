"""The first screen of a fit: errors by hand, whom to believe, what is said of cause, use and parameters."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import Fit, Verdict
from seatrial.identify.diagnosis.findings import Channel, Diagnosis
from seatrial.identify.filters import CONSTANT_VELOCITY
from seatrial.identify.posterior.verdicts import within
from seatrial.report.answer import Answer, _farther, answer, answered
from seatrial.report.blocks import plain_text
from seatrial.report.evidence import Evidence
from seatrial.ships.files import load
from seatrial.validate.comparison import compare
from seatrial.validate.metrics import reached

SHIP = load("kvlcc2_l7")
T = np.arange(0.0, 120.5, 0.5)
SIGMA = {"x": 1.0, "y": 1.0, "psi": 1.0}


def _trial(name: str = "unseen", drift: float = 0.0, turn: float = 0.0) -> Trial:
    """A straight run; a prediction drifts to starboard by `drift` [m/s] and turns by `turn` [rad/s]."""
    moved = {"x": T, "y": drift * T, "psi": turn * T, "u": np.ones(T.size), "v_m": 0.0 * T, "r": 0.0 * T}
    return Trial(name, T, moved)


def _channel(size: float) -> Channel:
    return Channel(0.01, size, 0.0, 0.01, 1.0, 100, 0.0)


def _fit(size: float = 1.0, verdicts: tuple[Verdict, ...] | None = None) -> Fit:
    free = (Free("hull.Y_v", -0.3, -1.0, 1.0), Free("hull.N_r", -0.05, -1.0, 1.0))
    known = verdicts or (Verdict("hull.Y_v", "identified", ""), Verdict("hull.N_r", "not identified", ""))
    return Fit(
        ship=SHIP, free=free, values=np.array([-0.3, -0.05]), sigma=np.array([0.03, 0.05]), covariance=np.eye(2),
        shrinkage=np.ones(2), at_bound=(), verdicts=known, history=np.zeros((1, 4)), objective=1.0, seconds=1.0,
        evaluations=1, status="converged", digest="d",
        diagnosis=Diagnosis({"x": _channel(size)}, (), {}, (), {}, ("", "")),
    )  # fmt: skip


def _evidence(fitted: float = 0.01, untuned: float = 0.02, steady: float = 0.1, *, restart: float | None = None,
              turn: float = 0.0, **more: Any) -> Evidence:  # fmt: skip
    drifts = {"fitted": fitted, "untuned": untuned, CONSTANT_VELOCITY: steady}
    found = tuple(compare(_trial(), _trial(drift=d, turn=turn), label=label, restart=restart, sigma=SIGMA)
                  for label, d in drifts.items())  # fmt: skip
    return Evidence("title", found, **{"fit": _fit(), "trained_on": ("other",), **more})


def _told(evidence: Evidence) -> Answer:
    found = answer(evidence)
    assert found is not None
    return found


def test_errors_are_those_at_the_time_and_of_the_heading_in_degrees() -> None:
    told = _told(_evidence(turn=math.radians(0.1)))
    assert list(told.errors) == ["10", "60"]
    assert told.errors["10"]["fitted"] == pytest.approx((0.1, math.radians(1.0)))
    assert told.errors["60"][CONSTANT_VELOCITY] == pytest.approx((6.0, math.radians(6.0)))
    lines = [*plain_text(told.body)]
    assert lines[1] == ("Error after 10 s: 0.10 m, 1.0° (untuned 0.20 m, 1.0°; constant velocity 1.0 m, 1.0°)")
    assert len(lines) <= 8


def test_a_prediction_that_restarts_earlier_is_told_at_its_longest() -> None:
    assert list(_told(_evidence(restart=30.0)).errors) == ["10", "30"]
    assert list(_told(_evidence(restart=5.0)).errors) == ["5"]


def test_each_start_counts_once_at_the_row_before_the_next() -> None:
    # the prediction begins anew every 30 s, without an error there
    errors = 0.1 * (T % 30.0)
    predicted = replace(_trial(), name="p").having(y=errors)
    found = reached(_trial(), predicted, 30.0, 10.0)["y"]
    assert found == pytest.approx([1.0, 1.0, 1.0, 1.0])
    assert reached(_trial(), predicted, 30.0, 30.0)["y"] == pytest.approx([2.95] * 4)
    assert reached(_trial(), predicted, None, 123.0)["y"].size == 0


@pytest.mark.parametrize("offset", [0, 1, 3])
def test_a_slow_receiver_counts_with_its_last_reading(offset: int) -> None:
    """Every 2 s on rows of half a second: the last reading until 10 s after each start, the heading at 10 s itself."""
    slow = np.arange(T.size) % 4 == offset
    measured = _trial().having(y=np.where(slow, 0.0, np.nan))
    errors = 0.1 * (T % 30.0)
    found = reached(measured, replace(_trial(), name="p").having(y=errors, psi=errors), 30.0, 10.0)
    at = [max(t for t in T[slow] - start if t <= 10.0) for start in (0.0, 30.0, 60.0, 90.0)]
    assert found["y"] == pytest.approx(0.1 * np.array(at))
    assert found["psi"] == pytest.approx([1.0] * 4)
    seldom = _trial().having(y=np.where(T % 30.0 == 0.5, 0.0, np.nan))
    assert reached(seldom, replace(_trial(), name="p").having(y=errors), 30.0, 10.0)["y"].size == 0


@pytest.mark.parametrize(("drifts", "trust", "why"), [
    ((0.01, 0.02, 0.1), "yes", "it explains 99 % of the motion after 60 s; its error stays below a ship's length"),
    ((0.03, 0.02, 0.1), "no", "'untuned' predicts these trials better"),
    ((0.2, 0.3, 0.1), "no", "'constant velocity' predicts these trials better"),
    ((0.1, 0.2, 0.5), "yes", "its error passes a ship's length within 100 s"),
    ((1e-4, 0.2, 0.5), "yes", "it explains more than 99.9 % of the motion"),
])  # fmt: skip
def test_a_fit_is_believed_as_far_as_it_predicts(drifts: tuple[float, float, float], trust: str, why: str) -> None:
    told = _told(_evidence(*drifts))
    assert told.trust == trust
    assert why in told.why


def test_a_difference_within_the_scatter_of_the_starts_is_no_defeat() -> None:
    """Student's t by hand: differences 3, -1, 1, -1 of squares have mean .5 and a standard error of .957; t is .52."""
    ours, theirs = [np.array([4.0, 1.0]), np.array([3.0, 1.0])], [np.array([1.0, 2.0]), np.array([2.0, 2.0])]
    assert not _farther(ours, theirs)
    assert _farther([4.0 * one for one in ours], theirs)  # twice as far is farther, whatever the scatter
    steady = [np.array([3.9, 2.0]), np.array([1.9, 2.9])]
    assert _farther([one + 0.9 for one in steady], steady)  # as much at each start
    assert not _farther([one + 0.05 for one in steady], steady)  # one per cent in length
    assert _farther([np.array([1.2])], [np.array([1.0])])  # a single start has no scatter
    assert not _farther(steady, ours[:1])
    missing = [np.array([math.nan, 1.0]), np.array([3.0])]
    assert not _farther(missing, [np.array([0.1, 1.0]), np.array([3.0])])


def test_a_fit_whose_priors_hold_what_is_open_is_told_what_comes_after_it() -> None:
    both = Verdict("hull.Y_v and hull.N_r", "not identified", "only hull.Y_v + hull.N_r acts: fix one of them")
    fit = _fit(verdicts=(*_fit().verdicts, both))
    held = replace(fit, free=tuple(replace(one, prior=one.start, sigma=0.1) for one in fit.free))
    assert _told(_evidence(fit=held)).further.startswith("seatrial card")
    assert _told(_evidence(0.3, fit=held)).further.startswith("seatrial design")


def test_trials_of_the_fit_prove_nothing() -> None:
    assert _told(_evidence(trained_on=("unseen",))).trust == "unknown"


def test_a_model_that_the_data_contradict_is_for_predictions_only() -> None:
    told = _told(_evidence(fit=_fit(size=50.0)))
    assert told.trust == "predictions"
    assert told.cause == "no error of an instrument that was tested: a term of the model or an input is missing"
    assert told.further.startswith("look for a term of the model")
    sound = _told(_evidence())
    assert sound.cause == "none: it looks like sensor noise"
    assert sound.further == "predict trials that the fit has not seen: seatrial validate"


def test_without_a_parameter_that_is_determined_there_are_predictions_only() -> None:
    none = tuple(Verdict(path, "not identified", "") for path in ("hull.Y_v", "hull.N_r"))
    told = _told(_evidence(fit=_fit(verdicts=none)))
    assert told.trust == "predictions"
    assert told.parameters == "0 of 2 determined by these trials; not determined: hull.Y_v, hull.N_r"


def test_parameters_are_graded_by_their_95_percent_interval() -> None:
    assert 100.0 * within(-0.3, 0.03) == pytest.approx(19.6)
    assert math.isinf(within(0.0, 1.0))
    assert _told(_evidence()).parameters == "1 of 2 determined by these trials within 20 %; not determined: hull.N_r"
    held = (Verdict("hull.Y_v", "graded", ""), Verdict("hull.N_r", "identified", ""))
    assert _told(_evidence(fit=_fit(verdicts=held))).parameters == \
        "2 of 2 determined by these trials within 20 to 196 %, if the form is right"


def test_a_combination_that_acts_alone_is_what_to_mend_first() -> None:
    both = Verdict("hull.Y_v and hull.N_r", "not identified", "only hull.Y_v + hull.N_r acts: fix one of them")
    assert _told(_evidence(fit=_fit(verdicts=(*_fit().verdicts, both)))).further == both.text


def test_purposes_are_told_by_verdict() -> None:
    told = _told(_evidence(uses={"training": "fit", "berthing": "cannot tell", "collision-avoidance": "fit"}))
    assert "Use: fit: training, collision-avoidance; cannot tell: berthing" in [*plain_text(told.body)]
    assert not any(line.startswith("Use") for line in plain_text(_told(_evidence()).body))


def test_without_a_fit_there_is_no_first_screen_and_json_gives_it_back() -> None:
    assert answer(_evidence(fit=None)) is None
    told = _told(_evidence())
    assert answered(vars(told)).body == told.body

"""What is said of parameters that have neither prior nor interval, and of combinations."""

import numpy as np
import pytest

from seatrial.core.parameters import Free
from seatrial.identify import Fit, Verdict
from seatrial.identify.posterior.verdicts import overruled, posterior, verdicts
from seatrial.identify.trajectory.gauss_newton import Normal


def said(H, free, values):
    """Verdicts by subject."""
    values = np.array(values)
    covariance, share = posterior(Normal(0.0, np.asarray(H), np.zeros(len(free))), free, values, 1.0)
    return {v.subject: v for v in verdicts(free, values, covariance, share, ())}


@pytest.mark.parametrize(("start", "value", "sigma", "status"), [
    (0.0, -9.0, 0.5, "identified"), (0.0, -9.0, 5.0, "weak"), (0.0, -9.0, 20.0, "not identified"),
    (-9.0, 0.1, 0.5, "identified"), (0.0, 0.0, 0.5, "not identified"),
])  # fmt: skip
def test_without_prior_and_bounds_a_parameter_is_measured_by_its_own_size(start, value, sigma, status):
    found = said([[sigma**-2.0]], (Free("hull.X_u", start),), [value])["hull.X_u"]
    assert found.status == status
    assert "prior" not in found.text
    one_sided = said([[sigma**-2.0]], (Free("hull.X_u", start, low=-100.0),), [value])["hull.X_u"]
    assert one_sided.status == status


def test_a_combination_that_the_data_do_not_split_is_named_whatever_the_units():
    """Only a / 1e6 + b shows, and c by itself."""
    row, alone = np.array([1e-6, 1.0, 0.0]), np.array([0.0, 0.0, 1e-9])
    H = 1e4 * (np.outer(row, row) + np.outer(alone, alone))
    found = said(H, (Free("a", 0.0), Free("b", 0.0), Free("c", 0.0)), [2e6, 3.0, 1e12])
    assert {name: v.status for name, v in found.items()} == {
        "a": "not identified", "b": "not identified", "c": "identified", "a and b": "weak",
    }  # fmt: skip
    assert "trade off against each other" in found["a and b"].text


def test_what_no_datum_touches_is_not_identified():
    found = said(np.diag([1e4, 0.0]), (Free("a", 0.0), Free("b", 0.0)), [1.0, 2.0])
    assert found["a"].status == "identified"
    assert found["b"].status == "not identified"


@pytest.mark.parametrize(("free", "value", "sigma", "status"), [
    (Free("a", 0.0, prior=0.0, sigma=3000.0), -21.0, 56.0, "not identified"),
    (Free("a", 0.0, low=-3000.0, high=3000.0), -21.0, 56.0, "not identified"),
    (Free("a", 100.0, prior=100.0, sigma=3000.0), -21.0, 56.0, "weak"),  # small beside what it began as
    (Free("a", -21.0, prior=-800.0, sigma=3000.0), -21.0, 56.0, "identified"),  # and beside what it was thought to be
    (Free("a", 0.0, prior=0.0, sigma=3000.0), -210.0, 56.0, "identified"),
    (Free("a", -210.0, prior=-210.0, sigma=60.0), -210.0, 56.0, "not identified"),  # the prior says it all
    (Free("a", -210.0, prior=-210.0, sigma=100.0), -210.0, 56.0, "weak"),
])  # fmt: skip
def test_a_wide_prior_or_interval_does_not_make_a_parameter_known(free, value, sigma, status):
    data = sigma**-2.0 - free.sigma**-2.0
    found = said([[data + free.sigma**-2.0]], (free,), [value])["a"]
    assert found.status == status
    if status == "not identified" and sigma > abs(value):
        assert "2.7 of its size, though the data removed 100% of the prior variance" in found.text


def test_what_no_data_of_a_kind_tell_is_not_identified_however_small_sigma_is():
    free = (Free("hull.Y_v", -0.3), Free("hull.N_r", -0.1))
    fit = Fit(
        ship=None, free=free, values=np.array([-0.3, -0.1]), sigma=np.full(2, 1e-3), covariance=1e-6 * np.eye(2),
        shrinkage=np.ones(2), at_bound=(), verdicts=tuple(Verdict(f.path, "identified", "well") for f in free),
        history=np.zeros((1, 4)), objective=1.0, seconds=1.0, evaluations=1, status="converged", digest="",
    )  # fmt: skip
    found = {v.subject: v for v in overruled(fit, {"hull.Y_v": "the antenna", "propeller.D_P": "a scale"}).verdicts}
    assert {name: v.status for name, v in found.items()} == {
        "hull.Y_v": "not identified", "hull.N_r": "identified", "propeller.D_P": "not identified",
    }  # fmt: skip
    assert found["hull.Y_v"].text == "well; nevertheless: the antenna"
    assert found["propeller.D_P"].text == "held, not fitted: a scale"
    assert overruled(fit, {}).verdicts == fit.verdicts

"""The free parameters as arrays: what stands for a prior or a bound that is not given, and the way back into a ship."""

import math

import casadi as ca
import numpy as np
import pytest

from seatrial.core.parameters import Free, ParameterError, read
from seatrial.identify.vector import Vector
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")
FREE = (Free("hull.Y_v", -0.3, -0.5, 0.1), Free("hull.N_v", -0.1, prior=-0.12, sigma=0.02), Free("hull.R_0", 0.02))


def test_a_parameter_without_prior_weighs_nothing_and_is_drawn_to_its_start():
    vector = Vector(FREE)
    np.testing.assert_allclose(vector.precision, np.diag([0.0, 0.02**-2.0, 0.0]), rtol=1e-15)
    np.testing.assert_array_equal(vector.mean, [-0.3, -0.12, 0.02])
    np.testing.assert_array_equal(vector.variance, [0.6**2 / 12.0, 0.02**2, math.inf])


def test_tied_priors_weigh_by_the_inverse_of_their_covariance():
    sigma, tied = np.array([0.05, 0.02, 0.003]), ((("hull.N_v", 0.9), ("hull.Y_r", 0.5)), (("hull.R_0", -0.4),), ())
    paths = ("hull.Y_v", "hull.N_v", "hull.R_0")
    each = zip(paths, sigma, tied, strict=True)
    free = [Free(path, 0.0, prior=0.0, sigma=s, tied=others) for path, s, others in each]
    covariance = np.outer(sigma, sigma) * [[1.0, 0.9, 0.0], [0.9, 1.0, -0.4], [0.0, -0.4, 1.0]]
    whole = Vector((free[0], Free("hull.N_r", -0.05, -0.09, 0.0), *free[1:]))  # one without prior; Y_r is not free
    at = np.ix_([0, 2, 3], [0, 2, 3])
    np.testing.assert_allclose(whole.precision[at] @ covariance, np.eye(3), atol=1e-12)
    assert not whole.precision[1].any()
    held = whole.held(np.zeros(4))
    np.testing.assert_allclose(held[at], whole.precision[at])
    assert held[1, 1] == 0.09**-2.0
    root = whole.root(np.full(4, 7.0))
    np.testing.assert_allclose((root @ root.T)[at], covariance, rtol=1e-12, atol=1e-18)
    assert (root @ root.T)[1].tolist() == [0.0, 49.0, 0.0, 0.0]
    # in another order, and each pair stated by the other of the two
    middle = Free("hull.N_v", 0.0, prior=0.0, sigma=0.02, tied=(("hull.Y_v", 0.9), ("hull.R_0", -0.4)))
    turned = Vector((free[2], middle, Free("hull.Y_v", 0.0, prior=0.0, sigma=0.05)))
    np.testing.assert_allclose(turned.precision[::-1, ::-1] @ covariance, np.eye(3), atol=1e-12)


@pytest.mark.parametrize(("tied", "said"), [
    ((("b", 0.9), ("c", 0.9)), "no covariance has"), ((("b", 0.1), ("b", 0.2)), "once"), ((("a", 0.1),), "different"),
])  # fmt: skip
def test_correlations_that_no_covariance_has_are_refused(tied, said):
    others = (Free("b", 0.0, prior=0.0, sigma=1.0, tied=(("c", -0.9),)), Free("c", 0.0, prior=0.0, sigma=1.0))
    with pytest.raises(ParameterError, match=said):
        Vector((Free("a", 0.0, prior=0.0, sigma=1.0, tied=tied), *others))


@pytest.mark.parametrize("given", [{"tied": (("b", 0.3),)}, {"prior": 0.0, "sigma": 1.0, "tied": (("b", 1.0),)}])
def test_only_a_prior_is_tied_and_never_for_certain(given):
    with pytest.raises(ParameterError, match="give a sigma, and a correlation"):
        Free("a", 0.0, **given)


def test_the_box_is_the_narrower_of_bounds_and_prior():
    low, high = Vector(FREE).box
    np.testing.assert_allclose(low, [-0.5, -0.18, -math.inf])
    np.testing.assert_allclose(high, [0.1, -0.06, math.inf])


def test_values_and_symbols_reach_the_model_at_their_paths():
    vector, values = Vector(FREE), np.array([-0.7, -0.2, 0.03])
    ship = vector.ship(SHIP, values)  # beyond its bound, as a search may end
    assert [read(ship.model, path) for path in vector.paths] == values.tolist()
    np.testing.assert_array_equal(vector.current(ship.model), values)
    assert vector.at_bound(values) == ("hull.Y_v",)
    p = ca.SX.sym("p", 3)
    traced = vector.model(SHIP.model, p)
    assert ca.is_equal(read(traced, "hull.N_v"), p[1])


def test_random_starts_stay_in_the_bounds_and_follow_the_seed():
    vector = Vector(FREE)
    one, two = (vector.drawn(50, np.random.default_rng(4)) for _ in range(2))
    np.testing.assert_array_equal(one, two)
    assert (one >= vector.low).all()
    assert (one <= vector.high).all()
    assert (one.std(axis=0) > 0).all()

"""The free parameters as arrays: what stands for a prior or a bound that is not given, and the way back into a ship."""

import math

import casadi as ca
import numpy as np

from seatrial.core.parameters import Free, read
from seatrial.identify.vector import Vector
from seatrial.ships.files import load

SHIP = load("kvlcc2_l7")
FREE = (Free("hull.Y_v", -0.3, -0.5, 0.1), Free("hull.N_v", -0.1, prior=-0.12, sigma=0.02), Free("hull.R_0", 0.02))


def test_a_parameter_without_prior_weighs_nothing_and_is_drawn_to_its_start():
    vector = Vector(FREE)
    np.testing.assert_array_equal(vector.precision, [0.0, 0.02**-2.0, 0.0])
    np.testing.assert_array_equal(vector.mean, [-0.3, -0.12, 0.02])
    np.testing.assert_array_equal(vector.variance, [0.6**2 / 12.0, 0.02**2, math.inf])


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

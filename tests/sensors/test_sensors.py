"""Virtual sensors: the stated noise, bias and resolution, and the same reading for the same seed."""

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.sensors import SensorError, Sensors

T = np.arange(0.0, 1000.0, 0.1)
RUN = Trial("run", T, {"u": 0.01 * T, "r": np.zeros_like(T)})


def test_noise_bias_and_resolution_are_as_stated():
    sensors = Sensors(noise={"u": 0.2}, bias={"u": 0.5, "r": -0.1}, quantum={"r": 0.03})
    read = sensors.read(RUN, np.random.default_rng(1))
    error = read["u"] - RUN["u"]
    assert np.mean(error) == pytest.approx(0.5, abs=4 * 0.2 / np.sqrt(T.size))
    assert np.std(error) == pytest.approx(0.2, rel=0.03)
    np.testing.assert_allclose(read["r"], -0.09, atol=1e-12)


def test_a_seed_makes_the_reading():
    sensors = Sensors(noise={"u": 0.2})
    one, two, other = (sensors.read(RUN, np.random.default_rng(s)) for s in (3, 3, 4))
    assert np.array_equal(one["u"], two["u"])
    assert not np.array_equal(one["u"], other["u"])


def test_impossible_sensors_are_refused():
    with pytest.raises(SensorError, match="noise of u is -1"):
        Sensors(noise={"u": -1.0})
    with pytest.raises(SensorError, match="run: no channel 'psi'"):
        Sensors(noise={"psi": 1.0}).read(RUN, np.random.default_rng(0))

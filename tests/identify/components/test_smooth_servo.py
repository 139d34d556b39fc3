"""The servo law of You 2023 Eq. 9: its exact step, and K and epsilon back from a log."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from seatrial.data import DataError, Trial
from seatrial.identify.components.smooth_servo import advanced, fit_smooth_servo

RATE, DT = 0.115, 0.2


def log(epsilon, noise=0.002, seed=0):
    """Steps of 20 degrees either way every 7 s, the angle by a stiff integrator."""
    rng, t = np.random.default_rng(seed), DT * np.arange(150)
    order = 0.35 * np.where((t // 7).astype(int) % 2, 1.0, -1.0)
    angle = [0.05]
    for k in range(len(t) - 1):
        angle.append(order[k] - float(advanced(np.array([order[k] - angle[-1]]), RATE, epsilon, DT)[0]))
    read = np.array(angle) + noise * rng.normal(size=len(t))
    return Trial(f"log {seed}", t, {"alpha_1": read, "alpha_1_cmd": order})


@pytest.mark.parametrize("epsilon", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("error", [-0.7, 0.004, 0.3])
def test_a_step_is_that_of_a_stiff_integrator(error, epsilon):
    def slope(_, e):
        return -RATE * e / np.hypot(e, epsilon)

    exact = solve_ivp(slope, (0.0, 2.0), [error], method="LSODA", rtol=1e-10, atol=1e-13).y[0, -1]
    assert advanced(np.array([error]), RATE, epsilon, 2.0)[0] == pytest.approx(exact, rel=1e-6, abs=2e-8)


def test_without_epsilon_it_turns_at_its_rate_and_stops():
    left = advanced(np.array([0.5, -0.01, 0.0]), RATE, 0.0, 1.0)
    np.testing.assert_allclose(left, [0.5 - RATE, 0.0, 0.0])


@pytest.mark.slow
@pytest.mark.parametrize("epsilon", [0.0, 0.05])
def test_both_numbers_come_back_from_noisy_logs(epsilon):
    found = fit_smooth_servo([log(epsilon, seed=k) for k in range(1)], "alpha_1")
    assert found.rate == pytest.approx(RATE, abs=max(4.0 * found.sigma[0], 2e-4))
    assert found.epsilon == pytest.approx(epsilon, abs=0.004)
    assert found.rmse == pytest.approx(0.002, rel=0.15)
    assert found.R2 > 0.999


def test_a_log_with_a_gap_is_refused():
    broken = log(0.0)
    with pytest.raises(DataError, match="without gaps"):
        fit_smooth_servo([broken.having(alpha_1=np.where(broken.t > 20.0, np.nan, 0.0))], "alpha_1")

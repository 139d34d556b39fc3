"""Bands of a model that lacks something hold on trials that nothing has seen, or they are refused."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.belief.bands.calibrating import calibrated
from seatrial.belief.bands.calibration import Calibration
from seatrial.belief.bands.held import Held, held, windows
from seatrial.belief.bands.prediction import fan
from seatrial.core.errors import RequestError
from seatrial.core.parameters import read
from seatrial.data import Trial
from seatrial.ships import Ship
from seatrial.simulate.replay import replay
from virtual_logs import left_out, log, posterior, ship

pytestmark = pytest.mark.long

HORIZONS = (4.0, 10.0, 20.0)
STILL = (0.0, 0.0)


def scaled(**factors: float) -> Ship:
    """The ship with some coefficients of its hull so many times as large."""
    truth = ship()
    return truth.moved({f"hull.{name}": factor * float(read(truth.model, f"hull.{name}"))
                        for name, factor in factors.items()})  # fmt: skip


def logs(truth: Ship, count: int, seed: int, current: tuple[float, float] = STILL) -> list[Trial]:
    rng = np.random.default_rng(seed)
    return [log(truth, k, rng, current) for k in range(count)]


def judged(found: Calibration, trials: list[Trial], level: float = 0.95) -> tuple[Held, ...]:
    """Coverage on trials, all kinds together, by horizon."""
    fans = [(fan(posterior(), found, t, replay(ship(), t, restart=20.0), level, restart=20.0, draws=200), t)
            for t in trials]  # fmt: skip
    rows = held(windows(made, t, HORIZONS) for made, t in fans)
    return tuple(row for row in rows if row.kind == "all kinds")


def share(rows: tuple[Held, ...]) -> float:
    """Mean coverage of groups and horizons."""
    return float(np.mean([value for row in rows for value in row.inside.values()]))


def test_a_true_model_with_white_noise_lacks_nothing_and_its_bands_are_those_of_its_noise() -> None:
    found = calibrated(posterior(), left_out(logs(ship(), 24, 0)))
    assert found.disturbance.current == pytest.approx(0.0, abs=2e-3)
    rows = judged(found, logs(ship(), 30, 1))
    assert 0.90 <= share(rows) <= 0.99
    for row in rows:
        assert all(row.width[name] < 4.0 * row.error[name] for name in row.width)


def test_a_force_that_the_model_lacks_is_within_its_bands() -> None:
    truth = scaled(N_r=1.3, Y_v=1.2)
    found = calibrated(posterior(), left_out(logs(truth, 24, 0)))
    assert any(one.sigma > 0 for one in found.disturbance.processes)
    rows = judged(found, logs(truth, 30, 1))
    assert 0.90 <= share(rows) <= 0.99
    assert rows[-1].width["psi"] < 5.0 * rows[-1].error["psi"]
    # the bands of a model that lacks nothing do not hold on this ship
    blind = calibrated(posterior(), left_out(logs(ship(), 24, 0)))
    assert share(judged(blind, logs(truth, 10, 1))) < 0.7


def test_one_trial_much_unlike_the_others_widens_bands_and_they_hold() -> None:
    trials = logs(ship(), 24, 0)
    odd = [*logs(scaled(N_r=3.0), 1, 7), *trials[1:]]
    new = logs(ship(), 20, 1)
    plain, wide = (judged(calibrated(posterior(), left_out(some)), new) for some in (trials, odd))
    assert share(wide) >= share(plain) - 0.01
    assert wide[-1].width["psi"] < 10.0 * plain[-1].width["psi"]


def test_trials_of_one_day_with_a_current_hold_on_a_day_when_it_flows_elsewhere() -> None:
    found = calibrated(posterior(), left_out(logs(ship(), 24, 0, (0.0, 0.1))))
    rows = judged(found, logs(ship(), 30, 1, (0.1, 0.0)))
    assert 0.88 <= share(rows) <= 0.99
    assert all(row.inside["position"] > 0.85 for row in rows)


def test_bands_of_few_trials_hold_on_unseen_ones() -> None:
    """Of a ship whose hull is not that of the model, whose trials all err alike: widths are then the harder bar."""
    truth = scaled(N_r=1.3, Y_v=1.2)
    new = logs(truth, 8, 1)
    for count in (4, 8):
        rows = judged(calibrated(posterior(), left_out(logs(truth, count, 100 * count))), new)
        assert share(rows) >= 0.90
        # over the errors; normal ones of known size need 1.96
        assert np.median([row.width[name] / row.error[name] for row in rows for name in row.width]) < 2.0 * 1.96


def test_two_trials_are_refused_before_anything_is_sailed() -> None:
    with pytest.raises(RequestError, match="too few trials to calibrate: 2 recordings, and at least 3 are needed"):
        calibrated(posterior(), left_out(logs(ship(), 2, 0), parts=2))

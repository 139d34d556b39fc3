"""The usual instruments of a ship: where they stand by a turn, how much they err by statistics, when they tell."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.environment import CHANNELS
from seatrial.sensors.suite import Suite, draught, usual
from seatrial.ships.files import load

SHIP = load("kvlcc2")
L = SHIP.L_pp
DEGREE, KNOT = math.pi / 180.0, 1852.0 / 3600.0
TRUTH = {"x": 0.0, "y": 0.0, "psi": 1.0, "u": 5.0, "v_m": 0.3, "r": 0.01, "n_P": 1.2, "delta": 0.2} | dict.fromkeys(
    CHANNELS, 0.0
)
TRUTH |= {"wind_x": 40.0, "wind_y": 3.0, "per_depth": 1.0 / 40.0}


def told(suite: Suite, seconds: float, dt: float = 0.1, **truth: float) -> dict[str, list[tuple[float, float, object]]]:
    """Time of the sample, time of the reading and values, by instrument."""
    watch, found = suite.start(4), {}
    for k in range(round(seconds / dt)):
        for reading in watch.read(k * dt, TRUTH | truth):
            found.setdefault(reading.kind, []).append((reading.t, k * dt, reading.values))
    return found


LAG = {"gnss": 0.2, "gyro": 0.05, "rate_gyro": 0.05, "speed_log": 0.1, "anemometer": 0.1, "echo_sounder": 0.1,
       "feedback": 0.05}  # fmt: skip
RATE = {"gnss": 1.0, "gyro": 10.0, "rate_gyro": 10.0, "speed_log": 1.0, "anemometer": 1.0, "echo_sounder": 1.0,
        "feedback": 5.0}  # fmt: skip


@pytest.mark.slow
def test_each_tells_at_its_rate_and_as_late_as_it_is():
    """Counted over 40 s in steps of 10 ms."""
    found = told(usual(SHIP), 40.0, dt=0.01)
    assert set(found) == set(LAG)
    for kind, rows in found.items():
        assert len(rows) == pytest.approx(40.0 * RATE[kind], abs=1.0 + LAG[kind] * RATE[kind])
        late = np.array([at - t for t, at, _ in rows])
        assert late.min() >= LAG[kind] - 1e-6
        assert late.max() < LAG[kind] + 0.011


# the standard deviation of each value, and the step of its last digit
ERRORS = {
    ("rate_gyro", "r"): (0.01 * DEGREE, 0.0), ("gyro", "psi"): (0.05 * DEGREE, 0.1 * DEGREE),
    ("gnss", "U"): (0.05, 0.1 * KNOT), ("speed_log", "u_w"): (0.03, 0.1 * KNOT),
    ("anemometer", "U_A"): (0.3, 0.1), ("anemometer", "U_T"): (math.hypot(0.3, 0.05), 0.1),
    ("echo_sounder", "below"): (0.05, 0.1), ("feedback", "delta"): (0.1 * DEGREE, 0.1 * DEGREE),
    ("feedback", "n_P"): (0.0, 0.0),
}  # fmt: skip


@pytest.fixture(scope="module")
def straight():
    """Readings of a ship on a straight course, a thousand of each of the slow instruments."""
    return told(usual(SHIP, antenna=(0.0, 0.0)), 1000.0, r=0.0)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "name"), ERRORS)
def test_each_errs_as_much_as_it_is_said_to(straight, kind, name):
    """The variance of a rounded value is that of its noise and a twelfth of its step squared."""
    noise, quantum = ERRORS[kind, name]
    read = np.array([values[name] for _, _, values in straight[kind]])
    if quantum:
        assert np.abs(read / quantum - np.round(read / quantum)).max() < 1e-6
        assert np.diff(np.unique(np.round(read / quantum))).min() == 1.0 or np.unique(read).size == 1
    wanted = math.hypot(noise, quantum / math.sqrt(12.0))
    # where a step is as large as the noise its share of the variance depends on where the truth lies in it
    slack = 4.0 / math.sqrt(2.0 * read.size) + (0.35 if quantum > 1.5 * noise else 0.02)
    assert read.std() == pytest.approx(wanted, rel=slack)


@pytest.mark.slow
def test_a_position_errs_by_noise_and_wanders_slowly(straight):
    """From second to second by noise and a step of the wandering; over minutes by sqrt(.05^2 t) more."""
    x = np.array([[values["x"], values["y"]] for _, _, values in straight["gnss"]])
    near, far = x[1:] - x[:-1], x[200:] - x[:-200]
    assert near.var() == pytest.approx(2.0 * 0.5**2 + 0.05**2, rel=4.0 * math.sqrt(2.0 / near.size) * 1.3)
    wandering = 0.05**2 * 600.0 * -math.expm1(-200.0 / 600.0)  # 2 s^2 (1 - exp(-t/T)), s^2 = walk^2 T/2
    assert 0.5 + 0.2 * wandering < far.var() < 0.5 + 3.0 * wandering


def test_they_stand_where_it_is_said():
    """In a turn at rest each moves by r times its lever: the mast 0.4 L aft, the log 0.3 L ahead; the keel is deep."""
    still = {"u": 0.0, "v_m": 0.0, "wind_x": 0.0, "wind_y": 0.0, "psi": 0.0}
    r = 2.0 / L  # so that a rounded reading is known to a thousandth of the length
    found = {kind: rows[0][2] for kind, rows in told(usual(SHIP), 1.5, r=r, **still).items()}
    assert found["speed_log"]["v_w"] == pytest.approx(0.6, abs=0.1 + 4.0 * 0.03)
    assert found["gnss"]["x"] == pytest.approx(-0.4 * L, abs=4.0 * 0.5)
    assert found["gnss"]["y"] == pytest.approx(0.0, abs=4.0 * 0.5)
    assert found["gnss"]["U"] == pytest.approx(0.8, abs=0.1 + 4.0 * 0.05)
    aside = found["anemometer"]["U_A"] * math.sin(found["anemometer"]["gamma_A"])
    assert aside == pytest.approx(-0.8, abs=0.1 + 4.0 * 0.3)
    plain = {instrument.kind: instrument for instrument in usual(SHIP).instruments}
    assert plain["anemometer"].measure(TRUTH | still | {"r": r})[1] == pytest.approx(-0.8)
    assert plain["speed_log"].measure(TRUTH | still | {"r": r})[1] == pytest.approx(0.6)
    assert found["echo_sounder"]["transducer"] == draught(SHIP) == 20.8
    assert found["echo_sounder"]["below"] == pytest.approx(40.0 - 20.8, abs=0.1 + 4.0 * 0.05)
    assert "below" not in told(usual(SHIP), 1.5, per_depth=1.0 / 260.0)["echo_sounder"][0][2]
    assert "below" in told(usual(SHIP), 1.5, per_depth=1.0 / 210.0)["echo_sounder"][0][2]


def rates(seed: tuple[int, ...]) -> tuple[float, ...]:
    watch = usual(SHIP).start(*seed)
    read = [reading for k in range(30) for reading in watch.read(0.1 * k, TRUTH) if reading.kind == "rate_gyro"]
    return tuple(reading.values["r"] for reading in read)


def test_ships_of_one_seed_err_on_their_own():
    """By their number; both defaults are the first of each."""
    assert len({rates(seed) for seed in ((0, 0), (0, 1), (1, 0))}) == 3
    assert rates(()) == rates((0, 0))

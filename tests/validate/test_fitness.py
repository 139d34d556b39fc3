"""Whether a model's errors are small enough for a use: what is judged, on what, and how sure a verdict is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from seatrial.choosing.purposes import PURPOSES
from seatrial.data import Trial
from seatrial.manoeuvres.human_random import HumanRandom
from seatrial.manoeuvres.stopping import CrashAstern
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.validate.fitness import FEWEST, FIT, NOT_FIT, OPEN, SIZE, Limit, brakes, interval, judge, shows, verdict

pytestmark = pytest.mark.slow

SHIP = load("esso_osaka_3m")
LIMIT = Limit("x", "an error", "position", 1.0, "L", "a test")


def limits(purpose: str, *keys: str) -> list[Limit]:
    """Limits of a purpose; metres are put in lengths, as the ship is a model."""
    wanted = next(one for one in PURPOSES if one.key == purpose).accuracy
    return [replace(one, size=0.05, unit="L") if one.unit == "m" else one for one in wanted if one.key in keys]


def errors(rng: np.random.Generator, trials: int, each: int, size: float) -> dict[str, tuple[float, ...]]:
    """Normal errors with a share that a trial has in common, of root mean square `size`."""
    common = rng.normal(0.0, math.sqrt(0.5), (trials, 1))
    drawn = size * (common + rng.normal(0.0, math.sqrt(0.5), (trials, each)))
    return {str(k): tuple(row) for k, row in enumerate(np.abs(drawn))}


def test_verdicts_are_seldom_wrong_for_few_trials() -> None:
    """At the limit itself either verdict is wrong; a fortieth on either side is nominal."""
    rng = np.random.default_rng(3)
    for trials, each in ((5, 6), (12, 6)):
        found = [verdict(LIMIT, errors(rng, trials, each, 1.0 / SIZE)).verdict for _ in range(150)]
        assert found.count(FIT) <= 0.08 * 150
        assert found.count(NOT_FIT) <= 0.08 * 150


def test_more_trials_decide_what_few_leave_open() -> None:
    rng = np.random.default_rng(5)
    few, many = (verdict(LIMIT, errors(rng, n, 6, 0.8 / SIZE)) for n in (6, 150))
    assert (few.verdict, many.verdict) == (OPEN, FIT)
    assert "trials are needed" in few.reason
    assert many.high - many.low < 0.5 * (few.high - few.low)


def test_scatter_counts_and_not_the_mean_alone() -> None:
    """Two models of one mean error; the one that is now right, now far off, is not fit."""
    steady = {str(k): (0.6, 0.65, 0.55) for k in range(8)}
    wild = {str(k): (0.0, 0.0, 1.8) for k in range(8)}
    assert np.mean([*steady.values()]) == pytest.approx(np.mean([*wild.values()]))
    assert verdict(LIMIT, steady).verdict == FIT
    assert verdict(LIMIT, wild).verdict == NOT_FIT


def test_few_trials_confirm_nothing_and_refute_what_is_far_off() -> None:
    for count in (1, FEWEST - 1):
        small, large = (verdict(LIMIT, {str(k): (size, size) for k in range(count)}) for size in (1e-6, 1e6))
        assert small.verdict == OPEN
        assert f"{FEWEST} are needed" in small.reason
        assert large.verdict == NOT_FIT
        assert large.low > LIMIT.size
    assert math.isnan(interval([(1.0, 2.0)])[1])
    assert verdict(LIMIT, {}).reason == "no trial shows it"
    assert verdict(LIMIT, {"berth": tuple(np.geomspace(2.8, 52.0, 39))}).verdict == NOT_FIT
    assert verdict(LIMIT, {"berth": (3.0,)}, noise=2.0).verdict == OPEN


def test_few_trials_seldom_refute_a_model_at_the_limit() -> None:
    """A fortieth is nominal where the errors of a trial are one; 1.37 limits by a single one are that."""
    rng = np.random.default_rng(8)
    for trials, each in ((1, 1), (1, 30), (3, 6)):
        found = [verdict(LIMIT, errors(rng, trials, each, 1.0 / SIZE)).verdict for _ in range(2000)]
        assert found.count(NOT_FIT) <= (0.025 + 3.0 * math.sqrt(0.025 / 2000)) * 2000
    drawn = np.abs(rng.normal(0.0, 1.0 / SIZE, 4000))
    share = np.mean([verdict(LIMIT, {"a": (e,) * 9}).verdict == NOT_FIT for e in drawn])
    assert share == pytest.approx(0.025, abs=3.0 * math.sqrt(0.025 / 4000))
    edge = 2.2414 / SIZE  # the two-sided twentieth of the normal law, in limits
    assert [verdict(LIMIT, {"a": (f * edge,)}).verdict for f in (0.999, 1.001)] == [OPEN, NOT_FIT]


def test_a_prediction_that_failed_is_an_infinite_error() -> None:
    found = verdict(LIMIT, {str(k): (0.01, math.inf if k == 0 else 0.01) for k in range(9)})
    assert found.verdict == NOT_FIT
    assert "1 predictions failed" in found.reason


def test_errors_below_the_scatter_of_the_readings_are_not_blamed_on_the_model() -> None:
    seen = {str(k): (1.5, 1.4, 1.6) for k in range(8)}
    assert verdict(LIMIT, seen).verdict == NOT_FIT
    assert verdict(LIMIT, seen, noise=2.0).verdict == OPEN
    assert "readings scatter" in verdict(LIMIT, seen, noise=2.0).reason


@pytest.fixture(scope="module")
def harbour() -> list[Trial]:
    """Dead slow, engine ahead and astern, rudder hard over."""
    return [_named(simulate(SHIP, HumanRandom(8.0, 0.6, seed=k, hold=5.0), duration=160.0, speed=0.08), f"harbour {k}")
            for k in range(6)]  # fmt: skip


@pytest.fixture(scope="module")
def open_water() -> list[Trial]:
    """Zigzags at speed, each to another angle."""
    return [_named(simulate(SHIP, Zigzag(10.0, math.radians(8.0 + k), math.radians(8.0 + k)), duration=120.0),
                   f"zigzag {k}") for k in range(6)]  # fmt: skip


def _named(trial: Trial, name: str) -> Trial:
    return replace(trial, name=name)


def test_a_model_that_is_right_at_speed_and_wrong_when_slow_is_not_fit_for_berthing(harbour, open_water) -> None:
    berthing = limits("berthing", "position", "heading")
    sea = limits("collision-avoidance", "position", "heading", "overshoot")
    wrong = SHIP.having({f"propeller.C_{k}": 0.0 for k in (3, 6, 7, 10)})  # a propeller without thrust astern
    trials = [*harbour, *open_water]
    assert judge(SHIP, trials, berthing).verdict == FIT
    assert judge(wrong, open_water, sea).verdict == FIT
    found = judge(wrong, trials, berthing)
    assert found.verdict == NOT_FIT
    assert {name for one in found.found for name in one.errors} <= {trial.name for trial in harbour}


def test_trials_show_what_was_done_in_them_and_nothing_else(harbour, open_water) -> None:
    slow, overshoot = limits("berthing", "position")[0], limits("collision-avoidance", "overshoot")[0]
    assert all(shows(slow, SHIP, trial) for trial in harbour)
    assert not any(shows(slow, SHIP, trial) for trial in open_water)
    assert all(shows(overshoot, SHIP, trial) for trial in open_water)
    assert not any(shows(overshoot, SHIP, trial) for trial in harbour)
    moored = harbour[0].having(**{name: np.zeros(len(harbour[0])) for name in ("x", "y", "psi", "u", "v_m", "r")})
    assert not shows(slow, SHIP, moored)


def test_trials_of_the_fit_are_left_out(harbour) -> None:
    names = [trial.name for trial in harbour]
    found = judge(SHIP, harbour, limits("berthing", "position"), trained_on=names[:3])
    assert found.left_out == tuple(names[:3])
    assert set(found.found[0].errors) == set(names[3:])
    assert found.verdict == OPEN


def test_the_distance_to_stop_is_that_of_a_ship_that_brakes_less() -> None:
    stop = _named(simulate(SHIP, CrashAstern(10.0, -10.0), duration=90.0), "stop")
    (rows,) = brakes(SHIP, stop)
    limit = limits("berthing", "stopping")[0]
    assert judge(SHIP, [stop], [limit]).found[0].value < 0.02
    weak = SHIP.having({"propeller.t_P": 0.5, "propeller.C_6": 0.0})
    assert judge(weak, [stop], [limit]).found[0].value > 0.05
    assert stop["u"][rows][-1] <= 0.2 * stop["u"][rows][0]
    unknown = {name: np.full(len(stop), np.nan) for name in ("n_P", "n_P_cmd")}
    assert not brakes(SHIP, stop.having(**unknown)), "a gap in the log is no order"


def test_an_overshoot_is_that_of_one_reversal(open_water) -> None:
    """A ship with less yaw damping swings on; its errors do not add up from one reversal to the next."""
    limit = limits("collision-avoidance", "overshoot")[0]
    lively = SHIP.having({"hull.N_r": -0.04})
    found = [judge(ship, open_water, [limit]).found[0] for ship in (SHIP, lively)]
    assert found[0].value < 0.01
    assert 0.1 < found[1].value < 20.0
    each = np.array([some[:2] for some in found[1].errors.values()])
    assert np.all(each[:, 1] < 3.0 * each[:, 0] + 0.5)

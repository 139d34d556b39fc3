"""A calibration of a few logs of a virtual ship in currents: each of its parts against that part by itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from seatrial.belief.bands.beginnings import _DOUBTS, _past, _predicted, _unlikely, by_history
from seatrial.belief.bands.calibrating import Withheld, spread_of
from seatrial.belief.bands.calibration import POWERS, Calibration
from seatrial.belief.bands.learning import by_trial, joined, learned
from seatrial.belief.bands.past import LAWS, Filter
from seatrial.belief.coverage import Reference
from seatrial.data import Trial
from seatrial.manoeuvres.reading import after
from seatrial.manoeuvres.told import seen
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import STATES
from seatrial.simulate.approach import time_step
from seatrial.simulate.run import simulate
from seatrial.study.grounds import trial_digest
from virtual_logs import NOISE, left_out, log, posterior, ship

pytestmark = pytest.mark.slow

CURRENT, SPAN = 0.08, 10.0


@pytest.fixture(scope="module")
def logs() -> list[Trial]:
    rng = np.random.default_rng(7)
    return [log(ship(), k, rng, tuple(CURRENT * rng.standard_normal(2))) for k in range(6)]


@pytest.fixture(scope="module")
def withheld(logs: list[Trial]) -> Withheld:
    return Withheld.of(posterior(), left_out(logs, parts=2), longest=20.0)


@pytest.fixture(scope="module")
def measured(withheld: Withheld) -> Calibration:
    return withheld.measured()


def test_each_part_is_judged_by_what_the_other_lacks(withheld: Withheld, logs: list[Trial]) -> None:
    assert withheld.trials == (*logs[::2], *logs[1::2])
    assert withheld.dt == pytest.approx(0.5)
    assert withheld.sigma == pytest.approx([NOISE[name] for name in STATES], rel=0.15)
    assert withheld.horizons[-1] <= 20.0
    first, second = withheld.parts
    for lacks, other in zip(withheld.lacks, (second, first), strict=True):
        again = learned(ship(), other.cut.error, other.found, by_trial(other.cut.trials))
        assert lacks == again
    # three currents a part: one component of .08 m/s each, the t law of four degrees takes it for .75 of its variance
    assert all(0.3 * CURRENT < lacks.current < 2.0 * CURRENT for lacks in withheld.lacks)


def test_a_calibration_holds_the_windows_of_each_part(withheld: Withheld, measured: Calibration) -> None:
    found = measured
    cut = joined([part.cut for part in withheld.parts])
    assert found.begin == "measured"
    assert found.left.trials == cut.trials == found.left.groups
    assert found.left.kinds == cut.kinds
    assert np.array_equal(found.left.error, cut.error, equal_nan=True)
    spreads = [spread_of(part.out, part.cut.lanes, lacks, withheld.sigma)[:, part.cut.rows]
               for part, lacks in zip(withheld.parts, withheld.lacks, strict=True)]  # fmt: skip
    assert found.left.spread == pytest.approx(np.concatenate(spreads))
    assert found.trials == {trial.name: trial_digest(trial) for trial in withheld.trials}
    assert found.noise == pytest.approx(withheld.sigma)
    both = withheld.parts
    every = replace(both[0].found, known=np.concatenate([one.found.known for one in both]),
                    unit=np.concatenate([one.found.unit for one in both], axis=1))  # fmt: skip
    assert found.disturbance == learned(ship(), cut.error, every, by_trial(cut.trials))
    # the draws know how far off a current takes the ship: errors over spreads are about one
    size = np.sqrt(np.nanmean((found.left.error / found.left.spread) ** 2, axis=(0, 1)))
    assert (size[:2] > 0.4).all()
    assert (size[:2] < 2.5).all()


def test_novelty_of_a_window_is_by_the_trials_of_the_other_part(withheld: Withheld, measured: Calibration) -> None:
    assert measured.left.novelty is not None
    assert measured.reference is not None
    own, low = list[float](), 0
    for part, other in zip(withheld.parts, withheld.parts[::-1], strict=True):
        seen = Reference.of(other.out.trials, ("u", "v_m", "r", "n_P", "delta"))
        for trial in part.out.trials:
            last = np.flatnonzero([name == trial.name for name in part.cut.trials])[0]
            span = slice(0, round(withheld.horizons[-1] / withheld.dt))
            rows = np.column_stack([trial[name] for name in seen.channels])[span]
            own.append(float(np.mean(seen.novelty(rows)) / measured.left.novelty[low + last, -1]))
        low += len(part.cut.trials)
    # the trial itself is near its prediction, and its apparent wind is its motion
    assert np.median(own) == pytest.approx(1.0, rel=0.3)
    every = measured.reference.points
    assert len(every) == pytest.approx(sum(len(trial) for trial in withheld.trials) / 2, rel=0.05)  # one a second
    assert measured.novel in POWERS


def test_indices_of_left_out_manoeuvres_are_those_of_the_loop(withheld: Withheld, measured: Calibration) -> None:
    found = measured.indices
    assert found is not None
    assert set(found.kinds) == {"turning", "zigzag"}
    trial = next(one for one in withheld.trials if one.meta["kind"] == "turning")
    policy = seen(trial)
    assert policy is not None
    assert not isinstance(policy, Zigzag)
    run = after(trial, float(policy.delta))
    start = tuple(float(run[name][0]) for name in STATES)
    again = simulate(ship(), policy, start=start, duration=1.3 * run.duration, dt=time_step(ship()))
    read, sailed = (policy.indices(one, ship().L_pp) for one in (run, again))
    rows = [k for k, name in enumerate(found.groups) if name == trial.name]
    assert rows
    for k in rows:
        name = found.names[k]
        assert found.error[k] == pytest.approx(sailed[name].value - read[name].value, abs=0.3 * found.spread[k])
        assert found.spread[k] > 0.0
    # an advance is off by a current in the time it takes, some 10 s: not by ten times that
    some = [abs(found.error[k]) for k in range(len(found.names)) if found.names[k] == "advance"]
    assert max(some) < 10.0 * CURRENT * 60.0


def test_a_past_is_read_before_each_start_and_told_by_the_law_that_errs_least(withheld: Withheld) -> None:
    found = by_history(withheld, SPAN)
    assert found.begin == "history 10"
    whole = [Filter.of(ship(), lacks, withheld.sigma, SPAN) for lacks in withheld.lacks]
    sizes = {one: _unlikely(withheld, [replace(who, doubt=one) for who in whole]) for one in _DOUBTS}
    assert found.doubt == min(sizes, key=lambda one: sizes[one])
    usual, errors, surprise, names = {}, {law: [] for law in LAWS}, 0.0, []
    for part, who in zip(withheld.parts, whole, strict=True):
        filters = replace(who, doubt=found.doubt)
        past = _past(filters, part, withheld.dt)
        known = past.seconds >= 0.5 * SPAN - 1e-6
        cut, some = part.cut.some(known), past.rows(known)
        names += cut.trials
        surprise = max(surprise, float(some.surprise.max()))
        for law in LAWS:
            errors[law].append(_predicted(filters, cut.lanes, some, law)[:, cut.rows] - cut.measured)
    assert found.left.trials == tuple(names)
    assert found.surprise == pytest.approx(surprise)
    weight = by_trial(names)[:, None, None]
    for law in LAWS:
        error = np.concatenate(errors[law])
        known = np.isfinite(error)
        mean = (weight * np.where(known, error, 0.0) ** 2).sum(axis=0) / (weight * known).sum(axis=0)
        mean[:, :2] = mean[:, :2].mean(axis=1, keepdims=True)
        usual[law] = float(np.log(np.sqrt(mean)).mean())
    assert found.law == min(LAWS, key=lambda law: usual[law])
    assert np.array_equal(found.left.error, np.concatenate(errors[found.law]), equal_nan=True)
    # a current that lasts is read off the past: positions err less than without it, and so are their spreads
    bare = joined([part.cut for part in withheld.parts])
    plain = np.nanmean(bare.error[:, -1, :2] ** 2)
    assert np.nanmean(found.left.error[:, -1, :2] ** 2) < plain

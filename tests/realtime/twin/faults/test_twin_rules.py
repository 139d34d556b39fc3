"""Rules of a twin on tiny inputs: when forecasts are judged, what each fault weighs, what the log shows by itself."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from linear_ship import CHANNELS, machine
from seatrial.data import Trial
from seatrial.data.formats.nmea import Aboard, Place
from seatrial.environment import CHANNELS as AROUND
from seatrial.identify import StudyError
from seatrial.identify.filters.augmented import SLOW as FORCES
from seatrial.identify.nuisance import CURRENT
from seatrial.models import STATES
from seatrial.realtime.twin import live as live_module
from seatrial.realtime.twin import sources
from seatrial.realtime.twin.ahead import HORIZONS, LEVEL, Score, Trust, lasting
from seatrial.realtime.twin.card import alarm, page, parameters, unseen
from seatrial.realtime.twin.faults.acting import Acting, Override
from seatrial.realtime.twin.faults.alarms import (
    CLOCK,
    DEEPER,
    FROZEN,
    STEERING,
    UNEXPLAINED,
    WRONG,
    Alarm,
    Judge,
    alarm_of,
    matters,
    possible,
)
from seatrial.realtime.twin.faults.stuck import FOLLOWS, JAMMED, SLOW, Repeats, Steering, steerings
from seatrial.realtime.twin.faults.suspects import (
    CARRIED,
    FORM,
    GROWS,
    IMPULSE,
    JUMP,
    LATE,
    LAZY,
    LOST,
    MISREAD,
    RAMP,
    RESISTED,
    REVERSED,
    SCALED,
    STUCK,
    Bank,
    Evidence,
    Suspect,
    pace,
    suspects,
)
from seatrial.realtime.twin.follow import Step, _midship, begun, inverse_of, surprise, without
from seatrial.realtime.twin.likely import FACTORS, NOISIER
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.saved import learnt, load_state, save_state
from seatrial.realtime.twin.settings import MHE, NOISE, SPEED, Seaway, noisier, scaled, usual
from seatrial.realtime.twin.sources import Ear, channels_of, noise_of
from seatrial.realtime.twin.tally import Hour, Tally
from seatrial.realtime.twin.waves import Swell
from seatrial.ships.files import load
from shown import aligned, tables

SHIP = load("kvlcc2")
ALL = ("x", "y", "psi", "r", "u_w", "v_north", "v_east", "n_P", "delta")


# --- what acts ---


def acting(turning: bool = False) -> Acting:
    controls = ("n_P", "alpha_1") if turning else ("n_P", "delta")
    model: Any = SimpleNamespace(controls=controls, stands_for=tuple((name, 1.0) for name in controls))
    return Acting(model, ())


@pytest.mark.parametrize("half", [{"U_T": 9.0}, {"gamma_T": 1.0}, {"U_A": 9.0}, {"gamma_A": 1.0}, {"U_C": 2.0},
                                  {"gamma_C": 1.0}, {"H_S": 3.0}, {"gamma_W": 1.0},
                                  {"U_T": 9.0, "gamma_T": math.nan}, {"U_A": 9.0, "gamma_A": math.nan},
                                  {"U_C": 2.0, "gamma_C": math.nan}, {"H_S": math.nan, "gamma_W": 1.0},
                                  {"T_W": math.nan}, {"depth": 0.0}, {"depth": -3.0}])  # fmt: skip
def test_a_vector_of_which_half_is_missing_changes_nothing(half: dict[str, float]) -> None:
    one = acting()
    one.heed({"U_T": 3.0, "gamma_T": 0.5, "U_C": 1.0, "gamma_C": 2.0, "H_S": 1.5, "gamma_W": 1.0, "T_W": 7.0,
              "depth": 20.0}, None)  # fmt: skip
    before = one.now.copy()
    one.heed(half, np.array([0.0, 0.0, 0.3, 5.0, 0.2, 0.0]))
    np.testing.assert_array_equal(one.now, before)


def test_surroundings_are_calm_until_they_are_logged_and_stay_over_a_row() -> None:
    one = acting()
    assert one.now[2:].tolist() == [0.0] * len(AROUND)
    assert np.isnan(one.now[:2]).all()
    one.heed({"n_P": 1.0, "delta": 0.1}, None)
    assert one.known
    before = one.now.copy()
    one.heed({"n_P": 3.0, "U_T": 8.0, "gamma_T": 0.0}, None)
    between = one.between(before)
    assert between[0] == 2.0  # the mean of both rows
    assert between[1] == 0.1
    assert between[2:].tolist() == [0.0] * len(AROUND)  # weather holds until the row that tells another


def test_a_thruster_turns_the_shorter_way_between_rows() -> None:
    one = acting(turning=True)
    one.heed({"n_P": 1.0, "alpha_1": 3.0}, None)
    before = one.now.copy()
    one.heed({"alpha_1": -3.0}, None)
    assert math.remainder(one.between(before)[1] - math.pi, math.tau) == pytest.approx(0.0)


# --- when a forecast is judged, and by what ---


@dataclass(frozen=True)
class Mark:
    """A ship that goes straight at (u, v) on psi, as `Trust` sees a follower; its forecasts are off by `off` north.

    Its states end with a current north, which carries forecasts on with it.
    """

    t: float
    mean: np.ndarray
    machine: Any
    cov: np.ndarray

    def ahead(self, t: float, acting: Any, step: float) -> tuple[Mark, None]:
        return replace(self, t=t, mean=self.machine.traced.onward(self.mean, acting, t - self.t)[0]), None


def mark(
    t: float, psi: float = 0.4, u: float = 5.0, v: float = -0.5, off: float = 0.0, sd: float = 0.0,
    carried: float = 0.0, log: bool = True, true: float = 0.0,
) -> Mark:  # fmt: skip
    H = np.eye(2, 7)
    model = SimpleNamespace(channels=("x", "y"), noise=np.array([0.3, 0.3]), read=lambda z, a: (H @ z, H.T))
    c, s = math.cos(psi), math.sin(psi)

    def onward(state: np.ndarray, acting: Any, span: float) -> tuple[np.ndarray]:
        way = np.array([state[3] * c - state[4] * s + off + state[6], state[3] * s + state[4] * c])
        return (np.array([*(state[:2] + span * way), *state[2:]]),)

    settings = SimpleNamespace(step=1.0, sensors={SPEED: None} if log else {}, memory=dict.fromkeys(FORCES, 100.0),
                               free=())  # fmt: skip
    here = SimpleNamespace(settings=settings, traced=SimpleNamespace(model=model, onward=onward), channels=("x", "y"),
                           names=(*STATES, CURRENT[0]))  # fmt: skip
    mean = np.array([t * (u * c - v * s + true), t * (u * s + v * c), psi, u, v, 0.0, carried])
    return Mark(t, mean, here, np.eye(7) * sd**2)


def told(last: int, every: int = 1, gap: tuple[int, int] = (0, 0), **how: float) -> Trust:
    """Rows of a second, a fix each `every` of them but none in the gap."""
    trust = Trust()
    for t in range(last + 1):
        at = mark(float(t), **how)
        fixed = t % every == 0 and not gap[0] < t < gap[1]
        trust.note(at, np.zeros(10), at.mean[:2] if fixed else np.full(2, math.nan))  # type: ignore[arg-type]
    return trust


def test_a_forecast_begins_each_minute_and_is_judged_at_each_horizon() -> None:
    """Of forecasts from 0, 60, 120, ... 600 s, those whose horizon is over by 630 s: 11, 9 and 1."""
    found = told(630)
    assert found.every == 60.0
    assert [found.scores[h].count for h in HORIZONS] == [11, 9, 1]
    assert HORIZONS == (30.0, 120.0, 600.0)
    assert LEVEL == 0.9
    for h in HORIZONS:
        score = found.scores[h]
        assert (score.rms, score.rival, score.held) == pytest.approx((0.0, 0.0, 1.0), abs=1e-6)


@pytest.mark.parametrize(("first", "judged"), [(44, 1), (45, 1), (46, 0), (59, 0)])
def test_a_fix_up_to_half_a_horizon_late_judges_and_a_later_one_does_not(first: int, judged: int) -> None:
    """That from 0 s over 30 s, whose first fix comes at `first`; until then there is none."""
    assert told(first, gap=(1, first)).scores[30.0].count == judged


def test_a_forecast_that_drifts_misses_by_its_drift_and_the_rival_of_an_even_course_by_nothing() -> None:
    """Off by .2 m/s north: 6 m after 30 s and 24 m after 120 s, far beyond bands of the noise of .3 m."""
    found = told(130, off=0.2)
    assert found.scores[30.0].rms == pytest.approx(6.0)
    assert found.scores[120.0].rms == pytest.approx(24.0)
    assert found.scores[30.0].rival == pytest.approx(0.0, abs=1e-6)
    assert found.scores[30.0].held == pytest.approx(0.5)  # east is right
    assert found.scores[30.0].count == 2


@pytest.mark.parametrize(("drift", "held"), [(0.0163, 1.0), (0.0167, 0.5)])
def test_bands_are_of_the_noise_of_the_fix_and_the_spread_together(drift: float, held: float) -> None:
    """No spread: 1.6449 x .3 m = .4935 m are reached after 30 s at .01645 m/s."""
    assert told(31, off=drift).scores[30.0].held == held


def test_a_spread_widens_the_bands() -> None:
    wide = 1.6449 * math.hypot(0.3, 0.4)
    assert [told(31, off=f * wide / 30.0, sd=0.4).scores[30.0].held for f in (0.99, 1.01)] == [1.0, 0.5]


# --- how much of what was learnt lasts ---


def memory(count: int) -> float:
    """How many of so many are remembered, each one by a sixteenth less with the next."""
    return sum((15.0 / 16.0) ** k for k in range(count))


@pytest.mark.slow
def test_what_has_gone_is_carried_on_no_more_and_what_lasts_is() -> None:
    """A current of .2 m/s that the twin still believes in: 6 m after 30 s; forecasts of the truth need none of it."""
    gone, there = told(1300, carried=0.2), told(1300, carried=0.2, true=0.2)
    for h in HORIZONS:
        whole = gone.scores[h].count * (0.2 * h) ** 2
        if h > 60.0:
            whole = gone.scores[h].ways[2]
        else:
            whole *= gone.scores[h].alone / gone.scores[h].count
        assert gone.scores[h].ways == pytest.approx([0.0, 0.0, whole, 0.0, 0.0], abs=1e-6)
        assert there.scores[h].ways == pytest.approx([0.0, 0.0, whole, 0.0, whole], abs=1e-6)
        # beside 16 that had the share of the next shorter horizon; those begun within another count with it
        alone = memory(1 + (gone.scores[h].count - 1) // max(round(h / 60.0), 1))
        assert gone.scores[h].alone == pytest.approx(alone)
        left = np.prod([16.0 / (16.0 + gone.scores[k].alone) for k in HORIZONS if k <= h])
        assert lasting(gone.scores, mark(0.0).machine)[h][1] == pytest.approx(left)
        assert lasting(there.scores, mark(0.0).machine)[h][1:] == pytest.approx((1.0, 1.0))
    # forecasts of 30 s begin each minute, and know those that have ended
    known = [16.0 / (16.0 + memory(k)) for k in range(22)]
    assert gone.scores[30.0].rms == pytest.approx(6.0 * np.sqrt(np.mean(np.square(known))))
    assert there.scores[600.0].rms == pytest.approx(0.0, abs=1e-6)


def test_shares_are_those_of_least_squares_and_within_bounds() -> None:
    """Without a log what was carried fades over the memory of forces from one horizon to the next, until shown."""
    here, without_log = mark(0.0).machine, mark(0.0, log=False).machine
    fresh = {h: Score() for h in HORIZONS}
    # what parameters were learnt is carried no further than anything has been shown for
    assert list(lasting(fresh, here).values()) == [(1.0, 1.0, 1.0), (0.0, 1.0, 1.0), (0.0, 1.0, 1.0)]
    faded = np.array(list(lasting(fresh, without_log).values()))
    assert faded == pytest.approx(np.array([[1.0, 1.0, 1.0], [0.0, math.exp(-0.9), 1.0], [0.0, math.exp(-5.7), 1.0]]))
    rng, some = np.random.default_rng(4), {h: Score() for h in HORIZONS}
    ways = rng.standard_normal((200, 2, 2)) @ [[1.0, 0.4], [0.0, 3.0]]
    for k, (first, second) in enumerate(ways):
        some[120.0].note(first, second, 0.7 * first + 0.2 * second, 1.0, (200.0 * k, 200.0 * k + 120.0))
    found, alone = lasting(some, here), memory(200)
    assert some[120.0].alone == pytest.approx(alone)
    assert found[30.0] == (1.0, 1.0, 1.0)
    weight = np.repeat((15.0 / 16.0) ** np.arange(199, -1, -1), 2)
    table = ways.transpose(1, 0, 2).reshape(2, -1).T
    square = (table * weight[:, None]).T @ table
    doubt = np.diag(16.0 / alone * np.diagonal(square))
    expected = [min(alone / 16.0, 1.0), 1.0]  # those of 30 s, to the power of four
    wanted = np.linalg.solve(square + doubt, square @ [0.7, 0.2] + doubt @ expected)
    assert found[120.0][:2] == pytest.approx(tuple(wanted))
    assert found[600.0] == (0.0, found[120.0][1], 1.0)
    for off, share in ((1e3, 1.0), (-1e3, 0.0)):
        one = {30.0: Score()}
        one[30.0].note(np.array([0.0, 1.0]), np.array([1.0, 0.0]), np.array([off, -off]), 1.0, (0.0, 30.0))
        assert lasting(one, here)[30.0][:2] == (1.0 - share, share)


def test_what_parameters_add_fades_as_shorter_horizons_show_and_grows_never() -> None:
    """Half is left after 30 s, so a sixteenth is expected after 120 s; as many forecasts show all of it."""
    here, scores, way = mark(0.0).machine, {h: Score() for h in HORIZONS}, np.array([2.0, 1.0])
    for k in range(3000):
        for h, share in ((30.0, 0.5), (120.0, 1.0)):
            scores[h].note(way, np.zeros(2), share * way, 1.0, (200.0 * k, 200.0 * k + h))
    found = lasting(scores, here)
    half = (0.5 + 1.0) / 2.0
    assert found[30.0][0] == pytest.approx(half, abs=1e-3)  # as many of before that had all of it
    assert found[120.0][0] == pytest.approx(min((half**4 + 1.0) / 2.0, half), abs=1e-3)
    scores[30.0] = Score()
    for k in range(3000):
        scores[30.0].note(way, np.zeros(2), 0.0 * way, 1.0, (200.0 * k, 200.0 * k + 30.0))
    assert [lasting(scores, here)[h][0] for h in (30.0, 120.0)] == pytest.approx([0.5, 0.5], abs=1e-3)  # not .53
    scores[120.0] = Score()
    for k in range(3000):
        scores[120.0].note(way, np.zeros(2), 0.1 * way, 1.0, (200.0 * k, 200.0 * k + 120.0))
    assert lasting(scores, here)[120.0][0] == pytest.approx((0.5**4 + 0.1) / 2.0, abs=1e-3)


@pytest.mark.parametrize(("spans", "alone"), [
    (((0.0, 60.0), (0.0, 60.0)), 1),
    (((0.0, 60.0), (60.0, 120.0)), 2), (((0.0, 60.0), (59.9, 119.0)), 1), (((5.0, 60.0), (4.0, 64.0)), 2),
    (((0.0, 60.0), (30.0, 90.0), (61.0, 121.0), (90.0, 150.0)), 2),
])  # fmt: skip
def test_forecasts_that_overlap_count_once(spans: tuple[tuple[float, float], ...], alone: int) -> None:
    """One that begins before the last one began is of another log."""
    score = Score()
    for span in spans:
        score.note(*np.ones((3, 2)), 1.0, span)
    assert score.alone == pytest.approx(memory(alone))
    assert score.count == len(spans)


def test_bands_widen_by_what_they_missed_until_they_hold_what_they_state() -> None:
    """Adaptive conformal: nine in ten hold in the long run, and never narrower than the filter's."""
    def width() -> float:
        return lasting({30.0: score}, mark(0.0).machine)[30.0][2]

    score = Score()
    for _ in range(20):
        score.note(*np.zeros((3, 2)), 1.0, (0.0, 30.0))
    assert width() == 1.0
    score.note(*np.zeros((3, 2)), 0.5, (0.0, 30.0))
    assert width() == pytest.approx(math.exp(0.2 * 0.4))
    score.note(*np.zeros((3, 2)), 1.0, (0.0, 30.0))
    assert width() == pytest.approx(math.exp(0.2 * 0.3))
    rng, held = np.random.default_rng(1), list[float]()
    for _ in range(2000):
        off = 3.0 * rng.standard_normal(2)  # bands state a third of it
        held.append(float(np.mean(np.abs(off) <= 1.6449 * width())))
        score.note(*np.zeros((3, 2)), held[-1], (0.0, 30.0))
    assert np.mean(held[100:]) == pytest.approx(LEVEL, abs=0.01)


def test_bands_are_no_narrower_than_over_a_shorter_horizon() -> None:
    """What goes wrong is seen first over the shorter one."""
    scores = {h: Score(wider=wider) for h, wider in zip(HORIZONS, (0.1, 0.5, 0.3), strict=True)}
    found = lasting(scores, mark(0.0).machine)
    assert [found[h][2] for h in HORIZONS] == pytest.approx([math.exp(one) for one in (0.1, 0.5, 0.5)])


def test_bands_that_were_widened_judge_the_next_forecasts() -> None:
    trust = told(31, off=0.0167)
    assert trust.scores[30.0].held == 0.5  # just beyond, as above
    for t in range(32, 95):
        at = mark(float(t), off=0.0167)
        trust.note(at, np.zeros(10), at.mean[:2])  # type: ignore[arg-type]
    assert trust.scores[30.0].held == 0.75


def test_a_score_is_a_root_mean_square_and_a_share_of_both_coordinates() -> None:
    some = Score(4, [36.0, 100.0], 6)
    assert (some.rms, some.rival, some.held) == (3.0, 5.0, 0.75)
    assert all(math.isnan(one) for one in (Score().rms, Score().rival, Score().held))


def test_where_fixes_are_rare_a_forecast_waits_until_one_is_near_its_horizon() -> None:
    """Fixes each 40 s: from 40 k + 10 s on the next fix but one ends 30 s; those that begin elsewhere would miss it."""
    found = told(1000, every=40)
    assert found.scores[30.0].count >= 10
    assert found.scores[30.0].rms == pytest.approx(0.0, abs=1e-6)


# --- which fault is named ---


def evidence(cause: str, score: float, how: str = JUMP, size: tuple[float, ...] = (5.0,)) -> Evidence:
    what = ("y" if cause == "b" else "x",) * len(size)
    return Evidence(Suspect(cause, how, what, (10.0,) * len(size), "m"), score, 7.0, size, (0.1,), 0.2)


@pytest.mark.parametrize(("size", "counts"), [((0.99,), False), ((1.0,), True), ((-1.0,), True), ((0.5, 1.01), True),
                                              ((0.5, -0.9), False)])  # fmt: skip
def test_a_fault_matters_from_a_tenth_of_its_usual_size_on_in_any_direction(size: Any, counts: bool) -> None:
    assert matters(evidence("a", 60.0, size=size)) is counts


def test_in_waves_evidence_has_to_last_over_a_whole_one() -> None:
    judge, fixed = Judge(10.0), evidence("a", 60.0, REVERSED, (0.0,))
    judge.wave = 14.0
    assert [t for t in (0.0, 2.5, 7.0, 13.9, 14.0) if judge.named(t, [fixed]) is not None] == [14.0]
    judge.clear()
    assert judge.named(20.0, [fixed]) is None
    assert judge.named(27.0, [evidence("a", 1.0, REVERSED, (0.0,))]) is None  # the other half of the wave
    assert judge.named(34.0, [fixed]) is None


def test_a_known_size_matters_however_small_and_thrust_is_lost_and_not_found() -> None:
    judge = Judge(10.0)
    fixed = evidence("a", 60.0, REVERSED, (0.0,))
    assert judge.named(0.0, [fixed]) is None
    assert judge.named(2.5, [fixed]) is not None
    assert possible(evidence("a", 60.0, LOST, (1.5,)))
    assert not possible(evidence("a", 60.0, LOST, (-1.5,)))
    assert possible(evidence("a", 60.0, JUMP, (-1.5,)))


@pytest.mark.parametrize(("since", "counts"), [(119.0, False), (121.0, True)])
def test_a_slow_ramp_matters_once_it_has_gone_as_far_as_a_quick_one(since: float, counts: bool) -> None:
    """Half of a tenth of its usual rate, after twice the time; a jump of that size does not."""
    assert matters(evidence("a", 60.0, RAMP, (0.5,)), since) is counts
    assert not matters(evidence("a", 60.0, JUMP, (0.5,)), since)


def test_the_best_decides_and_not_the_next_one_where_it_is_too_small_to_matter() -> None:
    judge = Judge(10.0)
    both = [evidence("a", 60.0, JUMP, (0.5,)), evidence("b", 45.0, JUMP, (5.0,))]
    assert [judge.named(t, both) for t in (0.0, 10.0, 50.0)] == [None] * 3


@pytest.mark.parametrize(("score", "crossed"), [(10.0, True), (9.99, False)])
def test_the_limit_itself_is_reached(score: float, crossed: bool) -> None:
    judge = Judge(10.0)
    judge.named(3.0, [evidence("a", score)])
    assert (judge.crossed == 3.0) is crossed


@pytest.mark.parametrize(("behind", "at_once"), [(9.99, False), (10.0, True)])
def test_a_lead_of_ten_names_at_once(behind: float, at_once: bool) -> None:
    judge = Judge(10.0)
    both = [evidence("a", 60.0), evidence("b", 60.0 - behind)]
    judge.named(100.0, both)
    assert (judge.named(103.0, both) is not None) is at_once
    assert judge.named(110.0, both) is None or at_once
    assert judge.named(120.0, both) is not None


def waited(*both: Evidence) -> float:
    """How long a judge waits that looks each second [s]."""
    judge = Judge(10.0)
    return next(t for t in np.arange(0.0, 90.0).tolist() if judge.named(t, both) is not None)


@pytest.mark.parametrize(("first", "second", "seconds"), [
    (("a", JUMP, "x"), ("b", JUMP, "y"), 20.0), (("a", JUMP, "x"), ("b", RAMP, "x"), 40.0),
    (("a", LOST, "n_P"), ("b", SCALED, "n_P"), 20.0), (("a", LOST, "n_P"), (WRONG, FORM, "model"), 40.0),
    (("a", LOST, "n_P"), (RESISTED, IMPULSE, "slow.u"), 40.0), ((RESISTED, GROWS, "slow.u"), (WRONG, FORM, "m"), 40.0),
    (("a", MISREAD, "delta"), (WRONG, FORM, "model"), 20.0), ((WRONG, FORM, "model"), ("b", JUMP, "x"), 35.0),
])  # fmt: skip
def test_how_an_instrument_is_wrong_and_whether_it_is_thrust_or_hull_is_worth_a_wait(
    first: tuple[str, str, str], second: tuple[str, str, str], seconds: float
) -> None:
    """Looks come a quarter later each time, so that a name comes at the first one after the wait."""
    both = [Evidence(Suspect(cause, how, (what,), () if how == FORM else (0.1,), "1"), score, 7.0,
                     () if how == FORM else (0.2,), (), 0.2)
            for (cause, how, what), score in ((first, 60.0), (second, 55.0))]  # fmt: skip
    assert seconds <= waited(*both) < 1.3 * seconds


def test_more_resistance_is_told_before_a_shaft_that_it_cannot_be_told_from() -> None:
    def both(slow: float, turns: float) -> tuple[Evidence, ...]:
        shaft = Evidence(Suspect("n_P sensor jumped", SCALED, ("n_P",), (0.1,), "1"), 60.0, 7.0, (turns,), (0.1,), 0.2)
        force = Suspect(RESISTED, IMPULSE, ("slow.u",), (1.0,), "m/s^2")
        return shaft, Evidence(force, 57.0, 7.0, (slow,), (0.1,))

    def said(some: tuple[Evidence, ...]) -> tuple[str, tuple[str, ...]]:
        judge = Judge(10.0)
        found = next(one for t in np.arange(0.0, 90.0).tolist() if (one := judge.named(t, some)) is not None)
        return found[0].suspect.cause, found[1]

    assert said(both(-1.0, 0.2)) == (RESISTED, ("n_P sensor jumped",))
    assert said(both(1.0, -0.2)) == ("n_P sensor jumped", (RESISTED,))  # a hull does not become easier to drive


@pytest.mark.parametrize(("behind", "rivals"), [(3.99, ("b",)), (4.0, ())])
def test_causes_within_four_cannot_be_told_apart(behind: float, rivals: tuple[str, ...]) -> None:
    judge = Judge(10.0)
    both = [evidence("a", 60.0), evidence("b", 60.0 - behind), evidence("b", 60.0 - behind)]
    judge.named(50.0, both)
    found = judge.named(70.0, both)
    assert found is not None
    assert found[1] == rivals


def test_an_alarm_in_words_and_numbers() -> None:
    both = Alarm("position jumped", JUMP, ("x", "y"), 61.4, 70.0, (12.3456, -4.0), "m", 30.0, ("a", "b"))
    assert both.text == "position jumped by 12.3, -4 m, since t = 61 s; cannot be told from: a, b"
    turn = Alarm("rate gyro jumped", JUMP, ("r",), 0.0, 1.0, (math.radians(0.5),), "rad/s")
    assert turn.text == "rate gyro jumped by 0.5 deg/s, since t = 0 s"
    assert Alarm("delta jammed", STUCK, ("delta",), 5.0, 9.0, (1.0,), "1").text == "delta jammed, since t = 5 s"
    assert Alarm("a", "", ("x",), 1.0, 2.0).over == math.inf
    drifts = alarm_of(evidence("x y drifts", 60.0, RAMP), 9.0, ("b",), True)
    assert (drifts.cause, drifts.how, drifts.since, drifts.size) == ("x y frozen", FROZEN, 7.0, ())
    pushed = alarm_of(evidence("current changed", 60.0, IMPULSE, (1.0, 2.0)), 9.0, (), True)
    assert (pushed.cause, pushed.size, pushed.held, pushed.what) == ("current changed", (1.0, 2.0), 0.2, ("x",))
    slow = alarm_of(evidence("delta slow", 60.0, LAZY), 9.0, (), False, 0.01)
    assert (slow.rate, slow.size, slow.score) == (0.01, (), 60.0)
    written = alarm(replace(both, over=80.0))
    assert (written["over"], written["size"], written["rivals"]) == (80.0, [12.3456, -4.0], ["a", "b"])
    assert alarm(both)["over"] is None


@pytest.mark.parametrize(("cause", "how", "what", "size", "deeper"), [
    ("n_P without its thrust", LOST, "n_P", 0.2, True), ("n_P sensor jumped", SCALED, "n_P", 0.1, True),
    ("n_P sensor jumped", SCALED, "n_P", -0.1, False),  # a shaft that turns faster than shown
    ("delta sensor scaled", SCALED, "delta", 0.1, False), ("delta sensor jumped", MISREAD, "delta", 0.1, False),
])  # fmt: skip
def test_a_propeller_that_gives_less_cannot_be_told_from_a_deeper_ship(
    cause: str, how: str, what: str, size: float, deeper: bool,
) -> None:  # fmt: skip
    found = alarm_of(replace(evidence(cause, 60.0, how, (size,)), suspect=Suspect(cause, how, (what,), (1.0,), "1")),
                     9.0, ("b",), False)  # fmt: skip
    assert found.rivals == (("b", DEEPER) if deeper else ("b",))
    assert ("deeper than its file" in found.text) == deeper


@pytest.mark.parametrize(("cause", "how", "what", "said"), [
    ("rate gyro jumped", JUMP, "r", "than the rate gyro until"), ("compass drifts", RAMP, "psi", "the compass until"),
    ("position frozen", FROZEN, "x", "than the position until"), ("position jumped", JUMP, "x", "true after 5 min"),
    ("delta jammed", STUCK, "delta", "look at delta itself"), ("delta slow", LAZY, "delta", "pressure of delta;"),
    ("delta jammed", STEERING, "delta", "look at delta:"), ("delta slow", STEERING, "delta", "look at delta:"),
    ("delta of the wrong sign", REVERSED, "delta", "the sign of delta in"),
    ("delta sensor jumped", MISREAD, "delta", "the angle of delta at"),
    ("n_P sensor jumped", SCALED, "n_P", "the turns of n_P at"),
    ("n_P without its thrust", LOST, "n_P", "the shaft of n_P,"), ("current changed", IMPULSE, "x", "no sensor"),
    (UNEXPLAINED, "", "model", "draught and depth"), (WRONG, "", "model", "this ship"), (CLOCK, "", "t", "the clock"),
])  # fmt: skip
def test_each_alarm_says_what_to_do_about_what_it_names(cause: str, how: str, what: str, said: str) -> None:
    one = Alarm(cause, how, (what,), 1.0, 2.0)
    assert said in one.advice
    assert "{" not in one.advice
    assert alarm(one)["advice"] == one.advice
    assert one.line == f"{cause}, since t = 1 s; {one.advice}"


def test_every_suspect_of_a_ship_has_its_advice_and_an_unknown_fault_has_none() -> None:
    for one in suspects(machine()):
        assert Alarm(one.cause, one.how, one.what, 1.0, 2.0).advice
    assert Alarm("a", "", ("x",), 1.0, 2.0).advice == ""
    assert Alarm("a", "", ("x",), 1.0, 2.0).line == "a, since t = 1 s"


# --- which faults there are, and how large they usually are ---


def test_the_usual_size_of_each_fault() -> None:
    """The linear ship: 100 m long at 5 m/s; noise of .5 m and 2e-4 rad/s; slow forces start at 2e-3 m/s2."""
    every = suspects(machine())
    found = {(one.cause, one.share): one for one in reversed(every) if one.how not in (GROWS, CARRIED, LATE)}
    assert [one.size for one in every if one.cause == "position drifts"] == [(0.5, 0.5), pytest.approx((0.05, 0.05))]
    (carried,) = (one for one in every if one.how == CARRIED)
    assert (carried.cause, carried.size) == ("current changed", pytest.approx((0.0125,) * 2))
    assert sorted((one.cause, one.share, one.size) for one in every if one.how == LATE) == [
        (f"{name} late", lag, (lag,)) for name in ("compass", "log", "position", "rate gyro") for lag in (3.0, 6.0)
    ]  # fmt: skip
    assert {one.cause: one.size for one in every if one.how == GROWS} == {  # within two lengths, 40 s
        "current changed": pytest.approx((0.0125,) * 2), "resistance or wind changed": pytest.approx((5e-4,)),
        "wind or another force changed": pytest.approx((5e-4, 5e-6)),
    }  # fmt: skip
    sizes = {
        "position jumped": (20.0 * 0.5 + 5.0,) * 2, "position drifts": (0.5,) * 2,
        "compass jumped": (math.radians(5.0),), "compass drifts": (math.radians(5.0) / 60.0,),
        "rate gyro jumped": (2e-3 + 0.05 / 20.0,), "log jumped": (1.0,), "rate gyro drifts": (4.5e-3 / 120.0,),
        "log drifts": (1.0 / 120.0,), "rate gyro scaled": (0.3,), "log scaled": (0.3,), "delta sensor scaled": (0.1,),
        "clock of the log off its pace": (0.02,), "current changed": (0.5,) * 2,
        "wind or another force changed": (2e-2, 2e-4), "resistance or wind changed": (2e-2,),
        "delta jammed": (1.0, math.radians(1.0)), "delta of the wrong sign": (1.0,),
        "delta sensor jumped": (math.radians(3.0),), "n_P sensor jumped": (0.1,), "n_P without its thrust": (1.0,),
    }  # fmt: skip
    for cause, size in sizes.items():
        assert found[cause, 1.0].size == pytest.approx(size), cause
    assert {share for cause, share in found if cause == "delta slow"} == {0.5, 0.25, 0.12}
    assert len(found) == len(sizes) + 3
    how = {cause: one.how for (cause, _), one in found.items()}
    assert (how["position jumped"], how["position drifts"], how["current changed"]) == (JUMP, RAMP, IMPULSE)
    assert (how["delta sensor jumped"], how["n_P sensor jumped"]) == (MISREAD, SCALED)
    assert [one.fixed for one in found.values()].count(True) == 5
    assert found["position drifts", 1.0].unit == "m/s"
    assert found["wind or another force changed", 1.0].what == ("slow.v_m", "slow.r")
    assert found["resistance or wind changed", 1.0].what == ("slow.u",)


def test_a_freed_parameter_may_change_by_twice_its_first_deviation() -> None:
    here = machine(free=("slow.u",))
    (one,) = (one for one in suspects(here) if one.cause == "slow.u changed")
    assert one.size == (4e-3,)
    velocity = {**here.settings.sensors}
    velocity["velocity"] = SimpleNamespace(sd=0.05, channels=("v_north", "v_east"))  # type: ignore[assignment]
    with_it = replace(here, settings=replace(here.settings, sensors=velocity))
    (one,) = (one for one in suspects(with_it) if one.cause == "velocity jumped")
    assert (one.size, one.unit) == ((1.0, 1.0), "m/s")


def test_onsets_fill_a_window_and_the_oldest_makes_room() -> None:
    """A window of 90 s by 5 s has 18; of a narrow one there are two at least."""
    bank = Bank(machine(), suspects(machine()))
    assert bank.latest == -math.inf
    assert bank.evidence() == []
    for k in range(18):
        bank.onset(5.0 * k, np.zeros(10), np.zeros(len(bank.machine.names)))
    assert sorted(bank._onset) == [5.0 * k for k in range(18)]
    bank.onset(90.0, np.zeros(10), np.zeros(len(bank.machine.names)))
    assert sorted(bank._onset)[0] == 5.0
    assert bank.latest == 90.0
    narrow = Bank(machine(window=5.0), suspects(machine()))
    assert narrow._onset.shape == (2,)


def test_a_slow_rudder_moves_at_its_share_of_the_rate_and_a_shaft_over_its_range_in_twenty_seconds() -> None:
    bank = Bank(machine(), suspects(machine()))
    lazy = [one for one in bank.suspects if one.how == LAZY]
    assert sorted(pace(machine().ship, one) for one in lazy) == pytest.approx([0.12 * 0.05, 0.25 * 0.05, 0.5 * 0.05])
    assert pace(machine().ship, next(one for one in bank.suspects if one.how == STUCK)) == math.inf
    assert bank._rate["n_P"] == pytest.approx(math.radians(3.5))


def stepped(innovation: Any, spread: Any, rows: Any = None, taken: Any = None) -> Step:
    innovation, spread = np.array(innovation, dtype=float), np.diag(np.array(spread, dtype=float))
    k = innovation.size
    rows = np.arange(k) if rows is None else np.array(rows)
    taken = np.ones(k, dtype=bool) if taken is None else np.array(taken)
    return Step(1.0, 1.0, rows, taken, innovation, spread, np.linalg.inv(spread), np.eye(11), np.zeros((k, 11)),
                np.zeros((11, k)), np.zeros(11), np.zeros(10), np.zeros(k))  # fmt: skip


def test_a_bank_is_surprised_once_by_a_channel_beyond_six_deviations() -> None:
    bank = Bank(machine(), suspects(machine()))
    assert not bank.surprised(stepped([11.9, 0.0, 0.0, 0.0, 0.0], [4.0, 1.0, 1.0, 1.0, 1.0]))
    far = stepped([12.1, 0.0, 0.0, 0.0, 0.0], [4.0, 1.0, 1.0, 1.0, 1.0])
    assert bank.surprised(far)
    bank.weigh(far, np.zeros(10))
    assert not bank.surprised(far)  # it was there before
    assert bank.surprised(stepped([12.1, 7.0, 0.0, 0.0, 0.0], [4.0, 1.0, 1.0, 1.0, 1.0]))
    bank.clear()
    assert bank.surprised(far)


# --- the filter's small parts ---


def test_the_surprise_of_a_reading_is_a_hundred_at_most() -> None:
    assert surprise(stepped([2.0, -3.0], [4.0, 1.0])) == pytest.approx(1.0 + 9.0)
    assert surprise(stepped([2.0, -3e3], [4.0, 1.0])) == pytest.approx(101.0)
    assert surprise(stepped([], [])) == 0.0


def test_a_row_without_a_channel_is_that_of_the_others() -> None:
    whole = stepped([1.0, 2.0, 3.0], [1.0, 2.0, 4.0], rows=[0, 2, 3], taken=[True, False, True])
    assert without(whole, ()) is whole
    left = without(whole, (2,))
    assert (left.rows.tolist(), left.taken.tolist(), left.innovation.tolist()) == ([0, 3], [True, True], [1.0, 3.0])
    np.testing.assert_allclose(left.inverse, np.diag([1.0, 0.25]))
    assert (left.slope.shape, left.gain.shape, left.spread.shape) == ((2, 11), (11, 2), (2, 2))
    assert left.nis == pytest.approx(1.0 + 9.0 / 4.0)
    assert without(whole, (0, 2, 3)).inverse.shape == (0, 0)


def test_an_inverse_whatever_the_units() -> None:
    units = np.array([1e-9, 1.0, 1e6])
    plain = np.array([[2.0, 0.3, 0.1], [0.3, 1.0, 0.2], [0.1, 0.2, 3.0]])
    spread = plain * np.outer(units, units)
    np.testing.assert_allclose(inverse_of(spread) * np.outer(units, units), np.linalg.inv(plain), rtol=1e-9)


@pytest.mark.parametrize("psi", [0.0, 0.7, -2.0])
@pytest.mark.parametrize("moving", [True, False])
def test_midship_is_the_antenna_less_its_arm(psi: float, moving: bool) -> None:
    """Place less the arm turned by the heading, velocity less r x arm; the slope is that of small changes."""
    here = machine(antenna=(-30.0, 4.0))
    mean = np.zeros(11)
    mean[:6] = (100.0, 50.0, psi, 5.0, 0.4, 0.02)

    def found(at: np.ndarray) -> np.ndarray:
        c, s, r = math.cos(at[2]), math.sin(at[2]), at[5] if moving else 0.0
        out = at.copy()
        out[0] -= -30.0 * c - 4.0 * s
        out[1] -= -30.0 * s + 4.0 * c
        out[3] += 4.0 * r
        out[4] -= -30.0 * r
        return out

    cov = np.diag(np.arange(1.0, 12.0))
    begin: Any = SimpleNamespace(machine=here, mean=mean, cov=cov)
    at = live_module.Follower(here, 0.0, begin.mean, begin.cov)
    got = _midship(at, moving)
    np.testing.assert_allclose(got.mean, found(mean))
    slope = np.array([(found(mean + e) - found(mean - e)) / 2e-6 for e in 1e-6 * np.eye(11)]).T
    np.testing.assert_allclose(got.cov, slope @ cov @ slope.T, rtol=1e-5, atol=1e-5)


def test_velocity_over_ground_at_the_first_row_is_turned_into_the_ship(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ship on 120 deg that is read to go 3 m/s north and 4 m/s east."""
    from seatrial.realtime.twin import follow

    monkeypatch.setattr(follow, "values", lambda model: {})
    here = machine()
    channels, noise = (*CHANNELS, "v_north", "v_east"), np.array([0.5, 0.5, 0.002, 2e-4, 0.05, 0.04, 0.04])
    there: Any = SimpleNamespace(model=SimpleNamespace(channels=channels, noise=noise), own=6, names=here.names)
    psi = math.radians(120.0)
    found = begun(replace(here, traced=there), 1.0, np.array([0.0, 0.0, psi, math.nan, math.nan, 3.0, 4.0]))
    assert found.mean[3] == pytest.approx(3.0 * math.cos(psi) + 4.0 * math.sin(psi))
    assert found.mean[4] == pytest.approx(4.0 * math.cos(psi) - 3.0 * math.sin(psi))
    assert found.mean[5] == 0.0  # no rate read
    assert np.sqrt(np.diagonal(found.cov))[3:5] == pytest.approx([0.2, 0.2])  # five times the noise


# --- what is assumed ---


def test_no_log_is_followed_more_closely_than_a_model_can() -> None:
    """Stated noise below a 400th of a length, a milliradian, and shares of the speed is raised to them."""
    L, U = SHIP.L_pp, SHIP.speed
    exact = usual(SHIP, ALL, noise=dict.fromkeys(("x", "psi", "r", "u_w", "v_north"), 1e-9))
    sd = {name: one.sd for name, one in exact.sensors.items()}  # type: ignore[attr-defined]
    assert sd == pytest.approx({"position": 2.5e-3 * L, "compass": 1e-3, "rate gyro": 5e-4 * U / L, "log": 2e-3 * U,
                                "velocity": 2e-3 * U})  # fmt: skip
    coarse = usual(SHIP, ALL, noise={"x": 9.0, "psi": 0.02})
    assert coarse.sensors["position"].sd == 9.0  # type: ignore[attr-defined]
    assert coarse.sensors["compass"].sd == 0.02  # type: ignore[attr-defined]
    assert dict(NOISE) == {"x": 1.0, "psi": 0.002, "r": 0.0003, "u_w": 0.05, "v_north": 0.05}


def test_times_of_a_twin_by_the_time_over_its_length() -> None:
    """A tanker of 320 m at 7.97 m/s: 40 s; ten of them to settle, two minutes at least; steps of a fiftieth."""
    T = SHIP.L_pp / SHIP.speed
    some = usual(SHIP, ALL)
    assert some.settle == pytest.approx(10.0 * T)
    assert some.step == pytest.approx(0.02 * T)
    small = usual(load("esso_osaka_3m"), ALL)
    assert small.settle == 120.0
    assert small.step == pytest.approx(max(0.02, 0.02 * load("esso_osaka_3m").L_pp / load("esso_osaka_3m").speed))
    assert some.estimator == "ekf"
    assert usual(SHIP, ALL, estimator=MHE).estimator == "mhe"


def test_an_unknown_antenna_may_be_a_third_of_the_length_away_and_little_aside() -> None:
    some = usual(SHIP, ALL, antenna=None)
    assert some.start["antenna.x"] == pytest.approx(0.3 * SHIP.L_pp)
    assert some.start["antenna.y"] == pytest.approx(0.05 * SHIP.L_pp)
    assert some.process["antenna.x"] == some.process["antenna.y"] == 0.0
    assert some.antenna == (0.0, 0.0)
    placed = usual(SHIP, ALL, antenna=(-90.0, 3.0))
    assert placed.antenna == (-90.0, 3.0)
    assert (placed.sensors["position"].x, placed.sensors["velocity"].y) == (-90.0, 3.0)  # type: ignore[attr-defined]
    assert placed.start["antenna.x"] == placed.start["antenna.y"] == pytest.approx(0.03 * SHIP.L_pp)


def test_a_gyro_has_a_bias_only_where_there_is_one_and_it_is_asked_for() -> None:
    assert "bias.r" in usual(SHIP, ALL).start
    assert "bias.r" not in usual(SHIP, ALL, gyro_bias=False).start
    assert "bias.r" not in usual(SHIP, ("x", "y", "psi")).start


@pytest.mark.parametrize(("channels", "fits"), [
    (("x", "y", "psi"), True), (("psi", "v_north", "v_east"), True), (("x", "psi"), False), (("x", "y"), False),
    (("psi",), False),
])  # fmt: skip
def test_a_twin_needs_heading_and_place_or_way(channels: tuple[str, ...], fits: bool) -> None:
    if fits:
        assert "compass" in usual(SHIP, channels).sensors
    else:
        with pytest.raises(StudyError, match="heading and position"):
            usual(SHIP, channels)


@pytest.mark.parametrize(("share", "good"), [("1", True), ("1.01", False), ("0.001", True), ("0", False)])
def test_a_share_is_above_nothing_and_up_to_all(share: str, good: bool) -> None:
    if good:
        R_0 = float(SHIP.model.hull.R_0)
        assert usual(SHIP, ALL, free=(f"hull.R_0={share}",)).start["hull.R_0"] == pytest.approx(float(share) * R_0)
    else:
        with pytest.raises(StudyError, match="share"):
            usual(SHIP, ALL, free=(f"hull.R_0={share}",))


def test_what_is_zero_has_no_share_to_drift_by() -> None:
    none = SHIP.having({"hull.R_0": 0.0})
    with pytest.raises(StudyError, match="it is 0"):
        usual(none, ALL, free=("hull.R_0",))


def test_factors_multiply_what_they_name_and_nothing_else() -> None:
    some = usual(SHIP, ALL)
    more = scaled(some, 3.0, 10.0)
    for name, value in some.process.items():
        factor = 3.0 if name in ("u", "v_m", "r") else 10.0 if name.startswith("slow.") else 1.0
        assert more.process[name] == pytest.approx(factor * value), name
    for name, value in some.start.items():
        assert more.start[name] == pytest.approx((10.0 if name.startswith("slow.") else 1.0) * value), name
    loud = noisier(some, 4.0)
    for name, one in some.sensors.items():
        assert loud.sensors[name].sd == pytest.approx(4.0 * one.sd)  # type: ignore[attr-defined]
    assert (FACTORS, NOISIER) == ((1.0, 3.0, 10.0, 30.0), (1.0, 2.0, 4.0, 8.0))
    assert some.more == tuple(some.start)


# --- what a log says ---


def trial(**channels: Any) -> Trial:
    size = len(next(iter(channels.values())))
    return Trial("log", np.arange(float(size)), {name: np.asarray(one, dtype=float) for name, one in channels.items()})


def test_a_log_without_noise_has_a_hundredth_of_its_steps() -> None:
    """A ramp that bends once: no scatter is found, and no reading is taken to be exact."""
    t = np.arange(400.0)
    found = noise_of(trial(x=5.0 * t + 0.01 * t**2, y=0.0 * t, psi=0.02 * t, n_P=t))
    assert found["psi"] == pytest.approx(max(1e-9, found["psi"]))
    steps = np.diff(5.0 * t + 0.01 * t**2)
    assert found["x"] >= 1e-2 * steps.std() * (1.0 - 1e-9)
    assert set(found) <= {"x", "y", "psi"}


def test_no_instrument_is_better_than_half_its_step() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(600.0)
    fine = 6.0 + 0.5 * np.sin(t / 60.0) + 1e-3 * rng.standard_normal(t.size)
    found = noise_of(trial(u_w=np.round(fine / 0.2) * 0.2))
    assert found["u_w"] >= 0.1 - 1e-12
    assert noise_of(trial(u_w=np.full(50, math.nan))) == {}


def test_what_steers_must_be_in_the_log() -> None:
    some = trial(x=[1.0, 2.0], n_P=[1.0, 1.0], delta=[math.nan, math.nan], U_G=[1.0, 1.0], gamma_G=[0.0, 0.0])
    assert channels_of(some, ("n_P",)) == ("x", "n_P", "U_G", "gamma_G", "v_north", "v_east")
    with pytest.raises(sources.DataError, match="no channel delta"):
        channels_of(some, ("n_P", "delta"))


class Said:
    """Readings of sentences in place of the decoder: each datagram is a kind and its values."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.values: dict[bytes, tuple[str, dict[str, float]]] = {}
        monkeypatch.setattr(sources, "split", lambda data: [data])
        monkeypatch.setattr(sources, "read_line", lambda line: SimpleNamespace(sentence=line, tag=None))
        monkeypatch.setattr(sources, "hear", lambda line: SimpleNamespace(source=self.values[line][0], line=line))
        monkeypatch.setattr(sources, "readings", lambda sentence: self.values[sentence.line][1])

    def __call__(self, ear: Ear, kind: str, t: float, **values: float) -> None:
        key = f"{kind}{t}{values}".encode()
        self.values[key] = kind, values
        ear.hear(key, t)


@pytest.mark.parametrize(("silent", "taken"), [(5.0, 0.1), (5.1, 0.9)])
def test_a_kind_that_is_silent_for_five_seconds_leaves_its_reading_to_another(
    monkeypatch: pytest.MonkeyPatch, silent: float, taken: float
) -> None:
    say, ear = Said(monkeypatch), Ear()
    say(ear, "HDT", 0.0, psi=0.1)
    say(ear, "THS", silent, psi=0.9)
    assert ear.row()["psi"] == taken


def test_instruments_off_the_centre_are_moved_to_midship_with_the_latest_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    """A log 3 m to starboard reads less in a turn to starboard: u + y r."""
    say, ear = Said(monkeypatch), Ear(aboard=Aboard(log=Place(0.0, 3.0)))
    say(ear, "ROT", 0.0, r=0.02, psi=0.5)
    ear.row()
    say(ear, "VHW", 1.0, u_log_water=5.0)
    assert ear.row()["u_w"] == pytest.approx(5.06)
    say(ear, "MWV", 2.0, gamma_T_bow=0.3)
    assert ear.row()["gamma_T"] == pytest.approx(0.8)
    say(ear, "MWV", 3.0, gamma_T_bow=6.0)
    assert ear.row()["gamma_T"] == pytest.approx(6.5 - math.tau)
    assert ear.row() == {}


def test_course_and_speed_are_components_and_the_first_fix_is_the_origin(monkeypatch: pytest.MonkeyPatch) -> None:
    say, ear = Said(monkeypatch), Ear()
    say(ear, "RMC", 0.0, latitude=10.0, longitude=20.0, U_G=4.0, gamma_G=2.0)
    row = ear.row()
    assert (row["x"], row["y"]) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert (row["v_north"], row["v_east"]) == pytest.approx((4.0 * math.cos(2.0), 4.0 * math.sin(2.0)))
    say(ear, "RMC", 1.0, latitude=10.001, longitude=20.0, U_G=4.0)
    row = ear.row()
    assert row["x"] == pytest.approx(110.6, abs=0.2)  # a thousandth of a degree of latitude
    assert row["y"] == pytest.approx(0.0, abs=1e-3)
    assert "v_north" not in row
    say(ear, "RMC", 2.0, latitude=10.001)
    assert ear.row() == {}


# --- what a log shows without a model ---


def test_a_channel_needs_thirty_readings_before_its_habit_is_known() -> None:
    """Of readings that never repeated, more than 30 are a habit."""
    for changes, stuck in ((29, False), (30, True)):
        some = Repeats()
        for k in range(changes + 1):
            some.note(float(k), {"x": float(k)})
        for k in range(changes + 1, changes + 9):
            some.note(float(k), {"x": float(changes)})
        assert (some.stuck("x") is not None) is stuck
    assert some.stuck("y") is None


def test_a_gap_is_no_repetition_and_a_fault_is_no_habit() -> None:
    some = Repeats()
    for k in range(40):
        some.note(float(k), {"x": float(k)})
    for k in range(40, 60):
        some.note(float(k), {"x": math.nan})
    assert some.runs["x"].count == 0
    for k in range(60, 80):
        some.note(float(k), {"x": 39.0})
    assert some.stuck("x") == 39.0
    before = some.runs["x"].same, some.runs["x"].all
    some.note(80.0, {"x": 1.0})  # it goes on: the run that was a fault does not count
    assert (some.runs["x"].same, some.runs["x"].all) == before
    assert some.runs["x"].since == 80.0


@pytest.mark.parametrize(("count", "since", "said"), [(3, 39.0, True), (2, 39.0, False), (3, 38.9, False),
                                                      (3, 45.0, True)])  # fmt: skip
def test_three_readings_alike_are_repeated_since_their_first(count: int, since: float, said: bool) -> None:
    some = Repeats()
    for k in range(40):
        some.note(float(k), {"x": float(k)})
    for k in range(40, 40 + count):
        some.note(float(k), {"x": 39.0})
    assert some.repeated("x", since) is said
    assert not some.repeated("y", since)


def moved(share: float, rows: int = 12, lag: float = 0.0, order: float = 0.6) -> Steering:
    steering, angle = Steering("delta", 0.05, lag), 0.0
    steering.note(-1.0, {"delta": 0.0, "delta_cmd": 0.0})
    for k in range(rows):
        steering.note(float(k), {"delta": angle, "delta_cmd": order})
        angle += 0.05 * share
    return steering


@pytest.mark.parametrize(("share", "word"), [(0.04, JAMMED), (0.06, SLOW), (0.49, SLOW), (0.51, None), (0.69, None),
                                             (0.71, FOLLOWS), (-0.5, JAMMED)])  # fmt: skip
def test_shares_of_the_movement_that_was_called_for(share: float, word: str | None) -> None:
    found = moved(share).verdict()
    assert (None if found is None else found[0]) == word
    if found is not None:
        assert found[1] == 1.0  # the first row that had to move


def swung(steering: Steering, rate: float, swings: int, t: float = 0.0) -> float:
    """The wheel from 23 deg to 23 deg on the other side, ten rows of a second each; the time after it."""
    angle, order = -0.4, -0.4
    for _ in range(swings):
        order = -order
        for _ in range(10):
            steering.note(t, {"delta": angle, "delta_cmd": order})
            angle += min(max(order - angle, -rate), rate)
            t += 1.0
    return t


def test_a_gear_is_as_quick_as_it_has_shown_three_times() -> None:
    steering = Steering("delta", 0.04, 0.0)
    t = swung(steering, 0.12, 2)
    assert steering.rate == 0.04
    swung(steering, 0.16, 2, t)
    assert steering.rate == pytest.approx(0.12)  # what it has shown three times, or more
    steering = Steering("delta", 0.04, 0.0)
    swung(steering, 0.03, 9)
    assert steering.rate == 0.04  # a slow one is no habit


def test_a_quick_gear_is_slow_by_its_own_rate_and_not_by_that_of_its_file() -> None:
    quick, strange = Steering("delta", 0.04, 0.0), Steering("delta", 0.04, 0.0)
    t = swung(quick, 0.12, 6)
    for one, since in ((quick, t + 100.0), (strange, 0.0)):
        swung(one, 0.03, 1, since)
    assert (quick.verdict() or ("",))[0] == SLOW  # a quarter of what it has shown
    assert (strange.verdict() or ("",))[0] == FOLLOWS  # three quarters of what the file says


def test_a_small_move_shows_no_rate() -> None:
    """Three degrees at a time, far from its order, are less than the four that count."""
    steering, angle = Steering("delta", 0.01, 0.0), 0.0
    for k in range(40):
        steering.note(float(k), {"delta": angle, "delta_cmd": 0.5 if k % 4 < 2 else -0.5})
        angle += math.radians(1.5) * (1.0 if k % 4 < 2 else -1.0)
    assert steering.rate == 0.01


def test_a_verdict_takes_three_rows_and_four_degrees() -> None:
    """Rows of .05 rad: four degrees are .0698 rad, two rows; three are needed."""
    assert moved(0.0, rows=3).verdict() is None
    assert moved(0.0, rows=4).verdict() is not None
    little = Steering("delta", 0.01, 0.0)
    little.note(-1.0, {"delta": 0.0, "delta_cmd": 0.0})
    verdicts = []
    for k in range(10):
        little.note(float(k), {"delta": 0.0, "delta_cmd": 0.5})
        verdicts.append(little.verdict() is not None)
    assert verdicts == [False] * 7 + [True] * 3  # seven movements of .01 rad are more than 4 deg


def test_a_servo_of_a_ship_file_and_one_without_a_rate() -> None:
    servos = {"a": SimpleNamespace(rate=0.04, lag=2.0, dead_time=1.5), "b": SimpleNamespace(rate=math.inf),
              "c": SimpleNamespace()}  # fmt: skip
    ship: Any = SimpleNamespace(actuators=SimpleNamespace(of=servos.__getitem__))
    found = {name: Steering.of(ship, name) for name in servos}
    assert (found["a"].rate, found["a"].lag) == (0.04, 3.5)
    assert (found["b"].rate, found["b"].lag) == (math.radians(3.5), 0.0)
    assert (found["c"].rate, found["c"].lag) == (math.radians(3.5), 0.0)
    assert [one.control for one in steerings(SHIP, ("delta", "delta_cmd", "n_P", "n_P_cmd"))] == ["delta"]
    assert steerings(SHIP, ("delta",)) == ()


def test_a_clock_that_is_set_back_forgets_what_the_rudder_did() -> None:
    steering = moved(0.0)
    steering.note(3.0, {"delta": 0.0, "delta_cmd": 0.6})
    assert steering.verdict() is None
    assert len(steering._orders) == 1


def test_an_hour_of_innovations_and_its_mean() -> None:
    hour = Hour(0.0, 12.0, 8)
    assert hour.mean == 1.5
    assert math.isnan(Hour(0.0).mean)
    low, high = Hour(0.0, 0.0, 1).band(0.9)  # the square of one normal number
    assert (low, high) == pytest.approx((0.0039321, 3.8414588), rel=1e-4)
    assert Hour(0.0, high, 1).inside(0.9)
    assert not Hour(0.0, high + 1e-3, 1).inside(0.9)
    assert not Hour(0.0, low - 1e-3, 1).inside(0.9)
    tally = Tally()
    tally.note(-1.0, 3.0, 2)
    assert tally.hours[0].start == -3600.0


# --- what is shown and kept ---


def a_live(tmp: Any = None) -> Any:
    """A twin with an estimate of its own, without a compiled model."""
    settings = usual(SHIP, ALL, free=("hull.R_0",))
    names = ("x", "y", "psi", "u", "v_m", "r", "environment.current_x", "environment.current_y", "slow.u",
             "slow.v_m", "slow.r", "bias.r", "hull.R_0")  # fmt: skip
    R_0 = float(SHIP.model.hull.R_0)
    mean = np.array([0.0, 0, 0, 7, 0, 0, 0.25, -0.5, 1e-4, 2e-4, 3e-6, 4e-5, 1.1 * R_0])
    cov = np.diag((0.01 * np.arange(1.0, 14.0)) ** 2)
    model = SimpleNamespace(noise=np.array([1.0, 2.0, 0.003]))
    here: Any = SimpleNamespace(ship=SHIP, settings=settings, names=names, channels=("x", "y", "psi"),
                                traced=SimpleNamespace(model=model))  # fmt: skip
    follower = live_module.Follower(here, 7200.0, mean, cov)
    alarms = [Alarm("compass jumped", JUMP, ("psi",), 10.0, 20.0, (0.1,), "rad", 40.0),
              Alarm("log jumped", JUMP, ("u_w",), 11.0, 21.0, (1.0,), "m/s", 40.0, over=30.0)]  # fmt: skip
    tally = Tally(hours=[Hour(0.0, 1000.0, 1000), Hour(3600.0, 1500.0, 1000)])
    return SimpleNamespace(machine=here, follower=follower, alarms=alarms, active=alarms[:1], tally=tally,
                           trust=Trust(), counts=live_module.Counts(3, 4, 5, 6), swell=Swell(),
                           roughen=lambda sea: None)  # fmt: skip


def test_the_card_counts_hours_alarms_and_changes() -> None:
    found = page(a_live(), "a.csv")
    text, document = found.html, found.document
    assert "followed a.csv to t = 7200 s (2.0 h)" in text
    assert "1 of 2" in text
    assert "+10.0 %" in text
    assert "95 % band" in text
    assert "bands of 90 %" in text
    assert "0.2 by its limits" in text
    assert [one["inside"] for one in document["hours"]] == [True, False]
    assert [one["nis"] for one in document["hours"]] == [1.0, 1.5]
    assert document["t"] == 7200.0
    assert document["rows"] == {"late": 3, "waiting": 4, "gaps": 5, "restarts": 6}
    assert "3, 4" in text
    shown = {one["name"]: (one["value"], one["sd"]) for one in document["unseen"]}
    assert shown["current north"] == pytest.approx((0.25, 0.07))
    assert shown["current east"] == pytest.approx((-0.5, 0.08))
    assert shown["slow moment, yaw"] == pytest.approx((3e-6, 0.11))
    assert len(document["alarms"]) == 2
    for one in found.sections:
        aligned(one.body)
    learns, others = tables(found.sections[1].body)
    R_0 = float(SHIP.model.hull.R_0)
    assert learns[1][:2] == ["hull.R_0", ""]
    assert [float(one) for one in learns[1][2:5]] == pytest.approx([R_0, 1.1 * R_0, 0.13], rel=5e-4)
    assert [len(one.replace(".", "").lstrip("0")) for one in learns[1][2:5]] == [4, 4, 2]
    assert others[1] == ["current north", "m/s", "0.250", "0.070"]
    (hours,) = tables(found.sections[5 if found.sections[4].title == "Alarms" else 4].body)
    assert hours[1][:2] == ["0", "1.000"]
    assert hours[2] == ["1", "1.500", hours[1][2], "1000", "no"]


def test_the_card_tells_what_waves_do_where_there_are_any() -> None:
    live = a_live()
    assert "rms, at about" not in page(live, "a.csv").html
    live.swell = Swell(Seaway(0.5, 0.1, {"wave.psi": math.radians(0.4), "wave.y": 1.5}))
    assert "yaw 0.40 deg, sway 1.5 m rms, at about 13 s" in page(live, "a.csv").html


def test_before_the_first_row_there_is_nothing_to_show() -> None:
    live = a_live()
    live.follower = None
    assert parameters(live) == unseen(live) == []
    assert learnt(live, "a") is SHIP
    assert page(live, "a.csv").document["t"] == 0.0


def test_what_was_learnt_is_in_the_ship_with_its_deviation_and_its_past() -> None:
    ship = learnt(a_live(), "a.csv")
    R_0 = float(SHIP.model.hull.R_0)
    assert float(ship.model.hull.R_0) == pytest.approx(1.1 * R_0)
    entry = ship.entries["hull.R_0"]
    assert entry.sigma == pytest.approx(0.13)
    assert "to t = 7200 s; before: " in entry.source
    assert "not given" not in entry.source


@pytest.mark.parametrize("spoilt", [{"ship": "another"}, {"names": ["x"]}, {"channels": ["psi"]}])
def test_a_state_of_another_twin_is_refused(tmp_path: Path, spoilt: dict[str, Any]) -> None:
    live, path = a_live(), tmp_path / "state.json"
    live.held = lambda: (np.array([1.0, math.nan]), {}, {})
    save_state(live, path)
    about = json.loads(path.read_text())
    path.write_text(json.dumps(about | spoilt))
    with pytest.raises(StudyError, match="another ship, log or choice"):
        load_state(live, path)
    for sea, what in (({"size": {"wave.z": 1.0}, "omega": 1.0}, "size.wave.z"),
                      ({"noise": {"nose": 1.0}}, "noise.nose"),
                      ({"size": {"wave.psi": 1.0}, "omega": 0.0}, "sea.omega")):  # fmt: skip
        path.write_text(json.dumps(about | {"sea": sea}))
        with pytest.raises(StudyError, match=what):
            load_state(live, path)
    path.write_text(json.dumps(about | {"schema": "seatrial-twin/1"}))
    with pytest.raises(StudyError, match=r"state\.json"):
        load_state(live, path)


def test_a_twin_that_has_not_begun_saves_nothing(tmp_path: Path) -> None:
    live = a_live()
    live.follower = None
    save_state(live, tmp_path / "state.json")
    assert not (tmp_path / "state.json").exists()


# --- the twin's own rules ---


def bare(**more: Any) -> Any:
    """A twin of the linear ship (20 s to its length), of which only the rules run."""
    one: Any = Live.__new__(Live)
    one.machine, one.alarms, one.follower, one.last = machine(), [], None, None
    one._masked, one._agreed, one._overrides, one._steering = {}, {}, {}, ()
    one._quiet = one._misfit = -math.inf
    one._bad, one._sea = [], None
    one.tally = Tally()
    one.done = []
    one._forget = lambda t, quiet: one.done.append(("forget", t, quiet))
    vars(one).update(more)
    return one


@pytest.mark.parametrize(("last", "each", "unexplained"), [(48.1, 4.1, True), (47.9, 4.1, False), (48.1, 3.9, False)])
def test_readings_are_unexplained_when_a_minute_of_them_is_four_times_too_far(
    last: float, each: float, unexplained: bool
) -> None:
    """Of two readings a row; the minute is full from four fifths of it on."""
    one = bare(_bad=[(t, 2.0 * each, 2) for t in (0.0, 10.0, last)])
    assert one._unexplained() is unexplained
    one.tally.level = 1.1  # a log that is rougher than stated has as much more to explain
    assert one._unexplained() is False


@pytest.mark.parametrize(("away", "ended"), [(60.1, True), (59.9, False)])
def test_a_sensor_is_believed_after_a_minute_of_agreement(away: float, ended: bool) -> None:
    fault = Alarm("log jumped", JUMP, ("u_w",), 10.0, 20.0)
    k = CHANNELS.index("u_w")
    one = bare(alarms=[fault], follower=object(), last=stepped([2.9], [1.0], rows=[k]))
    one._masked, one._agreed = {k: fault}, {k: 100.0}
    one._repeats = SimpleNamespace(stuck=lambda name: None)
    one._released(100.0 + away)
    assert (not one._masked) is ended
    assert math.isfinite(one.alarms[0].over) is ended
    if ended:
        assert one.alarms[0].over == 100.0 + away
        assert one.done == [("forget", 100.0 + away, 15.0)]


@pytest.mark.parametrize(("off", "stuck", "kept"), [(3.1, None, False), (-3.1, None, False), (2.9, None, True),
                                                    (0.0, 5.0, False)])  # fmt: skip
def test_agreement_is_within_three_deviations_and_of_a_sensor_that_moves(off: float, stuck: Any, kept: bool) -> None:
    fault = Alarm("log jumped", JUMP, ("u_w",), 10.0, 20.0)
    k = CHANNELS.index("u_w")
    one = bare(alarms=[fault], follower=object(), last=stepped([2.0 * off], [4.0], rows=[k]))
    one._masked, one._agreed = {k: fault}, {k: 100.0}
    one._repeats = SimpleNamespace(stuck=lambda name: stuck)
    one._released(130.0)
    assert one._agreed[k] == (100.0 if kept else 130.0)


@pytest.mark.parametrize(("since", "how", "channel", "opened"), [
    (300.1, JUMP, "x", True), (299.9, JUMP, "x", False), (300.1, RAMP, "x", False), (900.0, JUMP, "u_w", False),
])  # fmt: skip
def test_a_place_that_has_jumped_is_the_place_after_five_minutes(
    since: float, how: str, channel: str, opened: bool
) -> None:
    fault = Alarm("position jumped", how, (channel,), 10.0, 20.0)
    k = CHANNELS.index(channel)
    follower = live_module.Follower(machine(), 0.0, np.zeros(11), np.eye(11))
    one = bare(alarms=[fault], follower=follower, last=stepped([-40.0], [1.0], rows=[k]))
    one._masked, one._agreed = {k: fault}, {k: 0.0}
    one._repeats = SimpleNamespace(stuck=lambda name: None)
    one._released(20.0 + since)
    assert (not one._masked) is opened
    if opened:  # as uncertain as it is far
        assert one.follower.cov[0, 0] == pytest.approx(1.0 + 40.0**2)


@pytest.mark.parametrize(("found", "before", "causes"), [
    ((JAMMED, 5.0), None, ["delta jammed"]), ((SLOW, 5.0), None, ["delta slow"]),
    ((JAMMED, 5.0), (STEERING, 50.0), ["delta jammed"]), ((JAMMED, 5.0), (STEERING, 30.0), ["delta slow"]),
    ((SLOW, 5.0), (STEERING, 50.0), ["delta slow"]), ((JAMMED, 5.0), (LAZY, 50.0), ["delta slow"]),
])  # fmt: skip
def test_a_rudder_that_stops_within_a_minute_was_jammed(found: Any, before: Any, causes: list[str]) -> None:
    """At 100 s; a slow one that was named later than a minute ago stays what it is called."""
    one = bare(alarms=[] if before is None else [Alarm("delta slow", before[0], ("delta",), 1.0, before[1])])
    one._steered(f"delta {found[0]}", "delta", found, 100.0)
    assert [a.cause for a in one.alarms] == causes
    if before is None:
        assert (one.alarms[0].since, one.alarms[0].named, one.alarms[0].how) == (5.0, 100.0, STEERING)


@pytest.mark.parametrize(("how", "size", "held", "now", "rate"), [
    (LOST, (1.4,), 0.2, 1.0, math.inf), (LOST, (0.6,), 0.2, 0.6, math.inf), (MISREAD, (0.05,), 0.2, 0.05, math.inf),
    (SCALED, (0.2,), 0.2, 0.2, math.inf), (STUCK, (), 0.25, 0.25, math.inf), (LAZY, (), 0.1, 0.1, 0.02),
])  # fmt: skip
def test_what_a_control_at_fault_does_from_its_alarm(how: str, size: Any, held: float, now: float, rate: Any) -> None:
    one = bare()
    one._believe(Alarm("a", how, ("delta",), 1.0, 2.0, size, held=held, rate=rate), 2.0)
    found = one._overrides["delta"]
    assert (found.how, found.now, found.rate) == (how, now, rate)


def test_a_control_at_fault_leaves_slow_forces_open_and_an_unexplained_row_all_but_parameters() -> None:
    here, asked = machine(), []
    one = bare(_again=lambda since, opened: asked.append((since, *opened)))
    one._explain(Alarm("a", STUCK, ("delta",), 30.0, 40.0, held=0.1), 40.0)
    since, names, sizes = asked[-1]
    assert (since, names) == (30.0, ("slow.u", "slow.v_m", "slow.r"))
    np.testing.assert_allclose(sizes, [3.0 * here.settings.start[name] for name in names])
    one.alarms = [Alarm("current changed", IMPULSE, ("slow.u",), 31.0, 41.0, (-0.2,))]
    one._explain(one.alarms[0], 41.0)
    np.testing.assert_allclose(asked[-1][2], [0.2])
    assert one.alarms[0].over == 41.0
    one.alarms = [Alarm(UNEXPLAINED, "", ("model",), 32.0, 42.0)]
    one._explain(one.alarms[0], 42.0)
    assert asked[-1][1] == tuple(here.settings.start)
    np.testing.assert_allclose(asked[-1][2], [3.0 * one for one in here.settings.start.values()])
    one._explain(Alarm("log jumped", JUMP, ("u_w",), 33.0, 43.0), 43.0)
    assert asked[-1][1] == ()
    assert one.masked == ("u_w",)
    assert one._agreed == {CHANNELS.index("u_w"): 43.0}


def test_to_look_at_a_slow_rudder_does_not_move_it() -> None:
    one = bare(_controls=("n_P", "delta"), _acting=SimpleNamespace(now=np.array([1.0, 0.3, *[0.0] * 8])))
    one._overrides = {"delta": Override(LAZY, 0.05, 0.02)}
    assert [one.acting[:2].tolist() for _ in range(3)] == [[1.0, 0.05]] * 3
    row = SimpleNamespace(acting=one._acting.now)
    assert one._acted(row, 2.0)[1] == pytest.approx(0.09)
    assert one._acting.now[1] == 0.3


def test_a_sensor_that_is_frozen_is_named_with_all_its_channels() -> None:
    found = bare()._frozen("y", 12.0, 20.0)
    assert (found.cause, found.how, found.what) == ("position frozen", FROZEN, ("x", "y"))
    assert (found.since, found.named) == (12.0, 20.0)


def test_late_rows_are_counted_and_a_clock_that_goes_back_a_length_is_an_alarm() -> None:
    for back, late in ((19.9, 1), (20.1, 0)):
        one = bare(counts=live_module.Counts(), _anew=lambda t, readings, old: True)
        one._earlier(100.0 - back, np.zeros(5), SimpleNamespace(t=100.0))
        assert (one.counts.late, one.counts.restarts) == (late, 1 - late)
        assert len(one.alarms) == 1 - late


def test_quiet_is_never_shortened() -> None:
    one = bare()
    del one._forget
    for name in ("_bank", "_judge", "_rows", "_snapshots", "_bad", "trust"):
        setattr(one, name, SimpleNamespace(clear=lambda: None))
    one._quiet = 200.0
    one._forget(100.0, 50.0)
    assert one._quiet == 200.0
    one._forget(180.0, 50.0)
    assert one._quiet == 230.0

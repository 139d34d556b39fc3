"""Competing explanations of the same rows: against the closed form of the bank, exact delays, and what grows."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from linear_ship import CHANNELS, Sailed, machine, sailed
from seatrial.realtime.twin.faults.alarms import Alarm, Judge
from seatrial.realtime.twin.faults.cases import Kept, growing
from seatrial.realtime.twin.faults.explained import Window
from seatrial.realtime.twin.faults.suspects import (
    CARRIED,
    GROWS,
    JUMP,
    LATE,
    MISREAD,
    PACE,
    RAMP,
    SHARE,
    Bank,
    Evidence,
    Suspect,
    grown,
    suspects,
    walking,
)
from seatrial.realtime.twin.follow import Follower

P_0 = np.diag([4.0, 4.0, 1e-4, 0.04, 0.01, 1e-6, 0.1, 0.1, 1e-6, 1e-6, 1e-10])
ONSET = 20


def weighed(run: Sailed) -> tuple[Window, list[Evidence]]:
    """The rows and the bank's evidence, with onsets at each fifth row."""
    follower = Follower(machine(), 0.0, np.zeros(11), P_0)
    bank, starts, rows = Bank(follower.machine, suspects(follower.machine)), list[Follower](), list[Kept]()
    for k, (t, acting, readings) in enumerate(zip(run.t.tolist(), run.acting, run.readings, strict=True)):
        if k % 5 == 0:
            bank.onset(follower.t, acting, follower.mean)
            starts.append(follower)
        rows.append(Kept(t, acting, readings))
        follower, step = follower.row(t, acting, readings)
        bank.weigh(step, acting)
    return Window(rows, starts), bank.evidence()


def of(found: list[Evidence], cause: str, how: str) -> Evidence:
    return next(one for one in found if (one.suspect.cause, one.suspect.how) == (cause, how))


@pytest.mark.slow
def test_where_all_is_linear_the_filter_run_again_says_what_the_bank_says() -> None:
    """A jump within the gates: signatures of the first order are exact, sizes, deviations and scores alike."""
    run = sailed(45)
    run.readings[ONSET:, CHANNELS.index("psi")] += 0.004
    window, evidence = weighed(run)
    some = [one for one in evidence if one.suspect.how in (JUMP, RAMP, MISREAD, GROWS, CARRIED)
            and one.score > evidence[0].score - 29.0][:8]  # fmt: skip
    assert len({one.suspect.how for one in some}) >= 3
    found = window.compared(some)
    assert (found[0].suspect, found[0].onset) == (some[0].suspect, some[0].onset)
    for before in some:
        after = next(one for one in found if one.suspect == before.suspect)
        if after.onset == before.onset and before.suspect.how != CARRIED:
            assert after.score == pytest.approx(before.score, abs=0.05), before.suspect.cause
            for k, sigma in enumerate(before.sigma):  # .05 of a score is a quarter of a deviation
                assert after.size[k] == pytest.approx(before.size[k], abs=0.25 * sigma), before.suspect.cause
                assert after.sigma[k] == pytest.approx(sigma, rel=0.02), before.suspect.cause


@pytest.mark.slow
@pytest.mark.parametrize("lag", [3, 5])
def test_a_late_fix_is_no_jump_and_its_delay_is_exact(lag: int) -> None:
    run = sailed(50)
    read = run.readings.copy()
    for name in ("x", "y"):
        k = CHANNELS.index(name)
        run.readings[ONSET:, k] = read[ONSET - lag : -lag, k]
    window, evidence = weighed(run)
    found = window.compared(evidence)
    assert found[0].suspect.cause == "position late"
    assert found[0].size[0] == pytest.approx(lag, abs=4.0 * found[0].sigma[0] + 0.05)
    assert found[0].score - of(found, "position jumped", JUMP).score > 10.0
    assert found[0].score == pytest.approx(evidence[0].score)
    assert all(a.score >= b.score for a, b in pairwise(found))


@pytest.mark.slow
@pytest.mark.parametrize("share", [True, False])
def test_a_share_is_told_from_a_step_while_the_speed_rises(share: bool) -> None:
    """Divided by 1 + size, a reading would have less noise, and a share would win whatever it was."""
    run = sailed(60)
    run.readings[ONSET:, CHANNELS.index("u_w")] *= 1.4 if share else 1.0
    run.readings[ONSET:, CHANNELS.index("u_w")] += 0.0 if share else 0.5
    window, evidence = weighed(run)
    found = window.compared(evidence)
    assert found[0].suspect.cause == ("log scaled" if share else "log jumped")
    assert found[0].size[0] == pytest.approx(0.4 if share else 0.5, abs=5.0 * found[0].sigma[0])


@pytest.mark.slow
@pytest.mark.parametrize("by", [60.0, -60.0])
def test_an_outlier_of_another_channel_changes_no_verdict(by: float) -> None:
    """A fix 60 m off weighs as much as one 3 m off, whichever cause would bring the ship a little nearer to it."""
    found = list[dict[str, float]]()
    for off in (by / 20.0, by):
        run = sailed(45)
        run.readings[ONSET:, CHANNELS.index("u_w")] += 0.4
        run.readings[30, CHANNELS.index("y")] += off
        window, evidence = weighed(run)
        best = window.compared(evidence)
        assert best[0].suspect.cause == "log jumped"
        found.append({f"{one.suspect.cause} {one.suspect.how}": one.score - best[0].score for one in best})
    both = [cause for cause in found[0] if cause in found[1]]
    assert len(both) > 2
    assert [found[1][cause] for cause in both] == pytest.approx([found[0][cause] for cause in both], abs=10.0)


@pytest.mark.slow
def test_channels_and_controls_that_are_known_to_be_wrong_are_left_out() -> None:
    """A masked channel that is four deviations off adds nothing."""
    run = sailed(45)
    run.readings[ONSET:, CHANNELS.index("x")] += 6.0
    window, evidence = weighed(run)
    masked = replace(window, masked=(CHANNELS.index("u_w"),))
    usual = masked.compared(evidence)
    for row in window.rows:
        row.readings[CHANNELS.index("u_w")] += 0.2
    assert [one.score for one in masked.compared(evidence)] == pytest.approx([one.score for one in usual])


def test_nothing_is_compared_without_evidence_or_without_an_estimate_to_begin_from() -> None:
    assert Window((), ()).compared([]) == []
    one = Evidence(Suspect("a", JUMP, ("x",), (1.0,), "m"), 50.0, 7.0, (1.0,), (0.1,))
    assert Window((), ()).compared([one]) == [one]


@pytest.mark.slow
def test_a_clock_that_runs_fast_is_told_by_its_rate() -> None:
    run = sailed(90)
    run.t[ONSET:] = run.t[ONSET - 1] + (run.t[ONSET:] - run.t[ONSET - 1]) * 1.1
    window, evidence = weighed(run)
    pace = next(one for one in window.compared(evidence) if one.suspect.how == PACE)
    assert pace.size[0] == pytest.approx(1.0 - 1.0 / 1.1, abs=5.0 * pace.sigma[0])


# --- what grows ---

CURRENT = ("environment.current_x", "environment.current_y")


def test_what_grows_ends_after_two_lengths_and_takes_the_ship_along() -> None:
    """Two lengths are 40 s.  A ship to the east, which the water to the north takes to its port side."""
    suspect = Suspect("current changed", CARRIED, CURRENT, (0.1, 0.1), "m/s a second")
    fault = Evidence(suspect, 50.0, 10.0, (0.01, 0.02), (0.1, 0.1))
    mean = np.zeros(11)
    mean[2] = math.pi / 2.0
    at = Follower(machine(), 0.0, mean, P_0)
    for t in (5.0, 12.0, 30.0, 49.0, 60.0, 80.0):
        at = replace(grown(at, fault, t), t=t)
    names = at.machine.names
    found = {name: at.mean[names.index(name)] for name in ("u", "v_m", *CURRENT)}
    assert found == pytest.approx({"u": 0.8, "v_m": -0.4, CURRENT[0]: 0.4, CURRENT[1]: 0.8})
    still = replace(grown(replace(at, mean=mean, t=10.0), replace(fault, suspect=replace(suspect, how=GROWS)), 20.0))
    assert still.mean[[names.index("u"), names.index("v_m")]] == pytest.approx(0.0)


def test_a_walk_may_have_gone_as_far_as_the_growth_would_have() -> None:
    at = Follower(machine(), 0.0, np.zeros(11), np.zeros((11, 11)))
    for t in (1.0, 7.0, 40.0):
        at = replace(walking(at, CARRIED, (CURRENT, (0.01, 0.02)), t), t=t)
    north, u = (at.machine.names.index(name) for name in (CURRENT[0], "u"))
    assert math.sqrt(at.cov[north, north]) == pytest.approx(0.01 * 40.0)
    assert at.cov[u, north] == pytest.approx(at.cov[north, north])  # the ship with the water


@pytest.mark.parametrize(("since", "of", "walks"), [(10.0, "", True), (30.0, "", False), (-35.0, "", False),
                                                    (10.0, "a", False)])  # fmt: skip
def test_what_has_begun_walks_until_it_would_be_over(since: float, of: str, walks: bool) -> None:
    """From 10 s to 20 s: what began after that, more than 40 s ago, or is a consequence does not."""
    alarm = Alarm("current changed", GROWS, CURRENT, since, 20.0, (0.01, 0.02), of=of)
    at = Follower(machine(), 10.0, np.zeros(11), P_0)
    assert bool((growing([alarm], at, 20.0).cov != P_0).any()) is walks


# --- which is named ---


def test_of_a_step_and_a_share_that_cannot_be_told_apart_the_step_is_named() -> None:
    def one(how: str, score: float) -> Evidence:
        return Evidence(Suspect(how, how, ("u_w",), (1.0,), "m/s"), score, 7.0, (1.0,), (0.1,))

    for behind, cause in ((3.9, JUMP), (4.1, SHARE)):
        judge = Judge(10.0)
        both = [one(SHARE, 60.0), one(JUMP, 60.0 - behind)]
        judge.named(0.0, both)
        found = judge.named(40.0, both)
        assert found is not None
        assert found[0].suspect.cause == cause
    assert judge.named(80.0, [one(SHARE, 60.0), one(LATE, 59.0)]) is not None


def test_suspects_are_compared_now_and_then_and_those_compared_decide() -> None:
    a, b = (Evidence(Suspect(name, JUMP, (name,), (1.0,), "m"), 60.0, 7.0, (1.0,), (0.1,)) for name in "ab")
    asked, judge = list[float](), Judge(10.0)
    for t in np.arange(0.0, 30.0, 0.5).tolist():
        found = judge.named(t, [a, b], lambda some, t=t: (asked.append(t), [b, a])[1])  # type: ignore[func-returns-value]
        if found is not None:
            break
    assert asked == [2.5, 5.0, 7.5, 10.0, 12.5, 16.0, 20.0]  # a quarter longer each time, in rows of half a second
    assert found is not None
    assert (found[0].suspect.cause, found[1]) == ("b", ("a",))


def test_ten_readings_a_second_are_taken_in_once_with_the_controls_in_their_middle() -> None:
    """A heading in every row, a place in every tenth: each place is there, and no more rows than places."""
    rows = [Kept(0.1 * k, np.array([float(k)]), np.array([0.5, 7.0 if k % 10 == 3 else math.nan])) for k in range(100)]
    taken = Window(rows, ()).taken
    assert [row.t for row in taken] == pytest.approx([0.0, *(0.3 + k for k in range(10))])
    assert [float(row.acting[0]) for row in taken[2:]] == [9.0 + 10.0 * k for k in range(9)]
    often = [replace(row, readings=np.array([0.5, 7.0])) for row in rows]
    assert [row.t for row in Window(often, ()).taken] == pytest.approx(np.arange(10.0))
    slow = [replace(row, t=10.0 * row.t) for row in rows]
    assert [row.t for row in Window(slow, ()).taken] == [row.t for row in slow]


def test_onsets_are_the_further_apart_the_older_they_are() -> None:
    """One a second for 85 s in 30 places of a window of 90 s: all of the last seconds, and the oldest near its end."""
    bank = Bank(machine(spacing=1.0), suspects(machine()))
    for k in range(86):
        bank.onset(float(k), np.zeros(10), np.zeros(11))
    kept = np.sort(bank._onset)
    assert kept.size == 30
    assert kept[0] == 0.0
    assert kept[-3:].tolist() == [83.0, 84.0, 85.0]
    gaps = np.diff(kept)
    assert gaps[-10:].mean() < 0.5 * gaps[:10].mean()
    for k in range(86, 100):
        bank.onset(float(k), np.zeros(10), np.zeros(11))
    assert float(np.min(bank._onset)) >= 99.0 - 90.0 - 4.0 * float(np.max(gaps))

"""Rows that a twin takes in again, keeps, begins anew from and saves: against the filter by itself."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from linear_ship import CHANNELS, Sailed, machine, sailed
from seatrial.identify import StudyError
from seatrial.realtime.twin import follow, live
from seatrial.realtime.twin.faults.acting import Override
from seatrial.realtime.twin.faults.alarms import Alarm
from seatrial.realtime.twin.faults.suspects import JUMP, LAZY, REVERSED, suspects
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.saved import load_state, save_state

RUN = sailed(60, seed=4)


@pytest.fixture
def twin(monkeypatch: pytest.MonkeyPatch) -> Any:
    here = machine(settle=1e9, spacing=4.0, window=12.0)  # nothing is named
    monkeypatch.setattr(live, "made", lambda ship, settings: here)
    monkeypatch.setattr(live, "suspects", lambda machine: suspects(machine)[:2])  # quick ones, of the position
    monkeypatch.setattr(follow, "values", lambda model: {})
    return lambda: Live(here.ship, here.settings)


def fed(one: Live, run: Sailed = RUN, first: int = 0, last: int = 30) -> Live:
    for t, controls, readings in zip(run.t[first:last], run.acting[first:last], run.readings[first:last], strict=True):
        values = dict(zip(CHANNELS, readings.tolist(), strict=True)) | {"n_P": controls[0], "delta": controls[1]}
        assert one.feed(float(t), values)
    return one


def means(last: int, first: int = 1, how: Any = None) -> np.ndarray:
    """What acts in each row: the mean of two rows, the rudder as a fault has it."""
    acting = RUN.acting.copy()
    acting[1:, :2] = 0.5 * (RUN.acting[1:, :2] + RUN.acting[:-1, :2])
    return acting[first:last]


def test_a_twin_that_names_nothing_is_its_filter(twin: Any) -> None:
    one = fed(twin())
    at = follow.begun(one.machine, 1.0, RUN.readings[0])
    for t, acting, readings in zip(RUN.t[1:30], means(30), RUN.readings[1:30], strict=True):
        at, _ = at.row(float(t), acting, readings)
    assert one.follower is not None
    np.testing.assert_allclose(one.follower.mean, at.mean, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(one.follower.cov, at.cov, rtol=1e-12, atol=1e-18)
    assert not one.alarms
    assert one.counts == live.Counts()


@pytest.mark.parametrize(("how", "start"), [(LAZY, 0.02), (REVERSED, 0.0)])
def test_rows_are_taken_in_again_with_the_control_as_its_fault_has_it(twin: Any, how: str, start: float) -> None:
    """From the last estimate before the onset, opened; a slow rudder moves row by row."""
    one = fed(twin())
    kept = [at for at in one._snapshots if at.t <= 22.0][-1]
    one._overrides["delta"] = Override(how, start, 0.03)
    one._again(22.0, (("slow.r",), np.array([1e-4])))
    k = one.machine.names.index("slow.r")
    cov = kept.cov.copy()
    cov[k, k] += 1e-8
    at, angle = replace(kept, cov=cov), start
    for row in range(round(kept.t), 30):  # row k is at k + 1 s
        acting = means(row + 1, row)[0].copy()
        angle += np.clip(acting[1] - angle, -0.03, 0.03)
        acting[1] = angle if how == LAZY else -acting[1]
        at, _ = at.row(float(RUN.t[row]), acting, RUN.readings[row])
    assert one.follower is not None
    assert one.follower.t == 30.0
    np.testing.assert_allclose(one.follower.mean, at.mean, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(one.follower.cov, at.cov, rtol=1e-10, atol=1e-16)


def test_rows_are_kept_over_the_window_and_two_spacings_with_an_estimate_before_them(twin: Any) -> None:
    """Of a window of 12 s and onsets each 4 s: rows of the last 20 s, and one estimate at or before the first."""
    one = fed(twin(), last=60)
    assert [row.t for row in one._rows] == [float(t) for t in range(40, 61)]
    times = [at.t for at in one._snapshots]
    assert times[0] <= 40.0 < times[1]
    assert np.diff(times) == pytest.approx(3.0)  # an onset is at the row before the one in which four seconds are over
    assert times[-1] > 55.0


def test_an_onset_older_than_all_that_is_kept_begins_at_the_oldest(twin: Any) -> None:
    one = fed(twin(), last=60)
    before = one.follower
    one._again(1.0, ((), np.zeros(0)))
    assert one.follower is not None
    assert before is not None
    np.testing.assert_allclose(one.follower.mean, before.mean, rtol=1e-9, atol=1e-12)
    assert one.follower.t == before.t


def test_after_a_gap_the_motion_begins_anew_and_what_is_unseen_has_walked(twin: Any) -> None:
    one = fed(twin(), last=20)
    assert one.follower is not None
    before = one.follower
    late = replace(RUN, t=RUN.t + 150.0)
    fed(one, late, 20, 21)
    assert one.follower.t == 171.0
    assert one.counts.gaps == 1
    walked = before.cov[6:, 6:] + np.diag(one.machine.density[6:]) * 151.0
    np.testing.assert_allclose(one.follower.cov[6:, 6:], walked)
    np.testing.assert_allclose(one.follower.mean[6:], before.mean[6:])
    np.testing.assert_allclose(one.follower.mean[:3], RUN.readings[20, :3])
    assert one.last is None
    assert not one._rows
    assert not one._snapshots


def test_a_row_without_a_fix_begins_nothing_and_is_counted(twin: Any) -> None:
    one = twin()
    assert not one.feed(0.0, {"psi": 0.1, "x": 1.0, "y": 1.0, "n_P": math.nan})
    assert not one.feed(1.0, {"n_P": 1.0, "delta": 0.0, "psi": 0.1, "x": 1.0})
    assert (one.follower is None, one.counts.waiting) == (True, 2)
    assert one.feed(2.0, {"psi": 0.1, "x": 1.0, "y": 1.0})
    assert one.follower.t == 2.0
    assert one._quiet == pytest.approx(2.0 + 1e9)


@pytest.mark.parametrize(("gap", "kept"), [(5.9, True), (6.1, False)])
def test_over_a_third_of_a_length_nothing_is_evidence(twin: Any, gap: float, kept: bool) -> None:
    """L/U is 20 s; after 6 s the controls in between are not known, and evidence begins anew."""
    one = fed(twin(), last=20)
    before = one._bank._score.copy()
    late = replace(RUN, t=RUN.t + gap - 1.0)
    fed(one, late, 20, 21)
    assert one.counts.gaps == 0
    assert bool(np.any(one._bank._score)) is kept
    assert kept is not bool((one._bank._score == before).all()) or not kept


def test_a_state_with_its_first_alarm_masked_goes_on_as_it_was(twin: Any, tmp_path: Path) -> None:
    one = fed(twin())
    fault = Alarm("log jumped", JUMP, ("u_w",), 10.0, 20.0, (0.9,), "m/s", 40.0)
    one.alarms = [fault]
    one._masked, one._agreed = {CHANNELS.index("u_w"): fault}, {CHANNELS.index("u_w"): 20.0}
    one._overrides = {"delta": Override(LAZY, 0.03, 0.01)}
    save_state(one, tmp_path / "state.json")
    other = twin()
    assert load_state(other, tmp_path / "state.json") == 30.0
    assert other.masked == ("u_w",)
    assert other.alarms == [fault] or repr(other.alarms) == repr([fault])
    assert (other._overrides["delta"].how, other._overrides["delta"].now, other._overrides["delta"].rate) == (
        LAZY, 0.03, 0.01)  # fmt: skip
    np.testing.assert_array_equal(other.acting[0], one.acting[0])
    assert other.follower is not None
    assert one.follower is not None
    np.testing.assert_array_equal(other.follower.mean, one.follower.mean)
    np.testing.assert_array_equal(other.follower.cov, one.follower.cov)
    assert other._quiet == 45.0  # silent for fifteen seconds
    assert other._agreed == {CHANNELS.index("u_w"): 30.0}
    text = (tmp_path / "state.json").read_text().replace('"u_w": 0', '"u_w": 1')
    assert '"u_w": 1' in text
    (tmp_path / "state.json").write_text(text)
    with pytest.raises(StudyError, match="no channel with an alarm"):
        load_state(twin(), tmp_path / "state.json")

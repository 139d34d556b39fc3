"""What a twin begins with, shows and leaves behind: deviations at the first row, points of the page, provenance."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from linear import CHANNELS, NOISE, machine

from seatrial.realtime.twin import follow
from seatrial.realtime.twin.follow import begun
from seatrial.realtime.twin.live import Counts
from seatrial.realtime.twin.page import screen
from seatrial.realtime.twin.page.screen import Screen, _none, _round
from seatrial.realtime.twin.saved import provenance


def test_at_the_first_row_motion_is_as_read_and_as_uncertain_as_its_instruments(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ten times the noise of a fix, five of a compass, a quarter of the speed, half of U/L; 100 m at 5 m/s."""
    monkeypatch.setattr(follow, "values", lambda model: {})
    here = machine()
    readings = np.array([10.0, -20.0, 0.3, 0.02, 4.0])
    found = begun(here, 7.0, readings)
    assert found.t == 7.0
    np.testing.assert_allclose(found.mean[:6], [10.0, -20.0, 0.3, 4.0, 0.0, 0.02])
    sd = np.sqrt(np.diagonal(found.cov))
    np.testing.assert_allclose(sd[:6], [*(10.0 * NOISE[:2]), 5.0 * NOISE[2], 1.25, 1.25, 0.5 * 5.0 / 100.0])
    np.testing.assert_allclose(sd[6:], [here.settings.start[name] for name in here.names[6:]])
    readings[4] = math.nan  # without a log the usual speed, and all of it uncertain
    blind = begun(here, 7.0, readings)
    assert (blind.mean[3], math.sqrt(blind.cov[3, 3])) == pytest.approx((5.0, 5.0))
    known = begun(here, 7.0, readings, (np.arange(5.0), np.diag(np.arange(1.0, 6.0))))
    np.testing.assert_allclose(known.mean[6:], np.arange(5.0))
    np.testing.assert_allclose(np.diagonal(known.cov)[6:], np.arange(1.0, 6.0))


def a_live(**more: Any) -> Any:
    ship = SimpleNamespace(L_pp=100.0, speed=5.0, name="s", model=SimpleNamespace(controls=("delta",), breadth=0.0))
    machine = SimpleNamespace(ship=ship, channels=CHANNELS, settings=SimpleNamespace(free=("a.b",), estimator="ekf"))
    follower = SimpleNamespace(mean=np.arange(11.0), t=3.0)
    return SimpleNamespace(machine=machine, follower=follower, last=None, alarms=[], **more)


def test_the_page_keeps_a_point_each_tenth_of_a_length_and_strips_of_misses() -> None:
    """100 m at 5 m/s: each two seconds; misses in standard deviations, 99 at most, of what was read."""
    live = a_live()
    shown = Screen(live, "log")
    for k in range(900):
        t = 0.5 * k
        rows = np.array([0, 3])
        live.last = SimpleNamespace(t=t, rows=rows, innovation=np.array([2.0, -1e6]), spread=np.diag([4.0, 1.0]))
        shown.heard(t, {"x": 1.23456 + k, "y": 2.0} if k < 400 else {"x": 1.0})
    assert len(shown._estimated) == 225
    assert len(shown._measured) == 100
    assert shown._measured[1] == [1.235 + 4.0, 2.0]
    assert shown._estimated[-1] == [0.0, 1.0]
    assert list(shown._misses["x"])[:2] == [[0.0, 1.0], [2.0, 1.0]]
    assert shown._misses["r"][0] == [0.0, -99.0]
    assert not shown._misses["psi"]
    assert (shown._measured.maxlen, shown._misses["x"].maxlen) == (400, 240)
    shown.heard(1e6, {})  # another row than the last one
    assert len(shown._estimated) == 225
    assert (_round(1.23456789), _none(math.nan), _none(2.0)) == (1.23457, None, 2.0)


def test_a_picture_is_made_four_times_a_second_while_somebody_looks(monkeypatch: pytest.MonkeyPatch) -> None:
    now, made = [100.0], list[float]()
    monkeypatch.setattr(screen, "time", SimpleNamespace(monotonic=lambda: now[0]))
    shown = Screen(a_live(), "log")
    monkeypatch.setattr(shown, "_picture", lambda follower, at, force: made.append(at) or {})
    shown.look()
    assert made == []
    shown.looked = True
    for later in (0.0, 0.24, 0.02, 0.1, 0.2):
        now[0] += later
        shown.look()
    assert made == pytest.approx([100.0, 100.26, 100.56])
    shown.looked = False
    shown.look(force=True)
    assert len(made) == 4


def test_what_a_twin_leaves_behind_names_twenty_alarms_at_most() -> None:
    live = a_live(tally=SimpleNamespace(hours=[1, 2]))
    live.alarms = [SimpleNamespace(text=f"alarm {k}") for k in range(25)]
    found = provenance(live, "a log")
    assert found["alarms"] == [f"alarm {k}" for k in range(20)]
    assert (found["until"], found["hours"], found["log"], found["parameters"]) == (3.0, 2, "a log", ["a.b"])
    live.follower = None
    assert provenance(live, "a log")["until"] == 0.0
    assert vars(Counts()) == dict.fromkeys(("late", "waiting", "gaps", "restarts"), 0)


def test_faults_are_sought_over_a_minute_and_a_half_each_five_seconds() -> None:
    settings = machine().settings
    assert (settings.window, settings.spacing, settings.settle, settings.horizon) == (90.0, 5.0, 300.0, 60.0)
    assert settings.false_alarms == 0.2
    assert machine().patience == 10.0  # half of L/U

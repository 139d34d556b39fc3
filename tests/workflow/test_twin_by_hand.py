"""What a twin does with the rows of its log: when it waits, where it goes on, when it saves, what it shows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.data import Trial
from seatrial.report.blocks import Line, Table
from seatrial.ships.files import load
from seatrial.workflow.live import twin as following
from seatrial.workflow.validate import cautions

L7 = load("kvlcc2_l7")


class Clock:
    """A clock that a sleep moves on."""

    def __init__(self) -> None:
        self.now, self.slept = 100.0, list[float]()

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds


class Followed:
    """A live twin that keeps what it is fed, and raises an alarm at a time."""

    def __init__(self, alarm: float = math.inf) -> None:
        self.fed, self.alarms, self.follower, self.alarm = list[float](), list[Any](), object(), alarm

    def feed(self, t: float, values: Any) -> None:
        self.fed.append(t)
        if t == self.alarm:
            self.alarms.append(SimpleNamespace(named=t, text="wind changed", line="wind changed; allow for it"))


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(following, "time", made)
    return made


def rows(*times: float) -> Any:
    def some() -> Iterator[tuple[float, dict[str, float]]]:
        yield from ((t, {}) for t in times)

    return some


def log(*times: float, live: bool = False) -> Any:
    return following._Log("a", (), {}, rows(*times), None, live)


def follow(live: Followed, some: Any, begun: float = -math.inf, factor: float = math.inf, out: Path | None = None,
           note: Any = lambda _: None) -> list[float]:  # fmt: skip
    heard: list[float] = []
    screen: Any = SimpleNamespace(heard=lambda t, values: heard.append(t))
    following._follow(live, some, begun, factor, out, screen, note)  # type: ignore[arg-type]
    return heard


def test_rows_before_what_was_saved_are_not_fed_again(clock: Clock) -> None:
    live = Followed()
    assert follow(live, log(0.0, 5.0, 10.0, 15.0), begun=10.0) == [15.0]
    assert live.fed == [15.0]
    assert clock.slept == []


def test_a_wire_goes_on_ten_after_what_was_saved(clock: Clock) -> None:
    live = Followed()
    follow(live, log(0.0, 1.0, live=True), begun=50.0)
    assert live.fed == [60.0, 61.0]
    fresh = Followed()
    follow(fresh, log(0.0, 1.0, live=True), factor=1.0)
    assert fresh.fed == [0.0, 1.0]
    assert clock.slept == []  # a wire keeps time itself


def test_a_log_is_played_at_its_factor(clock: Clock) -> None:
    follow(Followed(), log(10.0, 14.0, 20.0), factor=2.0)
    assert clock.slept == pytest.approx([0.0, 2.0, 3.0])


def test_each_alarm_is_told_once_when_it_is_raised(clock: Clock) -> None:
    lines: list[str] = []
    follow(Followed(alarm=5.0), log(0.0, 5.0, 6.0), note=lines.append)
    assert lines == ["t = 5 s: wind changed; allow for it"]


def test_the_state_is_saved_each_ten_minutes_of_the_log_or_twenty_seconds_of_the_clock(
    clock: Clock, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    saved: list[float] = []
    live = Followed()
    monkeypatch.setattr(following, "save_state", lambda one, path: saved.append(one.fed[-1]))
    follow(live, log(0.0, 600.0, 601.0, 1201.0, 1201.5), begun=-0.5, out=tmp_path)
    assert saved == [600.0, 1201.0]
    saved.clear()
    follow(Followed(), log(*np.arange(0.0, 50.0, 5.0).tolist()), begun=-1.0, factor=1.0, out=tmp_path)
    assert saved == [25.0]  # 20 s after the first row nothing is over; the next is saved, 20 s more are not over
    saved.clear()
    follow(Followed(), log(0.0, 700.0), begun=-0.5)
    assert saved == []
    waiting = Followed()
    waiting.follower = None  # type: ignore[assignment]
    follow(waiting, log(0.0, 700.0), begun=-0.5, out=tmp_path)
    assert saved == []


def test_a_log_that_shows_too_little_is_refused_at_its_end() -> None:
    with pytest.raises(RequestError, match="a: no row shows heading, position and all controls"):
        following._keep(SimpleNamespace(follower=None), "a", None, lambda _: None)  # type: ignore[arg-type]
    following._keep(SimpleNamespace(follower=1), "a", None, lambda _: None)  # type: ignore[arg-type]


def test_a_summary_counts_hours_within_their_band_and_the_size_of_innovations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "parameters", lambda live: [{"path": "hull.N_r", "before": 1.0, "value": 2.5,
                                                                "sd": 0.125}])  # fmt: skip
    current = {"name": "current", "unit": "m/s", "value": 0.5, "sd": 0.25}
    monkeypatch.setattr(following, "unseen", lambda live: [current])
    hours = [SimpleNamespace(inside=lambda: True, nis=30.0, readings=20),
             SimpleNamespace(inside=lambda: False, nis=50.0, readings=20)]  # fmt: skip
    score = SimpleNamespace(count=7, rms=2.5, rival=10.0, held=0.95)
    live: Any = SimpleNamespace(follower=SimpleNamespace(t=1234.4), tally=SimpleNamespace(hours=hours), alarms=[],
                                trust=SimpleNamespace(scores={30.0: score}),
                                machine=SimpleNamespace(ship=SimpleNamespace(name="mine")))  # fmt: skip
    first, freed, others, ahead, last = following._shown(live, "a.csv")
    assert first == Line("mine on a.csv: 1234 s followed; innovations within their 95 % band in 1 of 2 hours, 2 of "
                         "what they should be")  # fmt: skip
    assert isinstance(freed, Table)
    assert isinstance(others, Table)
    assert isinstance(ahead, Table)
    assert freed.rows == (("hull.N_r", "1", "2.5", "0.12"),)
    assert others.rows == (("current", "m/s", "0.5", "0.25"),)
    assert ahead.rows == (("30", "7", "2.5", "10", "95"),)
    assert (freed.words, others.words, ahead.words) == ((), (1,), ())
    assert last == Line("no alarm")
    live.alarms = [SimpleNamespace(named=9.6, text="x", of=""), SimpleNamespace(named=9.7, text="y", of="x")]
    live.follower, live.tally.hours = None, []
    blocks = following._shown(live, "a.csv")
    assert blocks[-1] == Line("alarm at 10 s: x")  # the other is a consequence of it
    assert blocks[0].text.startswith("mine on a.csv: 0 s followed; innovations within their 95 % band in 0 of 0 hours")


def moving(t: np.ndarray, **meta: Any) -> Trial:
    usual = {"x": 0.0, "y": 0.0, "psi": 0.1, "u": 1.0, "v_m": 0.0, "r": 0.0, "n_P": 10.0, "delta": 0.1}
    return Trial("a", t, {n: np.full(len(t), v) for n, v in usual.items()}, meta=meta)


def test_a_leap_of_over_ten_steps_and_a_ship_of_another_length_are_warned_of() -> None:
    even = np.arange(20.0)
    assert cautions(L7, [moving(even)]) == []
    for gap, warned in ((10.0, False), (10.5, True)):
        t = np.concatenate([even, 19.0 + gap + even])
        lines = cautions(L7, [moving(t)])
        assert any("leaps over" in line for line in lines) is warned
    assert any(f"leaps over {gap:.3g} s" in line for line in lines)
    two = moving(np.array([0.0, 0.01]))
    assert not any("leaps" in line for line in cautions(L7, [two]))
    for factor, warned in ((1.019, False), (0.981, False), (1.021, True), (0.979, True)):
        lines = cautions(L7, [moving(even, L_pp=factor * L7.L_pp)])
        assert any("is of a ship of" in line for line in lines) is warned
    assert cautions(L7, [moving(even, L_pp="long")]) == []


def test_a_ship_that_feels_the_wind_is_told_where_there_is_none() -> None:
    even = np.arange(20.0)
    ship = load("kvlcc2")
    told = cautions(ship, [moving(even)])
    assert any("a has no wind (U_T, gamma_T); predicted in still air" in line for line in told)
    blown = moving(even).having(U_T=np.full(20, 5.0), gamma_T=np.zeros(20))
    assert not any("no wind" in line for line in cautions(ship, [blown]))


def test_rows_outside_of_the_complete_ones_and_gaps_within_are_counted() -> None:
    even = np.arange(30.0)
    torn = moving(even)
    torn = torn.having(u=np.where(even < 4, np.nan, 1.0), delta=np.where((even > 10) & (even < 14), np.nan, 0.1))
    lines = cautions(L7, [torn])
    assert "note: a: 4 rows outside of the complete ones are left out" in lines
    assert any("delta" in line and "3" in line for line in lines)
    assert not any("or the first after it at the start" in line for line in lines)


def test_recordings_follow_one_another_from_the_start_of_the_first() -> None:
    """Each begins at its own clock; a pause that lets its follower forget lies between them."""
    t = np.array([100.0, 101.0, 102.0])
    trials = [Trial(name, t + late, {"delta": np.zeros(3), "n_P": np.full(3, 10.0), "psi": np.zeros(3)}, {}, {})
              for name, late in (("a", 0.0), ("b", 7.0))]  # fmt: skip
    times = [t for t, _ in following._one_after_another(L7, trials, ())]
    pause = following._APART * L7.L_pp / L7.speed
    assert times == pytest.approx([0.0, 1.0, 2.0, 2.0 + pause, 3.0 + pause, 4.0 + pause])

"""What a fit writes and a browser reads: nothing is lost, nothing waits, nothing grows without end."""

from __future__ import annotations

import json
import math
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from seatrial.cli.fits import Words
from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.identify import Problem
from seatrial.identify.population.evolution import Evolution
from seatrial.identify.shooting.logo import Shooting
from seatrial.identify.trajectory.multistart import MultiStart
from seatrial.identify.trajectory.shooting import OneStep, Trajectory
from seatrial.identify.watch import part, stage, tell, with_values
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.realtime.fit_page.board import (
    BEFORE,
    DONE,
    FAILED,
    FITTING,
    REPORTING,
    STOPPED,
    WAITING,
    Board,
    Seen,
    Tracker,
    predicted,
    shown,
)  # fmt: skip
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

SHIP = load("kvlcc2_l7")
FREE = (
    Free("rudder.t_R", 0.5, 0.1, 0.9),
    Free("hull.Y_v", -0.3, prior=-0.3, sigma=0.05),
)


@pytest.fixture(scope="module")
def run() -> Trial:
    return simulate(SHIP, Zigzag(10.42, math.radians(20.0), math.radians(20.0)), dt=0.5, duration=200.0)


@pytest.fixture(scope="module")
def problem(run: Trial) -> Problem:
    return Problem(SHIP, (run,), FREE)


def rows(part, first: int, last: int) -> None:
    for k in range(first, last + 1):
        part(k, 100.0 / k, math.nan)


def test_each_browser_gets_every_row_once_and_a_reload_gets_all(problem: Problem) -> None:
    board = Board("run")
    early, late = Seen(), Seen()
    assert "part" not in board.news(early)
    one = board.begin("fit", problem, 50.0)
    rows(one, 1, 3)
    first = board.news(early)
    assert [row[0] for row in first["rows"]] == [1, 2, 3]
    assert first["anew"]
    assert first["part"]["free"][0]["unit"] == ""
    assert [p["path"] for p in first["part"]["free"]] == ["rudder.t_R", "hull.Y_v"]
    rows(one, 4, 5)
    again = board.news(early)
    assert [row[0] for row in again["rows"]] == [4, 5]
    assert "part" not in again
    assert "anew" not in again
    assert [row[0] for row in board.news(late)["rows"]] == [1, 2, 3, 4, 5]
    json.dumps(first, allow_nan=False)


def test_a_long_history_is_thinned_and_ends_with_its_last_row(problem: Problem) -> None:
    board, seen = Board("run"), Seen()
    one = board.begin("fit", problem, None)
    rows(one, 1, 10)
    board.news(seen)
    rows(one, 11, 20_001)
    news = board.news(seen)
    assert news["anew"]
    assert len(news["rows"]) < 4000
    assert news["last"][0] == 20_001
    iterations = [row[0] for row in news["rows"]]
    assert iterations == sorted(set(iterations))


@pytest.mark.slow
def test_telling_is_a_few_calls_however_long_the_fit(problem: Problem) -> None:
    """Nothing is predicted, formatted or looked through: the calls of a row, counted, are few and do not grow."""
    one, ship = Board("run").begin("fit", problem, None), with_values(SHIP, FREE, np.array([0.4, -0.2]))

    def calls(rows: range) -> float:
        count = 0

        def seen(_frame: object, event: str, _what: object) -> None:
            nonlocal count
            count += event in ("call", "c_call")

        before = sys.getprofile()
        sys.setprofile(seen)
        try:
            for k in rows:
                tell(one, (k, 1.0, math.nan), ship)
        finally:
            sys.setprofile(before)
        return count / len(rows)

    first, later = calls(range(1, 101)), calls(range(101, 5001))
    assert first < 100
    assert later < 1.5 * first


def test_ranges_hold_bounds_priors_and_starts(problem: Problem) -> None:
    told = Board("run").begin("fit", problem, None).told()["free"]
    bounded, drawn = told
    assert (bounded["from"], bounded["to"]) == (0.1, 0.9)
    assert drawn["low"] is None
    assert drawn["from"] == pytest.approx(-0.5)
    assert drawn["to"] == pytest.approx(-0.1)


def test_a_table_says_what_has_become_of_each_fit(problem: Problem, tmp_path: Path) -> None:
    files = {name: tmp_path / name for name in ("a", "b", "c")}
    board, told = Board("table", files), []
    both = Words(told.append, board=board)
    seen = part(both, "a", problem, None)
    assert seen is not None
    seen(1, 2.0, 3.0)
    files["a"].touch()
    part(both, "b", problem, None)
    part(both, "c", problem, None)
    assert board.news(Seen())["parts"] == [["a", DONE], ["b", FAILED], ["c", FITTING]]
    files["c"].touch()
    board.end(REPORTING)
    assert board.news(Seen())["parts"][2] == ["c", DONE]
    assert told == ["a: iteration 1: objective 2, validation 3"]
    assert Board("table", files).news(Seen())["parts"][0] == ["a", WAITING]
    assert part(print, "a", problem, None) is None


def test_fits_side_by_side_are_told_apart_by_their_threads(problem: Problem) -> None:
    board = Board("sweep")
    board.begin("a", problem, None)
    other = threading.Thread(target=board.begin, args=("b", problem, None))
    other.start()
    other.join()
    board.begin("c", problem, None)
    assert board.news(Seen())["parts"] == [["a", DONE], ["b", FITTING], ["c", FITTING]]
    board.end(DONE)
    assert board.news(Seen())["parts"] == [["a", DONE], ["b", DONE], ["c", DONE]]


def test_the_clock_stands_when_the_run_has_ended() -> None:
    now = [0.0]
    board = Board("run", clock=lambda: now[0])
    now[0] = 5.0
    board.end(REPORTING, "converged")
    now[0] = 7.0
    board.end(STOPPED, "interrupted")
    now[0] = 60.0
    news = board.news(Seen())
    assert (news["state"], news["text"], news["elapsed"]) == (STOPPED, "interrupted", 7.0)


def test_a_table_that_is_stopped_keeps_what_was_done_and_stops_the_rest(problem: Problem, tmp_path: Path) -> None:
    files = {name: tmp_path / name for name in ("b", "c", "d")}
    board = Board("table", files, before=("a",))
    assert board.news(Seen())["parts"] == [["a", BEFORE], ["b", WAITING], ["c", WAITING], ["d", WAITING]]
    board.begin("b", problem, None)
    files["b"].touch()
    board.begin("c", problem, None)
    board.end(STOPPED)
    assert board.news(Seen())["parts"] == [["a", BEFORE], ["b", DONE], ["c", STOPPED], ["d", WAITING]]


def test_what_goes_on_before_the_first_row_is_told_on_both_sides(problem: Problem) -> None:
    said: list[str] = []
    board = Board("run")
    seen = board.begin("a", problem, None)
    seen.beside = Words(said.append)
    stage(seen, "choosing widths: fit 1 of 4")
    assert said == ["choosing widths: fit 1 of 4"]
    assert board.news(Seen())["doing"] == "choosing widths: fit 1 of 4"


def test_one_fit_that_is_stopped_has_not_failed(problem: Problem) -> None:
    board = Board("run")
    board.begin("a", problem, None)
    board.end(STOPPED)
    assert board.news(Seen())["parts"] == [["a", STOPPED]]


@pytest.mark.parametrize("estimator", [
    Trajectory(window=50.0, every=4, iterations=4, threads=1), OneStep(iterations=3, threads=1),
    MultiStart(starts=2, iterations=3, threads=1), Shooting(window=50.0, iterations=4, threads=1),
    Evolution(population=4, largest=4, generations=6, runs=1, window=50.0, every=4, threads=1),
], ids=lambda e: type(e).__name__)  # fmt: skip
@pytest.mark.long
def test_every_search_tells_the_ship_it_has_and_the_fit_is_the_same(estimator, problem: Problem) -> None:
    boxed = replace(problem, free=(FREE[0],))
    one, plain = Board("run").begin("fit", boxed, None), []
    fit = estimator.fit(boxed, progress=one)
    alone = estimator.fit(boxed, progress=lambda *row: plain.append(row))
    np.testing.assert_array_equal(fit.values, alone.values)
    assert [row[:2] for row in one.history[1]] == [row[:2] for row in plain]
    assert one.found() == pytest.approx(list(fit.values), rel=0.05)


def test_values_that_make_no_ship_are_left_out(problem: Problem) -> None:
    one = Board("run").begin("fit", problem, None)

    def broken():
        raise ValueError("no ship")

    one.at(broken)
    assert one.found() == [None, None]


def test_tracks_of_different_kinds_with_a_break_at_every_restart(run: Trial) -> None:
    turn, other = replace(run, name="turn_1"), replace(run, name="zigzag_2")
    assert [t.name for t in shown((turn, replace(run, name="turn_2"), other))] == ["turn_1", "zigzag_2"]
    assert [t.name for t in shown((turn, replace(run, name="turn_2")))] == ["turn_1", "turn_2"]
    found = predicted(SHIP, run, 50.0)
    assert found["track"].count(None) == 3
    assert "failed" not in found
    lacking = Trial("bare", run.t, {name: run[name] for name in ("x", "y", "psi", "u", "v_m", "r")})
    assert "no channel n_P" in predicted(SHIP, lacking, None)["failed"]


@pytest.mark.long
def test_the_tracker_works_only_while_somebody_looks(problem: Problem) -> None:
    board = Board("run")
    one = board.begin("fit", problem, None)
    threads = []
    one.at(lambda: threads.append(threading.current_thread().name) or SHIP)
    one(1, 1.0, math.nan)
    with Tracker(board):
        time.sleep(0.7)
        assert one.tracks is None
        board.looked = True
        end = time.monotonic() + 10.0
        while one.tracks is None and time.monotonic() < end:
            time.sleep(0.05)
    assert one.tracks is not None
    assert one.tracks["iteration"] == 1
    assert set(threads) == {"tracks"}


def test_a_browser_is_told_what_is_new_else_every_two_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock alone is no news; the last picture is always shown, and says that it is the last."""
    now = [100.0]
    monkeypatch.setattr("seatrial.realtime.fit_page.board.time", SimpleNamespace(monotonic=lambda: now[0]))
    board = Board("run", clock=lambda: now[0])
    first, second = board.pictures(), board.pictures()
    assert first(False) == {"title": "run", "state": FITTING, "text": "", "elapsed": 0.0, "parts": [], "over": False}
    told = []
    for _ in range(5):
        now[0] += 0.9
        told.append(first(False) is not None)
    assert told == [False, False, True, False, False]
    board.text = "of two"
    assert first(False)["text"] == "of two"
    assert first(True)["over"] is True
    assert second(False)["text"] == "of two"

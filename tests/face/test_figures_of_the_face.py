"""What the face makes of numbers: draws in their units, tables of runs and fits, orders and weather as told."""

from __future__ import annotations

import math
import warnings
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import matplotlib
import numpy as np
import polars as pl
import pytest

import seatrial as st
from seatrial.core.errors import MissingError, RequestError
from seatrial.data.check import Finding
from seatrial.face import campaigns, orders, plots, running
from seatrial.face.campaigns import Draw, _least, _middle, _most, _number
from seatrial.face.fitting import Summary
from seatrial.face.orders import Order, Weather
from seatrial.face.running import Indices, here, options_of, told
from seatrial.face.trials import Findings
from seatrial.manoeuvres import Index

matplotlib.use("Agg")
from matplotlib.figure import Figure

DEGREE = math.pi / 180.0


# -- draws


@pytest.mark.parametrize(("found", "kind", "numbers", "within"), [
    (Draw.constant(9.0, unit="deg"), "constant", (9 * DEGREE,), None),
    (Draw.uniform(-10.0, 20.0, unit="deg"), "uniform", (-10 * DEGREE, 20 * DEGREE), None),
    (Draw.normal(9.0, 1.0, within=(5.0, 12.0), unit="kn"), "normal", (9 * 1852 / 3600, 1852 / 3600),
     (5 * 1852 / 3600, 12 * 1852 / 3600)),
    (Draw.lognormal(2.0, 0.3, within=(1.0, 4.0), unit="km"), "lognormal", (2000.0, 0.3), (1000.0, 4000.0)),
    (Draw.triangular(1.0, 2.0, 4.0), "triangular", (1.0, 2.0, 4.0), None),
    (Draw.levels([1.0, 2.0], unit="rpm"), "values", (1 / 60, 2 / 60), None),
])  # fmt: skip
def test_a_draw_is_in_its_unit(found: Any, kind: str, numbers: tuple[float, ...], within: Any) -> None:
    assert (found.kind, found.numbers) == (kind, pytest.approx(numbers))
    assert found.within == (within and pytest.approx(within))
    assert not found.factor


def test_a_draw_of_weighed_numbers_and_one_that_multiplies() -> None:
    chosen = Draw.choice([1.0, 2.0], [3.0, 1.0], unit="deg", factor=True)
    assert (chosen.kind, chosen.numbers, chosen.weights, chosen.factor) == (
        "choice", pytest.approx((DEGREE, 2 * DEGREE)), (3.0, 1.0), True
    )  # fmt: skip
    assert Draw.choice([1.0]).weights == ()
    makers = (Draw.constant, Draw.uniform, Draw.normal, Draw.lognormal, Draw.triangular, Draw.levels)
    given = ((1.0,), (1.0, 2.0), (1.0, 2.0), (1.0, 2.0), (1.0, 2.0, 3.0), ([1.0],))
    for make, numbers in zip(makers, given, strict=True):
        assert make(*numbers, factor=True).factor  # type: ignore[operator]
    with pytest.raises(RequestError, match="unit: no unit 'dgr'; near: deg"):
        Draw.constant(1.0, unit="dgr")


def test_a_table_of_runs_has_the_least_the_median_and_the_largest() -> None:
    column = pl.Series([3.0, -1.0, 10.0, None, 4.0])
    assert [_number(how(column)) for how in (_least, _middle, _most)] == [-1.0, 3.5, 10.0]
    assert _number(None) is None
    runs = campaigns.Runs(SimpleNamespace(name="a", rows=12, cases=tuple(SimpleNamespace(name=f"c{k}")  # type: ignore[arg-type]
                                                                         for k in range(7))))
    frame = pl.DataFrame({"case": [0, 0, 1], "run": [0, 1, 2], "x": [1.0, 5.0, 2.0], "y": [None, 3.0, 4.0]})
    runs.__dict__["_both"] = (frame, frame)
    table = runs.table
    assert table.title == "a: 12 runs of c0, c1, c2, c3, c4 ..."
    assert table.head == ("column", "least", "median", "largest", "runs")
    rows = {row[0]: row[1:] for row in table.rows}
    assert rows["x"] == (1.0, 2.0, 5.0, 3)
    assert rows["y"] == (3.0, 3.5, 4.0, 2)
    assert repr(runs) == "Runs('a', 7 cases, 12 runs, in memory)"
    assert repr(replace(runs, folder="out")).endswith("in out)")
    few = campaigns.Runs(SimpleNamespace(name="a", rows=1, cases=runs.plan.cases[:5]))  # type: ignore[arg-type]
    few.__dict__["_both"] = (frame, frame)
    assert few.table.title.endswith("c3, c4")


# -- fits


def fit(count: int = 2, others: int = 0, lines: int | None = None) -> Any:
    ship = st.load("kvlcc2_l7")
    free = st.near(ship, "hull.N_r", "hull.N_v", ratio=0.5)[:count]
    said = [SimpleNamespace(subject=one.path, status="identified", text="") for one in free]
    said += [SimpleNamespace(subject=f"pair {k}", status="", text="only the sum") for k in range(others)]
    diagnosis = None if lines is None else SimpleNamespace(lines=tuple(f"line {k}" for k in range(lines)))
    return SimpleNamespace(ship=ship, free=free, values=np.array([one.start * 1.1 for one in free]),
                           sigma=np.array([0.01, math.inf][:count]), verdicts=said, diagnosis=diagnosis,
                           objective=12.3456, status="converged")  # fmt: skip


def test_an_interval_holds_ninety_five_parts_of_a_hundred() -> None:
    first, second = Summary(fit()).table.rows
    path, unit, start, value, sigma, low, high, verdict = first
    assert (path, unit, verdict, sigma) == ("hull.N_r", "'", "identified", 0.01)
    assert value == pytest.approx(1.1 * start)  # type: ignore[operator]
    share = math.erf((high - value) / 0.01 / math.sqrt(2.0))  # type: ignore[operator]
    assert share == pytest.approx(0.95, abs=1e-9)
    assert value - low == pytest.approx(high - value)  # type: ignore[operator]
    assert second[4:7] == (None, None, None)
    assert Summary(fit()).table.title == "kvlcc2_l7: 2 parameters, objective 12.35, converged"


@pytest.mark.parametrize(("others", "lines", "notes"), [
    (4, 6, ["line 0", "line 1", "line 2", "line 3", "line 4", "line 5", "pair 0: only the sum", "pair 1: only the sum",
            "pair 2: only the sum", "pair 3: only the sum"]),
    (6, 8, ["line 0", "line 1", "line 2", "line 3", "line 4", "line 5", "... and 2 more: fit.diagnosis.lines",
            "pair 0: only the sum", "pair 1: only the sum", "pair 2: only the sum", "pair 3: only the sum",
            "... and 2 more verdicts"]),
    (0, None, ["the residuals were not tested"]),
])  # fmt: skip
def test_a_summary_shows_so_many_lines_and_verdicts(others: int, lines: int | None, notes: list[str]) -> None:
    assert list(Summary(fit(others=others, lines=lines)).table.notes) == notes


def test_a_problem_names_four_trials_and_how_many_more() -> None:
    ship = st.load("kvlcc2_l7")
    t = np.arange(5.0)
    trials = tuple(st.Trial(f"t{k}", t, {"psi": 0.0 * t}) for k in range(6))
    free = st.near(ship, "hull.N_r", ratio=0.5)
    assert st.Problem(ship, trials, free).table.notes == ("trials: t0, t1, t2, t3 and 2 more",)
    assert st.Problem(ship, trials[:4], free).table.notes == ("trials: t0, t1, t2, t3",)
    row = st.Problem(ship, trials, free).table.rows[0]
    assert row[:5] == ("hull.N_r", "'", free[0].start, free[0].low, free[0].high)
    assert row[5:] == (None, None)


# -- orders, weather, runs


def test_orders_of_which_nothing_is_said_leave_everything_to_the_manoeuvre() -> None:
    kinds = [one for one in vars(orders).values() if isinstance(one, type) and issubclass(one, Order) and one.kind]
    assert len(kinds) >= 19
    for kind in kinds:
        said = options_of(kind())
        assert said == {name: value for name, value in (("side", "starboard"), ("seed", 1))
                        if name in {f.name for f in fields(kind)}}, kind  # fmt: skip
    assert options_of(st.Zigzag(rudder_deg=20, heading_deg=10, side="port")) == {
        "side": "port", "rudder": 20, "heading": 10
    }  # fmt: skip
    assert options_of(st.Turning(steer_percent=50.0)) == {"side": "starboard", "steer": 50.0}


def test_weather_is_told_in_the_words_of_the_command_line() -> None:
    calm = running._around(Weather())
    assert {name: value for name, value in vars(calm).items() if value} == {}
    around = running._around(Weather(wind=8.1, wind_from_deg=30.0, gusts="davenport", current=0.5,
                                     current_towards_deg=270.0, wave_height=2.0, wave_period=7.0, waves_from_deg=45.0,
                                     depth=20.0))  # fmt: skip
    assert (around.wind, around.gusts, around.current, around.waves, around.depth) == (
        "8.1,30.0", "davenport", "0.5,270.0", "2.0,7.0,45.0", 20.0
    )  # fmt: skip
    assert here("--rudder and --rps; --waves") == "rudder_deg and n_P; waves"


def test_indices_are_in_degrees_and_to_their_resolution() -> None:
    found = Indices("a ship", {
        "overshoot": Index(0.1, "rad", resolution=0.5 * DEGREE), "advance": Index(301.234, "m", over_L=3.01234),
        "rate": Index(DEGREE, "rad/s"),
    })  # fmt: skip
    rows = {row[0]: row[1:] for row in found.table.rows}
    assert rows["overshoot"] == (5.73, "deg", None)  # 5.7296 to a tenth of half a degree
    assert rows["advance"] == (301.234, "m", 3.01234)
    assert rows["rate"][:2] == (pytest.approx(1.0), "deg/s")
    assert (len(found), [*found], found["advance"].value) == (3, ["overshoot", "advance", "rate"], 301.234)
    with pytest.raises(MissingError, match="a ship: no index 'advanse'; near: advance"):
        _ = found["advanse"]
    with pytest.raises(MissingError, match="no index 'advance'; there is none"):
        _ = Indices("a ship", {})["advance"]


def test_a_run_that_ended_early_warns_and_a_whole_one_does_not() -> None:
    def run(complete: bool, *notes: str) -> Any:
        return SimpleNamespace(name="zigzag", complete=complete, reason="the ship stopped", notes=notes)

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        told(run(True, "a note"))
    with pytest.warns(UserWarning, match="zigzag: the ship stopped; indices that the run did not reach are left out"):
        told(run(False))
    with pytest.warns(UserWarning, match="^much is doubtful$"):
        told(run(True, "warning: much is doubtful"))


# -- findings


def test_findings_are_counted_and_twelve_are_shown() -> None:
    kinds = ["error"] * 3 + ["warning"] * 6 + ["info"] * 5
    found = Findings(tuple(Finding(kind, f"w{k}", "here", "e", "r") for k, kind in enumerate(kinds)), 7)  # type: ignore[arg-type]
    lines = str(found).splitlines()
    assert lines[0] == "7 trials: 3 errors, 6 warnings, 5 notes"
    assert len(lines) == 14
    assert lines[-1] == "... and 2 more"
    assert lines[1] == "error: here: w0 (e); r"
    assert len(str(Findings(found[:12], 1)).splitlines()) == 13
    assert (len(found), len(found.errors), found[3].what, [one.what for one in found][-1]) == (14, 3, "w3", "w13")
    assert found.table.head == ("severity", "where", "what", "evidence", "remedy")
    assert found.table.rows[0] == ("error", "here", "w0", "e", "r")


# -- pictures


def sailed(psi: float, **meta: Any) -> st.Trial:
    t = np.linspace(0.0, 100.0, 101)
    return st.Trial("run", t, {"x": 6.0 * t * math.cos(psi), "y": 6.0 * t * math.sin(psi), "psi": np.full(101, psi),
                               "u": np.full(101, 6.0)}, meta=meta)  # fmt: skip


@pytest.mark.parametrize("psi", [0.0, 0.5 * math.pi, 2.0])
def test_a_hull_has_a_flat_stern_parallel_sides_and_a_pointed_bow(psi: float) -> None:
    """Corners in lengths ahead and half breadths to starboard; alike on both sides."""
    ax = Figure().add_subplot()
    plots.track(sailed(psi, L_pp=100.0), ax, outlines=2, breadth=30.0)
    east, north = ax.patches[0].get_xy()[:-1].T
    ahead = north * math.cos(psi) + east * math.sin(psi)
    aside = east * math.cos(psi) - north * math.sin(psi)
    corners = {(round(a, 6), round(b, 6)) for a, b in zip(ahead, aside, strict=True)}
    half = {(-50.0, 13.5), (-46.0, 15.0), (28.0, 15.0), (42.0, 9.0), (50.0, 0.0)}
    assert corners == half | {(a, -b) for a, b in half if b} | {(50.0, 0.0)}


def test_a_start_is_marked_and_gaps_are_left_out() -> None:
    trial = sailed(0.0, L_pp=100.0)
    trial = trial.having(x=np.where(np.arange(101) < 10, np.nan, trial["x"]))
    ax = Figure().add_subplot()
    plots.track(trial, ax, outlines=3)
    start = next(line for line in ax.lines if line.get_marker() == "o")
    assert start.get_xydata().tolist() == [[0.0, 60.0]]
    assert len(ax.patches) == 3
    assert ax.get_xlabel() == "east y [m]"
    alone = Figure().add_subplot()
    plots.track(sailed(0.0), alone)
    assert not alone.patches


@pytest.mark.slow
def test_channels_of_a_row_are_named_and_time_stands_below() -> None:
    trial = sailed(2.0)
    top, low = Figure().subplots(2)
    plots.series(trial, [("psi",), "u"], (top, low), label="mine")
    assert (top.get_xlabel(), low.get_xlabel()) == ("", "time t [s]")
    assert top.lines[0].get_label() == "mine"
    assert [text.get_text() for text in top.get_legend().get_texts()] == ["mine"]
    assert low.get_legend() is None
    assert top.lines[0].get_ydata()[0] == pytest.approx(math.degrees(2.0))
    assert low.lines[0].get_ydata()[0] == 6.0
    (both,) = plots.series(trial.having(v_m=trial["u"]), [("u", "v_m")], Figure().add_subplot(), label="mine")
    assert [line.get_label() for line in both.lines] == ["mine u", "mine v_m"]
    (plain,) = plots.series(trial, [("u",)], Figure().add_subplot())
    assert plain.get_legend() is None


@pytest.mark.parametrize(("rows", "height"), [(1, 2.4), (2, 3.0), (4, 6.0)])
def test_new_axes_have_a_row_each(rows: int, height: float, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(plots, "_made", lambda count, size: asked.append((count, size)) or [])
    plots._axes(rows, None)
    assert asked == [(rows, (6.4, height))]


def test_a_ship_that_is_saved_loads_again_with_its_numbers(tmp_path: Path) -> None:
    ship = st.load("kvlcc2_l7")
    again = st.load(str(ship.save(tmp_path / "mine.toml")))
    assert (tmp_path / "mine.toml").is_file()
    assert again.model == ship.model


def test_the_deviation_of_a_lognormal_is_of_the_logarithm_and_has_no_unit() -> None:
    """A median of 10 kn is 5.14 m/s; a deviation of .2 stays .2; both numbers of a normal one have the unit."""
    knot = 1852.0 / 3600.0
    assert Draw.lognormal(10.0, 0.2, unit="kn").numbers == pytest.approx((10.0 * knot, 0.2))
    assert Draw.normal(10.0, 2.0, unit="kn").numbers == pytest.approx((10.0 * knot, 2.0 * knot))

"""Columns of a campaign's table: types, nulls, units; and inputs that can be, before anything is computed."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import seatrial as st
from seatrial.campaign import Campaign, CampaignError, Case, Criterion, Tracks
from seatrial.campaign.analysis import analyse
from seatrial.campaign.chunk import check, compute
from seatrial.campaign.columns import index_units, meanings, typed, units_of
from seatrial.campaign.folder import open_folder, part_name
from seatrial.campaign.inputs import Input
from seatrial.campaign.running import run
from seatrial.campaign.tables import merge, scan
from seatrial.cli.app import main
from seatrial.core.executors import threads
from seatrial.environment import Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load

TEN = math.radians(10.0)
SHIP = load("kvlcc2_l7")
# 55 s: the quicker ones reach the second overshoot; the range of u ends some runs.
CASE = Case("case", replace(SHIP, validity={"u": (0.83, 2.0)}), Zigzag(11.85, TEN, TEN), SHIP.speed, 55.0, 0.1)
INPUTS = {
    "rudder.rate": Input("uniform", (0.03, 0.3)), "u": Input("uniform", (0.8, 1.3)),
    "policy.n_P": Input("normal", (11.85, 1.0)),
    "ship.hull.N_r": Input("normal", (1.0, 0.1), factor=True), "U_C": Input("uniform", (0.0, 0.1)),
}  # fmt: skip
LIMIT = 0.238
BOUND = {"narrow": Criterion("second_overshoot", -math.inf, LIMIT)}
CAMPAIGN = Campaign("columns", (CASE,), 60, INPUTS, chunk=25, criteria=BOUND, tracks=Tracks(50, ("psi", "delta")))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    where = tmp_path_factory.mktemp("columns") / "run"
    with threads(2) as pool:
        run(CAMPAIGN, where, pool=pool)
    return where


@pytest.fixture(scope="module")
def numbers() -> dict[str, np.ndarray]:
    """The columns as the loop has them: NaN for what a run does not have."""
    parts = [compute(CAMPAIGN, number).columns for number in range(CAMPAIGN.parts)]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def tables(folder: Path) -> list[pl.DataFrame]:
    merged = merge(open_folder(folder), folder.parent / "merged.parquet")[0]
    return [scan(open_folder(folder)).collect(), pl.read_parquet(merged)]


@pytest.mark.slow
def test_what_a_run_does_not_have_is_null(folder: Path, numbers: dict[str, np.ndarray]) -> None:
    """Averages of what is there, as any query gives them, are those of the finite numbers."""
    for table in tables(folder):
        assert list(table.columns) == list(numbers)
        for name, column in numbers.items():
            assert table[name].null_count() == np.count_nonzero(np.isnan(column)), name
            if table[name].dtype == pl.Float64:
                assert table[name].is_nan().sum() == 0
                assert np.array_equal(table[name].to_numpy(), column, equal_nan=True)
        reached = numbers["second_overshoot"][np.isfinite(numbers["second_overshoot"])]
        assert 5 < len(reached) < 55
        assert table["second_overshoot"].mean() == pytest.approx(reached.mean())
        assert table["second_overshoot"].count() == len(reached)
        assert 0 < table["failed"].count() < 60, numbers["u"]


@pytest.mark.slow
def test_verdicts_are_booleans_and_numbers_of_runs_whole(folder: Path, numbers: dict[str, np.ndarray]) -> None:
    for table in tables(folder):
        kinds = dict(table.schema)
        assert {name for name, kind in kinds.items() if kind == pl.Boolean} == {"complete", "narrow_met"}
        assert {name for name, kind in kinds.items() if kind == pl.Int64} == {"run", "case"}
        assert all(kind == pl.Float64 for name, kind in kinds.items() if kind not in (pl.Boolean, pl.Int64))
        assert table["complete"].to_list() == [value == 1.0 for value in numbers["complete"]]
        second = table["second_overshoot"]
        assert table["narrow_met"].to_list() == [None if v is None else v <= LIMIT for v in second]
        assert {True, False, None} == set(table["narrow_met"].to_list())


def test_each_file_has_the_unit_of_each_column(folder: Path) -> None:
    expected = {
        "run": "-", "case": "-", "rudder.rate": "rad/s", "u": "m/s", "policy.n_P": "1/s", "ship.hull.N_r": "-",
        "U_C": "m/s", "failed": "s", "complete": "-", "narrow_met": "-", "second_overshoot": "rad",
        "initial_turning_time": "s",
    }  # fmt: skip
    merge(open_folder(folder), folder.parent / "merged.parquet")
    for file in (folder / part_name(0), folder / part_name(2), folder.parent / "merged.parquet"):
        held = json.loads(pl.read_parquet_metadata(file)["seatrial.units"])
        assert list(held) == pl.read_parquet(file).columns
        assert expected.items() <= held.items()
    for file in (folder / part_name(1, "tracks"), folder.parent / "merged.tracks.parquet"):
        held = json.loads(pl.read_parquet_metadata(file)["seatrial.units"])
        assert held == {"run": "-", "t": "s", "psi": "rad", "delta": "rad"}
    assert open_folder(folder).manifest.units["u"] == "m/s"


@pytest.mark.slow
def test_stored_runs_have_the_units_of_their_indices() -> None:
    """Read by the manoeuvre itself, whose indices bear them."""
    case = Case("turn", SHIP, Turning(11.85, 0.6), SHIP.speed, 120.0, 0.2, whole=True)
    assert case.stored
    assert {"advance": "m", "drift": "rad", "time_90": "s"}.items() <= index_units(case, Uniform()).items()
    tally = replace(case, whole=False)
    both = index_units(tally, Uniform())
    assert both.items() <= index_units(case, Uniform()).items()


@pytest.mark.slow
def test_a_table_in_memory_has_the_same_types() -> None:
    runs = st.campaign("kvlcc2_l7", st.Zigzag(rudder_deg=10, heading_deg=10), runs=8, duration=30.0, dt=0.1,
                       inputs={"rudder.rate": st.Draw.uniform(2, 20, unit="deg/s")})  # fmt: skip
    table = runs.to_frame()
    assert table.schema["complete"] == pl.Boolean
    assert table.schema["run"] == pl.Int64
    assert not any(table[name].is_nan().any() for name in table.columns if table.schema[name] == pl.Float64)
    assert table.equals(typed(compute(runs.plan, 0).columns, runs.plan))
    counted = {row[0]: row[-1] for row in runs.table.rows}
    assert counted["complete"] == 8
    assert counted["failed"] == 0


def test_every_input_that_a_case_takes_has_a_meaning() -> None:
    known = meanings(CASE)
    assert known["rudder.rate"].unit == "rad/s"
    assert known["rudder.high"].unit == "rad"
    assert (known["policy.delta"].unit, known["depth"].unit, known["r"].unit) == ("rad", "m", "rad/s")
    assert units_of(CAMPAIGN)["rudder.rate"] == "rad/s"
    tug = Case("tug", load("container_son_nomoto"), Zigzag(1.0, TEN, TEN), 5.0, 10.0, 0.1)
    assert all(name in meanings(tug) for name in ("policy.n_P", "rudder.rate"))


@pytest.mark.parametrize(("name", "one", "told"), [
    ("rudder.rate", Input("uniform", (-3.0, -2.0)), "rudder.rate is -3 rad/s; it can be 1e-09 to inf"),
    ("rudder.rate", Input("uniform", (-1e-3, 1.0)), "rudder.rate is -0.001"),
    ("rudder.rate", Input("triangular", (-1.0, 0.5, 1.0)), "rudder.rate is -1"),
    ("rudder.rate", Input("constant", (0.0,)), "rudder.rate is 0"),
    ("rudder.rate", Input("uniform", (-1.1, -0.9), factor=True), "rudder.rate is -0.3"),
    ("rudder.rate", Input("normal", (0.1, 0.1), within=(-0.1, 0.3)), "rudder.rate is -0.1"),
    ("U_T", Input("choice", (1.0, -1.0), weights=(1.0, 0.0)), "U_T is -1 m/s"),
    ("depth", Input("uniform", (0.0, 10.0)), "depth is 0 m"),
    ("gamma_T", Input("uniform", (0.0, 360.0)), "180 deg is 3.14 rad"),
    ("ship.rudder.A_R", Input("uniform", (-0.2, 0.1)), "ship.rudder.A_R is -0.2"),
])  # fmt: skip
def test_a_distribution_that_ends_beyond_what_can_be_is_refused(name: str, one: Input, told: str) -> None:
    """By its ends, whatever the runs have drawn of it: a single run of random numbers need not show them."""
    with pytest.raises(CampaignError, match=f"inputs.{name}: {one.kind} .*{told}"):
        check(replace(CAMPAIGN, runs=1, inputs={name: one}, criteria={}))


def test_an_impossible_draw_far_down_is_refused_before_the_first_part() -> None:
    """Of 3000 rates with a mean of 3.2 standard deviations two are below zero; the first parts have none."""
    rate = {"rudder.rate": Input("normal", (0.32, 0.1))}
    far = replace(CAMPAIGN, runs=3000, inputs=rate, seed=3, chunk=25)
    first = Input("normal", (0.32, 0.1)).of(np.array([0.5]))
    assert first[0] == pytest.approx(0.32)
    with pytest.raises(CampaignError, match=r"run (\d+): rudder.rate is -.*within = \[low, high\]") as caught:
        check(far)
    assert int(str(caught.value).split("run ")[1].split(":")[0]) >= 25
    check(replace(far, runs=25))
    check(replace(far, inputs={"rudder.rate": Input("normal", (0.32, 0.1), within=(0.01, 1.0))}))


TOML = """schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = 4
[manoeuvre]
kind = "zigzag"
duration = 20.0
dt = 0.1
[inputs]
"""


@pytest.mark.parametrize(("line", "told"), [
    ('"rudder.rate" = { uniform = [-3, -2] }', "rudder.rate is -3 rad/s"),
    ('"rudder.rate" = { uniform = [2, 3], unit = "m" }', "rudder.rate.unit: 'm' cannot measure it; it is in rad/s"),
    ('"rudder.rate" = { uniform = [0.9, 1.1], factor = true, unit = "deg" }', "'deg' cannot measure it; it has none"),
    ('U_C = { value = 3, unit = "deg" }', "inputs.U_C.unit: 'deg' cannot measure it; it is in m/s"),
    ('[criteria]\nfirst_overshoot = { at_most = 3, unit = "m" }', "criteria.first_overshoot.unit: 'm' cannot measure"),
])  # fmt: skip
def test_a_file_with_an_impossible_input_is_refused_in_one_line(
    line: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.toml").write_text(TOML + line + "\n")
    assert main(["campaign", str(tmp_path / "a.toml"), "-o", str(tmp_path / "out")]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert told in said
    assert said.count("a.toml") == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_analysis_counts_what_is_there(folder: Path) -> None:
    table, found = scan(open_folder(folder)).collect(), analyse(open_folder(folder))
    (judged,), (lost,) = found.judged, found.lost
    met, second = table["narrow_met"], table["second_overshoot"]
    assert judged.missing == met.null_count() > 0
    assert (judged.violated.hits, judged.violated.runs) == ((~met).sum(), met.count())
    assert judged.worst[0].run == second.arg_max()
    assert judged.worst[0].value == second.max()
    assert (lost.failed.hits, lost.failed.runs) == (table["failed"].count(), 60)
    assert lost.incomplete.hits == (~table["complete"]).sum()
    assert lost.first_failed[0].value == table["failed"].min()
    (figure,) = (one for one in found.figures if one.index == "second_overshoot")
    assert (figure.spread.count, figure.spread.missing) == (second.count(), second.null_count())
    assert [one.value for one in figure.largest] == second.drop_nulls().sort(descending=True)[:5].to_list()
    assert [one.value for one in figure.smallest] == second.drop_nulls().sort()[:5].to_list()


@pytest.mark.slow
def test_of_saltelli_blocks_only_the_independent_runs_are_counted(tmp_path: Path) -> None:
    inputs = {"u": Input("uniform", (0.8, 1.3)), "rudder.rate": Input("uniform", (0.03, 0.3))}
    plan = Campaign("blocks", (replace(CASE, ship=SHIP),), 32, inputs, design="saltelli")
    with threads(1) as pool:
        run(plan, tmp_path / "run", pool=pool)
    table, found = scan(open_folder(tmp_path / "run")).collect(), analyse(open_folder(tmp_path / "run"))
    alone = table.filter(pl.col("run") % 4 % 3 == 0)["first_overshoot"]
    (figure,) = (one for one in found.figures if one.index == "first_overshoot")
    assert figure.spread.count == 16
    assert figure.spread.mean == pytest.approx(alone.mean())
    assert found.lost[0].failed.runs == 16

"""Rare events: probabilities that are known, and those of a ship against counting."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from seatrial.campaign import Campaign, CampaignError, Case, Criterion
from seatrial.campaign.chunk import compute
from seatrial.campaign.inputs import Input
from seatrial.campaign.rare import Rare, rare
from seatrial.campaign.rare.subset import MOST, Level, Limit, estimate, first_level, next_level
from seatrial.cli.app import main
from seatrial.data import Array
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load

DIMS, RARE, TEN = 6, 1e-6, math.radians(10.0)


def linear(z: Array) -> Array:
    return -stats.norm.ppf(RARE) - z.sum(axis=1) / math.sqrt(DIMS)


def sphere(z: Array) -> Array:
    return stats.chi2.isf(RARE, DIMS) - (z**2).sum(axis=1)


def two_sides(z: Array) -> Array:
    return -stats.norm.ppf(0.5 * RARE) - np.abs(z[:, 2])


def searched(limit: Limit, seed: int, runs: int = 1600) -> list[Level]:
    levels = [first_level(limit, seed, runs, DIMS)]
    while not levels[-1].last and not levels[-1].stalled and len(levels) < MOST:
        levels.append(next_level(limit, seed, len(levels), levels[-1]))
    return levels


@pytest.mark.slow
@pytest.mark.parametrize("limit", [linear, sphere, two_sides])
def test_one_in_a_million_from_ten_thousand_runs(limit: Limit) -> None:
    searches = [searched(limit, seed) for seed in range(40)]
    found = [estimate(levels) for levels in searches]
    values = np.array([one.probability for one in found])
    runs = np.mean([1600 + 1440 * (len(levels) - 1) for levels in searches])
    assert runs < 1.02e4
    assert abs(values.mean() / RARE - 1.0) < 3.0 * values.std() / values.mean() / math.sqrt(40)
    said = float(np.mean([one.variation for one in found]))
    assert 0.2 < said < 0.35
    assert values.std() / RARE < 1.6 * said  # the levels are not quite independent
    assert np.mean([one.interval[0] < RARE < one.interval[1] for one in found]) > 0.8


@pytest.mark.slow
def test_the_interval_of_one_in_a_hundred_thousand_holds_in_nine_of_ten() -> None:
    """A hundred repetitions of at most 2e4 runs each, of a probability that is known."""
    searches = [searched(lambda z: linear(z) + stats.norm.ppf(RARE) - stats.norm.ppf(1e-5), seed, 3600)
                for seed in range(100)]  # fmt: skip
    found = [estimate(levels).interval for levels in searches]
    assert max(3600 + 3240 * (len(levels) - 1) for levels in searches) <= 20_000
    assert sum(low <= 1e-5 <= high for low, high in found) >= 90


def test_a_frequent_event_is_simply_counted() -> None:
    (level,) = searched(lambda z: 1.0 - z[:, 0], 1)
    found = estimate([level])
    assert found.probability == np.mean(level.points[:, 0] > 1.0)
    assert found.variation == pytest.approx(math.sqrt((1.0 - found.probability) / (found.probability * 1600)))


def test_margins_without_slope_stall() -> None:
    """Two values only, of which the worse is rarer than a tenth: nothing says where it is nearer."""
    levels = searched(lambda z: np.where(z[:, 0] > 4.0, -1.0, 1.0), 1)
    assert levels[-1].stalled or not levels[-1].share
    assert len(levels) < MOST
    assert searched(lambda z: np.full(len(z), math.nan), 1)[0].stalled


def test_an_impossible_event_is_not_found() -> None:
    levels = searched(lambda z: 1.0 + np.exp(-z[:, 0]), 1, 400)
    assert len(levels) == MOST
    assert not levels[-1].last
    assert estimate(levels).probability <= 1e-11
    unreachable = searched(lambda z: np.where(z[:, 0] > 0, np.nan, z[:, 0] + 20.0), 1, 400)
    assert not any((level.margins < 0).any() for level in unreachable[:3])


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    ship = load("kvlcc2_l7")
    case = Case("case", ship, Zigzag(11.85, TEN, TEN), ship.speed, 40.0, 0.2)
    inputs = {
        "ship.hull.N_r": Input("normal", (1.0, 0.1), factor=True),
        "rudder.rate": Input("uniform", (math.radians(2.0), math.radians(20.0))),
    }
    bound = {"first_overshoot": Criterion("first_overshoot", -math.inf, math.radians(14.5))}
    return Campaign("test", (case,), 8000, inputs, criteria=bound, chunk=8000)


def counted(campaign: Campaign) -> tuple[float, float]:
    """Probability of a violation by counting, and its standard deviation."""
    met = [compute(campaign, number, 2).columns["first_overshoot_met"] for number in range(campaign.parts)]
    p = float(np.mean(np.concatenate(met) == 0.0))
    return p, math.sqrt(p / campaign.runs)


def agrees(found: Rare, p: float, sigma: float) -> bool:
    own = found.estimate.probability * found.estimate.variation
    return abs(found.estimate.probability - p) < 2.5 * math.hypot(own, sigma)


@pytest.mark.slow
def test_a_ship_is_as_counting_says(campaign: Campaign, tmp_path: Path) -> None:
    (found,) = rare(campaign, "first_overshoot", tmp_path / "a", runs=1000)
    assert agrees(found, *counted(campaign))
    assert found.estimate.probability < 0.03
    assert found.nearest["first_overshoot"] > math.radians(14.5)
    assert found.nearest["rudder.rate"] < math.radians(5.0)  # a slow rudder is what does it


@pytest.mark.long
def test_one_in_a_thousand_is_as_counting_says(campaign: Campaign, tmp_path: Path) -> None:
    strict = {"first_overshoot": Criterion("first_overshoot", -math.inf, math.radians(16.7))}
    own = replace(campaign, criteria=strict, runs=200_000)
    p, sigma = counted(own)
    assert 3e-4 < p < 3e-3
    found = [rare(replace(own, seed=k), "first_overshoot", tmp_path / str(k))[0] for k in range(10)]
    assert sum(agrees(one, p, sigma) for one in found) >= 8
    values = np.array([one.estimate.probability for one in found])
    assert abs(values.mean() / p - 1.0) < 3.0 * values.std() / values.mean() / math.sqrt(10)


@pytest.mark.slow
def test_a_search_that_was_cut_off_ends_with_the_same_numbers(campaign: Campaign, tmp_path: Path) -> None:
    (whole,) = rare(campaign, "first_overshoot", tmp_path / "a", runs=200)
    files = {path.name: path.read_bytes() for path in (tmp_path / "a" / "levels").iterdir()}
    last = sorted((tmp_path / "a" / "levels").iterdir())[-1]
    last.unlink()
    (again,) = rare(campaign, "first_overshoot", tmp_path / "a", runs=200, threads=2)
    assert again.estimate == whole.estimate
    assert {path.name: path.read_bytes() for path in (tmp_path / "a" / "levels").iterdir()} == files
    last.write_bytes(last.read_bytes()[:-40])
    with pytest.raises(CampaignError, match="cannot be read"):
        rare(campaign, "first_overshoot", tmp_path / "a", runs=200)


@pytest.mark.slow
def test_another_search_in_the_folder_is_refused(campaign: Campaign, tmp_path: Path) -> None:
    rare(campaign, "first_overshoot", tmp_path / "a", runs=100)
    with pytest.raises(CampaignError, match="holds another search"):
        rare(campaign, "first_overshoot", tmp_path / "a", runs=200)
    with pytest.raises(CampaignError, match="holds another search"):
        rare(replace(campaign, seed=2), "first_overshoot", tmp_path / "a", runs=100)
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(CampaignError, match="not empty"):
        rare(campaign, "first_overshoot", tmp_path, runs=100)


FILE = """
schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = 30
[manoeuvre]
kind = "zigzag"
rudder = 10.0
heading = 10.0
duration = 40.0
dt = 0.2
[inputs]
"ship.hull.N_r" = { normal = [1.0, 0.1], factor = true }
"rudder.rate" = { uniform = [2.0, 20.0], unit = "deg/s" }
[criteria]
first_overshoot = { at_most = 14.5, unit = "deg" }
third_overshoot = { at_most = 14.5, unit = "deg" }
"""


@pytest.mark.slow
def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = tmp_path / "c.toml", tmp_path / "out"
    file.write_text(FILE)
    assert main(["campaign", str(file), "--rare", "first_overshoot", "--runs", "200", "-o", str(out), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == json.loads((out / "rare.json").read_text())
    (case,) = said["cases"]
    assert case["interval"][0] < case["probability"] < case["interval"][1] < 0.1
    assert case["runs"] == 200 + 180 * (len(case["levels"]) - 1)
    page = (out / "report.html").read_text()
    assert f"seatrial simulate --from {out} {case['run']}" in page
    assert "≤ 14.5" in page


@pytest.mark.slow
def test_the_violation_that_is_named_is_sailed_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = tmp_path / "c.toml", tmp_path / "out"
    file.write_text(FILE)
    assert main(["campaign", str(file), "--rare", "first_overshoot", "--runs", "200", "-o", str(out), "--json"]) == 0
    (case,) = json.loads(capsys.readouterr().out)["cases"]
    file.unlink()
    assert main(["simulate", "--from", str(out), str(case["run"]), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["inputs"]["ship.hull.N_r"] == pytest.approx(case["nearest"]["ship.hull.N_r"], rel=1e-12)
    degrees = said["indices"]["first_overshoot"]["value"]
    assert degrees > 14.5
    assert math.radians(degrees) == pytest.approx(case["nearest"]["first_overshoot"], rel=1e-9)
    for wrong in ("200", "100000"):
        assert main(["simulate", "--from", str(out), wrong]) == 2
        assert "no run" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--rare", "first_overshot"], "first_overshoot"),
        (["--rare", "first_overshoot", "--runs", "105"], "multiple of 10"),
        (["--rare", "first_overshoot", "--runs", "-10"], "multiple of 10"),
        (["--rare", "first_overshoot", "--threads", "0"], "--threads"),
        (["--rare", "first_overshoot", "--report"], "give one of them"),
        (["--runs", "100"], "--runs is for --rare"),
        (["--rare", "third_overshoot"], "longer duration"),
    ],
)
def test_wrong_requests_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    file = tmp_path / "c.toml"
    file.write_text(FILE)
    assert main(["campaign", str(file), *arguments, "-o", str(tmp_path / "out")]) == 2
    lines = [line for line in capsys.readouterr().err.strip().splitlines() if "level 1" not in line or said in line]
    assert len(lines) == 1
    assert said in lines[0]


def test_gusts_are_refused(campaign: Campaign, tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="gusts"):
        rare(replace(campaign, gusts="davenport"), "first_overshoot", tmp_path / "a")
    assert not (tmp_path / "a").exists()

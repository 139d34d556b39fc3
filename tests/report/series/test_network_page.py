"""The report of a table of fits: the verdict on a claim, and that page and JSON say what the predictions are."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.report.page import write
from seatrial.report.series import covered, page, seeds, validation
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate
from seatrial.study.series import Claim, Published, Row, Series
from seatrial.validate.comparison import constant_velocity
from seatrial.validate.metrics import standardised
from seatrial.validate.series import BASELINE, TOGETHER, Member, Standing, Table, judged, outcomes
from summaries import summary_of

SIGMA = {"x": 10.0, "y": 4.0, "psi": 2.0, "u": 0.1, "v_m": 0.05, "r": 0.02}
SHIP = load("esso_osaka_3m")


def standing(key: str, *errors: float) -> Standing:
    return Standing(key, key, "", (), {"random": np.array(errors)}, {})


def verdict(better: tuple[float, ...], worse: tuple[float, ...], factor: float = 1.0) -> str:
    table = Table(("random",), (standing("a", *better), standing("b", *worse)), (), SIGMA)
    claim = Claim(says="", better="a", worse="b", rows=("random",), factor=factor)
    return outcomes(table, claim)[0].verdict


@pytest.mark.parametrize(
    ("better", "worse", "factor", "said"),
    [
        ((1.0,), (1.1,), 1.0, "holds"),
        ((1.0,), (0.9,), 1.0, "does not hold"),
        ((1.0,), (1.0,), 1.0, "holds"),
        ((1.0,), (11.0,), 10.0, "holds"),
        ((1.0,), (9.0,), 10.0, "does not hold"),
        ((1.0,), (math.inf,), 10.0, "holds"),
        ((math.inf,), (1.0,), 1.0, "does not hold"),
        ((math.inf,), (math.inf,), 1.0, "does not hold"),
        ((1.0, 1.2, 0.8), (0.9, 1.1, 0.85), 1.0, "within the spread of the seeds"),
        ((1.0, 1.01, 0.99), (0.5, 0.51, 0.49), 1.0, "does not hold"),
        ((), (1.0,), 1.0, "not run"),
        # no worse, with a margin of a tenth
        ((1.0,), (0.95,), 0.9, "holds"),
        ((1.0,), (0.89,), 0.9, "does not hold"),
        ((1.0, 1.01, 0.99), (0.95, 0.96, 0.94), 0.9, "holds"),
        # whoever is better by less than the seeds scatter has not won either
        ((1.0, 1.2, 0.8), (1.05, 1.25, 0.85), 1.0, "within the spread of the seeds"),
        ((1.0, 1.01, 0.99), (1.5, 1.51, 1.49), 1.0, "holds"),
    ],
)
def test_a_claim(better: tuple[float, ...], worse: tuple[float, ...], factor: float, said: str) -> None:
    assert verdict(better, worse, factor) == said


def test_no_credit_to_a_residual_that_was_not_used() -> None:
    bare, wide = (replace(standing("a", 1.0), title="hybrid", width=width) for width in (0.0, 0.3))
    claim = Claim(says="", better="a", worse="b", rows=("random",))
    table = Table(("random",), (bare, standing("b", 2.0)), (), SIGMA)
    assert outcomes(table, claim)[0].verdict == "holds without residual"
    assert outcomes(replace(table, standings=(wide, standing("b", 2.0))), claim)[0].verdict == "holds"
    assert outcomes(replace(table, standings=(bare, standing("b", 0.5))), claim)[0].verdict == "does not hold"
    assert (bare.name, wide.name) == ("hybrid: no residual", "hybrid: residual width 0.3")
    assert standing("a", 1.0).name == "a"


def test_mean_and_deviation_over_the_seeds() -> None:
    one = standing("a", 1.0, 2.0, 3.0)
    assert one.mean("random") == pytest.approx(2.0)
    assert one.deviation("random") == pytest.approx(1.0)  # n - 1
    assert math.isnan(standing("a", 1.0).deviation("random"))
    assert math.isnan(standing("a", 1.0, math.inf).deviation("random"))


def trial(name: str, rudder: float) -> Trial:
    wind = Uniform(U_T=1.0, gamma_T=1.0)
    return simulate(SHIP, Turning(10.0, rudder), speed=0.3, duration=25.0, dt=0.1, environment=wind, name=name)


@pytest.fixture(scope="module")
def series() -> Series:
    wrong = replace(SHIP, model=replace(SHIP.model, hull=replace(SHIP.model.hull, N_r=1.3 * SHIP.model.hull.N_r)))
    tests = {"turning": trial("t", 0.5), "berthing": trial("b <1>", -0.3)}
    rows = (Row("true", "what made them", SHIP, (), ()), Row("wrong", "another yaw damping", wrong, (), (), "MMG"))
    return Series(
        "demo", Path("demo.toml"), "A <table>", "", rows, tests, {},
        (Claim(says="Truth is better", better="true", worse="wrong", rows=("turning",)),),
        Published(source="a paper", note="protocol not confirmed",
                  rows={"MMG": {"turning": (0.8, 0.1), "berthing 3": (0.2,)}}),
        10.0, SIGMA, ("true", "wrong"), (), ("berthing",),
    )  # fmt: skip


def test_the_errors_are_those_of_the_evaluator(series: Series, tmp_path: Path) -> None:
    found = judged(series, tmp_path)
    for key, ship in (("true", SHIP), ("wrong", series.rows[1].ship)):
        alone = found.standing(key)
        assert alone is not None
        total = 0.0
        for label, measured in series.tests.items():
            guess = replay(ship, measured, restart=10.0, method="euler")
            value = standardised(measured, guess, SIGMA, restart=10.0)
            assert alone.mean(label) == pytest.approx(value, rel=1e-12)
            total += value * len(measured)
        assert alone.mean(TOGETHER) == pytest.approx(total / sum(len(t) for t in series.tests.values()), rel=1e-12)
    steady = found.standing(BASELINE)
    assert steady is not None
    measured = series.tests["turning"]
    assert steady.mean("turning") == pytest.approx(
        standardised(measured, constant_velocity(measured, 10.0), SIGMA, restart=10.0)
    )


@pytest.mark.slow
def test_a_hybrid_without_residual_is_called_so(series: Series) -> None:
    bare = replace(standing("true", 1.0), title="a hybrid", members=(one_member(),), width=0.0,
                   errors={name: np.array([1.0]) for name in ("turning", "berthing", TOGETHER)})  # fmt: skip
    other = replace(bare, key="wrong", title="another", width=0.3, errors={k: 2.0 * v for k, v in bare.errors.items()})
    last = replace(other, key=BASELINE, title=BASELINE, members=(), width=math.nan)
    found = Table(("turning", "berthing", TOGETHER), (bare, other, last), (), SIGMA)
    claims = tuple((c, tuple(outcomes(found, c))) for c in series.claims)
    html = page(replace(series, draw=()), replace(found, claims=claims), {}, provenance={}).html
    assert "<td>a hybrid: no residual</td>" in html
    assert "<td>another: residual width 0.3</td>" in html
    assert "a hybrid has no residual (left-out trials chose none) and stands for its physics" in html
    assert "holds for the physics alone, no residual, in turning" in html
    assert "<b>0 of 1</b>" in html


def one_member() -> Member:
    return Member(None, SHIP, np.zeros((0, 4)), math.nan, None)


def test_epochs_are_whole_numbers() -> None:
    history = np.array([[k, 1.0, 0.5 / k, 0.0] for k in (1, 2, 3)])
    curves = validation(replace(standing("a", 1.0), members=(replace(one_member(), history=history),)))
    ticks = re.findall(r">([0-9.]+)</text>", curves.split(">epoch<")[0])
    assert ticks == ["1", "2", "3"]


@pytest.mark.slow
def test_losses_close_to_each_other_are_told_in_digits() -> None:
    history = np.array([[k, 0.1914 + 1e-4 * k, math.nan, 0.0] for k in (1, 2, 3)])
    drawn = validation(replace(standing("a", 1.0), members=(replace(one_member(), history=history),)))
    ticks = re.findall(r">([^<]+)</text>", drawn.split(">epoch<")[1])
    numbers = [tick for tick in ticks if tick.startswith("0.191")]
    assert len(numbers) == len(set(numbers)) > 2


@pytest.mark.slow
def test_what_each_fit_took_wraps(series: Series, tmp_path: Path) -> None:
    found = judged(series, tmp_path)
    long = replace(one_member(), summary=summary_of(status="no better for 20 epochs; " * 20))
    found = replace(found, standings=(replace(found.standings[0], members=(long,)),))
    html = page(series, found, {}, provenance={}).html
    assert re.search('<h2>Cost of each fit</h2><div class="wrap( stack)?">', html)


@pytest.mark.slow
def test_the_legend_of_all_seeds_has_titles(series: Series, tmp_path: Path) -> None:
    drawn = seeds(judged(series, tmp_path).standings[:2], "turning")
    assert ">what made them</text>" in drawn
    assert ">another yaw damping</text>" in drawn


@pytest.mark.long
def test_page_and_numbers(series: Series, tmp_path: Path) -> None:
    found = judged(series, tmp_path)
    path = write(tmp_path / "report.html", page(
        series, found, covered(series), provenance={"study": "demo.toml"}, failed=["x: y"]))  # fmt: skip
    html = path.read_text(encoding="utf-8")
    assert "A &lt;table&gt;" in html
    assert "b &lt;1&gt;" in html
    assert "http" not in html.replace("http://www.w3.org", "")
    for words in ("MMG, turning", "0.800 ± 0.100", "MMG, berthing 3", "the recording is not in the set",
                  "Truth is better", "failed: x: y",
                  "<svg"):  # fmt: skip
        assert words in html
    numbers: Any = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    for words in ("sigma: x 10.00 m, y 4.000 m, psi 2.000 rad, u 0.1000 m/s, v_m 0.05000 m/s, r 0.02000 rad/s",
                  "what made them against another yaw damping", ">another yaw damping</text>"):  # fmt: skip
        assert words in html
    alone = html.split("<td>what made them</td>")[1].split("</tr>")[0]
    assert "±" not in alone
    wrong = found.standing("wrong")
    assert wrong is not None
    assert numbers["models"]["wrong"]["mean"]["turning"] == pytest.approx(wrong.mean("turning"))
    assert numbers["models"]["true"]["standard_deviation"]["turning"] is None
    assert numbers["claims"][0]["rows"][0]["verdict"] == "holds"
    assert numbers["published"]["protocol"] == "not confirmed"

"""The report of a table of fits: the verdict on a claim, and that page and JSON say what the predictions are."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.environment import Uniform
from seatrial.identify.series import Claim, Published, Row, Series
from seatrial.manoeuvres.turning import Turning
from seatrial.replay import replay
from seatrial.ships.files import load
from seatrial.simulate import simulate
from seatrial.validate.comparison import constant_velocity
from seatrial.validate.metrics import standardised
from seatrial.validate.network_page import write
from seatrial.validate.network_scores import BASELINE, TOGETHER, Standing, Table, judged, outcomes

SIGMA = {"x": 10.0, "y": 4.0, "psi": 2.0, "u": 0.1, "v_m": 0.05, "r": 0.02}
SHIP = load("esso_osaka_3m")


def standing(key: str, *errors: float) -> Standing:
    return Standing(key, key, "", (), {"random": np.array(errors)}, {})


def verdict(better: tuple[float, ...], worse: tuple[float, ...], factor: float = 1.0) -> str:
    table = Table(("random",), (standing("a", *better), standing("b", *worse)), (), SIGMA)
    return outcomes(table, Claim("", "a", "b", ("random",), factor))[0].verdict


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
    ],
)
def test_a_claim(better: tuple[float, ...], worse: tuple[float, ...], factor: float, said: str) -> None:
    assert verdict(better, worse, factor) == said


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
        (Claim("Truth is better", "true", "wrong", ("turning",), 1.0),),
        Published("a paper", "protocol not confirmed", {"MMG": {"turning": (0.8, 0.1), "berthing 3": (0.2,)}}),
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


@pytest.mark.long
def test_page_and_numbers(series: Series, tmp_path: Path) -> None:
    found = judged(series, tmp_path)
    page = write(tmp_path / "report.html", series, found, provenance={"study": "demo.toml"}, failed=["x: y"])
    html = page.read_text(encoding="utf-8")
    assert "A &lt;table&gt;" in html
    assert "b &lt;1&gt;" in html
    assert "http" not in html.replace("http://www.w3.org", "")
    for words in ("↳ paper, protocol not confirmed", "0.800 ± 0.100", "berthing 3", "Truth is better", "failed: x: y",
                  "<svg"):  # fmt: skip
        assert words in html
    numbers: Any = json.loads(page.with_suffix(".json").read_text(encoding="utf-8"))
    wrong = found.standing("wrong")
    assert wrong is not None
    assert numbers["models"]["wrong"]["mean"]["turning"] == pytest.approx(wrong.mean("turning"))
    assert numbers["models"]["true"]["standard_deviation"]["turning"] is None
    assert numbers["claims"][0]["rows"][0]["verdict"] == "holds"
    assert numbers["published"]["protocol"] == "not confirmed"

"""A study beside its publication: what differs is found by comparing, and named with its reason."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from network_trials import untrained
from seatrial.data import Trial
from seatrial.identify import Problem
from seatrial.identify.networks.training import Training
from seatrial.report.series.protocol import beside, data, departures, errors, settings
from seatrial.study.cells import Cell
from seatrial.study.data import Composition
from seatrial.study.schema import Published
from seatrial.study.series import Row, Series
from seatrial.validate.series import Standing, Table

SIGMA = {"x": 10.0, "y": 4.0, "psi": 2.0, "u": 0.1, "v_m": 0.05, "r": 0.02}


def trial(name: str, seconds: float = 30.0) -> Trial:
    return Trial(name, np.arange(0.0, seconds + 0.05, 0.1), {}, {}, {"source": "made"})


def made(estimator: Training, *, test: str = "zig 3") -> Series:
    problem = Problem(untrained(), (trial("zig 1"), trial("turn 1", 60.0)), (), validation=(trial("zig 2"),))
    row = Row("a", "a network", untrained(), ("@TZ",), (Cell(1, problem, estimator),), "Type-1")
    published = Published(
        source="a paper",
        rows={"Type-1": {"zigzag": (0.086, 0.063), "turning": (761.1, 1519.0)}},
        settings={"all": {"batch": 512, "learning_rate": 2e-5, "wind": "measured", "seeds": 1},
                  "Type-1": {"memory": 5}},
        seconds={"TZ": {"T": 60.0, "Z": 90.0}}, tests={"zigzag": "zig 3"}, why={"learning_rate": "scaled inputs"},
    )  # fmt: skip
    sets = {"TZ": Composition("TZ", {"T": ("turning/turn 1",), "Z": ("z/zig 1", "z/zig 2", "z/zig 3")})}
    return Series(
        "s", Path("s.toml"), "S", "", (row,), {"zigzag": trial(test)}, {"zigzag": trial("zig 2")}, (), published,
        100.0, SIGMA, (), (), (), compositions=sets,
    )  # fmt: skip


def test_a_setting_that_differs_is_named_with_its_reason() -> None:
    rows = {row.name: row for row in settings(made(Training(seeds=(1,), wind="measured")))}
    assert (rows["learning_rate"].printed, rows["learning_rate"].ours) == ("2e-05", "0.001")
    assert rows["learning_rate"].reason == "scaled inputs"
    assert rows["batch"].reason == rows["wind"].reason == rows["seeds"].reason == "as printed"
    assert rows["epochs"].printed == "not printed"
    assert rows["epochs"].reason == "the publication does not say"
    assert "threads" not in rows  # where it runs is no departure


def test_the_form_of_a_network_is_that_which_is_trained() -> None:
    rows = {row.name: row for row in settings(made(Training(hidden=7, memory=5)))}
    assert rows["hidden"].ours == "7"
    assert rows["memory"].same


def test_departures_follow_the_settings() -> None:
    asked = {"batch": 512, "learning_rate": 2e-5, "wind": "measured", "memory": 5}
    assert departures(made(Training(**asked)))["Type-1"] == []
    for name, value in {"batch": 128, "learning_rate": 1e-3, "wind": "true"}.items():
        assert departures(made(Training(**{**asked, name: value})))["Type-1"] == [name]


def test_seconds_that_are_missing_say_where_they_are() -> None:
    turning, zigzag, test = data(made(Training()))
    assert turning.same
    assert (zigzag.printed, zigzag.ours) == (90.0, pytest.approx(30.0))
    assert zigzag.reason == "watched: zig 2; kept for the test: zig 3"
    assert test.same
    other = data(made(Training(), test="zig 4"))
    assert other[-1].ours == "zig 4"
    assert other[-1].reason == "not explained"


def test_every_error_of_the_paper_has_its_place() -> None:
    series = made(Training(memory=5, wind="measured", learning_rate=2e-5), test="zig 4")
    one = Standing("a", "a", "Type-1", (), {"zigzag": np.array([0.5, 0.7])}, {})
    found = Table(("zigzag",), (replace(one, members=(object(),)),), (), SIGMA)  # type: ignore[arg-type]
    zigzag, turning = errors(series, found)
    assert (zigzag.printed, zigzag.ours) == ("0.086 ± 0.063", "0.600 ± 0.141")
    assert zigzag.reason == "another recording"
    assert (turning.printed, turning.ours) == ("761.1 ± 1519.0", "no such test")
    assert errors(series, Table(("zigzag",), (one,), (), SIGMA))[0].ours == "not run"
    assert beside(replace(series, published=Published(source="")), found).html == ""

"""Learning curves: what differs along a line is the seconds of one kind of trial, and nothing else."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from network_trials import untrained
from seatrial.data import Trial
from seatrial.identify import Problem
from seatrial.identify.networks.training import Training
from seatrial.report.series.judged import learning, lines, seconds
from seatrial.study.cells import Cell
from seatrial.study.schema import Published
from seatrial.study.series import Row, Series
from seatrial.validate.series import Standing, Table


def trial(kind: str, duration: float) -> Trial:
    return Trial(f"{kind} {duration:g}", np.arange(0.0, duration + 0.05, 0.1), {}, {}, {"kind": kind})


def row(key: str, **spent: float) -> Row:
    problem = Problem(untrained(), tuple(trial(kind, s) for kind, s in spent.items()), ())
    return Row(key, key, untrained(), (), (Cell(1, problem, Training()),))


ROWS = (row("all", random=60.0, turning=90.0), row("less", random=20.0, turning=90.0), row("none", turning=90.0),
        row("no turns", random=60.0), row("little", random=20.0, turning=30.0))  # fmt: skip
ERRORS = {"all": (0.2, 0.4), "less": (0.5,), "none": (2.0,), "no turns": (0.3,), "little": (9.0,)}


def series(*keys: str) -> Series:
    return Series("s", Path("s.toml"), "S", "", ROWS, {"random": trial("random", 10.0)}, {}, (), Published(source=""),
                  100.0, {}, (), (), (), curves={"a model": keys})  # fmt: skip


def table(**errors: tuple[float, ...]) -> Table:
    members = (object(),)
    standings = tuple(Standing(key, key, "", members, {"random": np.array(found)}, {})  # type: ignore[arg-type]
                      for key, found in errors.items())  # fmt: skip
    return Table(("random",), standings, (), {})


def test_a_panel_has_the_models_with_all_of_the_other_kinds() -> None:
    found = lines(series(*ERRORS), table(**ERRORS))["random"]
    assert [(p[0], round(p[1], 9)) for p in found["random"]["a model"]] == [(0.0, 2.0), (20.0, 0.5), (60.0, 0.3)]
    assert [p[0] for p in found["turning"]["a model"]] == [0.0, 90.0]
    (spread,) = [p[2] for p in found["random"]["a model"] if p[0] == 60.0]
    assert math.isclose(spread, 0.2 / math.sqrt(2.0))


@pytest.mark.slow
def test_what_is_not_fitted_yet_is_left_out() -> None:
    done = table(all=(0.2,), none=(2.0,))
    assert [p[0] for p in lines(series(*ERRORS), done)["random"]["random"]["a model"]] == [0.0, 60.0]
    some = replace(done.standings[0], members=())
    assert learning(series(*ERRORS), Table(("random",), (some,), (), {})).html == ""
    assert "<svg" in learning(series(*ERRORS), done).html
    assert learning(series(), done).html == ""


def test_seconds_are_of_the_training_alone() -> None:
    assert seconds(ROWS[0]) == {"random": 60.0, "turning": 90.0}
    assert seconds(replace(ROWS[0], cells=())) == {}

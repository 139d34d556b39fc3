"""Scores of the yardstick by independent formulas, what a question hides, and answers that are not whole."""

from __future__ import annotations

import math
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.records import read_record
from seatrial.data import DataError, Trial
from seatrial.identify import StudyError
from seatrial.study.schema import DataTable
from seatrial.validate.yardstick import SCHEMA, Question, SetFile, Task, asked, read_task, scored

STATES = ("x", "y", "psi", "u", "v_m", "r")
SAID = SetFile(title="a line", ship="kvlcc2_l7", given=["delta*", "U_T"], history=5.0, horizons=[2.0, 10.0],
               every=10.0, data=DataTable())  # fmt: skip


def straight(seconds: float = 60.0, dt: float = 0.5, speed: float = 2.0) -> Trial:
    """North at a constant speed; every channel counts rows, so that what is shown can be told."""
    t = 100.0 + dt * np.arange(round(seconds / dt) + 1)
    still = np.zeros(t.size)
    return Trial("straight", t, {"x": speed * (t - t[0]), "y": still, "psi": still, "u": still + speed, "v_m": still,
                                 "r": still, "delta": np.arange(t.size) * 1e-3, "U_A": still + 1.0,
                                 "U_T": still + 3.0})  # fmt: skip


def task(questions: tuple[Question, ...], known: tuple[Question, ...] = (), said: SetFile = SAID) -> Task:
    return Task("set", said, (), questions, known, dict.fromkeys(STATES, 2.0))


def off(question: Question, **by: float) -> Trial:
    """The truth, from its start on, with constant errors."""
    return question.truth.having(**{name: question.truth[name] + value for name, value in by.items()})


def test_a_question_hides_all_that_is_not_given_and_counts_from_its_start() -> None:
    (first, *others) = asked(straight(), SAID)
    assert len(others) == 4  # starts at 5, 15, 25, 35 and 45 s of 60, each with 10 s to predict
    assert first.asked.t[0] == -5.0
    assert first.asked.t[-1] == 10.0
    after = first.asked.t > 0.0
    for name in ("x", "u", "r", "U_A"):
        assert np.isnan(first.asked[name][after]).all()
        assert np.isfinite(first.asked[name][~after]).all()
    for name in ("delta", "U_T"):
        assert np.isfinite(first.asked[name]).all()
    assert first.truth.t[0] == 0.0
    assert first.truth["x"][0] == 10.0
    assert not first.asked.meta


def test_stretches_at_rest_do_not_count() -> None:
    still = straight()
    x = np.where(still.t < 130.0, 60.0, 60.0 + 2.0 * (still.t - 130.0))
    moving = [one.truth["x"][-1] for one in asked(still.having(x=x), replace(SAID, moving=1.0))]
    assert moving == [70.0, 90.0, 110.0]
    # the first of these stretches makes 10 m in 10 s
    moving = [one.truth["x"][-1] for one in asked(still.having(x=x), replace(SAID, moving=1.5))]
    assert moving == [90.0, 110.0]


def test_a_start_needs_a_reading() -> None:
    gap = straight()
    x = np.where(np.isclose(gap.t, 115.0), np.nan, gap["x"])
    assert len([*asked(gap.having(x=x), SAID)]) == 4


def test_errors_are_those_at_the_horizon_in_metres_and_radians() -> None:
    """Errors 3 and 4 m are 5 m; of headings .1 and -.3 rad the root mean square is sqrt(.05)."""
    one, two = [*asked(straight(), SAID)][:2]
    found = scored(task((one, two)), "m", [off(one, x=3.0, y=4.0, psi=0.1), off(two, x=-3.0, y=4.0, psi=-0.3)], [], 1.0)
    for ahead in found.ahead:
        assert ahead.position == pytest.approx(5.0)
        assert ahead.heading == pytest.approx(math.sqrt(0.05))
    # a drift of .1 m/s is .2 m after 2 s and 1 m after 10
    drift = one.truth.having(y=0.1 * one.truth.t)
    assert [a.position for a in scored(task((one,)), "m", [drift], [], 1.0).ahead] == pytest.approx([0.2, 1.0])


def test_equation_25_is_the_mean_square_over_the_scales_summed_over_states() -> None:
    """Errors of 1 in x and 3 in u with scales of 2: (1 + 9) / 4, the start itself being no prediction."""
    one, two = [*asked(straight(), SAID)][:2]
    found = scored(task((one, two)), "m", [off(one, x=1.0, u=3.0), off(two, x=-1.0, u=3.0)], [], 1.0)
    assert found.eq25 == pytest.approx(2.5)
    bare = Trial("a", one.truth.t, {name: one.truth[name] for name in ("x", "y", "psi")})
    assert math.isnan(scored(task((one,)), "m", [bare], [], 1.0).eq25)


def test_a_lap_too_many_counts_and_whole_turns_between_sensors_do_not() -> None:
    one = next(asked(straight(), SAID))
    lap = one.truth.having(psi=2.0 * math.pi * one.truth.t / 10.0)
    assert scored(task((one,)), "m", [lap], [], 1.0).ahead[1].heading == pytest.approx(2.0 * math.pi)
    turned = replace(one, truth=off(one, psi=2.0 * math.pi))
    assert scored(task((turned,)), "m", [off(one)], [], 1.0).ahead[1].heading == pytest.approx(0.0, abs=1e-12)


def test_bands_of_a_method_by_the_normal_distribution() -> None:
    """An error of one standard deviation in each of three: -3/2 - ln(sx sy spsi) - 3/2 ln(2 pi), all inside."""
    one = next(asked(straight(), SAID))
    n = np.ones(len(one.truth))
    told = off(one, x=1.0, y=2.0, psi=0.1).having(x_sd=1.0 * n, y_sd=2.0 * n, psi_sd=0.1 * n)
    found = scored(task((one,)), "m", [told], [], 1.0)
    assert found.own
    ahead = found.ahead[0]
    assert ahead.log_score == pytest.approx(-1.5 - math.log(0.2) - 1.5 * math.log(2.0 * math.pi))
    assert ahead.coverage == 1.0
    assert ahead.width == pytest.approx((2 * 1.96 * 1.5, 2 * 1.96 * 0.1), rel=1e-4)
    narrow = told.having(x_sd=0.5 * n)
    assert scored(task((one,)), "m", [narrow], [], 1.0).ahead[0].coverage == pytest.approx(2.0 / 3.0)


def test_bands_from_errors_on_training_trials_where_a_method_has_none() -> None:
    one, *rest = asked(straight(), SAID)
    known = [off(q, x=float(e), y=float(e), psi=0.1 * e) for q, e in zip(rest, (1.0, -1.0, 2.0, -2.0), strict=True)]
    found = scored(task((one,), tuple(rest)), "m", [off(one, x=3.2)], known, 1.0)
    sd = math.sqrt((1 + 1 + 4 + 4) / 4)
    assert not found.own
    assert found.ahead[0].width == pytest.approx((2 * 1.96 * sd, 2 * 1.96 * 0.1 * sd), rel=1e-4)
    assert found.ahead[0].coverage == pytest.approx(2.0 / 3.0)  # 3.2 > 1.96 * 1.58 = 3.10


@pytest.mark.parametrize("broken", ["none", "short", "late", "nan", "no heading", "between rows"])
def test_an_answer_that_is_not_whole_has_failed_and_no_score_is_the_better_for_it(broken: str) -> None:
    one = next(asked(straight(), SAID))
    whole = off(one)
    answer = {
        "none": None, "short": whole.rows(whole.t < 5.0), "late": whole.rows(whole.t > 3.0),
        "nan": whole.having(x=np.where(whole.t > 9.0, np.nan, whole["x"])),
        "no heading": Trial("a", whole.t, {"x": whole["x"], "y": whole["y"]}),
        "between rows": replace(whole, t=whole.t + 0.1),
    }[broken]  # fmt: skip
    found = scored(task((one,)), "m", [answer], [], 1.0)
    assert found.failed == 1
    assert math.isinf(found.ahead[1].position)
    assert math.isinf(found.eq25)


def test_the_start_itself_need_not_be_answered() -> None:
    one = next(asked(straight(), SAID))
    found = scored(task((one,)), "m", [off(one).rows(one.truth.t > 0.0)], [], 1.0)
    assert found.failed == 0
    assert [a.position for a in found.ahead] == pytest.approx([0.0, 0.0])


def test_the_sets_of_the_repository_are_whole_and_name_what_they_predict() -> None:
    """Each judges trials that no fit sees, at horizons that increase, and gives no state away."""
    paths = sorted((Path(__file__).parents[2] / "studies" / "yardstick").glob("*.toml"))
    assert len(paths) >= 7
    for path in paths:
        said = read_record(path, SetFile, SCHEMA, StudyError)
        tables = said.data.set or [said.data]
        train, test = ({one for table in tables for one in getattr(table, key)} for key in ("train", "test"))
        assert train, path
        assert test - train == test, path
        assert said.horizons == sorted(set(said.horizons)), path
        assert not [name for name in (*STATES, "U_A", "gamma_A", "U_G", "gamma_G") for one in said.given
                    if fnmatchcase(name, one)], path  # fmt: skip


def test_what_a_question_needs_is_said_in_a_line(tmp_path: Path) -> None:
    bare = Trial("bare", np.arange(50.0), {"u": np.ones(50)})
    with pytest.raises(DataError, match="bare: no channel x, y, psi"):
        next(asked(bare, SAID))
    file = tmp_path / "set.toml"
    file.write_text('schema = "seatrial-yardstick/1"\ntitle = "t"\nship = "kvlcc2_l7"\ngiven = ["delta"]\n'
                    "history = 5.0\nhorizons = [10.0, 5.0]\nevery = 5.0\n[data]\n")  # fmt: skip
    with pytest.raises(StudyError, match="horizons"):
        read_task(file)


VIRTUAL = """schema = "seatrial-yardstick/1"
title = "left out"
ship = "kvlcc2_l7"
given = ["n_P", "delta"]
history = 5.0
horizons = [5.0]
every = 10.0
left_out = 2
[data]
train = ["a", "b", "c"]
[virtual]
ship = "kvlcc2_l7"
seed = 1
duration = 20.0
sample = 0.5
[virtual.trials.a]
type = "turning:Turning"
rudder = 10.0
[virtual.trials.b]
type = "turning:Turning"
rudder = 20.0
[virtual.trials.c]
type = "turning:Turning"
rudder = -20.0
"""


def test_trials_left_out_in_turn_are_asked_about_once_each_of_one_that_has_not_seen_them(tmp_path: Path) -> None:
    file = tmp_path / "set.toml"
    file.write_text(VIRTUAL)
    whole = read_task(file)
    seen = [[trial.name for trial in part.train] for part in whole.parts]
    assert seen == [["c"], ["a", "b"]]
    out = [{round(float(one.truth["delta"][-1]), 3) for one in part.questions} for part in whole.parts]
    assert out == [{round(math.radians(10.0), 3), round(math.radians(20.0), 3)}, {round(math.radians(-20.0), 3)}]
    for key in ("questions", "known"):
        assert getattr(whole, key) == tuple(one for part in whole.parts for one in getattr(part, key))
    assert len(whole.questions) == 6  # starts at 5 and 15 s of 20, each with 5 s to predict
    for wrong in (VIRTUAL.replace("left_out = 2", "left_out = 3"),
                  VIRTUAL.replace('train = ["a", "b", "c"]', 'train = ["a", "b"]\ntest = ["c"]')):  # fmt: skip
        file.write_text(wrong)
        with pytest.raises(StudyError, match=r"left_out: . of . training trials"):
            read_task(file)

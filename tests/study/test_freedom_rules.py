"""The table [free]: widths by hand, the more specific pattern, sigmas of the ship file, what is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from seatrial.core.parameters import Free, ParameterError, read, specs
from seatrial.identify import Problem, StudyError
from seatrial.ships import Entry
from seatrial.ships.files import load
from seatrial.study.freedom import _specificity, freedom, stated, suspected, taken

SHIP = load("kvlcc2_l7")
Y_V = float(read(SHIP.model, "hull.Y_v"))


def one(entry: Any, path: str = "hull.Y_v", sigmas: dict[str, float] | None = None) -> Free:
    (found,), fixed = freedom(SHIP.model, {path: entry}, sigmas)
    assert fixed == ()
    return found


def test_a_prior_is_a_share_of_the_value_and_a_ratio_an_interval_about_it() -> None:
    prior = one({"prior": 0.3})
    assert (prior.path, prior.start, prior.prior, prior.sigma) == ("hull.Y_v", Y_V, Y_V, pytest.approx(0.3 * abs(Y_V)))
    meaning = specs(SHIP.model)["hull.Y_v"]
    assert (prior.low, prior.high) == (meaning.low, meaning.high)
    ratio = one({"ratio": 0.5})
    assert (ratio.low, ratio.high) == (pytest.approx(1.5 * Y_V), pytest.approx(0.5 * Y_V))  # the value is below zero
    assert math.isnan(ratio.prior)
    assert ratio.sigma == math.inf
    both = one({"ratio": 0.5, "low": 1.2 * Y_V, "sigma": 0.02, "start": 0.9 * Y_V})
    assert (both.low, both.high) == (pytest.approx(1.2 * Y_V), pytest.approx(0.5 * Y_V))
    assert (both.start, both.prior, both.sigma) == (0.9 * Y_V, Y_V, 0.02)
    tight = one({"ratio": 0.5, "high": 0.8 * Y_V})
    assert (tight.low, tight.high) == (pytest.approx(1.5 * Y_V), pytest.approx(0.8 * Y_V))


def test_the_floor_of_a_prior_is_its_least_sigma() -> None:
    assert one({"prior": 0.3, "floor": 0.01}).sigma == pytest.approx(0.3 * abs(Y_V))
    assert one({"prior": 0.3, "floor": 0.5}).sigma == 0.5
    zero = SHIP.having({"hull.X_vr": 0.0})
    (found,), _ = freedom(zero.model, {"hull.X_vr": {"prior": 0.3, "floor": 0.02}})
    assert (found.prior, found.sigma) == (0.0, 0.02)


def test_a_zero_is_left_fixed_by_a_pattern_and_refused_by_its_name() -> None:
    zero = SHIP.having({"hull.X_vr": 0.0})
    for entry in ({"prior": 0.3}, {"ratio": 0.3}):
        free, fixed = freedom(zero.model, {"hull.X_v*": entry})
        assert fixed == ("hull.X_vr",)
        assert "hull.X_vr" not in [f.path for f in free]
        with pytest.raises(StudyError, match=r"hull\.X_vr is zero"):
            freedom(zero.model, {"hull.X_vr": entry})


def test_the_more_specific_pattern_holds_whatever_the_order() -> None:
    tables = [{"hull.*": {"prior": 0.3}, "hull.Y_*": {"prior": 0.2}, "hull.Y_v": {"prior": 0.1}, "hull.N_r": False}]
    tables.append(dict(reversed(tables[0].items())))
    for table in tables:
        found = {f.path: f.sigma / abs(f.prior) for f in freedom(SHIP.model, table)[0]}
        assert found["hull.Y_v"] == pytest.approx(0.1)
        assert found["hull.Y_r"] == pytest.approx(0.2)
        assert found["hull.N_v"] == pytest.approx(0.3)
        assert "hull.N_r" not in found
        assert list(found) == [path for path in specs(SHIP.model) if path in found]  # in the order of the model
    assert _specificity("hull.Y_v") > _specificity("hull.Y_vvvvvvv*") > _specificity("hull.*")
    assert _specificity("hull.[XY]_v") < _specificity("a.b")
    assert _specificity("hull.Y_?") < _specificity("a.b")


@pytest.mark.parametrize(("entry", "error", "told"), [
    (0.3, StudyError, "is 0.3; write a table"), (True, StudyError, "is True; write a table"),
    ({"priro": 0.3}, StudyError, "no key 'priro'"), ({"prior": "a"}, StudyError, "prior is 'a'; it must be a number"),
    ({"prior": True}, StudyError, "prior is True"), ({"sigma": math.inf}, StudyError, "sigma is inf"),
    ({"prior": 0.0}, ParameterError, "prior is 0"), ({"ratio": -0.1}, ParameterError, "ratio is -0.1"),
    ({"sigma": 0.0}, ParameterError, "sigma is 0"), ({"prior": 0.1, "floor": 0.0}, ParameterError, "floor is 0"),
    ({}, StudyError, "give prior, sigma or ratio, or low and high"), ({"low": -1.0}, StudyError, "give prior, sigma"),
    ({"start": -1.0}, StudyError, "give prior, sigma"), ({"high": 0.0}, StudyError, "give prior, sigma"),
])  # fmt: skip
def test_an_entry_that_gives_no_freedom_is_refused(entry: Any, error: type[Exception], told: str) -> None:
    with pytest.raises(error, match=told):
        one(entry)


def test_a_range_beyond_what_a_parameter_can_be_is_refused_with_the_ratio_that_is_not() -> None:
    path = "rudder.t_R"
    value, meaning = float(read(SHIP.model, path)), specs(SHIP.model)[path]
    room = min(meaning.high - value, value - meaning.low) / value
    assert one({"ratio": 0.99 * room}, path).high <= meaning.high
    with pytest.raises(StudyError, match=rf"a ratio up to {math.floor(100 * min(room, 9.0)) / 100:g} stays within"):
        one({"ratio": 1.05 * room}, path)
    low = value * (1.0 - 1.05 * room)
    one({"ratio": 1.05 * room, "low": max(low, meaning.low), "high": min(2.0 * value, meaning.high)}, path)
    for entry in ({"low": meaning.low - 0.1, "high": value + 0.01}, {"low": value - 0.01, "high": meaning.high + 0.1}):
        with pytest.raises(StudyError, match="leaves what it can be"):
            one(entry, path)
    assert one({"low": meaning.low, "high": meaning.high}, path).low == meaning.low


def test_a_sigma_of_the_ship_file_is_a_prior_unless_the_entry_gives_one_or_refuses() -> None:
    sigmas = {"hull.Y_v": 0.004}
    assert one({}, sigmas=sigmas).sigma == 0.004
    assert one({"ratio": 0.5}, sigmas=sigmas).sigma == 0.004
    assert one({"prior": 0.1}, sigmas=sigmas).sigma == pytest.approx(0.1 * abs(Y_V))
    assert one({"sigma": 0.2}, sigmas=sigmas).sigma == 0.2
    assert one({"prior": False, "ratio": 0.5}, sigmas=sigmas).sigma == math.inf
    assert one({"sigma": 0.2, "prior": False}, sigmas=sigmas).sigma == 0.2
    table: dict[str, Any] = {"hull.Y_v": {}, "hull.Y_r": {}, "hull.N_v": {"prior": 0.2}, "hull.N_r": {"prior": False},
                             "hull.X_vr": {"sigma": 1.0}, "hull.R_0": False, "hull.N_vvr": {"ratio": 0.1}}  # fmt: skip
    every = dict.fromkeys(("hull.Y_v", "hull.N_v", "hull.N_r", "hull.X_vr", "hull.R_0", "hull.N_vvr"), 0.1)
    assert set(taken(SHIP.model, table, every)) == {"hull.Y_v", "hull.N_vvr"}


def test_sigmas_of_particulars_are_priors_and_those_of_a_fit_are_not() -> None:
    entries = {"hull.Y_v": Entry("estimated: clarke1983", -0.3, sigma=0.05), "hull.Y_r": Entry("a", 0.1),
               "hull.N_v": Entry("fitted in study s, from 1", -0.1, sigma=0.01),
               "hull.N_r": Entry("some paper", -0.05, sigma=0.02)}  # fmt: skip
    assert stated(replace(SHIP, entries=entries)) == {"hull.Y_v": 0.05, "hull.N_r": 0.02}
    no_estimate = {path: entry for path, entry in entries.items() if not entry.source.startswith("estimated")}
    assert "hull.N_v" not in stated(replace(SHIP, entries=no_estimate))


def test_suspects_are_asked_for_by_the_option_or_the_study_and_need_an_estimator_that_can() -> None:

    from seatrial.identify import Nuisance
    from seatrial.identify.trajectory.shooting import OneStep, Trajectory

    free = (one({"prior": 0.1}),)
    plain = Problem(SHIP, (), free)
    able = Trajectory(window=30.0)
    assert suspected("s", plain, able, False) is plain
    assert suspected("s", plain, able, True).nuisance.suspects == "auto"
    said = Problem(SHIP, (), free, nuisance=Nuisance(suspects="auto"))
    assert suspected("s", said, able, False) is said
    unable: Any = OneStep()
    assert suspected("s", plain, unable, False) is plain
    with pytest.raises(StudyError, match="s: --free-suspects needs the estimator"):
        suspected("s", plain, unable, True)
    with pytest.raises(StudyError, match=r's: nuisance\.suspects = "auto" needs'):
        suspected("s", said, unable, False)
    network = Problem(load("kvlcc2_l7_arx"), (), free)
    with pytest.raises(StudyError, match="this is Trajectory with"):
        suspected("s", network, able, True)

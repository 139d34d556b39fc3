"""What a study, a source of virtual trials and a table of fits mean where they say nothing, and where numbers end."""

from __future__ import annotations

from typing import Any

import pytest

from seatrial.core.records import filled
from seatrial.identify import StudyError
from seatrial.study import schema


def made(kind: type[Any], **given: Any) -> Any:
    return filled(kind, given, "a.toml", StudyError)


def test_a_study_of_a_ship_and_a_list_has_the_usual_settings() -> None:
    found = made(schema.StudyFile, ship="kvlcc2", data={})
    assert found.estimator == {"type": "shooting:Trajectory"}
    assert (found.data.root, found.data.extrapolate, found.data.train, found.data.scale_to) == (".", False, [], None)
    assert (found.loss.correlation, found.loss.scale, found.loss.weights) == (None, "noise", {})
    own = found.nuisance
    assert (own.initial, own.current, own.bias, own.common, own.suspects) == ({}, 0.0, {}, {}, "")
    assert (found.report.restart, found.report.published, found.virtual, found.rival) == (None, None, None, None)


def test_virtual_trials_last_ten_minutes_with_a_row_a_second_in_calm_water() -> None:
    """Those numbers stand in docs/studies.md."""
    found = made(schema.VirtualTable, ship="kvlcc2", seed=0, trials={"a": {"type": "straight:Straight"}})
    assert (found.duration, found.sample, found.step, found.speed) == (600.0, 1.0, 0.1, None)
    assert (found.orders, found.known, found.bench, found.wind_force) == (True, False, None, {})
    assert (found.wind.speed, found.wind.from_, found.wind.gusts) == (0.0, 0.0, "")
    assert (found.current.speed, found.current.towards) == (0.0, 0.0)
    one = found.trials["a"]
    assert (one.seed, one.rudder, one.heading, one.revolutions, one.speed, one.duration, one.current) \
        == (1, None, None, None, None, None, None)
    bench = made(schema.BenchTable, revolutions=[1.0, 2.0])
    assert (bench.repeats, bench.noise) == (1, 0.0)
    smoother = made(schema.SmootherTable, position=1.0, heading=0.1)
    assert (smoother.antenna, smoother.delay, smoother.current) == ((0.0, 0.0), 0.0, 0.0)


def test_a_table_of_fits_has_one_seed_and_claims_of_better_or_equal() -> None:
    found = made(schema.SeriesFile, data={"test": {"a": "b"}}, fits={"F": {}},
                 claims=[{"says": "x", "better": "F", "worse": "F", "rows": ["a"]}])  # fmt: skip
    assert found.seeds == [0]
    assert found.claims[0].factor == 1.0
    assert (found.published, found.budgets) == (None, {})
    fit = found.fits["F"]
    assert (fit.seeds, fit.validation, fit.loss) == (None, None, None)


PLACES: list[tuple[type[Any], dict[str, Any], str, Any, Any]] = [
    (schema.SmootherTable, {"position": 1.0, "heading": 1.0}, "position", 1e-9, 0.0),
    (schema.SmootherTable, {"position": 1.0, "heading": 1.0}, "heading", 1e-9, 0.0),
    (schema.SmootherTable, {"position": 1.0, "heading": 1.0}, "delay", 0.0, -1e-9),
    (schema.SmootherTable, {"position": 1.0, "heading": 1.0}, "current", 0.0, -1e-9),
    (schema.LossTable, {}, "correlation", 0.0, -1e-9),
    (schema.LossTable, {}, "weights", {"a": 1e-9}, {"a": 0.0}),
    (schema.NuisanceTable, {}, "current", 0.0, -1e-9),
    (schema.NuisanceTable, {}, "common", {"a": 1e-9}, {"a": 0.0}),
    (schema.ReportTable, {}, "restart", 1e-9, 0.0),
    (schema.SeriesReportTable, {}, "restart", 1e-9, 0.0),
    (schema.WindTable, {}, "speed", 0.0, -1e-9),
    (schema.CurrentTable, {}, "speed", 0.0, -1e-9),
    (schema.BenchTable, {}, "revolutions", [1.0, 2.0], [1.0]),
    (schema.BenchTable, {"revolutions": [1.0, 2.0]}, "repeats", 1, 0),
    (schema.BenchTable, {"revolutions": [1.0, 2.0]}, "noise", 0.0, -1e-9),
    (schema.VirtualTrialTable, {"type": "a"}, "speed", 0.0, -1e-9),
    (schema.VirtualTrialTable, {"type": "a"}, "duration", 1e-9, 0.0),
    (schema.VirtualTable, {"ship": "a", "seed": 0, "trials": {"a": {"type": "a"}}}, "seed", 0, -1),
    (schema.VirtualTable, {"ship": "a", "seed": 0, "trials": {"a": {"type": "a"}}}, "speed", 1e-9, 0.0),
    (schema.VirtualTable, {"ship": "a", "seed": 0}, "trials", {"a": {"type": "a"}}, {}),
    (schema.RivalTable, {}, "free", ["a"], []),
    (schema.TrialsTable, {}, "test", {"a": "b"}, {}),
    (schema.Claim, {"says": "x", "better": "a", "worse": "b"}, "rows", ["a"], []),
    (schema.Claim, {"says": "x", "better": "a", "worse": "b", "rows": ["a"]}, "factor", 1e-9, 0.0),
    (schema.SeriesFile, {"data": {"test": {"a": "b"}}, "fits": {"F": {}}}, "seeds", [3], []),
    (schema.SeriesFile, {"data": {"test": {"a": "b"}}}, "fits", {"F": {}}, {}),
]


@pytest.mark.parametrize(("kind", "others", "key", "least", "less"), PLACES,
                         ids=[f"{kind.__name__}-{key}" for kind, _, key, _, _ in PLACES])  # fmt: skip
def test_the_least_that_a_key_takes_is_taken_and_less_is_refused_at_its_key(
    kind: type[Any], others: dict[str, Any], key: str, least: Any, less: Any
) -> None:
    made(kind, **{**others, key: least})
    with pytest.raises(StudyError, match=rf"^a\.toml: {key}"):
        made(kind, **{**others, key: less})


def test_what_is_missing_or_of_another_type_is_told_at_its_place() -> None:
    for given, told in (
        ({"data": {}}, r"a\.toml: ship is missing"),
        ({"ship": 3, "data": {}}, r"a\.toml: ship is 3; it must be a text"),
        ({"ship": "a", "data": []}, r"a\.toml: data is \[\]; it must be a table"),
        ({"ship": "a", "data": {"train": ["a", 3]}}, r"a\.toml: data\.train\.1 is 3"),
        ({"ship": "a", "data": {"tain": []}}, r"a\.toml: data\.tain: no key 'tain'"),
        ({"ship": "a", "data": {"set": [{}, {"rot": "."}]}}, r"a\.toml: data\.set\.1\.rot: no key"),
    ):  # fmt: skip
        with pytest.raises(StudyError, match=told):
            made(schema.StudyFile, **given)

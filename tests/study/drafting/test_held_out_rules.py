"""What is held out of a first study: counts, sides, times and names by hand; and the numbers of its text."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.kinds import Kind
from seatrial.identify import StudyError
from seatrial.study.drafting import text
from seatrial.study.drafting.held_out import ROWS, copies, cut, dated, held_out, timed


def trial(name: str, start: str = "", rows: int = 40, seed: int = 0) -> Trial:
    t = np.arange(float(rows))
    x = np.random.default_rng(seed or sum(map(ord, name))).standard_normal(rows)
    return Trial(name, t, {"x": x, "u": 1.0 + x}, meta={"start": start} if start else {})


def kind(name: str, side: float | None = None) -> Kind:
    return Kind(name, {} if side is None else {"side": side})


def split(count: int, sides: list[float | None] | None = None, start: bool = True) -> tuple[list[str], list[str]]:
    """Names for training and test of `count` turns, recorded against the order of their names."""
    names = [f"t{k:02d}" for k in range(count)]
    stamps = [f"2020-01-{count - k:02d}T00:00:00Z" if start else "" for k in range(count)]
    trials = {name: trial(name, stamp) for name, stamp in zip(names, stamps, strict=True)}
    kinds = {name: kind("turning", side) for name, side in zip(names, sides or [None] * count, strict=True)}
    train, test, _ = held_out(trials, kinds, False)
    return list(train["turning"]), list(test.get("turning", ()))


@pytest.mark.parametrize(("count", "held"), [(2, 1), (3, 1), (4, 1), (5, 1), (7, 2), (8, 2), (10, 2), (11, 3), (12, 3)])
def test_a_quarter_is_held_out_the_latest(count: int, held: int) -> None:
    """round(count / 4), at least one of two; recorded later means a lower number here."""
    train, test = split(count)
    assert test == [f"t{k:02d}" for k in reversed(range(held))]
    assert train == [f"t{k:02d}" for k in reversed(range(held, count))]


def test_where_no_times_are_known_some_from_within_are_held_out() -> None:
    """The middle of each of as many equal parts of the order of names: of eight, the third and the seventh."""
    assert split(8, start=False)[1] == ["t02", "t06"]
    assert split(3, start=False)[1] == ["t01"]
    assert split(2, start=False)[1] == ["t01"]


def test_each_side_of_three_or_more_gives_its_own() -> None:
    sides: list[float | None] = [1.0, 1.0, 1.0, -1.0, -1.0, -1.0, -1.0, -1.0]
    _, test = split(8, sides)
    assert sorted(test) == ["t00", "t03"]
    _, few = split(4, [1.0, 1.0, 1.0, -1.0])
    assert few == ["t00"]  # the single one to port is kept for training
    _, two = split(4, [1.0, 1.0, -1.0, -1.0])
    assert two == ["t00"]  # no side has three: the latest of all


def test_one_of_each_kind_leaves_the_last_of_all_for_test() -> None:
    trials = {name: trial(name, f"2020-01-0{k}T00:00:00Z") for k, name in ((2, "a"), (3, "b"), (1, "c"))}
    kinds = {"a": kind("turning"), "b": kind("zigzag"), "c": kind("spiral")}
    train, test, notes = held_out(trials, kinds, False)
    assert test == {"zigzag": ("b",)}
    assert train == {"turning": ("a",), "zigzag": (), "spiral": ("c",)}
    assert set(notes) == {"turning: one recording only, for training; nothing of this kind judges the model",
                          "spiral: one recording only, for training; nothing of this kind judges the model",
                          "zigzag: in the test only"}  # fmt: skip
    _, _, cut_notes = held_out(trials, kinds, True)
    assert len(cut_notes) == 1
    assert cut_notes[0].startswith("one recording only: cut in time")


@pytest.mark.parametrize(("name", "seconds"), [
    ("a_1970-01-02_00:00:01", 86401.0), ("a 1970-01-01 010203", 3723.0), ("turn_02-Jan-1970_00_00_00", 86400.0),
    ("1970-01-01T00-01-00.csv", 60.0), ("1970-13-01_00:00:00", 0.0), ("a_1970-01-02", 0.0), ("plain", 0.0),
])  # fmt: skip
def test_a_date_in_a_name_is_seconds_since_1970(name: str, seconds: float) -> None:
    assert dated(name) == seconds


def test_times_are_known_where_two_differ() -> None:
    assert not timed({"a": trial("a"), "b": trial("b")})
    assert timed({"a": trial("a", "2020-01-01T00:00:00Z"), "b": trial("b", "2020-01-01T00:00:01Z")})
    assert not timed({"a": trial("a", "2020-01-01T00:00:00Z"), "b": trial("b", "2020-01-01T00:00:00Z")})
    assert not timed({"a": trial("a", "2020-01-01T00:00:00Z"), "b": trial("b")})


def test_a_copy_is_the_shorter_one() -> None:
    whole = trial("whole", rows=200, seed=5)
    part = Trial("part", whole.t[:120] - whole.t[0], {n: whole[n][:120] for n in whole.channels})
    assert copies({"part": part, "whole": whole, "other": trial("other", rows=200)}) \
        == {"part": "shares rows with whole, which is kept"}
    twins = {name: replace(whole, name=name) for name in "ba"}
    assert set(copies(twins)) == {"a"}  # of equal ones the first by name


def test_the_only_recording_is_cut_at_three_quarters() -> None:
    parts, both = cut({"logs/day one.csv": trial("x", rows=4 * ROWS)})
    assert list(parts) == ["day one.csv_first", "day one.csv_last"]
    assert [len(part) for part in both] == [3 * ROWS, ROWS]
    assert both[1].t[0] == 3.0 * ROWS
    assert "rows 1 to 90" in str(both[0].meta["processing"])
    with pytest.raises(StudyError, match="rows of one recording are too few"):
        cut({"a": trial("a", rows=4 * ROWS - 4)})


@pytest.mark.parametrize(("value", "shown"), [
    (0.0, "0.0"), (-3.0, "0.0"), (0.0123, "0.012"), (0.996, "1.00"), (1.26, "1.3"), (9.96, "10.0"), (12.6, "13.0"),
    (126.0, "130.0"), (1999.0, "2000.0"),
])  # fmt: skip
def test_a_number_of_the_text_has_two_figures(value: float, shown: str) -> None:
    assert text._round(value) == shown
    if value > 0.0:
        assert float(text._round(value)) == pytest.approx(value, rel=0.05)


def drafted(**more: Any) -> str:
    usual: dict[str, Any] = {
        "ship": "mine.toml", "family": "Mmg", "root": "logs", "format": "", "mapping": "", "actuators": (),
        "assumed": (),
        "files": {"a": "a[1].csv", "b": "b", "c": "c"}, "kinds": {"a": kind("turning"), "b": kind("zigzag")},
        "train": {"turning": ["a"]}, "test": {"zigzag": ["b"]}, "left_out": {"c": "too short"},
        "free": [("hull.*", 0.3, ("hull.Y_v", "hull.N_r")), ("K", 0.5, ("K",)), ("c.*", math.nan, ("c.a", "c.b"))],
        "limits": {}, "sampled": False, "timed": True,
        "clock": 6.0, "duration": 600.0, "windy": False, "sigma": {},
        "common": {"current.north": 0.5, "current.east": 0.5},
    }  # fmt: skip
    return text.text_of(**(usual | more))


def test_windows_are_ten_ship_lengths_of_way_and_ten_seconds_within_the_shortest_recording() -> None:
    import tomllib

    for clock, duration, window in (
        (6.0, 600.0, 60.0), (6.0, 50.0, 40.0), (0.05, 600.0, 10.0), (0.05, 10.0, 8.0), (30.0, 1e4, 300.0),
    ):  # fmt: skip
        made = tomllib.loads(drafted(clock=clock, duration=duration))
        assert made["estimator"]["window"] == window
        assert made["report"]["restart"] == window
        assert made["loss"] == {"scale": "noise"}
    assert "60.0 # s, 10 L/U" in drafted()


def test_the_text_names_what_is_free_held_out_and_left_out() -> None:
    import tomllib

    whole = drafted()
    made = tomllib.loads(whole)
    assert made["ship"] == "mine.toml"
    assert (made["data"]["root"], made["data"]["train"], made["data"]["test"]) == ("logs", ["a[[]1].csv"], ["b"])
    assert made["free"] == {"hull.*": {"prior": 0.3}, "K": {"prior": 0.5}, "c.*": {"sigma": 10.0}}
    assert "# left out: c: too short" in whole
    assert '"hull.*" = { prior = 0.3 } # 2 parameters' in whole
    assert "the latest; the fit does not see them" in whole
    assert "from the middle of the names" in drafted(timed=False)
    assert "its coefficients stay fixed" in whole
    assert "its coefficients stay fixed" not in drafted(windy=True)
    assert made["nuisance"] == {"common": {"current.north": 0.5, "current.east": 0.5}}
    assert "nuisance" not in tomllib.loads(drafted(common={}))
    turned = drafted(common={"bias.psi": 0.1, "deviation.north": 0.2})
    assert tomllib.loads(turned)["nuisance"] == {"common": {"bias.psi": 0.1, "deviation.north": 0.2}}
    assert "errors of the compass" in turned
    assert "errors of the compass" not in whole
    assert tomllib.loads(drafted(sigma={"x": 0.051, "psi": 0.0123}))["loss"] == {"sigma": {"x": 0.051, "psi": 0.012}}
    own = drafted(free=[("hull.*", text.OWN, ("hull.Y_v", "hull.N_r")), ("K", 0.5, ("K",))])
    assert tomllib.loads(own)["free"] == {"hull.*": {}, "K": {"prior": 0.5}}
    assert "the sigma that the ship file states" in own
    assert "the sigma that the ship file states" not in whole
    assert "format" not in made["data"]
    formatted = tomllib.loads(drafted(format="csv", mapping="m.toml"))
    assert (formatted["data"]["format"], formatted["data"]["mapping"]) == ("csv", "m.toml")
    sampled = tomllib.loads(drafted(sampled=True))
    assert sampled["estimator"] == {"type": "arx_fit:ArxRegression"}
    assert "loss" not in sampled


def test_a_recording_with_a_doubt_says_so(tmp_path: Path) -> None:
    doubted = Kind("turning", {}, doubts=("the rudder moves late",))
    assert "doubt: the rudder moves late" in drafted(kinds={"a": doubted, "b": kind("zigzag")})


def test_priors_of_a_first_study_are_those_of_the_kind_of_coefficient() -> None:
    """Regressions give hulls, rudders and added masses to about 30 %, a wake to 20 %; steering indices to a half."""
    from seatrial.study.drafting.draft import _RULES

    wide = {"damping", "K", "T", "T[123]", "delta_r", "K_*", "T_*"}
    for pattern, prior, needs in _RULES:
        if prior == text.OWN:
            continue  # free of a ship that states its sigma only
        part, _, name = pattern.rpartition(".")
        if part == "thrusters.*":  # maps of thrust; how way against it lessens it is known least
            assert prior == (0.5 if name == "against" else 0.3)
            assert needs == ("astern" if name in ("astern", "against") else "surge")
            continue
        sharp = name in ("w_P0", "T_*", "[XYN]_*") and part in ("*", "screw", "")
        assert prior == (0.5 if (part or pattern) in wide else 0.2 if sharp else 0.3), pattern
        surge = name in ("m_x", "X_udot", "X_udotz", "m_11", "[RX]_*", "X_*", "t_P", "w_P0") or part == "screw"
        assert needs == ("wind" if part == "wind" else "engine" if part == "propeller" else
                         "surge" if surge else "turn"), pattern  # fmt: skip

"""Recordings dealt into parts: whole, every one in one part, and by what is to be new in a part."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.identify import StudyError
from seatrial.study.folds import FOLDS, day, folds, supported


def stub(name: str, kind: str) -> Trial:
    """A straight run that its sidecar calls otherwise."""
    t = np.arange(30.0)
    still = {n: np.zeros(30) for n in ("y", "psi", "v_m", "r", "delta")}
    return Trial(name, t, {**still, "x": t, "u": np.ones(30), "n_P": np.ones(30)}, meta={"kind": kind})


def test_parts_hold_whole_recordings_of_every_kind() -> None:
    trials = [stub(f"{kind}_{day:02d}-Jul-2020_10_{minute}_00_{piece}", kind)
              for kind, minute in (("turning", 10), ("zigzag", 40)) for day in range(1, 7) for piece in (1, 2)]
    parts = folds(trials, "recording", 3)
    assert sorted(t.name for part in parts for t in part) == sorted(t.name for t in trials)
    for part in parts:
        names = {t.name for t in part}
        assert all(name[:-1] + other in names for name in names for other in "12")
        assert {name.partition("_")[0] for name in names} == {"turning", "zigzag"}
    with pytest.raises(StudyError, match="12 recordings"):
        folds(trials, "recording", 13)


def windy() -> list[Trial]:
    """Eight recordings of two pieces, on four days, straight ones and turns, wind and speed in opposite orders."""
    out: list[Trial] = []
    for k, (date, kind) in enumerate((date, kind) for date in (1, 2, 3, 4) for kind in ("turning", "straight")):
        for piece in (1, 2):
            one, rate, u = stub(f"{kind}_{date:02d}-Jul-2020_10_{10 + k}_00_{piece}", kind), 0.1, 1.0 + 0.1 * k
            if kind == "turning":
                arc = {"x": u / rate * np.sin(rate * one.t), "y": u / rate * (1.0 - np.cos(rate * one.t))}
                one = one.having(**arc, psi=rate * one.t, r=np.full(30, rate), delta=np.full(30, 0.3))
            out.append(one.having(U_T=np.full(30, 9.0 - k), gamma_T=np.zeros(30), u=np.full(30, u)))
    return out


def names(parts: list[list[Trial]]) -> list[list[str]]:
    """Kind and day of each part, sorted."""
    return [sorted({"_".join(t.name.split("_")[:2]) for t in part}) for part in parts]


@pytest.mark.parametrize("by", [*FOLDS])
def test_every_way_deals_every_trial_once_and_cuts_no_recording(by: str) -> None:
    trials = windy()
    parts = folds(trials, by, 3)
    assert sorted(t.name for part in parts for t in part) == sorted(t.name for t in trials)
    where = {t.name: k for k, part in enumerate(parts) for t in part}
    assert all(where[t.name] == where[t.name[:-1] + other] for t in trials for other in "12")
    assert len(parts) == {"kind-day": 8, "day": 4, "kind": 2}.get(by, 3)


def test_a_part_by_day_is_that_day_by_kind_that_kind_and_by_kind_and_day_that_kind_on_it() -> None:
    assert names(folds(windy(), "day", 2)) == [[f"{kind}_0{k}-Jul-2020" for kind in ("straight", "turning")]
                                               for k in (1, 2, 3, 4)]  # fmt: skip
    assert names(folds(windy(), "kind", 2)) == [[f"{kind}_0{k}-Jul-2020" for k in (1, 2, 3, 4)]
                                                for kind in ("straight", "turning")]  # fmt: skip
    assert all(len(one) == 1 for one in names(folds(windy(), "kind-day", 2)))


@pytest.mark.parametrize(("by", "level"), [("speed", "u"), ("wind", "U_T")])
def test_ranges_of_speed_and_wind_do_not_overlap(by: str, level: str) -> None:
    parts = folds(windy()[::-1], by, 3)
    spans = [(min(t[level][0] for t in part), max(t[level][0] for t in part)) for part in parts]
    assert all(high < low for (_, high), (low, _) in pairwise(spans))


def test_the_start_of_a_trial_tells_its_day_before_its_name_does() -> None:
    one = replace(stub("a_01-Jul-2020_10_10_00", "turning"), meta={"start": "2021-03-04T12:00:00+00:00"})
    assert day(one) == "2021-03-04"
    assert day(stub("run_20200806_162425", "turning")) == "20200806"
    assert day(stub("run_7", "turning")) == ""


@pytest.mark.slow
def test_only_ways_that_tell_recordings_apart_are_supported() -> None:
    assert [*supported(windy(), 2)] == ["recording", "day", "kind", "kind-day", "speed", "wind"]
    alike = [one.having(U_T=10.0 * one["u"]) for one in windy()]  # the wind is as the speed
    assert [*supported(alike, 2)] == ["recording", "day", "kind", "kind-day", "speed"]
    calm = [stub(f"run{k}", "turning") for k in range(4)]  # no days, no wind, one speed
    assert [*supported(calm, 2)] == ["recording"]
    for by in ("day", "kind", "kind-day", "wind", "speed"):
        with pytest.raises(StudyError, match=rf"--folds {by}: .* supports recording"):
            folds(calm, by, 2)
    one_day = [replace(t, name=re.sub(r"\d\d-Jul", "01-Jul", t.name)) for t in windy()]
    assert not {"day", "kind-day"} & {*supported(one_day, 3)}  # of one day, each kind on a day is each kind
    assert [len(part) for part in supported(one_day, 3)["kind"]] == [8, 8]
    one_without = [*windy(), stub("run", "turning")]
    assert not {"day", "kind-day", "wind"} & {*supported(one_without, 2)}

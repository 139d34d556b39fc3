"""What a calibration says of the days of its recordings, and of a current that was estimated first."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from seatrial.workflow.evidence.calibrate import of_one_day


def named(kinds: list[str], groups: list[str]) -> Any:
    return SimpleNamespace(left=SimpleNamespace(kinds=tuple(kinds), groups=tuple(groups)))


@pytest.mark.parametrize("day", ["06-Aug-2020", "2020-08-06", "20200806", "06_Aug_2020"])
def test_a_kind_whose_recordings_are_of_one_day_is_told(day: str) -> None:
    found = named(["turning"] * 3 + ["zigzag"] * 2, [f"turn_{day}_10", f"turn_{day}_11", f"turn_{day}_12",
                                                       f"zz_{day}_1", "zz_2021-01-01_1"])  # fmt: skip
    said = of_one_day(found)
    assert len(said) == 1
    assert said[0].startswith(f"turning: every recording is of {day};")


def test_names_without_a_day_tell_nothing() -> None:
    assert of_one_day(named(["turning"] * 3, ["a1", "a2", "run 123456789012"])) == ()

"""What a calibration says of the days of its recordings, and of a current that was estimated first."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.workflow.evidence.calibrate import of_one_day
from seatrial.workflow.evidence.fans import current_of


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


def first(**sigma: float) -> Any:
    found = {name.replace("_at_", "."): (0.2 if value else 0.0) for name, value in sigma.items()}
    return SimpleNamespace(found=found, sigma={name.replace("_at_", "."): value for name, value in sigma.items()})


def test_the_uncertainty_of_a_current_is_that_of_its_components() -> None:
    assert current_of(first(current_at_x=0.03, current_at_y=0.04)) == pytest.approx(np.sqrt((0.03**2 + 0.04**2) / 2))
    assert current_of(first(current_at_x=0.03, bias_at_psi=9.0)) == pytest.approx(0.03)
    assert current_of(first(bias_at_psi=9.0)) == np.inf

"""The test of a ship's equations: written out, they give the same rates, or it fails."""

from __future__ import annotations

import pytest

from seatrial.exchange import equations
from seatrial.ships.files import load


def test_the_exported_equations_are_the_ship() -> None:
    assert equations.equations(load("kvlcc2_l7")).verdict == "pass"


def test_other_equations_fail(monkeypatch: pytest.MonkeyPatch) -> None:
    usual = equations.module_text
    monkeypatch.setattr(
        equations, "module_text", lambda plant: usual(plant).replace('"hull.R_0": ', '"hull.R_0": 2.0 * ')
    )
    found = equations.equations(load("kvlcc2_l7"))
    assert found.verdict == "fail"
    assert "do not give the motion" in found.reason


def test_a_model_in_discrete_time_is_not_judged() -> None:
    assert equations.equations(load("kvlcc2_l7_arx")).verdict == "not judged"

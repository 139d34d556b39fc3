"""Modified Abkowitz: the race, the equations, and the fit that made its ship of the library."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import update, values
from seatrial.environment import CALM, Uniform
from seatrial.models.abkowitz_modified import Derivatives
from seatrial.ships.files import load

NAME = "modified_abkowitz_kvlcc2_l7"


def example() -> Any:
    path = Path(__file__).parents[2] / "examples" / "modified_abkowitz.py"
    spec = importlib.util.spec_from_file_location("modified_abkowitz_example", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.long
def test_the_ship_of_the_library_is_the_fit_of_the_example() -> None:
    found, kept = values(example().fitted(load("kvlcc2_l7")).model), values(load(NAME).model)
    assert list(found) == list(kept)
    assert [found[path] for path in kept] == pytest.approx(list(kept.values()), rel=2e-5)
    entries = load(NAME).entries
    assert all("fitted to simulated data" in entries[f"derivatives.{name}"].source for name in example().FITTED)


@pytest.mark.long
def test_manoeuvres_that_the_fit_never_saw() -> None:
    """What the notes of the ship file promise."""
    module = example()
    rows = module.compared(load("kvlcc2_l7"), load(NAME))
    assert len(rows) == 36
    for manoeuvre, name, true, found in rows:
        if "overshoot" in name:
            assert abs(found - true) < math.radians(3.0), (manoeuvre, name)
        else:
            bound = 0.03 if name in ("advance", "tactical_diameter") else 0.08
            assert found == pytest.approx(true, rel=bound), (manoeuvre, name)


def test_holds_its_speed_at_any_revolutions() -> None:
    """Revolutions enter: the balance lies near that of the ship it was fitted to."""
    from seatrial.simulate.run import approach

    one, other = load("kvlcc2_l7"), replace(load(NAME), validity={})
    for speed in (0.6, 0.9, 1.179, 1.35):
        assert approach(other, speed)[1] == pytest.approx(approach(one, speed)[1], rel=0.02)


def test_race_is_momentum_theory() -> None:
    race: Any = load(NAME).model.race
    c, u_Ainf = race.flow(1.0, 10.0)
    u_A, nD = 0.6, 2.16
    J = u_A / nD
    K_T = race.k_0 + race.k_1 * J + race.k_2 * J * J
    assert u_Ainf == pytest.approx(math.sqrt(u_A**2 + 8 / math.pi * K_T * nD**2) - u_A, rel=1e-14)
    washed, u_P = race.washed, u_A + race.k * u_Ainf
    assert c == pytest.approx(math.sqrt(washed * u_P**2 + (1 - washed) * u_A**2), rel=1e-14)
    assert race.flow(0.0, 0.0) == (0.0, 0.0)
    assert race.flow(-1.0, -10.0)[0] < 0  # astern the water comes from behind


@pytest.mark.parametrize("name", [name for name in values(load(NAME).model) if name.startswith("derivatives.")])
def test_each_term_is_the_one_of_the_equation(name: str) -> None:
    """One derivative at a time against Eqs. 21 to 23, dimensions and this house's signs put in."""
    model: Any = load(NAME).model
    u, v, r, n, delta, L = 1.1, -0.12, 0.05, 11.0, 0.25, 7.0
    alone = replace(model, derivatives=Derivatives(**dict.fromkeys(vars(model.derivatives), 0.0)))
    key = name.removeprefix("derivatives.")
    alone = update(alone, {"derivatives.C_R": 1.0, "derivatives.S": 1.0} if key in ("C_R", "S") else {name: 1.0})
    U, (c, a) = math.hypot(u, v), model.race.flow(u, n)
    e = delta + v / c - r * L / (2 * c)
    side = {"0": (a / 2) ** 2, "v": U * v, "r": L * U * r,
            "d": c**2 * delta + (c - model.c_0 * U) * (v - r * L / 2),
            "vvv": v**3 / U, "vvr": L * v**2 * r / U, "vrr": L**2 * v * r**2 / U, "rrr": L**3 * r**3 / U,
            "eee": c**2 * e**3}  # fmt: skip
    surge = {"eta_1": u**2, "eta_2": L * n * u, "eta_3": L**2 * n**2, "C_R": -(u**2), "S": -(u**2), "X_vv": v**2,
             "X_ee": c**2 * e**2, "X_rr": L**2 * r**2, "X_vr": L * v * r,
             "X_vvrr": L**2 * v**2 * r**2 / U**2}  # fmt: skip
    term = surge.get(key, side.get(key[2:], 0.0))
    expected = [0.0, 0.0, 0.0]
    expected[0 if key in surge else "XYN".index(key[0])] = term
    assert alone.force(u, v, r * L, n * L, delta) == pytest.approx(tuple(expected), rel=1e-12)


@pytest.mark.slow
def test_silent_at_rest_mirrored_and_finite_astern() -> None:
    model: Any = load(NAME).model
    assert model.derivative((0.0,) * 6, (0.0, 0.5), CALM) == (0.0,) * 6
    even = update(model, dict.fromkeys(model.asymmetries, 0.0))
    here = even.derivative((0.0, 0.0, 0.3, 1.0, -0.1, 0.05), (9.0, 0.2), CALM)
    there = even.derivative((0.0, 0.0, -0.3, 1.0, 0.1, -0.05), (9.0, -0.2), CALM)
    assert tuple(s * w for s, w in zip((1, -1, -1, 1, -1, -1), there, strict=True)) == pytest.approx(here, rel=1e-13)
    x = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    for _ in range(6000):  # crash astern, and on astern
        x = tuple(a + 0.05 * b for a, b in zip(x, model.derivative(x, (-8.0, 0.3), CALM), strict=True))
    assert np.isfinite(x).all()
    assert x[3] < 0


def test_current_only_carries_the_ship_along() -> None:
    model: Any = load(NAME).model
    around = Uniform(U_C=0.3, gamma_C=0.7).now()
    u_C = around.current_x * math.cos(0.4) + around.current_y * math.sin(0.4)
    v_C = around.current_y * math.cos(0.4) - around.current_x * math.sin(0.4)
    still = model.derivative((0.0, 0.0, 0.4, 1.0, 0.1, 0.05), (10.0, 0.2), CALM)
    moving = model.derivative((0.0, 0.0, 0.4, 1.0 + u_C, 0.1 + v_C, 0.05), (10.0, 0.2), around)
    drift = (around.current_x, around.current_y, 0.0, 0.05 * v_C, -0.05 * u_C, 0.0)
    assert moving == pytest.approx(tuple(a + b for a, b in zip(still, drift, strict=True)), rel=1e-12, abs=1e-14)

"""Usual settings of every manoeuvre: those of the standards in angles, and by the ship's length and L/U in all else."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest

from seatrial.manoeuvres import Index, Settings, by_demand
from seatrial.testing import manoeuvres

SHIP = Settings(n_P=1.0, speed=5.0, L_pp=100.0, rudder_limit=0.6, controls={"f_bow": 1e3, "f_stern": 2e3})
"""L/U is 20 s."""
CLOCK = 20.0
DEGREE = math.radians(1.0)
USUAL: dict[str, dict[str, float]] = {
    "acceleration": {"n_P": 0.0, "n_ahead": 1.0},
    "stopping": {"n_P": 1.0, "end": 0.2},
    "crash-astern": {"n_P": 1.0, "n_astern": -1.0, "end": 0.01},
    "turning": {"n_P": 1.0, "delta": 0.6},
    "zigzag": {"delta": 10.0 * DEGREE, "psi": 10.0 * DEGREE, "side": 1.0},
    "initial-turning": {"delta": 10.0 * DEGREE, "psi": 10.0 * DEGREE, "side": 1.0},
    "pull-out": {"delta": 20.0 * DEGREE, "window": 2.0 * CLOCK, "tolerance": 1e-4 / CLOCK, "side": 1.0},
    "spiral": {"delta": 20.0 * DEGREE, "window": 2.0 * CLOCK, "tolerance": 1e-4 / CLOCK, "step": 5.0 * DEGREE,
               "near": 5.0 * DEGREE, "fine": 1.0 * DEGREE},
    "reverse-spiral": {"rate": 0.2 / CLOCK, "step": 0.025 / CLOCK, "window": 2.0 * CLOCK, "tolerance": 2e-5 / CLOCK,
                       "k_P": 4.0 * CLOCK, "k_I": 2.0, "limit": 0.6},
    "williamson": {"delta": 0.6, "k_D": 2.0 * CLOCK, "slow": 0.05 / CLOCK, "swing": 60.0 * DEGREE,
                   "short": 20.0 * DEGREE, "k_P": 1.0},
    "scharnow": {"delta": 0.6, "k_D": 2.0 * CLOCK, "slow": 0.05 / CLOCK, "swing": 240.0 * DEGREE,
                 "short": 20.0 * DEGREE, "k_P": 1.0},
    "single-turn": {"delta": 0.6, "swing": 250.0 * DEGREE},
    "pseudo-random": {"delta": 20.0 * DEGREE, "spread": 0.25, "hold": 2.0 * CLOCK},
    "random": {"delta": 0.6, "hold": CLOCK, "travel": 0.2 * CLOCK, "length": 100.0 * CLOCK, "astern": 1.0},
    "crabbing": {"bow_max": 1e3, "stern_max": 2e3, "distance": 200.0, "drive": 0.6, "K_p": 3.0, "K_d": 3.0 * CLOCK,
                 "K_i": 0.3 / CLOCK},
    "straight": {"n_P": 1.0, "delta": 0.0},
    "track": {"ahead": 250.0, "radius": 300.0, "delta_max": 0.6},
    "berthing": {"speed": 5.0, "along": 2800.0, "across": 100.0, "braking": 2000.0, "ahead": 500.0, "n_max": 1.0},
}  # fmt: skip


@pytest.mark.parametrize("kind", USUAL)
def test_usual_settings_are_those_of_the_standards_and_of_the_ships_time(kind: str) -> None:
    made = vars(manoeuvres()[kind].ordered(SHIP))
    for name, wanted in USUAL[kind].items():
        assert made[name] == pytest.approx(wanted), name


@pytest.mark.parametrize("kind", [kind for kind in manoeuvres() if kind != "thrust-steps"])
def test_they_are_alike_for_a_ship_of_another_size(kind: str) -> None:
    """Four times as long at twice the speed: lengths by four, times by two, revolutions by a half."""
    other = replace(SHIP, n_P=0.5, speed=10.0, L_pp=400.0)
    small, large = (manoeuvres()[kind].ordered(one) for one in (SHIP, other))
    times = {"hold", "travel", "length"}
    for field in small.__dataclass_fields__.values():
        one: Any = getattr(small, field.name)
        meaning = field.metadata.get("spec")
        if not isinstance(one, float) or (meaning is None and field.name not in times):
            continue
        unit = "s" if meaning is None else meaning.unit
        by = {"m": 4.0, "s": 2.0, "1/s": 0.5, "rad/s": 0.5, "m/s": 2.0, "1/m": 0.25}.get(unit, 1.0)
        assert getattr(large, field.name) == pytest.approx(by * one), field.name


def test_the_users_angles_come_before_the_usual_ones_and_the_ships_limit_before_those() -> None:
    assert SHIP.clock == CLOCK
    assert (SHIP.rudder_or(0.3), SHIP.rudder_or(0.7)) == (0.3, 0.6)
    own = replace(SHIP, rudder=0.65, heading=0.4)
    assert (own.rudder_or(0.3), own.heading_or(0.2), SHIP.heading_or(0.2)) == (0.65, 0.4, 0.2)
    assert replace(SHIP, speed=0.0).clock > 1e3


def test_a_helm_in_percent_is_told_by_its_power_of_the_angle() -> None:
    """Hard over is a hundred percent: an angle in percent, a gain over it per percent."""
    hard = 35.0 * DEGREE
    told = by_demand({"neutral_rudder": Index(0.5 * hard, "rad", helm=1), "slope": Index(hard, "s", helm=1),
                      "gain": Index(1.0, "-", helm=-1), "advance": Index(3.0, "m", 1.5)})  # fmt: skip
    assert (told["neutral_steer"].value, told["neutral_steer"].unit) == (pytest.approx(50.0), "%")
    assert (told["slope"].value, told["slope"].unit) == (pytest.approx(100.0), "% s/rad")
    assert (told["gain"].value, told["gain"].unit) == (pytest.approx(hard / 100.0), "rad/%")
    assert told["advance"] == Index(3.0, "m", 1.5)

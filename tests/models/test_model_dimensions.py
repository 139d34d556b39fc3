"""Every ship of the library moves alike at another scale: its numbers by their declared units, lengths by a ratio.

Times go with the root of the ratio, masses with its cube; density and gravity stay.  A product for a quotient, a length
to a wrong power or a number with a wrong unit shows in any family.
"""

from __future__ import annotations

import re

import numpy as np
import pytest

from seatrial.core.parameters import update, walk
from seatrial.environment import Environment
from seatrial.models import Sampled, Stepped, unit
from seatrial.testing.discovery import ships, state_size

RATIO = 2.3
ROOT = RATIO**0.5
POWERS = {"m": 1.0, "s": 0.5, "kg": 3.0, "N": 3.0, "rad": 0.0}
STATES = {"phi": 0.0, "p": -0.5, "z": 1.0, "w": 0.5, "theta": 0.0, "q": -0.5}
SHIPS = {
    name: ship for name, ship in ships().items()
    if name != "naval_blanke"  # its published yaw moment by phi |u phi| is none: only a velocity squared makes one
    and not isinstance(ship.model, Sampled | Stepped) and set(ship.model.states[6:]) <= set(STATES)
}  # fmt: skip


def power(text: str) -> float:
    """Of the ratio by which a number of this unit goes."""
    total = 0.0
    for k, side in enumerate(text.replace("'", "").split("/")):
        for name, exponent in re.findall(r"([A-Za-z]+)(?:\^(\d+))?", side):
            total += (-1.0 if k else 1.0) * POWERS[name] * float(exponent or 1)
    return total


@pytest.mark.slow
@pytest.mark.parametrize("name", SHIPS)
def test_a_ship_moves_alike_at_another_scale(name: str) -> None:
    ship = SHIPS[name]
    model = ship.model
    other = update(model, {path: value * RATIO ** power(meaning.unit) for path, meaning, value in walk(model)})
    by = np.array([1.0, 1.0, 0.0, 0.5, 0.5, -0.5, *(STATES[one] for one in model.states[6:])])
    rng = np.random.default_rng(3)
    for _ in range(12):
        state = rng.uniform(-0.4, 0.4, by.size) * state_size(ship)
        state[3] += 0.6 * ship.speed
        control = rng.uniform(0.1, 0.6, len(model.controls)) * [
            {"rad": 0.5, "1/s": max(ship.n_P or 2.0, 0.1), "N": 1e3, "N m": 1e4}.get(unit(one), 1.0)
            for one in model.controls
        ]
        U = ship.speed
        here = Environment(wind_x=2.0 * U, wind_y=-U, current_x=0.1 * U, current_y=0.05 * U, wave_x=0.01 * ship.L_pp,
                           wave_y=0.005 * ship.L_pp, wave_T=0.7 * ship.L_pp**0.5)  # fmt: skip
        scale = np.array([ROOT, ROOT, ROOT, ROOT, RATIO, RATIO, ROOT, 1.0 / RATIO])
        there = Environment(*(np.array(here) * scale).tolist())
        moved = [c * RATIO ** power(unit(one)) for c, one in zip(control, model.controls, strict=True)]
        found = other.derivative(tuple(state * RATIO**by), tuple(moved), there)
        wanted = np.array(model.derivative(tuple(state), tuple(control), here)) * RATIO ** (by - 0.5)
        assert np.array(found) == pytest.approx(wanted, rel=1e-6, abs=1e-7 * np.abs(wanted).max())

"""Figures of a run in a harbour, of runs drawn by hand beside a quay that stands at any bearing."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.environment.chart import Chart, Quay
from seatrial.environment.fenders import CURVES, Fender
from seatrial.harbour.energy import Berthed
from seatrial.ships.files import load
from seatrial.simulate.contacts import contact_indices, keel_indices, shallows
from seatrial.simulate.place import aground_or_inside, depths, place_of

SHIP = load("kvlcc2_shallow")
L, B, D = 320.0, 58.0, 20.8
HALF = ((-160.0, 0.0), (-160.0, 29.0), (160.0, 29.0), (160.0, 0.0))
"""A pontoon, whose corners touch first."""
CHI = 0.5
"""Bearing of the quay's face, the water to starboard of it."""


def chart() -> Chart:
    """A face of 240 m about the origin with fenders at its thirds, two metres high."""
    along = np.array([math.cos(CHI), math.sin(CHI)])
    fender = Fender(CURVES["cone"], 2.0, 2.6e6, 120.0, chi=0.0)
    return Chart("slanted", 25.0, quays=(Quay(np.array([-120.0 * along, 120.0 * along]), fender),))


@pytest.fixture(scope="module")
def place() -> Any:
    return place_of(SHIP, chart(), hull=HALF)


def beside(ahead: float, off: float, turn: float) -> tuple[float, float, float]:
    """A pose by its way along the face, off it into the water, and its angle to it."""
    c, s = math.cos(CHI), math.sin(CHI)
    return ahead * c - off * s, ahead * s + off * c, CHI + turn


def approach(turn: float = 0.0, away: bool = True) -> Trial:
    """Broadside on at 6 cm/s until half a metre of fender is taken, turning not; then off again."""
    t = np.arange(0.0, 60.0)
    side = 29.0 / math.cos(turn) + 60.0 * math.tan(abs(turn))  # abreast of the fender that is nearer
    off = side + 2.0 + 1.2 - 0.06 * np.minimum(t, 28.0) + (0.04 * np.maximum(t - 28.0, 0.0) if away else 0.0)
    poses = np.array([beside(0.0, one, turn) for one in off])
    speed = np.where(t < 28.0, -0.06, 0.04)
    u, v = speed * math.sin(turn), speed * math.cos(turn)
    return Trial("berthing", t, {"x": poses[:, 0], "y": poses[:, 1], "psi": poses[:, 2], "u": u, "v_m": v,
                                 "r": 0.0 * t, "depth": np.full(60, 25.0)})  # fmt: skip


@pytest.mark.slow
def test_a_berthing_broadside_on_has_the_figures_of_its_fenders(place: Any) -> None:
    found = {name: index.value for name, index in contact_indices(approach(), SHIP, place).items()}
    fenders = place.grid.stops
    taken = (0.06 * 28.0 - 1.2) / 2.0
    force, energy = CURVES["cone"].both(taken)
    assert found["contact_speed"] == pytest.approx(0.06)
    assert found["speed_limit"] == pytest.approx(0.06 / 0.08)
    assert found["contact_angle"] == pytest.approx(0.0, abs=1e-9)
    assert found["fender_deflection"] == pytest.approx(taken)
    assert found["fender_reaction"] == pytest.approx(2.6e6 * force)
    assert found["contact_energy"] == pytest.approx(fenders * 2.6e6 * 2.0 * energy)
    assert fenders == 2
    assert found["contacts"] == 1.0
    twice = approach()
    again = Trial("twice", np.arange(120.0), {name: np.tile(column, 2) for name, column in twice.channels.items()})
    assert contact_indices(again, SHIP, place)["contacts"].value == 2.0


@pytest.mark.slow
@pytest.mark.parametrize("turn", [0.01, -0.01])
def test_a_berthing_at_an_angle_is_that_of_the_end_that_touches(place: Any, turn: float) -> None:
    """The energy by design practice is that of the fender's place along the hull, the angle and the water below."""
    trial = approach(turn)
    found = {name: index.value for name, index in contact_indices(trial, SHIP, place).items()}
    assert found["contact_angle"] == pytest.approx(0.01, rel=1e-6)
    assert found["contact_speed"] == pytest.approx(0.06 * math.cos(turn), rel=1e-9)
    mass, first = float(SHIP.model.displaced), 20  # rows: 1.2 m of 3.2, and square to the hull a little less
    off = 29.0 / math.cos(turn) + 60.0 * math.tan(0.01) + 2.0 + 1.2 - 0.06 * first
    a = -math.copysign(60.0, turn) * math.cos(turn) - off * math.sin(turn)  # of the fender, ahead of midship
    design = Berthed(mass, L, B, D, mass / (1025.0 * L * B * D), 0.5 - a / L, 0.01, found["contact_speed"], 25.0 - D)
    assert found["berthing_energy"] == pytest.approx(design.energy(), rel=1e-6)


@pytest.mark.parametrize("r", [0.0, 0.002, -0.003])
def test_a_bow_that_swings_closes_by_its_way_and_by_its_turn(r: float) -> None:
    """Bow on, a fender b to starboard of the centre line nears the bow by u - r b [m/s]."""
    place = place_of(SHIP, chart(), hull=HALF)
    t, b = np.arange(0.0, 30.0), 10.0
    poses = np.array([beside(60.0 - b, 160.0 + 3.2 - 0.06 * now, -math.pi / 2.0) for now in t])
    trial = Trial("bow on", t, {"x": poses[:, 0], "y": poses[:, 1], "psi": poses[:, 2], "u": 0.0 * t + 0.06,
                                "v_m": 0.0 * t + 0.7, "r": 0.0 * t + r, "depth": np.full(30, 25.0)})  # fmt: skip
    found = {name: index.value for name, index in contact_indices(trial, SHIP, place).items()}
    assert found["contact_speed"] == pytest.approx(0.06 - r * b, rel=1e-9)
    assert found["speed_limit"] == pytest.approx((0.06 - r * b) / 0.08, rel=1e-9)
    assert found["contact_angle"] == pytest.approx(math.pi / 2.0)
    assert found["fender_deflection"] == pytest.approx((0.06 * 29.0 - 1.2) / 2.0)
    assert found["contacts"] == 1.0


def test_a_ship_that_touches_nothing_has_no_figures(place: Any) -> None:
    trial = approach()
    far = trial.having(x=trial["x"] - 100.0 * math.sin(CHI), y=trial["y"] + 100.0 * math.cos(CHI))
    assert contact_indices(far, SHIP, place) == {}


def test_the_water_left_under_the_keel_is_least_where_it_is_told() -> None:
    t = np.arange(0.0, 50.0, 10.0)
    depth = np.array([26.0, 25.0, 24.0, 24.0, math.inf])
    trial = Trial("keel", t + 5.0, {"u": np.array([5.0, 6.0, 1.0, -6.0, 6.0]), "depth": depth})
    found = {name: index.value for name, index in keel_indices(trial, SHIP).items()}
    clear = depth - D - np.array([found["squat"]] * 5)
    assert found["under_keel"] == pytest.approx(clear[3])  # astern as ahead
    assert "aground" not in found
    told = shallows(trial, SHIP, 24.0 - D)
    assert set(told) == {25.0, 35.0} | {time for time in told if time in (5.0, 15.0)}
    assert told[35.0] == pytest.approx(found["under_keel"])
    assert told[25.0] > told[35.0]
    low = trial.having(depth=np.array([26.0, 21.3, 20.0, 22.0, 22.0]))
    assert keel_indices(low, SHIP)["aground"].value == 10.0
    assert keel_indices(trial, SHIP, "icorels")["squat"].value != found["squat"]


def test_a_start_is_in_a_wall_from_its_face_to_its_back(place: Any) -> None:
    for ahead, off, turn, said in ((0.0, 29.5, 0.0, ""), (0.0, 28.5, 0.0, "inside quay 1"), (0.0, 60.0, 0.0, ""),
                                   (0.0, 60.0, 0.5, "inside"), (0.0, -100.0, 0.0, "inside"), (0.0, -400.0, 0.0, ""),
                                   (285.0, 20.0, 0.0, ""), (275.0, 20.0, 0.0, "inside")):  # fmt: skip
        told = aground_or_inside(place, beside(ahead, off, turn), D)
        assert (said in told) if said else told == "", (ahead, off)
    assert "in 25.0 m of water with a draught of 26.0 m" in aground_or_inside(place, beside(0.0, 200.0, 0.0), 26.0)
    assert aground_or_inside(place, beside(0.0, 200.0, 0.0), 24.9) == ""
    assert depths(place, np.array([50.0]), np.array([60.0])) == pytest.approx([25.0])

"""What instruments see of a ship in a sea: its slow motion and, upon it, that of a long wave by its closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.environment.sea import Sea
from seatrial.environment.sea.rao import Rao
from seatrial.environment.sea.spectra import Jonswap
from seatrial.sensors.seaway import Seen

SEA = Sea(Jonswap(3.0, 9.0, 3.3), 2.0, seed=5)
SLOW = {"x": 40.0, "y": -30.0, "psi": 0.7, "u": 5.0, "v_m": 0.4, "r": 0.01, "delta": 0.2}


def cork(roll: float = 0.0) -> Rao:
    """A small thing that goes with the water: heave with the surface, surge and sway with its orbits."""
    omega, chi = np.linspace(0.1, 4.0, 300), np.radians(np.arange(0.0, 360.0, 5.0))
    c, s = np.cos(chi) + 0.0 * omega[:, None], np.sin(chi) + 0.0 * omega[:, None]
    none = 0j * c
    R = np.stack([-1j * c, -1j * s, -1.0 + none, roll + none, 0.5 * roll + none, 2.0 * roll + none], axis=-1)
    return Rao.of(omega, chi, R)


def slow(t: float) -> dict[str, float]:
    """The ship without waves, on a straight track."""
    c, s = math.cos(SLOW["psi"]), math.sin(SLOW["psi"])
    x, y = SLOW["x"] + t * (SLOW["u"] * c - SLOW["v_m"] * s), SLOW["y"] + t * (SLOW["u"] * s + SLOW["v_m"] * c)
    return SLOW | {"x": x, "y": y}


def truth(t: float, **more: float) -> Seen:
    return Seen(slow(t) | more, SEA, cork(0.01)).at(t)


@pytest.mark.slow
def test_it_heaves_with_the_surface_at_its_place_and_turns_with_it() -> None:
    for t in (0.0, 3.0, 100.0):
        seen = truth(t)
        at = slow(t)
        zeta = float(SEA.waves.elevation(*(np.array([one]) for one in (t, at["x"], at["y"])))[0])
        assert seen["z"] == pytest.approx(-zeta, abs=0.02)  # down
        assert seen["phi"] == pytest.approx(0.01 * zeta, abs=3e-4)
        assert seen["theta"] == pytest.approx(0.005 * zeta, abs=2e-4)
        assert seen["psi"] - 0.7 == pytest.approx(0.02 * zeta, abs=5e-4)
        assert math.hypot(seen["x"] - at["x"], seen["y"] - at["y"]) < 4.0
        assert seen["delta"] == 0.2
        assert truth(t, phi=0.1, p=0.02)["phi"] == pytest.approx(seen["phi"] + 0.1)
        assert truth(t, phi=0.1, p=0.02)["p"] == pytest.approx(seen["p"] + 0.02)


@pytest.mark.slow
def test_rates_are_those_of_the_motions_upon_the_slow_ones() -> None:
    """By central differences along the track, its course and speed held."""
    h = 1e-3
    for t in (2.0, 50.0):
        before, here, after = truth(t - h), truth(t), truth(t + h)
        for rate, motion, mean in (("w", "z", 0.0), ("p", "phi", 0.0), ("q", "theta", 0.0), ("r", "psi", 0.01)):
            assert here[rate] - mean == pytest.approx((after[motion] - before[motion]) / (2.0 * h), abs=2e-3)
        north, east = ((after[name] - before[name]) / (2.0 * h) for name in ("x", "y"))
        c, s = math.cos(0.7), math.sin(0.7)
        assert (here["u"], here["v_m"]) == pytest.approx((c * north + s * east, c * east - s * north), abs=5e-3)


@pytest.mark.slow
def test_the_same_instant_is_computed_once_and_another_anew() -> None:
    seen = truth(4.0)
    first = [seen[name] for name in ("x", "z", "u")]
    assert [seen[name] for name in ("x", "z", "u")] == first
    assert [seen.at(5.0)[name] for name in ("x", "z", "u")] != first
    assert [seen.at(4.0)[name] for name in ("x", "z", "u")] == first
    assert Seen(SLOW, SEA, cork()).t == 0.0

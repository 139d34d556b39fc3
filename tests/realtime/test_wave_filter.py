"""The wave filter and the ship that instruments see in a sea: the rudder rests, the course is kept."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.core.errors import CommandError
from seatrial.environment.sea import Sea, encountered
from seatrial.environment.sea.rao import Rao
from seatrial.environment.sea.spectra import Jonswap
from seatrial.realtime.conning import SteeringControl
from seatrial.realtime.plant import Plant
from seatrial.realtime.wave_filter import WaveFilter
from seatrial.sensors.seaway import Seen
from seatrial.ships.files import load

DT = 0.1
T = np.arange(0.0, 1200.0, DT)


def through(psi: np.ndarray, omega_0: float = 0.8) -> np.ndarray:
    one = WaveFilter(omega_0)
    return np.array([one.step(float(value), 0.0, DT)[0] for value in psi])


@pytest.mark.slow
def test_a_wave_at_its_frequency_is_taken_out() -> None:
    """One notch leaves zeta, a tenth, of it; the two beside it take some more."""
    for omega in (0.8, 0.6, 1.1):
        left = through(np.sin(omega * T))[6000:].std() / math.sqrt(0.5)
        assert left < 0.12, omega


@pytest.mark.slow
def test_a_slow_turn_passes_late_by_the_delay_of_three_notches() -> None:
    turned = through(0.01 * T)
    delay = sum(2.0 * 0.9 / (place * 0.8) for place in (0.63, 1.0, 1.6))
    assert 0.01 * T[-1] - turned[-1] == pytest.approx(0.01 * delay, rel=0.01)


def test_a_steady_heading_and_rate_pass_at_once() -> None:
    one = WaveFilter(0.8)
    for _ in range(50):
        assert one.step(1.2, 0.01, DT) == pytest.approx((1.2, 0.01), abs=1e-12)


@pytest.mark.slow
def test_through_south_nothing_jumps() -> None:
    away = through(np.mod(3.1 + 0.001 * T + math.pi, 2.0 * math.pi) - math.pi)
    assert np.abs(np.diff(away)).max() < 0.001


def test_it_continues_where_it_was_saved() -> None:
    one, two = WaveFilter(0.8), WaveFilter(0.8)
    psi = np.sin(0.7 * T[:400])
    for value in psi[:200]:
        one.step(float(value), 0.01, DT)
    two.restore(one.snapshot())
    assert [one.step(float(v), 0.0, DT) for v in psi[200:]] == [two.step(float(v), 0.0, DT) for v in psi[200:]]


@pytest.mark.parametrize("given", [(0.0, 0.1), (-1.0, 0.1), (math.nan, 0.1), (0.8, 0.0), (0.8, 1.0)])
def test_impossible_filters(given: tuple[float, float]) -> None:
    with pytest.raises(CommandError, match="wave filter"):
        WaveFilter(*given)


def yawing() -> Rao:
    """Heave of a metre and yaw of 0.3 deg per metre of wave; in short waves, above 1.8 rad/s, a ship does not yaw."""
    omega, chi = np.array([0.1, 1.2, 1.8, 6.0]), np.radians(np.arange(0.0, 360.0, 45.0))
    R = np.zeros((4, 8, 6), dtype=np.complex128)
    R[..., 2], R[:2, :, 5] = -1.0, math.radians(0.3)
    return Rao.of(omega, chi, R)


def sail(filtered: bool, sea: Sea) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    plant = Plant.of(load("kvlcc2"), dt=0.5)
    seen = Seen(plant, sea, yawing())
    control = SteeringControl.of(plant.ship, math.radians(35.0))
    met = encountered(np.array([sea.spectrum.omega_P]), plant["u"], sea.gamma_W + math.pi)
    control.filter = WaveFilter(float(met[0])) if filtered else None
    control.steer(0.0)
    kept: list[tuple[float, float, float]] = []
    for _ in range(2400):
        plant.step()
        here = seen.at(plant.t)
        delta = control.rudder(here["psi"], here["r"], 0.5)
        plant.order("delta", delta)
        kept.append((delta, plant["psi"], here["psi"]))
    return tuple(np.array(kept).T)  # type: ignore[return-value]


@pytest.mark.slow
def test_an_autopilot_with_a_wave_filter_leaves_the_rudder_at_rest() -> None:
    sea = Sea(Jonswap(3.0, 8.0), 0.5, seed=2)
    loud, slow, seen = sail(False, sea)
    quiet, course, _ = sail(True, sea)
    assert (seen - slow).std() == pytest.approx(math.radians(0.225), rel=0.15)  # times H_S / 4
    assert quiet[400:].std() < loud[400:].std() / 3.0
    assert abs(course[400:].mean()) < math.radians(0.2)
    assert course[400:].std() < math.radians(0.5)


def test_a_ship_seen_in_calm_water_is_itself() -> None:
    plant = Plant.of(load("kvlcc2"), dt=0.5)
    plant.order("delta", 0.2)
    seen = Seen(plant, Sea(Jonswap(0.0, 8.0)), yawing())
    for _ in range(20):
        plant.step()
        assert [seen.at(plant.t)[name] for name in ("x", "psi", "u", "r", "delta")] == [
            plant[name] for name in ("x", "psi", "u", "r", "delta")]  # fmt: skip

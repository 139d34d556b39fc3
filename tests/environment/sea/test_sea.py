"""Spectra, seeded waves and encounter: published figures, and what a sum of waves must keep of its spectrum."""

from __future__ import annotations

import math

import numpy as np
import pytest

from seatrial.core.errors import WeatherError
from seatrial.environment.sea import Sea, encountered
from seatrial.environment.sea.spectra import Ittc, Jonswap, PiersonMoskowitz, moments


@pytest.mark.parametrize(
    ("spectrum", "peak", "T_01", "T_z"),
    [(Ittc(4.0, 10.0), 2.2785, 7.718, 7.115), (Jonswap(4.0, 10.0, 3.3), 4.9457, 8.344, 7.785)],
)
def test_four_metres_at_ten_seconds(spectrum: Ittc | Jonswap, peak: float, T_01: float, T_z: float) -> None:
    """ITTC's rounded constants (487, 1949) are 0.06 % lower at the peak than the exact ones here."""
    found = moments(spectrum)
    assert float(spectrum.density(np.array([spectrum.omega_P]))[0]) == pytest.approx(peak, rel=7e-4)
    assert pytest.approx(T_01, abs=1.5e-3) == found.T_01
    assert found.T_z == pytest.approx(T_z, abs=1.5e-3)
    assert pytest.approx(4.0, rel=2e-3) == found.H_S


@pytest.mark.parametrize(("gamma", "error"), [(2.0, -0.0011), (3.3, 0.0012), (5.0, 0.0), (7.0, -0.0088)])
def test_factor_of_the_peak_keeps_the_height(gamma: float, error: float) -> None:
    assert pytest.approx(error, abs=6e-5) == moments(Jonswap(4.0, 10.0, gamma)).H_S / 4.0 - 1.0


@pytest.mark.parametrize(("V", "H_S", "omega_P"), [(10.0, 2.133, 0.8605), (15.0, 4.799, 0.5737), (20.0, 8.532, 0.4302)])
def test_developed_sea_by_its_wind(V: float, H_S: float, omega_P: float) -> None:
    sea = PiersonMoskowitz(V)
    assert pytest.approx(H_S, rel=5e-4) == moments(sea, 0.05, 60.0).H_S
    assert sea.omega_P == pytest.approx(omega_P, rel=5e-4)


def test_gamma_without_a_choice_is_one_in_swell_and_five_in_a_steep_sea() -> None:
    assert Jonswap(1.0, 12.0).peak == 1.0
    assert Jonswap(6.0, 8.0).peak == 5.0
    assert 1.0 < Jonswap(4.0, 9.0).peak < 5.0


def test_waves_have_the_variance_of_the_spectrum() -> None:
    sea = Sea(Jonswap(4.0, 10.0, 3.3), 0.4, seed=7)
    assert 0.5 * float((sea.waves.a**2).sum()) == pytest.approx(sea.moments.m0, rel=1e-4)
    assert sea.moments.m0 == pytest.approx(1.0, rel=5e-3)


@pytest.mark.slow
def test_an_hour_at_one_place_has_the_height_of_the_spectrum() -> None:
    t = np.arange(0.0, 3600.0, 0.5)
    for seed in range(3):
        surface = Sea(Ittc(3.0, 9.0), seed=seed).waves.elevation(t, 0.0 * t, 0.0 * t)
        assert 4.0 * surface.std() == pytest.approx(3.0, rel=0.03)
        assert abs(surface.mean()) < 0.01


def test_a_seed_is_one_sea() -> None:
    one, same, other = (Sea(Ittc(3.0, 9.0), seed=seed).waves for seed in (4, 4, 5))
    assert all(np.array_equal(a, b) for a, b in zip(one, same, strict=True))
    assert np.abs(one.eps - other.eps).max() > 1.0


def test_a_sea_does_not_repeat_itself() -> None:
    """With equal steps of frequency it would after 2 pi over the step."""
    sea = Sea(Ittc(3.0, 9.0))
    step = float(np.median(np.diff(sea.waves.omega)))
    t = np.arange(0.0, 300.0, 1.0)
    first, again = (sea.waves.elevation(at, 0.0 * at, 0.0 * at) for at in (t, t + 2.0 * math.pi / step))
    assert np.corrcoef(first, again)[0, 1] < 0.5


def test_waves_from_the_west_travel_east() -> None:
    """The crest is later by k x / omega at a place further east, and no later further north."""
    waves = Sea(Ittc(3.0, 9.0), 1.5 * math.pi).waves
    here, east, north = (waves.phase(np.zeros(1), np.array([x]), np.array([y])) for x, y in ((0, 0), (0, 50), (50, 0)))
    assert here - east == pytest.approx(50.0 * waves.k[None, :])
    assert here - north == pytest.approx(np.zeros((1, waves.k.size)), abs=1e-9)


def test_spread_follows_its_law() -> None:
    """The mean of the cosine about the mean direction under cos^2s of half the angle is s/(s + 1)."""
    turned = np.concatenate([Sea(Ittc(3.0, 9.0), 1.0, spread=8.0, seed=k).waves.beta for k in range(20)])
    off = turned - 1.0 - math.pi
    assert float(np.cos(off).mean()) == pytest.approx(8.0 / 9.0, abs=0.01)
    assert float(np.sin(off).mean()) == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize(("chi", "omega_e"), [(180, 0.950263), (90, 0.628319), (45, 0.400670), (0, 0.306374)])
def test_encounter_of_a_ten_second_wave_at_eight_metres_a_second(chi: float, omega_e: float) -> None:
    """The figures were computed with g = 9.81 m/s^2; the shift goes with 1/g."""
    omega = 2.0 * math.pi / 10.0
    expected = omega + (omega_e - omega) * 9.81 / 9.80665
    assert float(encountered(np.array([omega]), 8.0, math.radians(chi))[0]) == pytest.approx(expected, abs=1e-6)


def test_a_ship_that_runs_before_the_sea_meets_it_at_the_frequency_of_encounter() -> None:
    """The phase at the ship's place turns at omega_e, though no omega_e is in it."""
    waves, U = Sea(Ittc(3.0, 9.0), math.pi).waves, 8.0  # from the south, ship heads north
    t = np.array([1000.0, 1001.0])
    phase = waves.phase(t, U * t, 0.0 * t)
    assert phase[1] - phase[0] == pytest.approx(encountered(waves.omega, U, 0.0), abs=1e-8)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Jonswap(-1.0, 9.0), "height of -1 m"), (lambda: Ittc(3.0, 0.0), "period of 0 s"),
        (lambda: Ittc(10.0, 4.0), "would break"), (lambda: Jonswap(3.0, 9.0, 33.0), "gamma of 33"),
        (lambda: PiersonMoskowitz(0.0), "wind of 0"), (lambda: Sea(Ittc(3.0, 9.0), 90.0), "convert degrees"),
        (lambda: Sea(Ittc(3.0, 9.0), spread=0.2), "exponent"), (lambda: Sea(Ittc(3.0, 9.0), seed=-1), "seed of -1"),
        (lambda: Ittc(math.nan, 9.0), "height of nan"),
    ],
)  # fmt: skip
def test_a_sea_that_cannot_be(make: object, said: str) -> None:
    with pytest.raises(WeatherError, match=said):
        make()  # type: ignore[operator]

"""Seas, operators and coefficients at their bounds, and by closed forms: moments, mirrored hulls, one oscillator."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.constants import GRAVITY
from seatrial.core.errors import WeatherError
from seatrial.data import DataError
from seatrial.environment.sea import Sea, Waves, _deviations
from seatrial.environment.sea.hydrodynamics import Hydrodynamics, whole_turn
from seatrial.environment.sea.rao import MIRROR, Rao
from seatrial.environment.sea.reading import read_sea
from seatrial.environment.sea.spectra import Ittc, Jonswap, PiersonMoskowitz, moments

OMEGA = np.linspace(0.2, 2.0, 19)
CHI = np.radians(np.arange(0.0, 360.0, 45.0))
ROLL = np.diag([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])


BREAKING = 0.1 * GRAVITY * 81.0 / math.tau
"""Height of a tenth of the length of a deep-water wave of 9 s, over 2 pi [m]."""


# --- spectra and seas ---


def test_the_moments_of_two_parameters_are_those_of_the_integral() -> None:
    """Of A w^-5 exp(-B w^-4): m0 = A / 4B, so H_S; m1 = A B^(-3/4) Gamma(3/4) / 4; m2 = A sqrt(pi / B) / 4."""
    sea = Ittc(3.0, 9.0)
    B = 1.25 * sea.omega_P**4
    A = 4.0 * B * 9.0 / 16.0
    found = moments(sea, 0.05, 400.0)
    assert pytest.approx(3.0, rel=1e-4) == found.H_S
    assert found.m1 == pytest.approx(0.25 * A * B**-0.75 * math.gamma(0.75), rel=1e-4)
    assert found.m2 == pytest.approx(0.25 * A * math.sqrt(math.pi / B), rel=1e-3)
    assert (found.T_01, found.T_z) == pytest.approx(
        (math.tau * found.m0 / found.m1, math.tau * math.sqrt(found.m0 / found.m2))
    )
    wind = PiersonMoskowitz(15.0)
    assert moments(wind, 0.05, 400.0).m0 == pytest.approx(8.1e-3 * 15.0**4 / (4.0 * 0.74 * GRAVITY**2), rel=1e-4)
    peak = np.linspace(0.3, 1.2, 9001)
    for spectrum in (sea, wind, Jonswap(3.0, 9.0, 3.3)):
        assert peak[spectrum.density(peak).argmax()] == pytest.approx(spectrum.omega_P, abs=2e-4)


@pytest.mark.parametrize("gamma", [1.0, 3.3, 5.0])
def test_a_higher_peak_is_gamma_times_as_high(gamma: float) -> None:
    """At the peak; half way down its flank, one sigma off, gamma^exp(-1/2), .07 below and .09 above it."""
    plain, high = Ittc(3.0, 9.0), Jonswap(3.0, 9.0, gamma)
    less = 1.0 - 0.287 * math.log(gamma)
    for off, power in ((0.0, 1.0), (-0.07, math.exp(-0.5)), (0.09, math.exp(-0.5)), (0.18, math.exp(-2.0))):
        w = np.array([plain.omega_P * (1.0 + off)])
        assert high.density(w)[0] / plain.density(w)[0] == pytest.approx(less * gamma**power)
    for H_S, T_P, wanted in ((4.0, 7.0, 5.0), (4.0, 8.0, math.exp(5.75 - 4.6)), (4.0, 12.0, 1.0), (0.0, 8.0, 1.0)):
        assert Jonswap(H_S, T_P).peak == pytest.approx(wanted)


@pytest.mark.parametrize(("good", "bad"), [
    (lambda: PiersonMoskowitz(60.0), lambda: PiersonMoskowitz(60.1)), (lambda: Ittc(0.0, 0.5), lambda: Ittc(0.0, 0.49)),
    (lambda: Ittc(40.0, 40.0), lambda: Ittc(40.1, 40.0)), (lambda: Ittc(1.0, 40.0), lambda: Ittc(1.0, 40.1)),
    (lambda: Ittc(BREAKING - 1e-9, 9.0), lambda: Ittc(BREAKING + 1e-9, 9.0)),
    (lambda: Jonswap(1.0, 9.0, 10.0), lambda: Jonswap(1.0, 9.0, 10.1)),
    (lambda: Jonswap(1.0, 9.0, 1.0), lambda: Jonswap(1.0, 9.0, 0.99)),
    (lambda: Sea(Ittc(1.0, 9.0), 4.0 * math.pi), lambda: Sea(Ittc(1.0, 9.0), 4.0 * math.pi + 0.01)),
    (lambda: Sea(Ittc(1.0, 9.0), spread=1.0), lambda: Sea(Ittc(1.0, 9.0), spread=0.99)),
    (lambda: Sea(Ittc(1.0, 9.0), seed=0), lambda: Sea(Ittc(1.0, 9.0), seed=-1)),
])  # fmt: skip
def test_seas_at_their_bounds(good: Any, bad: Any) -> None:
    good()
    with pytest.raises(WeatherError):
        bad()


def test_three_hundred_waves_lie_in_the_middle_half_of_their_bands_with_their_variance() -> None:
    sea = Sea(Jonswap(3.0, 9.0, 3.3), 0.7, seed=4)
    waves, peak = sea.waves, sea.spectrum.omega_P
    width = 5.5 * peak / 300.0
    place = (waves.omega - 0.5 * peak) / width - np.arange(300)
    assert 0.25 <= place.min() < 0.3 < 0.7 < place.max() <= 0.75
    np.testing.assert_allclose(waves.k, waves.omega**2 / GRAVITY)
    np.testing.assert_allclose(waves.beta, 0.7 + math.pi)
    fine = np.linspace(0.5, 6.0, 300 * 40 + 1) * peak
    within = sea.spectrum.density(fine)
    band = np.array([np.trapezoid(within[40 * k : 40 * k + 41], fine[40 * k : 40 * k + 41]) for k in range(300)])
    np.testing.assert_allclose(0.5 * waves.a**2, band, rtol=5e-3, atol=1e-9)
    assert 0.0 <= waves.eps.min() < 0.2
    assert 6.0 < waves.eps.max() < math.tau
    assert sea.moments.m0 == pytest.approx(0.5 * (waves.a**2).sum(), rel=1e-3)


@pytest.mark.parametrize("s", [1.0, 4.0, 25.0])
def test_the_share_of_energy_below_a_direction_is_that_of_its_law(s: float) -> None:
    share = np.array([0.05, 0.3, 0.5, 0.9])
    found = _deviations(share, s)
    angle = np.linspace(-math.pi, math.pi, 200001)
    law = np.cos(0.5 * angle) ** (2.0 * s)
    for one, at in zip(share, found, strict=True):
        assert law[angle <= at].sum() / law.sum() == pytest.approx(one, abs=1e-3)
    assert (_deviations(share, math.inf) == 0.0).all()


def test_a_wave_travels_where_it_goes_to() -> None:
    """A crest that is at the origin at t = 0 is at omega / k t metres along beta."""
    beta, omega = 2.2, 0.8
    k = omega**2 / GRAVITY
    wave = Waves(*(np.array([one]) for one in (omega, k, beta, 1.5, 0.3)))
    t = np.array([0.0, 3.0, 50.0])
    far = omega / k * t
    np.testing.assert_allclose(wave.phase(t, far * math.cos(beta), far * math.sin(beta))[:, 0], 0.3)
    np.testing.assert_allclose(wave.elevation(t, 0.0 * t, 0.0 * t), 1.5 * np.cos(omega * t + 0.3))


# --- operators ---


def test_operators_of_half_a_turn_are_mirrored_and_gaps_beyond_an_eighth_of_a_turn_refused() -> None:
    half = np.radians([0.0, 45.0, 90.0, 135.0, 180.0])
    draw = np.random.default_rng(1)
    R = draw.normal(size=(2, 5, 6)) + 1j * draw.normal(size=(2, 5, 6))
    whole = Rao.of(np.array([0.5, 1.0]), half, R)
    assert np.degrees(whole.chi) == pytest.approx(np.arange(0.0, 360.0, 45.0))
    np.testing.assert_allclose(whole.R[:, :5], R)
    for k, other in ((5, 3), (6, 2), (7, 1)):
        np.testing.assert_allclose(whole.R[:, k], R[:, other] * MIRROR)
    port = Rao.of(np.array([0.5, 1.0]), math.tau - half, R * MIRROR)
    np.testing.assert_allclose(port.R[:, 1:4], R[:, 1:4])
    again = Rao.of(np.array([0.5, 1.0]), whole.chi + math.tau, whole.R)
    np.testing.assert_allclose(again.R, whole.R)
    with pytest.raises(WeatherError, match="no directions between 45 and 91 deg"):
        Rao.of(np.array([0.5, 1.0]), np.radians([0.0, 45.0, 91.0, 135.0, 180.0]), R)
    for omega in (np.array([0.5]), np.array([1.0, 0.5]), np.array([0.5, 0.5]), np.array([0.0, 0.5])):
        with pytest.raises(WeatherError, match="must rise"):
            Rao.of(omega, half, R[: omega.size])
    with pytest.raises(WeatherError, match="finite"):
        Rao.of(np.array([0.5, 1.0]), half, R * np.nan)


def test_operators_between_frequencies_and_beyond() -> None:
    R = np.stack([np.full((8, 6), 1.0 + 2.0j), np.full((8, 6), 3.0 - 2.0j)])
    rao = Rao.of(np.array([0.5, 1.0]), CHI, R)
    found = rao.at(np.array([0.1, 0.5, 0.75, 1.0, 1.01]))[:, 0, 0]
    np.testing.assert_allclose(found, [1.0 + 2.0j, 1.0 + 2.0j, 2.0, 3.0 - 2.0j, 0.0])


def test_operators_may_miss_two_hundredths_of_a_sea() -> None:
    sea = Sea(Ittc(3.0, 9.0))
    waves = sea.waves
    order = np.cumsum(waves.a**2) / (waves.a**2).sum()
    for share, good in ((0.02, True), (0.0201, False)):
        last = int(np.searchsorted(order, share))
        low = waves.omega[last] + (-1e-6 if good else 1e-6)
        rao = Rao.of(np.array([low, 9.0]), CHI, np.ones((2, 8, 6), dtype=complex))
        if good:
            rao.covers(sea)
        else:
            with pytest.raises(WeatherError, match="2% of the variance"):
                rao.covers(sea)


@pytest.mark.slow
def test_the_variance_of_a_motion_is_that_over_a_long_time() -> None:
    sea = Sea(Jonswap(2.0, 8.0), 0.4, seed=3)
    omega = np.linspace(0.2, 5.0, 40)
    R = (np.exp(-((omega[:, None] - 0.8) ** 2)) * (1.0 + 0.3 * np.cos(CHI)))[..., None] * np.arange(1.0, 7.0)
    rao = Rao.of(omega, CHI, R * np.exp(0.7j))
    t = np.arange(0.0, 20000.0, 3.1)
    still = np.zeros((t.size, 2))
    seen, rate = rao.motions(sea.waves, t, 0.0 * t, 0.0 * t, np.full(t.size, 0.9), still)
    wanted = rao.variances(sea.waves, 0.9)
    np.testing.assert_allclose(seen.var(axis=0), wanted, rtol=0.05)
    near = np.array([100.0, 100.001])
    two, speed = rao.motions(sea.waves, near, near * 3.0, near, np.full(2, 0.9), np.tile([3.0, 1.0], (2, 1)))
    np.testing.assert_allclose((two[1] - two[0]) / 1e-3, speed[0], rtol=2e-3, atol=1e-4)
    assert rate.shape == seen.shape


# --- coefficients ---


def heaving(**more: Any) -> Hydrodynamics:
    """Heave, roll and pitch of a body of constant coefficients, which a forced oscillator of one degree is."""
    A, B = np.zeros((OMEGA.size, 6, 6)), np.zeros((OMEGA.size, 6, 6))
    for k, (added, damping) in {2: (3.0, 1.5), 3: (0.5, 0.1), 4: (2.0, 0.8)}.items():
        A[:, k, k], B[:, k, k] = added, damping
    F = np.zeros((OMEGA.size, 8, 6), dtype=complex)
    F[..., 2], F[..., 3], F[..., 4] = 4.0, 2.0 * np.sin(CHI), 1.0j
    M, C = np.diag([5.0, 5.0, 5.0, 2.0, 6.0, 6.0]), np.diag([0.0, 0.0, 9.0, 1.5, 6.0, 0.0])
    return replace(Hydrodynamics(OMEGA, A, B, (2, 3, 4), M, C, 0.0, None, CHI, F), **more)


@pytest.mark.parametrize("U", [0.0, 3.0])
def test_a_body_of_constant_coefficients_is_an_oscillator_at_the_frequency_of_encounter(U: float) -> None:
    rao = heaving().rao(U, roll_damping=0.1)
    for k, chi in enumerate(rao.chi):
        w = OMEGA - OMEGA**2 / GRAVITY * U * math.cos(chi)
        np.testing.assert_allclose(rao.R[:, k, 2], 4.0 / (9.0 - 8.0 * w**2 + 1.5j * w), rtol=1e-9)
        more = 2.0 * 0.1 * math.sqrt(1.5 * 2.5)  # a tenth of the critical damping
        np.testing.assert_allclose(
            rao.R[:, k, 3], 2.0 * math.sin(chi) / (1.5 - 2.5 * w**2 + 1j * w * (0.1 + more)), atol=1e-12
        )
        assert not rao.R[:, k, [0, 1, 5]].any()
    further = np.zeros((6, 6))
    further[2, 2] = 2.0
    w = OMEGA
    np.testing.assert_allclose(heaving().rao(further=further).R[:, 0, 2], 4.0 / (9.0 - 8.0 * w**2 + 3.5j * w))
    assert heaving().forces.R[3, 2, 2] == 4.0
    for what in (lambda d: d.rao(), lambda d: d.forces):
        with pytest.raises(WeatherError, match="no wave forces"):
            what(heaving(F=np.empty((OMEGA.size, 0, 6), dtype=complex)))


def test_where_a_ship_runs_with_the_waves_it_rests() -> None:
    """In a following sea of omega = g / U the frequency of encounter is 0."""
    U = GRAVITY / OMEGA[8]
    R = heaving().rao(U).R
    assert not R[8, 0].any()
    assert R[7, 0].any()


def test_roll_is_damped_about_the_centre_of_gravity() -> None:
    """About a point .5 m off it, with a sway mass of 7: the inertia of roll about the centre is less by 7 / 4."""
    body = heaving(modes=(1, 2, 3, 4))
    A, B = body.A.copy(), body.B.copy()
    A[:, 1, 1], B[:, 1, 1] = 2.0, 0.3
    body = replace(body, A=A, B=B)
    lifted = body.moved(0.0, 0.0, 0.5)
    assert (lifted.z, body.z) == (0.5, 0.0)
    assert lifted.M[3, 3] == pytest.approx(2.0 + 5.0 * 0.25)
    assert lifted.A[0, 3, 3] == pytest.approx(0.5 + 2.0 * 0.25)
    found, other = lifted.rao(roll_damping=0.2).R, body.rao(roll_damping=0.2).R
    np.testing.assert_allclose(found[..., 3], other[..., 3], atol=1e-9)
    np.testing.assert_allclose(found[..., 1], other[..., 1] - 0.5 * other[..., 3], atol=1e-9)


def test_coefficients_between_frequencies_and_beyond_hold() -> None:
    A = heaving().A * OMEGA[:, None, None]
    data = heaving(A=A)
    added, damping = data.at(np.array([[0.25, -0.25], [9.0, 0.01]]))
    np.testing.assert_allclose(added[..., 2, 2], [[0.75, 0.75], [6.0, 0.6]])
    np.testing.assert_allclose(damping[..., 2, 2], 1.5)


@pytest.mark.parametrize(("spoil", "good"), [
    (lambda d: replace(d, omega=d.omega[:8], A=d.A[:8], B=d.B[:8], F=d.F[:8]), True),
    (lambda d: replace(d, omega=d.omega[:7], A=d.A[:7], B=d.B[:7], F=d.F[:7]), False),
    (lambda d: replace(d, omega=np.r_[d.omega[:10], d.omega[10:] + 0.15]), True),
    (lambda d: replace(d, omega=np.r_[d.omega[:10], d.omega[10:] + 0.17]), False),
    (lambda d: replace(d, B=d.B - 0.1019 * ROLL * (OMEGA[3] == OMEGA)[:, None, None]), True),
    (lambda d: replace(d, B=d.B - 0.1021 * ROLL * (OMEGA[3] == OMEGA)[:, None, None]), False),
    (lambda d: replace(d, A=d.A + 0.19 * math.sqrt(6.0) * np.outer(np.eye(6)[2], np.eye(6)[4])), True),
    (lambda d: replace(d, A=d.A + 0.21 * math.sqrt(6.0) * np.outer(np.eye(6)[2], np.eye(6)[4])), False),
])  # fmt: skip
def test_coefficients_at_the_bounds_of_what_is_taken(spoil: Any, good: bool) -> None:
    """Eight frequencies; a step of 2.6 of its neighbours'; energy given of a fiftieth; a fifth of asymmetry."""
    if good:
        spoil(heaving())
        return
    with pytest.raises(WeatherError) as told:
        spoil(heaving())
    assert "roll most" in str(told.value) or "damping" not in str(told.value)


@pytest.mark.parametrize(("direction", "good"), [(360.0, True), (-360.0, True), (361.0, False), (-361.0, False)])
def test_a_direction_of_a_sea_is_within_a_turn(tmp_path: Path, direction: float, good: bool) -> None:
    path = tmp_path / "sea.toml"
    path.write_text(f'schema = "seatrial-sea/1"\nspectrum = "ittc"\nH_S = 2\nT_P = 8\ndirection = {direction}\n')
    for text in (str(path), f"2,8,{direction}"):
        if good:
            assert read_sea(text).gamma_W == pytest.approx(math.radians(direction))
        else:
            with pytest.raises((DataError, WeatherError), match="0 to 360 deg"):
                read_sea(text)


def test_forces_of_one_side_are_those_of_the_other_mirrored() -> None:
    half = np.radians([0.0, 45.0, 90.0, 135.0, 180.0])
    draw = np.random.default_rng(2)
    F = draw.normal(size=(9, 5, 6)) + 1j * draw.normal(size=(9, 5, 6))
    chi, whole = whole_turn(half, F)
    assert np.degrees(chi) == pytest.approx(np.arange(0.0, 360.0, 45.0))
    np.testing.assert_allclose(whole[:, :5], F)
    np.testing.assert_allclose(whole[:, [5, 6, 7]], F[:, [3, 2, 1]] * MIRROR)

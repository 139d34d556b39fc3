"""Gusts, measured weather and how weathers join: the same at every call, right on average."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import welch

from seatrial.core.parameters import ParameterError
from seatrial.data import Trial
from seatrial.environment import CHANNELS, Uniform
from seatrial.environment.weather import Davenport, Froya, Gust, Harris, Measured, OchiShin, Together, WeatherError
from seatrial.manoeuvres.turning import Turning
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

BREEZE = Uniform(U_T=12.0, gamma_T=0.7, U_C=0.4, gamma_C=2.0, H_S=1.5, T_W=6.0, gamma_W=0.9, depth=30.0)
SPECTRA = {"davenport": Davenport(), "harris": Harris(), "froya": Froya(), "ochi-shin": OchiShin()}
named = pytest.mark.parametrize("name", list(SPECTRA))


def along(series: np.ndarray, gamma: float) -> np.ndarray:
    return series[:, 0] * math.cos(gamma) + series[:, 1] * math.sin(gamma)


@pytest.mark.slow
def test_one_gust_is_one_time_series() -> None:
    """A public simulator draws its phases anew at every call, so each integrator stage meets another wind."""
    gust = Gust(BREEZE, seed=4, across=0.5)
    first = gust.series(0.5, 400)
    assert np.array_equal(first, gust.series(0.5, 400))
    assert np.array_equal(first, Gust(BREEZE, seed=4, across=0.5).series(0.5, 400))
    assert gust.series(0.5, 5000)[:400] == pytest.approx(first, abs=1e-12)  # a longer run
    assert gust.series(0.25, 800)[::2] == pytest.approx(first, abs=1e-12)  # half the step
    assert np.abs(Gust(BREEZE, seed=5, across=0.5).series(0.5, 400) - first).max() > 0.5


@pytest.mark.long
@named
def test_gusts_keep_the_mean_wind_the_variance_and_all_else(name: str) -> None:
    gust = Gust(BREEZE, name, seed=1)
    series = gust.series(5.0, 40_000)  # long, so that the slowest harmonics average out
    wind = along(series, 0.7)
    assert wind.mean() == pytest.approx(12.0, abs=0.03)
    assert wind.var() == pytest.approx(gust.variance(12.0), rel=0.02)
    assert series[:, 0] * math.sin(0.7) == pytest.approx(series[:, 1] * math.cos(0.7), abs=1e-12)
    assert (series[:, 2:] == BREEZE.series(0.5, 1)[:, 2:]).all()


@named
def test_variance_is_the_integral_of_the_spectrum(name: str) -> None:
    gust, spectrum = Gust(BREEZE, name), SPECTRA[name]

    def by_octave(x: float) -> float:
        return math.exp(x) * float(spectrum.density(np.array([math.exp(x)]), 12.0)[0])

    total = quad(by_octave, math.log(gust.low), math.log(gust.high), limit=200, epsabs=1e-10)[0]
    assert gust.variance(12.0) == pytest.approx(total, rel=1e-4)


@pytest.mark.long
@named
def test_welch_finds_the_spectrum_again(name: str) -> None:
    wind = along(Gust(BREEZE, name, seed=2).series(0.4, 60_000), 0.7)
    f, found = welch(wind - wind.mean(), 2.5, nperseg=4096)
    for low in (0.004, 0.01, 0.03, 0.1, 0.3):
        band = (f >= low) & (f < 2.5 * low)
        assert found[band].mean() == pytest.approx(SPECTRA[name].density(f[band], 12.0).mean(), rel=0.1)


def test_spectra_as_published() -> None:
    """Where the Davenport form multiplies a public simulator adds: values by hand, and whole variances."""
    f, U = np.array([0.01]), 12.0  # X = 1 for Davenport, 1.5 for Harris
    assert Davenport(0.003).density(f, U)[0] == pytest.approx(4 * 0.003 * 144 / 2 ** (4 / 3) / 0.01)
    assert Harris(0.003).density(f, U)[0] == pytest.approx(4 * 0.003 * 144 * 1.5 / 4.25 ** (5 / 6) / 0.01)
    assert Froya().density(f, 10.0)[0] == pytest.approx(320 / (1 + 1.72**0.468) ** 3.561, rel=1e-3)
    wide = Gust(BREEZE, Davenport(0.003), low=1e-6, high=1e4).variance(U)
    assert wide == pytest.approx(6 * 0.003 * U * U, rel=2e-3)
    closed = 4 * 2 ** (-1 / 3) * math.gamma(0.5) * math.gamma(1 / 3) / (2 * math.gamma(5 / 6))
    wide = Gust(BREEZE, Harris(0.003), low=1e-8, high=1e5).variance(U)
    assert wide == pytest.approx(closed * 0.003 * U * U, rel=2e-3)


@pytest.mark.parametrize("joint", [0.003, 0.1])
def test_ochi_and_shin_join(joint: float) -> None:
    f = np.array([joint * (1 - 1e-9), joint * (1 + 1e-9)])
    low, high = OchiShin().density(f, 10.0)
    assert low == pytest.approx(high, rel=2e-4)


@pytest.mark.slow
def test_no_gust_on_a_calm_and_across_lets_the_direction_wander() -> None:
    assert not Gust(Uniform()).series(1.0, 50)[:, :2].any()
    series = Gust(BREEZE, across=0.8, seed=3).series(0.5, 20_000)
    side = series[:, 1] * math.cos(0.7) - series[:, 0] * math.sin(0.7)
    assert side.std() == pytest.approx(0.8 * along(series, 0.7).std(), rel=0.05)
    assert abs(np.corrcoef(side, along(series, 0.7))[0, 1]) < 0.1


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Gust(BREEZE, "davenprt"), "davenport"),
        (lambda: Gust(BREEZE, low=1.0, high=0.1), "low < high"),
        (lambda: Gust(BREEZE, across=-1.0), "0 or more"),
        (lambda: Measured(np.array([0.0, 0.0]), {}), "must rise"),
        (lambda: Measured(np.array([0.0]), {"U_T": np.array([1.0])}), "gamma_T go together"),
        (lambda: Measured(np.array([0.0]), {"depht": np.array([1.0])}), "depth"),
        (lambda: Measured(np.array([0.0]), {"depth": np.array([0.0])}), "depth of zero"),
        (lambda: Measured(np.array([0.0]), {"depth": np.array([np.nan])}), "no sample"),
        (lambda: Measured(np.array([0.0]), {"depth": np.array([1.0, 2.0])}), "2 samples"),
        (lambda: Measured.of(Trial("t", np.array([0.0]), {})), "no channel of weather"),
        (lambda: Together((BREEZE, Uniform(depth=9.0))).series(1.0, 2), "depth"),
    ],
)
def test_bad_weather_in_one_line(make: object, words: str) -> None:
    with pytest.raises(WeatherError, match=words) as caught:
        make()  # type: ignore[operator]
    assert "\n" not in str(caught.value)


def test_measured_wind_about_north_stays_there() -> None:
    t = np.array([100.0, 110.0, 120.0, 130.0])
    channels = {
        "U_T": np.array([5.0, 5.0, np.nan, 5.0]), "gamma_T": np.array([-0.1, 0.1, 0.1, 0.1]) % (2 * math.pi),
        "depth": np.array([20.0, 40.0, 40.0, 40.0]),
    }  # fmt: skip
    weather = Measured.of(Trial("t", t, channels))
    series = weather.series(5.0, 9)
    assert series.shape == (9, len(CHANNELS))
    assert np.isfinite(series).all()
    assert series[1, :2] == pytest.approx([5 * math.cos(0.1), 0.0], abs=1e-12)
    assert series[4, :2] == pytest.approx([5 * math.cos(0.1), 5 * math.sin(0.1)])  # the gap is bridged
    assert series[[0, 1, 2, 8], 7] == pytest.approx([1 / 20, 1 / 30, 1 / 40, 1 / 40])
    held = Measured.of(Trial("t", t, channels), held=True).series(5.0, 9)
    assert held[:4, 7] == pytest.approx([1 / 20, 1 / 20, 1 / 40, 1 / 40])
    assert weather.series(0.1, 1)[0, 2:7] == pytest.approx(0.0)


def test_held_samples_come_on_the_beat() -> None:
    t = 0.1 * np.arange(2001.0)
    held = Measured(t, {"depth": 1.0 + np.arange(2001.0)}, held=True).series(0.1, 2001)
    assert 1.0 / held[:, 7] == pytest.approx(1.0 + np.arange(2001.0))


def test_weathers_join() -> None:
    tide = Measured(np.array([0.0, 10.0]), {"U_C": np.array([0.0, 1.0]), "gamma_C": np.array([1.0, 1.0])})
    series = Together((Gust(Uniform(U_T=8.0), seed=1), tide, Uniform(depth=12.0))).series(1.0, 11)
    assert series[:, 2] == pytest.approx(np.linspace(0, math.cos(1.0), 11))
    assert series[:, 7] == pytest.approx(1 / 12)
    assert series[:, :2] == pytest.approx(Gust(Uniform(U_T=8.0), seed=1).series(1.0, 11)[:, :2])
    assert not Together(()).series(1.0, 3).any()


@pytest.mark.slow
def test_two_runs_in_one_gust_are_one_run() -> None:
    ship, policy = load("esso_osaka_3m"), Turning(n_P=10.0, delta=0.3)
    runs = [
        simulate(ship, policy, duration=40.0, environment=weather)
        for weather in (Gust(Uniform(U_T=2.0), seed=1), Gust(Uniform(U_T=2.0), seed=1), Uniform(U_T=2.0))
    ]
    assert np.array_equal(runs[0]["y"], runs[1]["y"])
    assert np.abs(runs[0]["y"] - runs[2]["y"]).max() > 0.01


@pytest.mark.parametrize("said", [
    {"U_T": 5.0, "gamma_T": 270.0}, {"U_C": 1.0, "gamma_C": 90.0}, {"H_S": 2.0, "gamma_W": -180.0}, {"U_C": 90.0},
    {"U_T": -1.0}, {"depth": 0.0},
])  # fmt: skip
def test_weather_that_cannot_be_is_refused(said: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match="it can be"):
        Uniform(**said)
    assert Uniform(U_T=5.0, gamma_T=-4.0 * math.pi).now().wind_x == pytest.approx(5.0)


def test_measured_sea_and_current_are_taken_by_their_components_and_held_at_the_ends() -> None:
    """Half way between two records vectors are the means of their components, sizes and periods of themselves."""
    t = np.array([10.0, 20.0])
    record = {"U_C": np.array([0.5, 0.7]), "gamma_C": np.array([0.0, 1.0]), "H_S": np.array([1.0, 2.0]),
              "gamma_W": np.array([2.0, 3.0]), "T_W": np.array([6.0, 8.0])}  # fmt: skip
    rows = Measured(t, record).series(5.0, 7)
    ends = [(0.5, 0.0, math.cos(2.0), math.sin(2.0), 6.0),
            (0.7 * math.cos(1.0), 0.7 * math.sin(1.0), 2.0 * math.cos(3.0), 2.0 * math.sin(3.0), 8.0)]  # fmt: skip
    for k, share in ((0, 0.0), (2, 0.0), (3, 0.5), (4, 1.0), (6, 1.0)):
        wanted = (1.0 - share) * np.array(ends[0]) + share * np.array(ends[1])
        assert rows[k, 2:7] == pytest.approx(wanted)
    held = Measured(t, record, held=True).series(5.0, 7)
    assert held[[0, 3], 2:7] == pytest.approx(np.array([ends[0], ends[0]]))
    assert held[[4, 6], 2:7] == pytest.approx(np.array([ends[1], ends[1]]))
    assert not rows[:, [0, 1, 7]].any()


@pytest.mark.slow
def test_gusts_blow_along_the_mean_wind_of_the_moment_and_across_to_its_starboard() -> None:
    """On a wind that goes round: the series less the base, turned into the wind, is what `gusts` gives."""
    t = np.arange(0.0, 60.0, 0.5)
    turning = Measured(t, {"U_T": np.full(t.size, 12.0), "gamma_T": 0.05 * t})
    gust = Gust(turning, seed=3, across=0.4)
    more = gust.series(0.5, t.size)[:, :2] - turning.series(0.5, t.size)[:, :2]
    c, s = np.cos(0.05 * t), np.sin(0.05 * t)
    along_it, across_it = gust.gusts(t, 12.0)
    assert more[:, 0] * c + more[:, 1] * s == pytest.approx(along_it, abs=1e-9)
    assert more[:, 1] * c - more[:, 0] * s == pytest.approx(across_it, abs=1e-9)
    long = np.arange(5000.0)
    assert gust.gusts(long, 12.0)[0][4096:] == pytest.approx(gust.gusts(long[4096:], 12.0)[0], abs=1e-9)
    assert not gust.bands(0.0)[1].any()


def test_ochi_and_shin_have_the_printed_branches() -> None:
    """f S/(kappa U^2) of X = 10 f/U: 583 X, 420 X^.7/(1 + X^.35)^11.5, 838 X over the same."""
    for X in (0.001, 0.02, 0.5):
        f = X * 1.5
        tail = (1.0 + X**0.35) ** 11.5
        shape = 583.0 * X if X < 0.003 else 420.0 * X**0.7 / tail if X < 0.1 else 838.0 * X / tail
        assert OchiShin(0.002).density(np.array([f]), 15.0)[0] == pytest.approx(0.002 * 225.0 * shape / f)
    high = Froya(z=40.0).density(np.array([0.02]), 20.0)[0]
    X = 172.0 * 0.02 * 4.0 ** (2.0 / 3.0) * 2.0**-0.75
    assert high == pytest.approx(320.0 * 4.0 * 4.0**0.45 / (1.0 + X**0.468) ** (5.0 / 1.404), rel=1e-9)

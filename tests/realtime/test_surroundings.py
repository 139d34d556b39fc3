"""Weather step by step: the same as in a whole run, wherever one begins, in little memory."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.environment import Uniform
from seatrial.environment.weather import Gust, Measured, Together, WeatherError
from seatrial.realtime import plant as surroundings
from seatrial.realtime.plant import Surroundings

DT = 0.5
WIND = Gust(Uniform(U_T=6.0, gamma_T=0.8), seed=2, across=0.5)
MEASURED = Measured(
    np.array([0.0, 100.0, 300.0]), {"U_T": np.array([2.0, 5.0, 3.0]), "gamma_T": np.array([0.0, 1.0, 2.0])}
)


@pytest.mark.parametrize(
    "weather",
    [Uniform(U_T=3.0, U_C=0.4, H_S=1.0, T_W=6.0, depth=20.0), WIND, Together((WIND, Uniform(U_C=0.5))), MEASURED,
     Gust(MEASURED, seed=1), Gust(Uniform(), seed=1)],
    ids=["steady", "gusts", "gusts and current", "measured", "gusts on measured", "gusts in a calm"],
)  # fmt: skip
def test_every_step_has_the_weather_of_the_whole_run(weather, monkeypatch):
    monkeypatch.setattr(surroundings, "_AHEAD", 400.0)
    whole = np.broadcast_to(weather.series(DT, 800), (800, 8))
    around = Surroundings(weather, DT)
    np.testing.assert_array_equal(np.array([around.at(k) for k in range(800)]), whole)


@pytest.mark.parametrize("weather", [
    WIND, MEASURED, pytest.param(Gust(MEASURED, seed=1), marks=pytest.mark.slow),
], ids=["gusts", "measured", "both"])  # fmt: skip
def test_from_anywhere_it_is_the_same_to_the_last_bit(weather, monkeypatch):
    monkeypatch.setattr(surroundings, "_AHEAD", 50.0)
    around = Surroundings(weather, DT)
    through = {k: around.at(k).tolist() for k in range(1000)}
    for k in (999, 3, 500, 100, 99, 401):
        assert Surroundings(weather, DT).at(k).tolist() == through[k]
        assert around.at(k).tolist() == through[k]
        assert around.values == through[k]


def test_what_is_set_holds_until_it_is_lifted():
    around = Surroundings(WIND, DT)
    forecast = around.at(7).tolist()
    around.hold(Uniform(U_C=1.0).now())
    assert not around.changes
    assert around.at(7)[2] == around.values[2] == 1.0
    around.hold(None)
    assert around.changes
    assert around.at(7).tolist() == forecast


def test_weather_that_does_not_go_together_is_refused():
    with pytest.raises(WeatherError, match="two weathers give waves"):
        Surroundings(Together((Uniform(H_S=1.0, T_W=5.0), Uniform(H_S=1.0, T_W=6.0))), DT)

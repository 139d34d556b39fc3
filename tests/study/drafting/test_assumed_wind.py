"""The force of wind that a first study assumes of a ship of particulars, whose outline above water nobody gave."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.parameters import values
from seatrial.data import Trial
from seatrial.forces.wind import fujiwara1998
from seatrial.identify import StudyError
from seatrial.ships import Ship
from seatrial.ships.estimate import estimate
from seatrial.ships.files import load, save
from seatrial.study.drafting.wind import _HEIGHT, _OUTLINES, blown, outline, table, with_wind
from seatrial.study.freedom import stated
from seatrial.study.study import read_ship

L, B, D = 40.0, 8.0, 2.5
T = np.arange(20.0)


@pytest.fixture(scope="module")
def bare(tmp_path_factory: pytest.TempPathFactory) -> Ship:
    sheet = tmp_path_factory.mktemp("sheet") / "particulars.toml"
    sheet.write_text(f'schema = "seatrial-particulars/1"\nname = "some"\n[particulars]\nL_pp = {L}\nB = {B}\nd = {D}\n'
                     "C_b = 0.68\nspeed = 6.0\nD_P = 1.6\nA_R = 1.8\nH_R = 1.9\n", encoding="utf-8")  # fmt: skip
    return estimate(sheet).ship


def log(**more: float) -> Trial:
    return Trial("log", T, {"u": 5.0 + 0.0 * T, **{name: value + 0.0 * T for name, value in more.items()}})


def test_a_wind_is_assumed_where_all_trials_have_one_and_an_estimated_ship_has_none(bare: Ship) -> None:
    windy, calm = log(U_T=4.0, gamma_T=1.0), log()
    assert [blown(one) for one in (windy, log(U_A=3.0, gamma_A=0.1), log(U_T=0.0), calm)] == [True, True, False, False]
    assert with_wind(bare, [windy, calm]) is bare
    assert with_wind(load("kcs"), [windy]).model.part("wind") is None  # its numbers are published, not estimated
    made = with_wind(bare, [windy, windy])
    assert made.model.feels_wind
    assert with_wind(made, [windy]) is made
    assert not any(path.startswith("wind.") for path in values(bare.model))


def test_it_pushes_as_ships_are_pushed_and_is_as_uncertain_as_they_differ(bare: Ship) -> None:
    """A beam wind of 10 m/s: .5 to 1.2 times the stagnation pressure on side areas of 3 to 12 % of L^2."""
    force = with_wind(bare, [log(U_T=4.0)]).model.part("wind")
    sizes, numbers = outline(L, B)
    pressure = 0.5 * 1.225 * 10.0**2
    across = pressure * sizes["A_L"] * (numbers["Y_1"][0] - numbers["Y_3"][0] + numbers["Y_5"][0])
    assert 0.5 * 0.03 * L * L * pressure < across < 1.2 * 0.12 * L * L * pressure
    assert numbers["X_1"][0] < 0.0 < numbers["X_1"][1] < abs(numbers["X_1"][0])  # a headwind drags
    assert 0.3 < numbers["Y_1"][1] / numbers["Y_1"][0] < 0.9
    assert float(force.Y_1) == numbers["Y_1"][0]
    big, many = outline(10.0 * L, 10.0 * B)
    assert big["A_L"] == pytest.approx(100.0 * sizes["A_L"])
    assert many == {name: pytest.approx(pair) for name, pair in numbers.items()}


def test_its_mean_is_the_mean_of_the_forces_on_the_outlines() -> None:
    sizes, numbers = outline(L, B)
    forces: dict[str, list[float]] = {"X_1": [], "Y_1": [], "N_2": []}
    for front, side, deck, C, C_BR, H_BR in _OUTLINES.values():
        A_T, A_L = front * B * B, side * L * L
        own = fujiwara1998(A_T=A_T, A_L=A_L, A_OD=deck * A_L, C=C * L, C_BR=C_BR * L, H_BR=H_BR * L,
                           H_C=_HEIGHT * A_L / L, B=B, L=L)  # fmt: skip
        for name, some in forces.items():
            some.append(own[name] * (A_T if name[0] == "X" else A_L))
    for name, some in forces.items():
        area = sizes["A_T" if name[0] == "X" else "A_L"]
        assert numbers[name][0] * area == pytest.approx(np.mean(some))
        assert numbers[name][1] * area == pytest.approx(np.std(some, ddof=1))


def test_the_table_of_the_study_is_that_force_with_its_sigmas(bare: Ship, tmp_path: Path) -> None:
    made = with_wind(bare, [log(U_T=4.0)])
    save(bare, tmp_path / "ship.toml")
    tables = tomllib.loads("\n".join(table(made)))
    read = read_ship(tmp_path / "study.toml", "ship.toml", tables)
    assert values(read.model)["wind.Y_1"] == pytest.approx(values(made.model)["wind.Y_1"], rel=1e-3)
    assert values(read.model)["wind.A_L"] == pytest.approx(values(made.model)["wind.A_L"], rel=1e-3)
    own = {path: sigma for path, sigma in stated(made).items() if path.startswith("wind.")}
    assert len(own) == 10
    assert {path: stated(read)[path] for path in own} == {path: pytest.approx(s, rel=1e-2) for path, s in own.items()}
    assert read_ship(tmp_path / "study.toml", "ship.toml").model.part("wind") is None


def test_a_force_that_a_study_gives_wrongly_is_one_line(bare: Ship, tmp_path: Path) -> None:
    save(bare, tmp_path / "ship.toml")
    with pytest.raises(StudyError, match=r"study\.toml: wind.*Y_9"):
        read_ship(tmp_path / "study.toml", "ship.toml", {"wind": {"type": "wind:Fujiwara", "Y_9": {"value": 1.0}}})

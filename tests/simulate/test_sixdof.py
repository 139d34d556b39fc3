"""A ship in six degrees of freedom among waves: regular waves, an irregular sea, and what the commands refuse."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.constants import GRAVITY
from seatrial.core.errors import RequestError, WeatherError
from seatrial.environment.sea import Sea, Waves
from seatrial.environment.sea.hydrodynamics import Hydrodynamics
from seatrial.environment.sea.reading import read_hydrodynamics
from seatrial.environment.sea.spectra import Ittc
from seatrial.manoeuvres.turning import Turning
from seatrial.ships import Ship, ShipError
from seatrial.ships.at_sea import with_memory
from seatrial.ships.files import load, save
from seatrial.simulate.sixdof import forced, solved, step_in
from seatrial.workflow.asked import InWaves, Span
from seatrial.workflow.seaway.making import roll, seakeeping
from seatrial.workflow.simulation import simulate

pytest.importorskip("h5netcdf")
HULL = Path(__file__).parent.parent / "environment" / "sea" / "wigley.nc"


@cache
def data() -> Hydrodynamics:
    read = read_hydrodynamics(HULL)
    return read.moved(0.0, 0.0, read.z_G)


@cache
def plain() -> Ship:
    """KVLCC2's primes on the parabolic hull: a numerical ship of no towing tank."""
    big: Any = load("kvlcc2")
    m = float(data().M[2, 2])
    body = replace(big.model.body, L_pp=100.0, B=10.0, d=6.25, m=m, x_G=0.0, I_zG=m * 625.0, m_x=0.05 * m,
                   m_y=0.9 * m, J_z=0.7 * m * 625.0)  # fmt: skip
    model = replace(
        big.model, body=body, propeller=replace(big.model.propeller, D_P=4.0, x_P=-48.0), wind=None, waves=None,
        rudder=replace(big.model.rudder, A_R=12.0, x_H=-46.4, x_R=-50.0, l_R=-71.0),
    )  # fmt: skip
    return replace(big, name="parabolic", model=model, L_pp=100.0, speed=5.0, n_P=None, validity={}, entries={})


@cache
def ship() -> Ship:
    return with_memory(plain(), read_hydrodynamics(HULL), 0.05, "data")


AHEAD = Turning(delta=0.0, n_P=2.2239)


def regular(omega: float, beta: float, a: float = 0.02) -> Waves:
    one = np.array([omega])
    return Waves(one, one**2 / GRAVITY, np.array([beta]), np.array([a]), np.zeros(1))


@pytest.mark.slow
@pytest.mark.parametrize(("omega", "chi"), [(0.7, math.pi), (0.9, 0.5 * math.pi), (0.5, 0.75 * math.pi)])
def test_regular_waves_give_the_response_of_the_frequency_domain(omega: float, chi: float) -> None:
    """Heave and pitch at rest in waves of 2 cm: amplitude of the last periods against operator, within 1 %.

    A rudder and a propeller that stand still; what sways and yaws slowly is not compared.
    """
    waves, dt = regular(omega, chi), 0.1
    still = replace(AHEAD, n_P=0.0)
    period = 2.0 * math.pi / omega
    steps = round(16 * period / dt)
    rows = np.zeros((1, 8))
    run = solved(ship(), still, np.zeros((1, 6)), rows, waves, data().forces, dt, steps, omega)
    last = slice(steps - round(6 * period / dt), steps)
    t = run.t[last]
    basis = np.column_stack([np.cos(omega * t), np.sin(omega * t), np.ones_like(t)])
    wanted = data().rao()
    at = int(np.argmin(np.abs(wanted.chi - chi)))
    k = int(np.argmin(np.abs(wanted.omega - omega)))
    for name, mode in (("z", 2), ("theta", 4)):
        if np.abs(wanted.R[k, at, mode]) < 1e-4:
            continue
        column = run.values[0, last, ship().model.states.index(name)]
        c, s, _ = np.linalg.lstsq(basis, column, rcond=None)[0]
        assert math.hypot(c, s) / 0.02 == pytest.approx(abs(wanted.R[k, at, mode]), rel=0.012), name


@pytest.mark.long
def test_an_irregular_sea_moves_it_as_operators_say() -> None:
    """Ten minutes at 5 m/s: heave and pitch near what spectrum and operators give at this speed."""
    sea = Sea(Ittc(0.5, 7.0), math.radians(30.0), seed=4)
    run = forced(ship(), AHEAD, sea=sea, forces=data().forces, duration=600.0, speed=5.0)
    model: Any = ship().model
    further = np.zeros((6, 6))
    further[3, 3] = float(model.roll.B_1)
    expected = data().rao(5.0, further=further).variances(sea.waves, 0.0)
    for name, mode in (("z", 2), ("theta", 4)):
        assert run[name][600:].std() == pytest.approx(math.sqrt(expected[mode]), rel=0.12), name
    assert run["zeta"].std() == pytest.approx(0.125, rel=0.1)


@pytest.mark.slow
def test_a_calm_sea_is_calm_water() -> None:
    flat = Sea(Ittc(0.0, 7.0), 0.3)
    run = forced(ship(), AHEAD, sea=flat, forces=data().forces, duration=20.0, speed=5.0)
    assert np.abs(run["theta"]).max() < 1e-3
    assert run.units["z"] == "m"
    assert step_in(ship(), Sea(Ittc(1.0, 4.0), 0.3)) <= 0.25 * 4.0 / (2.0 * math.pi)


@pytest.mark.slow
def test_what_is_refused(tmp_path: Path) -> None:
    """One line each, nothing written."""
    sea = Sea(Ittc(1.0, 7.0), 0.3)
    with pytest.raises(ShipError, match="six degrees of freedom"):
        forced(plain(), AHEAD, sea=sea, forces=data().forces, duration=20.0, speed=5.0)
    with pytest.raises(WeatherError, match="of the variance of the sea"):
        forced(ship(), AHEAD, sea=Sea(Ittc(0.1, 1.5), 0.3), forces=data().forces, duration=20.0, speed=5.0)
    save(plain(), tmp_path / "plain.toml")
    out = tmp_path / "out.toml"
    with pytest.raises(RequestError, match="share of the critical"):
        seakeeping(tmp_path / "plain.toml", HULL, out, roll_damping=5.0)
    with pytest.raises(RequestError, match="write ship or data"):
        seakeeping(tmp_path / "plain.toml", HULL, out, added="both")
    with pytest.raises(ShipError, match="give the data of this hull"):
        seakeeping("kvlcc2", HULL, out)
    with pytest.raises(RequestError, match="write M,M"):
        roll("kvlcc2", 5.0, 15.0, out, keels="a")
    with pytest.raises(ShipError, match="GM is -1"):
        roll("kvlcc2", -1.0, 15.0, out)
    assert not out.exists()


@pytest.mark.slow
def test_the_commands_write_ships(tmp_path: Path) -> None:
    """A ship that rolls, and one in six degrees of freedom that moves in a sea with forces of the same file."""
    made = roll("kvlcc2", 5.7, 18.6, tmp_path / "rolls.toml", keels="0.5,80")
    assert load(tmp_path / "rolls.toml").model == made.model
    save(plain(), tmp_path / "plain.toml")
    seakeeping(tmp_path / "plain.toml", HULL, tmp_path / "sea.toml", roll_damping=0.05)
    ran = simulate(tmp_path / "sea.toml", "straight", span=Span(30.0), waves=InWaves("0.3,7,150", HULL))
    assert set(ran.motions) == {"heave", "roll", "pitch"}
    assert ran.trial["theta"].std() > 0.0
    with pytest.raises(RequestError, match="has its own"):
        simulate(tmp_path / "sea.toml", "straight", span=Span(30.0), waves=InWaves("0.3,7,150", HULL, roll_damping=0.1))

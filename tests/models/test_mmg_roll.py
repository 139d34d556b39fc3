"""MMG with roll: the ship of the horizontal plane as a special case, heel in a turn, decay, stability."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seatrial.ships
from seatrial.core.parameters import ParameterError, specs
from seatrial.environment import CALM
from seatrial.forces.body_rigid import RigidCoriolis
from seatrial.manoeuvres.straight import Straight
from seatrial.manoeuvres.turning import Turning
from seatrial.models.mmg_roll import MmgRoll, Roll
from seatrial.models.rolling import GRAVITY
from seatrial.ships import Ship
from seatrial.ships.files import load, save
from seatrial.simulate.run import simulate

PLAIN: Any = load("kvlcc2_l7")
ROLL = Roll(I_x=520.0, J_x=130.0, GM=0.12, B_1=60.0, z_H=0.1, z_R=0.2)


def rolling(roll: Roll) -> Ship:
    return replace(PLAIN, name="rolling", model=MmgRoll(**vars(PLAIN.model), roll=roll))


def test_upright_it_is_the_ship_of_the_horizontal_plane() -> None:
    """With phi = p = 0 and no height at which a lateral force acts, to the last digits."""
    model = rolling(replace(ROLL, z_H=0.0, z_R=0.0)).model
    rng = np.random.default_rng(0)
    for _ in range(50):
        state = (0.0, 0.0, *(rng.uniform(-1.0, 1.0, 4) * (3.0, 1.2, 0.4, 0.2)).tolist())
        control = (float(rng.uniform(-12, 12)), float(rng.uniform(-0.6, 0.6)))
        plane = PLAIN.model.derivative(state, control, CALM)
        found = model.derivative((*state, 0.0, 0.0), control, CALM)
        assert found[:6] == pytest.approx(plane, rel=1e-12, abs=1e-15)
        assert found[6:] == pytest.approx((0.0, 0.0), abs=1e-15)


def test_a_stiff_ship_turns_as_the_one_of_the_horizontal_plane() -> None:
    tracks = []
    for ship in (PLAIN, rolling(replace(ROLL, GM=50.0, B_1=1e5))):
        trial = simulate(ship, Turning(10.4, math.radians(35.0)), duration=60.0, dt=0.02)
        tracks.append(np.column_stack([trial["x"], trial["y"], trial["psi"]]))
    assert np.abs(tracks[1] - tracks[0]).max() < 1e-3


def test_a_rudder_below_heels_into_the_turn_and_the_turning_out_of_it() -> None:
    """Steady heel by moments about the centre of gravity: W GM sin(phi) balances those of hull and rudder."""
    ship, policy = rolling(ROLL), Turning(10.4, math.radians(35.0))
    trial = simulate(ship, policy, duration=240.0, dt=0.02)
    found = policy.indices(trial, ship.L_pp)
    assert 0.0 < found["inward_heel"].value < found["outward_heel"].value
    model: Any = ship.model
    end = {name: float(trial[name][-1]) for name in trial.channels}
    sway = (end["u"] * end["r"]) * (model.body.m + model.body.m_x)  # steady: Y balances m u r and that of added mass
    lever = model.body.m * GRAVITY * ROLL.GM * math.sin(end["phi"])
    # Y of hull and rudder together is `sway`; their heights lie between z_H and z_R
    height = -lever / sway
    assert min(ROLL.z_H, ROLL.z_R) - 0.05 < height < max(ROLL.z_H, ROLL.z_R)
    assert end["phi"] < 0.0 < end["r"]


def test_roll_decays_with_its_period_and_damping() -> None:
    """Linear damping alone: the logarithmic decrement is 2 pi zeta/sqrt(1 - zeta^2), the period that of GM."""
    roll = replace(ROLL, z_H=0.0, z_R=0.0)
    ship = rolling(roll)
    trial = simulate(ship, Straight(0.0), duration=40.0, dt=0.01, start=(0.0,) * 6 + (0.01, 0.0))
    omega = math.sqrt(3270.0 * GRAVITY * roll.GM / (roll.I_x + roll.J_x))
    zeta = roll.B_1 / (2.0 * (roll.I_x + roll.J_x) * omega)
    damped = omega * math.sqrt(1.0 - zeta**2)
    swing = np.cos(damped * trial.t) + zeta * omega / damped * np.sin(damped * trial.t)
    phi = 0.01 * np.exp(-zeta * omega * trial.t) * swing
    assert np.abs(trial["phi"] - phi).max() < 1e-6
    quadratic, begin = rolling(replace(roll, B_2=2e3)), (0.0,) * 6 + (0.3, 0.0)
    harder = simulate(quadratic, Straight(0.0), duration=40.0, dt=0.01, start=begin)
    half = int(math.pi / damped / 0.01)
    assert np.abs(harder["phi"][half:]).max() / 0.3 < math.exp(-math.pi * zeta)  # quadratic damping takes more


def test_wall_sides_stiffen_and_a_negative_gm_lolls() -> None:
    """Angle of loll of a wall-sided hull: tan(phi) = sqrt(-2 GM/BM)."""
    unstable = replace(ROLL, GM=-0.01, BM=0.3, B_1=400.0, z_H=0.0, z_R=0.0)
    trial = simulate(rolling(unstable), Straight(0.0), duration=200.0, dt=0.02, start=(0.0,) * 6 + (0.02, 0.0))
    assert trial["phi"][-1] == pytest.approx(math.atan(math.sqrt(0.02 / 0.3)), rel=1e-4)


def test_a_body_of_other_equations_is_refused() -> None:
    body = RigidCoriolis(**vars(PLAIN.model.body))
    with pytest.raises(ParameterError, match="RigidCoriolis"):
        replace(rolling(ROLL).model, body=body)  # type: ignore[type-var]


def test_a_file_needs_the_family_and_roll_only(tmp_path: Path) -> None:
    """KVLCC2 as the library has it, with wind and a drag of still air in its resistance; it saves and loads again."""
    lines = "".join(f'{name} = {{ value = {value}, unit = "{specs(ROLL)[name].unit}", source = "assumed" }}\n'
                    for name, value in vars(ROLL).items())  # fmt: skip
    text = (Path(seatrial.ships.__file__).parent / "kvlcc2.toml").read_text()
    path = tmp_path / "rolling.toml"
    path.write_text(text.replace("mmg:Mmg", "mmg_roll:MmgRoll") + f"\n[roll]\n{lines}")
    ship = load(path)
    assert ship.model.part("roll") == ROLL
    again = load(save(ship, tmp_path / "again.toml"))
    assert again.model == ship.model

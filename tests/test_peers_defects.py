"""Each defect that a survey of public ship-manoeuvring simulators found, and a test that would have caught it.

Named by what was wrong there.  Figures of the peers are those of the survey (2026); none of their code is here.
Items 1 to 4 are here, 5 to 7 in test_peers_defects_runs.py.  Two are tested at home: the gust that is another
one at every call in test_weather.py (`test_one_gust_is_one_time_series`), and the advance speed of a propeller
over ground, not through the water, in testing/test_checks_bite.py.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import Scalar, spec
from seatrial.core.symbolic import exp, magnitude, where
from seatrial.environment import CALM
from seatrial.forces import Flow, Force, Slipstream
from seatrial.forces.hull import Polynomial
from seatrial.forces.propeller import Standard as Propeller
from seatrial.forces.propeller import inflow_angle, race, thrust
from seatrial.forces.rudder import Standard as Rudder
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models import Sampled
from seatrial.ships import Ship
from seatrial.ships.files import library, load
from seatrial.simulate.run import approach, simulate, straight, surge_balance, time_step

GOLDEN = tomllib.loads((Path(__file__).parent / "golden" / "kvlcc2.toml").read_text(encoding="utf-8"))
HARD_OVER = math.radians(35.0)
every_ship = pytest.mark.parametrize("name", library())


def turn(ship: Ship, n_P: float, duration: float, order: float = HARD_OVER, **how: Any) -> dict[str, float]:
    """Figures of a turn, lengths in L_pp."""
    policy = Turning(n_P=n_P, delta=order)
    found = policy.indices(simulate(ship, policy, duration=duration, **how), ship.L_pp)
    return {name: x.value if x.over_L is None else x.over_L for name, x in found.items()}


def flow(ship: Ship, u: float, v_m: float = 0.0, r: float = 0.0, n_P: float = 0.0, delta: float = 0.0) -> Flow:
    body: Any = ship.model.body  # type: ignore[attr-defined]
    return Flow(u, v_m, r, n_P, delta, 0.0, 0.0, body.rho, body.L_pp, body.d)


# 1: U and the drift angle at the centre of gravity, the equations of motion at midship


@dataclass(frozen=True, kw_only=True)
class AtGravity(Polynomial):
    """The slip: the hull's polynomial fed with the drift at the centre of gravity."""

    x_G: Scalar = spec("m", "centre of gravity ahead of midship")

    def force(self, flow: Flow) -> Force:
        return super().force(flow._replace(v_m=flow.v_m - flow.r * self.x_G))


def test_forces_and_equations_of_motion_have_one_origin() -> None:
    """shipmmg takes v at midship in the terms of x_G, but v - r x_G in U and beta: another turning circle.

    Forces do not know x_G, and the coupling terms do.  Fed as there, the hull turns KVLCC2 by more than the
    tolerance of the golden figures away from them, which the model itself meets.
    """
    ship = load("kvlcc2_l7")
    model: Any = ship.model
    assert model.body.x_G == pytest.approx(0.25)
    state, control = (0.0, 0.0, 0.0, 1.0, -0.15, 0.05), (11.85, 0.3)
    moved = replace(model, body=replace(model.body, x_G=0.0))
    at = flow(ship, 1.0, -0.15, 0.05, *control)
    assert moved.force(at) == model.force(at)
    assert abs(moved.derivative(state, control, CALM)[4] / model.derivative(state, control, CALM)[4] - 1) > 0.02
    given = {f.name: getattr(model.hull, f.name) for f in fields(Polynomial)}
    slip = replace(ship, model=replace(model, hull=AtGravity(**given, x_G=model.body.x_G)))
    golden, bar = GOLDEN["kvlcc2_l7"]["turn+35"]["advance_L"], GOLDEN["tolerance"]["ratio"]
    advance = [turn(s, GOLDEN["kvlcc2_l7"]["n_P"], 60.0)["advance"] for s in (ship, slip)]
    assert abs(advance[0] / golden - 1) < bar < abs(advance[1] / golden - 1)


@pytest.mark.parametrize("u", [1.0, -1.0])
def test_flow_straightening_is_that_of_its_side(u: float) -> None:
    """mmg of GitRepJo swaps gamma_R for beta_R < 0; drift to port is beta_R > 0 and has gamma_Rp, .640 of KVLCC2."""
    ship = load("kvlcc2_l7")
    rudder: Any = ship.model.rudder  # type: ignore[attr-defined]
    assert (rudder.gamma_Rp, rudder.gamma_Rn) == (0.640, 0.395)
    for v_m, used, other in ((-0.2, "gamma_Rp", "gamma_Rn"), (0.2, "gamma_Rn", "gamma_Rp")):
        at, race_ = flow(ship, u, v_m), Slipstream(0.6 * u, 0.3, 0.216)
        assert replace(rudder, **{other: 5.0}).force(at, race_) == rudder.force(at, race_)
        assert replace(rudder, **{used: 5.0}).force(at, race_) != rudder.force(at, race_)


# 2: a time step or tolerance that is wrong without a word


@pytest.mark.parametrize(("name", "duration"), [("kvlcc2_l7", 200.0), ("esso_osaka_3m", 250.0), ("kcs", 700.0)])
@pytest.mark.long
def test_default_step_is_exact_to_the_digits_of_the_indices(name: str, duration: float) -> None:
    """shipmmg at its default tolerance: advance 1.7 %, tactical diameter 2.8 % short of converged, silently.

    Here 0.1 % was the bar; the default step keeps 0.001 %, where Euler's method at that step would not.
    """
    ship = load(name)
    n_P, dt = approach(ship)[1], time_step(ship)
    default, fine = turn(ship, n_P, duration), turn(ship, n_P, duration, dt=dt / 8)
    assert default == pytest.approx(fine, rel=1e-5)
    euler = turn(ship, n_P, duration, method="euler")
    assert abs(euler["advance"] / fine["advance"] - 1) > 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["kvlcc2_l7", "kvlcc2", "esso_osaka_3m", "mariner"])
def test_zigzag_is_not_quantised_by_the_users_grid(name: str) -> None:
    """shipmmg reverses the rudder on the user's grid of times; the default step moves an overshoot by < 0.1 deg."""
    ship = load(name)
    policy = Zigzag(n_P=approach(ship)[1], delta=math.radians(20), psi=math.radians(20), side=1.0)
    duration, dt = 90.0 * ship.L_pp / ship.speed / 6.0, time_step(ship)
    runs = [simulate(ship, policy, duration=duration, dt=step) for step in (dt, dt / 8)]
    found = [policy.indices(run, ship.L_pp) for run in runs]
    default, fine = ({k: x.value for k, x in one.items() if "overshoot" in k} for one in found)
    assert len(default) >= 2
    assert default == pytest.approx(fine, abs=math.radians(0.1))


# 3: revolutions that do not belong to the speed


def test_approach_revolutions_hold_the_speed() -> None:
    """shipmmg tests KVLCC2 L7 at 17.95 1/s; 1.179 m/s goes with 11.85 1/s, and nothing there compares."""
    ship = load("kvlcc2_l7")
    U, n_P = approach(ship)
    assert U == 1.179
    assert n_P == pytest.approx(11.85, abs=0.005)
    assert abs(surge_balance(ship, U, n_P)) < 1e-9
    assert surge_balance(ship, U, 17.95) > 0.05 * U * U / ship.L_pp
    assert approach(ship, n_P=17.95)[0] > 1.4 * U
    assert turn(ship, 17.95, 60.0)["advance"] < 0.9 * turn(ship, n_P, 60.0)["advance"]


# 4: precedence in the wake; a drift angle by a quotient


class Misread(Propeller):
    """The slip: 1 - exp(-C_1 |beta_P|) (C_2 - 1) without the brackets about the difference."""

    def force(self, flow: Flow) -> tuple[Force, Slipstream]:
        beta_P = inflow_angle(flow, self.x_P)
        C_2 = where(beta_P < 0, self.C_2n, self.C_2p)
        u_P = (1.0 - self.w_P0) * (2.0 - exp(-self.C_1 * magnitude(beta_P)) * (C_2 - 1.0)) * flow.u
        return thrust(flow, self.t_P, self.D_P, u_P, race(flow.n_P, u_P, self.D_P, self.k_0, self.k_1, self.k_2))


@pytest.mark.slow
def test_wake_straight_ahead_is_that_of_straight_motion() -> None:
    """mmgdynamics: w_P = 0.09 for KVLCC2 straight ahead in place of 0.35, and a circle 11 % too small."""
    ship = load("kvlcc2")
    model: Any = ship.model
    slip: Any = Misread(**{f.name: getattr(model.propeller, f.name) for f in fields(Propeller)})
    wakes = [1.0 - p.force(flow(ship, 7.0, n_P=1.78))[1].u_P / 7.0 for p in (model.propeller, slip)]
    assert wakes == pytest.approx([0.35, 0.09], abs=1e-9)
    wrong = replace(ship, model=replace(model, propeller=slip))
    right, small = (turn(s, 1.71, 500.0, speed=15.5 * 0.5144)["advance"] for s in (ship, wrong))
    assert right == pytest.approx(3.02, abs=0.02)  # 2.69 with the slip, there and here
    assert small / right == pytest.approx(0.89, abs=0.03)


@every_ship
def test_sideways_and_astern_are_directions_like_any_other(name: str) -> None:
    """mmgdynamics divides by u = 0, and its atan(-v/u) jumps there from one side to the other.

    Drifting sideways every rate is finite, and those of sway and yaw pass through u = 0 without a step.
    """
    ship = load(name)
    if isinstance(ship.model, Sampled):
        pytest.skip("linear about its approach")
    own, rest = (0.0,) * (len(ship.model.states) - 6), straight(ship, 0.0)
    U, natural = ship.speed, ship.speed**2 / ship.L_pp * np.array([1.0, 1.0 / ship.L_pp])
    for v_m in (0.5 * U, -0.5 * U):
        for r in (0.0, 0.1 * U / ship.L_pp):
            rates = np.array([ship.model.derivative((0.0, 0.0, 0.0, u, v_m, r, *own), rest, CALM)
                              for u in (-1e-7 * U, 0.0, 1e-7 * U)], dtype=float)  # fmt: skip
            assert np.isfinite(rates).all()
            assert (np.ptp(rates[:, 4:6], axis=0) <= 1e-3 * natural).all()


def test_drift_opposes_itself_at_the_rudder_ahead_and_astern() -> None:
    """With the rudder amidships its force acts against the drift, whichever way the ship goes."""
    ship = load("kvlcc2_l7")
    rudder: Rudder = ship.model.rudder  # type: ignore[attr-defined]
    for u in (1.0, 0.0, -1.0):
        for v_m in (0.3, -0.3):
            assert rudder.force(flow(ship, u, v_m), Slipstream(0.6 * u, 0.3, 0.216)).Y * v_m < 0

"""Probes of parts, thrusters and controls, against the model's own rates and forces worked out by hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.actuators import Actuators
from seatrial.choosing import Finding
from seatrial.choosing.probing import Probe, findings
from seatrial.choosing.survey import _judged
from seatrial.environment import CALM, Environment
from seatrial.models import STATES, Model, kinematics
from seatrial.models.trim import Trim
from seatrial.ships import Ship
from seatrial.ships.files import load

U, L = 2.0, 50.0


def controlled(law: Callable[..., Any], follows: tuple[tuple[str, tuple[str, float]], ...]) -> Probe:
    """A ship whose rates are law(u, v, r, control, around), without dimension, and whose controls obey as given."""

    @dataclass(frozen=True)
    class Toy(Model):
        @property
        def controls(self) -> Any:
            return tuple(name for name, _ in follows)

        @property
        def follows(self) -> Any:
            return tuple(order for _, order in follows)

        def derivative(self, state: Any, control: Any, environment: Any) -> Any:
            _, _, psi, u, v, r = state[:6]
            X, Y, N = law(u / U, v / U, r * L / U, control, environment)
            return (*kinematics(psi, u, v, r), X * U * U / L, Y * U * U / L, N * U * U / L / L)

    ship = Ship("toy", Toy(), Actuators(), L_pp=L, speed=U)
    orders = {"n_P": 1.5, "delta": 0.0}
    return Probe(ship, Trim(STATES, (0.0, 0.0, 0.0, U, 0.0, 0.0), (1.5, 0.0), CALM, orders, 0.0))


USUAL = (("n_P", ("n_P", 1.0)), ("delta", ("delta", 1.0)))


@pytest.mark.parametrize(
    ("more", "answer"),
    [((), "no"), ((("n_bow", ("", 0.0)),), "no"), ((("n_bow", ("", 0.0)), ("n_stern", ("", 0.0))), "yes")],
)
def test_several_drives_are_controls_of_their_own(more: Any, answer: str) -> None:
    """One thruster beside propeller and rudder is a side thruster; two are drives."""
    found = findings(controlled(lambda u, v, r, c, e: (0.0 * u, 0.0 * u, 0.0 * u), USUAL + more))
    assert found["several_drives"].answer == answer
    assert found["side_thrusters"].answer == "no"


def test_two_propellers_of_one_order_are_several_drives() -> None:
    twin = (("n_P_1", ("n_P", 1.0)), ("n_P_2", ("n_P", 1.0)), ("delta", ("delta", 1.0)))
    found = findings(controlled(lambda u, v, r, c, e: (0.0 * u,) * 3, twin))["several_drives"]
    assert found.answer == "yes"
    assert "n_P_1, n_P_2, delta" in found.how


def test_no_thruster_runs_unless_it_is_asked_for() -> None:
    """The control called n_probe is the tunnel that a probe fits: nothing in a straight run, its order else."""
    given = (*USUAL, ("n_probe", ("n_probe", 1.0)))
    probe = controlled(lambda u, v, r, c, e: (c[2], 0.0 * u, 0.0 * u), given)
    assert probe.control(1.0, 0.0) == (1.5, 0.0, 0.0)
    assert probe.control(1.0, 0.0, 20.0)[2] == 20.0
    assert probe.rates() == (0.0, 0.0, 0.0)
    assert probe.rates(tunnel=20.0)[0] == 20.0


def test_rates_are_those_of_a_straight_run_unless_something_else_is_asked_for() -> None:
    seen: list[Any] = []

    def law(u: Any, v: Any, r: Any, c: Any, e: Any) -> Any:
        seen.append((u, v, r, *c, *e))
        return 0.1 * u, 0.2 * u, 0.3 * u

    probe = controlled(law, USUAL)
    assert probe.rates() == pytest.approx((0.1, 0.2, 0.3))
    assert seen[-1] == pytest.approx((1.0, 0.0, 0.0, 1.5, 0.0, *CALM))
    probe.rates(u=0.5, v_m=-0.2, r=0.7, n=2.0, delta=0.1, environment=Environment(wind_x=3.0))
    assert seen[-1] == pytest.approx((0.5, -0.2, 0.7, 3.0, 0.1, *Environment(wind_x=3.0)))


def test_surroundings_are_tried_at_a_fresh_wind_and_a_weak_current() -> None:
    met: list[Environment] = []

    def law(u: Any, v: Any, r: Any, c: Any, e: Any) -> Any:
        met.extend([e] if isinstance(u, float) else [])
        return (0.0 * u,) * 3

    findings(controlled(law, USUAL))
    for name, size in (("wind_x", 5.0), ("wind_y", 5.0), ("current_x", 0.1), ("current_y", 0.1)):
        assert {getattr(e, name) for e in met} == {0.0, size}, name


def test_a_kink_between_the_orders_that_are_tried_is_told_by_its_size() -> None:
    """Twice the change of revolutions by a half goes beyond 1.6 of them: .4 more than twice the change once."""
    kinked = controlled(lambda u, v, r, c, e: (abs(c[0] / 1.5 - 1.6) + c[0] / 1.5 - 1.6, 0.0 * u, 0.0 * u)
                        if isinstance(u, float) else (0.0 * u, 0.0 * u, 0.0 * u), USUAL)  # fmt: skip
    found = findings(kinked)["input_affine"]
    assert found.answer == "no"
    assert found.how.endswith("up to 0.8")


@pytest.mark.slow
def test_a_tunnel_turns_the_ship_by_its_thrust_at_its_place_and_less_under_way() -> None:
    """T = K_T rho n^2 D^4 at .4 L ahead: by the mass matrix of the body at rest; at U by the jet that bends."""
    ship = load("kvlcc2_l7")
    model: Any = ship.model
    x, D, K_T, n = 0.4 * ship.L_pp, 0.01 * ship.L_pp, 0.4, 20.0
    T = K_T * model.body.rho * n**2 * D**4
    b = model.body
    M = np.array([[b.m + b.m_y, b.x_G * b.m], [b.x_G * b.m, b.I_zG + b.x_G**2 * b.m + b.J_z]], dtype=float)
    bent = math.exp(-(ship.speed**2) * model.body.rho * 0.25 * math.pi * D**2 / T)
    scale = (ship.L_pp / ship.speed) ** 2
    told = [float(np.linalg.solve(M, [share * T, share * T * x])[1]) * scale for share in (1.0, bent)]
    found = findings(Probe.of(ship))["side_thrusters"]
    assert found.answer == "part"
    assert found.how == f"{ship.name}: yaw acceleration {told[0]:.2g} at rest, {told[1]:.2g} at U"


@pytest.mark.slow
def test_a_tunnel_that_is_there_is_a_yes_and_parts_that_are_apart_are_named() -> None:
    assert findings(Probe.of(load("esso_osaka_3m_harbour")))["side_thrusters"].answer == "yes"
    said = {name: findings(Probe.of(load(name)))["design_changes"] for name in ("kvlcc2_l7", "cybership2", "mariner")}
    assert {name: one.answer for name, one in said.items()} == {
        "kvlcc2_l7": "yes", "cybership2": "partly", "mariner": "no"}  # fmt: skip
    assert said["cybership2"].how.endswith("apart: damping, inertia, propeller, rudder")
    assert said["mariner"].how.endswith("one whole")


@pytest.mark.slow
def test_a_part_that_could_be_added_is_a_part() -> None:
    """A ship with places for wind and waves but none fitted; one without such places; a hull for shallow water."""
    bare = findings(Probe.of(load("kvlcc2_l7")))
    assert {key: bare[key].answer for key in ("wind", "waves", "current")} == {
        "wind": "part", "waves": "part", "current": "yes"}  # fmt: skip
    whole = findings(Probe.of(load("kvlcc2")))
    assert whole["wind"].answer == whole["waves"].answer == "yes"
    none = findings(Probe.of(load("mariner_nomoto")))
    assert {none[key].answer for key in ("wind", "waves", "shallow")} == {"no"}


@pytest.mark.parametrize(("measured", "declared", "answer"), [
    ((), None, "no"), (("part",), None, "part"), (("no", "yes", "part"), None, "yes"), ((), "part", "part"),
    (("yes",), "part", "part"), (("no",), "yes", "no"), (("no", "part"), "part", "part"),
])  # fmt: skip
def test_a_family_is_the_best_of_its_ships_and_no_better_than_is_declared(
    measured: tuple[str, ...], declared: str | None, answer: str
) -> None:
    family: Any = SimpleNamespace(declared={} if declared is None else {"wind": Finding(declared, "declared")})
    found = _judged(family, "wind", [Finding(one, f"ship {k}") for k, one in enumerate(measured)])
    assert found.answer == answer
    if not measured and declared is None:
        assert found.how == "neither measured nor declared"

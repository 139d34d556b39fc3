"""Probes of ships whose rates are written down: every answer and every number that it names follows by hand."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import pytest

from seatrial.actuators import Actuators
from seatrial.choosing.probing import Probe, findings, outputs
from seatrial.environment import CALM, Environment
from seatrial.models import STATES, Model, kinematics
from seatrial.models.trim import Trim
from seatrial.ships import Ship
from seatrial.ships.files import load

U, L, N_P, HELM = 2.0, 50.0, 1.5, 0.03
Law = Callable[..., tuple[float, float, float]]


def toy(law: Law, own: tuple[str, ...] = STATES) -> Probe:
    """A ship whose rates are law(u, v, r, n, delta, around), all of it without dimension, about a helm off midship."""

    @dataclass(frozen=True)
    class Toy(Model):
        states = own

        def derivative(self, state: Any, control: Any, environment: Any) -> Any:
            _, _, psi, u, v, r = state[:6]
            turn = r * L / U
            X, Y, N = law(u / U, v / U, turn, control[0] / N_P, control[1] - HELM, environment)
            more = [X] * (len(own) - 6)
            return (*kinematics(psi, u, v, r), X * U * U / L, Y * U * U / L, N * U * U / L / L, *more)

    ship = Ship("toy", Toy(), Actuators(), L_pp=L, speed=U)
    state = (0.0, 0.0, 0.0, U, 0.0, 0.0)
    return Probe(ship, Trim(STATES, state, (N_P, HELM), CALM, {"n_P": N_P, "delta": HELM}, 0.0))


def steered(N: Callable[..., Any]) -> Law:
    return lambda *x: (0.0 * x[0], 0.0 * x[0], N(*x))


def swayed(Y: Callable[..., Any]) -> Law:
    return lambda *x: (0.0 * x[0], Y(*x), 0.0 * x[0])


def surged(X: Callable[..., Any]) -> Law:
    return lambda *x: (X(*x), 0.0 * x[0], 0.0 * x[0])


CASES: list[tuple[str, Law, str, str]] = [
    ("turns", steered(lambda u, v, r, n, d, e: d), "yes", "acceleration 0.2 by"),
    ("turns", steered(lambda u, v, r, n, d, e: -d), "no", "acceleration -0.2 by"),
    ("turns", steered(lambda u, v, r, n, d, e: 1.0), "no", "acceleration 0 by"),
    ("drift", swayed(lambda u, v, r, n, d, e: -d), "yes", "up to 0.2 in"),
    ("drift", swayed(lambda u, v, r, n, d, e: -0.5 * r + 1.0), "yes", "up to 0.2 in"),
    ("drift", swayed(lambda u, v, r, n, d, e: 1.0 - v), "no", "up to 0 in"),
    ("speed_loss", surged(lambda u, v, r, n, d, e: 1.0 - v * v), "yes", "acceleration -0.022 in"),
    ("speed_loss", surged(lambda u, v, r, n, d, e: 1.0 - r * r), "yes", "acceleration -0.16 in"),
    ("speed_loss", surged(lambda u, v, r, n, d, e: 1.0 - d * d), "yes", "acceleration -0.16 in"),
    ("speed_loss", surged(lambda u, v, r, n, d, e: v * r), "yes", "acceleration -0.06 in"),
    ("speed_loss", surged(lambda u, v, r, n, d, e: -d), "no", "acceleration 0.4 in"),
    ("speed_loss", surged(lambda u, v, r, n, d, e: d), "no", "acceleration 0.4 in"),
    ("resistance", lambda u, v, r, n, d, e: (n - u, -v, -r), "yes", "damped: surge, sway, yaw"),
    ("resistance", lambda u, v, r, n, d, e: (n - u, v, -r), "no", "damped: surge, yaw"),
    ("resistance", lambda u, v, r, n, d, e: (u, -v, r), "no", "damped: sway"),
    ("resistance", lambda u, v, r, n, d, e: (n, v * v, r * r), "no", "damped: nothing"),
    ("revolutions", surged(lambda u, v, r, n, d, e: n - 1.0), "yes", "acceleration 0.2 by"),
    ("revolutions", surged(lambda u, v, r, n, d, e: 3.0 - n), "no", "acceleration -0.2 by"),
    ("revolutions", surged(lambda u, v, r, n, d, e: 1.0), "no", "acceleration 0 by"),
    ("steering_speed", steered(lambda u, v, r, n, d, e: u * d + n), "yes", "effect 0.1 at U/2, 0.2 at U"),
    ("steering_speed", steered(lambda u, v, r, n, d, e: n * d + u), "no", "effect 0.2 at U/2, 0.2 at U"),
    ("steering_revolutions", steered(lambda u, v, r, n, d, e: n * d), "yes", "effect 0.2, 0.3 at 1.5"),
    ("steering_revolutions", steered(lambda u, v, r, n, d, e: u * d + n), "no", "effect 0.2, 0.2 at 1.5"),
    ("reversing", surged(lambda u, v, r, n, d, e: u + n), "yes", "acceleration -0.5 by"),
    ("reversing", surged(lambda u, v, r, n, d, e: u * n), "yes", "acceleration -0.15 by"),
    ("reversing", surged(lambda u, v, r, n, d, e: n * n), "no", "acceleration 0.25 by"),
    ("reversing", surged(lambda u, v, r, n, d, e: -u), "no", "acceleration 0 by"),
    ("reversing_turns", swayed(lambda u, v, r, n, d, e: n + u), "yes", "acceleration 0.7 by"),
    ("reversing_turns", steered(lambda u, v, r, n, d, e: n * u), "yes", "acceleration 0.21 by"),
    ("reversing_turns", surged(lambda u, v, r, n, d, e: n), "no", "acceleration 0 by"),
    ("linear", lambda u, v, r, n, d, e: (2.0, 1 - v + d, 3 - r + d), "yes", ""),
    ("linear", swayed(lambda u, v, r, n, d, e: 1.0 + v * v), "no", "up to 0.08"),
    ("linear", steered(lambda u, v, r, n, d, e: 1.0 + r * r), "no", "up to 0.5"),
    ("linear", surged(lambda u, v, r, n, d, e: 1.0 - d * d), "no", "up to 0.32"),
    ("linear", steered(lambda u, v, r, n, d, e: r**3), "no", "up to 0.75"),
    ("linear", steered(lambda u, v, r, n, d, e: v**3), "no", "up to 0.048"),
    ("linear", steered(lambda u, v, r, n, d, e: v * r * d), "no", "up to 0.24"),
    ("input_affine", lambda u, v, r, n, d, e: (n * u, v**3 + d, r * r * d), "yes", "up to"),
    ("input_affine", surged(lambda u, v, r, n, d, e: u * n * n), "no", "up to 4.5"),
    ("input_affine", steered(lambda u, v, r, n, d, e: d * d), "no", "up to 0.32"),
    ("input_affine", steered(lambda u, v, r, n, d, e: n * d), "no", "up to 0.9"),
    ("input_affine", swayed(lambda u, v, r, n, d, e: v * n * n), "no", "up to 0.45"),
    ("input_affine", swayed(lambda u, v, r, n, d, e: r * n * n), "no", "up to 0.9"),
    ("at_rest", lambda u, v, r, n, d, e: (-u, -v, -r), "yes", "silent; dies out: surge, sway, yaw"),
    ("at_rest", lambda u, v, r, n, d, e: (-u, v, -r), "partly", "silent; dies out: surge, yaw"),
    ("at_rest", lambda u, v, r, n, d, e: (u, v * v, abs(r)), "no", "silent; dies out: nothing"),
    ("at_rest", lambda u, v, r, n, d, e: (-u - 1.0, -v, -r), "no", "not silent; dies out: surge, sway, yaw"),
    ("at_rest", lambda u, v, r, n, d, e: (1.0 - u, -v, -r), "no", "not silent; dies out: sway, yaw"),
    ("large_drift", lambda u, v, r, n, d, e: (-u, -v, -r), "yes", "opposed: sideways, on the spot, astern"),
    ("large_drift", lambda u, v, r, n, d, e: (-u, -v + 8 * v**3, -r), "partly", "opposed: on the spot, astern"),
    ("large_drift", lambda u, v, r, n, d, e: (-u, -v, -r + 2 * r**3), "partly", "opposed: sideways, astern"),
    ("large_drift", lambda u, v, r, n, d, e: (-u + 8 * u**3, -v, -r), "partly", "opposed: sideways, on the spot"),
    ("large_drift", lambda u, v, r, n, d, e: (0.0, 0.0, 0.0), "no", "opposed: nothing"),
]  # fmt: skip


@pytest.mark.parametrize(("key", "law", "answer", "number"), CASES, ids=lambda x: x if isinstance(x, str) else "")
def test_an_answer_and_its_number_follow_from_the_law(key: str, law: Law, answer: str, number: str) -> None:
    found = findings(toy(law))[key]
    assert found.answer == answer, found.how
    assert number in found.how


@pytest.mark.parametrize("k", range(5))
def test_states_without_an_answer_are_counted_on_the_whole_grid(k: int) -> None:
    grid = list(itertools.product((0.0, 1.0, -0.5), (0.0, 0.5, -1.0), (0.0, 2.0), (0.0, 1.0, -1.0), (0.0, 0.6)))
    for value in {x[k] for x in grid}:

        def law(*x: Any, value: float = value) -> Any:
            here = not isinstance(x[k], float) or not math.isclose(x[k], value, abs_tol=1e-9)
            return (1.0, 0.0, 0.0) if here else (math.nan, 0.0, 0.0)

        wrong = sum(x[k] == value for x in grid)
        found = findings(toy(law))["plausible"]
        assert found.answer == "no"
        assert found.how.startswith(f"toy: {wrong} of {len(grid)} ")


@pytest.mark.parametrize(("growth", "answer"), [(0.5, True), (-0.5, False)])
def test_a_straight_course_is_unstable_where_a_turn_grows(growth: float, answer: bool) -> None:
    found = findings(toy(lambda u, v, r, n, d, e: (n - u, -v, growth * r + d)))
    assert ("unstable_hull" in found) == answer
    if answer:
        assert found["unstable_hull"].how.removeprefix("toy: ")


@pytest.mark.parametrize(
    ("channel", "key"),
    [("wind_x", "wind"), ("wind_y", "wind"), ("current_x", "current"), ("current_y", "current"),
     ("wave_x", "waves"), ("wave_y", "waves"), ("per_depth", "shallow")],
)  # fmt: skip
@pytest.mark.parametrize("rate", range(3))
def test_each_surrounding_is_felt_by_itself_in_each_rate(channel: str, key: str, rate: int) -> None:
    def law(u: float, v: float, r: float, n: float, d: float, e: Environment) -> Any:
        return tuple(getattr(e, channel) * (k == rate) for k in range(3))

    found = findings(toy(law))
    felt = {name for name in ("wind", "current", "waves", "shallow") if found[name].answer == "yes"}
    assert felt == {key}
    assert all(found[name].answer == "no" for name in {"wind", "current", "waves", "shallow"} - felt)


@pytest.mark.parametrize("name", ["v", "r"])
def test_surroundings_are_felt_by_a_ship_that_they_reach_only_in_a_turn(name: str) -> None:
    """Shallow water changes the forces of drift and of turning: a ship on a straight course would not show it."""

    def law(u: float, v: float, r: float, n: float, d: float, e: Environment) -> Any:
        return 0.0, 0.0, e.per_depth * (v if name == "v" else r)

    assert findings(toy(law))["shallow"].answer == "yes"


def test_shallow_water_is_twice_the_draught_and_waves_are_a_hundredth_of_the_length() -> None:
    met: list[Environment] = []

    def law(u: float, v: float, r: float, n: float, d: float, e: Environment) -> Any:
        met.extend([e] if isinstance(u, float) else [])  # symbols of the linearised ship have no size
        return 0.0, 0.0, 0.0

    findings(toy(law))
    assert max(e.per_depth for e in met) == pytest.approx(0.5 / (0.05 * L))  # a draught of L/20, as none is known
    assert max(e.wave_x for e in met) == pytest.approx(0.01 * L)
    assert max(e.wave_y for e in met) == pytest.approx(0.01 * L)
    assert max(e.wave_T for e in met) == pytest.approx(2.0 * math.sqrt(L))


def test_outputs_are_the_velocities_that_move_and_the_own_states() -> None:
    assert outputs(toy(lambda u, v, r, n, d, e: (0.0, 0.0, d))) == ("r",)
    assert outputs(toy(lambda u, v, r, n, d, e: (n - u, v * r, 0.0))) == ("u", "v_m")
    assert outputs(toy(lambda u, v, r, n, d, e: (0.0, v, 0.0), (*STATES, "lead"))) == ("v_m", "lead")


@pytest.mark.parametrize(
    ("validity", "key", "answer"),
    [
        ({"u": (0.0, 9.0)}, "large_drift", "no"), ({"u": (0.1, 9.0)}, "large_drift", "no"),
        ({"u": (-0.1, 9.0)}, "large_drift", "yes"), ({}, "large_drift", "yes"),
        ({"u": (0.1, 9.0)}, "at_rest", "partly"), ({"u": (0.0, 9.0)}, "at_rest", "yes"),
        ({"n_P": (0.0, 9.0)}, "reversing", "no"), ({"n_P": (0.0, 9.0)}, "reversing_turns", "no"),
        ({"n_P": (-0.1, 9.0)}, "reversing", "yes"), ({"n_P": (-0.1, 9.0)}, "reversing_turns", "yes"),
        ({"delta": (0.0, 0.6)}, "reversing", "yes"),
    ],
)  # fmt: skip
def test_what_the_file_holds_for_outside_is_no_ability(validity: Any, key: str, answer: str) -> None:
    able = toy(lambda u, v, r, n, d, e: (n - u, -v, n * 0.1 - r))
    ship = replace(able.ship, validity=validity)
    assert findings(replace(able, ship=ship))[key].answer == answer


@pytest.mark.slow
def test_a_turn_rolls_a_ship_as_its_rate_of_p_says() -> None:
    """The roll acceleration in a turn, against the model's own derivative in that motion."""
    ship = load("container_son_nomoto")
    probe = Probe.of(ship)
    orders = (probe.at.orders["n_P"], probe.at.orders.get("delta", 0.0))
    rolled = [
        ship.model.derivative(
            (0.0, 0.0, 0.4, ship.speed, v * ship.speed, r * ship.speed / ship.L_pp, 0.0, 0.0), orders, CALM
        )[7]
        for v, r in ((0.0, 0.0), (-0.1, 0.4))
    ]
    change = (rolled[1] - rolled[0]) * (ship.L_pp / ship.speed) ** 2
    found = findings(probe)["heel"]
    assert found.answer == "yes"
    assert f"roll acceleration {change:.2g} in a turn" in found.how


def test_a_ship_without_revolutions_is_probed_at_one_a_second() -> None:
    plain = toy(lambda *x: (0.0, 0.0, 0.0))
    probe = replace(plain, at=replace(plain.at, orders={"delta": 0.1}))
    assert probe.control(2.0, 0.3) == pytest.approx((2.0, 0.4))
    assert plain.control(2.0, 0.3) == pytest.approx((2.0 * N_P, 0.3 + HELM))

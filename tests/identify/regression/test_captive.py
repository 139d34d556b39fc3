"""Captive tests: a free ship is a captive test without load, and coefficients come back from tables with noise."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import read, values
from seatrial.data import DataError
from seatrial.data.captive import LOADS, Captive
from seatrial.environment import CALM
from seatrial.forces import Flow
from seatrial.identify.regression.captive import CaptiveFit, fit_captive, open_water, priors
from seatrial.ships import Ship, ShipError
from seatrial.ships.files import load, save
from seatrial.study.freedom import freedom, stated

KVLCC2, MARINER, MODIFIED = (load(name) for name in ("kvlcc2_l7", "mariner", "modified_abkowitz_kvlcc2_l7"))
RAD = math.pi / 180.0


def loads_of(ship: Ship, rows: np.ndarray, included: bool) -> dict[str, np.ndarray]:
    """What the gauges read in these motions; with the model's own inertia where `included`."""
    known = values(ship.model)
    rho, L = float(known.get("body.rho", 1000.0)), ship.L_pp
    body: Any = ship.model.body
    if hasattr(body, "I_zG"):
        m, x_G, inertia = body.m, body.x_G, body.I_zG + body.m * body.x_G**2
    else:
        m, x_G, inertia = 0.5 * rho * L**3 * body.m, L * body.x_G, 0.5 * rho * L**5 * body.I_z
    found = []
    for u, v, r, n, delta, du, dv, dr in rows:
        one = ship.model.loads(Flow(u, v, r, n, delta, u, v, rho, L, float(ship.model.draught)), (du, dv, dr))
        own = (m * (du - v * r - x_G * r * r), m * (dv + u * r + x_G * dr), inertia * dr + m * x_G * (dv + u * r))
        found.append([a - included * b for a, b in itertools.zip_longest(one, own, fillvalue=0.0) if a is not None])
    return dict(zip(LOADS, np.array(found).T, strict=False))


def program(U: float, n: float, *, turn: bool = True, forced: bool = True) -> np.ndarray:
    """Drift, rudder, circular motion, other loads and forced sway and yaw, as Sawada 2024 (5.3) lists them."""
    tests = [(U, b, 0.0, d) for b in range(-20, 21, 5) for d in (0, -15, 15) if d == 0 or b % 10 == 0]
    tests += [(speed, 0, 0.0, d) for speed in (U, 0.7 * U, 0.4 * U) for d in range(-30, 31, 10)]
    tests += [(U, b, r, d) for b in (-10, 0, 10) for r in (-0.8, -0.4, 0.4, 0.8) for d in (0, -15, 15)] if turn else []
    rows = [(s * math.cos(b * RAD), -s * math.sin(b * RAD), r * s / 7.0, n, d * RAD, 0, 0, 0) for s, b, r, d in tests]
    if forced:
        for t in np.linspace(0.0, 2 * math.pi, 12, endpoint=False):
            c, s = 0.1 * math.cos(t), 0.1 * math.sin(t)
            rows += [(U, c, 0.0, n, 0.0, 0.0, -0.5 * s, 0.0), (U, 0.0, c, n, 0.0, 0.0, 0.0, -0.5 * s),
                     (U + c, 0.0, 0.0, n, 0.0, -0.5 * s, 0.0, 0.0)]  # fmt: skip
    return np.array(rows)


def table(
    ship: Ship, rows: np.ndarray, noise: float = 0.0, seed: int = 0, included: bool = False
) -> Captive:
    """A table of captive tests; `noise` is relative to the largest load of its kind."""
    rng = np.random.default_rng(seed)
    measured = {name: y + noise * np.abs(y).max() * rng.standard_normal(y.size)
                for name, y in loads_of(ship, rows, included).items()}  # fmt: skip
    rho = float(values(ship.model).get("body.rho", 1000.0))
    return Captive("tank", rows, measured, ship.L_pp, rho, "included" if included else "removed")


def off(ship: Ship, by: float, paths: Sequence[str]) -> Ship:
    """The ship with these numbers off, one up, one down."""
    return ship.having({path: float(read(ship.model, path)) * (1.0 + by * (-1) ** k) for k, path in enumerate(paths)})


def apart(found: CaptiveFit, truth: Ship) -> np.ndarray:
    """Errors of the fit over sigma."""
    return (found.values - [read(truth.model, path) for path in found.paths]) / found.sigma


@pytest.mark.parametrize("ship", [KVLCC2, MARINER, MODIFIED, load("suzaku")], ids=lambda s: s.name)
def test_a_ship_that_moves_freely_needs_no_carriage(ship: Ship) -> None:
    """At the rates of its own equation of motion the gauges read nothing once the inertia of the model is in."""
    U = ship.speed
    for v, r, delta in ((0.0, 0.0, 0.2), (-0.2 * U, 0.3 * U / ship.L_pp, 0.3), (0.1 * U, -0.5 * U / ship.L_pp, -0.4)):
        n = 1.2 * U / ship.L_pp
        rates = ship.model.derivative((0.0, 0.0, 0.0, U, v, r), (n, delta), CALM)[3:]
        row = np.array([[U, v, r, n, delta, *map(float, rates)]])
        whole, part = loads_of(ship, row, True), loads_of(ship, row, False)
        assert all(abs(whole[name][0]) < 1e-8 * max(abs(part[name][0]), 1.0) for name in ("X", "Y", "N"))


SEEDS = (0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 6)))


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_coefficients_come_back_within_what_sigma_says(seed: int) -> None:
    """All coefficients of a whole program, from 20 % off: white noise of .5 % of the largest load."""
    rows = program(1.18, 10.3)
    begun = off(KVLCC2, 0.2, [path for path in values(KVLCC2.model) if path.startswith(("hull.", "rudder.gamma"))])
    found = fit_captive(begun, table(KVLCC2, rows, 0.005, seed))
    assert not found.held
    z = apart(found, KVLCC2)
    assert np.abs(z).max() < 4.0
    assert 0.4 < np.sqrt(np.mean(np.square(z))) < 1.3
    status = {v.subject: v.status for v in found.verdicts}
    wanted = ("hull.Y_v", "hull.N_r", "rudder.a_H", "body.m_y", "propeller.t_P")
    assert {status[path] for path in wanted} == {"identified"}
    assert found.explained["Y"] > 0.999


@pytest.mark.slow
def test_without_noise_the_numbers_are_exact_at_any_scale_and_with_the_inertia_in() -> None:
    """A geosim of 3 m in sea water gives the primes of the model of 7 m."""
    from seatrial.ships.scaling import scale

    small = scale(KVLCC2, 3.0, rho=1025.0, effects=False).ship
    root = math.sqrt(3.0 / 7.0)
    rows = program(1.18, 10.3) * [root, root, 1 / root, 1 / root, 1.0, 1.0, 1.0, 7.0 / 3.0]
    paths = ("hull.Y_v", "hull.N_r", "rudder.epsilon", "body.m_y", "propeller.w_P0", "hull.R_0")
    found = fit_captive(off(KVLCC2, 0.15, paths), table(small, rows, included=True))
    truth = np.array([read(KVLCC2.model, path) for path in found.paths])
    assert np.abs(found.values / truth - 1.0).max() < 1e-6


@pytest.mark.slow
def test_what_the_runs_are_insensitive_to_is_held_and_says_which_test_would_determine_it() -> None:
    found = fit_captive(KVLCC2, table(KVLCC2, program(1.18, 10.3, turn=False, forced=False), 0.002))
    assert {"hull.N_r", "hull.Y_vrr", "rudder.l_R", "body.m_y"} <= set(found.held)
    assert "circular motion" in found.held["hull.N_r"]
    assert "PMM in sway" in found.held["body.m_y"]
    assert read(found.ship.model, "hull.N_r") == read(KVLCC2.model, "hull.N_r")
    assert not {"hull.N_r", "hull.Y_v"} - {v.subject for v in found.verdicts}
    by = found.determined_by
    assert "rudder (other load)" in by["rudder.kappa"]
    assert set(by["rudder.gamma_Rp"]) & {"drift", "drift + rudder"}
    assert all("drift" in kind for kind in by["hull.Y_vvv"])


@pytest.mark.slow
def test_steady_tests_leave_added_mass_to_the_ship_file() -> None:
    """In a circle m_x u r acts as Y_r does, so that only a forced motion separates them (Sawada 2024, 5.3)."""
    found = fit_captive(KVLCC2, table(KVLCC2, program(1.18, 10.3, forced=False), 0.005))
    assert found.held.keys() == {"body.m_x", "body.m_y", "body.J_z"}
    sigma = dict(zip(found.paths, found.sigma, strict=True))
    assert sigma["hull.Y_r"] < 0.005
    assert sigma["hull.X_vr"] < 0.01


@pytest.mark.slow
def test_two_numbers_that_only_act_together_are_not_both_fitted() -> None:
    runs = table(KVLCC2, program(1.18, 10.3))
    found = fit_captive(KVLCC2, runs, ("rudder.A_R", "rudder.f_alpha"))
    assert found.paths == ("rudder.A_R",)
    assert "only in combination" in found.held["rudder.f_alpha"]


def test_sigma_knows_that_the_terms_are_an_approximation() -> None:
    """A hull with a term that the model lacks: neighbouring runs err alike, and sigma must cover the number at rest."""
    rows = program(1.18, 10.3, turn=False, forced=False)
    runs = table(KVLCC2, rows, 0.0005, 3)
    beta = runs.beta
    bent = runs.loads["Y"] - 200.0 * beta**3 * np.abs(beta) ** 2 * 50.0
    found = fit_captive(KVLCC2, replace(runs, loads={**runs.loads, "Y": bent}), ("hull.Y_*",))
    k = found.paths.index("hull.Y_v")
    assert abs(found.values[k] + 0.315) > 0.003  # it is off
    assert abs(found.values[k] + 0.315) < 4.0 * found.sigma[k]


@pytest.mark.slow
@pytest.mark.parametrize("ship", [MARINER, MODIFIED], ids=lambda s: s.name)
def test_whole_ship_models_come_back_exactly(ship: Ship) -> None:
    U, L = ship.speed, ship.L_pp
    rows = program(1.0, 10.0) * [U, U, U * 7.0 / L, 1.0, 1.0, U * U * 7 / L, U * U * 7 / L, (U * 7.0 / L) ** 2]
    names = [path for path, value in values(ship.model).items() if path.startswith("derivatives.") and value]
    found = fit_captive(off(ship, 0.3, [n for n in names if n[-3:] not in ("C_R", ".S")]), table(ship, rows))
    a, b = (loads_of(one, rows, False)["N"] for one in (ship, found.ship))
    assert np.abs(a - b).max() < 1e-7 * np.abs(a).max()
    for path in ("derivatives.Y_v", "derivatives.N_r", "derivatives.N_d"):
        assert read(found.ship.model, path) == pytest.approx(read(ship.model, path), rel=1e-5)


@pytest.mark.slow
def test_the_sigma_of_the_tests_is_the_prior_of_a_study(tmp_path: Path) -> None:
    found = fit_captive(KVLCC2, table(KVLCC2, program(1.18, 10.3, turn=False, forced=False), 0.005))
    ship = load(save(found.ship, tmp_path / "tested.toml"))
    assert values(ship.model) == pytest.approx(values(found.ship.model), rel=1e-15)
    sigmas = dict(zip(found.paths, found.sigma, strict=True))
    assert priors(ship) == stated(ship) == pytest.approx(sigmas)
    (one, other), fixed = freedom(ship.model, {"hull.Y_v": {}, "hull.N_r": {"prior": 0.3}}, stated(ship))
    assert (one.sigma, other.sigma) == (pytest.approx(sigmas["hull.Y_v"]), pytest.approx(0.3 * 0.049))
    assert not fixed


def test_thrust_coefficients_of_an_open_water_test() -> None:
    J = np.linspace(0.0, 0.8, 9)
    found = open_water(J, 0.3 - 0.25 * J - 0.14 * J**2)
    assert list(found.values()) == pytest.approx([0.3, -0.25, -0.14])
    with pytest.raises(DataError, match="three at least"):
        open_water(J[:2], J[:2])


def test_what_cannot_be_fitted_is_refused() -> None:
    runs = table(KVLCC2, program(1.0, 9.0, turn=False, forced=False))
    thrust = replace(runs, loads={"T": runs.loads["T"]})
    for ship, some, said in (
        (load("mariner_nomoto"), runs, "has no forces that a captive test measures"),
        (KVLCC2, runs.kept(np.arange(len(runs)) < 1), "measured loads for"),
        (MARINER, thrust, "does not determine anything of"),
    ):  # fmt: skip
        with pytest.raises((DataError, ShipError), match=said):
            fit_captive(ship, some)

"""The programs that ours is compared with sail the same ship in the same way, and times are divided by what ran.

The independent simulator of the garden has the same 7 m KVLCC2; stand-ins have the signatures of the peers and
equations of their own.  What is measured is replaced: the clock by a list, the shortest run by a number.
"""

from __future__ import annotations

import math
import os
import re
import sys
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import count, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import seatrial.bench as room
from garden.ships import MODEL, Mmg
from seatrial.bench import PEERS, Row, fossen, shipmmg, timing, turn
from seatrial.engine import SimulationError
from seatrial.environment import CALM
from seatrial.ships.files import load
from seatrial.simulate.approach import approach


class Watch:
    """In place of `best`: runs the job once, keeps what it gives, and says the next of a list of times."""

    def __init__(self, *seconds: float) -> None:
        self.seconds, self.given = iter(seconds), []

    def __call__(self, job: Callable[[], Any], *_: float) -> float:
        self.given.append(job())
        return next(self.seconds)


def sailed(ship: Mmg, duration: float, delta: float = turn.DELTA, n: float = turn.N_P) -> Callable[[Any], Any]:
    """x, y, psi, u, v, r of an independent ship by time, from its speed straight ahead."""

    def rates(_: float, z: Any) -> list[float]:
        _, _, psi, u, v, r = z
        over = (u + 1j * v) * np.exp(1j * psi)
        return [over.real, over.imag, r, *ship.rates(u, v, r, (n, delta), (0.0, 0.0))]

    return solve_ivp(rates, (0.0, duration), [0, 0, 0, ship.speed, 0, 0], rtol=1e-9, atol=1e-10, dense_output=True).sol


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A turn of 20 s by four lanes."""
    monkeypatch.setattr(turn, "DURATION", 20.0)
    monkeypatch.setattr(turn, "LANES", 4)
    turn.turns.cache_clear()
    yield
    turn.turns.cache_clear()


@pytest.mark.usefixtures("short")
@pytest.mark.slow
def test_the_turn_is_that_of_an_independent_ship() -> None:
    z = turn.track(0.1)
    t = 0.1 * np.arange(201)
    np.testing.assert_allclose(z, sailed(MODEL, 20.0)(t).T, rtol=1e-6, atol=1e-6)
    whole = turn.sailed(0.1)
    np.testing.assert_array_equal(np.asarray(whole.values)[:, -1], np.tile(z[-1], (4, 1)))


@pytest.mark.usefixtures("short")
def test_times_are_divided_by_the_evaluations_that_ran(monkeypatch: pytest.MonkeyPatch) -> None:
    watch = Watch(64.0)
    monkeypatch.setattr(turn, "best", watch)
    assert turn.per_call() == 64.0 / (4 * 200 * 4)  # a step of Runge and Kutta has four
    np.testing.assert_allclose(np.asarray(watch.given[0].values)[:, -1], np.tile(sailed(MODEL, 20.0)(20.0), (4, 1)),
                               rtol=1e-6, atol=1e-6)  # fmt: skip


@pytest.mark.usefixtures("short")
@pytest.mark.slow
def test_scipy_solves_the_same_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    watch = Watch(3.0)
    monkeypatch.setattr(turn, "DURATION", 3.0)
    monkeypatch.setattr(turn, "best", watch)
    found = turn.by_scipy()
    [run] = watch.given
    assert found == pytest.approx(3.0 / run.nfev)
    assert 0.05 < max(b - a for a, b in pairwise(run.t)) <= 0.1 + 1e-12
    np.testing.assert_allclose(run.y[:, -1], sailed(MODEL, 3.0)(3.0), rtol=1e-5, atol=1e-5)


def test_the_bare_equations_are_called_a_thousand_times_as_the_turn_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []
    model = types.SimpleNamespace(derivative=lambda *given: calls.append(given))
    monkeypatch.setattr(turn, "ship", lambda: types.SimpleNamespace(model=model, speed=1.179))
    monkeypatch.setattr(turn, "best", Watch(7.0))
    assert turn.bare() == 7.0 / 1000
    assert calls == 1000 * [((0, 0, 0, 1.179, 0, 0), (11.85, math.radians(35)), CALM)]


@pytest.mark.usefixtures("short")
def test_between_steps_the_track_is_the_cubic_of_places_and_velocities() -> None:
    """Half way it is the mean of the ends and an eighth of the step times the difference of their velocities."""
    dt, z = 2.0, turn.track(2.0)
    place, speed = z[:, 0] + 1j * z[:, 1], (z[:, 3] + 1j * z[:, 4]) * np.exp(1j * z[:, 2])
    half = (place[1:] + place[:-1]) / 2 + dt / 8 * (speed[:-1] - speed[1:])
    found = turn.dense(dt, dt * (np.arange(len(half)) + 0.5))
    np.testing.assert_allclose(found, np.column_stack([half.real, half.imag]), rtol=1e-12)


@pytest.mark.slow
@pytest.mark.usefixtures("short")
def test_the_widest_step_is_the_first_that_is_near_enough() -> None:
    t = np.linspace(0.0, 20.0, 201)
    exact = sailed(MODEL, 20.0)(t)[:2].T
    errors = {dt: float(np.hypot(*(turn.dense(dt, t) - exact).T).max()) for dt in turn.STEPS[:6]}
    assert sorted(errors, key=lambda dt: errors[dt]) == sorted(errors)
    for wide, dt in pairwise(errors):
        assert turn.widest_step(math.sqrt(errors[wide] * errors[dt])) == dt
    with pytest.raises(SimulationError, match=r"down to 0\.1 s"):
        turn.widest_step(1e-12)


@pytest.mark.usefixtures("short")
def test_a_step_that_is_exact_is_near_enough_to_an_error_of_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    fine = turn.track(0.005)[::20, :2]
    monkeypatch.setattr(turn, "dense", lambda dt, t: fine)
    assert turn.widest_step(0.0) == 5.0


# shipmmg


@dataclass(frozen=True)
class Given:
    """What a peer's ship is made of."""

    of: dict[str, float]


class Theirs(Mmg):
    """The wake of shipmmg: w_P = w_P0 exp(-4 (beta - x_P r')^2)."""

    x_P = -0.69

    def _pushed(self, u: float, v: float, r: float, n: float, delta: float) -> Any:
        U, beta = math.hypot(u, v), math.atan2(-v, u)
        turned = r * self.length / U
        w = self.w_P0 * math.exp(-4.0 * (beta - self.x_P * turned) ** 2)
        p, u_P = self.propeller, (1.0 - w) * u
        J = u_P / (n * self.D_P)
        K_T = p["k_0"] + p["k_1"] * J + p["k_2"] * J * J
        push = self.rho * n * n * self.D_P**4 * K_T
        return push, self._rudder(U, beta, turned, delta, u_P, K_T * (n * self.D_P) ** 2)


def equations(b: dict[str, float], h: dict[str, float], rho: float, n: float, delta: float) -> Callable[..., Any]:
    """The MMG equations by the names of shipmmg, written for u, v, r, x, y, psi as its solver holds them."""

    def rates(_: float, state: Any) -> list[float]:
        u, v, r, _, _, psi = state
        L, d, U = b["L_pp"], b["d"], math.hypot(u, v)
        beta, v_, r_ = math.atan2(-v, u), v / U, r * L / U
        w = b["w_P0"] * math.exp(-4.0 * (beta - b["x_P"] * r_) ** 2)
        J = (1.0 - w) * u / (n * b["D_p"])
        K_T = h["k_0"] + h["k_1"] * J + h["k_2"] * J**2
        beta_R = beta - b["l_R"] * r_
        v_R = U * (b["γ_R_plus"] if beta_R > 0 else b["γ_R_minus"]) * beta_R
        race = (1.0 + b["κ"] * (math.sqrt(1.0 + 8.0 * K_T / (math.pi * J**2)) - 1.0)) ** 2
        u_R = b["ε"] * (1.0 - w) * u * math.sqrt(b["η"] * race + 1.0 - b["η"])
        F = 0.5 * rho * b["A_R"] * b["f_α"] * (u_R**2 + v_R**2) * math.sin(delta - math.atan2(v_R, u_R))
        q = 0.5 * rho * L * d * U**2
        # products of v' and r' by the letters of each name
        terms = {name: math.prod({"v": v_, "r": r_}[c] for c in name[2:-5]) * value
                 for name, value in h.items() if name[:2] in ("X_", "Y_", "N_")}  # fmt: skip
        X, Y, N = (q * sum(x for name, x in terms.items() if name[0] == axis) for axis in "XYN")
        X += (1.0 - b["t_P"]) * rho * n**2 * b["D_p"] ** 4 * K_T - q * h["R_0_dash"]
        X -= (1.0 - b["t_R"]) * F * math.sin(delta)
        Y -= (1.0 + b["a_H"]) * F * math.cos(delta)
        N = L * N - (b["x_R"] + b["a_H"] * b["x_H"]) * F * math.cos(delta)
        m, lever = b["m"], b["m"] * b["x_G"]
        held = np.array([[m + b["m_y"], lever], [lever, b["I_zG"] + b["m"] * b["x_G"] ** 2 + b["J_z"]]])
        moved = np.linalg.solve(held, [Y - (m + b["m_x"]) * u * r, N - lever * u * r])
        over = (u + 1j * v) * np.exp(1j * psi)
        surge = (X + (m + b["m_y"]) * v * r + lever * r**2) / (m + b["m_x"])
        return [surge, *moved, over.real, over.imag, r]

    return rates


@pytest.fixture
def peer(monkeypatch: pytest.MonkeyPatch) -> types.ModuleType:
    """A stand-in for shipmmg; its solver takes the options of scipy's."""
    module: Any = types.ModuleType(shipmmg.MODULE)
    module.Mmg3DofBasicParams = lambda **given: Given(given)
    module.Mmg3DofManeuveringParams = lambda **given: Given(given)

    def simulate(basic: Given, hull: Given, t: Any, delta: Any, n: Any, u0: float, ρ: float, **options: Any) -> Any:
        assert len(t) == len(delta) == len(n)
        assert np.ptp(delta) == np.ptp(n) == 0.0
        rates = equations(basic.of, hull.of, ρ, n[0], delta[0])
        return solve_ivp(rates, (t[0], t[-1]), [u0, 0, 0, 0, 0, 0], dense_output=True, **options)

    module.simulate_mmg_3dof = simulate
    monkeypatch.setitem(sys.modules, "shipmmg", types.ModuleType("shipmmg"))
    monkeypatch.setitem(sys.modules, shipmmg.MODULE, module)
    return module


@pytest.mark.usefixtures("short", "peer")
@pytest.mark.slow
def test_the_peer_sails_the_same_ship_by_the_same_rudder() -> None:
    found = shipmmg.their_turn(rtol=1e-9, atol=1e-10)
    t = np.linspace(0.0, 20.0, 21)
    given = {name: getattr(MODEL, name) for name in MODEL.__dataclass_fields__}
    expected = sailed(Theirs(**given), 20.0)(t)
    np.testing.assert_allclose(found.sol(t)[[3, 4, 5, 0, 1, 2]], expected, rtol=1e-6, atol=1e-6)
    assert expected[2, -1] > 0.5  # to starboard
    basic = shipmmg.theirs()[0].of
    assert basic["B"] == turn.ship().model.body.B  # type: ignore[attr-defined]


@pytest.mark.usefixtures("short", "peer")
@pytest.mark.slow
def test_a_turn_at_equal_error_is_timed_for_one_ship_each(monkeypatch: pytest.MonkeyPatch) -> None:
    watch, own = Watch(2.0), Watch(12.0, 5.0)
    monkeypatch.setattr(shipmmg, "best", watch)
    assert shipmmg.their_call() == pytest.approx(2.0 / watch.given[0].nfev)
    assert max(np.diff(watch.given[0].t)) <= 0.1 + 1e-12
    monkeypatch.setattr(shipmmg, "best", own)
    even = shipmmg.even_turn()
    t = np.linspace(0.0, 20.0, 2001)
    by = [shipmmg.their_turn(**given).sol(t) for given in ({}, {"rtol": 1e-9, "atol": 1e-11})]
    assert even.error == pytest.approx(abs((by[0] - by[1])[3] + 1j * (by[0] - by[1])[4]).max(), rel=1e-3)
    assert (even.ours, even.theirs, even.method) == (12.0 / 4, 5.0, "rk4")
    assert even.dt == turn.widest_step(even.error)
    assert even.own <= even.error
    assert np.asarray(own.given[0].values).shape[0] == 4
    assert own.given[1].t[-1] == 20.0


def zigzag(dt: float, duration: float = 80.0) -> Any:
    """Heading of the independent ship in a 20/20 zigzag, first to starboard, at every step."""
    angle, z, delta, order, found = math.radians(20), np.array([0, MODEL.speed, 0, 0.0]), 0.0, math.radians(20), []

    def rates(at: Any) -> Any:
        return np.array([at[3], *MODEL.rates(*at[1:], (turn.N_P, delta), (0.0, 0.0))])

    for _ in range(round(duration / dt) + 1):
        found.append(z[0])
        if order * z[0] > 0 and abs(z[0]) >= angle:
            order = -math.copysign(angle, z[0])
        delta += float(np.clip(order - delta, -dt * MODEL.rudder_rate, dt * MODEL.rudder_rate)) / 2
        a = rates(z)
        z = z + dt * rates(z + 0.5 * dt * a)
        delta += float(np.clip(order - delta, -dt * MODEL.rudder_rate / 2, dt * MODEL.rudder_rate / 2))
    return np.array(found)


@pytest.mark.slow
def test_our_zigzag_is_that_of_an_independent_ship() -> None:
    """Both reverse at a step of 0.05 s, in which the ship turns by less than 0.4 degrees."""
    assert math.radians(20) == shipmmg.ANGLE
    found = shipmmg._heading("rk4", 0.05)
    independent = zigzag(0.05)[::40]
    assert len(found) == len(independent) == 41
    assert np.degrees(np.abs(found - independent)).max() < 1.0
    assert np.degrees(np.ptp(found)) > 40.0


@pytest.mark.slow
def test_a_zigzag_at_equal_error_is_the_quickest_way_that_is_near_enough(
    monkeypatch: pytest.MonkeyPatch, peer: Any
) -> None:
    """The stand-in is 0.02 rad off at its default settings, at times that its grid holds."""
    asked: list[Any] = []

    def heading(_basic: Any, _hull: Any, delta: float, psi: float, t: Any, n: Any, **given: Any) -> Any:
        asked.append((delta, psi, t, n, given))
        off = 0.0 if "rtol" in given else -0.02
        return [*range(6), (np.sin(0.1 * t) + off * (np.abs(t - 15.0) < 1e-6)).tolist()]

    peer.zigzag_test_mmg_3dof = heading
    shipmmg.their_zigzag()
    assert np.diff(asked[0][2]) == pytest.approx(0.1)
    assert asked[0][2][-1] == 80.0
    monkeypatch.setattr(shipmmg, "SHIPS", 3)
    monkeypatch.setattr(shipmmg, "SECONDS", 30.0)
    seconds = [5.0, 3.0, 4.0, 2.5, 2.0, 6.0, 3.5, 4.5, 1.5]
    watch = Watch(*seconds)
    monkeypatch.setattr(shipmmg, "best", watch)
    exact = shipmmg._heading("rk4", 0.001)
    errors = {way: float(np.abs(shipmmg._heading(*way) - exact).max()) for way in shipmmg.WAYS}
    good = [way for way in shipmmg.WAYS if errors[way] <= 0.02]
    assert 1 < len(good) < len(shipmmg.WAYS)
    chosen = min(range(len(good)), key=lambda k: seconds[k])
    even = shipmmg.even_zigzag(shipmmg.random_ships())
    assert (even.method, even.dt) == good[chosen]
    assert even.error == pytest.approx(0.02)
    assert even.own == pytest.approx(errors[good[chosen]], rel=1e-6)
    assert (even.ours, even.theirs) == (seconds[len(good)] / 3, seconds[len(good) + 1])
    assert [run.values.shape[0] for run in watch.given[: len(good) + 1]] == (len(good) + 1) * [3]
    assert all(31 <= run.values.shape[1] <= 38 for run in watch.given[: len(good) + 1])  # about a row a second
    for delta, psi, t, n, given in asked[1:]:
        assert (delta, psi, t[0], t[-1]) == (math.radians(20), math.radians(20), 0.0, 30.0)
        assert len(n) == len(t)
        assert set(n) == {11.85}
        assert given["δ_rad_rate"] == pytest.approx(math.radians(15.8))
        assert (given["u0"], given["ρ"]) == (1.179, 1000.0)
    assert [len(t) - 1 for _, _, t, _, _ in asked[1:]] == [800, 16000, 800]


def test_what_is_measured_is_what_the_page_of_benchmarks_says() -> None:
    page = (Path(__file__).parents[2] / "docs" / "benchmarks.md").read_text()
    zigzags = re.search(r"\| ([0-9 ]+) random ships, each a (\d+)/\2 zigzag of (\d+) s", page)
    lanes = re.search(r"our engine, 1 thread, (\d+) ships", page)
    assert zigzags
    assert lanes
    assert (shipmmg.SHIPS, math.degrees(shipmmg.ANGLE), shipmmg.SECONDS) == (
        int(zigzags[1].replace(" ", "")), pytest.approx(float(zigzags[2])), float(zigzags[3]))  # fmt: skip
    assert turn.LANES == fossen.LANES == int(lanes[1])
    assert approach(load("kvlcc2_l7"))[1] == pytest.approx(turn.N_P, abs=0.005)  # it holds its speed before the turn
    assert turn.DURATION * turn.ship().speed > 30 * turn.ship().L_pp  # more than a circle
    assert 3 * load("esso_190k_tanker").L_pp < fossen.STEPS * fossen.DT * 4.8
    assert tuple(sorted(turn.STEPS, reverse=True)) == turn.STEPS
    assert all(abs(200.0 / dt - round(200.0 / dt)) < 1e-9 for dt in turn.STEPS)  # each ends where the turn ends


def test_random_ships_are_within_a_tenth_of_the_published(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shipmmg, "SHIPS", 4000)
    found, model = shipmmg.random_ships(), load("kvlcc2_l7").model
    for name, values in found.items():
        group, _, key = name.removeprefix("ship.").partition(".")
        usual = math.radians(20) if group == "policy" else getattr(getattr(model, group), key)
        share = values / usual
        assert len(share) == 4000
        # the mean and the spread of an even draw
        assert abs(share.mean() - 1.0) < 5 * 0.2 / math.sqrt(12 * 4000)
        assert 0.9 <= share.min() < 0.902
        assert 1.098 < share.max() <= 1.1


# the tanker of Fossen


def test_both_tankers_sail_the_same_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A stand-in whose rudder turns to port, as there: both speeds agree after the same steps of Euler's rule."""
    last: list[Any] = []

    class Tanker:
        def __init__(self, depth: float, rpm: float) -> None:
            self.nu, self.rpm, self.depth = np.array([4.8, 0, 0, 0, 0, 0], float), rpm, depth

        def dynamics(self, eta: Any, nu: Any, u_actual: Any, u_control: Any, sampleTime: float) -> tuple[Any, Any]:
            assert eta.tolist() == 6 * [0.0]
            assert self.depth > 1e6
            state = (0.0, 0.0, 0.0, nu[0], nu[1], nu[5])
            rates = load("esso_190k_tanker").model.derivative(state, (self.rpm / 60.0, -float(u_actual[0])), CALM)
            last.append(nu + sampleTime * np.array([rates[3], rates[4], 0, 0, 0, rates[5]], float))
            return last[-1], u_actual + sampleTime * (u_control - u_actual)

    module: Any = types.ModuleType(fossen.MODULE)
    module.tanker = Tanker
    for name in ("python_vehicle_simulator", "python_vehicle_simulator.vehicles"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    monkeypatch.setitem(sys.modules, fossen.MODULE, module)
    monkeypatch.setattr(fossen, "STEPS", 30)
    monkeypatch.setattr(fossen, "LANES", 3)
    watch = Watch(6.0, 9.0)
    monkeypatch.setattr(fossen, "best", watch)
    assert (fossen.ours(), fossen.theirs()) == (6.0 / 90, 9.0 / 30)
    ours = np.asarray(watch.given[0].values)[:, -1]
    assert len(last) == 30
    np.testing.assert_allclose(ours[:, [3, 4, 5]], np.tile(last[-1][[0, 1, 5]], (3, 1)), rtol=1e-9)
    assert last[-1][5] > 0.0  # to starboard


# times


def test_the_shortest_of_the_runs_counts_for_as_long_as_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a clock that goes on by what each job takes: four runs fill 3 s, and never fewer than are asked for."""
    now, takes = [100.0], iter([9.0, 1.0, 0.25, 2.0, 5.0, 7.0, 7.0, 7.0])
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])

    def job() -> None:
        now[0] += next(takes)

    assert timing.best(job, 3.0, 2) == 0.25  # the first of all is not counted
    assert next(takes) == 5.0
    assert timing.best(job, 0.0, 2) == 7.0
    with pytest.raises(StopIteration):
        next(takes)


def test_the_control_loop_sums_a_harmonic_series_and_is_told_in_milliseconds(monkeypatch: pytest.MonkeyPatch) -> None:
    watch, n = Watch(0.005), 200_000
    monkeypatch.setattr(timing, "best", watch)
    assert timing.control_loop() == 5.0
    assert watch.given[0] == pytest.approx(math.log(n) + np.euler_gamma + 0.5 / n, rel=1e-11)


def test_the_machine_is_told_by_cores_and_the_widest_vectors() -> None:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    flags = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    width = "AVX-512" if "avx512f" in flags else "AVX2" if "avx2" in flags else "no AVX2"
    assert timing.machine() == f"{cores} cores, {width}"


def test_each_peer_has_its_own_times_beside_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = map(float, count(1))
    for module, names in ((turn, ("per_call", "bare", "by_scipy")), (fossen, ("ours", "theirs")),
                          (shipmmg, ("their_call",))):  # fmt: skip
        for name in names:
            monkeypatch.setattr(module, name, partial(next, iter([next(numbers)] * 3)))
    even = shipmmg.Even(0.1, 0.1, "rk4", 0.5, 8.0, 9.0)
    monkeypatch.setattr(shipmmg, "even_turn", lambda: even)
    monkeypatch.setattr(shipmmg, "even_zigzag", lambda vary: replace(even, ours=10.0, theirs=11.0))
    monkeypatch.setattr(shipmmg, "random_ships", dict)
    found = {peer.name: [(row.ours, row.theirs) for row in peer.measure()] for peer in PEERS}
    assert found == {
        "floats": [(1, 2)], "scipy": [(1, 3)], "shipmmg": [(1, 6), (8, 9), (10, 11)], "fossen": [(4, 5)],
    }  # fmt: skip
    assert Row("", 2.0, 3.0).ratio == 1.5
    assert [peer.installed for peer in room.PEERS[:2]] == [True, True]
    assert room.PEERS[1].version == sys.modules["scipy"].__version__
    assert replace(room.PEERS[1], module="no_such_program").version == ""

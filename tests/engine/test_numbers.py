"""The numbers of the engine: orders, agreement of the back ends, derivatives, independence of lanes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from makes import TRACED, ships
from seatrial.core.parameters import ParameterError
from seatrial.engine import floats
from seatrial.engine.rollout import sensitivity, simulator
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.simulate.loop import closed_loop, loop_values
from tiers import slow_but

FREE = ("hull.Y_v", "hull.N_r", "rudder.t_R", "propeller.w_P0")


every_ship = pytest.mark.parametrize("case", ships(TRACED), indirect=True)


def slope(errors: list[float]) -> float:
    """Order of convergence from errors at steps that halve."""
    return float(np.polyfit(np.arange(len(errors)), -np.log2(errors), 1)[0])


@pytest.mark.slow
@pytest.mark.parametrize(("method", "order", "finest"), [("rk4", 4, 400), ("euler", 1, 6400)])
def test_order_of_integration_and_of_its_derivatives(l7: Any, method: str, order: int, finest: int) -> None:
    """A turn with the rudder held from the start: smooth, so the error falls with the order."""
    state0, held = np.array([[0, 0, 0, 1.0, -0.1, 0.05]]), np.array([[[11.85, 0.5, *([0.0] * 8)]]])
    plain, exact = simulator(l7.system), sensitivity(l7.system, FREE)

    def end(steps: int, how: str = method) -> tuple[Any, Any]:
        given: dict[str, Any] = {"dt": 20.0 / steps, "steps": steps + 1, "method": how}
        series = np.repeat(held, steps + 1, axis=1)
        z = plain.run(state0, held, l7.parameters, **given).values[0, -1]
        return z, exact.run(state0, series, l7.parameters, **given)[1][0, -1]

    z, d = end(2000, "rk4")
    found = [end(finest // 2**k) for k in (2, 1, 0)]
    assert slope([np.abs((x[0] - z) / l7.size).max() for x in found]) == pytest.approx(order, abs=0.1)
    scale = np.abs(d).max(axis=0)
    assert slope([np.abs((x[1] - d) / scale).max() for x in found]) == pytest.approx(order, abs=0.1)


@pytest.mark.parametrize(
    "case", slow_but(ships(TRACED), "kvlcc2_l7", "kvlcc2_l7_arx", "viknes_830", "zeefakkel_speeds"), indirect=True
)
def test_one_call_is_the_same_on_floats_virtual_machine_and_kernel(case: Any) -> None:
    """Ahead, astern and at rest, in wind, waves and current, revolutions of either sign: 1e-12 of the largest rate."""
    z, a, n = case.states(40), case.series(40, 1)[:, 0], len(case.held)
    rng = np.random.default_rng(5)
    a[1:, :n] *= rng.uniform(-1, 1, (39, n))
    acting = len(case.system.acting) or a.shape[1]
    a = np.hstack([a, rng.uniform(-1e-3, 1e-3, (40, acting - a.shape[1]))])  # a sampled model's rates
    direct = np.array(
        [case.system.derivative(tuple(x), tuple(c), tuple(case.parameters.tolist()))
         for x, c in zip(z.tolist(), a.tolist(), strict=True)]
    )  # fmt: skip
    scale = np.abs(direct).max(axis=1, keepdims=True)
    for back_end in ("simd", "virtual"):
        found = simulator(case.system, back_end=back_end).evaluate(z, a, case.parameters)
        assert np.isfinite(found).all()
        assert (np.abs(found - direct) <= 1e-12 * scale + 1e-300).all()


@every_ship
@pytest.mark.long
def test_trajectories_are_the_same_on_all_back_ends(case: Any) -> None:
    z, s, steps = case.ahead(3), case.series(3, 200), 200
    m = case.memory(z, s)
    given: dict[str, Any] = {"dt": case.dt, "steps": steps}
    for method in ("rk4", "euler"):
        simd, virtual = (
            simulator(case.system, back_end=b).run(z, s, case.parameters, memory0=m, method=method, **given).values
            for b in ("simd", "virtual")
        )
        slow = np.array([
            floats.rollout(case.system, tuple(z[i]), s[i], tuple(case.parameters), memory0=tuple(m[i]),
                           rk4=method == "rk4", **given)
            for i in range(3)
        ])  # fmt: skip
        own = len(case.size)
        for other in (virtual, slow):
            assert np.isfinite(simd).all()
            assert (np.abs(simd - other)[..., :own] <= 1e-9 * case.size).all()


@pytest.mark.slow
def test_closed_loop_is_the_same_on_all_back_ends(l7: Any) -> None:
    policy = Zigzag(n_P=11.85, delta=0.35, psi=0.35, side=-1.0)
    system = closed_loop(l7.ship, policy, 0.1)
    p = np.array(list(loop_values(l7.ship, policy).values()))
    z, m = np.array([[0, 0, 0.3, 1.179, 0, 0.0]]), np.array([[11.85, 0, -1.0, 0.3]])
    given: dict[str, Any] = {"dt": 0.1, "steps": 600}
    calm = np.zeros((1, 1, 8))
    simd, virtual = (
        simulator(system, back_end=b).run(z, calm, p, memory0=m, **given).values[0] for b in ("simd", "virtual")
    )
    slow = floats.rollout(system, tuple(z[0]), calm[0], tuple(p), memory0=tuple(m[0]), **given)
    assert np.abs(simd - virtual).max() < 1e-9
    assert np.abs(simd - slow).max() < 1e-9
    assert np.unique(np.sign(simd[:, system.stored.index("delta_cmd")])).size == 2


@pytest.mark.slow
def test_a_lane_does_not_know_its_neighbours_nor_the_threads(l7: Any) -> None:
    z, s = l7.ahead(100), l7.series(100, 60)
    run = simulator(l7.system).run
    slopes = sensitivity(l7.system, FREE).run
    given: dict[str, Any] = {"dt": 0.1, "steps": 60}
    whole = run(z, s, l7.parameters, threads=1, **given).values
    _, derivatives = slopes(z, s, l7.parameters, threads=1, **given)
    for lanes in (slice(3, 4), slice(0, 5), slice(1, 18), slice(0, 100)):
        for threads in (1, 2, 3, 7):
            found = run(z[lanes], s[lanes], l7.parameters, threads=threads, **given).values
            assert np.array_equal(found, whole[lanes])
            _, d = slopes(z[lanes], s[lanes], l7.parameters, threads=threads, **given)
            assert np.array_equal(d, derivatives[lanes])


@pytest.mark.slow
def test_every_kth_step_is_stored(l7: Any) -> None:
    z, s = l7.ahead(2), l7.series(2, 31)
    run = simulator(l7.system).run
    all_rows = run(z, s, l7.parameters, dt=0.1, steps=31, t0=5.0)
    assert all_rows.t[0] == 5.0
    for every in (1, 3, 7, 40):
        some = run(z, s, l7.parameters, dt=0.1, steps=31, every=every, t0=5.0)
        assert np.array_equal(some.values, all_rows.values[:, ::every])
        assert some.t == pytest.approx(all_rows.t[::every])
        for back_end in ("simd", "virtual"):
            _, d = sensitivity(l7.system, FREE, back_end=back_end).run(z, s, l7.parameters, dt=0.1, steps=31)
            _, e = sensitivity(l7.system, FREE, back_end=back_end).run(
                z, s, l7.parameters, dt=0.1, steps=31, every=every
            )
            assert np.array_equal(e, d[:, ::every])


@pytest.mark.slow
def test_parameters_per_lane(l7: Any) -> None:
    z, s, names = np.repeat(l7.ahead(1), 5, axis=0), np.repeat(l7.series(1, 50), 5, axis=0), ("rudder.t_R", "hull.Y_v")
    where = [l7.system.parameters.index(n) for n in names]
    q = l7.parameters[where] * np.linspace(0.8, 1.2, 5)[:, None]
    together = simulator(l7.system, names).run(z, s, l7.parameters, lanewise=q, dt=0.1, steps=50).values
    alone = simulator(l7.system)
    for lane in range(5):
        p = l7.parameters.copy()
        p[where] = q[lane]
        found = alone.run(z[:1], s[:1], p, dt=0.1, steps=50).values[0]
        assert together[lane] == pytest.approx(found, rel=1e-12, abs=1e-12)
    assert np.abs(together[0] - together[4]).max() > 1e-3
    other = simulator(l7.system, names, back_end="virtual")
    assert other.run(z, s, l7.parameters, lanewise=q, dt=0.1, steps=50).values == pytest.approx(together, abs=1e-11)


@pytest.mark.slow
def test_every_parameter_of_each_lane_counts_in_its_block(l7: Any) -> None:
    """What holds over a step is kept by block and lane: 20 ships, all of whose numbers differ, each as it is alone."""
    names, rng = l7.system.parameters, np.random.default_rng(5)
    z, s = np.repeat(l7.ahead(1), 20, axis=0), np.repeat(l7.series(1, 30), 20, axis=0)
    s[..., 1] = np.linspace(-0.4, 0.4, 20)[:, None]
    q = l7.parameters * rng.uniform(0.9, 1.1, (20, len(names)))
    together, alone = simulator(l7.system, names), simulator(l7.system)
    rates = together.evaluate(z, s[:, 0], l7.parameters, q)
    values = together.run(z, s, l7.parameters, lanewise=q, dt=0.1, steps=30).values
    for k in range(20):
        one = slice(k, k + 1)
        assert rates[k] == pytest.approx(alone.evaluate(z[one], s[one, 0], q[k])[0], rel=1e-12, abs=1e-14)
        assert values[k] == pytest.approx(alone.run(z[one], s[one], q[k], dt=0.1, steps=30).values[0], rel=1e-11)


@pytest.mark.parametrize("method", [pytest.param("rk4", marks=pytest.mark.slow), "euler"])
def test_derivatives_against_differences_and_virtual_machine(l7: Any, method: str) -> None:
    z, s = l7.ahead(3), l7.series(3, 100)
    given: dict[str, Any] = {"dt": 0.1, "steps": 100, "method": method}
    exact = sensitivity(l7.system, FREE)
    values, d = exact.run(z, s, l7.parameters, **given)
    plain = simulator(l7.system)
    assert values == pytest.approx(plain.run(z, s, l7.parameters, **given).values, rel=1e-12, abs=1e-12)
    for k, name in enumerate(FREE):
        j = l7.system.parameters.index(name)
        h = 1e-5 * abs(l7.parameters[j])
        up, down = l7.parameters.copy(), l7.parameters.copy()
        up[j], down[j] = up[j] + h, down[j] - h
        difference = (plain.run(z, s, up, **given).values - plain.run(z, s, down, **given).values) / (2 * h)
        assert np.abs(d[..., k] - difference).max() < 1e-6 * np.abs(d[..., k]).max()
    for k in range(6):
        h = 1e-5 * l7.size[k] * np.eye(6)[k]
        difference = plain.run(z + h, s, l7.parameters, **given).values
        difference = (difference - plain.run(z - h, s, l7.parameters, **given).values) / (2 * h[k])
        assert np.abs(d[..., len(FREE) + k] - difference).max() < 1e-6 * max(1.0, np.abs(d[..., len(FREE) + k]).max())
    other, e = sensitivity(l7.system, FREE, back_end="virtual").run(z, s, l7.parameters, **given)
    assert other == pytest.approx(values, rel=1e-11, abs=1e-11)
    assert (np.abs(e - d) <= 1e-9 * np.abs(d).max(axis=(0, 1, 2))).all()


@pytest.mark.slow
def test_derivatives_under_held_series(l7: Any) -> None:
    z, s = l7.ahead(3), l7.series(3, 1)
    for back_end in ("simd", "virtual"):
        exact = sensitivity(l7.system, FREE, back_end=back_end)
        _, held = exact.run(z, s, l7.parameters, dt=0.1, steps=30)
        _, spelled = exact.run(z, np.repeat(s, 30, axis=1), l7.parameters, dt=0.1, steps=30)
        assert np.array_equal(held, spelled)


@pytest.mark.slow
def test_packed_series_give_the_same(l7: Any) -> None:
    z, s = l7.ahead(20), l7.series(20, 30)
    for back_end in ("simd", "virtual"):
        engine = simulator(l7.system, back_end=back_end)
        a = engine.run(z, s, l7.parameters, dt=0.1, steps=30).values
        assert np.array_equal(a, engine.run(z, engine.pack(s), l7.parameters, dt=0.1, steps=30).values)


@pytest.mark.slow
def test_infinite_rates_let_the_order_through(l7: Any) -> None:
    from dataclasses import replace

    from seatrial.actuators import Actuators

    ship = replace(l7.ship, actuators=Actuators())
    policy = Turning(n_P=11.85, delta=0.5)
    system, p = closed_loop(ship, policy, 0.1), np.array(list(loop_values(ship, policy).values()))
    z, m = np.array([[0, 0, 0, 1.179, 0, 0.0]]), np.array([[11.85, 0.5]])
    closed = simulator(system).run(z, np.zeros((1, 1, 8)), p, memory0=m, dt=0.1, steps=200).values[0, :, :6]
    held = np.array([[[11.85, 0.5, *([0.0] * 8)]]])
    opened = simulator(l7.system).run(z, held, l7.parameters, dt=0.1, steps=200).values[0]
    assert closed == pytest.approx(opened, rel=1e-12, abs=1e-12)


@pytest.mark.slow
def test_unknown_names_are_refused(l7: Any) -> None:
    with pytest.raises(ParameterError, match=r"rudder\.t_R"):
        simulator(l7.system, ("rudder.tR",))
    with pytest.raises(ParameterError, match=r"rudder\.t_R"):
        sensitivity(l7.system, ("rudder.tR",))
    with pytest.raises(ValueError, match="rk4, euler"):
        simulator(l7.system).run(l7.ahead(1), l7.series(1, 1), l7.parameters, dt=0.1, steps=3, method="rk5")
    with pytest.raises(ValueError, match="open-loop"):
        sensitivity(closed_loop(l7.ship, Turning(n_P=1.0, delta=0.1), 0.1), ())
    assert math.isfinite(l7.dt)

"""The one way to run a ship: what a lane does depends on nothing but its own start, inputs and steps."""

from __future__ import annotations

import ast
import math

import numpy as np
import pytest

from house import MODULES, short, text, tree
from seatrial.environment import CHANNELS
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.lanes import Judge, Kernel, Lanes, Steps, given, run, slopes, steered
from seatrial.simulate.loop import open_loop, open_loop_parameters
from seatrial.simulate.run import approach, campaign

SHIP = load("kvlcc2_l7")
U, N_P = SHIP.speed, approach(SHIP)[1]
BUILDERS = {"simulator", "sensitivity"}


def turns(*deltas: float) -> Lanes:
    """A lane for each rudder angle, from the approach."""
    state = np.array([[0.0, 0.0, 0.0, U, 0.0, 0.0]] * len(deltas))
    return given(SHIP, state, np.array([[[N_P, delta, *([0.0] * len(CHANNELS))]] for delta in deltas]))


def zigzag() -> Lanes:
    """Two zigzags at slightly different revolutions, in the weather of a steady current."""
    around = np.zeros((1, 1, len(CHANNELS)))
    around[..., CHANNELS.index("current_y")] = 0.1
    vary = {"policy.n_P": np.array([N_P, 0.9 * N_P])}
    return steered(SHIP, Zigzag(N_P, 0.35, 0.35), 0.25, vary, np.array([[0.0, 0.0, 0.0, U, 0.1, 0.0]]), around, 2)


@pytest.mark.slow
def test_nothing_else_builds_a_simulator() -> None:
    found = {
        short(path)
        for path in MODULES
        if "rollout" in text(path)
        for node in ast.walk(tree(path))
        if isinstance(node, ast.ImportFrom) and "rollout" in (node.module or "").split(".")
        if BUILDERS & {one.name for one in node.names}
    }
    assert found == {"simulate/lanes.py"}


def test_a_run_that_is_taken_up_again_ends_where_the_whole_one_does() -> None:
    """In the middle of a zigzag the rudder moves and the policy remembers: states and memory are all there is."""
    loop = zigzag()
    system, whole = loop.kernel.system, run(zigzag(), Steps(0.25, 401), None).values
    half = run(loop, Steps(0.25, 201, 200), None).values[:, -1]
    n, m = len(system.states), len(system.memory)
    again = Lanes(loop.kernel, loop.shared, half[:, :n], loop.series, half[:, n : n + m], loop.lanewise)
    rest = run(again, Steps(0.25, 201, t0=50.0), None)
    assert rest.t[[0, -1]] == pytest.approx([50.0, 100.0])
    np.testing.assert_array_equal(rest.values[:, :, : n + m], whole[:, 200:, : n + m])


def test_a_lane_is_the_same_alone_and_among_others() -> None:
    many = run(turns(*np.linspace(-0.5, 0.5, 19)), Steps(0.5, 101)).values
    np.testing.assert_array_equal(run(turns(*np.linspace(-0.5, 0.5, 19)).part(slice(3, 4)), Steps(0.5, 101)).values[0],
                                  many[3])  # fmt: skip


def test_a_zigzag_in_lanes_is_that_of_a_campaign() -> None:
    vary = {"policy.n_P": np.array([N_P, 0.9 * N_P])}
    there = campaign(SHIP, Zigzag(N_P, 0.35, 0.35), vary, speed=U, duration=60.0, dt=0.25)
    start, around = np.array([[0.0, 0.0, 0.0, U, 0.0, 0.0]]), np.zeros((1, 1, len(CHANNELS)))
    here = run(steered(SHIP, Zigzag(N_P, 0.35, 0.35), 0.25, vary, start, around, 2), Steps(0.25, 241))
    np.testing.assert_array_equal(here.values, there.values)


def test_steps_between_rows_end_at_the_rows() -> None:
    steps = Steps.between(1.0, 5, 4)
    assert (steps.dt, steps.count, steps.every) == (0.25, 17, 4)
    assert run(turns(0.2), steps).t.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_a_lane_that_leaves_its_interval_fails_alone() -> None:
    """Hard over the ship turns out of 30 deg of heading, midships it does not; nobody judges, and both go on."""
    judge = Judge({"psi": (-math.pi / 6, math.pi / 6), "no_state": (0.0, 0.0)})
    judged, free = run(turns(0.6, 0.0), Steps(0.5, 201), judge), run(turns(0.6, 0.0), Steps(0.5, 201), None)
    (failed,) = judged.failures
    row = round(failed.time / 0.5)
    assert (failed.lane, failed.state) == (0, "psi")
    assert free.values[0, row - 1, 2] <= math.pi / 6 < free.values[0, row, 2]
    assert np.isnan(judged.values[0, row:]).all()
    np.testing.assert_array_equal(judged.values[1], free.values[1])
    assert free.failures == ()
    assert np.isfinite(free.values).all()


def test_slopes_are_those_of_neighbouring_runs() -> None:
    names = ("hull.N_r", "hull.Y_v")
    kernel, shared = Kernel(open_loop(SHIP), names, names), open_loop_parameters(SHIP)
    own = shared[[kernel.system.parameters.index(name) for name in names]]
    plain = turns(0.3)
    lanes = Lanes(kernel, shared, plain.state, plain.series, lanewise=own[None])
    states, found = slopes(lanes, Steps(0.5, 41, 40))
    for k in range(len(names)):
        h = 1e-6 * own[k] * np.eye(len(names))[k]
        up, down = (run(Lanes(kernel, shared, plain.state, plain.series, lanewise=(own + s * h)[None]),
                        Steps(0.5, 41, 40)).values for s in (1.0, -1.0))  # fmt: skip
        wanted = (up - down)[0, -1] / (2.0 * h[k])
        assert found[0, -1, :, k] == pytest.approx(wanted, rel=1e-5, abs=1e-7 * np.abs(wanted).max())
    assert states[0, -1] == pytest.approx(run(lanes, Steps(0.5, 41, 40)).values[0, -1], rel=1e-12)


def test_rates_are_the_first_step_of_a_run() -> None:
    lanes = turns(0.3)
    acting = np.array([[N_P, 0.3, *([0.0] * len(CHANNELS))]])
    rates = lanes.kernel.rates(lanes.state, acting, lanes.shared)
    step = run(lanes, Steps(1e-3, 2, method="euler")).values[0, 1] - lanes.state[0]
    assert rates[0] == pytest.approx(step / 1e-3, rel=1e-9, abs=1e-9)

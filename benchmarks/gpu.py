"""Rates of the engine on a GPU; without one, what its compiler says of the kernels.

A right-hand side is one of the four of a Runge-Kutta step of the closed loop: ship, rudder, shaft and zigzag.  Times
are those of a whole call with the arrays on the device, which waits for its end.
"""

from __future__ import annotations

import io
import math
import re
import sys
import time
from typing import Any

import numpy as np
from timing import best, publish

from seatrial.engine.cuda import DeviceError, lanes
from seatrial.engine.cuda.gpu import ROUNDED
from seatrial.engine.cuda.named import device_of
from seatrial.engine.rollout import sensitivity, simulator
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.loop import closed_loop, loop_memory, loop_values
from seatrial.simulate.run import approach, open_loop, open_loop_parameters

SHIPS, STEPS, DT = 1 << 20, 1001, 0.1
SENSITIVE, TRACKS, LEARNING = 1 << 18, 200_000, 65_536
Row = dict[str, Any]


def row(what: str, value: float, unit: str, bar: str = "-") -> Row:
    return {"what": what, "value": value, "unit": unit, "bar": bar}


class Zigzags:
    """Zigzags of the KVLCC2 model, with its hull's coefficients by lane where asked."""

    def __init__(self, machine: Any, precision: str, ships: int, vary: bool) -> None:
        ship = load("kvlcc2_l7")
        U, n_P = approach(ship)
        policy = Zigzag(n_P=n_P, delta=math.radians(20.0), psi=math.radians(20.0))
        self.system, self.values = closed_loop(ship, policy, DT), loop_values(ship, policy)
        own = tuple(name for name in self.system.parameters if name.startswith("ship.hull.")) if vary else ()
        start = (0.0, 0.0, 0.0, U, 0.0, 0.0)
        memory = np.array(loop_memory(ship, policy, DT, {"policy.n_P": n_P}, start))
        spread = np.random.default_rng(0).uniform(0.9, 1.1, (len(own), ships))
        nominal = np.array([[self.values[name]] for name in own]).reshape(len(own), 1)
        self.made = simulator(self.system, own, device=machine, precision=precision)
        kernel, tile = self.made.kernel, (1, ships)
        self.given = (
            kernel.put(np.tile(np.array(start)[:, None], tile)), kernel.put(np.tile(memory[:, None], tile)),
            kernel.pack(np.broadcast_to(np.zeros((1, 8)), (ships, 1, 8))), kernel.put(nominal * spread),
            np.array(list(self.values.values())),
        )  # fmt: skip

    def run(self, steps: int, every: int) -> Any:
        rows = self.made.kernel.rows(*self.given, t0=0.0, dt=DT, steps=steps, every=every, rk4=True)
        settle(self.made.kernel.device)
        return rows


def settle(machine: Any) -> None:
    """Wait for the device."""
    machine.device.default_stream.sync()


def closed_loops(machine: Any) -> list[Row]:
    found: list[Row] = []
    for precision, bar in (("double", ">= 30"), ("single", ">= 60")):
        for vary in (False, True):
            zigzags = Zigzags(machine, precision, SHIPS, vary)
            seconds = best(lambda z=zigzags: z.run(STEPS, STEPS - 1), 3.0, 3)
            which = "hull coefficients by ship" if vary else "one ship's parameters"
            rate = 4e-9 * (STEPS - 1) * SHIPS / seconds
            found.append(row(f"closed loop, standard MMG, RK4, {precision}, {which}", rate, "1e9 RHS/s", bar))
    return found


def sensitivities(machine: Any) -> list[Row]:
    ship, ships, steps, found = load("kvlcc2_l7"), SENSITIVE, 101, list[Row]()
    system = open_loop(ship)
    free = tuple(name for name in system.parameters if name.startswith("hull."))[:12]
    for precision, bar in (("double", ">= 3"), ("single", "-")):
        made = sensitivity(system, free, device=machine, precision=precision)
        kernel = made.kernel
        state = np.tile(np.array([[0.0, 0.0, 0.0, ship.speed, 0.0, 0.0]]).T, (1, ships))
        series = np.zeros((1, 1, len(system.series)))
        series[..., :2] = approach(ship)[1], 0.2
        given = (kernel.put(state), kernel.pack(np.broadcast_to(series[0], (ships, 1, len(system.series)))),
                 kernel.put(np.zeros((0, ships))), open_loop_parameters(ship))  # fmt: skip

        def run(kernel: Any = kernel, given: Any = given) -> None:
            kernel.rows(*given, dt=DT, steps=steps, every=steps - 1, rk4=True)
            settle(machine)

        rate = 4e-9 * (steps - 1) * ships / best(run, 3.0, 3)
        found.append(row(f"with 12 + 6 sensitivities, {precision}", rate, "1e9 RHS/s", bar))
    return found


def tracks(machine: Any) -> list[Row]:
    """200 000 ships of random parameters, 384 s at 10 Hz, every row kept; in double precision in quarters."""
    found: list[Row] = []
    for precision, parts in (("single", 1), ("double", 4)):
        zigzags = Zigzags(machine, precision, TRACKS // parts, True)
        seconds = parts * best(lambda z=zigzags: z.run(3841, 1), 1.0, 2)
        found.append(row(f"200 000 tracks of 384 s at 10 Hz on the device, {precision}", seconds, "s", "<= 1"))
    return found


def environments(machine: Any) -> list[Row]:
    import gymnasium

    import seatrial.envs

    found: list[Row] = []
    for id in seatrial.envs.IDS:
        for precision in ("double", "single"):
            envs: Any = gymnasium.make_vec(id, num_envs=LEARNING, device=machine, precision=precision)
            envs.reset(seed=0)
            orders = len(envs.lanes.work.orders)
            action = machine.put(np.random.default_rng(0).uniform(-0.3, 0.3, (LEARNING, orders)).astype(np.float32))

            def many(envs: Any = envs, action: Any = action) -> None:
                for _ in range(200):
                    envs.step(action)
                settle(machine)

            rate = 1e-8 * LEARNING * 200 / best(many, 2.0, 3)
            found.append(row(f"{id}, 65 536 ships, {precision}, steps a second", rate, "1e8", ">= 5"))
    return found


def agreement(machine: Any) -> list[Row]:
    """Greatest difference of zigzags from the processor, over the greatest value of each column."""
    ships, steps = 1024, 1001
    zigzags = Zigzags(machine, "double", ships, True)
    rows = np.moveaxis(zigzags.run(steps, 10).host(), -1, 0)
    state, memory, _, own, shared = zigzags.given
    usual = simulator(zigzags.system, zigzags.made.lanewise).run(
        state.host().T, np.zeros((ships, 1, 8)), shared, memory0=memory.host().T, lanewise=own.host().T, dt=DT,
        steps=steps, every=10,
    ).values  # fmt: skip
    size = np.abs(usual).max(axis=(0, 1)) + 1e-30
    off = float((np.abs(rows - usual).max(axis=(0, 1)) / size).max())
    return [row("zigzags of 100 s: difference from the processor", off, "", "<= 1e-9")]


def compiled() -> list[Row]:
    """Registers, local memory and time to compile, as NVRTC has it for an H100; needs no GPU."""
    from cuda.core import Program, ProgramOptions

    ship = load("kvlcc2_l7")
    policy = Zigzag(n_P=approach(ship)[1], delta=math.radians(20.0), psi=math.radians(20.0))
    loop, system, found = closed_loop(ship, policy, DT), open_loop(ship), list[Row]()
    free = tuple(name for name in system.parameters if name.startswith("hull."))[:12]
    for single in (False, True):
        precision, width = ("single", lanes.SINGLE_COLUMNS) if single else ("double", lanes.COLUMNS)
        part = lanes.parts(free, 6, width)[0]
        for name, text in (("rollout", lanes.rollout_code(loop, (), single)),
                           ("sensitivity", lanes.sensitivity_code(system, part, (), single))):  # fmt: skip
            log, begun = io.StringIO(), time.perf_counter()
            options = ProgramOptions(
                arch="sm_90", ptxas_options="-v", disable_warnings=True, **(ROUNDED if single else {})
            )
            Program(text, "c++", options).compile("cubin", logs=log)
            seconds = time.perf_counter() - begun
            told = log.getvalue().partition(f"entry function '{name}'")[2]
            spilled, registers = (
                float(re.findall(p, told)[0]) for p in (r"(\d+) bytes spill stores", r"Used (\d+) reg")
            )
            found += [row(f"{name}, {precision}: registers a thread", registers, "", "<= 255"),
                      row(f"{name}, {precision}: spilled", spilled, "bytes"),
                      row(f"{name}, {precision}: compiled in", seconds, "s")]  # fmt: skip
    return found


def main() -> None:
    """Measure and publish; what takes a device only where there is one."""
    begun, rows = time.perf_counter(), compiled()
    try:
        machine: Any = device_of("cuda")
    except DeviceError as error:
        print(f"{error}\nrates are not measured", file=sys.stderr)
    else:
        print(machine.device.name)
        for part in (agreement, closed_loops, sensitivities, tracks, environments):
            rows += part(machine)
            print(rows[-1])
    publish("gpu", rows)
    print(f"{time.perf_counter() - begun:.0f} s in all")


if __name__ == "__main__":
    main()

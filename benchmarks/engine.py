"""Cost of the engine per right-hand side and lane, and of making and loading its kernels."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from typing import Any

import numpy as np
from timing import best, publish

from seatrial.engine.rollout import sensitivity, simulator
from seatrial.ships.files import load
from seatrial.simulate.run import open_loop, open_loop_parameters
from seatrial.testing import ships

_WHOLE: Any = ships()["rolling"]
# The example with all that the family can carry, without wind and waves, as the standard MMG beside it.
SHIPS = {"rolling": replace(_WHOLE, model=replace(_WHOLE.model, wind=None, waves=None))}
_SIX: Any = ships()["unified"]


def _of(sections: Any, count: int) -> Any:
    """As many sections of the memory as a hull needs, all alike; their sum is the one of the example."""
    one = sections.components[0]
    shared = replace(one, **{k: v / count for k, v in vars(one).items() if k[:2] in ("c_", "d_")})
    return replace(sections, names=tuple(f"m{k}" for k in range(count)), components=(shared,) * count)


# Seven sections a group, as the parabolic hull of the tests has: 96 states.
SHIPS["unified"] = replace(_SIX, model=replace(
    _SIX.model, wind=None, waves=None, longitudinal=_of(_SIX.model.longitudinal, 7),
    transverse=_of(_SIX.model.transverse, 7),
))  # fmt: skip
LANES, STEPS, TWELVE = 128, 500, 12


def prepared(name: str) -> tuple[Any, Any, Any, Any]:
    ship = SHIPS[name] if name in SHIPS else load(name)
    system = open_loop(ship)
    state0 = np.zeros((LANES, len(system.states)))  # what a hybrid remembers is nothing yet
    state0[:, 3] = ship.speed
    series = np.zeros((LANES, STEPS, len(system.series)))
    series[:, :, 0], series[:, :, 1] = ship.n_P or 10.0, np.linspace(-0.5, 0.5, LANES)[:, None]
    return system, state0, series, open_loop_parameters(ship)


def free(system: Any) -> tuple[str, ...]:
    return tuple(n for n in system.parameters if n.startswith("hull."))[:TWELVE]


def rollout_ns(name: str, lanes: int = LANES, threads: int = 1) -> float:
    system, z, s, p = prepared(name)
    z, s = np.resize(z, (lanes, z.shape[1])), np.resize(s, (lanes, *s.shape[1:]))
    engine = simulator(system, back_end="simd")
    packed = engine.pack(s)
    job = lambda: engine.run(z, packed, p, dt=0.02, steps=STEPS, every=STEPS, threads=threads)  # noqa: E731
    return 1e9 * best(job) / (4 * (STEPS - 1) * lanes)


def sensitivity_ns(name: str) -> float:
    system, z, s, p = prepared(name)
    engine = sensitivity(system, free(system), back_end="simd")
    packed = engine.pack(s)
    job = lambda: engine.run(z, packed, p, dt=0.02, steps=STEPS, every=STEPS, method="rk4", threads=1)  # noqa: E731
    return 1e9 * best(job) / (4 * (STEPS - 1) * LANES)


def jacobian_ns(name: str) -> float:
    """Rates with A and B alone: the kernel of one call as a system of its own, stepped by Euler."""
    from seatrial.engine import trace
    from seatrial.engine.cache import library
    from seatrial.engine.csource import HEADER, lane_function

    system, z, s, p = prepared(name)
    j = trace.jacobian(system, free(system))
    width = j.function.size1_out(0)
    source = HEADER + lane_function("jac", j.function, ("lane", "lane", "parameters"), {}) + (
        f"void many(long n,long nb,in Z,in A,in P,out Y){{for(long k=0;k<n;k++)for(long q=0;q<nb;q++)"
        f"jac(Z+q*6*LB,A+q*6*LB,P,P,Y+q*{width}*LB);}}"
    )  # fmt: skip
    import ctypes

    from seatrial.engine.simd import blocks

    code = library(source)
    code.many.argtypes = [ctypes.c_long] * 2 + [ctypes.c_void_p] * 4
    Z, A, P = blocks(z), blocks(s[:, 0]), np.ascontiguousarray(p)
    Y = np.empty((Z.shape[0], width, 16))
    job = lambda: code.many(500, Z.shape[0], *(x.ctypes.data for x in (Z, A, P, Y)))  # noqa: E731
    return 1e9 * best(job) / (500 * LANES)


MAKE = """
import sys, time
sys.path.insert(0, sys.argv[3])
from engine import prepared
from seatrial.engine.rollout import simulator, sensitivity
system = prepared(sys.argv[1])[0]
start = time.perf_counter()
if sys.argv[2] == "rhs":
    simulator(system, back_end="simd")
else:
    kinds = {"all": system.parameters[:-2], "hull": [n for n in system.parameters if n.startswith("hull.")][:12]}
    sensitivity(system, kinds[sys.argv[2]], back_end="simd")
print(time.perf_counter() - start)
"""


def making(name: str, kind: str) -> tuple[float, float]:
    """Seconds to make a kernel with an empty cache, and with the kernel in it."""
    with tempfile.TemporaryDirectory() as folder:
        env, here = {**os.environ, "SEATRIAL_CACHE": folder}, os.path.dirname(__file__)
        call = [sys.executable, "-c", MAKE, name, kind, here]
        run = lambda: float(subprocess.run(call, env=env, capture_output=True, text=True, check=True).stdout)  # noqa: E731
        return run(), min(run() for _ in range(3))


def main() -> None:
    begun = time.perf_counter()
    rows: list[dict[str, Any]] = []

    def row(what: str, value: float, unit: str, bar: str) -> None:
        rows.append({"what": what, "value": value, "unit": unit, "bar": bar})

    row("standard MMG, RK4, 128 lanes, 1 thread", rollout_ns("kvlcc2_l7"), "ns per RHS and lane", "<= 25")
    one, two = rollout_ns("kvlcc2_l7", 2048), rollout_ns("kvlcc2_l7", 2048, 2)
    row("two threads over one, 2048 lanes", one / two, "x", ">= 1.7")
    row("standard MMG, rates with exact A and B (12 parameters)", jacobian_ns("kvlcc2_l7"), "ns per call", "<= 60")
    row("the same within RK4, sensitivities propagated", sensitivity_ns("kvlcc2_l7"), "ns per RHS and lane", "-")
    row("low-speed MMG, RK4, 128 lanes, 1 thread", rollout_ns("esso_osaka_3m"), "ns per RHS and lane", "<= 60")
    for ship, label in (("container_son_nomoto", "container ship with roll"), ("naval_blanke", "naval ship with roll"),
                        ("rolling", "standard MMG with roll")):  # fmt: skip
        row(f"{label}, RK4, 128 lanes, 1 thread", rollout_ns(ship), "ns per RHS and lane", "<= 25")
    row("six degrees of freedom with memory, 96 states, RK4, 128 lanes, 1 thread", rollout_ns("unified"),
        "ns per RHS and lane", "<= 150")  # fmt: skip
    row("hybrid, RK4, 128 lanes, 1 thread", rollout_ns("esso_osaka_3m_hybrid"), "ns per RHS and lane", "<= 150")
    row("low-speed MMG, rates with exact A and B (12 parameters)", jacobian_ns("esso_osaka_3m"), "ns per call", "-")
    for ship, label in (("kvlcc2_l7", "standard MMG"), ("esso_osaka_3m", "low-speed MMG")):
        for kind, meaning, bar in (("rhs", "right-hand side", "<= 2"), ("all", "Jacobians, every parameter", "<= 8")):
            cold, cached = making(ship, kind)
            row(f"{label}, {meaning}: traced and compiled, empty cache", cold, "s", bar)
            row(f"{label}, {meaning}: traced and loaded from the cache", 1e3 * cached, "ms", "<= 60")
    publish("engine", rows)
    print(f"{time.perf_counter() - begun:.0f} s in all")


if __name__ == "__main__":
    main()

"""What tests of co-simulation slaves share: runs of the engine, slaves on disk, and a host that is nothing but C."""

from __future__ import annotations

import math
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from seatrial.environment import Uniform
from seatrial.exchange.fmi.layout import Layout
from seatrial.ships import Ship
from seatrial.simulate.loop import closed_loop
from seatrial.simulate.run import campaign

GCC = shutil.which("gcc")
DT, STEPS = 0.1, 400
AROUND = Uniform(U_T=3.0, gamma_T=1.0, U_C=0.1, gamma_C=2.0)
GIVEN = {"wind.speed": 3.0, "wind.from": 1.0,
         "current_velocity.north": 0.1 * math.cos(2.0), "current_velocity.east": 0.1 * math.sin(2.0)}  # fmt: skip
STATES = ("ned_position.north", "ned_position.east", "ned_position.yaw", "body_velocity.surge", "body_velocity.sway",
          "body_velocity.yaw")  # fmt: skip


@dataclass(frozen=True)
class Run:
    """A run of the engine: states and orders per step, and what they start from."""

    states: np.ndarray
    orders: np.ndarray
    start: dict[str, float]


def flown(ship: Ship, policy: Any, names: tuple[str, ...], speed: float, environment: Any) -> Run:
    run = campaign(ship, policy, {}, speed=speed, duration=STEPS * DT, dt=DT, threads=1, environment=environment)
    stored, rows = closed_loop(ship, policy, DT).stored, run.values[0]
    orders = rows[:-1][:, [stored.index(f"{control}_cmd") for control in ship.model.controls]]
    start = {f"initial.{name}": float(v) for name, v in zip(STATES, rows[0], strict=False)}
    return Run(rows[:, :6], orders, start)


@dataclass(frozen=True)
class Made:
    """A slave on disk."""

    path: Path
    layout: Layout

    def at(self, *names: str) -> list[int]:
        """Value references."""
        every = [real.name for real in self.layout.all]
        return [every.index(name) for name in names]


def assert_same(got: np.ndarray, wanted: np.ndarray, bar: float = 1e-9) -> None:
    """The same to `bar` of the size of each state."""
    size = np.abs(wanted).max(axis=0)
    worst = (np.abs(got - wanted) / np.where(size > 0, size, 1.0)).max()
    assert worst <= bar, f"{worst:.2e}"


def orders(made: Made) -> list[int]:
    return made.at(*(real.name for real in made.layout.inputs if real.name.startswith("order.")))


C_HOST = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2.h"

extern void* __libc_malloc(size_t);
extern void* __libc_calloc(size_t, size_t);
static int taken;
void* malloc(size_t n) { taken++; return __libc_malloc(n); }
void* calloc(size_t n, size_t m) { taken++; return __libc_calloc(n, m); }

int main(int argc, char* argv[])
{
    void* lib = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    fmi2Component (*make)(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions*, int, int);
    fmi2Status (*set)(fmi2Component, const fmi2ValueReference[], size_t, const fmi2Real[]);
    fmi2Status (*get)(fmi2Component, const fmi2ValueReference[], size_t, fmi2Real[]);
    fmi2Status (*enter)(fmi2Component), (*leave)(fmi2Component);
    fmi2Status (*step)(fmi2Component, fmi2Real, fmi2Real, fmi2Boolean);
    fmi2CallbackFunctions nothing;
    fmi2ValueReference order[2], at[6] = {0, 1, 2, 3, 4, 5};
    double o[2], x[6], dt = atof(argv[3]);
    int k, before, bad = 0;
    memset(&nothing, 0, sizeof nothing);
    if (argc < 6 || !lib) { fprintf(stderr, "%s\n", dlerror()); return 2; }
    *(void**)&make = dlsym(lib, "fmi2Instantiate"); *(void**)&set = dlsym(lib, "fmi2SetReal");
    *(void**)&get = dlsym(lib, "fmi2GetReal"); *(void**)&step = dlsym(lib, "fmi2DoStep");
    *(void**)&enter = dlsym(lib, "fmi2EnterInitializationMode");
    *(void**)&leave = dlsym(lib, "fmi2ExitInitializationMode");
    order[0] = (fmi2ValueReference)atoi(argv[4]); order[1] = (fmi2ValueReference)atoi(argv[5]);
    fmi2Component ship = make("ship", fmi2CoSimulation, argv[2], NULL, &nothing, 0, 0);
    if (!ship) return 3;
    for (k = 6; k + 1 < argc; k += 2) {
        fmi2ValueReference one = (fmi2ValueReference)atoi(argv[k]); double v = atof(argv[k + 1]);
        bad += set(ship, &one, 1, &v) != fmi2OK;
    }
    bad += enter(ship) != fmi2OK; bad += leave(ship) != fmi2OK;
    for (k = 0; scanf("%lf %lf", &o[0], &o[1]) == 2; k++) {
        before = taken;
        bad += set(ship, order, 2, o) != fmi2OK;
        bad += step(ship, k * dt, dt, 1) != fmi2OK;
        bad += taken != before;
        bad += get(ship, at, 6, x) != fmi2OK;
        printf("%.17g %.17g %.17g %.17g %.17g %.17g\n", x[0], x[1], x[2], x[3], x[4], x[5]);
    }
    return bad ? 4 : 0;
}
"""

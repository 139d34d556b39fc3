"""A small co-simulation master: a course change of a whole ship, then a hull pushed by a tug.

Run it on the two files that `seatrial export` wrote: python examples/cosimulation.py SHIP.fmu HULL.fmu
"""

from __future__ import annotations

import math
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import fmpy
from fmpy.fmi2 import FMU2Slave

STEP = 0.5


class Slave:
    """One slave, its variables by name."""

    def __init__(self, path: str, folder: str) -> None:
        told = fmpy.read_model_description(path)
        self.names = {variable.name: variable.valueReference for variable in told.modelVariables}
        self.run = FMU2Slave(
            guid=told.guid, unzipDirectory=folder, modelIdentifier=told.coSimulation.modelIdentifier,
            instanceName=told.modelName,
        )  # fmt: skip
        self.t = 0.0

    def set(self, values: Mapping[str, float]) -> None:
        self.run.setReal([self.names[name] for name in values], list(values.values()))

    def __getitem__(self, name: str) -> float:
        return self.run.getReal([self.names[name]])[0]

    def step(self) -> None:
        self.run.doStep(self.t, STEP)
        self.t += STEP


@contextmanager
def slave(path: str) -> Iterator[Slave]:
    """A slave that is initialised, and gone at the end."""
    folder = fmpy.extract(path)
    one = Slave(path, folder)
    one.run.instantiate()
    one.run.setupExperiment(startTime=0.0)
    one.run.enterInitializationMode()
    one.run.exitInitializationMode()
    try:
        yield one
    finally:
        one.run.terminate()
        one.run.freeInstance()
        shutil.rmtree(folder)


def course_change(path: str, to: float) -> None:
    """An autopilot outside steers the whole ship to another course [rad]."""
    with slave(path) as ship:
        for _ in range(round(1200.0 / STEP)):
            rudder = 1.5 * (to - ship["ned_position.yaw"]) - 60.0 * ship["body_velocity.yaw"]
            ship.set({"order.delta": max(-0.35, min(0.35, rudder))})
            ship.step()
        course, rudder = (math.degrees(ship[name]) for name in ("ned_position.yaw", "feedback.delta"))
        speed = ship["body_velocity.surge"]
        sys.stdout.write(f"after {ship.t:g} s on course {course:.1f} deg, {speed:.2f} m/s, rudder {rudder:.1f} deg\n")


def pushed(path: str, force: float) -> None:
    """A tug pushes the hull amidships to starboard [N]; the current sets north."""
    with slave(path) as hull:
        hull.set({"current_velocity.north": 0.5})
        for _ in range(round(300.0 / STEP)):
            hull.set({"external_forces.sway": force})
            hull.step()
        east, north, drift = (hull[name] for name in ("ned_position.east", "ned_position.north", "body_velocity.sway"))
        moved = f"{east:.1f} m to the east, {north:.1f} m to the north"
        sys.stdout.write(f"after {hull.t:g} s {moved}, drifting at {drift:.2f} m/s\n")


if __name__ == "__main__":
    course_change(sys.argv[1], math.radians(20.0))
    pushed(sys.argv[2], 600e3)

"""FMUs of an engine, a governor and a course keeper, and a system of the Open Simulation Platform that joins them."""

from __future__ import annotations

from collections.abc import Sequence

from fmus import Real

# An engine: a lag of the first order behind the order, exact over a step; in rpm, as engines are.
ENGINE = r"""
static void begin(M *m, D *v) { v[1] = v[3]; }
static S step(M *m, D *v, D t, D dt) {
  if (t > 30.0 && v[4] > 0.5) return 3;
  v[1] = v[0] + (v[1] - v[0]) * exp(-dt / v[2]);
  if (v[4] < -0.5) v[1] = NAN;
  return 0;
}
"""
ENGINE_REALS = (
    Real("ordered", 0, unit="rev/min"), Real("shaft", 1, "output", "rpm"), Real("tau", 2, "parameter", "s", 8.0),
    Real("idle", 3, "parameter", "rpm", 60.0), Real("fails", 4, "parameter"),
)  # fmt: skip
# A course keeper.
KEEPER = r"""
static void begin(M *m, D *v) { v[2] = 0; }
static S step(M *m, D *v, D t, D dt) {
  v[2] = 1.5 * (v[3] - v[0]) - v[4] * v[1];
  return 0;
}
"""
KEEPER_REALS = (Real("heading", 0, unit="rad"), Real("rate", 1, unit="rad/s"), Real("rudder", 2, "output", "rad"),
                Real("course", 3, "parameter", "rad", 0.3), Real("T_D", 4, "parameter", "s", 20.0))  # fmt: skip
GOVERNOR = r"""
static void begin(M *m, D *v) { v[1] = 60; }
static S step(M *m, D *v, D t, D dt) { m->kept[0] += dt * (v[2] - v[0]); v[1] = v[2] + 0.02 * m->kept[0]; return 0; }
"""
GOVERNOR_REALS = (Real("turns", 0, unit="rpm"), Real("demand", 1, "output", "rpm"), Real("wanted", 2, unit="rpm"))


def wire(ends: Sequence[str], of: str = "Variable") -> str:
    """A connection of two ends SIMULATOR.NAME."""
    parts = (end.partition(".") for end in ends)
    inside = "".join(f'<{of} simulator="{simulator}" name="{name}"/>' for simulator, _, name in parts)
    return f"<{of}Connection>{inside}</{of}Connection>"


SYSTEM = """<?xml version="1.0" encoding="utf-8"?>
<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">
  <BaseStepSize>0.1</BaseStepSize>
  <Simulators>
    <Simulator name="vessel" source="kvlcc2.fmu"/>
    <Simulator name="diesel" source="engine.fmu">
      <InitialValues><InitialValue variable="tau"><Real value="3"/></InitialValue></InitialValues>
    </Simulator>
    <Simulator name="governor" source="governor.fmu"/>
    <Simulator name="keeper" source="keeper.fmu"/>
  </Simulators>
  <Connections>
WIRES  </Connections>
</OspSystemStructure>
""".replace("WIRES", "".join(map(wire, (
    ("diesel.shaft", "vessel.feedback.n_P"), ("diesel.ordered", "governor.demand"), ("governor.turns", "diesel.shaft"),
    ("vessel.order.n_P", "governor.wanted"), ("vessel.ned_position.yaw", "keeper.heading"),
    ("keeper.rate", "vessel.body_velocity.yaw"), ("keeper.rudder", "vessel.order.delta"),
))))  # fmt: skip

"""Commands on the plant of a ship: export, thrust-map, servo."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from . import options as o
from .render import emit, figure, note, show_table

if TYPE_CHECKING:
    from ..identify.components.servo import ServoFit
    from ..identify.components.thrust_map import ThrustMap

DEGREE = math.pi / 180.0


def export(
    model: o.ShipName, casadi: o.Casadi = None, c: o.CFolder = None, python: o.PythonFile = None,
    actuators: o.ActuatorStep = None, fmu: o.Fmu = None, fmi: o.Fmi = None, hull: o.HullAlone = False,
    dt: o.SlaveStep = None, json: o.Json = False,
) -> None:  # fmt: skip
    """Export a ship as a CasADi function, C, Python or an FMU."""
    from ..workflow.plant import export as run

    made = run(model, casadi=casadi, c=c, python=python, actuators=actuators, fmu=fmu, fmi=fmi, hull=hull, dt=dt,
               note=note)  # fmt: skip
    if json:
        emit({**made.description, "written": made.written})
    else:
        for path in made.written:
            note(f"wrote {path}")


def thrust_map(
    table: o.Pull, out: o.TablesOut = None, thrusters: o.Thrusters = None, together: o.Together = False,
    order: o.Order = None, json: o.Json = False,
) -> None:  # fmt: skip
    """Fit thrust by revolutions to a bollard pull."""
    from ..workflow.plant import thrust_map as run

    found = run(table, out, thrusters, together, order, note)
    if json:
        emit({"table": table, "file": out, "thrusters": {one.name: _map_document(one) for one in found}})
        return
    rows = [
        (one.name, " ".join(f"n^{k}" for k in one.powers), f"{one.n_low:g} to {one.n_max:g}", f"{one.R2:.5f}",
         figure(one.rmse, 3), *(figure(float(c), 5) for c in one.coefficients))
        for one in found
    ]  # fmt: skip
    head = ("thruster", "terms", "tested [1/s]", "R^2", "rmse [N]", *(f"c_{k}" for k in range(6)))
    show_table(head, rows, right=tuple(range(3, 11)))


def servo(trials: o.Trials, control: o.Control = None, out: o.TablesOut = None, json: o.Json = False) -> None:
    """Fit rate, lag and dead time of thrusters or rudders."""
    from ..workflow.plant import servo as run

    read, found = run(trials, control or (), out, note)
    if json:
        emit({"trials": [trial.name for trial in read], "file": out,
              "servos": {one.control: _servo_document(one) for one in found}})  # fmt: skip
        return
    rows = [
        (one.control, *(_with_spread(one, key, DEGREE if key in ("rate", "offset") else 1.0)
                        for key in ("rate", "lag", "dead_time", "offset")),
         figure(one.rmse / DEGREE, 3), f"{one.R2:.5f}", str(one.samples))
        for one in found
    ]  # fmt: skip
    head = ("servo", "rate [deg/s]", "lag [s]", "dead time [s]", "offset [deg]", "rmse [deg]", "R^2", "samples")
    show_table(head, rows, right=(5, 6, 7))


def _with_spread(one: ServoFit, key: str, unit: float) -> str:
    value = one.offset if key == "offset" else float(getattr(one.servo, key))
    return f"{value / unit:.5g} ± {one.sigma[key] / unit:.2g}" if key in one.sigma else "–"


def _map_document(one: ThrustMap) -> Mapping[str, Any]:
    return {
        "coefficients": one.coefficients.tolist(), "sigma": one.sigma.tolist(), "covariance": one.covariance.tolist(),
        "powers": list(one.powers), "n_low": one.n_low, "n_max": one.n_max, "astern": one.astern, "R2": one.R2,
        "rmse": one.rmse, "rows": one.rows,
        "candidates": [{"powers": list(c.powers), "error": c.error, "monotone": c.monotone} for c in one.candidates],
    }  # fmt: skip


def _servo_document(one: ServoFit) -> Mapping[str, Any]:
    return {
        "rate": float(one.servo.rate), "lag": float(one.servo.lag), "dead_time": float(one.servo.dead_time),
        "offset": one.offset, "sigma": dict(one.sigma), "rmse": one.rmse, "R2": one.R2, "samples": one.samples,
        "cautions": list(one.cautions),
    }  # fmt: skip

"""A ship with a residual and states beyond the six as a co-simulation slave: the engine's run, those states too."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slaves import AROUND, DT, GCC, GIVEN, STATES, assert_same

from seatrial.core.parameters import values
from seatrial.exchange import save_fmu
from seatrial.exchange.fmi.fmu import slave
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.approach import approach
from seatrial.simulate.loop import closed_loop
from seatrial.simulate.run import campaign

pytestmark = pytest.mark.skipif(GCC is None or sys.platform != "linux", reason="no C compiler")
STEPS = 3000
REMEMBERED = ("state.slow_wind_x", "state.slow_wind_y", "state.slow_n")


@pytest.fixture(scope="module")
def hybrid() -> Ship:
    """The library's, with a residual that acts: every weight in it, small, and a surface that drifts."""
    ship, rng = load("esso_osaka_3m_hybrid"), np.random.default_rng(2)
    weights = {path: rng.uniform(-0.02, 0.02) for path in values(ship.model) if path.startswith("residual_")}
    assert len(weights) > 20
    return ship.having({**weights, "drift_along": 0.02, "drift_across": 0.005})


@pytest.fixture(scope="module")
def run(hybrid: Ship) -> tuple[np.ndarray, np.ndarray]:
    """States, all nine, and orders of a zigzag in wind and current."""
    speed, n_P = approach(hybrid)
    policy = Zigzag(n_P, math.radians(20.0), math.radians(20.0))
    made = campaign(hybrid, policy, {}, speed=speed, duration=STEPS * DT, dt=DT, threads=1, environment=AROUND)
    stored, rows = closed_loop(hybrid, policy, DT).stored, made.values[0]
    return rows[:, :9], rows[:-1][:, [stored.index(f"{name}_cmd") for name in hybrid.model.controls]]


@pytest.mark.slow
def test_what_is_remembered_has_names_and_units(hybrid: Ship) -> None:
    made = slave(hybrid)
    units = {real.name: real.unit for real in made.outputs}
    assert set(REMEMBERED) <= set(units)
    assert [units[name] for name in REMEMBERED] == ["m/s", "m/s", "1/s"]
    settable = {real.name for real in made.numbers}
    assert {"ship.residual_X.u_U", "ship.drift_along", "ship.tau_shaft"} <= settable
    starts = {real.name: real.start for real in made.starts}
    assert starts["initial.state.slow_n"] == pytest.approx(starts["initial.feedback.n_P"]), "settled to its shaft"


@pytest.mark.long
@pytest.mark.parametrize("fmi", [2, 3])
def test_fmpy_follows_the_engine_for_300_s(
    hybrid: Ship, run: tuple[np.ndarray, np.ndarray], tmp_path: Path, fmi: int
) -> None:
    fmpy = pytest.importorskip("fmpy")
    validation = pytest.importorskip("fmpy.validation")
    states, orders = run
    path = save_fmu(hybrid, tmp_path / "hybrid.fmu", dt=DT, fmi=fmi)[0]
    assert validation.validate_fmu(str(path)) == []
    names = (*STATES, *REMEMBERED)
    start = {f"initial.{name}": float(v) for name, v in zip(names, states[0], strict=True)}
    got = _stepped(fmpy, path, {**GIVEN, **start}, orders, names, hybrid)
    assert_same(got, states)
    assert np.ptp(states[:, 2]) > 0.4, "it turned both ways"
    assert abs(states[-1, 6]) > 0.1, "the water follows the wind"


def _stepped(
    fmpy: Any, path: Path, given: dict[str, float], orders: np.ndarray, names: tuple[str, ...], ship: Ship
) -> np.ndarray:
    every = [real.name for real in slave(ship, dt=DT).all]
    told = fmpy.read_model_description(str(path))
    one = fmpy.instantiate_fmu(fmpy.extract(str(path), str(path.with_suffix(""))), told, fmi_type="CoSimulation")
    of_3 = told.fmiVersion.startswith("3")
    put, ask = (one.setFloat64, one.getFloat64) if of_3 else (one.setReal, one.getReal)
    if not of_3:
        one.setupExperiment(startTime=0.0)
    put([every.index(name) for name in given], list(given.values()))
    one.enterInitializationMode(**({"startTime": 0.0} if of_3 else {}))
    one.exitInitializationMode()
    at, ordered = [every.index(n) for n in names], [every.index(f"order.{n}") for n in ship.model.controls]
    rows = [ask(at)]
    for k, row in enumerate(orders):
        put(ordered, row.tolist())
        one.doStep(k * DT, DT)
        rows.append(ask(at))
    one.terminate()
    one.freeInstance()
    return np.array(rows)

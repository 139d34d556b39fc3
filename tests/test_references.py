"""Whole runs against independent implementations.

The figures of KVLCC2 are in golden/; the full tracks, and those of the Esso Osaka model (whose code is
under a non-commercial licence), lie outside the project, where SEATRIAL_REFS says.
"""

from __future__ import annotations

import math
import os
import tomllib
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array, Trial
from seatrial.environment import Uniform
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

HERE = Path(__file__).parent
REFS = Path(os.environ.get("SEATRIAL_REFS") or HERE.parents[1] / "shared" / "refs")
GOLDEN = tomllib.loads((HERE / "golden" / "kvlcc2.toml").read_text(encoding="utf-8"))
BAR = GOLDEN["tolerance"]
# Long enough for a turn of 540 deg and for three overshoots.
DURATION = {"kvlcc2_l7": {"turn": 200.0, "zigzag": 120.0}, "kvlcc2": {"turn": 1200.0, "zigzag": 700.0}}
CASES = [(ship, run) for ship in DURATION for run in GOLDEN[ship] if run[:4] in ("turn", "zigz")]

every_case = pytest.mark.parametrize(("name", "run"), CASES)


def reference(file: str) -> Array:
    """Rows of a reference track; skips where it is absent."""
    path = REFS / file
    if not path.exists():
        pytest.skip(f"no {file} in {REFS}: reference tracks are not part of the project; set SEATRIAL_REFS")
    return np.genfromtxt(path, delimiter=",", comments="#")


def manoeuvre(run: str, n_P: float) -> Any:
    kind, degrees = run[:-3], math.radians(float(run[-3:]))
    if kind == "turn":
        return Turning(n_P=n_P, delta=degrees)
    return Zigzag(n_P=n_P, delta=abs(degrees), psi=abs(degrees), side=math.copysign(1.0, degrees))


@cache
def flown(name: str, run: str) -> tuple[Any, Any, Trial]:
    ship, golden = load(name), GOLDEN[name]
    policy = manoeuvre(run, golden["n_P"])
    duration = DURATION[name][run[:-3]]
    return ship, policy, simulate(ship, policy, speed=golden["speed"], duration=duration, dt=golden["dt"])


@every_case
def test_kvlcc2_indices(name: str, run: str) -> None:
    ship, policy, trial = flown(name, run)
    want, found = GOLDEN[name][run], policy.indices(trial, ship.L_pp)
    if run.startswith("turn"):
        assert policy.complete(trial)
        side = policy._side
        lengths = {"advance": "advance_L", "transfer": "transfer_L", "tactical_diameter": "tactical_L"}
        for index, key in lengths.items():
            assert found[index].over_L == pytest.approx(want[key], rel=BAR["ratio"])
        assert found["steady_diameter"].over_L == pytest.approx(2 * want["turn_radius_L"], rel=BAR["ratio"])
        U_0 = GOLDEN[name]["speed"]
        assert found["speed_loss"].value == pytest.approx(1 - want["U_end"] / U_0, rel=BAR["ratio"])
        assert math.degrees(found["drift"].value) == pytest.approx(side * want["drift_end_deg"], rel=BAR["ratio"])
        return
    for number, index in enumerate(("first", "second", "third"), 1):
        overshoot = math.degrees(found[f"{index}_overshoot"].value)
        assert overshoot == pytest.approx(want[f"overshoot{number}_deg"], abs=BAR["overshoot_deg"])
        moment = found[f"{index}_reversal"].value
        assert moment == pytest.approx(want[f"t_switch{number}_s"], rel=BAR["ratio"])


@every_case
def test_kvlcc2_tracks(name: str, run: str) -> None:
    rows = reference(f"kvlcc2_{GOLDEN[name]['file']}_{run}.csv")
    ship, _, trial = flown(name, run)
    rows = rows[rows[:, 0] <= trial.t[-1]]
    at = np.rint(rows[:, 0] / GOLDEN[name]["dt"]).astype(int)
    distance = np.hypot(trial["x"][at] - rows[:, 4], trial["y"][at] - rows[:, 5])
    assert distance.max() < BAR["track_over_L"] * ship.L_pp
    assert np.abs(trial["psi"][at] - rows[:, 6]).max() < math.radians(BAR["overshoot_deg"])


@pytest.mark.parametrize("windy", [False, True])
def test_esso_osaka_turns(windy: bool) -> None:
    """The authors hold the rudder of a row over the step after it: our rudder ramps half a step ahead.

    'Calm' of their code is no air at all, so the wind module is taken off.
    """
    rows = reference("mmg1p1r_turn35_wind.csv" if windy else "mmg1p1r_turn+35.csv")
    ship, around = load("esso_osaka_3m"), Uniform(U_T=3.0, gamma_T=math.pi / 2)
    if not windy:
        ship = replace(ship, model=replace(ship.model, wind=None))  # type: ignore[type-var]
    trial = held_rudder(ship, rows, around if windy else Uniform())
    distance = np.hypot(trial[:, 0] - rows[:, 1], trial[:, 1] - rows[:, 3])
    assert distance.max() < 1e-3 * ship.L_pp


def held_rudder(ship: Any, rows: Array, around: Uniform) -> Array:
    """States under the rudder angles of `rows`, each held until the next row, at 10 rps."""
    from seatrial.engine.rollout import simulator
    from seatrial.simulate.run import open_loop, open_loop_parameters

    delta = np.where(np.isfinite(rows[:, 7]), rows[:, 7], rows[-2, 7])
    series = np.column_stack([np.full(delta.size, 10.0), delta, np.tile(around.now(), (delta.size, 1))])
    state0 = np.array([[0.0, 0.0, 0.0, 0.446, 0.0, 0.0]])
    run = simulator(open_loop(ship)).run(
        state0, series[None], open_loop_parameters(ship), dt=0.1, steps=delta.size
    )
    return run.values[0]

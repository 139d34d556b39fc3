"""The catamaran of two logs: what a fit to one foresees of the other, and what neither log can tell."""

from __future__ import annotations

import json
import os
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from usv_rivals import YAW, rivals, steered

from seatrial.cli.app import main
from seatrial.core.parameters import read
from seatrial.data.check.track import own_samples
from seatrial.data.formats import usv_asw
from seatrial.simulate.replay import replay
from seatrial.study.data import smoothed
from seatrial.study.schema import SmootherTable
from seatrial.study.study import read_study

pytestmark = pytest.mark.long
HOME = Path(__file__).parents[2]
STUDY = HOME / "studies" / "usv_asw_twinhull.toml"
ROOT = Path(os.environ.get("SEATRIAL_DATA", HOME.parent / "shared" / "data")) / "usv_asw_twinhull"
RUNS = ("circle", "sin")
OTHER = {"circle": "sin", "sin": "circle"}


@pytest.fixture(scope="module")
def study():
    if not ROOT.exists():
        pytest.skip(f"{ROOT} is not here: set SEATRIAL_DATA to the folder of the public data sets")
    return read_study(STUDY)


@pytest.fixture(scope="module")
def raw(study):
    return {run: usv_asw.read(ROOT / f"boat1_2_{run}.xlsx") for run in RUNS}


@pytest.fixture(scope="module")
def moving(study):
    """The smoothed runs, as the study makes them."""
    return {"circle": study.problem.trials[0], "sin": study.test[0]}


@pytest.fixture(scope="module")
def table(study, raw, moving):
    """Errors on the run that was not trained on, by model, and of the six parameters on their own run."""
    found = {}
    for run in RUNS:
        seen, unseen = steered(moving[run]), steered(raw[OTHER[run]])
        for name, rival in rivals(study).items():
            more = {"starts": 12} if name == "Nomoto" else {}  # from one start it ends in a poor valley
            fitted = rival.fitted(study, seen, **more) if rival.free else rival
            found[name, OTHER[run]] = fitted.errors(unseen)
            if name == "6 parameters":
                found["own", run] = fitted.errors(steered(raw[run]))
                found["fit", run] = fitted
        found["untrained", OTHER[run]] = rivals(study)["6 parameters"].errors(unseen)
    for (name, run), errors in found.items():
        if name != "fit":
            told = (f"{h:4.0f} s {a:6.2f} m {np.degrees(b):5.1f} deg {c:6.2f} m" for h, (a, b, c) in errors.items())
            sys.stdout.write(f"{run:8}{name:20}{''.join(told)}\n")  # the table of docs/published.md, with -s
    return found


def ratios(table, one, other, run):
    """Position and heading error of one over another, at 10 and 30 s."""
    mine, yours = table[one, run], table[other, run]
    return np.array([[mine[h][k] / yours[h][k] for h in mine] for k in (0, 1)])


@pytest.mark.parametrize("run", RUNS)
def test_six_parameters_on_the_unseen_run(table, run):
    position, heading = ratios(table, "6 parameters", "constant velocity", run)
    assert position.max() < 0.65
    assert heading.max() < 0.5
    # a steering model with a wandering rudder bias is nearly as good: these logs hold little more
    position, heading = ratios(table, "6 parameters", "Nomoto", run)
    assert position.max() < 1.1
    assert heading.max() < 1.0
    # training matters, and not only the disturbances that the filter follows
    position, heading = ratios(table, "6 parameters", "untrained", run)
    assert position.max() < 0.75
    assert heading.max() < 0.7


@pytest.mark.parametrize("run", RUNS)
def test_it_foresees_the_unseen_run_as_well_as_one_trained_there(table, run):
    assert np.abs(ratios(table, "6 parameters", "own", run) - 1.0).max() < 0.12


@pytest.mark.parametrize("run", RUNS)
def test_more_parameters_foresee_worse(table, run):
    assert ratios(table, "10 parameters", "6 parameters", run).min() > 1.0


def test_only_ratios_of_thrust_and_mass(study, moving, table):
    ship = table["fit", "circle"].ship
    paths = [*(f.path for f in study.problem.free), "thrusters.port.T_1", "thrusters.starboard.T_1"]
    now = {path: _value(ship, path) for path in paths}
    heavy = ship.having({path: 3.0 * value for path, value in now.items()})
    one, other = (replay(s, moving["sin"], restart=10.0) for s in (ship, heavy))
    for name in ("x", "y", "psi", "u", "v_m", "r"):
        assert np.abs(one[name] - other[name]).max() < 1e-9


def _value(ship, path):
    return float(read(ship.model, path))


def test_what_both_runs_agree_on(table):
    """Steady gains do, masses and drag within a fifth or so; sway is nobody's."""
    ships = [table["fit", run].ship for run in RUNS]

    def far(path):
        a, b = (_value(ship, path) for ship in ships)
        return abs(a / b - 1.0)

    assert far("damping.N_r") < 0.05
    assert far("damping.X_u") < 0.15
    assert far("inertia.m_33") < 0.25
    assert far("inertia.m_11") < 0.25
    assert far("damping.Y_v") > 0.3


def test_the_lever_scales_yaw_alone(study, moving, raw, table):
    """With twice the lever the yaw numbers double; the other run is foreseen alike."""
    wide = rivals(study)["6 parameters"]
    wide = replace(wide, ship=wide.ship.having({"thrusters.port.y": -0.6, "thrusters.starboard.y": 0.6}))
    doubled = {"inertia.m_33", "damping.N_r", YAW}
    freed = tuple(
        replace(f, start=2.0 * f.start, prior=2.0 * f.prior, sigma=2.0 * f.sigma) if f.path in doubled else f
        for f in wide.free
    )
    wide = replace(wide, free=freed, disturbances={YAW: 0.1}, walk={YAW: 0.006}).fitted(study, moving["circle"])
    near = table["fit", "circle"].ship
    assert _value(wide.ship, "damping.N_r") / _value(near, "damping.N_r") == pytest.approx(2.0, rel=0.15)
    assert _value(wide.ship, "inertia.m_33") / _value(near, "inertia.m_33") == pytest.approx(2.0, rel=0.15)
    errors, before = wide.errors(raw["sin"]), table["6 parameters", "sin"]
    assert [errors[h][0] / before[h][0] for h in errors] == pytest.approx([1.0, 1.0], abs=0.1)


def test_sway_hangs_on_where_the_antenna_stands(study, raw):
    said = read_smoother()
    found = []
    for x in (-0.4, 0.4):
        trial = smoothed(replace(said, antenna=(x, 0.0)), study.problem.ship, raw["circle"])
        fitted = rivals(study)["6 parameters"].fitted(study, trial)
        found.append(fitted)
    Y_v = [_value(f.ship, "damping.Y_v") for f in found]
    assert Y_v[0] / Y_v[1] > 3.0
    heading = [f.errors(raw["sin"], antenna=(x, 0.0))[30.0][1] for f, x in zip(found, (-0.4, 0.4), strict=True)]
    assert heading[0] / heading[1] == pytest.approx(1.0, abs=0.1)


def read_smoother():
    return SmootherTable(**tomllib.loads(STUDY.read_text())["data"]["smoother"])


def test_the_innovation_test_rings(raw, table):
    """At the first seconds (a turn with one propeller astern), and in the loop's own swing late on the circle."""
    found = table["fit", "sin"].filter().run(table["fit", "sin"].ship, own_samples(raw["circle"]))
    loud = [w.start for w in found.consistency.windows if w.nis > w.limit]
    assert not found.consistency.fits
    assert loud[0] == 0.0
    assert min(loud[1:]) > 130.0
    assert len(loud) < 0.4 * len(found.consistency.windows)


def test_the_command_line(study, table, tmp_path, capsys):
    assert main(["identify", str(STUDY), "-o", str(tmp_path / "run"), "--details"]) == 0
    page = (tmp_path / "run" / "report.html").read_text()
    told = capsys.readouterr()
    assert "damping.N_r" in told.out
    assert "forecast of boat1_2_sin over 10 s, fitted: 0.31" in told.out
    found = json.loads((tmp_path / "run" / "report.json").read_text())
    names = {"fitted": "6 parameters", "untuned": "untrained", "constant velocity": "constant velocity"}
    assert len(found["forecasts"]) == 6
    for f in found["forecasts"]:
        errors = (f["position"], f["heading"], f["end"])
        assert errors == pytest.approx(table[names[f["label"]], "sin"][f["horizon"]], rel=0.02)
    # better by the score, and yet not: the head says so, and what is assumed stands in the report
    assert any(line.startswith("position after 1, 2, 5 s") for line in found["worse"]["untuned"])
    assert any(line.startswith("y (1.2") for line in found["worse"]["constant velocity"])
    assert "greater error of position after 1, 2, 5 s" in page
    assumed = {a["path"] for a in found["assumptions"]}
    assert {"thrusters.port.T_1", "thrusters.starboard.T_1", "thrusters.port.y", "thrusters.starboard.y"} <= assumed
    status = {v["subject"]: v["status"] for v in found["fit"]["verdicts"]}
    unknown = {name for name, said in status.items() if said == "not identified"}
    assert unknown == {"damping.Y_v", "inertia.m_22", "thrusters.port.T_1", "thrusters.port.y"}
    assert "taken at even steps by interpolation" in told.err

"""By what scales and beside which ship a fit is judged, and in which currents."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.data.trialfile import write_trial
from seatrial.environment import Uniform
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.ships.writing import save
from seatrial.simulate.run import approach, simulate

STUDY = """schema = "seatrial-study/1"
ship = "mine.toml"
[data]
root = "logs"
train = ["a", "b"]
[free]
"hull.N_r" = { prior = 0.5 }
[loss]
sigma = { x = 9.0, y = 9.0, psi = 0.5, u = 0.1, v_m = 0.1, r = 0.1 }
[nuisance]
current = 0.3
[estimator]
type = "shooting:Trajectory"
window = 30.0
iterations = 8
"""


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of a fit that begins from a ship file of the user's own; `a` and `b` met an unlogged current."""
    at = tmp_path_factory.mktemp("own")
    ship = load("kvlcc2_l7")
    (at / "logs").mkdir()
    for name, side, towards in (("a", 1.0, 0.5), ("b", -1.0, 2.0)):
        run = simulate(ship, Zigzag(approach(ship)[1], 0.35, 0.35, side), duration=60.0, dt=0.1, every=5, name=name,
                       environment=Uniform(U_C=0.2, gamma_C=towards))  # fmt: skip
        kept = {k: v for k, v in run.channels.items() if k not in ("U_C", "gamma_C")}
        write_trial(replace(run, channels=kept), at / "logs" / f"{name}.csv")
    save(replace(ship.having({"hull.N_r": 1.3 * float(ship.model.hull.N_r)}), name="mine"), at / "mine.toml")
    (at / "study.toml").write_text(STUDY)
    assert main(["identify", str(at / "study.toml"), "-o", str(at / "run"), "--json"]) == 0
    return at


def judged(at: Path, model: str, capsys: pytest.CaptureFixture[str], *more: str) -> dict:
    capsys.readouterr()
    assert main(["validate", model, str(at / "logs"), "--json", *more]) == 0
    return json.loads(capsys.readouterr().out)


def test_two_models_are_judged_by_the_same_scales(fitted: Path, capsys) -> None:
    """Constant velocity knows no model, so its error tells by what was divided."""
    fit = str(fitted / "run" / "model.toml")
    ours, theirs = (judged(fitted, m, capsys)["standardised"]["constant velocity"] for m in (fit, "kvlcc2_l7"))
    assert ours == pytest.approx(theirs, rel=1e-9)
    scaled = [judged(fitted, m, capsys, "--scale", fit)["standardised"] for m in (fit, "kvlcc2_l7")]
    assert scaled[0]["constant velocity"] == pytest.approx(scaled[1]["constant velocity"], rel=1e-9)
    assert scaled[0]["constant velocity"] != pytest.approx(ours, rel=1e-2)
    assert main(["validate", fit, str(fitted / "logs"), "--scale", "kvlcc2"]) == 2


def test_a_fit_from_a_ship_file_is_judged_beside_that_ship(fitted: Path, capsys) -> None:
    said = judged(fitted, str(fitted / "run" / "model.toml"), capsys)["standardised"]
    assert said["fitted"] < said["untuned"]
    mine = judged(fitted, str(fitted / "mine.toml"), capsys)["standardised"]["mine"]
    assert math.isfinite(mine)


def test_the_estimated_current_acts_on_the_trials_it_was_estimated_on(fitted: Path, capsys) -> None:
    capsys.readouterr()
    fit = str(fitted / "run" / "model.toml")
    assert main(["validate", fit, str(fitted / "logs"), "--json"]) == 0
    told = capsys.readouterr()
    assert "a: a current of" in told.err
    errors = json.loads(told.out)["trials"]["a"]["fitted"]["metrics"]
    assert errors["x"]["rmse"] < 1.0  # 0.2 m/s over 60 s are 12 m

"""Numbers that no arithmetic can use are refused in a line that names the key, before anything runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.turning import Turning
from seatrial.ships.files import load
from seatrial.ships.writing import save
from seatrial.simulate.run import approach, simulate

STUDY = """schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "."
train = ["a"]
[free]
"hull.N_r" = { prior = 0.3 }
"hull.N_v" = { sigma = 0.3 }
[loss]
sigma = { x = 1.0, y = 1.0, psi = 0.1, u = 0.1, v_m = 0.1, r = 0.1 }
correlation = 5.0
[nuisance]
current = 0.25
initial = { u = 0.125 }
[report]
restart = 50.0
[estimator]
type = "shooting:Trajectory"
window = 30.0
tolerance = 1e-6
"""
PLACES = ("prior = 0.3", "sigma = 0.3", "x = 1.0", "correlation = 5.0", "current = 0.25", "u = 0.125",
          "restart = 50.0", "window = 30.0", "tolerance = 1e-6")  # fmt: skip
NUMBERS = ("inf", "nan", "5e-324", "1e308", "-1e308", "9" * 400, "9" * 5000)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    at = tmp_path_factory.mktemp("numbers")
    ship = load("kvlcc2_l7")
    write_trial(simulate(ship, Turning(approach(ship)[1], 0.3), duration=60, dt=0.1, every=5, name="a"), at / "a.csv")
    return at


@pytest.mark.parametrize("place", PLACES)
def test_a_study_with_such_a_number_is_refused(place: str, folder: Path, monkeypatch, capsys) -> None:
    monkeypatch.setattr("seatrial.identify.trajectory.shooting.Trajectory.fit", lambda *_, **__: pytest.fail("it ran"))
    free = place.startswith("u ")  # an initial state without a prior is a choice
    for number in NUMBERS[free:]:
        key = place.partition(" = ")[0]
        (folder / "study.toml").write_text(STUDY.replace(place, f"{key} = {number}"))
        assert main(["identify", str(folder / "study.toml"), "-o", str(folder / "run")]) == 2, number
        (line,) = [one for one in capsys.readouterr().err.splitlines() if not one.startswith(("note", "warning"))]
        assert line.startswith("error: ")
        assert "study.toml" in line
        assert not (folder / "run").exists()


@pytest.mark.parametrize("number", ["inf", "nan", "1e308", "-1e308", "5e-324", "9" * 400, "9" * 5000])
def test_a_ship_with_such_a_number_is_refused(number: str, tmp_path: Path, capsys) -> None:
    path = save(load("kvlcc2_l7"), tmp_path / "ship.toml")
    path.write_text(re.sub(r"(\nN_r = \{ \w+ = )[^,}]+", rf"\g<1>{number}", path.read_text(), count=1))
    assert main(["simulate", str(path), "zigzag"]) == 2
    (told,) = capsys.readouterr().err.splitlines()
    assert "ship.toml" in told
    assert "N_r" in told or len(number) == 5000


def test_a_ship_file_that_is_nested_without_end_is_refused(tmp_path: Path, capsys) -> None:
    path = tmp_path / "ship.toml"
    path.write_text('schema = "seatrial-ship/1"\nx = ' + "[" * 50_000 + "]" * 50_000)
    assert main(["show", str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1

"""`seatrial thrust-map` and `seatrial servo`, and what `show` and `simulate` say of a doubtful mass matrix."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

EQ_20 = (0.0722, 1.974, 0.151, 0.04978, 0.001187, -0.0001773)
ROOT = Path(__file__).parents[2]


def pull(n: float) -> float:
    return sum(c / 2 * n**k for k, c in enumerate(EQ_20))


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """Equation 20 for two thrusters, one with a row left open; revolutions in rpm."""
    rows = [f"{60 * n},{pull(n)!r},{'' if n == 3 else repr(1.1 * pull(n))}" for n in np.linspace(0, 10, 21).tolist()]
    path = tmp_path / "pull.csv"
    path.write_text("\n".join(["n [rpm],T_1 [N],T_2 [N]", *rows]) + "\n")
    return path


@pytest.mark.slow
def test_a_thrust_map_for_each_thruster(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = table.with_name("map.toml")
    assert main(["thrust-map", str(table), "-o", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["thrusters"]
    assert told["1"]["coefficients"] == pytest.approx([c / 2 for c in EQ_20], rel=1e-6)
    assert told["2"]["coefficients"][1] == pytest.approx(1.1 * EQ_20[1] / 2, rel=1e-6)
    assert (told["1"]["rows"], told["2"]["rows"], told["1"]["n_max"]) == (21, 20, 10.0)
    assert pytest.approx(1.0) == told["1"]["R2"]
    assert told["1"]["rmse"] < 1e-6


@pytest.mark.slow
def test_the_tables_it_writes_make_a_ship(table: Path, tmp_path: Path) -> None:
    """Put in the place of those of the tug they give the tug."""
    assert main(["thrust-map", str(table), "-o", str(tmp_path / "map.toml")]) == 0
    made = (tmp_path / "map.toml").read_text()
    assert set(tomllib.loads(made)) == {"thrusters", "actuators"}
    text = (ROOT / "src" / "seatrial" / "ships" / "qiuxin5.toml").read_text()
    text = re.sub(r"\[(thrusters|actuators)\.(n_)?\d\]\n(?:[^\[\n].*\n)+", "", text)
    for y in ("0.163", "-0.163"):
        where = "".join(f'{k} = {{ value = {v}, unit = "m", source = "test" }}\n' for k, v in (("x", -0.8), ("y", y)))
        made = made.replace("# x and y, the position [m], are to be added\n", where, 1)
    (tmp_path / "tug.toml").write_text(f"{text}\n{made}")
    part = load(tmp_path / "tug.toml").model.thrusters.components[0]  # type: ignore[attr-defined]
    assert part.thrust(7.0) == pytest.approx(pull(7.0), rel=1e-6)
    assert (part.y, part.n_max) == (0.163, 10.0)


def test_both_tested_together(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "pull.csv"
    path.write_text("n [1/s],T [N]\n" + "".join(f"{n},{2 * pull(n)!r}\n" for n in range(11)))
    assert main(["thrust-map", str(path), "--together", "--thrusters", "1,2", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["thrusters"]
    assert told["1"]["coefficients"] == told["2"]["coefficients"] == pytest.approx([c / 2 for c in EQ_20], rel=1e-5)
    assert main(["thrust-map", str(path), "--together"]) == 2
    assert "--thrusters 1,2" in capsys.readouterr().err


@pytest.mark.parametrize(("change", "options", "words"), [
    (("T_2 [N]", "T_2 [m]"), [], "column 'T_2 [m]'"),
    (("T_2 [N]", "T_1 [N]"), [], "named twice"),
    (("n [rpm]", "n_1 [rpm]"), [], "no revolutions; add n [1/s] or n_2 [1/s]"),
    (("", ""), ["--thrusters", "1"], "thrust of 2 thrusters (1, 2), the ship has 1 (1)"),
    (("600.0,", "600.0,-"), [], "not monotone"),
    (("600.0,", "600.0,x"), [], "is not a number"),
    (("", ""), ["-o", "map.csv"], "ends in .toml"),
    (("", ""), ["-o", "nowhere/map.toml"], "no such folder"),
    (("", ""), ["--order", "9"], "from 1 to 5"),
])  # fmt: skip
def test_bad_tables_in_one_line(
    table: Path, capsys: pytest.CaptureFixture[str], change: tuple[str, str], options: list[str], words: str
) -> None:
    table.write_text(table.read_text().replace(*change) if change[0] else table.read_text())
    assert main(["thrust-map", str(table), *options]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(("text", "words"), [
    ("n [1/s],T_1 [N]\n", "no rows below the heading"),
    ("n [1/s],T_1 [N]\n1,\n2,\n3,\n", "column 'T_1 [N]': no row has both"),
    ("n [1/s],T_1 [N]\n0,0\n1,0\n2,0\n3,0\n", "thrust is zero in every row"),
])  # fmt: skip
def test_tables_without_thrust(tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, words: str) -> None:
    (tmp_path / "pull.csv").write_text(text)
    assert main(["thrust-map", str(tmp_path / "pull.csv")]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


@pytest.mark.slow
def test_what_it_did_not_write_it_does_not_replace(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ship, out, folder = (table.with_name(name) for name in ("tug.toml", "map.toml", "folder.toml"))
    text = (ROOT / "src" / "seatrial" / "ships" / "qiuxin5.toml").read_text()
    ship.write_text(text)
    assert main(["thrust-map", str(table), "-o", str(ship)]) == 2
    assert "did not write" in capsys.readouterr().err
    assert ship.read_text() == text
    folder.mkdir()
    assert main(["thrust-map", str(table), "-o", str(folder)]) == 2
    said = capsys.readouterr().err
    assert "is a folder" in said
    assert said.count("\n") == 1
    for _ in range(2):
        assert main(["thrust-map", str(table), "-o", str(out)]) == 0
    assert "thruster 2: 1 of 21 rows" in capsys.readouterr().err
    out.write_text(out.read_text().partition("[thrusters.1]")[0] + "[actuators.alpha_1]\n")  # as of servo
    assert main(["thrust-map", str(table), "-o", str(out)]) == 2
    assert not [p for p in table.parent.iterdir() if p.name.startswith(".")]


@pytest.mark.long
def test_servos_of_a_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ship = load("qiuxin5")
    run = simulate(ship, Zigzag(approach(ship)[1], 0.35, 0.35), speed=ship.speed, duration=60.0, dt=0.2, name="log")
    write_trial(run, tmp_path / "log.csv")
    out = tmp_path / "servo.toml"
    assert main(["servo", str(tmp_path / "log.csv"), "-o", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)["servos"]
    assert told["alpha_1"]["rate"] == pytest.approx(0.1151, rel=1e-5)
    assert told["alpha_2"]["rate"] == pytest.approx(0.1161, rel=1e-5)
    tables = tomllib.loads(out.read_text())["actuators"]
    assert tables["alpha_1"]["type"] == "Azimuth"
    assert tables["alpha_1"]["rate"]["unit"] == "rad/s"
    assert main(["servo", str(tmp_path / "log.csv"), "--control", "alpha_2"]) == 0
    said = capsys.readouterr().out
    assert "6.65" in said
    assert "alpha_1" not in said
    assert main(["servo", str(tmp_path / "log.csv"), "--control", "alpha_7"]) == 2
    assert "alpha_7" in capsys.readouterr().err


def test_a_doubtful_mass_matrix_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "qiuxin5", "--json"]) == 0
    caught = capsys.readouterr()
    assert "M is not symmetric (m_23 = 1.1254, m_32 = -16.0598)" in caught.err
    assert json.loads(caught.out)["doubts"]
    assert main(["simulate", "qiuxin5", "straight", "--duration", "5", "--json"]) == 0
    assert "warning: qiuxin5: M is not symmetric" in capsys.readouterr().err
    assert main(["show", "kvlcc2", "--json"]) == 0
    caught = capsys.readouterr()
    assert (caught.err, json.loads(caught.out)["doubts"]) == ("", [])


def test_revolutions_that_were_not_tested_are_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["simulate", "qiuxin5", "straight", "--rps", "15"]) == 2
    assert re.search(r"\bn_1 of qiuxin5\b.*\b0 to 10 1/s", capsys.readouterr().err)
    ship = load("qiuxin5")
    run = simulate(ship, Zigzag(approach(ship)[1], 0.35, 0.35), speed=ship.speed, duration=20.0, dt=0.2, name="fast")
    write_trial(run.having(n_2=run["n_2"] + 6.0), tmp_path / "fast.csv")
    assert main(["predict", "qiuxin5", str(tmp_path / "fast.csv"), "-o", str(tmp_path / "out")]) == 0
    assert re.search(r"\bfast: n_2\b.*\b13\.03\b", capsys.readouterr().err)

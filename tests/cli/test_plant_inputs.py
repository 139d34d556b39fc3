"""Logs and ships that no plant can be fitted from: one line and exit status 2, or a warning and a fit."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import Trial
from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship
from seatrial.ships.files import load, save
from seatrial.simulate.run import approach, simulate

STUDY = """schema = "seatrial-study/1"
ship = "{ship}"
[data]
train = ["log"]
[free]
"damping.Y_v" = {{ prior = 0.3 }}
[estimator]
type = "shooting:Trajectory"
window = {window}
iterations = 1
"""
CATAMARAN = Path(__file__).parents[2] / "studies" / "ships" / "usv_asw_twinhull.toml"


@pytest.fixture(scope="module")
def log() -> Trial:
    ship = load("qiuxin5")
    return simulate(ship, Zigzag(approach(ship)[1], 0.35, 0.35), speed=ship.speed, duration=30, dt=0.2, name="log")


@pytest.fixture
def identify(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    def run(trial: Trial, ship: str = "qiuxin5", window: float = 10.0) -> tuple[int, list[str]]:
        write_trial(replace(trial, meta={k: v for k, v in trial.meta.items() if k != "ship"}), tmp_path / "log.csv")
        (tmp_path / "study.toml").write_text(STUDY.format(ship=ship, window=window))
        status = main(["identify", str(tmp_path / "study.toml"), "-o", str(tmp_path / "run")])
        assert status != 2 or not (tmp_path / "run").exists()
        return status, capsys.readouterr().err.strip().splitlines()

    return run


REFUSED = {
    "beyond the thrust map": (
        lambda t: t.having(n_1=t["n_1"] + 5.0), "n_1 goes from 12.03 to 12.03 1/s, thrust was tested from 0 to 10 1/s"),
    "a column too many": (
        lambda t: t.having(n_3=t["n_1"]), "commands thrusters by n_3 that qiuxin5 lacks (it has 1, 2)"),
    "a column too few": (
        lambda t: replace(t, channels={k: v for k, v in t.channels.items() if k not in ("n_2", "n_2_cmd", "n_P")}),
        "no channel n_2"),
    "degrees, azimuth": (
        lambda t: t.having(alpha_1=np.degrees(t["alpha_1"])), "direction of the thrust is in degrees"),
    "degrees, heading": (lambda t: t.having(psi=np.degrees(t["psi"])), "psi is in deg"),
    "too short": (lambda t: t.rows(slice(0, 40)), "lasts 7.8 s, estimator.window is 10 s"),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", REFUSED)
def test_refused_in_one_line(identify, log: Trial, case: str) -> None:
    change, words = REFUSED[case]
    status, told = identify(change(log))
    assert status == 2
    assert len(told) == 1
    assert words in told[0]


@pytest.mark.long
def test_uneven_rows_are_fitted_with_a_warning(identify, log: Trial) -> None:
    kept = np.array([k for k in range(len(log)) if k % 7 != 3], dtype=np.intp)
    status, told = identify(log.rows(kept))
    assert status == 0, told
    assert any("steps differ from 0.2 s" in line and line.startswith("warning") for line in told)


@pytest.mark.long
def test_a_mass_matrix_of_no_body_is_fitted_with_a_warning(identify, log: Trial, tmp_path: Path) -> None:
    tug: Ship = load("qiuxin5").having({"inertia.m_23": 1000.0, "inertia.m_32": 1000.0})
    save(tug, tmp_path / "strange.toml")
    status, told = identify(log, "strange.toml", 2.0)
    assert status == 0, told
    assert any(line.startswith("warning") and "M is not positive definite" in line for line in told)


@pytest.fixture
def catamaran_log() -> Trial:
    t = 0.1 * np.arange(300)
    psi = 0.3 * np.sin(0.3 * t)
    r, u = 0.09 * np.cos(0.3 * t), np.full_like(t, 0.7)
    x, y = (np.concatenate([[0.0], np.cumsum(0.07 * f(psi[:-1]))]) for f in (np.cos, np.sin))
    channels = {"x": x, "y": y, "psi": psi, "u": u, "v_m": -0.1 * r, "r": r}
    for side, sign in (("port", 1), ("starboard", -1)):
        channels[f"throttle_{side}"] = 0.4 + sign * 0.1 * np.cos(0.3 * t)
    return Trial("log", t, channels)


@pytest.mark.long
def test_pulse_widths_are_no_throttle(identify, catamaran_log: Trial, tmp_path: Path) -> None:
    (tmp_path / "cat.toml").write_text(CATAMARAN.read_text())
    pulses = catamaran_log.having(throttle_port=1500.0 + 500.0 * catamaran_log["throttle_port"])
    status, told = identify(pulses, "cat.toml")
    assert status == 2
    assert len(told) == 1
    assert re.search(r"throttle_port\b.*\b1650\b.*\b1750\b.*-1\b.*\b1\b", told[0])
    status, told = identify(catamaran_log, "cat.toml")
    assert status == 0, told


def test_a_fixed_thruster_whose_thrust_falls(identify, catamaran_log: Trial, tmp_path: Path) -> None:
    (tmp_path / "cat.toml").write_text(CATAMARAN.read_text().replace("T_1 = { value = 1.0", "T_1 = { value = -1.0", 1))
    status, told = identify(catamaran_log, "cat.toml")
    assert status == 2
    assert len(told) == 1
    assert "thrusters.port" in told[0]


@pytest.mark.slow
def test_a_smoother_that_cannot_be(identify, catamaran_log: Trial, tmp_path: Path, capsys) -> None:
    (tmp_path / "cat.toml").write_text(CATAMARAN.read_text())
    write_trial(catamaran_log, tmp_path / "log.csv")
    for table, words in (
        ("position = 0.02", "data.smoother.heading is missing"),
        ("position = 0.02\nheading = 0.01\nantena = [0, 0]", "near: antenna"),
        ('position = 0.02\nheading = 0.01\nparameters = { "damping.N_uu" = 0.1 }', "near: damping.N_u"),
        ("position = 0.02\nheading = 0.01\nprocess = { w = 0.1 }", "no state of the filter 'w'"),
        ("position = 0.0\nheading = 0.01", "data.smoother.position is 0.0"),
    ):
        study = STUDY.format(ship="cat.toml", window=10.0).replace("[free]", f"[data.smoother]\n{table}\n[free]")
        (tmp_path / "study.toml").write_text(study)
        assert main(["identify", str(tmp_path / "study.toml"), "-o", str(tmp_path / "run")]) == 2
        told = capsys.readouterr().err.strip()
        assert len(told.splitlines()) == 1
        assert words in told

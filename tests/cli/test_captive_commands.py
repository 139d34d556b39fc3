"""seatrial captive and seatrial scale: what they write, and what they refuse in one line."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import pytest

from seatrial.cli.app import main
from seatrial.core.parameters import read
from seatrial.ships.files import load

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("captive")
    runpy.run_path(str(EXAMPLES / "captive_tables.py"))["write"](folder)
    return folder


def run(capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str, str]:
    capsys.readouterr()
    status = main([str(one) for one in arguments])
    out, err = capsys.readouterr()
    return status, out, err


@pytest.mark.slow
def test_captive_tests_become_a_ship(tables: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "tested.toml"
    status, text, _ = run(capsys, "captive", "kvlcc2_l7", *sorted(tables.glob("*.csv")), "-o", out, "--json")
    said = json.loads(text)
    assert status == 0
    assert said["parameters"]["hull.N_r"]["verdict"] == "identified"
    assert "PMM" in said["held"]["body.m_y"]
    ship = load(out)
    truth = load("kvlcc2_l7")
    assert ship.entries["hull.N_r"].source.startswith("captive tests: 107 runs")
    for path in ("hull.Y_v", "hull.N_r", "rudder.a_H", "propeller.w_P0"):
        assert abs(read(ship.model, path) - read(truth.model, path)) < 4.0 * (ship.entries[path].sigma or 0.0), path


@pytest.mark.long
def test_the_page_draws_every_kind_of_test(tables: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"
    status, *_ = run(capsys, "captive", "kvlcc2_l7", *sorted(tables.glob("*.csv")), "--report", page)
    shown = page.read_text(encoding="utf-8")
    assert status == 0
    assert all(kind in shown for kind in ("drift + yaw + rudder", "rudder (other load)", "measured − computed"))


def test_only_what_is_asked_for_is_fitted(tables: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, text, _ = run(capsys, "captive", "kvlcc2_l7", tables / "rudder.csv", "--free", "rudder.a_H", "--json")
    assert status == 0
    assert list(json.loads(text)["parameters"]) == ["rudder.a_H"]


def test_a_model_at_full_scale(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "full.toml"
    status, text, _ = run(capsys, "scale", "kvlcc2_l7", "--to-length", 320, "-o", out, "--json")
    said = json.loads(text)
    assert status == 0
    assert load(out).L_pp == pytest.approx(320.0)
    assert said["effects"]["propeller.w_P0"]["after"] < 0.35
    assert said["self_propulsion"]["after"]["n_P"] < said["self_propulsion"]["before"]["n_P"] / 6.76
    status, text, _ = run(capsys, "scale", out, "--to-length", 7, "--json")
    assert json.loads(text)["effects"]["hull.R_0"]["after"] == pytest.approx(0.022)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [(["captive", "kvlcc2_l7", "none.csv"], "none.csv: no such file"),
     (["captive", "kvlcc2_l7", "{}/drift.csv", "-o", "x.csv"], "a ship file ends in .toml"),
     (["captive", "kvlcc2_l7", "{}/drift.csv", "--free", "hull.Yv"], "no parameter 'hull.Yv'; near: hull.Y_v"),
     (["captive", "zeefakkel", "{}/drift.csv"], "has no forces that a captive test measures"),
     (["captive", "kvlcc2_l7", "{}/drift.csv", "--open-water", "{}/drift.csv"], "has one J and one K_T"),
     (["captive", "kvlcc2_l7", "{}/drift.csv", "--mapping", "{}/drift.csv"], "not readable as TOML"),
     (["scale", "kvlcc2_l7", "--to-length", "-3"], "--to-length is -3; it must be above zero"),
     (["scale", "kvlcc2_l7", "--to-length", "7000"], "a ship or a model has 0.1 to 600 m"),
     (["scale", "kvlcc2_l7", "--to-length", "320", "--form-factor", "12"], "--form-factor is 12; it is from 0 to 1"),
     (["scale", "kvlcc2_l7", "--to-length", "320", "--rudder-wake", "x"], "proportion or own"),
     (["scale", "mariner", "--to-length", "7"], "no body in water")],
)  # fmt: skip
def test_refused_in_one_line(
    arguments: list[str], said: str, tables: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    status, out, err = run(capsys, *(one.format(tables) for one in arguments))
    assert (status, out) == (2, "")
    assert said in err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())

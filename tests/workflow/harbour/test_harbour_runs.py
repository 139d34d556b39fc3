"""Runs in a harbour, from the request to the figures."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.simulate.contacts import LIMIT, MEAN
from seatrial.workflow.harbour import RUNS, harbour


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "about"),
    [(("berthin",), "near: berthing"), (("canal", "--chart", "nowhere"), "no chart 'nowhere'"),
     (("berthing", "--chart", "canal"), "no quay with fenders"), (("berthing", "--ship", "kvlcc2_shallow"), "no tugs"),
     (("berthing", "--start", "250,-10,0"), "starts inside quay 1"), (("canal", "--start", "0,900,0"), "aground"),
     (("berthing", "--start", "1,2"), "X,Y,DEG"), (("canal", "--speed", "-1"), "--speed is -1"),
     (("lock", "--ship", "zeefakkel"), "zeefakkel")],
)  # fmt: skip
def test_a_wrong_request_is_one_line_and_exit_2(
    arguments: tuple[str, ...], about: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["harbour", *arguments]) == 2
    said = capsys.readouterr().err.strip()
    assert about in said
    assert "\n" not in said


def test_a_chart_of_ones_own_is_refused_with_its_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "own.geojson"
    shape = {"type": "LineString", "coordinates": [[0, 0], [100, 0], [100, 100], [50, -50]]}
    crossed = {"type": "Feature", "properties": {"kind": "quay"}, "geometry": shape}
    path.write_text(json.dumps({"type": "FeatureCollection", "schema": "seatrial-chart/1", "frame": "metres",
                                "features": [crossed]}), encoding="utf-8")  # fmt: skip
    assert main(["harbour", "canal", "--chart", str(path)]) == 2
    assert "own.geojson: quay 1 crosses itself, side 1 with side 3" in capsys.readouterr().err


@pytest.mark.long
def test_two_tugs_lay_a_tanker_on_its_fenders_and_take_it_off(tmp_path: Path) -> None:
    ran = harbour("berthing", out=tmp_path / "run.csv")
    assert (tmp_path / "run.csv").is_file()
    assert 0.5 * MEAN < ran.indices["contact_speed"].value < LIMIT
    assert abs(float(ran.trial["y"][-1]) + 31.0) < 1.0
    assert abs(float(ran.trial["psi"][-1])) < 0.02
    assert ran.indices["fender_deflection"].value < 0.7
    away = harbour("unberthing")
    assert float(away.trial["y"][-1]) < -80.0
    assert np.abs(away.trial["psi"]).max() < 0.1


@pytest.mark.long
@pytest.mark.parametrize("name", ["canal", "meeting", "lock"])
def test_a_ship_keeps_to_its_fairway(name: str) -> None:
    ran = harbour(name)
    assert name in RUNS
    assert ran.indices["under_keel"].value > 0.0
    assert ran.indices["off_fairway"].value < (150.0 if name == "canal" else 70.0)

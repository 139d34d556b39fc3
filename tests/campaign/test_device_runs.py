"""A campaign on a device: the runs of the processor to rounding, under another digest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cuda_shim import Shim
from seatrial.campaign import Tracks
from seatrial.campaign.chunk import compute
from seatrial.cli.app import main
from seatrial.workflow.campaigns.reading import read_campaign

FILE = """
schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = 6
[manoeuvre]
kind = "zigzag"
rudder = 10.0
heading = 10.0
duration = 40.0
dt = 0.2
[inputs]
"ship.hull.N_r" = { normal = [1.0, 0.1], factor = true }
U_C = { uniform = [0.0, 0.1] }
"""


def test_the_indices_of_a_device_are_those_of_the_processor(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(FILE)
    usual = read_campaign(tmp_path / "campaign.toml", lambda text: None)
    machine: Any = Shim()
    ours = replace(usual, cases=tuple(replace(case, device=machine) for case in usual.cases))
    there, here = compute(usual, 0), compute(ours, 0)
    assert len(there.columns["first_overshoot"]) == 6
    for name, column in there.columns.items():
        assert here.columns[name] == pytest.approx(column, rel=1e-9, abs=1e-9, nan_ok=True), name
    assert np.ptp(there.columns["first_overshoot"]) > 0.0


def test_the_digest_tells_machines_apart(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(FILE)
    usual = read_campaign(tmp_path / "campaign.toml", lambda text: None)
    other = [replace(usual, cases=tuple(replace(case, **given) for case in usual.cases)) for given in (
        {"device": "cuda"}, {"device": "cuda:1"}, {"device": "cuda", "precision": "single"})]  # fmt: skip
    assert usual.digest != other[0].digest == other[1].digest != other[2].digest


@pytest.mark.slow
def test_a_device_that_is_not_here_leaves_no_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "campaign.toml").write_text(FILE.replace("dt = 0.2", 'dt = 0.2\ndevice = "cuda:99"'))
    assert main(["campaign", str(tmp_path / "campaign.toml"), "-o", str(tmp_path / "run")]) == 2
    assert "99" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_the_option_stands_in_place_of_the_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = tmp_path / "campaign.toml", tmp_path / "run"
    file.write_text(FILE)
    assert main(["campaign", str(file), "-o", str(out), "--device", "cuda:99"]) == 2
    assert "99" in capsys.readouterr().err
    assert main(["campaign", str(file), "-o", str(out), "--device", "gpu"]) == 2
    assert main(["campaign", str(out), "--status", "--device", "cpu"]) == 2
    assert not out.exists()
    assert main(["campaign", str(file), "-o", str(out), "--device", "cpu"]) == 0
    assert main(["campaign", str(file), "-o", str(out)]) == 0  # the same campaign
    assert main(["simulate", "--from", str(out), "3", "--json"]) == 0


def test_tracks_of_a_device_are_those_of_the_processor(tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(FILE)
    usual = replace(read_campaign(tmp_path / "campaign.toml"), tracks=Tracks(7, precision="double"))
    machine: Any = Shim()
    ours = replace(usual, cases=tuple(replace(case, device=machine) for case in usual.cases))
    there, here = compute(usual, 0).tracks, compute(ours, 0).tracks
    assert len(here["run"]) == 6 * 29
    for name, column in there.items():
        assert here[name] == pytest.approx(column, rel=1e-9, abs=1e-9), name

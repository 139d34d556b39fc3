"""The day of docs/tutorials/azimuth-tug.md: from raw GNSS, compass and gyro to numbers that hold the truth."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.core.parameters import read
from seatrial.data.trialfile import read_trial
from seatrial.ships.files import load
from seatrial.study.study import read_study

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The day as the script leaves it, and the study of the tutorial beside it."""
    found = importlib.util.spec_from_file_location("tug_day", ROOT / "examples" / "tug_day.py")
    assert found is not None
    assert found.loader is not None
    module: Any = importlib.util.module_from_spec(found)
    sys.modules["tug_day"] = module
    found.loader.exec_module(module)
    place = tmp_path_factory.mktemp("tug")
    module.main(place)
    page = (ROOT / "docs" / "tutorials" / "azimuth-tug.md").read_text(encoding="utf-8")
    (place / "study.toml").write_text(page.partition("```toml\n")[2].partition("```")[0], encoding="utf-8")
    return place


@pytest.mark.long
def test_logs_say_their_units(folder: Path) -> None:
    for place in ("raw", "trials"):
        head = (folder / place / "zigzag_2020_7.csv").read_text(encoding="utf-8").partition("\n")[0]
        assert {"n_1 [1/s]", "alpha_1 [rad]", "n_2_cmd [1/s]", "alpha_2_cmd [rad]", "U_T [m/s]"} <= set(head.split(","))
    assert "u" not in read_trial(folder / "raw" / "zigzag_2020_7.csv")


@pytest.mark.long
def test_the_tutorial_finds_the_truth(folder: Path) -> None:
    """All 22 within three sigma, masses within 1 kg or 2 per cent; what is not told says so."""
    study, truth = read_study(folder / "study.toml"), load("qiuxin5").model
    fit = study.estimator.fit(study.problem)
    names = [f.path.rpartition(".")[2] for f in fit.free]
    hull = [k for k, f in enumerate(fit.free) if not f.path.startswith("wind")]
    true = np.array([float(read(truth, fit.free[k].path)) for k in hull])
    z = (fit.values[hull] - true) / fit.sigma[hull]
    assert len(hull) == 22
    assert np.abs(z).max() < 3.0
    assert np.sqrt((z**2).mean()) < 1.4
    assert fit.values[names.index("m_11")] == pytest.approx(138.06, rel=0.02)
    assert fit.values[names.index("m_22")] == pytest.approx(106.6, rel=0.02)
    assert fit.values[names.index("A_L")] == pytest.approx(0.30, rel=0.05)
    told = {v.subject.rpartition(".")[2]: v.status for v in fit.verdicts}
    assert told["m_11"] == "identified"
    assert told["Y_rv"] == told["Y_vr"] == "not identified"
    i, j = names.index("Y_rv"), names.index("Y_vr")
    C = fit.covariance
    assert C[i, j] > 0.9 * np.sqrt(C[i, i] * C[j, j]), "they rise and fall together: their difference is known"
    assert C[i, i] + C[j, j] - 2 * C[i, j] < 0.05 * (C[i, i] + C[j, j] + 2 * C[i, j])

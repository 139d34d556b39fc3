"""Forecasts of a real ship in waves (HAKUSAN, R package TSSS): the figures of docs/published.md on rows left out."""

from __future__ import annotations

import importlib.util
import json
import os
import sys
from pathlib import Path

import pytest

HOME = Path(__file__).parents[1]
ROOT = Path(os.environ.get("SEATRIAL_DATA", HOME.parent / "shared" / "data"))


def script():
    path = HOME / "studies" / "reports" / "hakusan.py"
    spec = importlib.util.spec_from_file_location("hakusan_report", path)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def test_other_columns_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    monkeypatch.setenv("SEATRIAL_DATA", str(tmp_path))
    module = script()
    assert module.main(["-o", str(tmp_path / "run")]) == 2
    assert "no such file" in capsys.readouterr().err
    file = tmp_path / module.FILE
    file.parent.mkdir()
    file.write_text("YawRate Rolling Pitch Rudder\n1 2 3 4\n")
    assert module.main(["-o", str(tmp_path / "run")]) == 2
    assert "line 1" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.long
@pytest.mark.skipif(not (ROOT / "hakusan").is_dir(), reason="HAKUSAN absent: set SEATRIAL_DATA (R package TSSS)")
def test_forecasts_beat_persistence_and_the_mean_on_rows_left_out(tmp_path: Path) -> None:
    module = script()
    assert module.main(["-o", str(tmp_path)]) == 0
    found = json.loads((tmp_path / "report.json").read_text())
    model = "vector AR of yaw rate, roll, pitch"
    for output in ("r", "phi"):
        errors = found[f"error_{output}"]
        ours, mean = errors[model], errors["mean"]["error"]
        assert ours["error"][0] < 0.35
        assert all(ours["error"][k] < 0.9 * mean[k] for k in range(5))
        assert all(ours["of_persistence"][k] < 0.62 for k in range(5))
        assert 0.88 < ours["inside"][0] < 0.99
    assert found["models"][model]["radius"] < 1.0

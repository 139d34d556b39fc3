"""`seatrial campaign` on files as users write them, right and wrong."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from seatrial.cli.app import main

GOOD = """
schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = 30
chunk = 16
[manoeuvre]
kind = "zigzag"
rudder = 10.0
heading = 10.0
duration = 60.0
dt = 0.2
[inputs]
"ship.hull.N_r" = { normal = [1.0, 0.1], factor = true }
"policy.delta" = { uniform = [9, 11], unit = "deg" }
[criteria]
first_overshoot = { at_most = 12.0, unit = "deg" }
"""


def written(folder: Path, text: str) -> str:
    path = folder / "campaign.toml"
    path.write_text(text)
    return str(path)


def test_from_a_file_to_one_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import polars as pl

    file, out = written(tmp_path, GOOD), str(tmp_path / "run")
    assert main(["campaign", file, "-o", out, "--shard", "2/2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["missing"] == 1
    assert main(["campaign", out, "--merge"]) == 2
    assert "1 of 2 parts are missing" in capsys.readouterr().err
    assert main(["campaign", file, "-o", out]) == 0
    assert main(["campaign", out, "--verify", "--json"]) == 0
    said = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert (said["done"], said["faults"]) == (2, [])
    assert len(said["digest"]) == 64
    assert main(["campaign", out, "--merge"]) == 0
    table = pl.read_parquet(tmp_path / "run" / "campaign.parquet")
    assert table.height == 30
    assert table["policy.delta"].min() > 0.157  # 9 deg
    held = table["first_overshoot"] <= 12.0 * 3.141592653589793 / 180.0
    assert (table["first_overshoot_met"] == held.cast(pl.Float64)).all()


def test_a_job_array_takes_its_share(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file, out = written(tmp_path, GOOD), tmp_path / "run"
    monkeypatch.setenv("SLURM_ARRAY_TASK_COUNT", "2")
    monkeypatch.setenv("SLURM_ARRAY_TASK_MIN", "5")
    monkeypatch.setenv("SLURM_ARRAY_TASK_ID", "6")
    assert main(["campaign", file, "-o", str(out)]) == 0
    assert [path.stem for path in out.rglob("*.parquet")] == ["0000001"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("runs = 30", "runs = 0", "runs"),
        ("runs = 30", "runs = 30\nseeed = 2", "seeed"),
        ('"kvlcc2_l7"', '"kvlcc9"', "kvlcc9"),
        ('"zigzag"', '"zigzac"', "zigzac"),
        ('"ship.hull.N_r"', '"ship.hull.N_q"', "ship.hull.N_q"),
        ("normal = [1.0, 0.1]", "normal = [1.0, 0.1], uniform = [0, 1]", "give one of"),
        ("normal = [1.0, 0.1]", "normal = [1.0]", "2 numbers"),
        ('unit = "deg" }\n[crit', 'unit = "dag" }\n[crit', "dag"),
        ("first_overshoot", "first_undershoot", "first_undershoot"),
        ("[inputs]", '[weather]\nwind = "8,300"\n[inputs]', "no force of wind"),
        ('"ship.hull.N_r" = { normal = [1.0, 0.1], factor', '"ship.body.m" = { normal = [1.0, 2.0], factor', "within"),
        ("runs = 30", 'runs = 31\ndesign = "saltelli"', "multiple of 4"),
    ],
)
def test_wrong_files_are_refused_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, said: str
) -> None:
    assert GOOD.count(old) >= 1
    assert main(["campaign", written(tmp_path, GOOD.replace(old, new)), "-o", str(tmp_path / "run")]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert said in lines[0]
    assert not (tmp_path / "run").exists()


def test_a_folder_that_holds_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["campaign", str(tmp_path), "--status"]) == 2
    assert "holds no campaign" in capsys.readouterr().err
    assert main(["campaign", str(tmp_path), "--status", "--merge"]) == 2
    assert main(["campaign", written(tmp_path, GOOD)]) == 2


@pytest.mark.slow
def test_a_run_is_replayed_from_the_folder_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import polars as pl

    out = tmp_path / "run"
    file = Path(written(tmp_path, GOOD))
    assert main(["campaign", str(file), "-o", str(out)]) == 0
    file.unlink()
    table = pl.read_parquet(out / "parts" / "0000" / "0000001.parquet")
    capsys.readouterr()
    assert main(["simulate", "--from", str(out), "17", "--json", "-o", str(tmp_path / "worst.csv")]) == 0
    said = json.loads(capsys.readouterr().out)
    row = table.filter(pl.col("run") == 17)
    assert said["inputs"]["ship.hull.N_r"] == row["ship.hull.N_r"][0]
    degrees = said["indices"]["first_overshoot"]["value"]
    assert degrees * 3.141592653589793 / 180.0 == pytest.approx(row["first_overshoot"][0], rel=1e-12)
    assert (tmp_path / "worst.csv").exists()
    for wrong in (["30"], ["-1"], ["17", "zigzag"], ["last"]):
        assert main(["simulate", "--from", str(out), *wrong]) == 2

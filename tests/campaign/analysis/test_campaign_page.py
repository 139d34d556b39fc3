"""`seatrial campaign DIR --report`: its numbers are those of the table, and its runs can be replayed."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from seatrial.cli.app import main

FILE = """
schema = "seatrial-campaign/1"
title = "Two <ships>"
ships = ["kvlcc2_l7", "esso_osaka_3m"]
runs = 80
chunk = 30
design = "saltelli"
[manoeuvre]
kind = "zigzag"
rudder = 10.0
heading = 10.0
duration = 45.0
dt = 0.2
[inputs]
"ship.hull.N_r" = { normal = [1.0, 0.1], factor = true }
"policy.delta" = { uniform = [8, 12], unit = "deg" }
[criteria]
first_overshoot = { at_most = 6.5, unit = "deg" }
"""

Folder = tuple[Path, pl.DataFrame]


def computed(folder: Path, text: str) -> Folder:
    file, out = folder / "c.toml", folder / "run"
    file.write_text(text)
    assert main(["campaign", str(file), "-o", str(out)]) == 0
    return out, pl.read_parquet(out / "parts" / "*" / "*.parquet")


@pytest.fixture(scope="module")
def saltelli(tmp_path_factory: pytest.TempPathFactory) -> Folder:
    pytest.importorskip("SALib")
    return computed(tmp_path_factory.mktemp("saltelli"), FILE)


def reported(folder: Path, *more: str) -> dict[str, Any]:
    assert main(["campaign", str(folder), "--report", *more]) == 0
    page = Path(more[1]) if more else folder / "report.html"
    assert page.read_text().startswith("<!DOCTYPE html>")
    return json.loads(page.with_suffix(".json").read_text())


@pytest.mark.slow
def test_the_numbers_are_those_of_the_table(saltelli: Folder) -> None:
    folder, table = saltelli
    said = reported(folder)
    own = table.filter((pl.col("case") == 0) & (pl.col("run") % 80 % 4).is_in([0, 3]))  # runs A and B of each block
    (judged,) = [one for one in said["criteria"] if one["case"] == 0]
    assert judged["violated"] == {"hits": int((~own["first_overshoot_met"]).sum()), "runs": 40}
    figure = next(one for one in said["figures"] if (one["case"], one["index"]) == (0, "first_overshoot"))
    assert figure["spread"]["count"] == 40
    assert figure["spread"]["mean"] == pytest.approx(own["first_overshoot"].mean())
    every = table.filter(pl.col("case") == 0)
    worst = every.sort("first_overshoot", descending=True)["run"][:5].to_list()
    assert [one["run"] for one in judged["worst"]] == [one["run"] for one in figure["largest"]] == worst
    assert figure["sensitivity"]["method"].startswith("Sobol")
    assert figure["sensitivity"]["used"] == 20
    assert said["units"]["first_overshoot"] == "rad"
    assert said["criteria"][0]["high"] == pytest.approx(math.radians(6.5))


@pytest.mark.slow
def test_a_run_of_the_page_is_replayed(saltelli: Folder, capsys: pytest.CaptureFixture[str]) -> None:
    folder, _ = saltelli
    said = reported(folder)
    page = (folder / "report.html").read_text()
    command = re.search(r"seatrial simulate --from (\S+) (\d+)", page)
    assert command is not None
    assert "Two &lt;ships&gt;" in page
    capsys.readouterr()
    assert main(["simulate", "--from", command[1], command[2], "--json"]) == 0
    value = json.loads(capsys.readouterr().out)["indices"]["first_overshoot"]["value"]
    assert math.radians(value) == pytest.approx(said["criteria"][0]["worst"][0]["value"], rel=1e-9)


@pytest.mark.slow
def test_missing_parts_are_named_and_cut_no_block(saltelli: Folder, tmp_path: Path) -> None:
    import shutil

    folder = tmp_path / "run"
    shutil.copytree(saltelli[0], folder)
    (folder / "parts" / "0000" / "0000000.parquet").unlink()  # runs 0 to 29 of case 0: block 7 is cut
    said = reported(folder, "-o", str(tmp_path / "page.html"))
    assert (said["rows"], said["of"]) == (130, 160)
    found = {one["case"]: one["sensitivity"]["used"] for one in said["figures"] if one["index"] == "first_overshoot"}
    assert found == {0: 12, 1: 20}
    assert "30 of 160 runs are not computed yet" in (tmp_path / "page.html").read_text()


@pytest.mark.slow
def test_failed_and_incomplete_runs_are_counted_and_named(tmp_path: Path) -> None:
    """A current far beyond the validity of the ship ends some runs; short ones lack their later indices."""
    text = (
        FILE.replace('"saltelli"', '"random"')
        .replace('["kvlcc2_l7", "esso_osaka_3m"]', '["kvlcc2_l7"]')
        .replace("runs = 80", "runs = 300")
    )
    folder, table = computed(tmp_path, text.replace('"policy.delta"', 'u = { uniform = [0.1, 4.0] }\n"policy.delta"'))
    said = reported(folder)
    (lost,) = said["lost"]
    failed = table.filter(table["failed"].is_finite())
    assert failed.height > 0
    assert lost["failed"] == {"hits": failed.height, "runs": 300}
    assert lost["incomplete"]["hits"] == int((~table["complete"]).sum()) > 0
    first = failed.sort("failed", "run")
    assert [one["run"] for one in lost["first_failed"]] == first["run"][:5].to_list()
    page = (folder / "report.html").read_text()
    assert "selection of the quicker runs" in page
    methods = [one["sensitivity"]["method"] for one in said["figures"] if one["sensitivity"]]
    assert methods
    assert all("given data" in one for one in methods)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--report", "-o", "{}/campaign.html"], "would overwrite"),
        (["--report", "-o", "{}/page.txt"], ".html"),
        (["--report", "--merge"], "give one of them"),
    ],
)
def test_wrong_requests(saltelli: Folder, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str) -> None:
    folder, before = saltelli[0], (saltelli[0] / "campaign.json").read_bytes()
    assert main(["campaign", str(folder), *(one.format(folder) for one in arguments)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert said in lines[0]
    assert (folder / "campaign.json").read_bytes() == before


def test_no_runs_no_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["campaign", str(tmp_path), "--report"]) == 2
    assert "holds no campaign" in capsys.readouterr().err

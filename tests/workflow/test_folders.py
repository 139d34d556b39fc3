"""`seatrial trials`: what it says of a folder, as a table, a page and JSON."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import Trial
from seatrial.data.kinds.kind import Kind
from seatrial.data.trialfile import write_trial
from seatrial.sensors import Sensors
from seatrial.validate.folder import Entry
from seatrial.workflow.asked import Span
from seatrial.workflow.folders.survey import _row
from seatrial.workflow.simulation import simulate

NOISE = Sensors({"x": 0.02, "y": 0.02, "psi": 0.002, "u": 0.01, "v_m": 0.01, "r": 0.001})


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three manoeuvres, a copy of part of one in a subfolder, and one whose sidecar tells another kind."""
    at, rng = tmp_path_factory.mktemp("logs"), np.random.default_rng(5)
    runs: dict[str, Trial] = {}
    for name, kind in (("a", "zigzag"), ("b", "turning"), ("c", "straight")):
        runs[name] = NOISE.read(simulate("kvlcc2_l7", kind, span=Span(150.0)).trial.rows(slice(0, None, 4)), rng)
    (at / "again").mkdir()
    runs["again/a"] = runs["a"].rows(slice(40, 300))
    told = runs["c"]
    runs["c"] = replace(told, meta={**told.meta, "kind": "spiral"})
    for name, trial in runs.items():
        write_trial(replace(trial, name=name.rpartition("/")[2]), at / f"{name}.csv")
    return at


@pytest.mark.slow
def test_kinds_overlaps_and_wrong_sidecars_are_told(folder: Path, capsys) -> None:
    assert main(["trials", str(folder), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    kinds = {name: (one["kind"], one["told"], one["compared"]) for name, one in said["trials"].items()}
    assert kinds["a"] == ("zigzag", "zigzag", "agrees")
    assert kinds["c"] == ("straight", "spiral", "differs")
    assert [set(one["trials"]) for one in said["overlaps"]] == [{"a", "again/a"}]
    assert said["trials"]["a"]["settings"]["rudder"] == pytest.approx(np.radians(10.0), abs=0.01)
    low, high = said["trials"]["b"]["ranges"]["delta"]
    assert (low, high) == pytest.approx((np.radians(35.0), np.radians(35.0)), abs=0.3)


@pytest.mark.slow
def test_the_table_is_for_people(folder: Path, capsys) -> None:
    assert main(["trials", str(folder)]) == 0
    told = capsys.readouterr().out
    assert "zigzag 10/10 starboard" in told
    assert "c: told as spiral, recognised as straight" in told
    assert "4 recordings: 2 zigzag, 1 turning, 1 straight" in told


@pytest.mark.slow
def test_an_unreadable_file_is_a_row_with_the_reason(folder: Path, tmp_path: Path, capsys) -> None:
    """The others are told, and the exit status says that something failed."""
    here = tmp_path / "logs"
    shutil.copytree(folder, here)
    (here / "bad.csv").write_text("t [s],psi [rad]\n0,1\n1,x\n")
    assert main(["trials", str(here), "-o", str(tmp_path / "trials.html")]) == 1
    told = capsys.readouterr()
    assert "1 of 5 recordings cannot be read" in told.err
    assert "5 recordings: 2 zigzag, 1 turning, 1 straight, and 1 unreadable" in told.out
    assert "line 3" in (tmp_path / "trials.html").read_text()
    assert main(["trials", str(here), "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert list(said["unread"]) == ["bad"]
    assert "line 3" in said["unread"]["bad"]
    study = tmp_path / "study.toml"
    assert main(["study", "new", "kvlcc2_l7", str(here), "-o", str(study)]) == 0
    assert "# left out: bad.csv: " in study.read_text()


@pytest.mark.slow
def test_the_page_draws_every_recording_north_up(folder: Path, tmp_path: Path) -> None:
    page = tmp_path / "trials.html"
    assert main(["trials", str(folder), "-o", str(page)]) == 0
    text = page.read_text()
    assert text.count("north x [m]") == 4
    assert text.count("east y [m]") == 4
    assert "two trials share a recording" in text
    assert json.loads(page.with_suffix(".json").read_text())["counts"] == {"zigzag": 2, "turning": 1, "straight": 1}


@pytest.mark.slow
def test_without_positions_there_is_no_track(tmp_path: Path) -> None:
    t = np.arange(0.0, 200.0)
    trial = Trial("waves", t, {"r": 0.02 * np.sin(t / 5), "phi": 0.05 * np.sin(t / 3), "delta": 0.03 * np.cos(t / 7)})
    write_trial(trial, tmp_path / "waves.csv")
    page = tmp_path / "page.html"
    assert main(["trials", str(tmp_path), "-o", str(page)]) == 0
    assert "north x" not in page.read_text()


@pytest.mark.slow
def test_names_with_markup_are_shown_as_they_are(tmp_path: Path) -> None:
    t = np.arange(0.0, 60.0)
    write_trial(Trial("x", t, {"psi": 0.0 * t, "u": 1.0 + 0.0 * t, "delta": 0.0 * t}), tmp_path / "a <b>&[1] $x$.csv")
    page = tmp_path / "page.html"
    assert main(["trials", str(tmp_path), "-o", str(page)]) == 0
    text = page.read_text()
    assert "a &lt;b&gt;&amp;[1] $x$" in text
    assert "<b>&[1]" not in text


def test_a_row_tells_what_the_sidecar_says_and_a_dash_where_it_says_nothing() -> None:
    trial = Trial("a", np.arange(61.0), {}, {}, {})
    kind = Kind("zigzag", evidence=())
    rows = [_row("a", Entry(trial, kind, told, verdict, {"u": (1.0, 2.0)}, new))
            for told, verdict, new in (("", "", np.nan), ("turning", "differs", 0.25), ("zigzag", "agrees", 0.0))]
    assert [row[2] for row in rows] == ["–", "turning (differs)", "zigzag"]
    assert [row[7] for row in rows] == ["–", "25 %", "0 %"]
    assert all(row[3] == "60" and row[5] == row[6] == row[8] == "–" for row in rows)

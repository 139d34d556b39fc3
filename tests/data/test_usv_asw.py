from __future__ import annotations

import sys
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from seatrial.cli.app import main
from seatrial.data import DataError
from seatrial.data.check import check
from seatrial.data.check.track import fixes, own_samples, track_miss
from seatrial.data.formats import formats, usv_asw
from seatrial.data.importing import import_log
from seatrial.data.trialfile import read_trial
from workbooks import HEADS, voyage, write_workbook


@pytest.fixture
def book(tmp_path):
    return lambda **how: write_workbook(tmp_path / "run.xlsx", voyage(**how))


def edited(tmp_path, row, head, text):
    rows = voyage(rows=30)
    rows[row][HEADS.index(head)] = text
    return write_workbook(tmp_path / "run.xlsx", rows)


def test_time_is_the_clock_and_positions_are_the_receivers(book):
    trial = usv_asw.read(book())
    assert trial.t[-1] == pytest.approx(0.11 * 399, abs=1e-9)
    rows = fixes(trial)
    moved = np.hypot(np.diff(trial["x"][rows]), np.diff(trial["y"][rows])).sum()
    assert moved == pytest.approx(0.8 * 0.11 * 398, rel=1e-4)
    assert trial["throttle_port"][0] == 0.5
    assert trial["throttle_starboard"][0] == -0.2
    assert trial.meta["held"] == ["throttle_port", "throttle_starboard"]
    assert trial.meta["licence"] == "MIT"


@pytest.mark.parametrize("swapped", [False, True])
def test_the_track_tells_compass_from_course(book, swapped):
    trial = usv_asw.read(book(swapped=swapped))
    assert np.degrees(track_miss(trial, "gamma_G")) < 0.2
    assert np.degrees(track_miss(trial, "psi")) > 2.0
    assert any("exchanged" in step for step in trial.meta["processing"]) is swapped


def test_trial_file_and_back(book, tmp_path):
    assert "usv-asw" in formats()
    [path] = import_log("usv-asw", book(), tmp_path / "out")
    again = read_trial(path)
    assert again["throttle_port"] == pytest.approx(0.5)
    assert again.unit("gamma_G") == "rad"
    assert [f.severity for f in check(again)] == ["warning"] * 3
    assert main(["check", str(path)]) == 0


def test_own_samples(book):
    trial = own_samples(usv_asw.read(book()))
    assert np.isnan(trial["x"]).sum() == np.isnan(trial["psi"]).sum() == 200
    assert np.isfinite(trial["throttle_port"]).all()
    assert fixes(trial).size == 200


def whats(trial):
    return {finding.what for finding in check(trial) if finding.severity == "error"}


def test_check_finds_the_traps(book):
    right = usv_asw.read(book())
    assert not whats(right)
    assert {f.where.split(": ")[1] for f in check(right) if f.what == "repeated values"} == {"x", "y", "psi"}
    assert whats(right.having(psi=right["gamma_G"], gamma_G=right["psi"])) == {
        "heading and course over ground are exchanged"
    }
    stretched = "the time step is not the true one, or x and y are stretched"
    assert whats(replace(right, t=0.1 * np.arange(len(right)))) == {stretched}
    assert whats(right.having(x=1.1117 * right["x"], y=1.1117 * right["y"])) == {stretched}
    assert whats(right.having(U_G=right["U_G"] * 3.6)) == {"wrong scale or unit: speed over ground and positions"}


@pytest.mark.parametrize(
    ("row", "head", "text", "message"),
    [
        (0, "t", "Heading", "column 'Heading', row 1: more columns of this name; keep one"),
        (3, "PWM_L", "1_500", "column 'PWM_L', row 4: '1_500' is no number"),
        (0, "PWM_L", "PWML", "row 1: no column 'PWM_L'; near: PWML"),
        (3, "PWM_L", "full", "column 'PWM_L', row 4: 'full' is no number"),
        (3, "PWM_L", "inf", "column 'PWM_L', row 4: 'inf' is not finite"),
        (5, "DateTime", "noon", "column 'DateTime', row 6: 'noon' is no time"),
        (5, "DateTime", "2025-07-24 15:45:54.179", "time goes back"),
    ],
)
def test_bad_workbook(tmp_path, row, head, text, message, capsys):
    path = edited(tmp_path, row, head, text)
    with pytest.raises(DataError, match=message):
        usv_asw.read(path)
    assert main(["import", "usv-asw", str(path), "-o", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err.strip()
    assert len(told.splitlines()) == 1
    assert "run.xlsx" in told
    assert not (tmp_path / "out").exists()


def test_an_empty_cell_is_a_gap(tmp_path):
    trial = usv_asw.read(edited(tmp_path, 3, "PWM_L", ""))
    assert np.flatnonzero(np.isnan(trial["throttle_port"])).tolist() == [2]


def test_no_workbook(tmp_path):
    (tmp_path / "log.xlsx").write_text("a,b\n1,2\n")
    with pytest.raises(DataError, match=r"log\.xlsx: not readable as a workbook"):
        usv_asw.read(tmp_path / "log.xlsx")
    with pytest.raises(DataError, match="rows below the header"):
        usv_asw.read(write_workbook(tmp_path / "run.xlsx", voyage(rows=1)))


def test_a_workbook_without_its_list_of_sheets(tmp_path):
    whole = write_workbook(tmp_path / "run.xlsx", voyage(rows=3))
    with zipfile.ZipFile(whole) as book:
        parts = {name: book.read(name) for name in book.namelist()}
    parts["xl/workbook.xml"] = parts["xl/workbook.xml"].replace(b"sheet ", b"shiit ")
    with zipfile.ZipFile(whole, "w") as book:
        for name, data in parts.items():
            book.writestr(name, data)
    with pytest.raises(DataError, match=r"run\.xlsx: not readable as a workbook"):
        usv_asw.read(whole)


def test_the_extra_is_named_where_it_lacks(book, monkeypatch, capsys, tmp_path):
    monkeypatch.setitem(sys.modules, "fastexcel", None)
    assert main(["import", "usv-asw", str(book()), "-o", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err.strip()
    assert len(told.splitlines()) == 1
    assert "pip install 'seatrial[log]'" in told


@pytest.mark.parametrize(("name", "swapped", "seconds"), [
    pytest.param("circle", False, 257.764, marks=pytest.mark.slow), ("sin", True, 167.974),
])  # fmt: skip
def test_the_real_logs(data_file, name, swapped, seconds):
    trial = usv_asw.read(data_file("usv_asw_twinhull", f"boat1_2_{name}.xlsx"))
    assert trial.t[-1] == pytest.approx(seconds)
    assert any("exchanged" in step for step in trial.meta["processing"]) is swapped
    assert np.degrees(track_miss(trial, "gamma_G")) < 1.6
    assert np.degrees(track_miss(trial, "psi")) > 4.0
    assert not whats(trial)
    assert np.mean(np.diff(trial["x"]) == 0) == pytest.approx(0.45, abs=0.01)
    # the yaw rate follows the difference of the throttles: left faster turns to starboard
    rows = fixes(trial)
    rate = np.gradient(trial["psi"][rows], trial.t[rows])
    assert np.corrcoef(rate, (trial["throttle_port"] - trial["throttle_starboard"])[rows])[0, 1] > 0.5


def test_throttle_in_per_cent(tmp_path):
    (tmp_path / "a.csv").write_text("t [s],throttle_port [%]\n0,50\n1,-20\n")
    assert read_trial(tmp_path / "a.csv")["throttle_port"].tolist() == [0.5, -0.2]

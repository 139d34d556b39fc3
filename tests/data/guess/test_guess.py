"""The guess at a mapping: logs in many shapes, imported by it without an edit; what it cannot know it says or asks."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from shapes import COASTER, DEG, KN, MODEL, SHAPES, Sailed, Sheet, astray, compass, sailed, stamps

from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.check import check_folder
from seatrial.data.guess import ASK, DOUBT, guess
from seatrial.data.guess.layout import read_text
from seatrial.data.guess.naming import meanings, parted, unit_of
from seatrial.data.trialfile import read_trial
from seatrial.workflow import RequestError
from seatrial.workflow.data import guess_mapping, import_logs, tried

QUICK = ("norwegian", "words_of_gaps", "two_files_of_one_trial")


def imported(log: Path, place: Path, change: Callable[[str], str] = str) -> tuple[str, dict[str, Trial]]:
    """The guessed mapping of a log, and the trials that the import makes by it."""
    mapping = place / "mapping.toml"
    guess_mapping(log, mapping)
    mapping.write_text(change(mapping.read_text(encoding="utf-8")), encoding="utf-8")
    written = import_logs("csv", log, place / "trials", mapping).written
    return mapping.read_text(encoding="utf-8"), {path.stem: read_trial(path) for path in written}


def log_of(place: Path, sheet: Sheet, **how: str) -> Path:
    return sheet.write(place / "logs" / "log.csv", **how).parent


def doubts(text: str, table: str) -> list[str]:
    """Doubts that stand above a table or a key of a mapping."""
    above: list[str] = []
    for line in text.splitlines():
        if line.startswith("# "):
            above.append(line)
        elif line.strip() in (f"[{table}]",) or line.startswith(f"{table} = "):
            return [one for one in above if DOUBT in one]
        elif line:
            above = []
    return []


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.long) for n in SHAPES])
@pytest.mark.slow
def test_a_log_of_any_shape_comes_in_as_it_was(name: str, tmp_path: Path) -> None:
    """No edit: 24 of 24 (22 are asked for), within the last digits that the log has."""
    folder = tmp_path / name
    expected = SHAPES[name](folder)
    text, trials = imported(folder, tmp_path)
    assert f'"{ASK}"' not in text.replace(f'value "{ASK}"', "")
    for trial, (log, digits) in expected.trials.items():
        assert trial in trials, list(trials)
        assert not astray(trials[trial], log, digits), text


def test_there_are_24_shapes() -> None:
    assert len(SHAPES) == 24


def straight(rudder: float = 0.0, **more: float) -> Sailed:
    return sailed(**{**MODEL, "rudder": rudder, "noise": 0.0, "wind": 0.0, "duration": 60.0, **more})


def basin(log: Sailed) -> Sheet:
    """A log of a basin without a unit but that of time."""
    sheet = Sheet().put("t [s]", log.t, 2).put("x", log["x"], 4).put("y", log["y"], 4).put("psi", log["psi"], 5)
    sheet.put("u", log["u"], 5).put("v", log["v_m"], 5).put("r", log["r"], 6).put("delta", log["delta"], 5)
    return sheet.put("n", 60 * log["n_P"], 2)


@pytest.mark.slow
def test_a_straight_run_cannot_show_the_side_of_the_rudder(tmp_path: Path) -> None:
    """The sign is asked for, the import refuses the file in one line, and runs with the answer."""
    log = log_of(tmp_path, basin(straight()))
    found = guess(log)
    assert found.asks == ("channels.r.unit", "channels.delta.sign")
    assert doubts(found.text, "channels.n_P")
    mapping = tmp_path / "m.toml"
    mapping.write_text(found.text, encoding="utf-8")
    with pytest.raises(DataError, match=rf'm\.toml: line \d+: channels\.r\.unit is "\{ASK}"; write the answer'):
        import_logs("csv", log, tmp_path / "trials", mapping)
    assert not (tmp_path / "trials").exists()
    answered = found.text.replace(f'unit = "{ASK}"', 'unit = "rad/s"').replace(f'sign = "{ASK}"', "sign = -1")
    mapping.write_text(answered, encoding="utf-8")
    assert len(import_logs("csv", log, tmp_path / "trials", mapping).written) == 1


@pytest.mark.slow
def test_a_small_rudder_angle_is_not_taken_for_radians(tmp_path: Path) -> None:
    """Course keeping with up to 0.7 deg: neither unit nor side shows."""
    log = sailed(**{**COASTER, "rudder": 0.3}, duration=200.0)
    sheet = Sheet().put("time", stamps(log.t)).put("lat", log.latitude, 8).put("lon", log.longitude, 8)
    sheet.put("heading", compass(log["psi"]), 1).put("sog", log.sog / KN, 2).put("cog", np.degrees(log.cog), 1)
    found = guess(log_of(tmp_path, sheet.put("rudder", np.degrees(log["delta"]), 1)))
    assert found.asks == ("channels.delta.unit", "channels.delta.sign")


def test_a_rudder_held_over_shows_its_side(tmp_path: Path) -> None:
    """A steady turn to port under +10 deg: positive is to port; within the loop of an unstable ship nothing is said."""
    t = np.arange(0.0, 200.0, 0.5)
    psi = np.degrees(-0.02 * t) % 360.0
    for angle, sign in ((10.0, "sign = -1"), (4.0, f'sign = "{ASK}"')):
        sheet = Sheet().put("t [s]", t, 1).put("heading", psi, 3).put("rudder", angle + 0.01 * np.sin(t), 3)
        assert sign in guess(log_of(tmp_path / str(angle), sheet)).text


def test_speeds_without_a_position_have_no_unit(tmp_path: Path) -> None:
    log = straight(20.0)
    sheet = Sheet().put("t", log.t, 2).put("heading", compass(log["psi"]), 2).put("speed", log["u"] / KN, 3)
    assert "log.unit" in guess(log_of(tmp_path, sheet)).asks


def test_a_mirrored_world_is_a_doubt(tmp_path: Path) -> None:
    """x, y and yaw fit as north, east and clockwise as well as they fit as east, north and anticlockwise."""
    log = straight(20.0)
    sheet = Sheet().put("t", log.t, 2).put("x", log["x"], 4).put("y", log["y"], 4).put("yaw", log["psi"], 5)
    text = guess(log_of(tmp_path, sheet)).text
    assert any("anticlockwise from east" in one for one in doubts(text, "channels.psi"))
    assert any("y, x" in one for one in doubts(text, "channels.x"))


@pytest.mark.slow
def test_names_that_the_track_refutes_are_not_followed(tmp_path: Path) -> None:
    """Latitude called lon, knots called m/s, degrees called rad: read as they are, each with a doubt."""
    log = sailed(**COASTER, duration=300.0)
    sheet = Sheet().put("time", stamps(log.t)).put("lon", log.latitude, 8).put("lat", log.longitude, 8)
    sheet.put("heading [rad]", compass(log["psi"]), 3).put("surge [m/s]", log["u"] / KN, 4).put(
        "sway [m/s]", log["v_m"] / KN, 4
    )
    text, trials = imported(log_of(tmp_path, sheet), tmp_path)
    assert not astray(trials["log"], log, {"x": 0.01, "y": 0.01, "psi": 1e-3 * DEG, "u": 1e-4, "v_m": 1e-4})
    for table in ("position", "channels.psi", "channels.u"):
        assert doubts(text, table), text


@pytest.mark.slow
def test_heading_and_course_exchanged(tmp_path: Path) -> None:
    log = sailed(**COASTER, duration=300.0)
    sheet = Sheet().put("time", stamps(log.t)).put("lat", log.latitude, 8).put("lon", log.longitude, 8)
    sheet.put("heading", np.degrees(log.cog), 2).put("sog", log.sog, 3).put("course", compass(log["psi"]), 2)
    text, trials = imported(log_of(tmp_path, sheet), tmp_path)
    assert not astray(trials["log"], log, {"psi": 0.01 * DEG})
    assert any("exchanged" in one for one in doubts(text, "channels.psi"))


@pytest.mark.slow
def test_sources_that_contradict_each_other_decide_nothing(tmp_path: Path) -> None:
    """A frozen heading: no reading fits, which is said, and names alone are followed."""
    log = sailed(**{**MODEL, "duration": 100.0}, psi_0=2.0)
    sheet = Sheet().put("t [s]", log.t, 2).put("x [m]", log["x"], 3).put("y [m]", log["y"], 3)
    sheet.put("heading [deg]", 0 * log["psi"] + 300.0, 2).put("u [m/s]", log["u"], 3).put("v [m/s]", log["v_m"], 3)
    found = guess(log_of(tmp_path, sheet))
    assert any("fit together in no reading" in one for one in found.doubts)
    assert "[channels.u]" in found.text


@pytest.mark.slow
def test_wind_to_and_apparent_wind_to_port(tmp_path: Path) -> None:
    """An apparent wind where it goes to, positive to port: the true wind would turn with the ship otherwise."""
    log = sailed(**COASTER, duration=400.0)
    sheet = Sheet().put("time", stamps(log.t)).put("lat", log.latitude, 8).put("lon", log.longitude, 8)
    sheet.put("heading", compass(log["psi"]), 2).put("sog", log.sog, 3).put("cog", np.degrees(log.cog), 2)
    sheet.put("wind speed", log["U_A"] / KN, 3).put("wind angle", (180.0 - np.degrees(log["gamma_A"])) % 360.0, 2)
    found, trials = imported(log_of(tmp_path, sheet), tmp_path)
    assert "sign = -1\ntowards = true" in found.partition("[apparent]")[2]
    assert not astray(trials["log"], log, {"U_A": 1e-3, "gamma_A": 0.01 * DEG})
    assert not astray(trials["log"], log, {"U_T": 1.5, "gamma_T": 0.3})  # the instruments' noise


@pytest.mark.slow
def test_units_in_the_cells(tmp_path: Path) -> None:
    """A heading and speeds such as "5.2 kn": the unit is read, and no doubt is left about it."""
    log = sailed(**COASTER, duration=200.0)
    rows = zip(log.t, np.degrees(log["psi"]) % 360.0, log.sog / KN, np.degrees(log.cog), strict=True)
    lines = [f"{t:.1f} s,{psi:.2f}°,{U:.3f} kn,{course:.2f} deg" for t, psi, U, course in rows]
    (tmp_path / "logs").mkdir()
    path = tmp_path / "logs" / "log.csv"
    path.write_text("\n".join(["time,heading,sog,cog", *lines]) + "\n")
    found, trials = imported(path, tmp_path)
    assert DOUBT not in found.partition("schema")[2]
    assert not astray(trials["log"], log, {"psi": 0.01 * DEG, "u": 0.002, "v_m": 0.002})


@pytest.mark.slow
def test_a_header_that_lies_about_speeds(tmp_path: Path) -> None:
    """Knots under a head of m/s, degrees under one of rad: said as doubts, and the import runs with the truth."""
    log = sailed(**COASTER, duration=300.0)
    sheet = Sheet().put("t [s]", log.t, 2).put("lat", log.latitude, 8).put("lon", log.longitude, 8)
    sheet.put("heading [rad]", compass(log["psi"]), 2).put("sog [m/s]", log.sog / KN, 3)
    found, trials = imported(log_of(tmp_path, sheet.put("cog [deg]", np.degrees(log.cog), 2)), tmp_path)
    assert any("header says m/s" in one for one in doubts(found, "ground"))
    assert any("header says rad" in one for one in doubts(found, "channels.psi"))
    assert not astray(trials["log"], log, {"psi": 0.01 * DEG, "u": 0.002, "v_m": 0.002})


def test_stamps_with_letters_of_a_zone_are_named(tmp_path: Path) -> None:
    log = sailed(**COASTER, duration=60.0)
    sheet = Sheet().put("when", [f"2025-10-26T02:{k // 120:02d}:{k / 2 % 60:04.1f} CEST" for k in range(log.t.size)])
    asked = guess(log_of(tmp_path, sheet.put("heading [deg]", compass(log["psi"]), 2)))
    assert asked.asks
    assert any("'when' has times that are not read" in one and "zone" in one for one in asked.doubts)


def test_a_guess_is_tried(tmp_path: Path) -> None:
    """A row that is too short in one file, of which the guess makes nothing, is a doubt with its line."""
    log = sailed(**COASTER, duration=100.0)
    sheet = Sheet().put("t [s]", log.t, 2).put("heading [deg]", compass(log["psi"]), 2)
    path = log_of(tmp_path, sheet.put("sog [kn]", log.sog / KN, 3).put("cog [deg]", compass(log.cog), 2)) / "log.csv"
    fine = tried(guess(path), path)
    assert not any("refuses" in doubt for doubt in fine.doubts)
    path.write_text(path.read_text() + "3000,1\n")
    found = tried(guess(path), path)
    assert any("the import refuses it" in doubt and "has 2 cells" in doubt for doubt in found.doubts)
    assert "# DOUBT: the import refuses it" in found.text.partition("schema")[0]


def test_a_true_wind_alone_is_a_doubt(tmp_path: Path) -> None:
    log = sailed(**COASTER, duration=200.0)
    sheet = (
        Sheet().put("t", log.t, 2).put("wind speed", log["U_T"], 2).put("wind direction", compass(log["gamma_T"]), 1)
    )
    said = " ".join(guess(log_of(tmp_path, sheet)).doubts)
    assert "where it goes to" in said
    assert "apparent" in said


@pytest.mark.long
def test_files_alike_are_asked_for_a_second_opinion(tmp_path: Path) -> None:
    """Two trials with the same columns, in one of which heading and course are the other way round."""
    for name, pair in (("a", ("heading", "course")), ("b", ("course", "heading"))):
        log = sailed(**COASTER, duration=300.0)
        sheet = (
            Sheet().put("t", log.t, 2).put("lat", log.latitude, 8).put("lon", log.longitude, 8).put("sog", log.sog, 3)
        )
        sheet.put(pair[0], compass(log["psi"]), 2).put(pair[1], np.degrees(log.cog), 2).write(tmp_path / f"{name}.csv")
    assert any("the other way round there" in one for one in guess(tmp_path).doubts)


@pytest.mark.parametrize(("rows", "about"), [
    ("t,psi\n", "no rows of numbers"), ("", "the file is empty"), ("1,2\n2,3\n3,4\n4,5\n", "no header"),
    ("a text\nof no table\n", "no rows"),
])  # fmt: skip
def test_what_is_no_table_is_refused(rows: str, about: str, tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text(rows, encoding="utf-8")
    with pytest.raises(DataError, match=about):
        guess(tmp_path)


@pytest.mark.slow
def test_constant_columns_and_few_rows_give_doubts_and_no_crash(tmp_path: Path) -> None:
    log = straight(20.0)
    assert guess(log_of(tmp_path / "few", basin(log.rows(slice(0, 4))))).asks
    flat = Sheet().put("t", np.arange(60.0), 1).put("x", np.zeros(60)).put("y", np.zeros(60)).put("psi", np.zeros(60))
    assert len(guess(log_of(tmp_path / "flat", flat.put("rudder", np.zeros(60)))).doubts) >= 3


def test_a_column_named_twice_and_no_clock_are_said(tmp_path: Path) -> None:
    log = straight(20.0)
    sheet = Sheet().put("a", log["u"], 2).put("heading", compass(log["psi"]), 2).put("heading", compass(log["psi"]), 2)
    found = guess(log_of(tmp_path, sheet))
    assert found.asks == ("time",)
    assert any("two columns are called heading" in one for one in found.doubts)


def test_a_mapping_is_never_written_over(tmp_path: Path) -> None:
    log, out = log_of(tmp_path, basin(straight(20.0))), tmp_path / "m.toml"
    out.write_text("mine", encoding="utf-8")
    with pytest.raises(RequestError, match="is there already"):
        guess_mapping(log, out)
    assert out.read_text(encoding="utf-8") == "mine"


def test_sentences_and_robots_logs_have_readers_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(
        "$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A\n" * 5, encoding="utf-8"
    )
    assert guess(tmp_path).format == "nmea"
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "x.mcap").write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(DataError, match="give a whole MCAP file"):
        guess(tmp_path / "bag")


@pytest.mark.parametrize(("head", "role", "unit"), [
    ("Rørvinkel [grader]", "delta", "deg"), ("Drehzahl (U/min)", "n_P", "rpm"), ("FüG [kn]", "sog", "kn"),
    ("dakaku(deg)", "delta", "deg"), ("HDG(T)", "heading", ""), ("SPD(GND)", "sog", ""),
    ("DGPS1_Latitude", "latitude", ""), ("yaw_rate_deg_s", "r", "deg/s"),
    ("field.twist.twist.angular.z", "r", ""), ("Wind Speed, kn", "wind_speed", "kn"), ("régime (tr/min)", "n_P", "rpm"),
])  # fmt: skip
def test_names_and_units_of_several_languages(head: str, role: str, unit: str) -> None:
    from seatrial.data.guess.naming import unit_in_name

    name, said = parted(head)
    assert meanings(name)[0].role == role
    assert (unit_of(said) or unit_in_name(name)) == unit


def test_orders_and_readings_are_told_apart() -> None:
    assert "command" in meanings("HeadingSet")[0].words
    assert "command" in meanings("Soll Ruderwinkel")[0].words
    assert "command" not in meanings("Rudder_Angle_FB")[0].words


@pytest.mark.parametrize(("text", "delimiter", "mark", "units"), [
    ("a;b\n1,5;2,5\n1,6;2,6\n", ";", ",", 0), ("a\tb\n1.5\t2\n1.6\t3\n", "\t", ".", 0),
    ("a,b\n[m],[s]\n1,2\n3,4\n", ",", ".", 1), ("  a   b\n 1   2\n 3   4\n", "whitespace", ".", 0),
    ("title\n\na,b\n1,2\n3,4\n", ",", ".", 0), ("a|b\n1|2\n3|4\n", "|", ".", 0),
])  # fmt: skip
def test_layouts(text: str, delimiter: str, mark: str, units: int, tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text, encoding="utf-8")
    found = read_text(path)
    assert (found.layout.delimiter, found.layout.decimal, found.layout.units_row, found.heads) == (
        delimiter,
        mark,
        units,
        ("a", "b"),
    )


def real(*parts: str) -> Path:
    path = Path(os.environ.get("SEATRIAL_DATA", Path(__file__).parents[4] / "shared" / "data")).joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{path} is not here: set SEATRIAL_DATA to the folder of the public data sets")
    return path


@pytest.mark.long
def test_the_public_free_running_model_as_its_reader_has_it(tmp_path: Path) -> None:
    """FRT-DS-ESSO by the guess and by its own reader: the same trials."""
    from seatrial.data.formats import reader

    folder = real("esso_osaka_frt", "data", "zigzag")
    text, trials = imported(folder, tmp_path)
    assert DOUBT not in "\n".join(text.splitlines()[3:])
    for path in sorted(folder.glob("*.csv")):
        right = reader("frt-esso")(path)
        for name in ("x", "y", "psi", "u", "v_m", "r", "delta", "n_P"):
            assert np.allclose(trials[path.stem][name][: len(right)], right[name], atol=1e-9, equal_nan=True), name


@pytest.mark.long
def test_the_public_catamaran_with_exchanged_columns(tmp_path: Path) -> None:
    """USV-ASW: the compass of one workbook is in the column called course, as its reader also finds."""
    from seatrial.data.formats import reader

    for name in ("boat1_2_circle.xlsx", "boat1_2_sin.xlsx"):
        path = real("usv_asw_twinhull", name)
        (tmp_path / path.stem).mkdir()
        _, trials = imported(path, tmp_path / path.stem)
        off = trials[path.stem]["psi"] - reader("usv-asw")(path)["psi"]
        assert np.abs(np.arctan2(np.sin(off), np.cos(off))).max() < 1e-6


@pytest.mark.long
def test_the_public_azimuth_ferry_comes_in_by_the_guess_alone(tmp_path: Path) -> None:
    """milliAmpere: topics at their own rates, nanoseconds without zeros, velocities east and north, a quaternion."""
    text, trials = imported(real("milliampere_2025"), tmp_path)
    assert set(trials) == {"nlp1", "qp1"}
    assert 'fraction = "ns"' in text
    assert 'north = "twist_linear_y"' in text
    assert not [one for one in check_folder(tuple(trials.values())) if one.severity == "error"]
    for trial in trials.values():
        assert {"x", "y", "psi", "u", "v_m", *(f"{n}_{k}" for n in ("n", "alpha") for k in (1, 2, 3, 4))} <= set(
            trial.channels
        )
        moved = np.gradient(trial["x"], trial.t), np.gradient(trial["y"], trial.t)
        ahead = moved[0] * np.cos(trial["psi"]) + moved[1] * np.sin(trial["psi"])
        good = np.isfinite(ahead + trial["u"])
        assert np.corrcoef(ahead[good], trial["u"][good])[0, 1] > 0.8


@pytest.mark.long
def test_the_public_container_ship_asks_for_what_is_not_there(tmp_path: Path) -> None:
    found = guess(real("hakusan"))
    assert {"channels.r.unit", "channels.delta.unit", "channels.delta.sign"} <= set(found.asks)
    assert re.search(rf'time = {{ column = "\{ASK}"', found.text)


@pytest.mark.slow
def test_the_command_prints_or_writes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = log_of(tmp_path, basin(straight(20.0)))
    assert main(["import", "--guess", str(log)]) == 0
    assert 'schema = "seatrial-mapping/1"' in capsys.readouterr().out
    assert main(["import", "--guess", str(log), "-o", str(tmp_path / "m.toml")]) == 0
    assert f"seatrial import csv {log} --mapping {tmp_path / 'm.toml'} -o trials" in capsys.readouterr().out
    assert main(["import", "--guess", str(log), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["format"], said["file"]) == ("csv", None)
    alone = ["csv", str(log)]
    for wrong in (["csv"], alone, [*alone, "--guess", str(log)], ["--guess", str(tmp_path / "no")]):
        assert main(["import", *wrong]) == 2
        assert len(capsys.readouterr().err.strip().splitlines()) == 1

"""Logs and mappings that cannot be right: one line with file, row and column, and nothing is written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from turning_log import DATUM, SCHEMA, fixes, table, trials, truth

from seatrial.data import DataError
from seatrial.data.folder import read_folder
from seatrial.data.formats import reader
from seatrial.data.importing import import_log
from seatrial.data.mapping.checked import read_mapping
from workbooks import write_workbook

TIME = 'time = { column = "Time", unit = "s" }\n'
HEADING = '[channels.psi]\ncolumn = "HDG"\nunit = "deg"\n'
PLACE = '[position]\nlatitude = "lat"\nlongitude = "lon"\n'


@pytest.mark.parametrize(("text", "mapping", "message"), [
    ("Time,HDG\n0,1\n1,2\n2\n", HEADING, r"line 4 has 1 cells, the header has 2"),
    ("Time,HDG\n0,1\n1,2,3\n", HEADING, r"line 3 has 3 cells, the header has 2"),
    ("Time,HDG\n0,1\n1,2,5\n", HEADING, r"line 3 has 3 cells"),
    ("Time;HDG\n0;1,5\n1;2\n", 'delimiter = ";"\n' + HEADING,
     r"column 'HDG', line 2: '1,5' is not a number; give decimal"),
    ("Time;HDG\n0;1.5\n1;2\n", 'delimiter = ";"\ndecimal = ","\n' + HEADING, r"column 'HDG', line 2: '1.5' has a dot"),
    ("Time,HDG\n0,1\n1,offline\n", HEADING,
     r"column 'HDG', line 3: 'offline' is not a number; .*missing in the mapping"),
    ("Time,HDG\n0,1 S\n1,2\n", HEADING, r"column 'HDG', line 2: '1 S' is not a number; give letters"),
    ("Time,HDG\n0,1 S\n1,2\n", HEADING + "letters = { S = 1, P = -1 }\n", r"line 3: no letter; one of S, P is needed"),
    ("Time,HDG\n0,1 S\n1,2 X\n", HEADING + "letters = { S = 1, P = -1 }\n", r"line 3: no letter 'x'"),
    ("Time,HDG\n0,1 S\n1,1x1\n", HEADING + "letters = { S = 1, P = -1 }\n",
     r"line 3: '1x1' is no number with a letter"),
    ("Time,HDG\n0,inf\n1,2\n", HEADING, r"column 'HDG', line 2: infinite"),
    ("Time,HDG,HDG\n0,1,1\n1,2,2\n", HEADING, r"column 'HDG', line 1: 2 columns of this name"),
    ("Time,HDG [rad]\n0,1\n1,2\n", HEADING.replace("HDG", "HDG [rad]"),
     r"column 'HDG \[rad\]', line 1: in rad, and the mapping says deg; give rad, or despite"),
    ("Time,HDG\ns,rad\n0,1\n1,2\n", "units_row = true\n" + HEADING,
     r"column 'HDG', line 2: in rad, and the mapping says deg"),
    ("Time,RUD\n0,1\n1,35\n", HEADING.replace("psi", "delta").replace("HDG", "RUD").replace("deg", "rad"),
     r"column 'RUD', line 3: 35 rad is no value of delta; is the column in another unit"),
    ("Time,HDG\n0,359.9\n1,0.2\n", HEADING.replace("deg", "rad"), r"column 'HDG', line 3: 0.2 rad is no value of psi"),
    ("Time,lat,lon\n0,6326.4,1025.2\n1,6326.4,1025.2\n", PLACE,
     r"column 'lat', line 2: 6326.4 is no latitude.*ddmm\.mmm"),
    ("Time,lat,lon\n0,139.5,35.1\n1,139.5,35.1\n", PLACE,
     r"column 'lat', line 2: 139.5 is no latitude.*exchanged with"),
    ("Time,lat,lon\n0,63.44,10.4\n1,63.44,1e3\n", PLACE, r"column 'lon', line 3: 1000 is no longitude"),
    ("Time,lat,lon\n0,6372.4,1025.2\n1,6372.4,1025.2\n", PLACE + 'format = "ddmm.mmm"\n',
     r"column 'lat', line 2: 72.4 minutes or seconds in 6372.4; is it in decimal degrees"),
    ("Time,lat,lon\n0,10.4 E,63.4 N\n1,10.4 E,63.4 N\n", PLACE,
     r"column 'lat', line 2: .*'E'.* are latitude and longitude"),
    ("Time,lat,lon\n0,north,3\n1,1,3\n", PLACE, r"column 'lat', line 2: 'north' is no latitude such as 63\.4412"),
    ("Time,a,b,c,d\n0,0,0,0,1\n1,0,0,1,1\n", '[heading]\nquaternion = ["a", "b", "c", "d"]\n',
     r"column 'a', line 3: a quaternion of size 1.414"),
    ("Time,HDG\n0,1\n", HEADING, r"1 rows of numbers; a trial needs at least 2"),
    ("Time,HDG\n0,1\n2,1\n1,1\n", HEADING, r"column 'Time', line 4: time goes back \(2 then 1\)"),
    ("Time,HDG,RUN\n0,1,a\n1,1,b\n2,1,a\n", HEADING + '[split]\ncolumn = "RUN"\n', r"column 'RUN', line 4: 'a' again"),
    ("Time,HDG\n0,1\n1,1\n", HEADING + '[[trial]]\nname = "a"\nfrom = 5\nto = 9\n', r"no rows between 5 and 9 s"),
    ("Time,HDG\n0,1\n1,1\n", HEADING + '[[trial]]\nname = "a"\nfrom = "10:00:00"\nto = 9\n',
     r"trial\[0\]: '10:00:00' is no number; the time of this log is seconds"),
    ("Time,HDG\n0,1 rad\n1,2 rad\n", HEADING, r"column 'HDG', line 2: in rad, and the mapping says deg"),
    ("Time,HDG\n0,1 deg\n1,2 rad\n", HEADING, r"column 'HDG', line 3: in rad, and line 2 says deg; a column has one"),
    ("Time,HDG [rad]\n0,1 deg\n1,2 deg\n", HEADING.replace("HDG", "HDG [rad]"),
     r"column 'HDG \[rad\]', line 2: in deg, and line 1 says rad"),
    ("Time,HDG\n0 ms,1\n1 ms,2\n", HEADING, r"column 'Time', line 2: in ms, and the mapping says s"),
    ("0,1\n1,2\n", HEADING, r'line 1 holds numbers, not names of columns; .*columns = \["t", "psi", ...\]'),
    ("0,1\n1,2\n", 'columns = ["Time", "HDG", "RUD"]\n' + HEADING,
     r"line 1 has 2 cells, columns of the mapping has 3"),
    ("Time,HDG\n0,\xe6\n1,1\n", HEADING, r'not readable as utf-8 text, line 2 .*encoding = "latin-1"'),
])  # fmt: skip
def test_a_wrong_log_is_refused_in_one_line_and_nothing_is_written(
    tmp_path: Path, text: str, mapping: str, message: str
) -> None:
    (tmp_path / "log.csv").write_text(text, encoding="latin-1")
    (tmp_path / "m.toml").write_text(SCHEMA + TIME + mapping)
    with pytest.raises(DataError, match=message) as error:
        import_log("csv", tmp_path / "log.csv", tmp_path / "out", tmp_path / "m.toml")
    assert "\n" not in str(error.value)
    assert "log.csv" in str(error.value) or "trial" in str(error.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("mapping", "message"), [
    (HEADING + '[channels.delta]\ncolumn = "HDG"\nunit = "deg"\n',
     "column 'HDG' is used twice, by channels.psi.column and channels.delta.column"),
    (HEADING.replace("HDG", "Time"), "column 'Time' is used twice, by time.column and channels.psi.column"),
    (HEADING + 'latters = { P = -1 }\n', "channels.psi.latters: no key 'latters'; near: letters"),
    (HEADING + 'interpolate = "cubic"\n', "channels.psi.interpolate is 'cubic'"),
    (HEADING + "limit = 0\n", "channels.psi.limit is 0"),
    (HEADING + 'file = "a.csv"\n', "channels.psi.file is 'a.csv'; files.pattern must say"),
    (HEADING + 'letter = "SIDE"\n', "channels.psi.letters is missing"),
    (HEADING + '[position]\nlatitude = "lat"\n', "position.longitude is missing"),
    (HEADING + PLACE + "antenna = [1.0]\n", "position.antenna must be two numbers"),
    (HEADING + PLACE + "datum = [120.0, 3.0]\n", "position.datum: datum at latitude 120"),
    (PLACE + "antenna = [1.0, 2.0]\n", "position.antenna needs the heading"),
    (HEADING + '[channels.x]\ncolumn = "x"\nunit = "m"\n' + PLACE, "position gives x and y, which channels gives too"),
    (HEADING + '[ground]\nspeed = "SOG"\n', "ground needs speed and course, or north and east"),
    ('[ground]\nspeed = "SOG"\ncourse = "COG"\n', "ground needs the heading"),
    (HEADING + '[ground]\nspeed = "SOG"\ncourse = "COG"\nunit = "deg"\n',
     "ground.unit: .*unit 'deg' cannot measure it"),
    (HEADING + '[heading]\nquaternion = ["a", "b", "c", "d"]\n', "heading gives psi, which channels gives too"),
    (HEADING + '[files]\npattern = "../a.csv"\n', "files: '../a.csv' must be a path below the folder"),
    (HEADING + '[files]\npattern = "a.csv"\njoin = "rows"\nstep = 1.0\n', "files.join = \"rows\" joins pieces"),
    (HEADING + '[apparent]\nspeed = "AWS"\ndirection = "AWA"\nsign = 2\n', "apparent.sign is 2; it must be 1 or -1"),
    ('columns = ["a", "a", "", ""]\n' + HEADING, "columns: 'a' is there twice"),
    (HEADING.replace("deg", "?"), r'line 5: channels.psi.unit is "\?"; write the answer to the doubt above it'),
    (HEADING + "sign='?' # to starboard?\n", r'line 6: channels.psi.sign is "\?"'),
    (HEADING + '[split]\ngap = 0.0\n', "split.gap is 0"),
    (HEADING + '[[trial]]\nname = "a/b"\nfrom = 0\nto = 1\n', "trial.0..name is 'a/b'"),
    (HEADING + '[[trial]]\nname = "a"\nfrom = 2\nto = 1\n', "trial.0. .'a'.: from 2 to 1; 'to' must be later"),
    (HEADING + '[[trial]]\nname = "a"\nfrom = 0\nto = 1\nset_points = { heading = 10 }\n', "set_points: heading is 10"),
    (HEADING + '[[trial]]\nname = "a"\nfrom = 0\n', "trial.0.to is missing"),
    (HEADING + '[[trial]]\nname = "a"\nfrom = true\nto = 1\n',
     "trial.0.from is True; it must be a finite number or a text"),
])  # fmt: skip
def test_a_mapping_that_cannot_mean_what_it_says(tmp_path: Path, mapping: str, message: str) -> None:
    (tmp_path / "m.toml").write_text(SCHEMA + TIME + mapping)
    with pytest.raises(DataError, match=f"m.toml: .*{message}") as error:
        read_mapping(tmp_path / "m.toml")
    assert "\n" not in str(error.value)


def test_a_unit_of_the_file_that_is_wrong_can_be_said_to_be(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", {"Time": [0, 1], "HDG [rad]": [350, 10]})
    [found] = trials(path, TIME + HEADING.replace("HDG", "HDG [rad]") + 'despite = "rad"\n')
    assert np.degrees(found["psi"]) == pytest.approx([350.0, 370.0])
    path = table(tmp_path / "a.csv", {"Time": [0, 1], "HDG (t)": [350, 10]})  # true, not tons
    assert len(trials(path, TIME + HEADING.replace("HDG", "HDG (t)"))[0]) == 2
    (tmp_path / "a.csv").write_text("Time,HDG\ns,m/s\n0,1\n1,2\n")
    with pytest.raises(DataError, match="column 'HDG', line 2: in m/s, and the mapping says deg"):
        trials(path, "units_row = true\n" + TIME + HEADING)


@pytest.mark.parametrize("swapped", [False, True])
def test_exchanged_latitude_and_longitude_show_against_heading_and_speed(tmp_path: Path, swapped: bool) -> None:
    """63 N, 10 E are both possible latitudes; the track that they give turns the other way."""
    true = truth()
    latitude, longitude = fixes(true)
    course = np.degrees(true["psi"] + np.arctan2(true["v_m"], true["u"])) % 360.0
    path = table(tmp_path / "a.csv", {
        "Time": true.t, "HDG": np.degrees(true["psi"]) % 360.0, "SOG": np.hypot(true["u"], true["v_m"]), "COG": course,
        "lat": longitude if swapped else latitude, "lon": latitude if swapped else longitude,
    })  # fmt: skip
    text = TIME + HEADING + PLACE + '[ground]\nspeed = "SOG"\ncourse = "COG"\n'
    if swapped:
        with pytest.raises(
            DataError, match=r"a\.csv: column 'lat', line 2: the track fits .* only with 'lat' and 'lon'"
        ):
            trials(path, text)
    else:
        assert trials(path, text)[0].meta["datum"]["latitude"] == pytest.approx(DATUM.latitude)


def test_the_row_of_a_workbook_is_that_of_the_sheet(tmp_path: Path) -> None:
    book = write_workbook(tmp_path / "a.xlsx", [["made by hand"], [], ["Time", "HDG"], ["0", "1"], ["1", "1.2.3"]])
    with pytest.raises(DataError, match=r"a\.xlsx: column 'HDG', row 5: '1\.2\.3' is not a number"):
        trials(book, "skip = 2\n" + TIME + HEADING)
    with pytest.raises(DataError, match=r"a\.xlsx: no sheet 'Dta'"):
        trials(book, 'sheet = "Dta"\n' + TIME + HEADING)
    (tmp_path / "b.xlsx").write_bytes(b"PK\x03\x04 no book")
    with pytest.raises(DataError, match=r"b\.xlsx: not readable as a workbook"):
        trials(tmp_path / "b.xlsx", TIME + HEADING)


def test_a_log_in_the_folder_of_the_trials_is_not_written_over(tmp_path: Path) -> None:
    path = table(tmp_path / "a.csv", {"Time": [0, 1], "HDG": [350, 10]})
    (tmp_path / "m.toml").write_text(SCHEMA + TIME + HEADING)
    before = path.read_bytes()
    with pytest.raises(DataError, match=r"a\.csv: a log would be written over"):
        import_log("csv", path, tmp_path, tmp_path / "m.toml")
    assert path.read_bytes() == before


def test_whoever_reads_logs_by_a_mapping_refuses_its_questions(tmp_path: Path) -> None:
    """Not only the import: studies, trials and check open logs by `reader` and `recordings`."""
    (tmp_path / "log.csv").write_text("Time,HDG\n0,1\n1,2\n")
    (tmp_path / "m.toml").write_text(SCHEMA + 'time = { column = "Time", unit = "?" }\n' + HEADING)
    for opened in (reader, lambda name, mapping: read_folder(tmp_path, name, mapping)):
        with pytest.raises(DataError, match=r'm\.toml: line 2: time\.unit is "\?"; write the answer'):
            opened("csv", tmp_path / "m.toml")

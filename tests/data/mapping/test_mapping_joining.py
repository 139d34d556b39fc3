"""Several files of one trial: topics at their own rates and starts, and logs that are cut over files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from turning_log import SCHEMA, at, table, trials, truth

from seatrial.data import DataError
from seatrial.data.importing import import_log
from seatrial.data.mapping.checked import read_mapping
from seatrial.data.mapping.joining import Series, joined
from seatrial.data.mapping.reading import read
from seatrial.data.mapping.recordings import recordings
from seatrial.data.mapping.schema import Sensor
from seatrial.data.trialfile import read_trial

TIME = 'time = { column = "Time", format = "iso", zone = "Europe/Oslo" }\n'
HEADING = '[channels.psi]\ncolumn = "HDG"\nunit = "deg"\n'
TOPICS = TIME + '[files]\npattern = "gps/heading.csv"\n' + HEADING + (
    '[channels.n_P]\ncolumn = "rpm"\nunit = "rpm"\nfile = "engine/shaft.csv"\n'
    '[channels.delta]\ncolumn = "data"\nunit = "deg"\nfile = "rudder.csv"\nlag = 0.2\nlimit = 1.0\n'
    '[channels.delta_cmd]\ncolumn = "order"\nunit = "deg"\nfile = "order.csv"\ninterpolate = "hold"\nlimit = 60\n'
)  # fmt: skip


def write_topics(folder: Path) -> Path:
    """Heading at 2 Hz, the shaft at 5 Hz from 0.33 s on, the rudder at 10 Hz with a gap late by .2 s, two orders."""
    slow, shaft, rudder = truth(0.5), truth(0.2, 110.0, 0.33), truth(0.1)
    kept = (rudder.t < 50.0) | (rudder.t > 55.0)
    table(folder / "gps" / "heading.csv", {"Time": [at(t) for t in slow.t], "HDG": np.degrees(slow["psi"]) % 360.0})
    table(folder / "engine" / "shaft.csv", {"Time": [at(t) for t in shaft.t], "rpm": 60.0 * (2.0 + 0.01 * shaft.t)})
    table(folder / "rudder.csv", {"Time": [at(t + 0.2) for t in rudder.t[kept]], "data": rudder.t[kept] / 10.0})
    table(folder / "order.csv", {"Time": [at(-3.0), at(10.0)], "order": [-20, 20]})
    return folder


@pytest.mark.slow
def test_topics_at_their_own_rates_are_joined_by_time(tmp_path: Path) -> None:
    for name in ("nlp1", "qp1"):
        write_topics(tmp_path / "raw" / name)
    (tmp_path / "m.toml").write_text(SCHEMA + TOPICS)
    paths = import_log("csv", tmp_path / "raw", tmp_path / "out", tmp_path / "m.toml")
    assert [path.name for path in paths] == ["nlp1.csv", "qp1.csv"]
    found, true = read_trial(paths[0]), truth(0.5)
    assert found.t == pytest.approx(true.t, abs=1e-9)
    early, late = found.t < 0.33, found.t > 110.3
    assert np.isnan(found["n_P"][early | late]).all(), "nothing is made up before a topic begins or after it ends"
    assert found["n_P"][~early & ~late] == pytest.approx(2.0 + 0.01 * found.t[~early & ~late])
    gap = (found.t > 49.95) & (found.t < 55.05)
    assert np.isnan(found["delta"][gap]).all(), "a gap of 5 s is longer than the limit of 1 s"
    assert np.degrees(found["delta"][~gap][:-1]) == pytest.approx(found.t[~gap][:-1] / 10.0)
    assert np.degrees(found["delta_cmd"][:30]) == pytest.approx([-20.0] * 20 + [20.0] * 10)
    assert np.isnan(found["delta_cmd"][found.t > 70.5]).all()
    assert any(step.startswith("delta joined from rudder.csv: linear within 1 s, 0.2 s late")
               for step in found.meta["processing"])  # fmt: skip


def test_even_rows_and_the_name_of_the_trial_in_those_of_its_files(tmp_path: Path) -> None:
    for name in ("zz_10", "zz_20"):
        table(tmp_path / f"{name}_gps.csv", {"Time": [at(t) for t in (0.0, 1.0, 2.0)], "HDG": [350, 0, 10]})
        table(tmp_path / f"{name}_rud.csv", {"Time": [at(t) for t in (0.0, 2.0)], "data": [0, 20]})
    text = TIME + '[files]\npattern = "{trial}_gps.csv"\nstep = 0.25\n' + HEADING + (
        '[channels.delta]\ncolumn = "data"\nunit = "deg"\nfile = "{trial}_rud.csv"\n')  # fmt: skip
    (tmp_path / "m.toml").write_text(SCHEMA + text)
    mapping = read_mapping(tmp_path / "m.toml")
    found = [read(one, mapping)[0] for one in recordings(tmp_path, mapping)]
    assert [one.name for one in found] == ["zz_10", "zz_20"]
    assert found[1].t == pytest.approx(0.25 * np.arange(9))
    assert np.degrees(found[1]["psi"]) == pytest.approx(350.0 + 10.0 * found[1].t)
    assert np.degrees(found[1]["delta"]) == pytest.approx(10.0 * found[1].t)


def test_one_trial_that_is_cut_over_files(tmp_path: Path) -> None:
    """Pieces go by their times, as names count 1, 10, 2; the error of a row names its own piece."""
    for name, begin in (("log_1", 0), ("log_2", 3), ("log_10", 6)):
        table(tmp_path / f"{name}.csv", {"Time": range(begin, begin + 3), "HDG": range(begin, begin + 3)})
    text = 'time = { column = "Time", unit = "s" }\n[files]\npattern = "{trial}_*.csv"\njoin = "rows"\n' + HEADING
    [found] = trials(tmp_path / "log_1.csv", text)
    assert found.name == "log"
    assert found.t.tolist() == list(range(9))
    assert np.degrees(found["psi"]) == pytest.approx(range(9))
    table(tmp_path / "log_2.csv", {"Time": [3, 4, "4"], "HDG": [1, 2, 3]})
    with pytest.raises(DataError, match=r"log_2\.csv: column 'Time', line 4: time repeats"):
        trials(tmp_path / "log_1.csv", text)
    table(tmp_path / "log_2.csv", {"Time": [3, 4, 5], "HDG": [1, "x", 3]})
    with pytest.raises(DataError, match=r"log_2\.csv: column 'HDG', line 3: 'x' is not a number"):
        trials(tmp_path / "log_1.csv", text)


@pytest.mark.parametrize(("how", "values"), [
    ("linear", [np.nan, 1.0, 1.5, 2.0, np.nan, np.nan, 7.0, np.nan]),
    ("nearest", [1.0, 1.0, 1.0, 2.0, 2.0, 7.0, 7.0, 7.0]),
    ("hold", [np.nan, 1.0, 1.0, 2.0, 2.0, np.nan, 7.0, 7.0]),
])  # fmt: skip
def test_how_a_value_comes_to_a_row(how: str, values: list[float]) -> None:
    series = Series(np.array([0.0, 1.0, 6.0]), {"u": np.array([1.0, 2.0, 7.0])}, np.arange(3))
    sensor = Sensor(interpolate=how, limit=1.2)  # type: ignore[arg-type]
    found = joined(series, "u", sensor, np.array([-0.5, 0.0, 0.5, 1.0, 2.0, 5.0, 6.0, 7.0]))
    assert found == pytest.approx(values, nan_ok=True)


def test_a_sparse_column_is_joined_by_the_step_of_its_own_values() -> None:
    """A slow instrument in a table of a quick one: nine of ten cells are empty."""
    t = 0.1 * np.arange(101)
    series = Series(t, {"u": np.where(np.arange(101) % 10 == 0, t, np.nan)}, np.arange(101))
    assert joined(series, "u", Sensor(lag=0.25), t[5:90]) == pytest.approx(t[5:90] + 0.25)


def test_a_heading_is_joined_over_north() -> None:
    series = Series(np.array([0.0, 1.0]), {"psi": np.radians([359.0, 1.0])}, np.arange(2))
    found = joined(series, "psi", Sensor(limit=2.0), np.array([0.5]))
    assert np.degrees(found) == pytest.approx(360.0)


@pytest.mark.parametrize(("change", "message"), [
    (("Time", "2026"), r"rudder\.csv: no row within 1 s of a value: delta is from"),
    (("clock", ""), r"rudder\.csv: column 'Time': its clock is a time of day, that of the rows absolute"),
    (("missing", ""), r"no file rudder\.csv; it is named in the mapping"),
    (("nothing", ""), r"raw: no file 'gps/heading\.csv' in this folder or below"),
])  # fmt: skip
def test_files_that_cannot_be_joined(tmp_path: Path, change: tuple[str, str], message: str) -> None:
    folder, text = write_topics(tmp_path / "raw" / "nlp1"), TOPICS
    rudder = folder / "rudder.csv"
    if change[0] == "Time":
        rudder.write_text(rudder.read_text().replace("2025-", f"{change[1]}-"))
    elif change[0] == "clock":
        table(rudder, {"Time": ["10:00:00", "10:00:01"], "data": [1, 2]})
        text += '[files.clocks."rudder.csv"]\ncolumn = "Time"\nformat = "clock"\n'
    else:
        (rudder if change[0] == "missing" else folder / "gps" / "heading.csv").unlink()
    (tmp_path / "m.toml").write_text(SCHEMA + text)
    with pytest.raises(DataError, match=message) as error:
        import_log("csv", tmp_path / "raw", tmp_path / "out", tmp_path / "m.toml")
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_real_ferry_is_joined_by_a_mapping_alone(data_file, tmp_path: Path) -> None:
    """Stamps whose nanoseconds lack their leading zeros: the log's own headers show the same times."""
    folder = data_file("milliampere_2025")
    text = (
        TOPICS[: TOPICS.index("[channels.n_P]")]
        .replace("gps/", "vectorVS330/")
        .replace('column = "Time"', 'column = "time"')
    )
    text = text.replace(
        HEADING, '[heading]\nquaternion = ["quaternion_x", "quaternion_y", "quaternion_z", "quaternion_w"]\n'
    )
    text = text.replace('"Europe/Oslo"', '"Europe/Oslo", fraction = "ns"')
    for n in range(1, 5):
        text += (
            f'[channels.alpha_{n}]\ncolumn = "data"\nunit = "deg"\nfile = "actuators/actuator_{n}/azimuth_angle.csv"\n'
        )
    (tmp_path / "m.toml").write_text(SCHEMA + text)
    stamp = 'time = { column = "header_stamp_secs", nanoseconds = "header_stamp_nsecs", format = "epoch" }\n'
    (tmp_path / "h.toml").write_text(SCHEMA + stamp + text[text.index("[files]") : text.index("[channels.alpha_1]")])
    mapping, headers = read_mapping(tmp_path / "m.toml"), read_mapping(tmp_path / "h.toml")
    for source, rows in zip(recordings(folder, mapping), (9855, 6838), strict=True):
        [found], [own] = read(source, mapping), read(source, headers)
        assert len(found) == rows
        late = (found.t - own.t) - np.median(found.t - own.t)
        assert np.median(np.abs(late)) < 0.005
        assert np.percentile(np.abs(late), 95) < 0.05
        assert np.isfinite(found["alpha_4"]).mean() > 0.98
        assert np.abs(np.diff(found["psi"])).max() < 0.1

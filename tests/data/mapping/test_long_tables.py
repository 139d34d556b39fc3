"""Tables of one value a row: each name at its own times, in any order of rows, to the last digit that is written."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.guess import guess
from seatrial.data.guess.layout import read_text
from seatrial.data.mapping.checked import read_mapping
from seatrial.data.mapping.reading import read
from seatrial.data.mapping.schema import Channel, Clock, Long, Mapping

START = datetime(2026, 5, 1, 9, 0, 0, tzinfo=UTC)


@dataclass
class Drawn:
    """A long table by chance.

    Attributes:
        text: of the file.
        how: the mapping that reads it.
        truth: milliseconds after the first and values, as they are written, by name.
    """

    text: str
    how: Mapping
    truth: dict[str, tuple[list[int], list[float]]]


def drawn(seed: int) -> Drawn:
    """Two to five names with rates, starts and gaps of their own, in one of four orders of rows."""
    hand = np.random.default_rng(seed)
    split, comma = bool(hand.random() < 0.3), bool(hand.random() < 0.3)
    parts = [("gps", "speed"), ("gps", "course"), ("imu", "rate"), ("log", "speed"), ("helm", "rudder angle")]
    chosen = [parts[k] for k in hand.permutation(len(parts))[: hand.integers(2, 6)]]
    names = [".".join(one) for one in chosen]
    rows: list[tuple[int, int, str]] = []
    truth: dict[str, tuple[list[int], list[float]]] = {}
    for k, name in enumerate(names):
        step, digits = int(hand.choice([100, 250, 1000])), int(hand.integers(0, 9))
        ticks = np.arange(int(hand.integers(12, 40))) * step + int(hand.integers(0, 3)) * 50
        ticks = ticks[hand.random(ticks.size) < 0.8]
        cells = [f"{value:.{digits}f}" for value in hand.normal(size=ticks.size) * 10.0 ** hand.integers(-3, 4)]
        cells = ["" if hand.random() < 0.05 else cell for cell in cells]
        truth[name] = ticks.tolist(), [float(cell) if cell else np.nan for cell in cells]
        rows += [(int(tick), k, cell) for tick, cell in zip(ticks, cells, strict=True)]
    order = str(hand.choice(["time", "name", "any", "back"]))
    if order == "any":
        rows = [rows[j] for j in hand.permutation(len(rows))]
    elif order != "name":
        rows.sort(key=lambda one: one[0], reverse=order == "back")
    mark, heads = (";" if comma else ","), (["group", "field"] if split else ["path"])
    lines = [mark.join(["id", "time", *heads, "value", "unit"])]
    for j, (tick, k, cell) in enumerate(rows):
        when = (START + timedelta(milliseconds=tick)).isoformat(timespec="milliseconds")
        said = chosen[k] if split else (names[k],)
        lines.append(mark.join([str(j), when, *said, cell.replace(".", "," if comma else "."), "m/s"]))
    how = Mapping(
        time=Clock("time", format="iso"), delimiter=mark, decimal="," if comma else ".",
        channels={f"c_{k}": Channel(name, "m/s") for k, name in enumerate(names)},
        long=Long(tuple(heads), "value", "unit" if hand.random() < 0.5 else None),
    )  # fmt: skip
    return Drawn("\n".join(lines) + "\n", how, truth)


def check(folder: Path, seed: int) -> None:
    one = drawn(seed)
    (folder / "log.csv").write_text(one.text, encoding="utf-8")
    (trial,) = read(folder / "log.csv", one.how)
    ticks = sorted({tick for some, _ in one.truth.values() for tick in some})
    np.testing.assert_array_equal(np.round(1000.0 * trial.t).astype(int), np.array(ticks) - ticks[0])
    assert trial.meta["start"].startswith((START + timedelta(milliseconds=ticks[0])).isoformat()[:19])
    for k, (own, values) in enumerate(one.truth.values()):
        expected = np.full(len(ticks), np.nan)
        expected[np.searchsorted(ticks, own)] = values
        np.testing.assert_array_equal(trial[f"c_{k}"], expected)


@pytest.mark.slow
def test_what_is_written_comes_back_to_the_last_digit(tmp_path: Path) -> None:
    for seed in range(25):
        check(tmp_path, seed)


@pytest.mark.long
def test_what_is_written_comes_back_a_thousand_times(tmp_path: Path) -> None:
    for seed in range(25, 1025):
        check(tmp_path, seed)


PLAIN = Mapping(time=Clock("t", unit="s"), channels={"psi": Channel("hdg", "deg"), "delta": Channel("rud", "deg")},
                long=Long(("name",), "value"))  # fmt: skip


def test_a_value_that_is_written_when_it_changes_holds_until_the_next(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,name,value\n0,hdg,1\n0,rud,5\n1,hdg,2\n2,hdg,3\n2.5,rud,-5\n3,hdg,4\n")
    (gaps,) = read(path, PLAIN)
    nan = np.nan
    np.testing.assert_array_equal(gaps.t, [0, 1, 2, 2.5, 3])
    np.testing.assert_array_equal(np.round(np.degrees(gaps["delta"]), 9), [5, nan, nan, -5, nan])
    np.testing.assert_array_equal(np.round(np.degrees(gaps["psi"]), 9), [1, 2, 3, nan, 4])
    held = Long(("name",), "value", hold=("rud",))
    (whole,) = read(path, Mapping(time=PLAIN.time, channels=PLAIN.channels, long=held))
    np.testing.assert_array_equal(np.round(np.degrees(whole["delta"]), 9), [5, 5, 5, -5, -5])
    np.testing.assert_array_equal(whole["psi"], gaps["psi"])


def test_a_value_that_is_there_twice_is_refused_or_chosen(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("t,name,value\n0,hdg,1\n0,rud,5\n1,hdg,2\n1,hdg,4\n1,rud,5\n2,hdg,3\n2,rud,5\n")
    with pytest.raises(DataError, match=r"column 't', line 5: time repeats"):
        read(path, PLAIN)
    for rule, value in (("first", 2.0), ("last", 4.0), ("mean", 3.0)):
        how = Mapping(time=PLAIN.time, channels=PLAIN.channels, long=PLAIN.long, duplicates=rule)  # type: ignore[arg-type]
        assert np.degrees(read(path, how)[0]["psi"][1]) == pytest.approx(value)


@pytest.mark.parametrize(("old", "new", "said"), [
    ("1,rud", "1,rudder", ""), ("2,hdg,3", "2,hdg,x", r"column 'hdg', line 6: 'x' is not a number"),
    ("rud", "ror", r"column 'name': no name 'rud'; known: hdg, ror"), ("name", "path", r"no column 'name'"),
    ("2,hdg", ",hdg", "column 't', line 6: no time"),
])  # fmt: skip
def test_what_is_wrong_is_named_with_its_line(old: str, new: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    text = "t,name,value\n0,hdg,1\n0,rud,5\n1,hdg,2\n1,rud,5\n2,hdg,3\n2,rud,5\n"
    path.write_text(text.replace(old, new))
    if not said:
        assert np.isnan(read(path, PLAIN)[0]["delta"][1])
        return
    with pytest.raises(DataError, match=said):
        read(path, PLAIN)


def test_units_of_a_long_table_are_those_of_its_names(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = "t,name,value,unit\n0,hdg,1,deg\n0,rud,5,{0}\n1,hdg,2,deg\n1,rud,5,{1}\n"
    how = Mapping(time=PLAIN.time, channels=PLAIN.channels, long=Long(("name",), "value", "unit"))
    path.write_text(rows.format("deg", "deg"))
    assert np.degrees(read(path, how)[0]["delta"][0]) == pytest.approx(5.0)
    path.write_text(rows.format("rad", "rad"))
    with pytest.raises(DataError, match=r"column 'rud', line 3: in rad, and the mapping says deg"):
        read(path, how)
    path.write_text(rows.format("deg", "rad"))
    with pytest.raises(DataError, match=r"column 'unit', line 5: 'rad' for rud, that was in 'deg' before"):
        read(path, how)


@pytest.mark.parametrize(("more", "said"), [
    ("[long]\nname = []\nvalue = 'v'\n", "long.name is empty"),
    ("[long]\nname = ['n']\nvalue = 'v'\nhold = ['r']\n", "long.hold: no column of the mapping 'r'"),
    ("[long]\nname = ['n']\nvalue = 'v'\n[split]\ncolumn = 'trial'\n", "long is of one table with a clock"),
    ("[long]\nname = ['n']\nvalue = 'v'\n[files]\npattern = 'a.csv'\n", "long is of one table with a clock"),
])  # fmt: skip
def test_a_long_table_that_cannot_be_is_refused(more: str, said: str, tmp_path: Path) -> None:
    text = ('schema = "seatrial-mapping/1"\ntime = { column = "t", unit = "s" }\n'
            '[channels.psi]\ncolumn = "hdg"\nunit = "deg"\n')  # fmt: skip
    (tmp_path / "m.toml").write_text(text + more)
    with pytest.raises(DataError, match=said):
        read_mapping(tmp_path / "m.toml")


T = np.arange(300) * 1.0
TRACK = {
    "heading": 20.0 * np.sin(T / 20.0), "rate": np.cos(T / 20.0), "rudder": np.where(np.sin(T / 20.0) > 0, -10.0, 10.0),
}  # fmt: skip


def historian(folder: Path, quality: bool) -> Path:
    """Tags of a historian by name: the heading and its rate each second, the rudder when it changes."""
    lines = ["Tag;Timestamp;Value;Units" + ";Quality" * quality]
    for tag, unit, values in (("Heading", "deg", TRACK["heading"]), ("ROT", "deg/s", TRACK["rate"]),
                              ("Rudder", "deg", TRACK["rudder"])):  # fmt: skip
        changed = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
        for k in changed.tolist():
            when = (START + timedelta(seconds=float(T[k]))).strftime("%Y-%m-%d %H:%M:%S")
            lines.append(f"{tag};{when};{values[k]:.4f};{unit}" + (";Bad" if k % 9 == 4 else ";Good") * quality)
    (folder / "tags.csv").write_text("\n".join(lines) + "\n")
    return folder / "tags.csv"


@pytest.mark.slow
@pytest.mark.parametrize("quality", [False, True])
def test_a_guess_reads_the_tags_of_a_historian(quality: bool, tmp_path: Path) -> None:
    path = historian(tmp_path, quality)
    found = guess(path)
    assert '[long]\nname = ["Tag"]\nvalue = "Value"\nunit = "Units"\nhold = ["Rudder"]' in found.text
    assert any("written when it changes" in one for one in found.doubts)
    assert any("'Quality' (Bad, Good)" in one for one in found.doubts) == quality
    (tmp_path / "m.toml").write_text(found.text.replace('sign = "?"', "sign = 1"))
    (trial,) = read(path, read_mapping(tmp_path / "m.toml"))
    np.testing.assert_allclose(np.degrees(trial["psi"]), TRACK["heading"], atol=1e-4)
    np.testing.assert_allclose(np.abs(np.degrees(trial["delta"])), 10.0, atol=1e-6)


@pytest.mark.slow
def test_a_guess_sees_all_names_where_the_rows_of_one_fill_its_beginning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("seatrial.data.guess.logs.read_text", lambda path: read_text(path, 100))
    found = guess(historian(tmp_path, False))
    assert 'column = "Rudder"' in found.text


@pytest.mark.slow
def test_paths_of_signal_k_are_in_si(tmp_path: Path) -> None:
    """Speeds of 3 m/s would be as likely in knots, and a heading below 6.28 in degrees."""
    t = np.arange(120)
    said = {"navigation.headingTrue": 0.7 + 0.002 * t, "navigation.speedOverGround": 3.0 + 0.001 * t,
            "navigation.courseOverGroundTrue": 0.7 + 0.002 * t, "steering.rudderAngle": 0.1 * np.sin(0.1 * t),
            "navigation.rateOfTurn": np.full(120, 0.002)}  # fmt: skip
    lines = ["timestamp,path,value"]
    for k in t.tolist():
        when = (START + timedelta(seconds=k)).strftime("%Y-%m-%dT%H:%M:%SZ")
        lines += [f"{when},{path},{values[k]:.5f}" for path, values in said.items()]
    path = tmp_path / "sk.csv"
    path.write_text("\n".join(lines) + "\n")
    text = guess(path).text
    for unit in ('speed = "navigation.speedOverGround"\ncourse = "navigation.courseOverGroundTrue"\nunit = "m/s"',
                 'column = "navigation.headingTrue"\nunit = "rad"', 'column = "navigation.rateOfTurn"\nunit = "rad/s"',
                 'column = "steering.rudderAngle"\nunit = "rad"'):  # fmt: skip
        assert unit in text


def test_longitudes_lie_on_lines_between_their_own_times(tmp_path: Path) -> None:
    """A latitude every second, a longitude half a second later, a degree east for one to the north."""
    rows = [(k, f"{k},lat,{50.0 + 0.001 * k:.4f}") for k in range(30)]
    rows += [(k + 0.5, f"{k + 0.5},lon,{9.0 + 0.001 * (k + 0.5):.4f}") for k in range(30) if k not in (11, 12, 13)]
    rows += [(k + 0.25, f"{k + 0.25},hdg,30.0") for k in range(30)]
    (tmp_path / "a.csv").write_text("t,name,value\n" + "\n".join(line for _, line in sorted(rows)) + "\n")
    (tmp_path / "m.toml").write_text("""schema = "seatrial-mapping/1"
time = { column = "t", unit = "s" }
[long]
name = ["name"]
value = "value"
[channels.psi]
column = "hdg"
unit = "deg"
[position]
latitude = "lat"
longitude = "lon"
datum = [50.0, 9.0]
""")
    (found,) = read(tmp_path / "a.csv", read_mapping(tmp_path / "m.toml"))
    known = np.flatnonzero(np.isfinite(found["x"]))
    at = np.round(found.t[known] + 0.0).astype(int)
    assert sorted(set(range(30)) - set(at.tolist())) == [0, 11, 12, 13, 14], "no line over a gap, none before the first"
    assert found["y"][known] / found["x"][known] == pytest.approx(np.cos(np.radians(50.0)), rel=5e-3)

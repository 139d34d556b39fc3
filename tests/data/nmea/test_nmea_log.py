"""A run told in sentences and imported again is the run within the last digit of the sentences."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from exact_instruments import told_by_exact

from seatrial.cli.app import main
from seatrial.data import DataError
from seatrial.data.formats import nmea
from seatrial.data.geodesy import Datum
from seatrial.data.importing import import_log
from seatrial.data.nmea.framing import Line, Tag, datagram
from seatrial.data.nmea.sentences import checksum
from seatrial.data.nmea.ship import SPOKEN, Fittings
from seatrial.data.nmea.ship import lines as spoken
from seatrial.data.robot.files import opened
from seatrial.data.robot.messages import NUMBER, unpacked
from seatrial.data.trialfile import read_trial
from seatrial.exchange.robot_log import save_robot_log

pytestmark = pytest.mark.slow

FIT = Fittings(Datum(59.43, 10.45), antenna=(2.5, -0.4), log=1.0, stern=-3.5, transducer=0.3, mmsi=0)
MAPPING = """schema = "seatrial-nmea/1"
antenna = { forward = 2.5, starboard = -0.4 }
log = { forward = 1.0 }
datum = { latitude = 59.43, longitude = 10.45 }
L_pp = 7.0
ship = "kvlcc2_l7"
"""
DT, ROWS = 0.1, 300
# Half of the last digit: 1e-7 minutes, 0.01 deg, 0.001 kn, 0.01 deg/min, 0.01 rev/min; v_m and x, y also
# carry the digit of what they are corrected by.
DIGIT = {
    "x": 3e-4, "y": 3e-4, "psi": 8.8e-5, "r": 1.5e-6, "u": 2.7e-4, "v_m": 2.7e-4, "delta": 8.8e-5, "n_P": 8.4e-5,
    "U_T": 5.1e-4, "gamma_T": 1.8e-4, "U_G": 2.7e-4, "gamma_G": 8.8e-5,
}  # fmt: skip


def run() -> list[dict[str, float]]:
    """A ship that turns through north, with everything changing."""
    t = np.arange(ROWS) * DT
    psi, r = 6.0 + 0.4 * np.sin(0.1 * t), 0.04 * np.cos(0.1 * t)
    rows = {
        "t": t, "psi": psi, "r": r, "x": 3.0 * t, "y": -40.0 + 0.5 * t, "u": 1.2 + 0.1 * np.sin(t), "v_m": -2.0 * r,
        "delta": 0.3 * np.sin(0.5 * t), "n_P": 10.0 + 0.1 * t,
        "wind_x": np.full(ROWS, 5.0), "wind_y": np.full(ROWS, -2.0),
        "current_x": np.full(ROWS, 0.2), "current_y": np.zeros(ROWS), "per_depth": np.full(ROWS, 1 / 3.0),
    }  # fmt: skip
    return [{name: float(values[k]) for name, values in rows.items()} for k in range(ROWS)]


def lines(kind: str, fit: Fittings, now: dict[str, float]) -> list[bytes]:
    return spoken(kind, fit, told_by_exact(fit, now))


def tagged(now: dict[str, float], kinds=SPOKEN) -> bytes:
    tag = Tag("II0001", None, FIT.epoch + now["t"])
    return b"".join(datagram([Line(one, tag)])[6:] for kind in kinds for one in lines(kind, FIT, now))


def imported(tmp_path, log: bytes, mapping: str | None = MAPPING):
    (tmp_path / "log.nmea").write_bytes(log)
    if mapping is not None:
        (tmp_path / "m.toml").write_text(mapping)
    out = tmp_path / f"out{len(list(tmp_path.iterdir()))}"  # a sidecar that is there would speak too
    [path] = import_log("nmea", tmp_path / "log.nmea", out, tmp_path / "m.toml" if mapping else None)
    return read_trial(path)


@pytest.fixture(scope="module")
def log() -> tuple[list[dict[str, float]], bytes]:
    pytest.importorskip("pynmeagps")
    rows = run()
    return rows, b"".join(map(tagged, rows))


def test_round_trip_within_the_last_digit(log, tmp_path):
    rows, text = log
    trial = imported(tmp_path, text)
    truth = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    assert trial.t == pytest.approx(truth["t"], abs=1e-3)
    for name in ("x", "y", "psi", "r", "u", "v_m", "delta", "n_P"):
        assert np.abs(trial[name] - truth[name]).max() <= DIGIT[name], name
    assert np.abs(trial["U_T"] - math.hypot(5.0, 2.0)).max() <= DIGIT["U_T"]
    assert np.abs(np.mod(trial["gamma_T"] - math.atan2(-2.0, 5.0) + 1.0, 2 * math.pi) - 1.0).max() <= DIGIT["gamma_T"]
    assert np.abs(trial["depth"] - 3.0).max() < 1e-3
    assert np.isfinite(trial.stack(*trial.channels)).all()
    assert trial.meta["datum"] == {"latitude": 59.43, "longitude": 10.45}
    assert trial.meta["ship"] == "kvlcc2_l7"
    assert trial.meta["start"] == "2027-01-15T08:00:00.000000+00:00"


def test_without_a_log_velocities_come_from_the_antenna(log, tmp_path):
    rows, _ = log
    trial = imported(tmp_path, b"".join(tagged(row, ("HDT", "ROT", "RMC")) for row in rows))
    for name in ("u", "v_m"):
        assert np.abs(trial[name] - [row[name] for row in rows]).max() < 1e-3, name
    assert any("course and speed over ground" in step for step in trial.meta["processing"])


def test_rows_are_those_of_the_fastest_and_the_rest_has_gaps(log, tmp_path):
    rows, _ = log
    text = b"".join(tagged(row, ("HDT", "RMC") if k % 10 == 0 else ("HDT",)) for k, row in enumerate(rows))
    trial = imported(tmp_path, text)
    assert len(trial) == ROWS
    assert np.isfinite(trial["x"]).sum() == ROWS // 10
    assert np.isfinite(trial["x"][::10]).all()
    assert "no ROT: r by central differences of psi" in trial.meta["processing"]


def test_clock_in_the_sentences_and_stamps_of_a_logger(log, tmp_path):
    rows, _ = log
    plain = [b"".join(one for kind in ("RMC", "HDT", "ROT") for one in lines(kind, FIT, row)) for row in rows]
    by_clock = imported(tmp_path, b"".join(plain))
    stamped = [b"".join(f"{row['t']:.3f} ".encode() + one + b"\n" for one in block.splitlines())
               for row, block in zip(rows, plain, strict=True)]  # fmt: skip
    by_stamp = imported(tmp_path, b"".join(stamped))
    iso = b"".join(f"2026-11-21T10:00:{row['t']:06.3f}Z,".encode() + block.splitlines()[1] + b"\n"
                   for row, block in zip(rows, plain, strict=True))  # fmt: skip
    by_date = imported(tmp_path, iso)
    for trial in (by_clock, by_stamp, by_date):
        assert trial.t == pytest.approx([row["t"] for row in rows], abs=1e-3)
        assert trial["psi"] == pytest.approx([row["psi"] for row in rows], abs=1e-4)
    assert by_date.meta["start"] == "2026-11-21T10:00:00.000000+00:00"
    assert by_clock.meta["start"] == by_stamp.meta["start"] == "2027-01-15T08:00:00.000000+00:00"  # the date is RMC's


def test_the_date_of_the_clock_is_that_of_the_first_row(log, tmp_path):
    """Over midnight, with an old receiver that begins with a date of its factory."""
    rows, _ = log
    late = Fittings(epoch=1_800_057_595.0)  # five seconds before midnight
    said = [one for row in rows for kind in ("RMC", "HDT") for one in lines(kind, late, row)]
    old = bytes(said[0]).replace(b",150127,", b",060180,").rpartition(b"*")[0]
    said[0] = old + b"*%s\r\n" % checksum(old[1:]).encode()
    trial = imported(tmp_path, b"".join(said))
    assert trial.meta["start"] == "2027-01-15T23:59:55.000000+00:00"
    assert trial.t == pytest.approx([row["t"] for row in rows], abs=1e-3)


@pytest.mark.parametrize("format", ["mcap", "rosbag2"])
def test_a_log_of_sentences_becomes_one_of_robots_and_comes_back(log, tmp_path, format):
    """Positions at half the rate of the heading: no message says where it does not know, and nothing is lost."""
    pytest.importorskip("rosbags")
    rows, _ = log
    text = b"".join(tagged(row, ("HDT", "ROT", "VBW", *(() if k % 2 else ("RMC",)))) for k, row in enumerate(rows))
    trial = imported(tmp_path, text)
    assert np.isnan(trial["x"]).sum() == ROWS // 2
    path = save_robot_log(trial, format, tmp_path)
    with opened(path) as bag:
        said = [unpacked(one.kind, one.data) for one in bag.messages if one.kind != NUMBER]
    assert all(math.isfinite(value) for one in said for value in one.values.values())
    assert min(one.stamp for one in said) == 1_800_000_000 * 10**9
    [written] = import_log(format, path, tmp_path / "back")
    after = read_trial(written)
    assert after.meta["start"] == trial.meta["start"]
    assert after.t == pytest.approx(trial.t, abs=1e-9)
    for name, values in trial.channels.items():
        np.testing.assert_allclose(np.mod(after[name] - values + 1.0, 2 * math.pi) if name == "psi" else after[name],
                                   np.where(np.isfinite(values), 1.0, np.nan) if name == "psi" else values,
                                   rtol=0, atol=1e-9)  # fmt: skip

def test_sentences_between_two_fixes_are_spread_evenly_also_over_midnight(tmp_path):
    pytest.importorskip("pynmeagps")
    late = Fittings(epoch=1_800_057_595.0)  # five seconds before midnight
    rows = run()[:100]
    text = b""
    for k, row in enumerate(rows):
        kinds = ("RMC", "HDT") if k % 10 == 0 else ("HDT",)
        text += b"".join(one for kind in kinds for one in lines(kind, late, row))
    trial = imported(tmp_path, text)
    assert trial.t == pytest.approx(np.arange(100) * DT, abs=1e-6)


def test_bad_lines_are_counted_and_foreign_sentences_named(log, tmp_path):
    _, text = log
    parts = text.splitlines(keepends=True)
    parts[5] = parts[5].replace(b",", b";")
    parts[7:7] = [b"garbage\r\n", b"# a comment\n", b"!AIVDM,1,1,,A,13aG?N0000PCs,0*63\r\n"]
    trial = imported(tmp_path, b"".join(parts))
    steps = "\n".join(trial.meta["processing"])
    assert "lines are no valid sentence, the first: line 6:" in steps
    assert "1 VDM" in steps or "VDM" not in steps


def test_a_line_that_lost_its_stamp_takes_no_time_from_the_others(log, tmp_path):
    _, text = log
    whole = imported(tmp_path, text)
    parts = text.splitlines(keepends=True)
    rate = next(k for k in range(200, len(parts)) if b"ROT," in parts[k])
    parts[rate] = parts[rate].rpartition(b"\\")[2]
    cut = imported(tmp_path, b"".join(parts))
    assert (cut.t == whole.t).all()
    assert (cut["r"] == whole["r"]).all()  # the lines about it tell its time
    assert cut.meta["lines"] == {"all": len(parts), "invalid": 0, "untimed": 0}
    stamp = parts[rate - 1].split(b"\\")[1]
    late = next(k for k in range(rate + 1, len(parts)) if stamp not in parts[k])
    parts[late] = parts[late].rpartition(b"\\")[2]  # here they do not agree
    again = imported(tmp_path, b"".join(parts))
    assert (again.t == whole.t).all()
    assert again.meta["lines"] == {"all": len(parts), "invalid": 0, "untimed": 1}


def test_revolutions_of_the_engine_are_not_those_of_the_shaft(log, tmp_path):
    _, text = log
    engine = b"RCRPM,E,0,9000.0,,A"
    parts = [one + b"$%s*%s\r\n" % (engine, checksum(engine).encode()) if b"RPM,S" in one else one
             for one in text.splitlines(keepends=True)]  # fmt: skip
    trial = imported(tmp_path, b"".join(parts))
    assert (trial["n_P"] == imported(tmp_path, text)["n_P"]).all()
    assert any("engine" in step and "left out" in step for step in trial.meta["processing"])


def test_what_is_left_of_a_damaged_log_is_in_its_place(log, tmp_path):
    _, text = log
    whole = imported(tmp_path, text)
    damaged, random = bytearray(text), np.random.default_rng(7)
    for k in random.integers(0, len(text), len(text) // 250).tolist():
        damaged[k] = int(random.integers(0, 256))
    trial = imported(tmp_path, bytes(damaged))
    assert trial.meta["lines"]["invalid"] > 500
    assert len(trial) <= ROWS
    row = np.searchsorted(whole.t, trial.t - (trial.t[0] - whole.t[0]) - 1e-4)
    for name in ("x", "y", "psi"):
        there = np.isfinite(trial[name])
        assert there.sum() > 0.5 * ROWS, name
        assert np.abs(trial[name] - whole[name][row])[there].max() < 1e-3, name


def test_damage_is_told_on_the_command_line(log, tmp_path, capsys):
    _, text = log
    parts = text.splitlines(keepends=True)
    parts[5] = parts[5].replace(b",", b";")
    (tmp_path / "log.nmea").write_bytes(b"".join(parts))
    assert main(["import", "nmea", str(tmp_path / "log.nmea"), "-o", str(tmp_path / "out")]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines()[-1].startswith("1 trial in ")
    [line] = err.splitlines()
    assert f"warning: log: 1 of {len(parts)} lines are no valid sentence and are left out" in line
    assert main(["import", "nmea", str(tmp_path / "log.nmea"), "-o", str(tmp_path / "out"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["lines"] == {"log": {"all": len(parts), "invalid": 1, "untimed": 0}}
    assert any("the first: line 6" in step for step in told["processing"]["log"])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "0 sentences"),
        (b"t [s],psi [rad]\n0,1\n", "is it a log of NMEA 0183"),
        (b"$HEHDT,10.0,T*%s\r\n" % checksum(b"HEHDT,10.0,T").encode(), "no time"),
        (b"1.0 $SDDPT,5.0,0.0,*%s\r\n" % checksum(b"SDDPT,5.0,0.0,").encode(), "no heading"),
    ],
)
def test_logs_that_cannot_be_used(tmp_path, text, message):
    with pytest.raises(DataError, match=message) as error:
        imported(tmp_path, text, None)
    assert "\n" not in str(error.value)
    assert not [*tmp_path.glob("out*")]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [("antenna", "antena", "no key 'antena'; near: antenna"), ("nmea/1", "nmea/2", "schema"),
     ("forward = 2.5", "fwd = 2.5", "antenna.fwd: no key 'fwd'"), ("59.43", "95.0", r"datum at latitude 95"),
     ("L_pp", "[L_pp", "not readable as TOML")],
)  # fmt: skip
def test_bad_mapping(tmp_path, old, new, message):
    with pytest.raises(DataError, match=message) as error:
        imported(tmp_path, b"x", MAPPING.replace(old, new))
    assert "\n" not in str(error.value)


def test_a_file_of_one_device_beside_those_of_others_says_to_put_them_together(tmp_path):
    sentence = b"$AGRSA,5.0,A,,V"
    line = b"05/14/2026,09:41:0%d.000,%s*%s\r\n"
    for name in ("rudder.raw", "gyro.raw"):
        told = sentence, checksum(sentence[1:]).encode()
        (tmp_path / name).write_bytes(b"".join(line % (k, *told) for k in range(9)))
    with pytest.raises(DataError, match="sort the lines of all by their stamps into one file"):
        nmea.read(tmp_path / "rudder.raw")
    (tmp_path / "gyro.raw").unlink()
    with pytest.raises(DataError, match=r"make rows of$"):
        nmea.read(tmp_path / "rudder.raw")

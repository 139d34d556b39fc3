"""ASCII lines of NovAtel by a writer of our own, against what was put in; a public line for the checksum."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.data.formats import novatel
from seatrial.data.geodesy import Datum
from seatrial.data.recognise import recognise

WEEK, BEGUN = 2416, 464400.25
START = 315964800 + 604800 * WEEK + BEGUN - 18.0
DATUM = Datum(59.0, 10.0)
T = np.round(0.1 * np.arange(200), 3)
PSI = 0.4 + 0.05 * T
U, V = 5.0, -0.5
COURSE = PSI + math.atan2(V, U)
R = 0.05
NORTH = (U * (np.sin(PSI) - np.sin(PSI[0])) + V * (np.cos(PSI) - np.cos(PSI[0]))) / R
EAST = (-U * (np.cos(PSI) - np.cos(PSI[0])) + V * (np.sin(PSI) - np.sin(PSI[0]))) / R
PLACES = [DATUM.place(a, b) for a, b in zip(NORTH.tolist(), EAST.tolist(), strict=True)]
Say = Callable[[int], str]


def line(mark: str, body: str) -> str:
    """By the table of the polynomial 0xEDB88320 without the inversions of zlib."""
    crc = 0
    for byte in body.encode():
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    return f"{mark}{body}*{crc:08x}"


def full(kind: str, k: int, fields: str) -> str:
    return line("#", f"{kind}A,COM1,0,31.0,FINESTEERING,{WEEK},{BEGUN + T[k]:.3f},00000040,5615,15980;{fields}")


def motion(k: int) -> str:
    speed = math.hypot(U, V)
    north, east = speed * math.cos(COURSE[k]), speed * math.sin(COURSE[k])
    return f"{north:.9f},{east:.9f},-0.01,1.5,-0.4,{math.degrees(PSI[k]) % 360.0:.9f}"


def inspva(k: int, status: str = "INS_SOLUTION_GOOD") -> str:
    a, b = PLACES[k]
    return full("INSPVA", k, f"{WEEK},{BEGUN + T[k]:.9f},{a:.11f},{b:.11f},42.1,{motion(k)},{status}")


def short(k: int) -> str:
    a, b = PLACES[k]
    fields = f"{WEEK},{BEGUN + T[k]:.9f},{a:.11f},{b:.11f},42.1,{motion(k)},INS_SOLUTION_GOOD"
    return line("%", f"INSPVASA,{WEEK},{BEGUN + T[k]:.3f};{fields}")


def inspvax(k: int) -> str:
    a, b = PLACES[k]
    rest = "0.02,0.02,0.03,0.001,0.001,0.001,0.05,0.05,1.0,00000000,0"
    return full("INSPVAX", k, f"INS_SOLUTION_FREE,INS_RTKFIXED,{a:.11f},{b:.11f},42.1,39.5,{motion(k)},{rest}")


def bestpos(k: int) -> str:
    a, b = PLACES[k]
    return full("BESTPOS", k, f"SOL_COMPUTED,NARROW_INT,{a:.11f},{b:.11f},42.1,39.5,WGS84,0.01,0.01,0.02,\"\",0,0,9,9")


def bestvel(k: int) -> str:
    """The velocity of a tenth of a second before, which is its latency."""
    course = math.degrees(COURSE[k] - 0.1 * R) % 360.0
    return full("BESTVEL", k, f"SOL_COMPUTED,DOPPLER_VELOCITY,0.100,0.000,{math.hypot(U, V):.6f},{course:.6f},0.0,0.0")


def heading2(k: int) -> str:
    return full("HEADING2", k, f"SOL_COMPUTED,NARROW_INT,1.5,{math.degrees(PSI[k]) % 360.0:.9f},0.1,0.0,0.1,0.1")


def log(tmp_path: Path, *says: Say, more: Sequence[str] = ()) -> Trial:
    path = tmp_path / "log.gps"
    path.write_text("\r\n".join([*(say(k) for k in range(T.size) for say in says), *more]))
    return novatel.read(path)


@pytest.mark.parametrize("says", [(inspva,), (short,), (inspvax,), (inspva, bestpos, bestvel)],
                         ids=["long", "short", "extended", "beside others"])  # fmt: skip
def test_inertial_solutions_are_the_motion(tmp_path: Path, says: Sequence[Say]) -> None:
    got = log(tmp_path, *says)
    assert got.t == pytest.approx(T, abs=1e-6)
    for name, right in (("psi", PSI), ("x", NORTH), ("y", EAST), ("u", U), ("v_m", V)):
        assert got[name] == pytest.approx(right, abs=1e-3 if name in "xy" else 1e-6), name
    assert got["phi"] == pytest.approx(math.radians(1.5))
    assert got["theta"] == pytest.approx(math.radians(-0.4))
    assert datetime.fromisoformat(got.meta["start"]).timestamp() == pytest.approx(START, abs=1e-5)
    assert not [step for step in got.meta["processing"] if step.startswith("doubt")]


@pytest.mark.slow
def test_position_velocity_and_two_antennas_are_put_together(tmp_path: Path) -> None:
    got = log(tmp_path, bestpos, bestvel, heading2)
    assert got["psi"] == pytest.approx(PSI, abs=1e-6)
    there = np.isfinite(got["u"])
    assert there.sum() > 190
    assert got["gamma_G"][there] == pytest.approx(np.unwrap(COURSE[there]), abs=1e-6)
    assert got["x"] == pytest.approx(NORTH, abs=1e-3)


def test_lines_without_a_solution_tell_nothing(tmp_path: Path) -> None:
    got = log(tmp_path, lambda k: inspva(k, "INS_ALIGNING" if k < 50 else "INS_SOLUTION_GOOD"), bestpos)
    assert np.isnan(got["psi"][got.t < 4.95]).all() or got.t.size == 150
    assert got.meta["ignored"] == {"INSPVA without a solution": 50}


@pytest.mark.slow
def test_damaged_lines_are_left_out_where_others_are_sound(tmp_path: Path) -> None:
    wrong = inspva(7).replace(",42.1,", ",42.2,")
    got = log(tmp_path, inspva, more=[wrong, "#BESTSATSA,COM1,0;1*00000000", "rubbish"])
    assert len(got) == T.size
    assert got.meta["lines"] == {"all": 203, "invalid": 2}
    assert got.meta["ignored"] == {"BESTSATS": 1}
    edited = log(tmp_path, lambda k: inspva(k).replace(",42.1,", ",42.2,"))
    assert len(edited) == T.size
    assert any("none of 200 lines has the checksum" in step for step in edited.meta["processing"])


def test_a_public_line_has_the_checksum_that_it_tells() -> None:
    """The example of the manual of a receiver (UM981)."""
    body = ("INSPVAXA,COM1,0,73.5,FINESTEERING,1695,309428.000,00000040,4e77,43562;INS_SOLUTION_GOOD,INS_PSRSP,"
            "51.11637873403,-114.03825114994,1063.6093,-16.9000,-0.0845,-0.0464,-0.0127,0.138023492,0.069459386,"
            "90.000923268,0.9428,0.6688,1.4746,0.0430,0.0518,0.0521,0.944295466,0.944567084,1.000131845,3,0")
    assert novatel.checked(body) == 0xE877C178
    assert line("#", body).endswith("*e877c178")
    assert zlib.crc32(body.encode()) != 0xE877C178


def test_such_a_log_is_recognised_and_others_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    path.write_text("\n".join(map(inspva, range(30))))
    known = recognise(path)
    assert known is not None
    assert known.format == "novatel"
    path.write_text("\n".join(f"line {k}" for k in range(30)))
    with pytest.raises(DataError, match="30 of them not of ASCII lines of NovAtel"):
        novatel.read(path)

"""Messages of NMEA 2000 as JSON: every field comes back as the bytes from which it would have been printed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from n2k_json import DELTA, PSI, T, sailed

from seatrial.data.formats import n2k
from seatrial.data.n2k.groups import said
from seatrial.data.n2k.spoken import _FIELDS, _bytes, degrees_by, plain
from seatrial.data.recognise import recognise


@pytest.mark.parametrize(("head", "degrees", "camel"), [
    ('{"version":"4.12.0","units":"std"}', True, False), ('{"version":"4.12.0","units":"si"}', False, False),
    ("", True, False), ("", False, True),
])  # fmt: skip
def test_a_log_of_json_is_the_ship(tmp_path: Path, head: str, degrees: bool, camel: bool) -> None:
    file = tmp_path / "log.json"
    file.write_text("\n".join([*([head] if head else []), *sailed(degrees, camel)]))
    known = recognise(file)
    assert known is not None
    assert known.format == "n2k"
    trial = n2k.read(file)
    assert trial.t == pytest.approx(T, abs=1e-6)
    assert trial["psi"] == pytest.approx(PSI, abs=2e-4)
    assert trial["delta"] == pytest.approx(DELTA, abs=2e-4)
    assert trial["r"] == pytest.approx(0.01, abs=1e-6)
    assert trial["U_G"] == pytest.approx(5.14)
    assert trial.meta["datum"] == pytest.approx({"latitude": 59.0, "longitude": 10.0})
    assert trial.meta["start"].startswith("2026-04-03T09:30:00")


@pytest.mark.parametrize(("pgn", "fields", "right"), [
    (127250, {"Heading": 98.2, "Variation": 4.1, "Reference": "Magnetic"}, {"psi": 102.3, "variation": 4.1}),
    (127250, {"Heading": 98.2, "Reference": {"value": 1, "name": "Magnetic"}}, {"psi_magnetic": 98.2}),
    (127250, {"Heading": 98.2, "Reference": 0}, {"psi": 98.2}), (127250, {"Heading": 98.2}, {}),
    (127245, {"Instance": 1, "Angle Order": -3.0}, {"delta_1_cmd": -3.0}),
    (127251, {"Rate": -0.5}, {"r": -0.5}),
    (127257, {"Yaw": 1.0, "Pitch": 2.5, "Roll": -4.8}, {"theta": 2.5, "phi": -4.8}),
    (129026, {"COG Reference": "Magnetic", "COG": 1.0, "SOG": 2.0}, {}),
    (127258, {"Variation": -6.0}, {"variation": -6.0}),
    (130306, {"Wind Angle": 32.0, "Reference": "Apparent"}, {}),
])  # fmt: skip
def test_angles_mean_what_the_group_says(pgn: int, fields: dict[str, Any], right: dict[str, float]) -> None:
    found = said(pgn, _bytes(pgn, fields, True))
    assert found == pytest.approx({name: math.radians(value) for name, value in right.items()}, abs=6e-5)


@pytest.mark.parametrize(("pgn", "fields", "right"), [
    (127488, {"Engine Instance": "Dual Engine Starboard", "Engine Speed": 1450}, {"rpm_E_1": 1450.0}),
    (127488, {"instance": 0, "speed": 600.25}, {"rpm_E_0": 600.25}),
    (127493, {"Instance": 0, "Transmission Gear": "Reverse"}, {"gear_0": -1.0}),
    (128259, {"Speed Water Referenced": 5.2}, {"u_log_water": 5.2}),
    (128259, {"Speed Water Referenced": 5.2, "Speed Direction": "Reverse"}, {"u_log_water": -5.2}),
    (128267, {"Depth": 12.34, "Offset": 0.5}, {"depth": 12.84}), (128267, {"Depth": 12.34}, {"depth": 12.34}),
    (129025, {"Latitude": -33.1234567, "Longitude": -70.7654321}, {"latitude": -33.1234567, "longitude": -70.7654321}),
    (129029, {"Date": "1970.01.02", "Time": "00:00:01.25", "Latitude": 47.5, "Longitude": -1.5, "Method": "GNSS fix"},
     {"latitude": 47.5, "longitude": -1.5, "utc": 86401.25}),
    (129029, {"Latitude": 47.5, "Longitude": -1.5, "Method": "no GNSS"}, {}),
    (126992, {"Source": "GPS", "Date": "1970-01-01", "Time": "00:01:00"}, {"utc": 60.0}),
    (126992, {"Source": "Local Crystal clock", "Date": "1970-01-01", "Time": "00:01:00"}, {}),
    (130306, {"Wind Speed": 7.4, "Wind Angle": 0.0, "Reference": "True (ground referenced to North)"},
     {"U_T_ground": 7.4, "gamma_T_ground": 0.0}),
    (130306, {"Wind Speed": 7.4, "Wind Angle": 0.0, "Reference": "Apparent"}, {"U_A": 7.4, "gamma_A": 0.0}),
    (129291, {"Set Reference": "True", "Set": 0.0, "Drift": 0.5}, {"gamma_C": 0.0, "U_C": 0.5}),
])  # fmt: skip
def test_numbers_and_codes_mean_what_the_group_says(pgn: int, fields: dict[str, Any], right: dict[str, float]) -> None:
    assert said(pgn, _bytes(pgn, fields, True)) == pytest.approx(right, abs=1e-9)


def test_fields_that_are_not_told_are_not_there() -> None:
    for pgn in _FIELDS:
        told = said(pgn, _bytes(pgn, {}, True))
        assert told == {}, (pgn, told)


@pytest.mark.parametrize(("line", "degrees"), [
    (b'{"version":"6","units":"std"}', True), (b'{"version":"6","units": "si"}', False),
    (b'{"pgn":127250,"fields":{"Heading":40.1}}', True), (b'{"pgn":127250,"fields":{"heading":6.28}}', False),
    (b'{"pgn":129026,"fields":{"COG":206.1}}', True), (b'{"pgn":129025,"fields":{"Latitude":59.1}}', False),
])  # fmt: skip
def test_the_unit_of_angles_is_said_or_shown(line: bytes, degrees: bool) -> None:
    assert degrees_by(line) is degrees


def test_lines_that_are_no_messages_keep_their_place() -> None:
    """Damaged ones are counted as such by the reader, with their number."""
    odd = b'\n'.join([b'{"version":"6"}', b'{"pgn":127250,"src":1', b"", b"A 1", b'{"pgn":127250,"fields":3,"src":1}',
                      b'{"timestamp":"2026-04-03T09:30:00Z","pgn":60928,"src":1,"fields":{"x":1}}'])  # fmt: skip
    found = plain(odd, True).split(b"\n")
    assert len(found) == 6
    assert found[0].startswith(b"#")
    assert found[1:5] == odd.split(b"\n")[1:5]
    assert b",60928,1,255," in found[5]

"""Tables of AIS as authorities publish them, and what is no such table."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.errors import RequestError
from seatrial.encounters.area import reports

DANISH = """# Timestamp,Type of mobile,MMSI,Latitude,Longitude,SOG,COG
31/01/2026 12:00:00,Class A,219000001,55.5,11.0,10.0,90.0
31/01/2026 12:00:10,Class A,219000002,55.6,11.1,102.3,360.0
31/01/2026 12:00:20,Base,2190000,91.0,181.0,,
"""
AMERICAN = """MMSI,BaseDateTime,LAT,LON,SOG,COG
219000001,2026-01-31T12:00:00,55.5,11.0,10.0,90.0
219000002,2026-01-31T12:00:10,55.6,11.1,102.3,360.0
"""
PLAIN = """t [s],mmsi,lat [deg],lon [deg],sog [kn],cog [deg]
0.0,219000001,55.5,11.0,10.0,90.0
10.0,219000002,55.6,11.1,102.3,360.0
"""


@pytest.mark.parametrize("text", [DANISH, AMERICAN, PLAIN], ids=["danish", "american", "plain"])
def test_tables_are_read_whoever_publishes_them(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    found = reports(tmp_path / "a.csv")
    assert found.ship.tolist() == [219000001, 219000002]  # a place that is none is left out
    assert np.diff(found.t) == pytest.approx([10.0])
    assert found.latitude == pytest.approx([55.5, 55.6])
    assert found.U[0] == pytest.approx(5.1444, abs=1e-3)
    assert found.chi[0] == pytest.approx(0.5 * math.pi)
    assert np.isnan([found.U[1], found.chi[1]]).all()  # what says that it does not know


@pytest.mark.parametrize(("text", "said"), [
    (PLAIN.replace("sog [kn]", "pace"), "no column of the speed"),
    (PLAIN.replace("55.6", "north"), "line 3: latitude is 'north'"),
    (PLAIN.replace("10.0,219000002", "noon,219000002"), "line 3: time is 'noon'"),
    ("", "not a table"),
])  # fmt: skip
def test_what_is_no_table_is_a_line(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(RequestError, match=said) as told:
        reports(tmp_path / "a.csv")
    assert "\n" not in str(told.value)

"""Clocks of logs: each way to write a time gives the same seconds, and what is ambiguous is refused."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from turning_log import table, trials

from seatrial.data import DataError, Trial
from seatrial.data.mapping.clocks.calendar import days, leap_seconds

HEADING = '[channels.psi]\ncolumn = "HDG"\nunit = "deg"\n'
# 0, 0.25 and 1.5 s after 2025-04-11 09:51:10 UTC
STEPS = (0.0, 0.25, 1.5)


def read(folder: Path, time: str, **columns: list[object]) -> Trial:
    path = table(folder / "a.csv", {**columns, "HDG": [1, 2, 3]}, ";")
    [found] = trials(path, f'delimiter = ";"\ntime = {{ {time} }}\n{HEADING}')
    return found


@pytest.mark.parametrize(("cells", "time"), [
    (("2025-04-11T09:51:10Z", "2025-04-11T09:51:10.25Z", "2025-04-11T09:51:11.5Z"), 'format = "iso"'),
    (("20250411T095110Z", "20250411T095110.25Z", "20250411T095111,5Z"), 'format = "iso"'),
    (("2025-04-11 11:51:10+02:00", "2025-04-11 11:51:10.25+0200", "2025-04-11 10:51:11.5+01"), 'format = "iso"'),
    (("2025/04/11 11:51:10", "2025/04/11 11:51:10,25", "2025/04/11 11:51:11.5"),
     'format = "iso", zone = "Europe/Oslo"'),
    (("11.04.2025 09:51:10", "11.04.2025 09:51:10.25", "11.04.2025 09:51:11.5"),
     'format = "%d.%m.%Y %H:%M:%S", zone = "UTC"'),
    (("04/11/25 11:51:10 AM", "04/11/25 11:51:10.250 AM", "04/11/25 11:51:11.5 AM"),
     'format = "%m/%d/%y %I:%M:%S.%f %p", zone = "+02:00"'),
    (("Apr 11 2025 09:51:10 +0000", "Apr 11 2025 09:51:10.25 +0000", "Apr 11 2025 09:51:11.5 +0000"),
     'format = "%b %d %Y %H:%M:%S %z"'),
    (("101 2025 09:51:10", "101 2025 09:51:10.25", "101 2025 09:51:11.5"), 'format = "%j %Y %H:%M:%S", zone = "UTC"'),
    (("1744365070", "1744365070.25", "1744365071.5"), 'format = "epoch"'),
    (("1744365070000", "1744365070250", "1744365071500"), 'format = "epoch", unit = "ms"'),
    (("1744365070000000000", "1744365070250000000", "1744365071500000000"), 'format = "epoch", unit = "ns"'),
    (("2025-04-11T09:51:07.5Z", "2025-04-11T09:51:07.75Z", "2025-04-11T09:51:09Z"), 'format = "iso", offset = 2.5'),
])  # fmt: skip
def test_absolute_times(tmp_path: Path, cells: tuple[str, ...], time: str) -> None:
    found = read(tmp_path, f'column = "T", {time}', T=list(cells))
    assert found.t.tolist() == list(STEPS)
    assert found.meta["start"] == "2025-04-11T09:51:10.000000+00:00"


def test_gps_weeks_dates_in_a_column_of_their_own_and_nanoseconds(tmp_path: Path) -> None:
    """18 leap seconds lie between GPS time and UTC since 2017; receivers of ten bits begin weeks anew at 1024."""
    tow = [467488, 467488.25, 467489.5]
    for week, told in ((2361, ""), (313, ", rollover = 2")):
        found = read(tmp_path, f'week = "W", column = "TOW", format = "gps"{told}', W=[week] * 3, TOW=tow)
        assert found.t.tolist() == list(STEPS)
        assert found.meta["start"] == "2025-04-11T09:51:10.000000+00:00"
    found = read(tmp_path, 'date = "D", column = "T", format = "%d.%m.%Y %H:%M:%S", zone = "UTC"', D=["11.04.2025"] * 3,
                 T=["09:51:10", "09:51:10.25", "09:51:11.5"])  # fmt: skip
    assert found.t.tolist() == list(STEPS)
    found = read(tmp_path, 'column = "S", nanoseconds = "N", format = "epoch"', S=[1744365070, 1744365070, 1744365071],
                 N=[0, 250000000, 500000000])  # fmt: skip
    assert found.t.tolist() == list(STEPS)


def test_every_digit_of_a_stamp_counts(tmp_path: Path) -> None:
    """Nanoseconds are kept; a logger that writes them without leading zeros is told by `fraction`."""
    cells = ["2025/04/11 11:51:10.630357142", "2025/04/11 11:51:10.718859396", "2025/04/11 11:51:11.67570729"]
    found = read(tmp_path, 'column = "T", format = "iso", zone = "UTC", fraction = "ns"', T=cells)
    assert np.diff(found.t).tolist() == pytest.approx([0.088502254, 0.348711333], abs=1e-15)
    assert found.meta["start"].endswith("10.630357+00:00")
    assert found.t[0] == pytest.approx(142e-9, abs=1e-15)


def test_hours_of_the_day_go_on_across_midnight(tmp_path: Path) -> None:
    found = read(tmp_path, 'column = "T", format = "clock"', T=["23:59:58", "23:59:59.5", "00:00:01"])
    assert found.t.tolist() == [0.0, 1.5, 3.0]
    assert "start" not in found.meta
    assert found.meta["processing"][-1] == "t = 0 s is 23:59:58"


def test_a_zone_that_nobody_knows_gives_times_without_a_start(tmp_path: Path) -> None:
    cells = ["2025-04-11 11:51:10", "2025-04-11 11:51:10.25", "2025-04-11 11:51:11.5"]
    found = read(tmp_path, 'column = "T", format = "iso", zone = "unknown"', T=cells)
    assert found.t.tolist() == list(STEPS)
    assert "start" not in found.meta


@pytest.mark.parametrize(("cells", "time", "message"), [
    (["2025-04-11 11:51:10"] * 3, 'format = "iso"', r"line 2: no time zone; give zone"),
    (["2025-10-26 01:59:59", "2025-10-26 02:30:00", "2025-10-26 03:30:00"], 'format = "iso", zone = "Europe/Oslo"',
     r"line 3: 2025-10-26 02:30:00 is twice, when its clocks are put back in Europe/Oslo"),
    (["2025-03-30 01:59:59", "2025-03-30 02:30:00", "2025-03-30 03:30:00"], 'format = "iso", zone = "Europe/Oslo"',
     r"line 3: .* is never in Europe/Oslo"),
    (["2025-04-11 11:51:10 CEST"] * 3, 'format = "iso"', r"line 2: the zone 'CEST' is not one time everywhere"),
    (["2025-04-11T09:51:10Z", "2025-04-11 09:51:11", "2025-04-11T09:51:12Z"], 'format = "iso"', "line 3: no time zone"),
    (["2025-04-11T09:51:10Z", "2025-04-11 09:51:11", "2025-04-11T09:51:12Z"], 'format = "iso", zone = "unknown"',
     "line 3: no time zone, and other rows have one"),
    (["2025-04-11T09:51:10Z", "2025-04-11T09:51:12Z", "2025-04-11T09:51:11Z"], 'format = "iso"',
     r"line 4: time goes back \(2 then 1\)"),
    (["2025-04-11T09:51:10Z", "11.4.2025", "2025-04-11T09:51:11Z"], 'format = "iso"',
     "line 3: '11.4.2025' is no time such as 2025-04-11T11:51:10.63"),
    (["2025-04-31T09:51:10Z"] * 3, 'format = "iso"', "line 2: .* a time that no calendar has"),
    (["1744365070", "soon", "1744365072"], 'format = "epoch"', "line 3: 'soon' is not a number"),
    (["1744365070000"] * 3, 'format = "epoch"', "line 2: 1744365070000 s are centuries; is it in another unit"),
    (["10:00:00", "10:00:01", ""], 'format = "clock"', "line 4: no time; every row needs its time"),
    (["10:00:00", "10:00:00", "10:00:01"], 'format = "clock"', 'line 3: time repeats .*duplicates = "first"'),
    (["0", "1", "1:02"], 'unit = "s"', "line 4: '1:02' is not a number; a time has a format"),
])  # fmt: skip
def test_times_that_cannot_be_told_are_refused(tmp_path: Path, cells: list[object], time: str, message: str) -> None:
    with pytest.raises(DataError, match=rf"a\.csv: column 'T', {message}") as error:
        read(tmp_path, f'column = "T", {time}', T=cells)
    assert "\n" not in str(error.value)


def test_a_table_without_a_clock_has_a_step(tmp_path: Path) -> None:
    assert read(tmp_path, "step = 0.5, offset = 2.0").t.tolist() == [2.0, 2.5, 3.0]


def test_gps_times_that_cannot_be(tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"column 'W', line 2: week 313 is before 1999; .* rollover = 2"):
        read(tmp_path, 'week = "W", column = "TOW", format = "gps"', W=[313] * 3, TOW=[0, 1, 2])
    with pytest.raises(DataError, match="column 'TOW', line 4: a week has 604800 s"):
        read(tmp_path, 'week = "W", column = "TOW", format = "gps"', W=[2361] * 3, TOW=[0, 1, 604800])


@pytest.mark.parametrize(("time", "message"), [
    ('column = "T", format = "isso"', "time.format: no format 'isso'; near: iso"),
    ('column = "T", format = "%H:%Q"', "time.format: '%Q' is not read"),
    ('column = "T", format = "%Y-%m-%d"', "it needs hours and minutes"),
    ('column = "T"', "time.unit is missing"),
    ('unit = "s"', "time.column is missing; a table without a clock has a step"),
    ('column = "T", step = 1.0', "time.step is for a table without a clock"),
    ("step = 0", "time.step is 0"),
    ('column = "T", unit = "s", zone = "UTC"', "time.zone is of no use with numbers"),
    ('column = "T", format = "gps"', "time.week is missing"),
    ('column = "T", format = "epoch", unit = "min"', "Unix time is in s, ms, us, ns"),
    ('column = "T", format = "iso", zone = "Europe/Olso"', "time.zone: no zone 'Europe/Olso'; near: Europe/Oslo"),
    ('column = "T", format = "iso", fraction = "us"', "time.fraction is 'us'"),
])  # fmt: skip
def test_a_clock_that_means_nothing_is_refused_at_its_key(tmp_path: Path, time: str, message: str) -> None:
    with pytest.raises(DataError, match=f"mapping.toml: .*{message}"):
        read(tmp_path, time, T=[0, 1, 2])


def test_the_calendar_is_that_of_the_standard_library() -> None:
    some = np.random.default_rng(3).integers(-(2**33), 2**33, size=500)
    dates = [datetime.fromtimestamp(int(one), UTC) for one in some]
    year, month, day = (np.array([getattr(one, part) for one in dates]) for part in ("year", "month", "day"))
    assert days(year, month, day).tolist() == (some // 86400).tolist()
    gps = np.array([datetime(2016, 12, 31, 23, 59, 59, tzinfo=UTC).timestamp() + 17, 1483228818, 0], dtype=np.int64)
    assert leap_seconds(gps * 10**9).tolist() == [17, 18, 0]

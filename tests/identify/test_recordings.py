"""Which trials are parts of one recording: by what cut them, by their time stamp, by a clock that goes on."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.prepare import unbroken
from seatrial.identify.recordings import dealt, recording, recordings


def trial(name: str, begin: float = 0.0, end: float = 10.0) -> Trial:
    t = np.arange(begin, end, 0.5)
    return Trial(name, t, {"u": np.ones_like(t)})


def grouped(*trials: Trial) -> list[list[str]]:
    return [[t.name for t in group] for group in recordings(trials)]


def test_parts_that_were_cut_here() -> None:
    t = np.concatenate([np.arange(0.0, 10.0, 0.5), np.arange(500.0, 510.0, 0.5)])
    parts = unbroken(Trial("zigzag", t, {"u": np.ones_like(t)}), 5.0)
    assert [p.name for p in parts] == ["zigzag_1", "zigzag_2"]
    assert {recording(p) for p in parts} == {"zigzag"}
    assert grouped(trial("turn"), *parts) == [["turn"], ["zigzag_1", "zigzag_2"]]


@pytest.mark.parametrize(("name", "stamp"), [
    ("random_06-Aug-2020_16_24_25_4", "06-Aug-2020_16_24_25"),
    ("turn_cut_14-Sep-2020_15_58_08", "14-Sep-2020_15_58_08"),
    ("run 2020-08-06T16:24:25 b", "2020-08-06T16:24:25"), ("20200806_162425_12", "20200806_162425"),
    ("turn_1", "turn_1"), ("berthing_12-Nov-2020", "berthing_12-Nov-2020"),
])  # fmt: skip
def test_parts_of_a_data_set_share_a_stamp(name: str, stamp: str) -> None:
    assert recording(trial(name)) == stamp


def test_one_second_apart_are_two() -> None:
    assert len(grouped(trial("zigzag_31-Jul-2020_13_04_24"), trial("zigzag_31-Jul-2020_13_04_25"))) == 2


def test_a_clock_that_goes_on() -> None:
    ten = [trial(f"log_{k}", 10.0 * k, 10.0 * k + 9.0) for k in range(1, 12)]
    assert grouped(*reversed(ten)) == [[f"log_{k}" for k in range(1, 12)]]
    assert grouped(trial("log"), trial("log_2", 12.0, 20.0)) == [["log", "log_2"]]
    assert grouped(trial("log"), trial("log_3", 12.0, 20.0)) == [["log"], ["log_3"]]
    assert len(grouped(trial("log_1"), trial("log_2"))) == 2  # each begins anew
    assert len(grouped(trial("log_1"), trial("log_2", 1000.0, 1010.0))) == 2


def test_whole_recordings_are_dealt_by_turns() -> None:
    names = ["a", "b_01-Jan-2020_00_00_00_1", "b_01-Jan-2020_00_00_00_2", "c"]
    parts = dealt([trial(name) for name in reversed(names)], 2)
    assert [[t.name for t in part] for part in parts] == [["a", "c"], names[1:3]]

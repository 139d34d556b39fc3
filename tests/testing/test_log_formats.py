"""Formats of logs that give an example keep the contract of `seatrial.data.formats`; wrong ones are named."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.data import DataError, Trial, unwrapped
from seatrial.data.formats import frt_esso, nmea
from seatrial.data.table import check_time, lines_of, numbers
from seatrial.testing import FORMAT_CHECKS, ContractError, Log, check_format, log_examples


def sentence(body: str) -> str:
    return f"${body}*{functools.reduce(lambda a, b: a ^ b, body.encode()):02X}\r\n"


NMEA = "".join(
    sentence(f"GPRMC,1200{k:02d},A,3500.{k:04d},N,13930.0000,E,10.0,010.0,241126,,")
    + sentence(f"HEHDT,{350 + k % 10}.0,T") + sentence(f"TIROT,{6.0 + k},A") for k in range(30)
)  # fmt: skip
COMPASS = "".join(f"{0.5 * k:.1f} {(350 + k) % 360}.0\n" for k in range(20))
ROWS = "".join(f"{0.1 * k:.1f}," + ",".join(f"{0.01 * (k + i):.2f}" for i in range(12)) + "\n" for k in range(20))
FRT = f"{','.join(frt_esso.COLUMNS)}\n{ROWS}"
LOGS = log_examples() | {"nmea": Log(nmea, NMEA), "frt-esso": Log(frt_esso, FRT)}


@pytest.mark.parametrize("check", list(FORMAT_CHECKS))
@pytest.mark.parametrize("name", list(LOGS))
def test_format(name: str, check: str) -> None:
    FORMAT_CHECKS[check](LOGS[name])


def right(source: Path, mapping: None = None, heading: Callable[[Any], Any] = np.radians) -> Trial:
    """The reader of docs/extending.md; `heading` is what it makes of degrees."""
    table, lines = numbers(source, lines_of(source), 0, ("time", "heading"), None)
    t, psi = table.T
    check_time(source, "time", t, lines)
    return Trial(source.stem, t.copy(), {"psi": unwrapped(heading(psi))})


def hasty(source: Path, mapping: None = None) -> Trial:
    """One that trusts every row to be two numbers."""
    rows = [[float(x) for x in line.split()] for line in source.read_text(encoding="utf-8").splitlines()]
    t, heading = np.array(rows).T
    return Trial(source.stem, t, {"psi": unwrapped(np.radians(heading))})


def anonymous(source: Path, mapping: None = None) -> Trial:
    """One whose errors do not say which file is wrong."""
    try:
        return hasty(source)
    except ValueError as error:
        raise DataError("not a compass log") from error


def log(read: Callable[..., Trial], example: str = COMPASS) -> Log:
    return Log(SimpleNamespace(name="compass", suffixes=(".cmp",), read=read), example)


def test_a_format_that_keeps_the_contract_passes() -> None:
    check_format(log(right))


@pytest.mark.parametrize(("wrong", "named"), [
    (log(functools.partial(right, heading=lambda degrees: degrees)), "degrees must be converted"),
    (log(lambda file, mapping: Trial(file.stem, np.arange(9.0), {"u": np.full(9, 70.0)})), "knots"),
    (log(lambda file, mapping: Trial(file.stem, np.arange(9.0), {"delta": np.full(9, 20.0)})), "degrees"),
    (log(lambda file, mapping: Trial(file.stem, np.arange(9.0), {"n_P": np.full(9, 120.0)})), "rpm"),
    (log(lambda file, mapping: Trial("log", np.arange(9.0), {"psi": np.zeros(9)})), "called 'log'"),
    (log(lambda file, mapping: Trial(file.stem, np.zeros(9), {"psi": np.zeros(9)})), "strictly increase"),
    (log(lambda file, mapping: Trial(file.stem, np.arange(9.0), {"heading": np.zeros(9)})), "no standard channel"),
    (log(hasty), "ValueError|UnicodeDecodeError"),
    (log(anonymous), "does not name it|UnicodeDecodeError"),
    (Log(SimpleNamespace(name="compass", read=right), COMPASS), "suffixes"),
])  # fmt: skip
def test_a_format_that_breaks_it_is_named(wrong: Log, named: str) -> None:
    with pytest.raises(ContractError, match=named):
        check_format(wrong)

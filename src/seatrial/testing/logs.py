"""Checks of a format of logs against the contract of `seatrial.data.formats`, by a short log that is right."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from ..data import UNITS, DataError, Trial
from ..data import formats as room
from .discovery import ContractError, require

POSSIBLE: Mapping[str, tuple[float, str]] = {
    "u": (60.0, "m/s; knots and km/h must be converted"), "v_m": (60.0, "m/s; knots and km/h must be converted"),
    "r": (4.0, "rad/s; degrees a second or a minute must be converted"),
    "delta": (math.pi / 2, "rad; degrees must be converted"), "n_P": (100.0, "1/s; rpm must be converted"),
    "U_T": (120.0, "m/s; knots must be converted"), "U_A": (120.0, "m/s; knots must be converted"),
}  # fmt: skip
"""Greatest magnitude of a channel that a log of a craft can have, and what is probably wrong above it."""
_TURN = 4.0
"""Greatest rate of a heading [rad/s]; degrees read as radians turn faster."""


class Log(NamedTuple):
    """A module of a format of text files, and a log of it that is right."""

    module: Any
    example: str

    @property
    def name(self) -> str:
        """Name of the file: that which marks a folder, or one with the first suffix."""
        first = self.module.suffixes[0]
        return f"example{first}" if first.startswith(".") else first

    def read(self, folder: Path, content: bytes) -> Trial:
        """What the format makes of a file with this content."""
        file = folder / self.name
        file.write_bytes(content)
        return self.module.read(file, None)


def log_examples() -> dict[str, Log]:
    """The formats that give an `EXAMPLE`, by name."""
    modules = [import_module(f"{room.__name__}.{info.name}") for info in iter_modules(room.__path__)]
    return {one.name: Log(one, one.EXAMPLE) for one in modules if hasattr(one, "EXAMPLE")}


def _trial(log: Log) -> Trial:
    with TemporaryDirectory() as folder:
        return log.read(Path(folder), log.example.encode())


def complete(log: Log) -> None:
    """It has a name, and suffixes in lower case."""
    require(getattr(log.module, "name", ""), "`name` is missing, by which seatrial import chooses the format")
    suffixes = getattr(log.module, "suffixes", ())
    require(suffixes and isinstance(suffixes, tuple), "`suffixes` is missing, a tuple such as (\".log\",)")
    require(all(one == one.lower() or one[0] != "." for one in suffixes), f"suffixes {suffixes} are not in lower case")


def reads(log: Log) -> None:
    """Its example becomes a trial: named by the file, its time strictly increasing, with standard channels."""
    trial = _trial(log)
    require(trial.name == "example" or "." not in log.name, f"the trial is called {trial.name!r}, its file example")
    require(len(trial) > 1 and bool((np.diff(trial.t) > 0).all()), "time does not strictly increase")
    require(bool(set(trial.channels) & set(UNITS)), f"no standard channel among {', '.join(trial.channels)}")
    bare = [name for name in trial.channels if name not in UNITS and name not in trial.units]
    require(not bare, f"channels of its own without a unit: {', '.join(bare)}")


def possible(log: Log) -> None:
    """Values are those of a craft, in SI and radians."""
    trial = _trial(log)
    for name, (most, unit) in POSSIBLE.items():
        if name in trial:
            largest = float(np.nanmax(np.abs(trial[name]), initial=0.0))
            require(largest <= most, f"{name} reaches {largest:.4g}, more than {most:.3g} {unit}")
    if "psi" in trial:
        psi, t = trial["psi"], trial.t
        first = float(psi[np.isfinite(psi)][0]) if np.isfinite(psi).any() else 0.0
        require(abs(first) <= 2 * math.pi, f"psi begins at {first:.4g} rad: degrees must be converted")
        rate = float(np.nanmax(np.abs(np.diff(psi) / np.diff(t)), initial=0.0))
        require(rate <= _TURN, f"psi turns {rate:.4g} rad/s: convert degrees, and unwrap at north (data.unwrapped)")


def damages(example: str) -> Iterator[tuple[str, bytes]]:
    """Ways in which a log is damaged, with what is left of it."""
    whole, lines = example.encode(), example.splitlines(keepends=True)
    yield "empty", b""
    yield "of another program", b"<html>404</html>\n"
    yield "binary", b"\x00\x01\x02\xff" * 64
    yield "with a byte that is no text", whole[: len(whole) // 2] + b"\xff\xfe" + whole[len(whole) // 2 :]
    yield "cut off within its last line", whole.rstrip()[:-3]
    for k in sorted({len(lines) // 3, len(lines) // 2, len(lines) - 1}):
        yield f"with letters in line {k + 1}", "".join([*lines[:k], "x", lines[k][1:], *lines[k + 1 :]]).encode()
        yield f"with a field too many in line {k + 1}", "".join(
            [*lines[:k], lines[k].rstrip("\r\n"), ",1;2\t3 4\n", *lines[k + 1 :]]).encode()  # fmt: skip
        yield f"with line {k + 1} twice", "".join([*lines[: k + 1], *lines[k:]]).encode()
        yield f"with nan in line {k + 1}", "".join([*lines[:k], "nan", lines[k], *lines[k + 1 :]]).encode()


def refuses(log: Log) -> None:
    """A damaged log is read, or refused by a DataError: one line that names the file."""
    with TemporaryDirectory() as folder:
        for what, content in damages(log.example):
            try:
                trial = log.read(Path(folder), content)
            except DataError as error:
                require("\n" not in str(error), f"a file {what}: the error has several lines")
                require(log.name in str(error), f"a file {what}: the error does not name it: {error}")
                continue
            except Exception as error:
                kind = type(error).__name__
                raise ContractError(f"a file {what} raises {kind} ({error}) in place of a DataError") from error
            require(bool((np.diff(trial.t) > 0).all()), f"a file {what} becomes a trial whose time does not increase")


FORMAT_CHECKS: Mapping[str, Callable[[Log], None]] = {
    check.__name__: check for check in (complete, reads, possible, refuses)
}
"""The checks of a log format by name."""

"""A sea from a file or from three numbers, and operators from whatever file has them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Literal

from ...core.errors import WeatherError
from ...core.values import dataclass
from ...data import DataError
from ...data.documents import read_keys
from ...data.table import existing
from . import Sea
from .hydrodynamics import Hydrodynamics
from .rao import Rao
from .spectra import Ittc, Jonswap, PiersonMoskowitz, SeaSpectrum

_SCHEMA = "seatrial-sea/1"
_FORM = "M,S,DEG such as 3,9,60 (height, peak period, where from) or a file such as sea.toml"


@dataclass(frozen=True)
class SeaFile:
    """Keys of a sea file; angles in degrees, as in the options."""

    spectrum: Literal["jonswap", "ittc", "pierson-moskowitz"]
    direction: float
    H_S: float | None = None
    T_P: float | None = None
    gamma: float | None = None
    wind: float | None = None
    spread: float | None = None
    seed: int | None = None


def read_sea(text: str, seed: int = 0) -> Sea:
    """The sea of a file, or JONSWAP's of ``M,S,DEG``.

    Raises:
        DataError, WeatherError: neither of them, a key that is missing or has no meaning, a sea that cannot be.
    """
    try:
        given = [float(part) for part in text.split(",")]
    except ValueError:
        return _from_file(Path(text), seed)
    if len(given) != 3 or not all(map(math.isfinite, given)):
        raise WeatherError(f"--sea is '{text}'; write {_FORM}")
    H_S, T_P, direction = given
    if abs(direction) > 360.0:
        raise WeatherError(f"--sea is '{text}'; a direction is from 0 to 360 deg: write {_FORM}")
    return Sea(Jonswap(H_S, T_P), math.radians(direction), seed=seed)


def read_hydrodynamics(path: str | Path) -> Hydrodynamics:
    """Added mass, damping, stiffness and wave forces from a Capytaine data set (.nc), or without forces a table (.csv).

    Raises:
        DataError, WeatherError: no such file, another ending, what the readers refuse.
    """
    from .capytaine import read_data
    from .coefficients import read_coefficients

    here = existing(path)
    kind = here.suffix.lower()
    if kind not in (".nc", ".csv"):
        raise DataError(f"{here}: coefficients are read from .nc (Capytaine) or .csv (a table)")
    return read_data(here) if kind == ".nc" else read_coefficients(here)


def read_rao(path: str | Path, roll_damping: float | None = None, speed: float = 0.0) -> Rao:
    """Operators from a Capytaine data set (.nc), with further damping of roll, or from a table (.csv).

    Those of a data set at zero speed are solved at the frequencies of encounter of `speed` [m/s]; a table is as it is.

    Raises:
        DataError, WeatherError: no such file, another ending, what the readers refuse, or damping of a table, whose
            operators have theirs already.
    """
    from .capytaine import read_capytaine
    from .tables import read_table

    here = existing(path)
    kind = here.suffix.lower()
    if kind not in (".nc", ".csv"):
        raise DataError(f"{here}: operators are read from .nc (Capytaine) or .csv (a table)")
    if roll_damping is not None and kind == ".csv":
        raise DataError(f"{here}: the operators of a table include their damping; leave --roll-damping out")
    if roll_damping is not None and not 0.0 <= roll_damping < 1.0:
        raise DataError(f"--roll-damping is {roll_damping:g}; it is a share of the critical damping, such as 0.05")
    return read_table(here) if kind == ".csv" else read_capytaine(here, roll_damping or 0.0, speed)


def _from_file(path: Path, seed: int) -> Sea:
    if path.suffix.lower() != ".toml":
        raise WeatherError(f"--sea is '{path}'; write {_FORM}")
    said = read_keys(path, SeaFile, _SCHEMA)
    if abs(said.direction) > 360.0:
        raise DataError(f"{path}: direction is {said.direction:g}; it is from 0 to 360 deg")
    try:
        spread = math.inf if said.spread is None else said.spread
        own = seed if said.seed is None else said.seed
        return Sea(_spectrum(path, said), math.radians(said.direction), spread, own)
    except WeatherError as error:
        raise DataError(f"{path}: {error}") from None


def _spectrum(path: Path, said: SeaFile) -> SeaSpectrum:
    wanted = ("wind",) if said.spectrum == "pierson-moskowitz" else ("H_S", "T_P")
    taken = (*wanted, "gamma") if said.spectrum == "jonswap" else wanted
    for key in ("H_S", "T_P", "gamma", "wind"):
        there = getattr(said, key) is not None
        if there and key not in taken:
            raise DataError(f"{path}: {key} has no meaning for {said.spectrum}; it takes {', '.join(taken)}")
        if not there and key in wanted:
            raise DataError(f"{path}: no {key}; {said.spectrum} needs {', '.join(wanted)}")
    if said.wind is not None:
        return PiersonMoskowitz(said.wind)
    H_S, T_P = said.H_S or 0.0, said.T_P or 0.0
    return Jonswap(H_S, T_P, said.gamma) if said.spectrum == "jonswap" else Ittc(H_S, T_P)

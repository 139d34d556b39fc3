"""Trials: the one time-series type, measured or simulated, and the rooms that read, check and prepare them.

Contract: a `Trial` is frozen, in SI and radians, with the channel names of docs/conventions.md and the standard units
`UNITS`.  NaN marks a gap and is kept; no function fills it silently.  `trialfile` reads and writes trial files,
`formats` reads foreign logs, `importing` turns those into trial files, `prepare` makes trials from trials, `check`
finds the faults of one.  Unusable data raise `DataError`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..core.errors import DataError, MissingError
from ..core.once import by_identity
from ..core.parameters import unknown
from ..core.ranks import median
from ..core.values import dataclass, field, replace

__all__ = ["UNITS", "Array", "DataError", "Dataset", "Trial", "unwrapped"]

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Trial:
    """One recording, or one simulated run.

    Attributes:
        name: short name, the stem of its file.
        t: time [s], shape (samples,), strictly increasing.
        channels: other channels by name, each of shape (samples,), SI units; NaN marks a gap.
        units: unit of each channel that is not a standard one.
        meta: contents of the sidecar (ship, scale, kind, set points, source, licence, processing).
        file: the trial file it was read from; None without one, or after a change of its time.
    """

    name: str
    t: Array
    channels: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=dict[str, str])
    meta: Mapping[str, Any] = field(default_factory=dict[str, Any])
    file: Path | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        for name, values in self.channels.items():
            if values.shape != self.t.shape:
                raise DataError(f"{self.name}: channel {name} has {values.size} samples, time has {self.t.size}")

    def __repr__(self) -> str:
        every = f"every {self.dt:.4g} s" if len(self) > 1 else "no steps"
        return f"{type(self).__name__}({self.name!r}, {len(self)} rows, {every}: {', '.join(self.channels)})"

    def __getitem__(self, name: str) -> Array:
        if name == "t":
            return self.t
        if name not in self.channels:
            raise MissingError(f"{self.name}: {unknown(name, self.channels, 'channel')}")
        return self.channels[name]

    def __contains__(self, name: object) -> bool:
        return name == "t" or name in self.channels

    def __len__(self) -> int:
        return int(self.t.size)

    @cached_property
    def dt(self) -> float:
        """Median time step [s]."""
        return median(np.diff(self.t)) if len(self) > 1 else float("nan")

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]."""
        return float(self.t[-1] - self.t[0]) if len(self) else 0.0

    @property
    def heading(self) -> Array:
        """Its heading `psi`, continuous across +-pi (`unwrapped`) [rad]; all who ask share it, so it is read-only."""
        return _continuous(self["psi"])

    def unit(self, name: str) -> str:
        """Unit of a channel."""
        return self.units.get(name) or UNITS.get(name, "-")

    def stack(self, *names: str) -> Array:
        """Channels side by side, shape (samples, len(names))."""
        return np.column_stack([self[name] for name in names])

    def rows(self, index: slice | Array | NDArray[np.bool_] | NDArray[np.intp]) -> Self:
        """The same trial with only some of its samples."""
        kept = {name: values[index] for name, values in self.channels.items()}  # type: ignore[index]
        return replace(self, t=self.t[index], channels=kept)  # type: ignore[index]

    def having(self, **channels: Array) -> Self:
        """The same trial with channels added or replaced."""
        return replace(self, channels={**self.channels, **channels})

    def noting(self, *steps: str) -> Self:
        """The same trial with more processing steps noted."""
        if not steps:
            return self
        return replace(self, meta={**self.meta, "processing": [*self.meta.get("processing", []), *steps]})


@dataclass(frozen=True)
class Dataset:
    """Whole trials set aside for training, validation and test; each is in one of them only."""

    train: tuple[Trial, ...] = ()
    validation: tuple[Trial, ...] = ()
    test: tuple[Trial, ...] = ()

    def __post_init__(self) -> None:
        seen: dict[str, str] = {}
        for part in ("train", "validation", "test"):
            for trial in getattr(self, part):
                if trial.name in seen:
                    raise DataError(f"trial {trial.name} is in {seen[trial.name]} and in {part}; keep it in one")
                seen[trial.name] = part

    def __iter__(self) -> Iterator[Trial]:
        return iter((*self.train, *self.validation, *self.test))


def unwrapped(psi: Array) -> Array:
    """Heading made continuous across +-pi [rad]; gaps stay gaps.

    >>> unwrapped(np.array([3.1, -3.1, np.nan, -3.0])).round(2).tolist()
    [3.1, 3.18, nan, 3.28]
    """
    out = psi.copy()
    good = np.isfinite(psi)
    known = psi if good.all() else psi[good]
    if not (np.abs(np.diff(known)) < math.pi).all():  # seldom, and ten times as dear
        out[good] = np.unwrap(known)
    return out


@by_identity
def _continuous(psi: Array) -> Array:
    out = unwrapped(psi)
    out.flags.writeable = False
    return out


UNITS: Mapping[str, str] = MappingProxyType({
    "t": "s", "x": "m", "y": "m", "psi": "rad", "u": "m/s", "v_m": "m/s", "r": "rad/s",
    "n_P": "1/s", "n_P_cmd": "1/s", "delta": "rad", "delta_cmd": "rad",
    "U_T": "m/s", "gamma_T": "rad", "U_A": "m/s", "gamma_A": "rad",
    "u_w": "m/s", "U_C": "m/s", "gamma_C": "rad", "U_G": "m/s", "gamma_G": "rad",
    "phi": "rad", "p": "rad/s", "theta": "rad", "depth": "m",
    "H_S": "m", "T_W": "s", "gamma_W": "rad",
})  # fmt: skip
"""By channel its unit; angles are in radians."""

"""Campaigns: many runs of manoeuvres, each a function of the campaign and of its own number.

Contract: a `Campaign` is a frozen value: cases (a ship in a manoeuvre), inputs that differ from run to run, a design of
points and a seed.  Run number k has the same numbers whichever process, thread or machine computes it, and whatever was
computed before.  `chunk` computes a part of them as a table, one row a run; `folder` keeps the parts of a campaign in a
folder as Parquet files and tells what is missing; `running` computes that, in threads or through any executor.
`tallies` are manoeuvres that read their indices inside the compiled loop; `tracks` are samples of each run, kept beside
its row; `inputs` and `designs` have distributions and points.  A campaign that cannot be carried out raises
`CampaignError`.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Annotated

import numpy as np

from ..core.errors import CampaignError as CampaignError
from ..core.records import Limits
from ..core.values import dataclass, field
from ..core.version import __version__
from ..data import Array
from ..environment import Uniform
from ..manoeuvres import Manoeuvre
from ..models import STATES
from ..ships import Ship
from ..ships.writing import to_toml
from .designs import Design, check_runs
from .inputs import Input
from .tallies import tally_of
from .tracks import Tracks as Tracks

__all__ = ["Campaign", "CampaignError", "Case", "Correlated", "Criterion", "Tracks", "usual_chunk"]

CHUNK = 16384
"""Usual number of runs in a part: some tenths of a second of work, a file of one or two megabytes."""

STORED = 2048
"""The same where each run is stored and read as a whole: a second of work, so that Ctrl-C is answered in that time."""


@dataclass(frozen=True)
class Case:
    """A ship in a manoeuvre.

    Attributes:
        name: as it stands in the table.
        speed: initial speed straight ahead through the water [m/s].
        duration: length of each run [s].
        dt: time step [s].
        method: "rk4" or "euler".
        whole: whether the runs are stored and read as a whole, for the indices that no tally has.
        device: "cpu", or "cuda" for a GPU, whose last digits are others.
        precision: "double"; a GPU also takes "single".
    """

    name: str
    ship: Ship
    manoeuvre: Manoeuvre
    speed: float
    duration: float
    dt: float
    method: str = "rk4"
    whole: bool = False
    device: str = "cpu"
    precision: str = "double"

    @property
    def samples(self) -> int:
        """Samples of each run, the first included."""
        return round(self.duration / self.dt) + 1

    @property
    def stored(self) -> bool:
        """Whether the runs are read as a whole: so asked, or of a ship that rolls, whose heel no tally follows."""
        return self.whole or self.ship.model.motion != STATES


def usual_chunk(cases: Sequence[Case], tracks: Tracks | None) -> int:
    """Number of runs in a part: a second of work at most, and tracks of a file of convenient size."""
    stored = any(case.stored or tally_of(case.manoeuvre, case.dt, {}, flowing=False) is None for case in cases)
    most = STORED if stored else CHUNK
    return most if tracks is None else min(tracks.chunk(case.samples, most) for case in cases)


@dataclass(frozen=True)
class Correlated:
    """Inputs with a joint distribution, such as the posterior of a fit: normal, or by draws.

    Attributes:
        names: paths of parameters.
        mean: shape (names,).
        root: lower Cholesky factor of the covariance, shape (names, names).
        draws: equally likely values, shape (draws, names), in place of mean and root; None without.
    """

    names: tuple[str, ...]
    mean: Array
    root: Array
    draws: Array | None = None

    @property
    def dims(self) -> int:
        """Dimensions of a design that it takes: one for each name, or one to choose a draw."""
        return len(self.names) if self.draws is None else 1

    def of(self, share: Array) -> Array:
        """Values at shares in (0, 1), shapes (runs, dims) and (runs, names)."""
        if self.draws is not None:
            return self.draws[np.minimum((share[:, 0] * len(self.draws)).astype(np.intp), len(self.draws) - 1)]
        from scipy.special import ndtri

        joint: Array = self.mean + ndtri(share) @ self.root.T
        return joint


@dataclass(frozen=True)
class Criterion:
    """A bound that an index is held against: met at `low` <= index <= `high` (SI units)."""

    index: str
    low: Annotated[float, Limits(null=-math.inf)]
    high: Annotated[float, Limits(null=math.inf)]


@dataclass(frozen=True)
class Campaign:
    """What a campaign computes.

    Attributes:
        name: of the table.
        cases: each is run `runs` times, with the same points: runs of the same number differ in the case alone.
        runs: number of runs of a case.
        inputs: by name: a parameter of the closed loop ("ship.hull.Y_v", "rudder.rate", "policy.delta"), of the weather
            ("U_T", "gamma_T", "U_C", "gamma_C", "H_S", "T_W", "gamma_W", "depth") or of the start
            ("x", "y", "psi", "u", "v_m", "r").
        correlated: inputs with a joint distribution.
        design: of the points.
        seed: of the points and of gusts.
        weather: steady weather, where no input replaces it.
        gusts: spectrum of gusts on the wind, a seed a run; None without.
        balanced: whether each run starts with the revolutions that hold its speed.
        criteria: bounds of indices, by name.
        chunk: number of runs in a part.
        tracks: samples of each run that are kept; None keeps none.

    Raises:
        CampaignError: numbers that make no campaign.
    """

    name: str
    cases: tuple[Case, ...]
    runs: int
    inputs: Mapping[str, Input]
    correlated: Correlated | None = None
    design: Design = "random"
    seed: int = 1
    weather: Uniform = field(default_factory=Uniform)
    gusts: str | None = None
    balanced: bool = False
    criteria: Mapping[str, Criterion] = field(default_factory=dict[str, Criterion])
    chunk: int = CHUNK
    tracks: Tracks | None = None

    def __post_init__(self) -> None:
        if not self.cases:
            raise CampaignError(f"{self.name}: give one ship and one manoeuvre at least")
        if not 0 <= self.seed < 2**63:
            raise CampaignError(f"{self.name}: seed is {self.seed}; it is zero or above")
        if self.chunk < 1:
            raise CampaignError(f"{self.name}: chunk is {self.chunk}; give 1 or more")
        if self.design == "saltelli" and self.correlated is not None and self.correlated.draws is not None:
            raise CampaignError(f"{self.name}: design saltelli moves inputs one by one, which draws do not allow; take "
                                "fit.json, or another design")  # fmt: skip
        try:
            check_runs(self.design, self.dims, self.runs, self.levels)
        except ValueError as error:
            raise CampaignError(f"{self.name}: {error}") from None
        if self.tracks is not None:
            self._check_tracks(self.tracks)

    def _check_tracks(self, tracks: Tracks) -> None:
        first = tracks.names(self.cases[0].ship, self.cases[0].manoeuvre)
        for case in self.cases:
            own = tracks.names(case.ship, case.manoeuvre)
            if own != first:
                both = f"{case.name} has {', '.join(own)}, {self.cases[0].name} {', '.join(first)}"
                raise CampaignError(f"{self.name}: tracks: {both}; choose columns that both have")
            tracks.check(case.samples, len(own), min(self.chunk, self.runs))

    @property
    def kept(self) -> tuple[str, ...]:
        """Columns of the tracks after their run and time; empty without tracks."""
        return self.tracks.names(self.cases[0].ship, self.cases[0].manoeuvre) if self.tracks else ()

    @property
    def track_rows(self) -> int:
        """Rows of the tracks of all runs, where none fails."""
        return self.runs * sum(self.tracks.rows(case.samples) for case in self.cases) if self.tracks else 0

    @property
    def varied(self) -> tuple[str, ...]:
        """Names of the inputs that take a dimension of the design, in its order."""
        return tuple(name for name, one in self.inputs.items() if one.varies)

    @property
    def dims(self) -> int:
        """Dimensions of the design."""
        return len(self.varied) + (self.correlated.dims if self.correlated else 0)

    @property
    def levels(self) -> tuple[int, ...]:
        """Of a grid, how many values each input has."""
        return tuple(len(self.inputs[name].numbers) for name in self.varied)

    @property
    def rows(self) -> int:
        """Number of runs of all cases."""
        return self.runs * len(self.cases)

    @property
    def parts(self) -> int:
        """Number of parts; each is of one case."""
        return len(self.cases) * -(-self.runs // self.chunk)

    def part(self, number: int) -> tuple[int, int, int]:
        """Case, first run and end of a part."""
        case, place = divmod(number, -(-self.runs // self.chunk))
        return case, place * self.chunk, min((place + 1) * self.chunk, self.runs)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that defines the numbers of the runs, and of the version."""
        found = hashlib.sha256(__version__.encode())
        for case in self.cases:
            settings = (type(case.manoeuvre).__name__, sorted(vars(case.manoeuvre).items()), case.speed, case.duration,
                        case.dt, case.method, case.whole,
                        *(() if case.device == "cpu" else (case.device.partition(":")[0], case.precision)))  # fmt: skip
            found.update(f"{case.name} {to_toml(case.ship)} {settings!r}".encode())
        drawn = (self.runs, sorted(self.inputs.items()), list(self.inputs), self.design, self.seed, self.weather,
                 self.gusts, self.balanced, sorted(self.criteria.items()), self.chunk)  # fmt: skip
        found.update(repr(drawn if self.tracks is None else (*drawn, self.tracks)).encode())
        if self.correlated is not None:
            found.update(repr(self.correlated.names).encode())
            found.update(self.correlated.mean.tobytes() + self.correlated.root.tobytes())
            if self.correlated.draws is not None:
                found.update(self.correlated.draws.tobytes())
        return found.hexdigest()

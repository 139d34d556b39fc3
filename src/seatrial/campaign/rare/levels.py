"""The folder of a search for a rare event: a manifest, and each level as a Parquet file, complete or absent.

    DIR/search.json                     campaign, criterion, number of runs of a level
    DIR/levels/case-0-level-03.parquet  a run a row: inputs, indices, margin, and `z_...`, its point in normal space

A level names its search, so that one of another cannot be taken for it.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Annotated

import numpy as np

from ... import __version__
from ...core.errors import first_line
from ...core.files import write_together, write_whole
from ...core.records import Limits, Positive, from_json, json_in, read_json, to_json
from ...core.values import dataclass
from ...data import Array
from .. import Campaign, CampaignError
from ..analysis import margin
from ..chunk import sailed_at
from .subset import Level, Limit

SCHEMA = "seatrial-campaign-rare/2"
"""What a search for rare events says of itself; other versions are refused."""
SEARCH = "search.json"
"""The file that tells how far the search has come."""
_KEY = "seatrial.rare"

# Cumulated probabilities stay off 0 and 1, whose quantiles may be infinite.
_EDGE = 2.0**-53


def cube_of(points: Array) -> Array:
    """Points of the unit cube of those in standard normal space."""
    from scipy.special import ndtr

    return np.clip(ndtr(points), _EDGE, 1.0 - _EDGE)


@dataclass(frozen=True)
class Search:
    """What the folder of a search says of it.

    Attributes:
        name, version, digest: of the campaign, the seatrial that began it, and all that defines the numbers.
        criterion, index, runs: what is sought, the index that it bounds, runs of each level.
        cases: names.
        source, text: the file of the campaign, and what that held; None without one.
    """

    name: str
    version: str
    digest: str
    criterion: str
    index: str
    runs: int
    cases: tuple[str, ...]
    source: str | None
    text: str | None


@dataclass(frozen=True)
class _About:
    """What the file of a level says beside its table; see `Level`."""

    search: str
    bound: Annotated[float, Limits(null=math.inf)]
    accepted: Annotated[float, Limits(least=0.0, most=1.0)]
    step: Positive


@dataclass(frozen=True)
class Sought:
    """A search.

    Attributes:
        campaign: whose inputs, cases and weather are taken; its design and number of runs are not.
        criterion: name of the one whose violation is the event.
        runs: of each level.
        threads: of the kernels.
    """

    campaign: Campaign
    criterion: str
    runs: int
    threads: int = 1

    @property
    def index(self) -> str:
        """Index that the criterion bounds."""
        return self.campaign.criteria[self.criterion].index

    @cached_property
    def digest(self) -> str:
        """SHA-256 of all that defines the numbers."""
        return hashlib.sha256(f"{self.campaign.digest} {self.criterion} {self.runs}".encode()).hexdigest()

    def sail(self, case: int, points: Array) -> Mapping[str, Array]:
        """Inputs and indices of runs at points of standard normal space, shape (runs, dims)."""
        return sailed_at(self.campaign, case, cube_of(points), self.threads)

    def margins(self, columns: Mapping[str, Array]) -> Array:
        """How far each run is from violating the criterion."""
        bound = self.campaign.criteria[self.criterion]
        return margin(columns[bound.index], bound.low, bound.high)

    def limit(self, case: int) -> Limit:
        """Margin as a function of points."""
        return lambda points: self.margins(self.sail(case, points))


def begin(sought: Sought, folder: Path, source: Path | None = None) -> None:
    """Make the folder, or see that it is that of this very search.

    Args:
        source: file that the campaign was read from; its text is kept, so that runs can be replayed.

    Raises:
        CampaignError: it holds something else.
    """
    manifest = folder / SEARCH
    if manifest.exists():
        if read_search(folder).digest != sought.digest:
            raise CampaignError(f"{folder}: holds another search (criterion, --runs, campaign or version differ); "
                                "choose another folder with -o")  # fmt: skip
        return
    if folder.exists() and any(path.name[0] != "." for path in folder.iterdir()):
        raise CampaignError(f"{folder}: is not empty and holds no search for a rare event; choose another with -o")
    folder.mkdir(parents=True, exist_ok=True)
    found = Search(
        sought.campaign.name, __version__, sought.digest, sought.criterion, sought.index, sought.runs,
        tuple(case.name for case in sought.campaign.cases), None if source is None else str(source.resolve()),
        None if source is None else source.read_text(encoding="utf-8"),
    )  # fmt: skip
    write_whole(manifest, to_json(found, SCHEMA))


def read_search(folder: Path) -> Search:
    """What the folder of a search says of it; raises `CampaignError` as of `read_json`."""
    return read_json(folder / SEARCH, Search, SCHEMA, CampaignError)


def level_path(folder: Path, case: int, number: int) -> Path:
    """File of a level."""
    return folder / "levels" / f"case-{case}-level-{number:02d}.parquet"


def write_level(sought: Sought, case: int, level: Level, path: Path) -> None:
    """Write a level with the inputs and indices of its runs.

    Raises:
        OSError: it cannot be written; nothing of it is left.
    """
    import polars as pl

    sailed = sought.sail(case, level.points)
    columns = {name: np.asarray(column, dtype=np.float64) for name, column in sailed.items()}
    columns |= {"margin": level.margins, **{f"z_{k}": column.copy() for k, column in enumerate(level.points.T)}}
    about = {_KEY: to_json(_About(sought.digest, level.bound, level.accepted, level.step), SCHEMA)}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_together({path: lambda scratch: pl.DataFrame(columns).write_parquet(scratch, metadata=about)})


def read_level(sought: Sought, path: Path) -> tuple[Level, Mapping[str, Array]]:
    """A level, and the inputs and indices of its runs.

    Raises:
        CampaignError: a file that is damaged or of another search.
    """
    import polars as pl

    try:
        said, table = pl.read_parquet_metadata(path).get(_KEY, "null"), pl.read_parquet(path)
        points = np.column_stack([table[name].to_numpy() for name in table.columns if name.startswith("z_")])
        margins = table["margin"].to_numpy()
    except (OSError, ValueError, pl.exceptions.PolarsError) as error:
        raise CampaignError(f"{path}: cannot be read ({first_line(error)}); delete it and search again") from None
    remedy = "delete it and search again"
    about = from_json(_About, json_in(said, SCHEMA, path, CampaignError, remedy), path, CampaignError)
    if about.search != sought.digest or len(margins) != sought.runs:
        raise CampaignError(f"{path}: is of another search; delete it and search again")
    rows = {name: table[name].to_numpy() for name in table.columns if name != "margin" and not name.startswith("z_")}
    return Level(points, margins, about.bound, about.accepted, about.step), rows

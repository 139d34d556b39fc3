"""The folder of a search for a rare event: a manifest, and each level as a Parquet file, complete or absent.

    DIR/search.json                     campaign, criterion, number of runs of a level
    DIR/levels/case-0-level-03.parquet  a run a row: inputs, indices, margin, and `z_...`, its point in normal space

A level names its search, so that one of another cannot be taken for it.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ... import __version__
from ...core.files import write_together, write_whole
from ...data import Array
from .. import Campaign, CampaignError
from ..analysis import margin
from ..chunk import sailed_at
from .subset import Level, Limit

SCHEMA = "seatrial-campaign-rare/1"
MANIFEST = "search.json"

# Cumulated probabilities stay off 0 and 1, whose quantiles may be infinite.
_EDGE = 2.0**-53


def cube_of(points: Array) -> Array:
    """Points of the unit cube of those in standard normal space."""
    from scipy.special import ndtr

    return np.clip(ndtr(points), _EDGE, 1.0 - _EDGE)


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
    manifest = folder / MANIFEST
    if manifest.exists():
        if read_manifest(folder).get("digest") != sought.digest:
            raise CampaignError(f"{folder}: holds another search (criterion, --runs, campaign or version differ); "
                                "choose another folder with -o")  # fmt: skip
        return
    if folder.exists() and any(path.name[0] != "." for path in folder.iterdir()):
        raise CampaignError(f"{folder}: is not empty and holds no search for a rare event; choose another with -o")
    folder.mkdir(parents=True, exist_ok=True)
    document = {"schema": SCHEMA, "name": sought.campaign.name, "version": __version__, "digest": sought.digest,
                "criterion": sought.criterion, "index": sought.index, "runs": sought.runs,
                "cases": [case.name for case in sought.campaign.cases],
                "source": None if source is None else str(source.resolve()),
                "text": None if source is None else source.read_text(encoding="utf-8")}  # fmt: skip
    write_whole(manifest, json.dumps(document, indent=1) + "\n")


def read_manifest(folder: Path) -> dict[str, Any]:
    """What the folder of a search says of it; empty where it is damaged or missing."""
    try:
        document: Any = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return document if isinstance(document, dict) and document.get("schema") == SCHEMA else {}


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
    about = {"seatrial.rare": sought.digest, "bound": repr(level.bound), "accepted": repr(level.accepted),
             "step": repr(level.step)}  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    write_together({path: lambda scratch: pl.DataFrame(columns).write_parquet(scratch, metadata=about)})


def read_level(sought: Sought, path: Path) -> tuple[Level, Mapping[str, Array]]:
    """A level, and the inputs and indices of its runs.

    Raises:
        CampaignError: a file that is damaged or of another search.
    """
    import polars as pl

    try:
        about, table = pl.read_parquet_metadata(path), pl.read_parquet(path)
        numbers = [float(about[key]) for key in ("bound", "accepted", "step")]
        points = np.column_stack([table[name].to_numpy() for name in table.columns if name.startswith("z_")])
        margins = table["margin"].to_numpy()
    except (OSError, KeyError, ValueError, pl.exceptions.PolarsError) as error:
        why = str(error).splitlines()[0]
        raise CampaignError(f"{path}: cannot be read ({why}); delete it and search again") from None
    if about.get("seatrial.rare") != sought.digest or len(margins) != sought.runs or math.isnan(sum(numbers)):
        raise CampaignError(f"{path}: is of another search; delete it and search again")
    rows = {name: table[name].to_numpy() for name in table.columns if name != "margin" and not name.startswith("z_")}
    return Level(points, margins, *numbers), rows

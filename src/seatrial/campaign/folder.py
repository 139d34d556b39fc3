"""The folder of a campaign: a manifest, and its parts as Parquet files, each complete or absent.

    DIR/campaign.json             what the folder holds: digest, version, number of runs, columns with units
    DIR/parts/0000/0000012.parquet  runs of part 12

A part is written under a hidden name and then renamed, so that a killed process leaves nothing half-written and any
number of processes may work in one folder.  Its bytes are a function of the campaign alone.
"""

from __future__ import annotations

import errno
import hashlib
import io
import json
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..core.files import plain, write_together, write_whole
from ..core.version import __version__
from ..data import Array
from . import Campaign, CampaignError
from .chunk import Part, compute

SCHEMA = "seatrial-campaign-folder/1"
MANIFEST = "campaign.json"
_PARTS = "parts"
_A_FOLDER = 1000
# A column that no run fills costs nothing, others up to eight bytes a run; random numbers do not compress.
_BYTES = 8.0
_WHOLE = ("run", "case")


@dataclass(frozen=True)
class Held:
    """What a folder says of its campaign.

    Attributes:
        folder: the folder.
        document: the manifest.
    """

    folder: Path
    document: Mapping[str, Any]

    @property
    def parts(self) -> int:
        """Number of parts."""
        return int(self.document["parts"])

    @property
    def missing(self) -> list[int]:
        """Numbers of the parts that are not there yet."""
        there = {int(path.stem) for path in (self.folder / _PARTS).glob("*/*.parquet")}
        return [number for number in range(self.parts) if number not in there]

    def path(self, number: int) -> Path:
        """File of a part."""
        return part_path(self.folder, number)

    def digest(self) -> str:
        """SHA-256 of the bytes of all parts in their order; the same for the same campaign wherever it was computed.

        Raises:
            CampaignError: a part is missing.
        """
        if self.missing:
            raise CampaignError(_incomplete(self))
        found = hashlib.sha256()
        for number in range(self.parts):
            found.update(hashlib.sha256(self.path(number).read_bytes()).digest())
        return found.hexdigest()


def _incomplete(held: Held) -> str:
    return f"{held.folder}: {len(held.missing)} of {held.parts} parts are missing; run the campaign to its end"


def part_path(folder: Path, number: int) -> Path:
    """File of part `number`; a thousand in a folder."""
    return folder / _PARTS / f"{number // _A_FOLDER:04d}" / f"{number:07d}.parquet"


def open_folder(folder: Path) -> Held:
    """The campaign that a folder holds.

    Raises:
        CampaignError: it holds none, or one of another version.
    """
    try:
        document = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        wanted = f"seatrial campaign CAMPAIGN.toml -o {folder} starts one"
        raise CampaignError(f"{folder}: holds no campaign; {wanted}") from None
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise CampaignError(f"{folder / MANIFEST}: is not of schema '{SCHEMA}'")
    return Held(folder, document)


def begin(campaign: Campaign, folder: Path, source: Path | None = None) -> Held:
    """The folder of a campaign, new or as it was left.

    Args:
        source: file that the campaign was read from; its text is kept, so that runs can be replayed.

    Raises:
        CampaignError: it holds another campaign or one of another version, or the disk is too small for this one.
        OSError: it cannot be written.
    """
    if (folder / MANIFEST).exists():
        held = open_folder(folder)
        theirs, version = held.document["digest"], held.document["version"]
        if version != __version__:
            raise CampaignError(f"{folder}: was begun with seatrial {version}, this is {__version__}; "
                                "go on with that version, or choose another folder with -o")  # fmt: skip
        if theirs != campaign.digest:
            raise CampaignError(f"{folder}: holds another campaign ({held.document['name']}, digest {theirs[:12]}; "
                                f"this one has {campaign.digest[:12]}); choose another folder with -o")  # fmt: skip
        return held
    if folder.exists() and any(path.name[0] != "." for path in folder.iterdir()):
        raise CampaignError(f"{folder}: is not empty and holds no campaign; choose another folder with -o")
    first = _first(campaign)
    _check_room(campaign, folder, len(first))
    document = {
        "schema": SCHEMA, "name": campaign.name, "version": __version__, "digest": campaign.digest,
        "cases": [case.name for case in campaign.cases], "runs": campaign.runs, "rows": campaign.rows,
        "parts": campaign.parts, "chunk": campaign.chunk, "design": campaign.design, "seed": campaign.seed,
        "inputs": [*campaign.varied, *(campaign.correlated.names if campaign.correlated else ())],
        "criteria": {name: vars(one) for name, one in campaign.criteria.items()},
        "columns": first,
        "source": None if source is None else str(source.resolve()),
        "text": None if source is None else source.read_text(encoding="utf-8"),
    }  # fmt: skip
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / MANIFEST, json.dumps(plain(document), indent=1) + "\n")
    return open_folder(folder)


def _first(campaign: Campaign) -> list[str]:
    """Columns of the table, from a few runs of each case; a case whose columns differ is refused."""
    from dataclasses import replace

    wanted: list[str] = []
    for case in campaign.cases:
        few = replace(campaign, cases=(case,), runs=campaign.runs, chunk=1)
        found = list(compute(few, 0).columns)
        if wanted and set(found) != set(wanted):
            only = sorted(set(found) ^ set(wanted))
            raise CampaignError(f"{campaign.name}: {case.name} has other columns than {campaign.cases[0].name} "
                                f"({', '.join(only[:6])}); make one campaign of each manoeuvre")  # fmt: skip
        wanted = wanted or found
    return wanted


def _check_room(campaign: Campaign, folder: Path, columns: int) -> None:
    there = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    needed, free = campaign.rows * columns * _BYTES, shutil.disk_usage(there).free
    if needed > free:
        size = f"{campaign.rows} runs of {columns} columns take up to {needed / 1e9:.3g} GB"
        raise CampaignError(f"{campaign.name}: {size}; {there} has {free / 1e9:.3g} GB free")


def write_part(campaign: Campaign, folder: Path, number: int, threads: int = 1) -> int:
    """Compute one part and write it; the number of its runs.

    Raises:
        OSError: it cannot be written; nothing of it is left.
    """
    table = compute(campaign, number, threads)
    path = part_path(folder, number)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, _parquet(campaign, table, number))
    return len(table.columns["run"])


def _parquet(campaign: Campaign, part: Part, number: int) -> bytes:
    # in memory first: Polars has an error of its own for a full disk
    import polars as pl

    columns = {name: _typed(name, column) for name, column in part.columns.items()}
    about = {"seatrial.version": __version__, "seatrial.campaign": campaign.digest, "seatrial.part": str(number)}
    held = io.BytesIO()
    pl.DataFrame(columns).write_parquet(held, compression="zstd", compression_level=1, metadata=about)
    return held.getvalue()


def _typed(name: str, column: Array) -> Any:
    return column.astype(np.int64) if name in _WHOLE else np.ascontiguousarray(column, dtype=np.float64)


def wrong_parts(held: Held) -> Iterator[str]:
    """What is wrong with the parts that are there: unreadable, of another campaign, or with missing runs."""
    import polars as pl

    expected = int(held.document["rows"])
    seen = 0
    for number in range(held.parts):
        path = held.path(number)
        if not path.exists():
            continue
        try:
            about, rows = pl.read_parquet_metadata(path), pl.read_parquet(path)
        except (OSError, pl.exceptions.PolarsError) as error:
            yield f"{path}: cannot be read ({str(error).splitlines()[0]}); delete it and run the campaign again"
            continue
        if about.get("seatrial.campaign") != held.document["digest"] or about.get("seatrial.part") != str(number):
            yield f"{path}: is of another campaign or part; delete it and run the campaign again"
        if list(rows.columns) != list(held.document["columns"]):
            yield f"{path}: has other columns than the campaign; delete it and run the campaign again"
        seen += rows.height
    if not held.missing and seen != expected:
        yield f"{held.folder}: has {seen} runs in place of {expected}"


def scan(held: Held) -> Any:
    """The table as a lazy frame of Polars, in the order of the runs.

    Raises:
        CampaignError: no part is there yet.
    """
    import polars as pl

    there = sorted((held.folder / _PARTS).glob("*/*.parquet"), key=lambda path: int(path.stem))
    if not there:
        raise CampaignError(f"{held.folder}: no part is computed yet; run the campaign first")
    return pl.scan_parquet(there)


def merge(held: Held, out: Path) -> Path:
    """Write the whole table to one Parquet file.

    Raises:
        CampaignError: parts are missing.
    """
    if held.missing:
        raise CampaignError(_incomplete(held))
    write_together({out: lambda scratch: _sink(scan(held), scratch, out)})
    return out


def _sink(table: Any, scratch: str, out: Path) -> None:
    import polars as pl

    try:
        table.sink_parquet(scratch, compression="zstd")
    except pl.exceptions.PolarsError as error:
        if "os error" not in str(error):
            raise
        raise OSError(errno.ENOSPC if "os error 28" in str(error) else errno.EIO, str(error), str(out)) from None

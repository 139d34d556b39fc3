"""The tables of a campaign's folder: read as a whole, merged to one file each, and checked part by part."""

from __future__ import annotations

import errno
import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core.errors import first_line
from ..core.files import write_together
from . import CampaignError
from .columns import about
from .folder import PARTS, TRACKS, Held, Kept, part_name
from .tracks import counts

if TYPE_CHECKING:
    import polars as pl


def scan(held: Held) -> pl.LazyFrame:
    """The table as a lazy frame of Polars, in the order of the runs.

    Raises:
        CampaignError: no part is there yet.
    """
    return _scan(held, PARTS)


def scan_tracks(held: Held) -> pl.LazyFrame:
    """The tracks as a lazy frame of Polars: run, t, columns; run by run.

    Raises:
        CampaignError: the campaign keeps none, or no part is there yet.
    """
    if TRACKS not in held.kinds:
        wanted = "tracks = { every = 10 } in the file of the campaign keeps every tenth sample"
        raise CampaignError(f"{held.folder}: keeps no tracks; {wanted}")
    return _scan(held, TRACKS)


def _scan(held: Held, kind: str) -> pl.LazyFrame:
    there = held.there(kind)
    if not there:
        raise CampaignError(f"{held.folder}: no part is computed yet; run the campaign first")
    return held.place.scan([part_name(number, kind) for number in there])


def merge(held: Held, out: Path) -> tuple[Path, ...]:
    """Write the whole table to one Parquet file, and the tracks to another beside it: NAME.tracks.parquet.

    Raises:
        CampaignError: parts are missing.
    """
    held.complete()
    tables = {out: scan(held)}
    if TRACKS in held.kinds:
        tables[out.with_suffix(".tracks.parquet")] = scan_tracks(held)
    return write_together({path: lambda scratch, path=path: _sink(held, tables[path], scratch, path)
                           for path in tables})  # fmt: skip


def _sink(held: Held, table: pl.LazyFrame, scratch: str, out: Path) -> None:
    import polars as pl

    units = held.manifest.units
    try:
        own = {name: units.get(name, "-") for name in table.collect_schema().names()}
        table.sink_parquet(scratch, compression="zstd", metadata=about(own))
    except pl.exceptions.PolarsError as error:
        if "os error" not in str(error):
            raise damaged(held, error) from None
        raise OSError(errno.ENOSPC if "os error 28" in str(error) else errno.EIO, str(error), str(out)) from None


def damaged(held: Held, error: Exception) -> CampaignError:
    """What a part that Polars cannot read is answered with."""
    return CampaignError(f"{held.folder}: a part cannot be read ({first_line(error)}); "
                         f"seatrial campaign {held.folder} --verify says which")  # fmt: skip


def wrong_parts(held: Held) -> Iterator[str]:
    """What is wrong with the parts that are there: unreadable, of another campaign, or with missing runs or samples."""
    seen, there = 0, {kind: set(held.there(kind)) for kind in held.kinds}
    for number in range(held.parts):
        tables: dict[str, pl.DataFrame] = {}
        for kind in held.kinds:
            if number in there[kind]:
                faults = list(_read(held, number, kind, tables))
                yield from (f"{held.folder}/{part_name(number, kind)}: {fault}; delete it and run the campaign again"
                            for fault in faults)  # fmt: skip
        seen += tables[PARTS].height if PARTS in tables else 0
        if held.manifest.tracks and len(tables) == len(held.kinds) and not _agree(held.manifest.tracks, **tables):
            yield (f"{held.folder}/{part_name(number, TRACKS)}: has other runs or samples than the part; delete it "
                   "and run the campaign again")  # fmt: skip
    if not held.missing and seen != held.manifest.rows:
        yield f"{held.folder}: has {seen} runs in place of {held.manifest.rows}"


def _read(held: Held, number: int, kind: str, tables: dict[str, pl.DataFrame]) -> Iterator[str]:
    """What is wrong with one file; its table goes into `tables`."""
    import polars as pl

    try:
        content = held.place.read(part_name(number, kind))
        told, rows = pl.read_parquet_metadata(io.BytesIO(content)), pl.read_parquet(io.BytesIO(content))
    except (OSError, pl.exceptions.PolarsError) as error:
        yield f"cannot be read ({first_line(error)})"
        return
    if told.get("seatrial.campaign") != held.manifest.digest or told.get("seatrial.part") != str(number):
        yield "is of another campaign or part"
    about = held.manifest
    if tuple(rows.columns) != (about.tracks.columns if about.tracks and kind == TRACKS else about.columns):
        yield "has other columns than the campaign"
        return
    tables[kind] = rows


def _agree(kept: Kept, parts: pl.DataFrame, tracks: pl.DataFrame) -> bool:
    """Whether the tracks of a part have every kept sample of each of its runs, in their order."""
    case = parts["case"].to_numpy()
    samples, dt = (np.array(one)[case] for one in (kept.samples, kept.dt))
    rows = counts(parts["failed"].to_numpy(), samples, dt, kept.every)
    return np.array_equal(np.repeat(parts["run"].to_numpy(), rows), tracks["run"].to_numpy())

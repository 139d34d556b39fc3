"""The folder of a campaign: a manifest, and its parts as Parquet files, each complete or absent.

    DIR/campaign.json                what the folder holds: digest, version, number of runs, columns with units
    DIR/parts/0000/0000012.parquet   runs of part 12
    DIR/tracks/0000/0000012.parquet  their tracks, where the campaign keeps any

Each file is whole or absent (`places`), so that a killed process leaves nothing half-written and any number of
processes may work in one folder.  The tracks of a part are there before its runs.  The bytes of both are a function of
the campaign alone.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core.files import plain
from ..core.records import digest, from_json, json_in
from ..core.values import dataclass
from ..core.version import __version__
from . import Campaign, CampaignError, Criterion
from .chunk import compute
from .columns import about, typed, units_of
from .places import Place, place_of
from .tracks import FIRST

if TYPE_CHECKING:
    import polars as pl

SCHEMA = "seatrial-campaign-folder/3"
"""What a folder of a campaign says of itself; other versions are refused."""
MANIFEST, SEAL = "campaign.json", "seal"
PARTS, TRACKS = "parts", "tracks"
_A_FOLDER = 1000
# A column that no run fills costs nothing, others up to eight bytes a run; random numbers do not compress.
_BYTES = 8.0


@dataclass(frozen=True)
class Kept:
    """Of a manifest: which tracks there are.

    Attributes:
        every, columns, precision: steps from sample to sample, columns, and of their numbers.
        rows: samples of all runs.
        samples, dt: of the runs of each case, and their time step [s].
    """

    every: int
    columns: tuple[str, ...]
    precision: str
    rows: int
    samples: tuple[int, ...]
    dt: tuple[float, ...]


@dataclass(frozen=True)
class Manifest:
    """What a folder says of its campaign.

    Attributes:
        name, version, digest: of the campaign, the seatrial that began it, and all that defines its numbers.
        cases, devices: name and device of each.
        runs, rows, parts, chunk: of each case, of all, and how they are dealt.
        design, seed, inputs, criteria: as the campaign has them.
        columns, units: of the table of runs; units of all columns that have one.
        tracks: None without any.
        source, text: the file that it was read from, and what that held; None without one.
    """

    name: str
    version: str
    digest: str
    cases: tuple[str, ...]
    runs: int
    rows: int
    parts: int
    chunk: int
    design: str
    seed: int
    inputs: tuple[str, ...]
    criteria: Mapping[str, Criterion]
    columns: tuple[str, ...]
    units: Mapping[str, str]
    tracks: Kept | None
    devices: tuple[str, ...]
    source: str | None
    text: str | None


@dataclass(frozen=True)
class Held:
    """The folder of a campaign.

    Attributes:
        place: where its files are.
        manifest: what it says.
    """

    place: Place
    manifest: Manifest

    @property
    def folder(self) -> str:
        """The folder or URL."""
        return str(self.place)

    @property
    def parts(self) -> int:
        """Number of parts."""
        return self.manifest.parts

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of files that each part has."""
        return (PARTS, TRACKS) if self.manifest.tracks else (PARTS,)

    def there(self, kind: str = PARTS) -> list[int]:
        """Numbers of the parts of which that kind of file is there, in their order."""
        return sorted(int(Path(name).stem) for name in self.place.find(kind))

    @property
    def missing(self) -> list[int]:
        """Numbers of the parts that are not there yet."""
        there = set.intersection(*(set(self.there(kind)) for kind in self.kinds))
        return [number for number in range(self.parts) if number not in there]

    def digest(self) -> str:
        """SHA-256 of the bytes of all parts in their order; the same for the same campaign wherever it was computed.

        Raises:
            CampaignError: a part is missing.
        """
        self.complete()
        found = hashlib.sha256()
        for number in range(self.parts):
            for kind in self.kinds:
                found.update(hashlib.sha256(self.place.read(part_name(number, kind))).digest())
        return found.hexdigest()

    def complete(self) -> None:
        """Refuse a folder that misses parts; CampaignError says how many."""
        missing = len(self.missing)
        if missing:
            lacking = f"{missing} of {self.parts} parts are missing"
            raise CampaignError(f"{self.folder}: {lacking}; run the campaign to its end")


def part_name(number: int, kind: str = PARTS) -> str:
    """File of part `number`; a thousand in a folder."""
    return f"{kind}/{number // _A_FOLDER:04d}/{number:07d}.parquet"


def open_folder(where: str | Path | Place) -> Held:
    """The campaign that a folder or store holds.

    Raises:
        CampaignError: it holds none, one of another version, or one whose manifest was changed.
    """
    place = place_of(where) if isinstance(where, str | Path) else where
    try:
        content = place.read(MANIFEST)
    except OSError:
        wanted = f"seatrial campaign CAMPAIGN.toml -o {place} starts one"
        raise CampaignError(f"{place}: holds no campaign; {wanted}") from None
    where = f"{place}/{MANIFEST}"
    document = json_in(content, SCHEMA, where, CampaignError)
    if document.pop(SEAL, None) != digest({"schema": SCHEMA, **document}):
        raise CampaignError(f"{where}: was changed after it was written; put back what the campaign wrote")
    return Held(place, from_json(Manifest, document, where, CampaignError))


def begin(campaign: Campaign, where: str | Path | Place, source: Path | None = None) -> Held:
    """The folder of a campaign, new or as it was left.

    Args:
        where: folder, or URL of a store.
        source: file that the campaign was read from; its text is kept, so that runs can be replayed.

    Raises:
        CampaignError: it holds another campaign or one of another version, or the disk is too small for this one.
        OSError: it cannot be written.
    """
    place = place_of(where) if isinstance(where, str | Path) else where
    if place.used():
        return _again(campaign, place)
    first = _first(campaign)
    _check_room(campaign, place, len(first))
    manifest = Manifest(
        campaign.name, __version__, campaign.digest, tuple(case.name for case in campaign.cases), campaign.runs,
        campaign.rows, campaign.parts, campaign.chunk, campaign.design, campaign.seed,
        (*campaign.varied, *(campaign.correlated.names if campaign.correlated else ())), campaign.criteria,
        tuple(first), units_of(campaign), _tracks(campaign), tuple(case.device for case in campaign.cases),
        None if source is None else str(source.resolve()),
        None if source is None else source.read_text(encoding="utf-8"),
    )  # fmt: skip
    document = {"schema": SCHEMA, **plain(manifest)}
    place.write({MANIFEST: (json.dumps({**document, SEAL: digest(document)}, indent=1) + "\n").encode()})
    return open_folder(place)


def _again(campaign: Campaign, place: Place) -> Held:
    """What lies there, if it is of this campaign."""
    if not place.holds(MANIFEST):
        raise CampaignError(f"{place}: is not empty and holds no campaign; choose another folder with -o")
    held = open_folder(place)
    theirs, version = held.manifest.digest, held.manifest.version
    if version != __version__:
        raise CampaignError(f"{place}: was begun with seatrial {version}, this is {__version__}; "
                            "go on with that version, or choose another folder with -o")  # fmt: skip
    if theirs != campaign.digest:
        raise CampaignError(f"{place}: holds another campaign ({held.manifest.name}, digest {theirs[:12]}; "
                            f"this one has {campaign.digest[:12]}); choose another folder with -o")  # fmt: skip
    return held


def _tracks(campaign: Campaign) -> Kept | None:
    """Of the manifest: what is kept, and how long the runs of each case are."""
    if campaign.tracks is None:
        return None
    return Kept(campaign.tracks.every, (*FIRST, *campaign.kept), campaign.tracks.precision, campaign.track_rows,
                tuple(case.samples for case in campaign.cases), tuple(case.dt for case in campaign.cases))  # fmt: skip


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


def _check_room(campaign: Campaign, place: Place, columns: int) -> None:
    needed, free, tracks = campaign.rows * columns * _BYTES, place.free(), ""
    if campaign.tracks is not None:
        needed += campaign.track_rows * len(campaign.kept) * np.dtype(campaign.tracks.type).itemsize
        tracks = f" and {campaign.track_rows} rows of tracks"
    if free is not None and needed > free:
        size = f"{campaign.rows} runs of {columns} columns{tracks} take up to {needed / 1e9:.3g} GB"
        raise CampaignError(f"{campaign.name}: {size}; {place} has {free / 1e9:.3g} GB free")


def write_part(campaign: Campaign, where: str | Path | Place, number: int, threads: int = 1) -> int:
    """Compute one part and write it; the number of its runs.

    Raises:
        OSError: it cannot be written; nothing of it is left, or tracks that the next try writes again.
    """
    import polars as pl

    place = place_of(where) if isinstance(where, str | Path) else where
    part = compute(campaign, number, threads)
    told = {"seatrial.version": __version__, "seatrial.campaign": campaign.digest, "seatrial.part": str(number)}
    units = units_of(campaign)
    frames = {TRACKS: pl.DataFrame(dict(part.tracks))} if part.tracks else {}
    frames[PARTS] = typed(part.columns, campaign)
    place.write({part_name(number, kind): _parquet(frame, units, told) for kind, frame in frames.items()})
    return frames[PARTS].height


def _parquet(frame: pl.DataFrame, units: Mapping[str, str], told: Mapping[str, str]) -> bytes:
    # in memory first: Polars has an error of its own for a full disk
    held, own = io.BytesIO(), {name: units.get(name, "-") for name in frame.columns}
    frame.write_parquet(held, compression="zstd", compression_level=1, metadata={**told, **about(own)})
    return held.getvalue()

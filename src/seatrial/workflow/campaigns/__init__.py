"""Campaigns: running a file of one into a folder, and what such a folder says."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...campaign import CampaignError
from ...campaign.folder import Held, merge, open_folder, wrong_parts
from ...campaign.running import Executor, Ran, Shard, Watch, run
from .. import RequestError
from ..request import Note, silent
from .reading import read_campaign

__all__ = ["CampaignError", "Status", "campaign", "merged", "read_campaign", "shard_of", "status"]


@dataclass(frozen=True)
class Status:
    """What a folder of a campaign says of itself.

    Attributes:
        held: the folder.
        done: parts that are there.
        faults: what is wrong with them, where they were read.
        digest: of the data set; None before it is complete.
    """

    held: Held
    done: int
    faults: tuple[str, ...] = ()
    digest: str | None = None

    @property
    def document(self) -> dict[str, object]:
        """For JSON."""
        about: Mapping[str, Any] = self.held.document
        return {"folder": str(self.held.folder), "name": about["name"], "parts": self.held.parts, "done": self.done,
                "rows": about["rows"], "digest": self.digest, "faults": list(self.faults)}  # fmt: skip


def shard_of(text: str | None) -> Shard:
    """The shard that is asked for; that of a Slurm array task where none is."""
    if text is not None:
        return Shard.read(text)
    task, count = os.environ.get("SLURM_ARRAY_TASK_ID"), os.environ.get("SLURM_ARRAY_TASK_COUNT")
    if task is None or count is None:
        return Shard()
    first = int(os.environ.get("SLURM_ARRAY_TASK_MIN", "0"))
    return Shard.read(f"{int(task) - first + 1}/{count}")


def campaign(
    path: Path, out: Path, *, shard: str | None = None, threads: int | None = None, executor: Executor | None = None,
    width: int | None = None, watch: Watch | None = None, note: Note = silent,
) -> Ran:  # fmt: skip
    """Run a campaign file into a folder; what is there is kept, the rest is computed.

    Raises:
        RequestError: a campaign that cannot be carried out, a folder of another one, or one too large for the disk.
        OSError: a part cannot be written; the others stay.
    """
    if threads is not None and threads < 1:
        raise RequestError(f"--threads is {threads}; give 1 or more")
    part = shard_of(shard)
    return run(read_campaign(path, note), out, source=path.read_text(encoding="utf-8"), shard=part, threads=threads,
               executor=executor, width=width, watch=watch)  # fmt: skip


def status(folder: Path, *, verify: bool = False) -> Status:
    """How far a campaign is; with `verify` every part is read and compared with the manifest."""
    held = open_folder(folder)
    missing = len(held.missing)
    faults = tuple(wrong_parts(held)) if verify else ()
    return Status(held, held.parts - missing, faults, held.digest() if not missing and not faults else None)


def merged(folder: Path, out: Path | None = None) -> Path:
    """The whole table as one Parquet file, `campaign.parquet` in the folder unless named.

    Raises:
        CampaignError: parts are missing.
    """
    return merge(open_folder(folder), out or folder / "campaign.parquet")

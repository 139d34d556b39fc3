"""Campaigns: running a file of one into a folder, and what such a folder says."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...campaign import Campaign, CampaignError
from ...campaign.chunk import replay
from ...campaign.folder import Held, Manifest, open_folder
from ...campaign.rare import replay as replay_rare
from ...campaign.rare.levels import SEARCH, Search, read_search
from ...campaign.running import Ran, Shard, Watch, run
from ...campaign.tables import merge, wrong_parts
from ...core import executors
from ...core.files import toml_of
from ...core.values import dataclass, replace
from ...data import Trial
from ...data.trialfile import write_trial
from ...engine.cuda.named import device_of
from ...manoeuvres import Index, Manoeuvre
from .. import RequestError
from ..request import Note, check_output, silent
from .reading import campaign_of, read_campaign

__all__ = ["CampaignError", "Status", "campaign", "merged", "read_campaign", "replayed", "shard_of", "status"]


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
        about = self.held.manifest
        return {"folder": self.held.folder, "name": about.name, "parts": self.held.parts, "done": self.done,
                "rows": about.rows, "tracks": about.tracks, "digest": self.digest,
                "faults": list(self.faults)}  # fmt: skip


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
    path: Path, out: str | Path, *, shard: str | None = None, threads: int | None = None, dask: str | None = None,
    device: str | None = None, watch: Watch | None = None, note: Note = silent,
) -> Ran:  # fmt: skip
    """Run a campaign file into a folder; what is there is kept, the rest is computed.

    Args:
        out: folder, or URL of an object store such as ``s3://BUCKET/NAME``.
        shard: ``K/N``; None takes that of a Slurm array task, if this is one.
        threads: of this process; None takes one a processor.
        dask: address of a Dask scheduler, or ``local:N``, in place of threads.
        device: "cpu" or "cuda" in place of what the file says; another one is another data set.
        watch: told of the progress.

    Raises:
        RequestError: a campaign that cannot be carried out, a folder of another one, or one too large for the disk.
        DeviceError: the device is not here.
        OSError: a part cannot be written; the others stay.
    """
    if threads is not None and threads < 1:
        raise RequestError(f"--threads is {threads}; give 1 or more")
    if threads is not None and dask is not None:
        raise RequestError("--threads and --dask: give one of them")
    part, plan = shard_of(shard), read_campaign(path, note)
    if device is not None:
        for case in plan.cases:
            device_of(device, case.precision)
        plan = on_devices(plan, [device] * len(plan.cases))
    with executors.threads(threads) if dask is None else executors.dask(dask, note) as pool:
        return run(plan, out, pool=pool, source=path, shard=part, watch=watch)


def on_devices(plan: Campaign, devices: Sequence[str]) -> Campaign:
    """The campaign with each case on a device of its own."""
    return replace(plan, cases=tuple(replace(c, device=d) for c, d in zip(plan.cases, devices, strict=True)))


def status(where: str | Path, *, verify: bool = False) -> Status:
    """How far a campaign is; with `verify` every part is read and compared with the manifest."""
    held = open_folder(where)
    missing = len(held.missing)
    faults = tuple(wrong_parts(held)) if verify else ()
    return Status(held, held.parts - missing, faults, held.digest() if not missing and not faults else None)


def merged(where: str | Path, out: Path | None = None) -> tuple[Path, ...]:
    """The whole table as one Parquet file, `campaign.parquet` in the folder unless named, and the tracks beside it.

    Raises:
        CampaignError: parts are missing.
        RequestError: a store, without the name of a file here.
    """
    held = open_folder(where)
    return merge(held, beside(held, out, "campaign.parquet"))


def beside(held: Held, out: Path | None, usual: str) -> Path:
    """The file that is asked for, or that of the usual name in the folder; RequestError: a store has no folder."""
    if out is not None:
        return out
    if held.place.path is None:
        raise RequestError(f"{held.folder}: name a file of this machine with -o, such as -o {usual}")
    return held.place.path / usual


@dataclass(frozen=True)
class Replayed:
    """One run of a campaign, run again.

    Attributes:
        ship: name of the case.
        policy: the manoeuvre as it was ordered.
        trial: the run.
        inputs: what differed, SI units and radians.
        indices: of the run.
        complete: whether the run holds all that they need.
    """

    ship: str
    policy: Manoeuvre
    trial: Trial
    inputs: Mapping[str, float]
    indices: Mapping[str, Index]
    complete: bool


def _plan(about: Manifest | Search, folder: str) -> tuple[Campaign, str]:
    """The campaign of a manifest, and the file that it was read from."""
    text, source = about.text, about.source
    if not text or not source:
        raise RequestError(f"{folder}: was not begun from a campaign file; its runs cannot be replayed from here")
    return campaign_of(toml_of(text), Path(source)), source


def replayed(where: str | Path, run_number: int, out: Path | None = None) -> Replayed:
    """Run one row of the table of a campaign again, and write its trial to a file where one is named.

    Args:
        where: folder or URL of a campaign, or folder of a search for a rare violation, whose last levels are the rows.

    Raises:
        RequestError: a folder without the text of its campaign, or no run of this number.
    """
    check_output(out, (".csv", ".parquet"), "a trial file")
    if "://" not in str(where) and (Path(where) / SEARCH).exists():
        plan, _ = _plan(read_search(Path(where)), str(where))
        runs, policy, trial = replay_rare(plan, Path(where), run_number)
    else:
        held = open_folder(where)
        plan, source = _plan(held.manifest, held.folder)
        plan = on_devices(plan, held.manifest.devices)
        if plan.digest != held.manifest.digest:
            changed = f"the ships of {source} or the version have changed since"
            raise RequestError(f"{held.folder}: {changed}; nothing is replayed")
        runs, policy, trial = replay(plan, run_number)
    if out is not None:
        write_trial(trial, out)
    inputs = {name: float(column[0]) for name, column in runs.columns.items()}
    return Replayed(runs.case.name, policy, trial, inputs, policy.indices(trial, runs.case.ship.L_pp),
                    policy.complete(trial))  # fmt: skip

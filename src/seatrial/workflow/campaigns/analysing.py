"""What a campaign shows: the report of a folder, and the probability of a rare violation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ... import __version__
from ...campaign import Campaign
from ...campaign.analysis import analyse
from ...campaign.columns import index_units
from ...campaign.folder import MANIFEST, Held, open_folder
from ...campaign.rare import RUNS, Rare, Watch
from ...campaign.rare import rare as search
from ...core.files import plain, toml_of, write_whole
from ...core.values import dataclass
from ...engine.rollout import default_threads
from ...report.campaign import page
from ...report.campaign.rare import page as rare_page
from ...report.page import write
from .. import RequestError
from ..request import Note, check_output, silent
from . import beside
from .reading import campaign_of, read_campaign

REPORT = "report.html"
"""The page in a campaign's folder."""


def report(where: str | Path, out: Path | None = None) -> Path:
    """Write the report of a campaign, `report.html` in its folder unless named, and its numbers beside it.

    Raises:
        RequestError: a path that is no page, or would overwrite the manifest of the campaign.
        CampaignError: a folder without runs.
    """
    check_output(out, (".html",), "a page")
    held = open_folder(where)
    path = beside(held, out, REPORT)
    if held.place.path is not None and path.with_suffix(".json").resolve() == (held.place.path / MANIFEST).resolve():
        raise RequestError(f"{path}: its numbers would overwrite {held.folder}/{MANIFEST}; choose another name with -o")
    about = held.manifest
    origin = {"campaign": str(about.source or "Python"), "folder": str(held.place.everywhere()),
              "seed": str(about.seed), "digest": about.digest, "seatrial": about.version}  # fmt: skip
    return write(path, page(analyse(held), _units(held), origin))


def _units(held: Held) -> dict[str, str]:
    """SI unit of each index; none of a campaign whose ships or file are gone, whose numbers remain SI."""
    text, source = held.manifest.text, held.manifest.source
    if not text or not source:
        return {}
    try:
        plan = campaign_of(toml_of(text), Path(source))
    except (RequestError, OSError):
        return {}
    return {name: unit for case in plan.cases for name, unit in index_units(case, plan.weather).items()}


@dataclass(frozen=True)
class Found:
    """What a search for a rare violation gave.

    Attributes:
        campaign: as read.
        criterion: name.
        cases: estimate of each.
    """

    campaign: Campaign
    criterion: str
    cases: tuple[Rare, ...]

    @property
    def document(self) -> dict[str, Any]:
        """For JSON, SI units and radians."""
        return {"schema": "seatrial-campaign-rare-result/1", "name": self.campaign.name, "criterion": self.criterion,
                "bound": vars(self.campaign.criteria[self.criterion]), "version": __version__,
                "cases": [_document(one) for one in self.cases]}  # fmt: skip


def _document(one: Rare) -> dict[str, Any]:
    low, high = one.estimate.interval
    levels = [{"margin": level.bound, "share": level.share, "accepted": level.accepted} for level in one.levels]
    return {"case": one.case, "probability": one.estimate.probability, "variation": one.estimate.variation,
            "interval": [low, high], "reached": one.reached, "runs": one.runs, "unknown": one.unknown,
            "levels": levels, "nearest": one.nearest, "distance": one.distance,
            "run": one.run}  # fmt: skip


def rare(
    path: Path, criterion: str, out: Path, *, runs: int | None = None, threads: int | None = None,
    watch: Watch | None = None, note: Note = silent,
) -> Found:  # fmt: skip
    """Search for violations of a criterion; the folder gets `rare.json`, a page and the levels.

    Raises:
        RequestError: a campaign or a search that cannot be carried out.
        CampaignError: no such criterion, or a folder of something else.
    """
    if threads is not None and threads < 1:
        raise RequestError(f"--threads is {threads}; give 1 or more")
    plan = read_campaign(path, note)
    cases = search(plan, criterion, out, runs=RUNS if runs is None else runs, threads=threads or default_threads(),
                   watch=watch, source=path)  # fmt: skip
    found, bound = Found(plan, criterion, cases), plan.criteria[criterion]
    write_whole(out / "rare.json", json.dumps(plain(found.document), indent=1) + "\n")
    unit = next((units[bound.index] for case in plan.cases
                 if bound.index in (units := index_units(case, plan.weather))), "-")  # fmt: skip
    origin = {"campaign": str(path), "folder": str(out.resolve()), "seed": str(plan.seed), "digest": plan.digest,
              "seatrial": __version__}  # fmt: skip
    write(out / REPORT, rare_page(plan.name, criterion, bound, cases, unit, str(out), origin))
    return found

"""Commands on a folder of recordings: what is in it, and a first study of it."""

from __future__ import annotations

from pathlib import Path

from ..workflow.asked import Foreign
from . import options as o
from .fits import Terminal, end, show

_STUDY = Path("study.toml")


def trials(
    folder: o.Folder, out: o.SurveyPage = None, remedy: o.Separated = None, *, logs: Foreign, json: bool = False
) -> None:
    """Show what is in a folder of trials: kinds, ranges, tracks."""
    from ..workflow.folders.survey import trials as run

    end(run(folder, logs, out=out, remedy=remedy, sink=Terminal()), json)


def study(
    action: o.StudyAction, ship: o.ShipName, folder: o.Folder, out: o.NewStudy = _STUDY, *,
    logs: Foreign, json: bool = False,
) -> None:  # fmt: skip
    """Write a study of a ship and a folder, with trials held out."""
    from ..workflow.folders.drafting import new_study

    show(new_study(action, ship, folder, out, logs, sink=Terminal()), json)

"""Commands on a folder of recordings: a page for it, what is in it, and a first study of it."""

from __future__ import annotations

from pathlib import Path

from ..workflow.asked import Foreign, Port
from . import options as o
from .fits import Terminal, end, show

DESK_PORT = 8030
"""Where `open` listens if the user names no port."""
_STUDY = Path("study.toml")


def open_(folder: o.DeskFolder = Path("."), page: Port = Port()) -> None:
    """Serve a page that takes a folder of logs to a model by mouse."""
    from ..core.errors import RequestError
    from .render import note

    if not folder.is_dir():
        raise RequestError(f"{folder}: is no folder; make it first, or name another")
    try:
        from ..desk.app import new_key, serve
    except ModuleNotFoundError as error:
        raise RequestError(f"a page needs {error.name}; pip install 'seatrial[web]'") from None
    from ..core.listening import HERE, address, listen

    key = new_key()
    with listen(HERE, DESK_PORT if page.port is None else page.port, anywhere=False) as listening:
        note(f"open {address(listening)}?key={key} in a browser; Ctrl-C ends it")
        serve(folder.resolve(), listening, key)


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

"""The pages that are made from the code, written below docs/reference/made before Sphinx reads its sources."""

from __future__ import annotations

import re
import runpy
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import api
import commands
import parts
import ships

MADE = "reference/made"
HIDDEN = ":hidden:\n:maxdepth: 1\n"


def generate(source: Path) -> None:
    """Write all generated pages anew."""
    out = source / MADE
    shutil.rmtree(out, ignore_errors=True)
    for room in parts.ROOMS:
        folder = _folder(out, room.name)
        _index(folder, room.title, room.about, parts.write(room, folder))
    folder = _folder(out, "commands")
    _index(folder, "Commands", "Every command of `seatrial`, as `--help` tells it.", commands.write(folder))
    folder = _folder(out, "ships")
    names = ships.write(folder)
    _index(folder, "Ships", "Every ship of the library: particulars, sources, validity, manoeuvres.", names)
    _gallery(out, folder, names)
    folder = _folder(out, "api")
    _index(folder, "Python", "The names of `seatrial`, and the door of each room.", api.write(folder))


def _folder(out: Path, name: str) -> Path:
    folder = out / name
    folder.mkdir(parents=True)
    return folder


def _index(folder: Path, title: str, about: str, names: Sequence[str]) -> None:
    listed = "".join(f"{name}\n" for name in names)
    text = f"# {title}\n\n{about}\n\n```{{toctree}}\n:maxdepth: 1\n\n{listed}```\n"
    (folder / "index.md").write_text(text, encoding="utf-8")


def _gallery(out: Path, folder: Path, names: Sequence[str]) -> None:
    """One picture of each ship that turns, with the command of its figures, each a link to its page."""
    cards = "".join(
        f":::{{grid-item-card}} {name}\n:link: ships/{name}\n:link-type: doc\n:img-top: ships/{name}-turning.svg\n"
        f"{_command((folder / f'{name}.md').read_text(encoding='utf-8'))}\n:::\n"
        for name in names if (folder / f"{name}-turning.svg").exists()
    )  # fmt: skip
    text = ("# Gallery\n\nFor whoever looks for a ship: turning circles of the library, each with its command.\n\n"
            f"::::{{grid}} 1 2 3 3\n\n{cards}\n::::\n")  # fmt: skip
    (out / "gallery.md").write_text(text, encoding="utf-8")


def _command(page: str) -> str:
    """The first command of a page, as code."""
    found = re.search(r"`seatrial simulate [^`]+`", page)
    return found[0] if found else ""


def _of_the_code(app: Any, name: str, source: list[str]) -> None:
    """The page of types is that of the code, whatever the file lacks."""
    if name == "types":
        source[0] = runpy.run_path(str(Path(app.srcdir) / "make_types.py"))["page"]()


def setup(app: Any) -> dict[str, Any]:
    """Write the pages when a build begins."""
    app.connect("builder-inited", lambda app: generate(Path(app.srcdir)))
    app.connect("source-read", _of_the_code)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""Exported files: written whole or not at all, their titles, and the templates of their source."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from string import Template

from ..core.files import write_together
from ..ships import Ship, ShipError


def write(files: Mapping[Path, str | bytes | Callable[[str], None]]) -> tuple[Path, ...]:
    """Write files of one folder together: all are complete before the first takes its place.

    Args:
        files: by path the text or bytes, or what saves itself under a name that it is given.

    Raises:
        ShipError: a folder that is not there, or a file that cannot be written.
    """
    for path in files:
        if not path.parent.is_dir():
            raise ShipError(f"{path}: no such folder: {path.parent}")
        if path.is_dir():
            raise ShipError(f"{path}: is a folder; name a file")
    try:
        return write_together(files)
    except OSError as error:
        raise ShipError(f"{error.filename}: cannot be written: {error.strerror}") from error


def title(ship: Ship) -> str:
    """Title of an exported file; a fitted ship no longer has the title of its start."""
    made = ship.notes.get("provenance")
    if isinstance(made, Mapping) and "study" in made:
        return f"{ship.name}: fitted in study {made['study']}"
    return str(ship.notes.get("title", ship.name))


def filled(file: str, part: str, **values: object) -> str:
    """A part of a template in `templates`, its ``$names`` replaced; a line ``@@ part`` begins each part."""
    return Template(_parts(file)[part]).substitute(values)


@cache
def _parts(file: str) -> Mapping[str, str]:
    text = (Path(__file__).with_name("templates") / file).read_text(encoding="utf-8")
    found = re.split(r"^@@ (\w+)\n", text, flags=re.MULTILINE)
    return dict(zip(found[1::2], (part.removesuffix("\n") for part in found[2::2]), strict=True))

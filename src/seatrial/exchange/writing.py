"""Files that are there whole or not at all, and what they are headed with."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

from ..ships import Ship, ShipError


def write(files: Mapping[Path, str | bytes | Callable[[str], None]]) -> tuple[Path, ...]:
    """Write files of one folder together: all are complete before the first takes its place.

    Args:
        files: by path the text or bytes, or what saves itself under a name that it is given.

    Raises:
        ShipError: a folder that is not there, or a file that cannot be written.
    """
    scratch: dict[Path, Path] = {}
    try:
        for path, content in files.items():
            scratch[path] = _scratch(path)
            if callable(content):
                content(str(scratch[path]))
            else:
                scratch[path].write_bytes(content.encode() if isinstance(content, str) else content)
            os.chmod(scratch[path], 0o644)
        for path, made in scratch.items():
            os.replace(made, path)
    except OSError as error:
        raise ShipError(f"{error.filename or next(iter(files))}: cannot be written: {error.strerror}") from None
    finally:
        for made in scratch.values():
            made.unlink(missing_ok=True)
    return tuple(files)


def title(ship: Ship) -> str:
    """What heads an exported file: a ship that a study fitted is no longer what its title said before."""
    made = ship.notes.get("provenance")
    if isinstance(made, Mapping) and "study" in made:
        return f"{ship.name}: fitted in study {made['study']}"
    return str(ship.notes.get("title", ship.name))


def _scratch(path: Path) -> Path:
    if not path.parent.is_dir():
        raise ShipError(f"{path}: no such folder: {path.parent}")
    if path.is_dir():
        raise ShipError(f"{path}: is a folder; name a file")
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    except OSError as error:
        raise ShipError(f"{path}: cannot be written: {error.strerror}") from None
    os.close(handle)
    return Path(name)

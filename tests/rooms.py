"""Modules that somebody adds to a room of the package, put there for the time of a test."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest


class Rooms:
    """Rooms of the package with further modules in them."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self._folder, self._monkeypatch = folder, monkeypatch
        self._made: list[tuple[Any, str, str]] = []

    def put(self, file: str, text: str) -> Any:
        """The module of a file such as "forces/skeg.py" with this text."""
        room, name = file.rpartition("/")[0], Path(file).stem
        package = importlib.import_module(f"seatrial.{room.replace('/', '.')}" if room else "seatrial")
        folder = self._folder / "rooms" / room
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
        self._monkeypatch.setattr(package, "__path__", [*package.__path__, str(folder)])
        importlib.invalidate_caches()
        self._made.append((package, name, f"{package.__name__}.{name}"))
        return importlib.import_module(f"{package.__name__}.{name}")

    def clear(self) -> None:
        """Forget the modules."""
        for package, name, full in self._made:
            sys.modules.pop(full, None)
            if hasattr(package, name):
                delattr(package, name)


@contextmanager
def rooms(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Rooms]:
    """Rooms that are as before at the end."""
    made = Rooms(folder, monkeypatch)
    try:
        yield made
    finally:
        made.clear()

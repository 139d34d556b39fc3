"""Classes that a file may name: those of the package's own rooms, and of modules that the user trusts.

A file is data.  To import a module runs its code, so a name in a file is imported only where it lies in a room of
the package, or where the caller allows this module to run: ``load(path, trust=...)``,
``read_study(path, trust=...)``, ``--trust MODULE``.
"""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
from collections.abc import Generator, Iterable
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any

from ..core.errors import first_line
from ..core.parameters import Parts, unknown
from . import ShipError

Trust = bool | Iterable[str]
"""False: the package's own classes only. Names of modules: these too, and modules below them. True: any module."""

ROOMS = ("forces", "models", "identify", "manoeuvres")
"""Rooms whose classes a file may name."""

_NAME = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*")
_TRUSTED: ContextVar[bool | frozenset[str]] = ContextVar("trusted", default=False)


@contextmanager
def trusting(trust: Trust) -> Generator[None, None, None]:
    """Let files that are read inside name these modules, besides those trusted around it."""
    held = _TRUSTED.get()
    asked = trust if isinstance(trust, bool) else frozenset([trust] if isinstance(trust, str) else trust)
    if isinstance(asked, frozenset) and isinstance(held, frozenset):
        asked |= held
    token = _TRUSTED.set(held if held is True or asked is False else asked)
    try:
        yield
    finally:
        _TRUSTED.reset(token)


def find_class(name: object, room: str, where: str) -> type:
    """The dataclass ``module:Class`` of a room of the package, or of a module that is trusted, by its full name.

    Raises:
        ShipError: no such class, or one of a module that is not allowed to run.
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise ShipError(f"{where}: a type is written 'module:Class'; got {name!r}")
    module, _, cls = name.partition(":")
    inside = _modules(room)
    if module not in inside:  # it may have come since
        _listed.cache_clear()
        inside = _modules(room)
    full = inside.get(module, module)
    if full.partition(".")[0] == "seatrial":
        if not any(full in _modules(r).values() for r in ROOMS):
            raise ShipError(f"{where}: {unknown(module, inside, 'module')}")
    elif not trusted(module):
        raise ShipError(
            f"{where}: {unknown(module, inside, 'module')}; one from elsewhere runs its code when it is read: "
            f"allow that by --trust {module} (in Python trust=True)"
        )
    try:
        found = importlib.import_module(full)
    except Exception as error:  # whatever code that was trusted raises
        where_from = "; is its folder in PYTHONPATH?" if getattr(error, "name", "") == full else ""
        raise ShipError(f"{where}: module {full} cannot be imported: {first_line(error)}{where_from}") from None
    classes = {n: c for n, c in vars(found).items() if inspect.isclass(c) and is_dataclass(c)}
    if cls not in classes:
        raise ShipError(f"{where}: {unknown(cls, classes or ['none'], f'class in {module}')}")
    return classes[cls]


def foreign(thing: Any) -> frozenset[str]:
    """Modules outside the package that hold the class of a model or of a part of it; such code runs already."""
    parts = list(thing.items()) if isinstance(thing, Parts) else []
    if is_dataclass(thing):
        parts += [(f.name, getattr(thing, f.name)) for f in fields(thing)]
    own = {type(thing).__module__} if is_dataclass(thing) else set[str]()
    return frozenset({m for m in own if m.partition(".")[0] != "seatrial"}.union(*(foreign(p) for _, p in parts)))


def _modules(room: str) -> dict[str, str]:
    """Full names of the modules of a room by their own names, at whatever depth; packages are no modules."""
    return _listed(room, tuple(importlib.import_module(f"seatrial.{room}").__path__))


@cache
def _listed(room: str, folders: tuple[str, ...]) -> dict[str, str]:
    found: dict[str, str] = {}
    for full in (m.name for m in pkgutil.walk_packages(folders, f"seatrial.{room}.") if not m.ispkg):
        if (other := found.setdefault(full.rpartition(".")[2], full)) != full:
            raise ShipError(f"{full} and {other} have one name, so that no file can say which it means; rename one")
    return found


def trusted(module: str) -> bool:
    """Whether the caller allows code of this name to run."""
    held = _TRUSTED.get()
    return held if isinstance(held, bool) else any(module == one or module.startswith(f"{one}.") for one in held)

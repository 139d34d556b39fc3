"""Reference pages of forces, families and manoeuvres: what each is, its numbers, its equations and their lines."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import seatrial as st
from equations import equations, literal, written

SOURCE = Path(importlib.import_module("seatrial").__file__ or "").parents[1]


@dataclass(frozen=True)
class Room:
    """A catalogue with a page for each module.

    Attributes:
        only: methods whose equations are shown; empty for all.
    """

    name: str
    title: str
    about: str
    package: ModuleType
    only: tuple[str, ...] = ()


ROOMS = (
    Room("forces", "Forces", "Each module of `seatrial.forces`: a force on the ship, its numbers and its equations.",
         st.forces),
    Room("families", "Model families", "Each module of `seatrial.models`: how a family computes its rates.", st.models),
    Room("manoeuvres", "Manoeuvres", "Each module of `seatrial.manoeuvres`: what it orders, and its indices.",
         st.manoeuvres, ("command", "begin")),
)  # fmt: skip


def write(room: Room, out: Path) -> list[str]:
    """Write the pages of a room; their names in order."""
    names: list[str] = []
    for found in pkgutil.iter_modules(room.package.__path__, f"{room.package.__name__}."):
        module = importlib.import_module(found.name)
        name = found.name.rpartition(".")[2]
        text = page(module, room.only)
        if text:
            (out / f"{name}.md").write_text(text, encoding="utf-8")
            names.append(name)
    return names


def page(module: ModuleType, only: Sequence[str] = ()) -> str:
    """The page of a module; empty where it holds no class and no equation."""
    own = list(_classes(module))
    found = equations(module, only)
    if not own and not found:
        return ""
    path = Path(inspect.getfile(module)).relative_to(SOURCE).as_posix()
    name = module.__name__.rpartition(".")[2]
    first, _, rest = (inspect.getdoc(module) or "").partition("\n\n")
    parts = [f"# `{name}`\n\n{literal(first)}\n\n{literal(rest)}\n\nSource: `src/{path}`\n"]
    parts += [_about(cls) for cls in own]
    if found:
        parts.append("\n## Equations\n\nTypeset from the source, each with the line that computes it.\n")
        parts.append(written(found, f"src/{path}"))
    return "".join(parts)


def _classes(module: ModuleType) -> Iterator[type]:
    for cls in vars(module).values():
        if inspect.isclass(cls) and is_dataclass(cls) and cls.__module__ == module.__name__ and cls.__name__[0] != "_":
            yield cls


def _about(cls: type) -> str:
    rows = "".join(_row(one.name, one.metadata["spec"]) for one in fields(cls) if "spec" in one.metadata)
    table = f"\n| number | meaning | unit | limits |\n|---|---|---|---|\n{rows}" if rows else ""
    return f"\n## {cls.__name__}\n\n{literal((inspect.getdoc(cls) or '').partition('Attributes:')[0].strip())}\n{table}"


def _row(name: str, spec: Any) -> str:
    span = f"{spec.low:g} to {spec.high:g}".replace("-inf to inf", "any").replace("inf", "no limit")
    return f"| `{name}` | {literal(spec.about).replace('|', '&#124;')} | {spec.unit or '–'} | {span} |\n"

"""Reference pages of the Python interface: the public names, and the door of each room."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from pathlib import Path
from typing import get_origin

import seatrial
from equations import literal

_HIDDEN = {"cli", "bench"}


def write(out: Path) -> list[str]:
    """Write a page of the names of `seatrial`, and one for each room; their names."""
    offered = {one: getattr(seatrial, one) for one in dir(seatrial) if not one.startswith("_")}
    # an alias of types has the docstring of another package
    names = [one for one, found in offered.items() if callable(found) and get_origin(found) is None]
    body = "".join(f"\n```{{eval-rst}}\n{_public(one)}```\n" for one in names)
    (out / "seatrial.md").write_text(f"# The names of `seatrial`\n\n`import seatrial as st`.\n{body}", encoding="utf-8")
    rooms = list(_rooms())
    for room in rooms:
        (out / f"{room}.md").write_text(_door(room), encoding="utf-8")
    return ["seatrial", *rooms]


def _public(name: str) -> str:
    """The directive of a public name; one that a room offers as well is indexed there."""
    found = getattr(seatrial, name)
    kind = ".. autoclass:: seatrial.{}\n   :members:\n" if inspect.isclass(found) else ".. autofunction:: seatrial.{}\n"
    return kind.format(name) + ("" if found.__module__.startswith("seatrial.face") else "   :no-index:\n")


def _rooms() -> Iterator[str]:
    found = sorted(one.name for one in pkgutil.iter_modules(seatrial.__path__) if one.ispkg)
    return (name for name in found if name not in _HIDDEN and _offered(name))


def _offered(name: str) -> list[tuple[str, str]]:
    """Classes and functions that the door of a room offers, with the directive of each."""
    room = importlib.import_module(f"seatrial.{name}")
    own = {key: one for key, one in vars(room).items() if not key.startswith("_")
           and getattr(one, "__module__", "").startswith(f"seatrial.{name}")}  # fmt: skip
    return [(key, "autoclass" if inspect.isclass(one) else "autofunction") for key, one in own.items()
            if inspect.isclass(one) or inspect.isfunction(one)]  # fmt: skip


def _door(name: str) -> str:
    room = importlib.import_module(f"seatrial.{name}")
    members = "".join(
        f"\n```{{eval-rst}}\n.. {directive}:: seatrial.{name}.{key}\n"
        + ("   :members:\n" if directive == "autoclass" else "") + "```\n"
        for key, directive in _offered(name)
    )  # fmt: skip
    return f"# `seatrial.{name}`\n\n{literal((room.__doc__ or '').strip())}\n{members}"

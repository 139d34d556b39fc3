"""One ship of each make: what a unit test that holds for every ship runs on; the others are in the long tier."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import Any

import pytest

from seatrial.models import Stepped
from seatrial.ships.files import library, load


def make(thing: Any) -> tuple[Any, ...]:
    """The classes and choices that a model is built from: what decides its kernel."""
    values = [getattr(thing, f.name) for f in fields(thing)]
    parts = [part for value in values for part in (value if isinstance(value, tuple) else (value,))]
    own = tuple(p for p in parts if isinstance(p, str))
    return (type(thing), own, *(make(p) for p in parts if is_dataclass(p)))


LIBRARY = library()
TRACED = tuple(name for name in LIBRARY if not isinstance(load(name).model, Stepped))
"""Ships whose equations are traced; a network steps by itself."""
UNIT = frozenset({make(load(name).model): name for name in reversed(LIBRARY)}.values())


def ships(names: Iterable[str] = LIBRARY) -> list[Any]:
    """Cases of a test: one ship of each make in every run; its sisters, whose kernels differ in numbers only, long."""
    return [pytest.param(name, marks=() if name in UNIT else pytest.mark.long) for name in names]

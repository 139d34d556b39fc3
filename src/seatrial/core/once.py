"""Work that is asked for again with the same objects."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from functools import wraps
from typing import Any, ParamSpec, TypeVar

_Asked = ParamSpec("_Asked")
_Found = TypeVar("_Found")

_PLAIN = (float, int, str, type(None))
"""What is told from others by its value."""


def by_identity(work: Callable[_Asked, _Found]) -> Callable[_Asked, _Found]:
    """`work` on objects that never change, such as trials and their channels: done once for these while all live.

    Numbers and texts among its arguments are told apart by value.  What it returns is shared by all who ask.
    """
    known: dict[tuple[Any, ...], tuple[tuple[weakref.ref[Any], ...], _Found]] = {}

    @wraps(work)
    def done(*some: _Asked.args, **named: _Asked.kwargs) -> _Found:
        asked = (*some, *named.values()) if named else some
        key = (*((one,) if isinstance(one, _PLAIN) else id(one) for one in asked), *named)
        objects = [one for one in asked if not isinstance(one, _PLAIN)]
        found = known.get(key)
        if found is None or any(kept() is not one for kept, one in zip(found[0], objects, strict=True)):
            refs = tuple(weakref.ref(one, lambda _: known.pop(key, None)) for one in objects)
            known[key] = found = refs, work(*some, **named)
        return found[1]

    return done

"""Which tests are of which tier: modules that are slow or long as a whole, families with some quick cases."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import pytest

MARKS = re.compile(r"^pytestmark = (?:.+\n?)+", re.M)
"""The marks that a module gives to all of its tests."""


def left_out(module: str, expression: str) -> bool:
    """Whether `-m expression` leaves out every test of a module with this text: by a term `not slow` or `not long`."""
    terms = [term.strip() for term in expression.split(" and ")]
    out = [term.removeprefix("not ") for term in terms if term in ("not slow", "not long")]
    marks = MARKS.search(module) if out else None
    return marks is not None and any(re.search(rf"\bmark\.{tier}\b", marks[0]) for tier in out)


def slow_but(cases: Iterable[Any], *quick: Any) -> list[Any]:
    """The cases of a family as `parametrize` takes them, each slow but those that are named.

    Raises:
        ValueError: if one that is named is none of the cases, so that the unit tier would lose it unseen.
    """
    given = [case if hasattr(case, "marks") else pytest.param(*_values(case)) for case in cases]
    keep = [_values(one) for one in quick]
    if any(one not in [case.values for case in given] for one in keep):
        raise ValueError(f"not all of {quick} are cases")
    return [
        case if case.values in keep else pytest.param(*case.values, marks=[*case.marks, pytest.mark.slow], id=case.id)
        for case in given
    ]


def _values(case: Any) -> tuple[Any, ...]:
    return tuple(case) if isinstance(case, list | tuple) else (case,)

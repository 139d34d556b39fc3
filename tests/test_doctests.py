"""Examples in docstrings are run; each is what its function is for, in a line or two."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

import seatrial

ROOT = Path(seatrial.__file__).parent
MODULES = sorted(
    ".".join(("seatrial", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")
    for path in ROOT.rglob("*.py") if "\n    >>> " in path.read_text(encoding="utf-8")
)  # fmt: skip


def test_where_users_begin_there_are_examples() -> None:
    assert {"seatrial.face.ships", "seatrial.core.parameters", "seatrial.data"} <= {*MODULES}


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_give_what_they_say(name: str) -> None:
    failed, tried = doctest.testmod(importlib.import_module(name), optionflags=doctest.NORMALIZE_WHITESPACE)
    assert tried > 0
    assert failed == 0

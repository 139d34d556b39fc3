"""Columns of a log as values, for tests of what a guess reads off them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from seatrial.data.guess.cells import Column
from seatrial.data.guess.layout import Layout, Table
from seatrial.data.guess.roles import Signal

TABLE = Table(Path("a.csv"), Layout(), (), (), ())


def column(values: Any, head: str = "A", **more: Any) -> Column:
    numbers = np.asarray(values, dtype=np.float64)
    given: dict[str, Any] = {"unit": "", "where": "", "kind": "number", "letters": {}, "missing": (), "means": (),
                             "cells": tuple(map(str, numbers.tolist()))}  # fmt: skip
    return Column(table=TABLE, head=head, name=head, values=numbers, **{**given, **more})


def signal(role: str, values: Any, head: str = "A", **more: Any) -> Signal:
    found = column(values, head, **more)
    return Signal(role, found, found.values)

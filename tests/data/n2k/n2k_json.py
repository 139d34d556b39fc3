"""Messages of NMEA 2000 as JSON, of a ship that weaves."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np

T = np.round(0.2 * np.arange(300), 3)
PSI = 5.9 + 0.01 * T
DELTA = 0.2 * np.sin(0.1 * T)
AT = "2026-04-03T09:{:02d}:{:06.3f}Z"


def message(t: float, pgn: int, source: int, **fields: Any) -> str:
    named = {name.replace("_", " "): value for name, value in fields.items()}
    when = AT.format(30 + int(t // 60), t % 60)
    return json.dumps({"timestamp": when, "prio": 2, "src": source, "dst": 255, "pgn": pgn, "description": "x",
                       "fields": named}, separators=(",", ":"))  # fmt: skip


def sailed(degrees: bool, camel: bool = False) -> list[str]:
    """Heading, rate, rudder, place and course of a ship, each by its own device."""
    size, digits = (math.degrees(1.0), 3) if degrees else (1.0, 5)
    lines: list[str] = []
    for t, psi, delta in zip(T.tolist(), PSI.tolist(), DELTA.tolist(), strict=True):
        angle = [round(size * one, digits) for one in (psi % math.tau, 0.01, delta, (psi + 0.05) % math.tau)]
        lines += [
            message(t, 127250, 35, Heading=angle[0], Reference="True"),
            message(t, 127251, 35, **{"rate" if camel else "Rate": round(size * 0.01, 7)}),
            message(t, 127245, 12, Instance=0, Position=angle[2]),
            message(t, 129025, 7, Latitude=round(59.0 + 1e-5 * t, 7), Longitude=round(10.0 - 1e-5 * t, 7)),
            message(t, 129026, 7, COG=angle[3], SOG=5.14, **{"cogReference" if camel else "COG Reference": "True"}),
        ]  # fmt: skip
    return lines

"""The Esso Osaka logs, by kind; read through SEATRIAL_DATA, never copied."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

from seatrial.data import Trial
from seatrial.data.formats.frt_esso import read
from seatrial.data.prepare import drop_trailing_gaps

ROOT = Path(os.environ.get("SEATRIAL_DATA", Path(__file__).parents[2] / "shared" / "data")) / "esso_osaka_frt" / "data"
KINDS = ("random", "turning", "zigzag", "berthing")
COPY = "turn_cut_14-Sep-2020_15_58_08"


@cache
def by_kind() -> dict[str, list[Trial]]:
    """The trials of each kind, in the order of their files."""
    return {
        kind: [drop_trailing_gaps(read(f)) for f in sorted((ROOT / kind).glob("*.csv")) if f.stem != COPY]
        for kind in KINDS
    }

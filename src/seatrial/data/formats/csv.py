"""Any table of numbers as trials, by a mapping file, `seatrial-mapping/1`.

The file says which column is which channel, in which unit, with which sign and offset, and by which clock:

    schema = "seatrial-mapping/1"
    time = { column = "Time", unit = "s" }
    frame = { velocity = "earth" }
    [channels.psi]
    column = "HDG"
    unit = "deg"

Text, workbooks and Parquet are read; docs/data.md has every key.
"""

from __future__ import annotations

from pathlib import Path

from .. import Trial
from ..mapping.checked import read_mapping
from ..mapping.reading import only
from ..mapping.reading import read as read_all
from ..mapping.recordings import recordings
from ..mapping.schema import Mapping

__all__ = ["name", "needs_mapping", "read", "read_all", "read_mapping", "recordings", "suffixes"]

name = "csv"
suffixes = (".csv", ".dat")
needs_mapping = True


def read(source: Path, mapping: Mapping) -> Trial:
    """Read the only trial of one recording by a mapping."""
    return only(read_all(source, mapping), source)

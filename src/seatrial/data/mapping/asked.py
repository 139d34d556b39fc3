"""Questions in a mapping file: a value "?" that nothing in the log answers, written by the guess."""

from __future__ import annotations

import re
from pathlib import Path

from .. import DataError

ASK = "?"
"""Value of a key that nothing in the log decides; whoever reads the mapping refuses it until a person has answered."""

_ASKED = re.compile(r"""(\w+)\s*=\s*["']\?["']""")


def refuse_open(path: Path) -> None:
    """Refuse a mapping file that still asks.

    Raises:
        DataError: naming the line and its key.
    """
    table = ""
    text = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
    for number, line in enumerate(text.splitlines(), 1):
        plain = line.partition("#")[0].strip()
        table = plain.strip("[]") if plain.startswith("[") else table
        found = _ASKED.search(plain)
        if found is not None:
            outer = table or (plain.partition("=")[0].strip() if "{" in plain else "")
            place = ".".join(part for part in (outer, found[1]) if part)
            raise DataError(f'{path}: line {number}: {place} is "{ASK}"; write the answer to the doubt above it')

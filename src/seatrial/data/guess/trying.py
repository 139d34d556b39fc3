"""A guess put to the test: its logs are imported in memory and checked, and what that shows becomes a doubt."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from .. import DataError
from ..check import check_folder
from ..formats import logs
from .answers import DOUBT
from .guessing import Guess


def tried(found: Guess, src: Path) -> Guess:
    """The guess with a doubt for a refusal of the import, or for each error that `check` finds in its trials.

    A guess that still asks, or that has no mapping, is left as it is.  Warnings of the check are counted in a note.

    Args:
        found: the guess.
        src: the log or folder that it is of.
    """
    if not found.text or found.asks:
        return found
    with TemporaryDirectory() as folder:
        mapping = Path(folder) / "mapping.toml"
        mapping.write_text(found.text, encoding="utf-8")
        try:
            trials = [trial for _, some in logs("csv", src, mapping) for trial in some]
        except DataError as error:
            return _doubting(found, [f"the import refuses it: {str(error).replace(str(mapping), 'the mapping')}"])
    findings = check_folder(trials)
    errors = [f"seatrial check: {one}" for one in findings if one.severity == "error"]
    warned = sum(one.severity == "warning" for one in findings)
    note = f"its trials have {warned} warning{'s' * (warned != 1)} by seatrial check, see there"
    return _doubting(replace(found, notes=(*found.notes, note)) if warned else found, errors)


def _doubting(found: Guess, doubts: list[str]) -> Guess:
    """The guess with more doubts, at the head of its text."""
    head, gap, rest = found.text.partition("\n\n")
    lines = [f"# {DOUBT} {doubt}" for doubt in doubts]
    return replace(found, text="\n".join([head, *lines]) + gap + rest, doubts=(*doubts, *found.doubts))

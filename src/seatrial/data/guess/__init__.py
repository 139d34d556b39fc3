"""A guess at a mapping: which column is what, its unit, sign, frame and clock, with the evidence and the doubts.

Contract: `guess(src)` looks at a log or a folder and gives a `Guess`: the text of a mapping file for `import csv`, or
the reader that takes the logs as they are.  Names say where the search begins (`words.toml`); what they leave open is
decided by the values, with the three sources of `check.relations`.  In the text, every entry has its evidence above it;
each doubt is a comment that begins with `DOUBT:`, and a value "?" asks what nothing in the log shows, so that the
import refuses the file until a person has answered (`mapping.checked`).
"""

from .answers import ASK, DOUBT
from .guessing import Guess, guess

__all__ = ["ASK", "DOUBT", "Guess", "guess"]

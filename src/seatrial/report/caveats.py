"""Former place of `evidence`: import from there."""

from .evidence import Assumption, assumptions, caveats

__all__ = ["Assumption", "assumptions", "caveats"]

"""Former place of `rivals`: import from there."""

from .rivals import write

__all__ = ["write"]

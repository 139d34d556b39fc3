"""Workflows: what the commands do, as functions that return values and print nothing.

Contract: what the user should read while a workflow runs goes to its argument `note`, one line at a time; a request
that cannot be carried out is a `RequestError`, raised before anything is written.
"""

from __future__ import annotations

__all__ = ["RequestError"]


class RequestError(ValueError):
    """A request that cannot be carried out; the text names what, where and what would be right."""

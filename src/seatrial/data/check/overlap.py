"""Rows that recordings share, among many of them at the cost of reading each once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from .. import Trial

_COMMON = ("x", "y", "psi", "u", "v_m", "r", "delta")
_FEWEST = 10
"""Rows in common that are no chance."""

_Placed = list[tuple[int, Trial]]


def shared(train: Sequence[Trial], test: Sequence[Trial]) -> list[tuple[int, int, int, float]]:
    """Pairs of recordings with at least ten rows in common.

    Returns:
        Place in `train`, place in `test`, how many rows, and which part of the rows of the latter; in this order.
    """
    found: list[tuple[int, int, int, float]] = []
    for (mine, some), (yours, others) in product(_by_channels(train).items(), _by_channels(test).items()):
        if names := [name for name in mine if name in yours]:
            found += _shared(names, some, others)
    return sorted(found)


def _by_channels(trials: Sequence[Trial]) -> dict[tuple[str, ...], _Placed]:
    """Trials with their places in the list, by which of the common channels they have."""
    found: dict[tuple[str, ...], _Placed] = {}
    for k, trial in enumerate(trials):
        found.setdefault(tuple(name for name in _COMMON if name in trial), []).append((k, trial))
    return found


def _shared(names: list[str], some: _Placed, others: _Placed) -> Iterator[tuple[int, int, int, float]]:
    """The rows of all of `some` are sorted once, those of each other one are looked up."""
    own = [_rows(trial, names) for _, trial in some]
    rows, owner = np.concatenate(own), np.repeat(np.arange(len(own)), [len(one) for one in own])
    order = np.argsort(rows, kind="stable")
    rows, owner = rows[order], owner[order]
    for place, other in others:
        wanted = _rows(other, names)
        first, last = np.searchsorted(rows, wanted, "left"), np.searchsorted(rows, wanted, "right")
        held = [owner[a:b] for a, b in zip(first.tolist(), last.tolist(), strict=True) if a < b]
        if not held:
            continue
        counts = np.bincount(np.concatenate(held), minlength=len(some))
        for k in np.flatnonzero(counts >= _FEWEST).tolist():
            yield some[k][0], place, int(counts[k]), float(counts[k] / len(wanted))


def _rows(trial: Trial, names: list[str]) -> NDArray[np.uint64]:
    """A number for each different row, by which equal ones are found; sorted."""
    table = trial.stack(*names)
    table = table[np.isfinite(table).all(axis=1)]
    # nine digits: the same recording written by two programs is still the same
    bits = (np.round(table, 9) + 0.0).view(np.uint64).reshape(table.shape)
    mixed = np.zeros(len(bits), dtype=np.uint64)
    for column in bits.T:  # splitmix64: two rows in 10^19 come out the same by chance
        mixed = (mixed ^ column) + np.uint64(0x9E3779B97F4A7C15)
        mixed = (mixed ^ (mixed >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        mixed = (mixed ^ (mixed >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        mixed ^= mixed >> np.uint64(31)
    return np.unique(mixed)

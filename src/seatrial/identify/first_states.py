"""Which entries of the first state of a trial a fit may move, and what holds those that no reading does.

A position or heading that no compared channel follows from is held at its measurement: nothing else tells it.
Any other entry whose own channel is left out, as the speeds are where only positions are compared, is drawn to its
measurement by the spread of that channel over the trials, so weakly that it only decides where the data say nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..data import Array
from ..models import STATES
from .chains import Chains, Index

# Channels of which one must be compared for the start of a position or of the heading to be told.
_TOLD_BY = {"x": ("x",), "y": ("y",), "psi": ("psi", "x", "y")}


@dataclass(frozen=True)
class FirstStates:
    """The free entries of the first states.

    Attributes:
        free: their indices in the state.
        weight: of the squared offset of each from its measurement; zero where its readings are compared.
        measured: measurement of each in each trial, shape (trials, free).
        lanes: first windows of all trials.
    """

    free: Index
    weight: Array
    measured: Array
    lanes: Index

    @staticmethod
    def of(cut: Chains, span: Array) -> FirstStates:
        """Those that the compared channels tell; `span` is the spread of each channel, shape (states,)."""
        compared = {STATES[k] for k in np.flatnonzero(cut.scale.max(axis=(0, 1)))}
        told = [k for k, name in enumerate(STATES) if compared & {*_TOLD_BY.get(name, STATES)}]
        free = np.array(told, dtype=np.intp)
        weight = np.array([0.0 if STATES[k] in compared else span[k] ** -2.0 for k in told])
        lanes = cut.levels[0]
        return FirstStates(free, weight, cut.nodes[np.ix_(lanes, free)], lanes)

    @staticmethod
    def none(cut: Chains) -> FirstStates:
        """Every first state as measured."""
        return FirstStates(np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros((cut.trials, 0)), cut.levels[0])

    @property
    def count(self) -> int:
        """How many there are in a trial."""
        return self.free.size

    def away(self, nodes: Array) -> Array:
        """Their offsets from the measurement, shape (trials, free)."""
        return nodes[np.ix_(self.lanes, self.free)] - self.measured

    def prior(self, nodes: Array) -> float:
        """Their part of the objective."""
        return float((self.weight * self.away(nodes) ** 2).sum())

"""What a ship does in an encounter: when its action begins, how far it turns and slows, and how fast.

An action is found by the alteration that another ship can detect, and dated back to where it left the old course, so
that yawing in waves is none.  A change of course at a waypoint looks like one too: tracks do not tell orders.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from .geometry import Array, Bools, Motion, taken
from .limits import Limits
from .roles import Encounter

_STILL = 0.1
"""Least speed that a ship turns by [m/s]."""


@dataclass(frozen=True, eq=False)
class Action:
    """What one ship does from the beginning of an encounter to its closest approach; arrays of shape (...).

    Attributes:
        exists: whether it does anything that can be detected.
        row: where that begins.
        starboard, port: greatest alteration to either side of the course at the beginning [rad].
        shown: greatest alteration to one side that is made in one move [rad]: what is turned within the `window` from
            the action's beginning counts by `at_once`, as much as is turned in all.
        slowed: greatest loss of speed, as a share.
        course, speed: change from the course [rad] and share of speed lost, of each row, shape (..., rows).
    """

    exists: Bools
    row: NDArray[np.intp]
    starboard: Array
    port: Array
    shown: Array
    slowed: Array
    course: Array
    speed: Array


def action(ship: Motion, t: Array, met: Encounter, until: NDArray[np.intp], limits: Limits) -> Action:
    """What a ship does between the beginning of an encounter and the row `until`."""
    course = smooth(ship.psi, t, limits.smoothing.of(ship.L))
    course = course - taken(course, met.begins)[..., None]
    U = np.hypot(ship.u, ship.v_m)
    speed = 1.0 - U / np.maximum(taken(U, met.begins), 1e-3)[..., None]
    rows = np.arange(len(t))
    within = (rows >= met.begins[..., None]) & (rows <= until[..., None]) & met.exists[..., None]
    turned = _began(np.abs(course), limits.detectable.value, limits.beginning.value, within, met.begins)
    slowing = _began(speed, limits.slowing.value, 0.25 * limits.slowing.value, within, met.begins)
    row = np.minimum(turned, slowing)
    exists = row < len(t)
    row = np.where(exists, row, len(t) - 1)
    way = limits.window.value * ship.L / np.maximum(taken(U, met.begins), _STILL)[..., None]
    swift = (t >= t[row][..., None]) & (t <= t[row][..., None] + way)
    starboard, port = _most(course, within), _most(-course, within)
    # ships that turn away from each other are apart before the turn is done, which is within the window or not
    moves = [(whole, _most(side * course, swift & exists[..., None]))
             for side, whole in ((1.0, starboard), (-1.0, port))]  # fmt: skip
    shown = [np.minimum(np.maximum(whole, move), move / limits.at_once.value) for whole, move in moves]
    return Action(exists, row, starboard, port, np.maximum(*shown), _most(speed, within), course, speed)


def smooth(psi: Array, t: Array, span: Array) -> Array:
    """Heading without jumps, as its mean over `span` [s], shape (..., 1), around each row; shorter at both ends."""
    whole = np.unwrap(psi)
    step = float(np.median(np.diff(t)))
    half = np.floor(0.5 * span / step + 1e-9).astype(int)
    rows = np.arange(len(t))
    reach = np.minimum(half, np.minimum(rows, len(t) - 1 - rows))
    total = np.concatenate([np.zeros((*whole.shape[:-1], 1)), np.cumsum(whole, axis=-1)], axis=-1)
    low, high = (np.broadcast_to(one, whole.shape) for one in (rows - reach, rows + reach + 1))
    return (np.take_along_axis(total, high, -1) - np.take_along_axis(total, low, -1)) / (2 * reach + 1)


def _began(change: Array, detected: float, began: float, within: Bools, first: NDArray[np.intp]) -> NDArray[np.intp]:
    """The row where the change that reaches `detected` left `began`; the number of rows where it never does."""
    seen = within & (change >= detected)
    at = seen.argmax(axis=-1)
    rows = np.arange(change.shape[-1])
    small = within & (change < began) & (rows <= at[..., None])
    last = np.where(small, rows, -1).max(axis=-1)
    return np.where(seen.any(axis=-1), np.maximum(last, first), change.shape[-1])


def _most(values: Array, within: Bools) -> Array:
    """Greatest of the rows within; 0 where there are none."""
    return np.maximum(np.where(within, values, 0.0).max(axis=-1), 0.0)

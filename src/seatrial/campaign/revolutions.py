"""Revolutions that hold the speed of many ships at once."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..data import Array
from ..environment import CALM
from ..models import Sampled
from ..ships import Ship
from ..simulate.lanes import Kernel
from ..simulate.loop import open_loop, open_loop_parameters
from . import CampaignError

# Halvings of the range of revolutions: down to rounding; and steps of the search for that range, a tenth each.
_HALVINGS = 60
_LOW, _HIGH, _STEPS = 0.1, 2000.0, 104


def balanced(ship: Ship, vary: Mapping[str, Array], speed: Array) -> Array:
    """Revolutions of a steady straight run in calm at `speed` [m/s], rudder midships, per ship [1/s], shape (ships,).

    The highest that hold it, from which more of them push the ship on: a parabola of thrust may rise again where it
    hardly turns.  NaN of a ship that none hold, as one whose propeller has no drag where it stands.

    Args:
        vary: parameters per ship; those of the ship ("ship.<path>") enter.
        speed: shape (ships,).

    Raises:
        CampaignError: a model without a balance of surge.
    """
    if isinstance(ship.model, Sampled) or ship.model.states != ship.model.motion:
        whose = "models without states of their own"
        raise CampaignError(f"{ship.name}: revolutions are balanced for {whose}; give policy.n_P")
    own = tuple(name[5:] for name in vary if name.startswith("ship."))
    kernel, shared = Kernel(open_loop(ship), own), open_loop_parameters(ship)
    lanewise = np.column_stack([vary[f"ship.{name}"] for name in own]) if own else None
    state = np.zeros((len(speed), len(ship.model.states)))
    state[:, 3] = speed
    factors = np.array([factor if order == "n_P" else 0.0 for order, factor in ship.model.follows])

    def surge(n_P: Array) -> Array:
        acting = np.hstack([n_P[:, None] * factors, np.tile(np.array(CALM), (len(n_P), 1))])
        return kernel.rates(state, acting, shared, lanewise)[:, 3]

    low, high = np.full(len(speed), np.nan), _HIGH * speed / ship.L_pp
    pushed = surge(high) >= 0.0
    for over in np.geomspace(_HIGH, _LOW, _STEPS)[1:]:
        tried = over * speed / ship.L_pp
        under, open_ = surge(tried) < 0.0, np.isnan(low)
        low, high = np.where(open_ & under, tried, low), np.where(open_ & ~under, tried, high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        under = surge(middle) < 0.0
        low, high = np.where(under, middle, low), np.where(under, high, middle)
    return np.where(pushed, 0.5 * (low + high), np.nan)

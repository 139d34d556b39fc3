"""A running ship as its instruments see it in a sea: its own slow motion, with that of the waves upon it."""

from __future__ import annotations

import math

import numpy as np

from ..environment import to_earth
from ..environment.sea import Sea
from ..environment.sea.rao import Rao
from . import Truth

_MOVED = ("x", "y", "psi", "u", "v_m", "r", "z", "phi", "theta", "w", "p", "q")
_OWN = ("phi", "p")


class Seen:
    """True values of a ship and, added to first order, of its motion in waves; read by name like the ship itself.

    x, y, psi, u, v_m, r are totals; heave z (down), phi, theta and their rates w, p, q are those of `simulate.seaway`.
    """

    def __init__(self, ship: Truth, sea: Sea, rao: Rao) -> None:
        """The truth of `ship` in a sea; WeatherError: operators that do not cover its frequencies."""
        rao.covers(sea)
        self._ship, self._sea = ship, sea
        # Interpolated once to the frequencies of the waves; at each instant only directions are left.
        self._rao, self._table = rao, rao.at(sea.waves.omega)
        self._for: tuple[float, ...] = ()
        self._now: dict[str, float] = {}
        self.t = 0.0

    def __getitem__(self, name: str, /) -> float:
        return self._moved()[name] if name in _MOVED else self._ship[name]

    def at(self, t: float) -> Seen:
        """The same truth at time `t` [s]."""
        self.t = t
        return self

    def _moved(self) -> dict[str, float]:
        slow = tuple(self._ship[name] for name in ("x", "y", "psi", "u", "v_m", "r"))
        key = (self.t, *slow)
        if key == self._for:
            return self._now
        x, y, psi, u, v, r = slow
        c, s = math.cos(psi), math.sin(psi)
        here = [np.array([value]) for value in (self.t, x, y, psi)]
        moved, speed = self._rao.motions(
            self._sea.waves, here[0], here[1], here[2], here[3], np.array([to_earth(u, v, c, s)]), self._table
        )
        surge, sway, heave, roll, pitch, yaw = moved[0].tolist()
        rates = speed[0].tolist()
        north, east = to_earth(surge, sway, c, s)
        phi, p = (self._slow(name) for name in _OWN)
        totals = (x + north, y + east, psi + yaw, u + rates[0], v + rates[1], r + rates[5],
                  heave, phi + roll, pitch, rates[2], p + rates[3], rates[4])  # fmt: skip
        self._for, self._now = key, {name: float(value) for name, value in zip(_MOVED, totals, strict=True)}
        return self._now

    def _slow(self, name: str) -> float:
        """A state of a ship that heels, 0 of one that does not."""
        try:
            return self._ship[name]
        except KeyError:
            return 0.0

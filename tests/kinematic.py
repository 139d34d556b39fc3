"""Ships that turn at a steady rate and keep or change their speed when told: tracks for tests of encounters."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from seatrial.encounters import Tracks


@dataclass(frozen=True)
class Sailed:
    """Start [m], heading [deg], speed [m/s], and orders (time [s], turn [deg], speed as a share of the first)."""

    x: float
    y: float
    psi: float
    U: float
    orders: Sequence[tuple[float, float, float]] = ()
    L: float = 200.0

    def rows(self, t: np.ndarray, rate: float = 0.5) -> tuple[np.ndarray, ...]:
        """Motion at the times t, by small steps; rate in deg/s."""
        step = 0.5
        fine = np.arange(t[0], t[-1] + step, step)
        psi, share = np.full(fine.shape, self.psi), np.ones(fine.shape)
        for at, turn, speed in self.orders:
            done = np.clip((fine - at) * rate, 0.0, abs(turn)) * math.copysign(1.0, turn)
            psi = psi + done
            share = np.where(fine >= at, share + (speed - share) * np.clip((fine - at) / 120.0, 0.0, 1.0), share)
        psi = np.radians(psi)
        x = self.x + np.concatenate([[0.0], np.cumsum(step * self.U * share * np.cos(psi))[:-1]])
        y = self.y + np.concatenate([[0.0], np.cumsum(step * self.U * share * np.sin(psi))[:-1]])
        found = [np.interp(t, fine, one) for one in (x, y, psi, self.U * share)]
        return (*found, np.zeros_like(t))


def tracks(ships: Sequence[Sailed], T: float = 2400.0, dt: float = 5.0, rate: float = 0.5) -> Tracks:
    """Tracks of ships over T seconds."""
    t = np.arange(0.0, T + dt / 2, dt)
    x, y, psi, u, v_m = (np.array(one) for one in zip(*(ship.rows(t, rate) for ship in ships), strict=True))
    L = np.array([ship.L for ship in ships])
    return Tracks(t, x, y, psi, u, v_m, L, L / 6.0)


def meeting(heading: float, T: float, U: float = 8.0, k: float = 1.0, off: float = 0.0) -> tuple[float, float]:
    """Start of a ship of this heading [deg] and speed k U that is `off` m aside of the place U T ahead at T."""
    c, s = math.cos(math.radians(heading)), math.sin(math.radians(heading))
    return U * T - k * U * T * c - off * s, -k * U * T * s + off * c

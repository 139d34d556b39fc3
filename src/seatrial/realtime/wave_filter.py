"""The wave filter of an autopilot: heading and rate of turn without what waves add, so that the rudder rests.

A cascade of three notches over the band of the encounter,

    H(s) = prod (s^2 + 2 zeta omega_i s + omega_i^2) / (s + omega_i)^2,   omega_i = omega_0 (0.63, 1, 1.6),

of gain one at rest and at high frequency (Fossen's notch, from memory of his handbook).  At slow turns it delays by
2 (1 - zeta) / omega_i each, so it belongs where the waves are much faster than the rudder's loop.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..core.errors import CommandError

_PLACES = (0.63, 1.0, 1.6)


class WaveFilter:
    """Filters heading and rate of turn, sample by sample."""

    def __init__(self, omega_0: float, zeta: float = 0.1) -> None:
        """For waves met at about omega_0 [rad/s]; zeta is what remains at each notch.

        Raises:
            CommandError: a frequency that is not above zero, or a zeta outside 0 to 1.
        """
        if not 0.0 < omega_0 < math.inf:
            raise CommandError(f"a wave filter at {omega_0:g} rad/s; give a frequency above zero")
        if not 0.0 < zeta < 1.0:
            raise CommandError(f"a wave filter of zeta {zeta:g}; give one between 0 and 1")
        self.omega_0, self.zeta = omega_0, zeta
        self.reset()

    def reset(self) -> None:
        """Begin anew: the next sample is taken as it is."""
        self._last: float | None = None
        self._turned = 0.0
        self._memory: list[float] = []

    def step(self, psi: float, r: float, dt: float) -> tuple[float, float]:
        """Heading [rad] and rate of turn [rad/s] without waves; `dt` is the time since the sample before [s]."""
        if self._last is None:
            self._memory = [0.0, 0.0] * len(_PLACES) + self._rest(r, dt)
            self._first = psi
        else:
            self._turned += math.remainder(psi - self._last, 2.0 * math.pi)
        self._last = psi
        half = 2 * len(_PLACES)
        heading = self._run(self._turned, dt, 0)
        return self._first + heading, self._run(r, dt, half)

    def _rest(self, value: float, dt: float) -> list[float]:
        """Memories of notches that have had this value for ever."""
        out: list[float] = []
        for place in _PLACES:
            (b0, _, b2), (_, a2) = _notch(place * self.omega_0, self.zeta, dt)
            out += [value * (1.0 - b0), value * (b2 - a2)]
        return out

    def _run(self, value: float, dt: float, at: int) -> float:
        for k, place in enumerate(_PLACES):
            (b0, b1, b2), (a1, a2) = _notch(place * self.omega_0, self.zeta, dt)
            i = at + 2 * k
            out = b0 * value + self._memory[i]
            self._memory[i : i + 2] = [b1 * value - a1 * out + self._memory[i + 1], b2 * value - a2 * out]
            value = out
        return value

    def snapshot(self) -> list[Any]:
        """Its complete state."""
        return [self._last, self._turned, self._first if self._last is not None else 0.0, *self._memory]

    def restore(self, saved: Sequence[Any]) -> None:
        """Continue from a `snapshot`."""
        self._last, self._turned, self._first = saved[:3]
        self._memory = list(saved[3:])


def _notch(omega: float, zeta: float, dt: float) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """One notch by the bilinear rule, exact at its own frequency: numerator and denominator in z^-1."""
    c = omega / math.tan(min(0.5 * omega * dt, 1.5))
    a0 = (c + omega) ** 2
    square, cross = c * c + omega * omega, 2.0 * zeta * omega * c
    middle = 2.0 * (omega * omega - c * c) / a0
    return ((square + cross) / a0, middle, (square - cross) / a0), (middle, (c - omega) ** 2 / a0)

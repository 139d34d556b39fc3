"""The space of encounters as numbers: what a search moves in, and a rare event is sampled in.

A point has, for each other ship, the time to its closest approach, the ratio of speeds, its course and its conduct;
then the weather.  Points of the unit cube are spread over the encounters of given roles as `meeting.drawn` spreads
them, but for the ratio of speeds, which is uniform here.
"""

from __future__ import annotations

import math

import numpy as np

from ..core.errors import RequestError
from ..core.values import dataclass
from ..data import Array
from ..environment import CHANNELS
from .meeting import Meeting, Ranges, Span
from .rules import Role

PER_SHIP = ("T", "k", "psi", "conduct")
WEATHER = ("wind", "wind_from", "current", "current_towards")
_COURSES = 720
"""Steps of course in which roles are told apart."""


@dataclass(frozen=True)
class Space:
    """Encounters of an own ship on course north.

    Attributes:
        roles: of the own ship towards each other one.
        U: its speed [m/s].
        conducts: how many the others may have.
        ranges: of times and ratios of speeds; nobody misses.
        weather: least and greatest of each of `WEATHER` [m/s, rad].
    """

    roles: tuple[Role, ...]
    U: float
    conducts: int
    ranges: Ranges
    weather: tuple[Span, Span, Span, Span]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the numbers of a point."""
        return (*(f"{name}_{k + 1}" for k in range(len(self.roles)) for name in PER_SHIP), *WEATHER)

    @property
    def free(self) -> tuple[int, ...]:
        """Places of the numbers that vary, which are the dimensions of the cube."""
        spans = [span for role in self.roles
                 for span in (self.ranges.T, self.ranges.k[role], (0.0, 1.0), (0.0, self.conducts - 1.0))]  # fmt: skip
        return tuple(k for k, (low, high) in enumerate((*spans, *self.weather)) if high > low)

    @property
    def discrete(self) -> tuple[bool, ...]:
        """Of each dimension, whether it is the number of a conduct."""
        return tuple(self.names[k].startswith("conduct") for k in self.free)

    def at(self, cube: Array) -> Array:
        """Points of those of the cube, shape (points, names).

        Raises:
            RequestError: no course has a role at some time and ratio of speeds.
        """
        share = np.zeros((len(cube), len(self.names)))
        share[:, list(self.free)] = cube
        found = np.empty_like(share)
        for ship, role in enumerate(self.roles):
            first = len(PER_SHIP) * ship
            T, k = (low + (high - low) * share[:, first + one]
                    for one, (low, high) in enumerate((self.ranges.T, self.ranges.k[role])))  # fmt: skip
            psi = self._course(role, T, k, share[:, first + 2])
            conduct = np.minimum(np.floor(share[:, first + 3] * self.conducts), self.conducts - 1.0)
            found[:, first : first + len(PER_SHIP)] = np.column_stack([T, k, psi, conduct])
        low, high = np.array(self.weather).T
        found[:, -len(WEATHER) :] = low + (high - low) * share[:, -len(WEATHER) :]
        return found

    def holds(self, point: Array) -> bool:
        """Whether its ships begin apart."""
        met = meeting(point[None], self.U)
        return bool((np.hypot(met.x, met.y) >= self.ranges.apart).all())

    def _course(self, role: Role, T: Array, k: Array, share: Array) -> Array:
        """The course below which a share of those of a role lie [rad]."""
        edges = np.linspace(-math.pi, math.pi, _COURSES + 1)
        met = straight(self.U, T[:, None], k[:, None], edges)
        fits = (met.roles == role) & (np.hypot(met.x, met.y) >= self.ranges.apart)
        whole = fits[:, :-1] & fits[:, 1:]  # on both ends of the step
        count = whole.cumsum(axis=1)
        if not count[:, -1].all():
            raise RequestError(f"no encounter of {role.name.lower()} at some of these times and ratios of speeds")
        wanted = np.minimum(share, 1.0 - 1e-12) * count[:, -1]
        step = (count > np.floor(wanted)[:, None]).argmax(axis=1)
        return edges[step] + (wanted - np.floor(wanted)) * (edges[1] - edges[0])


def straight(U: float, T: Array, k: Array, psi: Array) -> Meeting:
    """Ships that meet the own one after T [s], with k times its speed on courses psi [rad]."""
    speed = k * U
    x, y = T * (U - speed * np.cos(psi)), -T * speed * np.sin(psi)
    return Meeting(U, x, y, np.broadcast_to(psi, x.shape), np.broadcast_to(speed, x.shape))


def meeting(points: Array, U: float) -> Meeting:
    """The meetings of points; a ship whose time is NaN is left out: it sails away, far astern."""
    ships = (points.shape[1] - len(WEATHER)) // len(PER_SHIP)
    T, k, psi = (points[:, one : len(PER_SHIP) * ships : len(PER_SHIP)] for one in range(3))
    met, none = straight(U, T, k, psi), np.isnan(T)
    far = -1e6 - 1e4 * np.arange(ships)
    return Meeting(np.full(len(points), U), np.where(none, far, met.x), np.where(none, 0.0, met.y),
                   np.where(none, math.pi, psi), np.where(none, U, met.U_target))  # fmt: skip


def around(points: Array) -> Array:
    """The weather of points as the channels of the environment, shape (points, channels)."""
    wind, wind_from, current, towards = points[:, -len(WEATHER) :].T
    found = np.zeros((len(points), len(CHANNELS)))
    for name, speed, angle in (("wind", wind, wind_from), ("current", current, towards)):
        found[:, CHANNELS.index(f"{name}_x")] = speed * np.cos(angle)
        found[:, CHANNELS.index(f"{name}_y")] = speed * np.sin(angle)
    return found

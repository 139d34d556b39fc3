"""Latitude and longitude to metres north and east of a datum, and back, exactly.

The plane touches WGS 84 at the datum; a point of the ellipsoid is seen on it along the plane's normal, so
that distances are right to 4 mm at 10 km, and to 0.5 m at 50 km.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from . import DataError

# Semi-axis [m] and squared eccentricity of WGS 84.
_A, _E2 = 6378137.0, 0.00669437999014


@dataclass(frozen=True)
class Datum:
    """Where x and y are zero.

    Attributes:
        latitude, longitude: [deg], north and east positive.
    """

    latitude: float
    longitude: float

    def __post_init__(self) -> None:
        if not (abs(self.latitude) <= 89.0 and abs(self.longitude) <= 180.0):
            raise DataError(
                f"datum at latitude {self.latitude:g}, longitude {self.longitude:g}; "
                "the first is -89 to 89 deg, the second -180 to 180 deg"
            )

    def north_east(self, latitude: float, longitude: float) -> tuple[float, float]:
        """Metres north and east of the datum."""
        X, Y, Z = _earth_fixed(latitude, longitude - self.longitude)
        X0, _, Z0 = _earth_fixed(self.latitude, 0.0)
        s, c = math.sin(math.radians(self.latitude)), math.cos(math.radians(self.latitude))
        return c * (Z - Z0) - s * (X - X0), Y

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Latitude and longitude [deg] of the point that many metres north and east; the inverse of `north_east`."""
        phi = math.radians(self.latitude)
        w = 1.0 - _E2 * math.sin(phi) ** 2
        M, N = _A * (1.0 - _E2) / w**1.5, _A / math.sqrt(w)
        latitude, longitude = self.latitude, self.longitude
        for _ in range(6):
            north, east = self.north_east(latitude, longitude)
            latitude += math.degrees((x - north) / M)
            longitude += math.degrees((y - east) / (N * math.cos(phi)))
        return latitude, (longitude + 180.0) % 360.0 - 180.0


def _earth_fixed(latitude: float, longitude: float) -> tuple[float, float, float]:
    """Earth-centred coordinates [m] of a point of the ellipsoid."""
    phi, lam = math.radians(latitude), math.radians(longitude)
    N = _A / math.sqrt(1.0 - _E2 * math.sin(phi) ** 2)
    return N * math.cos(phi) * math.cos(lam), N * math.cos(phi) * math.sin(lam), N * (1.0 - _E2) * math.sin(phi)

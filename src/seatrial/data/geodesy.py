"""Latitude and longitude to metres north and east of a datum, and back, exactly.

The plane touches WGS 84 at the datum; a point of the ellipsoid is projected on it along the plane's normal, so
that distances are right to 4 mm at 10 km, and to 0.5 m at 50 km.
"""

from __future__ import annotations

import math
import re

import numpy as np

from ..core.values import dataclass
from . import Array, DataError

SEMI_AXIS, E2 = 6378137.0, 0.00669437999014
"""Semi-axis [m] and squared eccentricity of WGS 84."""

# Iterations towards a datum at most, and the tolerance [m].
_STEPS, _NEAR = 60, 1e-7


@dataclass(frozen=True)
class Datum:
    """Where x and y are zero.

    Attributes:
        latitude, longitude: [deg], north and east positive.

    >>> here = Datum(35.0, 139.7)
    >>> [round(float(one), 4) for one in here.place(1000.0, 0.0)]
    [35.009, 139.7]
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

    def track(self, latitude: Array, longitude: Array) -> tuple[Array, Array]:
        """Metres north and east of the datum for arrays of fixes; a fix with a gap gives gaps."""
        gap = np.isnan(latitude + longitude)
        phi, lam = np.radians(np.where(gap, np.nan, latitude)), np.radians(longitude - self.longitude)
        X0, _, Z0 = _earth_fixed(self.latitude, 0.0)
        N = SEMI_AXIS / np.sqrt(1.0 - E2 * np.sin(phi) ** 2)
        up, out = N * (1.0 - E2) * np.sin(phi) - Z0, N * np.cos(phi) * np.cos(lam) - X0
        s, c = math.sin(math.radians(self.latitude)), math.cos(math.radians(self.latitude))
        return c * up - s * out, N * np.cos(phi) * np.sin(lam)

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Latitude and longitude [deg] of the point x metres north and y metres east; the inverse of `north_east`.

        Raises:
            DataError: the plane has no point of the earth below it there.
        """
        s, c = math.sin(math.radians(self.latitude)), math.cos(math.radians(self.latitude))
        q, (X0, _, Z0) = 1.0 / (1.0 - E2), _earth_fixed(self.latitude, 0.0)
        # Down from the plane by `depth` to X^2 + Y^2 + q Z^2 = a^2: the nearer root of a quadratic.
        inward = c * X0 + q * s * Z0 + x * s * c * (q - 1.0)
        off = x * x * (s * s + q * c * c) + y * y
        rest = inward * inward - (c * c + q * s * s) * off
        if rest < 0.0:
            raise DataError(f"{x:g} m north and {y:g} m east of the datum is beyond the earth; stay within 6000 km")
        depth = off / (inward + math.sqrt(rest))
        X, Z = X0 - s * x - c * depth, Z0 + c * x - s * depth
        longitude = self.longitude + math.degrees(math.atan2(y, X))
        return math.degrees(math.atan2(q * Z, math.hypot(X, y))), (longitude + 180.0) % 360.0 - 180.0

    @staticmethod
    def seeing(latitude: float, longitude: float, x: float, y: float) -> Datum:
        """The datum from which a place [deg] lies x metres north and y metres east.

        North is that of the datum, not that of the place, so the solution is iterative.

        Raises:
            DataError: there is none, or it is too near to a pole.
        """
        datum = Datum(latitude, longitude)
        for _ in range(_STEPS):
            north, east = datum.north_east(latitude, longitude)
            datum = Datum(*datum.place(north - x, east - y))
            if math.hypot(north - x, east - y) <= _NEAR:
                return datum
        raise DataError(
            f"no datum {x:g} m south and {y:g} m west of latitude {latitude:g}, longitude {longitude:g}; "
            "give one, nearer to the ship or farther from the pole"
        )


def _earth_fixed(latitude: float, longitude: float) -> tuple[float, float, float]:
    """Earth-centred coordinates [m] of a point of the ellipsoid."""
    phi, lam = math.radians(latitude), math.radians(longitude)
    N = SEMI_AXIS / math.sqrt(1.0 - E2 * math.sin(phi) ** 2)
    return N * math.cos(phi) * math.cos(lam), N * math.cos(phi) * math.sin(lam), N * (1.0 - E2) * math.sin(phi)


_ZONE = re.compile(r"([1-9]|[1-5]\d|60)\s*([C-HJ-NP-X])", re.IGNORECASE)
_SCALE, _FALSE_EAST, _FALSE_NORTH = 0.9996, 500_000.0, 10_000_000.0


def zone_of(text: str) -> tuple[int, bool]:
    """Number of a zone of UTM, and whether it is south of the equator, by N and S or the letter of its band.

    S is the southern half, not the band between 32 and 40 N, of which the half is N.

    Raises:
        DataError: no such zone.
    """
    found = _ZONE.fullmatch(text.strip())
    if found is None:
        raise DataError(f"'{text:.20}' is no zone of UTM, such as 32N or 56S")
    letter = found[2].upper()
    return int(found[1]), letter == "S" or letter < "N"


def of_utm(northing: Array, easting: Array, zone: int, south: bool) -> tuple[Array, Array]:
    """Latitude and longitude [deg] of northings and eastings [m] of a zone of UTM.

    The series of Krueger (1912) in the third flattening n, to n^4: below a micrometre within a zone (Karney, Transverse
    Mercator with an accuracy of a few nanometers, J. Geodesy 85, 2011, eq. 36).
    """
    n = (1.0 - math.sqrt(1.0 - E2)) / (1.0 + math.sqrt(1.0 - E2))
    A = SEMI_AXIS / (1.0 + n) * (1.0 + n**2 / 4.0 + n**4 / 64.0)
    beta = (
        n / 2.0 - 2.0 * n**2 / 3.0 + 37.0 * n**3 / 96.0 - n**4 / 360.0,
        n**2 / 48.0 + n**3 / 15.0 - 437.0 * n**4 / 1440.0,
        17.0 * n**3 / 480.0 - 37.0 * n**4 / 840.0,
        4397.0 * n**4 / 161280.0,
    )
    xi = (northing - _FALSE_NORTH * south) / (_SCALE * A)
    eta = (easting - _FALSE_EAST) / (_SCALE * A)
    xi_0 = xi - sum(b * np.sin(2 * j * xi) * np.cosh(2 * j * eta) for j, b in enumerate(beta, start=1))
    eta_0 = eta - sum(b * np.cos(2 * j * xi) * np.sinh(2 * j * eta) for j, b in enumerate(beta, start=1))
    tau_0 = np.sin(xi_0) / np.hypot(np.sinh(eta_0), np.cos(xi_0))
    tau, e = tau_0 / (1.0 - E2), math.sqrt(E2)
    for _ in range(5):  # Newton's method for the latitude of which tau_0 is the conformal one
        sigma = np.sinh(e * np.arctanh(e * tau / np.hypot(1.0, tau)))
        conformal = tau * np.hypot(1.0, sigma) - sigma * np.hypot(1.0, tau)
        slope = (1.0 - E2) * np.hypot(1.0, tau) / (1.0 + (1.0 - E2) * tau**2)
        tau = tau + (tau_0 - conformal) / np.hypot(1.0, conformal) * (1.0 / slope)
    longitude = np.degrees(np.arctan2(np.sinh(eta_0), np.cos(xi_0))) + 6.0 * zone - 183.0
    return np.degrees(np.arctan(tau)), longitude

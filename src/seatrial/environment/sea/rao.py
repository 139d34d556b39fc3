"""Response amplitude operators: the motion of a ship per metre of wave, by frequency and direction."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...core.errors import WeatherError
from ...core.values import dataclass
from ...data import Array
from . import Sea, Waves

Complex = NDArray[np.complex128]

MODES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
"""What becomes of the motions of a ship with two equal sides when the wave comes from the other one."""

_WIDEST = math.radians(45.0)
_ROWS = 2048
# A sea with more of its variance beyond the table has motions that are more than a hundredth off in amplitude.
_OUTSIDE = 0.02


@dataclass(frozen=True)
class Rao:
    """Operators of the six motions of midship, in ship axes: x forward, y starboard, z down.

    A wave a cos(omega_e t) at midship gives the motion a |R| cos(omega_e t + arg R).

    Attributes:
        omega: frequencies of the waves from a point at rest [rad/s], rising, shape (n,).
        chi: directions the waves travel towards, clockwise from the bow [rad], rising over a full turn (0 following, pi
            head sea), shape (m,).
        R: operators [m/m] and [rad/m], shape (n, m, 6).
        name: where they are from, for messages.
    """

    omega: Array
    chi: Array
    R: Complex
    name: str = "RAO"

    @classmethod
    def of(cls, omega: Array, chi: Array, R: Complex, name: str = "RAO") -> Rao:
        """Operators on a full turn of directions: half a turn is mirrored, as a ship has two equal sides.

        Raises:
            WeatherError: fewer than two frequencies, frequencies that do not rise, gaps between directions.
        """
        if omega.size < 2 or not (np.diff(omega) > 0.0).all() or not omega[0] > 0.0:
            raise WeatherError(f"{name}: frequencies must rise from above zero, two at least")
        if not np.isfinite(R).all():
            raise WeatherError(f"{name}: operators that are no finite numbers; complete the table")
        turn = np.mod(chi, 2.0 * math.pi)
        turn[turn > 2.0 * math.pi - 1e-6] = 0.0
        first = np.unique(np.round(turn, 6), return_index=True)[1]
        turn, whole = turn[first], R[:, first]
        sides = (turn > 1e-6) & (np.abs(turn - math.pi) > 1e-6)
        starboard = turn < math.pi
        if sides.any() and (starboard[sides].all() or not starboard[sides].any()):
            turn = np.concatenate([turn, 2.0 * math.pi - turn[sides]])
            whole = np.concatenate([whole, whole[:, sides] * MIRROR], axis=1)
            order = np.argsort(turn)
            turn, whole = turn[order], whole[:, order]
        gaps = np.diff(turn, append=turn[0] + 2.0 * math.pi)
        if (widest := int(np.argmax(gaps))) >= 0 and gaps[widest] > _WIDEST + 1e-6:
            begin = math.degrees(turn[widest])
            raise WeatherError(
                f"{name}: no directions between {begin:g} and {begin + math.degrees(gaps[widest]):g} deg from the bow; "
                f"give steps of at most {math.degrees(_WIDEST):g} deg, from 0 (following) to 180 (head sea) at least"
            )
        return cls(omega, turn, whole, name)

    def at(self, omega: Array) -> Complex:
        """Operators at frequencies [rad/s], shape (len(omega), m, 6).

        Real and imaginary part are interpolated, not amplitude and phase, which jumps.  Below the table the first
        holds, above it the ship is at rest.
        """
        flat = self.R.reshape(self.omega.size, -1)
        parts = [np.column_stack([np.interp(omega, self.omega, column, right=0.0) for column in half.T])
                 for half in (flat.real, flat.imag)]  # fmt: skip
        return (parts[0] + 1j * parts[1]).reshape(omega.size, self.chi.size, 6)

    def covers(self, sea: Sea) -> None:
        """Refuse a sea with more than 2 % of its variance at frequencies outside the table (WeatherError)."""
        waves = sea.waves
        energy = waves.a**2
        outside = (waves.omega < self.omega[0]) | (waves.omega > self.omega[-1])
        share = float(energy[outside].sum() / max(energy.sum(), 1e-300))
        if share > _OUTSIDE:
            raise WeatherError(
                f"{self.name}: {share:.0%} of the variance of the sea lies outside {self.omega[0]:.3g} to "
                f"{self.omega[-1]:.3g} rad/s; give operators around {sea.spectrum.omega_P:.3g} rad/s"
            )

    def variances(self, waves: Waves, psi: float) -> Array:
        """Variance of the six motions on a steady heading psi [rad]; [m^2] and [rad^2], shape (6,)."""
        R = self.at(waves.omega)
        amplitude = np.abs(_turned(R, self.chi, np.mod(waves.beta - psi, 2.0 * math.pi)[None, :])[0])
        return 0.5 * (waves.a**2) @ amplitude**2

    def motions(
        self, waves: Waves, t: Array, x: Array, y: Array, psi: Array, rate: Array, table: Complex | None = None
    ) -> tuple[Array, Array]:
        """Motions along a slow track and their rates, each of shape (samples, 6).

        Args:
            waves: components of the sea.
            t, x, y, psi: times [s], places [m] and headings [rad] of midship without waves, shape (samples,).
            rate: velocity of midship over ground, north and east [m/s], shape (samples, 2).
            table: the operators `at` the waves, where a caller has kept them.
        """
        R = self.at(waves.omega) if table is None else table
        out, speed = np.empty((2, t.size, 6))
        for start in range(0, t.size, _ROWS):
            rows = slice(start, start + _ROWS)
            unit = waves.a * np.exp(1j * waves.phase(t[rows], x[rows], y[rows]))
            along = np.outer(rate[rows, 0], np.cos(waves.beta)) + np.outer(rate[rows, 1], np.sin(waves.beta))
            met = waves.omega - waves.k * along
            steady = bool((psi[rows] == psi[start]).all())
            headings = psi[start : start + 1] if steady else psi[rows]
            own = _turned(R, self.chi, np.mod(waves.beta - headings[:, None], 2.0 * math.pi))
            for kept, parts in ((out, unit), (speed, 1j * met * unit)):
                kept[rows] = (parts @ own[0] if steady else np.einsum("tj,tjm->tm", parts, own)).real
        return out, speed


def _turned(R: Complex, chi: Array, at: Array) -> Complex:
    """Operators (components, directions, 6) at directions (samples, components): (samples, components, 6)."""
    after = np.searchsorted(chi, at, side="right")
    before = (after - 1) % chi.size
    after = after % chi.size
    width = np.mod(chi[after] - chi[before], 2.0 * math.pi)
    share = np.mod(at - chi[before], 2.0 * math.pi) / np.where(width > 0.0, width, 2.0 * math.pi)
    each = np.arange(R.shape[0])
    return R[each, before] * (1.0 - share)[..., None] + R[each, after] * share[..., None]

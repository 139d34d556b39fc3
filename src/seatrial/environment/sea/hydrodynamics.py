"""What a panel code or a strip theory says of a hull: added mass, damping, stiffness, inertia and wave forces.

Everything here is in ship axes (x forward, y starboard, z down, time exp(+i omega t)) at zero speed, about a point on
the centre line; the readers convert.  At a speed the same coefficients are taken at the frequency of encounter, which
is the usual approximation for slow ships: what the forward speed itself does to radiation is left out.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.constants import GRAVITY
from ...core.errors import WeatherError
from ...core.values import dataclass, replace
from ...data import Array
from .rao import MIRROR, MODES, Complex, Rao

_BASIN = 0.02
"""Negative damping that is rounding of a panel code, as a share of the largest."""


@dataclass(frozen=True)
class Hydrodynamics:
    """Coefficients of a hull over the frequency.

    Attributes:
        omega: frequencies [rad/s], rising, shape (n,).
        A, B: added mass and radiation damping [kg, kg m, kg m^2 and /s], shape (n, 6, 6); zero where not computed.
        modes: the motions that were computed, numbers in `rao.MODES`.
        M, C: mass matrix and hydrostatic stiffness, shape (6, 6).
        z_G: height of the centre of gravity, below the water line [m].
        A_inf: added mass at infinite frequency, shape (6, 6); None where not computed.
        chi: directions the waves travel towards, clockwise from the bow [rad], rising over a full turn, shape (m,).
        F: wave forces [N/m] and moments [N m/m] of shape (n, m, 6); empty where not computed.
        name: where they are from, for messages.
        z: height of the point that motions are about, below the water line [m].
    """

    omega: Array
    A: Array
    B: Array
    modes: tuple[int, ...]
    M: Array
    C: Array
    z_G: float
    A_inf: Array | None
    chi: Array
    F: Complex
    name: str = "coefficients"
    z: float = 0.0

    def __post_init__(self) -> None:
        _risen(self.name, self.omega)
        for what, values in (("added mass", self.A), ("damping", self.B), ("stiffness", self.C), ("mass", self.M)):
            if not np.isfinite(values).all():
                raise WeatherError(f"{self.name}: {what} that is no finite number; complete the data")
        if not np.isfinite(self.F).all():
            raise WeatherError(f"{self.name}: wave forces that are no finite numbers; complete the data")
        _symmetric(self.name, "added mass", self.A, self.modes)
        _passive(self.name, self.omega, self.B, self.modes)

    def moved(self, x: float, y: float, z: float) -> Hydrodynamics:
        """The same about another point, x, y, z [m] ahead of, to starboard of and below the present one."""
        # velocity at the old point of a body that moves with v and turns with w about the new one: v + w x (old - new)
        H = _lever(-x, -y, -z)

        def turned(matrix: Array) -> Array:
            return H.T @ matrix @ H

        far = None if self.A_inf is None else turned(self.A_inf)
        return replace(self, A=turned(self.A), B=turned(self.B), M=turned(self.M), C=turned(self.C), A_inf=far,
                       F=self.F @ H, z=self.z + z)  # fmt: skip

    def at(self, omega: Array) -> tuple[Array, Array]:
        """Added mass and damping at frequencies [rad/s] of any shape, (..., 6, 6); beyond the ends the ends hold."""
        flat = np.abs(omega).ravel()
        both = [np.stack([np.interp(flat, self.omega, column) for column in matrix.reshape(self.omega.size, 36).T], -1)
                for matrix in (self.A, self.B)]  # fmt: skip
        return both[0].reshape(*omega.shape, 6, 6), both[1].reshape(*omega.shape, 6, 6)

    def rao(self, U: float = 0.0, roll_damping: float = 0.0, further: Array | None = None) -> Rao:
        """Motions per metre of wave at a speed [m/s]: coefficients at the frequency of encounter.

        (-omega_e^2 (M + A) + i omega_e B + C) xi = F, for the motions that were computed; others are at rest.

        Args:
            U: speed ahead [m/s].
            roll_damping: damping of roll that waves do not carry away, over the critical one.
            further: damping besides that of radiation, shape (6, 6).

        Raises:
            WeatherError: no wave forces.
        """
        if not self.F.size:
            raise WeatherError(f"{self.name}: no wave forces; add them, or a table of operators")
        met = self.omega[:, None] - self.omega[:, None] ** 2 / GRAVITY * U * np.cos(self.chi)
        added, damping = self.at(met)
        if further is not None:
            damping = damping + further
        inertia = self.M + added
        if 3 in self.modes and roll_damping:
            H = _lever(0.0, 0.0, self.z - self.z_G)
            rolling = (H.T @ inertia @ H)[..., 3, 3]  # about the centre of gravity
            damping[..., 3, 3] += 2.0 * roll_damping * np.sqrt(np.maximum(self.C[3, 3] * rolling, 0.0))
        w = met[..., None, None]
        own = np.ix_(self.modes, self.modes)
        system = (-(w**2) * inertia + 1j * w * damping + self.C)[..., own[0], own[1]]
        # where the ship runs with the waves it stands still beside them: surge, sway and yaw have no balance
        idle = np.abs(met) < 1e-3 * self.omega[:, None]
        system[idle] = np.eye(len(self.modes))
        xi = np.linalg.solve(system, self.F[..., self.modes, None])[..., 0]
        xi[idle] = 0.0
        R = np.zeros((*met.shape, 6), dtype=np.complex128)
        R[..., self.modes] = xi
        return Rao.of(self.omega, self.chi, R, self.name)

    @property
    def forces(self) -> Rao:
        """The wave forces in the form of operators [N/m] and [N m/m]: read along a track as motions are."""
        if not self.F.size:
            raise WeatherError(f"{self.name}: no wave forces; add them, or give a ship without memory and a table")
        return Rao(self.omega, self.chi, self.F, self.name)


def _lever(x: float, y: float, z: float) -> Array:
    """Velocities at a point x, y, z [m] off another one, from those at that one; shape (6, 6)."""
    H = np.eye(6)
    H[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return H


def whole_turn(chi: Array, F: Complex) -> tuple[Array, Complex]:
    """Directions over a full turn from those of one side, as a ship has two equal ones; see `Rao.of`."""
    turn = Rao.of(np.array([1.0, 2.0]), chi, np.concatenate([F, F])[:2] if len(F) < 2 else F[:2])
    order = [int(np.argmin(np.abs(np.mod(chi - one + 1e-6, 2.0 * math.pi)))) for one in turn.chi]
    mirror = [int(np.argmin(np.abs(np.mod(-chi - one + 1e-6, 2.0 * math.pi)))) for one in turn.chi]
    own = np.abs(np.mod(chi[order] - turn.chi + math.pi, 2.0 * math.pi) - math.pi) < 1e-5
    return turn.chi, np.where(own[:, None], F[:, order], F[:, mirror] * MIRROR)


def _risen(name: str, omega: Array) -> None:
    if omega.size < 8 or not omega[0] > 0.0 or not (np.diff(omega) > 0.0).all() or not np.isfinite(omega).all():
        raise WeatherError(f"{name}: {omega.size} frequencies; give 8 or more that rise from above zero")
    steps = np.diff(omega)
    # a geometric series grows from step to step, so each is compared with its neighbours
    around = np.maximum(np.r_[steps[1:], steps[-2]], np.r_[steps[1], steps[:-1]])
    if (wide := int(np.argmax(steps / around))) >= 0 and steps[wide] > 2.6 * around[wide]:
        raise WeatherError(
            f"{name}: a gap between {omega[wide]:.4g} and {omega[wide + 1]:.4g} rad/s; give steps that change slowly"
        )


def _symmetric(name: str, what: str, matrix: Array, modes: tuple[int, ...]) -> None:
    for i in modes:
        for j in modes:
            size = np.sqrt(np.abs(matrix[:, i, i] * matrix[:, j, j])).max()
            off = np.abs(matrix[:, i, j] - matrix[:, j, i]).max()
            if off > 0.2 * size:
                raise WeatherError(
                    f"{name}: {what} of {MODES[i]} by {MODES[j]} and of {MODES[j]} by {MODES[i]} differ by {off:.3g}; "
                    "at zero speed they are equal"
                )


def _passive(name: str, omega: Array, B: Array, modes: tuple[int, ...]) -> None:
    """Refuse damping that would drive the ship: waves carry energy away at every frequency."""
    own = np.ix_(modes, modes)
    part = B[:, own[0], own[1]]
    size = np.sqrt(np.maximum(np.abs(np.einsum("nii->ni", part)).max(axis=0), 1e-300))
    least = np.linalg.eigvalsh(0.5 * (part + part.transpose(0, 2, 1)) / np.outer(size, size))[:, 0]
    if least.min() < -_BASIN:
        worst = int(np.argmin(least))
        alone = int(np.argmin(np.einsum("nii->ni", part)[worst] / size**2))
        raise WeatherError(
            f"{name}: damping at {omega[worst]:.4g} rad/s gives energy to the ship ({MODES[modes[alone]]} most); "
            "it is never below zero: check its sign, units and irregular frequencies"
        )

"""Base of the families that roll: heel and roll rate beside the six states, and what they do to the kinematics.

Axes are fixed in the ship and roll with it: v_m is sway along the deck and r the rate about its normal, so that the
ship drifts over ground with v_m cos(phi) and turns with r cos(phi) (Son and Nomoto 1981, as coded in MSS container.m).
At phi = p = 0 these are the kinematics of the horizontal plane.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

from ..core.parameters import Scalar, Scalars
from ..core.symbolic import cos, sin
from ..environment import Environment, to_body, to_earth
from ..forces import Flow
from . import ROLL, STATES, Model
from .common import Afloat, Surroundings

GRAVITY = 9.81
"""Gravity of the two published models [m/s^2]."""


class Rolling(Model):
    """A ship with heel and roll rate."""

    states: ClassVar[tuple[str, ...]] = (*STATES, *ROLL)


class Heeled(NamedTuple):
    """What a heeled ship meets.

    Attributes:
        around: velocities along the axes of the ship, over ground and through the water.
        phi, p: heel [rad] and roll rate [rad/s].
        cos_phi, sin_phi: of the heel.
    """

    around: Surroundings
    phi: Scalar
    p: Scalar
    cos_phi: Scalar
    sin_phi: Scalar

    @classmethod
    def of(cls, state: Scalars, environment: Environment) -> Heeled:
        """What a ship in `state` meets; a current that it drifts with is still water."""
        _, _, psi, u, v_m, r, phi, p = state
        c, s, upright, over = cos(psi), sin(psi), cos(phi), sin(phi)
        ahead, aside = to_body(environment.current_x, environment.current_y, c, s)
        around = Surroundings(u, v_m, r, u - ahead, v_m - aside / upright, c, s, environment)
        return cls(around, phi, p, upright, over)

    def flow(self, body: Afloat, n_P: Scalar = 0.0, delta: Scalar = 0.0) -> Flow:
        """The flow that force modules feel; the wind comes over the deck of a ship upright."""
        flow, v_m = self.around.flow(body, n_P, delta), self.around.v_m
        return flow._replace(v_A=flow.v_A - v_m + v_m * self.cos_phi)

    def rates(self, du: Scalar, dv: Scalar, dp: Scalar, dr: Scalar, turning: Scalar | None = None) -> Scalars:
        """Rates of the eight states, from those of the velocities through the water and of p and r.

        A uniform current adds its own motion and no acceleration over ground, as in the horizontal plane.

        Args:
            du, dv, dp, dr: [m/s^2, m/s^2, rad/s^2, rad/s^2].
            turning: rate of the heading [rad/s]; None is r cos(phi).
        """
        around, upright = self.around, self.cos_phi
        north, east = to_earth(around.u, around.v_m * upright, around.cos_psi, around.sin_psi)
        heading = around.r * upright if turning is None else turning
        u_C, v_C = around.u - around.u_r, around.v_m - around.v_r  # v_C cos(phi) is the current across
        return (
            north, east, heading,
            du + heading * upright * v_C, dv + (self.p * v_C * self.sin_phi - heading * u_C) / upright, dr,
            self.p, dp,
        )  # fmt: skip


def lateral(
    force: tuple[Scalar, Scalar, Scalar], rows: tuple[tuple[Scalar, Scalar, Scalar], ...]
) -> tuple[Scalar, Scalar, Scalar]:
    """Accelerations of sway, roll and yaw under their forces: the solution with a mass matrix of three rows."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    Y, K, N = force
    ei, di, dh = e * i - f * h, d * i - f * g, d * h - e * g
    over = 1.0 / (a * ei - b * di + c * dh)
    return (
        (ei * Y + (c * h - b * i) * K + (b * f - c * e) * N) * over,
        (-di * Y + (a * i - c * g) * K + (c * d - a * f) * N) * over,
        (dh * Y + (b * g - a * h) * K + (a * e - b * d) * N) * over,
    )

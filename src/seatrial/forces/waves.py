"""Mean forces of waves: what an irregular sea does to a ship's track, its oscillations left out."""

from __future__ import annotations

from math import pi
from typing import ClassVar

from ..core.constants import GRAVITY
from ..core.parameters import Scalar, spec
from ..core.symbolic import clip, magnitude, root, speed, where
from ..core.values import dataclass
from . import Flow, Force, ForceModule


@dataclass(frozen=True, kw_only=True)
class MeanDrift(ForceModule):
    """Mean drift force and moment by cubics in wavelength over ship length.

    The numbers come from one public code (wavesSet.m by W. Guang, 2025), which calls them
    experimental; the attribution to Daidola, Graham, Johnsen and Levy (1986) was not checked in print.
    They are C_X, C_Y, C_N of

        X = -q a^2 cos chi C_X,  Y = -q a^2 sin chi C_Y,  N = -q a^2 L_pp sin chi C_N,  q = 0.5 rho g L_pp

    with a the wave amplitude and chi the direction the waves come from, off the bow.  The code has
    no g; here it is put in, since without it the units fail and a beam sea would push with a tenth of
    what a wall reflects.  They are the defaults;
    a ship with coefficients of its own gives them in its file.  An irregular sea has the mean
    a^2 = H_S^2 / 8, and the wavelength g T^2 / 2 pi of its mean period in deep water.

    Range: lambda / L_pp from 0.3 to 0.95; beyond, the value at the end of the range holds.  This range is
    ours, the source prints none: between these the side force falls as reflection does, outside the cubic turns
    (0.28 and 0.95).  At 0.3 C_Y is 1.32, a third above what a wall would reflect: take the side force of
    short waves as an upper estimate.  Speed of the ship and encounter frequency do not enter.
    """

    shortest: ClassVar[float] = 0.3
    longest: ClassVar[float] = 0.95

    X_0: Scalar = spec("", "drift along the ship, constant", default=0.05)
    X_1: Scalar = spec("", "drift along the ship, by lambda/L", default=-0.20)
    X_2: Scalar = spec("", "drift along the ship, by (lambda/L)^2", default=0.75)
    X_3: Scalar = spec("", "drift along the ship, by (lambda/L)^3", default=-0.51)
    Y_0: Scalar = spec("", "drift across the ship, constant", default=0.46)
    Y_1: Scalar = spec("", "drift across the ship, by lambda/L", default=6.83)
    Y_2: Scalar = spec("", "drift across the ship, by (lambda/L)^2", default=-15.65)
    Y_3: Scalar = spec("", "drift across the ship, by (lambda/L)^3", default=8.44)
    N_0: Scalar = spec("", "drift moment, constant", default=-0.11)
    N_1: Scalar = spec("", "drift moment, by lambda/L", default=0.68)
    N_2: Scalar = spec("", "drift moment, by (lambda/L)^2", default=-0.79)
    N_3: Scalar = spec("", "drift moment, by (lambda/L)^3", default=0.21)

    def force(self, flow: Flow) -> Force:
        wavelength = GRAVITY / (2.0 * pi) * flow.wave_T * flow.wave_T
        x = clip(wavelength / flow.L_pp, self.shortest, self.longest)
        C_X = ((self.X_3 * x + self.X_2) * x + self.X_1) * x + self.X_0
        C_Y = ((self.Y_3 * x + self.Y_2) * x + self.Y_1) * x + self.Y_0
        C_N = ((self.N_3 * x + self.N_2) * x + self.N_1) * x + self.N_0
        # 0.5 rho g L_pp a^2 with a^2 = H_S^2 / 8; one H_S is left in the components.
        unit = -flow.rho * GRAVITY * flow.L_pp / 16.0 * speed(flow.wave_u, flow.wave_v)
        side = unit * flow.wave_v
        return Force(unit * flow.wave_u * C_X, side * C_Y, side * flow.L_pp * C_N)


@dataclass(frozen=True, kw_only=True)
class HeadSea(ForceModule):
    """Added resistance in mild head seas, STAWAVE-1 of ISO 15016:2015 and ITTC 7.5-04-01-01.1.

    R_AW = rho g H_S^2 B sqrt(B / L_BWL) / 16, by reflection at the bow alone, for waves from within
    45 degrees of the bow and H_S up to 2.25 sqrt(L_pp / 100 m); none for waves from elsewhere, and no
    side force or moment.  A higher sea counts as one of that height: the ship heaves and pitches there,
    which this formula cannot know.
    """

    B: Scalar = spec("m", "breadth", (1e-3, 1e3))
    L_BWL: Scalar = spec("m", "from the stem along the waterline to 95 % of the breadth", (1e-3, 1e3))

    def force(self, flow: Flow) -> Force:
        ahead = where(flow.wave_u >= magnitude(flow.wave_v), 1.0, 0.0)
        square = flow.wave_u * flow.wave_u + flow.wave_v * flow.wave_v
        square = clip(square, 0.0, 2.25 * 2.25 * flow.L_pp / 100.0)
        X = -ahead * flow.rho * GRAVITY / 16.0 * square * self.B * root(self.B / self.L_BWL)
        return Force(X, 0.0 * X, 0.0 * X)

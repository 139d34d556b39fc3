"""Wind forces by the loading functions of Blendermann (1994)."""

from __future__ import annotations

from csv import DictReader
from importlib.resources import files
from math import pi

from ..core.parameters import ParameterError, Scalar, spec, unknown
from ..core.symbolic import atan2, magnitude, speed, where
from ..core.values import dataclass
from . import Flow, Force, ForceModule


@dataclass(frozen=True, kw_only=True)
class Blendermann(ForceModule):
    """Wind forces of Blendermann (1994), J. Wind Eng. Ind. Aerodyn. 51, 339-351; Fossen (2021) 10.1.2.

    The side force acts at the centroid of the lateral area in a beam wind and moves towards the end
    that faces the wind, 0.18 L_OA for each radian off the beam.
    """

    rho_air: Scalar = spec("kg/m^3", "density of the air", (0.5, 2.0))
    A_T: Scalar = spec("m^2", "frontal area above water", (1e-6, 1e5))
    A_L: Scalar = spec("m^2", "lateral area above water", (1e-6, 1e5))
    L_OA: Scalar = spec("m", "length over all", (1e-3, 1e3))
    s_L: Scalar = spec("m", "centroid of the lateral area ahead of midship")
    C_Dt: Scalar = spec("", "drag across the ship, over the lateral area", (0.1, 2.0))
    C_Dl_bow: Scalar = spec("", "drag along the ship over the frontal area, wind ahead of the beam", (0.0, 2.0))
    C_Dl_stern: Scalar = spec("", "drag along the ship over the frontal area, wind abaft the beam", (0.0, 2.0))
    delta: Scalar = spec("", "cross-force parameter", (0.0, 1.0))

    def force(self, flow: Flow) -> Force:
        U_A = speed(flow.u_A, flow.v_A)
        c, s = flow.u_A / U_A, flow.v_A / U_A
        C_Dl_AF = where(flow.u_A < 0, self.C_Dl_stern, self.C_Dl_bow)
        along = C_Dl_AF * self.A_T / (self.A_L * self.C_Dt)
        loading = 1.0 - 2.0 * self.delta * (1.0 - along) * (c * s) * (c * s)  # sin^2 2g = 4 sin^2 g cos^2 g
        pressure = 0.5 * self.rho_air * (flow.u_A * flow.u_A + flow.v_A * flow.v_A) / loading
        X = -pressure * self.A_T * C_Dl_AF * c
        Y = -pressure * self.A_L * self.C_Dt * s  # away from the wind: to port for a wind from starboard
        off_beam = atan2(magnitude(flow.v_A), flow.u_A) - 0.5 * pi
        return Force(X, Y, (self.s_L - 0.18 * self.L_OA * off_beam) * Y)


def blendermann1994(ship_type: str) -> dict[str, float]:
    """Coefficients of `Blendermann` of one of the seventeen published types of ship.

    Args:
        ship_type: such as "tanker, loaded", in letters of either case.

    Raises:
        ParameterError: no such type; names the near ones.
    """
    with (files("seatrial.forces") / "wind_blendermann.csv").open() as table:
        types = {row.pop("ship type"): row for row in DictReader(table)}
    kind = ship_type.strip().lower()
    if kind not in types:
        raise ParameterError(unknown(ship_type, types, "ship type of Blendermann"))
    return {name: float(number) for name, number in types[kind].items()}

"""Suction of banks and closed quays: the mirror ship for the side force, and a lever for the moment.

Y = c_bank rho u^2 (A_M/L)^2 times the suction that the chart gives at the ship's place (`environment.grid`); N is Y
times a lever.  Potential flow has no moment in a straight run, and is low near the bottom: from h/d 1.5 to 1.2 the
force grows by 1.25 here where reviews speak of twice.  c_bank and x_bank belong to the ship file; no published
coefficients of banks could be opened, so x_bank is 0 by default.  A moment that turns the bow away from the bank, as
measured, has x_bank below zero.
"""

from __future__ import annotations

from ..core.parameters import Scalar, spec
from ..core.values import dataclass
from . import Flow, Force, ForceModule


@dataclass(frozen=True, kw_only=True)
class Bank(ForceModule):
    """Side force towards banks and bow-out moment, of the sections of a parabola; U^2, ahead and astern alike."""

    A_M: Scalar = spec("m^2", "midship section under water", (1e-6, 1e4))
    c_bank: Scalar = spec("", "side force over that of the mirror ship; no published value", (0.0, 10.0), default=1.0)
    x_bank: Scalar = spec("", "lever of the side force ahead of midship, in L_pp; no published value", (-1.0, 1.0),
                          default=0.0)  # fmt: skip

    def force(self, flow: Flow) -> Force:
        section = self.A_M / flow.L_pp
        Y = self.c_bank * flow.rho * flow.u * flow.u * section * section * flow.bank_v
        return Force(0.0, Y, self.x_bank * flow.L_pp * Y)

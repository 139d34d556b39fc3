"""Five ships on which faults are planted: the truth of the simulators, and what the twin is given of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from garden.others import ESSO, TWIN
from garden.run import ship_file
from garden.ships import FULL, Mmg
from garden.ships import Ship as Real
from seatrial.core.parameters import values
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.workflow.judging import estimate
from strangers.logs import sheet
from strangers.ships import BY_NAME

# The coefficients of a ship file that was fitted well are off by so much, one standard deviation.
_OFF = 0.02


@dataclass(frozen=True)
class Vessel:
    """A ship of the table.

    Attributes:
        real: the truth.
        seed: of the errors of the file that the twin is given.
        dt: between rows [s].
        noise: of the instruments, SI.
    """

    real: Real
    seed: int
    dt: float
    noise: Mapping[str, float]

    @property
    def own(self) -> float:
        """L/U [s]."""
        return self.real.length / self.real.speed

    @property
    def known(self) -> Ship:
        """What the twin is given."""
        return _known(self.real.name, self.seed)


_SEA = {"x": 0.5, "psi": 0.0015, "r": 1e-4, "u_w": 0.03, "v_north": 0.03, "U_T": 0.3, "gamma_T": 0.05}
_POND = {"x": 0.01, "psi": 0.002, "r": 1e-3, "u_w": 0.01, "v_north": 0.01, "U_T": 0.1, "gamma_T": 0.05}
COASTER: Mmg = BY_NAME["mmg_90"].ship  # type: ignore[assignment]
BOAT: Mmg = BY_NAME["mmg_24"].ship  # type: ignore[assignment]
VESSELS = {
    "kvlcc2": Vessel(FULL, 1, 1.0, _SEA), "esso_osaka_3m": Vessel(ESSO, 2, 0.5, _POND),
    "twin_virtual": Vessel(TWIN, 3, 0.5, _POND), "mmg_90": Vessel(COASTER, 4, 1.0, _SEA),
    "mmg_24": Vessel(BOAT, 5, 0.5, {**_SEA, "r": 1e-3, "psi": 0.003}),
}  # fmt: skip
"""The twin was tuned on the first two and on what the next two could not tell apart; the last one judges."""


@lru_cache
def _known(name: str, seed: int) -> Ship:
    with TemporaryDirectory() as folder:
        if name in BY_NAME:
            stranger = BY_NAME[name]
            made = estimate(sheet(stranger, Path(folder) / "sheet.toml"), Path(folder) / "ship.toml").ship
            ship = made.having(_true(VESSELS[name].real))  # type: ignore[arg-type]
        else:
            ship = load(ship_file(VESSELS[name].real, Path(folder)))
    random = np.random.default_rng([seed, 11])
    hull = {path: value for path, value in values(ship.model).items() if path.startswith("hull.") and value}
    return ship.having({path: value * (1.0 + _OFF * float(random.standard_normal())) for path, value in hull.items()})


def _true(s: Mmg) -> dict[str, float]:
    """Numbers of the truth by the paths of the package (`garden.ships`, where they stand in equations)."""
    L, mass, m = s.length, 0.5 * s.rho * s.length**2 * s.d, s.rho * s.volume
    out = {f"{room}.{name}": value for room in ("hull", "rudder", "propeller")
           for name, value in getattr(s, room).items()}  # fmt: skip
    body = {"m": m, "x_G": s.x_G, "I_zG": m * (0.25 * L) ** 2, "m_x": s.added[0] * mass, "m_y": s.added[1] * mass,
            "J_z": s.added[2] * mass * L**2}  # fmt: skip
    out |= {f"body.{name}": value for name, value in body.items()}
    return out | {
        "propeller.D_P": s.D_P, "propeller.w_P0": s.w_P0, "propeller.x_P": -0.48 * L, "rudder.A_R": s.A_R,
        "rudder.eta": s.D_P / s.H_R, "rudder.x_H": -0.464 * L, "rudder.x_R": -0.5 * L, "rudder.l_R": -0.71 * L,
    }  # fmt: skip

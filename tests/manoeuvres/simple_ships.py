"""Ships whose answers are known in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from seatrial.actuators import Actuators
from seatrial.core.parameters import Scalar, spec
from seatrial.core.symbolic import magnitude
from seatrial.manoeuvres import Settings
from seatrial.models import Model
from seatrial.models.nomoto import Nomoto
from seatrial.ships import Ship

L, U = 100.0, 5.0
SETTINGS = Settings(n_P=1.0, speed=U, L_pp=L, rudder_limit=float("inf"))


@dataclass(frozen=True, kw_only=True)
class Surge(Model):
    """u' = b n |n| - c u |u|, straight ahead; with b = 0.02 and c = 0.002 one turn per second holds 3.16 m/s."""

    b: Scalar = spec("m", "thrust over mass")
    c: Scalar = spec("1/m", "resistance over mass")

    def derivative(self, state: Any, control: Any, environment: Any) -> Any:
        u, n = state[3], control[0]
        return (u, 0.0, 0.0, self.b * n * magnitude(n) - self.c * u * magnitude(u), 0.0, 0.0)


def surge(b: float = 0.05, c: float = 0.002) -> Ship:
    return Ship("surge", Surge(b=b, c=c), Actuators(), L, U)


def norrbin(K: float = 0.05, T: float = 40.0, alpha: float = 0.0, n_1: float = 1.0) -> Ship:
    """K' = 1, T' = 2 unless told otherwise."""
    return Ship("norrbin", Nomoto(K=K, T=T, U=U, alpha=alpha, n_1=n_1), Actuators(), L, U)


UNSTABLE = norrbin(alpha=4e4, n_1=-1.0)
"""T r' - r + alpha r^3 = K delta: folds at K delta = -+2/(3 sqrt(3 alpha)), +-0.005 rad/s with the rudder midships."""

FOLD = 2.0 / (3.0 * np.sqrt(3.0 * 4e4)) / 0.05
RESIDUAL = 0.005


def measured(trial: Any, seed: int = 1, **noise: float) -> Any:
    """The run as a logger without orders would have it, with noise of the given standard deviations."""
    rng = np.random.default_rng(seed)
    kept = {n: v for n, v in trial.channels.items() if not n.endswith("_cmd")}
    noisy = {n: kept[n] + s * rng.standard_normal(len(trial)) for n, s in noise.items()}
    return type(trial)(trial.name, trial.t, {**kept, **noisy})

"""A calibration whose law is known."""

from __future__ import annotations

import numpy as np

from seatrial.belief.bands.calibration import Calibration, Left, best_share, posterior_digest
from seatrial.belief.bands.disturbance import Disturbance, Process
from virtual_logs import posterior

H = np.array([5.0, 10.0, 20.0, 40.0])
UNIT = np.array([1.0, 1.0, 0.1, 0.1, 0.1, 0.01])


def made(recordings: int = 24, windows: int = 6, *, known: bool = True, seed: int = 0) -> Calibration:
    """Errors that grow with the horizon, whose size the draws know or not; zigzags end after 20 s."""
    rng, count = np.random.default_rng(seed), recordings * windows
    usual = UNIT * (H / 10.0)[:, None]
    own = np.exp(rng.standard_normal((count, 1, 1)))
    error = usual * own * rng.standard_normal((count, len(H), 6))
    spread = usual * (own if known else np.exp(rng.standard_normal((count, 1, 1))))
    names = tuple(f"t{k}" for k in range(recordings) for _ in range(windows))
    kinds = tuple("zigzag" if k < recordings // 4 else "turning" for k in range(recordings) for _ in range(windows))
    error[np.array([kind == "zigzag" for kind in kinds]), 3] = np.nan
    left = Left(names, names, kinds, H, error, spread)
    who = Disturbance((Process("u", 1e-3, 5.0), Process("r", 2e-3, 50.0, "water")), 0.03)
    held = posterior()
    return Calibration(held.digest, posterior_digest(held), {n: f"digest of {n}" for n in names}, "measured",
                       0.01 * UNIT, who, best_share(left, 0.9), left)  # fmt: skip

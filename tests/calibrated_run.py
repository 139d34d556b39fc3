"""A calibration of known size beside a run of `fitted_run`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from seatrial.belief.bands.calibration import Calibration, Left, beside, posterior_digest, save
from seatrial.belief.bands.disturbance import Disturbance, Process
from seatrial.belief.reading import posterior

H = np.array([10.0, 25.0, 60.0, 150.0])
UNIT = np.array([1.0, 1.0, 0.06, 0.03, 0.02, 0.002])
RECORDINGS, WINDOWS = 24, 6


def calibrated(
    model: Path, *, size: float = 1.0, kinds: tuple[str, ...] = ("turning", "zigzag"), count: int = RECORDINGS
) -> Path:  # fmt: skip
    """Write model.bands.json: errors of left-out trials `size` times some usual ones, whatever the draws say."""
    rng, held, windows = np.random.default_rng(0), posterior(model, weighed=False), count * WINDOWS
    usual = size * UNIT * (H / 50.0)[:, None]
    names = tuple(f"t{k}" for k in range(count) for _ in range(WINDOWS))
    of = tuple(kinds[k % len(kinds)] for k in range(count) for _ in range(WINDOWS))
    left = Left(names, names, of, H, usual * rng.standard_normal((windows, len(H), 6)), np.ones((windows, len(H), 6)))
    who = Disturbance((Process("u", 1e-4, 5.0), Process("r", 1e-5, 50.0)), 0.005)
    made = Calibration(held.digest, posterior_digest(held), dict.fromkeys(names, "digest"), "measured", 1e-3 * UNIT,
                       who, 0.0, left)  # fmt: skip
    return save(made, beside(model))

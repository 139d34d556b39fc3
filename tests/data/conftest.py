from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import Trial

ROOT = Path(os.environ.get("SEATRIAL_DATA", Path(__file__).parents[3] / "shared" / "data"))


def real(*parts: str) -> Path:
    path = ROOT.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{path} is not here: set SEATRIAL_DATA to the folder of the public data sets")
    return path


@pytest.fixture
def data_file():
    return real


def zigzag_like(duration: float = 200.0, dt: float = 0.1, name: str = "made") -> Trial:
    """A trial that is right by construction: r follows delta, positions follow u, v_m and psi."""
    t = np.arange(0.0, duration, dt)
    delta = 0.3 * np.sign(np.sin(2 * np.pi * t / 40.0)) + 0.05
    r = np.zeros_like(t)
    for k in range(t.size - 1):
        r[k + 1] = r[k] + dt * (0.12 * delta[k] - r[k]) / 4.0
    psi = 0.3 + np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] + r[:-1]) * dt)])
    u, v_m = 0.5 - 2.0 * r**2 + 0.01 * np.sin(t / 7), -0.8 * r
    dx, dy = u * np.cos(psi) - v_m * np.sin(psi), u * np.sin(psi) + v_m * np.cos(psi)
    x = np.concatenate([[0.0], np.cumsum(0.5 * (dx[1:] + dx[:-1]) * dt)])
    y = np.concatenate([[0.0], np.cumsum(0.5 * (dy[1:] + dy[:-1]) * dt)])
    true = 1.5 + 0.2 * np.sin(t / 11)
    ahead, aside = true * np.cos(1.0 - psi) + u, true * np.sin(1.0 - psi) + v_m
    channels = {
        "x": x, "y": y, "psi": psi, "u": u, "v_m": v_m, "r": r, "delta": delta, "n_P": np.full_like(t, 10.0),
        "U_T": true, "gamma_T": np.full_like(t, 1.0), "U_A": np.hypot(ahead, aside),
        "gamma_A": np.arctan2(aside, ahead),
    }  # fmt: skip
    return Trial(name, t, channels, {}, {"ship": "made", "L_pp": 3.0, "kind": "zigzag"})


@pytest.fixture
def made() -> Trial:
    return zigzag_like()

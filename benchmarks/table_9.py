"""Which difference of protocol could give the MMG column of Wakita 2022, Table 9: one at a time, and any scale at all.

The paper's six recordings are not in the data; on those that are, the published coefficients are judged by Eq. 25
under one change after another, kind by kind.  Then the scales of the six states are left free: those that come nearest
to the printed ratios of the kinds, by non-negative least squares on the relative errors.

    SEATRIAL_DATA=DIR python benchmarks/table_9.py
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import nnls

from seatrial.core.parameters import update, values
from seatrial.data import Trial
from seatrial.data.formats import logs
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.validate.metrics import ESSO_OSAKA_SIGMA

STATES = ("x", "y", "psi", "u", "v_m", "r")
KINDS = ("random", "turning", "zigzag", "berthing")
PAPER = {"random": 0.272, "turning": 0.858, "zigzag": 1.015, "berthing": (0.036 + 0.189 + 0.100) / 3}
HERE = {"random": 0.236, "turning": 1.875, "zigzag": 1.173, "berthing": (0.126 + 0.604 + 0.650) / 3}
"""Printed, and by the published coefficients on the paper's own six recordings, as `studies/wakita2022_tables.toml`."""


def recordings() -> list[Trial]:
    """Every recording but the two that repeat part of another."""
    root = Path(os.environ["SEATRIAL_DATA"]) / "esso_osaka_frt" / "data"
    return [t for _, some in logs("frt-esso", root) for t in some if "cut" not in t.name]


def squares(ship: Ship, trial: Trial, restart: float | None, method: str = "rk4") -> np.ndarray:
    """Mean square error of each state [SI], shape (6,), heading unwrapped."""
    made = replay(ship, trial, restart=restart, method=method)
    out = []
    for name in STATES:
        apart = np.interp(made.t, trial.t, np.unwrap(trial[name]) if name == "psi" else trial[name]) - made[name]
        if name == "psi":
            apart = (apart + np.pi) % (2.0 * np.pi) - np.pi
        out.append(float(np.nanmean(apart**2)))
    return np.array(out)


def table(ship: Ship, trials: list[Trial], restart: Callable[[str], float | None], method: str = "rk4") -> np.ndarray:
    """Mean square errors by kind and state, shape (4, 6): means of the recordings of a kind by their rows."""
    rows = []
    for kind in KINDS:
        some = [t for t in trials if t.meta["kind"] == kind]
        parts = [squares(ship, t, restart(kind), method) for t in some]
        rows.append(np.average(parts, axis=0, weights=[len(t.t) for t in some]))
    return np.array(rows)


def scaled(ship: Ship, **by: float) -> Ship:
    """The ship with numbers multiplied, `__` for a dot."""
    own = values(ship.model)
    new = {key.replace("__", "."): factor * float(own[key.replace("__", ".")]) for key, factor in by.items()}
    return replace(ship, model=update(ship.model, new))


def late(trial: Trial, rows: int, names: tuple[str, ...]) -> Trial:
    """The trial with channels that many rows later."""
    moved = {n: np.roll(x, rows) if n in names else x for n, x in trial.channels.items()}
    return replace(trial, channels=moved)


def windless(ship: Ship) -> Ship:
    """The ship without a force of the wind."""
    return replace(ship, model=replace(ship.model, wind=None))


def variants(ship: Ship, trials: list[Trial]) -> Mapping[str, np.ndarray]:
    """The table under each protocol."""

    def by(kind: str) -> float | None:
        return 100.0

    wind = ("U_A", "gamma_A", "U_T", "gamma_T")
    return {
        "as here: restart 100 s, true wind": table(ship, trials, by),
        "restart in random and turning only": table(ship, trials, lambda k: 100.0 if k in KINDS[:2] else None),
        "restart 50 s": table(ship, trials, lambda k: 50.0),
        "restart 20 s": table(ship, trials, lambda k: 20.0),
        "restart 6 s, the window of the training": table(ship, trials, lambda k: 6.0),
        "Euler, 0.1 s": table(ship, trials, by, "euler"),
        "no wind": table(windless(ship), trials, by),
        "wind force half": table(scaled(ship, wind__rho_air=0.5), trials, by),
        "wind force twice": table(scaled(ship, wind__rho_air=2.0), trials, by),
        "wind 1 s later": table(ship, [late(t, 10, wind) for t in trials], by),
        "orders 1 s later": table(ship, [late(t, 10, ("n_P", "delta")) for t in trials], by),
        "no side force of the propeller": table(
            scaled(ship, **{f"propeller__{a}_{k}": 0.0 for a in "AB" for k in range(1, 9)}), trials, by),
        "rho of the sea": table(scaled(ship, body__rho=1025.0 / 998.0), trials, by),
    }  # fmt: skip


def fitted_scales(errors: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Scales 1/sigma^2 that come nearest to the target, each kind by its share of it, and what they give."""
    found, _ = nnls(errors / target[:, None], np.ones(len(target)))
    return found, errors @ found


def main() -> None:
    """Print both tables."""
    ship, trials = load("esso_osaka_3m"), recordings()
    weights = np.array([1.0 / ESSO_OSAKA_SIGMA[name] ** 2 for name in STATES])
    target = np.array([PAPER[k] / HERE[k] for k in KINDS])
    print("wanted, over the first row:", dict(zip(KINDS, target.round(2), strict=True)))
    first: np.ndarray | None = None
    for name, errors in variants(ship, trials).items():
        own = errors @ weights
        first = own if first is None else first
        scales, nearest = fitted_scales(errors, first * target)
        sigma = [f"{1 / np.sqrt(s):.3g}" if s > 0 else "inf" for s in scales]
        shares = [f"{a / b:.2f}" for a, b in zip(nearest, first * target, strict=True)]
        rows = [f"{k} {a:.3f} ({a / b:.2f})" for k, a, b in zip(KINDS, own, first, strict=True)]
        print(f"{name:42}", *rows, "| with any scale, over what is wanted:", *shares, "sigma", *sigma)
        if "as here" in name:
            for kind, row in zip(KINDS, errors * weights, strict=True):
                print(f"    {kind}:", *(f"{n} {x / row.sum():.2f}" for n, x in zip(STATES, row, strict=True)))


if __name__ == "__main__":
    main()

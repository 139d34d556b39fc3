"""Tables of captive tests of a model tanker, for the tutorial on captive tests: drift, rudder, circular motion.

The loads are those of the ship `kvlcc2_l7` with noise of half a per cent of the largest; the columns are our names.

    python examples/captive_tables.py FOLDER
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

import seatrial as st

HEAD = "U [m/s],beta [deg],r ['],delta [deg],n_P [rps],X [N],Y [N],N [N m],T [N],F_N [N]"
U, N_P, NOISE = 1.179, 11.85, 0.005


def programs() -> dict[str, list[tuple[float, float, float, float]]]:
    """Speed [m/s], drift [deg], r' and rudder [deg] of each run, as Sawada 2024 (5.3) lists the tests."""
    return {
        "drift": [(U, b, 0.0, d) for b in range(-20, 21, 5) for d in (0, -15, 15) if b or d],
        "rudder": [(k * U, 0, 0.0, d) for k in (1.0, 0.7, 0.4) for d in range(-35, 36, 5)],
        "circular": [(U, b, r, d) for b in (-10, 0, 10) for r in (-0.8, -0.4, 0.4, 0.8) for d in (0, -15, 15)],
    }


def write(folder: Path) -> None:
    """One table a program; the same noise at every call."""
    model: Any = st.load("kvlcc2_l7").model
    rng = np.random.default_rng(1)
    folder.mkdir(parents=True, exist_ok=True)
    for name, runs in programs().items():
        loads = []
        for speed, beta, turn, delta in runs:
            u, v = speed * math.cos(math.radians(beta)), -speed * math.sin(math.radians(beta))
            flow = st.forces.Flow(u, v, turn * speed / 7.0, N_P, math.radians(delta), u, v, 1000.0, 7.0, 0.46)
            loads.append(model.loads(flow, (0.0, 0.0, 0.0)))
        measured = np.array(loads, dtype=np.float64)
        measured += NOISE * np.abs(measured).max(axis=0) * rng.standard_normal(measured.shape)
        rows = [f"{speed:.4f},{beta:g},{turn:g},{delta:g},{N_P}," + ",".join(f"{one:.3f}" for one in row)
                for (speed, beta, turn, delta), row in zip(runs, measured, strict=True)]  # fmt: skip
        (folder / f"{name}.csv").write_text("\n".join([HEAD, *rows]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1] if len(sys.argv) > 1 else "captive"))

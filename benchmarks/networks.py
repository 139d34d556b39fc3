"""Networks in NumPy: prediction of a window of 100 s, alone and many together, and a run in a closed loop.

All run on one thread, so processor time is taken: the time on the clock of a machine that does nothing else.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from timing import publish

from seatrial.data import Trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.models.network import Network, initial
from seatrial.models.neural import Neural
from seatrial.ships.files import load
from seatrial.simulate.replay import replay
from seatrial.simulate.run import simulate

WINDOW = 100.0
SCALE = (0.3, 0.1, 0.05, 10.0, 0.5, 3.0, 3.0)
BAR = "< 50 ms"


def ship_of(kind: str, layers: tuple[int, ...], memory: int) -> Any:
    """The 3 m model with an untrained network whose accelerations are of its size."""
    drawn = initial(Network(kind, layers, memory=memory, scale=SCALE), 0)
    last = f"W_{len(layers)}"
    net = drawn.having({**drawn.weights, last: 0.02 * drawn.weights[last]})
    return replace(load("esso_osaka_3m"), name="net", model=Neural(dt=0.1, network=net), n_P=10.0, validity={})


def record(seconds: float) -> Trial:
    """A made-up log at 10 Hz."""
    t = 0.1 * np.arange(round(seconds / 0.1) + 1)
    still = dict.fromkeys(("y", "psi", "v_m", "r"), 0.0 * t)
    moving = {"x": 0.3 * t, "u": 0.3 + 0.0 * t, "n_P": 10 + 0 * t, "delta": 0.3 * np.sin(0.5 * t)}
    wind = {"U_T": 1.0 + 0.0 * t, "gamma_T": 1.0 + 0.0 * t}
    return Trial("log", t, {**still, **moving, **wind}, meta={})


def milliseconds(job: Callable[[], Any], repeats: int = 25) -> float:
    """Shortest processor time of repeated runs [ms]."""
    job()
    found: list[float] = []
    for _ in range(repeats):
        start = time.process_time()
        job()
        found.append(time.process_time() - start)
    return 1e3 * min(found)


def main() -> None:
    """Measure and publish."""
    paper, lstm = ship_of("forgetting", (200, 200, 200), 10), ship_of("lstm", (64, 64), 0)
    one, long = record(WINDOW), record(16 * WINDOW)
    jobs = {
        "100 s window at the paper's size (122 600 weights, m = 10)": (lambda: replay(paper, one), 1, BAR),
        "the same, each of 16 windows together": (lambda: replay(paper, long, restart=WINDOW), 16, BAR),
        "100 s window, LSTM of 64 units": (lambda: replay(lstm, one), 1, BAR),
        "100 s of a zigzag in a closed loop at the paper's size": (
            lambda: simulate(paper, Zigzag(n_P=10.0, delta=0.3, psi=0.3), speed=0.4, duration=WINDOW), 1, "-"),
    }  # fmt: skip
    rows: list[dict[str, Any]] = [
        {"what": what, "value": milliseconds(job) / share, "unit": "ms of processor time", "bar": bar}
        for what, (job, share, bar) in jobs.items()
    ]
    publish("networks", rows)


if __name__ == "__main__":
    main()

"""A step of training of the network of Wakita 2022 (Eq. 9, 122 600 weights, batch 512), by hand and as PyTorch has it.

All in one run: the rate of a matrix product, the literal equations differentiated by PyTorch, and the step of
the package.  With a GPU, its step too.
"""

from __future__ import annotations

import os
import resource
import time
from typing import Any

import numpy as np
import torch
from timing import best, publish

from seatrial.identify.networks.data import Batch
from seatrial.identify.networks.engine import Engine, Form, one_thread_each
from seatrial.models.network import Network, initial

WINDOWS, ROWS, MEMORY, WIDTH = 512, 60, 10, 200
NETWORK = initial(Network("forgetting", (WIDTH,) * 3, memory=MEMORY, scale=(0.3, 0.1, 0.05, 10.0, 0.5, 1.0, 1.0)), 0)
# Products of a step forward: m - 1 in the memory and two behind it, for each simulated row; thrice with the way back.
WORK = 3 * (ROWS - MEMORY) * (MEMORY - 1 + 2) * 2 * WINDOWS * WIDTH**2


def windows(device: str) -> Batch:
    """Windows of the size of the paper's, of noise."""
    rng = np.random.default_rng(0)

    def made(scale: float, *shape: int) -> Any:
        return torch.tensor(scale * rng.normal(size=shape), dtype=torch.float32, device=device)

    size = (ROWS, WINDOWS)
    return Batch(
        made(0.2, *size, 6), made(0.5, *size, 2), made(1.0, *size, 2), made(0.01, *size, 3), made(1.0, 9).abs(), 0.1
    )


def step(device: str, by_hand: bool, threads: int) -> Any:
    """A job that computes loss and gradient of a batch once."""
    form = Form(NETWORK, MEMORY, 0.0)
    engine, batch = Engine(form, device, threads), windows(device)
    theta = torch.tensor(engine.vector.exact(NETWORK.weights), dtype=torch.float32, device=device)

    def literal() -> None:
        engine._literal(theta, batch, True)

    def own() -> None:
        engine.losses(theta, batch)
        if device == "cuda":
            torch.cuda.synchronize()

    return own if by_hand else literal


def product() -> Any:
    """A job: the product of two large matrices."""
    a, out = torch.randn(2048, 2048), torch.empty(2048, 2048)
    return lambda: torch.mm(a, a, out=out)


def spent(job: Any, times: int) -> float:
    """Least processor time of repeated runs [s], which a busy machine lengthens little."""
    job()
    found: list[float] = []
    for _ in range(times):
        start = time.process_time()
        job()
        found.append(time.process_time() - start)
    return min(found)


def main() -> None:
    """Measure on one processor, then the step on all, and publish."""
    with one_thread_each():
        work, literal, own = (
            spent(job, times) for job, times in (
                (product(), 10), (step("cpu", by_hand=False, threads=1), 3), (step("cpu", by_hand=True, threads=1), 6),
            )
        )  # fmt: skip
        together = best(step("cpu", by_hand=True, threads=len(os.sched_getaffinity(0))), 3.0, 5)
    rate = 2 * 2048**3 / work
    rows = [
        {"what": "matrix product on one processor, 2048 x 2048, float32", "value": rate / 1e9, "unit": "GFLOP/s",
         "bar": ""},
        {"what": "a step of the printed equations by PyTorch, processor time on one", "value": literal, "unit": "s",
         "bar": ""},
        {"what": "a step of the package, processor time on one", "value": own, "unit": "s", "bar": "the line above"},
        {"what": "printed equations over the package", "value": literal / own, "unit": "", "bar": "1"},
        {"what": "share of the rate of a matrix product", "value": WORK / own / rate, "unit": "", "bar": "0.8"},
        {"what": "a step of the package on all processors, wall time", "value": together, "unit": "s", "bar": ""},
    ]
    if torch.cuda.is_available():
        there = best(step("cuda", by_hand=True, threads=1), 3.0, 5)
        rows.append({"what": f"a step on {torch.cuda.get_device_name()}", "value": there, "unit": "s", "bar": ""})
        rows.append({"what": "step rate of the GPU over all processors", "value": together / there, "unit": "",
                     "bar": "20"})
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    rows.append({"what": "largest memory of the process", "value": peak, "unit": "MB", "bar": ""})
    publish("training", rows)


if __name__ == "__main__":
    main()

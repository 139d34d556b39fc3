"""Shortest of repeated runs, and a fixed loop that shows a busy machine."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any


def best(job: Callable[[], Any], seconds: float = 1.5, least: int = 5) -> float:
    """Shortest of repeated runs [s]."""
    job()
    found: list[float] = []
    end = time.perf_counter() + seconds
    while len(found) < least or time.perf_counter() < end:
        start = time.perf_counter()
        job()
        found.append(time.perf_counter() - start)
    return min(found)


def control_loop() -> float:
    """A fixed Python loop [ms]: slower than usual, the machine is busy."""

    def loop() -> float:
        x = 0.0
        for k in range(200_000):
            x += 1.0 / (k + 1.0)
        return x

    return 1e3 * best(loop, 0.5)


def machine() -> str:
    """Cores and vector width, nothing that names the machine."""
    flags = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    width = next((name for key, name in (("avx512f", "AVX-512"), ("avx2", "AVX2")) if key in flags), "no AVX2")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{cores} cores, {width}"

"""What the scripts here share: minima of repetitions, a table, a file of results."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
TABLE = HERE.parent / "docs" / "benchmarks.md"
SCRIPTS = ("engine", "peers", "campaign", "tuning", "export", "shooting", "networks", "training", "realtime", "envs")


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
    """A fixed Python loop [ms]: slower than its usual value tells a busy machine."""

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
    return f"{len(os.sched_getaffinity(0))} cores, {width}"


def publish(name: str, rows: list[dict[str, Any]]) -> None:
    """Write results/<name>.json and the table of docs/benchmarks.md; print the rows."""
    result = {"machine": machine(), "control_loop_ms": control_loop(), "rows": rows}
    (HERE / "results").mkdir(exist_ok=True)
    (HERE / "results" / f"{name}.json").write_text(json.dumps(result, indent=1) + "\n")
    for row in rows:
        print(f"{row['what']}: {row['value']:.4g} {row['unit']} (bar {row['bar']})")
    lines = ["# Benchmarks", "", "Written by `make bench`; the shortest of repeated runs."]
    for script in SCRIPTS:
        path = HERE / "results" / f"{script}.json"
        if not path.exists():
            continue
        of = json.loads(path.read_text())
        lines += ["", f"## benchmarks/{script}.py", "",
                  f"{of['machine']}; Python control loop {of['control_loop_ms']:.1f} ms.", "",
                  "| what | measured | bar |", "|---|---|---|"]  # fmt: skip
        lines += [f"| {r['what']} | {r['value']:.4g} {r['unit']} | {r['bar']} |" for r in of["rows"]]
    TABLE.write_text("\n".join(lines) + "\n")

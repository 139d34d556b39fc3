"""What the 25 trainings of studies/wakita2022.toml cost at the paper's size, and what bounds them.

The rate of the matrix products that make up a step, for one seed and for five as one batched product, and with
half-precision products; then a step of each type at each window length, in processor time on one core, times the
updates that the study makes.  Beside the settings of the study those that it had before: 50 epochs of batches of
512 windows of 60 rows.

    SEATRIAL_DATA=DIR OMP_NUM_THREADS=1 python benchmarks/trainings.py

Writes results/trainings.json.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
import training
from timing import control_loop, machine

from seatrial.identify.networks.data import Rows
from seatrial.identify.networks.engine import one_thread_each
from seatrial.study.series import Row, read_series

ROOT = Path(__file__).parents[1]
BEFORE: dict[str, Any] = {"batch": 512, "epochs": 50, "curriculum": ()}
TYPES = ("type-1", "type-2", "type-3", "type-4", "type-5")
WINDOWS, UNITS, SEEDS, CORES = 128, 200, 5, 2


def products() -> dict[str, float]:
    """Rates [GFLOP/s] of the product of nine chains of 256 windows with the recurrent matrix."""
    rows = 9 * 256
    a, w = torch.randn(SEEDS, rows, UNITS), torch.randn(SEEDS, UNITS, UNITS)
    half = a[0].bfloat16(), w[0].bfloat16()
    jobs = {
        "one seed, float32": lambda: [a[k] @ w[k] for k in range(SEEDS)],
        "five seeds in one batched product, float32": lambda: torch.bmm(a, w),
        "one seed, bfloat16": lambda: [half[0] @ half[1] for _ in range(SEEDS)],
    }
    work = 2 * SEEDS * rows * UNITS**2
    return {name: work / training.spent(job, 20) / 1e9 for name, job in jobs.items()}


def step(row: Row, rows: int) -> float:
    """Processor time of a step of a type [s], per window."""
    settings: Any = row.cells[0].estimator
    case = training.Case(settings.kind, settings.acceleration, (UNITS,) * 3)
    training.ROWS = rows
    return training.spent(training.package(case.form, count=WINDOWS), 3) / WINDOWS


def windows(row: Row, settings: Any) -> dict[int, int]:
    """Windows seen in all epochs, by their length."""
    problem, model = row.cells[0].problem, row.ship.model
    horizons = (*settings.curriculum, settings.horizon)
    found = Rows.of(problem.trials, model, False, max(horizons))  # type: ignore[arg-type]
    share = settings.epochs / len(horizons)
    return {rows: round(share * len(found.starts(rows, settings.stride))) for rows in horizons}


def main() -> None:
    """Measure and write."""
    series = read_series(ROOT / "studies" / "wakita2022.toml")
    with one_thread_each():
        rates, rows = products(), list[dict[str, Any]]()
        for key in TYPES:
            row = series.row(key)
            settings: Any = row.cells[0].estimator
            now, before = windows(row, settings), windows(row, replace(settings, **BEFORE))
            same = next((one for one in rows if one["form"] == [settings.kind, settings.acceleration]), None)
            each = same["step_ms_per_window"] if same else {n: 1e3 * step(row, n) for n in now}
            cost = {name: sum(count * each[n] / 1e3 for n, count in seen.items())
                    for name, seen in (("now_s", now), ("before_s", before))}  # fmt: skip
            rows.append({"type": key, "form": [settings.kind, settings.acceleration], "step_ms_per_window": each,
                         **cost, "updates": sum(now.values()) // settings.batch})  # fmt: skip
            print(rows[-1], flush=True)
    total = {name: SEEDS * sum(row[name] for row in rows) / 3600 for name in ("now_s", "before_s")}
    out = {
        "what": "processor time of a training by type at the paper's size, one core, without the watched losses",
        "command": "SEATRIAL_DATA=DIR OMP_NUM_THREADS=1 python benchmarks/trainings.py", "machine": machine(),
        "control_loop_ms": control_loop(), "products_gflops": rates, "rows": rows,
        "hours_of_25_on_one_core": {"now": total["now_s"], "before": total["before_s"]},
        "hours_of_25_on_two_cores": {"now": total["now_s"] / CORES, "before": total["before_s"] / CORES},
    }  # fmt: skip
    (ROOT / "benchmarks" / "results" / "trainings.json").write_text(json.dumps(out, indent=1) + "\n")
    print({key: out[key] for key in ("products_gflops", "hours_of_25_on_one_core", "hours_of_25_on_two_cores")})


if __name__ == "__main__":
    main()

"""How CMA-ES keeps its box on the study of Suyama 2023: evaluations to a target and final objective, over seeds.

Single runs of three populations with each penalty, and the search with restarts, against the optimum of the gradient.

    python benchmarks/boxes.py
"""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from seatrial.identify.population.evolution import Evolution
from seatrial.identify.population.penalty import KINDS
from seatrial.identify.tuning.ranges import within
from seatrial.study.study import read_study

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "suyama2023_boxes.json"
RATIOS, POPULATIONS, SEEDS, TARGET = (0.2, 0.5), (12, 24, 48), tuple(range(1, 11)), 1e-4


def main() -> None:
    """Measure and write."""
    began, study, rows = time.perf_counter(), read_study(ROOT / "studies" / "suyama2023.toml"), list[dict[str, Any]]()
    estimator: Any = study.estimator
    for ratio in RATIOS:
        posed = replace(study.problem, free=within(study.problem, ratio), validation=())
        optimum = replace(estimator, starts=40).gradient(600.0).fit(posed).objective
        usual: Evolution = estimator.evolution()
        ways = [(population, replace(usual, population=population, runs=1, agree=1)) for population in POPULATIONS]
        for name in KINDS:
            for population, how in (*ways, (0, usual)):
                fits = [replace(how, penalty=name, seed=seed).fit(posed) for seed in SEEDS]
                best = [float(fit.objective) for fit in fits]
                optimum = min(optimum, *best)
                rows.append({
                    "ratio": ratio, "penalty": name, "population": population or "12 doubled to 128, restarts",
                    "objectives": best, "evaluations": [fit.evaluations for fit in fits],
                    "to_target": [reached(fit.history, population, optimum) for fit in fits] if population else [],
                    "runs": [len(fit.ends) for fit in fits],
                })  # fmt: skip
                print(f"{time.perf_counter() - began:.0f} s", line({**rows[-1], "optimum": optimum}), flush=True)
        for row in rows:
            row.setdefault("optimum", optimum)
    RESULTS.write_text(json.dumps({
        "command": "python benchmarks/boxes.py", "target": TARGET, "seeds": len(SEEDS),
        "seconds": time.perf_counter() - began, "rows": rows,
    }, indent=1) + "\n")  # fmt: skip


def reached(history: Any, population: int, optimum: float) -> int | None:
    """Evaluations until the objective is within the target of the optimum; None where it never is."""
    near = np.flatnonzero(history[:, 1] <= optimum * (1.0 + TARGET))
    return int(near[0] + 1) * population if near.size else None


def line(row: dict[str, Any]) -> str:
    """One way in one line."""
    gaps = np.array(row["objectives"]) / row["optimum"] - 1.0
    found = [n for n in row["to_target"] if n is not None]
    way = f"a_r {row['ratio']:g}, {row['penalty']}, population {row['population']}"
    return (f"{way}: gap median {np.median(gaps):.1e}, "
            f"worst {gaps.max():.1e}; {int((gaps <= TARGET).sum())} of {gaps.size} within {TARGET:g}, to it "
            f"{np.median(found) if found else float('nan'):.0f} evaluations")  # fmt: skip


if __name__ == "__main__":
    main()

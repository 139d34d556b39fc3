"""The hybrid of the 3 m Esso Osaka in five folds of FRT-DS-ESSO: each width of its residual, and their mean.

    SEATRIAL_DATA=DIR python examples/hybrid_folds.py [-o hybrid_folds.json]

The study fits every width and takes the mean of the parameters, so nothing is chosen by looking at files held out.  The
last row predicts with the mean and with the minute before each start (`predict --history 60`).
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import seatrial as st

ROOT = Path(os.environ.get("SEATRIAL_DATA", Path(__file__).parents[2] / "shared" / "data")) / "esso_osaka_frt" / "data"
STUDY = Path(__file__).parents[1] / "studies" / "esso_osaka_hybrid.toml"
KINDS = ("random", "turning", "zigzag", "berthing")
COPY = "turn_cut_14-Sep-2020_15_58_08"  # repeats part of turn_14-Sep-2020_15_58_08
FOLDS, RESTART, HISTORY = 5, 100.0, 60.0
MEAN = "mean of the widths"
CARRIED = f"the same, --history {HISTORY:g}"
Files = dict[str, list[st.Trial]]


def read_files() -> Files:
    """The files of each kind, in the order of their names."""
    read = st.reader("frt-esso")
    return {kind: [st.drop_trailing_gaps(read(f)) for f in sorted((ROOT / kind).glob("*.csv")) if f.stem != COPY]
            for kind in KINDS}  # fmt: skip


def errors(ship: st.Ship, trials: Sequence[st.Trial], history: float | None = None) -> list[st.Comparison]:
    """Predictions restarted every 100 s, against the measurement."""
    run = partial(st.replay, ship) if history is None else st.Carrier.of(ship, history).replay
    sigma = st.metrics.ESSO_OSAKA_SIGMA
    return [st.compare(t, run(t, restart=RESTART, method="euler"), label="", restart=RESTART, sigma=sigma)
            for t in trials]  # fmt: skip


def fold(study: st.Study, files: Files, number: int) -> dict[str, st.Ship]:
    """The ships fitted without the files of a fold: with each width, and with the mean of all."""
    train = tuple(t for kind in KINDS for i, t in enumerate(files[kind]) if i % FOLDS != number)
    who: Any = study.estimator
    problem = replace(study.problem, trials=train)
    found = {f"width {w:g}": values for w, (values, _) in zip(who.widths, who.each(problem), strict=True)}
    found[MEAN] = np.mean(list(found.values()), axis=0)
    vector = problem.vector
    return {label: problem.ship.having(vector.by_path(values)) for label, values in found.items()}


def main() -> None:
    """Measure, print and write."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("-o", "--out", type=Path, default=Path("hybrid_folds.json"))
    where: Path = asked.parse_args().out
    if not ROOT.is_dir():
        sys.exit(f"{ROOT}: no such folder; set SEATRIAL_DATA (public set NAOE-5thLab/FRT-DS-ESSO)")
    study, files = st.read_study(STUDY), read_files()
    held: dict[str, dict[str, list[st.Comparison]]] = {}
    for number in range(FOLDS):
        out = {kind: [t for i, t in enumerate(files[kind]) if i % FOLDS == number] for kind in KINDS}
        ships = fold(study, files, number)
        for label, ship in (*ships.items(), (CARRIED, ships[MEAN])):
            rows = held.setdefault(label, {kind: [] for kind in KINDS})
            for kind, trials in out.items():
                rows[kind] += errors(ship, trials, HISTORY if label == CARRIED else None)
        sys.stderr.write(f"fold {number + 1} of {FOLDS}\n")
    found = {label: {**{kind: st.pooled(some) for kind, some in rows.items()},
                     "together": st.pooled([c for some in rows.values() for c in some])}
             for label, rows in held.items()}  # fmt: skip
    told = {"what": "standardised error of files held out, five folds, restart 100 s",
            "command": "SEATRIAL_DATA=DIR python examples/hybrid_folds.py", **found}  # fmt: skip
    where.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    for label, one in found.items():
        figures = " ".join(f"{kind} {one[kind]:.4f}" for kind in (*KINDS, "together"))
        sys.stdout.write(f"{label}: {figures}\n")


if __name__ == "__main__":
    main()

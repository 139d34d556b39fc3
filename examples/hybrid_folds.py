"""The hybrid of the 3 m Esso Osaka on trials of FRT-DS-ESSO that its fit has not seen, beside its physics alone.

    SEATRIAL_DATA=DIR python examples/hybrid_folds.py [--folds kind day turns] [--widths 0.3 1] [-o hybrid_folds.json]

All trials of a kind, or of a day, are left out at once; five parts by turns share their days and kinds with the trials
of the fit.  The MMG model is fitted to the same trials as `studies/esso_osaka_mmg.toml` says.  The hybrid is the mean
of the fits of its study; without `--widths` their prior widths are those of the study.  The last row predicts with the
mean and with the minute before each start (`predict --history 60`).
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
FOLDS = ("kind", "day", "turns")
COPY = "turn_cut_14-Sep-2020_15_58_08"  # repeats part of turn_14-Sep-2020_15_58_08
PARTS, RESTART, HISTORY = 5, 100.0, 60.0
PHYSICS, MEAN = "MMG", "hybrid"
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


def fitted(trials: Sequence[st.Trial], widths: Sequence[float]) -> dict[str, Any]:
    """The ships fitted to some trials: the MMG model, the hybrid with each width, and with the mean of all."""
    study, plain = st.read_study(STUDY), st.read_study(STUDY.with_name("esso_osaka_mmg.toml"))
    # linted: the fits alone, without the tests of their residuals
    alone = plain.estimator.fit(replace(plain.problem, trials=tuple(trials), validation=(), linted=True))
    who: Any = study.estimator
    who = replace(who, widths=tuple(widths)) if widths else who
    problem = replace(study.problem, trials=tuple(trials), linted=True)
    found = [values for values, _ in who.each(problem)]
    last = dict(zip((f"width {who.widths[-1]:g} in full",), found[-1:], strict=True))
    ships = {label: problem.ship.having(problem.vector.by_path(values))
             for label, values in {**last, MEAN: np.mean(found, axis=0)}.items()}  # fmt: skip
    return {PHYSICS: alone.ship, **ships}


def parts(files: Files, by: str) -> list[list[st.Trial]]:
    """The trials of each part: of a kind, of a day (random_06-Aug-2020_16_24_25_1), or every fifth of each kind."""
    if by == "kind":
        return [*files.values()]
    every = [trial for some in files.values() for trial in some]
    if by == "day":
        days = dict.fromkeys(trial.name.partition("2020")[0][-7:] for trial in every)
        return [[trial for trial in every if day in trial.name] for day in days]
    return [[trial for some in files.values() for trial in some[part::PARTS]] for part in range(PARTS)]


def main() -> None:
    """Measure, print and write."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--folds", nargs="+", choices=FOLDS, default=FOLDS)
    asked.add_argument("--widths", type=float, nargs="+", default=[])
    asked.add_argument("-o", "--out", type=Path, default=Path("hybrid_folds.json"))
    given = asked.parse_args()
    if not ROOT.is_dir():
        sys.exit(f"{ROOT}: no such folder; set SEATRIAL_DATA (public set NAOE-5thLab/FRT-DS-ESSO)")
    files = read_files()
    what = "standardised error of files held out, restart 100 s; spread: standard deviation over the parts"
    settings = ["--folds", *given.folds, *(["--widths", *map(str, given.widths)] if given.widths else [])]
    command = " ".join(["SEATRIAL_DATA=DIR python examples/hybrid_folds.py", *settings])
    found: dict[str, Any] = {}
    for by in given.folds:
        found[by] = measured(files, by, given.widths)
        said = {"what": what, "command": command, **found}
        given.out.write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
    for by, rows in found.items():
        for label, one in rows.items():
            figures = " ".join(f"{name} {value:.4f}" for name, value in one.items())
            sys.stdout.write(f"by {by}, {label}: {figures}\n")


def measured(files: Files, by: str, widths: Sequence[float]) -> dict[str, dict[str, float]]:
    """Errors of each ship on trials that its fit has not seen."""
    kind = {trial.name: kind for kind, some in files.items() for trial in some}
    trials = [trial for some in files.values() for trial in some]
    held: dict[str, list[list[st.Comparison]]] = {}
    for number, out in enumerate(dealt := parts(files, by)):
        ships = fitted([trial for trial in trials if trial not in out], widths)
        for label, ship in (*ships.items(), (CARRIED, ships[MEAN])):
            held.setdefault(label, []).append(errors(ship, out, HISTORY if label == CARRIED else None))
        figures = ", ".join(f"{label} {st.pooled(some[-1]):.4f}" for label, some in held.items())
        sys.stderr.write(f"by {by}, part {number + 1} of {len(dealt)}: {figures}\n")
    return {label: told(some, kind) for label, some in held.items()}


def told(parts: Sequence[Sequence[st.Comparison]], kind: dict[str, str]) -> dict[str, float]:
    """Errors of each kind, together, and their spread over the parts."""
    every = [one for some in parts for one in some]
    alike = {name: st.pooled([one for one in every if kind[one.measured.name] == name]) for name in KINDS}
    return {**alike, "together": st.pooled(every), "spread": float(np.std([st.pooled(p) for p in parts], ddof=1))}


if __name__ == "__main__":
    main()

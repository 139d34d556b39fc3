"""The hybrid of the 3 m Esso Osaka in five folds of FRT-DS-ESSO: each width of its residual, and the width chosen anew.

    SEATRIAL_DATA=DIR python examples/hybrid_folds.py [-o hybrid_folds.json]

A figure at one width is of a setting that was picked among settings compared on these folds; where each fold chooses
its width from its own training files, the held-out files had no part in that choice.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from seatrial.data import Trial
from seatrial.data.formats.frt_esso import read
from seatrial.data.prepare import drop_trailing_gaps
from seatrial.ships import Ship
from seatrial.simulate.replay import replay
from seatrial.study.study import read_study
from seatrial.validate import Comparison
from seatrial.validate.comparison import compare, pooled
from seatrial.validate.metrics import ESSO_OSAKA_SIGMA

ROOT = Path(os.environ.get("SEATRIAL_DATA", Path(__file__).parents[2] / "shared" / "data")) / "esso_osaka_frt" / "data"
STUDY = Path(__file__).parents[1] / "studies" / "esso_osaka_hybrid.toml"
KINDS = ("random", "turning", "zigzag", "berthing")
COPY = "turn_cut_14-Sep-2020_15_58_08"  # repeats part of turn_14-Sep-2020_15_58_08
FOLDS, RESTART = 5, 100.0


def errors(ship: Ship, trials: Sequence[Trial]) -> list[Comparison]:
    """Predictions restarted every 100 s, against the measurement."""
    return [compare(t, replay(ship, t, restart=RESTART, method="euler"), label="", restart=RESTART,
                    sigma=ESSO_OSAKA_SIGMA) for t in trials]  # fmt: skip


def crossed(estimator: Any, problem: Any, files: dict[str, list[Trial]], label: str) -> dict[str, Any]:
    """Errors of the files held out, by kind and together, and the width of each fold."""
    held: dict[str, list[Comparison]] = {kind: [] for kind in KINDS}
    widths: list[float] = []
    for fold in range(FOLDS):
        train = tuple(t for kind in KINDS for i, t in enumerate(files[kind]) if i % FOLDS != fold)
        fit = estimator.fit(replace(problem, trials=train))
        found = re.search(r"prior width (\S+) by", fit.status)
        widths.append(float(found[1]) if found else float(estimator.widths[0]))
        for kind in KINDS:
            held[kind] += errors(fit.ship, [t for i, t in enumerate(files[kind]) if i % FOLDS == fold])
        sys.stderr.write(f"{label}, fold {fold + 1}: width {widths[-1]:g}\n")
    out = {kind: pooled(some) for kind, some in held.items()}
    return {"widths": widths, **out, "together": pooled([c for some in held.values() for c in some])}


def main() -> None:
    """Measure, print and write."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("-o", "--out", type=Path, default=Path("hybrid_folds.json"))
    out: Path = asked.parse_args().out
    if not ROOT.is_dir():
        sys.exit(f"{ROOT}: no such folder; set SEATRIAL_DATA (public set NAOE-5thLab/FRT-DS-ESSO)")
    files = {kind: [drop_trailing_gaps(read(f)) for f in sorted((ROOT / kind).glob("*.csv")) if f.stem != COPY]
             for kind in KINDS}  # fmt: skip
    study = read_study(STUDY)
    who: Any = study.estimator
    found = {f"width {w:g}": crossed(replace(who, widths=(w,)), study.problem, files, f"width {w:g}")
             for w in who.widths}  # fmt: skip
    found["width chosen in each fold"] = crossed(who, study.problem, files, "chosen")
    told = {"what": "standardised error of files held out, five folds, restart 100 s",
            "command": "SEATRIAL_DATA=DIR python examples/hybrid_folds.py", **found}  # fmt: skip
    out.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    for label, one in found.items():
        figures = " ".join(f"{kind} {one[kind]:.4f}" for kind in (*KINDS, "together"))
        sys.stdout.write(f"{label}: {figures}\n")


if __name__ == "__main__":
    main()

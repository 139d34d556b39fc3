"""Bands of the Esso Osaka on trials that nothing of theirs has seen: coverage and width, nested five-fold.

    SEATRIAL_DATA=DIR python benchmarks/coverage.py [-o benchmarks/results/coverage.json] [--keep DIR]

Each outer fold holds back every fifth trial of each kind.  On the others the hybrid is fitted, its residual in full
(`WIDTHS`); the calibration is made from inner fits that leave parts of them out; then the trials held back are
predicted from measured states every 100 s.  Nothing is chosen on the outer folds.  `--keep` keeps fits and calibrations
in a folder, so that a second run computes the bands only.

The width is compared with the narrowest band that is constant at each horizon and covers 95 % of the errors of all
folds together: a band that knows the answer.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from seatrial.belief.bands.calibrating import calibrated
from seatrial.belief.bands.calibration import Calibration, beside, load, save
from seatrial.belief.bands.held import ALL, GROUPS, Windows, windows
from seatrial.belief.bands.prediction import fan
from seatrial.belief.parts import left_out
from seatrial.belief.posterior import Posterior
from seatrial.data import Trial
from seatrial.data.formats.frt_esso import read
from seatrial.data.prepare import drop_trailing_gaps
from seatrial.identify import Fit, Problem
from seatrial.identify.recordings import recordings
from seatrial.models import STATES
from seatrial.simulate.replay import replay
from seatrial.study.folds import folds as parts_of
from seatrial.study.store import save_fit
from seatrial.study.stored import load_fit
from seatrial.study.study import read_study

ROOT = Path(os.environ.get("SEATRIAL_DATA", Path(__file__).parents[2] / "shared" / "data")) / "esso_osaka_frt" / "data"
STUDY = Path(__file__).parents[1] / "studies" / "esso_osaka_hybrid.toml"
KINDS = ("random", "turning", "zigzag", "berthing")
COPY = "turn_cut_14-Sep-2020_15_58_08"  # repeats part of turn_14-Sep-2020_15_58_08
FOLDS, PARTS, RESTART, LEVEL, DRAWS = 5, 5, 100.0, 0.95, 300
HORIZONS = (10.0, 50.0, 100.0)
WIDTHS = (0.3, 1.0)


def fitted(estimator: Any, problem: Problem, folder: Path | None) -> Fit:
    """The fit of an outer fold, from the folder where it is kept there."""
    if folder is not None and (folder / "model.toml").is_file():
        return load_fit(folder)
    found = estimator.fit(problem)
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        save_fit(found, folder, problem, study="coverage")
    return found


def calibration_of(held: Posterior, who: Any, problem: Problem, fit: Fit, model: Path | None) -> Calibration:
    """The calibration of an outer fold, from beside its model where it is kept there."""
    if model is not None and beside(model).is_file():
        return load(model, held)
    found = calibrated(held, left_out(who, problem, fit, held, out=parts_of(problem.trials, "recording", PARTS)))
    if model is not None:
        save(found, beside(model))
    return found


def folds(keep: Path | None) -> Iterator[tuple[Calibration, Posterior, list[Trial]]]:
    """Calibration and posterior of each outer fold, with the trials it holds back."""
    files = {kind: [drop_trailing_gaps(read(f)) for f in sorted((ROOT / kind).glob("*.csv")) if f.stem != COPY]
             for kind in KINDS}  # fmt: skip
    study = read_study(STUDY)
    who: Any = replace(study.estimator, widths=WIDTHS)
    for fold in range(FOLDS):
        begun = time.process_time()
        train = tuple(t for kind in KINDS for i, t in enumerate(files[kind]) if i % FOLDS != fold)
        problem = replace(study.problem, trials=train, validation=())
        fit = fitted(who, problem, None if keep is None else keep / f"fold-{fold}")
        held = Posterior(fit.ship, fit.free, fit.values, fit.covariance, fit.digest, {})
        found = calibration_of(held, who, problem, fit, None if keep is None else keep / f"fold-{fold}" / "model.toml")
        sys.stderr.write(f"fold {fold + 1}: {len(recordings(train))} recordings, {fit.status}; "
                         f"{time.process_time() - begun:.0f} s of processor\n")  # fmt: skip
        yield found, held, [t for kind in KINDS for i, t in enumerate(files[kind]) if i % FOLDS == fold]


def judged(kinds: Sequence[str], found: Sequence[Windows], trials: Sequence[str]) -> dict[str, Any]:
    """Coverage by group and horizon of some kinds, with the number of windows and trials."""
    some = [k for k, one in enumerate(found) if one.kind in kinds]
    error, half = (np.concatenate([getattr(found[k], name) for k in some]) for name in ("error", "half"))
    inside = np.where(np.isfinite(error), np.abs(error) <= half, np.nan)
    out: dict[str, Any] = {"trials": len({trials[k] for k in some}), "windows": int(np.isfinite(error[:, 0, 0]).sum())}
    for name, group in GROUPS.items():
        where = [STATES.index(one) for one in group]
        out[name] = {f"{h:g} s": round(float(np.nanmean(inside[:, j, where])), 4) for j, h in enumerate(HORIZONS)}
    out["together"] = round(float(np.nanmean(inside)), 4)
    shares = [np.nanmean(np.where(np.isfinite(one.error), np.abs(one.error) <= one.half, np.nan))
              for one in (found[k] for k in some)]  # fmt: skip
    out["mean of the trials"] = round(float(np.mean(shares)), 4)
    return out


def sharpness(found: Sequence[Windows]) -> dict[str, dict[str, float]]:
    """Mean half width over that of the narrowest constant band that covers, by state and horizon."""
    error, half = (np.concatenate([getattr(one, name) for one in found]) for name in ("error", "half"))
    least = np.nanquantile(np.abs(error), LEVEL, axis=0)
    ratio = np.nanmean(half, axis=0) / least
    return {f"{h:g} s": dict(zip(STATES, ratio[j].round(3).tolist(), strict=True)) for j, h in enumerate(HORIZONS)}


def main() -> None:
    """Measure, print and write."""
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("-o", "--out", type=Path, default=Path(__file__).parent / "results" / "coverage.json")
    asked.add_argument("--keep", type=Path)
    said = asked.parse_args()
    if not ROOT.is_dir():
        sys.exit(f"{ROOT}: no such folder; set SEATRIAL_DATA (public set NAOE-5thLab/FRT-DS-ESSO)")
    found: list[Windows] = []
    names: list[str] = []
    lacks: list[Mapping[str, Any]] = []
    for calibration, held, trials in folds(said.keep):
        lacking = calibration.disturbance
        lacks.append({"recordings": len(set(calibration.left.groups)), "share": calibration.share,
                      "current": lacking.current, "accelerations": [vars(p) for p in lacking.processes if p.sigma > 0]})
        for trial in trials:
            made = fan(held, calibration, trial, replay(held.ship, trial, restart=RESTART), LEVEL, restart=RESTART,
                       draws=DRAWS)  # fmt: skip
            found.append(windows(made, trial, HORIZONS))
            names.append(trial.name)
    kinds = dict.fromkeys(sorted(one.kind for one in found))
    rows = {kind: judged((kind,), found, names) for kind in kinds} | {ALL: judged(tuple(kinds), found, names)}
    told = {"what": "coverage of 95 % bands of trials held back, nested five-fold, restart 100 s",
            "command": "SEATRIAL_DATA=DIR python benchmarks/coverage.py", "level": LEVEL, "draws": DRAWS,
            "coverage": rows, "width over the narrowest constant band": sharpness(found), "folds": lacks}  # fmt: skip
    said.out.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
    for kind, row in rows.items():
        parts = "; ".join(f"{name} {' '.join(f'{100 * v:.0f}' for v in row[name].values())}" for name in GROUPS)
        count = f"{row['trials']} trials, {row['windows']} windows"
        print(f"{kind} ({count}): {parts}; together {100 * row['together']:.1f}")
    for h, row in sharpness(found).items():
        print(f"width over the narrowest constant band, {h}: {row}")


if __name__ == "__main__":
    main()

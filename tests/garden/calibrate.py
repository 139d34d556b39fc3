"""How honest the sigmas of a fit of sound logs are, and whether anything is called a fault.

    python -m garden.calibrate SHIP:WEATHER:RATE:SEEDS ... [--json FILE]      (with tests/ on PYTHONPATH)

SEEDS is a number, or FIRST-LAST; RATE in Hz, empty for that of the ship.  A current is estimated in trials that have
one.  The root mean square of the errors over their sigmas should be 1, and 95 % should be below 1.96.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from seatrial import load
from seatrial.core.parameters import near
from seatrial.data.check import check_folder
from seatrial.data.trialfile import read_trials
from seatrial.identify import Nuisance, Problem
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.workflow.data import import_logs

from .fleet import FLEET
from .logs import clean
from .run import keys, ship_file
from .ships import hidden


@dataclass(frozen=True)
class Calibration:
    """Fits of sound logs.

    Attributes:
        spec: ship, weather, rate and seeds.
        rms_z, coverage: of the errors over their sigmas, and the share of them below 1.96.
        count: number of them.
        alarms: findings of `check` of warnings and errors, by seed.
        lacking: what fits say that contradicts the model, by seed.
        factors: ratio of mean estimate to truth by parameter, and the rms of its errors over sigma.
    """

    spec: str
    rms_z: float
    coverage: float
    count: int
    alarms: dict[int, tuple[str, ...]]
    lacking: dict[int, tuple[str, ...]]
    factors: dict[str, tuple[float, float]]


def calibrated(spec: str) -> Calibration:
    """Fit sound logs of several seeds."""
    ship, weather, rate, seeds = spec.split(":")
    first, _, last = seeds.rpartition("-")
    vessel = FLEET[ship]
    truth = hidden(vessel.ship)
    off: list[list[float]] = []
    ratios: list[list[float]] = []
    alarms: dict[int, tuple[str, ...]] = {}
    lacking: dict[int, tuple[str, ...]] = {}
    for seed in range(int(first or 1), int(last) + 1):
        with tempfile.TemporaryDirectory() as scratch:
            where = Path(scratch)
            mapping = clean(ship, weather, seed, float(rate) if rate else None).write_raw(where / "raw")
            import_logs("csv", where / "raw", where / "trials", mapping)
            trials = read_trials([where / "trials"])
            published = load(ship_file(vessel.ship, where))
        right = {"current", "current:x", "current:y"} if weather == "current" else set()
        told = set(keys(check_folder(trials))) - right
        nuisance = Nuisance(current=0.3 * vessel.ship.speed) if weather == "current" else Nuisance()
        problem = Problem(published, tuple(trials), near(published.model, *truth, ratio=0.5), nuisance=nuisance)
        fit = Trajectory().fit(problem)
        if told:
            alarms[seed] = tuple(sorted(told))
        if fit.diagnosis is not None and fit.diagnosis.lacking:
            lacking[seed] = fit.diagnosis.lines
        off.append([(v - truth[f.path]) / s for f, v, s in zip(fit.free, fit.values, fit.sigma, strict=True)])
        ratios.append([v / truth[f.path] for f, v in zip(fit.free, fit.values, strict=True)])
    z, mean = np.array(off), np.mean(ratios, axis=0)
    each = np.sqrt(np.mean(z**2, axis=0))
    factors = {path: (float(m), float(e)) for path, m, e in zip(truth, mean, each, strict=True)}
    return Calibration(spec, float(np.sqrt(np.mean(z**2))), float(np.mean(np.abs(z) < 1.96)), z.size, alarms, lacking,
                       factors)  # fmt: skip


def line(one: Calibration) -> str:
    """The outcome in a few lines."""
    worst = max(one.factors.items(), key=lambda row: row[1][1])
    out = [f"{one.spec:24} rms z {one.rms_z:.3f}  coverage {one.coverage:.3f}  n {one.count:4}  "
           f"alarms {len(one.alarms)}  lacking {len(one.lacking)}  worst {worst[0]} {worst[1][1]:.2f}"]  # fmt: skip
    out += [f"  seed {seed}: check says {', '.join(told)}" for seed, told in one.alarms.items()]
    out += [f"  seed {seed}: fit says {'; '.join(told[1:4])}" for seed, told in one.lacking.items()]
    return "\n".join(out)


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("specs", nargs="+")
    parser.add_argument("--json", type=Path)
    asked = parser.parse_args(arguments)
    found: list[Calibration] = []
    for spec in asked.specs:
        found.append(calibrated(spec))
        sys.stdout.write(line(found[-1]) + "\n")
        sys.stdout.flush()
    if asked.json:
        asked.json.write_text(json.dumps([asdict(one) for one in found], indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))

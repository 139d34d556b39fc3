"""How far estimates from particulars alone are from the ships of the library, and how often their bands hold.

Each ship of examples/particulars is estimated, sails the standard trials at the speed of the published model, and with
draws of the sigmas that the estimate states.  A trial's figure is inside where the published model's lies within the
band of 95 %.  With SEATRIAL_DATA, the overshoots of the KVLCC2 that two tanks measured are compared too.

    [SEATRIAL_DATA=DIR] python benchmarks/estimate.py [--draws N]
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from seatrial.belief.bands.manoeuvring import bands
from seatrial.belief.reading import stated
from seatrial.campaign.revolutions import balanced
from seatrial.core.parameters import values
from seatrial.engine import SimulationError
from seatrial.environment import Uniform
from seatrial.manoeuvres import Manoeuvre
from seatrial.manoeuvres.initial_turning import InitialTurning
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship
from seatrial.ships.estimate import estimate
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate, time_step
from seatrial.study.study import read_study
from seatrial.validate.comparison import manoeuvre

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "estimate.json"
PARTICULARS = ROOT / "examples" / "particulars"
SHIPS = {
    "kvlcc2_l7": "kvlcc2_l7", "kcs": "kcs", "esso_osaka_3m": "esso_osaka_3m", "esso_osaka": "esso_osaka",
    "s175": "container_son_nomoto", "mariner": "mariner", "suzaku": "suzaku", "seiun_maru": "seiun_maru",
    "gms_110": "gms_110",
}  # fmt: skip
"""File of particulars and the published ship of the library."""
SEEN = ("kvlcc2_l7", "kcs", "esso_osaka_3m", "suzaku")
"""Ships whose published numbers made the scatter of the formulas."""
LEVEL, SEED, _REACH = 0.95, 1, 1.96
TEN, TWENTY, HARD = (math.radians(angle) for angle in (10.0, 20.0, 35.0))
FIGURES = {
    "advance": 1.0, "tactical_diameter": 1.0, "initial_turning_distance": 1.0, "first_overshoot": math.degrees(1.0),
    "second_overshoot": math.degrees(1.0),
}  # fmt: skip


@dataclass(frozen=True)
class Compared:
    """One figure: lengths in ship lengths, angles in degrees."""

    ship: str
    trial: str
    figure: str
    published: float
    estimated: float
    low: float
    high: float

    @property
    def inside(self) -> bool:
        return self.low <= self.published <= self.high


def trials(n_P: float) -> Iterator[tuple[str, Manoeuvre, tuple[str, ...]]]:
    for side, word in ((1.0, "starboard"), (-1.0, "port")):
        yield f"35 deg {word}", Turning(n_P, side * HARD), ("advance", "tactical_diameter")
        yield f"10/10 {word}", Zigzag(n_P, TEN, TEN, side), ("first_overshoot", "second_overshoot")
        yield f"20/20 {word}", Zigzag(n_P, TWENTY, TWENTY, side), ("first_overshoot",)
        yield f"way {word}", InitialTurning(n_P, TEN, TEN, side), ("initial_turning_distance",)


def figures(ship: Ship, policy: Manoeuvre, U: float) -> dict[str, float]:
    duration = 40.0 * ship.L_pp / U
    run = simulate(replace(ship, validity={}), policy, speed=U, duration=duration)
    return {name: one.value for name, one in policy.indices(run, ship.L_pp).items()}


def compared(name: str, draws: int) -> Iterator[Compared]:
    published, made = load(SHIPS[name]), estimate(PARTICULARS / f"{name}.toml").ship
    held, U = stated(made), published.speed
    if held is None:
        raise SystemExit(f"{name}: the estimate states no sigma")
    drawn, (_, n), (_, m) = held.draws(draws, SEED), approach(published), approach(made, U)
    bare = replace(made, validity={}, speed=U)
    vary = {f"ship.{path}": column for path, column in zip(held.names, drawn.T, strict=True)}
    yield from straight(name, published, made, (n, m), balanced(bare, vary, np.full(draws, U)))
    for (word, theirs, wanted), (_, ours, _) in zip(trials(n), trials(m), strict=True):
        try:
            truth = figures(published, theirs, U)
        except SimulationError:
            continue
        own = figures(made, ours, U)
        found = bands(bare, ours, held.names, drawn, speed=U, duration=40.0 * made.L_pp / U, dt=time_step(bare),
                      weather=Uniform())  # fmt: skip
        for figure in wanted:
            if figure in truth and figure in own:
                unit = FIGURES[figure] / (made.L_pp if FIGURES[figure] == 1.0 else 1.0)
                edges = found.edges(figure, LEVEL)
                yield Compared(name, word, figure, *(float(unit * x) for x in (truth[figure], own[figure], *edges)))


def straight(
    name: str, published: Ship, made: Ship, n_P: tuple[float, float], drawn: np.ndarray
) -> Iterator[Compared]:  # fmt: skip
    """R_0' of a published set that has one, and the revolutions that hold the speed, of one whose engine has any."""
    theirs, entry = values(published.model).get("hull.R_0"), made.entries["hull.R_0"]
    if theirs is not None:
        reach = _REACH * (entry.sigma or 0.0)
        yield Compared(name, "straight", "R_0", float(theirs), entry.given, entry.given - reach, entry.given + reach)
    if n_P[0] > 0.0 and published.n_P is None:
        low, high = np.quantile(drawn, (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL))
        yield Compared(name, "straight", "n_P", *n_P, float(low), float(high))


def measured(draws: int) -> Iterator[Compared]:
    """Both overshoots of the zigzags of HSVA and MARIN, at 7 m [deg]; rudders reverse where the tank did."""
    sys.path.insert(0, str(ROOT / "studies" / "reports"))
    from kvlcc2_captive import executed, overshoots  # type: ignore[import-not-found]

    study = read_study(ROOT / "studies" / "kvlcc2_fine_tuning.toml")
    made = estimate(PARTICULARS / "kvlcc2_l7.toml").ship
    held = stated(made)
    for trial in (*study.problem.trials, *study.test):
        policy = manoeuvre(trial)
        if held is None or not isinstance(policy, Zigzag):
            continue
        late, U = executed(trial, policy.delta, policy.psi) - policy.psi, float(trial["u"][0])
        bare = replace(made, validity={}, speed=U)
        own = replace(policy, n_P=approach(bare)[1], psi=policy.psi + late)
        long = 3.0 * trial.duration  # slow draws come to their second overshoot, too
        ran = simulate(bare, own, speed=U, duration=long)
        found = bands(bare, own, held.names, held.draws(draws, SEED), speed=U, duration=long, dt=time_step(bare),
                      weather=Uniform())  # fmt: skip
        for name, truth in zip(("first_overshoot", "second_overshoot"), overshoots(trial), strict=True):
            index = own.indices(ran, made.L_pp).get(name)
            if index is not None and math.isfinite(truth):
                four = (truth, *(x + late for x in (index.value, *found.edges(name, LEVEL))))
                yield Compared("kvlcc2_l7", trial.name, name, *(math.degrees(x) for x in four))


def shares(rows: list[Compared]) -> dict[str, Any]:
    unseen = [row for row in rows if row.ship not in SEEN] or rows
    z = [math.log(row.estimated / row.published) for row in rows if row.estimated > 0.0 < row.published]
    wide = [(row.high - row.low) / row.estimated for row in rows]
    return {"inside": round(float(np.mean([r.inside for r in rows])), 3), "of": len(rows),
            "inside, unseen ships": round(float(np.mean([r.inside for r in unseen])), 3), "of unseen": len(unseen),
            "rms error of the logarithm": round(float(np.sqrt(np.mean(np.square(z)))), 3),
            "median width over value": round(float(np.nanmedian(wide)), 3)}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=400)
    parser.add_argument("--ships", nargs="*", default=list(SHIPS))
    asked = parser.parse_args()
    tanks = list(measured(asked.draws)) if os.environ.get("SEATRIAL_DATA") else []
    for r in tanks:
        print(f"  {r.trial:30s} {r.figure:18s} measured {r.published:6.2f} estimated {r.estimated:6.2f} "
              f"band {r.low:6.2f} {r.high:6.2f} {'' if r.inside else '  OUTSIDE'}", flush=True)  # fmt: skip
    start, rows = time.perf_counter(), list[Compared]()
    for name in asked.ships:
        own = list(compared(name, asked.draws))
        rows += own
        print(f"{name}: {sum(r.inside for r in own)} of {len(own)} inside", flush=True)
        for r in own:
            print(f"  {r.trial:16s} {r.figure:26s} published {r.published:7.3g} estimated {r.estimated:7.3g} "
                  f"band {r.low:7.3g} {r.high:7.3g} {'' if r.inside else '  OUTSIDE'}", flush=True)  # fmt: skip
    real = {"measured by two tanks": shares(tanks)} if tanks else {}
    found = {**shares(rows), **real, "seconds": round(time.perf_counter() - start, 1),
             "rows": [vars(row) for row in rows]}  # fmt: skip
    print({key: value for key, value in found.items() if key != "rows"})
    if asked.ships == list(SHIPS):
        RESULTS.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()

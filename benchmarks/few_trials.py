"""Whether bands from few zigzags hold: on virtual ships that the model cannot represent, and from tank to tank.

Virtual: the KVLCC2 with every coefficient another one, by as much as towing tanks differ, with cross-flow drag, a
speed-dependent resistance and a stalling rudder that the model has not.  Six of its zigzags to 20 degrees are fitted
from the published coefficients, trials are left out in turn, and the bands of its turns at 35 degrees are held against
these.  Real, with SEATRIAL_DATA: the KVLCC2 fitted to the zigzags of one tank, bands of the overshoots of the other.

    SEATRIAL_DATA=DIR python benchmarks/few_trials.py [--ships N] [--draws N]
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from timing import machine

from seatrial.belief.parts import left_out
from seatrial.belief.posterior import Posterior
from seatrial.belief.power import Power
from seatrial.belief.weighing import power
from seatrial.campaign import Case
from seatrial.campaign.reading import whole_indices
from seatrial.core.parameters import Scalar, spec, update
from seatrial.core.symbolic import cos, magnitude, sin, speed
from seatrial.data import Array, Trial
from seatrial.environment import Uniform
from seatrial.forces import Flow, Force, Slipstream
from seatrial.forces.hull import Polynomial
from seatrial.forces.rudder_neutral import OffCentre
from seatrial.identify import Fit, Loss, Problem
from seatrial.identify.recordings import recordings
from seatrial.identify.trajectory.shooting import Trajectory
from seatrial.manoeuvres import Manoeuvre
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.study.freedom import freedom
from seatrial.study.study import read_study
from seatrial.validate.comparison import manoeuvre

ROOT = Path(__file__).parents[1]
STUDY, RESULTS = ROOT / "studies" / "kvlcc2_zigzags.toml", ROOT / "benchmarks" / "results" / "few_trials.json"
TURN, OVER = ("advance", "transfer", "tactical_diameter"), ("first_overshoot", "second_overshoot")
SPEED, N_P, DT, LEVEL = 1.18, 10.23, 0.1, 0.95
ZIGZAGS = ((10, 10, 1), (10, 10, -1), (20, 20, 1), (20, 20, -1), (10, 5, 1), (20, 5, -1))
# Sensors of a basin: m, rad, m/s, rad/s.
NOISE = {"x": 0.005, "y": 0.005, "psi": 0.0005, "u": 0.002, "v_m": 0.002, "r": 0.0002}


@dataclass(frozen=True, kw_only=True)
class OtherHull(Polynomial):
    """A hull with cross-flow drag, and a resistance that changes with speed by another power."""

    C_Y: Scalar = spec("'", "cross-flow drag of sway")
    C_N: Scalar = spec("'", "damping of yaw by its square")
    k_X: Scalar = spec("", "growth of the resistance coefficient with speed")
    U_0: Scalar = spec("m/s", "speed at which the coefficient is R_0")

    def force(self, flow: Flow) -> Force:
        v, r, area = flow.v_m, flow.r * flow.L_pp, 0.5 * flow.rho * flow.L_pp * flow.d
        more = self.R_0 * self.k_X * (speed(flow.u, v) / self.U_0 - 1.0) * flow.u * magnitude(flow.u)
        drag = Force(-area * more, -area * self.C_Y * v * magnitude(v), -area * flow.L_pp * self.C_N * r * magnitude(r))
        return super().force(flow) + drag


@dataclass(frozen=True, kw_only=True)
class OtherRudder(OffCentre):
    """A rudder that loses a part of its force with the square of the angle of attack."""

    stall: Scalar = spec("", "share lost at a right angle")

    def force(self, flow: Flow, slipstream: Slipstream) -> Force:
        u_R, v_R = self._inflow(flow, slipstream)
        delta = flow.delta + self.delta_0
        attack = (u_R * sin(delta) - v_R * cos(delta)) / speed(u_R, v_R)
        return Force(*((1.0 - self.stall * attack * attack) * one for one in super().force(flow, slipstream)))


def published() -> Ship:
    """The published ship that the study begins from."""
    return load(STUDY.parent / "kvlcc2_l7_neutral.toml")


def free_of(ship: Ship) -> Any:
    """The free parameters of the study."""
    return freedom(ship.model, tomllib.loads(STUDY.read_text())["free"])[0]


def truth(ship: Ship, rng: np.random.Generator) -> Ship:
    """Another ship: coefficients drawn as wide as the priors of the study, and forces that the model has not."""
    moved = {f.path: f.prior + f.sigma * float(np.clip(rng.standard_normal(), -2, 2)) for f in free_of(ship)}
    model: Any = update(ship.model, moved)
    own, blade = ({f.name: getattr(part, f.name) for f in fields(part)} for part in (model.hull, model.rudder))
    drag = {"C_Y": rng.uniform(0.0, 0.3), "C_N": rng.uniform(0.0, 0.01), "k_X": rng.uniform(-0.3, 0.3), "U_0": SPEED}
    hull = OtherHull(**own, **drag)
    rudder = OtherRudder(**blade, stall=rng.uniform(0.0, 0.6))
    return replace(ship, model=replace(model, hull=hull, rudder=rudder), validity={})


def zigzags(ship: Ship, rng: np.random.Generator) -> tuple[Trial, ...]:
    """Its zigzags, with the noise of a basin."""
    return tuple(_noisy(simulate(ship, _zigzag(*one), speed=SPEED, duration=120.0, dt=DT, name=f"{k} {one}"), rng)
                 for k, one in enumerate(ZIGZAGS))  # fmt: skip


def _zigzag(delta: float, psi: float, side: float) -> Zigzag:
    return Zigzag(n_P=N_P, delta=math.radians(delta), psi=math.radians(psi), side=side)


def _noisy(trial: Trial, rng: np.random.Generator) -> Trial:
    channels = {name: trial[name] + NOISE.get(name, 0.0) * rng.standard_normal(len(trial)) for name in trial.channels}
    return replace(trial, channels=channels)


def turn(side: float) -> Turning:
    """A turn at 35 degrees."""
    return Turning(n_P=N_P, delta=math.radians(math.copysign(35.0, side)))


def of_ship(ship: Ship) -> dict[str, float]:
    """Indices of both turns and of a 20/20 zigzag to port after starboard of one ship; SI units."""
    found: dict[str, float] = {}
    for label, policy, names, seconds in MEASURED:
        got = policy.indices(simulate(ship, policy, speed=SPEED, duration=seconds, dt=DT), ship.L_pp)
        found |= {f"{label} {name}": got[name].value for name in names if name in got}
    return found


MEASURED = (
    ("turn 35 starboard", turn(1), TURN, 160.0), ("turn 35 port", turn(-1), TURN, 160.0),
    ("zigzag 15/15", _zigzag(15, 15, 1), OVER, 120.0),
)  # fmt: skip


def drawn(fit: Fit, draws: Array) -> dict[str, Array]:
    """The same of many draws of the parameters of a fit."""
    found: dict[str, Array] = {}
    for label, policy, names, seconds in MEASURED:
        start = np.array([[0.0, 0.0, 0.0, SPEED, 0.0, 0.0]])
        got = runs(fit, draws, policy, start, seconds)
        found |= {f"{label} {name}": got[name] for name in names}
    return found


def runs(fit: Fit, draws: Array, policy: Manoeuvre, start: Array, seconds: float) -> Mapping[str, Array]:
    """Indices of a manoeuvre for many draws."""
    steps, ship = round(seconds / DT) + 1, replace(fit.ship, validity={})
    vary = {f"ship.{one.path}": column for one, column in zip(fit.free, draws.T, strict=True)}
    case = Case("few", ship, policy, float(start[0, 3]), seconds, DT)
    names = TURN if isinstance(policy, Turning) else OVER
    return whole_indices(case, names, vary, start, Uniform().series(DT, steps)[None], len(draws), steps, 2)[0]


def posteriors(fit: Fit, found: Power, count: int) -> dict[str, Array]:
    """Draws of the fit's own posterior, and of the one that left-out trials have widened."""
    return {label: Posterior(fit.ship, fit.free, fit.values, fit.covariance, fit.digest, {}, one).draws(count, 1)
            for label, one in (("fit", None), ("left out", found))}  # fmt: skip


def fitted(problem: Problem, estimator: Any) -> tuple[Fit, Power]:
    """A fit, and what its left-out trials say."""
    fit = estimator.fit(problem)
    held = Posterior(fit.ship, fit.free, fit.values, fit.covariance)
    parts = left_out(estimator, problem, fit, held, out=recordings(problem.trials))
    return fit, power(fit, problem, estimator, [*parts])


def virtual(count: int, draws: int) -> Iterator[dict[str, Any]]:
    """One ship after the other: truth, published and bands of each index."""
    ship, rng = published(), np.random.default_rng(20261123)
    before, loss = of_ship(ship), Loss({"psi": 0.035, "r": 0.0026, "u": 0.02, "v_m": 0.01}, 60.0)
    estimator = Trajectory(window=30.0, every=5, initial="measured", tolerance=1e-6, threads=2)
    made = 0
    while made < count:
        other = truth(ship, rng)
        true = of_ship(other)
        # a ship that nobody would build, or that does not finish its manoeuvres
        if len(true) < len(before) or not 2.0 < true["turn 35 starboard tactical_diameter"] / ship.L_pp < 6.0:
            continue
        made += 1
        fit, found = fitted(Problem(ship, zigzags(other, rng), free_of(ship), loss), estimator)
        bands = {label: drawn(fit, some) for label, some in posteriors(fit, found, draws).items()}
        own = of_ship(replace(fit.ship, validity={}))
        yield {"factor": found.factor, "left": found.left, "indices": {name: {
            "true": value, "published": before[name], "fit": own.get(name, math.nan),
            "bands": {label: edges(some[name]) for label, some in bands.items()},
        } for name, value in true.items()}}  # fmt: skip


def edges(values: Array) -> list[float]:
    """Edges of the band of 95 %, of the draws that reach it."""
    return [float(one) for one in np.nanquantile(values, (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL))]


def summed(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Coverage and mean width of the bands of some indices, and mean errors of the values themselves."""
    true = np.array([one["true"] for one in rows])
    out: dict[str, Any] = {"count": len(rows)}
    for name in ("published", "fit"):
        out[f"error of {name}"] = float(np.nanmean(np.abs(np.array([one[name] for one in rows]) - true)))
    for name in ("fit", "left out"):
        band = np.array([one["bands"][name] for one in rows])
        held = (band[:, 0] <= true) & (true <= band[:, 1])
        out[f"bands of {name}"] = {"coverage": float(held.mean()), "width": float((band[:, 1] - band[:, 0]).mean())}
    return out


def by_index(ships: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Of the virtual ships, by index, both sides of a turn together; lengths in L, angles in degrees."""
    ended, L = {name.split()[-1] for name in ships[0]["indices"]}, published().L_pp
    found: dict[str, Any] = {}
    for name in sorted(ended):
        scale = math.degrees(1.0) if name.endswith("overshoot") else 1.0 / L
        rows = [scaled(one, scale) for ship in ships for key, one in ship["indices"].items() if key.endswith(name)]
        found[name] = summed(rows)
    return found


def scaled(row: Mapping[str, Any], scale: float) -> dict[str, Any]:
    """One index in another unit."""
    bands = {label: [scale * one for one in pair] for label, pair in row["bands"].items()}
    return {"bands": bands, **{name: scale * row[name] for name in ("true", "published", "fit")}}


def real(draws: int) -> dict[str, Any]:
    """From tank to tank, from small rudder angles to great ones, and the turns that all zigzags give."""
    study = read_study(STUDY)
    every = study.problem.trials
    hsva, marin = ([t for t in every if t.name.startswith(name)] for name in ("HSVA", "MARIN"))
    small = [t for t in hsva if float(np.nanmax(np.abs(t["delta"]))) < math.radians(18.0)]
    others = [t for t in every if t not in small]
    out: dict[str, Any] = {}
    for label, some, rest in (
        ("HSVA to MARIN", hsva, marin), ("MARIN to HSVA", marin, hsva), ("HSVA to 15 deg to the others", small, others),
    ):  # fmt: skip
        fit, found = fitted(replace(study.problem, trials=tuple(some)), study.estimator)
        rows = list(overshot(fit, posteriors(fit, found, draws), rest))
        out[label] = {"fitted": len(some), "factor": found.factor, **summed(rows), "rows": rows}
    fit, found = fitted(study.problem, study.estimator)
    bands = {label: drawn(fit, some) for label, some in posteriors(fit, found, draws).items()}
    before, own = (of_ship(replace(ship, validity={})) for ship in (published(), fit.ship))
    out["all zigzags"] = {"fitted": len(every), "factor": found.factor, "errors": dict(found.errors), "turns": {
        name: {"published": before[name] / fit.ship.L_pp, "value": own[name] / fit.ship.L_pp,
               **{label: [one / fit.ship.L_pp for one in edges(some[name])] for label, some in bands.items()}}
        for name in own if name.startswith("turn")
    }}  # fmt: skip
    return out


def overshot(fit: Fit, draws: Mapping[str, Array], trials: Sequence[Trial]) -> Iterator[dict[str, Any]]:
    """Both overshoots of measured zigzags and their bands [deg]; rudders reverse where the tank did."""
    sys.path.insert(0, str(ROOT / "studies" / "reports"))
    from kvlcc2_captive import executed, overshoots  # type: ignore[import-not-found]

    for trial in trials:
        policy = manoeuvre(trial)
        if not isinstance(policy, Zigzag):
            continue
        late = executed(trial, policy.delta, policy.psi) - policy.psi
        held = replace(policy, n_P=float(np.nanmean(trial["n_P"])), psi=policy.psi + late)
        start = np.array([[0.0, 0.0, 0.0, *(float(trial[name][0]) for name in ("u", "v_m", "r"))]])
        bands = {label: runs(fit, some, held, start, trial.duration) for label, some in draws.items()}
        three = (overshoots(trial), *(overshoots(trial, ship) for ship in (published(), fit.ship)))
        for k, (true, before, own) in enumerate(zip(*three, strict=True)):
            if math.isfinite(true):
                row = {"true": true, "published": before, "fit": own,
                       "bands": {label: edges(some[OVER[k]] + late) for label, some in bands.items()}}  # fmt: skip
                yield {"trial": trial.name, "overshoot": k + 1, **scaled(row, math.degrees(1.0))}


def main() -> None:
    """Virtual ships, kept as each is done; then the tanks, where their data are at hand."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ships", type=int, default=40)
    parser.add_argument("--draws", type=int, default=400)
    asked = parser.parse_args()
    told: dict[str, Any] = {
        "what": "bands of 95 % from few zigzags: coverage, mean width, mean errors; lengths in L, angles in degrees",
        "machine": machine(), "command": "SEATRIAL_DATA=DIR python benchmarks/few_trials.py", "draws": asked.draws,
    }  # fmt: skip
    if os.environ.get("SEATRIAL_DATA"):
        told["tanks"] = real(asked.draws)
    ships: list[dict[str, Any]] = []
    for one in virtual(asked.ships, asked.draws):
        ships.append(one)
        told["virtual"] = {"ships": len(ships), "factors": [s["factor"] for s in ships], **by_index(ships)}
        RESULTS.write_text(json.dumps(told, indent=1) + "\n")


if __name__ == "__main__":
    main()

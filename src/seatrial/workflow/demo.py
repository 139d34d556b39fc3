"""Complete worked example on built-in ships: a virtual sea trial, checks, a fit, validation, a report."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ..core.parameters import Free, read
from ..data import Trial
from ..data.check import check_folder
from ..data.trialfile import write_trials
from ..identify import Fit, Loss, Nuisance, Problem
from ..identify.lint import lint, raise_on_errors
from ..manoeuvres.turning import Turning
from ..manoeuvres.zigzag import Zigzag
from ..sensors import Sensors
from ..ships import Ship
from ..ships.files import load
from ..simulate.run import approach, simulate
from ..study.cells import PAGE
from ..study.store import MODEL, save_fit
from ..validate.metrics import scales
from .comparing import compared
from .request import DEGREE, make_folder

SHIP, SEED = "kvlcc2_l7", 20
# The hull is unstable on course: from a noisy start even the true ship drifts away within minutes.
RESTART = 60.0

HIDDEN: Mapping[str, float] = MappingProxyType({
    "hull.R_0": 1.15, "hull.Y_v": 0.82, "hull.Y_r": 1.2, "hull.N_v": 1.15, "hull.N_r": 0.85,
    "hull.N_vvr": 1.2, "hull.X_vr": 0.8, "propeller.w_P0": 0.9, "rudder.epsilon": 0.88, "rudder.kappa": 1.15,
    "rudder.gamma_Rp": 1.18, "rudder.gamma_Rn": 0.85,
})  # fmt: skip
"""What differs between the ship at sea and its handbook, as factors; unknown to the fit."""

NOISE: Mapping[str, float] = MappingProxyType({
    "x": 0.03, "y": 0.03, "psi": 0.1 * DEGREE, "u": 0.005, "v_m": 0.005, "r": 0.05 * DEGREE,
})  # fmt: skip
"""Standard deviation of a GNSS receiver, a gyro and a log at model scale, SI units."""

_TRAINING = ((35, None, 1), (20, None, -1), (10, 10, 1), (20, 20, -1), (15, 5, 1))
_UNSEEN = ((35, None, -1), (25, None, 1), (15, 15, 1))


def tell(out: Path, say: Callable[[str], None]) -> dict[str, Any]:
    """Run the demo; writes trials/, report.html, report.json, model.toml, fit.json, history.csv, fit.npz to `out`.

    Returns:
        What happened: `lines` for a reader, and the numbers.
    """
    from ..identify.trajectory.shooting import Trajectory

    handbook = load(SHIP)
    truth = handbook.having({path: factor * read(handbook.model, path) for path, factor in HIDDEN.items()})
    rng = np.random.default_rng(SEED)
    say("a virtual sea trial, with sensor noise")
    training, unseen = (tuple(_trial(truth, *m, rng) for m in part) for part in (_TRAINING, _UNSEEN))
    make_folder(out / "trials")
    write_trials((*training, *unseen), out / "trials")
    findings = [str(f) for f in check_folder((*training, *unseen))]
    say("a fit from the handbook's values")
    usual = {path: float(read(handbook.model, path)) for path in HIDDEN}
    free = tuple(Free(path, value, prior=value, sigma=0.3 * abs(value)) for path, value in usual.items())
    # White sensor noise: every sample counts, and the start of each window is no better known than the rest.
    problem = Problem(handbook, training, free, Loss(NOISE, correlation=0.0), Nuisance(initial=NOISE))
    raise_on_errors(lint(problem))
    fit = Trajectory(window=200.0, every=5, method="rk4", tolerance=1e-8).fit(problem)
    save_fit(fit, out, problem, study="demo", test=unseen)
    say("validation on manoeuvres the fit has not seen")
    pooled = _report(fit, problem, unseen, findings, out)
    return _summary(fit, truth, findings, pooled, out)


def _trial(ship: Ship, rudder: float, heading: float | None, side: int, rng: np.random.Generator) -> Trial:
    """One recorded manoeuvre: ten samples a second, every channel with its noise."""
    U, n_P = approach(ship)
    policy = (Turning(n_P, side * rudder * DEGREE) if heading is None
              else Zigzag(n_P, rudder * DEGREE, heading * DEGREE, side))  # fmt: skip
    set_points = f"{rudder}" if heading is None else f"{rudder}_{heading}"
    name = f"{policy.kind}_{set_points}_{'starboard' if side > 0 else 'port'}"
    run = _with_approach(simulate(ship, policy, speed=U, duration=180.0, dt=0.02, every=5, name=name), U, n_P)
    recorded = Sensors(noise=NOISE).read(run, rng)
    return replace(recorded, meta={**recorded.meta, "source": "virtual sea trial of seatrial demo"})


def _with_approach(run: Trial, U: float, n_P: float) -> Trial:
    """The run after 20 s of the steady straight approach that a logger records before the execute."""
    before = np.arange(-20.0, -0.05, 0.1)
    steady = {"x": U * before, "u": np.full_like(before, U), "n_P": np.full_like(before, n_P),
              "n_P_cmd": np.full_like(before, n_P)}  # fmt: skip
    straight = np.zeros_like(before)
    channels = {n: np.concatenate([steady.get(n, straight), v]) for n, v in run.channels.items()}
    return replace(run, t=np.concatenate([before, run.t]), channels=channels)


def _report(
    fit: Fit, problem: Problem, unseen: tuple[Trial, ...], findings: list[str], out: Path
) -> dict[str, float]:
    from ..core.version import __version__
    from ..report.evidence import assumptions
    from ..report.report import Report

    comparisons, _ = compared(load(out / MODEL), unseen, RESTART, scales(unseen, None))
    report = Report(
        "A virtual sea trial of KVLCC2 (7 m)", comparisons, fit, tuple(t.name for t in problem.trials),
        tuple(findings), assumptions(fit.ship, [f.path for f in fit.free]),
        provenance={"command": "seatrial demo", "version": f"seatrial {__version__}", "seed": str(SEED)},
    )  # fmt: skip
    report.write(out / PAGE)
    return report.pooled


def _summary(
    fit: Fit, truth: Ship, findings: list[str], pooled: Mapping[str, float], out: Path
) -> dict[str, Any]:
    exact = np.array([read(truth.model, f.path) for f in fit.free])
    away = np.abs(fit.values - exact) / fit.sigma
    identified = sum(v.status == "identified" for v in fit.verdicts)
    lines = [
        f"ship        {SHIP}: {len(HIDDEN)} parameters are up to 20 % off their handbook values, unknown to the fit",
        f"trials      {len(_TRAINING)} for the fit, {len(_UNSEEN)} kept back; noise of GNSS, gyro and log",
        f"checks      {len(findings)} findings" + (f", such as: {findings[0]}" if findings else ""),
        f"fit         {fit.status} in {fit.seconds:.1f} s, {fit.evaluations} evaluations",
        f"truth       {int((away < 3).sum())} of {away.size} parameters within 3 sigma of it",
        f"verdicts    {identified} of {len(fit.verdicts)} identified",
        *(f"error       {label}: {value:.4g} (standardised, unseen trials)" for label, value in pooled.items()),
        f"wrote       {out / PAGE}, {out / MODEL}, {out / 'trials'}",
    ]
    return {"lines": lines, "standardised": dict(pooled), "within_3_sigma": int((away < 3).sum()),
            "parameters": away.size, "seconds": fit.seconds, "report": str(out / PAGE),
            "model": str(out / MODEL)}  # fmt: skip

"""A run folder with a fit of known quality, without the time that a fit takes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from seatrial.core.parameters import Free, read
from seatrial.data import Array, Trial
from seatrial.identify import Fit, Problem, Verdict
from seatrial.identify.diagnosis.findings import Diagnosis
from seatrial.identify.nuisance import EVERY
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate
from seatrial.study.store import save_fit

PATHS = ("hull.Y_v", "hull.N_r", "rudder.kappa")
NOISE = {"x": 0.03, "y": 0.03, "psi": 0.002, "u": 0.005, "v_m": 0.005, "r": 0.001}
DEGREE = np.pi / 180.0


def truth() -> Ship:
    """The ship that every trial is of."""
    return load("kvlcc2_l7")


def trial(rudder: float, heading: float | None = None, side: int = 1, seed: int = 0, duration: float = 100.0) -> Trial:
    """A turn, or a zigzag, in degrees, with the noise of instruments."""
    ship, rng = truth(), np.random.default_rng(seed)
    U, n_P = approach(ship)
    policy = (Turning(n_P, side * rudder * DEGREE) if heading is None
              else Zigzag(n_P, rudder * DEGREE, heading * DEGREE, side))  # fmt: skip
    run = simulate(ship, policy, speed=U, duration=duration, dt=0.1, every=5)
    name = f"{policy.kind}_{rudder:g}_{side:+d}"
    noisy = {n: run[n] + s * rng.standard_normal(len(run)) for n, s in NOISE.items()}
    return replace(run.having(**noisy), name=name, meta={**run.meta, "source": "test"})


def covariance(share: float) -> Array:
    """Of independent parameters with this relative deviation."""
    values = np.array([float(read(truth().model, path)) for path in PATHS])
    return np.diag((share * values) ** 2)


def saved(
    folder: Path, trials: Sequence[Trial], *, share: float = 0.01, off: float = 0.0, test: Sequence[Trial] = (),
    file: str = "", text: str = "", form: float = 0.0,
    errors: Mapping[str, float] | None = None,
) -> Path:  # fmt: skip
    """model.toml of a fit whose parameters are off by a share of their values.

    Args:
        share: relative deviation of the posterior.
        off: error of the estimate, as a share of the value.
        errors: of instruments that all trials share, as the fit has found them.
        form: share of the variance that is of the form, as a diagnosis has it; none is made for zero.
    """
    ship = truth()
    folder.mkdir(exist_ok=True)
    start = np.array([float(read(ship.model, path)) for path in PATHS])
    value = start * (1.0 + off)
    free = tuple(Free(path, float(one), prior=float(one), sigma=0.3 * abs(float(one)))
                 for path, one in zip(PATHS, start, strict=True))  # fmt: skip
    C = covariance(share)
    fit = Fit(
        ship.having(dict(zip(PATHS, value.tolist(), strict=True))), free, value, np.sqrt(np.diag(C)), C, np.ones(3), (),
        tuple(Verdict(path, "identified", "fine") for path in PATHS), np.array([[0, 2.0, np.nan, 0.1]]), 2.0, 0.1, 1,
        "done", "digest-of-this-fit", diagnosis=Diagnosis(form=form) if form else None,
        nuisances={} if errors is None else {EVERY: errors},
    )  # fmt: skip
    return save_fit(fit, folder, Problem(ship, tuple(trials), free), study="s", test=test, file=file, text=text)

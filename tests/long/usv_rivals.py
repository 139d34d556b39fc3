"""What the study of the catamaran is compared with: simpler and richer models, fitted and driven alike."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from seatrial.core.parameters import Free
from seatrial.data import Trial
from seatrial.data.check.track import own_samples
from seatrial.identify.filters.forecast import forecasts
from seatrial.models.nomoto import Nomoto
from seatrial.study.data import kalman

HORIZONS = (10.0, 30.0)
YAW = "damping.N_u"
# Fields of [data.smoother]; the same for every rival, in its own words.
COMMON = {"position": 0.02, "heading": 0.01, "antenna": (0.0, 0.0), "delay": 0.0}
WALK = {"u": 0.03, "v_m": 0.03, "r": 0.03}


def free(path: str, start: float, sigma: float, low: float = -np.inf, high: float = np.inf) -> Free:
    return Free(path, start, low, high, start, sigma)


@dataclass(frozen=True)
class Rival:
    """A model, what is fitted of it, and which disturbances its filter may find."""

    ship: Any
    free: tuple[Free, ...]
    disturbances: dict[str, float]
    walk: dict[str, float]
    current: float = 0.01
    seen: tuple[str, ...] = ()  # what it is fitted to; all six states where none is named

    def filter(self, **more: Any) -> Any:
        said = {**COMMON, "current": self.current, "process": {**WALK, **self.walk}, "parameters": self.disturbances}
        return kalman(SimpleNamespace(**{**said, **more}), self.ship)

    def fitted(self, study: Any, smoothed: Trial, **estimator: Any) -> Rival:
        """The rival with its numbers from one smoothed run; disturbances begin at none."""
        sigma = {k: v for k, v in study.problem.loss.sigma.items() if k in (self.seen or study.problem.loss.sigma)}
        problem = replace(
            study.problem, ship=self.ship, trials=(smoothed,), free=self.free,
            loss=replace(study.problem.loss, sigma=sigma),
        )  # fmt: skip
        fit = replace(study.estimator, **estimator).fit(problem)
        return replace(self, ship=fit.ship.having(dict.fromkeys(self.disturbances, 0.0)))

    def errors(self, raw: Trial, **more: Any) -> dict[float, tuple[float, float, float]]:
        """Position [m], heading [rad] and last position [m], root mean square, by horizon [s]."""
        found = self.filter(**more).run(self.ship, own_samples(raw))
        return {h: forecasts(found, h, every=5.0, begin=20.0).rms() for h in HORIZONS}


def steered(trial: Trial) -> Trial:
    """The trial with half the sum of the throttles as n_P and their difference as delta: what Nomoto knows."""
    port, starboard = trial["throttle_port"], trial["throttle_starboard"]
    both = trial.having(n_P=0.5 * (port + starboard), delta=port - starboard)
    return replace(both, meta={**both.meta, "held": [*both.meta["held"], "n_P", "delta"]})


def rivals(study: Any) -> dict[str, Rival]:
    ship, six = study.problem.ship, study.problem.free
    bare = {"notes": {}, "n_P": None}
    nomoto = replace(ship, model=Nomoto(K=0.3, T=0.5, U=0.7), **bare)
    still = replace(ship, model=Nomoto(K=1e-9, T=1e6, U=0.7), **bare)
    more = (
        free("damping.X_uu", -0.1, 0.3, -10.0, 0.0), free("damping.N_v", 0.0, 0.5),
        *(free(f"thrusters.{side}.T_2", 0.2, 0.5, 0.0, 20.0) for side in ("port", "starboard")),
    )  # fmt: skip
    fossen = {"disturbances": {YAW: 0.05}, "walk": {YAW: 0.003}}
    turn = (free("K", 0.3, 0.2, 0.01, 5.0), free("T", 0.5, 0.3, 0.15, 10.0), free("delta_r", 0.0, 0.1))
    return {
        "constant velocity": Rival(still, (), {}, {}, 0.0),
        "Nomoto": Rival(nomoto, turn, {"delta_r": 0.1}, {"delta_r": 0.01}, 0.0, ("psi", "r")),
        "6 parameters": Rival(ship, six, **fossen),
        "10 parameters": Rival(ship, (*six, *more), **fossen),
    }

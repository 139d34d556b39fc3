"""The tug of You 2023: 22 parameters from 12 manoeuvres (4390 samples), by the engine and by IPOPT; 100 long runs."""

from __future__ import annotations

import resource
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from timing import best, publish

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from seatrial.identify.shooting.logo import Shooting
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.simulate.run import simulate
from tug_trials import COLD, NOISE, TRUTH, problem  # pyright: ignore


def long_runs(count: int) -> tuple[Any, ...]:
    """Zigzags of 1000 samples at as many speeds and angles."""
    rng, out = np.random.default_rng(1), []
    for k in range(count):
        policy = Zigzag(n_P=float(rng.uniform(3.0, 10.0)), delta=float(rng.uniform(0.15, 0.5)), psi=0.35)
        run = simulate(TRUTH, policy, speed=0.5, duration=199.8, dt=0.2, name=f"zigzag {k}")
        out.append(Sensors(NOISE).read(run, rng))
    return tuple(out)


def once(estimator: Shooting, told: Any) -> tuple[float, Any]:
    """Seconds and the fit."""
    began = time.perf_counter()
    fit = estimator.fit(told)
    return time.perf_counter() - began, fit


def main() -> None:
    """Measure and publish."""
    told = problem(start=COLD)
    warm, cold = Shooting(), Shooting(schedule="go", starts=1)
    fit = warm.fit(told)
    by_ipopt = Shooting(schedule="go", back_end="ipopt", starts=1)
    seconds, other = once(by_ipopt, told)
    rows = [
        {"what": "tug, 22 parameters, LO then GO", "value": best(lambda: warm.fit(told)), "unit": "s", "bar": "0.5"},
        {"what": "tug, 22 parameters, GO from zero damping", "value": best(lambda: cold.fit(told)), "unit": "s",
         "bar": "2"},
        {"what": "tug, 22 parameters, IPOPT Gauss-Newton from zero damping", "value": seconds, "unit": "s", "bar": "8"},
        {"what": "objective of IPOPT against the engine, relative", "value": abs(other.objective / fit.objective - 1.0),
         "unit": "", "bar": "1e-6"},
    ]
    runs = long_runs(100)
    for count in (10, 100):
        seconds, large = once(warm, problem(recorded=runs[:count]))
        rows.append({"what": f"{count} manoeuvres of 1000 samples, a whole fit", "value": seconds, "unit": "s",
                     "bar": "linear in the data"})
        rows.append({"what": f"{count} manoeuvres of 1000 samples, an iteration", "value": seconds / len(large.history),
                     "unit": "s", "bar": "linear in the data"})
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    rows.append({"what": "largest memory of the process, 100 manoeuvres included", "value": peak, "unit": "MB",
                 "bar": "1000"})
    publish("shooting", rows)


if __name__ == "__main__":
    main()

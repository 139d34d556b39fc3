"""Checks of the computation: the time step it chooses, and whether it keeps up with the clock."""

from __future__ import annotations

import numpy as np

from ...models import Sampled
from ...simulate.run import fastest, time_step
from . import Judgement, Plot, given
from .probe import Probe

_ALLOWED = 1e-3


def step(p: Probe) -> Judgement:
    """The time step is chosen by scale and stiffness; what it costs in accuracy is measured."""
    dt = time_step(p.ship)
    evidence = {"time step": (dt, "s"), "in time of one ship length": (dt / p.unit_time, "L/U")}
    if isinstance(p.ship.model, Sampled):
        return Judgement("pass", "a model in discrete time runs at the step it was made for", evidence)
    evidence["step times fastest motion"] = (dt * fastest(p.ship), "-")
    coarse, fine = (p.run(p.n_P, p.limit, 15 * p.unit_time, dt=dt / k) for k in (1, 4))
    every = np.interp(coarse.t, fine.t, np.arange(len(fine))).round().astype(int)
    apart = np.hypot(coarse["x"] - fine["x"][every], coarse["y"] - fine["y"][every]) / p.ship.L_pp
    evidence["track error of a hard turn over 15 lengths"] = (float(apart.max()), "L")
    evidence["heading error"] = (float(np.degrees(np.abs(coarse["psi"] - fine["psi"][every]).max())), "deg")
    plot = Plot("Error of the track by the time step", "t U/L", "L", (("a hard turn", coarse.t / p.unit_time, apart),))
    return given(
        float(apart.max()) < _ALLOWED,
        f"chosen automatically; a hard turn is {float(apart.max()):.1e} L from that at a quarter of the step",
        f"a hard turn is {float(apart.max()):.1e} L from that at a quarter of the step; wanted below {_ALLOWED:g} L",
        evidence, plot,
    )  # fmt: skip


def real_time(p: Probe) -> Judgement:
    """A step takes less time than it covers."""
    length, dt = 100 * p.unit_time, time_step(p.ship)
    p.run(p.n_P, 0.1 * p.limit, length)
    begun = p.clock()
    run = p.run(p.n_P, 0.1 * p.limit, length)
    taken = max(p.clock() - begun, 1e-9)
    factor = run.duration / taken
    evidence = {
        "real-time factor, one ship": (factor, "times"), "step": (1e6 * dt, "us"),
        "time per step": (1e6 * taken * dt / run.duration, "us"),
    }  # fmt: skip
    return given(factor > 1.0, f"runs {factor:.3g} times as fast as the clock, everything included",
                 "does not keep up with the clock", evidence)  # fmt: skip

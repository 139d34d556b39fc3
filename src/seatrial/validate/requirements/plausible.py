"""Check that nothing happens that theory or physics rules out: motion, energy or mass out of nothing."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...models import unit
from . import Finding, Judgement, Plot, body, judged, not_applicable, ranged, slips, typical, whole
from . import thresholds as limit
from .control import losses, places, thrusters
from .hull import motion
from .probe import Probe
from .propulsion import wrong_swing

_DEGREE = math.pi / 180.0


def plausible(p: Probe) -> Judgement:
    """Nothing happens that physics forbids: of the body, of thrust, in current, under any orders, left alone."""
    quick = "mass, inertia or damping is that of no ship: a motion dies out at once"
    still = [*_by_itself(p), *ranged("fastest motion at the approach", p.quickest, "U/L", limit.QUICK, quick),
             *body.inertia(p), *body.coriolis(p), *body.energy(p), *body.sides(p), *body.heading(p), *wrong_swing(p),
             *thrusters(p), *typical.position(p), *slips.named(p, [*typical.numbers(p), *whole.findings(p)]),
             *typical.stern(p), *places(p)]  # fmt: skip
    # a force that is ordered in newtons has nothing to lose; revolutions have
    still += [one for one in losses(p)[0] if unit(one.what.partition(":")[0]) == "1/s"]
    if p.quickest > limit.QUICK.far.high:
        return judged("", still)  # a run would take millions of steps to say the same
    orders, plot = _under_orders(p)
    found = [*orders, *_left_alone(p), *body.current(p), *body.heel(p), *still]
    return judged("no motion that physics forbids was found", found, plot)


def _by_itself(p: Probe) -> Iterator[Finding]:
    """At rest, without orders, in calm: no acceleration."""
    if not p.rests:
        return
    push = p.at([(0.0, 0.0, 0.0)], p.controls())[0]
    size = float(np.abs(push * (1.0, 1.0, p.ship.L_pp)).max()) * p.ship.L_pp / p.U**2
    yield Finding("acceleration at rest without orders", size, "U^2/L", limit.STILL,
                  "starts to move from rest without any order")  # fmt: skip


def _under_orders(p: Probe) -> tuple[list[Finding], Plot]:
    """Speed and rate of turn under 25 steady orders."""
    lowest = -1.0 if p.reverses and p.astern else 0.3
    orders = [(float(n), float(d)) for n in np.linspace(lowest, 1.0, 5) for d in np.linspace(-1.0, 1.0, 5)]
    controls = [p.controls(n * p.n_P, d * p.limit) for n, d in orders]
    _, runs = p.drift([p.state(u=p.U)] * len(controls), controls, 60 * p.unit_time)
    speed, turn = np.hypot(runs[:, :, 3], runs[:, :, 4]), np.abs(runs[:, :, 5])
    fastest, turning = (float(np.where(np.isfinite(x), x, np.inf).max()) for x in (speed / p.U, turn * p.unit_time))
    several = tuple((f"{n:+.2f} n_P, {d * p.limit / _DEGREE:+.0f} deg", run[:, 1], run[:, 0])
                    for (n, d), run in zip(orders[::4], runs[::4], strict=True))  # fmt: skip
    wrong = "runs away under steady orders: too little {} for its {}"
    found = [Finding("greatest speed under any steady orders", fastest, "U", limit.FASTEST,
                     wrong.format("resistance in surge", "thrust")),
             Finding("greatest rate of turn", turning, "U/L", limit.SPINNING,
                     wrong.format("damping of yaw", "steering"))]  # fmt: skip
    return found, Plot("Tracks under steady orders", "east [m]", "north [m]", several, equal=True)


def _left_alone(p: Probe) -> Iterator[Finding]:
    """Greatest share of the motion that is left 20 L/U after everything stopped, of 24 starts."""
    if not p.stops:
        yield not_applicable("motion left 20 L/U after the engines stop", "the model has no engine to stop")
        return
    rng = np.random.default_rng(1)
    lowest = -0.5 if p.allows("u", -0.5 * p.U) else 0.5
    states = [p.state(f * p.U, g * 0.2 * p.U, h * 0.2 * p.U / p.ship.L_pp)
              for f, g, h in rng.uniform((lowest, -1, -1), (1, 1, 1), (24, 3))]  # fmt: skip
    _, runs = p.drift(states, [p.controls()] * len(states), 20 * p.unit_time)
    moved = motion(p, runs)
    left = float((np.where(np.isfinite(moved[:, -1]), moved[:, -1], np.inf) / moved[:, 0]).max())
    yield Finding("motion left 20 L/U after the engines stop, at most", left, "of the start", limit.NO_GAIN,
                  "gains motion with the engines stopped")  # fmt: skip

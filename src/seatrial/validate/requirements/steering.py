"""Checks of steering: turning circles, drift in a turn, and what the rudder's force depends on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...data import Array, Trial
from ...models import unit
from . import Finding, Judgement, Plot, judged, not_applicable, typical, worst
from . import thresholds as limit
from .probe import Probe

_DEGREE = math.pi / 180.0
_SIDES = ((1, "starboard"), (-1, "port"))
_STEPS = (0.3, 0.6, 1.0)


def turning(p: Probe) -> Judgement:
    """The rudder turns the ship, to its own side, more of it turns more, to either side and at half the speed."""
    runs: dict[tuple[float, float, int], Trial] = {}
    for f, steps in ((1.0, _STEPS), (0.5, _STEPS[::2])):
        if f == 1.0 or p.allows("u", 0.4 * f * p.U):
            orders = {(f, a, s): (f * p.n_P, s * a * p.limit) for a in steps for s, _ in _SIDES}
            p.runs([*orders.values()], 25 * p.unit_time / f, speed=f * p.U)
            runs |= {case: p.run(*order, 25 * p.unit_time / f, speed=f * p.U) for case, order in orders.items()}
    bends = {(f, a, s): s * _curvature(run) * p.ship.L_pp for (f, a, s), run in runs.items()}
    found: list[Finding] = []
    cases = list(dict.fromkeys((f, a) for f, a, _ in bends))
    greatest = [(f, a) for f, a in cases if a == 1.0]
    pairs = [(one, other) for one, other in pairwise(cases) if one[0] == other[0]]

    def said(f: float, a: float) -> str:
        return f"{a * p.limit / _DEGREE:.0f} deg at {f:g} U"

    for s, name in _SIDES:
        own = [(said(*case), bends[*case, s]) for case in cases]
        wrong = f"the rudder to {name} does not turn the ship to its own side, {{at}}"
        found.append(worst(f"curvature of the circle to {name}", own, limit.OWN_SIDE, wrong, "1/L"))
        more = [(f"{said(*other)} over {said(*one)}", bends[*other, s] - bends[*one, s]) for one, other in pairs]
        wrong = f"more rudder to {name} does not turn tighter, {{at}}"
        found.append(worst(f"gain of curvature by more rudder to {name}", more, limit.TIGHTER, wrong, "1/L"))
    uneven = [(said(*case), bends[*case, 1] / (bends[*case, -1] or math.nan)) for case in cases]
    found.append(worst("curvature to starboard over port", uneven, limit.SIDES, "the sides turn unlike, {at}"))
    hard = [
        (f"to {name} at {case[0]:g} U", 2.0 / (bends[*case, s] or math.nan)) for case in greatest for s, name in _SIDES
    ]
    wrong = "no plausible size of the turning circle, {at}"
    found.append(worst("diameter of the steady circle at the greatest angle", hard, limit.CIRCLE, wrong, "L"))
    found += [*_side_force(p), *_inside(p, runs[1.0, 1.0, 1], runs[1.0, 1.0, -1]), *typical.at_first(p),
              *typical.zigzag(p)]  # fmt: skip
    tracks = tuple((f"{s * a * p.limit / _DEGREE:+.0f} deg", run["y"], run["x"])
                   for (f, a, s), run in runs.items() if f == 1.0)  # fmt: skip
    drifts = "; the bow inside the turn" if p.sways else "; it has no drift"
    return judged(
        f"turns to the side of the rudder, to both alike, the tighter the larger the angle{drifts}",
        found, Plot("Turning", "east [m]", "north [m]", tracks, equal=True),
    )  # fmt: skip


def _curvature(run: Trial) -> float:
    """Mean curvature of the track over the last fifth of a run, positive to starboard [1/m]."""
    tail = slice(-len(run) // 5, None)
    return float(np.mean(run["r"][tail]) / max(float(np.mean(np.hypot(run["u"][tail], run["v_m"][tail]))), 1e-12))


def _side_force(p: Probe) -> Iterator[Finding]:
    """The rudder is at the stern: what turns the bow in pushes midship out."""
    if not p.sways:
        return
    if p.moments:
        yield not_applicable("side force of the rudder", f"it has no rudder, {', '.join(p.moments)} turn it alone")
        return
    points: list[tuple[str, float]] = []
    for f in p.ahead:
        straight, *turned = p.at([(f * p.U, 0, 0)], [p.controls(p.n_P, s * p.limit) for s in (0, 0.3, 1.0, -0.3, -1.0)])
        for s, rates in zip((0.3, 1.0, -0.3, -1.0), turned, strict=True):
            yaw = float(rates[2] - straight[2]) * p.ship.L_pp
            points.append((f"{f:g} U, rudder {s:+g}", float(rates[1] - straight[1]) / yaw if yaw else math.nan))
    wrong = "the side force of the rudder is swapped: it pushes the ship into the turn, {at}"
    yield worst("sway by the rudder over the yaw it gives", points, limit.STERN_OUT, wrong, "1/L")


def _inside(p: Probe, starboard: Trial, port: Trial) -> Iterator[Finding]:
    """Drift in a turn; where a moment is ordered, as for positioning, the point about which the hull turns."""
    if not p.sways:
        return
    points: list[tuple[str, float]] = []
    for run, (side, name) in zip((starboard, port), _SIDES, strict=True):
        tail = slice(-len(run) // 5, None)
        if p.moments and not p.conventional:
            v_m, r = (float(np.mean(run[channel][tail])) for channel in ("v_m", "r"))
            points.append((f"to {name}", -v_m / (r * p.ship.L_pp) if r else math.nan))
            continue
        beta = side * float(np.mean(np.arctan2(-run["v_m"][tail], run["u"][tail])))
        points.append((f"to {name}", beta / _DEGREE))
    if p.moments and not p.conventional:
        wrong = "turns about a point far abaft midship, with its bow outside the turn, {at}"
        yield worst("pivot ahead of midship in a turn", points, limit.PIVOT, wrong, "L")
        return
    wrong = "turns without drift, or with its bow outside the turn, {at}"
    yield worst("drift angle at the greatest rudder", points, limit.BOW_INSIDE, wrong, "deg")


def lateral(p: Probe) -> Judgement:
    """A turning ship drifts."""
    run, mirrored = (p.run(p.n_P, side * p.limit, 25 * p.unit_time) for side, _ in _SIDES)
    found = list(_inside(p, run, mirrored)) or [
        Finding(
            "drift angle at the greatest rudder", 0.0, "deg", limit.BOW_INSIDE, "turns without drift: it has no sway"
        )
    ]
    plot = Plot("Sway speed in a turn", "t U/L", "v_m/U", (("v_m", run.t / p.unit_time, run["v_m"] / p.U),))
    return judged("drifts with its bow inside the turn, to both sides", found, plot)


def rudder_yaw(p: Probe, u: float, orders: list[tuple[float, float]]) -> Array:
    """Yaw given by the rudder at u [m/s] for each (revolutions, angle), positive to its own side, over U^2/L^2."""
    angles = np.array([delta for _, delta in orders])
    given = p.at([(u, 0.0, 0.0)], [p.controls(n, d) for n, d in orders])
    without = p.at([(u, 0.0, 0.0)], [p.controls(n) for n, _ in orders])
    return np.sign(angles) * (given - without)[:, 2] * p.unit_time**2


def answer_varies(p: Probe) -> Judgement:
    """The rudder lives on its inflow: speed of the ship and race of the propeller; without either it is dead."""
    if any(p.ship.model.differential):
        return unequal_thrust(p)
    found = [*_inflow(p), *_race(p), *_sternway(p)]
    delta, span = 0.3 * p.limit, 2 * p.unit_time
    cases = {"usual": (p.U, p.n_P), "half the speed": (0.5 * p.U, p.n_P),
             "1.3 times the revolutions": (p.U, 1.3 * p.n_P)}  # fmt: skip
    states = [p.state(u=u) for u, _ in cases.values()]
    t, runs = p.drift(states, [p.controls(n, delta) for _, n in cases.values()], span)
    _, straight = p.drift(states, [p.controls(n) for _, n in cases.values()], span)
    gained = np.unwrap(runs[:, :, 2], axis=1) - straight[:, :, 2]
    ordered = [name for name in p.steering if unit(name) == "N m"]
    pushed = [float(rudder_yaw(p, u, [(n, delta)])[0]) for u, n in cases.values()]
    for name, g, m, missing in zip([*cases][1:], gained[1:], pushed[1:], ("speed", "revolutions"), strict=True):
        wrong = f"the answer to the rudder does not change with {missing}"
        # less moment and less damping may turn a slower ship as far
        change = max(float(np.abs(g - gained[0]).max()) / (abs(float(gained[0, -1])) or 1.0),
                     abs(m - pushed[0]) / (abs(pushed[0]) or 1.0))  # fmt: skip
        # a thruster that is turned has its thrust at any speed: what is left is the damping of the hull
        bound = limit.NOTICEABLE if p.conventional or ordered or missing == "revolutions" else None
        found.append(Finding(f"change of the answer within 2 L/U, {name}", change, "of the usual", bound, wrong))
    if ordered:
        names = ", ".join(ordered)
        wrong = f"no rudder: {names} is a moment as ordered, in dead water too, at any speed and revolutions"
        found = [replace(one, wrong=wrong) for one in found]
    lines = tuple((name, t / p.unit_time, runs[k, :, 2] / _DEGREE) for k, name in enumerate(cases))
    good = "the force of the rudder grows with speed and revolutions, and is nothing in dead water"
    return judged(good, found, Plot("Heading after a rudder order", "t U/L", "psi [deg]", lines))


def unequal_thrust(p: Probe) -> Judgement:
    """Without a rudder, thrust to one side turns the craft to the other, at rest and under way, ahead and astern."""
    points = [
        (f"{f:g} U, to {name}", float(rudder_yaw(p, f * p.U, [(p.n_P, s * share * p.limit)])[0]))
        for f in (*p.astern, *((0.0,) if p.rests else ()), *p.ahead) for s, name in _SIDES for share in (0.3, 1.0)
    ]  # fmt: skip
    wrong = "more thrust on one side does not turn the craft to the other, {at}"
    found = [worst("yaw by the steering demand", points, limit.STEERS, wrong, "U^2/L^2")]
    far, near = (dict(points[k::2]) for k in (1, 0))
    more = [(at, far[at] - near[at]) for at in far]
    wrong = "a greater steering demand does not turn the craft faster, {at}"
    found.append(worst("yaw by all of the demand over that by 30 percent", more, limit.STEERS, wrong, "U^2/L^2"))
    return judged("it has no rudder: unequal thrust turns it at rest and under way, to the side of the demand", found)


def _inflow(p: Probe) -> Iterator[Finding]:
    """No force in dead water; with the propeller stopped, a force that goes with the square of speed."""
    orders = [(0.0, s * a * p.limit) for s, _ in _SIDES for a in (0.3, 1.0)]
    names = [f"{math.degrees(d):+.0f} deg" for _, d in orders]
    usual = float(np.abs(rudder_yaw(p, p.U, [(p.n_P, p.limit)])[0])) or 1.0
    if p.rests:
        dead = p.at([(0.0, 0.0, 0.0)], [p.controls(*order) for order in orders]) - p.at([(0.0, 0.0, 0.0)], p.controls())
        scale = np.array([1.0, 1.0, p.ship.L_pp]) * p.ship.L_pp / p.U**2
        points = [(at, float(x)) for at, x in zip(names, np.abs(dead * scale).max(axis=1) / usual, strict=True)]
        wrong = "the rudder works in dead water, at {at}"
        yield worst(
            "force of the rudder at rest, propeller stopped", points, limit.DEAD_WATER, wrong, "of that under way"
        )
    if not p.stops or not p.conventional:
        return
    fast = rudder_yaw(p, p.U, orders)
    if fast.any():
        wrong = "with the propeller stopped the rudder turns the ship the wrong way, at {at}"
        own = [(at, float(x) / usual) for at, x in zip(names, fast, strict=True)]
        yield worst("force of the rudder at U, propeller stopped", own, limit.STEERS, wrong, "of that under way")
    slow = max(0.25, min(p.ahead))
    if slow < 0.5:
        share = rudder_yaw(p, slow * p.U, orders) / np.where(fast, fast, np.nan) * (0.25 / slow) ** 2
        points = [(at, float(x)) for at, x in zip(names, share, strict=True)]
        wrong = "with the propeller stopped the rudder's force does not go with the square of speed, at {at}"
        if fast.any():
            yield worst("the same at a quarter of the speed over that at U", points, limit.INFLOW, wrong)


def _race(p: Probe) -> Iterator[Finding]:
    """More revolutions, more force: the race of the propeller adds to the inflow."""
    if not np.ptp(rudder_yaw(p, p.U, [(k * p.n_P, p.limit) for k in (0.0, 1.0, 1.6)])):
        wrong = "more revolutions do not give the rudder more force: they do not enter it"
        yield Finding("gain of rudder force by revolutions", 0.0, "-", limit.MORE_RACE, wrong)
        return
    rising: list[tuple[str, float]] = []
    for f in p.ahead:
        base = max(f, 0.5) * p.n_P
        for s, _ in _SIDES:
            for a in (0.3, 1.0):
                yaw = rudder_yaw(p, f * p.U, [(k * base, s * a * p.limit) for k in (1.0, 1.3, 1.6)])
                gain = np.diff(yaw) / np.where(yaw[:-1], np.abs(yaw[:-1]), 1.0)
                rising += [(f"{f:g} U, {s * a * p.limit / _DEGREE:+.0f} deg", float(g)) for g in gain]
    wrong = "more revolutions do not give the rudder more force, {at}"
    yield worst("gain of rudder force by 1.2 to 1.3 times the revolutions", rising, limit.MORE_RACE, wrong)
    if p.rests and p.conventional:
        usual = float(np.abs(rudder_yaw(p, p.U, [(p.n_P, p.limit)])[0])) or 1.0
        orders = [(k * p.n_P, s * p.limit) for k in (0.5, 1.0) for s, _ in _SIDES]
        kick = [(f"{n / p.n_P if p.n_P else 0:g} n_P, {math.degrees(d):+.0f} deg", float(x) / usual)
                for (n, d), x in zip(orders, rudder_yaw(p, 0.0, orders), strict=True)]  # fmt: skip
        wrong = "from rest, the race of the propeller gives the rudder no force, {at}"
        yield worst("kick of the rudder from rest", kick, limit.KICK, wrong, "of that under way")


def _sternway(p: Probe) -> Iterator[Finding]:
    """With sternway and a stopped propeller the rudder works the other way, or not at all."""
    if not (p.astern and p.stops and p.conventional):
        return
    usual = float(np.abs(rudder_yaw(p, p.U, [(p.n_P, p.limit)])[0])) or 1.0
    points = [(f"{f:g} U, to {name}", float(rudder_yaw(p, f * p.U, [(0.0, s * p.limit)])[0]) / (usual * f * f))
              for f in p.astern for s, name in _SIDES]  # fmt: skip
    wrong = "with sternway the rudder turns the ship as if it went ahead, {at}"
    yield worst("yaw by the rudder with sternway, propeller stopped", points, limit.ASTERN_RUDDER, wrong)

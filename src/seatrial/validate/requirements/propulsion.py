"""Checks of the propulsion: thrust ahead and astern, speeds it holds, stopping, the swing of a reversed propeller."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from ...data import Array, unwrapped
from ...environment import CALM
from ...models import unit
from ...models.common import Composed, Surroundings
from . import Finding, Judgement, Plot, judged, ranged, typical, worst
from . import thresholds as limit
from .body import shares
from .probe import Probe

_REVERSED = (-0.3, -0.6, -1.0)


def speed_by_revolutions(p: Probe) -> Judgement:
    """More revolutions, more thrust and speed; reversed, they pull astern at every speed, and stop the ship."""
    if not p.propulsion:
        return Judgement("not applicable", "the ship has no propeller order n_P: " + ", ".join(p.ship.model.controls))
    if not p.stops:
        wrong = "speed does not follow the revolutions: the model has no propeller"
        return judged("", [Finding("change of surge by stopping the propeller", 0.0, "U^2/L", limit.PUSH, wrong)])
    found = [*_thrust(p), *_loaded(p), *(_astern(p) if p.reverses else ())]
    shares = (0.25, 0.5, 0.75, 1.0)
    runs_of = [s * (p.n_P or 1.0) for s in shares]
    t, runs = p.drift([p.state(u=p.U)] * len(shares), [p.controls(n) for n in runs_of], 200 * p.unit_time)
    final = [float(u) for u in runs[:, -1, 3]]
    apart = [(f"{b:g} over {a:g} n_P", (y - x) / p.U) for (a, x), (b, y) in pairwise(zip(shares, final, strict=True))]
    wrong = "speed does not follow the revolutions: no propeller and no resistance in it"
    found.append(worst("gain of steady speed by revolutions", apart, limit.FOLLOWS, wrong, "U"))
    half = final[1] / final[3] if final[3] else math.inf
    wrong = "half the revolutions do not hold about half the speed"
    found.append(Finding("steady speed at half the revolutions, over the whole", half, "-", limit.HALF, wrong))
    if p.reverses and p.rests:
        found += _stopping(p)
    lines = tuple((f"{s:g} n_P", t / p.unit_time, runs[k, :, 3]) for k, s in enumerate(shares))
    good = "thrust and speed follow the revolutions" + ("; reversed they pull astern and stop the ship" if p.reverses
            else "; the ship's file does not claim reversed revolutions, so they are not judged")  # fmt: skip
    return judged(good, found, Plot("Speed after a change of revolutions", "t U/L", "u [m/s]", lines))


def _surge(p: Probe, u: float, orders: Array | list[float]) -> Array:
    """Surge acceleration at u [m/s] and revolutions [1/s], over U^2/L."""
    return p.at([(u, 0.0, 0.0)], [p.controls(float(n)) for n in orders])[:, 0] * p.ship.L_pp / p.U**2


def _thrust(p: Probe) -> Iterator[Finding]:
    """Ahead: thrust grows with revolutions at every speed, from bollard pull on."""
    n = p.n_P or 1.0
    rising: list[tuple[str, float]] = []
    for f in (*p.astern, *((0.0,) if p.rests else ()), *p.ahead):
        orders = np.array([0.6, 0.8, 1.0, 1.2, 1.4]) * n * max(abs(f), 0.4)
        gains = np.diff(_surge(p, f * p.U, orders))
        rising += [(f"{f:g} U, {order / n:.2g} n_P", float(g)) for order, g in zip(orders[1:], gains, strict=True)]
    wrong = "more revolutions do not give more thrust, at {at}"
    yield worst("gain of thrust by revolutions", rising, limit.PUSH, wrong, "U^2/L")
    speeds = [*([0.0] if p.rests else []), *p.ahead]
    thrust = [float(np.subtract(*_surge(p, f * p.U, [n, 0.0]))) for f in speeds]
    gained = [(f"{b:g} over {a:g} U", y / x - 1.0 if x > 0 else math.inf)
              for (a, x), (b, y) in pairwise(zip(speeds, thrust, strict=True))]  # fmt: skip
    if gained:
        yield worst(
            "gain of thrust by speed, at held revolutions", gained, limit.FADES, "thrust grows with speed, {at}"
        )
    propeller: Any = p.ship.model.part("propeller")
    if propeller is not None and isinstance(p.ship.model, Composed):
        drag = [(f"{f:g} U", math.copysign(1.0, f) * float(propeller.force(
                 Surroundings.of(p.state(f * p.U), CALM).flow(p.ship.model.body))[0].X) * p.unit_time
                 / (float(p.ship.model.displaced or 1.0) * p.U)) for f in (*p.astern, *p.ahead)]  # fmt: skip
        wrong = "the stopped propeller pushes the ship along, at {at}"
        yield worst("force of the stopped propeller along the motion", drag, limit.STILL, wrong, "m U^2/L")
    if not p.rests:
        return
    still, quarter, half, whole = _surge(p, 0.0, [0.0, 0.25 * n, 0.5 * n, n])
    points = [("half n_P", float(half - still)), ("n_P", float(whole - still))]
    yield worst("bollard pull", points, limit.PUSH, "no thrust at rest, at {at}", "U^2/L")
    ratios = [("n_P over half", float((whole - still) / (half - still or math.nan))),
              ("half over quarter", float((half - still) / (quarter - still or math.nan)))]  # fmt: skip
    wrong = "bollard pull does not go with the square of revolutions, {at}"
    yield worst("bollard pull at twice the revolutions", ratios, limit.SQUARE_THRUST, wrong)


def _loaded(p: Probe) -> Iterator[Finding]:
    """How the propeller is loaded: its advance, its pull at rest over its thrust under way, and by its diameter."""
    D_P = float(getattr(typical.screw(p.ship.model), "D_P", 0.0))
    if not (p.conventional and p.n_P):
        return
    standing, under_way = (float(np.subtract(*_surge(p, f * p.U, [p.n_P, 0.0]))) for f in (0.0, 1.0))
    if under_way > 0.0:
        wrong = (
            "thrust of the propeller does not fall with speed as that of one: thrust or diameter (k_0, D_P) is wrong"
        )
        yield from ranged("bollard pull over thrust at U", standing / under_way, "-", limit.PULL_OVER_THRUST, wrong)
    pushed, dragged = _surge(p, p.U, [p.n_P, 0.0])
    if dragged < 0.0:
        wrong = "thrust and resistance do not balance at the speed and revolutions of the file: propeller or resistance"
        yield from ranged("surplus of thrust at the approach", float(pushed / -dragged), "-", limit.BALANCE, wrong)
    if not D_P:
        return
    wrong = "the propeller turns too fast or too slow for the speed: thrust or resistance (k_0, D_P, R_0) is wrong"
    yield from ranged("speed over revolutions and diameter", p.U / (p.n_P * D_P), "-", limit.ADVANCE, wrong)
    mass = float(p.ship.model.displaced) * float(shares(p)[0, 0])
    if mass > 0.0 and p.rests:
        pull = standing * p.U**2 / p.ship.L_pp * mass / (1025.0 * p.n_P**2 * D_P**4 * len(p.propulsion))
        wrong = "the thrust of the propeller (k_0) is that of none of its diameter"
        yield from ranged("bollard pull over rho n^2 D^4", pull, "-", limit.PULL_NUMBER, wrong)


def _astern(p: Probe) -> Iterator[Finding]:
    """Reversed: it pulls astern at rest and at every speed ahead, the more the faster it turns."""
    n = p.n_P or 1.0
    pulls: list[tuple[str, float]] = []
    more: list[tuple[str, float]] = []
    for f in (0.0, *p.ahead):
        orders = (0.0, *_REVERSED)
        surge = _surge(p, f * p.U, [share * n for share in orders])
        pulls += [
            (f"{f:g} U, {share:g} n_P", float(surge[0] - a)) for share, a in zip(orders[1:], surge[1:], strict=True)
        ]
        more += [(f"{f:g} U, {b:g} over {a:g} n_P", float(x - y))
                 for (a, x), (b, y) in pairwise(zip(orders[1:], surge[1:], strict=True))]  # fmt: skip
    pulls += [(f"{f:g} U, -1 n_P", float(np.subtract(*_surge(p, f * p.U, [0.0, -n])))) for f in p.astern[:2]]
    wrong = "the reversed propeller pushes ahead or does not pull, at {at}"
    yield worst("pull astern of reversed revolutions", pulls, limit.PULLS_ASTERN, wrong, "U^2/L")
    wrong = "more reversed revolutions do not pull harder, at {at}"
    yield worst("gain of pull astern by reversed revolutions", more, limit.PULLS_ASTERN, wrong, "U^2/L")
    shares: list[tuple[str, float]] = []
    for share in (0.5, 1.0):
        still, ahead, astern = _surge(p, 0.0, [0.0, share * n, -share * n])
        shares.append((f"{share:g} n_P", float((still - astern) / (ahead - still or math.nan))))
    wrong = "bollard pull astern out of proportion to that ahead, at {at}"
    yield worst("bollard pull astern over ahead", shares, limit.REVERSED, wrong)


def _stopping(p: Probe) -> Iterator[Finding]:
    """A crash stop, and the speed astern that it ends in."""
    _, (run,) = p.drift([p.state(u=p.U)], [p.controls(-(p.n_P or 1.0))], 100 * p.unit_time)
    u = run[:, 3]
    stopped = bool((u <= 0.0).any())
    reach = float(np.hypot(run[: int(np.argmax(u <= 0.0)) + 1, 0], run[: int(np.argmax(u <= 0.0)) + 1, 1]).max())
    wrong = "reversed revolutions do not stop the ship"
    yield Finding(
        "head reach of a crash stop", reach / p.ship.L_pp if stopped else math.inf, "L", limit.STOPPING, wrong
    )
    wrong = "reversed revolutions give no plausible speed astern"
    yield Finding(
        "steady speed astern", float(np.hypot(u[-1], run[-1, 4]) * np.sign(-u[-1])) / p.U, "U", limit.STERNWAY, wrong
    )


def swing(p: Probe) -> tuple[list[tuple[str, float]], list[tuple[str, float]]]:
    """Yaw and sway by reversed revolutions over U^2/L, each with where; starboard is positive."""
    n = p.n_P or 1.0
    shares = [f for f in (*p.astern, 0.0, *p.ahead) if abs(f) <= 0.5]
    rows = [(f * p.U, 0.0, 0.0) for f in shares for _ in (0.6, 1.0)]
    orders = [p.controls(-k * n) for _ in shares for k in (0.6, 1.0)]
    change = (p.at(rows, orders) - p.at(rows, p.controls())) * p.ship.L_pp / p.U**2
    names = [f"{f:g} U, -{k:g} n_P" for f in shares for k in (0.6, 1.0)]
    yaw = [(at, float(x) * p.ship.L_pp) for at, x in zip(names, change[:, 2], strict=True)]
    return yaw, [(at, float(x)) for at, x in zip(names, change[:, 1], strict=True)]


def wrong_swing(p: Probe) -> list[Finding]:
    """A swing that contradicts the declared hand; none of a pair that turns opposite ways."""
    if not (p.reverses and p.rests and p.sways and p.conventional):
        return []
    model: Any = p.ship.model
    yaw, sway = swing(p)
    largest = max(abs(x) for _, x in (*yaw, *sway))
    if getattr(model, "pair", "") == "opposite":
        points = [(at, abs(x)) for at, x in (*yaw, *sway)]
        found = [worst("swing by a reversed contra-turning pair", points, limit.NO_SWING,
                       "a contra-turning pair swings the stern when reversed, {at}", "U^2/L")]  # fmt: skip
        return [*found, *_one_reversed(p)]
    if largest < limit.SWING.low:
        return []
    hand = getattr(model.part("propeller"), "hand", "right")
    side, stern = (1.0, "port") if hand == "right" else (-1.0, "starboard")
    wrong = f"reversed, a {hand}-handed propeller swings the stern to {stern}; this one does not, at {{at}}"
    found = [
        worst(
            f"yaw by the reversed {hand}-handed propeller",
            [(at, side * x) for at, x in yaw],
            limit.HANDED,
            wrong,
            "U^2/L",
        ),
        worst("side force of it at midship", [(at, -side * x) for at, x in sway], limit.HANDED, wrong, "U^2/L"),
    ]
    standing = p.at([(0.0, 0.0, 0.0)], [p.controls(-p.n_P), p.controls()])
    X, Y, N = shares(p) @ ((standing[0] - standing[1]) * [1.0, 1.0, p.ship.L_pp])
    wrong = "the side force of the reversed propeller (wheel effect) is out of proportion to its pull"
    found += ranged(
        "side force of the reversed propeller over its pull", abs(float(Y / X)), "-", limit.SWING_SHARE, wrong
    )
    wrong = "the wheel effect of the reversed propeller does not act at the stern"
    found += ranged("lever of the side force of the reversed propeller", float(N / Y), "L", limit.SWING_LEVER, wrong)
    return found


def _one_reversed(p: Probe) -> Iterator[Finding]:
    """One propeller of a pair reversed alone turns the ship to its own side, by its lever."""
    n = p.n_P or 1.0
    points: list[tuple[str, float]] = []
    shares = dict(zip(p.ship.model.controls, p.ship.model.differential, strict=True))
    apart = [(name, -math.copysign(1.0, shares[name])) for name in p.propulsion if shares[name]]
    for name, side in apart or zip(p.propulsion, (-1.0, 1.0), strict=False):
        k = p.ship.model.controls.index(name)
        for f in (0.0, *p.ahead[:3]):
            orders = list(p.controls())
            orders[k] = -n
            change = p.at([(f * p.U, 0, 0)], [p.controls(), tuple(orders)])
            points.append((f"{name} at {f:g} U", side * float(change[1, 2] - change[0, 2]) * p.unit_time**2))
    wrong = "one propeller of a pair, reversed alone, does not turn the ship to its own side, {at}"
    yield worst("yaw by one propeller reversed alone", points, limit.PULLS_ASTERN, wrong, "U^2/L^2")


def _pair_reversed(p: Probe) -> Judgement:
    """Unequal thrusters reversed together push straight astern; one by itself turns the craft to its own side."""
    points = [(at, abs(x)) for side in swing(p) for at, x in side]
    found = [worst("swing by thrusters reversed together", points, limit.NO_SWING,
                   "thrusters reversed together swing the stern, {at}", "U^2/L"), *_one_reversed(p)]  # fmt: skip
    return judged("thrusters on either side push straight astern together, one alone turns the craft to its own side",
                  found)  # fmt: skip


def reversing(p: Probe) -> Judgement:
    """A reversed propeller swings the bow to the side of its hand; a contra-turning pair does not swing it."""
    if not p.propulsion:
        return Judgement("not applicable", "the ship has no propeller order n_P")
    if any(name.startswith("alpha") for name in p.steering):
        return Judgement("not applicable", "its thrusters turn about: they push astern without a reversed propeller")
    if all(unit(name) == "N" for name in p.propulsion):
        return Judgement("not applicable", f"its thrust is ordered in newtons ({', '.join(p.propulsion)}): it has no "
                         "propeller that swings the stern")  # fmt: skip
    if not p.reverses:
        return Judgement("fail", "the ship's file says that the model is not valid at reversed revolutions: "
                         "its propeller has no side force astern")  # fmt: skip
    if any(p.ship.model.differential):
        return _pair_reversed(p)
    found = wrong_swing(p)
    run = p.run(-p.n_P, 0.0, 25 * p.unit_time, speed=0.5 * p.U)
    psi = unwrapped(run["psi"])
    plot = Plot("Heading while backing", "t U/L", "psi [deg]",
                (("rudder midships", run.t / p.unit_time, np.degrees(psi)),))  # fmt: skip
    heading = float(np.degrees(psi[-1]))
    if getattr(p.ship.model, "pair", "") == "opposite":
        return judged("the pair turns opposite ways: backing swings the stern to neither side, one propeller alone to "
                      "its own", found, plot)  # fmt: skip
    yaw, _ = swing(p) if p.rests else ([("", 0.0)], [])
    size = max(abs(x) for _, x in yaw)
    lacks = Finding("greatest yaw by reversed revolutions", size, "U^2/L", limit.SWING,
                    "a reversed propeller makes no side force: the model has no hand")  # fmt: skip
    shown = Finding("heading change backing for 25 L/U", heading, "deg")
    side = "starboard" if heading > 0 else "port"
    return judged(f"backing swings the bow to {side}, by the hand of the propeller", [lacks, *found, shown], plot)

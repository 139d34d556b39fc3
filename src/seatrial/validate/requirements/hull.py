"""Checks of the hull: resistance ahead and astern, damping of sway and yaw, stability on course, rest."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from inspect import signature
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import ParameterError, update, values
from ...data import Array
from ...engine import SimulationError
from ...environment import CALM
from ...models.common import Composed, Surroundings
from . import Finding, Judgement, Plot, judged, worst
from . import thresholds as limit
from .probe import Probe

_SHARES = (0.01, 0.05, 0.2, 0.5, 1.0)
_SIDES = ((1.0, "starboard"), (-1.0, "port"))
_OPPOSED, _RUDDERS, _TURNS_ON = 0.3, (16, 8, 8), 2e-3
"""Most rudder that the loop of the spiral is sought with, of the greatest; how many angles, of each refinement; what
turns on [U/L]."""
_SMALL = 1e-3
"""Motion over U on one side of a kink: far above the steps of differences, far below where forces curve."""
_HARD = 0.05
"""v_m r over U^2/L of the gentlest turn by a rudder at its limit: 9 deg of drift in a circle of six lengths."""
_LARGEST = 0.5
"""Greatest sway speed over U and yaw rate over U/L of the grids: those of a hard turn."""


def resistance(p: Probe, at_rest: bool = False) -> Judgement:
    """Each velocity meets a resistance of its own, ahead and astern, at every speed; `at_rest`: at none as well."""
    found = [*_coasting(p), *_damping(p, at_rest and p.rests), *_bare(p), *_turned(p)]
    t, runs = p.drift(
        [p.state(u=p.U), p.state(p.U, v_m=0.2 * p.U), p.state(p.U, r=0.3 * p.U / p.ship.L_pp)],
        [p.controls(), p.controls(p.n_P), p.controls(p.n_P)], 15 * p.unit_time,
    )  # fmt: skip
    scales = (("u, propeller stopped", 0, 3, p.U), ("v_m from a push", 1, 4, 0.2 * p.U),
              ("r from a push", 2, 5, 0.3 * p.U / p.ship.L_pp))  # fmt: skip
    plot = Plot("Decay of each velocity", "t U/L", "over its initial value",
                tuple((label, t / p.unit_time, runs[k, :, c] / scale) for label, k, c, scale in scales))  # fmt: skip
    return judged(
        "surge, sway and yaw each meet a resistance at every speed tried, and a turn takes speed", found, plot
    )


def straight_resistance(p: Probe) -> Judgement:
    """A straight run ahead and astern meets a resistance."""
    return judged("straight ahead and astern it meets a resistance that grows with speed", _coasting(p))


def _coasting(p: Probe) -> Iterator[Finding]:
    """Surge with the propeller stopped, then under way."""
    L = p.ship.L_pp
    kept: dict[float, float] = {}
    for way, shares in (("ahead", p.ahead), ("astern", p.astern)):
        if not (shares and p.stops):
            continue
        u = p.U * np.array(shares)
        slowed = -p.at(np.column_stack([u, 0 * u, 0 * u]), p.controls())[:, 0]
        kept |= dict(zip(shares, slowed.tolist(), strict=True))
        points = [(f"{f:g} U", a * L / (v * abs(v))) for f, a, v in zip(shares, slowed, u, strict=True)]
        pulls = min(a for _, a in points) < 0
        wrong = f"the resistance {way} pulls the ship along" if pulls else f"too little resistance {way}"
        wrong = f"{wrong}, at {{at}}" if slowed.any() else f"no resistance in surge {way}"
        yield worst(f"loss of speed {way}, propeller stopped", points, limit.RESISTANCE, wrong, "1/L")
    if any(kept.values()):
        steps = [*pairwise(sorted(p.ahead)), *pairwise(sorted(p.astern, reverse=True))]
        grown = [(f"{a:g} to {b:g} U", _power(b / a, kept[a], kept[b])) for a, b in steps if a in kept and b in kept]
        if grown:
            wrong = "resistance does not grow with speed, {at}"
            yield worst("power of speed by which resistance grows", grown, limit.GROWTH, wrong)
        turned = [(f"{-a:g} U", -kept[a] / kept[-a] if kept[-a] else math.inf) for a in kept if a < 0 and -a in kept]
        if turned:
            yield worst("resistance astern over ahead", turned, limit.ASTERN, "resistance astern out of proportion")
    held = [(f"{f:g} U", -float(p.slopes(f * p.U, p.controls(f * p.n_P))[0, 0]) * p.unit_time) for f in p.ahead]
    wrong = "under way no resistance in surge" + (", at {at}" if any(a for _, a in held) else ": it keeps any speed")
    yield worst("damping of surge under way", held, limit.UNDER_WAY, wrong, "U/L")


def _power(ratio: float, before: float, after: float) -> float:
    """Power of the speed by which a resistance grows; 0 where it vanishes or changes its sign."""
    return math.log(after / before) / math.log(ratio) if before * after > 0.0 else 0.0


def _damping(p: Probe, at_rest: bool) -> Iterator[Finding]:
    """Sway and yaw, each by itself and to both sides, the ship under its own revolutions; at rest, stopped."""
    L = p.ship.L_pp
    standing = (0.0,) if at_rest else ()
    for name, axis, top in (("sway", 1, p.U), ("yaw", 2, p.U / L)):
        low, high = p.ship.validity.get(("v_m", "r")[axis - 1], (-math.inf, math.inf))
        points: list[tuple[str, float]] = []
        rows: list[tuple[float, ...]] = []
        orders: list[tuple[float, ...]] = []
        for f in (*p.astern, *standing, *p.ahead):
            for share in _SHARES:
                for side in (1, -1):
                    x = side * share * min(_LARGEST * top, high, -low)
                    row = [f * p.U, 0.0, 0.0]
                    row[axis] = x
                    rows.append(tuple(row))
                    orders.append(p.controls(max(f, 0.0) * p.n_P))
        usual = p.at([(row[0], 0.0, 0.0) for row in rows], orders)[:, axis]  # the swirl of a propeller
        rates = p.at(rows, orders)[:, axis] - usual
        for row, rate in zip(rows, rates, strict=True):
            x = row[axis]
            speed = math.hypot(row[0], x if axis == 1 else x * L)
            where = f"{row[0] / p.U:g} U, {'v_m' if axis == 1 else 'r'} {x / top:+.2g} U" + ("" if axis == 1 else "/L")
            points.append((where, -float(rate) * L / (x * speed)))
        none = not rates.any()
        bound = limit.SWAY if axis == 1 else limit.YAW
        wrong = f"no resistance in {name}" if none else f"{name} is not damped, at {{at}}"
        yield worst(f"damping of {name}", points, bound, wrong, "1/L")


def _bare(p: Probe) -> Iterator[Finding]:
    """The forces of the hull and of the rudder amidships, each by itself: one may hide a wrong sign of the other."""
    model = p.ship.model
    hull: Any = model.part("hull") or model.part("damping")
    if not isinstance(model, Composed) or hull is None or len(signature(hull.force).parameters) != 1:
        return  # a hull with arguments of its own (roll) is judged by the whole ship
    points: dict[str, list[tuple[str, float]]] = {"surge": [], "sway": [], "yaw": []}
    for f in (*p.astern, *p.ahead):
        straight = Surroundings.of(p.state(f * p.U), CALM).flow(model.body)
        points["surge"].append((f"{f:g} U", -math.copysign(1.0, f) * float(hull.force(straight).X)))
        for side in (1, -1):
            for share in _SHARES:
                x = side * share * _LARGEST
                where = f"{f:g} U, {x:+.2g} U"
                aside = hull.force(straight._replace(v_m=x * p.U))
                points["sway"].append((where, -side * float(aside.Y)))
                turned = hull.force(straight._replace(r=x * p.U / p.ship.L_pp))
                points["yaw"].append((f"{where}/L", -side * float(turned.N)))
    propeller: Any = model.part("propeller")
    rudder: Any = model.part("rudder")
    if propeller is not None and rudder is not None:
        points |= {"sway by the rudder": [], "yaw by the rudder": []}
        for f in p.ahead:
            straight = Surroundings.of(p.state(f * p.U), CALM).flow(model.body, max(f, 0.5) * p.n_P)
            for side in (1, -1):
                for name, moved in (("sway", straight._replace(v_m=side * 0.1 * f * p.U)),
                                    ("yaw", straight._replace(r=side * 0.3 * f * p.U / p.ship.L_pp))):  # fmt: skip
                    force = rudder.force(moved, propeller.force(moved)[1])
                    where = f"{f:g} U, to {'starboard' if side > 0 else 'port'}"
                    points[f"{name} by the rudder"].append(
                        (where, -side * float(force.Y if name == "sway" else force.N))
                    )
    for name, found in points.items():
        signs = [(at, float(np.sign(force))) for at, force in found]
        what = "the rudder amidships" if "rudder" in name else "the hull's own force"
        axis = name.partition(" ")[0]
        yield worst(f"sign of {what} against {axis}", signs, limit.HULL, f"{what} pushes along the {axis}, at {{at}}")


def _turned(p: Probe) -> Iterator[Finding]:
    """Speed left in a hard turn over that held straight ahead, to both sides, at full and at half the revolutions.

    What takes speed is the drift: it turns the centripetal force (m + m_y) v_m r against the thrust.  A hull of dynamic
    positioning that is turned by an ordered moment drifts little, and is asked for a loss in proportion to v_m r.
    """
    points: list[tuple[str, float]] = []
    for share in (1.0, 0.5) if p.stops else (1.0,):
        straight = _held(p, share)
        orders = [(share * p.n_P, side * p.limit) for side, _ in _SIDES]
        runs = p.runs(orders, 25 * p.unit_time / share, speed=share * p.U)
        for run, (_, name) in zip(runs, _SIDES, strict=True):
            if isinstance(run, SimulationError):
                points.append((f"to {name} from {share:g} U: it blows up", math.nan))
                continue
            tail = slice(-len(run) // 5, None)
            v_m, r = (float(np.mean(run[channel][tail])) for channel in ("v_m", "r"))
            speed = float(np.mean(np.hypot(run["u"][tail], run["v_m"][tail]))) or math.nan
            hard = abs(v_m * r) * p.ship.L_pp / speed**2 / _HARD
            left = speed / straight
            if left > limit.TURNED.high and 0.0 < hard < 1.0:
                left = 1.0 - (1.0 - left) / hard
            points.append((f"to {name} from {share:g} U", left))
    fast = max(left for _, left in points) > limit.TURNED.high
    wrong = "a hard turn takes no speed, {at}" if fast else "it stops or runs away in a hard turn, {at}"
    yield worst("speed left in a hard turn", points, limit.TURNED, wrong, "of straight ahead")


def _held(p: Probe, share: float) -> float:
    """Speed that is held straight ahead at a share of the revolutions [m/s]; that share of the approach where none is.

    A model without a propeller holds the speed of its table, at whatever speed it approaches.
    """
    u = np.linspace(0.2, 2.0, 361) * share * p.U
    pushed = p.at(np.column_stack([u, 0.0 * u, 0.0 * u]), p.controls(share * p.n_P))[:, 0]
    held = np.flatnonzero((pushed[:-1] > 0.0) & (pushed[1:] <= 0.0))
    if not held.size:
        return share * p.U
    k = held[np.argmin(np.abs(u[held] - share * p.U))]
    return float(u[k] + (u[k + 1] - u[k]) * pushed[k] / (pushed[k] - pushed[k + 1]))


def growth(p: Probe, u: float, side: float = 0.0) -> float:
    """Fastest growth of a disturbance of the straight run at speed `u` [1/s]; negative where it dies out.

    The states beyond the six take part: a response model of second order has a root of its own in them.

    Args:
        side: +1 of a turn to starboard, -1 to port.  The flow at a rudder, and the wake in drift, have coefficients of
            their own for each side, so that forces have a kink at v_m = r = 0 (MMG: Yasukawa and Yoshimura 2015,
            Eq. 25), where the slopes to neither side are those of differences across it.
    """
    small = side * _SMALL * p.U
    # the bow is inside a turn: v_m < 0 where r > 0
    slopes = p.slopes(u, p.controls(p.n_P * u / p.U), -0.5 * small, small / p.ship.L_pp)[1:, 1:]
    moving = [k for k in range(len(slopes)) if np.abs(slopes[k]).max() > 1e-12 / p.unit_time]
    block = slopes[np.ix_(moving, moving)]
    return float(np.linalg.eigvals(block).real.max()) if moving else 0.0


def stability(p: Probe, both: bool = False) -> Judgement:
    """Course stability is a property of hull and speed, may be lost, and is proved by pull-outs to both sides.

    Args:
        both: whether a stable ship must become unstable by a change of one number, and then keep turning.
    """
    speeds = [f * p.U for f in (0.25, 0.5, 0.75, 1.0)]
    rates = [growth(p, u) for u in speeds]
    roots = tuple(growth(p, p.U, side) * p.unit_time for side, _ in _SIDES)
    root = max(roots)
    effects = sorted(_effects(p, rates[-1]), reverse=True)
    effect, name = effects[0] if effects else (0.0, "")
    flip, flipped = _flip(p, rates[-1], [path for _, path in effects[:5]])
    spread = (max(rates) - min(rates)) / (max(map(abs, rates)) or 1.0)
    found = [
        *(Finding(f"growth of a disturbance to {to} at the approach", one, "U/L")
          for one, (_, to) in zip(roots, _SIDES, strict=True)),
        Finding("the same at a quarter of the speed", rates[0] * p.unit_time, "U/L"),
        Finding("change of the root with speed", spread, "-", limit.WITH_SPEED,
                "course stability does not change with speed"),
        Finding(f"change of the root by half of {name or 'any parameter'}", effect / (abs(rates[-1]) or 1.0), "-",
                limit.BY_HULL, "course stability does not change with the hull's numbers"),
    ]  # fmt: skip
    pulls, plot = _pulled_out(p, roots)
    if both and root <= limit.NEAR_NEUTRAL:
        flip, flipped = _flip(p, -1.0, [path for _, path in effects], 5 * limit.NEAR_NEUTRAL)
        wrong = "no number of the hull makes it keep turning with the rudder amidships"
        turning = 0.0 if flipped is None else max(0.0, _kept_turning(flipped))
        what = f"rate of turn 300 L/U after a pull-out, {flip or 'no change of one number'}"
        found.append(Finding(what, turning, "U/L", limit.KEEPS_TURNING, wrong))
    width = loop(p)
    found.append(Finding("width of the loop of the spiral", math.degrees(width), "deg"))
    other = f"; {flip} makes it {'stable' if rates[-1] > 0 else 'unstable'}" if flip else ""
    turns = f", loop of {math.degrees(width):.2g} deg" if math.degrees(width) > 0.01 else ""
    good = (f"{_state(roots)} on course at {p.U:.3g} m/s, by roots and pull-outs{turns}; "
            f"depends on speed and on the hull's numbers{other}")  # fmt: skip
    return judged(good, [*found, *pulls], plot)


def _state(roots: tuple[float, ...]) -> str:
    """What the roots to starboard and to port say together."""
    low, high = min(roots), max(roots)
    if high < -limit.NEAR_NEUTRAL:
        return "stable"
    if low > limit.NEAR_NEUTRAL:
        return "unstable"
    if high <= limit.NEAR_NEUTRAL:
        return f"{'un' * (high > 0.0)}stable, next to neutral,"
    kink = "stable" if low < -limit.NEAR_NEUTRAL else "neutral"
    side, other = ("starboard", "port") if roots[0] > roots[1] else ("port", "starboard")
    return f"unstable to {side} and {kink} to {other}, next to neutral,"


def loop(p: Probe) -> float:
    """Width of the loop of the spiral [rad]: the rudder angles at which the ship turns on to either side."""
    _, turned = p.drift([p.state(p.U)] * 2, [p.controls(p.n_P, side * p.limit) for side, _ in _SIDES],
                        10 * p.unit_time)  # fmt: skip
    edges = _least(p, [tuple(run[-1].tolist()) for run in turned])
    # to starboard it turns on from the first of them up, to port from minus the second down
    return max(0.0, -sum(edges)) if np.isfinite(edges).all() else 0.0


def _least(p: Probe, begun: Sequence[tuple[float, ...]]) -> list[float]:
    """Least rudder to each side at which a turn to that side goes on [rad]; infinite where none of those tried does."""
    ends = [(-_OPPOSED * p.limit, _OPPOSED * p.limit)] * len(_SIDES)
    for count in _RUDDERS:
        tried = [np.linspace(*end, count) for end in ends]
        orders = [p.controls(p.n_P, side * float(angle))
                  for (side, _), angles in zip(_SIDES, tried, strict=True) for angle in angles]  # fmt: skip
        _, runs = p.drift([state for state in begun for _ in range(count)], orders, 100 * p.unit_time)
        rates = runs[:, -1, 5].reshape(len(_SIDES), count) * p.unit_time
        ends = [_bracket(side * some > _TURNS_ON, angles)
                for (side, _), some, angles in zip(_SIDES, rates, tried, strict=True)]  # fmt: skip
        if not np.isfinite(ends).all():
            return [math.inf] * len(ends)
    return [0.5 * (low + high) for low, high in ends]


def _bracket(on: NDArray[np.bool_], angles: Array) -> tuple[float, float]:
    """The angles between which turns begin to go on; the first angle where all do, infinite where none does."""
    if not on.any():
        return math.inf, math.inf
    first = int(np.argmax(on))
    return float(angles[max(first - 1, 0)]), float(angles[first])


def _pulled_out(p: Probe, roots: tuple[float, ...]) -> tuple[list[Finding], Plot]:
    """Rate of turn that is left 300 L/U after a turn, the rudder amidships, of each side held against its own root."""
    turns = [(side, f"{little}to {name}", share * p.limit)
             for little, share in (("", 1.0), ("a little ", 0.1)) for side, name in _SIDES]  # fmt: skip
    control = p.controls(p.n_P)
    _, turned = p.drift([p.state(p.U)] * 4, [p.controls(p.n_P, side * angle) for side, _, angle in turns],
                        10 * p.unit_time)  # fmt: skip
    t, runs = p.drift([tuple(run[-1].tolist()) for run in turned], [control] * 4, 300 * p.unit_time)
    ends = runs[:, -1, 5] * p.unit_time
    # the swirl of a single propeller turns a stable ship as well
    middle = 0.5 * (ends[0] + ends[1]) if max(roots) < -limit.NEAR_NEUTRAL else 0.0
    found: list[Finding] = []
    for k, (side, name) in enumerate(_SIDES):
        left = [(f"from a turn {turns[at][1]}", side * float(ends[at] - middle)) for at in (k, k + 2)]
        if roots[k] > limit.NEAR_NEUTRAL:
            bound, state, wrong = limit.KEEPS_TURNING, "unstable", "does not keep"
        elif roots[k] < -limit.NEAR_NEUTRAL:
            bound = limit.PULLED_OUT if max(roots) < -limit.NEAR_NEUTRAL else limit.NEARLY_OUT
            state, wrong = "stable", "keeps"
        else:
            bound, state, wrong = limit.NEARLY_OUT, "neutral", "keeps"
        said = f"{state} to {name} by its roots, yet it {wrong} turning with the rudder amidships, {{at}}"
        found.append(worst(f"rate of turn left 300 L/U after a pull-out from {name}", left, bound, said, "U/L"))
    lines = tuple(
        (name, t / p.unit_time, run[:, 5] * p.unit_time) for (_, name, _), run in zip(turns, runs, strict=True)
    )
    return found, Plot("Pull-outs", "t U/L", "r L/U", lines)


def _varied(p: Probe, path: str, factor: float) -> float | None:
    """Growth of a disturbance with one parameter multiplied; None where the ship cannot have it."""
    try:
        model = update(p.ship.model, {path: factor * values(p.ship.model)[path]})
        found = growth(replace(p, ship=replace(p.ship, model=model)), p.U)
    except (ParameterError, ArithmeticError, ValueError):
        return None
    return found if math.isfinite(found) else None


def _effects(p: Probe, usual: float) -> Iterator[tuple[float, str]]:
    """Effect of each parameter of the hull; of every parameter where the model does not separate those of the hull."""
    paths = [path for path, value in values(p.ship.model).items() if value]
    own = [path for path in paths if path.partition(".")[0] in ("hull", "damping", "derivatives")]
    for path in own or paths:
        found = _varied(p, path, 1.5)
        if found is not None:
            yield abs(found - usual), path


def _flip(p: Probe, usual: float, strongest: list[str], least: float = limit.NEAR_NEUTRAL) -> tuple[str, Probe | None]:
    """A change of one of the strongest parameters that makes stable unstable, or unstable stable; in words, and made.

    Args:
        usual: growth that is to change its sign.
        least: growth or decay that it is to have then [U/L].
    """
    for factor in (0.8, 1.25, 0.5, 2.0, 0.2, -1.0):
        for path in strongest:
            found = _varied(p, path, factor)
            if found is not None and found * usual < 0 and abs(found) * p.unit_time > least:
                model = update(p.ship.model, {path: factor * values(p.ship.model)[path]})
                return f"{path} times {factor:g}", replace(p, ship=replace(p.ship, model=model))
    return "", None


def _kept_turning(p: Probe) -> float:
    """Rate of turn after a pull-out, of the side that turns less [U/L]."""
    found, _ = _pulled_out(p, (math.inf, math.inf))
    return min(one.value for one in found)


def motion(p: Probe, runs: Array) -> Array:
    """Size of the motion of each row, yaw at 0.3 L [m/s]."""
    return np.sqrt(runs[:, :, 3] ** 2 + runs[:, :, 4] ** 2 + (0.3 * p.ship.L_pp * runs[:, :, 5]) ** 2)


def rest_is_stable(p: Probe) -> Judgement:
    """Left alone, the ship comes to rest, however slowly: each velocity by itself, and all together."""
    if not p.rests:
        low, high = p.ship.validity["u"]
        return Judgement(
            "fail", f"the ship's file says that the model is not valid at rest, but from {low:g} to {high:g} m/s"
        )
    rng = np.random.default_rng(2)
    size, lasts = 0.3 * p.U, 300.0
    alone = [s * e for e in np.eye(3) for s in (1.0, -1.0)]
    spread = np.array([size, size, 2 * size / p.ship.L_pp])
    states = [p.state(*row) for row in (np.vstack([alone, rng.uniform(-1, 1, (26, 3))]) * spread).tolist()]
    t, runs = p.drift(states, [p.controls()] * len(states), lasts * p.unit_time)
    moved = motion(p, runs)
    share = moved / moved[:, :1]
    # u' = -k u |u|/L from the start: what the least resistance leaves
    allowed = 1.0 / (1.0 + limit.COASTING * lasts * moved[:, 0] / p.U)
    names = ["u ahead", "u astern", "v_m to starboard", "v_m to port", "r to starboard", "r to port"]
    labels = [*names, *(f"start {k}" for k in range(7, len(states) + 1))]
    over = [(at, float(end / most)) for at, end, most in zip(labels, share[:, -1], allowed, strict=True)]
    third = share.shape[1] // 3
    fell = [
        (at, float(row[-third] - row[-1]) + 1e-5 * float(row[-1] < 1e-3)) for at, row in zip(labels, share, strict=True)
    ]
    wrong = "left alone it does not come to rest ({at}): no resistance there, or its origin is not at rest"
    found = [
        worst(f"motion left after {lasts:g} L/U, over what the least resistance leaves", over, limit.LEFT, wrong),
        worst("fall in the last third", fell, limit.FELL, wrong, "of the start"),
    ]
    lines = tuple((label, t / p.unit_time, row) for label, row in zip(labels[:8], share, strict=False))
    plot = Plot("Motion left without orders", "t U/L", "over its start", lines)
    return judged("from every start it comes to rest; resistance that goes with the square takes its time", found, plot)

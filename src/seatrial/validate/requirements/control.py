"""Checks of the actuators, their delays, limits and rates, and of side thrusters under way."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from ...actuators import Azimuth, Servo, queue_length, queued
from ...data import Array
from ...models import unit
from . import Finding, Judgement, Plot, judged, ranged, typical, worst
from . import thresholds as limit
from .body import shares
from .probe import Probe

_DEGREE = math.pi / 180.0
_PLACES = ((("bow", "fore", "front"), 1.0), (("stern", "aft", "rear"), -1.0))
_ABREAST = ((("port", "left"), -1.0), (("starboard", "right"), 1.0))
"""What names of thrusters begin with, and the sign of their place, ahead or to starboard."""


def _answer(servo: Servo, start: float, order: float, dt: float, lasts: float) -> Array:
    """Values of an actuator at rest at `start` after an order, one each step; the first is the start."""
    memory = (start, *([0.0] * len(servo.extra)))
    waiting = (start,) * queue_length(float(servo.dead_time), dt)
    values = [start]
    for _ in range(max(int(lasts / dt), 2)):
        pieces, waiting = queued(waiting, order, float(servo.dead_time), dt)
        for share, one in pieces:
            if share > 1e-12:
                _, memory = servo.advance(memory, one, share * dt)
        values.append(float(memory[0]))
    return np.array(values)


def _steps(p: Probe, name: str) -> Iterator[tuple[str, float, float]]:
    """Steps of an order within the limits, to either side: where, from, to."""
    servo = p.ship.actuators.of(name)
    size = {"rad": p.limit, "1/s": p.n_P or 1.0}.get(unit(name), 1.0)
    high = min(float(servo.high), size) if math.isfinite(float(servo.high)) else size
    low = max(float(servo.low), -size) if math.isfinite(float(servo.low)) else -size
    yield "from rest to the high side", 0.0, 0.9 * high
    yield "from rest to the low side", 0.0, 0.9 * low
    if name in p.steering:
        yield "from side to side", 0.9 * low, 0.9 * high
        yield "back", 0.9 * high, 0.9 * low


def _expected(servo: Servo, start: float, order: float) -> float:
    """Time until nine tenths of a step, by the rate, the lag and the dead time of the file [s]."""
    step, lag = abs(order - start), float(getattr(servo, "lag", 0.0))
    rate = float(servo.rate)
    down = float(getattr(servo, "rate_down", rate))
    rate = rate if abs(order) > abs(start) else down
    ramp = max(step - lag * rate, 0.0) if math.isfinite(rate) and lag > 0 else (step if math.isfinite(rate) else 0.0)
    left = step - ramp
    if ramp >= 0.9 * step:
        return float(servo.dead_time) + 0.9 * step / rate
    late = lag * math.log(left / (0.1 * step)) if lag > 0 and left > 0.1 * step else 0.0
    return float(servo.dead_time) + (ramp / rate if ramp else 0.0) + late


def delay(p: Probe, controls: tuple[str, ...] | None = None) -> Judgement:
    """An order takes time to act, the time that the ship's file says; all orders, or those of `controls`."""
    if controls is None:
        controls = tuple(dict.fromkeys((*p.steering, *p.propulsion, *own_thrusters(p))))
    if not controls:
        return Judgement("not applicable", "the ship has no such order")
    found: list[Finding] = []
    for name in controls:
        servo = p.ship.actuators.of(name)
        if servo.at_once or (isinstance(servo, Azimuth) and not math.isfinite(float(servo.rate))):
            continue
        points: list[tuple[str, float]] = []
        seconds: list[float] = []
        for where, start, order in _steps(p, name):
            due = _expected(servo, start, order)
            dt = min(p.step, due / 50.0)
            done = (_answer(servo, start, order, dt, 2.0 * due + 4 * dt) - start) / (order - start) >= 0.9
            late = float(np.argmax(done)) * dt if done.any() else math.inf
            points.append((where, late / (due + 0.5 * dt)))
            seconds.append(late)
        wrong = f"{name} does not carry out its order in the time that the ship's file gives, {{at}}"
        found.append(worst(f"{name}: time of nine tenths of an order over that of the file", points, limit.LATE, wrong))
        found.append(Finding(f"{name}: nine tenths of the order after", seconds[0], "s"))
    slow = [name for name in controls if not p.ship.actuators.of(name).at_once]
    at_once = [name for name in controls if name not in slow]
    idle = " and ".join([", ".join(at_once[:-1]), at_once[-1]]) if len(at_once) > 1 else "".join(at_once)
    idle += " obey at once" if len(at_once) > 1 else " obeys at once"
    # the steering gear has to wait; a shaft may obey at once where no number of it is known
    waits = bool([name for name in slow if name in p.steering] or (slow and not set(controls) & set(p.steering)))
    shown = Finding("controls that take time, of those judged", len(slow) / len(controls), "-",
                    limit.WAITS if waits else limit.ALL_WAIT,
                    f"{idle}: the ship's file gives no rate, lag or dead time")  # fmt: skip
    found += [*_through(p, controls), *(typical.waiting(p) if set(controls) & set(p.steering) else ())]
    good = "orders take the time to act that the ship's file gives"
    good += f"; {idle}, its file says nothing" if at_once else ""
    run = p.run(0.5 * p.n_P, 0.5 * p.limit, 10 * p.unit_time)
    lines = tuple(
        (label, run.t, run[channel] / (run[f"{name}_cmd"][0] or 1.0))
        for name in controls
        for label, channel in ((name, name), (f"{name} ordered", f"{name}_cmd"))
    )
    return judged(good, [shown, *found], Plot("Answer to a step of the order", "t [s]", "over the order", lines))


def _through(p: Probe, controls: tuple[str, ...]) -> Iterator[Finding]:
    """The simulated ship obeys its actuators: a run has the answer that they give by themselves."""
    run = p.run(0.5 * p.n_P, 0.5 * p.limit, 10 * p.unit_time)
    points: list[tuple[str, float]] = []
    for name in controls:
        servo, order = p.ship.actuators.of(name), float(run[f"{name}_cmd"][0])
        start = float(run[name][0])
        if servo.at_once or order == start or isinstance(servo, Azimuth):
            continue
        alone = _answer(servo, start, order, run.dt, run.t[-1])[: len(run)]
        points.append((name, float(np.abs(run[name][: len(alone)] - alone).max()) / abs(order - start)))
    if points:
        wrong = "in a run {at} does not move as its actuator does"
        yield worst(
            "actuator in a run, apart from the actuator by itself", points, limit.SAME_GEAR, wrong, "of the step"
        )


def limits(p: Probe) -> Judgement:
    """Angle and rate have their greatest values, which are reached and not exceeded, to both sides."""
    if not p.steering:
        return Judgement("not applicable", "the ship has no steering order; its controls are "
                         + ", ".join(p.ship.model.controls))  # fmt: skip
    found: list[Finding] = []
    for name in p.ship.model.controls:
        found += _limited(p, name)
    return judged("angle and rate reach their greatest values to both sides and keep within them", found)


def _limited(p: Probe, name: str) -> Iterator[Finding]:
    """Limits and rate of one control: those of a steering gear are required, those that exist must hold."""
    servo = p.ship.actuators.of(name)
    if name in p.steering:
        yield from _steering_gear(p, name, servo)
    rate, lag = float(servo.rate), float(getattr(servo, "lag", 0.0))
    if isinstance(servo, Azimuth):
        ends = {"starboard": 0.9 * math.pi, "port": -0.9 * math.pi} if math.isfinite(rate) else {}
    else:
        known = {"high": float(servo.high), "low": float(servo.low)}
        ends = {side: end for side, end in known.items() if math.isfinite(end) and end}
    reached: list[tuple[str, float]] = []
    fastest: list[tuple[str, float]] = []
    for side, end in ends.items():
        step = abs(end) / rate if math.isfinite(rate) else 1.0
        dt = max(step / 200.0, 1e-6)
        order = end if isinstance(servo, Azimuth) else 3.0 * end
        values = _answer(servo, 0.0, order, dt, 2.0 * step + 10.0 * lag + float(servo.dead_time) + 4 * dt)
        extreme = values[-1] if abs(values / end).max() <= 1.0 + 1e-9 else values[int(np.argmax(np.abs(values)))]
        reached.append((f"{side} side", float(extreme) / end))
        if math.isfinite(rate):
            fastest.append((f"to the {side} side", float(np.abs(np.diff(values)).max()) / dt / rate))
    if reached:
        wrong = f"{name} does not reach its limit, or passes it, {{at}}"
        yield worst(f"{name}: end of an order beyond the limit, over the limit", reached, limit.REACHED, wrong)
    if fastest:
        wrong = f"{name} does not move at the rate of the ship's file, {{at}}"
        yield worst(f"{name}: greatest rate measured over that of the file", fastest, limit.RATE, wrong)


def _steering_gear(p: Probe, name: str, servo: Servo) -> Iterator[Finding]:
    """Angle and rate that a steering gear must have in the ship's file."""
    scale, of = (_DEGREE, "deg") if unit(name) == "rad" else (1.0, unit(name))
    low, high, rate = float(servo.low), float(servo.high), float(servo.rate)
    if name.partition("_")[0] == "delta":
        wrong = f"{name} has no greatest angle in the ship's file, or an impossible one"
        yield worst(f"{name}: greatest angle", [("high", high / scale), ("low", -low / scale)], limit.ANGLE, wrong, of)
    elif not isinstance(servo, Azimuth):
        wrong = f"{name} has no greatest value in the ship's file"
        yield Finding(f"{name}: greatest value", high, of, limit.SOME, wrong)
    wrong = f"{name} has no greatest rate in the ship's file"
    yield Finding(f"{name}: greatest rate", rate / scale, f"{of}/s", limit.SOME, wrong)
    if math.isfinite(rate) and unit(name) == "rad":
        top = high if math.isfinite(high) else p.limit
        lengths = top / rate / p.unit_time
        wrong = f"the rate of {name} is not that of a steering gear: {lengths:.2g} lengths from midships to hard over"
        # a small craft at little speed sails far in the time that SOLAS gives every ship
        if lengths <= limit.STROKE.high or rate < limit.SOLAS:
            yield Finding(f"{name}: from midships to hard over", lengths, "L/U", limit.STROKE, wrong)


def places(p: Probe) -> Iterator[Finding]:
    """Thrusters stand within the hull where their names say, push where they point, and have the size of thrusters."""
    if not p.rests:
        return
    L, U, even = p.ship.L_pp, p.U, shares(p)
    for name in p.ship.model.thrusters_by_name:
        found = [_aside(p, name, even, sign) for sign in (1.0, -1.0)]
        for force in found:
            if force is None or not math.hypot(force[0], force[1]):
                continue
            wrong = f"thruster {name} stands outside of the hull, or x, y are in another unit"
            along = abs(force[0]) > abs(force[1])
            lever = float(force[2] / force[0 if along else 1])
            yield Finding(f"{name}: lever of its thrust", abs(lever), "L", limit.THRUSTER_LEVER, wrong)
            yield from _abreast(p, name, even)
            side = next((sign for words, sign in _PLACES if name.startswith(words)), 0.0)
            if side and not along:
                wrong = f"thruster {name} stands at the other end: bow and stern look exchanged, or x its sign"
                yield Finding(f"{name}: lever towards its name", side * lever, "L", limit.NAMED_PLACE, wrong)
            size = math.hypot(force[0], force[1]) * U * U / (L * 9.81) / float(even[0, 0])
            yield from ranged(f"{name}: thrust over weight", size, "-", limit.THRUSTER_FORCE,
                              f"the thrust of {name} is that of no thruster of such a ship")  # fmt: skip
            if f"alpha_{name}" in p.ship.model.controls:
                off = float(abs(force[0]) + max(0.0, -force[1])) / math.hypot(force[0], force[1])
                yield Finding(f"{name}: thrust off its direction", off, "-", limit.DIRECTED,
                              f"the thrust of {name} does not point where its angle says")  # fmt: skip
            break


def _abreast(p: Probe, name: str, even: Array) -> Iterator[Finding]:
    """A thruster that is called port stands to port: pushing ahead it turns the ship to starboard."""
    side = next((sign for words, sign in _ABREAST if name.startswith(words)), 0.0)
    force = _aside(p, name, even, 1.0, 0.0) if side else None
    if force is not None and abs(force[0]) > abs(force[1]):
        wrong = f"thruster {name} stands on the other side: port and starboard look exchanged, or y its sign"
        lever = -side * float(force[2] / force[0])
        yield Finding(f"{name}: lever across towards its name", lever, "L", limit.NAMED_PLACE, wrong)


def _aside(p: Probe, name: str, even: Array, sign: float, angle: float = 0.5 * math.pi) -> Array | None:
    """X, Y over m U^2/L and N over m U^2 of a thruster at rest that pushes to starboard; None without one.

    Args:
        angle: of a thruster that turns [rad].
    """
    controls, names = list(p.controls()), p.ship.model.controls
    strength = next((one for one in names if one in (f"n_{name}", f"f_{name}", f"throttle_{name}")), "")
    if not strength:
        return None
    high = float(p.ship.actuators.of(strength).high)
    order = high if math.isfinite(high) else abs(p.controls(p.n_P)[names.index(strength)]) or 1.0
    controls[names.index(strength)] = sign * order
    if f"alpha_{name}" in names:
        controls[names.index(f"alpha_{name}")] = angle
    still = list(controls)
    still[names.index(strength)] = 0.0
    usual, pushed = p.at([(0.0, 0.0, 0.0)], [tuple(still), tuple(controls)])
    return even @ ((pushed - usual) * np.array([1.0, 1.0, p.ship.L_pp]) * p.ship.L_pp / p.U**2)


def own_thrusters(p: Probe) -> tuple[str, ...]:
    """Controls of side thrusters: those that follow neither rudder nor propeller."""
    return tuple(name for name in p.ship.model.controls if name not in {*p.steering, *p.propulsion})


def thrusters(p: Probe) -> list[Finding]:
    """Side thrusters push to the ordered side at every speed, by the square of revolutions, at most as at rest."""
    found: list[Finding] = []
    for name in own_thrusters(p):
        if unit(name) != "1/s":
            continue
        high = float(p.ship.actuators.of(name).high)
        order = high if math.isfinite(high) else 1.0
        still = {sign: _push(p, 0.0, name, sign * order) for sign in (1.0, -1.0)}
        if not p.rests or not any(np.hypot(*push[1:]) for push in still.values()):
            continue
        aside = [("starboard", float(still[1.0][1])), ("port", -float(still[-1.0][1]))]
        found.append(worst(f"{name}: sway by orders to either side, at rest", aside, limit.PUSH,
                           f"{name} does not push to the side of its order, {{at}}", "U^2/L"))  # fmt: skip
        kept: list[tuple[str, float]] = []
        for f in (*p.astern, *p.ahead):
            for sign, rest in still.items():
                way = _push(p, f * p.U, name, sign * order)
                where = f"{f:g} U, {'starboard' if sign > 0 else 'port'}"
                kept += [
                    (f"{what}, {where}", float(way[k] / rest[k])) for k, what in ((1, "sway"), (2, "yaw")) if rest[k]
                ]
        wrong = f"{name} changes its side or gains force under way, {{at}}"
        found.append(worst(f"{name}: force under way over that at rest", kept, limit.KEPT, wrong))
        squares = [(side, float(still[sign][1] / (_push(p, 0.0, name, 0.5 * sign * order)[1] or math.nan)))
                   for sign, side in ((1.0, "starboard"), (-1.0, "port"))]  # fmt: skip
        wrong = f"the thrust of {name} does not go with the square of revolutions, {{at}}"
        found.append(worst(f"{name}: force at twice the revolutions", squares, limit.THRUST_SQUARE, wrong))
        even = float(-still[-1.0][1] / (still[1.0][1] or math.nan))
        found.append(Finding(f"{name}: force to port over starboard", even, "-", limit.SIDES,
                             f"{name} pushes unlike to the two sides"))  # fmt: skip
    return found


def _push(p: Probe, u: float, name: str, order: float) -> Array:
    """What one control adds to surge, sway and yaw at headway `u`, over U^2/L."""
    controls = list(p.controls())
    controls[p.ship.model.controls.index(name)] = order
    usual, pushed = p.at([(u, 0.0, 0.0)], [p.controls(), tuple(controls)])
    return (pushed - usual) * np.array([1.0, 1.0, p.ship.L_pp]) * p.ship.L_pp / p.U**2


def losses(p: Probe) -> tuple[list[Finding], tuple[Plot, ...]]:
    """What side thrusters lose with speed ahead."""
    found: list[Finding] = []
    lines: list[tuple[str, Array, Array]] = []
    for name in own_thrusters(p):
        high = float(p.ship.actuators.of(name).high)
        order = high if math.isfinite(high) else 1.0
        shares = (0.0, 0.25, 0.5, 0.75, 1.0)
        sizes = {
            sign: np.array([math.hypot(*_push(p, f * p.U, name, sign * order)[1:]) for f in shares]) for sign in (1, -1)
        }
        if not sizes[1][0] > 0:
            continue
        left = {sign: size / size[0] for sign, size in sizes.items() if size[0] > 0}
        points = [("starboard" if sign > 0 else "port", float(share[2])) for sign, share in left.items()]
        wrong = f"{name} keeps its force at speed, to {{at}}: its file gives no loss"
        found.append(worst(f"{name}: yaw and sway left at 0.5 U", points, limit.LOSS, wrong, "of that at rest"))
        falls = [(f"{b:g} over {a:g} U", float(x - y)) for share in left.values()
                 for (a, x), (b, y) in pairwise(list(zip(shares, share, strict=True))[:3])]  # fmt: skip
        wrong = f"{name} does not lose force with every gain of speed, {{at}}"
        found.append(worst(f"{name}: fall of force with speed", falls, limit.FALLS, wrong, "of that at rest"))
        lines.append((name, np.array(shares), left[1]))
    plots = (Plot("Force of side thrusters under way", "u/U", "of that at rest", tuple(lines)),) if lines else ()
    return found, plots


def side_thrusters(p: Probe) -> Judgement:
    """A side thruster loses force with headway, and pushes to the side of its order."""
    found, plots = losses(p)
    if not found:
        return Judgement("not applicable", "the ship's file has no side thruster (a [thrusters.NAME] table of "
                         "thruster:Tunnel would give it one)")  # fmt: skip
    return judged(
        "side thrusters push to the ordered side and lose force with headway", [*found, *thrusters(p)], *plots
    )

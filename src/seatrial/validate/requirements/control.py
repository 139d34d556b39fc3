"""Checks of what steers the ship: side thrusters, reversing, delays and limits of the actuators."""

from __future__ import annotations

import math

import numpy as np

from ...actuators import Azimuth
from ...data import unwrapped
from ...models import unit
from . import Judgement, Plot, given
from .probe import Probe

_DEGREE = math.pi / 180.0


def side_thrusters(p: Probe) -> Judgement:
    """A side thruster loses force with headway."""
    conventional = {*p.steering, *p.propulsion}
    own = [name for name in p.ship.model.controls if name not in conventional]
    evidence: dict[str, tuple[float, str]] = {}
    shares: list[float] = []
    for name in own:
        high = float(p.ship.actuators.of(name).high)
        order = high if math.isfinite(high) else 1.0
        forces = [_sideways(p, u, name, order) for u in (0.0, 0.25 * p.U, 0.5 * p.U)]
        if abs(forces[0]) > 0:
            share = [f / forces[0] for f in forces]
            shares.append(share[-1])
            evidence |= {f"{name}: yaw and sway left at {q:g} U": (s, "of that at rest")
                         for q, s in zip((0.25, 0.5), share[1:], strict=True)}  # fmt: skip
    if not shares:
        return Judgement("not applicable", "the ship's file has no side thruster (a [thrusters.NAME] table of "
                         "thruster:Tunnel would give it one)")  # fmt: skip
    return given(
        max(shares) < 0.95, "side thrusters lose force with headway",
        "side thrusters keep their force at speed: their file gives no loss", evidence,
    )  # fmt: skip


def _sideways(p: Probe, u: float, name: str, order: float) -> float:
    """What one control adds to sway and yaw at headway `u`, as one signed acceleration [m/s^2]."""
    controls = list(p.controls())
    usual = p.rates(u, 0.0, 0.0, tuple(controls))
    controls[p.ship.model.controls.index(name)] = order
    change = p.rates(u, 0.0, 0.0, tuple(controls)) - usual
    sign = 1.0 if change[1] >= 0 else -1.0
    return sign * float(np.hypot(change[1], 0.3 * p.ship.L_pp * change[2]))


def reversing(p: Probe) -> Judgement:
    """A reversed propeller swings the bow to the side of its hand."""
    if not p.propulsion:
        return Judgement("not applicable", "the ship has no propeller order n_P")
    if any(name.startswith("alpha") for name in p.steering):
        return Judgement("not applicable", "its thrusters turn about: they push astern without a reversed propeller")
    if not p.allows("n_P", -0.5 * p.n_P):
        return Judgement("fail", "the ship's file says that the model is not valid at reversed revolutions: "
                         "its propeller has no side force astern")  # fmt: skip
    u = 0.3 * p.U
    ahead, astern = (p.rates(u, 0.0, 0.0, p.controls(n))[1:] for n in (p.n_P, -p.n_P))
    unit = p.U**2 / p.ship.L_pp
    swing = float(np.hypot(astern[0], p.ship.L_pp * astern[1])) / unit
    run = p.run(-p.n_P, 0.0, 25 * p.unit_time, speed=0.5 * p.U)
    heading = float(unwrapped(run["psi"])[-1]) / _DEGREE
    evidence = {"sway and yaw by reversed revolutions": (swing, "U^2/L"),
                "the same ahead": (float(np.hypot(ahead[0], p.ship.L_pp * ahead[1])) / unit, "U^2/L"),
                "heading change backing for 25 L/U": (heading, "deg")}  # fmt: skip
    plot = Plot("Heading while backing", "t U/L", "psi [deg]",
                (("rudder midships", run.t / p.unit_time, unwrapped(run["psi"]) / _DEGREE),))  # fmt: skip
    side = "starboard" if heading > 0 else "port"
    return given(swing > 1e-6, f"backing swings the bow to {side}",
                 "a reversed propeller makes no side force: the model has no hand", evidence, plot)  # fmt: skip


def delay(p: Probe, controls: tuple[str, ...] | None = None) -> Judgement:
    """An order takes time to act; all orders, or those of `controls`."""
    controls = (*p.steering, *p.propulsion) or p.ship.model.controls if controls is None else controls
    if not controls:
        return Judgement("not applicable", "the ship has no such order")
    run = p.run(0.5 * p.n_P, 0.5 * p.limit, 10 * p.unit_time)
    evidence: dict[str, tuple[float, str]] = {}
    for name in controls:
        wanted = run[f"{name}_cmd"][0] - run[name][0]
        if wanted:
            done = (run[name] - run[name][0]) / wanted >= 0.9
            late = float(run.t[int(np.argmax(done))]) if done.any() else math.inf
            waits = not p.ship.actuators.of(name).at_once
            evidence[f"{name}: nine tenths of the order after"] = (late if waits else 0.0, "s")
    slow = [name for name in controls if not p.ship.actuators.of(name).at_once]
    lines = tuple(
        (label, run.t, run[channel] / (run[f"{name}_cmd"][0] or 1.0))
        for name in controls
        for label, channel in ((name, name), (f"{name} ordered", f"{name}_cmd"))
    )
    idle = ", ".join(name for name in controls if name not in slow)
    good = "orders take time to act" + (f"; {idle} obeys at once, its file says nothing" if idle else "")
    steers = [name for name in slow if name in p.steering] or not p.steering
    return given(
        bool(slow) and bool(steers or set(controls) <= set(p.propulsion)), good,
        f"{idle} obeys at once: the ship's file gives no rate, lag or dead time", evidence,
        Plot("Answer to a step of the order", "t [s]", "over the order", lines),
    )  # fmt: skip


def limits(p: Probe) -> Judgement:
    """Angle and rate have their greatest values."""
    if not p.steering:
        return Judgement("not applicable", "the ship has no steering order; its controls are "
                         + ", ".join(p.ship.model.controls))  # fmt: skip
    run = p.run(p.n_P, math.radians(120.0), 15 * p.unit_time)
    evidence: dict[str, tuple[float, str]] = {}
    lacking: list[str] = []
    for name in p.steering:
        servo = p.ship.actuators.of(name)
        turns = isinstance(servo, Azimuth)
        reached, rate = float(np.abs(run[name]).max()), float(np.abs(np.diff(run[name])).max() / run.dt)
        scale, of = (_DEGREE, "deg") if unit(name) == "rad" else (1.0, unit(name))
        evidence[f"{name}: greatest value when 120 deg of rudder are ordered"] = (reached / scale, of)
        evidence[f"{name}: greatest rate"] = (rate / scale, f"{of}/s")
        if not turns and not math.isfinite(float(servo.high)):
            lacking.append(f"{name} has no greatest angle")
        if not math.isfinite(float(servo.rate)):
            lacking.append(f"{name} has no greatest rate")
    return given(not lacking, "angle and rate stay within their greatest values",
                 "; ".join(lacking) + " in the ship's file", evidence)  # fmt: skip

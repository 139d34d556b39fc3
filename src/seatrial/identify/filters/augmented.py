"""A ship with what acts on it unseen as further states: current, slow forces, errors of instruments, parameters.

Names of the further states: those of `nuisance.CURRENT`; ``slow.u``, ``slow.v_m``, ``slow.r``, accelerations by forces
that the model lacks [m/s^2, rad/s^2]; ``bias.CHANNEL``, a slow error of one reading; ``antenna.x``, ``antenna.y``, how
far forward and to starboard of its stated place the satellite antenna stands [m]; those of `WAVES`, the first-order
motion of midship in waves along the axes of the ship, a displacement and its rate [m, rad, m/s, rad/s]; and paths of
parameters of the model.  Each holds its value, or returns to zero with a time constant of its own; its process noise
lets it walk.  A motion in waves is an oscillator that white noise drives (Fossen 2011, section 8.2, whose output is the
rate): its band is that of the sea, so that it takes up neither a step nor a drift, which a larger noise would.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from ...core.parameters import specs, unknown
from ...core.symbolic import alone
from ...core.values import dataclass, replace
from ...environment import CHANNELS, Environment
from ...models import Sampled
from ...ships import Ship
from ...simulate.loop import open_loop, open_loop_parameters
from .. import StudyError
from ..nuisance import CURRENT
from .kalman import FilterModel, Numeric, dense, rk4
from .measurement import Antenna, Sensor, Track

SLOW = ("slow.u", "slow.v_m", "slow.r")
BIAS = "bias."
ANTENNA = ("antenna.x", "antenna.y")
WAVES: Mapping[str, str] = {"wave.x": "wave.u", "wave.y": "wave.v_m", "wave.psi": "wave.r"}
"""Displacements by waves, and the rate of each."""


@dataclass(frozen=True)
class Augmented:
    """A traced ship with further states.

    Attributes:
        model: what a filter computes with.
        own: number of states of the ship's own model, which come first.
        controls: controls of the ship, the first of what acts.
        onward: (state, acting, dt) -> state after dt.
        pushed: (state, acting, dt) -> derivative of that by the controls, transposed: shape (controls, n).
    """

    model: FilterModel
    own: int
    controls: tuple[str, ...]
    onward: Numeric
    pushed: Numeric

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all states."""
        return self.model.names


@alone
def augmented(ship: Ship, more: Sequence[str], sensors: Sequence[Sensor], memory: Mapping[str, float]) -> Augmented:
    """Trace a ship with the further states `more`.

    Args:
        memory: time constant of each state that returns to zero [s], others hold their value.  Of an oscillator that of
            the displacement is 1/(2 damping omega), that of the rate 1/omega.

    Raises:
        StudyError: a model in discrete time, or a name of no such state.
    """
    if isinstance(ship.model, Sampled):
        raise StudyError(f"{ship.name}: a model in discrete time; a filter here needs rates, not samples")
    channels = tuple(name for sensor in sensors for name in sensor.channels)
    waves = tuple(name for pair in WAVES.items() for name in pair)
    known = (*CURRENT, *SLOW, *ANTENNA, *waves, *(f"{BIAS}{name}" for name in channels), *specs(ship.model))
    for name in more:
        if name not in known:
            raise StudyError(f"{ship.name}: {unknown(name, known, 'parameter')}")
    system, values = open_loop(ship), open_loop_parameters(ship).tolist()
    own, controls, names = len(system.states), len(ship.model.controls), (*system.states, *more)
    at = {name: own + k for k, name in enumerate(more)}
    n = len(names)
    z, a, dt = ca.SX.sym("z", n), ca.SX.sym("a", controls + len(CHANNELS)), ca.SX.sym("dt")

    def rates(state: Any, acting: Any) -> Any:
        inputs = [state[at[path]] if path in at else values[k] for k, path in enumerate(system.parameters)]
        moving = list(system.derivative(tuple(ca.vertsplit(state[:own])), tuple(ca.vertsplit(acting)), tuple(inputs)))
        for name in (name for name in SLOW if name in at):
            place = system.states.index(name.removeprefix("slow."))
            moving[place] = moving[place] + state[at[name]]
        return ca.vertcat(*moving, *(_walks(state, at, name, memory) for name in more))

    def rates_now(state: Any) -> Any:
        return rates(state, a)

    whole, half = rk4(rates_now, z, dt), rk4(rates_now, z, 0.5 * dt)
    read = _read(sensors, z, a[controls:], at)
    angle, noise, delay = np.array([(float(s.angle), s.sd, s.delay) for s in sensors for _ in s.channels]).T
    points = 2 * n + 1
    model = FilterModel(
        names=names, channels=channels, angle=angle, noise=noise, delay=delay,
        step=Numeric(dense([z, a, dt], [whole, ca.jacobian(whole, z), ca.jacobian(half, z)])),
        step_points=Numeric(dense([z, a, dt], [whole]).map("points", "serial", points, [1, 2], [])),
        read=Numeric(dense([z, a], [read, ca.jacobian(read, z)])),
        read_points=Numeric(dense([z, a], [read]).map("points", "serial", points, [1], [])),
    )  # fmt: skip
    pushed = ca.jacobian(whole, a)[:, :controls]
    return Augmented(
        model, own, ship.model.controls, Numeric(dense([z, a, dt], [whole])), Numeric(dense([z, a, dt], [pushed]))
    )


def _walks(state: Any, at: Mapping[str, int], name: str, memory: Mapping[str, float]) -> Any:
    """Rate of a further state."""
    if name in WAVES:
        return state[at[WAVES[name]]]
    if name not in memory:
        return 0.0
    held = {rate: displaced for displaced, rate in WAVES.items()}.get(name)
    if held is None:
        return -state[at[name]] / memory[name]
    return -state[at[held]] / memory[name] ** 2 - state[at[name]] / memory[held]


def _in_waves(z: Any, at: Mapping[str, int]) -> tuple[Any, ...]:
    """The motion with that in waves on it, whose heading turns the axes of the slow velocity."""
    x, y, psi, u, v_m, r, *others = ca.vertsplit(z)
    if not any(name in at for name in WAVES):
        return x, y, psi, u, v_m, r, *others
    ahead, aside, turn = (z[at[name]] if name in at else 0.0 for name in WAVES)
    du, dv, dr = (z[at[name]] if name in at else 0.0 for name in WAVES.values())
    c, s, c_w, s_w = ca.cos(psi), ca.sin(psi), ca.cos(turn), ca.sin(turn)
    return (x + ahead * c - aside * s, y + ahead * s + aside * c, psi + turn, (u + du) * c_w + (v_m + dv) * s_w,
            (v_m + dv) * c_w - (u + du) * s_w, r + dr, *others)  # fmt: skip


def _read(sensors: Sequence[Sensor], z: Any, around: Any, at: Mapping[str, int]) -> Any:
    """What the sensors read, with their slow errors."""
    here = Environment(*ca.vertsplit(around))
    north, east = (z[at[name]] if name in at else 0.0 for name in CURRENT)
    here = here._replace(current_x=here.current_x + north, current_y=here.current_y + east)
    slow, state = tuple(ca.vertsplit(z)), _in_waves(z, at)
    out: list[Any] = []
    ahead, aside = (z[at[name]] if name in at else 0.0 for name in ANTENNA)
    for sensor in sensors:
        told = sensor.read(state, here)
        if isinstance(sensor, Antenna | Track):
            # by the slow motion alone: sway goes with the yaw in waves, as if the antenna stood elsewhere
            there, not_there = (replace(sensor, x=x, y=y).read(slow, here) for x, y in ((ahead, aside), (0.0, 0.0)))
            told = tuple(a + b - c for a, b, c in zip(told, there, not_there, strict=True))
        for channel, value in zip(sensor.channels, told, strict=True):
            name = f"{BIAS}{channel}"
            out.append(value + z[at[name]] if name in at else value)
    return ca.vertcat(*out)

"""Networks as a model family: accelerations from velocities, controls and the apparent wind.

Wakita 2022 (Eqs. 7, 9, Euler's rule of Eqs. 20-22), Sawada 2024 section 4.1.3.  A network is sampled and
stepped: it is trained in PyTorch, and moves all lanes at once here, in NumPy.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from ..core.parameters import ParameterError, Scalar, Scalars, spec
from ..core.symbolic import is_symbol
from ..core.values import dataclass, field
from ..data import Array
from ..environment import CHANNELS, Environment
from . import STEERING, Stepped
from .network import INPUTS, Network, recurrent
from .network_pass import Pass

_TRUE_WIND, _CURRENT = (
    slice(len(STEERING) + CHANNELS.index(name), len(STEERING) + CHANNELS.index(name) + 2)
    for name in ("wind_x", "current_x")
)


@dataclass(frozen=True, kw_only=True)
class Neural(Stepped):
    """Accelerations of u, v_m and r through the water from a network of velocities, controls and apparent wind.

    Between samples the accelerations hold, and position and heading follow Euler's rule.  The network is
    silent at the origin of all its inputs; at rest a rudder or the wind alone may move it as in the
    data, so the model is not valid there.
    """

    valid_at_rest: ClassVar[bool] = False

    dt: Scalar = spec("s", "sample time; the model runs at no other", (1e-6, 1e4))
    network: Network = field(metadata={"network": True})

    @property
    def learned(self) -> Network:
        return self.network

    @property
    def feels_wind(self) -> bool:
        return self.network.wind

    @property
    def needed(self) -> tuple[str, ...]:
        return ("U_T", "gamma_T") if self.network.wind else ()

    @property
    def look_back(self) -> int:
        return self.network.look_back

    @property
    def memory(self) -> tuple[str, ...]:
        """Whether it has begun (0: the first sample held before), then earlier inputs or the latent state."""
        net = self.network
        if net.kind == "feedforward":
            return ()
        if recurrent(net.kind):
            size = net.layers[0] * (2 if net.kind == "lstm" else 1)
            return ("begun", *(f"z_{k}" for k in range(1, size + 1)))
        back = range(net.look_back, 0, -1)
        return ("begun", *(f"{name}_back_{k}" for k in back for name in INPUTS[: net.inputs]))

    def begin(self, state: Scalars, control: Scalars) -> Scalars:
        """Memory that lets the first sample, wind and all, have held over the look-back."""
        return (0.0,) * len(self.memory)

    def recall_memory(self, state: Array, acting: Array) -> tuple[float, ...]:
        """Memory after measured samples before a start, the oldest first.

        Where fewer than the look-back are known, the first of them stands for those before it.

        Args:
            state: shape (samples, 6), at least one.
            acting: controls and environment, shape (samples, 10).
        """
        if not self.look_back:
            return ()
        known = features(self.network, state, acting)[-self.look_back :]
        missing = np.repeat(known[:1], self.look_back - len(known), axis=0)
        past = np.vstack([missing, known])
        if not recurrent(self.network.kind):
            return (1.0, *past.ravel().tolist())
        through = Pass(_usable(self.network), 1)
        through.run_in(past[None])
        return (1.0, *through.cell.latent.ravel().tolist())

    def plant(self, memory: Array) -> Flight:
        """The network under way from what each lane remembers, shape (lanes, memory)."""
        return Flight(self, memory)

    def advance(
        self, state: Scalars, control: Scalars, environment: Environment, memory: Scalars
    ) -> tuple[Scalars, Scalars]:
        """The contract's; symbols instead of numbers are a ParameterError."""
        if any(map(is_symbol, (*state, *control, *environment, *memory))):
            cannot = "cannot be linearised, traced or exported as symbols"
            raise ParameterError(f"a network of {self.network.count} weights {cannot}; ask for numbers")
        now, acting = np.array([state[:6]]), np.array([(*control, *environment)])
        flight = Flight(self, np.array([memory]))
        rates = flight.rates(now, acting)[0, 3:6].tolist()
        return tuple(rates), flight.memory_after(np.array([memory]), now, acting)


class Flight:
    """A network moving many lanes; it has memory, so `rates` is called once a sample."""

    def __init__(self, model: Neural, memory: Array) -> None:
        self.network, self.dt = _usable(model.network), float(model.dt)
        self.through = Pass(self.network, len(memory))
        self._start: Array | None = memory if memory.shape[1] else None

    def rates(self, state: Array, acting: Array) -> Array:
        """Rates (lanes, 6) under controls and environment (lanes, 10) that hold over one sample time."""
        c, s = np.cos(state[:, 2]), np.sin(state[:, 2])
        flows = bool(acting[:, _CURRENT].any())
        x = _seen(self.network, state, acting, c, s, flows)
        if self._start is not None:
            self._begin(self._start, x)
        answer = self.through.step(x)
        u, v, rates = state[:, 3], state[:, 4], np.empty_like(state)
        rates[:, 0], rates[:, 1], rates[:, 2] = u * c - v * s, u * s + v * c, state[:, 5]  # Wakita 2022 Eq. 20
        rates[:, 3:6] = answer
        if flows:  # what the current seems to do as the ship turns in it
            turned = state[:, 2] + self.dt * state[:, 5]
            after, before = _to_body(acting, _CURRENT, np.cos(turned), np.sin(turned)), _to_body(acting, _CURRENT, c, s)
            rates[:, 3] += (after[0] - before[0]) / self.dt
            rates[:, 4] += (after[1] - before[1]) / self.dt
        return rates

    def memory_after(self, memory: Array, state: Array, acting: Array) -> tuple[float, ...]:
        """What the first lane remembers after a first call of `rates` that began from `memory`."""
        if not memory.shape[1]:
            return ()
        if recurrent(self.network.kind):
            return (1.0, *self.through.cell.latent[0].tolist())
        x = features(self.network, state, acting)
        past = self._past(memory, x)[0]
        return (1.0, *np.vstack([past, x])[1:].ravel().tolist())

    def _past(self, memory: Array, x: Array) -> Array:
        """Inputs before this sample (lanes, look-back, inputs): remembered, or this sample's own."""
        back = self.network.look_back
        held = np.repeat(x[:, None], back, axis=1)
        if recurrent(self.network.kind):
            return held
        return np.where(memory[:, :1, None] > 0, memory[:, 1:].reshape(held.shape), held)

    def _begin(self, memory: Array, x: Array) -> None:
        self._start = None
        remembers = recurrent(self.network.kind)
        if not remembers or not (memory[:, 0] > 0).all():
            self.through.run_in(self._past(memory, x))
        if not remembers:
            return
        latent = np.where(memory[:, :1] > 0, memory[:, 1:], self.through.cell.latent)
        self.through.cell.latent = latent.astype(self.through.precision)


def features(network: Network, state: Array, acting: Array) -> Array:
    """Inputs of a network in SI units, shape (rows, inputs), from states (rows, 6) and controls with environment.

    Velocities through the water; the apparent wind from the true wind, the heading and the velocity over ground
    (Wakita 2022 Eq. 6).
    """
    flows = bool(acting[:, _CURRENT].any())
    return _seen(network, state, acting, np.cos(state[:, 2]), np.sin(state[:, 2]), flows)


def _seen(network: Network, state: Array, acting: Array, c: Array, s: Array, flows: bool) -> Array:
    x = np.empty((len(state), network.inputs))
    x[:, :3], x[:, 3:5] = state[:, 3:6], acting[:, :2]
    if network.wind:
        u_W, v_W = _to_body(acting, _TRUE_WIND, c, s)
        x[:, 5], x[:, 6] = u_W + state[:, 3], v_W + state[:, 4]
    if flows:
        u_C, v_C = _to_body(acting, _CURRENT, c, s)
        x[:, 0] -= u_C
        x[:, 1] -= v_C
    return x


def _to_body(acting: Array, which: slice, c: Array, s: Array) -> tuple[Array, Array]:
    """The vector that stands at `which` in ship axes."""
    north, east = acting[:, which.start], acting[:, which.start + 1]
    return north * c + east * s, east * c - north * s


def _usable(network: Network) -> Network:
    if not network.trained:
        raise ParameterError("the network is untrained; train it: seatrial identify STUDY.toml -o DIR")
    return network

"""The forward pass of a network over samples, many lanes at once, in NumPy.

`Pass` takes one sample after the other, as a simulation does: a network that forgets keeps the chains of the
next m answers in flight, each one sample further on than the last, so a sample costs one matrix product
instead of m.  Wide networks go in single precision, within 1e-6 of the largest acceleration of what
`accelerations` gives, which passes over whole records by the equations as they are printed, in double precision.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..data import Array
from .network import Network, recurrent

Numbers = NDArray[np.floating[Any]]
Arrays = Mapping[str, Numbers]


_WIDE = 100
"""Units of a layer from which single precision is worth it: twice as fast."""


class Cell(Protocol):
    """The first layer, which alone remembers."""

    latent: Numbers
    """What it remembers, shape (lanes, size)."""

    def push(self, x: Numbers) -> Numbers:
        """Its output (lanes, h) after one more sample of inputs (lanes, inputs) in SI units."""
        ...


def prepared(network: Network, precision: type[np.floating[Any]]) -> Arrays:
    """The weights in one precision, with W_x: what multiplies the inputs in SI units, (inputs, h or gates h)."""
    w = dict(network.weights)
    rows = w["W_ih"] if "W_ih" in w else np.vstack([w[n] for n in ("W_x0", "W_u0", "W_w0") if n in w])
    w["W_x"] = rows / np.array(network.scale)[:, None]
    return {name: array.astype(precision) for name, array in w.items()}


class _Plain:
    """tanh(W x + b) - tanh(b), nothing remembered: the first layer of Sawada 2024 Eq. 10, zero at the origin."""

    def __init__(self, network: Network, w: Arrays, lanes: int) -> None:
        self.W, self.b, self.rest = w["W_x"], w["b_0"], np.tanh(w["b_0"])
        self.latent = np.zeros((lanes, 0), self.b.dtype)

    def push(self, x: Numbers) -> Numbers:
        return np.tanh(x @ self.W + self.b) - self.rest


class _Chains:
    """The first line of Wakita 2022 Eq. 9: the chains that end at this sample and at the m - 2 next ones.

    The first m - 1 answers are of chains that had no beginning, and mean nothing.
    """

    def __init__(self, network: Network, w: Arrays, lanes: int) -> None:
        self.W, self.b, self.W_r, self.rest = w["W_x"], w["b_0"], w["W_r0"], np.tanh(w["b_0"])
        self.length, self.at = network.memory, 0
        self.latent = np.zeros((lanes, 0), self.b.dtype)
        self._chains = np.zeros((lanes, self.length - 1, self.b.size), self.b.dtype)
        self._spare = np.empty_like(self._chains)

    def push(self, x: Numbers) -> Numbers:
        drive = x @ self.W
        drive += self.b
        new = np.tanh(drive)
        new -= self.rest
        if self.length == 1:
            return new
        grown, h = self._spare, self.b.size
        flat = grown.reshape(-1, h)
        np.matmul(self._chains.reshape(-1, h), self.W_r, out=flat)  # W_r0^T z_1 of every chain, one product
        grown += drive[:, None]
        np.tanh(flat, out=flat)
        flat -= self.rest
        ended = grown[:, self.at].copy()
        grown[:, self.at] = new  # its place goes to the chain that begins here, from zero
        self.at = (self.at + 1) % (self.length - 1)
        self._chains, self._spare = grown, self._chains
        return ended


class _Standard:
    """The first line of Wakita 2022 Eq. 7."""

    def __init__(self, network: Network, w: Arrays, lanes: int) -> None:
        self.W, self.b, self.W_r, self.rest = w["W_x"], w["b_0"], w["W_r0"], np.tanh(w["b_0"])
        self.latent = np.zeros((lanes, self.b.size), self.b.dtype)

    def push(self, x: Numbers) -> Numbers:
        self.latent = np.tanh(x @ self.W + self.latent @ self.W_r + self.b) - self.rest
        return self.latent


def _sigmoid(x: Numbers) -> Numbers:
    return 0.5 + 0.5 * np.tanh(0.5 * x)


class _Gated:
    """An LSTM (it remembers output and cell) or a GRU; silent at the origin, as the candidate has no bias."""

    def __init__(self, network: Network, w: Arrays, lanes: int) -> None:
        self.W, self.W_h, self.b, self.b_h = w["W_x"], w["W_hh"], w["b_ih"], w["b_hh"]
        self.h, self.lstm = network.layers[0], network.kind == "lstm"
        self.latent = np.zeros((lanes, 2 * self.h if self.lstm else self.h), self.b.dtype)

    def push(self, x: Numbers) -> Numbers:
        z, h = self.latent[:, : self.h], self.h
        a, b = x @ self.W + self.b, z @ self.W_h + self.b_h
        first, second = _sigmoid(a[:, :h] + b[:, :h]), _sigmoid(a[:, h : 2 * h] + b[:, h : 2 * h])
        if self.lstm:
            cell = second * self.latent[:, h:] + first * np.tanh(a[:, 2 * h : 3 * h] + b[:, 2 * h : 3 * h])
            z = _sigmoid(a[:, 3 * h :] + b[:, 3 * h :]) * np.tanh(cell)
            self.latent = np.hstack([z, cell])
        else:
            new = np.tanh(a[:, 2 * h :] + first * b[:, 2 * h :])
            self.latent = z = (1.0 - second) * new + second * z
        return z


def _cell(network: Network, w: Arrays, lanes: int) -> Cell:
    kinds = {"feedforward": _Plain, "forgetting": _Chains, "rnn": _Standard}
    return kinds.get(network.kind, _Gated)(network, w, lanes)


class Head:
    """The layers behind the first: tanh(W z + b) - tanh(b), and the last without either (Wakita 2022 Eq. 7)."""

    def __init__(self, network: Network, w: Arrays) -> None:
        n = len(network.layers)
        self.inner = [(w[f"W_{k}"], w[f"b_{k}"], np.tanh(w[f"b_{k}"])) for k in range(1, n)]
        self.last = w[f"W_{n}"]

    def of(self, z: Numbers) -> Numbers:
        """Accelerations (lanes, 3) of the first layer's output (lanes, h)."""
        for W, b, rest in self.inner:
            z = z @ W
            z += b
            np.tanh(z, out=z)
            z -= rest
        return z @ self.last


class Pass:
    """A network on its way through the samples of so many lanes."""

    def __init__(self, network: Network, lanes: int) -> None:
        self.precision = np.float32 if max(network.layers) >= _WIDE else np.float64
        w = prepared(network, self.precision)
        self.network, self.cell, self.head = network, _cell(network, w, lanes), Head(network, w)
        on = network.limits
        self._bounds = on and (np.array(on.low), np.array(on.high), np.array(on.acceleration), on.rate)

    def run_in(self, past: Array) -> None:
        """Go through samples (lanes, samples, inputs) without an answer."""
        for k in range(past.shape[1]):
            self.cell.push(self._held(past[:, k]).astype(self.precision))

    def step(self, x: Array) -> Array:
        """Accelerations (lanes, 3) [m/s^2, m/s^2, rad/s^2] at the next sample of inputs (lanes, inputs) in SI units."""
        held = self._held(x)
        answer = np.asarray(self.head.of(self.cell.push(held.astype(self.precision))), dtype=np.float64)
        if self._bounds is None:
            return answer
        largest, rate = self._bounds[2:]
        return np.clip(answer, -largest, largest) - rate * (x[:, :3] - held[:, :3])

    def _held(self, x: Array) -> Array:
        return x if self._bounds is None else np.minimum(np.maximum(x, self._bounds[0]), self._bounds[1])


def accelerations(network: Network, inputs: Array) -> Array:
    """Accelerations at every sample of records of inputs, (lanes, samples, inputs) in SI units -> (lanes, samples, 3).

    A record begins as if its first sample had held over the look-back.  Limits are left out: this is what the
    equations define, each chain from zero at its own first sample.
    """
    x, m = np.concatenate([np.repeat(inputs[:, :1], network.look_back, axis=1), inputs], axis=1), network.look_back + 1
    lanes, samples = inputs.shape[:2]
    w = prepared(network, np.float64)
    if recurrent(network.kind):
        cell = _cell(network, w, lanes)
        z = np.stack([cell.push(x[:, k]) for k in range(x.shape[1])], axis=1)[:, m - 1 :].reshape(lanes * samples, -1)
    else:
        z = np.zeros((lanes * samples, network.layers[0]))
        for k in range(m):
            here = x[:, k : k + samples].reshape(lanes * samples, -1) @ w["W_x"] + w["b_0"]
            z = np.tanh(here + z @ w["W_r0"] if k else here) - np.tanh(w["b_0"])
    return np.asarray(Head(network, w).of(z), dtype=np.float64).reshape(lanes, samples, 3)

"""Networks as values: which kind, how wide, how far back they look, and their weights.

Wakita 2022 Eqs. 7 and 9, Sawada 2024 Eq. 10.  The symbols are the papers': an input is multiplied by the
transpose of its matrix, so a matrix has a row per input and a column per unit.  NumPy only; how a network
is passed over samples is in `network_pass`.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import numpy as np

from ..core.parameters import ParameterError
from ..core.values import dataclass, field, replace
from ..data import Array

KINDS = ("feedforward", "rnn", "forgetting", "lstm", "gru")
INPUTS = ("u", "v_m", "r", "n_P", "delta", "wind_u", "wind_v")
"""u, v_m, r [m/s, m/s, rad/s], n_P [1/s], delta [rad], U_A cos(gamma_A) and U_A sin(gamma_A) [m/s]."""
LOOK_BACK = 10
"""Samples that a start of unlimited memory runs through from zero, its own included (Wakita 2022: 1 s)."""
_GATES = {"lstm": 4, "gru": 3}
_CANDIDATE = 2
"""Where the candidate stands among the gates: input, forget, candidate, output; reset, update, candidate."""


@dataclass(frozen=True)
class Limits:
    """Bounds on a network that keep every run finite, off where a paper is reproduced.

    Attributes:
        low, high: each input is held within [low, high] before the network sees it; zero is inside.
        acceleration: largest magnitude of each output [m/s^2, m/s^2, rad/s^2].
        rate: what a velocity exceeds its range by decays at this rate [1/s], on top of the network's answer,
            so no velocity leaves its range by more than acceleration / rate.
    """

    low: tuple[float, ...]
    high: tuple[float, ...]
    acceleration: tuple[float, ...]
    rate: float = 1.0

    def __post_init__(self) -> None:
        if len(self.low) != len(self.high) or any(not a < 0.0 < b for a, b in zip(self.low, self.high, strict=True)):
            raise ParameterError("limits: low and high have one value an input each, with low < 0 < high")
        if len(self.acceleration) != 3 or any(not a > 0.0 for a in self.acceleration) or not self.rate > 0.0:
            raise ParameterError("limits: acceleration has three values above zero, and the rate is above zero")


@dataclass(frozen=True, eq=False)
class Network:
    """A network from inputs to accelerations of u, v_m, r; its output at the origin is zero.

    Attributes:
        kind: "feedforward" (Sawada 2024 Eq. 10), "rnn" (Wakita 2022 Eq. 7), "forgetting" (Eq. 9), "lstm" or "gru".
        layers: units of each hidden layer, the first (recurrent) one first; (200, 200, 200) in Wakita 2022.
        wind: whether it sees the apparent wind: 7 inputs (`INPUTS`) with it, 5 without.
        scale: what each input is divided by, in its own unit; all ones where not given.
        memory: samples that an answer depends on, its own included: 1 for "feedforward", m for "forgetting",
            0 (all of the past) for the others.
        weights: W_x0 (3, h), W_u0 (2, h), W_w0 (2, h), W_r0 (h, h), b_0 (h), then W_1, b_1 ... and the last
            W without a bias, (h, 3).  "lstm" and "gru": W_ih (inputs, gates h), W_hh (h, gates h), b_ih, b_hh
            (gates h) in place of those with a 0, gates in the order input, forget, candidate, output or
            reset, update, candidate; the biases of the candidate are zero, else the origin would move the ship.
            None at all in a network that is yet to be trained.
        limits: bounds on its inputs and outputs; None for none.
    """

    kind: str
    layers: tuple[int, ...]
    wind: bool = True
    scale: tuple[float, ...] = ()
    memory: int = 0
    weights: Mapping[str, Array] = field(default_factory=dict[str, Array])
    limits: Limits | None = None

    def __post_init__(self) -> None:
        _check_form(self)
        object.__setattr__(self, "scale", tuple(map(float, self.scale)) or (1.0,) * self.inputs)
        if len(self.scale) != self.inputs or any(not s > 0.0 for s in self.scale):
            raise ParameterError(f"scale has {len(self.scale)} values; {self.inputs} inputs take as many above zero")
        if self.limits is not None and len(self.limits.low) != self.inputs:
            raise ParameterError(f"limits are of {len(self.limits.low)} inputs; the network has {self.inputs}")
        kept = {name: np.array(array, dtype=np.float64, order="C") for name, array in self.weights.items()}
        for array in kept.values():
            array.setflags(write=False)
        object.__setattr__(self, "weights", kept)
        if kept:
            _check_weights(self)

    @property
    def inputs(self) -> int:
        """How many inputs it has."""
        return len(INPUTS) if self.wind else len(INPUTS) - 2

    @property
    def trained(self) -> bool:
        """Whether it has weights."""
        return bool(self.weights)

    @property
    def look_back(self) -> int:
        """Samples before a start that its beginning depends on."""
        return (self.memory or LOOK_BACK) - 1

    @property
    def count(self) -> int:
        """Number of weights."""
        return sum(int(np.prod(shape)) for shape in self.shapes.values())

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Shape of each array of weights by name, in the papers' order."""
        h, gates = self.layers[0], _GATES.get(self.kind, 0) * self.layers[0]
        if gates:
            found: dict[str, tuple[int, ...]] = {
                "W_ih": (self.inputs, gates), "W_hh": (h, gates), "b_ih": (gates,), "b_hh": (gates,)}  # fmt: skip
        else:
            found = {"W_x0": (3, h), "W_u0": (2, h)}
            found |= {"W_w0": (2, h)} if self.wind else {}
            found |= {"W_r0": (h, h)} if self.kind != "feedforward" else {}
            found |= {"b_0": (h,)}
        for k, (a, b) in enumerate(zip(self.layers, self.layers[1:], strict=False), 1):
            found |= {f"W_{k}": (a, b), f"b_{k}": (b,)}
        return found | {f"W_{len(self.layers)}": (self.layers[-1], 3)}

    @property
    def digest(self) -> str:
        """SHA-256 of the weights: names, shapes and 64-bit values; of nothing where there are none."""
        h = hashlib.sha256()
        for name in sorted(self.weights):
            array = self.weights[name]
            h.update(f"{name}{array.shape}".encode())
            h.update(array.astype("<f8").tobytes())
        return h.hexdigest()

    def having(self, weights: Mapping[str, Array]) -> Network:
        """The same network with other weights."""
        return replace(self, weights=weights)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Network) and self._key() == other._key()

    def __hash__(self) -> int:
        return hash(self._key())

    def _key(self) -> tuple[object, ...]:
        return (self.kind, self.layers, self.wind, self.scale, self.memory, self.limits, self.digest)


def _check_form(network: Network) -> None:
    if network.kind not in KINDS:
        raise ParameterError(f"no kind of network '{network.kind}'; known: {', '.join(KINDS)}")
    if not network.layers or any(n < 1 for n in network.layers):
        raise ParameterError(f"layers are {list(network.layers)}; give the units of each hidden layer, such as [200]")
    low, high = {"feedforward": (1, 1), "forgetting": (1, 10**6)}.get(network.kind, (0, 0))
    if not low <= network.memory <= high:
        wanted = f"{low}" if low == high else f"{low} or more"
        raise ParameterError(f"memory is {network.memory} samples; a network of kind '{network.kind}' takes {wanted}")


def _check_weights(network: Network) -> None:
    shapes = network.shapes
    for name in (*shapes, *network.weights):
        if name not in shapes or name not in network.weights:
            have = "have an array" if name not in shapes else "lack"
            raise ParameterError(f"the weights {have} {name}; a network of this form has {', '.join(shapes)}")
        array = network.weights[name]
        if array.shape != shapes[name]:
            raise ParameterError(f"{name} has shape {array.shape}; {list(network.layers)} layers need {shapes[name]}")
        if not np.isfinite(array).all():
            raise ParameterError(f"{name} holds a value that is not finite")
    for name in ("b_ih", "b_hh"):
        if name in shapes and np.any(candidate(network, network.weights[name])):
            raise ParameterError(f"{name}: the candidate has a bias; it must be zero for the origin to be at rest")


def candidate(network: Network, gates: Array) -> Array:
    """The candidate's own columns of an array over the gates of an LSTM or a GRU; a view."""
    h = network.layers[0]
    return gates[..., _CANDIDATE * h : (_CANDIDATE + 1) * h]


def initial(network: Network, seed: int) -> Network:
    """`network` with weights drawn evenly within one over the root of the units they come from.

    The same on every machine for one seed; biases begin at zero where the zero output at the origin needs it.
    """
    rng, made = np.random.default_rng(seed), dict[str, Array]()
    for name, shape in network.shapes.items():
        layer = int(name[2:]) if name[2:].isdigit() else 0  # that it comes from; 0 is the recurrent one itself
        bound = network.layers[max(layer, 1) - 1] ** -0.5
        made[name] = rng.uniform(-bound, bound, shape)
        if name in ("b_ih", "b_hh"):
            candidate(network, made[name])[:] = 0.0
    return network.having(made)


def recurrent(kind: str) -> bool:
    """Whether what a network remembers is a latent state rather than inputs."""
    return kind in ("rnn", "lstm", "gru")

"""Batches of windows, and the weights of a network of tanh folded into those of a network of logistic functions.

tanh(a) = 2 s(2a) - 1 with the logistic s, which costs a tenth of tanh.  Its factors and offsets, the zero at
the origin and the scale of the inputs all go into the weights, so a layer is one product and one s.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

INPUTS = 7
"""u, v_m, r, n_P, delta and the apparent wind vector."""


class Batch(NamedTuple):
    """Windows that one step looks at; the first axis is time.

    Attributes:
        state: measured x, y, psi, u, v_m, r, shape (rows, windows, 6).
        control: n_P and delta, shape (rows, windows, 2).
        wind: where it comes from [m/s], shape (rows, windows, 2): the vector of the true wind, north and
            east, or where `apparent` that of the wind measured on board, ahead and to starboard.
        acceleration: measured rates of u, v_m, r from each row to the next, shape (rows, windows, 3).
        weight: 1 / sigma of the six states and the three accelerations, shape (9,).
        dt: time step [s].
        apparent: whether the wind is that of the measurement, whatever the simulated ship does.
    """

    state: Tensor
    control: Tensor
    wind: Tensor
    acceleration: Tensor
    weight: Tensor
    dt: float
    apparent: bool = False

    def part(self, windows: slice) -> Batch:
        """Some of the windows."""
        return self._replace(
            state=self.state[:, windows], control=self.control[:, windows], wind=self.wind[:, windows],
            acceleration=self.acceleration[:, windows],
        )  # fmt: skip


class Folded(NamedTuple):
    """Weights of a network of logistic functions.

    Attributes:
        inputs: shape (7, h); rows of zeros for a wind that the network does not see.
        first, later: offset of the first step of a chain and of the others, shape (h,).
        recurrent: shape (h, h); empty without recurrence.
        hidden: weights and offset of each layer after the first, in turn.
        out, offset: of the accelerations, shapes (h, 3) and (3,).
    """

    inputs: Tensor
    first: Tensor
    later: Tensor
    recurrent: Tensor
    hidden: tuple[Tensor, ...]
    out: Tensor
    offset: Tensor

    @property
    def flat(self) -> tuple[Tensor, ...]:
        """All tensors in a fixed order."""
        return (self.inputs, self.first, self.later, self.recurrent, *self.hidden, self.out, self.offset)

    def like(self, tensors: tuple[Tensor, ...]) -> Folded:
        """The same form around other tensors in the order of `flat`."""
        inputs, first, later, recurrent, *hidden, out, offset = tensors
        return Folded(inputs, first, later, recurrent, tuple(hidden), out, offset)


def input_matrix(weights: Mapping[str, Tensor], scale: Tensor) -> Tensor:
    """What multiplies the seven inputs, their scale taken in, shape (7, units)."""
    import torch

    names = ("W_ih",) if "W_ih" in weights else ("W_x0", "W_u0", "W_w0")
    rows = torch.cat([weights[name] for name in names if name in weights]) / scale[:, None]
    return torch.cat((rows, rows.new_zeros(INPUTS - len(rows), rows.shape[1])))


def fold(weights: Mapping[str, Tensor], scale: Tensor) -> Folded:
    """Fold a network, by operations that PyTorch can differentiate.

    Args:
        weights: by the names of `models.network.Network`.
        scale: what each input is divided by.
    """
    b = weights["b_0"]
    recurrent = weights.get("W_r0", b.new_zeros(0, 0))
    below = 1.0 + b.tanh()  # z = 2 s - 1 - tanh(b), so z W = s (2 W) - (1 + tanh(b)) W
    later = 2.0 * b - 2.0 * (below @ recurrent) if recurrent.numel() else 2.0 * b
    first, hidden, k = 2.0 * b, list[Tensor](), 1
    while f"b_{k}" in weights:
        b = weights[f"b_{k}"]
        hidden += [4.0 * weights[f"W_{k}"], 2.0 * (b - below @ weights[f"W_{k}"])]
        below, k = 1.0 + b.tanh(), k + 1
    out = weights[f"W_{k}"]
    return Folded(
        2.0 * input_matrix(weights, scale), first, later, 4.0 * recurrent, tuple(hidden), 2.0 * out, -(below @ out)
    )

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
        first: offset of every step of a chain, shape (h,).
        further: what is added to it in every step but the first, shape (h,); zero without recurrence.
        recurrent: shape (h, h); empty without recurrence.
        hidden: matrix and offset of each layer after the first.
        out, offset: of the accelerations, shapes (h, 3) and (3,).
    """

    inputs: Tensor
    first: Tensor
    further: Tensor
    recurrent: Tensor
    hidden: tuple[tuple[Tensor, Tensor], ...]
    out: Tensor
    offset: Tensor


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
    import torch

    b = weights["b_0"]
    recurrent = weights.get("W_r0", b.new_zeros(0, 0))
    below = 1.0 + b.tanh()  # z = 2 s - 1 - tanh(b), so z W = s (2 W) - (1 + tanh(b)) W
    further = -2.0 * (below @ recurrent) if recurrent.numel() else torch.zeros_like(b)
    first, hidden, k = 2.0 * b, list[tuple[Tensor, Tensor]](), 1
    while f"b_{k}" in weights:
        b = weights[f"b_{k}"]
        hidden.append((4.0 * weights[f"W_{k}"], 2.0 * (b - below @ weights[f"W_{k}"])))
        below, k = 1.0 + b.tanh(), k + 1
    out = weights[f"W_{k}"]
    return Folded(
        2.0 * input_matrix(weights, scale), first, further, 4.0 * recurrent, tuple(hidden), 2.0 * out, -(below @ out)
    )

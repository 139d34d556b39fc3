"""Loss of any network over a batch of windows as the papers print it, differentiated by PyTorch.

It trains the kinds that are not of tanh alone (LSTM, GRU), and is what `training_rollout` is held against.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from .training_fold import Batch, input_matrix

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

Cell = Callable[[Tensor, Any], tuple[Tensor, Any]]
"""Output of the first layer and its memory after one more row of inputs (windows, 7); the memory begins as None."""


def literal_losses(
    weights: Mapping[str, Tensor], scale: Tensor, batch: Batch, *, kind: str, memory: int, known: int, simulate: bool
) -> Tensor:
    """Loss by channel, summed over windows: Eq. 23 over a simulation (6 channels) or Eq. 16 (3 channels).

    Args:
        weights, scale: as of `models.network.Network`.
        batch: the windows.
        kind, memory: of the network.
        known: rows at the start of a window whose state is that of the measurement.
        simulate: whether velocities are simulated; else they are those of the measurement.
    """
    import torch

    cell, head = _cell(weights, scale, kind), _head(weights)
    path, seen, kept, errors = [batch.state[0]], list[Tensor](), None, list[Tensor]()
    for i in range(len(batch.state) - 1):
        seen.append(_inputs(path[i], batch, i))
        if memory == 0:
            z, kept = cell(seen[i], kept)
        elif i >= known - 1:
            kept = None
            for x in seen[i - memory + 1 :]:
                z, kept = cell(x, kept)
        if i < known - 1:
            path.append(batch.state[i + 1])
            continue
        a = head(z)  # pyright: ignore[reportPossiblyUnboundVariable]
        errors.append((a - batch.acceleration[i]) * batch.weight[6:])
        path.append(_moved(path[i], a, batch.dt) if simulate else batch.state[i + 1])
    if not simulate:
        return torch.stack(errors).square().sum((0, 1)) / len(errors)  # (16)
    error = (torch.stack(path) - batch.state) * batch.weight[:6]
    return error.square().sum((0, 1)) / len(path)  # (23)


def _inputs(state: Tensor, batch: Batch, i: int) -> Tensor:
    import torch

    _, _, psi, u, v, _ = state.unbind(-1)
    wind = batch.wind[i]
    if not batch.apparent:
        c, s, (north, east) = psi.cos(), psi.sin(), wind.unbind(-1)
        wind = torch.stack((north * c + east * s + u, east * c - north * s + v), -1)  # (6)
    return torch.cat((state[:, 3:], batch.control[i], wind), -1)


def _moved(state: Tensor, a: Tensor, dt: float) -> Tensor:
    import torch

    _, _, psi, u, v, r = state.unbind(-1)
    c, s = psi.cos(), psi.sin()
    return state + dt * torch.cat((torch.stack((u * c - v * s, u * s + v * c, r), -1), a), -1)  # (20)-(22)


def _head(weights: Mapping[str, Tensor]) -> Callable[[Tensor], Tensor]:
    def head(z: Tensor) -> Tensor:
        k = 1
        while f"b_{k}" in weights:
            b = weights[f"b_{k}"]
            z = (z @ weights[f"W_{k}"] + b).tanh() - b.tanh()
            k += 1
        return z @ weights[f"W_{k}"]

    return head


def _cell(weights: Mapping[str, Tensor], scale: Tensor, kind: str) -> Cell:
    W = input_matrix(weights, scale)
    if kind in ("lstm", "gru"):
        W_h, b, b_h = weights["W_hh"], weights["b_ih"], weights["b_hh"]
        return lambda x, kept: (_lstm if kind == "lstm" else _gru)(x @ W + b, W_h, b_h, kept)
    b = weights["b_0"]

    def plain(x: Tensor, kept: Any) -> tuple[Tensor, Any]:
        a = x @ W + b if kept is None else x @ W + kept @ weights["W_r0"] + b
        z = a.tanh() - b.tanh()  # (7), (9)
        return z, z

    return plain


def _lstm(seen: Tensor, W_h: Tensor, b_h: Tensor, kept: Any) -> tuple[Tensor, Any]:
    z, cell = kept or (seen.new_zeros(len(seen), len(W_h)),) * 2
    enter, forget, new, leave = (seen + z @ W_h + b_h).chunk(4, -1)
    cell = forget.sigmoid() * cell + enter.sigmoid() * new.tanh()
    z = leave.sigmoid() * cell.tanh()
    return z, (z, cell)


def _gru(seen: Tensor, W_h: Tensor, b_h: Tensor, kept: Any) -> tuple[Tensor, Any]:
    z = seen.new_zeros(len(seen), len(W_h)) if kept is None else kept
    reset, update, new = seen.chunk(3, -1)
    of_reset, of_update, of_new = (z @ W_h + b_h).chunk(3, -1)
    fresh = (new + (reset + of_reset).sigmoid() * of_new).tanh()
    keep = (update + of_update).sigmoid()
    z = (1.0 - keep) * fresh + keep * z
    return z, z

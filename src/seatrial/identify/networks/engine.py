"""Loss and gradient of a batch of windows, in pieces of one size that share the processors, and its two forms.

The pieces depend on the batch alone and are summed in their order, so the number of threads changes no digit.
`literal_losses` takes any network as the papers print it; it trains the kinds that are not of tanh alone (LSTM, GRU).
`folded_losses` (Wakita 2022 Eqs. 7, 9, 16, 23) takes networks of tanh only and is held against it: all memory chains
under way advance together, one product per time step, and share the projection of the input; the layers behind see
only the chain that ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...data import Array
from ...models.network import Network, candidate
from .data import Batch, Folded, fold, input_matrix

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

# Windows of a piece on processors, at most and at least: enough for a product near its full rate, few enough for
# two cores to share a batch of 128.
_PIECE, _SMALL = 256, 64


class Form(NamedTuple):
    """Settings of a loss.

    Attributes:
        network: kind, layers, memory and scale; its weights play no part.
        known: rows at the start of a window whose state is that of the measurement.
        acceleration: share of the acceleration loss (Eq. 16); the rest is the state loss (Eq. 23).
    """

    network: Network
    known: int
    acceleration: float

    @property
    def folds(self) -> bool:
        """Whether the network is one of tanh only, which goes quicker folded."""
        return self.network.kind in ("feedforward", "rnn", "forgetting")


class Vector:
    """Weights by name as parts of one vector, whose entries are all of the order of one.

    Args:
        network: form of the network.
        answers: typical size of each acceleration; the columns of the last matrix are counted in it.
    """

    def __init__(self, network: Network, answers: tuple[float, ...] = (1.0, 1.0, 1.0)) -> None:
        self.shapes = network.shapes
        self.sizes = [int(np.prod(shape)) for shape in self.shapes.values()]
        free = {name: np.ones(shape) for name, shape in self.shapes.items()}
        for name in ("b_ih", "b_hh"):
            if name in free:
                candidate(network, free[name])[:] = 0.0  # or the origin would move the ship
        self.free = np.concatenate([a.ravel() for a in free.values()])
        self.last, self.answers = f"W_{len(network.layers)}", np.array(answers)

    def joined(self, weights: Mapping[str, Array]) -> Array:
        """The vector of named arrays, untrained: the last matrix taken as it is, in the size of the answers."""
        return np.concatenate([weights[name].ravel() for name in self.shapes])

    def exact(self, weights: Mapping[str, Array]) -> Array:
        """The vector of named arrays that `named` gives back."""
        return self.joined({**weights, self.last: weights[self.last] / self.answers})

    def named(self, vector: Array) -> dict[str, Array]:
        """Weights of a vector."""
        parts = self._parted(vector)
        return {**parts, self.last: parts[self.last] * self.answers}

    def tensors(self, vector: Tensor) -> dict[str, Tensor]:
        """The same of a tensor, for PyTorch to differentiate."""
        parts = self._parted(vector)
        return {**parts, self.last: parts[self.last] * vector.new_tensor(self.answers)}

    def _parted(self, vector: Any) -> dict[str, Any]:
        out, at = dict[str, Any](), 0
        for (name, shape), size in zip(self.shapes.items(), self.sizes, strict=True):
            out[name] = vector[at : at + size].reshape(shape)
            at += size
        return out


class Engine:
    """Loss and gradient by the vector of weights.

    Args:
        form: the loss.
        device: "cpu" or "cuda".
        threads: how many pieces run at once on processors.
        answers: typical size of each acceleration.
    """

    def __init__(self, form: Form, device: str, threads: int, answers: tuple[float, ...] = (1.0, 1.0, 1.0)) -> None:
        import torch

        self.form, self.vector, self.device = form, Vector(form.network, answers), device
        self.scale = torch.tensor(form.network.scale, dtype=torch.float32, device=device)
        self.pool = ThreadPoolExecutor(threads) if threads > 1 and device == "cpu" else None

    def losses(self, theta: Tensor, batch: Batch, gradient: bool = True) -> tuple[Tensor, Tensor | None]:
        """Mean over the windows by channel, shape (9,), and the gradient of the sum of the shares, or None."""
        import torch

        size = batch.state.shape[1]
        piece = min(_PIECE, max(_SMALL, -(-size // 2))) if self.device == "cpu" else size
        pieces = [batch.part(slice(k, min(k + piece, size))) for k in range(0, size, piece)]
        each = map if self.pool is None or len(pieces) == 1 else self.pool.map
        done = list(each(partial(self._piece, theta, gradient=gradient), pieces))
        loss, slope = (torch.stack(parts).sum(0) / size for parts in zip(*done, strict=True))
        return loss, slope if gradient else None

    def _piece(self, theta: Tensor, batch: Batch, gradient: bool) -> tuple[Tensor, Tensor]:
        """Loss by channel and gradient of a piece, summed over its windows; the gradient is zero if not asked for."""
        import torch

        share, own = self.form.acceleration, theta.detach().requires_grad_(gradient)
        loss, total = batch.weight.new_zeros(len(batch.weight)), own.new_zeros(())
        with torch.set_grad_enabled(gradient):
            losses = self._losses(own)
            for part, simulate, at in ((1.0 - share, True, slice(0, 6)), (share, False, slice(6, 9))):
                if part > 0.0:
                    found = losses(batch, simulate=simulate)
                    loss[at] = found.detach()
                    total = total + part * found.sum()
        return loss, torch.autograd.grad(total, own)[0] if gradient else total

    def _losses(self, theta: Tensor) -> Callable[..., Tensor]:
        """The function of a batch that gives its losses by channel."""
        network, weights = self.form.network, self.vector.tensors(theta)
        known = {"memory": network.memory, "known": self.form.known}
        if self.form.folds:
            return partial(folded_losses, fold(weights, self.scale), **known)
        return partial(literal_losses, weights, self.scale, kind=network.kind, **known)


@contextmanager
def one_thread_each() -> Generator[None, None, None]:
    """PyTorch with a single thread per piece, as it was before afterwards."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


Cell = Callable[[Tensor, Any], tuple[Tensor, Any]]
"""Output of the first layer and its memory after one more row of inputs (windows, 7); the memory begins as None."""


def literal_losses(
    weights: Mapping[str, Tensor], scale: Tensor, batch: Batch, *, kind: str, memory: int, known: int, simulate: bool
) -> Tensor:
    """Loss by channel, summed over windows: Eq. 23 over a simulation (6 channels) or Eq. 16 (3 channels).

    Args:
        weights, scale, kind, memory: of the network, as in `models.network.Network`.
        known, simulate: as in `simulated`.
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


class Path(NamedTuple):
    """A simulation of every window: measured rows first, then simulated ones.

    Attributes:
        psi: heading [rad], shape (rows, windows).
        velocity: u, v_m, r, shape (rows, windows, 3).
        rates: accelerations that the network gives from the last known row on, shape (rows - known, windows, 3).
    """

    psi: Tensor
    velocity: Tensor
    rates: Tensor


class _Chains:
    """First layer: the chains under way, the youngest first; a chain that could not end in the window never begins.

    Args:
        w: the weights.
        memory: m of the chains; 1 for no recurrence, 0 for a memory that never ends.
        steps: time steps of a window.
    """

    def __init__(self, w: Folded, memory: int, steps: int) -> None:
        self.recurrent, self.further = w.recurrent, w.further
        self.memory, self.steps, self.done = memory, steps, 0
        self.under_way: Tensor | None = None  # one chain after the other, shape (chains x windows, units)

    def push(self, seen: Tensor) -> Tensor | None:
        """Output of the chain that ends, shape (windows, units), after one more projected input; None if none ends."""
        import torch

        self.done += 1
        if self.memory == 0:
            self.under_way = (seen if self.under_way is None else self._on(self.under_way, seen)).sigmoid_()
            return self.under_way
        windows, parts = len(seen), [seen] if self.done + self.memory <= self.steps + 1 else []
        if self.under_way is not None:
            parts.append(self._on(self.under_way, seen))
        grown = torch.cat(parts).sigmoid_()
        if self.done < self.memory:
            self.under_way = grown
            return None
        # A split is differentiated by one copy; slices would fill a tensor of zeros for each.
        self.under_way, ended = grown.split([len(grown) - windows, windows])
        if not len(self.under_way):
            self.under_way = None
        return ended

    def _on(self, before: Tensor, seen: Tensor) -> Tensor:
        return (before @ self.recurrent).view(-1, *seen.shape).add_(seen + self.further).view(-1, seen.shape[1])


def simulated(w: Folded, batch: Batch, *, memory: int, known: int, simulate: bool = True) -> Path:
    """Pass the network over every window by Euler's rule.

    Args:
        memory: as of `models.network.Network`.
        known: rows at the start of a window whose state is that of the measurement (Eqs. 18, 19).
        simulate: whether velocities are simulated; else they are those of the measurement.
    """
    import torch

    steps = len(batch.state) - 1
    heading, motion = (part.unbind(0) for part in batch.state[..., 2:].split([1, 3], -1))
    driven, into = batch.control @ w.inputs[3:5] + w.first, w.inputs[:3]
    angle = speed = ()
    if batch.apparent:
        driven = driven + batch.wind @ w.inputs[5:]
    else:  # the true wind [U cos(g - psi), U sin(g - psi)] plus the ship's own u and v_m (6)
        into = torch.cat((into[:2] + w.inputs[5:], into[2:], w.inputs[5:]))
        speed = batch.wind.norm(dim=-1, keepdim=True).unbind(0)
        g = torch.atan2(batch.wind[..., 1], batch.wind[..., 0])
        angle = torch.stack((g, g - 0.5 * math.pi), -1).unbind(0)
    chains, by_row = _Chains(w, memory, steps), driven.unbind(0)
    psi, velocity, rates = [heading[0]], [motion[0]], list[Tensor]()
    for i in range(steps):
        shown = velocity[i]
        if not batch.apparent:
            shown = torch.cat((shown, (angle[i] - psi[i]).cos() * speed[i]), -1)
        ended = chains.push(torch.addmm(by_row[i], shown, into))
        if ended is not None and i >= known - 1:
            rates.append(_answer(w, ended))
        if simulate and i >= known - 1:
            psi.append(torch.add(psi[i], velocity[i][:, 2:], alpha=batch.dt))  # (20)
            velocity.append(torch.add(velocity[i], rates[-1], alpha=batch.dt))  # (21), (22)
        else:
            psi.append(heading[i + 1])
            velocity.append(motion[i + 1])
    return Path(torch.cat(psi, -1).t(), torch.stack(velocity), torch.stack(rates))


def _answer(w: Folded, z: Tensor) -> Tensor:
    import torch

    for matrix, offset in w.hidden:
        z = torch.addmm(offset, z, matrix).sigmoid_()
    return torch.addmm(w.offset, z, w.out)  # (7), (9)


def folded_losses(w: Folded, batch: Batch, *, memory: int, known: int, simulate: bool) -> Tensor:
    """Loss by channel, summed over windows: Eq. 23 over a simulation (6 channels) or Eq. 16 (3 channels).

    The network does not see positions, so Eq. 20 is summed over all rows at once.
    """
    import torch

    path = simulated(w, batch, memory=memory, known=known, simulate=simulate)
    start, weight = known - 1, batch.weight
    if not simulate:
        error = (path.rates - batch.acceleration[start:-1]) * weight[6:]
        return error.square().sum((0, 1)) / len(error)  # (16)
    c, s = path.psi[start:-1].cos(), path.psi[start:-1].sin()
    u, v, _ = path.velocity[start:-1].unbind(-1)
    moved = torch.stack((u * c - v * s, u * s + v * c), -1).cumsum(0) * batch.dt  # (20)
    place = torch.cat((batch.state[:known, :, :2], batch.state[start, :, :2] + moved))
    error = (torch.cat((place, path.psi[..., None], path.velocity), -1) - batch.state) * weight[:6]
    return error.square().sum((0, 1)) / len(error)  # (23)

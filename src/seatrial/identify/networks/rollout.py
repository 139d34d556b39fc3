"""Loss of a network of tanh over a batch of windows (Wakita 2022 Eqs. 7, 9, 16, 23), for PyTorch to differentiate.

All memory chains that are under way advance together, one product per time step, and share the projection of
the input; the layers behind see only the chain that ends.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from .data import Batch, Folded

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any


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
        w: the weights.
        batch: the windows.
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

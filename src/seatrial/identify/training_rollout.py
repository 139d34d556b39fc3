"""Loss and gradient of a network of tanh over a batch of windows (Wakita 2022 Eqs. 7, 9, 16, 23), by hand.

All memory chains that are under way advance together, one product per time step, and share the projection of
the input; the layers behind see only the chain that ends.  The derivative of the logistic function follows
from its value, so nothing else is kept for the way back.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from .training_fold import INPUTS, Batch, Folded

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

Outcome = tuple[Tensor, tuple[Tensor, ...]]
"""Loss by channel, and the gradient of its sum in the order of `Folded.flat`; none where it was not asked for."""


class Seen(NamedTuple):
    """What the network is shown at one row, or at all: views of the working memory."""

    psi: Tensor
    velocity: Tensor
    drift: Tensor
    r: Tensor
    shown: Tensor
    wind: Tensor
    ahead: Tensor
    aside: Tensor


class Step(NamedTuple):
    """The first layer at one step: views of the working memory, None where nothing is.

    Attributes:
        fresh: the chain that begins.
        going, flat: the chains that go on, and the same row by row.
        before: those one step earlier, row by row.
        live, ended: all of them, and the slot of the chain that ends.
        of_fresh, of_flat, of_live, of_ended, of_before: gradients by `fresh`, `flat`, `live`, `ended`, `before`.
    """

    fresh: Tensor | None
    going: Tensor | None
    flat: Tensor | None
    before: Tensor | None
    live: Tensor
    ended: Tensor
    of_fresh: Tensor
    of_flat: Tensor | None
    of_live: Tensor
    of_ended: Tensor
    of_before: Tensor | None


class Rollout:
    """Loss and gradient for batches of one size; working memory is kept from one to the next.

    Args:
        rows, windows: shape of a batch.
        memory: m of the chains; 1 for no recurrence, 0 for a memory that never ends.
        known: rows at the start of a window whose state is that of the measurement (Eqs. 18, 19); m where
            memory ends.
        layers: units of each hidden layer.
        like: a tensor of the type, on the device.
        keep: whether gradients will be asked for; without, long windows need little memory.
    """

    def __init__(
        self, rows: int, windows: int, *, memory: int, known: int, layers: tuple[int, ...], like: Tensor,
        keep: bool = True,
    ) -> None:  # fmt: skip
        self.rows, self.known, self.memory, self.slots = rows, known, memory, memory or 1
        steps, first = rows - 1, layers[0]
        depth = steps if keep else 2  # how many steps are kept
        self.path = like.new_zeros(rows, windows, 4)  # psi, u, v_m, r
        self.inputs = like.new_zeros(steps, windows, INPUTS)
        self.still = like.new_zeros(steps, windows, 2)  # the wind that a ship at rest would feel
        self.s = like.new_zeros(depth, self.slots, windows, first)
        self.behind = [like.new_zeros(depth, windows, n) for n in layers[1:]]
        self.a = like.new_zeros(steps, windows, 3)
        # The way back: gradients by the activations of two steps, and by each layer's pre-activations.
        back = steps if keep else 0
        self.grown = [like.new_zeros(self.slots, windows, first) for _ in range(2)]
        self.summed = like.new_zeros(back, windows, first)
        self.of_behind = [like.new_zeros(back, windows, n) for n in layers[1:]]
        self.of_a = like.new_zeros(steps, windows, 3)
        # Views of every step, made once: making them takes as long as many an operation on them.
        self.seen, self.steps = [self._seen(i) for i in range(rows)], [self._step(i) for i in range(steps)]
        self.heads = [[layer[i % depth] for layer in self.behind] for i in range(steps)]
        self.of_heads = [[layer[i] for layer in self.of_behind] for i in range(back)]
        self.rates, self.of_rates, self.sums = (list(x.unbind(0)) for x in (self.a, self.of_a, self.summed))

    def _seen(self, i: int | slice) -> Seen:
        here = self.path[:-1][i] if isinstance(i, slice) else self.path[i]
        k = i if isinstance(i, slice) else min(i, self.rows - 2)  # of the last row only the path counts
        inputs, still = self.inputs[k], self.still[k]
        return Seen(
            here[..., 0], here[..., 1:], here[..., 1:3], here[..., 3], inputs[..., :3], inputs[..., 5:], still[..., 0],
            still[..., 1],
        )  # fmt: skip

    def _step(self, i: int) -> Step:
        depth, width = len(self.s), self.s.shape[-1]
        begin, end, fresh = self._live(i)
        now, before = self.s[i % depth], self.s[(i - 1) % depth]
        grown, earlier = self.grown[i % 2], self.grown[i % 2 - 1]
        live, on = slice(0 if fresh else begin, max(end, 1)), end > begin
        source = slice(begin - 1, end - 1) if self.memory else slice(0, 1)
        return Step(
            now[0] if fresh else None, now[begin:end] if on else None, now[begin:end].view(-1, width) if on else None,
            before[source].view(-1, width) if on else None, now[live], now[-1], grown[0],
            grown[begin:end].view(-1, width) if on else None, grown[live], grown[-1],
            earlier[source].view(-1, width) if on else None,
        )  # fmt: skip

    def state_loss(self, w: Folded, batch: Batch, gradient: bool = True) -> Outcome:
        """Mean squared standardised error of x, y, psi, u, v_m, r over a simulation, summed over windows (Eq. 23)."""
        self.path[: self.known] = batch.state[: self.known, :, 2:]
        self._forward(w, batch, simulate=True)
        loss, of_path = self._missed(batch)
        if not gradient:
            return loss, ()
        self.of_a.zero_()
        return loss, self._backward(w, batch, of_path)

    def acceleration_loss(self, w: Folded, batch: Batch, gradient: bool = True) -> Outcome:
        """The same of the accelerations along the measured motion (Eq. 16)."""
        self.path.copy_(batch.state[..., 2:])
        self._forward(w, batch, simulate=False)
        first = self.known - 1
        error = (self.a[first:] - batch.acceleration[first:-1]) * batch.weight[6:]
        loss = (error * error).sum((0, 1)) / len(error)  # (16)
        if not gradient:
            return loss, ()
        self.of_a.zero_()
        self.of_a[first:] = error * batch.weight[6:] * (2.0 / len(error))
        return loss, self._backward(w, batch, None)

    def _live(self, i: int) -> tuple[int, int, bool]:
        """Slots from `begin` to before `end` that go on at step `i`, and whether a chain begins there, in slot 0.

        Slot k holds the chain that began k steps ago.  One that could not end in the window never begins.
        """
        if self.memory == 0:
            return (0, 0, True) if i == 0 else (0, 1, False)
        lowest = max(0, i - (self.rows - 1 - self.memory))
        return max(lowest, 1), min(i, self.memory - 1) + 1, lowest == 0

    def _forward(self, w: Folded, batch: Batch, simulate: bool) -> None:
        import torch

        dt, winds = batch.dt, batch.wind.unbind(0)
        self.inputs[..., 3:5] = batch.control[:-1]
        if not simulate:
            self._see(self._seen(slice(None)), batch.wind[:-1], batch.apparent)
        for i in range(self.rows - 1):
            here = self.seen[i]
            if simulate:
                self._see(here, winds[i], batch.apparent)
            self._remember(i, w)
            if i < self.known - 1:
                continue
            z = self.steps[i].ended
            for k, layer in enumerate(self.heads[i]):
                z = torch.addmm(w.hidden[2 * k + 1], z, w.hidden[2 * k], out=layer).sigmoid_()
            torch.addmm(w.offset, z, w.out, out=self.rates[i])  # (7), (9)
            if simulate:
                after = self.seen[i + 1]
                torch.add(here.velocity, self.rates[i], alpha=dt, out=after.velocity)  # (21), (22)
                torch.add(here.psi, here.r, alpha=dt, out=after.psi)  # (20)

    def _see(self, at: Seen, wind: Tensor, apparent: bool) -> None:
        """What the network is shown at a step: velocities, and the wind that a ship so moving feels (Eq. 6)."""
        import torch

        at.shown.copy_(at.velocity)
        if apparent:
            at.wind.copy_(wind)
            return
        c, s, (north, east) = at.psi.cos(), at.psi.sin(), wind.unbind(-1)
        torch.mul(north, c, out=at.ahead).addcmul_(east, s)
        torch.mul(east, c, out=at.aside).addcmul_(north, s, value=-1.0)
        at.wind[..., 0] = at.ahead
        at.wind[..., 1] = at.aside
        at.wind.add_(at.drift)

    def _remember(self, i: int, w: Folded) -> None:
        """First layer: every chain under way goes on by a step."""
        import torch

        step, seen = self.steps[i], self.inputs[i] @ w.inputs
        if step.fresh is not None:
            torch.add(seen, w.first, out=step.fresh).sigmoid_()
        if step.going is not None and step.flat is not None and step.before is not None:
            step.going.copy_(seen.add_(w.later))
            torch.addmm(step.flat, step.before, w.recurrent, out=step.flat).sigmoid_()

    def _missed(self, batch: Batch) -> tuple[Tensor, Tensor]:
        """Eq. 23 by channel, and the gradient by psi, u, v_m, r of each row.

        The network does not see positions, so Eq. 20 is summed over all rows at once.
        """
        start = self.known - 1
        psi, u, v, _ = self.path[:-1].unbind(-1)
        c, s = psi.cos(), psi.sin()
        north, east = u * c - v * s, u * s + v * c
        error = self.path.new_zeros(*self.path.shape[:2], 6)
        for k, rate in enumerate((north, east)):
            moved = (rate[start:] * batch.dt).cumsum(0)  # (20)
            error[start + 1 :, :, k] = moved + batch.state[start, :, k] - batch.state[start + 1 :, :, k]
        error[..., 2:] = self.path - batch.state[..., 2:]
        error *= batch.weight[:6]
        loss = (error * error).sum((0, 1)) / self.rows  # (23)
        error *= batch.weight[:6] * (2.0 / self.rows)
        x, y = (error[1:, :, :2].flip(0).cumsum(0).flip(0) * batch.dt).unbind(-1)
        of_path = error[..., 2:].clone()
        of_path[:-1, :, 0] += y * north - x * east
        of_path[:-1, :, 1] += x * c + y * s
        of_path[:-1, :, 2] += y * c - x * s
        return loss, of_path

    def _backward(self, w: Folded, batch: Batch, of_path: Tensor | None) -> tuple[Tensor, ...]:
        """Gradient by the weights; `of_a` holds what the loss asks of the accelerations themselves."""
        import torch

        steps, first = self.rows - 1, torch.zeros_like(w.first)
        recurrent, up = torch.zeros_like(w.recurrent), w.recurrent.t()
        along = None if of_path is None else of_path[-1]  # gradient by the path of the next row
        for i in range(steps - 1, -1, -1):
            if along is not None and i + 1 >= self.known:
                self.of_rates[i].add_(along[:, 1:], alpha=batch.dt)
            step = self.steps[i]
            self._down(i, w, up)
            torch.ops.aten.sigmoid_backward(step.of_live, step.live, grad_input=step.of_live)
            torch.sum(step.of_live, 0, out=self.sums[i])
            if step.fresh is not None:
                first += step.of_fresh.sum(0)
            if step.before is not None and step.of_flat is not None:
                recurrent.addmm_(step.before.t(), step.of_flat)
            if along is not None and of_path is not None and i >= self.known:
                along = self._along(i, along, self.sums[i] @ w.inputs.t(), of_path[i], batch)
        return self._collected(first, recurrent)

    def _down(self, i: int, w: Folded, up: Tensor) -> None:
        """Gradient by the activations of the first layer: from the chains' next step, and from the layers behind."""
        import torch

        ahead = self.steps[i + 1] if i + 2 < self.rows else None
        goes_on = ahead is not None and ahead.of_flat is not None
        if ahead is not None and ahead.of_flat is not None and ahead.of_before is not None:
            torch.mm(ahead.of_flat, up, out=ahead.of_before)
        if i < self.known - 1:
            return
        down, back = self.of_rates[i], w.out
        for k in range(len(self.behind) - 1, -1, -1):
            of = self.of_heads[i][k]
            torch.mm(down, back.t(), out=of)
            down, back = torch.ops.aten.sigmoid_backward(of, self.heads[i][k], grad_input=of), w.hidden[2 * k]
        last = self.steps[i].of_ended
        torch.addmm(last, down, back.t(), beta=float(self.memory == 0 and goes_on), out=last)

    def _along(self, i: int, after: Tensor, of_inputs: Tensor, own: Tensor, batch: Batch) -> Tensor:
        """Gradient by psi, u, v_m, r of row `i` from that of the next row and that of the inputs."""
        out = own + after
        out[:, 3].add_(after[:, 0], alpha=batch.dt)
        out[:, 1:] += of_inputs[:, :3]
        if not batch.apparent:
            out[:, 1:3] += of_inputs[:, 5:]
            out[:, 0] += of_inputs[:, 5] * self.still[i, :, 1] - of_inputs[:, 6] * self.still[i, :, 0]
        return out

    def _collected(self, first: Tensor, recurrent: Tensor) -> tuple[Tensor, ...]:
        """Gradients in the order of `Folded.flat`: products over all steps at once where no step needs them."""

        def rows(a: Tensor) -> Tensor:
            return a.reshape(-1, a.shape[-1])

        inputs, summed = rows(self.inputs), rows(self.summed)
        out = [inputs.t() @ summed, first, summed.sum(0) - first, recurrent]
        ended = slice(self.known - 1, None)
        below = self.s[ended, -1]
        for layer, of in zip((*self.behind, None), (*self.of_behind, self.of_a), strict=True):
            of = rows(of[ended])
            out += [rows(below).t() @ of, of.sum(0)]
            below = below if layer is None else layer[ended]
        return tuple(out)

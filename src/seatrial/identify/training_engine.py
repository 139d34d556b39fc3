"""One step of training: loss and gradient of a batch, shared out over the processors in pieces of one size.

The pieces depend on the batch alone and are summed in their order, so the number of threads changes no digit.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..data import Array
from ..models.network import Network, candidate
from .training_fold import Batch, fold
from .training_literal import literal_losses
from .training_rollout import folded_losses

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

# Windows of a piece on processors: large enough for a product at full rate, small enough for two cores to share 512.
_PIECE = 256


class Form(NamedTuple):
    """What a loss is made of.

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

    def __init__(
        self, form: Form, device: str, threads: int, answers: tuple[float, ...] = (1.0, 1.0, 1.0)
    ) -> None:
        import torch

        self.form, self.vector, self.device = form, Vector(form.network, answers), device
        scale = torch.tensor(form.network.scale, dtype=torch.float32, device=device)
        self.scale = scale
        self.pool = ThreadPoolExecutor(threads) if threads > 1 and device == "cpu" else None

    def losses(self, theta: Tensor, batch: Batch, gradient: bool = True) -> tuple[Tensor, Tensor | None]:
        """Mean over the windows by channel, shape (9,), and the gradient of the sum of the shares, or None."""
        import torch

        size = batch.state.shape[1]
        piece = _PIECE if self.device == "cpu" else size
        slices = [slice(k, min(k + piece, size)) for k in range(0, size, piece)]
        done = self._each(lambda k: self._piece(theta, batch.part(slices[k]), gradient), len(slices))
        loss = torch.stack([one[0] for one in done]).sum(0) / size
        return loss, torch.stack([one[1] for one in done]).sum(0) / size if gradient else None

    def _each(self, job: Callable[[int], Any], count: int) -> list[Any]:
        if self.pool is None or count == 1:
            return [job(k) for k in range(count)]
        return list(self.pool.map(job, range(count)))

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
        if self.form.folds:
            return partial(folded_losses, fold(weights, self.scale), memory=network.memory, known=self.form.known)
        return partial(
            literal_losses, weights, self.scale, kind=network.kind, memory=network.memory, known=self.form.known
        )


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

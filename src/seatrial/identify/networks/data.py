"""Trials as rows in PyTorch, batches of windows cut from them, and networks of tanh folded into logistic ones.

tanh(a) = 2 s(2a) - 1 with the logistic s, which costs a tenth of tanh.  Its factors and offsets, the zero at
the origin and the scale of the inputs all go into the weights, so a layer is one product and one s.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.values import dataclass
from ...data import Array, DataError, Trial
from ...data.prepare import resampling
from ...models import STATES
from ...models.network import INPUTS
from ...models.neural import Neural, features
from ...simulate.replay import inputs, unread
from .. import Loss, StudyError
from ..record import measured, spread

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

CHANNELS = (*STATES, "rate of u", "rate of v_m", "rate of r")
"""Compared quantities, in the order of `Batch.weight`."""

# A step may differ from the model's sample time by this fraction.
_UNEVEN = 0.02
_CONTROLS, _WIND, _CURRENT = slice(0, 2), slice(2, 4), slice(4, 6)


@dataclass(frozen=True)
class Rows:
    """All rows of some trials, one trial after the other.

    Attributes:
        state: x, y, psi, u, v_m, r as measured, heading unwrapped, shape (rows, 6).
        acting: controls and environment, shape (rows, 10).
        wind: as `Batch.wind`, shape (rows, 2).
        rates: of u, v_m, r from each row to the next, shape (rows, 3); NaN in the last row of a trial.
        ends: one past the last row of each trial.
        names: of the trials.
    """

    state: Array
    acting: Array
    wind: Array
    rates: Array
    ends: tuple[int, ...]
    names: tuple[str, ...]

    @staticmethod
    def of(trials: Sequence[Trial], model: Neural, measured_wind: bool, window: int) -> Rows:
        """Read trials, each of which must hold a window of `window` rows.

        Raises:
            DataError: a channel is missing, there is a current, the sample time is not the model's, or a trial
                is too short.
        """
        for trial in trials:
            if len(trial) < window:
                back = f"{model.look_back} to look back on included; leave it out, or shorten the windows"
                raise DataError(f"{trial.name}: {len(trial)} rows; a window takes {window}, {back}")
        _same_step(trials, float(model.dt))
        parts = [_read(trial, model, measured_wind) for trial in trials]
        ends = tuple(np.cumsum([len(part[0]) for part in parts]).tolist())
        state, acting, wind, rates = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
        return Rows(state, acting, wind, rates, ends, tuple(trial.name for trial in trials))

    @property
    def complete(self) -> NDArray[np.bool_]:
        """Rows without a gap."""
        return np.asarray(np.isfinite(np.hstack([self.state, self.acting])).all(axis=1))

    def starts(self, rows: int, stride: int) -> NDArray[np.int64]:
        """First rows of all windows of `rows` rows without a gap, `stride` rows apart; each trial's end is covered.

        Raises:
            DataError: nothing is left.
        """
        before = np.concatenate([[0], np.cumsum(~self.complete)])
        of_trials = [
            np.unique(np.append(np.arange(begin, end - rows + 1, stride), end - rows))
            for begin, end in pairwise((0, *self.ends))
        ]
        at = np.concatenate(of_trials)
        out = at[before[at + rows] == before[at]]
        if not out.size:
            raise DataError(f"no window of {rows} rows without a gap in {', '.join(self.names)}")
        return out

    def shown(self, model: Neural) -> Array:
        """Inputs of the network at every complete row, SI units, shape (n, inputs)."""
        good = self.complete
        return features(model.network, self.state[good], self.acting[good])


def _same_step(trials: Sequence[Trial], dt: float) -> None:
    """Refuse trials at other steps than `dt` [s], all of them at once."""
    uneven = [trial for trial in trials if np.any(np.abs(np.diff(trial.t) - dt) > _UNEVEN * dt)]
    if uneven:
        more = f" (and {len(uneven) - 1} more alike)" if len(uneven) > 1 else ""
        found = f"{uneven[0].name}: sampled every {uneven[0].dt:g} s{more}, the network runs at {dt:g} s only"
        raise DataError(f"{found}; {resampling(dt, *uneven)}")


def _read(trial: Trial, model: Neural, measured_wind: bool) -> tuple[Array, Array, Array, Array]:
    dt = float(model.dt)
    acting = inputs(trial, model)
    if acting[:, _CURRENT].any():
        raise DataError(f"{trial.name}: has a current; networks are trained in still water only")
    for rows in unread(trial, model).values():  # what was filled is no data
        acting[rows] = np.nan
    state = measured(trial)
    wind = acting[:, _WIND]
    if measured_wind and model.network.wind:
        absent = [name for name in ("U_A", "gamma_A") if name not in trial]
        if absent:
            raise DataError(f'{trial.name}: no channel {", ".join(absent)}; wind = "measured" needs it')
        wind = trial["U_A"][:, None] * np.column_stack([np.cos(trial["gamma_A"]), np.sin(trial["gamma_A"])])
        acting[~np.isfinite(wind).all(axis=1)] = np.nan
    rates = np.full((len(state), 3), np.nan)
    rates[:-1] = np.diff(state[:, 3:], axis=0) / dt
    return state, acting, wind, rates


def weights_of_errors(rows: Rows, trials: Sequence[Trial], loss: Loss) -> Array:
    """1 / sigma of each of `CHANNELS`: standard deviations over the training set, unless the loss names them."""
    scale = dict(loss.sigma) or spread(trials)
    of_states = [1.0 / scale[name] if name in scale else 0.0 for name in STATES]
    of_rates = np.nanstd(rows.rates, axis=0)
    if not (of_rates > 0).all():
        raise DataError("velocities never change in the training files; there is nothing to learn")
    return np.array([*of_states, *(1.0 / of_rates)])


def typical(rows: Rows, model: Neural) -> tuple[float, ...]:
    """Root mean square of each input over the training rows, by which a network's inputs are divided.

    Raises:
        StudyError: an input is zero throughout.
    """
    found = np.sqrt(np.mean(np.square(rows.shown(model)), axis=0))
    for name, size in zip(INPUTS, found, strict=False):
        if not size > 0:
            wind = "; give the ship a network with wind = false" if name.startswith("wind") else ""
            raise StudyError(f"estimator: the training files never excite the input {name}{wind}")
    return tuple(found.tolist())


def answers(rows: Rows, dt: float) -> tuple[float, ...]:
    """Typical size of the accelerations, over a second so that noise counts little; shape (3,)."""
    n = max(round(1.0 / dt), 1)
    found = np.concatenate([  # never from one recording to the next
        (rows.state[a + n : b, 3:] - rows.state[a : max(b - n, a), 3:]) / (n * dt)
        for a, b in pairwise((0, *rows.ends))
    ])  # fmt: skip
    found = found[np.isfinite(found).all(axis=1)]
    return tuple(np.maximum(np.std(found, axis=0), 1e-12).tolist()) if len(found) else (1.0, 1.0, 1.0)


class Source:
    """Rows on the device, and the windows of one length cut from them."""

    def __init__(self, rows: Rows, weight: Array, dt: float, *, device: str, apparent: bool, repeat: int = 0) -> None:
        import torch

        def there(a: Array) -> Tensor:
            return torch.tensor(a, dtype=torch.float32, device=device)

        corner = rows.state[rows.complete][0] * np.array([1, 1, 0, 0, 0, 0])
        self.state, self.control = there(rows.state - corner), there(rows.acting[:, _CONTROLS])
        self.wind, self.rates, self.weight = there(rows.wind), there(np.nan_to_num(rows.rates)), there(weight)
        self.dt, self.apparent, self.repeat, self.device = dt, apparent, repeat, device

    def batch(self, starts: NDArray[np.int64], rows: int) -> Batch:
        """The windows that begin at `starts`, positions from their own beginnings.

        With `repeat`, the first `repeat` rows are copies of the one after them.
        """
        import torch

        at = np.arange(rows)
        at[: self.repeat] = self.repeat
        where = torch.from_numpy(at[:, None] + starts[None]).to(self.device)
        state = self.state[where]
        state[..., :2] -= state[:1, :, :2].clone()
        return Batch(
            state, self.control[where], self.wind[where], self.rates[where], self.weight, self.dt, self.apparent
        )


NETWORK_INPUTS = 7
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
    """Factors of the seven inputs, their scale included, shape (7, units)."""
    import torch

    names = ("W_ih",) if "W_ih" in weights else ("W_x0", "W_u0", "W_w0")
    rows = torch.cat([weights[name] for name in names if name in weights]) / scale[:, None]
    return torch.cat((rows, rows.new_zeros(NETWORK_INPUTS - len(rows), rows.shape[1])))


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

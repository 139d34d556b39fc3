"""Trials as rows that windows are cut from, in PyTorch: what was measured, what acted, and what an error counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..data import Array, DataError, Trial, unwrapped
from ..data.prepare import resampling
from ..models import STATES
from ..models.network import INPUTS
from ..models.neural import Neural, features
from ..replay import inputs
from ..replay_gaps import gaps
from . import Loss, StudyError
from .training_fold import Batch
from .windows import spread

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

CHANNELS = (*STATES, "rate of u", "rate of v_m", "rate of r")
"""What a loss compares, in the order of `Batch.weight`."""

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
        """Read trials of which each is to hold a window of so many rows.

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
        found: list[NDArray[np.int64]] = []
        begin = 0
        for end in self.ends:
            last = end - rows
            at = np.unique(np.append(np.arange(begin, last + 1, stride), last))
            found.append(at[before[at + rows] == before[at]])
            begin = end
        out = np.concatenate(found)
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
    for rows in gaps(trial, model).values():  # what was filled is no data
        acting[rows] = np.nan
    state = trial.stack(*STATES)
    state[:, 2] = unwrapped(state[:, 2])
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
    pieces = zip((0, *rows.ends[:-1]), rows.ends, strict=True)  # never from one recording to the next
    found = np.concatenate([(rows.state[a + n : b, 3:] - rows.state[a : max(b - n, a), 3:]) / (n * dt)
                            for a, b in pieces])  # fmt: skip
    found = found[np.isfinite(found).all(axis=1)]
    return tuple(np.maximum(np.std(found, axis=0), 1e-12).tolist()) if len(found) else (1.0, 1.0, 1.0)


class Source:
    """Rows on the device, and the windows of one length cut from them."""

    def __init__(
        self, rows: Rows, weight: Array, dt: float, *, device: str, apparent: bool, repeat: int = 0
    ) -> None:
        import torch

        def there(a: Array) -> Tensor:
            return torch.tensor(a, dtype=torch.float32, device=device)

        corner = rows.state[rows.complete][0] * np.array([1, 1, 0, 0, 0, 0])
        self.state, self.control = there(rows.state - corner), there(rows.acting[:, _CONTROLS])
        self.wind, self.rates, self.weight = there(rows.wind), there(np.nan_to_num(rows.rates)), there(weight)
        self.dt, self.apparent, self.repeat, self.device = dt, apparent, repeat, device

    def batch(self, starts: NDArray[np.int64], rows: int) -> Batch:
        """The windows that begin at `starts`, positions from their own beginnings.

        With `repeat`, the first so many rows are copies of the one after them.
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

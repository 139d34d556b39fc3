"""What acts on a ship from row to row: controls and surroundings as the log has them, and controls at fault."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from ....core.records import Limits
from ....core.values import dataclass
from ....data import Array
from ....data.prepare import turns
from ....environment import CHANNELS
from ....models import Model
from .suspects import LAZY, LOST, MISREAD, REVERSED, SCALED

_PLACE = {name: k for k, name in enumerate(CHANNELS)}
_VECTORS = (("current", "U_C", "gamma_C"), ("wave", "H_S", "gamma_W"))


@dataclass
class Override:
    """What a control does in place of what the log says.

    It holds `now`, follows slowly, loses a share, is reversed, or is logged too far by `now` or by that share.
    """

    how: str
    now: float
    rate: Annotated[float, Limits(null=math.inf)] = math.inf

    def acts(self, logged: float, span: float) -> float:
        """The control as it acts, for a row of `span` seconds."""
        if self.how == LOST:
            return logged * math.sqrt(max(1.0 - self.now, 0.0))
        if self.how == REVERSED:
            return -logged
        if self.how in (MISREAD, SCALED):
            return logged - self.now if self.how == MISREAD else logged * (1.0 - self.now)
        if self.how == LAZY:
            self.now += min(max(logged - self.now, -self.rate * span), self.rate * span)
        return self.now


def between_rows(before: Array, now: Array, kept: NDArray[np.bool_], turning: NDArray[np.bool_]) -> Array:
    """What acts from one row to the next: what is kept as it was before, the rest with the mean of both rows.

    Args:
        before, now: at either row; NaN before the first reading.
        kept, turning: which stay until the next row, and which are angles that go round, the shorter way.
    """
    apart, there = now - before, np.isfinite(before)
    around = before + 0.5 * np.arctan2(np.sin(apart), np.cos(apart))
    mean = np.where(turning, around, 0.5 * (before + now))
    return np.where(there, np.where(kept, before, mean), now)


class Acting:
    """Controls and environment as they were last logged.

    Attributes:
        now: shape (controls + 8,); NaN is a control that has not been logged yet.
    """

    def __init__(self, model: Model, held: Collection[str]) -> None:
        """Args: held: controls that keep the value of a row until the next one; others act with the mean of both."""
        self._model, self.controls = model, model.controls
        self.now = np.full(len(self.controls) + len(CHANNELS), np.nan)
        self.now[len(self.controls) :] = 0.0
        self._kept = np.array([*(name in held for name in self.controls), *(True for _ in CHANNELS)])
        self._turns = np.array([*(turns(name) for name in self.controls), *(False for _ in CHANNELS)])

    @property
    def known(self) -> bool:
        """Whether all controls have been logged."""
        return bool(np.isfinite(self.now).all())

    def between(self, before: Array) -> Array:
        """What acts from the row at which it was `before` to this one."""
        return between_rows(before, self.now, self._kept, self._turns)

    def heed(self, values: Mapping[str, float], motion: Array | None) -> None:
        """Take the controls and the environment of a row.

        Args:
            motion: x, y, psi, u, v_m, r as estimated, which turns apparent wind into true; None before there is any.
        """
        for k, (name, (order, factor)) in enumerate(zip(self.controls, self._model.stands_for, strict=True)):
            value = values.get(name, values.get(order, math.nan) * factor)
            if math.isfinite(value):
                self.now[k] = value
        around = self.now[len(self.controls) :]
        wind = _wind(values, motion)
        if wind is not None:
            around[_PLACE["wind_x"]], around[_PLACE["wind_y"]] = wind
        for stem, size, direction in _VECTORS:
            much, where = values.get(size, math.nan), values.get(direction, math.nan)
            if math.isfinite(much + where):
                around[_PLACE[f"{stem}_x"]] = much * math.cos(where)
                around[_PLACE[f"{stem}_y"]] = much * math.sin(where)
        if math.isfinite(values.get("T_W", math.nan)):
            around[_PLACE["wave_T"]] = values["T_W"]
        if values.get("depth", math.nan) > 0.0:
            around[_PLACE["per_depth"]] = 1.0 / values["depth"]


def _wind(values: Mapping[str, float], motion: Array | None) -> tuple[float, float] | None:
    """Where the true wind comes from, north and east [m/s]; apparent wind by the estimated motion."""
    much, where = values.get("U_T", math.nan), values.get("gamma_T", math.nan)
    if math.isfinite(much + where):
        return much * math.cos(where), much * math.sin(where)
    much, where = values.get("U_A", math.nan), values.get("gamma_A", math.nan)
    if motion is None or not math.isfinite(much + where):
        return None
    psi, u, v_m = motion[2:5].tolist()
    c, s = math.cos(psi), math.sin(psi)
    ahead, aside = much * math.cos(where) - u, much * math.sin(where) - v_m
    return ahead * c - aside * s, ahead * s + aside * c

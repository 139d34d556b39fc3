"""Validation: errors of predictions against measurements, criteria and requirements.

Contract: a `Comparison` holds one prediction and one measured trial on the same rows with their `Metrics`; `report`
turns comparisons into pages.  Modules: comparison, metrics, series (tables of fits), rivals (virtual studies), imo
(MSC.137(76)), requirements (Sawada 2024).
"""

from __future__ import annotations

from collections.abc import Mapping

from ..core.values import dataclass, field
from ..data import Trial

__all__ = ["Comparison", "Metrics"]


@dataclass(frozen=True)
class Metrics:
    """Errors of one channel over the compared samples.

    Attributes:
        rmse: root mean square error, in the channel's SI unit.
        r2: 1 - SSE / SST about the measured mean; NaN for a constant channel.
        fvu: fraction of variance unexplained, var(error) / var(measured).
        bias: mean error, predicted - measured.
        samples: number of samples compared (gaps left out).
    """

    rmse: float
    r2: float
    fvu: float
    bias: float
    samples: int


@dataclass(frozen=True)
class Comparison:
    """One prediction and one measurement.

    Attributes:
        measured, predicted: on the same rows.
        label: what predicts ("fitted", "published", "constant velocity").
        restart: seconds between restarts from the measured state, or None.
        metrics: by channel, over the whole prediction.
        horizons: by seconds since the restart, then by channel: RMSE within that horizon's bin.
        standardised: sum over the states of the mean squared error over sigma^2 (Wakita 2022 Eq. 25).
        indices: measured and predicted manoeuvre indices by name, where the trial has any.
        sigma: scale of each state in `standardised`, SI units.
        index_units: unit of each index.
    """

    measured: Trial
    predicted: Trial
    label: str
    restart: float | None
    metrics: Mapping[str, Metrics]
    horizons: Mapping[float, Mapping[str, float]]
    standardised: float
    indices: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    sigma: Mapping[str, float] = field(default_factory=dict[str, float])
    index_units: Mapping[str, str] = field(default_factory=dict[str, str])

    @property
    def samples(self) -> int:
        """Rows that were compared in at least one channel."""
        return max((m.samples for m in self.metrics.values()), default=0)

"""Priors against the data: where the data alone want a parameter far from what it was believed to be.

A posterior is the product of a prior and of what the data say.  Divided by the prior of one parameter it is what the
data, and the priors of the others, say of that one (the cavity of expectation propagation; Minka 2001); how far that
lies from the prior, over the scatter of both, is a test of the prior (Box 1980).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ...core.values import dataclass
from ...data import Array
from ..vector import Vector

# A prior is named where the data contradict it by so many sigma.
PULLS = 3.0
# Beyond so many it is no likelier than an error of an instrument.
_BELIEVED = 5.0
# Share of the prior variance that the data must remove to say where they want a parameter.
_SAYS = 0.05


@dataclass(frozen=True)
class Pull:
    """One prior and what the data want instead.

    Attributes:
        path: of the parameter.
        prior, sigma: mean and standard deviation of the prior, SI units.
        wanted: by the data without this prior, in one Gauss-Newton step.
        deviates: distance of the two over the scatter of both.
        share: of the objective that the step would remove.
    """

    path: str
    prior: float
    sigma: float
    wanted: float
    deviates: float
    share: float

    @property
    def matters(self) -> bool:
        """Whether chance is no explanation."""
        return abs(self.deviates) > PULLS

    @property
    def first(self) -> bool:
        """Whether it is likelier than an error of an instrument."""
        return self.matters and abs(self.deviates) < _BELIEVED

    @property
    def text(self) -> str:
        """The finding in one line."""
        off = (self.wanted - self.prior) / self.sigma
        return (f"the data want {self.path} {abs(off):.1f} sigma {'above' if off > 0 else 'below'} its prior: "
                f"{self.wanted:.3g} for {self.prior:.3g} +- {self.sigma:.2g}")  # fmt: skip

    @property
    def remedy(self) -> str:
        """What lets the data have it."""
        wide = float(f"{max(abs(self.wanted - self.prior), self.sigma):.1g}")
        return f'widen the prior: "{self.path}" = {{ sigma = {wide:g} }} in [free] of the study'


def pulls(vector: Vector, p: Array, variance: Array, cost: float) -> tuple[Pull, ...]:
    """The priors of a fit, the one that is contradicted most first.

    Args:
        p: where the fit ended, shape (parameters,) or longer.
        variance: of the posterior, of the same shape.
        cost: sum of the weighted squares of the residuals.
    """
    return tuple(sorted(_pulls(vector, p, variance, max(cost, 1e-300)), key=lambda one: -abs(one.deviates)))


def _pulls(vector: Vector, p: Array, variance: Array, cost: float) -> Iterator[Pull]:
    for f, mean, m, v in zip(vector.free, vector.mean.tolist(), p.tolist(), variance.tolist(), strict=False):
        square = f.sigma**2
        if not math.isfinite(square) or not 0.0 < v < (1.0 - _SAYS) * square:
            continue
        rest = square - v
        wanted = mean + (m - mean) * square / rest
        yield Pull(f.path, mean, f.sigma, wanted, (m - mean) / math.sqrt(rest),
                   (m - mean) ** 2 * v / (square * rest) / cost)  # fmt: skip

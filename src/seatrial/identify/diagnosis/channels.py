"""Residuals of a fit channel by channel, against the noise of the sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ...core.values import dataclass
from ...data import Array
from ...models import unit

# Residuals this much larger than the noise, and neighbours this much alike, are more than chance explains.
LARGE, ALIKE = 1.3, 0.15


def _shown(name: str, noise: float) -> str:
    """A noise in plain digits and the unit of reports."""
    symbol = unit(name)
    value = math.degrees(noise) if symbol.startswith("rad") else noise
    digits = max(1 - math.floor(math.log10(value)), 0) if 0.0 < value < math.inf else 0
    return f"{value:.{digits}f} {symbol.replace('rad', 'deg')}"


def plain(value: float, digits: int) -> str:
    """A number with so many digits that count, without an exponent where it is of ordinary size."""
    return f"{float(f'{value:.{digits}g}'):g}"


@dataclass(frozen=True)
class Channel:
    """Residuals of one channel.

    Attributes:
        noise: standard deviation of the sensor's noise, SI units.
        size: root mean square residual over the noise, degrees of freedom allowed for.
        alike: correlation of neighbouring residuals, beyond what the noise of the inputs causes.
        alike_sigma: scatter of that correlation for white residuals.
        lasting: time over which residuals are alike: twice the sum of their correlations [s].
        count: number of residuals.
        by_inputs: root mean square residual that the noise of the inputs causes, over the noise.
    """

    noise: float
    size: float
    alike: float
    alike_sigma: float
    lasting: float
    count: int
    by_inputs: float = 0.0

    def grounds(self, name: str) -> tuple[str, ...]:
        """What contradicts the model, one line each."""
        out: list[str] = []
        expected = math.hypot(1.0, self.by_inputs)
        if self.size > LARGE * expected:
            times, noise = plain(self.size, 2), _shown(name, self.noise)
            out.append(f"{name}: residuals are {times} times the sensor noise ({noise})")
        if self.alike > ALIKE + 4.0 * self.alike_sigma and self.size > expected:
            out.append(f"{name}: neighbouring residuals are alike (correlation {self.alike:.2f})")
        return tuple(out)


@dataclass(frozen=True)
class Residuals:
    """Residuals of one trial over the sensor noise, window after window.

    Attributes:
        t: time, the gaps between windows left out [s], shape (rows,).
        values: by channel; NaN where nothing is compared.
        control: the control that stands beside them (`Diagnosis.control`), as it acted.
    """

    t: Array
    values: Mapping[str, Array]
    control: Array

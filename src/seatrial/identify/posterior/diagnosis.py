"""What the residuals of a fit say about it: values that an estimator attaches to its fit (`posterior.diagnose`)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ...data import Array

# A suspect is listed as a cause from this drop of the objective on, in squared sigma, and if it moves a parameter by
# this many sigma or removes this share of the objective.
SIGNIFICANT, MOVES, REMOVES = 25.0, 1.0, 0.05
# Residuals this much larger than the noise, and neighbours this much alike, are more than chance explains.
LARGE, ALIKE = 1.3, 0.15
# A reversed wind (twice its reading too much) shows as at least this scale error in the first step towards it.
_TURNED = 0.5


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
            out.append(f"{name}: residuals are {self.size:.2g} times the sensor noise ({self.noise:.2g})")
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


@dataclass(frozen=True)
class Suspicion:
    """Score test (Lagrange multiplier) of one error of the instruments that the problem does not estimate.

    Attributes:
        name, words, unit, per: as in `suspects.Suspect`.
        drop: expected decrease of the objective in squared sigma (chi square, one degree of freedom).
        share: of the objective that it would remove.
        size, sigma: estimate in one Gauss-Newton step, SI units.
        moves: change of each free parameter, in its sigma, if it were estimated.
        of_reading: as in `suspects.Suspect`.
        whole: whether it is there or not, without a size, and cannot be estimated (`alternatives`).
    """

    name: str
    words: str
    unit: str
    per: float
    drop: float
    share: float
    size: float
    sigma: float
    moves: Mapping[str, float]
    of_reading: bool = False
    whole: bool = False

    @property
    def value(self) -> str:
        """Error of the instrument with its sigma and unit, as a share of the true value where it is a scale."""
        if self.whole:
            return "whole"
        size, sigma = self.size, self.sigma
        if self.of_reading and size < 0.9:
            size, sigma = size / (1.0 - size), sigma / (1.0 - size) ** 2
        return f"{size / self.per:.3g} +- {sigma / self.per:.1g} {self.unit}"

    @property
    def sized(self) -> str:
        """What it is, with its size where it has one."""
        return self.words if self.whole else f"{self.words} of {self.value}"

    @property
    def turned(self) -> bool:
        """Whether a wind acts so little as logged that it may act the other way: its direction may be reversed."""
        return self.name == "scale.wind" and self.size > _TURNED

    @property
    def matters(self) -> bool:
        """Whether it is significant and has an effect on the result."""
        most = max((abs(v) for v in self.moves.values()), default=0.0)
        return self.drop > SIGNIFICANT and (most > MOVES or self.share > REMOVES)

    @property
    def text(self) -> str:
        """The finding in one line."""
        most = max(self.moves, key=lambda path: abs(self.moves[path]), default="")
        moved = f"; {most} would move by {self.moves[most]:+.1f} sigma" if most else ""
        other = "; or its direction is where it blows to" if self.turned else ""
        return (f"{self.sized} would remove {self.share:.0%} of the objective"
                f"{moved}{other}")  # fmt: skip


@dataclass(frozen=True)
class Diagnosis:
    """Whether the model explains the data, and what else would.

    Attributes:
        channels: residuals by compared channel.
        suspicions: tests of the errors of instruments, the most likely first.
        rejected: readings left out as outliers, by trial and channel.
        errors: errors of instruments that were estimated, as suspicions whose drop is that of leaving each out.
        residuals: by trial, for drawings.
        control: name and unit of the control that stands beside them: the first angle, else the first control.
        widened: factor of each sigma over that of white noise, by path; empty where `Loss.correlation` states sigma.
        fixed: for fixed parameters of the model, the change of the free parameter that it moves most if it were
            larger by its error, in sigma: (path, free path, change); the strongest first.
        shares: error of each fixed parameter relative to its value: its sigma where the ship file states one, else .1.
        carried: for each free parameter the root sum of squares of what the fixed ones with a stated sigma move it by,
            in its sigma; empty where none is stated.
    """

    channels: Mapping[str, Channel] = field(default_factory=dict[str, Channel])
    suspicions: tuple[Suspicion, ...] = ()
    rejected: Mapping[str, Mapping[str, int]] = field(default_factory=dict[str, Mapping[str, int]])
    errors: tuple[Suspicion, ...] = ()
    residuals: Mapping[str, Residuals] = field(default_factory=dict[str, Residuals], repr=False)
    control: tuple[str, str] = ("", "")
    widened: Mapping[str, float] = field(default_factory=dict[str, float])
    fixed: tuple[tuple[str, str, float], ...] = ()
    shares: Mapping[str, float] = field(default_factory=dict[str, float])
    carried: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def causes(self) -> tuple[Suspicion, ...]:
        """Suspects that matter, the most likely first."""
        return tuple(one for one in self.suspicions if one.matters)

    @property
    def lacking(self) -> bool:
        """Whether the model does not explain the data."""
        return bool(self.causes) or any(one.grounds(name) for name, one in self.channels.items())

    def numbers(self) -> dict[str, object]:
        """The same for fit.json, SI units."""
        return {
            "explained": not self.lacking, "lines": self.lines,
            "channels": {name: {"noise": c.noise, "size": c.size, "correlation": c.alike, "samples": c.count}
                         for name, c in self.channels.items()},
            "suspects": [{"name": s.name, "size": s.size, "sigma": s.sigma, "drop": s.drop, "share": s.share,
                          "matters": s.matters, "moves": dict(s.moves)} for s in self.suspicions],
            "estimated": {s.name: {"size": s.size, "sigma": s.sigma} for s in self.errors},
            "outliers": {trial: dict(found) for trial, found in self.rejected.items()},
            "widened": dict(self.widened),
            "fixed": [{"parameter": path, "error": self.shares.get(path, 0.1), "moves": free, "sigmas": moved}
                      for path, free, moved in self.fixed],
            "carried": dict(self.carried),
        }  # fmt: skip

    @property
    def lines(self) -> tuple[str, ...]:
        """The finding and its grounds, one line each."""
        out = [f"{name}: outliers left out: {', '.join(f'{count} of {channel}' for channel, count in n.items())}"
               for name, n in self.rejected.items()]  # fmt: skip
        out += [f"estimated: {one.words} of {one.value}" for one in self.errors]
        if not self.lacking:
            return ("the residuals look like sensor noise", *out)
        grounds = [line for name, one in self.channels.items() for line in one.grounds(name)]
        return (
            "the model does not explain the data: sigma and verdicts hold only if the model were right",
            *(f"suspect: {one.text}" for one in self.causes[:5]), *grounds, *out,
        )  # fmt: skip

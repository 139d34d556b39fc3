"""The pseudo-random manoeuvre: rudder and revolutions switched by a maximal-length sequence.

The sequence is that of a linear recurrence over the residues of a prime, so two levels give the
binary sequence (PRBS) and three, five or seven the m-level ones that Sawada 2024 Table 1 lists.  Its
autocorrelation is that of noise within a period, which is what excites every frequency alike.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from functools import cache
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import ParameterError, Scalar, Scalars, spec
from ..core.values import dataclass
from ..data import Array, Trial
from . import Index, Manoeuvre, Settings
from .reading import helm_channel, in_lengths, rms

LEVELS = (2, 3, 5, 7)
"""Numbers of levels for which a multi-level pseudo-random sequence exists here: primes."""
# The longest sequence looked for; a longer one is longer than any trial.
_LONGEST = 2400
# A level lasts so many L/U: long against rudder and yaw, short against the speed.
_HOLD = 2.0
# Shares of a step by which a sample may miss the instant of a switch.
_ROUNDING = 1e-9
_CELLS = 5


class Excitation(Manoeuvre):
    """A random manoeuvre: complete after `length` seconds, to within a sample, and judged by how it moved the ship."""

    timed: ClassVar[bool] = True  # whatever its length, it is whole
    length: float

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("hold", "travel", "length"):
            if not 0 < (time := vars(self).get(name, 1.0)) < math.inf:
                raise ParameterError(f"{name} is {time:g} s; it must be above zero")

    def complete(self, trial: Trial) -> bool:
        """Whether the run is as long as ordered, to within a sample."""
        return trial.duration + trial.dt >= self.length * (1 - _ROUNDING)

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """How much the run moved the ship; see `liveliness`."""
        return liveliness(trial, L_pp)


@dataclass(frozen=True)
class PseudoRandom(Excitation):
    """Rudder, and if wanted revolutions, held at random levels for `hold` seconds each.

    Switches fall on multiples of `hold`, whatever the time step.  The revolutions run through the same
    sequence half a period (two levels) or a quarter (more) later, so the two are uncorrelated within it.

    Attributes:
        levels: number of levels between the extremes, a prime up to 7; the seven are less white.
        degree: order of the recurrence; the period has levels**degree - 1 switches.
        hold: time between switches [s].
        seed: picks where in the period the sequence begins.
    """

    kind: ClassVar[str] = "pseudo-random"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "side", "seed")
    given: ClassVar[tuple[str, ...]] = ("rudder_level", "revolution_level")

    n_P: Scalar = spec("1/s", "propeller revolutions about which they vary")
    delta: Scalar = spec("rad", "greatest rudder angle; its sign is that of the first side", (-math.pi, math.pi))
    spread: Scalar = spec("-", "greatest change of the revolutions over n_P", (0.0, 2.0), default=0.0)
    levels: int = 5
    degree: int = 2
    hold: float = 10.0
    seed: int = 1

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.levels not in LEVELS:
            raise ParameterError(f"levels is {self.levels}; a maximal-length sequence has 2, 3, 5 or 7")
        if not (self.degree >= 2 and self.levels**self.degree - 1 <= _LONGEST):
            raise ParameterError(
                f"degree is {self.degree}; with {self.levels} levels it is from 2 to "
                f"{int(math.log(_LONGEST + 1, self.levels))}"
            )

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """Five levels up to 20 deg, each for two ship lengths, revolutions within a quarter of the approach's."""
        delta = settings.side * settings.rudder_or(math.radians(20.0))
        hold = _HOLD * settings.L_pp / settings.speed
        return cls(settings.n_P, delta, 0.25, hold=hold, seed=settings.seed)

    @property
    def period(self) -> float:
        """Time after which the orders repeat [s]."""
        return self.hold * (self.levels**self.degree - 1)

    def schedule(self, dt: float, steps: int) -> Array:
        """Levels of rudder and revolutions in [-1, 1] per step, shape (steps, 2); the same at every call."""
        sequence = m_sequence(self.levels, self.degree)
        size = sequence.size
        first = int(np.random.default_rng(self.seed).integers(size))
        at = first + np.floor(np.arange(steps) * dt / self.hold + _ROUNDING).astype(np.intp)
        later = size // 2 if self.levels == LEVELS[0] else size // 4
        return np.column_stack([sequence[at % size], sequence[(at + later) % size]])

    def command(
        self, t: Scalar, state: Scalars, memory: Scalars, given: Scalars = (0.0, 0.0)
    ) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad] at the given levels."""
        rudder, revolutions = given
        return (self.n_P * (1.0 + self.spread * revolutions), self.delta * rudder), memory

    def complete(self, trial: Trial) -> bool:
        """Whether a whole period was run, to within a sample."""
        return trial.duration + trial.dt >= self.period * (1 - _ROUNDING)


@cache
def m_sequence(levels: int, degree: int) -> Array:
    """One period of a maximal-length sequence with values in [-1, 1], shape (levels**degree - 1,).

    With two levels the autocorrelation is 1, and -1/N at every other shift; with three or five it is
    zero at every shift but 0 and N/2, where the sequence repeats with the other sign.

    Args:
        levels: number of levels, one of `LEVELS`.
        degree: order of the recurrence.
    """
    coefficients = next(
        c for c in itertools.product(range(levels), repeat=degree) if c[0] and _period(c, levels) == levels**degree - 1
    )
    found = list(itertools.islice(_recurrence(coefficients, levels), levels**degree - 1))
    half = levels // 2
    if levels == LEVELS[0]:
        sequence = 2.0 * np.array(found, dtype=np.float64) - 1.0
    else:  # residues about zero: 3 of 5 is -2, so that the other sign of a residue is the other side
        sequence = (np.mod(np.array(found) + half, levels) - half).astype(np.float64) / half
    sequence.setflags(write=False)  # kept for the next caller
    return sequence


def _recurrence(coefficients: tuple[int, ...], levels: int) -> Iterator[int]:
    """x[k + n] = sum of c[i] x[k + i], modulo `levels`, from (0, ..., 0, 1) on."""
    register = (*([0] * (len(coefficients) - 1)), 1)
    while True:
        yield register[0]
        register = _shifted(register, coefficients, levels)


def _shifted(register: tuple[int, ...], coefficients: tuple[int, ...], levels: int) -> tuple[int, ...]:
    return (*register[1:], sum(c * x for c, x in zip(coefficients, register, strict=True)) % levels)


def _period(coefficients: tuple[int, ...], levels: int) -> int:
    """Steps after which the register of the recurrence is back where it began."""
    first = register = (*([0] * (len(coefficients) - 1)), 1)
    steps = 0
    while not steps or register != first:
        register = _shifted(register, coefficients, levels)
        steps += 1
    return steps


def liveliness(trial: Trial, L_pp: float) -> Mapping[str, Index]:
    """What a random run covers.

    Root mean squares of rudder [rad] and yaw rate [rad/s], least and greatest speed [m/s], length of
    the track [m], and `coverage`: the share of 5 x 5 cells of rudder and yaw rate, each between its
    extremes, that the run visits [-].  Figures whose channels are absent are left out.
    """
    out: dict[str, Index] = {}
    helm = helm_channel(trial)
    if helm in trial:
        out["rudder_rms"] = Index(rms(trial[helm]), "rad", helm=1)
    if "r" in trial:
        out["yaw_rate_rms"] = Index(rms(trial["r"]), "rad/s")
    if "u" in trial and "v_m" in trial:
        U = np.hypot(trial["u"], trial["v_m"])
        out["speed_min"], out["speed_max"] = Index(float(np.nanmin(U)), "m/s"), Index(float(np.nanmax(U)), "m/s")
        out["track_length"] = in_lengths(float(np.nansum(U[:-1] * np.diff(trial.t))), L_pp)
    if helm in trial and "r" in trial:
        cells = [_cell(trial[name]) for name in (helm, "r")]
        both = (cells[0] >= 0) & (cells[1] >= 0)
        visited = np.unique(_CELLS * cells[0][both] + cells[1][both]).size
        out["coverage"] = Index(visited / _CELLS**2, "-")
    return out


def _cell(values: Array) -> Array:
    """Number of the cell that each value falls in between the extremes; -1 for a gap."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    scaled = (values - low) / max(high - low, 1e-300) * _CELLS
    return np.where(np.isfinite(values), np.clip(np.floor(scaled), 0, _CELLS - 1), -1.0)

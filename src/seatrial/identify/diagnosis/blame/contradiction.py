"""A trial that asks other parameters than the others do: a value that `by_trial` finds and a diagnosis tells."""

from __future__ import annotations

from collections.abc import Mapping

from ....core.values import dataclass

# Deviates beyond which chance is no explanation: those of a suspect (`findings.SIGNIFICANT`).
_DEVIATES = 5.0
# Of trials that contradict each other, those beyond this are named.
_HARDLY = 3.0
# One trial stands out where leaving it out removes this share of what the scores of all exceed chance by.
_MOST = 0.75


@dataclass(frozen=True)
class Contradiction:
    """What one trial asks of the parameters, against the others.

    Attributes:
        trial: its name.
        chi, freedom: square of its score over the covariance, and what chance leaves of that on average.
        deviates: the same in standard deviations of a Gaussian (Wilson and Hilferty 1931).
        together: deviates of the scores of all trials at once.
        removes: share of the excess of all trials that leaving this one out would remove.
        moves: change of each free parameter without this trial, in its sigma.
    """

    trial: str
    chi: float
    freedom: int
    deviates: float
    together: float
    removes: float
    moves: Mapping[str, float]

    @property
    def matters(self) -> bool:
        """Whether chance is no explanation, and the result depends on it."""
        return max(self.deviates, self.together) > _DEVIATES and max(map(abs, self.moves.values()), default=0.0) > 1.0

    @property
    def odd(self) -> bool:
        """Whether noise does not explain it, or hardly."""
        return self.deviates > _HARDLY

    @property
    def alone(self) -> bool:
        """Whether the others agree among themselves, or nearly."""
        return self.deviates > _DEVIATES and self.removes > _MOST

    @property
    def text(self) -> str:
        """The finding in one line."""
        most = max(self.moves, key=lambda path: abs(self.moves[path]))
        return (f"trial {self.trial} contradicts the others (chi square {self.chi:.0f} where {self.freedom} is "
                f"expected); without it {most} would move by {self.moves[most]:+.1f} sigma")  # fmt: skip

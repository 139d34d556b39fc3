"""A safety case as values: what is claimed and asked for, and what became of its runs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

from ...campaign.analysis.proportion import Proportion
from ...core.records import Limits, NotNegative, Positive, digest
from ...core.values import asdict, dataclass, field
from ...encounters.sensing import Sensing
from .rare import Rarely, Seldom
from .stacks import Stack

SCHEMA, PART, RARE = "seatrial-case/1", "seatrial-case-part/1", "seatrial-case-rare/1"
CONTACT, MUTE = "contact", "silent"
"""What a run can fail by beside the rules: hulls that touched, a stack that answered no more."""
RoleName = Literal["head-on", "give-way", "stand-on", "overtaking", "overtaken"]


@dataclass(frozen=True, kw_only=True)
class Met:
    """A ship that is met: place north and east of the own one [m], course [rad], speed [m/s], conduct."""

    x: float
    y: float
    psi: float
    U: Positive
    conduct: str


@dataclass(frozen=True, kw_only=True)
class Encountered:
    """What is met: drawn by role of the own ship towards each other one, a fixed set, ships given, or a table of AIS.

    `duration` [s] is that of a run; by the latest meeting unless given.  `kinds` are those of the ships that are met,
    in order (Rule 18); power-driven unless given.
    """

    set: Literal["drawn", "imazu", "dnv", "given", "ais"] = "drawn"
    file: str | None = None
    ships: tuple[Met, ...] = ()
    roles: tuple[RoleName, ...] = ("head-on", "give-way", "stand-on")
    runs: Annotated[int, Limits(least=1, most=1_000_000)] = 1000
    length: Positive | None = None
    duration: Positive | None = None
    kinds: tuple[Literal["power-driven", "sailing", "fishing", "restricted", "not under command"], ...] = ()


@dataclass(frozen=True, kw_only=True)
class Around:
    """Least and greatest true wind and current [m/s], and of their directions [rad]; any unless given."""

    wind: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    wind_from: tuple[float, float] = (-math.pi, math.pi)
    current: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    current_towards: tuple[float, float] = (-math.pi, math.pi)


@dataclass(frozen=True, kw_only=True)
class Where:
    """Where runs begin: open water in sight of one another unless given.

    Attributes:
        chart: of the library, or a file beside the case.
        at, psi: place of the own ship north and east of its datum [m], and its course [rad].
        draught: of the own ship, squat and allowances included [m]; that of its file unless given.
        safety: depth that it takes for safe [m].
        visibility: [m]; given, it is restricted.
    """

    chart: str | None = None
    at: tuple[float, float] = (0.0, 0.0)
    psi: float = 0.0
    draught: Positive | None = None
    safety: Positive | None = None
    visibility: Positive | None = None


@dataclass(frozen=True, kw_only=True)
class Failed:
    """What a failure was when it was found: rules that it broke, and the digest of its tracks."""

    broken: tuple[str, ...]
    tracks: str


@dataclass(frozen=True, kw_only=True)
class CaseFile:
    """A case as its file has it.

    `stack` and `traffic` are conducts, a stack also FILE.py:NAME of one's own, or a table of one.  It sees all
    ships as they are without `sensors`.  `rare` asks for a breach by levels; `as_fitted` draws no ship from the
    posterior, and `found` is of a failure that was kept.
    """

    claim: str
    ship: str
    stack: str | Stack = "rules"
    seed: Annotated[int, Limits(least=0)] = 1
    traffic: tuple[str, ...] = ("rules", "ignores", "late")
    encounters: Encountered = field(default_factory=Encountered)
    weather: Around = field(default_factory=Around)
    waters: Where = field(default_factory=Where)
    sensors: Sensing | None = None
    rare: Seldom | None = None
    as_fitted: bool = False
    found: Failed | None = None

    @property
    def called(self) -> str:
        """What steers the own ship, in a word or as a command."""
        return self.stack if isinstance(self.stack, str) else f"{self.stack.told} ({self.stack.speaks})"

    @property
    def foreign(self) -> bool:
        """Whether it may fall silent, being no conduct."""
        return not isinstance(self.stack, str) or ":" in self.stack


@dataclass(frozen=True)
class Part:
    """What became of some runs.

    Attributes:
        first: number of the first run.
        broken: rules that the own ship did not keep, by run; `CONTACT` and `MUTE` among them; None where the model
            failed.
        judged: rules that applied to it, by run.
        closest: least gap of the own hull to any other [m], by run; None where the model failed.
        untested: channels with which the ship leaves what trials tested, by run.
        plain, plain_closest: the same as `broken` and `closest` on the ship as it was fitted, without a draw; empty
            where there is no posterior, and in parts that are not sailed again.
    """

    case: str
    first: int
    broken: tuple[tuple[str, ...] | None, ...]
    judged: tuple[tuple[str, ...], ...]
    plain: tuple[tuple[str, ...] | None, ...] = ()
    closest: tuple[float | None, ...] = ()
    plain_closest: tuple[float | None, ...] = ()
    untested: tuple[str, ...] = ()


@dataclass(frozen=True)
class Case:
    """A case that was run.

    Attributes:
        file: what was asked for.
        digest: of all that decides the runs.
        parts: of its runs, in order.
        posterior: digest of the fit from which ships were drawn; empty without one.
        rarely: the breach that was sought by levels; None where none was.
    """

    file: CaseFile
    digest: str
    parts: tuple[Part, ...]
    posterior: str
    rarely: Rarely | None = None

    @property
    def broken(self) -> list[tuple[str, ...] | None]:
        """By run."""
        return [one for part in self.parts for one in part.broken]

    @property
    def pairs(self) -> list[tuple[tuple[str, ...], tuple[str, ...]]]:
        """What was broken in runs that were sailed twice: on the ship that was drawn, and on the fitted one."""
        return [(a, b) for part in self.parts for a, b in zip(part.broken, part.plain, strict=False)
                if a is not None and b is not None]  # fmt: skip

    @property
    def added(self) -> tuple[float, float, float]:
        """Share of runs that fail by which drawn ships are worse than the fitted one, and its interval of 95 %.

        It is the difference of two shares of the same runs: those that fail on one ship only, by Clopper and Pearson
        at 97.5 % each (Bonferroni), so that it holds at least as often as it says.
        """
        pairs = self.pairs
        worse, better = (Proportion(sum(bool(one[k]) and not one[1 - k] for one in pairs), len(pairs)) for k in (0, 1))
        (low, high), (least, most) = worse.within(0.975), better.within(0.975)
        return worse.value - better.value, low - most, high - least

    @property
    def sealed(self) -> str:
        """Digest of all parts: of every run, what applied and what was broken; and of a breach by levels."""
        return digest([asdict(part) for part in (*self.parts, *([self.rarely] if self.rarely else []))])

    def share(self, rule: str) -> Proportion:
        """Of the runs to which a rule applied (contact, silence: all), those that broke it."""
        rows = [(one, judged) for part in self.parts
                for one, judged in zip(part.broken, part.judged, strict=True) if one is not None]  # fmt: skip
        mine = [one for one, judged in rows if rule in (CONTACT, MUTE) or rule in judged]
        return Proportion(sum(rule in one for one in mine), len(mine))


def part_at(out: Path, first: int) -> Path:
    """File of the runs from one on, in the folder of a case."""
    return out / f"part-{first:07d}.json"


def rare_at(out: Path) -> Path:
    """File of what was found by levels."""
    return out / "rare.json"

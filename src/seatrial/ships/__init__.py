"""Ships: a model with its numbers, each with its source.

Contract: `load(name or file)` gives a `Ship`; a fit is saved as such a file too, so whatever takes
a ship takes a fit.  One TOML file per ship; see docs/extending.md for its keys.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from ..actuators import Actuators
from ..core.errors import ShipError as ShipError
from ..core.parameters import possible, specs, update, walk
from ..core.values import dataclass, field, replace
from ..models import Model


@dataclass(frozen=True)
class Entry:
    """Where one number of a ship file comes from.

    Attributes:
        source: citation key and place, such as ``yasukawa2015 Tab. 3``.
        given: the number as printed there; primed where `prime` is True.
        prime: whether `given` is non-dimensional and was scaled on loading.
        unit: unit of `given` as printed; empty where it is that of the parameter.
        sigma: standard uncertainty of the model value, where known.
    """

    source: str
    given: float
    prime: bool = False
    unit: str = ""
    sigma: float | None = None


@dataclass(frozen=True, repr=False)
class Ship:
    """A model of a ship, its actuators, its approach condition and the provenance of its numbers.

    Attributes:
        L_pp: length between perpendiculars [m], the yardstick of every report.
        speed: approach speed [m/s].
        n_P: revolutions that hold it [1/s]; None where they follow from the model.
        validity: closed interval of each state outside which the model is not valid.
        entries: provenance of each parameter by path.
        notes: free text of the file: title, references, cautions, fit provenance.
        of: name of the ship that this is another model of, as its logs give it; empty where it is `name`.
        file: where it was read from; a ship that was changed since keeps it.
    """

    name: str
    model: Model
    actuators: Actuators
    L_pp: float
    speed: float
    n_P: float | None = None
    validity: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, tuple[float, float]])
    entries: Mapping[str, Entry] = field(default_factory=dict[str, Entry])
    notes: Mapping[str, Any] = field(default_factory=dict[str, Any])
    of: str = ""
    file: Path | None = field(default=None, compare=False)

    def __hash__(self) -> int:
        # Of what equal ships have in common; mappings have no hash.
        numbers = tuple(value for _, _, value in walk(self.model))
        return hash((self.name, type(self.model), numbers, self.L_pp, self.speed, self.n_P, self.of))

    def __repr__(self) -> str:
        family = type(self.model).__name__
        return f"{type(self).__name__}({self.name!r}, {family}, {self.L_pp:g} m, {self.speed:.4g} m/s)"

    @property
    def names(self) -> tuple[str, ...]:
        """What a log may call the ship: the name of this model, and that of the ship it is a model of."""
        return (self.name, self.of) if self.of else (self.name,)

    def having(self, changes: Mapping[str, float]) -> Self:
        """The same ship with some parameters of its model replaced.

        Raises:
            ParameterError: no such parameter, or a number that leaves what it can be, as a ship file would be refused.
        """
        possible(specs(self.model), changes)
        return self.moved(changes)

    def moved(self, changes: Mapping[str, float]) -> Self:
        """`having` without a check of the ranges: the result of a search is reported, not refused at the end."""
        return replace(self, model=update(self.model, changes))


def shortened(cautions: Sequence[str]) -> Iterator[str]:
    """Cautions of a ship with those of ranges in one line, where there are several; its file has them one by one."""
    start = "outside the range of "
    formulas = [one.removeprefix(start).partition(": ")[0] for one in cautions if one.startswith(start)]
    if len(formulas) > 1:
        yield f"{start}{len(formulas)} formulas ({', '.join(formulas)}); by how much: the sources in the ship file"
    yield from (one for one in cautions if len(formulas) < 2 or not one.startswith(start))

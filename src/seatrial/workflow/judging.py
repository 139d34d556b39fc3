"""Choices and judgements of ships: estimation from particulars, design of trials, requirements and the IMO criteria."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..core.parameters import unknown
from ..data import UNITS
from ..models import STATES
from ..ships import Ship
from . import RequestError
from .request import DEGREE, PAGES, Note, check_output, positive, ship_of, silent

if TYPE_CHECKING:
    from ..choosing.purposes import Advice, Purpose
    from ..identify.design.excitation import Plan
    from ..report.page import Page
    from ..ships.estimate import Estimate
    from ..validate.imo import ImoTable
    from ..validate.requirements import Table

ANGULAR = ("psi", "r")


def estimate(particulars: Path, out: Path, note: Note = silent) -> Estimate:
    """Estimate a ship from its particulars by regression formulas, and write its file.

    Raises:
        RequestError: an output that is no ship file or would replace the particulars.
        ShipError: particulars that cannot be used; nothing is written.
    """
    from ..ships.estimate import estimate as estimated
    from ..ships.files import save

    check_output(out, (".toml",), "a ship file", particulars)
    made = estimated(particulars)
    save(made.ship, out)
    for line in made.cautions:
        note(f"warning: {line}")
    note(f"wrote {out}")
    return made


def recommend(purpose: str) -> tuple[Purpose, Sequence[Advice]]:
    """A purpose by its key, and the families of models ranked for it.

    Raises:
        RequestError: an unknown purpose; lists the known ones.
    """
    from ..choosing import purposes
    from ..choosing.survey import survey

    found = {one.key: one for one in purposes.PURPOSES}
    if purpose not in found:
        raise RequestError(f"--for: no purpose '{purpose}'; known: {', '.join(found)}")
    return found[purpose], purposes.recommend(found[purpose], survey())


@dataclass(frozen=True)
class Design:
    """A set of manoeuvres for the parameters of a ship.

    Attributes:
        ship: the ship.
        noise: standard deviation of each channel that is measured, SI units and radians.
        plan: the manoeuvres, and what they determine.
    """

    ship: Ship
    noise: Mapping[str, float]
    plan: Plan


def design(
    ship: str | Path | Ship, free: Sequence[str], *, budget: float = 60.0, noise: str | None = None,
    interval: float | None = None, repeats: int = 1, note: Note = silent,
) -> Design:  # fmt: skip
    """Choose manoeuvres that determine the parameters `free` of a ship, by Fisher information.

    Args:
        ship: a name of the library, a ship file or a ship.
        free: patterns of parameter paths, such as ``hull.*``.
        budget, noise, interval, repeats: as the options of `seatrial design`; no noise assumes good sensors.
        note: takes assumptions, and manoeuvres that are left out.

    Raises:
        RequestError, ParameterError, StudyError, ShipError: a request that cannot be carried out.
    """
    from ..identify.design.excitation import plan, usual, usual_noise, wanted

    positive(budget=budget, interval=interval, repeats=float(repeats))
    vessel = ship_of(ship)
    if not free:
        raise RequestError("--free: name the parameters to design for, for example 'hull.*' (see seatrial show)")
    deviations = _noise(noise) if noise else usual_noise(vessel)
    if not noise:
        note("note: no --noise given; good sensors are assumed: " + _in_words(deviations))
    found = plan(
        vessel, wanted(vessel, free), usual(vessel), budget, noise=deviations, interval=interval, repeats=repeats
    )
    for line in found.left_out:
        note(f"note: left out: {line}")
    return Design(vessel, deviations, found)


def _noise(text: str) -> dict[str, float]:
    """Deviations in SI units and radians from ``channel=value,...``.

    Raises:
        RequestError: an unknown channel, or no number above zero.
    """
    out: dict[str, float] = {}
    for part in text.split(","):
        name, _, value = part.strip().partition("=")
        if name not in STATES:
            raise RequestError(f"--noise: {unknown(name, STATES, 'channel')}")
        try:
            number = float(value)
        except ValueError:
            raise RequestError(f"--noise: '{part.strip()}' is no deviation; write {name}=0.1") from None
        positive(noise=number)
        out[name] = number * (DEGREE if name in ANGULAR else 1.0)
    return out


def _in_words(deviations: Mapping[str, float]) -> str:
    return ", ".join(
        f"{name} {value / (DEGREE if name in ANGULAR else 1.0):.2g} {UNITS[name].replace('rad', 'deg')}"
        for name, value in deviations.items()
    )


def imo(ship: str | Path | Ship, out: Path | None = None, note: Note = silent) -> ImoTable:
    """Judge a ship by the criteria of IMO MSC.137(76); writes a page where `out` is given.

    Raises:
        RequestError: an output that is no page, or whose folder does not exist.
        ShipError: a ship that cannot be read, or has no steady approach.
    """
    from ..report.imo import page
    from ..validate.imo import imo_table

    check_output(out, PAGES, "the page of the criteria")
    table = imo_table(ship_of(ship))
    _write(out, lambda: page(table), note)
    return table


def requirements(
    ship: str | Path | Ship, scope: str = "collision-avoidance", out: Path | None = None, note: Note = silent
) -> Table:
    """Judge a ship by Sawada 2024 section 6; writes a page where `out` is given.

    Raises:
        RequestError: an unknown scope, or an output that is no page or whose folder does not exist.
        ShipError: a ship that cannot be read.
    """
    from ..report.requirements import page
    from ..validate.requirements.scopes import SCOPES, judge

    if scope not in SCOPES:
        raise RequestError(f"--scope is '{scope}'; known: {', '.join(SCOPES)}")
    check_output(out, PAGES, "the page of the requirements")
    found = judge(ship_of(ship), scope)
    _write(out, lambda: page(found), note)
    return found


def _write(out: Path | None, page: Callable[[], Page], note: Note) -> None:
    if out is not None:
        from ..report.page import write

        note(f"wrote {write(out, page())}")

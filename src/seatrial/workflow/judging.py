"""Ships made and judged: from particulars, captive tests, another scale; design of trials, requirements, criteria."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.parameters import unknown, values
from ..core.values import dataclass, replace
from ..data import UNITS
from ..models import STATES
from ..ships import Ship, shortened
from ..ships.classes import foreign
from . import RequestError
from .asked import Bands, Draws
from .request import DEGREE, PAGES, Note, banded, check_output, positive, ship_of, silent

if TYPE_CHECKING:
    from ..choosing.purposes import Advice, Purpose
    from ..identify.design.excitation import Plan
    from ..identify.regression.captive import CaptiveFit
    from ..report.page import Page
    from ..ships.estimate import Estimate
    from ..ships.scaling import Scaled
    from ..validate.imo import ImoTable
    from ..validate.requirements import Table
    from .evidence.designed import Foreseen

ANGULAR = ("psi", "r")
ESTIMATED = Bands(level=95.0, count=200)
"""Bands by which an estimated ship is judged unless others are asked for."""


def estimate(
    particulars: Path, out: Path, note: Note = silent, *, shallow: bool = False, GM: float | None = None
) -> Estimate:
    """Estimate a ship from its particulars by regression formulas, and write its file.

    Args:
        shallow, GM: a ship that feels the depth, and one that heels, with its metacentric height [m].

    Raises:
        RequestError: an output that is no ship file or would replace the particulars.
        ShipError: particulars that cannot be used; nothing is written.
    """
    from ..ships.estimate import estimate as estimated
    from ..ships.files import save

    check_output(out, (".toml",), "a ship file", particulars)
    made = estimated(particulars, shallow=shallow, GM=GM)
    save(made.ship, out)
    for line in shortened(made.cautions):
        note(f"warning: {line}")
    note(f"wrote {out}")
    return made


def copy(ship: str | Path | Ship, file: Path, note: Note = silent) -> Ship:
    """Write a ship as a complete, commented file to edit, called by the name of the file; the copy made.

    It holds what the ship's file is like or leaves at a default, and the weights of a network beside it.

    Raises:
        RequestError: an output that is no ship file, or that exists.
    """
    from ..ships.files import load, save
    from ..ships.networks import weights_name

    check_output(file, (".toml",), "a ship file")
    base = ship_of(ship)
    beside = (file, file.with_name(weights_name(file))) if base.model.learned is not None else (file,)
    for one in beside:
        if one.exists():
            raise RequestError(f"{one}: exists already; name a new file")
    made = replace(base, name=file.stem, of=base.of or base.name)
    save(made, file, comments=True)
    note(f"wrote {file}, a copy of {base.name} to edit")
    return load(file, trust=foreign(base.model))


def captive(
    ship: str | Path | Ship, tables: Sequence[Path], out: Path | None = None, *, mapping: Path | None = None,
    free: Sequence[str] = (), water: Path | None = None, page: Path | None = None, note: Note = silent,
) -> CaptiveFit:  # fmt: skip
    """Fit the coefficients of a ship to tables of captive tests, and write its file.

    Args:
        ship: the ship to begin with; parameters that the tests do not determine keep its value.
        tables: of one model, CSV.
        out: ship file to write (.toml).
        mapping, free, water: as `--mapping`, `--free`, `--open-water` of `seatrial captive`.
        page: report to write (.html).

    Raises:
        RequestError: an output of another kind, or in the place of an input.
        DataError, FitError, ParameterError: tables that cannot be used; nothing is written.
    """
    from ..core.version import __version__
    from ..data.captive import read_captive
    from ..identify.regression.captive import USUAL, fit_captive
    from ..report.judging.captive import in_words
    from ..report.judging.captive import page as made
    from ..report.page import write
    from ..ships.files import save

    inputs = [*tables, *(one for one in (mapping, water) if one is not None)]
    check_output(out, (".toml",), "a ship file", *inputs)
    check_output(page, PAGES, "a report", *inputs)
    vessel = ship_of(ship)
    if water is not None:
        vessel = _with_propeller(vessel, water)
    runs = read_captive(tables, mapping, L_pp=vessel.L_pp, rho=float(values(vessel.model).get("body.rho", 1000.0)))
    found = fit_captive(vessel, runs, tuple(free) or USUAL)
    note(in_words(found))
    if out is not None:
        found = replace(found, ship=_named(found, out.stem))
        save(found.ship, out)
        note(f"wrote {out}")
    if page is not None:
        command = f"seatrial captive {vessel.name} {' '.join(map(str, tables))}"
        write(page, made(found, {"tables": runs.source or runs.name, "command": command, "version": __version__}))
        note(f"wrote {page}")
    return found


def _named(found: CaptiveFit, name: str) -> Ship:
    """The fitted ship under its own name, with title and cautions of its own."""
    before = found.began
    held = ", ".join(found.held) or "nothing"
    notes = {key: value for key, value in before.notes.items() if key != "provenance"}
    notes["title"] = f"{before.notes.get('title', before.name)}; coefficients of captive tests"
    caution = f"Not determined by the tests, and as in {before.name}: {held}."
    notes["cautions"] = [*before.notes.get("cautions", ()), caution]
    return replace(found.ship, name=name, of=before.of or before.name, notes=notes)


def _with_propeller(ship: Ship, table: Path) -> Ship:
    """The ship with the thrust coefficients of an open-water test, columns J and K_T (or Kt)."""
    from ..data import DataError
    from ..data.table import lines_of, numbers, split_row
    from ..identify.regression.captive import open_water
    from ..ships import Entry

    lines = lines_of(table)
    heads = split_row(lines[0], ",")
    plain = [head.partition("[")[0].strip().replace("_", "").upper() for head in heads]
    if plain.count("J") != 1 or plain.count("KT") != 1:
        raise DataError(f"{table}: line 1: columns {', '.join(heads)}; an open-water test has one J and one K_T")
    rows = numbers(table, lines, 1, heads, ",")[0][:, [plain.index("J"), plain.index("KT")]]
    found = open_water(*rows[np.isfinite(rows).all(axis=1)].T)
    part = "propeller" if "propeller.k_0" in values(ship.model) else "race"
    changes = {path.replace("propeller", part): value for path, value in found.items()}
    sources = {path: Entry(f"open-water test {table.name}", value) for path, value in changes.items()}
    return replace(ship.having(changes), entries={**ship.entries, **sources})


@dataclass(frozen=True)
class Loading:
    """Propeller and rudder at self-propulsion straight ahead.

    Attributes:
        n_P: revolutions [1/s].
        thrust: over 0.5 rho L d U^2.
        rudder: normal force by rudder angle over 0.5 rho A_R U^2 [1/rad]: grows with the square of the inflow.
    """

    n_P: float
    thrust: float
    rudder: float


@dataclass(frozen=True)
class AnotherScale:
    """A ship at another length, and how propeller and rudder are loaded at either; None without one of each."""

    scaled: Scaled
    before: Loading | None
    after: Loading | None


def scale(
    ship: str | Path | Ship, to_length: float, out: Path | None = None, *, form_factor: float | None = None,
    roughness: float | None = None, density: float | None = None, rudder: str = "proportion",
    friction: bool = True, note: Note = silent,
) -> AnotherScale:  # fmt: skip
    """Scale a ship to another length, with the effects of friction and wake, and write its file.

    Args:
        to_length: L_pp of the new ship [m].
        form_factor, density, rudder: as `form`, `rho` and `rudder` of `ships.scaling.scale`.
        roughness: of the hull of a ship [m].
        friction: False for Froude's law alone.

    Raises:
        RequestError: an output of another kind, a number that cannot be.
        ShipError: a ship that cannot be scaled; nothing is written.
    """
    from ..ships.files import save
    from ..ships.scaling import ROUGHNESS
    from ..ships.scaling import scale as scaled

    check_output(out, (".toml",), "a ship file")
    positive(to_length=to_length, density=density)
    for option, value, most in (("--form-factor", form_factor, 1.0), ("--roughness", roughness, 0.01)):
        if value is not None and not 0.0 <= value <= most:
            raise RequestError(f"{option} is {value:g}; it is from 0 to {most:g}")
    vessel = ship_of(ship)
    made = scaled(vessel, to_length, form=form_factor, k_S=ROUGHNESS if roughness is None else roughness, rho=density,
                  rudder=rudder, effects=friction)  # fmt: skip
    found = AnotherScale(made, _loading(vessel), _loading(made.ship))
    for line in made.cautions:
        note(f"note: {line}")
    if out is not None:
        save(replace(made.ship, name=out.stem), out)
        note(f"wrote {out}")
    return found


def _loading(ship: Ship) -> Loading | None:
    """Propeller and rudder where the ship holds its approach speed."""
    from ..forces import Flow
    from ..simulate.run import approach

    if not hasattr(ship.model, "loads") or "rudder.A_R" not in values(ship.model):
        return None
    U, n_P = approach(ship)
    model: Any = ship.model
    rho, L, d = float(model.body.rho), ship.L_pp, float(model.draught)
    pressure, angle = 0.5 * rho * U * U, 1e-4
    straight, turned = (
        model.loads(Flow(U, 0.0, 0.0, n_P, delta, U, 0.0, rho, L, d), (0.0, 0.0, 0.0)) for delta in (0.0, angle)
    )
    area = float(values(model)["rudder.A_R"])
    return Loading(n_P, straight.T / (pressure * L * d), (turned.F_N - straight.F_N) / (pressure * area * angle))


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
        foreseen: bands of indices before and after them; none unless asked for.
    """

    ship: Ship
    noise: Mapping[str, float]
    plan: Plan
    foreseen: tuple[Foreseen, ...] = ()


def design(
    ship: str | Path | Ship, free: Sequence[str], *, budget: float = 60.0, noise: str | None = None,
    interval: float | None = None, repeats: int = 1, bands: Draws = Draws(), note: Note = silent,
) -> Design:  # fmt: skip
    """Choose manoeuvres that determine the parameters `free` of a ship, by Fisher information.

    Args:
        ship: a name of the library, a ship file or a ship.
        free: patterns of parameter paths, such as ``hull.*``.
        budget, noise, interval, repeats: as the options of `seatrial design`; no noise assumes good sensors.
        bands: of the IMO indices before and after the trials.
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
    if not banded(bands):
        return Design(vessel, deviations, found)
    from .evidence.designed import foreseen

    model = None if isinstance(ship, Ship) else ship
    return Design(vessel, deviations, found, foreseen(vessel, found, bands, model=model, note=note))


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


def imo(
    ship: str | Path | Ship, out: Path | None = None, note: Note = silent, *, bands: Bands = Bands()
) -> ImoTable:
    """Judge a ship by the criteria of IMO MSC.137(76); writes a page where `out` is given.

    Args:
        bands: with these, draws of a fitted ship judge, see `judged.imo_with_bands`; else its numbers.  Of an estimated
            ship that nothing has tuned draws of its sigmas judge always.

    Raises:
        RequestError: an output that is no page, or whose folder does not exist; draws without bands.
        StudyError: bands of a ship without a posterior.
        ShipError: a ship that cannot be read, or has no steady approach.
    """
    from ..report.judging.imo import page
    from ..validate.imo import imo_table

    if banded(bands) or _untuned(ship):
        from .evidence.judged import imo_with_bands

        bands = bands if banded(bands) else ESTIMATED
        return imo_with_bands(_fitted(ship, bands), bands, out=out, note=note)
    check_output(out, PAGES, "the page of the criteria")
    table = imo_table(ship_of(ship))
    _write(out, lambda: page(table), note)
    return table


def requirements(
    ship: str | Path | Ship, scope: str = "collision-avoidance", out: Path | None = None, note: Note = silent, *,
    bands: Draws = Draws(),
) -> Table:  # fmt: skip
    """Judge a ship by Sawada 2024 section 6; writes a page where `out` is given.

    Args:
        bands: with these, draws of a fitted ship judge; else its numbers.

    Raises:
        RequestError: an unknown scope, an output that is no page or whose folder does not exist, draws without bands.
        StudyError: bands of a ship without a posterior.
        ShipError: a ship that cannot be read.
    """
    from ..exchange.equations import equations
    from ..realtime.connection import connection
    from ..report.judging.requirements import page
    from ..validate.requirements.scopes import SCOPES, judge

    if scope not in SCOPES:
        raise RequestError(f"--scope is '{scope}'; known: {', '.join(SCOPES)}")
    check_output(out, PAGES, "the page of the requirements")
    elsewhere = {"3": connection, "4": equations, "N2": equations}
    if banded(bands):
        from .evidence.judged import requirements_with_bands

        found = requirements_with_bands(_fitted(ship, bands), scope, bands, elsewhere, note=note)
    else:
        found = judge(ship_of(ship), scope, elsewhere=elsewhere)
    _write(out, lambda: page(found), note)
    return found


def _untuned(ship: str | Path | Ship) -> bool:
    """Whether it is the file of an estimate that nothing has tuned."""
    from ..belief.reading import stated

    return not isinstance(ship, Ship) and Path(ship).suffix == ".toml" and stated(ship_of(ship)) is not None


def _fitted(ship: str | Path | Ship, bands: Draws) -> str:
    """The file of a fitted ship, whose posterior lies beside it."""
    if isinstance(ship, Ship):
        raise RequestError(f"bands of {bands.level:g} percent are of a fitted ship's file, not of a ship in memory: "
                           "name it")  # fmt: skip
    return str(ship)


def _write(out: Path | None, page: Callable[[], Page], note: Note) -> None:
    if out is not None:
        from ..report.page import write

        note(f"wrote {write(out, page())}")

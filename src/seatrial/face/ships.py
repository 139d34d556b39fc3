"""Ships with verbs: simulate, predict, save."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

from .. import data, ships
from ..core.parameters import walk
from ..manoeuvres import Policy
from ..ships.classes import Trust
from ..ships.files import load as load_ship
from ..ships.writing import save
from ..simulate.replay import replay
from .orders import Order, Weather
from .running import Run, simulate
from .tables import Cell, Table, Tabular, entries
from .trials import Trial, trial_of


@dataclass(frozen=True, eq=False, repr=False)
class Ship(ships.Ship):
    """A model of a ship, its actuators, its approach condition and the sources of its numbers.

    Attributes are those of `seatrial.ships.Ship`.
    """

    def simulate(
        self, what: Order | Policy, *, speed: float | None = None, n_P: float | None = None,
        duration: float | None = None, dt: float | None = None, weather: Weather | None = None,
    ) -> Run:  # fmt: skip
        """Run a manoeuvre such as ``Zigzag(rudder_deg=20, heading_deg=20)``; arguments as of `seatrial.simulate`."""
        return simulate(self, what, speed=speed, n_P=n_P, duration=duration, dt=dt, weather=weather)

    def predict(self, trial: data.Trial, *, restart: float | None = None) -> Trial:
        """Free-running prediction of a trial from its own controls and wind, on its own rows.

        Args:
            restart: seconds after which the state is reset to the measured one; None for one run.

        Raises:
            DataError: a channel is missing, or no row is complete.
            SimulationError: the prediction blows up; names time and state.
        """
        return trial_of(replay(self, trial, restart=restart))

    @property
    def parameters(self) -> Parameters:
        """Every number of the model with its unit, meaning and source."""
        return Parameters(self)

    def save(self, path: str | Path) -> Path:
        """Write a ship file, which `load` reads."""
        return save(self, path)

    def _repr_html_(self) -> str:
        approach = "with the revolutions that hold it" if self.n_P is None else f"{self.n_P:.4g} 1/s"
        said = [("model", type(self.model).__name__), ("L_pp", f"{self.L_pp:.4g} m"),
                ("approach", f"{self.speed:.4g} m/s, {approach}"), ("controls", ", ".join(self.model.controls)),
                ("parameters", str(sum(1 for _ in walk(self.model)))),
                *(("caution", line) for line in self.notes.get("cautions", ()))]  # fmt: skip
        return entries(str(self.notes.get("title", self.name)), said)


@dataclass(frozen=True, repr=False)
class Parameters(Tabular):
    """The numbers of a ship as a table."""

    ship: ships.Ship

    @property
    def table(self) -> Table:
        """Path, value, unit, meaning and source of each number."""
        def row(path: str, value: object, unit: str, about: str) -> tuple[Cell, ...]:
            entry = self.ship.entries.get(path)
            return path, float(str(value)), unit, about, entry.source if entry else ""

        rows = tuple(row(path, value, meaning.unit, meaning.about) for path, meaning, value in walk(self.ship.model))
        head = ("parameter", "value", "unit", "about", "source")
        return Table(f"{self.ship.name}: {len(rows)} parameters", head, rows)


def ship_of(ship: ships.Ship) -> Ship:
    """Any ship as one with verbs."""
    return ship if isinstance(ship, Ship) else Ship(*(getattr(ship, f.name) for f in fields(ships.Ship)))


def load(name_or_path: str | Path, *, trust: Trust = False) -> Ship:
    """Read a ship of the library by name, or a ship file (a saved fit is one) by path.

    Args:
        trust: modules outside the package whose code the file may run by naming their classes; True for any.

    Raises:
        ShipError: no such ship; a key, unit, type or number that cannot be used, in one line.
    """
    return ship_of(load_ship(name_or_path, trust=trust))

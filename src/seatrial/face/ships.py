"""Ships with verbs: simulate, predict, save."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from .. import data, ships
from ..core.errors import MissingError
from ..core.parameters import unknown, values, walk
from ..core.values import dataclass, fields
from ..manoeuvres import Policy
from ..report.blocks import Line, Numbers
from ..ships.classes import Trust
from ..ships.files import load as load_ship
from ..ships.writing import save
from ..simulate.replay import replay
from .orders import Order, Weather
from .running import Run, ran, told, weather_of
from .tables import Cell, Table, Tabular, html, table_of
from .trials import Trial, trial_of

if TYPE_CHECKING:
    from ..exchange import Equations
    from ..models.linear import Linear
    from ..realtime.plant import Plant


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
        return told(ran(self, what, speed, n_P, duration, dt, weather or Weather()))

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
        """The numbers of the model by path; printed, with unit, meaning and source."""
        return Parameters(self)

    def linear(self, speed: float | None = None) -> Linear:
        """The ship linearised on a straight course: ``.transfer_function("r")``, ``.state_space()``, ``.nomoto()``.

        Args:
            speed: through calm water [m/s]; None takes the approach speed.

        Raises:
            ParameterError: no steady straight run at that speed.
        """
        from ..models.linear import straight

        return straight(self.model, self.speed if speed is None else speed)

    def plant(self, *, dt: float, weather: Weather | None = None) -> Plant:
        """The ship with its actuators to be stepped in real time: ``plant.order("delta", 0.1)``, ``plant.step()``.

        Args:
            dt: time step [s].
            weather: wind, current, waves and depth; None is calm, deep water.

        Raises:
            RequestError: weather that the ship has no force for.
            ShipError: a step that is not above zero.
        """
        from ..realtime.plant import Plant

        return Plant.of(self, dt=dt, environment=weather_of(self, weather or Weather()).weather)

    def equations(self, dt: float | None = None) -> Equations:
        """The ship as CasADi functions ``.rates``, ``.step`` and, with a step of `dt` [s], ``.ordered_step``.

        Raises:
            ShipError: a model in discrete time; a step that is not above zero.
        """
        from ..exchange import equations_of

        return equations_of(self, dt)

    def save(self, path: str | Path) -> Path:
        """Write a ship file, which `load` reads."""
        return save(self, path)

    def _repr_html_(self) -> str:
        approach = "with the revolutions that hold it" if self.n_P is None else f"{self.n_P:.4g} 1/s"
        said = [("model", type(self.model).__name__), ("L_pp", f"{self.L_pp:.4g} m"),
                ("approach", f"{self.speed:.4g} m/s, {approach}"), ("controls", ", ".join(self.model.controls)),
                ("parameters", str(len(self.parameters))),
                *(("caution", line) for line in self.notes.get("cautions", ()))]  # fmt: skip
        return html((Line(str(self.notes.get("title", self.name)), "heading"), Numbers(tuple(said))))


@dataclass(frozen=True, repr=False)
class Parameters(Tabular, Mapping[str, float]):
    """The numbers of a ship: ``ship.parameters["hull.Y_v"]``, and all of them as a table."""

    ship: ships.Ship

    def __getitem__(self, path: str) -> float:
        known = values(self.ship.model)
        if path not in known:
            raise MissingError(f"{self.ship.name}: {unknown(path, known)}")
        return float(known[path])

    def __iter__(self) -> Iterator[str]:
        return (path for path, _, _ in walk(self.ship.model))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def table(self) -> Table:
        """Path, value, unit, meaning and source of each number."""

        def row(path: str, value: object, unit: str, about: str) -> tuple[Cell, ...]:
            entry = self.ship.entries.get(path)
            return path, float(str(value)), unit, about, entry.source if entry else ""

        rows = tuple(row(path, value, meaning.unit, meaning.about) for path, meaning, value in walk(self.ship.model))
        head = ("parameter", "value", "unit", "about", "source")
        return table_of(f"{self.ship.name}: {len(rows)} parameters", head, rows)


def ship_of(ship: ships.Ship) -> Ship:
    """Any ship as one with verbs."""
    return ship if isinstance(ship, Ship) else Ship(*(getattr(ship, f.name) for f in fields(ships.Ship)))


def load(name_or_path: str | Path, *, trust: Trust = False) -> Ship:
    """Read a ship of the library by name, or a ship file (a saved fit is one) by path.

    Args:
        trust: modules outside the package whose code the file may run by naming their classes; True for any.

    Raises:
        ShipError: no such ship; a key, unit, type or number that cannot be used, in one line.

    >>> import seatrial as st
    >>> tanker = st.load("kvlcc2")
    >>> tanker.L_pp
    320.0
    >>> run = tanker.simulate(st.Turning(rudder_deg=35))
    >>> float(round(run.indices["tactical_diameter"].over_L, 1))
    3.0
    """
    return ship_of(load_ship(name_or_path, trust=trust))

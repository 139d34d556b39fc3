"""Campaigns from a script: ships, orders in degrees and distributions to a lazy table, one row a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from ..campaign import Campaign, CampaignError, Case, Tracks, usual_chunk
from ..campaign import chunk as chunks
from ..campaign.columns import WHOLE, typed
from ..campaign.designs import Design
from ..campaign.folder import open_folder
from ..campaign.inputs import Input, Kind
from ..campaign.running import run
from ..campaign.schema import ManoeuvreTable
from ..campaign.tables import scan, scan_tracks
from ..core import executors
from ..core.errors import RequestError
from ..core.parameters import unknown
from ..core.values import dataclass, replace
from ..data.units import KNOWN
from ..environment import Uniform
from ..manoeuvres import Manoeuvre
from ..ships import Ship as AnyShip
from ..simulate.approach import approach, time_step
from ..workflow.campaigns.reading import case_of
from ..workflow.request import ship_of
from .orders import Order, Weather
from .running import here, options_of, weather_of
from .tables import Table, Tabular, table_of

if TYPE_CHECKING:
    import polars as pl

_FEW = 5


class Draw:
    """What differs from run to run: ``Draw.uniform(0.9, 1.1, factor=True)``, ``Draw.normal(9, 1, unit="deg")``.

    `unit` is that of the numbers, SI and radians where it is left out; with `factor` they multiply the value of the
    ship or manoeuvre in place of replacing it.
    """

    @staticmethod
    def constant(value: float, *, unit: str | None = None, factor: bool = False) -> Input:
        """The same number in all runs."""
        return _draw("constant", (value,), unit, factor)

    @staticmethod
    def uniform(low: float, high: float, *, unit: str | None = None, factor: bool = False) -> Input:
        """Any number from `low` to `high`, equally likely."""
        return _draw("uniform", (low, high), unit, factor)

    @staticmethod
    def normal(
        mean: float, deviation: float, *, within: tuple[float, float] | None = None, unit: str | None = None,
        factor: bool = False,
    ) -> Input:  # fmt: skip
        """A normal distribution; `within` cuts it off."""
        return _draw("normal", (mean, deviation), unit, factor, within=within)

    @staticmethod
    def lognormal(
        median: float, deviation: float, *, within: tuple[float, float] | None = None, unit: str | None = None,
        factor: bool = False,
    ) -> Input:  # fmt: skip
        """A lognormal distribution; `deviation` is that of the logarithm."""
        return _draw("lognormal", (median, deviation), unit, factor, within=within)

    @staticmethod
    def triangular(low: float, mode: float, high: float, *, unit: str | None = None, factor: bool = False) -> Input:
        """A triangular distribution with its peak at `mode`."""
        return _draw("triangular", (low, mode, high), unit, factor)

    @staticmethod
    def choice(
        values: Sequence[float], weights: Sequence[float] = (), *, unit: str | None = None, factor: bool = False
    ) -> Input:
        """One of some numbers, equally likely unless weighed."""
        return _draw("choice", tuple(values), unit, factor, weights=tuple(weights))

    @staticmethod
    def levels(values: Sequence[float], *, unit: str | None = None, factor: bool = False) -> Input:
        """The levels of a grid."""
        return _draw("values", tuple(values), unit, factor)


def _draw(
    kind: Kind, numbers: tuple[float, ...], unit: str | None, factor: bool, *, weights: tuple[float, ...] = (),
    within: tuple[float, float] | None = None,
) -> Input:  # fmt: skip
    if unit is not None and unit not in KNOWN:
        raise RequestError(f"unit: {unknown(unit, KNOWN, 'unit')}")
    scale = KNOWN[unit][1] if unit is not None else 1.0
    # the second number of a lognormal distribution is of the logarithm
    own = tuple(n if kind == "lognormal" and k == 1 else n * scale for k, n in enumerate(numbers))
    return Input(kind, own, weights, None if within is None else (within[0] * scale, within[1] * scale), factor)


@dataclass(frozen=True, eq=False, repr=False)
class Runs(Tabular):
    """The table of a campaign, computed when its rows are first asked for; SI units and radians.

    Attributes:
        plan: what is computed; see `seatrial.campaign`.
        folder: where its parts are, once `run` has been told; None: in memory.
    """

    plan: Campaign
    folder: str | Path | None = None

    def run(self, folder: str | Path | None = None, *, threads: int | None = None) -> Runs:
        """Compute all runs now, in threads: into a folder, where a killed run goes on, or into memory.

        Args:
            folder: or the URL of an object store, ``s3://BUCKET/NAME``.

        Raises:
            CampaignError: a folder of another campaign, or one too large for the disk.
            OSError: a part cannot be written; the others stay.
        """
        if folder is None:
            _ = self._both
            return self
        with executors.threads(threads) as pool:
            run(self.plan, folder, pool=pool)
        return replace(self, folder=folder)

    def lazy(self) -> pl.LazyFrame:
        """The table as a lazy frame of Polars; of a folder, only what a query needs is read."""
        return self._both[0].lazy() if self.folder is None else scan(open_folder(self.folder))

    def tracks(self) -> pl.LazyFrame:
        """The samples that were kept of every run as a lazy frame: run, t and the chosen columns, run by run.

        ``runs.tracks().filter(pl.col("run") == 12).collect()`` is one run; of a folder little more than that is read.

        Raises:
            CampaignError: the campaign keeps none.
        """
        if self.plan.tracks is None:
            raise CampaignError(f"{self.plan.name}: keeps no tracks; campaign(..., tracks=10) keeps every tenth sample")
        return self._both[1].lazy() if self.folder is None else scan_tracks(open_folder(self.folder))

    def to_frame(self) -> pl.DataFrame:
        """The table as a data frame of Polars; any other library reads it by the Arrow interface."""
        return self.lazy().collect()

    def __len__(self) -> int:
        return self.plan.rows

    @property
    def table(self) -> Table:
        """Least, median and largest value of each column; computes the runs."""
        import polars as pl

        found = self.to_frame().drop(WHOLE).cast(pl.Float64)
        rows = tuple((name, *(_number(how(found[name])) for how in (_least, _middle, _most)), found[name].count())
                     for name in found.columns)  # fmt: skip
        of = ", ".join(case.name for case in self.plan.cases[:_FEW])
        title = f"{self.plan.name}: {self.plan.rows} runs of {of}{' ...' * (len(self.plan.cases) > _FEW)}"
        return table_of(title, ("column", "least", "median", "largest", "runs"), rows)

    def __repr__(self) -> str:
        where = "in memory" if self.folder is None else f"in {self.folder}"
        cases = len(self.plan.cases)
        return f"{type(self).__name__}({self.plan.name!r}, {cases} cases, {self.plan.rows} runs, {where})"

    @cached_property
    def _both(self) -> tuple[pl.DataFrame, pl.DataFrame]:
        """The table, and the tracks."""
        import polars as pl

        with executors.threads() as pool:
            parts = list(pool.ordered(chunks.compute, ((self.plan, number) for number in range(self.plan.parts))))
        tracks = pl.concat([pl.DataFrame(dict(part.tracks)) for part in parts])
        return pl.concat([typed(part.columns, self.plan) for part in parts]), tracks


def _least(column: Any) -> Any:
    return column.min()


def _middle(column: Any) -> Any:
    return column.median()


def _most(column: Any) -> Any:
    return column.max()


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def campaign(
    ships: str | Path | AnyShip | Sequence[str | Path | AnyShip], what: Order | Manoeuvre | Sequence[Order | Manoeuvre],
    *, runs: int, inputs: Mapping[str, Input] | None = None, seed: int = 1, design: Design = "random",
    weather: Weather | None = None, speed: float | None = None, n_P: float | None = None,
    duration: float | None = None, dt: float | None = None, method: str = "rk4", balanced: bool = False,
    whole: bool = False, tracks: int | Tracks | None = None, title: str = "campaign",
) -> Runs:  # fmt: skip
    """Many runs of manoeuvres, each a function of the campaign and of its own number; docs/campaigns.md.

    Args:
        ships: names of the library, ship files or ships; one or several.
        what: an order in degrees such as ``Zigzag(rudder_deg=20, heading_deg=20)``, or a manoeuvre of
            `seatrial.manoeuvres` in radians, which needs a duration; one or several.
        runs: of each ship in each manoeuvre.
        inputs: what differs, by name: "ship.hull.N_r", "rudder.rate", "policy.delta", "U_T", "depth", "u", ...
        seed, design: of the points: "random", "sobol", "latin-hypercube", "saltelli" or "grid".
        weather: around all runs, where no input replaces it; gusts have a seed of their own in each.
        speed, n_P, duration, dt: as of `simulate`.
        method: "rk4" or "euler".
        balanced: whether each run starts with the revolutions that hold its speed.
        whole: whether runs are stored and read as a whole, for the indices that no tally has.
        tracks: keep every so many samples of each run, or which of their columns too: ``Tracks(10, ("x", "y"))``.

    Returns:
        The table, lazy: the campaign is checked, and nothing is computed before its rows are asked for.

    Raises:
        RequestError, ShipError, CampaignError: what cannot be run.
    """
    fleet = [ship_of(one) for one in ([ships] if isinstance(ships, str | Path | AnyShip) else ships)]
    orders = [what] if isinstance(what, Order | Manoeuvre) else list(what)
    if not fleet or not orders:
        raise CampaignError(f"{title}: give one ship and one manoeuvre at least")
    given, around = dict(inputs or {}), weather or Weather()
    places = [weather_of(ship, replace(around, gusts=None)) for ship in fleet]
    steady = cast("Uniform", places[0].weather)  # without gusts it is steady
    if around.gusts is not None and not (around.wind or "U_T" in given):
        raise CampaignError(f"{title}: gusts need a mean wind to blow about; give weather.wind or the input U_T")
    settings: dict[str, Any] = {"speed": speed, "rps": n_P, "duration": duration, "dt": dt, "method": method,
                                "indices": "all" if whole else "tally"}  # fmt: skip
    cases = tuple(_case(ship, one, len(fleet) > 1, len(orders) > 1, steady, settings)
                  for ship in fleet for one in orders)  # fmt: skip
    kept = Tracks(tracks) if isinstance(tracks, int) else tracks
    plan = Campaign(title, cases, runs, given, design=design, seed=seed, weather=steady, gusts=around.gusts,
                    balanced=balanced, chunk=usual_chunk(cases, kept), tracks=kept)  # fmt: skip
    chunks.check(plan)
    return Runs(plan)


def _case(
    ship: AnyShip, what: Order | Manoeuvre, ships: bool, orders: bool, around: Uniform, settings: Mapping[str, Any]
) -> Case:
    if isinstance(what, Order):
        try:
            return case_of(ship, ManoeuvreTable(kind=what.kind, **options_of(what), **settings), ships, orders, around)
        except RequestError as error:
            raise RequestError(here(str(error))) from None
    if settings["duration"] is None:
        raise RequestError(f"{type(what).__name__}: a manoeuvre given in radians needs a duration [s]")
    speed = 0.0 if what.from_rest else approach(ship, settings["speed"], None)[0]
    name = " ".join(([ship.name] if ships or not orders else []) + ([what.kind] if orders else []))
    return Case(name, ship, what, speed, settings["duration"], settings["dt"] or time_step(ship), settings["method"],
                settings["indices"] == "all")  # fmt: skip

"""One part of a campaign as a table: inputs, indices and verdicts, a row a run.

Where the manoeuvre has a tally and the weather is steady or a gust, the runs leave the compiled loop as one row each,
and the samples of their tracks; else they are stored as a whole and read by `Manoeuvre.indices`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..core.parameters import ParameterError, possible
from ..core.values import dataclass, field
from ..data import Array, Trial
from ..environment import CHANNELS, Uniform
from ..environment.weather import Gust
from ..manoeuvres import Manoeuvre
from ..models import STATES
from ..simulate.lanes import check_varied, steered
from ..simulate.loop import loop_values
from . import Campaign, CampaignError, Case
from .columns import meanings
from .designs import points, uniform
from .reading import figures, sailed, usual_units, whole_indices
from .revolutions import balanced
from .tallies import tally_of
from .tracks import Column, Tracks, counts, sail, table

WEATHER = tuple(vars(Uniform()))
"""Inputs of the weather, by the names of `Uniform`."""

_WIND = 8_000_000
"""Gusts are a series a run: runs are made in groups of so many numbers, 64 MB."""

_LOOKED = 10_000_000
"""Numbers of endless distributions that are looked at before anything is computed: a second."""

_SEEDS = 7
"""Stream of the seeds of gusts, apart from that of the points."""


@dataclass(frozen=True)
class Part:
    """Columns of a part of a campaign, each of shape (runs,).

    Attributes:
        case: its number.
        first: number of its first run within the case.
        columns: by name, in the order of the table.
        tracks: kept samples by column, shape (samples of all runs,); empty where none are kept.
    """

    case: int
    first: int
    columns: Mapping[str, Array]
    tracks: Mapping[str, Column] = field(default_factory=dict[str, Column])


def drawn(campaign: Campaign, case: int, first: int, last: int, cube: Array | None = None) -> dict[str, Array]:
    """Inputs of runs `first` to `last` (not included) of a case, each of shape (runs,).

    Args:
        cube: points of the unit cube in place of those of the design, shape (runs, dims).

    Raises:
        CampaignError: a draw that is impossible, such as a negative mass, with its run.
    """
    if cube is None:
        cube = points(campaign.design, campaign.seed, campaign.dims, campaign.runs, first, last, campaign.levels)
    usual = _usual(campaign, campaign.cases[case])
    out: dict[str, Array] = {}
    for name, one in campaign.inputs.items():
        share = cube[:, campaign.varied.index(name)] if one.varies else np.full(last - first, 0.5)
        out[name] = one.of(share) * (usual[name] if one.factor else 1.0)
    if campaign.correlated is not None:
        joint = campaign.correlated.of(cube[:, len(campaign.varied) :])
        out |= dict(zip(campaign.correlated.names, joint.T, strict=True))
    _check_drawn(campaign, case, first, out)
    return out


def _usual(campaign: Campaign, case: Case) -> dict[str, float]:
    """What each input is where it does not vary."""
    start = dict(zip(STATES, (0.0, 0.0, 0.0, case.speed, 0.0, 0.0), strict=True))
    return {**vars(campaign.weather), **start, **loop_values(case.ship, case.manoeuvre)}


def _check_drawn(campaign: Campaign, case: int, first: int, columns: Mapping[str, Array]) -> None:
    known = meanings(campaign.cases[case])
    for name, column in columns.items():
        for run in (int(np.argmin(column)), int(np.argmax(column))):
            try:
                possible(known, {name: float(column[run])})
            except ParameterError as error:
                raise CampaignError(f"{campaign.name}: run {first + run}: {error}; cut its distribution off by "
                                    "within = [low, high]") from None  # fmt: skip


def check(campaign: Campaign) -> None:
    """Refuse inputs that a case does not have, and numbers that are impossible, before anything is computed.

    Raises:
        CampaignError: the input and the case.
    """
    names = [*campaign.inputs, *(campaign.correlated.names if campaign.correlated else ())]
    double = {name for name in names if names.count(name) > 1}
    if double:
        raise CampaignError(f"{campaign.name}: {', '.join(sorted(double))}: is an input twice")
    for number, case in enumerate(campaign.cases):
        try:
            check_varied(case.ship, case.manoeuvre, (n for n in names if n not in WEATHER and n not in STATES))
        except ValueError as error:
            raise CampaignError(f"{campaign.name}: {case.name}: {error}") from None
        endless = _check_ends(campaign, case) or campaign.correlated is not None
        last = min(campaign.runs, _LOOKED // max(campaign.dims, 1)) if endless else min(campaign.runs, campaign.chunk)
        for first in range(0, last, campaign.chunk):
            drawn(campaign, number, first, min(first + campaign.chunk, last))


def _check_ends(campaign: Campaign, case: Case) -> bool:
    """Refuse distributions that end beyond what their input can be; whether one goes on without an end."""
    known, usual, endless = meanings(case), _usual(campaign, case), False
    for name, one in campaign.inputs.items():
        for end in one.ends:
            endless |= math.isinf(end)
            try:
                possible(known, {name: end * (usual[name] if one.factor else 1.0)} if math.isfinite(end) else {})
            except ParameterError as error:
                said = f"{one.kind} {list(one.numbers)}"
                raise CampaignError(f"{campaign.name}: inputs.{name}: {said}: {error}") from None
    return endless


@dataclass(frozen=True)
class Runs:
    """Consecutive runs of a case, ready to be run.

    Attributes:
        columns: inputs by name, each of shape (runs,).
        vary: those of them that are parameters of the closed loop.
        start: initial states over ground, shape (runs or 1, 6).
        around: weather, shape (runs or 1, steps or 1, 8).
        lanes: number of runs.
    """

    case: Case
    columns: Mapping[str, Array]
    vary: Mapping[str, Array]
    start: Array
    around: Array
    lanes: int

    @property
    def steps(self) -> int:
        """Samples of each run."""
        return self.case.samples


def ready(campaign: Campaign, at: int, first: int, last: int, cube: Array | None = None) -> Runs:
    """Runs `first` to `last` (not included) of case number `at`; `cube` as of `drawn`."""
    case, columns, lanes = campaign.cases[at], drawn(campaign, at, first, last, cube), last - first
    around = _around(campaign, case, columns, first, lanes)
    vary = {name: v for name, v in columns.items() if name not in WEATHER and name not in STATES}
    if campaign.balanced:
        speed = columns.get("u", np.full(lanes, case.speed))
        vary["policy.n_P"] = columns["policy.n_P"] = balanced(case.ship, vary, speed)
        if (lost := np.flatnonzero(np.isnan(vary["policy.n_P"]))).size:
            told = f"{speed[lost[0]]:g} m/s (run {first + lost[0]} of the case)"
            raise CampaignError(f"{case.ship.name}: no revolutions hold {told}")
    return Runs(case, columns, vary, _start(case, columns, around[:, 0]), around, lanes)


def sailed_at(campaign: Campaign, at: int, cube: Array, threads: int = 1) -> dict[str, Array]:
    """Inputs and indices of case number `at` at points of the unit cube, shape (runs, dims); without gusts."""
    runs = ready(campaign, at, 0, len(cube), cube)
    return {**runs.columns, **_sailed(runs, campaign.weather, threads, None)[0]}


def compute(campaign: Campaign, number: int, threads: int = 1) -> Part:
    """Compute one part; the same numbers whatever the threads."""
    at, first, last = campaign.part(number)
    group = last - first if campaign.gusts is None else max(_WIND // (campaign.cases[at].samples * len(CHANNELS)), 1)
    found: list[dict[str, Array]] = []
    tracks: list[dict[str, Column]] = []
    for low in range(first, last, group):
        runs = ready(campaign, at, low, min(low + group, last))
        figures, kept = _sailed(runs, campaign.weather, threads, campaign.tracks)
        found.append({**runs.columns, **figures})
        if campaign.tracks is not None:
            numbers = np.arange(low, low + runs.lanes) + at * campaign.runs
            case, every = runs.case, campaign.tracks.every
            own = counts(figures["failed"], case.samples, case.dt, every)
            tracks.append(table(kept, numbers, own, every, case.dt))
    columns = _joined(found)
    numbers = np.arange(first, last, dtype=np.float64) + at * campaign.runs
    rows = {"run": numbers, "case": np.full(last - first, float(at)), **columns}
    for name, bound in campaign.criteria.items():
        value = columns[bound.index]
        rows[f"{name}_met"] = np.where(np.isfinite(value), (value >= bound.low) & (value <= bound.high), np.nan)
    return Part(at, first, rows, _joined(tracks) if tracks else {})


def _joined(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    return dict(parts[0]) if len(parts) == 1 else {n: np.concatenate([one[n] for one in parts]) for n in parts[0]}


def _around(campaign: Campaign, case: Case, columns: Mapping[str, Array], first: int, lanes: int) -> Array:
    """Weather per run and step, shape (runs or 1, steps or 1, 8)."""
    steps = case.samples
    here = {name: columns.get(name, value) for name, value in vars(campaign.weather).items()}
    if campaign.gusts is None and not any(name in columns for name in WEATHER):
        return campaign.weather.series(case.dt, steps)[None]
    if campaign.gusts is None:
        wind, current, waves = (components_of(here[size], here[angle]) for size, angle in
                                (("U_T", "gamma_T"), ("U_C", "gamma_C"), ("H_S", "gamma_W")))  # fmt: skip
        held = np.broadcast_arrays(*wind, *current, *waves, here["T_W"], 1.0 / np.asarray(here["depth"]))
        return np.column_stack([np.atleast_1d(one) for one in held])[:, None, :].astype(np.float64)
    return np.stack(list(_gusts(campaign, case, here, first, lanes)))


def components_of(size: Any, angle: Any) -> tuple[Any, Any]:
    """(north, east) components over arrays."""
    return size * np.cos(angle), size * np.sin(angle)


def _gusts(campaign: Campaign, case: Case, here: Mapping[str, Any], first: int, lanes: int) -> Iterator[Array]:
    """The wind of each run, with a seed that is a function of the campaign's seed and the run's number."""
    seeds = (uniform(campaign.seed, 1, first, first + lanes, _SEEDS)[:, 0] * 2.0**53).astype(np.int64)
    for lane in range(lanes):
        own = Uniform(**{name: float(v if np.ndim(v) == 0 else v[lane]) for name, v in here.items()})
        yield Gust(own, campaign.gusts or "", int(seeds[lane])).series(case.dt, case.samples)


def _start(case: Case, columns: Mapping[str, Array], around: Array) -> Array:
    """Initial x, y, psi, u, v_m, r over ground, shape (runs or 1, 6): through the water, plus the current."""
    usual = (0.0, 0.0, 0.0, case.speed, 0.0, 0.0)
    north, east = around[:, CHANNELS.index("current_x")], around[:, CHANNELS.index("current_y")]
    given = [np.atleast_1d(columns.get(name, value)) for name, value in zip(STATES, usual, strict=True)]
    x, y, psi, u, v_m, r, north, east = np.broadcast_arrays(*given, north, east)
    c, s = np.cos(psi), np.sin(psi)
    return np.column_stack([x, y, psi, u + north * c + east * s, v_m + east * c - north * s, r])


def _sailed(
    runs: Runs, usual: Uniform, threads: int, tracks: Tracks | None
) -> tuple[dict[str, Array], dict[str, Column]]:
    """Indices of the runs, with `failed` [s], NaN for a run that did not, and `complete` (0 or 1); their tracks."""
    case, vary, around, steps = runs.case, runs.vary, runs.around, runs.steps
    north, east = (around[:, 0, CHANNELS.index(name)] for name in ("current_x", "current_y"))
    flowing = bool(north.any() or east.any())
    tally = None if case.stored else tally_of(case.manoeuvre, case.dt, case.ship.validity, flowing)
    if tally is None:
        names = tuple(usual_units(case, usual.series(case.dt, steps)[None], steps))
        return whole_indices(case, names, vary, runs.start, around, runs.lanes, steps, threads, tracks)
    flow = {"policy.current_x": north, "policy.current_y": east}
    more = {name: np.broadcast_to(one, runs.lanes) for name, one in flow.items()}
    loop = steered(case.ship, tally, case.dt, {**vary, **(more if flowing else {})}, runs.start, around, runs.lanes,
                   case.device, case.precision)  # fmt: skip
    names = tracks.names(case.ship, case.manoeuvre) if tracks else ()
    rows, kept = sail(loop, case.dt, steps, case.method, threads, tracks, names, away=case.device != "cpu")
    return figures(tally, loop.kernel.system.stored, rows, vary), kept


def replay(campaign: Campaign, run: int, cube: Array | None = None) -> tuple[Runs, Manoeuvre, Trial]:
    """One run of a campaign as a trial, with its inputs and the manoeuvre as it was ordered.

    Args:
        run: its number in the table.
        cube: point of the unit cube in place of that of the design, shape (1, dims).

    Raises:
        CampaignError: no run of this number.
    """
    if not 0 <= run < campaign.rows:
        raise CampaignError(f"{campaign.name}: no run {run}; runs go from 0 to {campaign.rows - 1}")
    case, place = divmod(run, campaign.runs)
    one = ready(campaign, case, place, place + 1, cube)
    policy, trial, _ = next(sailed(one.case, one.vary, one.start, one.around, 1, one.steps, 1))
    return one, policy, trial

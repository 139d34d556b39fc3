"""Bands of a manoeuvre: its indices and tracks for many draws of the parameters of a ship.

Every draw is the same ship with other numbers, in one compiled loop.  The bands count what the data of a fit leave open
about its parameters and nothing else: no error of the form of the model, no weather, no error of measurement.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...campaign import Case
from ...campaign.reading import figures, sailed
from ...campaign.revolutions import balanced
from ...campaign.tallies import Tally, tally_of
from ...core.executors import processors
from ...core.parameters import values
from ...core.values import dataclass
from ...data import Array, DataError, Trial
from ...environment import CHANNELS, Weather
from ...manoeuvres import Manoeuvre
from ...models import STATES, Sampled, Stepped
from ...ships import Ship
from ...ships.felt import driven
from ...simulate.approach import substeps
from ...simulate.lanes import Steps, run, steered

# So many rows of each track are kept at most; fewer, down to the least, where all runs would take more than 130 MB.
_ROWS, _FEWEST, _KEPT = 601, 61, 16_000_000
# Steps of a manoeuvre without memory are so many times as long, where the integrator allows.
_LONGER = (20, 10, 5, 2)
# Runs are sailed in groups of so many stored numbers, 64 MB.
_STORED = 8_000_000
# A run of fewer samples has no indices.
_LEAST = 3
STANDING = 0.5
"""Share of the draws that must not fail for the others to have a band."""


@dataclass(frozen=True)
class Bands:
    """Runs of a manoeuvre, one a draw.

    Attributes:
        t: times of the tracks [s], shape (rows,).
        tracks: x, y, psi, u, v_m, r of each run, shape (draws, rows, 6); NaN after a run failed.
        indices: of each run by name, shape (draws,), SI units; NaN where a run did not reach one.
        failed: when each run left the ship's validity or blew up [s], shape (draws,); NaN where it did not.
    """

    t: Array
    tracks: Array
    indices: Mapping[str, Array]
    failed: Array

    def edges(self, name: str, level: float) -> tuple[float, float]:
        """Lower and upper edge of an index at a level of 0 to 1; NaN where too many runs did not reach it.

        A run that failed before it is of a ship that there is not, and the others have the band; that of fewer than
        half of all would be one of the law of the draws, and not of the trials.
        """
        found = self.indices.get(name, np.full(len(self.failed), np.nan))
        reached = found[np.isfinite(found)]
        missed = np.isnan(found) & np.isnan(self.failed)
        if len(reached) < max(level * (len(reached) + int(missed.sum())), STANDING * len(found)):
            return float("nan"), float("nan")
        low, high = np.quantile(reached, sides(level))
        return float(low), float(high)

    def band(self, state: str, level: float) -> tuple[Array, Array]:
        """Lower and upper edge of a state at each time, over the runs that have come so far, shape (rows,) each."""
        columns = self.tracks[:, :, STATES.index(state)]
        here = np.isfinite(columns).any(axis=0)
        found = np.full((2, len(self.t)), np.nan)
        found[:, here] = np.nanquantile(columns[:, here], sides(level), axis=0)
        return found[0], found[1]


def sides(level: float) -> tuple[float, float]:
    """Shares of the draws below the two edges of a band."""
    return 0.5 * (1.0 - level), 0.5 * (1.0 + level)


def bands(
    ship: Ship, policy: Manoeuvre, names: Sequence[str], draws: Array, *, speed: float, duration: float, dt: float,
    weather: Weather, held: bool = True, threads: int = 0,
) -> Bands:  # fmt: skip
    """Sail a manoeuvre with every draw.

    Args:
        names: paths of the parameters that differ.
        draws: their values, shape (draws, names).
        speed: initial speed ahead through the water [m/s]; also what the revolutions hold.
        duration, dt: length and time step of each run [s].
        held: whether each draw starts with the revolutions that hold its speed; else all have those of `policy`.
        threads: of the processor; 0 takes all of them.

    A draw whose speed no revolutions hold fails at once.
    """
    step, threads = step_of(ship, policy, dt), threads or processors()
    around = weather.series(step, round(duration / step) + 1)[None]
    vary = {f"ship.{name}": column for name, column in zip(names, draws.T, strict=True)}
    if held and balances(ship, policy):
        vary["policy.n_P"] = balanced(ship, vary, np.full(len(draws), speed))
    case = Case("bands", ship, policy, 0.0 if policy.from_rest else speed, duration, step)
    north, east = (around[0, 0, CHANNELS.index(name)] for name in ("current_x", "current_y"))
    start = np.array([[0.0, 0.0, 0.0, case.speed + north, east, 0.0]])
    flowing = bool(north or east) or around.shape[1] > 1
    tally = None if flowing or case.stored else tally_of(policy, step, ship.validity, False)
    if tally is not None:
        return _tallied(case, tally, vary, start, around, len(draws), threads)
    return _whole(case, vary, start, around, len(draws), threads)


def straightened(made: Bands, count: int, wider: float = 1.0) -> Bands:
    """Of runs by a centre, draws about it and their mirror images: what runs would be that depend on a draw by slopes.

    A covariance by Gauss and Newton is that of a fit whose predictions are straight in the parameters.  Trials fix bent
    ridges, which its draws leave to one side, to ships that no trial allows; so predictions are as straight as the
    covariance takes them for (Immer, Korzepa and Bauer 2021).  Half the difference of a pair has no even term.

    Args:
        count: of the runs that are kept.
        wider: how many times as far from the centre as the draws they are.
    """
    half = (len(made.failed) - 1) // 2

    def straight(values: Array) -> Array:
        odd = 0.5 * wider * (values[1 : half + 1] - values[half + 1 :])
        return values[0] + np.concatenate([odd, -odd])[:count]

    indices = {name: straight(found) if np.any(found < 0.0) else np.maximum(straight(found), 0.0)
               for name, found in made.indices.items()}  # fmt: skip
    failed = np.fmin(made.failed[1 : half + 1], made.failed[half + 1 :])
    return Bands(made.t, straight(made.tracks), indices, np.fmin(np.tile(failed, 2)[:count], made.failed[0]))


def step_of(ship: Ship, policy: Manoeuvre, dt: float) -> float:
    """Time step of the runs [s]: that of a single one, or longer where nothing is decided at the steps.

    Without memory a manoeuvre switches nothing, and only the error of the integrator counts, as between the rows of a
    log (`approach.substeps`); a zigzag needs the short steps for the instant of its reversals.
    """
    if policy.memory or isinstance(ship.model, Sampled | Stepped):
        return dt
    return next((many * dt for many in _LONGER if substeps(ship, many * dt) == 1), dt)


def _tallied(
    case: Case, tally: Tally, vary: Mapping[str, Array], start: Array, around: Array, lanes: int, threads: int
) -> Bands:  # fmt: skip
    """One kernel for all runs: every so many rows of them, and the indices from their last.

    What a tally leaves out, means over the end of a run, is read from the rows that are kept.
    """
    steps = round(case.duration / case.dt) + 1
    loop = steered(case.ship, tally, case.dt, vary, start, around, lanes)
    stored = loop.kernel.system.stored
    every = -(-steps // min(_ROWS, max(_KEPT // (lanes * len(stored)), _FEWEST)))
    rows = run(loop, Steps(case.dt, every * -(-steps // every) + 1, every, case.method), None, threads).values
    found = figures(tally, stored, rows[:, -1], vary)
    t, failed = case.dt * every * np.arange(rows.shape[1] - 1), found.pop("failed")
    found.pop("complete")
    ends = np.where(np.isnan(failed), np.inf, failed)
    tracks = np.where((t >= ends[:, None])[:, :, None], np.nan, rows[:, :-1, : len(STATES)])
    kept = rows[:, :-1, [stored.index(name) for name in (*STATES, *case.ship.model.controls)]]
    more = [_lacking(case, tally, t[t < end], one) for one, end in zip(kept, ends.tolist(), strict=True)]
    return Bands(t, tracks, {**found, **_columns(more)}, failed)


def _lacking(case: Case, tally: Tally, t: Array, rows: Array) -> dict[str, float]:
    """Indices of one run that its tally leaves out, from stored rows of states and controls."""
    names = (*STATES, *case.ship.model.controls)
    if case.manoeuvre.memory:
        return {}
    trial = Trial("run", t, {name: rows[: len(t), k] for k, name in enumerate(names)})
    found = read(case.manoeuvre, trial, case.ship.L_pp)
    return {name: value for name, value in found.items() if name not in tally.figures}


def _columns(found: Sequence[Mapping[str, float]]) -> dict[str, Array]:
    """Indices of many runs by name; NaN where one did not reach it."""
    names = dict.fromkeys(name for one in found for name in one)
    return {name: np.array([one.get(name, np.nan) for one in found]) for name in names}


def _whole(
    case: Case, vary: Mapping[str, Array], start: Array, around: Array, lanes: int, threads: int
) -> Bands:  # fmt: skip
    """Runs of a manoeuvre without a tally, each read as a whole."""
    steps = round(case.duration / case.dt) + 1
    t = np.linspace(0.0, (steps - 1) * case.dt, min(_ROWS, steps))
    tracks, over = np.full((lanes, len(t), len(STATES)), np.nan), np.full(lanes, np.nan)
    found: list[dict[str, float]] = []
    group = max(_STORED // (steps * (len(case.ship.model.controls) * 4 + 16)), 1)
    for low in range(0, lanes, group):
        own = {name: column[low : low + group] for name, column in vary.items()}
        runs = sailed(case, own, start, around, min(group, lanes - low), steps, threads)
        for lane, (policy, trial, failed) in enumerate(runs, low):
            over[lane] = failed
            _keep(t, tracks[lane], trial)
            found.append(read(policy, trial, case.ship.L_pp))
    return Bands(t, tracks, _columns(found), over)


def balances(ship: Ship, policy: Manoeuvre) -> bool:
    """Whether revolutions hold the speed of the approach, and can be found for each draw."""
    whole = not isinstance(ship.model, Sampled) and ship.model.states == ship.model.motion
    orders = any(order == "n_P" for order, _ in ship.model.follows)
    return whole and orders and driven(ship) and not policy.from_rest and "n_P" in values(policy)


def _keep(t: Array, track: Array, trial: Trial) -> None:
    """Put the track of a run at the times `t`, up to where it failed."""
    here = t <= trial.t[-1] * (1.0 + 1e-9) if len(trial) else np.zeros(len(t), dtype=np.bool_)
    for k, name in enumerate(STATES):
        track[here, k] = np.interp(t[here], trial.t, trial[name])


def read(policy: Manoeuvre, trial: Trial, L_pp: float) -> dict[str, float]:
    """Indices of one run by name, SI units; none of a run that is over before it began."""
    if len(trial) < _LEAST:
        return {}
    try:
        return {name: index.value for name, index in policy.indices(trial, L_pp).items()}
    except DataError:
        return {}

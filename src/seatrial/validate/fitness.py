"""Fitness of a model for a use: errors of its predictions against the errors that the use accepts, with intervals.

Sawada 2024 section 5: the accuracy that is required depends on the use, and is an error of the motion between
simulation and ship.  Which errors, and how large, is declared beside the purposes (`choosing/purposes.toml`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ..core.constants import GRAVITY
from ..core.once import by_identity
from ..core.values import dataclass
from ..data import Array, DataError, Trial, unwrapped
from ..engine import SimulationError
from ..identify.noise import sensor_noise
from ..manoeuvres.reading import path_length, rudder_channel, through_water
from ..ships import Ship
from ..simulate.replay import predicted, replay
from .comparison import manoeuvre
from .metrics import heading, segments

FIT, NOT_FIT, OPEN = "fit", "not fit", "cannot tell"
FEWEST = 5
"""Fewest trials that confirm: of fewer, a bootstrap over trials has no tail.  Refuting needs no such number."""
SIZE = 1.64
"""Times the root mean square error: nine of ten errors are smaller, where they are normal."""
_LEVEL, _DRAWS, _SEED = 0.95, 2000, 20241005
# Spread of a draw of equal trials, which has none.
_EQUAL = 1e-3
# Greatest width of the interval over Student's.
_WIDEST = 2.0
# A window counts if it reaches over this share of the horizon.
_WHOLE = 0.9
# Froude number below which a ship is at low speed (Wakita 2022 and Sawada 2024 Table 1 take it as that of berthing).
_SLOW = 0.05
# What counts as motion at low speed [L, rad], as a turn [rad], as a large rudder angle [rad], as reversed [share].
_MOVED, _SWUNG, _TURN, _LARGE, _ASTERN = 0.05, math.radians(5.0), math.radians(10.0), math.radians(20.0), 0.3
# An engine is stopped below this share of its greatest revolutions; a ship, below this share of its speed at the order.
_IDLE, _STOPPED = 0.1, 0.2
# The heading has come back from a peak by so much [rad].
_BACK = math.radians(1.0)
_SHAFTS = ("n_P_cmd", "n_P", "n_P_1_cmd", "n_P_1")

Windows = list[slice]


@dataclass(frozen=True)
class Limit:
    """An error that a use accepts.

    Attributes:
        key, about: short name, and what is judged in words.
        of: "position", "heading", "speed" or "turn" at the end of a window; "stopping"; "overshoot"; or a manoeuvre
            index such as "advance".
        when: which windows show it, a name of `CONDITIONS`; not used where `of` is no window.
        horizon: length of a window, in L_pp over the approach speed.
        size, unit: greatest accepted error: "m" at full scale (over the scale of the trial), "L" ship lengths, "deg",
            "U" approach speeds, or "share" of what was measured.
        source: where the figure comes from.
        must: whether trials without it are refused.
    """

    key: str
    about: str
    of: str
    size: float
    unit: str
    source: str
    when: str = ""
    horizon: float = 0.0
    must: bool = False


@dataclass(frozen=True)
class Found:
    """A limit and the errors found, in the unit of the limit.

    Attributes:
        errors: by trial; infinite where the prediction failed.
        value, low, high: `SIZE` times the root mean square error, and its 95 % interval; NaN where it has none.
        verdict, reason: one of `FIT`, `NOT_FIT`, `OPEN`, and why.
    """

    limit: Limit
    errors: Mapping[str, tuple[float, ...]]
    value: float
    low: float
    high: float
    verdict: str
    reason: str


@dataclass(frozen=True)
class Fitness:
    """Verdicts on all limits of a purpose.

    Attributes:
        purpose, title: in a word and in words.
        unit_time: L_pp over the approach speed, in which horizons count [s].
        left_out: trials that the model was fitted to.
    """

    purpose: str
    title: str
    found: tuple[Found, ...]
    unit_time: float
    left_out: tuple[str, ...] = ()

    @property
    def verdict(self) -> str:
        """Not fit where one limit is exceeded, fit where all are kept, else it cannot be told."""
        verdicts = {one.verdict for one in self.found}
        return NOT_FIT if NOT_FIT in verdicts else OPEN if OPEN in verdicts else FIT


def judge(
    ship: Ship, trials: Sequence[Trial], limits: Sequence[Limit], *, purpose: str = "", title: str = "",
    trained_on: Sequence[str] = (), smooth_start: float | None = None,
) -> Fitness:  # fmt: skip
    """Errors of a ship's model on trials against the limits of a use.

    Args:
        ship: the model.
        trials: trials of that use; those in `trained_on` are left out.
        limits: what the use accepts.
        purpose, title: the use, in a word and in words.
        smooth_start: seconds of readings from which each initial state is estimated; None takes the reading.
    """
    unseen = [trial for trial in trials if trial.name not in trained_on]
    found: list[Found] = []
    for limit in limits:
        pool = {trial.name: _errors(limit, ship, trial, smooth_start) for trial in unseen if shows(limit, ship, trial)}
        floor = max((_noise(limit, ship, trial) for trial in unseen if trial.name in pool), default=0.0)
        found.append(verdict(limit, {name: some for name, some in pool.items() if some}, floor))
    left_out = tuple(trial.name for trial in trials if trial not in unseen)
    return Fitness(purpose, title, tuple(found), ship.L_pp / ship.speed, left_out)


def shows(limit: Limit, ship: Ship, trial: Trial) -> bool:
    """Whether a trial shows what a limit is about; nothing is predicted for it."""
    if limit.of == "stopping":
        return bool(brakes(ship, trial))
    if limit.horizon:
        return bool(_windows(limit, ship, trial))
    return bool(legs(trial)) if limit.of == "overshoot" else limit.of in _indices(ship, trial, trial)


def interval(errors: Sequence[Sequence[float]], level: float = _LEVEL) -> tuple[float, float, float]:
    """`SIZE` times the root mean square error over all trials, and its interval.

    A studentised bootstrap over trials of the logarithm (Efron and Tibshirani 1993, section 12.5), once to twice as
    wide as Student's interval from the linearised variance: plain percentiles are far too narrow for five trials.

    Args:
        errors: of each trial, at least one each.
        level: probability that the interval covers the value of many trials.

    Returns:
        The value, and both ends of the interval, NaN for one trial.
    """
    squares = np.array([float(np.sum(np.square(some))) for some in errors])
    counts = np.array([len(some) for some in errors], dtype=float)
    value, k = SIZE * math.sqrt(squares.sum() / counts.sum()), len(errors)
    if math.isinf(value) or value == 0.0:
        return value, value, value
    if k < 2:
        return value, math.nan, math.nan
    centre, own = _logarithm(squares, counts)
    drawn = np.random.default_rng(_SEED).integers(0, k, (_DRAWS, k))
    others, spread = _logarithm(squares[drawn], counts[drawn])
    ratios = (others - centre) / np.maximum(spread, _EQUAL)
    from scipy.special import stdtrit  # a quarter of a second, for what few ask

    tail, usual = 0.5 * (1.0 - level), float(stdtrit(k - 1, 0.5 * (1.0 + level)))
    # Draws without the only trial that has errors have next to no spread; hence an upper end.
    most = np.clip(np.quantile(ratios, (1.0 - tail, tail)) * (1.0, -1.0), usual, _WIDEST * usual)
    return value, value * math.exp(-most[0] * own), value * math.exp(most[1] * own)


def _least(errors: Sequence[Sequence[float]], level: float = _LEVEL) -> float:
    """Lower end of the interval of `interval` for any number of trials: normal errors, those of a trial as one.

    A trial's mean square is then at most as scattered as chi-squared of one degree of freedom.
    """
    from scipy.special import chdtri

    squares = sum(float(np.mean(np.square(some))) for some in errors)
    return SIZE * math.sqrt(squares / float(chdtri(len(errors), 0.5 * (1.0 - level))))


def _logarithm(squares: Array, counts: Array) -> tuple[Array, Array]:
    """Logarithm of the root mean square over trials (the last axis), and its standard deviation, linearised."""
    total, k = np.maximum(squares.sum(axis=-1), 1e-300), squares.shape[-1]
    mean = total / counts.sum(axis=-1)
    rest = squares - mean[..., None] * counts
    return 0.5 * np.log(mean), 0.5 * np.sqrt(k / (k - 1) * np.square(rest).sum(axis=-1)) / total


def verdict(limit: Limit, errors: Mapping[str, tuple[float, ...]], noise: float = 0.0) -> Found:
    """The verdict on one limit.

    Args:
        limit: what is accepted.
        errors: by trial, in the unit of the limit.
        noise: standard deviation of the readings, in that unit: no error below it can be seen.
    """
    if not errors:
        return Found(limit, errors, math.nan, math.nan, math.nan, OPEN, "no trial shows it")
    value, low, high = interval(tuple(errors.values()))
    count = len(errors)
    if count < FEWEST:
        few, least = f"shown by {count} trial{'s' * (count != 1)} only", _least(tuple(errors.values()))
        if least > math.hypot(limit.size, SIZE * noise):
            return Found(limit, errors, value, least, high, NOT_FIT, f"{few}, but no more are needed to refute it")
        return Found(limit, errors, value, low, high, OPEN, f"{few}; {FEWEST} are needed")
    if high <= limit.size:
        return Found(limit, errors, value, low, high, FIT, "")
    if low > math.hypot(limit.size, SIZE * noise):
        many = sum(math.isinf(e) for some in errors.values() for e in some)
        return Found(limit, errors, value, low, high, NOT_FIT, f"{many} predictions failed" if many else "")
    if SIZE * noise > limit.size:
        reason = f"the readings scatter by {noise:.2g} {limit.unit}: no such error can be seen in them"
        return Found(limit, errors, value, low, high, OPEN, reason)
    if value < limit.size:  # the interval narrows with the root of the number of trials
        wanted = math.ceil(count * (math.log(high / value) / math.log(limit.size / value)) ** 2)
        more = f"about {wanted} trials are needed" if wanted < 1000 else "more trials will hardly decide it"
    else:
        more = "the error itself is beyond the limit, its interval is not; more trials are needed"
    return Found(limit, errors, value, low, high, OPEN, more)


def _errors(limit: Limit, ship: Ship, trial: Trial, smooth: float | None) -> tuple[float, ...]:
    """Errors of one trial in the unit of the limit; infinite where the prediction fails."""
    unit = unit_of(limit, ship, trial)
    if limit.of == "stopping":
        return tuple(_stopping(ship, trial, rows, smooth) / unit for rows in brakes(ship, trial))
    if limit.of == "overshoot":
        return tuple(_overshoot(ship, trial, rows, smooth) / unit for rows in legs(trial))
    if not limit.horizon:
        return (_index_error(limit.of, ship, trial, smooth) / unit,)
    part = trial.rows(predicted(trial))
    chosen = _windows(limit, ship, trial)
    try:
        guess = _guess(ship, trial, _seconds(limit, ship), smooth)
    except SimulationError:
        return (math.inf,) * len(chosen)
    return tuple(_at_end(limit.of, part.rows(rows), guess.rows(rows)) / unit for rows in chosen)


@by_identity
def _guess(ship: Ship, trial: Trial, seconds: float, smooth: float | None) -> Trial:
    """Its predictions, restarted so often: what several limits of several uses are judged by."""
    return replay(ship, trial, restart=seconds, smooth_start=smooth)


def unit_of(limit: Limit, ship: Ship, trial: Trial) -> float:
    """The unit of a limit in SI units and radians."""
    scale = trial.meta.get("scale")  # ship over model
    metre = 1.0 / scale if isinstance(scale, int | float) and scale > 0 else 1.0
    return {"m": metre, "L": ship.L_pp, "deg": math.radians(1.0), "U": ship.speed, "share": 1.0}[limit.unit]


def _noise(limit: Limit, ship: Ship, trial: Trial) -> float:
    """Standard deviation of a reading of what is judged, in the unit of the limit; 0 where it is not known."""
    of = {"position": ("x", "y"), "heading": ("psi",), "speed": ("u",)}.get(limit.of, ())
    levels = [sensor_noise(trial.heading if n == "psi" else trial[n]) for n in of if n in trial]
    known = [level for level in levels if math.isfinite(level)]
    return math.hypot(*known) / unit_of(limit, ship, trial) if known else 0.0


def _seconds(limit: Limit, ship: Ship) -> float:
    return limit.horizon * ship.L_pp / ship.speed


@by_identity
def _windows(limit: Limit, ship: Ship, trial: Trial) -> Windows:
    """Rows of each window that shows what a limit is about, within the rows that can be predicted."""
    part = trial.rows(predicted(trial))
    length = _seconds(limit, ship)
    number = segments(part.t, length)
    out: Windows = []
    for k in np.unique(number):
        rows = np.flatnonzero(number == k)
        window = slice(int(rows[0]), int(rows[-1]) + 1)
        held = part.rows(window)
        if held.duration >= _WHOLE * length - part.dt and CONDITIONS[limit.when](ship, held):
            out.append(window)
    return out


def _at_end(of: str, measured: Trial, guess: Trial) -> float:
    """The error at the last complete row of a window, SI units and radians; a share for "turn"."""
    psi, said = heading(measured["psi"], guess["psi"], np.zeros(len(measured), dtype=np.intp))
    series: Mapping[str, Callable[[], Array]] = {
        "position": lambda: np.hypot(guess["x"] - measured["x"], guess["y"] - measured["y"]),
        "heading": lambda: np.abs(said - psi),
        "speed": lambda: np.abs(guess["u"] - measured["u"]),
        "turn": lambda: np.abs((said - said[0]) - (psi - psi[0])) / np.abs(psi - psi[0]).clip(1e-12),
    }
    known = _known(series[of]())
    return float(known[-1]) if known.size else math.inf


def _speed(trial: Trial) -> float:
    """Mean speed through the water [m/s]; NaN where none is known."""
    known = _known(np.hypot(*through_water(trial)))
    return float(known.mean()) if known.size else math.nan


def _known(values: Array) -> Array:
    return values[np.isfinite(values)]


def _swing(trial: Trial) -> float:
    """Change of heading from the first row to the last [rad]."""
    known = _known(trial.heading)
    return abs(float(known[-1] - known[0])) if known.size else 0.0


def _slow(ship: Ship, trial: Trial) -> bool:
    moved = float(path_length(trial)[-1]) > _MOVED * ship.L_pp or _swing(trial) > _SWUNG
    return moved and _speed(trial) < _SLOW * math.sqrt(GRAVITY * ship.L_pp)


def _hard_over(ship: Ship, trial: Trial) -> bool:
    known = _known(trial["delta"]) if "delta" in trial else np.zeros(0)
    return bool(known.size) and float(np.median(np.abs(known))) >= _LARGE


def _reversed(ship: Ship, trial: Trial) -> bool:
    name = next((n for n in _SHAFTS if n in trial), None)
    return name is not None and float(np.mean((trial[name] < 0.0) & (trial["u"] > 0.0))) >= _ASTERN


CONDITIONS: Mapping[str, Callable[[Ship, Trial], bool]] = {
    "low speed": _slow,
    "large rudder angle": _hard_over,
    "propeller reversed": _reversed,
    "turning": lambda ship, trial: _swing(trial) >= _TURN,
    "under way": lambda ship, trial: _speed(trial) >= _SLOW * math.sqrt(GRAVITY * ship.L_pp),
}
"""What a window may show, by name: whether the measured motion of a ship shows it."""


def brakes(ship: Ship, trial: Trial) -> Windows:
    """Rows of each stop: from the engine stopped or reversed on, until it is ahead again or the log ends.

    Only those in which the speed ahead falls from a third of the approach or more to a fifth of what it was.
    """
    name = next((n for n in _SHAFTS if n in trial), None)
    if name is None or "u" not in trial:
        return []
    n_P, u = trial[name], trial["u"]
    idle = n_P <= _IDLE * float(np.abs(_known(n_P)).max(initial=0.0))  # not in a gap
    out: Windows = []
    # A log that begins with the order on begins at its first sample.
    for first in (*np.flatnonzero(idle[:1]), *np.flatnonzero(idle[1:] & ~idle[:-1])):
        on = np.flatnonzero(~idle[first + 1 :])
        rows = slice(int(first), int(first + 1 + on[0]) if on.size else len(trial))
        if u[first] > ship.speed / 3.0 and bool((u[rows] <= _STOPPED * u[first]).any()):
            out.append(rows)
    return out


def _stopping(ship: Ship, trial: Trial, rows: slice, smooth: float | None) -> float:
    """Error of the distance run from the order to a fifth of the speed [m]."""
    part = trial.rows(rows)
    try:
        guess = replay(ship, part, smooth_start=smooth)
    except SimulationError:
        return math.inf
    truth = part.rows(predicted(part))
    return abs(_distance(guess, float(truth["u"][0])) - _distance(truth, float(truth["u"][0])))


def _distance(run: Trial, u_0: float) -> float:
    """Way until the speed has fallen to a fifth [m]; beyond the end of the log, at the mean deceleration of the run."""
    way = path_length(run)
    below = np.flatnonzero(run["u"] <= _STOPPED * u_0)
    if below.size:
        return float(way[below[0]])
    u = float(run["u"][-1])
    brake = (u_0 - u) / run.duration if run.duration else 0.0
    return float(way[-1]) + (u * u - (_STOPPED * u_0) ** 2) / (2.0 * brake) if brake > 0.0 else math.inf


def legs(trial: Trial) -> Windows:
    """Rows of each leg of a zigzag from a reversal of the rudder to the next, if the heading comes to a peak in it."""
    if trial.meta.get("kind") != "zigzag" or rudder_channel(trial) not in trial:
        return []
    rudder = trial[rudder_channel(trial)]
    large = np.flatnonzero(np.abs(rudder) >= 0.5 * np.nanmax(np.abs(rudder)))
    turns = large[1:][np.diff(np.sign(rudder[large])) != 0.0]
    out: Windows = []
    for first, last in zip(turns, (*turns[1:], len(trial)), strict=True):
        rows = slice(int(first), int(last))
        over = -math.copysign(1.0, rudder[first]) * unwrapped(trial["psi"][rows])
        if over.size > 2 and np.nanargmax(over) > 0 and np.nanmax(over) - over[-1] > _BACK:
            out.append(rows)
    return out


def _overshoot(ship: Ship, trial: Trial, rows: slice, smooth: float | None) -> float:
    """Error of the highest heading in a leg, predicted from its reversal on [rad].

    Under the logged rudder a later overshoot of one run from the start would be that of another manoeuvre: the rudder
    is reversed at the measured heading, not at the predicted one.
    """
    part = trial.rows(rows)
    try:
        guess = replay(ship, part, smooth_start=smooth)
    except SimulationError:
        return math.inf
    truth = part.rows(predicted(part))
    side = -math.copysign(1.0, trial[rudder_channel(trial)][rows.start])
    psi, said = heading(truth["psi"], guess["psi"], np.zeros(len(truth), dtype=np.intp))
    return abs(float(np.nanmax(side * said)) - float(np.nanmax(side * psi)))


def _index_error(name: str, ship: Ship, trial: Trial, smooth: float | None) -> float:
    """Error of a manoeuvre index of a whole run; infinite where the prediction does not come so far."""
    try:
        guess = _indices(ship, trial, replay(ship, trial, smooth_start=smooth))
    except SimulationError:
        return math.inf
    return abs(guess[name] - _indices(ship, trial, trial)[name]) if name in guess else math.inf


def _indices(ship: Ship, measured: Trial, run: Trial) -> dict[str, float]:
    """Manoeuvre indices of a run that was steered as the measured trial, SI units and radians; empty where none."""
    policy = manoeuvre(measured)
    if policy is None:
        return {}
    rows = measured.rows(predicted(measured))
    rudder = {name: rows[name] for name in ("delta", "delta_cmd") if name in rows}
    try:
        found = policy.indices(rows if run is measured else run.having(**rudder), ship.L_pp)
    except DataError:
        return {}
    return {name: one.value for name, one in found.items()}

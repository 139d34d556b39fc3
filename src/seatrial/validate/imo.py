"""The IMO standards for ship manoeuvrability, resolution MSC.137(76), as a table of simulated trials.

Every criterion of section 5.3 is run to both sides where it has sides: value, limit, verdict, and the
reason where the model cannot give one (no propulsion, no reverse thrust, extrapolation).  Definitions are those of
section 4.2 and of MSC/Circ.1053.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from ..belief.bands.manoeuvring import Bands
from ..core.constants import KNOT
from ..core.parameters import values
from ..core.values import dataclass, field, replace
from ..data import Trial
from ..engine import SimulationError
from ..environment import CALM
from ..forces.propeller import KoseWake, Standard
from ..manoeuvres import Manoeuvre, Settings
from ..manoeuvres.initial_turning import InitialTurning
from ..manoeuvres.stopping import CrashAstern
from ..manoeuvres.turning import Turning
from ..manoeuvres.zigzag import Zigzag
from ..models import Sampled
from ..models.settled import settled
from ..ships import Ship, shortened
from ..ships.steering import by_angle, helm_limit, throttled
from ..simulate.run import approach, simulate, straight, surge_balance

PASS, FAIL, NOT_APPLICABLE, UNDECIDED = "pass", "fail", "not applicable", "undecided"
ADVANCE, TACTICAL_DIAMETER, INITIAL_TURNING = 4.5, 5.0, 2.5  # MSC.137(76) 5.3.1, 5.3.2; in ship lengths
OVERSHOOT_20 = 25.0  # 5.3.3.3 [deg]
TRACK_REACH, TRACK_REACH_RELAXED = 15.0, 20.0  # 5.3.4; in ship lengths

_DEGREE = math.degrees(1.0)
# A run that is not over after this much way never will be; lengths of the first and of the last try.
_FIRST, _LAST = 15.0, 480.0
_BESIDE = "the ship slides to the other side of its course: this is no turning circle"
# Surge acceleration over V^2/L beyond which an approach is not called steady.
_STEADY = 2e-3
_SIDES = {1.0: "starboard", -1.0: "port"}
# Change of the surge acceleration, over U^2/L, below which a model does not answer.
_NOTHING = 1e-9
_SHIP_LENGTH = 100.0


@dataclass(frozen=True)
class Band:
    """What draws of a fitted ship do, beside what its fitted numbers do.

    Attributes:
        low, high: edges in the unit of the criterion; NaN where too few draws give the value.
        met: share of all draws that meet the criterion; one that does not give the value does not meet it.
        draws: their number.
    """

    low: float
    high: float
    met: float
    draws: int


@dataclass(frozen=True)
class Source:
    """The run that a value is read of: its policy, what came of it, the index of the manoeuvre, and runs of draws."""

    policy: Manoeuvre
    run: Trial
    index: str
    draws: Bands | None = None


@dataclass(frozen=True)
class Criterion:
    """One line of the table.

    Attributes:
        name: what is judged; `side` the side of the first rudder, empty where there is none.
        value: what the ship does, in `unit`; None where the run did not yield it.
        limit: the greatest value that passes, in `unit` ("L" ship lengths, or "deg").
        verdict: "pass", "fail", "not applicable", or "undecided" where draws of the ship differ about it.
        reason: why nothing can be judged, or what to know about the verdict.
        source: the run of the value; None where there is none.
        band: of draws; None where none were made.
    """

    name: str
    side: str
    value: float | None
    unit: str
    limit: float
    verdict: str
    reason: str = ""
    source: Source | None = field(default=None, repr=False, compare=False)
    band: Band | None = None

    @property
    def title(self) -> str:
        """Name and side."""
        return f"{self.name}{f' ({self.side})' if self.side else ''}"

    def judged_by(self, band: Band, level: float) -> Criterion:
        """The same with the verdict of draws: it stands where the whole band of `level` (0 to 1) is on its side."""
        tail = 0.5 * (1.0 - level)
        verdict = PASS if band.met >= 1.0 - tail else FAIL if band.met <= tail else UNDECIDED
        told = f"met by {band.met:.3g} of the draws" if 0.0 < band.met < 1.0 else ""
        return replace(self, verdict=verdict, band=band, reason="; ".join(filter(None, (told, self.reason))))


@dataclass(frozen=True)
class ImoTable:
    """All criteria for one ship, with the conditions they were run in.

    Attributes:
        speed: test speed V [m/s]; n_P: revolutions that hold it [1/s].
        conditions: of the runs, by name.
        caveats: what the table does not say, the weightiest first.
        together: share of the draws of an estimated ship that meet every criterion they judge; None of any other.
    """

    ship: str
    L_pp: float
    speed: float
    n_P: float
    rows: tuple[Criterion, ...]
    conditions: Mapping[str, str]
    caveats: tuple[str, ...]
    together: float | None = None

    @property
    def L_over_V(self) -> float:
        """The ship's clock, on which the limits of the 10/10 zigzag depend [s]."""
        return self.L_pp / self.speed

    def count(self, verdict: str) -> int:
        """Number of criteria with this verdict."""
        return sum(row.verdict == verdict for row in self.rows)

    @property
    def verdict(self) -> str:
        """One sentence on the whole, and one more on a ship for which the standards are not made."""
        small = f" The standards hold from {_SHIP_LENGTH:g} m on; this one has {self.L_pp:.4g} m."
        return self._whole() + small * (self.L_pp < _SHIP_LENGTH)

    def _whole(self) -> str:
        failed, unsure = ([row.title for row in self.rows if row.verdict == one] for one in (FAIL, UNDECIDED))
        left = self.count(NOT_APPLICABLE)
        if self.together is not None:
            return self._probable(left)
        open_ = f"; {left} of {len(self.rows)} criteria could not be judged" if left else ""
        if unsure:
            open_ = f"; undecided: {', '.join(unsure)}{open_}"
        if failed:
            return f"Does not meet: {', '.join(failed)}{open_}."
        if unsure:
            return f"Meets {self.count(PASS)} criteria{open_}."
        return f"Meets every criterion that could be judged ({self.count(PASS)}){open_}."

    def _probable(self, left: int) -> str:
        """The whole of an estimated ship, which nothing but formulas stands behind: probabilities, no verdict."""
        banded = {row.title: row.band.met for row in self.rows if row.band is not None}
        least = min(banded, key=lambda title: banded[title])
        return (f"An estimate, untuned: by its sigmas it meets all {len(banded)} criteria that could be judged with "
                f"probability {self.together:.2g}; least sure: {least}, {banded[least]:.2g}"
                f"{f'; {left} could not be judged' if left else ''}.")  # fmt: skip


def overshoot_limits(L_over_V: float) -> tuple[float, float]:
    """Limits of the first and the second overshoot of the 10/10 zigzag [deg] for L/V [s] (MSC.137(76) 5.3.3).

    >>> overshoot_limits(9.0), overshoot_limits(20.0), overshoot_limits(40.0)
    ((10.0, 25.0), (15.0, 32.5), (20.0, 40.0))
    """
    if L_over_V < 10.0:
        return 10.0, 25.0
    if L_over_V < 30.0:
        return 5.0 + 0.5 * L_over_V, 17.5 + 0.75 * L_over_V
    return 20.0, 40.0


_NO_ANGLE = "the criterion is for 10 or 20 deg of rudder, and this craft has no rudder: it is steered by a demand"


def imo_table(ship: Ship) -> ImoTable:
    """Run every trial of the standards from the ship's approach, in calm, deep water.

    Raises:
        ShipError: no steady approach is found.
    """
    V, n_P = approach(ship)
    settings = Settings(n_P, V, ship.L_pp, helm_limit(ship))
    astern = max(-abs(n_P), float(ship.actuators.of("n_P").low))
    rows = (*_steering(ship, settings), _stop(ship, settings, astern))
    return ImoTable(
        ship.name, ship.L_pp, V, n_P, rows,
        {
            "test speed": f"{V:.4g} m/s ({V / KNOT:.3g} kn) at {_ahead(ship, n_P)}",
            "L/V": f"{ship.L_pp / V:.3g} s",
            "full astern": f"{_ahead(ship, astern)}: that of the approach reversed, as far as the ship's goes"
            if astern < 0 else "none",
            "water": "deep, still", "wind and waves": "none", "loading": "that of the ship file",
        },
        tuple(_caveats(ship, V, n_P)),
    )  # fmt: skip


def _ahead(ship: Ship, n_P: float) -> str:
    """An order ahead in words."""
    return f"{100.0 * n_P:.3g} % throttle" if throttled(ship) else f"{n_P:.4g} revolutions per second"


def _steering(ship: Ship, settings: Settings) -> Iterator[Criterion]:
    first, second = overshoot_limits(ship.L_pp / settings.speed)
    ten, twenty = 10.0 / _DEGREE, 20.0 / _DEGREE
    hard = Turning.ordered(settings)
    angles = by_angle(ship)
    helm = f"rudder {abs(hard.delta) * _DEGREE:.3g} deg" if angles else "full steering demand"
    steered = bool(ship.model.obeying("delta"))
    for side, word in _SIDES.items():
        runs: tuple[tuple[Manoeuvre, tuple[tuple[str, str, str, float], ...]], ...] = (
            (replace(hard, delta=side * hard.delta),
             ((f"advance, {helm}", "advance", "L", ADVANCE),
              (f"tactical diameter, {helm}", "tactical_diameter", "L", TACTICAL_DIAMETER))),
            (InitialTurning(settings.n_P, ten, ten, side),
             (("way to 10 deg of heading, rudder 10 deg", "initial_turning_distance", "L", INITIAL_TURNING),)),
            (Zigzag(settings.n_P, ten, ten, side),
             (("10/10 zigzag, first overshoot", "first_overshoot", "deg", first),
              ("10/10 zigzag, second overshoot", "second_overshoot", "deg", second))),
            (Zigzag(settings.n_P, twenty, twenty, side),
             (("20/20 zigzag, first overshoot", "first_overshoot", "deg", OVERSHOOT_20),)),
        )  # fmt: skip
        for policy, figures in runs:
            missing = "nothing of this ship obeys a rudder order" if not steered \
                else "" if angles or isinstance(policy, Turning) else _NO_ANGLE
            run, reason, over = (None, missing, True) if missing else _run(ship, policy, settings.speed)
            found = {} if run is None else {
                name: (_DEGREE if one.unit == "rad" else 1.0) * (one.value if one.over_L is None else one.over_L)
                for name, one in policy.indices(run, ship.L_pp).items()
            }  # fmt: skip
            for name, index, unit, limit in figures:
                row = _judged(name, word, found.get(index), unit, limit, reason, over)
                yield row if run is None else replace(row, source=Source(policy, run, index))


def _run(ship: Ship, policy: Manoeuvre, V: float) -> tuple[Trial | None, str, bool]:
    """The run, None where it blows up; why it is missing or too short; and whether more time would change nothing."""
    lengths = _FIRST
    while True:
        try:
            run = simulate(ship, policy, speed=V, duration=lengths * ship.L_pp / V)
        except SimulationError as error:
            return None, str(error), True
        if policy.complete(run):
            return run, "", True
        if lengths >= _LAST:
            way = V * run.duration / ship.L_pp
            return run, f"the run was not over after the time of {way:.0f} ship lengths at test speed", False
        lengths *= 2.0


def _judged(
    name: str, side: str, value: float | None, unit: str, limit: float, reason: str, over: bool = True
) -> Criterion:  # fmt: skip
    if value is None:
        # A ship that is still swinging after so long never gives the figure: that is a failure of the ship.
        verdict = NOT_APPLICABLE if over else FAIL
        return Criterion(name, side, None, unit, limit, verdict, reason or "the run did not yield it")
    if value < 0 and unit == "L":
        return Criterion(name, side, value, unit, limit, NOT_APPLICABLE, reason or _BESIDE)
    return Criterion(name, side, value, unit, limit, PASS if value <= limit else FAIL, reason)


def _stop(ship: Ship, settings: Settings, astern: float) -> Criterion:
    """The full astern stop; without a verdict where the model cannot know it, with its value where it has one."""
    name, unit = "track reach, full astern", "L"
    missing = no_stop(ship, settings.speed, settings.n_P, astern)
    if missing:
        return Criterion(name, "", None, unit, TRACK_REACH, NOT_APPLICABLE, missing)
    policy = CrashAstern(settings.n_P, astern)
    run, reason, over = _run(replace(ship, validity={}), policy, settings.speed)
    reach = policy.indices(run, ship.L_pp).get("track_reach") if run is not None and over else None
    if run is None or reach is None:
        return _judged(name, "", None, unit, TRACK_REACH, reason, over=run is None)
    value = reach.value / ship.L_pp
    stopped = np.flatnonzero(run["u"] <= float(policy.end) * run["u"][0])
    doubts = unreliable_stop(ship, astern, run.rows(slice(0, int(stopped[0]) if stopped.size else None)))
    if doubts:
        return Criterion(name, "", value, unit, TRACK_REACH, NOT_APPLICABLE, f"extrapolates: {doubts}")
    row = replace(_judged(name, "", value, unit, TRACK_REACH, ""), source=Source(policy, run, "track_reach"))
    relaxed = f"up to {TRACK_REACH_RELAXED:g} L if the Administration allows it for a ship of large displacement"
    return replace(row, reason=relaxed) if TRACK_REACH < value <= TRACK_REACH_RELAXED else row


def _caveats(ship: Ship, V: float, n_P: float) -> Iterator[str]:
    yield "These are simulated trials: they carry the errors of the model, which the table does not know."
    if held_speed(ship, V, n_P):
        yield (
            "The model holds its speed and does not drift: a turn loses no speed here, so advance, tactical "
            "diameter and ways are those of a point that steers, not of the ship."
        )
    for caution in shortened(ship.notes.get("cautions", ())):
        yield f"The ship's file cautions: {caution}"
    gaining = surge_balance(ship, V, n_P)
    if abs(gaining) * ship.L_pp > _STEADY * V * V:
        yield f"The approach is not steady: straight ahead the speed changes by {gaining:.2g} m/s per second at first."
    yield (
        "The test speed is the approach speed of the ship file; the standards ask for at least 90 % of the speed "
        "at 85 % of the engine's greatest output, which the file does not hold."
    )
    if ship.L_pp < _SHIP_LENGTH:
        yield (
            f"The standards hold for ships of {_SHIP_LENGTH:g} m and more (chemical tankers and gas carriers of any "
            f"length); this one has {ship.L_pp:.4g} m.  If it is a model, its zigzag limits are not those of the ship: "
            "L/V grows with the square root of the scale."
        )
    yield "The standards hold for full load on even keel; the loading is that of the ship file, whatever it is."


def held_speed(ship: Ship, V: float, n_P: float) -> bool:
    """Whether nothing changes the surge velocity: neither speed, nor revolutions, nor turning."""
    if isinstance(ship.model, Sampled):
        return not any(path.rpartition(".")[2].startswith("u_") for path in values(ship.model))
    control = straight(ship, n_P)
    rest = settled(ship.model, np.array([[*control, *CALM]], dtype=np.float64))[0].tolist()
    motions = ((V, 0.0), (0.5 * V, 0.0), (V, 0.3 * V))  # at speed, slow, turning
    rates = [
        float(ship.model.derivative((0.0, 0.0, 0.0, u, -v, v / ship.L_pp, *rest), control, CALM)[3])
        for u, v in motions
    ]
    return all(abs(rate) * ship.L_pp < _NOTHING * V * V for rate in rates)


def no_stop(ship: Ship, V: float, n_P: float, astern: float) -> str:
    """Why the ship cannot be stopped by its engine at all; empty where it can."""
    if not any(order == "n_P" for order, _ in ship.model.follows):
        return "nothing of this ship obeys an order of revolutions"
    scale = _NOTHING * V * V / ship.L_pp
    ahead, stopped, back = (surge_balance(ship, V, n) for n in (n_P or 1.0, 0.0, astern or -1.0))
    if abs(ahead - back) < scale and abs(ahead - stopped) < scale:
        return "the model has no propulsion: its surge does not answer the revolutions"
    if astern >= 0:
        return "the shaft of this ship does not turn astern"
    if back >= stopped - scale:
        return "the model has no reverse thrust: reversed revolutions brake no more than a stopped propeller"
    return ""


def unreliable_stop(ship: Ship, astern: float, run: Trial) -> str:
    """Why a computed stop is not to be trusted; empty where it lies within what the model was made for.

    Args:
        astern: revolutions ordered [1/s].
        run: until the ship has stopped.
    """
    doubts: list[str] = []
    propeller = ship.model.part("propeller")
    if isinstance(propeller, Standard | KoseWake):
        doubts.append(f"propeller:{type(propeller).__name__}, whose reversed thrust is its curve for ahead turned "
                      "round and was never fitted")  # fmt: skip
    low = ship.validity.get("n_P", (-math.inf, math.inf))[0]
    if astern < low:
        doubts.append(f"the ship file is valid for n_P of {low:g} 1/s and above, full astern is {astern:.3g} 1/s")
    for name, (low, high) in ship.validity.items():
        if name == "n_P" or name not in run:
            continue
        least, greatest = float(np.min(run[name])), float(np.max(run[name]))
        if least < low or greatest > high:
            doubts.append(f"{name} leaves its validity of {low:g} to {high:g} ({least:.3g} to {greatest:.3g})")
    return "; ".join(doubts)

"""Draws of a manoeuvre of a fitted ship, and what their bands stand on.

That is the calibration beside the model where there is one, else the posterior that trials left out in turn have
widened, else the samples of its posterior, else the covariance of the fit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ...belief.bands.calibration import Calibration, beside, load
from ...belief.bands.conformal import unsure
from ...belief.bands.manoeuvring import STANDING, Bands, bands, read, step_of, straightened
from ...belief.bands.prediction import Runs, manoeuvre, scale_of
from ...belief.posterior import Posterior
from ...belief.reading import drawn_from
from ...core.values import dataclass, replace
from ...data import Array, Trial
from ...environment import Weather
from ...manoeuvres import Manoeuvre
from ...models import STATES
from ...report.judging.bands import CALIBRATED, PARAMETERS_ONLY, Basis, basis_of
from ...report.judging.tested import reached
from ...ships import Ship
from ...simulate.run import recorded
from ...study.grounds import SURROUNDINGS, Beyond, kind_of
from ...study.store import read_summary
from .. import RequestError
from ..asked import Bands as Asked
from ..request import level_of

DRAWS, MOST = 1000, 20_000
# A quantile is worth its name with so many draws beyond it.
_TAIL = 5
SEED = 1
# A parameter is left open where so much of its prior variance stays.
_LOOSE = 0.5
UNKNOWN = "; nothing is known of the error there; "
LEAVE_OUT = "; or let trials left out in turn widen them (seatrial calibrate MODEL)"
# What a polynomial of third order lacks is of the fifth at least, which grows by the square of how far a run goes; no
# farther than this many times what trials tested, where an estimate of growth ends.
_ORDER, _FARTHEST = 2, 2.0
# Rows of each calibrated run: indices of a manoeuvre with memory hang on the instant of its reversals.
_ROWS, _SWITCHED = 200, 600


@dataclass(frozen=True)
class Sailed:
    """A manoeuvre with every draw.

    Attributes:
        bands: of the draws.
        draws: parameters of each run, shape (draws, free).
        basis: what the bands stand on.
        beyond: channels in which the run leaves the trials of the fit.
        caveats: what the bands do not say, one line each, the first that of the basis.
    """

    bands: Bands
    draws: Array
    basis: Basis
    beyond: tuple[Beyond, ...]
    caveats: tuple[str, ...]


@dataclass(frozen=True)
class Drawing:
    """What draws are made with.

    Attributes:
        held: posterior of the fit.
        found: calibration beside the model; None where there is none.
        level: of 0 to 1.
        count: number of draws.
        extrapolate: whether bands are given beyond the ranges of the trials of the fit.
        explained: whether the model explains the trials of its fit.
    """

    held: Posterior
    found: Calibration | None
    level: float
    count: int
    extrapolate: bool
    explained: bool

    @staticmethod
    def of(model: str, asked: Asked, usual: int = DRAWS) -> Drawing:
        """From the options, with the `usual` number of draws.

        Raises:
            RequestError: a level or number of draws that makes no band, or too few recordings for it.
            StudyError: the model has no posterior (says which command makes one), or the calibration of another fit.
        """
        level, count = level_of(asked), usual if asked.count is None else asked.count
        least = round(_TAIL * 200.0 / (100.0 - level) + 0.5)
        if not least <= count <= MOST:
            raise RequestError(f"--draws is {count}; bands of {level:g} percent take {least} to {MOST}")
        held = drawn_from(model)
        found = load(model, held) if held.fitted and beside(model).is_file() else None
        if found is not None and (found.power is None or 0.01 * level <= found.level):
            found.factors(0.01 * level)
        elif found is not None:  # too few recordings for this level: the widened posterior has it
            found = None
        explained = not held.fitted or read_summary(Path(model).parent).explained
        return Drawing(held, found, 0.01 * level, count, asked.extrapolate, explained)

    def beyond(self, run: Trial) -> tuple[Beyond, ...]:
        """Where a run leaves the trials of the fit.

        Raises:
            RequestError: it does, and that was not accepted.
        """
        if refused := self.refusal(run):
            raise RequestError(f"--bands: {refused}")
        return self.held.grounds.beyond(run, self.held.ship.model.controls) if self.held.fitted else ()

    def refusal(self, run: Trial) -> str:
        """Why no bands are given for a run; empty where they are."""
        if self.ungrounded:
            return self.ungrounded
        out = self.refused(run)
        if not out:
            return ""
        return (f"the run leaves the trials of the fit: {reached(out)}{UNKNOWN}"
                "fit trials that go so far, or accept it with --extrapolate"
                f"{'' if self.held.power is not None else LEAVE_OUT}")  # fmt: skip

    @property
    def ungrounded(self) -> str:
        """Why no run at all has bands: ranges of trials that were not kept; empty where they were, or are not asked."""
        if self.extrapolate or self.held.covered or not self.held.fitted:
            return ""
        return (f"the fit of {self.held.ship.name} did not keep the ranges of its trials (an older version); "
                "fit it again, or accept bands of unknown validity with --extrapolate")  # fmt: skip

    def refused(self, run: Trial) -> tuple[Beyond, ...]:
        """Where a run leaves the trials of the fit so that it has no bands."""
        if self.extrapolate or not self.held.fitted:
            return ()
        out = self.held.grounds.beyond(run, self.held.ship.model.controls)
        return () if self._told(out) else out

    def _told(self, out: tuple[Beyond, ...]) -> bool:
        """Whether a posterior widened by left-out trials says what is open there."""
        return self.held.power is not None and not any(one.channel in SURROUNDINGS for one in out)

    def sail(
        self, ship: Ship, policy: Manoeuvre, run: Trial, *, speed: float, dt: float, weather: Weather,
        balanced: bool = True,
    ) -> Sailed:  # fmt: skip
        """Sail a manoeuvre with every draw.

        Args:
            run: by the fitted numbers.
            speed: initial speed ahead through the water [m/s].
            dt: time step of a single run [s].
            balanced: whether draws of a fit without calibration each start with the revolutions that hold their speed.

        Raises:
            RequestError: the run leaves the trials of the fit, and that was not accepted.
            ShipError: a calibrated model that cannot be disturbed.
        """
        out_of = self.beyond(run)
        found = self.found if not out_of or not self._told(out_of) or self.extrapolate else None
        if found is None:
            drawn = self._paired if self._by_slopes else self.held.draws(self.count, SEED)
            sailed = ship if self.held.fitted else replace(ship, validity={})  # of formulas, which end nowhere sharply
            made = bands(sailed, policy, self.held.names, drawn, speed=speed, duration=run.duration, dt=dt,
                         weather=weather, held=balanced)  # fmt: skip
            if self._by_slopes:
                made, drawn = straightened(made, self.count, self._wider(out_of)), drawn[1 : self.count + 1]
            basis = basis_of(self.held)
            lines = (self._law,) if self.held.power is None else self.held.power.words
        else:
            drawn, kind = self.held.draws(self.count, SEED), kind_of(run)
            made, scale, sure = _calibrated(self, found, policy, run, speed, dt, weather, kind)
            basis = CALIBRATED.on(len(set(found.left.groups)))
            lines = _unsure(found, self.level, kind, run.duration, scale, sure, made)
        lines = (*lines, *self._caveats(run, out_of, basis, made))
        return Sailed(made, drawn, basis, out_of, (basis.words, *lines))

    @property
    def _by_slopes(self) -> bool:
        """Whether draws are of a covariance alone, which is that of the fit's slopes."""
        return self.held.fitted and self.held.samples is None and self.held.power is None

    @property
    def _paired(self) -> Array:
        """The fitted numbers, then half of the draws, then the other half: their mirror images about the fit."""
        held = self.held
        half = held.draws(-(-self.count // 2), SEED)
        return np.vstack([held.mean, half, np.clip(2.0 * held.mean - half, *held.bounds)])

    @property
    def _law(self) -> str:
        """What draws are taken from where no left-out trial has widened them."""
        held = self.held.samples
        if not self.held.fitted:
            return f"drawn from the sigmas of {len(self.held.free)} numbers, each by itself, within its physical range"
        return "drawn from the covariance of the fit, within its bounds, and followed by slopes" if held is None else (
            f"drawn from the {len(held)} samples of the posterior beside the model")

    def _caveats(self, run: Trial, out_of: tuple[Beyond, ...], basis: Basis, made: Bands) -> list[str]:
        lines: list[str] = []
        if basis is PARAMETERS_ONLY and not self.explained:
            lines.append("the model does not explain its trials: bands are as wide as these scatter about it")
        if out_of:
            lines.append(f"extrapolated: {reached(out_of)}; {self._open_there(basis, out_of)}")
        kinds, kind = self.held.grounds.kinds, kind_of(run)
        if kinds and kind not in kinds:
            lines.append(f"no trial of the fit is of this kind ({kind}); they are {', '.join(kinds)}")
        if lost := int(np.isfinite(made.failed).sum()):
            whose = "bands are of the others" if lost <= (1.0 - STANDING) * len(made.failed) else (
                "an index that fewer than half of all reach has no band: fix some of what the trials leave open")
            lines.append(f"{lost} of {len(made.failed)} draws have no revolutions that hold the speed, left the "
                         f"validity of the ship file or blew up on their way; {whose}")  # fmt: skip
        return lines

    def _wider(self, out_of: Sequence[Beyond]) -> float:
        """How many times as wide bands are beyond the trials, as far as these contradict the form of the model.

        What is ordered tells how far a run goes; the motion does where no order goes farther, as it is the model's own
        word, and that of a wrong form may run away.
        """
        ordered = (one.times for one in out_of if one.channel in self.held.ship.model.controls)
        far = max(ordered, default=1.0)
        far = min(far if far > 1.0 else max((one.times for one in out_of), default=1.0), _FARTHEST)
        return math.sqrt(1.0 + self.held.form * (far ** (2 * _ORDER) - 1.0))

    def _open_there(self, basis: Basis, out_of: Sequence[Beyond]) -> str:
        """What the bands count beyond the trials."""
        if basis.kind == CALIBRATED.kind:
            return "no left-out trial has tested the bands there"
        if self.held.power is None:
            wider = self._wider(out_of) if self._by_slopes else 1.0
            return f"the bands are {f'{wider:.2g} times as wide' if wider > 1.0 else 'not widened'} for it"
        loose = int((self.held.power.shares(self.held.free, self.held.covariance) > _LOOSE).sum())
        return (f"there the bands are as wide as the priors of what the trials leave open ({loose} of "
                f"{len(self.held.free)} free parameters), which no trial has tested; what the study holds counts as "
                "exact")  # fmt: skip


def _unsure(
    found: Calibration, level: float, kind: str, longest: float, scale: float | None, sure: Sequence[str], made: Bands
) -> tuple[str, ...]:
    """Where left-out trials say less than the bands."""
    lines = [*unsure(len(set(found.left.groups)), level)]
    kinds, far = found.factors(level).kinds[:-1], found.reach(level)
    if sure and found.indices is not None:
        lines.append(f"{', '.join(_words(sure))}: calibrated on the same of left-out manoeuvres "
                     f"({len(set(found.indices.groups))} recordings)")  # fmt: skip
    if other := [name for name in made.indices if name not in sure and np.isfinite(made.indices[name]).any()]:
        which = "all indices" if not sure else ", ".join(_words(other))
        lines.append(f"{which}: held against no left-out manoeuvre; a model that is wrong all along it can miss by "
                     "more than the band")  # fmt: skip
        if scale is not None:
            lines.append(f"the manoeuvre answers the ship: such indices are {scale:.3g} times as far apart as those of "
                         "the draws, which is the mean factor of the calibration over times and states")  # fmt: skip
    if kind not in kinds:
        lines.append(f"no left-out trial is of this kind ({kind}): the widest bands of {', '.join(kinds)} are taken")
    if longest > far * (1.0 + 1e-6):
        lines.append(f"calibrated up to {far:.4g} s from the start; beyond, the factor of that time is kept, which no "
                     "left-out trial has tested")  # fmt: skip
    return tuple(lines)


def _calibrated(
    asked: Drawing, found: Calibration, policy: Manoeuvre, run: Trial, speed: float, dt: float, weather: Weather,
    kind: str,
) -> tuple[Bands, float | None, tuple[str, ...]]:  # fmt: skip
    """Draws that also differ by what the model lacks, their bands, the factor on indices, and those that need none.

    Indices that left-out manoeuvres show are put as far apart as these were missed.  For the others: tracks are put as
    far apart at each time as the calibrated edges are, and under fixed orders indices are read of that.  A manoeuvre
    that answers the ship has the instants of its orders from the draw as it was sailed: headings
    that are stretched about those of another instant have no overshoot that a ship has.  There indices are read of the
    draws as they are, and put apart by the mean factor of the calibration.
    """
    ship = asked.held.ship
    step = step_of(ship, policy, dt)
    every = max(round(run.duration / step) // (_SWITCHED if policy.memory else _ROWS), 1)
    runs = manoeuvre(asked.held, found, policy, asked.level, speed=0.0 if policy.from_rest else speed,
                     duration=run.duration, dt=step, weather=weather, kind=kind, draws=asked.count, every=every,
                     seed=SEED)  # fmt: skip
    bad = np.maximum.accumulate(~np.isfinite(runs.drawn).all(axis=2), axis=1)
    tracks, raw = (np.where(bad[:, :, None], np.nan, one) for one in (runs.tracks, runs.drawn[:, :, : len(STATES)]))
    failed = np.where(bad[:, -1], runs.t[bad.argmax(axis=1)], np.nan)
    around = weather.series(step, every * (len(runs.t) - 1) + 1)
    plain = recorded(ship, policy, runs.t, runs.fitted, around, dt=step, every=every)
    fitted = read(policy, plain, ship.L_pp)
    drawn = _figures(policy, ship.L_pp, plain, runs, raw)
    held = {name: values for name, one in drawn.items() if found.indices is not None and name in fitted
            and (values := found.indices.apart(kind, name, one, fitted[name], asked.level)) is not None}  # fmt: skip
    if not policy.memory:
        others = _figures(policy, ship.L_pp, plain, runs, tracks) if set(drawn) - set(held) else {}
        return Bands(runs.t, tracks, {**others, **held}, failed), None, tuple(held)
    scale = scale_of(asked.held, found, plain, kind, asked.level)
    return Bands(runs.t, tracks, {**_apart(drawn, fitted, scale), **held}, failed), scale, tuple(held)


def _words(names: Sequence[str]) -> list[str]:
    return [name.replace("_", " ") for name in names]


def _apart(indices: Mapping[str, Array], fitted: Mapping[str, float], scale: float) -> dict[str, Array]:
    """Indices so many times as far from those of the fitted run; none changes its sign that no draw changes."""
    out: dict[str, Array] = {}
    for name, values in indices.items():
        middle = fitted.get(name, float(np.nanmedian(values)))
        moved = middle + scale * (values - middle)
        out[name] = np.maximum(moved, 0.0) if np.nanmin(values) >= 0.0 else moved
    return out


def _figures(policy: Manoeuvre, L_pp: float, plain: Trial, runs: Runs, tracks: Array) -> dict[str, Array]:
    """Indices of every draw by the manoeuvre itself; NaN where it did not reach one.

    Args:
        plain: the run by the fitted numbers, on the rows of the draws.
        tracks: of the draws; NaN from where one failed.
    """
    own = {name: runs.stored.index(name) for name in plain.channels if name in runs.stored}
    out: dict[str, Array] = {}
    for k, (track, rows) in enumerate(zip(tracks, runs.drawn, strict=True)):
        columns = {name: rows[:, at] for name, at in own.items()}
        columns |= {name: track[:, j] for j, name in enumerate(STATES)}
        one, good = plain.having(**columns), np.isfinite(track[:, 0])
        if not good.all():
            one = one.rows(slice(0, int(good.argmin())))
        for name, value in read(policy, one, L_pp).items():
            out.setdefault(name, np.full(len(tracks), np.nan))[k] = value
    return out

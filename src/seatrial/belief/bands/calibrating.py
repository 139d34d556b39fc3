"""From fits that left trials out to a calibration: horizons, errors, what the model lacks, spreads, scores."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from ...core.values import dataclass, replace
from ...data import Array, Trial
from ...identify.noise import noise
from ...identify.record import step_of
from ...identify.recordings import recordings
from ...models import STATES
from ...study.grounds import trial_digest
from ..parts import LeftOut
from ..posterior import Posterior
from .calibration import LEVEL, Calibration, Left, best_power, best_share, posterior_digest
from .conformal import needed, too_few
from .disturbance import Disturbance
from .indexing.left_out import left_indices
from .learning import Variances, Windows, by_trial, learned, quiet, variances, windows_of
from .novel import acting, reference_of, so_far
from .sailing import Begins, FreeRuns, sailed

# Draws of a spread; horizons, the first one over L/U and the ratio of two.
_DRAWS, _FIRST, _RATIO = 100, 0.7, 1.4
# The first horizon is a multiple of so many rows where it is longer, so that steps of the integrator may join rows.
_TOGETHER = 10


@dataclass(frozen=True)
class Part:
    """Left-out trials of one fit, with what they are judged by."""

    out: LeftOut
    cut: Windows
    found: Variances


def horizons_of(trials: Sequence[Trial], time: float, longest: float | None) -> Array:
    """Horizons at which errors are taken [s]: multiples of the first, about evenly spaced in the logarithm.

    Args:
        time: L/U of the ship [s].
        longest: None takes what as many recordings reach as `LEVEL` needs, or all of them where they are fewer.

    Raises:
        RequestError: too few recordings for any level.
    """
    spans = sorted((max(trial.duration for trial in group) for group in recordings(trials)), reverse=True)
    if len(spans) < 2:
        raise too_few(len(spans))
    most = min(longest or spans[min(needed(LEVEL), len(spans)) - 1], spans[0])
    dt = step_of(trials)
    unit = _TOGETHER * dt if min(_FIRST * time, most / 8.0) > _TOGETHER * dt else dt
    first = max(round(min(_FIRST * time, most / 8.0) / unit), 1) * unit
    count = max(int(np.log(most / first) / np.log(_RATIO)) + 1, 2)
    many = np.unique(np.round(np.geomspace(1.0, max(most / first, 2.0), count))).astype(np.float64)
    return first * many[many * first <= most * (1.0 + 1e-9)]


@dataclass(frozen=True)
class Withheld:
    """What calibrations of one fit are made of: left-out trials, and what a model without each part lacks.

    Attributes:
        held: posterior of the fit to all trials.
        trials: all that were left out.
        parts: with the windows of the trials that each left out.
        horizons: [s].
        lacks: what a model lacks by the trials of the other parts, for each part.
        sigma: of the readings, shape (6,).
        dt: time step [s].
    """

    held: Posterior
    trials: tuple[Trial, ...]
    parts: tuple[Part, ...]
    horizons: Array
    lacks: tuple[Disturbance, ...]
    sigma: Array
    dt: float

    @staticmethod
    def of(held: Posterior, parts: Iterable[LeftOut], longest: float | None = None) -> Withheld:
        """Arguments and errors as of `calibrated`."""
        every = list(parts)
        trials = [trial for part in every for trial in part.trials]
        h = horizons_of(trials, held.ship.L_pp / max(held.ship.speed, 1e-3), longest)
        level, dt = noise(trials), step_of(trials)
        sigma = np.array([level.get(name, 0.0) for name in STATES])
        made: list[Part] = []
        for out in every:
            cut = windows_of(out.held.ship, out.trials, h, dt)
            made.append(Part(out, cut, variances(out, cut, sigma)))
        lacks = tuple(_learned([other for other in made if other is not one]) for one in made)
        return Withheld(held, tuple(trials), tuple(made), h, lacks, sigma, dt)

    def measured(self) -> Calibration:
        """Of predictions that begin in measured states."""
        spreads = [one.cut.reached(spread_of(one.out, one.cut.lanes, who, self.sigma))
                   for one, who in zip(self.parts, self.lacks, strict=True)]  # fmt: skip
        found = self.made("measured", [one.cut for one in self.parts], [one.cut.error for one in self.parts], spreads)
        pairs = [(one.out, who) for one, who in zip(self.parts, self.lacks, strict=True)]
        return replace(found, indices=left_indices(pairs, self.recording))

    @property
    def recording(self) -> dict[str, str]:
        """Recording of each trial by name."""
        return {trial.name: group[0].name for group in recordings(self.trials) for trial in group}

    def made(
        self, begin: str, cuts: Sequence[Windows], errors: Sequence[Array], spreads: Sequence[Array]
    ) -> Calibration:  # fmt: skip
        """A calibration from errors and spreads of the windows of each part."""
        of, cuts = self.recording, list(cuts)
        names = tuple(name for cut in cuts for name in cut.trials)
        left = Left(names, tuple(of[name] for name in names), tuple(kind for cut in cuts for kind in cut.kinds),
                    self.horizons, np.concatenate(errors), np.concatenate(spreads), self._novelty(cuts))  # fmt: skip
        told = {trial.name: trial_digest(trial) for trial in self.trials if trial.name in names}
        return Calibration(self.held.digest, posterior_digest(self.held), told, begin, self.sigma,
                           _learned(self.parts), share := best_share(left, LEVEL), left, power=self.held.power,
                           novel=best_power(left, share, LEVEL), reference=reference_of(self.trials))  # fmt: skip

    def _novelty(self, cuts: Sequence[Windows]) -> Array | None:
        """How unlike the trials of its fit each window is until each horizon; None where the trials do not tell."""
        found: list[Array] = []
        for cut in cuts:
            one = next(part for part in self.parts if cut.trials[0] in part.cut.trials)
            seen = reference_of([t for other in self.parts if other is not one for t in other.out.trials])
            if seen is None:
                return None
            ship = one.out.held.ship
            rows = sailed(ship, cut.lanes, quiet(ship, 1), 0)[0]
            at = so_far(seen, acting(ship, rows, cut.lanes), cut.lanes.t)
            found.append(np.nan_to_num(cut.reached(at), nan=1.0))
        return np.concatenate(found)


def calibrated(held: Posterior, parts: Iterable[LeftOut], *, longest: float | None = None) -> Calibration:
    """Calibrate the predictions of a fit that begin in measured states.

    Args:
        held: posterior of the fit to all trials.
        parts: fits that left trials out, and these trials; see `left_out`.
        longest: horizon [s]; see `horizons_of`.

    Raises:
        RequestError: too few recordings.
        DataError: a trial lacks a channel.
    """
    return Withheld.of(held, parts, longest).measured()


def _learned(parts: Sequence[Part]) -> Disturbance:
    """What the model lacks, by the left-out trials of some fits."""
    cuts = [one.cut for one in parts]
    names = tuple(name for cut in cuts for name in cut.trials)
    found = Variances(np.concatenate([one.found.known for one in parts]),
                      np.concatenate([one.found.unit for one in parts], axis=1))  # fmt: skip
    return learned(parts[0].out.held.ship, np.concatenate([cut.error for cut in cuts]), found, by_trial(names))


def spread_of(
    out: LeftOut, lanes: FreeRuns, disturbance: Disturbance, sigma: Array, past: Begins | None = None
) -> Array:  # fmt: skip
    """Standard deviation of the draws, readings included, shape (lanes, rows, 6); see `sailing.Uncertain`."""
    who = out.held
    uncertain = replace(quiet(who.ship, _DRAWS), names=who.names, draws=who.draws(_DRAWS, 1), start=sigma,
                        disturbance=disturbance, past=past)  # fmt: skip
    return spread(sailed(who.ship, lanes, uncertain, 2), sigma)


def mean_of(runs: Array) -> Array:
    """Mean over the draws that stay finite, shape (lanes, rows, 6), of runs as `spread` takes them; NaN of none."""
    good = np.isfinite(runs)
    with np.errstate(all="ignore"):
        return np.where(good, runs, 0.0).sum(axis=0) / good.sum(axis=0)


def spread(runs: Array, sigma: Array) -> Array:
    """Standard deviation over the draws that stay finite, and of a reading, shape (lanes, rows, 6).

    Args:
        runs: shape (draws, lanes, rows, 6).
        sigma: of the readings, shape (6,).
    """
    with np.errstate(all="ignore"):
        good = np.isfinite(runs)
        count = np.maximum(good.sum(axis=0), 1)
        mean = np.where(good, runs, 0.0).sum(axis=0) / count
        return np.sqrt((np.where(good, runs - mean, 0.0) ** 2).sum(axis=0) / count + sigma**2)

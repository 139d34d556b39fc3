"""Comparisons of a model with trials: in which current, from which start, by what scales; its fitness for a purpose."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..core.parameters import unknown, values
from ..core.values import dataclass, replace
from ..data import Trial
from ..engine import SimulationError
from ..models import Sampled
from ..ships import Ship
from ..ships.files import library, load
from ..validate import Comparison
from . import RequestError, Sink
from .asked import Predicting
from .request import positive, vector

if TYPE_CHECKING:
    from ..belief.corrected import Errors
    from ..belief.fit_first import Beginning
    from ..choosing.purposes import Purpose
    from ..simulate.carried import Carrier
    from ..validate.fitness import Fitness

# Greatest current that is accepted [m/s], as in `request.surroundings`.
_MOST_CURRENT = 15.0
# What is estimated on the first seconds is listed beyond so many of its standard deviations; all of it acts.
_CLEAR = 2.0


@dataclass(frozen=True)
class Judged:
    """Trials as they are predicted and compared.

    Attributes:
        trials: corrected, in the current.
        begun: how those begin that were fitted first, by name.
        changes: what was done to them, one line each.
        read: how the instruments of each log a motion, by name: the inverse of what was done to its readings.
    """

    trials: tuple[Trial, ...]
    begun: Mapping[str, Beginning]
    changes: tuple[str, ...]
    read: Mapping[str, Callable[[Trial], Trial]]


class Carries(Protocol):
    """A ship that is predicted with what acted before each start."""

    def replay(self, trial: Trial, *, restart: float | None, smooth_start: float | None) -> Trial:
        """Prediction as of `simulate.replay.replay`."""
        ...


def compared(
    ship: Ship, trials: Iterable[Trial], restart: float | None, sigma: Mapping[str, float], base: Ship | None = None,
    *, smooth_start: float | None = None, begun: Mapping[str, Beginning] | None = None, carrier: Carries | None = None,
) -> tuple[tuple[Comparison, ...], tuple[str, ...]]:
    """Each trial beside the ship, the ship it was fitted from (`base`, or as its file says), and constant velocity.

    A trial in `begun` is compared from there on; all begin in the same state, and its manoeuvre, being cut, has no
    indices.  With a `carrier` the ship is predicted by it, and the others as they are.

    Returns:
        The comparisons, and a line for each prediction that blew up, which is left out.
    """
    from ..identify.filters import CONSTANT_VELOCITY
    from ..simulate.replay import replay
    from ..validate.comparison import compare, constant_velocity

    found: list[Comparison] = []
    failed: list[str] = []
    for trial in trials:
        rows, first = slice(0, 0), (begun or {}).get(trial.name)
        begin = None if first is None else (first.t, first.state)
        length = ship.L_pp if first is None else None
        for label, model in _models(ship, base).items():
            try:
                predicted = carrier.replay(trial, restart=restart, smooth_start=smooth_start) \
                    if carrier is not None and model is ship else \
                    replay(model, trial, restart=restart, smooth_start=smooth_start, begin=begin)
            except SimulationError as error:
                failed.append(f"{label}: {error}")
                continue
            low, high = trial.t.searchsorted([predicted.t[0], predicted.t[-1]])
            rows = slice(int(low), int(high) + 1)
            found.append(compare(trial, predicted, label=label, restart=restart, sigma=sigma, L_pp=length))
        part = trial.rows(rows)
        if len(part):
            steady = constant_velocity(part, restart, None if first is None else first.state)
            found.append(compare(part, steady, label=CONSTANT_VELOCITY, restart=restart, sigma=sigma, L_pp=length))
    return tuple(found), tuple(failed)


def carrier_of(ship: Ship, how: Predicting) -> Carrier | None:
    """The ship with what acted before each start carried on; None where no history is asked for.

    Raises:
        RequestError: with --fit-first, or a model in discrete time.
    """
    if how.history is None:
        return None
    if how.fit_first is not None:
        raise RequestError("--history: --fit-first already estimates how a trial begins; give one of the two")
    if isinstance(ship.model, Sampled):
        raise RequestError(f"--history: {ship.name} is a model in discrete time, which has no accelerations to carry "
                           "on; leave the option out")  # fmt: skip
    from ..simulate.carried import Carrier

    return Carrier.of(ship, how.history)


def scales_asked(trials: Sequence[Trial], fit: str | None) -> tuple[Mapping[str, float], str]:
    """Scale of each state, and its origin in words: the fit that is named, or the trials alone.

    Raises:
        RequestError: no fit is saved beside the model that is named.
    """
    from ..study.store import fitted_scale
    from ..validate.metrics import ESSO_OSAKA_SIGMA, scales

    held = {} if fit is None else fitted_scale(fit)
    if fit is not None and not held:
        raise RequestError(f"--scale: {fit}: no fit beside it has kept its scales; name the model.toml of a fit")
    sigma = scales(trials, held)
    if held:
        return sigma, f"as where {fit} was fitted"
    return sigma, "those of the common evaluator of this set" if sigma is ESSO_OSAKA_SIGMA \
        else "the spread of these trials"


def judged(ship: Ship, model: str, trials: Sequence[Trial], how: Predicting, sink: Sink) -> Judged:
    """The trials as they are predicted, with a note on each change.

    Those that the model was fitted to are corrected by all that the fit estimated of them: the errors of instruments
    that they share, a current, and their own currents and biases.  Other trials of the same source have the same
    instruments, and so the same errors of these; on those of another source nothing is assumed, unless it is asked
    for.  With `how.fit_first` currents and biases are estimated anew on every trial.

    Args:
        model: as the user named the ship.

    Raises:
        RequestError: a current that cannot be, no such fit, or a model in discrete time that is to be fitted first.
        DataError: a trial is too short for it.
    """
    positive(fit_first=how.fit_first)
    speed, towards = vector("--current", how.current, _MOST_CURRENT)
    if how.fit_first is not None and isinstance(ship.model, Sampled):
        raise RequestError(f"--fit-first: {ship.name} is a model in discrete time, which has no sensitivities to "
                           "fit with; leave the option out")  # fmt: skip
    right, changes, errors, made = _corrected(ship, model, trials, how)
    begun: dict[str, Beginning] = {}
    if how.current is not None:
        north, east = speed * np.cos(towards), speed * np.sin(towards)
        right = [t.having(U_C=np.full(len(t), np.hypot(north, east)), gamma_C=np.full(len(t), np.arctan2(east, north)))
                 for t in right]  # fmt: skip
        changes.append(f"--current: {how.current.replace(',', ' m/s towards ')} deg acts on every trial")
    if how.fit_first is not None:
        from ..belief.fit_first import between_trials, fit_first
        from ..study.store import summary_beside

        said = summary_beside(model)
        differing = between_trials(said.nuisances if said else {})
        begun = {t.name: fit_first(ship, t, how.fit_first, current=how.current is None, differing=differing)
                 for t in right}  # fmt: skip
        changes += [one for t in right for one in _begun_words(ship, begun[t.name], how.fit_first)]
        right = [begun[t.name].trial for t in right]
    for one in changes:
        sink.note(f"note: {one}")
    from ..belief.corrected import as_logged, summed

    every = {name: summed(own, begun[name].found if name in begun else {}) for name, own in errors.items()}
    read = {name: partial(as_logged, errors=own, model=ship.model, made=made) for name, own in every.items()}
    return Judged(tuple(right), begun, tuple(changes), read)


def _corrected(
    ship: Ship, model: str, trials: Sequence[Trial], how: Predicting
) -> tuple[list[Trial], list[str], Mapping[str, Errors], Collection[str]]:  # fmt: skip
    """The trials without the errors that a fit estimated, and a line on each that was corrected or was not.

    Returns:
        The trials, the lines, these errors by trial, and the velocities that the logger made.
    """
    from ..belief.corrected import as_true, of_trial, shared_by_all, summed, words
    from ..study.store import summary_beside

    said = summary_beside(model)
    found = said.nuisances if said else {}
    fit = model if how.instruments is None else how.instruments
    other = said if fit == model else summary_beside(fit)
    every = shared_by_all(other.nuisances if other else {})
    if how.instruments is not None and not every:
        raise RequestError(f"--instruments: {fit}: no fit beside it has estimated an error of an instrument or a "
                           "current of all trials ([nuisance.common], --free-suspects); name the model.toml of one "
                           "that has")  # fmt: skip
    anew = how.current is not None or how.fit_first is not None
    shared = {name: size for name, size in every.items() if not (anew and name.startswith("current."))}
    names = {*provenance(ship).get("trained_on", ()), *found}
    names |= {one.name for one in said.grounds.trials} if said else set()
    sources = {one.source for one in said.grounds.trials} if said else set()
    made = other.grounds.made if other else ()
    ours = [trial.name for trial in trials if trial.name in names or how.instruments]
    alike = [trial.name for trial in trials if trial.name not in ours and str(trial.meta.get("source", "")) in sources]
    lasting = {name: size for name, size in shared.items() if not name.startswith("current.")}
    theirs = {**dict.fromkeys(ours, shared), **dict.fromkeys(alike, lasting)}
    own = found if how.fit_first is None else {}
    mine = {trial.name: {name: size for name, size in of_trial(trial.name, own, ()).items()
                         if not (how.current and name.startswith("current."))} for trial in trials}  # fmt: skip
    lines = [f"{trial.name}: {words(mine[trial.name], ship.model, trial)}, taken as the fit estimated"
             for trial in trials if any(mine[trial.name].values())]  # fmt: skip
    right = [as_true(trial, theirs.get(trial.name, {}), ship.model, own=mine[trial.name], made=made)
             for trial in trials]  # fmt: skip
    errors = {name: summed(theirs.get(name, {}), one) for name, one in mine.items()}
    others = [trial.name for trial in trials if trial.name not in theirs]
    told = {f"corrected by {{}}, as the fit of {fit} estimated": (ours, shared),
            f"of the source of the trials of {fit}, so corrected by {{}}, as its fit estimated": (alike, lasting),
            "not of this study, nor of the source of its trials, so not corrected by what its fit found ({}); "
            f"--instruments {fit} does it": (others, shared)}  # fmt: skip
    lines += [f"{_named(some)}: {text.format(words(of, ship.model, trials[0]))}"
              for text, (some, of) in told.items() if some and of]  # fmt: skip
    return right, lines, errors, made


def _named(names: Sequence[str]) -> str:
    """Names of trials, the first ones where there are many."""
    return ", ".join(names) if len(names) <= 4 else f"{', '.join(names[:3])} and {len(names) - 3} more"


def _begun_words(ship: Ship, one: Beginning, span: float) -> list[str]:
    from ..belief.corrected import words
    from ..identify.diagnosis.channels import LARGE

    clear = {name: size for name, size in one.found.items() if abs(size) > _CLEAR * one.sigma[name]}
    if any(name.startswith("current.") for name in clear):
        clear |= {name: size for name, size in one.found.items() if name.startswith("current.")}
    found = words(clear, ship.model, one.trial) or f"no current and no bias beyond {_CLEAR:g} sigma"
    lines = [f"{one.trial.name}: from its first {span:g} s: {found}"]
    if one.size > LARGE and any(one.found.values()):
        lines.append(f"{one.trial.name}: the model does not explain its first {span:g} s (residuals {one.size:.2g} "
                     "times the noise); part of what was estimated is its own error")  # fmt: skip
    elif one.size > LARGE:
        lines = [f"{one.trial.name}: the model does not explain its first {span:g} s (residuals {one.size:.2g} times "
                 "the noise): no current and no bias is estimated, its own errors would pass for them; a fit with "
                 "[nuisance] current or bias says how these differ between trials"]  # fmt: skip
    return lines


def provenance(ship: Ship) -> Mapping[str, Any]:
    """How a ship was fitted, as its file says; empty where it was not."""
    found = ship.notes.get("provenance", {})
    return found if isinstance(found, Mapping) else {}


def _models(ship: Ship, fitted_from: Ship | None) -> dict[str, Ship]:
    """The ships that predict, by label: the model, and the one that it was fitted from."""
    made = provenance(ship)
    base = made.get("ship")
    if fitted_from is None and base is None:
        return {"published" if _of_the_library(ship, ship.name) else ship.name: ship}
    before = fitted_from or _began(ship, made)
    if before is None:  # fitted by a version that kept no start
        return {"fitted": ship} | ({"published": load(str(base))} if _of_the_library(ship, str(base)) else {})
    published = _of_the_library(before, before.name) and values(load(before.name).model) == values(before.model)
    return {"fitted": ship} | ({"published" if published else "untuned": before} if before.model.trained else {})


def _began(ship: Ship, made: Mapping[str, Any]) -> Ship | None:
    """The ship that a fit started from, rebuilt from its provenance; None where the file does not say."""
    began = made.get("began")
    if not isinstance(began, Mapping) or not began or ship.model.learned is not None:
        return None
    return replace(ship.having({str(path): float(value) for path, value in began.items()}), name=str(made["ship"]))


def _of_the_library(ship: Ship, name: str) -> bool:
    """Whether the library's ship of this name is one of the same structure, not another model of that ship."""
    if name not in library():
        return False
    held = load(name).model
    return type(held) is type(ship.model) and set(values(held)) == set(values(ship.model))


_ASKED = "as asked for by --limit"
# An accepted error in metres that is more than this share of the ship is meant for a larger one.
_WIDE = 0.1

STATUS = {"fit": 0, "not fit": 3, "cannot tell": 4}
"""Exit status by verdict; 1 and 2 keep their meaning, a run that failed and a request that was wrong."""


def purpose_of(purpose: str, limits: str | None) -> Purpose:
    """A purpose by its key, with the limits of ``name=value,...`` in place of its own, each in the unit it has there.

    Raises:
        RequestError: a purpose without limits, an unknown limit, or a value that is no number above zero.
    """
    from ..choosing.purposes import PURPOSES

    known = {one.key: one for one in PURPOSES if one.accuracy}
    if purpose not in known:
        raise RequestError(f"--for is '{purpose}'; errors are judged for: {', '.join(known)}")
    found = {limit.key: limit for limit in known[purpose].accuracy}
    for part in limits.split(",") if limits else ():
        name, _, value = part.strip().partition("=")
        if name not in found:
            raise RequestError(f"--limit: {unknown(name, found, 'limit')}")
        try:
            size = float(value)
        except ValueError:
            size = math.nan
        if not (size > 0.0 and math.isfinite(size)):
            raise RequestError(f"--limit: '{part.strip()}'; write {name}={found[name].size:g}, in {found[name].unit}")
        found[name] = replace(found[name], size=size, source=_ASKED)
    return replace(known[purpose], accuracy=tuple(found.values()))


def refuse(purpose: Purpose, ship: Ship, trials: Sequence[Trial], trained_on: Sequence[str]) -> None:
    """Refuse trials that cannot show whether a model is fit for a purpose, before anything is predicted.

    Raises:
        RequestError: every trial was used in the fit, or none shows what the purpose is about, or a limit in metres of
            the full-scale ship is meant for a model whose scale is not on record.
    """
    from ..validate.fitness import shows, unit_of

    unseen = [trial for trial in trials if trial.name not in trained_on]
    if not unseen:
        raise RequestError(f"--for {purpose.key}: the model was fitted to every one of these trials; give others")
    for limit in (one for one in purpose.accuracy if one.must):
        wide = next((t for t in unseen if limit.size * unit_of(limit, ship, t) > _WIDE * ship.L_pp), None)
        if limit.unit == "m" and wide is not None and limit.source != _ASKED:
            known = "a scale (ship over model) in its sidecar" if "scale" not in wide.meta else "a smaller limit"
            raise RequestError(f"--for {purpose.key}: {limit.key}={limit.size:g} m is much for {wide.name}, of a ship "
                               f"of {ship.L_pp:g} m; give {known}, or --limit {limit.key}=M")  # fmt: skip
        if not any(shows(limit, ship, trial) for trial in unseen):
            seconds = limit.horizon * ship.L_pp / ship.speed
            what = f"{limit.when} over {seconds:.3g} s or more" if limit.when else limit.about
            raise RequestError(f"--for {purpose.key}: no trial shows {limit.about} ({what}); give trials that do")


def uses(ship: Ship, trials: Sequence[Trial], trained_on: Sequence[str]) -> dict[str, str]:
    """The verdict of a model for each purpose by which errors are judged, on trials that the fit has not used."""
    from ..choosing.purposes import PURPOSES
    from ..validate.fitness import OPEN

    found: dict[str, str] = {}
    for purpose in (one for one in PURPOSES if one.accuracy):
        try:
            refuse(purpose, ship, trials, trained_on)
        except RequestError:  # no trial shows it
            found[purpose.key] = OPEN
            continue
        found[purpose.key] = fitness(purpose, ship, trials, trained_on, None).verdict
    return found


def fitness(
    purpose: Purpose, ship: Ship, trials: Sequence[Trial], trained_on: Sequence[str], smooth_start: float | None
) -> Fitness:
    """The verdicts on trials that `refuse` let pass."""
    from ..validate.fitness import judge

    return judge(ship, trials, purpose.accuracy, purpose=purpose.key, title=purpose.title,
                 trained_on=trained_on, smooth_start=smooth_start)  # fmt: skip

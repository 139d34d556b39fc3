"""Checks of a problem before anything is run, and the decorator that puts them in front of every fit.

An interval without width and bounds that exclude the start never get here: `Free` refuses them.
"""

from __future__ import annotations

import functools
import json
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any, TypeVar, cast

import numpy as np

from ..core.once import by_identity
from ..core.parameters import specs, unknown
from ..data import Array, DataError, Trial
from ..data.check import Finding, check_folder, check_set
from ..data.prepare import derivable, derived, measured
from ..models import STATES, Sampled, unit
from ..ships import Ship
from ..simulate.begun import too_little, untold
from ..simulate.replay import gap_words, gaps, logged, no_wind, predicted, unread, wind_words
from ..simulate.steering import filled_words
from . import Estimator, Fit, Issue, Nuisance, Problem, StudyError
from .components.actuation import exceeded
from .posterior.acting import acting
from .posterior.verdicts import manoeuvre_for
from .record import Record, Settings, compared_as, even, every_of, scales, step_of
from .trajectory.objective import TrajectoryObjective
from .trajectory.suspects import level_of
from .vector import Vector

# Kinds of findings of `check` that make a fit wrong rather than poor.
_FATAL = ("sign", "axes", "unit", "scale", "step", "short")
# Keys of findings that the lint tells in its own words, and the errors of instruments that answer others if estimated.
_OWN = {"quality", "gaps", "missing_rows", "uneven_steps", "time_quantised"}
_ANSWERS = {
    "current": "current", "through_water": "current", "heading_bias": "bias.psi", "gyro_bias": "bias.r",
    "log_bias": "bias.u", "log_scale": "scale.u", "gyro_scale": "scale.r", "lever_arm": "antenna",
    "rudder_offset": "offset.delta", "rudder_scale": "scale.delta", "rudder_sides": "port.delta",
}  # fmt: skip
# Ship and trial may differ by this much in length before one of them is taken to be scaled.
_LENGTH = 0.02


# Kinds of errors of instruments that have the unit of their channel.
_ANGLES = ("bias", "offset", "direction")
# Length and stride of the predictions by which sensitivity is checked [s].
_WINDOW, _EVERY = 100.0, 1.0
# A parameter hardly acts where its typical change moves the predictions by less than this, in squared sigmas in all.
_FAINT = 0.01
# Warnings that a first screen lists whole, and parameters that it names.
_FEW = 3


def lint(
    problem: Problem, test: Sequence[Trial] = (), estimator: Estimator | None = None, *, felt: bool = True
) -> tuple[Issue, ...]:
    """Findings that forbid a run or should be known before it, errors first.

    Args:
        problem: the problem.
        test: trials that only the report uses.
        estimator: the estimator that will fit it; None assumes `shooting:Trajectory`.
        felt: whether to predict the trials, to check that each parameter changes some prediction.
    """
    found = _unrun(problem, estimator, *test)
    if felt and not any(issue.severity == "error" for issue in found):
        found = (*found, *_felt(problem))
    return tuple(sorted(found, key=lambda issue: issue.severity != "error"))


@by_identity  # before a study is run all of it is asked for, and this again when its fit begins
def _unrun(problem: Problem, estimator: Estimator | None, *test: Trial) -> tuple[Issue, ...]:
    """What is found without a prediction."""
    found = [*_free(problem), *_scales(problem), *_levels(problem), *_starts(problem, estimator), *mass(problem)]
    found += [*_trials(problem, test, estimator is None or getattr(estimator, "partial", False)),
              *_checked(problem, test), *_sets(problem, test)]
    if estimator is not None and tested_by(problem, estimator) and not any(one.severity == "error" for one in found):
        found += unmet(problem, compared_as(estimator))
    return tuple(found)


def lines(issues: Iterable[Issue]) -> tuple[str, ...]:
    """Warnings and errors as lines, in order; a finding that several trials share is listed once, with their number."""
    places: dict[tuple[str, str], dict[str, None]] = {}
    for issue in issues:
        places.setdefault((issue.severity, issue.text), {})[issue.where] = None
    return tuple(f"{severity}: {_named(tuple(where))}: {text}" for (severity, text), where in places.items())


def headlines(issues: Sequence[Issue]) -> tuple[str, ...]:
    """The warnings of `lint` for a first screen: as they are where these are few, else their heads in a line a kind."""
    whole = lines(issues)
    if len(whole) <= _FEW:
        return whole
    faint = [issue.where for issue in issues if issue.faint]
    other = lines(issue for issue in issues if not issue.faint)
    found = [f"warning: {len(other)} doubts: {'; '.join(map(_head, other))}"] if len(other) > 1 else list(other)
    if faint:
        more = f" and {len(faint) - _FEW} more" if len(faint) > _FEW else ""
        found.append(f"warning: hardly felt in these trials: {', '.join(faint[:_FEW])}{more}; leave them out of "
                     "[free], or add a manoeuvre that excites them (seatrial design)")  # fmt: skip
    return (*found[:-1], f"{found[-1]}; --details and the page tell each with its remedy")


def _head(line: str) -> str:
    """Where and what of a warning, without its evidence and remedy."""
    return re.split(r" \(|; ", line.removeprefix("warning: "))[0].removeprefix("free: ")


def _named(where: Sequence[str]) -> str:
    return where[0] if len(where) == 1 else f"{where[0]} and {len(where) - 1} more"


def raise_on_errors(issues: Iterable[Issue]) -> None:
    """Raise a StudyError that names the first error, and how many more there are."""
    errors = [issue for issue in issues if issue.severity == "error"]
    if errors:
        more = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise StudyError(f"{errors[0].where}: {errors[0].text}{more}")


_F = TypeVar("_F", bound=Callable[..., Fit])


def linted(fit: _F) -> _F:
    """The `fit` of an estimator that raises a StudyError on the first error of `lint` before it begins.

    A problem is checked once: those that an estimator derives from it, for a stage, a fold or a start, are not
    checked again.  Whether the trials are sensitive to each parameter is left to `lint` itself and to the verdict of
    the fit: it takes a compilation.
    """

    @functools.wraps(fit)
    def checked(self: Any, problem: Problem, *args: Any, **options: Any) -> Fit:
        if not problem.linted:
            raise_on_errors(lint(problem, estimator=self, felt=False))
            problem = replace(problem, linted=True)
            if tested_by(problem, self):
                from .diagnosis.stages import in_stages

                pool = options.pop("pool", None)
                one = fit if pool is None else functools.partial(fit, pool=pool)
                return in_stages(one, self, problem, *args, **options)
        return fit(self, problem, *args, **options)

    return cast(_F, checked)


def tested_by(problem: Problem, estimator: Any) -> bool:
    """Whether the residuals of a fit can be tested: an estimator of trajectories, and a model in continuous time."""
    settings = ("window", "every", "dt", "method", "threads")
    return bool(problem.free) and not isinstance(problem.ship.model, Sampled) and all(
        hasattr(compared_as(estimator), name) for name in settings
    )


def _free(problem: Problem) -> Iterator[Issue]:
    known = specs(problem.ship.model)
    if not problem.free and problem.ship.model.learned is None:  # a network is fitted by its weights
        yield Issue("error", "free", f"no free parameter; name some of {', '.join(list(known)[:6])}, ...")
    for path, count in Counter(free.path for free in problem.free).items():
        if path not in known:
            yield Issue("error", "free", unknown(path, known))
        elif path == "dt" and isinstance(problem.ship.model, Sampled):
            yield Issue("error", "free", "dt is the sample time of a model in discrete time, which no fit can move")
        elif count > 1:
            yield Issue("error", "free", f"{path} is named {count} times; once is enough")
    for free in problem.free:
        meaning = known.get(free.path)
        if meaning and not meaning.low <= free.start <= meaning.high:
            reach = f"[{meaning.low:g}, {meaning.high:g}]"
            yield Issue("error", free.path, f"starts at {free.start:g}, outside its physical range {reach}")


def _scales(problem: Problem) -> Iterator[Issue]:
    tables = {"loss.sigma": problem.loss.sigma, "nuisance.initial": problem.nuisance.initial,
              "nuisance.bias": problem.nuisance.bias}  # fmt: skip
    motion = problem.ship.model.motion
    for where, table in tables.items():
        for name, value in table.items():
            if name not in motion:
                yield Issue("error", where, unknown(name, motion, "channel"))
            elif not value > 0 or (math.isinf(value) and where != "nuisance.initial"):  # there, inf is free
                yield Issue("error", f"{where}.{name}", f"is {value:g}; it must be above zero")
            elif name == "psi" and math.pi < value < math.inf:
                in_radians = f"{value:g} deg is {math.radians(value):.3g} rad"
                yield Issue("error", f"{where}.psi", f"is {value:g} rad, more than half a turn; {in_radians}")
    for name, value in problem.nuisance.common.items():
        where = f"nuisance.common.{name}"
        if not value > 0:
            yield Issue("error", where, f"is {value:g}; it must be above zero")
        elif name.partition(".")[0] in _ANGLES and _angle(name.partition(".")[2]) and math.pi < value < math.inf:
            in_radians = f"{value:g} deg is {math.radians(value):.3g} rad"
            yield Issue("error", where, f"is {value:g} rad, more than half a turn; {in_radians}")
    if problem.loss.correlation is not None and problem.loss.correlation < 0:
        yield Issue("error", "loss.correlation", f"is {problem.loss.correlation:g} s; it must be zero or above")


def _levels(problem: Problem) -> Iterator[Issue]:
    """Levels of trials that are not fitted to."""
    trials = [trial.name for trial in problem.trials]
    for name, (control, trial) in ((name, level_of(name)) for name in problem.nuisance.common):
        if control and trial not in trials:
            yield Issue("error", f"nuisance.common.{name}", unknown(trial, trials, "training trial"))


def _angle(channel: str) -> bool:
    """Whether a channel is an angle in radians; a wind is one by its direction."""
    return channel in ("psi", "wind") or (channel not in STATES and unit(channel) == "rad")


def _starts(problem: Problem, estimator: Estimator | None) -> Iterator[Issue]:
    """Initial states that are taken as measured, with the estimator's remedy for their noise (`starts_remedy`)."""
    where, remedy = getattr(estimator, "starts_remedy", ("", ""))
    if remedy and not problem.loss.correlation and not problem.nuisance.initial:
        yield Issue(
            "warning", where, "every sample counts as independent while windows start at measured states: "
            f"the noise of initial states counts as information, and sigma is too small; {remedy}",
        )  # fmt: skip


_TELLS = {
    "x": "a current and the drift of the track", "psi": "the heading to the wind and of the first row",
    "u": "the speed but by the track", "v_m": "the sway but by track and yaw", "r": "the rate but by the heading",
}
"""What stays unknown, or is known less well, without a reading of a state."""


def _refused(trial: Trial, needed: Sequence[str], partial: bool) -> str:
    """Why a trial cannot be fitted to: a control that it lacks, or too little of the motion; else empty."""
    absent = [name for name in needed if name not in trial]
    wanted = [name for name in absent if not partial or name not in STATES]
    if wanted:
        lost = [name for name in wanted if name not in STATES]
        remedy = ("; with orders on record, or about constant revolutions: assumed = "
                  f"{json.dumps(lost)} in [data] of the study" if lost else "")  # fmt: skip
        return f"no channel {', '.join(wanted)}; the model needs {', '.join(needed)}{derivable(trial, wanted)}{remedy}"
    return too_little(trial)


def _unknown(lacking: Sequence[str]) -> str:
    listed = "; ".join(dict.fromkeys(_TELLS["x" if name == "y" else name] for name in lacking))
    return f"no readings of {', '.join(lacking)}, so its start is estimated from the others; not told: {listed}"


def _untold(trial: Trial, lacking: Sequence[str]) -> Iterator[Issue]:
    """States without a reading, and those that are made from others."""
    made = derived(trial)
    if never := [name for name in lacking if name not in made]:
        yield Issue("warning", trial.name, _unknown(never))
    if said := ", ".join(f"{name} (from {made[name]})" for name in lacking if name in made and logged(trial, name)):
        yield Issue("warning", trial.name,
                    f"made from others, so no measurement and left out of the residuals: {said}")  # fmt: skip


def _trials(problem: Problem, test: Sequence[Trial], partial: bool) -> Iterator[Issue]:
    if not problem.trials:
        yield Issue("error", "trials", "no trial to train on")
    rows = 0
    for trial in (*problem.trials, *problem.validation, *test):
        needed = (*STATES, *problem.ship.model.controls)
        if refused := _refused(trial, needed, partial and not isinstance(problem.ship.model, Sampled)):
            yield Issue("error", trial.name, refused)
            continue
        lacking = untold(trial)
        yield from _untold(trial, lacking)
        yield from _trial(problem, trial)
        if problem.ship.model.motion != STATES and not logged(trial, "phi"):
            yield Issue("warning", trial.name, "no heel (phi); the ship rolls, and only sway and yaw tell of it")
        if any(trial is one for one in problem.trials):
            told = [name for name in needed if name not in lacking]
            rows += int(np.isfinite(trial.stack(*told)).all(axis=1).sum())
    for words in exceeded(problem.ship, problem.trials):
        yield Issue("warning", "actuators", words)
    if len(problem.trials) == 1 and partial:  # others refuse a single trial, or say so themselves
        kind = str(problem.trials[0].meta.get("kind", "")) or "its kind"
        yield Issue("warning", "trials", f"one trial only: what it does not excite stays at its prior, and all but "
                    f"{kind} at its speeds and rudder angles is extrapolation")  # fmt: skip
    if problem.trials and rows < len(problem.free):
        yield Issue("warning", "trials", f"{rows} complete samples for {len(problem.free)} free parameters")


def _trial(problem: Problem, trial: Trial) -> Iterator[Issue]:
    ship = problem.ship
    length, name = trial.meta.get("L_pp"), trial.meta.get("ship")
    if isinstance(length, int | float) and abs(length / ship.L_pp - 1) > _LENGTH:
        remedy = 'scale it (scale_to = "ship" in [data], data.prepare.froude_scaled), or take the ship it belongs to'
        yield Issue("error", trial.name, f"is of a ship of {length:g} m, {ship.name} has {ship.L_pp:g} m; {remedy}")
    elif name is not None and name not in ship.names:
        yield Issue("warning", trial.name, f"is of ship '{name}', the study is of '{ship.name}'")
    windy = ship.model.feels_wind
    if windy and no_wind(trial, ship.model):
        yield Issue("warning", trial.name, "has no wind (U_T, gamma_T), which the model uses; still air is assumed")
    if told := wind_words(trial, windy):
        yield Issue("warning", trial.name, told)
    part = trial.rows(predicted(trial))
    left_out = isinstance(ship.model, Sampled)
    if missing := (gaps if left_out else unread)(part, ship.model):
        fate = "rows with such a gap are left out" if left_out else filled_words(part, ship.model, missing)
        yield Issue("warning", trial.name, f"{gap_words(part, missing)}; {fate}")
    yield from commands(problem, trial)
    yield from sampling(trial)


def doubts(problem: Problem, test: Sequence[Trial] = ()) -> tuple[Finding, ...]:
    """What `check` says of all trials of a problem together, of warnings those that the problem does not answer.

    Gaps and uneven steps are left to `lint`, which says what becomes of them.
    """
    trials = {id(trial): trial for trial in (*problem.trials, *problem.validation, *test)}
    own = problem.nuisance
    estimated = (*own.common, *(f"bias.{name}" for name in own.bias), *(["current"] if own.current > 0 else []))
    answered = {key for key, name in _ANSWERS.items() if any(one.startswith(name) for one in estimated)}
    return tuple(
        finding for finding in check_folder(tuple(trials.values()))
        if finding.severity == "error" or (finding.severity == "warning" and finding.key not in _OWN | answered)
    )


def _checked(problem: Problem, test: Sequence[Trial]) -> Iterator[Issue]:
    for finding in doubts(problem, test):
        severity = "error" if finding.severity == "error" and finding.kind in _FATAL else "warning"
        yield Issue(severity, finding.where, f"{finding.what} ({finding.evidence}); {finding.remedy}")


def _sets(problem: Problem, test: Sequence[Trial]) -> Iterator[Issue]:
    sets = (("training", problem.trials), ("validation", problem.validation), ("test", test))
    for k, (earlier, mine) in enumerate(sets):
        names = {trial.name for trial in mine}
        for later, yours in sets[k + 1 :]:
            for trial in yours:
                if trial.name in names:
                    yield Issue("error", trial.name, f"is in {earlier} and in {later}; keep it in one")
            apart = [trial for trial in yours if trial.name not in names]
            for finding in check_set(mine, apart):
                what = finding.what.replace("training and test", f"{earlier} and {later}")
                remedy = finding.remedy.replace("test", later).replace("training", earlier)
                yield Issue("error", finding.where, f"{what} ({finding.evidence}); {remedy}")
    order = {trial.name: k for k, trial in enumerate(problem.trials)}
    for finding in check_set(problem.trials, problem.trials):
        first, second = finding.trials
        if order[first] < order[second]:
            yield Issue("warning", finding.where, f"are one recording, counted twice ({finding.evidence}), so that "
                        "sigma is too small; leave one of them out")  # fmt: skip
    if not (problem.validation or test):
        yield Issue("warning", "validation", "no trial is held out; nothing is known of unseen manoeuvres")


def _felt(problem: Problem) -> Iterator[Issue]:
    """Parameters to which no prediction of the training trials is sensitive at the start of the search."""
    if isinstance(problem.ship.model, Sampled):
        return
    dt = step_of(problem.trials)
    # Without priors, as these are no data, and a difference of the two would be rounding.
    free = tuple(replace(one, sigma=math.inf, tied=()) for one in problem.free)
    bare = replace(problem, nuisance=Nuisance(), free=free)
    try:
        objective = TrajectoryObjective.build(
            bare, bare.trials, scales(bare), window=max(_WINDOW, dt), dt=dt,
            every=max(round(_EVERY / dt), 1), method="rk4", threads=None,
        )  # fmt: skip
    except DataError as error:
        yield Issue("error", "trials", str(error))
        return

    def known(values: Array) -> Array:
        with np.errstate(over="ignore", invalid="ignore"):
            return objective.normal(values, np.zeros(0)).H

    found = known(bare.vector.start)
    if np.isfinite(found).all():  # else the model blows up there, which the estimator reports by trial and state
        yield from _told_apart(problem.vector, found, known)


def _told_apart(vector: Vector, found: Array, known: Callable[[Array], Array]) -> Iterator[Issue]:
    """Parameters that no data of these trials determine, one by one and by what acts of them; those hardly felt."""
    for free, felt in zip(vector.free, np.diag(found), strict=True):
        held = np.isfinite(free.sigma)
        alone = "would be its prior" if held else "would be arbitrary"
        if not felt > 1e-12 * free.scale**-2.0:
            yield Issue(
                "warning" if held else "error", free.path,
                f"the data are insensitive to it at {free.start:g}; the result {alone}; leave it out of [free], "
                "or add a manoeuvre", faint=held,
            )  # fmt: skip
        elif felt * free.scale**2 < _FAINT:
            yield Issue(
                "warning", free.path, f"hardly acts in these trials: they would leave it uncertain by "
                f"{felt**-0.5 / free.scale:.2g} times what it may change; {manoeuvre_for(free.path)} would excite it "
                "(seatrial design)", faint=True,
            )  # fmt: skip
    for one in acting(vector.paths, found, vector.start, known):
        if one.count:
            yield Issue("warning", "free", one.words)


# Measured revolutions may leave the tested range by this share of it: noise, and a governor that overshoots.
_BEYOND = 0.01
# Readings of a channel that a fit meets, as a share of those that it could.
_MET = 0.5
# Steps may differ by this share before a trial is taken at even steps, as `windows` does.
_UNEVEN = 0.02


def mass(problem: Problem) -> Iterator[Issue]:
    """Doubts about the mass matrix at the start; warnings only, because fitted ones often share them."""
    for text in problem.ship.model.mass_doubts(float(problem.ship.L_pp)):
        yield Issue("warning", "inertia", f"{text}; the fit starts there anyway")


def tested(ship: Ship) -> dict[str, tuple[float, float]]:
    """Revolutions [1/s], or throttle, for which the thrust map of each thruster holds, by control; unlimited, none."""
    found: dict[str, tuple[float, float]] = {}
    for name, part in ship.model.thrusters_by_name.items():
        (low, high), control = part.tested, f"{part.prefixes[0]}_{name}"
        if math.isfinite(high - low):
            servo = ship.actuators.of(control)
            throttled = part.prefixes[0] == "throttle"
            found[control] = (low, high) if throttled else (max(float(servo.low), low), min(float(servo.high), high))
    return found


def untested(ship: Ship, trial: Trial) -> Iterator[str]:
    """Revolutions of a trial beyond those for which thrust was tested, a thruster each."""
    for control, (low, high) in tested(ship).items():
        if control not in trial or not np.isfinite(trial[control]).any():
            continue
        least, most = float(np.nanmin(trial[control])), float(np.nanmax(trial[control]))
        slack = _BEYOND * max(abs(low), abs(high))
        if least < low - slack or most > high + slack:
            own = "" if unit(control) == "-" else f" {unit(control)}"
            yield f"{control} goes from {least:.4g} to {most:.4g}{own}, thrust was tested from {low:g} to {high:g}{own}"


def commands(problem: Problem, trial: Trial) -> Iterator[Issue]:
    """Commands beyond the thrust map, and commands of thrusters that the ship lacks."""
    ship = problem.ship
    for what in untested(ship, trial):
        if problem.extrapolate:
            yield Issue("warning", trial.name, f"{what}; extrapolated, as the problem allows")
        else:
            yield Issue("error", trial.name, f"{what}; test further, leave these rows out, or set "
                        "extrapolate = true in [data]")  # fmt: skip
    spare = [name for name in _thrusting(ship, trial) if np.nanmax(np.abs(trial[name]), initial=0.0) > 0]
    if spare:
        names = ", ".join(ship.model.thrusters_by_name)
        yield Issue("error", trial.name, f"commands thrusters by {', '.join(spare)} that {ship.name} lacks (it has "
                    f"{names}); add them to the ship, rename the columns, or take them out")  # fmt: skip


def _thrusting(ship: Ship, trial: Trial) -> list[str]:
    """Channels named like controls of thrusters that the ship lacks."""
    own = [f"{prefix}_{name}" for name, part in ship.model.thrusters_by_name.items() for prefix in part.prefixes]
    stems = {control.partition("_")[0] for control in own}
    return [
        name for name in trial.channels
        if name.partition("_")[0] in stems and name not in (*own, "n_P") and not name.endswith(("_cmd", "_sd"))
        and not name.startswith("n_P_") and "_" in name
    ]  # fmt: skip


def unmet(problem: Problem, settings: Settings) -> Iterator[Issue]:
    """Sparse readings that lie between the rows that a fit compares, or between even rows: they count for nothing."""
    dt = step_of(problem.trials, settings.dt)
    every, model = every_of(settings.every, dt), problem.ship.model
    window = settings.window or max(trial.duration for trial in problem.trials)
    steps = max(round(window / dt), 1) + 1
    for trial in problem.trials:
        record = Record.of(even(trial, dt, model), model)
        cut = [record.window(first, steps, every, np.ones(len(model.motion))) for first in record.begins(steps - 1)]
        met = np.unique(np.concatenate([piece.rows[piece.inside] for piece in cut])) if cut else np.zeros(0, np.intp)
        for k, name in enumerate(model.motion):
            read = int(np.isfinite(trial[name]).sum()) if measured(trial, name) else 0
            count = int(np.isfinite(record.state[met, k]).sum())
            if count < _MET * min(read, met.size):
                remedy = ("every = 1 in [estimator] compares every row" if every > 1
                          else f"dt = {0.5 * dt:.3g} in [estimator] has rows between")  # fmt: skip
                yield Issue("warning", trial.name, f"{count} of {read} readings of {name} lie in the rows that are "
                            f"compared, {every * dt:.3g} s apart; {remedy}")  # fmt: skip


def sampling(trial: Trial) -> Iterator[Issue]:
    """Uneven steps, where the fit interpolates."""
    steps = np.diff(trial.t)
    off = np.abs(steps - trial.dt) > _UNEVEN * trial.dt
    if off.any():
        yield Issue("warning", trial.name, f"{int(off.sum())} of {steps.size} steps differ from {trial.dt:.3g} s (from "
                    f"{steps.min():.3g} to {steps.max():.3g} s); taken at even steps by interpolation")  # fmt: skip

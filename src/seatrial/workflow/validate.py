"""Checks of trials; free-running predictions of trials by a model, and their comparison with the measurements."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from dataclasses import replace as having
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core.version import __version__
from ..data import DataError, Trial
from ..data.check import Finding, check_folder, check_set
from ..data.prepare import steps_text
from ..data.trialfile import read_trials, write_trials
from ..engine import SimulationError
from ..report.blocks import fields, joined, line
from ..report.evidence import assumptions
from ..report.judging.fans import held_table, words
from ..report.judging.fitness import brief
from ..report.report import Report, worse_words
from ..ships import Ship, ShipError
from ..ships.felt import feels
from ..ships.files import load
from ..simulate.carried import Carrier
from ..simulate.replay import gap_words, no_wind, predicted, replay, unread, wind_words
from ..simulate.steering import filled_words
from ..validate.metrics import scale_words
from . import SILENT, Document, Outcome, RequestError, Sink
from .asked import Bands, Predicting
from .comparing import (
    Judged,
    carrier_of,
    compared,
    fitness,
    judged,
    provenance,
    purpose_of,
    refuse,
    scales_asked,
)
from .reports import comparisons as table_of
from .request import PAGES, as_steered, banded, grounds_of, make_folder, positive, separate, untested

if TYPE_CHECKING:
    from ..belief.bands.prediction import Fan
    from ..belief.coverage import Coverage
    from ..belief.spread import Spread
    from ..choosing.purposes import Purpose
    from ..report.judging.fans import BandsHeld
    from .evidence.fans import Banding

_SEVERITIES = {"error": "error", "warning": "warning", "info": "note"}
# A time step above so many median steps of the trial gets a warning.
_LEAP = 10


def check(
    paths: Sequence[Path], *, against: Sequence[Path] = (), out: Path | None = None, remedy: Path | None = None,
    sink: Sink = SILENT,
) -> Outcome[Mapping[str, Sequence[Finding]]]:
    """Findings of each trial; against a training set also overlap and coverage.

    Args:
        paths: trial files, or folders of them.
        against: those of a training set, or a study, whose training trials are meant.
        out: page of the comparison to write (.html).
        remedy: file to write with the steps of the remedies (`prepare.steps`), for a person to read and `mend`.

    Returns:
        The findings by trial; those of severity "error" are in `errors`.

    Raises:
        RequestError: a page is asked for without a training set, or is no .html.
        DataError: a file cannot be read.
    """
    if out is not None and not against:
        raise RequestError("-o: a page is written of a comparison; name the training files with --against")
    if out is not None and out.suffix.lower() not in PAGES:
        raise RequestError(f"{out}: a page ends in .html")
    if remedy is not None and remedy.suffix.lower() != ".toml":
        raise RequestError(f"{remedy}: a file of steps ends in .toml")
    trials = read_trials(paths)
    every = list(check_folder(trials))
    if remedy is not None:
        _write_remedies(remedy, every, paths, sink)
    covered: list[Coverage] = []
    if against:
        overlaps, covered = _compared(_training(against), trials, out, sink)
        every += overlaps
    found = {trial.name: [f for f in every if trial.name in _about(f)] for trial in trials}
    counts = {s: sum(f.severity == s for f in every) for s in _SEVERITIES}
    more = {"coverage": {c.name: c.numbers() for c in covered}} if against else {}
    document = {"trials": {name: [asdict(f) for f in some] for name, some in found.items()}, "counts": counts, **more}
    many = ((len(found), "trial"), *((counts[s], word) for s, word in _SEVERITIES.items()))
    first, *rest = (f"{count} {word}{'s' * (count != 1)}" for count, word in many)
    total = f"{first}: {', '.join(rest)}"
    shown = joined(map(line, (*map(str, every), *map(str, covered), total)))
    return Outcome(found, fields(document, shown), tuple(str(f) for f in every if f.severity == "error"))


def _training(paths: Sequence[Path]) -> tuple[Trial, ...]:
    """Trials of files and folders, and of a study those that its fit sees: what it keeps back may lie beside them."""
    from ..study.study import read_study

    studies = [path for path in paths if path.suffix.lower() == ".toml"]
    files = [path for path in paths if path not in studies]
    theirs = [trial for path in studies for trial in read_study(path).problem.trials]
    return (*(read_trials(files) if files else ()), *theirs)


def _write_remedies(file: Path, found: Sequence[Finding], paths: Sequence[Path], sink: Sink) -> None:
    """Write the steps of all remedies, and say how to apply them; no file where no step helps."""
    steps = [(f"{one.where}: {one.what}", one.steps) for one in found if one.steps and one.severity != "info"]
    if not steps:
        sink.note("no remedy is a change of the trials; no file of steps is written")
        return
    make_folder(file.parent)
    file.write_text(steps_text(steps), encoding="utf-8")
    again = shlex.join(["seatrial", "mend", *map(str, paths), "--by", str(file)])
    sink.note(f"wrote {file}; read it, then run: {again} -o DIR")


def _about(finding: Finding) -> tuple[str, ...]:
    """Names of the trials under which a finding is listed: of an overlap, the one under test."""
    return finding.trials[-1:] if finding.kind == "overlap" else finding.trials


def _compared(
    train: Sequence[Trial], trials: Sequence[Trial], out: Path | None, sink: Sink
) -> tuple[tuple[Finding, ...], list[Coverage]]:
    """Recordings that both share, and how the training set covers each trial; the page where one is asked for."""
    from ..belief.coverage import Reference, coverage, remembered, usual
    from ..data.prepare import drop_trailing_gaps

    overlaps = check_set(train, trials)
    whole, ours = ([drop_trailing_gaps(t) for t in some] for some in (train, trials))
    reference = Reference.of(whole, remembered(whole, usual([*whole, *ours])))
    covered = [coverage(reference, trial) for trial in ours]
    if out is not None:
        from ..report.judging.coverage import page
        from ..report.page import write

        out.parent.mkdir(parents=True, exist_ok=True)
        write(out, page(reference, whole, ours, covered, [str(f) for f in overlaps]))
        sink.note(f"wrote {out}")
    return overlaps, covered


def validate(
    model: str, paths: Sequence[Path], *, out: Path | None = None, how: Predicting = Predicting(),
    scale: str | None = None, purpose: str | None = None, limits: str | None = None, bands: Bands = Bands(),
    sink: Sink = SILENT,
) -> Outcome[Report]:  # fmt: skip
    """Compare a model and its baselines with trials, and judge it for a purpose where one is named.

    Args:
        model: a name of the library, or a ship file.
        paths: trial files, or folders of them.
        out: page to write, with its numbers beside it.
        how: the trials are predicted.
        scale, limits: as the options of `seatrial validate`.
        purpose: as its option --for; the verdict is `Report.fitness`.
        bands: of the predictions, whose coverage is `Report.bands`.

    Returns:
        The report; a prediction that blew up is in `errors`.

    Raises:
        RequestError, ShipError, DataError: what is asked for cannot be done.
    """
    if out is not None and out.suffix.lower() not in PAGES:
        raise RequestError(f"{out}: a report ends in .html; its numbers go beside it as .json")
    wanted = _purpose(purpose, limits, how.fit_first)
    positive(restart=how.restart, smooth_start=how.smooth_start, history=how.history)
    banding = _banding(model, bands, how)
    ship, trials = _read(model, paths, sink)
    made = provenance(ship)
    seen = tuple(made.get("trained_on", ()))
    if wanted is not None:
        refuse(wanted, ship, trials, seen)
    sigma, origin = scales_asked(trials, scale)
    scaled = f"{scale_words(sigma)} ({origin})"
    asked = judged(ship, model, trials, how, sink)
    carrier = carrier_of(ship, how)
    comparisons, failed = compared(
        ship, asked.trials, how.restart, sigma, smooth_start=how.smooth_start, begun=asked.begun,
        carrier=carrier if banding is None or how.history is None else banding,
    )  # fmt: skip
    held = None if banding is None else _held(banding, asked, how.restart, sink)
    spread = spread_of(model, ship, trials, sink)
    fit = None if wanted is None else fitness(wanted, ship, asked.trials, seen, how.smooth_start)
    report = Report(
        f"{ship.name}: validation", comparisons, trained_on=seen, fitness=fit,
        findings=(*(str(s) for s in spread if s.verdict != "inside"),
                  *(str(f) for f in check_folder(trials) if f.severity != "info")),
        assumptions=assumptions(ship), fit_first=how.fit_first, changes=asked.changes, bands=held,
        provenance={"model": model, "version": f"seatrial {__version__}", "trials": ", ".join(map(str, paths)),
                    "errors divided by": scaled, **_told(how),
                    **{k: str(made[k]) for k in ("study", "digest", "date") if k in made}},
    )  # fmt: skip
    if out is not None:
        sink.note(f"wrote {report.write(out)}")
    begun = {"fit_first": {name: one.numbers() for name, one in asked.begun.items()}} if asked.begun else {}
    document = {**report.numbers(), **begun, **spread_numbers(spread)}
    leads = worse_words(report)
    shown = joined(map(line, leads)) + table_of(report) + line(f"errors divided by: {scaled}")
    shown += brief(fit) if fit else ()
    shown += held_table(held.rows) + line(words(held.rows, held.level)) if held else ()
    return Outcome(report, fields(document, shown), failed, leads)


def _told(how: Predicting) -> Mapping[str, str]:
    """How the trials were predicted, for the report."""
    told = {"restart": "none" if how.restart is None else f"{how.restart:g} s"}
    if how.smooth_start is not None:
        told["starts"] = f"from the readings of {how.smooth_start:g} s"
    if how.history is not None:
        told["carried on"] = f"what acted in {how.history:g} s before each start"
    return told


def _purpose(purpose: str | None, limits: str | None, fit_first: float | None) -> Purpose | None:
    """The purpose that is asked for, with its limits.

    Raises:
        RequestError: it cannot be judged, or not so.
    """
    if purpose is None:
        if limits is not None:
            raise RequestError("--limit: it changes a limit of a purpose; name one with --for")
        return None
    if fit_first is not None:
        raise RequestError("--for: its windows start in measured states; leave --fit-first out")
    return purpose_of(purpose, limits)


def predict(
    model: str, paths: Sequence[Path], out: Path, *, how: Predicting = Predicting(), bands: Bands = Bands(),
    sink: Sink = SILENT,
) -> Outcome[tuple[Trial, ...]]:  # fmt: skip
    """Predict trials on their own rows, as their instruments would log them, and write trial files to `out`.

    Bands go to the folder `bands` below it, a file of lower and upper edges a trial.

    Returns:
        The predictions; a trial that cannot be predicted is in `errors`.

    Raises:
        RequestError, ShipError, DataError: what is asked for cannot be done; `out` would overwrite the trials.
    """
    positive(restart=how.restart, smooth_start=how.smooth_start, history=how.history)
    banding = _banding(model, bands, how)
    ship, trials = _read(model, paths, sink, out)
    predictions: list[Trial] = []
    fans: list[Fan] = []
    failed: list[str] = []
    asked = judged(ship, model, trials, how, sink)
    carrier = carrier_of(ship, how)
    for trial in asked.trials:
        try:
            one, made = _predicted(ship, asked, trial, how, banding or carrier, sink)
            predictions.append(one)
            fans += [] if made is None else [made]
        except SimulationError as error:  # the other trials are predicted all the same
            failed.append(str(error))
    _note_untested(model, ship, asked.trials, predictions, sink)
    make_folder(out)
    write_trials(predictions, out)
    from .evidence.fans import write_fan

    written = (*(str(out / f"{one.name}.csv") for one in predictions), *(str(write_fan(one, out)) for one in fans))
    spread = spread_of(model, ship, trials, sink)
    begun = {"fit_first": {name: one.numbers() for name, one in asked.begun.items()}} if asked.begun else {}
    document = {"model": ship.name, "restart": how.restart, **({} if how.history is None else {"history": how.history}),
                "written": list(written), **begun, **spread_numbers(spread)}
    return Outcome(tuple(predictions), fields(document, joined(map(line, written))), tuple(failed))


def _predicted(
    ship: Ship, asked: Judged, trial: Trial, how: Predicting, by: Banding | Carrier | None, sink: Sink
) -> tuple[Trial, Fan | None]:  # fmt: skip
    """A trial predicted, as its instruments log it, and its bands, where what makes them is given."""
    first, made = asked.begun.get(trial.name), None
    if by is None:
        begin = None if first is None else (first.t, first.state)
        one = replay(ship, trial, restart=how.restart, smooth_start=how.smooth_start, begin=begin)
    elif isinstance(by, Carrier):
        one = by.replay(trial, restart=how.restart, smooth_start=how.smooth_start)
    else:
        one, made = by.predicted(trial, how.restart, sink.note, first)
    one = asked.read[trial.name](one)
    one = one if first is None else one.noting(f"begins at {first.t:g} s in an estimated state")
    return one, None if made is None else having(made, predicted=one)


def _note_untested(
    model: str, ship: Ship, trials: Sequence[Trial], predictions: Sequence[Trial], sink: Sink
) -> None:  # fmt: skip
    """Say which predictions leave what the trials of the fit tested."""
    grounds, measured = grounds_of(model, sink.note), {trial.name: trial for trial in trials}
    for one in predictions:
        for told in untested(grounds, ship, as_steered(measured[one.name], one)):
            sink.note(told)


def _banding(model: str, bands: Bands, how: Predicting) -> Banding | None:
    """What bands are made with; None where none are asked for.

    Raises:
        RequestError, StudyError: as of `Banding.of`.
    """
    if not banded(bands):
        return None
    from .evidence.fans import Banding

    return Banding.of(model, bands, how)


def _held(banding: Banding, asked: Judged, restart: float | None, sink: Sink) -> BandsHeld | None:
    """Bands of the trials that can be predicted, and how often they held."""
    from .evidence.fans import judged as judged_bands

    made: list[tuple[Fan, Trial]] = []
    for trial in asked.trials:
        try:
            _, fan = banding.predicted(trial, restart, sink.note, asked.begun.get(trial.name))
        except SimulationError:  # among the comparisons already
            continue
        made.append((fan, trial))
    return judged_bands(made, banding, restart) if made else None


def _read(model: str, paths: Sequence[Path], sink: Sink, out: Path | None = None) -> tuple[Ship, Sequence[Trial]]:
    """Ship and trials, whose cautions are noted."""
    ship, trials = trained(load(model), model), read_trials(paths)
    if out is not None:
        separate(out, paths)
    for one in cautions(ship, trials):
        sink.note(one)
    return ship, trials


def trained(ship: Ship, name: str) -> Ship:
    """The ship, if its network is trained or it has none; `name` is how the user named it.

    Raises:
        RequestError: its network is untrained.
    """
    if ship.model.trained:
        return ship
    remedy = f'train it: seatrial identify STUDY.toml -o DIR, with ship = "{name}" in the study'
    raise RequestError(f"{name}: the network of {ship.name} is untrained (its file names no weights); {remedy}")


def cautions(ship: Ship, trials: Iterable[Trial]) -> list[str]:
    """Warnings and notes on predicting these trials with this ship, one line each."""
    return [one for trial in trials for one in _of_trial(ship, trial)]


def _of_trial(ship: Ship, trial: Trial) -> Iterator[str]:
    from ..identify.lint import untested

    yield from (f"warning: {trial.name}: {text}; extrapolated" for text in untested(ship, trial))
    leap = float(np.diff(trial.t).max()) if len(trial) > 2 else 0.0
    if leap > _LEAP * trial.dt:
        yield f"warning: {trial.name} leaps over {leap:.3g} s; the controls are not known in that time"
    length = trial.meta.get("L_pp")
    if isinstance(length, int | float) and abs(length / ship.L_pp - 1) > 0.02:
        yield f"warning: {trial.name} is of a ship of {length:g} m, {ship.name} has {ship.L_pp:g} m"
    windy = feels(ship, "wind_x")
    if no_wind(trial, ship.model) and windy:
        yield f"warning: {trial.name} has no wind (U_T, gamma_T); predicted in still air"
    if words := wind_words(trial, windy):
        yield f"note: {trial.name}: {words}"
    part = trial.rows(predicted(trial))
    if found := unread(part, ship.model):
        first = ", or the first after it at the start" if any(rows[0] for rows in found.values()) else ""
        filled = filled_words(part, ship.model, found)
        yield f"warning: {trial.name}: {gap_words(part, found)}; {filled}{first}"
    if len(part) < len(trial):
        yield f"note: {trial.name}: {len(trial) - len(part)} rows outside of the complete ones are left out"


def spread_of(model: str, ship: Ship, trials: Sequence[Trial], sink: Sink) -> list[Spread]:
    """Whether each trial leaves the training data of a saved hybrid, noted too; empty where no members are saved.

    Advice only: where it cannot be had, a note says why, and the prediction stands.
    """
    from ..belief.spread import NAME, load_members, spreads

    beside = Path(model).with_name(NAME)
    if Path(model).suffix != ".toml" or not beside.is_file():
        return []
    try:
        found = load_members(beside, ship)
    except ShipError as error:
        sink.note(f"warning: not known whether these trials leave the training data: {error}")
        return []
    out: list[Spread] = []
    for trial in trials:
        try:
            out += spreads(found, ship, [trial])
        except (DataError, SimulationError) as error:
            sink.note(f"warning: {trial.name}: not known whether it leaves the training data: {error}")
            continue
        sink.note(f"{'warning' if out[-1].verdict == 'leaves' else 'note'}: {out[-1]}")
    return out


def spread_numbers(found: Sequence[Spread]) -> Document:
    """The spread for a JSON document, under "spread" by trial; empty where there is none."""
    return {"spread": {one.name: one.numbers() for one in found}} if found else {}

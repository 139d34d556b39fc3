"""Checks of trials: findings in each, and whether a training set overlaps with them and covers them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path

from ..data import Trial
from ..data.check import Finding, check_folder, check_set
from ..data.trialfile import read_trials
from ..validate.coverage import Coverage, Reference, coverage, usual
from . import SILENT, Outcome, RequestError, Sink

_SEVERITIES = ("error", "warning", "info")


def check(
    paths: Sequence[Path], *, against: Sequence[Path] = (), out: Path | None = None, sink: Sink = SILENT
) -> Outcome[Mapping[str, Sequence[Finding]]]:
    """Findings of each trial; against a training set also overlap and coverage.

    Args:
        paths: trial files, or folders of them.
        against: those of a training set.
        out: page of the comparison to write (.html).

    Returns:
        The findings by trial; those of severity "error" are in `errors`.

    Raises:
        RequestError: a page is asked for without a training set, or is no .html.
        DataError: a file cannot be read.
    """
    if out is not None and not against:
        raise RequestError("-o: a page is written of a comparison; name the training files with --against")
    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise RequestError(f"{out}: a page ends in .html")
    trials = read_trials(paths)
    every = list(check_folder(trials))
    covered: list[Coverage] = []
    if against:
        overlaps, covered = _compared(read_trials(against), trials, out, sink)
        every += overlaps
    found = {trial.name: [f for f in every if trial.name in _about(f)] for trial in trials}
    counts = {s: sum(f.severity == s for f in every) for s in _SEVERITIES}
    more = {"coverage": {c.name: c.numbers() for c in covered}} if against else {}
    document = {"trials": {name: [asdict(f) for f in some] for name, some in found.items()}, "counts": counts, **more}
    total = f"{len(found)} trials: {counts['error']} errors, {counts['warning']} warnings, {counts['info']} notes"
    shown = (*map(str, every), *map(str, covered), total)
    return Outcome(found, document, shown, tuple(str(f) for f in every if f.severity == "error"))


def _about(finding: Finding) -> tuple[str, ...]:
    """Names of the trials under which a finding is listed: of an overlap, the one under test."""
    return finding.trials[-1:] if finding.kind == "overlap" else finding.trials


def _compared(
    train: Sequence[Trial], trials: Sequence[Trial], out: Path | None, sink: Sink
) -> tuple[tuple[Finding, ...], list[Coverage]]:
    """Recordings that both share, and how the training set covers each trial; the page where one is asked for."""
    from ..data.prepare import drop_trailing_gaps

    overlaps = check_set(train, trials)
    whole, ours = ([drop_trailing_gaps(t) for t in some] for some in (train, trials))
    reference = Reference.of(whole, usual([*whole, *ours]))
    covered = [coverage(reference, trial) for trial in ours]
    if out is not None:
        from ..report.coverage import page
        from ..report.page import write

        out.parent.mkdir(parents=True, exist_ok=True)
        write(out, page(reference, whole, ours, covered, [str(f) for f in overlaps]))
        sink.note(f"wrote {out}")
    return overlaps, covered

"""The command check: what is wrong with trials, and whether a training set covers them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import typer

from ..core.files import write_whole
from ..data import Trial
from ..data.check import Finding, check_set
from ..data.check import check as findings_of
from ..data.trialfile import read_trials
from ..validate.coverage import Coverage, Reference, coverage, usual
from .support import UsageError, emit, note, say

_SEVERITIES = ("error", "warning", "info")


def check(paths: Sequence[Path], against: Sequence[Path], out: Path | None, json: bool) -> None:
    """Findings of each trial; against a training set also overlap and coverage.  Exit 1 on errors.

    Raises:
        UsageError: a page is asked for without a training set, or is no .html.
    """
    if out is not None and not against:
        raise UsageError("-o: a page is written of a comparison; name the training files with --against")
    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise UsageError(f"{out}: a page ends in .html")
    trials = read_trials(paths)
    found = {trial.name: list(findings_of(trial)) for trial in trials}
    covered: list[Coverage] = []
    if against:
        train = read_trials(against)
        overlaps, covered = compared(train, trials, out)
        for finding in overlaps:
            found[finding.trials[-1]].append(finding)
    counts = {s: sum(f.severity == s for fs in found.values() for f in fs) for s in _SEVERITIES}
    if json:
        more: dict[str, Any] = {"coverage": {c.name: c.numbers() for c in covered}} if against else {}
        emit({"trials": {name: [asdict(f) for f in fs] for name, fs in found.items()}, "counts": counts, **more})
    else:
        lines = [str(f) for fs in found.values() for f in fs] + [str(c) for c in covered]
        total = f"{len(found)} trials: {counts['error']} errors, {counts['warning']} warnings, {counts['info']} notes"
        say("\n".join([*lines, total]) + "\n")
    raise typer.Exit(1 if counts["error"] else 0)


def compared(
    train: Sequence[Trial], trials: Sequence[Trial], out: Path | None
) -> tuple[tuple[Finding, ...], list[Coverage]]:
    """Recordings that both share, and how the training set covers each trial; the page where one is asked for."""
    from ..data.prepare import drop_trailing_gaps

    overlaps = check_set(train, trials)
    whole, ours = ([drop_trailing_gaps(t) for t in some] for some in (train, trials))
    reference = Reference.of(whole, usual([*whole, *ours]))
    covered = [coverage(reference, trial) for trial in ours]
    if out is not None:
        from ..report.coverage import document

        out.parent.mkdir(parents=True, exist_ok=True)
        write_whole(out, document(reference, whole, ours, covered, [str(f) for f in overlaps]))
        note(f"wrote {out}")
    return overlaps, covered

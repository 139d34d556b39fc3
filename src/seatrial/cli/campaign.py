"""The command for many runs: campaign."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from click.exceptions import Exit

from ..report.blocks import bullets, fields, line
from ..workflow.asked import Shares
from . import options as o
from .render import answer, at_terminal, fault, live, note

if TYPE_CHECKING:
    from ..campaign.rare import Rare

_EVERY = 10.0  # off a terminal, seconds between lines of progress


def campaign(
    source: o.CampaignSource, out: o.CampaignFolder = None, shares: Shares = Shares(), threads: o.Threads = None,
    device: o.CampaignDevice = None, show: o.CampaignStatus = False, verify: o.Verify = False,
    merge: o.Merge = False, report: o.CampaignReport = False, rare: o.Rare = None, runs: o.RareRuns = None,
    json: bool = False,
) -> None:  # fmt: skip
    """Run many manoeuvres of varied ships and weather."""
    from ..workflow import RequestError

    asked = [name for name, given in (("--status", show), ("--verify", verify), ("--merge", merge),
                                      ("--report", report), ("--rare", rare is not None)) if given]  # fmt: skip
    if len(asked) > 1:
        raise RequestError(f"{' and '.join(asked)}: give one of them")
    if device is not None and (asked or out is None):
        raise RequestError("--device is for the run of a campaign file; leave it out")
    if runs is not None and rare is None:
        raise RequestError("--runs is for --rare; the runs of a campaign stand in its file")
    if merge or report:
        _write(source, None if out is None else Path(out), merge, json)
    elif show or verify:
        _look(source, verify, json)
    elif out is None:
        raise RequestError("give the folder of the campaign with -o DIR, or --status, --verify, --merge or --report "
                           "of one")  # fmt: skip
    elif rare is not None:
        _rare(Path(source), rare, out, runs, threads, json)
    else:
        _run(Path(source), out, shares.shard, threads, shares.dask, device, json)


def _write(folder: str, out: Path | None, merge: bool, json: bool) -> None:
    from ..workflow import campaigns as work

    if merge:
        paths = work.merged(folder, out)
    else:
        from ..workflow.campaigns.analysing import report

        paths = (report(folder, out),)
    said: dict[str, object] = dict(zip(("file", "tracks"), paths, strict=False))
    answer(fields(said, bullets(f"wrote {path}" for path in paths)), json)


def _look(folder: str, verify: bool, json: bool) -> None:
    from ..workflow import campaigns as work

    found = work.status(folder, verify=verify)
    about = found.held.manifest
    kept = about.tracks
    said = [f"{about.name}: {found.done} of {found.held.parts} parts of {about.rows} runs are done"]
    said += [f"tracks of each run, every {kept.every} samples: {', '.join(kept.columns)}"] if kept else []
    said += [f"digest {found.digest}"] if found.digest else []
    answer(fields(found.document, bullets(said)), json)
    for one in found.faults:
        fault(f"error: {one}")
    if found.faults:
        raise Exit(1)


def _rare(source: Path, criterion: str, out: str, runs: int | None, threads: int | None, json: bool) -> None:
    from ..workflow import RequestError
    from ..workflow.campaigns.analysing import rare
    from ..workflow.request import Stopped

    if "://" in out:
        raise RequestError(f"-o {out}: a search for rare violations writes to a folder of this machine")

    def told(case: str, level: int, so_far: float) -> None:
        note(f"{case}: level {level}, probability below it {so_far:.3g}")

    try:
        found = rare(source, criterion, Path(out), runs=runs, threads=threads, watch=told, note=note)
    except KeyboardInterrupt:
        raise Stopped(f"interrupted; run the same command again to go on in {out}") from None
    answer(fields(found.document, bullets(said for one in found.cases for said in _found(one, criterion, out))), json)
    for one in found.cases:
        if one.reached and one.unknown:
            note(f"note: {one.unknown:.1%} of the last level did not reach the index; they count as no violation")


def _found(one: Rare, criterion: str, out: str) -> Iterator[str]:
    """What a search found for a case."""
    (low, high), at = one.estimate.interval, one.estimate
    if not one.reached:
        yield f"{one.case}: no tenth of a level violates {criterion} down to {at.probability:.1e}, {one.runs} runs"
        return
    yield (f"{one.case}: {criterion} is violated with probability {at.probability:.3g} "
           f"({low:.2g} to {high:.2g}, 95 %; coefficient of variation {at.variation:.2g}), {one.runs} runs")
    if one.run is not None:
        yield f"a likely violation: seatrial simulate --from {out} {one.run}; {Path(out) / 'report.html'}"


def _run(
    source: Path, out: str, shard: str | None, threads: int | None, dask: str | None, device: str | None, json: bool
) -> None:
    from rich.console import Console

    from ..workflow import campaigns as work
    from ..workflow.request import Stopped

    with Console(stderr=True, quiet=not at_terminal()).status("reading") as status:
        progress = _Progress(live(status) if at_terminal() else None)
        try:
            ran = work.campaign(source, out, shard=shard, threads=threads, dask=dask, device=device, watch=progress,
                                note=note)  # fmt: skip
        except KeyboardInterrupt:
            raise Stopped(f"interrupted; run the same command again to go on in {out}") from None
    left = len(ran.held.missing)
    rate = ran.runs / ran.seconds if ran.seconds > 0 else 0.0
    said = f"{ran.runs} runs in {ran.seconds:.1f} s ({rate:.0f} a second); {left} parts are left; {out}"
    answer(fields({"folder": out, "parts": ran.parts, "runs": ran.runs, "seconds": ran.seconds, "missing": left},
                  line(said)), json)  # fmt: skip


class _Progress:
    """Progress in words: on the moving line of a terminal, or a line now and then."""

    def __init__(self, moving: object) -> None:
        self._moving, self._last = moving, time.monotonic()

    def __call__(self, done: int, parts: int, runs: int, seconds: float) -> None:
        rate = runs / max(seconds, 1e-9)
        text = f"{done} of {parts} parts, {rate:.0f} runs a second, {(parts - done) * seconds / done:.0f} s left"
        if callable(self._moving):
            self._moving(text)
        elif time.monotonic() - self._last > _EVERY:
            self._last = time.monotonic()
            note(text)

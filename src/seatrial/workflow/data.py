"""Conversion of trial files: logs of other tools to trials and back, and trials on another time step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..core.files import write_whole
from ..core.parameters import unknown
from ..core.values import dataclass, replace
from ..data import DataError, Trial
from ..data.check import check_folder
from ..data.formats import logs
from ..data.guess import DOUBT, Guess, guess
from ..data.guess.guessing import reader_of
from ..data.importing import import_log
from ..data.prepare import mended, read_steps
from ..data.prepare import resample as resampled
from ..data.sidecar import read_sidecar, sidecar_path
from ..data.trialfile import read_trials, write_trials
from ..exchange.robot_log import FORMATS, save_robot_log
from . import RequestError
from .request import Note, make_folder, separate, silent


@dataclass(frozen=True)
class Imported:
    """Trial files written from logs.

    Attributes:
        written: the files.
        lines: counts of lines by trial, of logs that consist of lines.
        processing: what was done to each trial, from its sidecar.
        sources: what each trial holds, from where and how often, by quantity.
        missing: quantities that a fit may want and a trial does not hold.
        ignored: number of sentences or messages of each kind that nothing was read from.
    """

    written: tuple[Path, ...]
    lines: Mapping[str, Mapping[str, int]]
    processing: Mapping[str, Sequence[Any]]
    sources: Mapping[str, Mapping[str, str]]
    missing: Mapping[str, Sequence[str]]
    ignored: Mapping[str, Mapping[str, int]]


def import_logs(format: str, source: Path, out: Path, mapping: Path | None = None, note: Note = silent) -> Imported:
    """Write a trial file for each log, with a note on each one of which something could not be read.

    Raises:
        DataError: a log that cannot be read; then nothing has been written.
    """
    written = tuple(import_log(format, source, out, mapping))
    found = {path.stem: read_sidecar(path) for path in written}
    said: dict[str, list[str]] = {}
    for name, meta in found.items():
        for step in (_damage(meta.get("lines", {})), *map(str, meta.get("processing", []))):
            if step and (step.startswith("doubt: ") or step.endswith(_LEFT)):
                said.setdefault(step, []).append(name)
    for step, names in said.items():
        where = names[0] if len(names) == 1 else f"{len(names)} trials"
        more = f"; see processing in {sidecar_path(written[0].with_stem(names[0]))}" if step.endswith(_LEFT) else ""
        note(f"warning: {where}: {step}{more}")
    return Imported(
        written, {name: meta["lines"] for name, meta in found.items() if "lines" in meta},
        {name: meta.get("processing", []) for name, meta in found.items()},
        {name: meta.get("sources", {}) for name, meta in found.items()},
        {name: meta.get("missing", []) for name, meta in found.items()},
        {name: meta["ignored"] for name, meta in found.items() if meta.get("ignored")},
    )  # fmt: skip


def importing(format: str | None, source: Path | None, out: Path | None) -> tuple[str, Path, Path]:
    """What an import needs: a format, a source and a folder for the trials; a source alone tells its format.

    Raises:
        RequestError: one of them is missing.
    """
    if format is not None and source is None and Path(format).exists():
        format, source = _format_of(Path(format)), Path(format)
    if format is None or source is None:
        raise RequestError("give FORMAT and SRC, such as csv logs --mapping mapping.toml, or --guess FOLDER")
    if out is None:
        raise RequestError("give the folder for the trial files: -o trials")
    return format, source, out


def _format_of(source: Path) -> str:
    """The format of a log or a folder of logs, by what is in them.

    Raises:
        RequestError: a table, which needs a mapping.
        DataError: a format that is not read.
    """
    known = reader_of(source)
    if known is None:
        raise RequestError(f"{source}: a table, or of no format that is known: seatrial import --guess {source}")
    return known.format


def guess_mapping(folder: Path, out: Path | None = None, more: object = None) -> Guess:
    """Write the mapping that the logs of a folder suggest, tried on them; none where a reader takes them without.

    Raises:
        RequestError: other arguments of an import beside it, or a file that is there already.
        DataError: nothing there that is a table or a known log.
    """
    if more is not None:
        raise RequestError(f"--guess {folder} stands alone: leave out {more}")
    if out is not None and out.exists():
        raise RequestError(f"{out}: is there already, perhaps corrected by hand; remove it, or choose another (-o)")
    found = tried(guess(folder), folder)
    if out is not None and found.text:
        write_whole(out, found.text)
    return found


def tried(found: Guess, src: Path) -> Guess:
    """The guess with a doubt for a refusal of the import, or for each error that `check` finds in its trials.

    A guess that still asks, or that has no mapping, is left as it is.  Warnings of the check are counted in a note.

    Args:
        found: the guess.
        src: the log or folder that it is of.
    """
    if not found.text or found.asks:
        return found
    with TemporaryDirectory() as folder:
        mapping = Path(folder) / "mapping.toml"
        mapping.write_text(found.text, encoding="utf-8")
        try:
            trials = [trial for _, some in logs(found.format, src, mapping) for trial in some]
        except DataError as error:
            return _doubting(found, [f"the import refuses it: {str(error).replace(str(mapping), 'the mapping')}"])
    findings = check_folder(trials)
    errors = [f"seatrial check: {one}" for one in findings if one.severity == "error"]
    warned = sum(one.severity == "warning" for one in findings)
    note = f"its trials have {warned} warning{'s' * (warned != 1)} by seatrial check, see there"
    return _doubting(replace(found, notes=(*found.notes, note)) if warned else found, errors)


def _doubting(found: Guess, doubts: list[str]) -> Guess:
    """The guess with more doubts, at the head of its text."""
    head, gap, rest = found.text.partition("\n\n")
    lines = [f"# {DOUBT} {doubt}" for doubt in doubts]
    return replace(found, text="\n".join([head, *lines]) + gap + rest, doubts=(*doubts, *found.doubts))


def _damage(lines: Mapping[str, int]) -> str:
    """What is missing of a log of lines, in words; nothing where it is whole."""
    found = {"invalid": f"of {lines.get('all', 0)} lines are no valid sentence", "untimed": "sentences have no time"}
    parts = [f"{lines[kind]} {text}" for kind, text in found.items() if lines.get(kind)]
    return " and ".join([*parts, _LEFT]) if parts else ""


_LEFT = "are left out"


def convert(trials: Sequence[Path], to: str, out: Path) -> list[Path]:
    """Write each trial as a log of format `to`; the files.

    Raises:
        RequestError: no such format.
        DataError: a trial that cannot be read, or cannot be written in the format.
    """
    if to not in FORMATS:
        raise RequestError(f"--to: {unknown(to, FORMATS, 'format')}")
    read = read_trials(trials)
    make_folder(out)
    return [save_robot_log(trial, to, out) for trial in read]


def resample(trials: Sequence[Path], dt: float, out: Path) -> list[Path]:
    """Write each trial on even steps of `dt` [s]; the files.

    Raises:
        DataError: a trial that cannot be read or resampled, or a folder that holds the trials themselves.
    """
    return _write([resampled(trial, dt) for trial in read_trials(trials)], trials, out)


def mend(trials: Sequence[Path], by: Path, out: Path) -> list[Path]:
    """Write each trial with the steps of a file (`prepare.steps`); the files, several of a trial that was cut.

    Raises:
        DataError: a trial or a file of steps that cannot be read, a step that a trial cannot take, steps for a trial
            that is not there, or a folder that holds the trials themselves.
    """
    steps, read = read_steps(by), read_trials(trials)
    names = [trial.name for trial in read]
    for name in dict.fromkeys(name for step in steps for name in step.trials if name not in names):
        raise DataError(f"{by}: {unknown(name, names, 'trial')}")
    made = [part for trial in read for part in mended(trial, steps)]
    twice = next((part.name for k, part in enumerate(made) if part.name in {one.name for one in made[:k]}), None)
    if twice is not None:
        raise DataError(f"{by}: two trials would be called {twice}; rename one")
    return _write(made, trials, out)


def _write(made: Sequence[Trial], sources: Sequence[Path], out: Path) -> list[Path]:
    separate(out, sources)
    make_folder(out)
    return write_trials(made, out)

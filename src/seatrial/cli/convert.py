"""The commands import and convert: logs of other tools to trial files, and the reverse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..core.parameters import unknown
from ..data.importing import import_log
from ..data.sidecar import read_sidecar, sidecar_path
from ..data.trialfile import read_trials
from ..exchange.robot_log import FORMATS, save_robot_log
from .support import UsageError, emit, make_folder, note, say


def import_logs(format: str, source: Path, out: Path, mapping: Path | None, json: bool) -> None:
    """Write a trial file for each log, and say of each one what of it could not be read.

    Raises:
        DataError: a log that cannot be read; then nothing has been written.
    """
    written = import_log(format, source, out, mapping)
    said = {path.stem: read_sidecar(path) for path in written}
    for path, meta in zip(written, said.values(), strict=True):
        if damage := _damage(meta.get("lines", {})):
            note(f"warning: {path.stem}: {damage}; see processing in {sidecar_path(path)}")
    if json:
        emit({
            "format": format, "written": [str(path) for path in written],
            "lines": {name: meta["lines"] for name, meta in said.items() if "lines" in meta},
            "processing": {name: meta.get("processing", []) for name, meta in said.items()},
        })  # fmt: skip
    else:
        say(f"{len(written)} trials in {out}; next: seatrial check {out}\n")


def _damage(lines: Mapping[str, int]) -> str:
    """What is missing of a log of lines, in words; nothing where it is whole."""
    parts = []
    if lines.get("invalid"):
        parts.append(f"{lines['invalid']} of {lines['all']} lines are no valid sentence")
    if lines.get("untimed"):
        parts.append(f"{lines['untimed']} sentences have no time")
    return " and ".join(parts) + " and are left out" if parts else ""


def convert(trials: Sequence[Path], to: str, out: Path, json: bool) -> None:
    """Write each trial in another format.

    Raises:
        UsageError: no such format.
        DataError: a trial that cannot be read, or not be written so.
    """
    if to not in FORMATS:
        raise UsageError(f"--to: {unknown(to, FORMATS, 'format')}")
    read = read_trials(trials)
    make_folder(out)
    written = [save_robot_log(trial, to, out) for trial in read]
    if json:
        emit({"format": to, "written": [str(path) for path in written]})
    else:
        say("".join(f"{path}\n" for path in written))

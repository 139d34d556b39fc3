"""The command convert: trial files to logs that other tools read."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from .cli_support import UsageError, emit, make_folder
from .data.trialfile import read_trials
from .exchange.robot_log import FORMATS, save_robot_log
from .parameters import unknown


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
        sys.stdout.write("".join(f"{path}\n" for path in written))

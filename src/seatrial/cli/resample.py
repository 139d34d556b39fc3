"""The command resample: trials on another time step."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .support import emit, make_folder, say, separate


def resample(
    trials: Annotated[list[Path], typer.Argument(metavar="TRIAL...", help="Trial files, or folders of them.")],
    dt: Annotated[float, typer.Option(help="The new time step [s].")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder for the trials.")],
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")] = False,
) -> None:
    """Trials on even steps of another length, as a model in discrete time asks for."""
    from ..data.prepare import resample as resampled
    from ..data.trialfile import read_trials, write_trial

    made = [resampled(trial, dt) for trial in read_trials(trials)]
    separate(out, trials)
    make_folder(out)
    for trial in made:
        write_trial(trial, out / f"{trial.name}.csv")
    written = [str(out / f"{trial.name}.csv") for trial in made]
    if json:
        emit({"dt": dt, "written": written})
    else:
        say("".join(f"{path}\n" for path in written))

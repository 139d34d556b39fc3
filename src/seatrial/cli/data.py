"""Commands on trial files: import, convert, resample."""

from __future__ import annotations

from . import options as o
from .render import emit, note, say


def import_(
    format: o.LogFormat, source: o.Source, out: o.TrialFolder, mapping: o.Mapping = None, json: o.Json = False
) -> None:
    """Import logs of other tools as trial files."""
    from ..workflow.data import import_logs

    made = import_logs(format, source, out, mapping, note)
    if json:
        emit({"format": format, "written": made.written, "lines": made.lines, "processing": made.processing})
    else:
        say(f"{len(made.written)} trials in {out}; next: seatrial check {out}\n")


def convert(trials: o.Trials, to: o.RobotFormat, out: o.LogFolder, json: o.Json = False) -> None:
    """Convert trial files to robot logs with standard messages."""
    from ..workflow.data import convert as run

    written = run(trials, to, out)
    if json:
        emit({"format": to, "written": written})
    else:
        say("".join(f"{path}\n" for path in written))


def resample(trials: o.Trials, dt: o.NewStep, out: o.TrialFolder, json: o.Json = False) -> None:
    """Resample trials to even time steps."""
    from ..workflow.data import resample as run

    written = run(trials, dt, out)
    if json:
        emit({"dt": dt, "written": written})
    else:
        say("".join(f"{path}\n" for path in written))

"""The command line: one command per workflow, each a few lines over a function of `workflow`.

Results go to standard output (one JSON object with ``--json``), messages to standard error.
Exit status: 0 done, 1 the run failed, 2 the request was wrong.  A cold start imports only what a command needs.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from . import campaign, data, evidence, fits, folders, installation, judging, ships, simulation
from .command import Program
from .options import manoeuvres
from .outcome import ended
from .render import say

_FIRST = """\
seatrial: from the logs of a ship's trials to a model you can trust, and a simulator you can drive.

  see it work              seatrial demo -o demo
  read my logs             seatrial import --guess LOGS -o mapping.toml
  fit a model to them      seatrial study new SHIP TRIALS -o study.toml; seatrial identify study.toml -o run
                           or both in a browser: seatrial open FOLDER
  drive a ship             seatrial bridge kvlcc2
  test an autopilot on it  seatrial steer kvlcc2 --nmea udp://127.0.0.1:10110

All commands: seatrial --help. What works on this machine: seatrial doctor.
"""
_LAST = '\b\nCompletion in bash (zsh, fish alike): eval "$(_SEATRIAL_COMPLETE=bash_source seatrial)"'
_COMPLETION = "_SEATRIAL_COMPLETE"
"""The variable by which a shell asks for completions."""

_SECTIONS = {
    "Data": (folders.open_, data.import_, folders.trials, fits.check, data.mend, data.resample, data.convert),
    "Fit": (judging.design, folders.study, fits.identify, evidence.calibrate, ships.captive, data.thrust_map,
            data.servo),
    "Judge": (fits.predict, fits.validate, evidence.card, evidence.cite, evidence.yardstick, evidence.case, judging.imo,
              judging.requirements, evidence.paper),
    "Drive": (simulation.simulate, simulation.harbour, campaign.campaign, simulation.steer, simulation.bridge,
              simulation.range_, simulation.twin),
    "Ship": (ships.ships, ships.show, judging.models, ships.copy, ships.estimate, ships.scale, ships.roll,
             ships.seakeeping),
    "Export": (ships.export,),
    "This program": (simulation.demo, simulation.bench, installation.doctor),
}  # fmt: skip
"""Commands by what people come for."""


def _formats() -> list[str]:
    """The formats of logs that have a module, and whether they need a mapping."""
    from ..data.formats import formats

    return [f"{one.name} (with --mapping)" if one.needs_mapping else one.name for one in formats().values()]


app = Program(
    "Build a ship manoeuvring model that you can trust from sea trial logs.", _SECTIONS,
    {simulation.simulate: ("Manoeuvres", lambda: manoeuvres({})), data.import_: ("Formats", _formats)}, _LAST,
)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit status."""
    given = sys.argv[1:] if arguments is None else arguments
    if _COMPLETION in os.environ:
        app.main(list(given), prog_name="seatrial", complete_var=_COMPLETION)
    if not given:
        say(_FIRST)
        return 0
    return ended(app, given)

"""The command line: one command per workflow, each a few lines over a function of `workflow`.

Results go to standard output (one JSON object with ``--json``), messages to standard error.
Exit status: 0 done, 1 the run failed, 2 the request was wrong.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import typer

from . import choosing, data, fits, judging, plant, realtime, ships, simulation
from .command import Command, Group, WithManoeuvres, offered
from .outcome import ended

app = typer.Typer(
    name="seatrial", cls=Group, no_args_is_help=True, add_completion=False, rich_markup_mode=None,
    pretty_exceptions_enable=False, help="Build a ship manoeuvring model that you can trust from sea trial logs.",
)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit status."""
    return ended(typer.main.get_command(app), sys.argv[1:] if arguments is None else arguments)


for _command in (
    simulation.demo, ships.ships, ships.show, simulation.simulate, choosing.models, ships.estimate, choosing.design,
    judging.requirements, judging.imo, plant.export, plant.thrust_map, plant.servo, data.resample, simulation.bench,
    data.import_, data.convert, fits.check, fits.identify, realtime.steer, realtime.bridge,
    fits.predict, fits.validate,
):  # fmt: skip
    _cls = WithManoeuvres if _command is simulation.simulate else Command
    app.command(_command.__name__.strip("_").replace("_", "-"), cls=_cls)(offered(_command))

"""The command line: one command per workflow, each a few lines over a function of `workflow`.

Results go to standard output (one JSON object with ``--json``), messages to standard error.
Exit status: 0 done, 1 the run failed, 2 the request was wrong.  A cold start imports only what a command needs.
"""

from __future__ import annotations

import functools
import inspect
import os
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from typer.core import TyperCommand, TyperGroup

from . import campaign, data, evidence, fits, folders, harbour, installation, judging, ships, simulation
from . import options as o
from .outcome import ended
from .render import say

_Base: Any = TyperCommand if TYPE_CHECKING else object
_READ = {"ship", "model", "study", "check"}
"""Parameters of commands whose files may name classes of the user."""

_PLAIN: dict[Any, re.Pattern[str]] = {
    str: re.compile(r"[^\0]*", re.DOTALL), Path: re.compile(r"[^\0]+", re.DOTALL),
    int: re.compile(r"[+-]?\d{1,15}"), float: re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.IGNORECASE),
}  # fmt: skip
"""Texts that need no check beyond their form, by the type of the parameter."""


class _Quick(_Base):
    """A command whose plain values are converted here; Typer converts the others, and words what is wrong.

    Typer's conversion imports Pydantic, which takes a fifth of the time of a short command.
    """

    def get_params(self, ctx: Any) -> list[Any]:
        """The parameters, and `--help`."""
        found = super().get_params(ctx)
        for parameter in found:
            _shorten(parameter)
        return found


class Group(_Quick, TyperGroup):
    """The command line itself."""


class Command(_Quick, TyperCommand):
    """One of its commands."""


def _shorten(parameter: Any) -> None:
    """Let a parameter without a value, or of a plain one, be converted without Typer."""
    # Of a version of Typer without such a descriptor nothing is known, and nothing is changed.
    kind = getattr(getattr(parameter, "type_descriptor", None), "annotation", None)
    if kind is None or "process_value" in vars(parameter):
        return
    convert = parameter.process_value
    single = not parameter.multiple and parameter.nargs == 1

    def process_value(context: Any, value: Any) -> Any:
        if value is None and not parameter.required:
            return None if single else ()
        if single and kind in _PLAIN:
            if isinstance(value, kind):
                return value
            if isinstance(value, str) and _PLAIN[kind].fullmatch(value):
                return kind(value)
        return convert(context, value)

    if parameter.callback is None or kind is bool:
        parameter.process_value = process_value


class Listing(Command):
    """A command whose help ends with a list, whose names are imported only to show it."""

    title = ""

    @staticmethod
    def names() -> Iterable[str]:
        """What is listed."""
        return ()

    def get_help(self, ctx: Any) -> str:
        """The help of the command, then the list."""
        import textwrap

        listed = textwrap.fill(f"{', '.join(self.names())}.", 78, initial_indent="  ", subsequent_indent="  ",
                               break_on_hyphens=False)  # fmt: skip
        return f"{super().get_help(ctx)}\n\n{self.title}:\n{listed}"


class WithManoeuvres(Listing):
    """One that lists the manoeuvres."""

    title = "Manoeuvres"

    @staticmethod
    def names() -> Iterable[str]:
        """Those that `simulate` runs."""
        from ..workflow.simulation import known

        return known()


class WithFormats(Listing):
    """One that lists the formats of logs."""

    title = "Formats"

    @staticmethod
    def names() -> Iterable[str]:
        """Those that have a module, and whether they need a mapping."""
        from ..data.formats import formats

        return (f"{one.name} (with --mapping)" if one.needs_mapping else one.name for one in formats().values())


LISTING: dict[Any, type[Command]] = {simulation.simulate: WithManoeuvres, data.import_: WithFormats}


def offered(command: Callable[..., None]) -> Callable[..., None]:
    """The command, with `--trust` where it reads a ship, a model or a study."""
    signature = inspect.signature(command, eval_str=True)
    if not _READ & set(signature.parameters):
        return command

    @functools.wraps(command)
    def run(*args: Any, trust: list[str] | None = None, **options: Any) -> None:
        from ..ships.classes import trusting

        with trusting(trust or ()):
            command(*args, **options)

    asked = inspect.Parameter("trust", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=o.Trust)
    parameters = [*signature.parameters.values(), asked]
    vars(run)["__signature__"] = signature.replace(parameters=parameters)
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    return run


app = typer.Typer(
    name="seatrial", cls=Group, no_args_is_help=True, rich_markup_mode=None,
    pretty_exceptions_enable=False, help="Build a ship manoeuvring model that you can trust from sea trial logs.",
)  # fmt: skip


_FIRST = """\
seatrial: from the logs of a ship's trials to a model you can trust, and a simulator you can drive.

  see it work              seatrial demo -o demo
  read my logs             seatrial import --guess LOGS -o mapping.toml
  fit a model to them      seatrial study new SHIP TRIALS -o study.toml; seatrial identify study.toml -o run
  drive a ship             seatrial bridge kvlcc2
  test an autopilot on it  seatrial steer kvlcc2 --nmea udp://127.0.0.1:10110

All commands: seatrial --help. What works on this machine: seatrial doctor.
"""
_COMPLETION = "_SEATRIAL_COMPLETE"
"""The variable by which a shell asks for completions; Typer's scripts set it."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; the exit status."""
    command = typer.main.get_command(app)
    given = sys.argv[1:] if arguments is None else arguments
    if _COMPLETION in os.environ:
        command.main(list(given), prog_name="seatrial")
    if not given:
        say(_FIRST)
        return 0
    return ended(command, given)


for _command in (
    simulation.demo, ships.ships, ships.show, ships.copy, simulation.simulate, judging.models, ships.estimate,
    ships.captive, ships.scale, ships.roll, ships.seakeeping, judging.design, judging.requirements, judging.imo,
    ships.export, data.thrust_map, data.servo, data.resample, data.mend, simulation.bench, data.import_, data.convert,
    folders.trials, fits.check, folders.study, fits.identify, simulation.steer, simulation.bridge, simulation.range_,
    fits.predict, fits.validate,
    evidence.calibrate, evidence.card, simulation.twin, campaign.campaign, harbour.harbour, installation.doctor,
):  # fmt: skip
    app.command(_command.__name__.strip("_").replace("_", "-"), cls=LISTING.get(_command, Command))(offered(_command))

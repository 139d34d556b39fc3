"""From a function to a command: the option `--trust`, and a cold start without what a command does not need."""

from __future__ import annotations

import functools
import inspect
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from typer.core import TyperCommand, TyperGroup

from . import options as o

_Base: Any = TyperCommand if TYPE_CHECKING else object
_READ = {"ship", "model", "study"}
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


class WithManoeuvres(Command):
    """A command whose help lists the manoeuvres, which are imported only to show it."""

    def get_help(self, ctx: Any) -> str:
        """The help of the command, then the manoeuvres."""
        import textwrap

        from ..workflow.simulation import known

        listed = textwrap.fill(f"{', '.join(known())}.", 78, initial_indent="  ", subsequent_indent="  ",
                               break_on_hyphens=False)  # fmt: skip
        return f"{super().get_help(ctx)}\n\nManoeuvres:\n{listed}"


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

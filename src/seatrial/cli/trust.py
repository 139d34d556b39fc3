"""The option `--trust` of every command that reads a ship or a study file."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any

import typer

from ..ships.classes import trusting

_READ = {"ship", "ship_name", "model", "study"}
_Modules = Annotated[
    list[str] | None, typer.Option(metavar="MODULE", help="Let files use this module's classes: it runs. Repeatable.")
]


def offer_trust(app: typer.Typer) -> None:
    """Give `--trust` to the commands of `app` that take a ship, a model or a study."""
    for command in app.registered_commands:
        if command.callback is not None and _READ & set(inspect.signature(command.callback).parameters):
            command.callback = _trusting(command.callback)


def _trusting(function: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(function)
    def run(*args: Any, trust: list[str] | None = None, **options: Any) -> Any:
        with trusting(trust or ()):
            return function(*args, **options)

    said: Any = run
    asked = inspect.Parameter("trust", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=_Modules)
    before = inspect.signature(function, eval_str=True).parameters.values()
    said.__signature__ = inspect.Signature([*before, asked])
    said.__annotations__ = {one.name: one.annotation for one in (*before, asked)}
    return said

"""Reference pages of the commands, from the command line itself."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import click

from equations import literal


def write(out: Path) -> list[str]:
    """Write a page for each command; their names in the order of `seatrial --help`."""
    commands: Any = import_module("seatrial.cli.app").app.whole()
    for name, one in commands.items():
        (out / f"{name}.md").write_text(page(name, one), encoding="utf-8")
    return list(commands)


def page(name: str, command: Any) -> str:
    """Usage, arguments and options of a command."""
    context = click.Context(command, info_name=name)
    usage = " ".join([f"seatrial {name}", *command.collect_usage_pieces(context)])
    own = command.get_params(context)
    arguments = [_row(one.metavar or one.name.upper(), one) for one in own if one.param_type_name == "argument"]
    options = [_row(", ".join([*one.opts, *one.secondary_opts]), one) for one in own if one.param_type_name == "option"]
    parts = [f"# `seatrial {name}`\n\n{literal(command.help or '')}\n\n```text\n{usage}\n```\n"]
    for title, rows in (("Arguments", arguments), ("Options", options)):
        if rows:
            parts.append(f"\n## {title}\n\n| | | default |\n|---|---|---|\n{''.join(rows)}")
    return "".join(parts)


def _row(title: str, parameter: Any) -> str:
    default = parameter.default
    unset = type(default).__module__.startswith("click")  # which has a word of its own for none
    usual = "" if unset or default in (None, False, ()) or callable(default) else f"`{default}`"
    given = "required" if parameter.required else usual
    about = literal(getattr(parameter, "help", "") or "")
    return f"| `{title}` | {about} | {given} |\n".replace("|port", "\\|port")

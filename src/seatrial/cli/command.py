"""A command from a function: its parameters become arguments and options, and each group of options becomes one value.

A parameter whose type is a frozen dataclass is a group (`workflow.asked`): its fields are options, under a title of
their own in the help.  `--json` and `--trust` are those of every command.  A command is made when it is asked for, so
that `--help` and a short command do not make the others.
"""

from __future__ import annotations

import inspect
import os
import textwrap
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Any, cast, get_args, get_origin, get_type_hints

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from ..core.errors import RequestError
from ..workflow.asked import Always, Argument, Offers, Option, Project

Function = Callable[..., None]

_KINDS: Mapping[Any, click.ParamType[Any]] = {
    str: click.STRING, int: click.INT, float: click.FLOAT, bool: click.BOOL, Path: click.Path(path_type=Path),
}  # fmt: skip
_WIDTH = 78
PROJECT = Path("seatrial.toml")
"""Defaults of the commands that run in the folder that holds it."""
# Allowed for one run by whoever runs it, or said of one run alone.
_DATA = "SEATRIAL_DATA"
_NEVER = ("json", "trust", "anywhere", "out", "check")


def named(function: Function) -> str:
    """The name of its command."""
    return function.__name__.strip("_").replace("_", "-")


class Command(click.Command):
    """The command of a function.

    Args:
        function: does the work; its docstring is the help.
        title, names: a list at the end of the help, whose names are imported only to show it.
    """

    def __init__(self, function: Function, title: str = "", names: Callable[[], Iterable[str]] | None = None) -> None:
        self._function, self._title, self._names = function, title, names
        self._own, self.groups = _taken(function)
        groups = [*self.groups.values(), Always]
        super().__init__(named(function), help=inspect.getdoc(function),
                         params=[*self._own, *(one for group in groups for one in _options(group))])  # fmt: skip

    def make_context(
        self, info_name: str | None, args: list[str], parent: click.Context | None = None, **extra: Any
    ) -> click.Context:  # fmt: skip
        """What is given, and for what is not the defaults of the project of this folder."""
        if not (extra.get("resilient_parsing") or "--help" in args) and PROJECT.is_file():
            extra["obj"] = project = _project()
            extra["default_map"] = _defaults(self, project, _names(parent))
        return super().make_context(info_name, args, parent, **extra)

    def invoke(self, ctx: click.Context) -> None:
        """Call the function with what was given; files that are read may name classes of trusted modules."""
        from .render import note, quietly

        with quietly(ctx.params["quiet"]), _at_home(ctx.find_object(Project)):
            taken = [f"{max(one.opts, key=len)} {_shown(ctx.params[str(one.name)])}" for one in self.params
                     if ctx.get_parameter_source(str(one.name)) is ParameterSource.DEFAULT_MAP]  # fmt: skip
            if taken:
                note(f"note: {PROJECT}: {', '.join(taken)}")
            self._invoke(ctx.params)

    def _invoke(self, given: Mapping[str, Any]) -> None:
        values: dict[str, Any] = {str(one.name): given[str(one.name)] for one in self._own}
        values |= {name: _value(group, given) for name, group in self.groups.items()}
        always = _value(Always, given)
        if "json" in inspect.signature(self._function).parameters:
            values["json"] = always.json
        if not always.trust:
            self._run(values)
            return
        from ..ships.classes import trusting

        with trusting(always.trust):
            self._run(values)

    def _run(self, values: Mapping[str, Any]) -> None:
        lines = [first(values[str(one.name)]) for one in self._own
                 if (first := vars(one).get("first")) is not None and values[str(one.name)] is not None]  # fmt: skip
        if not any(lines):
            self._function(**values)
            return
        from .render import beginning

        with beginning([line for line in lines if line]):
            self._function(**values)

    def format_arguments(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Nothing: arguments are the first rows of the options, whatever the version of Click."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Arguments, options of this command, those of each group, and those of every command."""
        for title, some in self.sections(ctx):
            if found := self.rows(ctx, some):
                with formatter.section(title):
                    formatter.write_dl(found)

    def rows(self, ctx: click.Context, some: Iterable[click.Parameter]) -> list[tuple[str, str]]:
        """How some parameters are written, each with its help."""
        rows = [(one.make_metavar(ctx), about(one)) if isinstance(one, click.Argument) else one.get_help_record(ctx)
                for one in some]  # fmt: skip
        return [row for row in rows if row is not None]

    def get_help(self, ctx: click.Context) -> str:
        """The help, and the list of names where there is one."""
        if self._names is None:
            return super().get_help(ctx)
        listed = textwrap.fill(f"{', '.join(self._names())}.", _WIDTH, initial_indent="  ", subsequent_indent="  ",
                               break_on_hyphens=False)  # fmt: skip
        return f"{super().get_help(ctx)}\n\n{self._title}:\n{listed}"

    def sections(self, ctx: click.Context) -> Iterator[tuple[str, Sequence[click.Parameter]]]:
        """Titles of the help with the parameters below each."""
        arguments = [one for one in self._own if isinstance(one, click.Argument)]
        yield "Arguments", arguments
        yield "Options", [one for one in self._own if one not in arguments]
        for group in (*self.groups.values(), Always):
            names = ["help" if group is Always else "", *(field.name for field in fields(cast("Any", group)))]
            yield _title(group), [one for one in self.get_params(ctx) if one.name in names]


class Program(click.Group):
    """The command line: commands by section, each made when it is asked for.

    Args:
        sections: functions of commands by title.
        lists: title and names of the list at the end of a command's help.
        epilog: the end of the help.
    """

    def __init__(
        self, about: str, sections: Mapping[str, Sequence[Function]],
        lists: Mapping[Function, tuple[str, Callable[[], Iterable[str]]]], epilog: str,
    ) -> None:  # fmt: skip
        super().__init__("seatrial", help=about, epilog=epilog)
        self.sections, self._lists = sections, lists
        self._functions = {named(one): one for some in sections.values() for one in some}

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Their names, by section."""
        return list(self._functions)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of this name, made at its first use."""
        if cmd_name not in self.commands and cmd_name in self._functions:
            function = self._functions[cmd_name]
            title, names = self._lists.get(function, ("", None))
            self.commands[cmd_name] = Command(function, title, names)
        return self.commands.get(cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that is asked for; of an unknown one the message names those that are near."""
        if args[0] not in self._functions:
            self.whole()
        return super().resolve_command(ctx, args)

    def whole(self) -> Mapping[str, Command]:
        """Every command by name."""
        with click.Context(self) as context:
            return {name: cast("Command", self.get_command(context, name)) for name in self._functions}

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The first line of each command's help, by section."""
        width = max(map(len, self._functions))
        for title, some in self.sections.items():
            with formatter.section(title):
                formatter.write_dl([(f"{named(one):{width}}", (inspect.getdoc(one) or "").splitlines()[0])
                                    for one in some])  # fmt: skip


def about(parameter: click.Parameter) -> str:
    """The help of an argument or option."""
    return str(getattr(parameter, "help", "") or "")


def _title(group: type) -> str:
    """The title of a group in the help: what its docstring says."""
    return (inspect.getdoc(group) or "").splitlines()[0].rstrip(".")


def _taken(function: Function) -> tuple[list[click.Parameter], dict[str, type]]:
    """Arguments and options of a function's own, and its groups by the name of the parameter."""
    hints = get_type_hints(function, include_extras=True)
    own: list[click.Parameter] = []
    groups: dict[str, type] = {}
    for name, one in inspect.signature(function).parameters.items():
        if is_dataclass(hint := hints[name]):
            groups[name] = cast("type", hint)
        elif name != "json":
            own.append(_parameter(name, hint, MISSING if one.default is one.empty else one.default))
    return own, groups


def _options(group: type) -> list[click.Parameter]:
    hints = get_type_hints(group, include_extras=True)
    return [_parameter(one.name, hints[one.name], one.default) for one in fields(cast("Any", group))]


def _value(group: Any, given: Mapping[str, Any]) -> Any:
    return group(**{one.name: given[one.name] for one in fields(group)})


def _names(program: click.Context | None) -> Sequence[str]:
    return program.command.list_commands(program) if program and isinstance(program.command, Program) else ()


def _project() -> Project:
    """What `seatrial.toml` says; an unknown key, schema or value is a RequestError."""
    from ..core.records import read_record

    return read_record(PROJECT, Project, "seatrial-project/1")


def _defaults(command: Command, project: Project, commands: Sequence[str]) -> dict[str, Any]:
    """Values of a project for the options of a command, by the names of their parameters.

    Args:
        command, commands: the one that runs, and the names of all.

    Raises:
        RequestError: no such command or option, one that a project may not set, a value of another kind.
    """
    from ..core.parameters import unknown

    place = f"{PROJECT}: options"
    for name in project.options:
        if name not in commands:
            raise RequestError(f"{place}: {unknown(name, commands, 'command')}")
    known = {max(one.opts, key=len).removeprefix("--"): one for one in command.params
             if isinstance(one, click.Option) and one.name not in _NEVER and not one.is_flag}  # fmt: skip
    found: dict[str, Any] = {"quiet": True} if project.quiet else {}
    for key, value in project.options.get(str(command.name), {}).items():
        if key not in known:
            raise RequestError(f"{place}.{command.name}: {unknown(key, known, 'option that a project sets')}")
        found[str(known[key].name)] = _of_kind(known[key], value, f"{place}.{command.name}.{key}")
    return found


def _of_kind(option: click.Option, value: Any, place: str) -> Any:
    """A value of a file as the option takes it; a text is no number, as it is on the command line."""
    number = option.type in (click.FLOAT, click.INT)
    several = cast("list[Any]", value) if option.multiple and isinstance(value, list) else [value]
    kinds = (int, float) if option.type is click.FLOAT else int if number else str
    if not all(isinstance(one, kinds) and not isinstance(one, bool) for one in several):
        wanted = "a number" if option.type is click.FLOAT else "a whole number" if number else "a text"
        raise RequestError(f"{place} is {value!r}; it must be {wanted}{' or a list of them' * option.multiple}")
    return several if option.multiple else value


def _shown(value: Any) -> str:
    return " ".join(map(str, value)) if isinstance(value, tuple) else str(value)


@contextmanager
def _at_home(project: Project | None) -> Generator[None]:
    """Within, $SEATRIAL_DATA is the folder that a project names, unless the shell has one."""
    if project is None or project.data is None or _DATA in os.environ:
        yield
        return
    os.environ[_DATA] = str(project.data)
    try:
        yield
    finally:
        del os.environ[_DATA]


def _so_far(context: click.Context) -> dict[str, Any]:
    """What is given so far; after an option without its value Click leaves the arguments in `args`."""
    arguments = [one for one in context.command.params if isinstance(one, click.Argument)]
    left = {str(one.name): word if one.nargs == 1 else (word,)
            for one, word in zip(arguments, context.args, strict=False)}  # fmt: skip
    return {**left, **{name: value for name, value in context.params.items() if value}}


def _completed(offers: Offers) -> Callable[[click.Context, click.Parameter, str], list[CompletionItem]]:
    def completed(context: click.Context, _: click.Parameter, typed: str) -> list[CompletionItem]:
        found = [CompletionItem(one) for one in offers(_so_far(context)) if one.startswith(typed)]
        return found or [CompletionItem(typed, type="file")]

    return completed


def _parameter(name: str, hint: Any, default: Any) -> click.Parameter:
    """A parameter as Click has it, from its annotation.

    Raises:
        TypeError: an annotation without an `Argument` or `Option`.
    """
    kind, how = get_args(hint)[:2] if get_args(hint) else (hint, None)
    several = get_origin(kind) is tuple
    [plain] = [one for one in get_args(kind) or [kind] if one not in (type(None), Ellipsis)]
    given: dict[str, Any] = {"type": _KINDS[plain], "required": default is MISSING}
    if default not in (MISSING, None, ()):
        given["default"] = default
    if isinstance(how, Argument | Option) and how.offers is not None:
        given["shell_complete"] = _completed(how.offers)
    if isinstance(how, Argument):
        made = click.Argument([name], metavar=how.metavar, nargs=-1 if several else 1, **given)
        vars(made).update(help=how.help, first=how.first)
        return made
    if not isinstance(how, Option):
        raise TypeError(f"{name}: an Argument or Option says how a command line names it")
    flags = how.flags or (f"--{name.replace('_', '-')}",)
    if plain is bool:  # said of another, Click takes a value such as -5 for the next option
        given["is_flag"] = True
    return click.Option([name, *flags], help=how.help, metavar=how.metavar, multiple=several,
                        show_default=plain is not bool and default not in (MISSING, None, ()), **given)  # fmt: skip

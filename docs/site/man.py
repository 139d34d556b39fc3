"""Manual pages of the commands in the macros of man(7), from the command line itself: `make docs` writes build/man."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import click


def write(out: Path) -> list[Path]:
    """Write the page of the program and one for each command; the files."""
    app, version = import_module("seatrial.cli.app").app, import_module("seatrial").__version__
    out.mkdir(parents=True, exist_ok=True)
    pages = {"seatrial": whole(app, version)}
    pages |= {f"seatrial-{name}": page(name, one, version) for name, one in app.whole().items()}
    for name, text in pages.items():
        (out / f"{name}.1").write_text(text, encoding="utf-8")
    return [out / f"{name}.1" for name in pages]


def page(name: str, command: Any, version: str) -> str:
    """The page of a command: what `--help` has."""
    context = click.Context(command, info_name=name)
    usage = " ".join(command.collect_usage_pieces(context))
    parts = [*_head(f"seatrial-{name}", version, command.help), _section("SYNOPSIS"),
             f"\\fBseatrial {roff(name)}\\fR {roff(usage)}"]  # fmt: skip
    for title, some in command.sections(context):
        rows = [(f"\\fB{roff(said)}\\fR", help) for said, help in command.rows(context, some)]
        parts += [_section(title.upper()), *_list(rows)] if rows else []
    return "\n".join([*parts, _section("SEE ALSO"), "seatrial(1)", ""])


def whole(app: Any, version: str) -> str:
    """The page of the program: its commands by section, exit status, environment and files."""
    commands = app.whole()
    parts = [*_head("seatrial", version, app.help), _section("SYNOPSIS"), "\\fBseatrial\\fR COMMAND [OPTIONS]"]
    named = import_module("seatrial.cli.command").named
    for title, some in app.sections.items():
        rows = [(f"\\fBseatrial\\-{roff(name)}\\fR(1)", commands[name].help) for name in map(named, some)]
        parts += [_section(title.upper()), *_list(rows)]
    parts += [_section("EXIT STATUS"), *_list([
        ("0", "done"), ("1", "the run failed"), ("2", "the request was wrong"),
        ("3, 4", "of validate --for: not fit for the use; trials that cannot tell"), ("130", "interrupted"),
    ])]  # fmt: skip
    parts += [_section("ENVIRONMENT"), *_list([
        ("SEATRIAL_DATA", "folder of the public data sets"), ("SEATRIAL_CACHE", "folder of compiled kernels"),
        ("SEATRIAL_CC", "C compiler; none for the virtual machine"), ("SEATRIAL_THREADS", "most threads of a run"),
        ("NO_COLOR", "no colours"),
    ])]  # fmt: skip
    parts += [_section("FILES"), *_list([("seatrial.toml", "defaults of the commands that run in its folder")])]
    return "\n".join([*parts, ""])


def roff(text: str) -> str:
    """Text with what troff would read as its own escaped."""
    plain = text.replace("\\", "\\e").replace("-", "\\-")
    return "\n".join(f"\\&{line}" if line.startswith((".", "'")) else line for line in plain.splitlines())


def _head(name: str, version: str, about: str) -> list[str]:
    return [f'.TH "{name.upper()}" 1 "" "seatrial {version}"', _section("NAME"),
            f"{roff(name)} \\- {roff(about[0].lower() + about[1:].rstrip('.'))}"]  # fmt: skip


def _section(title: str) -> str:
    return f'.SH "{title}"'


def _list(rows: list[tuple[str, str]]) -> list[str]:
    return [line for said, about in rows for line in (".TP", said, roff(about))]


if __name__ == "__main__":
    print(*write(Path(sys.argv[1])), sep="\n")

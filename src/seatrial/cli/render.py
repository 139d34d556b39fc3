r"""Output of the commands: results, notes, JSON and tables; the one place that writes to a terminal.

A name, a title or a cell of a foreign file may hold escape sequences, line ends or marks that turn the direction of
writing.  They are shown as their escapes (``\x1b``), never sent.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from json import dumps
from typing import IO, TYPE_CHECKING, Any

from ..report.blocks import Body, Fields, Group, Table, cell, document, plain_text
from ..workflow import figure as figure

if TYPE_CHECKING:
    from rich.console import Console
    from rich.status import Status
    from rich.table import Table as RichTable

_LONGEST, _MANY = 2000, 13
_FIRST: ContextVar[tuple[str, ...]] = ContextVar("first", default=())
_QUIET: ContextVar[bool] = ContextVar("quiet", default=False)


def shown(text: str) -> str:
    """Text for a terminal: lines and tabs stay, every other character that is not printed is written as its escape."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" else " " if c.isspace() else _escaped(c) for c in text)


def one_line(text: str) -> str:
    """The same in one line of a length that can be read."""
    line = shown("; ".join(part.strip() for part in text.splitlines() if part.strip()))
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST - 100]} ... {line[-90:]}"


def in_json(text: str) -> str:
    """A JSON text with what is not printed as JSON escapes it; only strings hold any."""
    return "".join(c if c.isprintable() or c in " \n" else _units(c) for c in text)


@contextmanager
def beginning(lines: Sequence[str]) -> Generator[None]:
    """Notes before the first word of what is done within; what fails before it has said any leaves them out."""
    token = _FIRST.set(tuple(lines))
    try:
        yield
        _begin()
    finally:
        _FIRST.reset(token)


def _begin() -> None:
    lines = _FIRST.get()
    _FIRST.set(())
    for line in lines:
        note(line)


@contextmanager
def quietly(asked: bool = True) -> Generator[None]:
    """No notes and no progress within, only results and what went wrong."""
    token = _QUIET.set(asked)
    try:
        yield
    finally:
        _QUIET.reset(token)


def at_terminal() -> bool:
    """Whether progress has a moving line: standard error is a terminal, and nobody asked for quiet."""
    return sys.stderr.isatty() and not _QUIET.get()


def say(text: str) -> None:
    """Results to standard output, with what would control a terminal escaped."""
    _begin()
    _write(sys.stdout, shown(text))


def say_lines(*lines: object) -> None:
    """Results to standard output, a line each."""
    say("".join(f"{line}\n" for line in lines))


def note(text: str) -> None:
    """One line for the user on standard error, unless it is to be quiet."""
    if not _QUIET.get():
        fault(text)


def fault(text: str) -> None:
    """What went wrong, in one line on standard error; a closed standard error does not stop the work."""
    _begin()
    try:
        _write(sys.stderr, one_line(text) + "\n")
    except OSError:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def note_warning(message: Warning | str, *_: Any) -> None:
    """A Python warning as one line for the user."""
    note(f"note: {message}")


def hand_on(text: str, *, aside: bool) -> None:
    """Output of another program, unchanged, to standard output or, `aside`, to standard error."""
    stream = sys.stderr if aside else sys.stdout
    if stream is not None:
        stream.write(text)


def answer(body: Body, json: bool) -> None:
    """What a command has found, to standard output: as one JSON object, or for people."""
    _begin()
    emit(document(body)) if json else show(body)


def emit(said: Mapping[str, Any]) -> None:
    """One JSON object to standard output; a number that is not finite becomes null."""
    from ..core.files import plain

    say(in_json(dumps(plain(said), ensure_ascii=False, allow_nan=False)) + "\n")


def console() -> Console:
    """Standard output as Rich writes it; wide where it is no terminal, so that nothing is cut."""
    from rich.console import Console

    return Console(highlight=False, width=None if sys.stdout.isatty() else 160, soft_wrap=True)


def show(body: Body) -> None:
    """Blocks to standard output; of a figure its caption, as a terminal has no drawings."""
    for block in body:
        if isinstance(block, Table):
            _show_table(block)
        elif isinstance(block, Fields | Group):
            show(block.body)
        else:
            say_lines(*plain_text((block,)))


def _show_table(block: Table) -> None:
    screen = console()
    screen.print(drawn := _drawn(block), width=max(screen.width, screen.measure(drawn).minimum))


def _drawn(block: Table) -> RichTable:
    """A plain table: names and numbers are never broken, words at their spaces; of many columns with less between."""
    from rich import box, table
    from rich.markup import escape

    padding = (0, 1, 0, 0) if len(block.head) > _MANY else (0, 1)
    drawn = table.Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=padding)
    for k, name in enumerate(block.head):
        side = "left" if k == 0 or k in block.words else "right"
        drawn.add_column(escape(shown(name)), justify=side, overflow="fold", min_width=_least(block, k))
    for row in block.rows:
        drawn.add_row(*(escape(shown(cell(one))) for one in row))
    return drawn


def _least(block: Table, k: int) -> int:
    """Characters of the longest name or number of a column; of words the longest of them."""
    cells = [shown(cell(row[k])) for row in block.rows if k < len(row)]
    return max((len(part) for one in cells for part in (one.split() if k in block.words else [one])), default=1)


def live(status: Status) -> Callable[[str], None]:
    """A function that puts a text on the moving line of a terminal."""
    from rich.markup import escape

    return lambda text: status.update(escape(one_line(text)))


def _write(stream: IO[str] | None, text: str) -> None:
    if stream is None:  # closed by the caller
        return
    encoding = getattr(stream, "encoding", None) or "utf-8"
    stream.write(text.encode(encoding, "backslashreplace").decode(encoding))


def _escaped(c: str) -> str:
    return c.encode("unicode_escape").decode("ascii")


def _units(c: str) -> str:
    code = c.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{code[k : k + 2].hex()}" for k in range(0, len(code), 2))

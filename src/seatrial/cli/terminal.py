r"""The one place through which words reach a terminal: nothing in them controls it, whatever file they come from.

A name, a title or a cell of a foreign file may hold escape sequences, line ends or marks that turn the direction of
writing.  They are shown as what they are (``\x1b``), never sent.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import IO, Any

_LONGEST = 2000


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


def say(text: str) -> None:
    """Results to standard output, as they are but for what would control a terminal."""
    _write(sys.stdout, shown(text))


def note(text: str) -> None:
    """One line for the user, beside the output; where nobody listens any more, work goes on without."""
    try:
        _write(sys.stderr, one_line(text) + "\n")
    except OSError:
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def note_warning(message: Warning | str, *_: Any) -> None:
    """A Python warning as one line for the user."""
    note(f"note: {message}")


def _write(stream: IO[str] | None, text: str) -> None:
    if stream is None:  # closed by who called us
        return
    encoding = getattr(stream, "encoding", None) or "utf-8"
    stream.write(text.encode(encoding, "backslashreplace").decode(encoding))


def _escaped(c: str) -> str:
    return c.encode("unicode_escape").decode("ascii")


def _units(c: str) -> str:
    code = c.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{code[k : k + 2].hex()}" for k in range(0, len(code), 2))

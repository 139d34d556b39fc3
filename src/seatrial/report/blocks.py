"""Blocks: what a command has found, as values of few kinds that a terminal, a page, a notebook and JSON each draw.

A `Body` is a tuple of blocks; the functions make one, and ``+`` joins them.  Faces: `page.html` for pages and
notebooks, `plain_text` for notebooks, `cli.render.show` for a terminal, `document` for JSON.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Literal

from ..core.values import dataclass

Cell = str | float | int | None
"""Of a table: a number stays a number, for data frames; None is empty."""


@dataclass(frozen=True)
class Line:
    """One line or paragraph.

    Attributes:
        kind: "lead" is the answer, "soft" a remark, "warning" stands in a box, "heading" above what follows.
        command: what to type, at its end.
    """

    text: str
    kind: Literal["", "lead", "soft", "heading", "warning"] = ""
    command: str = ""


@dataclass(frozen=True)
class Lines:
    """Several lines of equal rank; in a box where `boxed`, under a title where it has one."""

    lines: tuple[str, ...]
    title: str = ""
    boxed: bool = False


@dataclass(frozen=True)
class Table:
    """Rows under headings.

    Attributes:
        words: columns to align left, besides the first.
        wide: its words are wrapped, and on a narrow screen each row of many columns stands as lines, so that it needs
            no scrolling.
        folded: a page shows it only on request.
        title: one line above it, of a table that stands alone.
        notes: lines below it.
    """

    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    words: tuple[int, ...] = ()
    wide: bool = False
    folded: bool = False
    title: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Figure:
    """A drawing with a line beneath.

    Attributes:
        svg: the drawing; it may hold its numbers (`figure_data`).
        least, most: width in pixels; where the screen is narrower than the least it scrolls.
    """

    svg: str
    caption: str
    least: int = 0
    most: int = 0


@dataclass(frozen=True)
class Group:
    """Blocks side by side, each at least so many pixels wide where the screen allows; None is half and half."""

    body: Body
    least: int | None = 420


@dataclass(frozen=True)
class Fields:
    """Blocks, and what JSON says in their place: fields of its object, SI units and radians unless they name others."""

    values: Mapping[str, object]
    body: Body = ()


@dataclass(frozen=True)
class Numbers:
    """Names with their values, in words; `main` of a page, the first as the greatest."""

    pairs: tuple[tuple[str, str], ...]
    main: bool = False


@dataclass(frozen=True)
class Verdict:
    """An answer, and what it stands on.

    Attributes:
        answer: in few words.
        why: the reason, in one line.
        grounds: what to trust, why, what to do next: name to sentences.
    """

    answer: str
    why: str = ""
    grounds: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Blanks:
    """Fields to fill in by hand on paper, side by side."""

    names: tuple[str, ...]


Block = Line | Lines | Table | Figure | Group | Fields | Numbers | Verdict | Blanks
Body = tuple[Block, ...]
"""What stands one below the other."""


def number(value: float, digits: int = 3) -> str:
    """A number to read: `digits` significant figures; a dash where there is none."""
    if not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if -4 < size < 6:
        return f"{value:.{max(0, digits - 1 - size)}f}".replace("-", "−")
    return f"{value:.{digits - 1}e}".replace("-", "−")


def joined(bodies: Iterable[Body]) -> Body:
    """Bodies one below the other."""
    return tuple(block for body in bodies for block in body)


def line(text: str, *, command: str = "") -> Body:
    """A paragraph, and what to type at its end."""
    return (Line(text, command=command),)


def heading(text: str) -> Body:
    """What stands above a part of a section."""
    return (Line(text, "heading"),)


def lead(text: str) -> Body:
    """The first sentence of a page."""
    return (Line(text, "lead"),)


def soft(text: str) -> Body:
    """A remark below a table or a figure; nothing for an empty line."""
    return (Line(text, "soft"),) if text else ()


def bullets(lines: Iterable[str]) -> Body:
    """A list of lines."""
    return (Lines(tuple(lines)),)


def note(title: str, lines: Iterable[str]) -> Body:
    """A box with a list of warnings; nothing without any."""
    some = tuple(lines)
    return (Lines(some, title, boxed=True),) if some else ()


def table(
    head: Sequence[str], rows: Iterable[Sequence[str]], *, words: Sequence[int] = (), wide: bool = False,
    folded: bool = False,
) -> Body:  # fmt: skip
    """A table that scrolls sideways, unless it is `wide`; a cell that begins with * is the best of its row.

    Args:
        words: columns to align left, besides the first.
        folded: shown only on request.
    """
    return (Table(tuple(head), tuple(map(tuple, rows)), tuple(words), wide, folded),)


def figure(svg: str, caption: str, *, least: int = 0, most: int = 0) -> Body:
    """A drawing with a line beneath."""
    return (Figure(svg, caption, least, most),)


def gallery(*drawn: Body, least: int = 420) -> Body:
    """Figures side by side, each at least so many pixels wide where the screen allows; nothing without any."""
    some = joined(drawn)
    return (Group(some, least),) if some else ()


def fields(values: Mapping[str, object], body: Body = ()) -> Body:
    """Blocks with what JSON says in their place."""
    return (Fields(values, body),)


def document(body: Body) -> dict[str, object]:
    """The object that JSON has of a body: the fields of all its blocks."""
    found: dict[str, object] = {}
    for block in body:
        if isinstance(block, Fields):
            found |= block.values
        if isinstance(block, Fields | Group):
            found |= document(block.body)
    return found


def tiles(shown: Iterable[tuple[str, str]]) -> Body:
    """Values with what they are, the first as the main one."""
    return (Numbers(tuple((what, value) for value, what in shown), main=True),)


def entries(shown: Mapping[str, str]) -> Body:
    """Names with their values; nothing without any."""
    return (Numbers(tuple(shown.items())),) if shown else ()


def plain_text(body: Body) -> Iterator[str]:
    """The lines of a body as text; of a figure its caption."""
    for block in body:
        yield from _plain(block)


def _plain(block: Block) -> Iterator[str]:
    match block:
        case Line():
            yield f"{block.text} {block.command}".rstrip()
        case Lines():
            yield from (block.title,) * bool(block.title)
            yield from block.lines
        case Table():
            yield from (block.title,) * bool(block.title)
            yield from _columns(block)
            yield from block.notes
        case Figure():
            yield block.caption
        case Group() | Fields():
            yield from plain_text(block.body)
        case Numbers():
            yield from (f"{name}: {value}" for name, value in block.pairs)
        case Verdict():
            yield f"{block.answer}: {block.why}" if block.why else block.answer
            yield from (f"{name}: {said}" for name, said in block.grounds)
        case Blanks():
            yield from (f"{name}:" for name in block.names)


def _columns(block: Table) -> Iterator[str]:
    """Cells below each other, numbers to the right; no heading without rows."""
    cells = [block.head, *(tuple(map(cell, row)) for row in block.rows)] if block.rows else []
    widths = [max(len(row[k]) for row in cells) for k in range(len(block.head) if cells else 0)]
    for row in cells:
        yield "  ".join(one.ljust(width) if k == 0 or k in block.words else one.rjust(width)
                        for k, (one, width) in enumerate(zip(row, widths, strict=True))).rstrip()  # fmt: skip


def cell(value: Cell) -> str:
    """A cell as text; a number that is one with four digits."""
    if isinstance(value, float):
        return number(value, 4).replace("−", "-")
    return "" if value is None else str(value)

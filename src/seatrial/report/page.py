"""The face of a result on a page: self-contained HTML, with its numbers as JSON beside it.

A `Page` is a title and `Section` values of blocks; `write` writes the page and its numbers, both or neither.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from ..core.errors import ReportError as ReportError
from ..core.files import plain as plain
from ..core.files import write_together
from ..core.values import dataclass
from .blocks import (
    Blanks,
    Block,
    Body,
    Fields,
    Figure,
    Group,
    Line,
    Lines,
    Numbers,
    Table,
    Verdict,
    cell,
    document,
    entries,
    fields,
    joined,
)
from .figure_data import taken

_STYLE = Path(__file__).with_name("page.css").read_text(encoding="utf-8")
_SCRIPT = Path(__file__).with_name("page.js").read_text(encoding="utf-8")
_NAME = 60
"""Letters of the name of a file of numbers."""
_ABREAST = 4
"""Columns that a narrow screen has room for side by side."""


@dataclass(frozen=True)
class Section:
    """One part of a page.

    Attributes:
        title: heading, plain text; empty for what stands below the title of the page.
        body: a section that shows nothing has no heading, but what JSON says in its place is written.
        sheet: begins on a new sheet of paper.
    """

    title: str
    body: Body
    sheet: bool = False

    @property
    def html(self) -> str:
        """Heading and body."""
        shown = html(self.body)
        heading = f"<h2>{text(self.title)}</h2>" if self.title and shown else ""
        return '<div class="sheet"></div>' * self.sheet + heading + shown


@dataclass(frozen=True)
class Page:
    """A page and its numbers.

    Attributes:
        title: plain text.
        sections: in the order to show.
        numbers: fields of the JSON file beside those of the sections, SI units and radians.
    """

    title: str
    sections: tuple[Section, ...]

    @property
    def html(self) -> str:
        """The whole document; it loads nothing from outside."""
        body = "".join(section.html for section in self.sections)
        return (
            '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{text(self.title)}</title><style>\n{_STYLE}</style></head>"
            f"<body><main><h1>{text(self.title)}</h1>{body}</main><script>\n{_SCRIPT}</script></body></html>\n"
        )

    @property
    def document(self) -> dict[str, Any]:
        """What JSON has of its blocks: a value that is not finite is null."""
        return plain(document(joined(section.body for section in self.sections)))


def write(path: str | Path, page: Page) -> Path:
    """Write the page to `path` and its numbers beside it as .json; both or neither.

    Returns:
        The path of the page.

    Raises:
        ReportError: a path that ends in .json, which the numbers take.
        OSError: a file cannot be written.
    """
    here = Path(path)
    if here.suffix == ".json":
        raise ReportError(f"{here}: the page would be overwritten by its numbers; end it in .html")
    here.parent.mkdir(parents=True, exist_ok=True)
    numbers = json.dumps(page.document, indent=1, allow_nan=False) + "\n"
    write_together({here.with_suffix(".json"): numbers, here: page.html})
    return here


def text(value: object) -> str:
    """Anything as text that is safe in a page."""
    return escape(str(value), quote=True)


def html(body: Body) -> str:
    """A body as HTML."""
    return "".join(map(_drawn, body))


def _drawn(block: Block) -> str:
    match block:
        case Line():
            return _line(block)
        case Lines():
            return _lines(block)
        case Table():
            return _table(block)
        case Figure():
            return _figure(block)
        case Group() | Fields():
            return _group(block)
        case Numbers():
            return _numbers(block)
        case Verdict():
            if block.why:
                return f"<p><strong>{text(block.answer)}</strong>: {text(block.why)}.</p>"
            return html((Line(block.answer, "lead"), Numbers(block.grounds)))
        case Blanks():
            fields = "".join(f"<div><span>{text(name)}</span></div>" for name in block.names)
            return f'<div class="{"sign" if len(block.names) > 1 else "sign wide"}">{fields}</div>'


def _line(block: Line) -> str:
    words = text(block.text) + (f" <code>{text(block.command)}</code>" if block.command else "")
    if block.kind == "heading":
        return f"<h3>{words}</h3>"
    return f'<div class="note">{words}</div>' if block.kind == "warning" else f"<p{_class(block.kind)}>{words}</p>"


def _lines(block: Lines) -> str:
    listed = "<ul>" + "".join(f"<li>{text(line)}</li>" for line in block.lines) + "</ul>"
    heading = f"<strong>{text(block.title)}</strong>" if block.title else ""
    return f'<div class="note">{heading}{listed}</div>' if block.boxed else heading + listed


def _table(block: Table) -> str:
    kinds = ["text" if k in block.words else "" for k in range(len(block.head))]
    top = "".join(f"<th{_class(kind)}>{text(name)}</th>" for name, kind in zip(block.head, kinds, strict=True))
    stacked = block.wide and len(block.head) > _ABREAST
    over = block.head if stacked else ("",) * len(block.head)
    lines = ("".join(map(_cell, map(cell, row), kinds, over)) for row in block.rows)
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    drawn = f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'
    if block.wide:
        drawn = f'<div class="wrap{" stack" if stacked else ""}">{drawn}</div>'
    if block.folded:
        drawn = f"<details><summary>{len(block.rows)} rows</summary>{drawn}</details>"
    title = f"<div><b>{text(block.title)}</b></div>" if block.title else ""
    return title + drawn + "".join(f"<div>{text(note)}</div>" for note in block.notes)


def _figure(block: Figure) -> str:
    """The drawing, and a link to the numbers that it holds (`figure_data`)."""
    line, (drawing, data) = text(block.caption), taken(block.svg)
    name = re.sub(r"[^a-z0-9]+", "-", block.caption.lower()).strip("-")[:_NAME] or "figure"
    link = f' <a class="data" download="{name}.csv.gz" href="{data}">data (CSV)</a>' if data else ""
    if block.least and not block.most:  # the drawing scrolls, its caption does not
        drawing = f'<div class="scroll"><div style="min-width:{block.least}px">{drawing}</div></div>'
    drawn = f'<figure><div role="img" aria-label="{line}">{drawing}</div><figcaption>{line}{link}</figcaption></figure>'
    return f'<div style="max-width:{block.most}px;margin:1rem 0">{drawn}</div>' if block.most else drawn


def _group(block: Group | Fields) -> str:
    some = html(block.body)
    if isinstance(block, Fields):
        return some
    if block.least is None:
        return f'<div class="halves">{some}</div>'
    narrow = f"grid-template-columns:repeat(auto-fill,minmax(min(100%,{block.least}px),1fr))"
    columns = "" if block.least == 420 else f' style="{narrow}"'
    return f'<div class="figures"{columns}>{some}</div>'


def _numbers(block: Numbers) -> str:
    if not block.main:
        lines = "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in block.pairs)
        return f"<dl>{lines}</dl>"
    parts = (f'<div class="tile{" main" if k == 0 else ""}"><b>{text(value)}</b><span>{text(what)}</span></div>'
             for k, (what, value) in enumerate(block.pairs))  # fmt: skip
    return f'<div class="tiles">{"".join(parts)}</div>'


def provenance(shown: Mapping[str, str]) -> Section:
    """Where a page comes from: study, version, command and the like."""
    return Section("Provenance", fields({"provenance": dict(shown)}, entries(shown)))


def _cell(shown: str, kind: str, head: str) -> str:
    """A cell, with its heading for screens on which that is not above it."""
    best = shown.startswith("*")
    of = f' data-of="{text(head)}"' if head else ""
    return f"<td{_class(' '.join(filter(None, (kind, 'best' if best else ''))))}{of}>{text(shown[best:])}</td>"


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""

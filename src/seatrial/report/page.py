"""Self-contained HTML pages with their numbers as JSON: page builder, text, tables and figures.

A `Page` is a title and `Section` values; `write` writes the page and its numbers, both or neither.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

from ..core.errors import ReportError as ReportError
from ..core.files import plain as plain
from ..core.files import write_together
from .figure_data import taken

_STYLE = Path(__file__).with_name("page.css").read_text(encoding="utf-8")
_SCRIPT = Path(__file__).with_name("page.js").read_text(encoding="utf-8")
_NAME = 60
"""Letters of the name of a file of numbers."""


@dataclass(frozen=True)
class Section:
    """One part of a page.

    Attributes:
        title: heading, plain text; empty for what stands below the title of the page.
        body: HTML; a section without a body is not shown, but its numbers are written.
        numbers: fields of the JSON file, SI units and radians.
    """

    title: str
    body: str
    numbers: Mapping[str, object] = field(default_factory=dict[str, object])

    @property
    def html(self) -> str:
        """Heading and body."""
        return f"<h2>{text(self.title)}</h2>{self.body}" if self.title and self.body else self.body


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
    numbers: Mapping[str, object] = field(default_factory=dict[str, object])

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
        """All numbers as JSON has them: a value that is not finite is null."""
        fields = dict(self.numbers)
        for section in self.sections:
            fields |= section.numbers
        return plain(fields)


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


def table(head: Sequence[str], rows: Iterable[Sequence[str]], *, words: Sequence[int] = ()) -> str:
    """A table that scrolls sideways; a cell that begins with * is the best of its row.

    Args:
        head: headings, plain text.
        rows: cells, plain text.
        words: columns to align left, besides the first.
    """
    kinds = ["text" if i in words else "" for i in range(len(head))]
    top = "".join(f"<th{_class(kind)}>{text(name)}</th>" for name, kind in zip(head, kinds, strict=True))
    lines = ("".join(_cell(cell, kind) for cell, kind in zip(row, kinds, strict=True)) for row in rows)
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f'<div class="scroll"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def bullets(lines: Iterable[str]) -> str:
    """A list of plain lines."""
    return "<ul>" + "".join(f"<li>{text(line)}</li>" for line in lines) + "</ul>"


def figure(svg: str, caption: str) -> str:
    """A drawing with a line beneath, and a link to the numbers that it holds (`figure_data`)."""
    line, (drawing, data) = text(caption), taken(svg)
    name = re.sub(r"[^a-z0-9]+", "-", caption.lower()).strip("-")[:_NAME] or "figure"
    link = f' <a class="data" download="{name}.csv.gz" href="{data}">data (CSV)</a>' if data else ""
    return f'<figure><div role="img" aria-label="{line}">{drawing}</div><figcaption>{line}{link}</figcaption></figure>'


def gallery(*drawn: str, least: int = 420) -> str:
    """Figures side by side, each at least so many pixels wide where the screen allows; empty without any."""
    some = "".join(drawn)
    narrow = f"grid-template-columns:repeat(auto-fill,minmax(min(100%,{least}px),1fr))"
    columns = "" if least == 420 else f' style="{narrow}"'
    return f'<div class="figures"{columns}>{some}</div>' if some else ""


def lead(line: str) -> str:
    """The first sentence of a page."""
    return f'<p class="lead">{text(line)}</p>'


def soft(line: str) -> str:
    """A remark below a table or a figure; empty for an empty line."""
    return f'<p class="soft">{text(line)}</p>' if line else ""


def note(title: str, lines: Iterable[str]) -> str:
    """A box with a list of warnings; empty without any."""
    some = list(lines)
    heading = f"<strong>{text(title)}</strong>" if title else ""
    return f'<div class="note">{heading}{bullets(some)}</div>' if some else ""


def tiles(shown: Iterable[tuple[str, str]]) -> str:
    """Values with what they are, the first as the main one."""
    parts = (f'<div class="tile{" main" if k == 0 else ""}"><b>{text(value)}</b><span>{text(what)}</span></div>'
             for k, (value, what) in enumerate(shown))  # fmt: skip
    return f'<div class="tiles">{"".join(parts)}</div>'


def entries(shown: Mapping[str, str]) -> str:
    """Names with their values; empty without any."""
    lines = "".join(f"<dt>{text(name)}</dt><dd>{text(value)}</dd>" for name, value in shown.items())
    return f"<dl>{lines}</dl>" if lines else ""


def provenance(shown: Mapping[str, str]) -> Section:
    """Where a page comes from: study, version, command and the like."""
    return Section("Provenance", entries(shown), {"provenance": dict(shown)})


def _cell(cell: str, kind: str) -> str:
    best = cell.startswith("*")
    return f"<td{_class(' '.join(filter(None, (kind, 'best' if best else ''))))}>{text(cell[best:])}</td>"


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""

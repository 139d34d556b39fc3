"""The bricks of a self-contained page: escaped text, tables, the style sheet, the frame."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape

_STYLE = """
:root{--ink:#1c2329;--soft:#5d6871;--rule:#dde2e6;--tint:#f4f6f8;--accent:#0072B2;--warn:#9a4a00}
*{box-sizing:border-box}
body{margin:0;background:#fff;color:var(--ink);
font:16px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:1080px;margin:0 auto;padding:1.5rem 1.2rem 4rem}
h1{font-size:1.7rem;line-height:1.2;margin:.2rem 0 .4rem}
h2{font-size:1.2rem;margin:2.4rem 0 .6rem;padding-bottom:.25rem;border-bottom:2px solid var(--rule)}
h3{font-size:1rem;margin:1.6rem 0 .4rem}
p{max-width:72ch;margin:.4rem 0}
.lead{font-size:1.1rem}
.soft,figcaption{color:var(--soft);font-size:.9rem}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(170px,1fr));gap:.8rem;margin:1rem 0}
.tile{background:var(--tint);border-left:4px solid var(--rule);border-radius:4px;padding:.7rem .9rem}
.tile.main{border-color:var(--accent)}
.tile b{display:block;font-size:1.7rem;line-height:1.2;font-variant-numeric:tabular-nums}
.tile span{color:var(--soft);font-size:.9rem}
.scroll{overflow-x:auto;margin:.6rem 0}
table{border-collapse:collapse;font-size:.9rem;font-variant-numeric:tabular-nums}
th,td{padding:.28rem .8rem .28rem 0;text-align:right;white-space:nowrap;border-bottom:1px solid var(--rule)}
th{color:var(--soft);font-weight:600;vertical-align:bottom}
th:first-child,td:first-child,td.text,th.text{text-align:left}
td.best{font-weight:700}
.wrap td{vertical-align:top}
.wrap td.text{white-space:normal;min-width:12ch;padding-right:1.4rem}
.figures{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,420px),1fr));gap:1rem;align-items:start}
figure{margin:0;min-width:0}
svg{display:block;width:100%;height:auto}
ul{max-width:72ch;padding-left:1.2rem;margin:.4rem 0}
li{margin:.25rem 0}
.note{background:#fdf6ec;border-left:4px solid #e69f00;border-radius:4px;padding:.6rem 1rem;margin:.8rem 0}
dl{display:grid;grid-template-columns:max-content 1fr;gap:.2rem 1.2rem;font-size:.9rem}
dt{color:var(--soft)}
dd{margin:0;overflow-wrap:anywhere}
@media(max-width:520px){main{padding:1rem .8rem 3rem}h1{font-size:1.4rem}
dl{grid-template-columns:1fr}dd{margin-bottom:.4rem}}
@media print{body{font-size:11px}main{max-width:none;padding:0}figure,.tile,tr{break-inside:avoid}
h2,h3{break-after:avoid}.scroll{overflow:visible}}
"""


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
    """A drawing with a line beneath; `svg` is taken as it is."""
    line = text(caption)
    return f'<figure role="img" aria-label="{line}">{svg}<figcaption>{line}</figcaption></figure>'


def page(title: str, body: str) -> str:
    """The whole document; it asks for nothing outside itself."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{text(title)}</title><style>{_STYLE}</style></head>"
        f"<body><main>{body}</main></body></html>\n"
    )


def _cell(cell: str, kind: str) -> str:
    best = cell.startswith("*")
    return f"<td{_class(' '.join(filter(None, (kind, 'best' if best else ''))))}>{text(cell[best:])}</td>"


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""

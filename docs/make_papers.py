"""Write the tables of papers.md: references, and of each item of four papers where it is, what tests it, how it stands.

The references are those of the package (`seatrial cite`), the items stand in papers.toml.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PAGE, DATA = HERE / "papers.md", HERE / "papers.toml"
REFERENCES = HERE.parent / "src" / "seatrial" / "workflow" / "evidence" / "references.toml"
BEGIN, END = "<!-- written by make_papers.py from papers.toml: begin -->", "<!-- end -->"
FIRST, LAST = "<!-- written by make_papers.py from references.toml: begin -->", "<!-- end of references -->"
STATUS = ("implemented", "reproduced", "departed", "not done")


def papers() -> list[dict[str, Any]]:
    """The papers as the data file has them."""
    return tomllib.loads(DATA.read_text(encoding="utf-8"))["paper"]


def numbers(span: str) -> range:
    """The numbers of a row: "7" or "7-9"."""
    first, _, last = span.partition("-")
    return range(int(first), int(last or first) + 1)


def page() -> str:
    """The page with its tables written anew."""
    text = _between(PAGE.read_text(encoding="utf-8"), FIRST, "".join(map(_section, sections())), LAST)
    return _between(text, BEGIN, "".join(map(_paper, papers())), END)


def sections() -> list[dict[str, Any]]:
    """The references by section: title, what was read, papers by key with reference and DOI."""
    return tomllib.loads(REFERENCES.read_text(encoding="utf-8"))["section"]


def _between(text: str, begin: str, made: str, end: str) -> str:
    before, _, rest = text.partition(begin)
    return f"{before}{begin}\n{made}{end}{rest.partition(end)[2]}"


def _section(one: dict[str, Any]) -> str:
    about = f"{one['about']}\n\n" if one["about"] else ""
    rows = "".join(f"| `{key}` | {said} | {doi}{' ' if doi else ''}|\n" for key, (said, doi) in one["papers"].items())
    return f"\n## {one['title']}\n\n{about}| key | reference | DOI |\n|---|---|---|\n{rows}"


def _paper(paper: dict[str, Any]) -> str:
    rows = [line for kind, some in paper["rows"].items() for line in _rows(kind, some)]
    count = sum(paper["counts"].values())
    states = dict.fromkeys(STATUS, 0)
    for some in paper["rows"].values():
        for span, *_, state, _why in some:
            states[state] += len(numbers(span))
    said = ", ".join(f"{n} {state}" for state, n in states.items() if n)
    head = "| item | section | what | where | tested by | status |\n|---|---|---|---|---|---|\n"
    return f"\n### {paper['key']}: {count} items, {said}\n\n{head}{''.join(rows)}"


def _rows(kind: str, rows: list[list[str]]) -> Iterator[str]:
    for span, section, what, where, tests, state, why in rows:
        tested = ", ".join(f"`{name.partition('::')[2]}`" for name in tests.split() if name != "-") or "–"
        cells = (_item(kind, span), section, what, _places(where), tested, f"{state}: {why}" if why else state)
        yield f"| {' | '.join(cell.replace('|', '&#124;') for cell in cells)} |\n"


def _item(kind: str, span: str) -> str:
    ends = [str(n) for n in (numbers(span)[0], numbers(span)[-1])][: 1 + ("-" in span)]
    if kind == "equation":
        return " to ".join(f"({end})" for end in ends)
    name, _, of = kind.partition(" ")
    short = {"table": "Table", "figure": "Fig."}.get(name, f"{of}:")
    return f"{short} {' to '.join(ends)}"


def _places(where: str) -> str:
    found: dict[str, list[str]] = {}
    for place in where.split():
        module, _, name = place.partition(":")
        path = module.replace(".", "/")
        path += ".py" if (HERE.parent / "src" / "seatrial" / f"{path}.py").exists() else "/"
        found.setdefault(path, []).extend([name] if name else [])
    return ", ".join(f"`{path}`{': ' * bool(names)}{', '.join(f'`{n}`' for n in names)}"
                     for path, names in found.items() if path != "-/") or "–"  # fmt: skip


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")

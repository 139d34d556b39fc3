"""Check a built site: every link within it leads somewhere, and no page asks another server for anything.

usage: python docs/site/links.py FOLDER
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# What a browser fetches by itself; a link is followed by a reader.
_FETCHED = {
    ("script", "src"), ("img", "src"), ("link", "href"), ("iframe", "src"), ("source", "src"), ("object", "data"),
}  # fmt: skip
_NOT_FETCHED = {"canonical", "search", "index", "next", "prev", "author", "copyright"}


class Page(HTMLParser):
    """Links and anchors of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.fetched: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect what a tag names and where it points."""
        held = {key: value for key, value in attrs if value is not None}
        self.anchors |= {held[key] for key in ("id", "name") if key in held}
        if tag == "a" and "href" in held:
            self.links.append(held["href"])
        for key, value in held.items():
            if (tag, key) in _FETCHED and held.get("rel") not in _NOT_FETCHED:
                self.fetched.append(value)


def faults(folder: Path) -> Iterator[str]:
    """What is wrong, a line each."""
    pages: dict[Path, Page] = {}
    for path in sorted(set(folder.rglob("*.html")) - set((folder / "_static").rglob("*"))):
        pages[path] = Page()
        pages[path].feed(path.read_text(encoding="utf-8"))
    for path, page in pages.items():
        here = path.relative_to(folder).as_posix()
        yield from (f"{here}: asks {one}" for one in page.fetched if urlsplit(one).netloc)
        for link in dict.fromkeys([*page.links, *page.fetched]):
            yield from (f"{here}: {link}: {why}" for why in _dead(path, link, pages))


def _dead(path: Path, link: str, pages: dict[Path, Page]) -> Iterator[str]:
    """Why a link leads nowhere; pages of source know a name by its module, not by the room that offers it."""
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if target.is_dir():
        target /= "index.html"
    if not target.exists():
        yield "no such file"
    elif parts.fragment and target in pages and "_modules" not in path.parts:
        if unquote(parts.fragment) in pages[target].anchors:
            return
        yield "no such place on the page"


def main(arguments: list[str]) -> int:
    """Print what is wrong; zero where nothing is."""
    if len(arguments) != 1 or not Path(arguments[0]).is_dir():
        print(__doc__, file=sys.stderr)
        return 2
    found = list(faults(Path(arguments[0]).resolve()))
    print("\n".join(found) or "every link leads somewhere, nothing is asked from elsewhere")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

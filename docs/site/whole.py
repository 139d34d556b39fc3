"""The documentation in one PDF, and the site of every version: `make pdf`, `make versions`.

    python docs/site/whole.py build/seatrial.pdf
    python docs/site/whole.py --versions build/versions

The PDF is the site, printed by a browser, as only browsers draw MathML.  The site of the
working tree lies in `latest`, that of each tag vX.Y.Z in X.Y.Z; each page links to the same page of the others.
"""

from __future__ import annotations

import html
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chromium-headless-shell")
NEXT = re.compile(r'<link rel="next"[^>]* href="([^"#]+)"')
TAG = re.compile(r"v(\d+\.\d+\.\d+)")


def sphinx(builder: str, docs: Path, out: Path, versions: Sequence[str] = (), this: str = "") -> None:
    """Build the pages of a checkout; those that it links to are told by the environment."""
    around = {**os.environ, "SEATRIAL_DOCS": " ".join([this, *(one for one in versions if one != this)])}
    command = [sys.executable, "-m", "sphinx", "-q", "-b", builder, str(docs), str(out)]
    subprocess.run(command, check=True, env=around)


def printed(out: Path) -> None:
    """All pages as one PDF, in the order in which they follow each other; SystemExit without a browser.

    Page by page: one page of all of them keeps a browser busy for longer than anyone waits.
    """
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise SystemExit(f"a PDF is printed by a browser, and none of {', '.join(BROWSERS)} is on the path")
    pdf = import_module("pypdf")
    with tempfile.TemporaryDirectory() as folder, pdf.PdfWriter() as whole:
        site = Path(folder) / "site"
        sphinx("html", ROOT / "docs", site)
        for page in following(site):
            one = Path(folder) / "page.pdf"
            flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"]
            place = [f"--user-data-dir={folder}/browser", f"--print-to-pdf={one}"]
            subprocess.run([browser, *flags, *place, page.as_uri()], check=True, stderr=subprocess.DEVNULL)
            whole.append(one, outline_item=title(page))
        out.parent.mkdir(parents=True, exist_ok=True)
        whole.write(out)


def following(site: Path) -> list[Path]:
    """The pages of a built site from the first on, each where the one before it says what comes next."""
    found = [(site / "index.html").resolve()]
    while (after := NEXT.search(found[-1].read_text(encoding="utf-8"))) is not None:
        page = (found[-1].parent / after[1]).resolve()
        if page in found:
            break
        found.append(page)
    return found


def title(page: Path) -> str:
    """What a page calls itself, without the name of the site behind it."""
    said = re.search(r"<title>(.*?)</title>", page.read_text(encoding="utf-8"), re.DOTALL)
    return html.unescape(said[1]).rpartition(" \N{EM DASH} ")[0] if said else page.stem


def released(tags: str) -> list[str]:
    """The versions among tags, the newest first."""
    found = [match[1] for match in map(TAG.fullmatch, tags.split()) if match]
    return sorted(found, key=lambda one: tuple(map(int, one.split("."))), reverse=True)


def every(out: Path) -> None:
    """The site of each version, from its own tag."""
    told = subprocess.run(["git", "tag"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    versions = ["latest", *released(told)]
    for one in versions:
        if one == "latest":
            sphinx("html", ROOT / "docs", out / one, versions, one)
            continue
        with tempfile.TemporaryDirectory() as folder:
            tree = Path(folder) / "tree"
            subprocess.run(["git", "worktree", "add", "-q", "--detach", str(tree), f"v{one}"], cwd=ROOT, check=True)
            try:
                sphinx("html", tree / "docs", out / one, versions, one)
            finally:
                subprocess.run(["git", "worktree", "remove", "--force", str(tree)], cwd=ROOT, check=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["--versions"]:
        every(Path(sys.argv[2]))
    else:
        printed(Path(sys.argv[1]))

"""The documentation in one PDF, and the site of every version: `make pdf`, `make versions`.

    python docs/site/whole.py build/seatrial.pdf
    python docs/site/whole.py --versions build/versions

The PDF is the single page that Sphinx writes, printed by a browser, as only browsers draw MathML.  The site of the
working tree lies in `latest`, that of each tag vX.Y.Z in X.Y.Z; each page links to the same page of the others.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chromium-headless-shell")
TAG = re.compile(r"v(\d+\.\d+\.\d+)")


def sphinx(builder: str, docs: Path, out: Path, versions: Sequence[str] = (), this: str = "") -> None:
    """Build the pages of a checkout; those that it links to are told by the environment."""
    around = {**os.environ, "SEATRIAL_DOCS": " ".join([this, *(one for one in versions if one != this)])}
    command = [sys.executable, "-m", "sphinx", "-q", "-b", builder, str(docs), str(out)]
    subprocess.run(command, check=True, env=around)


def printed(out: Path) -> None:
    """All pages as one PDF; SystemExit without a browser."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise SystemExit(f"a PDF is printed by a browser, and none of {', '.join(BROWSERS)} is on the path")
    with tempfile.TemporaryDirectory() as folder:
        sphinx("singlehtml", ROOT / "docs", Path(folder) / "page")
        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer"]
        place = f"--user-data-dir={folder}/browser"
        out.parent.mkdir(parents=True, exist_ok=True)
        page = (Path(folder) / "page" / "index.html").as_uri()
        command = [browser, *flags, place, f"--print-to-pdf={out.resolve()}", page]
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL)


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

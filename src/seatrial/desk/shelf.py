"""What a folder holds, by the kind of file that the commands know: logs, trials, ships, studies, runs, pages."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path

from ..core.errors import DataError, RequestError
from ..core.values import dataclass
from ..data.guess.guessing import reader_of
from ..study.store import ARRAYS, HISTORY, RUN, SUMMARY

JOBS = ".seatrial"
"""Folder of the commands that were run, below that of the user."""
LOGS = "logs"
"""Folder to which dropped logs go."""

_MOST = 2000
"""Files that are looked at."""
_HEAD = 4096
"""Bytes of a file that tell its kind."""
_SCHEMAS = {
    "ship": "ship", "study": "study", "series": "study", "particulars": "particulars", "steps": "steps",
    "mapping": "mapping", "nmea": "mapping", "robot": "mapping", "captive": "mapping", "scenario": "scenario",
    "case": "case", "campaign": "campaign",
}  # fmt: skip
_ENDINGS = {".html": "page", ".fmu": "fmu"} | dict.fromkeys(
    (".yaml", ".md", ".npz", ".png", ".jpg", ".jpeg", ".svg", ".pdf", ".docx", ".py", ".ipynb", ".c", ".h"), ""
)
_PRODUCTS = (".toml", ".html", ".fmu")
_OF_A_FIT = (SUMMARY, HISTORY, ARRAYS, RUN, "report.json")


@dataclass(frozen=True)
class Item:
    """One thing in the folder.

    Attributes:
        path: below the folder, with forward slashes.
        kind: "log", "logs", "mapping", "trials", "steps", "particulars", "ship", "study", "run", "page", "fmu",
            "scenario", "case" or "campaign".
        size: bytes of a file; number of logs or trials of a folder.
        names: the trials of a folder of trials.
        format: of logs that are read without a mapping; empty of tables, and of what is not known.
    """

    path: str
    kind: str
    size: int
    names: tuple[str, ...] = ()
    format: str = ""


def shelf(folder: Path) -> tuple[Item, ...]:
    """What lies in a folder and in the folders right below it, in the order of the work."""
    order = ("logs", "log", "mapping", "trials", "steps", "particulars", "ship", "study", "run", "page", "fmu")
    found: list[Item] = []
    fitted = (folder / SUMMARY).exists()
    for path in _visible(folder):
        if fitted and path.name in _OF_A_FIT:
            continue  # no log, and no work
        found += _folder(folder, path) if path.is_dir() else _file(folder, path)
    rank = {kind: k for k, kind in enumerate(order)}
    return tuple(sorted(found, key=lambda one: (rank.get(one.kind, len(order)), one.path)))


def inside(folder: Path, name: str) -> Path:
    """The path of a name below the folder.

    Raises:
        RequestError: it is no plain name, begins with a dash, is hidden, or leads out of the folder.
    """
    parts = name.replace("\\", "/").split("/")
    if not name or any(part in ("", "..") or part[0] in ".-~" or ":" in part or not part.isprintable()
                       for part in parts):  # fmt: skip
        raise RequestError(f"'{name}' is no name in this folder; write letters, digits, dots and dashes, as in run_1")
    path = folder.joinpath(*parts)
    if not path.resolve().is_relative_to(folder.resolve()):
        raise RequestError(f"'{name}' lies outside of this folder")
    return path


def place_of(name: str) -> str:
    """Where a dropped file goes: what a command has made stays beside the others, every other file is a log."""
    return name if Path(name).suffix.lower() in _PRODUCTS else f"{LOGS}/{name}"


def _visible(folder: Path) -> Iterator[Path]:
    for count, path in enumerate(sorted(folder.iterdir())):
        if count >= _MOST:
            return
        if not path.name.startswith(".") and path.exists():
            yield path


def _folder(root: Path, folder: Path) -> list[Item]:
    """A folder is one item, and the files in it that a command takes by themselves are others."""
    name = folder.relative_to(root).as_posix()
    files = [path for path in _visible(folder) if path.is_file()]
    if (folder / SUMMARY).exists():
        products = [one for path in files if path.suffix in _PRODUCTS for one in _file(root, path)]
        return [Item(name, "run", len(files)), *products]
    trials = tuple(path.stem for path in files if path.suffix == ".csv" and path.with_suffix(".yaml").exists())
    if trials:
        return [Item(name, "trials", len(trials), trials)]
    logs = [path for path in files if _kind(path) == "log"]
    others = [one for path in files if path.suffix in _PRODUCTS for one in _file(root, path)]
    return ([Item(name, "logs", len(logs), format=_format(folder))] if logs else []) + others


def _file(root: Path, path: Path) -> list[Item]:
    kind = _kind(path)
    format = _format(path) if kind == "log" else ""
    return [Item(path.relative_to(root).as_posix(), kind, path.stat().st_size, format=format)] if kind else []


def _format(path: Path) -> str:
    try:
        known = reader_of(path)
    except (DataError, OSError):
        return ""
    return known.format if known is not None and not known.tabular else ""


def _kind(path: Path) -> str:
    """Of a TOML file by its schema; what no command reads has none."""
    if path.suffix == ".toml":
        return _SCHEMAS.get(_schema(path), "")
    return _ENDINGS.get(path.suffix.lower(), "log")


def _schema(path: Path) -> str:
    """The first word of a schema after "seatrial-", from the head of a file; empty where it has none."""
    try:
        with path.open("rb") as file:
            lines = file.read(_HEAD).decode("utf-8", errors="replace").splitlines()
        line = next((line for line in lines if line.replace(" ", "").startswith("schema=")), "")
        said = tomllib.loads(line).get("schema", "")
    except (OSError, tomllib.TOMLDecodeError):
        return ""
    return said.removeprefix("seatrial-").partition("/")[0] if isinstance(said, str) else ""

"""A published paper run anew: its tables and figures beside ours, on one page.

Each paper has a script below `REPORTS` with `COST`, what it takes in words, and either `made(command)`, which gives the
page, and `TABLES`, those that its parts are titled by, or `STUDY`, the study whose report is the page.  Sawada 2024 has
no runs of its own: its page has its Table 1 and ships of the library under its requirements.
"""

from __future__ import annotations

import importlib.util
import math
import re
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import numpy as np

from ...core.files import read_toml
from ...core.values import dataclass
from ...core.version import __version__
from ...data import Trial
from ...identify.design.excitation import TABLE_1, Published, dimensionless_length
from ...report import printed
from ...report.blocks import fields, lead, line
from ...report.judging.requirements import brief
from ...report.page import Page, Section, provenance, write
from ...ships.files import load
from ...validate.requirements.scopes import judge
from .. import SILENT, Outcome, RequestError, Sink
from ..request import PAGES, check_output

REPORTS = Path("studies") / "reports"
"""Where the scripts are, below the working folder."""

PAPERS = ("sawada2024", "suyama2023", "wakita2022", "you2023")
"""The papers whose tables `paper` makes again."""
_JUDGED = {"collision-avoidance": "kvlcc2", "berthing": "esso_osaka_3m_harbour"}
_L_PP, _FROUDE, _WAKITA = 3.0, 0.05, 65
_TABLES = re.compile(r"\bTab(?:le)?s?\.? (\d+(?:(?:, | and | to )\d+)*)")


@dataclass(frozen=True)
class Made:
    """The page that was written, and the titles of its parts."""

    page: Path
    parts: tuple[str, ...]


def paper(key: str, out: Path, *, table: int | None = None, sink: Sink = SILENT) -> Outcome[Made]:
    """Run a paper, and write its page.

    Args:
        key: one of `PAPERS`.
        table: the table that is wanted alone; the run is the same.

    Raises:
        RequestError: an unknown paper or table, a folder without the scripts, an output that is no page.
    """
    if key not in PAPERS:
        raise RequestError(f"no paper '{key}'; known: {', '.join(PAPERS)}")
    check_output(out, PAGES, "the page of a paper")
    made, study, cost, tables = _how(key)
    if made is None and table is not None:
        raise RequestError(f"--table: the page of {key} is the report of {study}, which is made whole; for some of its "
                           f"rows: seatrial identify {study} --only NAME -o RUN (published, mmg: 20 s)")  # fmt: skip
    if table is not None and table not in tables:
        raise RequestError(f"--table {table}: the page of {key} has tables {', '.join(map(str, tables))}")
    sink.note(f"{key} takes {cost}")
    begin = time.perf_counter()
    if made is None:
        parts = _of_study(study, out, sink)
    else:
        page = made(f"seatrial paper {key}{'' if table is None else f' --table {table}'} -o {out}")
        page = page if table is None else part(page, table)
        write(out, page)
        parts = tuple(one.title for one in page.sections if one.title)
    sink.note(f"wrote {out} after {time.perf_counter() - begin:.0f} s")
    said = f"{key}: {', '.join(parts)}"
    return Outcome(Made(out, parts), fields({"paper": key, "page": out, "parts": list(parts)}, line(said)))


def _how(key: str) -> tuple[Callable[[str], Page] | None, Path, str, tuple[int, ...]]:
    """What makes the page, or the study whose report it is; what that takes; the tables on it."""
    if key == "sawada2024":
        return _sawada, Path(), "half a minute on two cores", (1,)
    script = _script(key)
    return getattr(script, "made", None), Path(getattr(script, "STUDY", "")), script.COST, getattr(script, "TABLES", ())


def part(page: Page, table: int) -> Page:
    """The page with what stands above all sections, those whose titles name a table, and the last, its provenance."""
    *sections, last = page.sections
    return Page(page.title, (*(one for one in sections if not one.title or table in _named(one.title)), last))


def _named(title: str) -> frozenset[int]:
    """The tables that a title names: "Tables 1 and 3 to 6" are 1, 3, 4, 5 and 6."""
    found: set[int] = set()
    for numbers in _TABLES.findall(title):
        for span in re.split(r", | and ", numbers):
            first, _, last = span.partition(" to ")
            found |= set(range(int(first), int(last or first) + 1))
    return frozenset(found)


def _script(key: str) -> ModuleType:
    path = REPORTS / f"{key}.py"
    spec = importlib.util.spec_from_file_location(f"seatrial_paper_{key}", path)
    if spec is None or spec.loader is None or not path.is_file():
        raise RequestError(f"no file {path} here; papers are run in a checkout of the repository")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # where a dataclass looks for its annotations
    sys.path.insert(0, str(path.parent.resolve()))  # scripts import those beside them
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.pop(0)
    return module


def _of_study(study: Path, out: Path, sink: Sink) -> tuple[str, ...]:
    """Run a study in the folder that has the name of the page, and put its report in the place of the page."""
    from ..identify import identify

    run = out.with_suffix("")
    identify(study, run, sink=sink)
    for kind in (".html", ".json"):
        shutil.copyfile((run / "report.html").with_suffix(kind), out.with_suffix(kind))
    return (f"report of {study}",)


def _sawada(command: str) -> Page:
    """Table 1, and the requirements of section 6.2 of two ships."""
    rows = [row for found in TABLE_1 for row in _lengths(found)]
    numbers = {"schema": "seatrial-printed/1", "rows": {"table 1": printed.fields(rows)}}
    said = "Sawada 2024: Table 1 as printed, with the length that could be computed, and what section 6.2 requires."
    return Page("Sawada 2024, printed and ours", (
        Section("", fields(numbers, lead(said))),
        Section("Table 1: data of published identifications", printed.side_by_side(rows, first="T' of")),
        *(Section(f"Section 6.2, {scope}: {name}", brief(judge(load(name), scope)))
          for scope, name in _JUDGED.items()),
        provenance({"version": f"seatrial {__version__}", "command": command}),
    ))  # fmt: skip


def _lengths(found: Published) -> Iterator[printed.Row]:
    """Printed lengths of one row; the logs of all but Wakita 2022 were not read."""
    for length in dict.fromkeys(found.length):
        name = f"[{found.reference}] {found.model}, {found.manoeuvres}"
        if found.reference == _WAKITA:
            why = ("from the seconds that Table 6 of that paper prints for TZRB, with V of Fr = 0.05; which recordings "
                   "the print counts besides is not said")  # fmt: skip
            yield printed.Row(name, length, _length_of_wakita(), "", why)
        else:
            yield printed.Row(name, length, "not computed", "", "its logs were not read")


def _length_of_wakita() -> float:
    """T' of the training set TZRB of Wakita 2022 by Eq. 33."""
    seconds = read_toml(REPORTS.parent / "wakita2022_tables.toml")["seconds"]["TZRB"]
    sets = [Trial(kind, np.array([0.0, T]), {}) for kind, T in seconds.items()]
    return dimensionless_length(sets, _FROUDE * math.sqrt(9.81 * _L_PP), _L_PP)

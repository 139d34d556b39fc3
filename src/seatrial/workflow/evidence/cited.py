"""What a result owes to whom: papers of its numbers, equations and estimator, data sets, programs.

Keys of papers stand in the sources of a ship's numbers, and in docstrings as "Suyama 2023" or "suyama2023";
`references.toml` has what is behind each.  So a part or an estimator from elsewhere is credited by its own docstring.
"""

from __future__ import annotations

import inspect
import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, cast

from ...core.errors import SeatrialError
from ...core.values import dataclass, fields, is_dataclass
from ...core.version import __version__
from ...report.blocks import Body, bullets, table
from ...report.blocks import fields as said
from ...ships import Ship
from ...ships.classes import find_class
from ...ships.files import library, load, variants
from ...study.schema import USUAL
from ...study.store import Summary, summary_beside
from .. import Outcome
from ..request import ship_of

_NAMED = re.compile(
    r"\b([A-Z][a-z]+)(?:(?:,? and |,? & |, )(?:van |de )?[A-Z][a-z]+)*(?: et al\.)?,? \(?((?:19|20)\d\d)\b"
)
_KEY = re.compile(r"\b[a-z][a-z_]*(?:(?:19|20)\d\d)?\b")
# What everything is made with.
_PROGRAMS = ("andersson2019", "harris2020", "virtanen2020")
_FITTED = "fitted in study"


@dataclass(frozen=True)
class Owed:
    """Thanks to one publication, data set or program.

    Attributes:
        what: "numbers", "equations", "estimator", "data" or "program".
        key: of `references`; empty of what has none.
        why: which numbers, equations or trials.
        reference, doi: as they are cited; empty where not known.
    """

    what: str
    key: str
    why: str
    reference: str
    doi: str = ""


@dataclass(frozen=True)
class Cited:
    """All that a ship or a fit owes.

    Attributes:
        owed: by what it is for.
        others: sources of numbers without a publication in the list, and how many numbers each has.
        cautions: what could not be found out, one line each.
    """

    name: str
    owed: tuple[Owed, ...]
    others: Mapping[str, int]
    cautions: tuple[str, ...]


def cite(run: str) -> Outcome[Cited]:
    """What a run, a fitted model or a ship owes to whom.

    Args:
        run: folder of a run, a ship file, or a ship of the library.

    Raises:
        ShipError, StudyError: it cannot be read.
    """
    model = run if run in (*library(), *variants()) or not Path(run).is_dir() else str(Path(run) / "model.toml")
    ship, fit = ship_of(model), summary_beside(model)
    sources, cautions = _sources(ship, fit)
    found = Cited(
        ship.name,
        (*_numbers(sources), *_equations(ship), *(_estimators(fit) if fit else ()), *(_data(fit) if fit else ()),
         Owed("program", "", "everything", f"seatrial {__version__} (CITATION.cff)"),
         *(Owed("program", key, "everything", *references()[key]) for key in _PROGRAMS)),
        Counter(_short(one) for one in sources.values() if not _keys(one)), tuple(cautions),
    )  # fmt: skip
    return Outcome(found, _shown(found))


@cache
def references() -> Mapping[str, tuple[str, str]]:
    """Reference and DOI of each paper by key."""
    text = Path(__file__).with_name("references.toml").read_text(encoding="utf-8")
    return {key: (str(one[0]), str(one[1])) for part in tomllib.loads(text)["section"]
            for key, one in part["papers"].items()}  # fmt: skip


def named(text: str) -> dict[str, str]:
    """Papers that a text names, as keys or as author and year: what it writes by key, in its order."""
    whole = " ".join(text.split())
    found = [(one.start(), f"{one[1].lower()}{one[2]}", one[0].replace("(", "")) for one in _NAMED.finditer(whole)]
    found += [(one.start(), one[0], one[0]) for one in _KEY.finditer(whole) if one[0] in references()]
    return {key: written for _, key, written in sorted(found, reverse=True)[::-1]}


def _sources(ship: Ship, fit: Summary | None) -> tuple[dict[str, str], list[str]]:
    """The source of each number; of a fitted one that of the number it began from, which its prior stands on."""
    sources = {path: one.source for path, one in ship.entries.items()}
    fitted = [path for path, source in sources.items() if source.startswith(_FITTED)]
    if not fitted:
        return sources, []
    began = _began(fit) if fit else None
    if began is None:
        return sources, [f"{len(fitted)} numbers were fitted; the ship file that they began from is not at hand: cite "
                         "it too"]  # fmt: skip
    return {**sources, **{path: began.entries[path].source for path in fitted if path in began.entries}}, []


def _began(fit: Summary) -> Ship | None:
    """The ship that the study names, which is in the library, or a file that is still there."""
    named = str(fit.provenance.get("ship", ""))
    said = str(tomllib.loads(fit.study_text).get("ship", named)) if fit.study_text else named
    file = Path(fit.study_file).parent / said
    if said in (*library(), *variants()):
        return load(said)
    return load(file) if file.suffix == ".toml" and file.is_file() else None


def _numbers(sources: Mapping[str, str]) -> Iterator[Owed]:
    parts: dict[str, Counter[str]] = {}
    for path, source in sources.items():
        for key in _keys(source):
            parts.setdefault(key, Counter())[path.partition(".")[0]] += 1
    for key, counted in parts.items():
        why = ", ".join(f"{part} {n}" for part, n in counted.items())
        yield Owed("numbers", key, why, *references()[key])


def _keys(source: str) -> tuple[str, ...]:
    """Papers of a source; what its formula was only compared with is none of them."""
    said = "" if source.startswith(_FITTED) else source.partition("; others: ")[0]
    return tuple(key for key in named(said) if key in references())


def _short(source: str) -> str:
    """A source without the reason of one number."""
    return _FITTED if source.startswith(_FITTED) else re.split(r"[:;,(]", source, maxsplit=1)[0].strip()


def _equations(ship: Ship) -> Iterator[Owed]:
    """Papers of the docstrings of a model and of its parts."""
    yield from _told("equations", dict.fromkeys(_parts(ship.model)))


def _parts(value: Any) -> Iterator[type]:
    if not is_dataclass(value):
        return
    yield type(value)
    for one in fields(value):
        inner = getattr(value, one.name)
        for part in cast("tuple[Any, ...]", inner) if isinstance(inner, tuple) else (inner,):
            yield from _parts(part)


def _estimators(fit: Summary) -> Iterator[Owed]:
    """Papers of the estimators that the study names, or of the usual one."""
    study = tomllib.loads(fit.study_text) if fit.study_text else {}
    tables = [one.get("estimator") for one in study.get("fits", {}).values()] or [study.get("estimator")]
    kinds = dict.fromkeys(str((one or {}).get("type", USUAL)) for one in tables)
    classes: list[type] = []
    for kind in kinds:
        try:
            classes.append(find_class(kind, "identify", "estimator"))
        except SeatrialError:  # of a module that is not trusted here
            yield Owed("estimator", "", kind, "not of this package; see its own documentation")
    yield from _told("estimator", dict.fromkeys(classes))


def _told(what: str, classes: Mapping[type, None]) -> Iterator[Owed]:
    why: dict[str, list[str]] = {}
    written: dict[str, str] = {}
    for cls in classes:
        whole = f"{inspect.getdoc(sys.modules[cls.__module__]) or ''} {inspect.getdoc(cls) or ''}"
        for key, words in named(whole).items():
            written.setdefault(key, words)
            why.setdefault(key, []).append(f"{cls.__module__.rpartition('.')[2]}:{cls.__name__}")
    for key, names in why.items():
        yield Owed(what, key, ", ".join(names), *references().get(key, (f"{written[key]}, named by its docstring", "")))


def _data(fit: Summary) -> Iterator[Owed]:
    counted = Counter(one.source for one in fit.grounds.trials)
    for source, n in counted.items():
        trials = f"{n} trial{'s' * (n != 1)}"
        yield Owed("data", "", trials, source or "no source in the sidecars of these trials; name who sailed them")


def _shown(found: Cited) -> Body:
    rows = [(one.what, one.why, one.reference, one.doi or "–") for one in found.owed]
    notes = [f"not in the list of papers, {n} number{'s' * (n != 1)}: {source}" for source, n in found.others.items()]
    document = {"ship": found.name, "owed": list(map(vars, found.owed)), "others": dict(found.others),
                "cautions": found.cautions}  # fmt: skip
    shown = table(("for", "of", "cite", "DOI"), rows, words=(1, 2))
    return said(document, shown + bullets(notes) + bullets(found.cautions))

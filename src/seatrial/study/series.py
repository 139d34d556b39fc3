"""Files of many fits: models trained on different trials, with several seeds, and judged on the same tests.

A `Series` is a table: its rows are models, its columns are trials that no fit has seen.  Each fit with each of its
seeds is a `Cell`, a problem of its own that can be run by itself.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from ..core.files import is_plain, read_toml
from ..core.parameters import unknown
from ..core.records import document_of, filled, of_schema, read_record
from ..core.values import dataclass, field, replace
from ..data import Trial
from ..identify import Estimator, Loss, Nuisance, Problem, StudyError
from ..ships import Ship
from ..ships.classes import Trust, trusting
from .cells import Cell
from .data import Composition, read_compositions, read_data
from .freedom import freedom, stated, suspected
from .schema import Claim, DataTable, Published, SeriesFile
from .study import read_estimator, read_ship

SCHEMA = "seatrial-series/1"
PUBLISHED = "seatrial-published/1"
"""Of a file that holds what a publication prints, which several tables of fits may name."""
FULL, QUICK = "full", "quick"


@dataclass(frozen=True)
class Row:
    """One model of the table.

    Attributes:
        key: its name in the file.
        title: heading in the report.
        ship: as it is before any fit; the model itself where nothing is fitted.
        train: composition or files as the study names them.
        cells: one for each seed; none where the ship is judged as it is.
        published: column of a publication that it stands for, or empty.
    """

    key: str
    title: str
    ship: Ship
    train: tuple[str, ...]
    cells: tuple[Cell, ...]
    published: str = ""


@dataclass(frozen=True)
class Series:
    """A file of many fits, read and ready to run.

    Attributes:
        tests: trials that no fit sees, by the label of their row.
        watched: trials that decide when a training stops, by label.
        budget: name of the size it was read in.
        sigma: scale of each state; empty where the report has to find one.
        draw, seeds: keys of the models whose tracks are drawn, the best seed or all, of every test in `tracks`.
        curves: keys of the models that a line over the seconds of training joins, by the label of the line.
        compositions: the recordings of each set that the file of sets names.
        only: keys of the models that are to be fitted; none is all.
        partial: the report shows the cells that are done where others fail; if not, one that fails ends the run.
        kept_back: whether the report judges fits on trials that they have not seen.
        notes: for the user, beside those of the lint.
    """

    partial: ClassVar[bool] = True
    kept_back: ClassVar[bool] = True
    notes: ClassVar[tuple[str, ...]] = ()

    name: str
    path: Path
    title: str
    about: str
    rows: tuple[Row, ...]
    tests: Mapping[str, Trial]
    watched: Mapping[str, Trial]
    claims: tuple[Claim, ...]
    published: Published
    restart: float | None
    sigma: Mapping[str, float]
    draw: tuple[str, ...]
    seeds: tuple[str, ...]
    tracks: tuple[str, ...]
    budget: str = FULL
    curves: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    compositions: Mapping[str, Composition] = field(default_factory=dict[str, Composition])
    only: tuple[str, ...] = ()

    @property
    def cells(self) -> tuple[Cell, ...]:
        """The fits that are asked for, in the order of the file."""
        return tuple(cell for row in self.rows if not self.only or row.key in self.only for cell in row.cells)

    @property
    def apart(self) -> tuple[Trial, ...]:
        """Trials that no fit sees."""
        return tuple(self.tests.values())

    def row(self, key: str) -> Row:
        """The model of that name."""
        return next(row for row in self.rows if row.key == key)


def is_series(path: str | Path) -> bool:
    """Whether a file is one of this kind; what cannot be read is none."""
    try:
        return read_toml(Path(path)).get("schema") == SCHEMA
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError):
        return False


def read_series(
    path: str | Path, budget: str = FULL, *, trust: Trust = False, suspects: bool = False, only: Sequence[str] = ()
) -> Series:
    """Read a file of many fits and all that it names.

    Args:
        budget: "full", or one of its [budgets].
        suspects: as if each fit had `suspects = "auto"` in its [nuisance].
        only: keys of the models that are to be fitted, for which `suspects` is; none is all.
        trust: modules outside the package whose classes it may name, and so run; True for any.

    Raises:
        StudyError: naming the file, the key and what would be right.
        ShipError, DataError, ParameterError: from what the file names.
    """
    here = Path(path)
    said = _checked(here, of_schema(document_of(here, StudyError), SCHEMA, here, StudyError))
    if budget != FULL and budget not in said.budgets:
        raise StudyError(f"{here}: {unknown(budget, (FULL, *said.budgets), 'budget')}")
    _check_names(here, said)
    size = said.budgets.get(budget)
    reader = _Reader(here, said, size, tuple(only or said.fits) if suspects else ())
    with trusting(trust):
        rows = tuple(reader.row(key) for key in said.fits if size is None or not size.fits or key in size.fits)
    held = [row.key for row in rows]
    for name in only:
        if name not in held:
            raise StudyError(f"{here}: {unknown(name, held, 'fit')}")
    tests, watched = reader.kept_apart(rows[0].ship)
    return Series(
        here.stem, here, said.title or here.stem, said.about, rows, tests, watched,
        tuple(claim for claim in said.claims if claim.better in held and claim.worse in held),
        _published(here, said.published),
        said.report.restart, said.report.sigma or said.loss.sigma, tuple(k for k in said.report.draw if k in held),
        tuple(k for k in said.report.seeds if k in held), tuple(said.report.tracks), budget,
        {label: tuple(k for k in keys if k in held) for label, keys in said.report.curves.items()},
        read_compositions(here.parent / said.data.sets) if said.data.sets else {}, tuple(only),
    )  # fmt: skip


def _published(path: Path, said: Published | str | None) -> Published:
    """What a publication prints, from the file itself or from the one it names."""
    if not isinstance(said, str):
        return said or Published(source="")
    here = path.parent / said
    if not here.is_file():
        raise StudyError(f"{path}: published: no such file: {here}")
    return read_record(here, Published, PUBLISHED, StudyError)


def _checked(path: Path, document: Mapping[str, Any]) -> SeriesFile:
    """The document with its keys and types checked, each fit completed by the one that it is like."""
    whole = {**document, "fits": _completed(path, document.get("fits", {}))}
    found = filled(SeriesFile, whole, path, StudyError)
    for key, fit in found.fits.items():
        if not is_plain(key):
            raise StudyError(f"{path}: fits: '{key}' names a folder of the run; take letters, digits, spaces, '-', '_'")
        if not fit.ship:
            raise StudyError(f"{path}: fits.{key}.ship is missing")
        if bool(fit.train) != bool(fit.estimator):
            lacking = "estimator" if fit.train else "train"
            raise StudyError(f"{path}: fits.{key}.{lacking} is missing; without both, the ship is judged as it is")
    return found


def _completed(path: Path, fits: Any) -> Any:
    """Each fit with what it leaves to the one it is like; its estimator and its [free] setting by setting."""
    if not isinstance(fits, dict) or not all(isinstance(fit, dict) for fit in fits.values()):
        return fits
    out: dict[str, Any] = {}
    for key, fit in fits.items():
        base = fit.get("like", "")
        if base and base not in out:
            raise StudyError(f"{path}: fits.{key}.like: {unknown(base, out, 'fit before it')}")
        other = out.get(base, {})
        merged = {name: {**other.get(name, {}), **fit.get(name, {})} for name in ("estimator", "free")}
        out[key] = {**other, **fit, **{name: table for name, table in merged.items() if table}}
    return out


def _check_names(path: Path, said: Any) -> None:
    """Claims, drawings and validation name what there is."""
    places = [(f"claims {k}", name, said.fits, "fit") for k, claim in enumerate(said.claims, start=1)
              for name in (claim.better, claim.worse)]  # fmt: skip
    places += [(f"claims {k}", row, said.data.test, "row") for k, claim in enumerate(said.claims, start=1)
               for row in claim.rows]  # fmt: skip
    places += [(f"budgets.{key}.fits", name, said.fits, "fit")
               for key, size in said.budgets.items() for name in size.fits]  # fmt: skip
    places += [(f"budgets.{key}.settings", kind, types, "estimator among its fits")
               for key, size in said.budgets.items() for kind in size.settings
               for types in [{str(fit.estimator["type"]) for name, fit in said.fits.items()
                              if "type" in fit.estimator and (not size.fits or name in size.fits)}]]  # fmt: skip
    places += [("report", name, said.fits, "fit") for name in (*said.report.draw, *said.report.seeds)]
    places += [(f"report.curves.{label}", name, said.fits, "fit")
               for label, names in said.report.curves.items() for name in names]  # fmt: skip
    places += [("report.tracks", name, said.data.test, "row") for name in said.report.tracks]
    places += [(f"fits.{key}.validation", name, said.data.validation, "trial of data.validation")
               for key, fit in said.fits.items() for name in fit.validation or ()]  # fmt: skip
    titles = [fit.title or key for key, fit in said.fits.items()]
    for key, title in zip(said.fits, titles, strict=True):
        if titles.count(title) > 1:
            raise StudyError(f"{path}: fits.{key}.title: two fits are called '{title}'; tell them apart")
    for where, name, known, what in places:
        if name not in known:
            raise StudyError(f"{path}: {where}: {unknown(name, known, what)}")


class _Reader:
    """Problems of one file; trials that several fits share are read once."""

    def __init__(self, path: Path, said: Any, size: Any, suspects: tuple[str, ...]) -> None:
        self.path, self.said, self.size, self.suspects = path, said, size, suspects
        self._read: dict[tuple[tuple[str, ...], ...], tuple[tuple[Trial, ...], ...]] = {}

    def row(self, key: str) -> Row:
        fit = self.said.fits[key]
        ship = read_ship(self.path, fit.ship)
        cells: tuple[Cell, ...] = ()
        if fit.train:
            problem = self._problem(key, fit, ship)
            where, asked = f"{self.path}: fits.{key}", key in self.suspects
            study, restart = f"{self.path.stem}: {key}", self.said.report.restart
            cells = tuple(Cell(seed, suspected(where, problem, who, asked), who, study, key, restart)
                          for seed, who in self._estimators(key, fit))  # fmt: skip
        return Row(key, fit.title or key, ship, tuple(fit.train), cells, fit.published)

    def kept_apart(self, ship: Ship) -> tuple[dict[str, Trial], dict[str, Trial]]:
        """Trials of test and of validation, by label."""
        data = self.said.data
        _, watched, tests = self._trials(tuple(data.test.values())[:1], (), tuple(data.validation), ship, alone=True)
        return dict(zip(data.test, tests, strict=True)), dict(zip(data.validation, watched, strict=True))

    def _problem(self, key: str, fit: Any, ship: Ship) -> Problem:
        labels = tuple(self.said.data.validation) if fit.validation is None else tuple(fit.validation)
        train, validation, _ = self._trials(tuple(fit.train), tuple(fit.exclude), labels, ship)
        try:
            free, _ = freedom(ship.model, fit.free, stated(ship)) if fit.free else ((), ())
        except StudyError as error:
            raise StudyError(f"{self.path}: fits.{key}: {error}") from None
        loss, nuisance = fit.loss or self.said.loss, fit.nuisance
        return Problem(
            ship, train, free, Loss(loss.sigma, loss.correlation, loss.weights, loss.scale),
            Nuisance(**vars(nuisance)), validation,
        )  # fmt: skip

    def _estimators(self, key: str, fit: Any) -> list[tuple[int | None, Estimator]]:
        kind = str(fit.estimator.get("type", ""))
        table = {**fit.estimator, **({} if self.size is None else self.size.settings.get(kind, {}))}
        who: Any = read_estimator(self.path, table, f"fits.{key}.estimator")
        if not hasattr(who, "seeds"):
            return [(None, who)]
        seeds = fit.seeds or self.said.seeds
        if self.size is not None and self.size.seeds is not None:
            seeds = self.size.seeds
        return [(seed, replace(who, seeds=(seed,))) for seed in dict.fromkeys(seeds)]

    def _trials(
        self, train: tuple[str, ...], exclude: tuple[str, ...], labels: tuple[str, ...], ship: Ship,
        alone: bool = False,
    ) -> tuple[tuple[Trial, ...], ...]:  # fmt: skip
        """Training, validation and test; `alone` asks for what is kept apart only."""
        data = self.said.data
        if (train, exclude, labels) not in self._read:
            # What is watched by another fit is left out of this one too: no model has more to learn from.
            watched = [data.validation[label] for label in labels]
            apart = [name for name in data.validation.values() if name not in watched]
            self._read[train, exclude, labels] = read_data(self.path, DataTable(
                root=data.root, sets=data.sets, format=data.format, mapping=data.mapping,
                train=["*"] if alone else list(train), validation=watched, test=list(data.test.values()),
                exclude=[*exclude, *apart],
            ), ship)  # fmt: skip
        return self._read[train, exclude, labels]

"""A table of fits beside the publication that it follows: what was trained on, the settings, the errors.

Every departure is found by comparing what the publication prints with what the study has; a reason is looked up in
the study by the name of what differs, and a departure without one says "not explained".
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any

from ...study.series import Row, Series
from ...validate.series import Standing, Table
from .. import printed
from ..blocks import Fields, heading, joined, soft
from ..page import Section
from ..printed import side_by_side

ALL = "all"
"""Key of the printed settings that every column has."""
UNTOLD = "not printed"
"""What a table says of a setting that the paper does not state."""
# Where and on what a fit runs is not what it computes.
_MACHINE = ("device", "threads", "seeds")
_FORM = ("kind", "hidden", "layers", "memory")


def beside(series: Series, found: Table) -> Section:
    """Everything printed beside ours; empty where the study names no publication."""
    parts = {
        "Training data": data(series), "Settings": settings(series), "Evaluation": evaluation(series, found),
        "Errors, mean ± standard deviation over the seeds": errors(series, found),
    }  # fmt: skip
    shown = {title: rows for title, rows in parts.items() if rows}
    if not shown:
        return Section("", (Fields({"printed": {}}),))
    source = soft(f"{series.published.source}. {series.published.note}")
    body = source + joined(heading(title) + side_by_side(rows) for title, rows in shown.items())
    told = {"printed": {title: printed.fields(rows) for title, rows in shown.items()}}
    return Section("Printed beside ours", (Fields(told, body),))


def _columns(series: Series) -> list[Row]:
    """The models that stand for a column of the publication."""
    return [row for row in series.rows if row.published]


def data(series: Series) -> list[printed.Row]:
    """Seconds of each composition by kind; what is missing of it is in the tests, is watched, or is left out."""
    out: list[printed.Row] = []
    for row in _columns(series):
        for name in (one.removeprefix("@") for one in row.train if row.cells):
            held = series.compositions.get(name)
            if held is None or any(one.name.startswith(f"{name}, ") for one in out):
                continue
            trials = {trial.name: trial.duration for trial in row.cells[0].problem.trials}
            for kind, seconds in series.published.seconds.get(name, {}).items():
                files = [file.rpartition("/")[2] for file in held.parts.get(kind, ())]
                ours = round(sum(trials.get(file, 0.0) for file in files), 1)
                missing = [file for file in files if file not in trials]
                out.append(printed.Row(f"{name}, {kind}", seconds, ours, "s", _missing(series, row, missing)))
    apart = series.published.tests.items()
    return out + [
        printed.Row(f"test, {label}", name, series.tests[label].name if label in series.tests else "none",
                    why=series.published.why.get("test", ""))
        for label, name in apart
    ]  # fmt: skip


def _missing(series: Series, row: Row, names: Iterable[str]) -> str:
    places = {trial.name: "kept for the test" for trial in series.tests.values()}
    places |= {trial.name: "watched" for trial in series.watched.values()}
    by_place: dict[str, list[str]] = {}
    for name in names:
        by_place.setdefault(places.get(name, "left out"), []).append(name)
    why = [f"{place}: {', '.join(some)}" for place, some in by_place.items()]
    return "; ".join(why) or "the same recordings; their ends are rounded otherwise"


def settings(series: Series) -> list[printed.Row]:
    """Every setting of the estimators, columns with the same pair of values together."""
    said, why = series.published.settings, series.published.why
    pairs: dict[tuple[str, str, str], list[str]] = {}
    columns = [row for row in _columns(series) if row.cells and row.published in {*said}]
    for row in columns:
        theirs = {**said.get(ALL, {}), **said[row.published]}
        for name, ours in _settings(row).items():
            pair = name, _told(theirs.get(name, UNTOLD)), _told(ours)
            pairs.setdefault(pair, []).append(row.published)
    order = {name: k for k, name in enumerate(dict.fromkeys(name for name, _, _ in pairs))}
    out = list[printed.Row]()
    for (name, theirs, ours), who in sorted(pairs.items(), key=lambda pair: order[pair[0][0]]):
        whose = name if len(who) == len(columns) else f"{name}, {', '.join(who)}"
        silent = "the publication does not say" if theirs == UNTOLD else ""
        out.append(printed.Row(whose, theirs, ours, why=why.get(whose, why.get(name, silent))))
    return out


def _settings(row: Row) -> dict[str, Any]:
    """The settings of a row's estimator; those of the form of its network with what the ship file adds."""
    estimator: Any = row.cells[0].estimator
    own = {one.name: getattr(estimator, one.name) for one in fields(estimator) if one.name not in _MACHINE}
    network = row.ship.model.learned
    if network is not None and hasattr(estimator, "form"):
        form = estimator.form(network)
        own |= dict(zip(_FORM, (form.kind, form.layers[0], len(form.layers), form.memory), strict=True))
    return {**own, "seeds": len(row.cells)}


def _told(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value)) or "none"  # pyright: ignore[reportUnknownArgumentType]
    return f"{value:g}" if isinstance(value, float) else str(value)


def evaluation(series: Series, found: Table) -> list[printed.Row]:
    """How predictions are made and weighed."""
    restart = "none" if series.restart is None else f"{series.restart:g} s"
    shown = ", ".join(f"{name} {size:.4g}" for name, size in found.sigma.items())
    # `validate.series` replays every model so.
    ours = {"restart": restart, "wind": "true", "start": "1 measured row", "rule": "Euler, 0.1 s", "sigma": shown}
    why = {"sigma": "of the paper's six files, worked out from the data set, heading unwrapped"}
    return [
        printed.Row(name, said, ours.get(name, "none"),
                    why=series.published.why.get(f"evaluation, {name}", why.get(name, "")))
        for name, said in series.published.evaluation.items()
    ]  # fmt: skip


def departures(series: Series) -> Mapping[str, list[str]]:
    """By column, the settings that the publication prints otherwise."""
    rows = [row for row in settings(series) if not row.same and row.printed != UNTOLD]
    every = [row.published for row in _columns(series) if row.cells]
    return {
        column: [name for row in rows for name, _, whose in [row.name.partition(", ")]
                 if not whose or column in whose.split(", ")]
        for column in every
    }  # fmt: skip


def errors(series: Series, found: Table) -> list[printed.Row]:
    """The table of errors, cell by cell."""
    departed = departures(series)
    standings = {one.published: one for one in found.standings if one.published}
    return [
        printed.Row(f"{column}, {test}", pair(*cell), _ours(standings.get(column), test),
                    why=_because(series, column, test, departed.get(column, [])))
        for column, tests in series.published.rows.items() for test, cell in tests.items()
    ]  # fmt: skip


def _ours(one: Standing | None, test: str) -> str:
    if one is None or not one.members:
        return "not run"
    if test not in one.errors:
        return "no such test"
    mean = one.mean(test)
    return pair(mean, one.deviation(test)) if math.isfinite(mean) else "no number"


def _because(series: Series, column: str, test: str, departed: list[str]) -> str:
    own, why = series.tests.get(test), series.published.why
    parts = [why[key] for key in (f"{column}, {test}",) if key in why]
    if own is None:
        parts.append("the recording is not in the set")
    elif test in series.published.tests and own.name != series.published.tests[test]:
        parts.append("another recording")
    if departed:
        parts.append(f"other {', '.join(departed)}")
    return "; ".join(parts)


def pair(mean: float, deviation: float = math.nan) -> str:
    """Mean ± standard deviation, as many decimals as the paper prints."""
    decimals = sum(mean < limit for limit in (10.0, 100.0, 1000.0))
    return f"{mean:.{decimals}f}" + (f" ± {deviation:.{decimals}f}" if math.isfinite(deviation) else "")

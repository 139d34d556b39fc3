"""Everything that the report of a series says in numbers, for a JSON file."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import Any

from ..data import DataError
from ..identify.series import Series
from .coverage import Coverage, Reference, coverage
from .network_scores import Standing, Table, compositions

SCHEMA = "seatrial-networks/1"


def covered(series: Series) -> dict[str, dict[str, Coverage]]:
    """How each test trial lies within each composition; one without the channels that it takes is left out."""
    found: dict[str, dict[str, Coverage]] = {}
    for name, trials in compositions(series).items():
        try:
            reference = Reference.of(trials)
            found[name] = {label: coverage(reference, trial) for label, trial in series.tests.items()}
        except DataError:
            continue
    return found


def numbers(series: Series, found: Table, cover: Mapping[str, Mapping[str, Coverage]]) -> dict[str, Any]:
    """All of it, SI units and radians; a prediction that is no number is null."""
    published = series.published
    return {
        "schema": SCHEMA, "series": series.name, "title": series.title, "budget": series.budget,
        "restart": series.restart, "sigma": dict(found.sigma),
        "tests": {label: trial.name for label, trial in series.tests.items()},
        "validation": {label: trial.name for label, trial in series.watched.items()},
        "models": {one.key: _of(series, one, found.tests) for one in found.standings},
        "claims": [
            {"says": claim.says, "better": claim.better, "worse": claim.worse, "factor": claim.factor,
             "rows": [asdict(f) for f in rows]}
            for claim, rows in found.claims
        ],
        "coverage": {name: {test: c.numbers() for test, c in some.items()} for name, some in cover.items()},
        "spread": {key: {test: s.numbers() for test, s in some.items()} for key, some in found.validity.items()},
        "published": {"source": published.source, "note": published.note, "protocol": "not confirmed",
                      "rows": {k: {row: list(v) for row, v in column.items()} for k, column in published.rows.items()}},
    }  # fmt: skip


def _of(series: Series, one: Standing, tests: Iterable[str]) -> dict[str, Any]:
    row = next((row for row in series.rows if row.key == one.key), None)
    return {
        "title": one.title, "train": [] if row is None else list(row.train), "published": one.published,
        "trained_on": [t.name for t in row.cells[0].problem.trials] if row is not None and row.cells else [],
        "weights": one.weights, "width": one.width,
        "seeds": [
            {"seed": m.seed, "objective": m.objective, "seconds": m.seconds, "status": m.summary.get("status", ""),
             "updates": m.summary.get("evaluations"), "digest": m.summary.get("digest", ""),
             "errors": {test: float(one.errors[test][k]) for test in tests}, "history": m.history.tolist()}
            for k, m in enumerate(one.members)
        ],
        "mean": {test: one.mean(test) for test in tests},
        "standard_deviation": {test: one.deviation(test) for test in tests},
    }  # fmt: skip


def to_json(document: Mapping[str, Any]) -> str:
    """As text; a number that is not finite becomes null."""
    return json.dumps(_plain(document), indent=1) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        items: Iterable[tuple[Any, Any]] = value.items()
        return {str(key): _plain(item) for key, item in items}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

"""The report: comparisons, baselines and a fit on one page, and the same numbers as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from ..core.errors import ReportError as ReportError
from ..core.files import write_whole
from ..identify import Fit
from ..validate import Comparison
from ..validate.comparison import CONSTANT_VELOCITY, pooled
from ..validate.foresight import Foresight
from .caveats import Assumption

PUBLISHED = "published"


@dataclass(frozen=True)
class Report:
    """What was compared, with what, and on what grounds.

    Attributes:
        title: heading of the page.
        comparisons: any number of labels and trials, in the order to show; a trial has one
            comparison for each label.
        fit: the fit that made the ship, where it was fitted.
        trained_on: names of the trials that fit has seen.
        findings: what the checks of the data found, one line each.
        assumptions: numbers of the ship that nobody measured.
        forecasts: errors of forecasts from what a filter knew, where the trials come of a smoother.
        provenance: ship, data files, software version, digest, command, date: name to text.
    """

    title: str
    comparisons: tuple[Comparison, ...]
    fit: Fit | None = None
    trained_on: tuple[str, ...] = ()
    findings: tuple[str, ...] = ()
    assumptions: tuple[Assumption, ...] = ()
    forecasts: tuple[Foresight, ...] = ()
    provenance: Mapping[str, str] = field(default_factory=dict[str, str])

    def __post_init__(self) -> None:
        seen: set[tuple[str, str]] = set()
        for c in self.comparisons:
            if (c.measured.name, c.label) in seen:
                raise ReportError(f"trial {c.measured.name} has two comparisons labelled '{c.label}'")
            seen.add((c.measured.name, c.label))

    @property
    def labels(self) -> tuple[str, ...]:
        """Who predicts, the subject first and the constant-velocity baseline last."""
        order = list(dict.fromkeys(c.label for c in self.comparisons))
        rank = {PUBLISHED: 1, CONSTANT_VELOCITY: 2}
        return tuple(sorted(order, key=lambda label: rank.get(label, 0)))

    @property
    def trials(self) -> dict[str, dict[str, Comparison]]:
        """Comparisons by trial, then by label."""
        out: dict[str, dict[str, Comparison]] = {}
        for c in self.comparisons:
            out.setdefault(c.measured.name, {})[c.label] = c
        return out

    @property
    def pooled(self) -> dict[str, float]:
        """Standardised mean squared error by label, over the trials that every label predicts."""
        common = [found for found in self.trials.values() if len(found) == len(self.labels)]
        return {label: pooled(found[label] for found in common) for label in self.labels}

    def write(self, path: str | Path) -> Path:
        """Write the page to `path` and the numbers beside it as .json; whole or not at all.

        Returns:
            The path of the page.

        Raises:
            ReportError: a path that ends in .json, where the numbers go.
        """
        from .sections import document

        page = Path(path)
        if page.suffix == ".json":
            raise ReportError(f"{page}: the page would be overwritten by its numbers; end it in .html")
        page.parent.mkdir(parents=True, exist_ok=True)
        numbers = json.dumps(_plain(self.numbers()), indent=1, allow_nan=False) + "\n"
        html = document(self)
        write_whole(page.with_suffix(".json"), numbers)
        write_whole(page, html)
        return page

    def numbers(self) -> dict[str, Any]:
        """Everything the page says in numbers, SI units and radians."""
        from .caveats import caveats
        from .sections import sentence, worse

        return {
            "schema": "seatrial-report/1",
            "title": self.title,
            "summary": sentence(self),
            "standardised": self.pooled,
            "worse": {other: worse(self, other) for other in self.labels[1:]},
            "forecasts": [asdict(f) for f in self.forecasts],
            "assumptions": [asdict(a) for a in self.assumptions],
            "trials": {
                name: {label: _of_comparison(c) for label, c in found.items()}
                for name, found in self.trials.items()
            },
            "fit": _of_fit(self.fit) if self.fit else None,
            "trained_on": self.trained_on,
            "findings": self.findings,
            "caveats": caveats(self),
            "provenance": dict(self.provenance),
        }


def _of_comparison(c: Comparison) -> dict[str, Any]:
    return {
        "standardised": c.standardised,
        "samples": c.samples,
        "restart": c.restart,
        "sigma": dict(c.sigma),
        "metrics": {name: asdict(m) for name, m in c.metrics.items()},
        "horizons": {f"{end:g}": dict(values) for end, values in c.horizons.items()},
        "indices": {
            name: {"measured": a, "predicted": b, "unit": c.index_units.get(name, "")}
            for name, (a, b) in c.indices.items()
        },
    }


def _of_fit(fit: Fit) -> dict[str, Any]:
    return {
        "ship": fit.ship.name,
        "parameters": {
            free.path: {
                "start": free.start, "value": float(fit.values[i]), "sigma": float(fit.sigma[i]),
                "low": free.low, "high": free.high, "shrinkage": float(fit.shrinkage[i]),
                "at_bound": free.path in fit.at_bound,
            }
            for i, free in enumerate(fit.free)
        },
        "verdicts": [asdict(verdict) for verdict in fit.verdicts],
        "objective": fit.objective,
        "seconds": fit.seconds,
        "evaluations": fit.evaluations,
        "status": fit.status,
        "digest": fit.digest,
    }  # fmt: skip


def _plain(value: Any) -> Any:
    """The same in what JSON knows; a number that is not finite becomes null."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value

"""Report of a fit or a validation: comparisons, baselines and a fit on one page, and the same numbers as JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..identify import Fit
from ..validate import Comparison
from .evidence import PUBLISHED, Evidence, caveats
from .page import Page, ReportError, plain, write
from .sections import sections, sentence, worse

__all__ = ["PUBLISHED", "Report", "ReportError"]


@dataclass(frozen=True)
class Report(Evidence):
    """What was compared, with what and on what grounds, as a page with its numbers; attributes as in `Evidence`."""

    @property
    def page(self) -> Page:
        """The sections and the numbers."""
        return Page(self.title, sections(self), self.numbers())

    def write(self, path: str | Path) -> Path:
        """Write the page to `path` and the numbers beside it as .json; both or neither.

        Returns:
            The path of the page.

        Raises:
            ReportError: a path that ends in .json, which the numbers take.
        """
        return write(path, self.page)

    def numbers(self) -> dict[str, Any]:
        """The numbers of the page, SI units and radians."""
        return plain({
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
        })


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

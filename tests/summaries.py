"""What a fit.json says, made by hand."""

from __future__ import annotations

from typing import Any

from seatrial.core.records import from_json
from seatrial.study.store import Summary

_LEAST = {"study": "S", "digest": "d", "status": "done", "objective": 0.0, "seconds": 0.0, "evaluations": 0,
          "parameters": {}, "covariance": [], "verdicts": [], "diagnosis": None, "nuisances": {}, "provenance": {}}


def summary_of(**changes: Any) -> Summary:
    """A fit without parameters, but for what is given in the types of JSON."""
    return from_json(Summary, {**_LEAST, **changes}, "fit.json")

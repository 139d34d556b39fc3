"""seatrial: from the logs of a ship's trials to a model you can trust, and a simulator you can drive."""

from __future__ import annotations

from typing import Any

__version__ = "0.1.0"

_LAZY = {
    "load": "ships.files", "library": "ships.files", "near": "core.parameters", "read_trial": "data.trialfile",
    "read_trials": "data.trialfile", "Trial": "data", "Loss": "identify", "Nuisance": "identify",
    "Problem": "identify", "Fit": "identify", "read_study": "study.study",
    "Trajectory": "identify.trajectory.shooting", "OneStep": "identify.trajectory.shooting",
    "Turning": "manoeuvres.turning", "Zigzag": "manoeuvres.zigzag",
    "compare": "validate.comparison", "Report": "report.report",
}  # fmt: skip
"""Names a user meets first, and the module that holds each; imported when first asked for."""


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module 'seatrial' has no attribute '{name}'")
    from importlib import import_module

    return getattr(import_module(f"seatrial.{_LAZY[name]}"), name)

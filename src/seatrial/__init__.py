"""seatrial: from the logs of a ship's trials to a model you can trust, and a simulator you can drive.

``import seatrial as st``, then ``st.load``, ``st.read_trials``, ``st.fit``: ``dir(st)`` lists the names, docs/python.md
is the guide.  Each is imported when it is first asked for, so that the import of the package takes no time.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .core.version import __version__

if TYPE_CHECKING:  # for editors and type checkers; `_LAZY` has the same names, a test compares them
    from inspect import Signature

    from .campaign.tracks import Tracks as Tracks
    from .core.parameters import Free as Free
    from .data.check import Finding as Finding
    from .face.campaigns import Draw as Draw
    from .face.campaigns import Runs as Runs
    from .face.campaigns import campaign as campaign
    from .face.fitting import Fit as Fit
    from .face.fitting import Problem as Problem
    from .face.fitting import fit as fit
    from .face.fitting import near as near
    from .face.fitting import read_fit as read_fit
    from .face.fitting import read_study as read_study
    from .face.orders import Acceleration as Acceleration
    from .face.orders import Berthing as Berthing
    from .face.orders import CourseKeeping as CourseKeeping
    from .face.orders import Crabbing as Crabbing
    from .face.orders import CrashAstern as CrashAstern
    from .face.orders import HumanRandom as HumanRandom
    from .face.orders import InitialTurning as InitialTurning
    from .face.orders import PseudoRandom as PseudoRandom
    from .face.orders import PullOut as PullOut
    from .face.orders import ReverseSpiral as ReverseSpiral
    from .face.orders import Scharnow as Scharnow
    from .face.orders import SingleTurn as SingleTurn
    from .face.orders import Spiral as Spiral
    from .face.orders import Stopping as Stopping
    from .face.orders import Straight as Straight
    from .face.orders import ThrustSteps as ThrustSteps
    from .face.orders import TrackFollowing as TrackFollowing
    from .face.orders import Turning as Turning
    from .face.orders import Weather as Weather
    from .face.orders import Williamson as Williamson
    from .face.orders import Zigzag as Zigzag
    from .face.running import Run as Run
    from .face.running import simulate as simulate
    from .face.ships import Ship as Ship
    from .face.ships import load as load
    from .face.trials import Trial as Trial
    from .face.trials import check as check
    from .face.trials import read_trial as read_trial
    from .face.trials import read_trials as read_trials
    from .identify import Loss as Loss
    from .identify import Nuisance as Nuisance
    from .identify.trajectory.shooting import OneStep as OneStep
    from .identify.trajectory.shooting import Trajectory as Trajectory
    from .identify.tuning.fine_tuning import FineTuning as FineTuning
    from .report.report import Report as Report
    from .ships.files import library as library
    from .validate.comparison import compare as compare

_ROOMS = {
    "campaign.tracks": ("Tracks",),
    "core.parameters": ("Free",),
    "data.check": ("Finding",),
    "face.campaigns": ("Draw", "Runs", "campaign"),
    "face.fitting": ("Fit", "Problem", "fit", "near", "read_fit", "read_study"),
    "face.orders": (
        "Acceleration", "Berthing", "CourseKeeping", "Crabbing", "CrashAstern", "HumanRandom", "InitialTurning",
        "PseudoRandom", "PullOut", "ReverseSpiral", "Scharnow", "SingleTurn", "Spiral", "Stopping", "Straight",
        "ThrustSteps", "TrackFollowing", "Turning", "Weather", "Williamson", "Zigzag",
    ),
    "face.running": ("Run", "simulate"),
    "face.ships": ("Ship", "load"),
    "face.trials": ("Trial", "check", "read_trial", "read_trials"),
    "identify": ("Loss", "Nuisance"),
    "identify.trajectory.shooting": ("OneStep", "Trajectory"),
    "identify.tuning.fine_tuning": ("FineTuning",),
    "report.report": ("Report",),
    "ships.files": ("library",),
    "validate.comparison": ("compare",),
}  # fmt: skip
"""Public names by the module that holds them."""

_LAZY = {name: module for module, names in _ROOMS.items() for name in names}

_VERBS = ("simulate", "campaign")
"""Names that are rooms too."""

__all__ = ["__version__", *sorted(_LAZY)]  # pyright: ignore[reportUnsupportedDunderAll]


class _Verb(ModuleType):
    """A room whose name is a verb of the face as well: the room is a package, and called, it does what it says."""

    def __call__(self, *args: Any, **options: Any) -> Any:
        return _verb(self)(*args, **options)

    @property
    def __signature__(self) -> Signature:
        """That of the function, for `help` and completion."""
        from inspect import signature

        return signature(_verb(self))


def _verb(room: ModuleType) -> Any:
    from importlib import import_module

    name = room.__name__.rpartition(".")[2]
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)


class _Package(ModuleType):
    """This package: `seatrial.simulate` and `seatrial.campaign` stay rooms, whichever module imports them first."""

    def __setattr__(self, name: str, value: object) -> None:
        if name in _VERBS and type(value) is ModuleType:
            value.__class__ = _Verb
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

if not TYPE_CHECKING:  # a name that there is not is then an error of the type checker

    def __getattr__(name: str) -> Any:
        from importlib import import_module

        if name in _VERBS:  # before anything has imported the room
            return import_module(f"seatrial.{name}")
        if name not in _LAZY:
            raise AttributeError(f"module 'seatrial' has no attribute '{name}'; dir(seatrial) lists its names")
        return getattr(import_module(f"seatrial.{_LAZY[name]}"), name)

    def __dir__() -> list[str]:
        return list(__all__)

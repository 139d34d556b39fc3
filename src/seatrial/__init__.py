"""seatrial: from the logs of a ship's trials to a model you can trust, and a simulator you can drive.

``import seatrial as st``, then ``st.load``, ``st.read_trials``, ``st.fit``: ``dir(st)`` lists the names, docs/python.md
is the guide.  This is the promised API: docs, examples, studies and notebooks import nothing deeper, and a test holds
that.  Each name is imported when it is first asked for, so that the import of the package takes no time.

Names are verbs and values (`load`, `Zigzag`, `fit`), subjects, whose names go together (``st.blocks.table``,
``st.parameters.read``), and catalogues, which hold a module for each thing and load it when it is first asked for, by
the path that ship files and studies give: ``st.manoeuvres.zigzag.Zigzag`` in radians, ``st.models.mmg.Mmg``.
"""

from __future__ import annotations

import sys
from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

from .core.version import __version__ as __version__

if TYPE_CHECKING:  # what a type checker sees is the table of the names too: `_names` reads these lines
    from inspect import Signature

    from . import environment as environment
    from . import envs as envs
    from . import forces as forces
    from . import manoeuvres as manoeuvres
    from . import models as models
    from . import testing as testing
    from .belief import coverage as coverage
    from .belief.bands import calibration as calibration
    from .belief.bands import prediction as _bands
    from .belief.freer import with_units as with_units
    from .belief.reading import posterior as posterior
    from .campaign.tracks import Tracks as Tracks
    from .core import parameters as parameters
    from .core import symbolic as symbolic
    from .core.errors import MissingError as MissingError
    from .core.errors import SeatrialError as SeatrialError
    from .core.files import read_toml as read_toml
    from .core.parameters import Free as Free
    from .core.records import filled as filled
    from .data import Array as Array
    from .data import DataError as DataError
    from .data import kinds as kinds
    from .data import unwrapped as unwrapped
    from .data.captive import Captive as Captive
    from .data.captive import read_captive as read_captive
    from .data.check import Finding as Finding
    from .data.formats import formats as formats
    from .data.formats import reader as reader
    from .data.geodesy import Datum as Datum
    from .data.prepare import drop_trailing_gaps as drop_trailing_gaps
    from .data.prepare.smooth import sensor_noise as sensor_noise
    from .data.prepare.smooth import smooth as smooth
    from .data.trialfile import write_trial as write_trial
    from .engine import Scalars as Scalars
    from .engine import SimulationError as SimulationError
    from .engine import System as System
    from .environment import Uniform as Uniform
    from .environment.geojson import load_chart as load_chart
    from .environment.weather import Gust as Gust
    from .environment.weather import Measured as Measured
    from .environment.weather import Together as Together
    from .exchange import Equations as Equations
    from .exchange import equations_of as equations_of
    from .exchange import save_c as save_c
    from .exchange import save_casadi as save_casadi
    from .exchange import save_fmu as save_fmu
    from .exchange import save_network as save_network
    from .exchange import save_python as save_python
    from .face.campaigns import Draw as Draw
    from .face.campaigns import Runs as Runs
    from .face.campaigns import campaign as _campaign
    from .face.fitting import Fit as Fit
    from .face.fitting import Problem as Problem
    from .face.fitting import Study as Study
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
    from .face.running import simulate as _simulate
    from .face.ships import Ship as Ship
    from .face.ships import load as load
    from .face.trials import Trial as Trial
    from .face.trials import check as check
    from .face.trials import read_trial as read_trial
    from .face.trials import read_trials as read_trials
    from .identify import Estimator as Estimator
    from .identify import FitError as FitError
    from .identify import Loss as Loss
    from .identify import Nuisance as Nuisance
    from .identify.components import first_guess as first_guess
    from .identify.components import servo as servo
    from .identify.components import smooth_servo as smooth_servo
    from .identify.components import thrust_map as thrust_map
    from .identify.filters import ahead as ahead
    from .identify.filters import stacking as stacking
    from .identify.filters.filtering import Kalman as Kalman
    from .identify.filters.forecast import forecasts as forecasts
    from .identify.filters.horizon import Horizon as Horizon
    from .identify.filters.measurement import Antenna as Antenna
    from .identify.filters.measurement import Heading as Heading
    from .identify.filters.measurement import Rate as Rate
    from .identify.networks.averaged import Averaged as Averaged
    from .identify.networks.training import Training as Training
    from .identify.networks.widths import Widths as Widths
    from .identify.population.evolution import Evolution as Evolution
    from .identify.posterior.verdicts import overruled as overruled
    from .identify.regression import zigzag_kt as zigzag_kt
    from .identify.regression.arx_fit import ArxRegression as ArxRegression
    from .identify.regression.arx_fit import fit_arx as fit_arx
    from .identify.regression.captive import CaptiveFit as CaptiveFit
    from .identify.regression.captive import fit_captive as fit_captive
    from .identify.regression.regression import Regression as Regression
    from .identify.regression.vector_ar import VectorAr as VectorAr
    from .identify.regression.vector_ar import fit_vector_ar as fit_vector_ar
    from .identify.regression.vector_ar import forecast as forecast
    from .identify.regression.vector_ar import vector_orders as vector_orders
    from .identify.shooting.logo import Shooting as Shooting
    from .identify.trajectory.multistart import MultiStart as MultiStart
    from .identify.trajectory.shooting import OneStep as OneStep
    from .identify.trajectory.shooting import Trajectory as Trajectory
    from .identify.trajectory.shooting import free_everywhere as free_everywhere
    from .identify.tuning import tuned as tuned
    from .identify.tuning.fine_tuning import FineTuning as FineTuning
    from .manoeuvres import Policy as Policy
    from .realtime.loop import Loop as Loop
    from .realtime.plant import Plant as Plant
    from .realtime.recording import Recording as Recording
    from .realtime.recording import rerun as rerun
    from .report import blocks as blocks
    from .report import figures as figures
    from .report import page as page
    from .report import printed as printed
    from .report import rivals as _rivals_page
    from .report import tuning as _tuning_page
    from .report.judging import captive as _captive_page
    from .report.report import Report as Report
    from .sensors import Sensors as Sensors
    from .sensors.suite import usual as _usual_sensors
    from .ships import Entry as Entry
    from .ships import actuation as actuation
    from .ships.files import ROLES as ROLES
    from .ships.files import library as library
    from .ships.files import role_of as role_of
    from .ships.files import save as save
    from .ships.rolled import Stability as Stability
    from .ships.rolled import with_roll as with_roll
    from .simulate import lanes as lanes
    from .simulate.carried import Carrier as Carrier
    from .simulate.contacts import contact_indices as contact_indices
    from .simulate.loop import open_loop as open_loop
    from .simulate.loop import open_loop_parameters as open_loop_parameters
    from .simulate.place import place_of as place_of
    from .simulate.replay import held as _held_series
    from .simulate.replay import inputs as _replay_inputs
    from .simulate.replay import replay as replay
    from .simulate.replay import unseen as _unseen_states
    from .simulate.run import approach as approach
    from .simulate.run import campaign as _run_lanes
    from .simulate.run import simulate as _run_policy
    from .simulate.starts import smoothed_starts as smoothed_starts
    from .study import virtual as virtual
    from .study.schema import VirtualTable as VirtualTable
    from .validate import Comparison as Comparison
    from .validate import comparison as comparison
    from .validate import metrics as metrics
    from .validate import rivals as rivals
    from .validate.comparison import compare as compare
    from .validate.comparison import pooled as pooled
    from .workflow import demo as demo
    from .workflow.contributing import published as published
    from .workflow.judging import captive as captive

    # under another name than where it is made, or than that of a room
    bands = _bands
    campaign = _campaign
    captive_page = _captive_page
    held_series = _held_series
    replay_inputs = _replay_inputs
    rivals_page = _rivals_page
    run_lanes = _run_lanes
    run_policy = _run_policy
    simulate = _simulate
    tuning_page = _tuning_page
    unseen_states = _unseen_states
    usual_sensors = _usual_sensors

_CATALOGUES = ("forces", "manoeuvres", "models")
"""Rooms with a module for each thing."""

_VERBS = ("simulate", "campaign")
"""Names that are rooms too."""

_IMPORT = r"^    from \.(\S*) import (\w+) as (\w+)$"


@cache
def _names() -> dict[str, tuple[str, str]]:
    """Each public name with the module that holds it and its name there."""
    import re
    from pkgutil import get_data

    source = (get_data(__name__, "__init__.py") or b"").decode()
    found = {shown.lstrip("_"): (module, own) for module, own, shown in re.findall(_IMPORT, source, re.MULTILINE)}
    return {name: found[name] for name in sorted(found)}


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

    module, name = _names()[room.__name__.rpartition(".")[2]]
    return getattr(import_module(f"{__name__}.{module}"), name)


class _Catalogue(ModuleType):
    """A room whose modules are loaded when they are first asked for."""

    def __getattr__(self, name: str) -> Any:
        from importlib import import_module
        from importlib.util import find_spec

        if name.startswith("_") or find_spec(f"{self.__name__}.{name}") is None:
            raise AttributeError(f"module '{self.__name__}' has no attribute '{name}'")
        return import_module(f"{self.__name__}.{name}")


class _Package(ModuleType):
    """This package: its verbs and catalogues are so, whichever module imports them first."""

    def __setattr__(self, name: str, value: object) -> None:
        if type(value) is ModuleType and name in (*_VERBS, *_CATALOGUES):
            value.__class__ = _Verb if name in _VERBS else _Catalogue
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package

if not TYPE_CHECKING:  # a name that there is not is then an error of the type checker

    def __getattr__(name: str) -> Any:
        from importlib import import_module

        if name in _VERBS:  # before anything has imported the room
            return import_module(f"seatrial.{name}")
        if name == "__all__":
            return __dir__()
        if name not in _names():
            raise AttributeError(f"module 'seatrial' has no attribute '{name}'; dir(seatrial) lists its names")
        module, own = _names()[name]
        room = import_module(f"seatrial.{module}" if module else "seatrial")
        # a module of a room is a name as well as what the room's door holds
        return getattr(room, own) if module and own in vars(room) else import_module(f"{room.__name__}.{own}")

    def __dir__() -> list[str]:
        return ["__version__", *_names()]

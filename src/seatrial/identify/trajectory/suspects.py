"""Errors that the instruments of a log may have: offsets, scales and delays of inputs and sensors, and a current.

Each is one number, zero where the instrument is right, named "kind.channel".  An error of an input changes what acts on
the model; an error of a sensor changes what the model predicts the sensor to read.  Both enter to first order, so that
one direction describes each: of the inputs (`Suspect.acts`), or of the readings (`Suspect.reads`).  A problem may
estimate any of them (`Nuisance.common`), and `diagnosis.findings` tests those that it does not.

Sign: a reading is the true value plus the error.  An offset of +2 deg means that the log shows 2 deg too much; a delay
of 1 s means that it shows the value of one second before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...core.errors import StudyError
from ...core.values import dataclass
from ...data import Array, Trial
from ...data.prepare.made import measured
from ...environment import CHANNELS
from ...models import Model, Sampled, unit
from ...simulate.replay import from_apparent, wind_of

X, Y, PSI, U, V, R = range(6)
_DEG = math.radians(1.0)
MOST: Mapping[str, float] = {
    # a magnetic compass read as true: the variation of most waters
    "bias.psi": 30.0 * _DEG, "bias.psi_speed": 30.0 * _DEG,
    "bias.r": 1.0 * _DEG,  # a gyro of a phone before it is warm; a ship's turn indicator has .01 deg/s
    "bias.u": 1.5, "bias.v_m": 1.5,  # a log that is not calibrated, and a lever arm in a turn
    "scale.r": 0.15,  # IMO A.526(13) allows .05
    "scale.wind": 0.6,  # an anemometer in the lee or the jet of the superstructure
    "scale": 0.3, "port": 0.3,  # logs, tachometers and rudder indicators before any calibration
    "offset": 10.0 * _DEG,
    "deviation": 15.0 * _DEG,  # a magnetic compass without correctors; the speed error of a gyro is 2 deg
    "delay": 60.0,  # clocks set by hand
    # half the length and the beam of the largest ships
    "antenna.ahead": 250.0, "antenna.starboard": 40.0, "receiver.ahead": 250.0, "receiver.starboard": 40.0,
    "current": 5.0, "wind": 40.0, "level": 0.5,
}  # fmt: skip
"""The largest error that an instrument may have and still be called one, by name or kind, SI units.

A wrong unit or column is larger, and is no error of an instrument: `data.check` names those.
"""
Acts = Callable[[Array, float], Array]
"""From inputs (lanes, steps, inputs) and the step [s]: their change by a unit error, same shape."""
Reads = Callable[[Array, Array | None, float], Array]
"""From predictions (..., rows, 6), a change of them (..., rows, 6) and the step between rows [s]: the change of the
reading by a unit error (without a change), or the derivative of that along the change."""


@dataclass(frozen=True)
class Suspect:
    """One error of the instruments.

    Attributes:
        name: key in a study, such as "offset.delta".
        words: what it is.
        unit, per: unit in reports, and how many SI units one of it is.
        step: small error for a finite difference, SI units; of an input.
        acts: of an input, else None.
        reads: of a sensor, else None.
        of_reading: whether it is a share of the reading, not of the true value: true = (1 - error) reading.
    """

    name: str
    words: str
    unit: str
    per: float
    step: float = 1e-4
    acts: Acts | None = None
    reads: Reads | None = None
    of_reading: bool = False

    @property
    def most(self) -> float:
        """The largest that instruments and waters have (`MOST`), SI units; of a scale as a share of the true value."""
        return MOST.get(self.name, MOST.get(self.name.partition(".")[0], math.inf))


def _column(at: Sequence[int], values: Callable[[Array, float], Array]) -> Acts:
    """Direction with these values in the columns `at`."""

    def acts(series: Array, dt: float) -> Array:
        out = np.zeros_like(series)
        out[..., list(at)] = values(series[..., list(at)], dt)
        return out

    return acts


def _slope(series: Array, dt: float) -> Array:
    """Rate of change along the steps; zero for a single step."""
    return np.gradient(series, dt, axis=-2) if series.shape[-2] > 1 else np.zeros_like(series)


def _earlier(values: Array, dt: float) -> Array:
    """Change of a reading that is one second late, to first order."""
    return -_slope(values, dt)


def _channels(at: Sequence[int], values: Callable[[Array, float], Array]) -> Reads:
    """A linear error of the channels `at`: the same operation on a change of the prediction."""

    def reads(predicted: Array, change: Array | None, dt: float) -> Array:
        of = predicted if change is None else change
        out = np.zeros_like(of)
        out[..., list(at)] = values(of[..., list(at)], dt)
        return out

    return reads


def _bias(at: int) -> Reads:
    def reads(predicted: Array, change: Array | None, dt: float) -> Array:
        out = np.zeros_like(predicted if change is None else change)
        out[..., at] = change is None
        return out

    return reads


def _antenna(aside: bool) -> Reads:
    """Antenna one metre ahead of midship, or to starboard of it."""

    def reads(predicted: Array, change: Array | None, dt: float) -> Array:
        c, s = np.cos(predicted[..., PSI]), np.sin(predicted[..., PSI])
        place, turned = ((-s, c), (-c, -s)) if aside else ((c, s), (-s, c))
        out = np.zeros_like(predicted if change is None else change)
        for k, axis in enumerate((X, Y)):
            out[..., axis] = place[k] if change is None else turned[k] * change[..., PSI]
        return out

    return reads


def _receiver(aside: bool) -> Reads:
    """Position and speeds one metre ahead of midship, or to starboard of it: a point of a turning hull moves across."""
    place, channel, way = _antenna(aside), U if aside else V, -1.0 if aside else 1.0

    def reads(predicted: Array, change: Array | None, dt: float) -> Array:
        out = place(predicted, change, dt)
        out[..., channel] = way * (predicted if change is None else change)[..., R]
        return out

    return reads


def _turned(predicted: Array, change: Array | None, dt: float) -> Array:
    """Heading one radian too large, and the speeds over ground that it turned into u and v_m."""
    of = predicted if change is None else change
    out = np.zeros_like(of)
    out[..., PSI], out[..., U], out[..., V] = change is None, of[..., V], -of[..., U]
    return out


def _deviation(east: bool) -> Reads:
    """Error of the compass of one cycle, largest on a heading to the north, or to the east."""

    def reads(predicted: Array, change: Array | None, dt: float) -> Array:
        psi = predicted[..., PSI]
        out = np.zeros_like(predicted if change is None else change)
        if change is None:
            out[..., PSI] = np.sin(psi) if east else np.cos(psi)
        else:
            out[..., PSI] = (np.cos(psi) if east else -np.sin(psi)) * change[..., PSI]
        return out

    return reads


_SENSORS = (
    Suspect("bias.psi", "a bias of the heading", "deg", _DEG, reads=_bias(PSI)),
    Suspect("deviation.north", "a deviation of the compass on northerly headings (speed error of a gyro)", "deg", _DEG,
            reads=_deviation(east=False)),
    Suspect("deviation.east", "a deviation of the compass on easterly headings", "deg", _DEG,
            reads=_deviation(east=True)),
    Suspect("bias.u", "a bias of the speed", "m/s", 1.0, reads=_bias(U)),
    Suspect("bias.v_m", "a bias of the sway velocity", "m/s", 1.0, reads=_bias(V)),
    Suspect("bias.r", "a bias of the yaw rate", "deg/s", _DEG, reads=_bias(R)),
    Suspect("scale.u", "a scale error of the speed", "%", 0.01, reads=_channels((U,), lambda y, _: y)),
    Suspect("scale.r", "a scale error of the yaw rate", "%", 0.01, reads=_channels((R,), lambda y, _: y)),
    Suspect("delay.position", "a delay of the position", "s", 1.0, reads=_channels((X, Y), _earlier)),
    Suspect("delay.psi", "a delay of the heading", "s", 1.0, reads=_channels((PSI,), _earlier)),
    Suspect("delay.speed", "a delay of the speeds u and v_m", "s", 1.0, reads=_channels((U, V), _earlier)),
    Suspect("delay.r", "a delay of the yaw rate", "s", 1.0, reads=_channels((R,), _earlier)),
    Suspect("antenna.ahead", "a position measured ahead of midship", "m", 1.0, reads=_antenna(aside=False)),
    Suspect("antenna.starboard", "a position measured to starboard of midship", "m", 1.0, reads=_antenna(aside=True)),
)  # fmt: skip

_RECEIVER = (
    Suspect("bias.psi_speed", "a bias of the heading that turned the speeds over ground too", "deg", _DEG,
            reads=_turned),
    Suspect("delay.receiver", "a delay of position and speeds, those of one receiver,", "s", 1.0,
            reads=_channels((X, Y, U, V), _earlier)),
    Suspect("receiver.ahead", "position and speeds of a receiver ahead of midship, by", "m", 1.0,
            reads=_receiver(aside=False)),
    Suspect("receiver.starboard", "position and speeds of a receiver to starboard of midship, by", "m", 1.0,
            reads=_receiver(aside=True)),
)  # fmt: skip
"""Errors that position and measured speeds share, so that they agree with each other."""


def suspects(model: Model, trials: Sequence[Trial]) -> tuple[Suspect, ...]:
    """Those that the model and the trials can have.

    Args:
        model: its controls and whether it has a force of the wind.
        trials: whether they have a wind.
    """
    if isinstance(model, Sampled):
        return ()
    found = list(_SENSORS)
    if all(measured(trial, name) for trial in trials for name in ("u", "v_m")):
        found += _RECEIVER
    for name, at in _together(model.controls):
        found += _of_control(name, at, unit(model.controls[at[0]]) == "rad")
    n = len(model.controls)
    around = {name: n + k for k, name in enumerate(CHANNELS)}
    for way, channel in (("north", "current_x"), ("east", "current_y")):
        found.append(Suspect(f"current.{way}", f"a current to the {way}", "m/s", 1.0,
                             acts=_column([around[channel]], lambda v, _: np.ones_like(v))))  # fmt: skip
    if model.feels_wind:
        for way, channel in (("north", "wind_x"), ("east", "wind_y")):
            found.append(Suspect(f"wind.{way}", f"a wind from the {way} that is not in the log", "m/s", 1.0, step=1e-2,
                                 acts=_column([around[channel]], lambda v, _: np.ones_like(v))))  # fmt: skip
    if model.feels_wind and any(wind_of(trial) is not None for trial in trials):
        wind = [around["wind_x"], around["wind_y"]]
        told = "a scale error of the apparent wind" if any(map(from_apparent, trials)) else "a scale error of the wind"
        found.append(Suspect("scale.wind", told, "%", 0.01, acts=_column(wind, lambda v, _: -v),
                             of_reading=True))  # fmt: skip
        found.append(Suspect("direction.wind", "an error of the wind direction", "deg", _DEG,
                             acts=_column(wind, lambda v, _: np.stack([v[..., 1], -v[..., 0]], axis=-1))))  # fmt: skip
    return tuple(found)


def level_of(name: str) -> tuple[str, str]:
    """Control and trial of an error "level.CONTROL.TRIAL": the share by which an assumed control is too small there.

    Both are empty of another error.
    """
    kind, _, rest = name.partition(".")
    control, _, trial = rest.partition(".")
    return (control, trial) if kind == "level" else ("", "")


def _level(name: str, model: Model, trials: Sequence[Trial], lanes: Array | NDArray[np.intp]) -> Suspect:
    """The level of a control in the windows of one trial, all that follow the same order with it."""
    control, trial = level_of(name)
    order = dict(zip(model.controls, (order for order, _ in model.follows), strict=True)).get(control)
    if order is None:
        raise StudyError(f"[nuisance] common names '{name}'; controls are {', '.join(model.controls)}")
    at = [k for k, (one, _) in enumerate(model.follows) if one == order]
    mine = np.array([trials[int(k)].name == trial for k in lanes])

    def acts(series: Array, dt: float) -> Array:
        out = np.zeros_like(series)
        out[..., at] = series[..., at] * mine[:, None, None]
        return out

    return Suspect(name, f"the level of {control} in {trial}, off", "%", 0.01, acts=acts)


def _together(controls: Sequence[str]) -> list[tuple[str, list[int]]]:
    """Names of controls with their places: each, and those of one kind that have the same error."""
    kinds: dict[str, list[int]] = {}
    for at, name in enumerate(controls):
        kinds.setdefault(name.rpartition("_")[0], []).append(at)
    several = [(kind, places) for kind, places in kinds.items() if len(places) > 1 and kind and kind not in controls]
    return [*((name, [at]) for at, name in enumerate(controls)), *several]


def _of_control(name: str, at: Sequence[int], angle: bool) -> Iterator[Suspect]:
    """Errors of the reading of a control, or of all of one kind alike."""
    told = name if len(at) == 1 else f"each {name}"
    if angle:
        yield Suspect(f"offset.{name}", f"an offset of {told}", "deg", _DEG,
                      acts=_column(at, lambda v, _: -np.ones_like(v)))  # fmt: skip
        yield Suspect(f"port.{name}", f"a scale error of {told} to port", "%", 0.01,
                      acts=_column(at, lambda v, _: -np.minimum(v, 0.0)), of_reading=True)  # fmt: skip
    yield Suspect(f"scale.{name}", f"a scale error of {told}", "%", 0.01, acts=_column(at, lambda v, _: -v),
                  of_reading=True)  # fmt: skip
    yield Suspect(f"delay.{name}", f"a delay of {told}", "s", 1.0, step=1e-3, acts=_column(at, _slope))


def recorded(common: Sequence[Suspect], states: Array, dt: float) -> Array:
    """Change of recorded states, shape (windows, motion), by a unit of each error, shape (errors, windows, motion).

    They go on for `dt` as they move.  A heading that reads 4 deg too much began 4 deg too far: where an initial state
    stays within the noise of its reading, that is of what the reading would have been.
    """
    psi, u, v_m, r = states[:, PSI : R + 1].T
    c, s, later = np.cos(psi), np.sin(psi), states.copy()
    later[:, : PSI + 1] += dt * np.column_stack([u * c - v_m * s, u * s + v_m * c, r])
    rows, out = np.stack([states, later], axis=1), np.zeros((len(common), *states.shape))
    for k, one in enumerate(common):
        if one.reads:
            out[k] = one.reads(rows, None, dt)[:, 0]
    return out


def named(
    model: Model, trials: Sequence[Trial], names: Sequence[str], lanes: Array | NDArray[np.intp]
) -> tuple[Suspect, ...]:
    """Those of these names, in this order.

    Args:
        lanes: index of the trial of each window.

    Raises:
        StudyError: an unknown name, with those that there are.
    """
    known = {one.name: one for one in suspects(model, trials)}
    known |= {name: _level(name, model, trials, lanes) for name in names if level_of(name)[0]}
    for name in names:
        if name not in known:
            raise StudyError(f"[nuisance] common names '{name}'; known: {', '.join(known)}")
    return tuple(known[name] for name in names)

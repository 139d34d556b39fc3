"""Trials corrected by what a fit estimated beside the parameters: errors of instruments, currents and sensor biases.

Errors of instruments are those of `trajectory.suspects`: a reading is the true value plus the error.  An error that all
trials share (`Fit.nuisances["*"]`) belongs to the instrument; a current or a bias of one trial belongs to that trial.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np

from ..data import Array, Trial, unwrapped
from ..data.prepare import derived, shifted
from ..data.prepare.made import SOURCES, marked
from ..environment import CHANNELS
from ..identify.nuisance import CURRENT, EVERY, with_current
from ..identify.trajectory.suspects import Suspect, level_of, suspects
from ..models import STATES, Model
from ..simulate.replay import wind_of
from ..simulate.starts import wrong_compass

Errors = Mapping[str, float]
"""Errors by name as in `trajectory.suspects`, such as "offset.delta", "bias.psi", "current.north"; SI units."""

# Channels of a sensor that has a delay, where they are not one channel of that name.
_TOGETHER = {"position": ("x", "y"), "speed": ("u", "v_m"), "receiver": ("x", "y", "u", "v_m")}
# Errors of readings that depend on the whole state.
_OF_STATE = ("antenna", "receiver", "deviation")
# Kinds of errors that are not corrected by their direction: a shift in time, and the current, which is no error.
_APART = ("delay", "current")
# An error of 15 deg turns by at most a quarter of what it is off; so many times leave nothing.
_ROUNDS = 20
_COMPASS = ("bias.psi", "deviation.north", "deviation.east")
_CURRENTS = {"current.north": CURRENT[0].rpartition(".")[2], "current.east": CURRENT[1].rpartition(".")[2]}


def shared_by_all(found: Mapping[str, Errors]) -> dict[str, float]:
    """Everything that all trials of a fit share: errors of instruments, and a current.

    Args:
        found: by trial and name, as in `Fit.nuisances`.
    """
    return dict(found.get(EVERY, {}))


def summed(one: Errors, other: Errors) -> dict[str, float]:
    """Errors of both; those of one name add up."""
    return {name: one.get(name, 0.0) + other.get(name, 0.0) for name in (*one, *other)}


def of_trial(name: str, found: Mapping[str, Errors], studied: Collection[str]) -> dict[str, float]:
    """Everything that a fit estimated for a trial of this name: shared errors, its current and its biases.

    What is shared holds for the trials of the study, those that it keeps back included.

    Args:
        found: by trial and name, as in `Fit.nuisances`.
    """
    shared = found.get(EVERY, {}) if name in studied else {}
    out = {key: size for key, size in shared.items() if level_of(key)[1] in ("", name)}
    for key, size in found.get(name, {}).items():
        named = next((one for one, own in _CURRENTS.items() if own == key), key.replace("bias_", "bias.", 1))
        out[named] = out.get(named, 0.0) + size
    return out


def as_true(
    trial: Trial, shared: Errors, model: Model, *, own: Errors | None = None, made: Collection[str] = ()
) -> Trial:  # fmt: skip
    """The trial as it is predicted: corrected by what its instruments share with those of a fit, and by its own errors.

    Where the compass is among the former, each start is read off the seconds before too (`simulate.starts`).

    Args:
        own: of this trial alone.
        made: velocities that the logger makes of track and heading (`Grounds.made`).
    """
    errors = summed(shared, own or {})
    if not any(errors.values()):
        return trial
    told = marked(trial, {name: ", ".join(SOURCES[name]) for name in made if name in trial})
    right = corrected(told, errors, model)
    return wrong_compass(right) if any(shared.get(name) for name in _COMPASS) else right


def corrected(trial: Trial, errors: Errors, model: Model) -> Trial:
    """The trial as instruments without these errors would have logged it, in the current among them.

    Inputs change as in the fit that estimated the errors (`Suspect.acts`), readings by the inverse of the error.
    A delay shifts its channels in time; rows without a reading are left out.  A current adds to the logged one.  Errors
    of what the trial did not log change nothing.
    """
    if not any(errors.values()):
        return trial
    known = {one.name: (one, errors[one.name]) for one in suspects(model, [trial]) if errors.get(one.name)}
    acting = [(one, c) for name, (one, c) in known.items() if one.acts and name.partition(".")[0] not in _APART]
    out = _acted(trial, acting, model) if acting else trial
    out = _levelled(out, errors, model)
    for name, size in errors.items():
        kind, _, what = name.partition(".")
        if kind == "delay" and size:
            late = [one for one in _late(what, trial, model) if one in trial]
            out = shifted(out, size, *late) if late else out
    out = _read(out, errors, [(one, c) for one, c in known.values() if one.reads])
    own = {key: errors.get(name, 0.0) for name, key in _CURRENTS.items()}
    return with_current(out, {trial.name: own}).noting(f"corrected by {', '.join(errors)}, as estimated")


def _levelled(trial: Trial, errors: Errors, model: Model) -> Trial:
    """The trial with the levels of its own controls."""
    orders = dict(zip(model.controls, (order for order, _ in model.follows), strict=True))
    for name, size in errors.items():
        control, of = level_of(name)
        if of == trial.name:
            alike = [one for one, order in orders.items() if order == orders[control] and one in trial]
            trial = trial.having(**{one: trial[one] * (1.0 + size) for one in alike})
    return trial


def _late(what: str, trial: Trial, model: Model) -> tuple[str, ...]:
    """Channels of a sensor, of a control, or of all controls of one kind."""
    own = tuple(name for name in model.controls if name == what or name.rpartition("_")[0] == what) or (what,)
    return _TOGETHER.get(what, tuple(_logged(name, trial, model) for name in own))


def _logged(control: str, trial: Trial, model: Model) -> str:
    """The channel that a control is read from: its own, or that of the order it follows."""
    orders = {name: order for name, (order, _) in zip(model.controls, model.stands_for, strict=True)}
    return control if control in trial else orders.get(control, control)


def _acted(trial: Trial, acting: list[tuple[Suspect, float]], model: Model) -> Trial:
    """The trial with corrected inputs."""
    n = len(model.controls)
    series = np.zeros((len(trial), n + len(CHANNELS)))
    for k, (name, (order, factor)) in enumerate(zip(model.controls, model.stands_for, strict=True)):
        if name in trial or order in trial:
            series[:, k] = trial[name] if name in trial else factor * trial[order]
    wind = wind_of(trial)
    if wind is not None:
        series[:, n], series[:, n + 1] = wind
    change = sum((c * one.acts(series, trial.dt) for one, c in acting if one.acts), np.zeros_like(series))
    right, moved = series + change, np.asarray(change.any(axis=0))
    channels = {name: right[:, k] for k, name in enumerate(model.controls) if moved[k]}
    if moved[n : n + 2].any():
        north, east = right[:, n], right[:, n + 1]
        channels |= {"U_T": np.hypot(north, east), "gamma_T": np.arctan2(east, north)}
    return trial.having(**channels)


def _read(trial: Trial, errors: Errors, reading: list[tuple[Suspect, float]]) -> Trial:
    """The trial with corrected readings: biases and scales of each channel first, then what the whole state says."""
    state = np.zeros((len(trial), len(STATES)))
    for k, name in enumerate(STATES):
        if name in trial:
            values = unwrapped(trial[name]) if name == "psi" else trial[name]
            state[:, k] = (values - errors.get(f"bias.{name}", 0.0)) / (1.0 + errors.get(f"scale.{name}", 0.0))
    right = state
    of_state = [(one.reads, c) for one, c in reading if one.reads and
                (one.name.partition(".")[0] in _OF_STATE or one.name == "bias.psi_speed")]  # fmt: skip
    for _ in range(_ROUNDS if of_state else 0):  # an error is that of the true state: of the true heading, a deviation
        right = state - sum(c * reads(right, None, trial.dt) for reads, c in of_state)
    before = trial.stack(*(name for name in STATES if name in trial))
    after: dict[str, Array] = {}
    for k, name in enumerate(one for one in STATES if one in trial):
        if not np.array_equal(right[:, STATES.index(name)], before[:, k], equal_nan=True):
            after[name] = right[:, STATES.index(name)]
    return _remade(trial, trial.having(**after)) if after else trial


def as_logged(predicted: Trial, errors: Errors, model: Model, made: Collection[str] = ()) -> Trial:
    """What instruments with these errors would have logged of a motion; the inverse of `corrected`, delays left out.

    Args:
        predicted: with all states.
        errors: of readings; others change nothing.
        model: of the ship.
        made: velocities that the logger makes of track and heading.
    """
    known = {one.name: one for one in suspects(model, [predicted])}
    state = predicted.stack(*STATES)
    for name, c in errors.items():
        one = known.get(name)
        if one is not None and one.reads and name.partition(".")[0] in _OF_STATE:
            state = state + c * one.reads(predicted.stack(*STATES), None, predicted.dt)
    for k, name in enumerate(STATES):
        state[:, k] = state[:, k] * (1.0 + errors.get(f"scale.{name}", 0.0)) + errors.get(f"bias.{name}", 0.0)
    if {"u", "v_m"} <= set(made):
        seen = np.exp(-1j * (state[:, 2] - predicted["psi"])) * (predicted["u"] + 1j * predicted["v_m"])
        state[:, 3], state[:, 4] = seen.real, seen.imag
    return predicted.having(**{name: state[:, k] for k, name in enumerate(STATES)})


def _remade(logged: Trial, right: Trial) -> Trial:
    """The corrected trial with its speeds and rate of turn as they are made from the corrected track and heading.

    Only those that are made from others change: a compass that deviates turns speeds that a logger made by its heading.
    """
    made = {name for name in derived(logged) if name in logged}
    if "psi" not in right or not made & {"u", "v_m", "r"}:
        return right
    north, east, turn = (_change(name, logged, right) for name in ("x", "y", "psi"))
    out: dict[str, Array] = {}
    if "r" in made:
        out["r"] = right["r"] + np.gradient(turn, right.t)
    if made & {"u", "v_m"} and {"u", "v_m"} <= set(right.channels):
        over_ground = np.gradient(north, right.t) + 1j * np.gradient(east, right.t)
        along = np.exp(-1j * turn) * (right["u"] + 1j * right["v_m"])
        along += np.exp(-1j * _filled(unwrapped(right["psi"]))) * over_ground
        out |= {"u": along.real, "v_m": along.imag}
    return right.having(**out)


def _change(name: str, logged: Trial, right: Trial) -> Array:
    """What a channel was corrected by, row by row, also where it was not read."""
    if name not in right:
        return np.zeros(len(right))
    before, after = (unwrapped(one[name]) if name == "psi" else one[name] for one in (logged, right))
    return _filled(after - before)


def _filled(values: Array) -> Array:
    """Values with straight lines through gaps."""
    known, rows = np.isfinite(values), np.arange(values.size)
    return np.interp(rows, rows[known], values[known]) if known.any() else np.zeros(values.size)


def words(errors: Errors, model: Model, trial: Trial) -> str:
    """Errors with sizes and units, the current last as speed and direction; for people."""
    known = {one.name: one for one in suspects(model, [trial])}
    out: list[str] = []
    for name, size in errors.items():
        one = known.get(name)
        if name in _CURRENTS or not size:
            continue
        if one is None:
            out.append(f"{name} of {size:.3g}")
            continue
        share = size / (1.0 - size) if one.of_reading and size < 0.9 else size
        out.append(f"{one.words} of {share / one.per:.3g} {one.unit}")
    north, east = (errors.get(name, 0.0) for name in _CURRENTS)
    if north or east:
        towards = math.degrees(math.atan2(east, north)) % 360.0
        out.append(f"a current of {math.hypot(north, east):.3g} m/s towards {towards:.3g} deg")
    return ", ".join(out)

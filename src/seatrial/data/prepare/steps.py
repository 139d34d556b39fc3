"""Corrections of logs as values: what a remedy says is what is printed, written to a file and applied.

A `Step` is one correction; its `words` are the sentence of a finding, and `mended` applies it, so that neither can
contradict the other.  `seatrial check --remedy` writes a file of steps, `seatrial-steps/1`, for a person to read and
change; `seatrial mend` applies it.  `OPERATIONS` has all that a step can do.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from ...core.parameters import unknown
from ...core.values import dataclass, replace
from .. import Array, DataError, Trial, unwrapped
from ..documents import read_keys
from ..table import within
from ..units import conversion
from .axes import integral, to_body, to_earth
from .cutting import drop_trailing_gaps, unbroken, without
from .made import SOURCES, derived, marked
from .timing import interpolate_gaps, resample, shifted

SCHEMA = "seatrial-steps/1"
"""What a file of steps says of itself."""
# Stretches that a sentence names; the file has all of them.
_NAMED = 2
# Steps that it names.
_SAID = 3
# Rows of a piece that can be judged.
_FEWEST = 20
# What a track with headings tells.
_TOLD = ("u", "v_m", "r")


@dataclass(frozen=True, kw_only=True)
class Step:
    """One correction of trials.

    Attributes:
        do: one of `OPERATIONS`, which say what the other attributes mean.
        channels: those that it changes.
        amount: its numbers.
        unit: of the number of "add" and "constant".
        names: new names, of "rename"; what each channel is made of, of "mark".
        where: first and last time of each stretch [s], both included, of "gaps" and "cut".
        trials: names of the trials that it is for; none for all.
    """

    do: str
    channels: tuple[str, ...] = ()
    amount: tuple[float, ...] = ()
    unit: str = ""
    names: tuple[str, ...] = ()
    where: tuple[tuple[float, ...], ...] = ()
    trials: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """What to do, in words."""
        return OPERATIONS[self.do].words(self)

    def apply(self, trial: Trial) -> Trial:
        """The trial with this correction, whatever its name; after "cut", with a leap of time."""
        return OPERATIONS[self.do].apply(self, trial)


@dataclass(frozen=True)
class Remedy:
    """What mends a fault of a log.

    Attributes:
        text: what to do, in words, where no step can do it; else what else may be done.
        steps: what to do to the log.
        nuisance: keys of [nuisance] of a study and their values, which let a fit estimate the fault.
    """

    text: str = ""
    steps: tuple[Step, ...] = ()
    nuisance: tuple[tuple[str, float], ...] = ()

    def __str__(self) -> str:
        freed = ", ".join(f"{key} = {value:.3g}" for key, value in self.nuisance)
        said = [f"estimate it with the fit: [nuisance] {freed} in the study"] if freed else []
        words = [f"in {step.trials[0]} {step.words}" if step.trials else step.words for step in self.steps]
        more = f", and {len(words) - _SAID} more steps" if len(words) > _SAID + 1 else ""
        told = ", then ".join(words[: _SAID if more else None]) + more
        return "; or ".join(filter(None, [*said, told, self.text]))

    def repair(self, trial: Trial) -> Trial:
        """The trial with all steps."""
        for step in self.steps:
            trial = step.apply(trial)
        return trial


@dataclass(frozen=True)
class Operation:
    """What a step does.

    Attributes:
        amounts: how many numbers it takes.
        words, apply: as in `Step`.
        needs: whether its channels must be in the trial.
    """

    amounts: int
    words: Callable[[Step], str]
    apply: Callable[[Step, Trial], Trial]
    needs: bool = True


@dataclass(frozen=True, kw_only=True)
class _File:
    """A file of steps."""

    steps: tuple[Step, ...]


def read_steps(path: str | Path) -> tuple[Step, ...]:
    """The steps of a file.

    Raises:
        DataError: no such file, another schema, an unknown key, operation or unit, a wrong number of amounts.
    """
    found = read_keys(path, _File, SCHEMA).steps
    with within(Path(path)):
        for k, step in enumerate(found):
            _check(f"steps[{k}]", step)
    return found


def _check(place: str, step: Step) -> None:
    if step.do not in OPERATIONS:
        raise DataError(f"{place}.do: {unknown(step.do, OPERATIONS, 'operation')}")
    if len(step.amount) != (wanted := OPERATIONS[step.do].amounts):
        raise DataError(f"{place}.amount has {len(step.amount)} numbers; '{step.do}' takes {wanted}")
    if step.do in ("add", "constant"):
        for name in step.channels:
            conversion(name, step.unit)
    if step.do in ("multiply", "clock") and step.amount[0] == 0.0:
        raise DataError(f"{place}.amount is 0; '{step.do}' takes a number that is not zero")
    if step.do in ("exchange", "to_body", "move", "rotate") and len(step.channels) != 2:
        raise DataError(f"{place}.channels has {len(step.channels)} names; '{step.do}' takes two")
    if step.do == "follow" and not (len(step.channels) == 1 and step.amount[0] > 0):
        raise DataError(f"{place}: 'follow' takes one channel and a rate above zero [deg/s]")
    if step.do in ("rename", "mark") and len(step.names) != len(step.channels):
        raise DataError(f"{place}.names: give one for each channel ({len(step.channels)}), not {len(step.names)}")
    if any(len(stretch) != 2 or stretch[0] > stretch[1] for stretch in step.where):
        raise DataError(f"{place}.where: a stretch is [from, to], in s")


def steps_text(about: Iterable[tuple[str, Sequence[Step]]]) -> str:
    """A file of steps, each under its comment; stretches to leave out come first, as their times are as logged."""
    pairs = [(note, step) for note, steps in about for step in steps]
    pairs.sort(key=lambda pair: pair[1].do not in ("gaps", "cut"))
    blocks = [f'schema = "{SCHEMA}"\n']
    for note, step in pairs:
        said = {key: value for key, value in vars(step).items() if value and key != "do"}
        if step.amount:  # as in the words
            said["amount"] = [float(f"{number:.6g}") for number in step.amount]
        lines = "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in said.items())
        blocks.append(f'# {note}\n# {step.words}\n[[steps]]\ndo = "{step.do}"\n{lines}')
    return "\n".join(blocks)


def mended(trial: Trial, steps: Sequence[Step]) -> tuple[Trial, ...]:
    """The trial with the steps that are for it; its parts, numbered, where a stretch is cut out of its middle.

    Raises:
        DataError: a channel that the trial does not have.
    """
    mine = [step for step in steps if not step.trials or trial.name in step.trials]
    parts = (trial,)
    for step in mine:
        if step.do == "cut":
            parts = tuple(piece for part in parts for piece in _pieces(part, step))
        elif step.do == "split":
            parts = tuple(piece for part in parts for piece in unbroken(part, step.amount[0]))
        else:
            parts = tuple(_one(step, part) for part in parts)
    if not parts:
        raise DataError(f"{trial.name}: nothing is left after {mine[-1].words}")
    if len(parts) == 1:
        return (replace(parts[0], name=trial.name),)
    return tuple(replace(part, name=f"{trial.name}_{k}") for k, part in enumerate(parts, start=1))


def derivable(trial: Trial, absent: Sequence[str]) -> str:
    """How to come by velocities and rate of turn that were not logged; a clause, empty where the track cannot tell."""
    wanted = [name for name in absent if name in _TOLD]
    if not wanted or any(name not in trial for name in ("x", "y", "psi")):
        return ""
    listed = ", ".join(f'"{name}"' for name in wanted)
    return (f"; the track tells {', '.join(wanted)}: seatrial mend --by a file of steps with "
            f'do = "derive", channels = [{listed}] (docs/data.md, Remedies)')  # fmt: skip


def _one(step: Step, trial: Trial) -> Trial:
    if OPERATIONS[step.do].needs and (missing := [name for name in step.channels if name not in trial]):
        told = unknown(missing[0], trial.channels, "channel")
        raise DataError(f"{trial.name}: {step.words}: {told}{derivable(trial, missing)}")
    return step.apply(trial).noting(step.words)


def _inside(step: Step, t: Array) -> NDArray[np.bool_]:
    """Rows in the stretches of a step; half a millisecond is the rounding of a time in a file."""
    inside = np.zeros(t.size, dtype=np.bool_)
    for first, last in step.where:
        inside |= (t >= first - 5e-4) & (t <= last + 5e-4)
    return inside


def _pieces(trial: Trial, step: Step) -> tuple[Trial, ...]:
    """What is before, between and after the stretches, without pieces too short to judge."""
    return tuple(part.noting(step.words) for part in without(trial, _inside(step, trial.t), _FEWEST))


def _changed(step: Step, trial: Trial, change: Callable[[Array], Array]) -> Trial:
    return trial.having(**{name: change(trial[name]) for name in step.channels if name in trial})


# -- operations


def _add(step: Step, trial: Trial) -> Trial:
    return trial.having(**{
        name: trial[name] + step.amount[0] * conversion(name, step.unit)[1] for name in step.channels if name in trial
    })  # fmt: skip


def _constant(step: Step, trial: Trial) -> Trial:
    return trial.having(**{
        name: np.full(len(trial), step.amount[0] * conversion(name, step.unit)[1]) for name in step.channels
    })  # fmt: skip


def _sided(side: float) -> Callable[[Step, Trial], Trial]:
    return lambda s, trial: _changed(s, trial, lambda v: np.where(v * side > 0, v * s.amount[0], v))


def _exchange(step: Step, trial: Trial) -> Trial:
    a, b = step.channels
    return trial.having(**{a: trial[b], b: trial[a]})


def _to_body(step: Step, trial: Trial) -> Trial:
    north, east = step.channels
    u, v = to_body(trial[north], trial[east], trial["psi"])
    return trial.having(u=u, v_m=v)


def _move(step: Step, trial: Trial) -> Trial:
    ahead, aside = step.amount
    a, b = step.channels
    if a == "u":
        return trial.having(u=trial[a] + aside * trial["r"], v_m=trial[b] - ahead * trial["r"])
    north, east = to_earth(np.full(len(trial), ahead), np.full(len(trial), aside), trial["psi"])
    return trial.having(**{a: trial[a] - north, b: trial[b] - east})


def _rotate(step: Step, trial: Trial) -> Trial:
    """Velocities in axes that are turned clockwise."""
    a, b = step.channels
    u, v = to_body(trial[a], trial[b], np.full(len(trial), math.radians(step.amount[0])))
    return trial.having(**{a: u, b: v})


def _clock(step: Step, trial: Trial) -> Trial:
    return replace(trial, t=trial.t[0] + (trial.t - trial.t[0]) * step.amount[0], file=None)


def _even(step: Step, trial: Trial) -> Trial:
    return replace(trial, t=trial.t[0] + step.amount[0] * np.arange(len(trial)), file=None)


def _drop(step: Step, trial: Trial) -> Trial:
    return replace(trial, channels={n: v for n, v in trial.channels.items() if n not in step.channels})


def _rename(step: Step, trial: Trial) -> Trial:
    to = dict(zip(step.channels, step.names, strict=True))
    own = {to.get(name, name): said for name, said in derived(trial).items()}
    there = {to.get(name, name): values for name, values in trial.channels.items()}
    return replace(trial, channels=there, meta={**trial.meta, "derived": own} if own else trial.meta)


def _water(step: Step) -> tuple[float, float]:
    speed, towards = step.amount
    return speed * math.cos(math.radians(towards)), speed * math.sin(math.radians(towards))


def _to_ground(step: Step, trial: Trial) -> Trial:
    north, east = _water(step)
    u, v = to_body(np.full(len(trial), north), np.full(len(trial), east), trial["psi"])
    return _current(step, trial.having(u=trial["u"] + u, v_m=trial["v_m"] + v))


def _current(step: Step, trial: Trial) -> Trial:
    north, east = _water(step)
    every = np.ones(len(trial))
    return trial.having(U_C=math.hypot(north, east) * every, gamma_C=math.atan2(east, north) * every)


def _from_course(step: Step, trial: Trial) -> Trial:
    return trial.having(psi=unwrapped(trial["psi"]) - np.arctan2(trial["v_m"], trial["u"]))


def _derive(step: Step, trial: Trial) -> Trial:
    from .smooth import smooth

    track = smooth(trial)
    return marked(trial.having(**{name: track[name] for name in step.channels}), _made(step.channels))


def _made(names: Iterable[str]) -> dict[str, str]:
    """What the smoother makes channels of."""
    return {name: ", ".join(SOURCES[name]) for name in names if name in SOURCES}


def _follow(step: Step, trial: Trial) -> Trial:
    """What a servo of this rate [deg/s] makes of the orders."""
    most = math.radians(step.amount[0]) * np.diff(trial.t)
    (name,) = step.channels
    orders = trial[name]
    angle = orders.copy()
    for k in range(1, len(trial)):
        if math.isfinite(angle[k - 1]):
            angle[k] = angle[k - 1] + min(max(orders[k] - angle[k - 1], -most[k - 1]), most[k - 1])
    return trial.having(**{f"{name}_cmd": orders, name: angle})


def _from_track(step: Step, trial: Trial) -> Trial:
    from .smooth import smooth

    track = smooth(trial)
    drift = np.arctan2(track["v_m"], track["u"])
    return marked(trial.having(u=trial["u"] * np.cos(drift), v_m=trial["u"] * np.sin(drift)), _made(("v_m",)))


def _rebuilt(step: Step, trial: Trial) -> Trial:
    """Heading as the integral of r; offset and bias of r are those that fit the readings best."""
    rate, psi = trial["r"], unwrapped(trial["psi"])
    turned = integral(trial.t, np.interp(trial.t, trial.t[np.isfinite(rate)], rate[np.isfinite(rate)]))
    good = np.isfinite(psi)
    line = np.polynomial.Polynomial.fit(trial.t[good], (psi - turned)[good], 1)
    made = trial.having(psi=np.where(np.isfinite(rate), turned + line(trial.t), np.nan))
    return marked(made, {"psi": "r"})


def _unrepeated(values: Array) -> Array:
    return np.where(np.concatenate([[False], np.diff(values) == 0]), np.nan, values)


def _gaps(step: Step, trial: Trial) -> Trial:
    inside = _inside(step, trial.t)
    return _changed(step, trial, lambda values: np.where(inside, np.nan, values))


def _fill(step: Step, trial: Trial) -> Trial:
    return interpolate_gaps(trial, step.amount[0], [name for name in step.channels if name in trial])


def _list(step: Step) -> str:
    return ", ".join(step.channels)


def _stretches(step: Step) -> str:
    some = [f"t = {a:g} s" if a == b else f"t = {a:g} to {b:g} s" for a, b in step.where[:_NAMED]]
    more = len(step.where) - _NAMED
    return ", ".join(some) + (f" and in {more} more stretch{'es' * (more > 1)}" if more > 0 else "")


def _moved(step: Step) -> str:
    ahead, aside = step.amount
    if step.channels[0] == "u":
        return f"move u, v_m to midship: v_m {-ahead:+.6g} r, u {aside:+.6g} r"
    return (f"move {_list(step)} to midship: x {-ahead:+.6g} cos psi {aside:+.6g} sin psi, "
            f"y {-ahead:+.6g} sin psi {-aside:+.6g} cos psi")  # fmt: skip


def _added(step: Step) -> str:
    said = f"add {step.amount[0]:+.6g} {step.unit} to {_list(step)}"
    return f"{said} (offset = {step.amount[0]:.6g} in the mapping, if its unit is {step.unit})"


def _multiplied(step: Step) -> str:
    if step.amount[0] == -1.0:
        return f"change the sign of {_list(step)} (sign = -1 in the mapping)"
    return f"multiply {_list(step)} by {step.amount[0]:.6g}"


def _log_current(step: Step) -> str:
    return f"U_C = {step.amount[0]:.6g} m/s, gamma_C = {step.amount[1]:.6g} deg"


OPERATIONS: Mapping[str, Operation] = MappingProxyType({
    "add": Operation(1, _added, _add),
    "constant": Operation(1, lambda s: f"take {_list(s)} as {s.amount[0]:.6g} {s.unit} in every row", _constant,
                          needs=False),
    "multiply": Operation(1, _multiplied, lambda s, trial: _changed(s, trial, lambda v: v * s.amount[0])),
    "multiply_starboard": Operation(1, lambda s: f"multiply {_list(s)} to starboard by {s.amount[0]:.6g}", _sided(1.0)),
    "multiply_port": Operation(1, lambda s: f"multiply {_list(s)} to port by {s.amount[0]:.6g}", _sided(-1.0)),
    "shift": Operation(1, lambda s: f"shift {_list(s)} by {s.amount[0]:+.6g} s",
                       lambda s, trial: shifted(trial, -s.amount[0], *(n for n in s.channels if n in trial))),
    "exchange": Operation(0, lambda s: f"exchange {' and '.join(s.channels)}", _exchange),
    "to_body": Operation(0, lambda s: f"turn {_list(s)}, north and east, into u, v_m by psi (frame = {{ velocity = "
                         '"earth" } in the mapping)', _to_body),
    "move": Operation(2, _moved, _move),
    "rotate": Operation(1, lambda s: f"turn the axes of {_list(s)} by {s.amount[0]:+.6g} deg", _rotate),
    "clock": Operation(1, lambda s: f"multiply t by {s.amount[0]:.6g}", _clock),
    "even": Operation(1, lambda s: f"count time from row to row in steps of {s.amount[0]:.6g} s", _even),
    "resample": Operation(1, lambda s: f"resample to {s.amount[0]:.6g} s",
                          lambda s, trial: resample(trial, s.amount[0])),
    "fill": Operation(1, lambda s: f"fill gaps of {_list(s) or 'all channels'} of at most {s.amount[0]:.6g} s by "
                      "straight lines", _fill),
    "split": Operation(1, lambda s: f"split where time leaps by more than {s.amount[0]:.6g} s", lambda s, trial: trial),
    "gaps": Operation(0, lambda s: f"make gaps of {_list(s)} at {_stretches(s)}", _gaps),
    "cut": Operation(0, lambda s: f"cut out {_stretches(s)}",
                     lambda s, trial: trial.rows(~_inside(s, trial.t))),
    "trim": Operation(0, lambda s: "leave out the empty rows at the end", lambda s, trial: drop_trailing_gaps(trial)),
    "drop": Operation(0, lambda s: f"leave out {_list(s)}", _drop),
    "rename": Operation(0, lambda s: f"call {_list(s)} {', '.join(s.names)}", _rename),
    "unwrap": Operation(0, lambda s: f"make {_list(s)} continuous", lambda s, trial: _changed(s, trial, unwrapped)),
    "unrepeat": Operation(0, lambda s: f"keep the samples of {_list(s)} that differ from the one before",
                          lambda s, trial: _changed(s, trial, _unrepeated)),
    "to_ground": Operation(2, lambda s: f"add the current to u, v_m, which are over ground, and log it: "
                           f"{_log_current(s)}", _to_ground),
    "current": Operation(2, lambda s: f"log the current: {_log_current(s)}", _current, needs=False),
    "derive": Operation(0, lambda s: f"compute {_list(s)} from the smoothed track and heading", _derive, needs=False),
    "mark": Operation(0, lambda s: f"call {_list(s)} made from {'; '.join(dict.fromkeys(s.names))}, no measurement",
                      lambda s, trial: marked(trial, dict(zip(s.channels, s.names, strict=True)))),
    "follow": Operation(1, lambda s: f"call {_list(s)} {_list(s)}_cmd, and compute {_list(s)} as a servo of "
                        f"{s.amount[0]:.6g} deg/s follows it", _follow),
    "from_course": Operation(0, lambda s: "subtract the drift angle atan2(v_m, u) from psi", _from_course),
    "from_bow": Operation(0, lambda s: f"add psi to {_list(s)}",
                          lambda s, trial: _changed(s, trial, lambda v: v + trial["psi"])),
    "from_track": Operation(0, lambda s: "divide u, the speed over ground, into u, v_m by the angle between the "
                            "smoothed track and psi", _from_track),
    "rebuild": Operation(0, lambda s: "rebuild psi from r: its integral, with the offset and the bias of r that fit "
                         "the readings best", _rebuilt),
})  # fmt: skip
"""What a step can do: its numbers, in the order of `Step.amount`, are in its words."""

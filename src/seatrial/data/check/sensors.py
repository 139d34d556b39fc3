"""Checks of single channels and of the wind: clock, gaps, steps, degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...core.ranks import median
from ...core.values import dataclass
from .. import Array, Trial, unwrapped
from ..prepare import BREAK, Remedy, Step, complete
from ..turns import DIFFER, turns

MEASURED = ("x", "y", "psi", "u", "v_m", "r", "U_A", "gamma_A", "U_T", "gamma_T", "phi", "p")
"""Channels that an instrument measures."""

COMPARED = MEASURED[:6]
"""Those of the motion, which a fit compares; it needs no value of them in every row."""

EVERY = "all channels"
"""What a finding names that concerns the whole log."""

_DIRECTIONS = ("gamma_T", "gamma_A", "gamma_C")
# No thruster turns faster than this [rad/s], except one in degrees read as radians.
_SPIN = 4.0
# Resolution of compass (1 deg), rate of turn (1 deg/min), log (0.1 kn), receiver (1e-4 min of latitude) and
# anemometer (1 kn, 1 deg), by channel [SI]; and the length below which a ship is a model [m].
_STEPS = {
    "psi": math.radians(1.0), "phi": math.radians(0.1), "r": math.radians(1.0) / 60.0, "p": math.radians(0.1),
    "u": 0.0515, "v_m": 0.0515,
    "x": 0.186, "y": 0.186, "U_T": 0.515, "U_A": 0.515, "gamma_T": math.radians(1.0), "gamma_A": math.radians(1.0),
}  # fmt: skip
_SHIP = 20.0
_BEYOND = 1e15
# Rows without a value that a fit can do without.
_SPARED = 0.25
# Rows before and after a leap of time whose mean velocity is that of the ship there.
_AROUND = 6
# Steps that such a leap has at least.
_LEAPS = 3.0
# Values that show the rate of an instrument.
_FEW = 10

Kind = Literal["sign", "axes", "unit", "scale", "step", "short", "overlap", "quality"]
"""Kind of a fault.  A wrong sign, axis, unit, scale or time step makes a fit wrong, and so does a trial that is
too short or both trained on and tested on; the quality of the data makes it poor."""


@dataclass(frozen=True)
class Fault:
    """A finding without the name of the trial; `where` lists channels, or names another part of the trial."""

    severity: Literal["error", "warning", "info"]
    where: str
    what: str
    evidence: str
    remedy: str | Remedy
    kind: Kind = "quality"
    key: str = ""

    @property
    def channels(self) -> tuple[str, ...]:
        """Its channels; empty for a fault of all of them."""
        return () if self.where == EVERY else tuple(self.where.split(", "))


def beyond_faults(trial: Trial) -> Iterator[Fault]:
    """Values beyond every unit, with which no check can compute."""
    for name, values in trial.channels.items():
        largest = float(np.nanmax(np.abs(values), initial=0.0))
        if largest > _BEYOND:
            yield Fault("error", name, "beyond anything measured", f"up to {largest:.3g} {trial.unit(name)}",
                        gaps_of(trial, np.abs(values) > _BEYOND, name), "unit", "sentinel")  # fmt: skip


def sensor_faults(trial: Trial) -> Iterator[Fault]:
    """Faults of single channels."""
    yield from _time_faults(trial)
    yield from _angle_faults(trial)
    yield from _step_faults(trial)
    yield from _turn_faults(trial)


def _turn_faults(trial: Trial) -> Iterator[Fault]:
    """Two instruments in one channel, by turns."""
    for name in DIFFER:
        beside = ("x", "y") if name == "x" else (name,)
        if not all(one in trial for one in beside):
            continue
        good = np.isfinite(sum(trial[one] for one in beside))
        values = unwrapped(trial[name])[good] if name == "psi" else trial[name][good]
        found = turns(name, values, trial["y"][good] if name == "x" else None)
        if found is None:
            continue
        size = f"{found[1]:.3g} m" if name == "x" else f"{math.degrees(found[1]):.3g} deg"
        yield Fault(
            "warning", ", ".join(beside), "two instruments take turns",
            f"{size} apart, {int(np.sum(found[0]))} of {len(values)} readings are of the second",
            "import each from a column or a source of its own, or leave one out", "quality", "turns",
        )  # fmt: skip


def _time_faults(trial: Trial) -> Iterator[Fault]:
    steps = np.diff(trial.t)
    bad = int((steps <= 0).sum())
    if bad:
        kind = "repeats" if (steps[steps <= 0] == 0).all() else "goes back"
        distinct = np.unique(trial.t).size
        yield Fault(
            "error", "t", f"time {kind}", f"{bad} of {steps.size} steps, {distinct} distinct times",
            "the clock is rounded: rebuild the time from the row number and the true step", "quality",
            "time_repeats" if kind == "repeats" else "time_back",
        )  # fmt: skip
        return
    middle = median(steps)
    leaps = np.flatnonzero(steps > 1.5 * middle)
    different = np.unique(np.round(steps / middle, 3)).size
    share = leaps.size / steps.size
    if share > 0.05 and different <= 10 and not _lost_rows(trial, leaps, middle):
        yield Fault(
            "warning", "t", "time is quantised",
            f"only {different} different steps, from {steps.min():.3g} to {steps.max():.3g} s",
            _do("even", amount=(trial.duration / (len(trial) - 1),)), "quality", "time_quantised",
        )  # fmt: skip
    elif leaps.size and (ahead := _set_ahead(trial)) is not None:
        at, by = ahead
        yield Fault(
            "warning", "t", "the clock was set ahead while the log went on",
            f"by {by:.3g} s at t = {at:g} s: the ship is where it was a row later, at the same velocity",
            _do("split", amount=(0.5 * by,)), "step", "clock_ahead",
        )  # fmt: skip
    elif leaps.size:
        k = int(leaps[0])
        yield Fault(
            "warning", "t", "missing samples",
            f"{leaps.size} leap{'s' * (leaps.size > 1)}, up to {steps.max():.3g} s, the first at t = {trial.t[k]:g} s",
            _bridged(steps[leaps], middle), "quality", "missing_rows",
        )  # fmt: skip
    elif (off := np.abs(steps - middle) > 0.1 * middle).mean() > 0.05:
        yield Fault(
            "warning", "t", "uneven steps",
            f"{int(off.sum())} of {steps.size} steps differ by over 10 % from {middle:.3g} s, "
            f"from {steps.min():.3g} to {steps.max():.3g} s",
            _do("resample", amount=(middle,)), "quality",
            "uneven_steps",
        )  # fmt: skip


def _do(do: str, *channels: str, amount: tuple[float, ...] = (), unit: str = "") -> Remedy:
    """A remedy of one step."""
    return Remedy(steps=(Step(do=do, channels=channels, amount=amount, unit=unit),))


def degrees(*names: str) -> Step:
    """Degrees that were read as radians."""
    return Step(do="multiply", channels=names, amount=(math.pi / 180.0,))


def stretches(t: Array, rows: NDArray[np.bool_]) -> tuple[tuple[float, float], ...]:
    """First and last time of each stretch of rows [s]."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], rows.astype(np.int8), [0]])))
    return tuple((float(t[a]), float(t[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True))


def gaps_of(trial: Trial, rows: NDArray[np.bool_], *names: str) -> Remedy:
    """Gaps in the place of rows that nothing measured; an input is filled."""
    where = stretches(trial.t, rows)
    steps = [Step(do="gaps", channels=names, where=where)]
    if not set(names) & set(COMPARED):
        longest = max(b - a for a, b in where) + 2.0 * trial.dt
        steps.append(Step(do="fill", channels=names, amount=(longest,)))
    return Remedy(steps=tuple(steps))


def _bridged(leaps: Array, step: float) -> Remedy:
    """Few rows that lack are bridged, as a fit does; a trial ends where more do."""
    short, most = leaps[leaps <= BREAK * step], BREAK * step
    steps = [Step(do="split", amount=(most,))] if short.size < leaps.size else []
    if short.size:
        steps.append(Step(do="resample", amount=(step,)))
        steps.append(Step(do="fill", amount=(float(short.max()) + 2.5 * step,)))
    return Remedy(steps=tuple(steps))


def _set_ahead(trial: Trial) -> tuple[float, float] | None:
    """Time and size of a leap of the clock across which the ship moved as in one row [s]; None where it has none."""
    if not ("x" in trial and "y" in trial):
        return None
    fixed = np.flatnonzero(np.isfinite(trial["x"] + trial["y"]))
    if fixed.size < 4 * _AROUND:
        return None
    t, steps = trial.t[fixed], np.diff(trial.t[fixed])
    moved = np.diff(trial["x"][fixed] + 1j * trial["y"][fixed])
    middle = median(steps)
    for k in np.flatnonzero(steps > _LEAPS * middle).tolist():
        before, after = (np.sum(moved[a:b]) / np.sum(steps[a:b]) if 0 <= a < b <= steps.size else math.nan
                         for a, b in ((k - _AROUND, k), (k + 1, k + 1 + _AROUND)))  # fmt: skip
        mean = 0.5 * (before + after)
        one = abs(moved[k] - mean * middle) < 0.7 * abs(mean) * middle and abs(after - before) < 0.3 * abs(mean)
        if one and abs(mean) * middle > 3.0 * median(np.abs(np.diff(moved[k + 1 : k + 1 + _AROUND]))):
            return float(t[k]), float(steps[k] - middle)
    return None


def _lost_rows(trial: Trial, leaps: NDArray[np.intp], middle: float) -> bool:
    """Whether the ship has moved further across the leaps of time: rows are missing; a rounded clock shows no such."""
    steps = np.diff(trial.t)
    whole = np.abs(steps / middle - np.round(steps / middle)) < 0.02
    if not (whole.all() and steps.min() > 0.98 * middle and all(name in trial for name in ("x", "y"))):
        return False
    moved = np.hypot(np.diff(trial["x"]), np.diff(trial["y"]))
    usual = np.delete(moved, leaps)
    if not (np.isfinite(moved[leaps]).any() and np.isfinite(usual).any()):
        return False
    return bool(np.nanmedian(moved[leaps]) > 1.5 * np.nanmedian(usual))


def _angle_faults(trial: Trial) -> Iterator[Fault]:
    for name, values in trial.channels.items():
        if not np.isfinite(values).any():
            continue
        largest = float(np.nanmax(np.abs(values)))
        if name.split("_")[0] == "delta" and largest > 1.6:
            yield Fault(
                "error",
                name,
                "rudder is in degrees",
                f"up to {largest:.3g} rad",
                Remedy('unit = "deg" in the mapping', (degrees(name),)),
                "unit",
                "unit",
            )
        elif name.split("_")[0] == "alpha" and largest > 6.3 and trial.unit(name) in ("rad", "-"):
            yield _turned(trial, name, largest)
        elif name in _DIRECTIONS and largest > 6.3:
            # a continuous direction may exceed one turn in radians
            yield Fault("error" if largest > 30 else "info", name, "direction beyond one turn",
                        f"up to {largest:.4g} rad", Remedy("if it is in degrees", (degrees(name),)), "quality",
                        "unit")  # fmt: skip
    if "psi" not in trial:
        return
    jumps = np.abs(np.diff(trial["psi"]))
    for turn, unit in ((2 * math.pi, "rad"), (360.0, "in degrees")):
        wraps = int((np.abs(jumps - turn) < 0.2 * turn).sum())
        if wraps:
            # a compass counts from 0 to 360 deg, and whatever reads a heading here makes it continuous
            ordinary = unit == "rad"
            steps = (*([] if ordinary else [degrees("psi")]), Step(do="unwrap", channels=("psi",)))
            yield Fault("info" if ordinary else "error", "psi", "heading wraps",
                        f"{wraps} leaps of about {turn:.4g} {unit}",
                        "no action; data.unwrapped makes it continuous" if ordinary else Remedy(steps=steps), "quality",
                        "wraps")  # fmt: skip


def _turned(trial: Trial, name: str, largest: float) -> Fault:
    """A thruster beyond one turn: it may have rotated that far, but without leaps of a turn and without spinning."""
    good = np.isfinite(trial[name])
    moves, steps = np.abs(np.diff(trial[name][good])), np.diff(trial.t[good])
    moving = moves > 1e-3
    usual = median(moves[moving] / steps[moving]) if moving.any() else 0.0
    spins = usual > _SPIN and not name.endswith("_cmd")  # an order leaps
    if largest > 30 or moves.max(initial=0.0) > 6.5 or spins:
        return Fault(
            "error", name, "direction of the thrust is in degrees",
            f"up to {largest:.3g} rad, by up to {moves.max(initial=0.0):.3g} rad a row, median {usual:.3g} rad/s",
            Remedy("unit = \"deg\" in the mapping", (degrees(name),)), "unit", "unit",
        )  # fmt: skip
    return Fault("info", name, "direction beyond one turn", f"up to {largest:.4g} rad",
                 "if it is in degrees, convert it to radians")  # fmt: skip


def _step_faults(trial: Trial) -> Iterator[Fault]:
    """Coarse steps, few distinct values over a wide range: one note for ordinary instruments, else a warning."""
    ordinary: list[tuple[str, str]] = []
    for name in MEASURED:
        values = trial[name][np.isfinite(trial[name])] if name in trial else np.zeros(0)
        levels = np.unique(values)
        span = float(levels[-1] - levels[0]) if levels.size else 0.0
        if values.size < 50 or levels.size < 3 or span <= 0:
            continue
        quantum = median(np.diff(levels))
        if levels.size >= 0.25 * values.size or quantum <= 2e-3 * span:
            continue
        if quantum <= 1.01 * _resolution(trial, name):
            ordinary.append((name, f"{name} {quantum:.3g} {trial.unit(name)}"))
        else:
            yield Fault(
                "warning", name, "coarse steps",
                f"{levels.size} distinct values in {values.size} samples, "
                f"steps of {quantum:.3g} {trial.unit(name)}",
                Remedy(steps=(Step(do="rebuild", channels=("psi",)),)) if name == "psi" and "r" in trial
                else "state its noise in [loss] sigma of the study: a third of the step", "quality", "coarse",
            )  # fmt: skip
    if ordinary:
        yield Fault(
            "info", ", ".join(name for name, _ in ordinary), "steps of ordinary instruments",
            ", ".join(words for _, words in ordinary),
            "no action; the noise of a channel is a third of its step at least", "quality", "steps",
        )  # fmt: skip


def _resolution(trial: Trial, name: str) -> float:
    """Resolution of an ordinary instrument [SI]; aboard a model, that of a ship by Froude's law."""
    length: Any = trial.meta.get("L_pp")
    ratio = min(float(length) / _SHIP, 1.0) if isinstance(length, int | float) and length > 0 else 1.0
    by_froude = {"m": ratio, "m/s": math.sqrt(ratio), "rad/s": 1.0 / math.sqrt(ratio)}
    return _STEPS.get(name, 0.0) * by_froude.get(trial.unit(name), 1.0)


def gap_faults(trial: Trial) -> Iterator[Fault]:
    """Gaps, those that begin and end together as one; instruments slower than the rows; an empty end."""
    if not trial.channels:
        return
    filled = np.isfinite(trial.stack(*trial.channels)).any(axis=1)
    last = int(np.flatnonzero(filled)[-1]) if filled.any() else -1
    empty = len(trial) - 1 - last
    if last < 0:
        yield Fault("error", EVERY, "no data", f"{len(trial)} rows, all empty", "leave the trial out")
        return
    if empty:
        yield Fault(
            "warning", EVERY, "rows without data at the end",
            f"the last {empty} of {len(trial)} rows", _do("trim"),
        )  # fmt: skip
    slower: dict[float, list[str]] = {}
    holes: dict[_Holes, list[str]] = {}
    for name, values in trial.channels.items():
        if not np.isnan(values[: last + 1]).any():
            continue
        every = _every(trial.t[: last + 1], values[: last + 1])
        if every:
            slower.setdefault(every, []).append(name)
        else:
            found = _Holes.of(trial.t[: last + 1], values[: last + 1])
            holes.setdefault(next((one for one in holes if one.same(found)), found), []).append(name)
    for found, names in holes.items():
        # a fit compares the motion row by row; an input must have a value in every row
        few = set(names) <= set(COMPARED) and found.missing < _SPARED * (last + 1)
        yield Fault(
            "info" if few else "warning", ", ".join(names), "gaps", found.words(last + 1),
            "no action; a fit leaves these rows out" if few else found.remedy(trial, names), "quality", "gaps",
        )  # fmt: skip
    for every, names in slower.items():
        yield Fault(
            "info", ", ".join(names), f"sampled at {1.0 / every:.3g} Hz",
            f"a value every {every:.3g} s, the rows are at {1.0 / trial.dt:.3g} Hz",
            "the channel is complete; prepare.interpolate_gaps where every row must have a value", "quality", "slow",
        )  # fmt: skip


@dataclass(frozen=True)
class _Holes:
    """Gaps of a channel that are longer than its sampling step.

    Attributes:
        spans: begin and end of each gap [s].
        usual: time from one value to the next [s].
        missing: rows without a value.
    """

    spans: tuple[tuple[float, float], ...]
    usual: float
    missing: int

    @staticmethod
    def of(t: Array, values: Array) -> _Holes:
        good = np.isfinite(values)
        at, row = t[good], median(np.diff(t))
        usual = median(np.diff(at)) if at.size > 1 else row
        edges = np.concatenate([[t[0] - row], at, [t[-1] + row]])
        wide = np.flatnonzero(np.diff(edges) > usual + 0.5 * row)
        spans = tuple((max(float(edges[k]), float(t[0])), float(edges[k + 1])) for k in wide.tolist())
        return _Holes(spans, usual, int((~good).sum()))

    def same(self, other: _Holes) -> bool:
        """Whether both have the same gaps, to within their sampling steps."""
        slack = 1.01 * max(self.usual, other.usual)
        pairs = zip(self.spans, other.spans, strict=False)
        return len(self.spans) == len(other.spans) and all(
            abs(a - c) <= slack and abs(b - d) <= slack for (a, b), (c, d) in pairs
        )

    def remedy(self, trial: Trial, names: Sequence[str]) -> Remedy:
        """Short gaps filled, long ones cut out where a control has them."""
        most = math.inf if set(names) <= set(MEASURED) else BREAK * trial.dt
        filled = [b - a for a, b in self.spans if b - a <= most]
        rows = np.zeros(len(trial), dtype=np.bool_)
        for a, b in self.spans:
            rows |= (b - a > most) & (trial.t > a) & (trial.t < b)
        steps = [Step(do="cut", where=stretches(trial.t, rows))] if rows.any() else []
        if filled or not self.spans:
            longest = max(filled, default=2.0 * trial.dt)
            steps.append(Step(do="fill", channels=tuple(names), amount=(float(f"{longest * (1.0 + 1e-3):.4g}"),)))
        return Remedy(steps=tuple(steps))

    def words(self, rows: int) -> str:
        """The numbers in words."""
        if not self.spans:
            return f"{self.missing} of {rows} samples, scattered"
        longest, many = max(b - a for a, b in self.spans), "s" if len(self.spans) > 1 else ""
        first = min(a for a, _ in self.spans)
        return (f"{self.missing} of {rows} samples in {len(self.spans)} gap{many} of up to {longest:.3g} s, "
                f"the first after t = {first:g} s")  # fmt: skip


def _every(t: Array, values: Array) -> float:
    """Sampling step of an instrument that is slower than the rows and complete [s]; 0 for any other."""
    at = t[np.isfinite(values)]
    steps = np.diff(at)
    if steps.size < _FEW or not (steps > 0).all():
        return 0.0
    row, every = median(np.diff(t)), median(steps)
    even = bool((np.abs(steps - every) <= 0.25 * every + 1.01 * row).all())
    whole = max(at[0] - t[0], t[-1] - at[-1]) <= every + 1.01 * row
    return float(f"{every:.3g}") if every > 1.5 * row and steps.max() < 1.9 * every and even and whole else 0.0


def wind_faults(trial: Trial) -> Iterator[Fault]:
    """True and apparent wind against each other and the ship's velocity: both must be *from*."""
    names = ("U_A", "gamma_A", "U_T", "gamma_T", "psi", "u", "v_m")
    if not all(name in trial for name in names):
        return
    rows = trial.rows(complete(trial, names))
    if len(rows) < 20:
        return
    speed, angle, u, v = rows["U_T"], rows["gamma_T"] - rows["psi"], rows["u"], rows["v_m"]
    ahead, aside = speed * np.cos(angle), speed * np.sin(angle)
    felt = (rows["U_A"] * np.cos(rows["gamma_A"]), rows["U_A"] * np.sin(rows["gamma_A"]))
    misses = {
        (true, felt_sign): median(np.hypot(
            felt_sign * felt[0] - true * ahead - u, felt_sign * felt[1] - true * aside - v,
        ))
        for true in (1, -1) for felt_sign in (1, -1)
    }  # fmt: skip
    best = min(misses, key=lambda key: misses[key])
    ours = misses[1, 1]
    names_of = {(-1, 1): "gamma_T", (1, -1): "gamma_A", (-1, -1): "gamma_T and gamma_A"}
    numbers = f"true and apparent wind differ by {ours:.3g} m/s as 'from', by {misses[best]:.3g} m/s so"
    if best != (1, 1) and misses[best] < 0.5 * ours:
        yield Fault("error", names_of[best], "wind direction is 'to', not 'from'", numbers,
                    _do("add", *names_of[best].split(" and "), amount=(180.0,), unit="deg"),
                    "quality", "wind_to")  # fmt: skip
    elif ours > 0.3 * (median(speed) + median(np.abs(u))):
        yield Fault("warning", "U_A, gamma_A, U_T, gamma_T", "true and apparent wind disagree",
                    f"median difference {ours:.3g} m/s", "check units, heading and lever arm", "quality",
                    "wind_disagree")  # fmt: skip

"""Who is the odd one out: causes compete to explain what track, heading, rates and speeds leave over of each other.

Each suspect is a repair of the log: of a sign, of axes, of a unit, or by an amount that is fitted.  The one after which
least is left over is named, once, with its size; the log is repaired by it, and the rest is judged again.  Suspects
that explain the same are named together, unless a third witness decides (`_third_witness`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import Array, Trial, unwrapped
from ..prepare import to_earth
from .relations import G, Window, has, left_over, length_of, window_of
from .sensors import Fault, Kind

Repair = Callable[[Trial], Trial]

_DEG = math.pi / 180.0
# A gross suspect must leave at most this part of the squares, and there must be this much to explain (rms in noise).
_GROSS, _MUCH = 0.1, 4.0
# A fine one must take away this part of what is beyond noise, and be this many standard errors from none.
_SHARE, _SURE = 0.5, 8.0
_QUIET = 0.3
# Suspects whose logarithm of the squares differ by less than this part of the windows are told together.
_TIE = 0.02
_ROUNDS = 3
# Without any explanation it is told from this many times the noise on.
_LOST = 60.0
_ROWS, _WINDOWS, _TRIALS = 16, 60, 6
# A factor beyond this is a unit, if one explains it.
_LARGE = 0.3


@dataclass(frozen=True)
class Suspect:
    """A repair of a log that may explain what is left over.

    Attributes:
        key: the culprit for programs.
        channels: those that are accused.
        what, remedy: for people.
        kind: of the fault.
        repair: the log as it should be.
        evidence: numbers beyond the common ones.
        grave: whether it makes a fit wrong beyond use.
        last: whether it is heard only where nobody else explains anything.
    """

    key: str
    channels: tuple[str, ...]
    what: str
    remedy: str
    kind: Kind
    repair: Repair
    evidence: str = ""
    grave: bool = True
    last: bool = False


def differing(trials: Sequence[Trial]) -> list[int]:
    """Indices of trials that fit together much worse than the others."""
    own = [_rms(found.left) if (found := left_over([trial], causes=False)) else 0.0 for trial in trials]
    usual = float(np.median([one for one in own if one] or [0.0]))
    return [k for k, one in enumerate(own) if one > max(1.5 * usual, 1.5)]


def accused(trials: Sequence[Trial]) -> tuple[list[Fault], list[Trial]]:
    """Faults of channels that some trials of one ship have in common, and the trials repaired."""
    repaired = list(trials)
    found: list[Fault] = []
    for _ in range(_ROUNDS):
        fault, repair = _worst(repaired, {key for one in found for key in (one.key,)})
        if fault is None or repair is None:
            break
        found.append(fault)
        repaired = [repair(trial) for trial in repaired]
    return found, repaired


def _worst(trials: Sequence[Trial], told: set[str]) -> tuple[Fault | None, Repair | None]:
    now = left_over(trials)
    if now is None or _rms(now.left) < _QUIET:
        return None, None
    squares = _squares(now.left)
    rivals: list[tuple[float, Suspect]] = []
    if _rms(now.left) > _MUCH:
        thin = [_thinned(trial) for trial in _turning_most(trials)]
        before = left_over(thin, causes=False)
        for suspect in _gross(trials) if before is not None else ():
            after = left_over([suspect.repair(trial) for trial in thin], causes=False)
            if after is not None and _rms(after.left) ** 2 < _GROSS * _rms(before.left if before else now.left) ** 2:
                rivals.append((_squares(after.left), suspect))
    rivals += [pair for pair in _fine(trials, now) if pair[1].key not in told]
    if not rivals:
        return (_unexplained(now) if _gross_misfit(trials) and not told else None), None
    rivals = [pair for pair in rivals if not pair[1].last] or rivals
    rivals.sort(key=lambda pair: pair[0])
    best = rivals[0]
    even = [s for left, s in rivals if math.log(left / best[0]) < _TIE and s.key not in ("",)]
    if not np.isfinite(now.left[:, :2]).any():  # psi and r alone: either may be the one
        either = [s for _, s in rivals if s.channels in (("psi",), ("r",)) and s.kind == even[0].kind]
        even = [next((s for s in either if s.channels == one), even[0]) for one in (("psi",), ("r",))]
    even = _third_witness(trials, even)
    return _told(even, _rms(now.left), math.sqrt(best[0] / squares)), even[0].repair


def _told(even: Sequence[Suspect], rms: float, part: float) -> Fault:
    first = even[0]
    names = list(dict.fromkeys(name for one in even for name in one.channels))
    what = " or ".join(dict.fromkeys(one.what for one in even))
    remedy = " or ".join(dict.fromkeys(one.remedy for one in even))
    about = [one.evidence for one in even if one.evidence]
    about.append(f"track, heading, rates and speeds differ by {rms:.3g} times their noise, by {rms * part:.2g} after")
    return Fault("error" if first.grave else "warning", ", ".join(names), what, "; ".join(about), remedy,
                 first.kind, first.key)  # fmt: skip


def _gross_misfit(trials: Sequence[Trial]) -> bool:
    """Whether positions do not follow the velocities at all."""
    for trial in trials:
        if has(trial, "x", "y", "u", "psi"):
            lost = left_over([trial], causes=False)
            if lost is not None and _rms(lost.left) > _LOST:
                return True
    return False


def _unexplained(now: Window) -> Fault:
    return Fault("warning", "x, y, psi, u, v_m, r", "track, heading, rates and speeds do not fit together",
                 f"they differ by {_rms(now.left):.3g} times their noise, and no single cause explains it",
                 "check axes, reference point and time of the sensors", "quality", "inconsistent")  # fmt: skip


def _turning_most(trials: Sequence[Trial]) -> list[Trial]:
    """The few trials whose heading changes most."""

    def turned(trial: Trial) -> float:
        return -float(np.nanmax(trial["psi"]) - np.nanmin(trial["psi"])) if has(trial, "psi") else 0.0

    return sorted(trials, key=turned)[:_TRIALS]


def _thinned(trial: Trial) -> Trial:
    """Few rows a window and few windows, which is enough for signs, axes and units."""
    every = max(int(window_of(trial) / (_ROWS * trial.dt)), 1)
    return trial.rows(slice(0, _WINDOWS * _ROWS * every, every))


def _rms(left: Array) -> float:
    good = left[np.isfinite(left)]
    return float(np.sqrt(np.mean(good**2))) if good.size else 0.0


def _squares(left: Array) -> float:
    good = left[np.isfinite(left)]
    return float(good @ good) / max(good.size, 1) + 0.05


# -- suspects that need no size


def _times(factor: float, *names: str) -> Repair:
    return lambda trial: trial.having(**{n: trial[n] * factor for n in names if n in trial})


def _exchange(a: str, b: str) -> Repair:
    return lambda trial: trial.having(**{a: trial[b], b: trial[a]})


def _from_earth(first: str, second: str) -> Repair:
    def repair(trial: Trial) -> Trial:
        u, v = to_earth(trial[first], trial[second], -trial["psi"])
        return trial.having(u=u, v_m=v)

    return repair


def _heading_of_course(trial: Trial) -> Trial:
    return trial.having(psi=unwrapped(trial["psi"]) - np.arctan2(trial["v_m"], trial["u"]))


_UNITS: Mapping[str, Sequence[tuple[str, float]]] = {
    "psi": (("deg", 1 / _DEG), ("rad, converted from deg", _DEG)),
    "r": (("deg/s", 1 / _DEG), ("rad/s, converted from deg/s", _DEG), ("deg/min, taken as deg/s", 60.0),
          ("deg/s, taken as deg/min", 1 / 60.0), ("deg/min", 60.0 / _DEG), ("rad/s, taken as deg/min", _DEG / 60.0)),
    "x, y": (("ft", 3.28084), ("km", 1e-3), ("NM", 1 / 1852.0), ("mm", 1e3), ("cm", 1e2)),
    "u, v_m": (("kn", 1.943844), ("km/h", 3.6), ("cm/s", 100.0), ("m/s, taken as kn", 0.514444),
               ("m/s, taken as km/h", 1 / 3.6)),
    "u": (("kn", 1.943844), ("km/h", 3.6)),
    "v_m": (("kn", 1.943844), ("km/h", 3.6)),
    "t": (("ms", 1e3), ("us", 1e6), ("min", 1 / 60.0), ("h", 1 / 3600.0)),
}  # fmt: skip


def _gross(trials: Sequence[Trial]) -> Iterator[Suspect]:
    """Signs, axes and units that a log is known to get wrong."""
    known = {name for trial in trials for name in trial.channels if has(trial, name)}
    if {"x", "y", "u", "v_m", "psi"} <= known:
        yield from _axes()
    for name, what in (("psi", "psi counts counterclockwise"), ("r", "r counts to port")):
        if name in known:
            yield Suspect("sign", (name,), what, f"change its sign: sign = -1 of {name} in the mapping, or "
                          f"trial.having({name}=-trial['{name}'])", "sign", _times(-1.0, name))  # fmt: skip
    for names, units in _UNITS.items():
        channels = tuple(names.split(", "))
        if names != "t" and not set(channels) <= known:
            continue
        for unit, factor in units:
            repair = _slower(1.0 / factor) if names == "t" else _times(1.0 / factor, *channels)
            yield Suspect(
                "unit", channels, f"{names} {'is' if len(channels) == 1 else 'are'} in {unit}",
                f"say so in the unit of the column, or divide by {factor:.6g}", "unit", repair,
            )  # fmt: skip


def _axes() -> Iterator[Suspect]:
    for key, names, what, remedy, repair in (
        ("axes", ("u", "v_m"), "u, v_m are velocities north and east, not surge and sway",
         'turn them into body axes by psi: frame = { velocity = "earth" } in the mapping', _from_earth("u", "v_m")),
        ("axes", ("u", "v_m"), "u, v_m are velocities east and north",
         'exchange the columns, and frame = { velocity = "earth" } in the mapping', _from_earth("v_m", "u")),
        ("axes", ("x", "y"), "x is east and y is north", "exchange the two columns", _exchange("x", "y")),
        ("axes", ("u", "v_m"), "u is sway and v_m is surge", "exchange the two columns", _exchange("u", "v_m")),
        ("sign", ("v_m",), "v_m counts to port", "change its sign", _times(-1.0, "v_m")),
        ("sign", ("u",), "u counts astern", "change its sign", _times(-1.0, "u")),
        ("sign", ("y",), "y counts to the west", "change its sign", _times(-1.0, "y")),
        ("sign", ("x",), "x counts to the south", "change its sign", _times(-1.0, "x")),
        ("course_as_heading", ("psi",), "psi is the course over ground, not the heading",
         "take the column of the compass, or subtract the drift angle atan2(v_m, u)", _heading_of_course),
    ):  # fmt: skip
        yield Suspect(key, names, what, remedy, "sign" if key == "sign" else "axes", repair)


def _slower(factor: float) -> Repair:
    return lambda trial: replace(trial, t=trial.t[0] + (trial.t - trial.t[0]) * factor, file=None)


# -- suspects whose size is fitted

_Make = Callable[[Sequence[Trial], list[float], list[float]], Suspect | None]


def _fine(trials: Sequence[Trial], now: Window) -> Iterator[tuple[float, Suspect]]:
    squares, beyond = _squares(now.left), _rms(now.left) ** 2 - 1.0
    for columns, make in _FITTED:
        fitted = _fit(now, columns)
        if fitted is None:
            continue
        sizes, errors, rms = fitted
        if columns[0].endswith("_scale"):  # what is left over is counted in what was shown, not in what was true
            if sizes[0] > 0.98:
                continue
            sizes, errors = [sizes[0] / (1.0 - sizes[0])], [errors[0] / (1.0 - sizes[0]) ** 2]
        sure = max(abs(size) / error for size, error in zip(sizes, errors, strict=True))
        removed = _rms(now.left) ** 2 - rms**2
        if sure < _SURE or removed < _SHARE * beyond:
            continue
        suspect = make(trials, sizes, errors)
        if suspect is not None and max(abs(one) for one in sizes) > 0 and not columns[0].endswith("_scale"):
            suspect = _refined(trials, columns, make, sizes, errors, suspect)
        if suspect is not None:
            yield min(rms**2 + 0.05 + 0.01 * (len(columns) - 1) * squares, squares), suspect


def _refined(
    trials: Sequence[Trial], columns: Sequence[str], make: _Make, sizes: list[float], errors: list[float],
    suspect: Suspect,
) -> Suspect:  # fmt: skip
    """The suspect with its size from the repaired logs: large faults are not linear."""
    after = left_over([suspect.repair(trial) for trial in trials])
    more = None if after is None else _fit(after, columns)
    if more is None:
        return suspect
    return make(trials, [a + b for a, b in zip(sizes, more[0], strict=True)], errors) or suspect


def _fit(now: Window, columns: Sequence[str]) -> tuple[list[float], list[float], float] | None:
    """Sizes of some causes, their standard errors with what is left as noise, and the rms that is left."""
    left = now.left.ravel()
    matrix = np.column_stack([now.columns[name].ravel() for name in columns])
    good = np.isfinite(left) & np.isfinite(matrix).all(axis=1)
    left, matrix = left[good], matrix[good]
    if len(left) < 20 or not (np.abs(matrix) > 0).any(axis=0).all():
        return None
    normal = matrix.T @ matrix
    if np.linalg.cond(normal / np.sqrt(np.outer(np.diag(normal), np.diag(normal)))) > 1e6:
        return None
    sizes = np.linalg.solve(normal, matrix.T @ left)
    rest = left - matrix @ sizes
    rms = float(np.sqrt(np.mean(rest**2)))
    # windows overlap by three quarters
    errors = np.sqrt(np.diag(np.linalg.inv(normal)) * 4.0) * max(rms, 0.5)
    return sizes.tolist(), errors.tolist(), rms


def _length(trials: Sequence[Trial]) -> float:
    return next((size for trial in trials if (size := length_of(trial))), 100.0)


def _speed(trials: Sequence[Trial]) -> float:
    tops = [float(np.nanquantile(np.abs(t["u"]), 0.9)) for t in trials if "u" in t and np.isfinite(t["u"]).any()]
    return max(tops, default=1.0)


def _heading_bias(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    degrees = sizes[0] / _DEG
    if abs(degrees) < 0.4:
        return None
    return Suspect(
        "heading_bias", ("psi",), f"heading bias of {degrees:+.2f} deg (or magnetic heading)",
        f"offset = {-degrees:.2f} of psi (deg) in the mapping, or trial.having(psi=trial['psi'] - {sizes[0]:.5f})",
        "quality", lambda trial: trial.having(psi=trial["psi"] - sizes[0]),
        f"the track lies {-degrees:+.2f} +- {errors[0] / _DEG:.2f} deg from heading and drift, on every heading", False,
    )  # fmt: skip


def _log_scale(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    if abs(sizes[0]) < 0.02:
        return None
    return Suspect(
        "log_scale", ("u", "v_m"), f"speeds are {100 * sizes[0]:+.1f} % off the track",
        f"divide u and v_m by {1 + sizes[0]:.4f}", "scale" if abs(sizes[0]) > 0.15 else "quality",
        _times(1.0 / (1.0 + sizes[0]), "u", "v_m"), f"{100 * sizes[0]:+.2f} +- {100 * errors[0]:.2f} %",
        abs(sizes[0]) > 0.15, abs(sizes[0]) > _LARGE,
    )  # fmt: skip


def _log_bias(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    speed = _speed(trials)
    if max(map(abs, sizes)) < 0.01 * speed:
        return None
    names = ("u", "v_m")[: len(sizes)]
    words = ", ".join(f"{n} {size:+.3g} m/s" for n, size in zip(names, sizes, strict=True))
    return Suspect(
        "log_bias", names, f"speed log has a bias: {words}", f"subtract it: {words}", "quality",
        lambda trial: trial.having(**{n: trial[n] - size for n, size in zip(names, sizes, strict=True)}),
        ", ".join(f"{size:+.3g} +- {error:.2g} m/s" for size, error in zip(sizes, errors, strict=True)), False,
    )  # fmt: skip


def _lever(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    if math.hypot(*sizes) < 0.03 * _length(trials):
        return None
    ahead, aside = sizes
    where = f"{abs(ahead):.3g} m {'ahead' if ahead > 0 else 'abaft'}, {abs(aside):.3g} m to " + (
        "starboard" if aside > 0 else "port"
    )

    def repair(trial: Trial) -> Trial:
        c, s = np.cos(trial["psi"]), np.sin(trial["psi"])
        return trial.having(x=trial["x"] - ahead * c + aside * s, y=trial["y"] - ahead * s - aside * c)

    return Suspect(
        "lever_arm", ("x", "y"), f"x, y are those of an antenna {where} of midship",
        f"subtract the lever arm turned by psi: x - ({ahead:.4g} cos psi - {aside:.4g} sin psi), "
        f"y - ({ahead:.4g} sin psi + {aside:.4g} cos psi)", "quality", repair,
        f"{ahead:+.3g} +- {errors[0]:.2g} m ahead, {aside:+.3g} +- {errors[1]:.2g} m to starboard", False,
    )  # fmt: skip


def _sway_lever(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    ahead, aside = -sizes[0], -sizes[1]
    if math.hypot(ahead, aside) < 0.03 * _length(trials) or not has(trials[0], "r"):
        return None
    return Suspect(
        "lever_arm", ("u", "v_m"), f"u, v_m are those of a point {ahead:+.3g} m ahead and {aside:+.3g} m to starboard "
        "of midship", f"v_m - {ahead:.4g} r, u + {aside:.4g} r", "quality",
        lambda trial: trial.having(u=trial["u"] + aside * trial["r"], v_m=trial["v_m"] - ahead * trial["r"]),
        f"{ahead:+.3g} +- {errors[0]:.2g} m ahead", False,
    )  # fmt: skip


def _late(*names: str) -> Callable[[Sequence[Trial], list[float], list[float]], Suspect | None]:
    def make(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
        lag, step = sizes[0], float(np.median([trial.dt for trial in trials]))
        if abs(lag) < max(0.3 * step, 0.05 * math.sqrt(_length(trials) / G)):
            return None
        which = ", ".join(names)
        return Suspect(
            "lag", names, f"{which} {'is' if len(names) == 1 else 'are'} {'late' if lag > 0 else 'early'} by "
            f"{abs(lag):.2g} s",
            f"shift by {-lag:+.3g} s: prepare.shifted(trial, {lag:.3g}, {', '.join(map(repr, names))})", "quality",
            lambda trial: _shifted(trial, lag, names), f"{lag:+.3g} +- {errors[0]:.2g} s against "
            f"{'heading and speeds' if names[0] == 'x' else 'the others'}", False,
        )  # fmt: skip

    return make


def _shifted(trial: Trial, lag: float, names: Sequence[str]) -> Trial:
    from ..prepare import shifted

    return shifted(trial, lag, *(n for n in names if n in trial))


def _water(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    speed, towards = math.hypot(*sizes), math.degrees(math.atan2(sizes[1], sizes[0])) % 360.0
    if speed < 0.015 * _speed(trials):
        return None

    def repair(trial: Trial) -> Trial:
        c, s = np.cos(trial["psi"]), np.sin(trial["psi"])
        north, east = sizes
        return trial.having(u=trial["u"] + north * c + east * s, v_m=trial["v_m"] + east * c - north * s)

    return Suspect(
        "through_water", ("u", "v_m"), f"speeds are through the water, in a current of {speed:.3g} m/s towards "
        f"{towards:.0f} deg", "add the current turned by psi to u and v_m, which are over ground here, and log it "
        f"as U_C = {speed:.3g} m/s, gamma_C = {towards:.0f} deg", "quality", repair,
        f"the track drifts {sizes[0]:+.3g} +- {errors[0]:.2g} m/s north, {sizes[1]:+.3g} +- {errors[1]:.2g} m/s east",
        False,
    )  # fmt: skip


def _gyro_bias(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    ship_time = math.sqrt(_length(trials) / G)
    if abs(sizes[0]) * ship_time < 1e-3:
        return None
    a_minute = sizes[0] / _DEG * 60.0
    return Suspect(
        "gyro_bias", ("r",), f"rate of turn has a bias of {a_minute:+.3g} deg/min",
        f"offset = {-a_minute:.3g} of r (deg/min) in the mapping, or subtract {sizes[0]:.4g} rad/s", "quality",
        lambda trial: trial.having(r=trial["r"] - sizes[0]),
        f"heading turns {-a_minute:+.3g} +- {errors[0] / _DEG * 60:.2g} deg/min more than r gives", False,
    )  # fmt: skip


def _gyro_scale(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    if abs(sizes[0]) < 0.02:
        return None
    return Suspect(
        "gyro_scale", ("r",), f"rate of turn is {100 * sizes[0]:+.1f} % off the heading",
        f"divide r by {1 + sizes[0]:.4f}", "scale" if abs(sizes[0]) > 0.15 else "quality",
        _times(1.0 / (1.0 + sizes[0]), "r"), f"{100 * sizes[0]:+.2f} +- {100 * errors[0]:.2f} %", abs(sizes[0]) > 0.15,
        abs(sizes[0]) > _LARGE,
    )  # fmt: skip


def _time_scale(trials: Sequence[Trial], sizes: list[float], errors: list[float]) -> Suspect | None:
    if abs(sizes[0]) < 0.004 or not any(has(trial, "r", "psi") for trial in trials):
        return None
    step, factor = float(np.median([trial.dt for trial in trials])), 1.0 / (1.0 + sizes[0])
    return Suspect(
        "time_scale", ("t",), "the time step is not the true one",
        f"use the clock of the log: true step about {step * factor:.4g} s instead of {step:.4g} s, or multiply t by "
        f"{factor:.5g}", "step", _slower(factor),
        f"positions move and heading turns {factor:.4f} +- {errors[0]:.1g} times as much as u, v_m, r give",
        abs(sizes[0]) > 0.04, abs(sizes[0]) > _LARGE,
    )  # fmt: skip


_FITTED: tuple[tuple[tuple[str, ...], _Make], ...] = (
    (("heading_bias",), _heading_bias),
    (("log_scale",), _log_scale),
    (("log_bias",), _log_bias),
    (("log_bias", "sway_bias"), _log_bias),
    (("lever_ahead", "lever_aside"), _lever),
    (("lever_ahead", "lever_aside"), _sway_lever),
    (("lag_x",), _late("x", "y")),
    (("lag_psi",), _late("psi")),
    (("lag_u",), _late("u", "v_m")),
    (("lag_r",), _late("r")),
    (("water_north", "water_east"), _water),
    (("gyro_bias",), _gyro_bias),
    (("gyro_scale",), _gyro_scale),
    (("time_scale",), _time_scale),
)


def _third_witness(trials: Sequence[Trial], even: list[Suspect]) -> list[Suspect]:
    """Decide between suspects that explain the same, where something else in the logs can."""
    points = [one for one in even if one.key == "lever_arm"]
    if len(points) == 2 and even[0].key == "lever_arm":
        # a turning ship pivots a quarter to half its length ahead of midship, where there is no sway
        pivots = [pivot for trial in trials if (pivot := _pivot(trial)) is not None]
        inside = not pivots or 0.1 < float(np.median(pivots)) / _length(trials) < 0.8
        return [one for one in points if ("x" in one.channels) == inside]
    if even[0].key == "log_scale":
        return even[:1]
    return even


def _pivot(trial: Trial) -> float | None:
    """Distance of the point without sway ahead of midship in turns [m]."""
    if not has(trial, "r", "v_m"):
        return None
    r, v = trial["r"], trial["v_m"]
    hard = np.isfinite(r) & np.isfinite(v)
    hard &= np.abs(r) > 0.5 * float(np.nanmax(np.abs(r)))
    return float(-(v[hard] @ r[hard]) / (r[hard] @ r[hard])) if hard.sum() > 20 else None

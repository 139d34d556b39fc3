"""Where the water and the wind carry the ship: closed turns, straight legs on several headings, and the wind on record.

In a steady turn the velocities over ground of one whole circle add up to the current.  On straight legs the drift is
the same to one side on every heading where the compass is wrong, and towards one point of the earth in a current;
where a turn tells the current, one leg is enough.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...core.constants import GRAVITY
from ...core.values import dataclass
from .. import Array, Trial, unwrapped
from ..prepare import Remedy, Step, complete, integral
from .relations import has, length_of, slides_unseen
from .sensors import Fault

_TURN = 2.0 * math.pi
# Drift that is told, as a part of the speed; the drift a wind may cause, as a part of its own speed.
_PART, _LEEWAY = 0.02, 0.08
# Drift of a turning ship that its wind can cause at most, as a part of the speed of the wind; beyond, it is a current.
_DRIVEN = 0.03
_SURE = 6.0
# Drift angle on a straight leg that no propeller causes [rad].
_ASKEW = math.radians(3.0)


@dataclass(frozen=True)
class Drift:
    """A drift over ground [m/s, north and east], its standard error, and which way the ship turned."""

    north: float
    east: float
    error: float
    side: float

    @property
    def speed(self) -> float:
        """Its size [m/s]."""
        return math.hypot(self.north, self.east)

    @property
    def towards(self) -> float:
        """Where it goes [deg]."""
        return math.degrees(math.atan2(self.east, self.north)) % 360.0


def drift_faults(trials: Sequence[Trial]) -> Iterator[Fault]:
    """Currents nobody told of, compasses that straight legs contradict, and winds that blow the other way."""
    turns = {trial.name: drift for trial in trials if (drift := circle(trial)) is not None}
    wind = [*_wind_axes(trials)]
    if wind:
        yield wind[0]
        return
    to = _wind_to(trials, turns)
    if to is not None:
        yield to
        return
    legs = [leg for trial in trials if (leg := _leg(trial)) is not None and not _windy(trial, leg.speed)]
    fault = _of_legs(legs)
    if fault is not None and fault.key == "heading_bias":
        yield fault
        return
    current = _beside_turns(trials, turns) or _of_turns(trials, turns) or fault
    if current is not None:
        yield current


def circle(trial: Trial) -> Drift | None:
    """Drift of the last whole circle of a turn; None without one."""
    names = ("x", "y", "psi") if has(trial, "x", "y", "psi") else ("u", "v_m", "psi")
    if not has(trial, *names) or not has(trial, "psi"):
        return None
    rows = trial.rows(complete(trial, names))
    if len(rows) < 40:
        return None
    psi, t = unwrapped(rows["psi"]), rows.t
    side = math.copysign(1.0, psi[-1] - psi[0])
    turned = side * (psi - psi[-1])
    first = int(np.searchsorted(np.maximum.accumulate(turned), -_TURN))
    if first == 0 or side * (psi[first] - psi[0]) < math.pi / 3.0 or not _steady(psi[first:], t[first:], side):
        return None
    part = slice(first, None)
    t, psi = t[part], psi[part]
    if names[0] == "x":
        x, y = rows["x"][part], rows["y"][part]
    else:
        c, s = np.cos(psi), np.sin(psi)
        x, y = (integral(t, v) for v in (rows["u"][part] * c - rows["v_m"][part] * s,
                                         rows["u"][part] * s + rows["v_m"][part] * c))  # fmt: skip
    return _drift(t, psi, x, y, side)


def _steady(psi: Array, t: Array, side: float) -> bool:
    """Whether the circle is one turn to one side at a rate that changes little."""
    quarters = np.interp(np.linspace(0.0, 1.0, 5), np.linspace(0.0, 1.0, t.size), side * psi)
    rates = np.diff(quarters)
    return bool(rates.min() > 0.4 * rates.max())


def _drift(t: Array, psi: Array, x: Array, y: Array, side: float) -> Drift | None:
    """x, y = turned steady speeds that change by a trend, and a drift, by least squares on displacements."""
    c, s = np.cos(psi), np.sin(psi)
    late = (t - t[0]) / (t[-1] - t[0]) - 0.5
    n = max(t.size // 40, 1)
    zero, one = np.zeros_like(t), np.ones_like(t)
    north = np.column_stack([_over(t, part, n) for part in (c, -s, late * c, -late * s, one, zero)])
    east = np.column_stack([_over(t, part, n) for part in (s, c, late * s, late * c, zero, one)])
    a = np.arange(0, t.size - n, n)
    matrix = np.concatenate([north, east])
    moved = np.concatenate([x[a + n] - x[a], y[a + n] - y[a]])
    normal = matrix.T @ matrix
    if np.linalg.cond(normal) > 1e12:
        return None
    size = np.linalg.solve(normal, matrix.T @ moved)
    rest = moved - matrix @ size
    error = float(np.sqrt(np.linalg.inv(normal)[4, 4] * 2.0 * (rest @ rest) / max(moved.size - 6, 1)))
    return Drift(float(size[4]), float(size[5]), error, side)


def _over(t: Array, rate: Array, n: int) -> Array:
    total = integral(t, rate)
    a = np.arange(0, t.size - n, n)
    return total[a + n] - total[a]


def _of_turns(trials: Sequence[Trial], turns: dict[str, Drift]) -> Fault | None:
    found = []
    for trial in trials:
        drift = turns.get(trial.name)
        if drift is None:
            continue
        known = _logged_current(trial)
        speed = math.hypot(drift.north - known[0], drift.east - known[1])
        top = float(np.nanquantile(np.abs(trial["u"]), 0.9)) if "u" in trial else 1.0
        if speed > max(_SURE * drift.error, _PART * top, _LEEWAY * _wind_speed(trial)):
            found.append((trial.name, drift))
    if not found:
        return None
    words = "; ".join(f"{name} drifts {d.speed:.3g} +- {d.error:.1g} m/s towards {d.towards:.0f} deg"
                      for name, d in found[:4])  # fmt: skip
    speed = float(np.median([d.speed for _, d in found]))
    return _current(speed, found[0][1].towards, f"closed turns: {words}")


def _current(speed: float, towards: float, evidence: str) -> Fault:
    return Fault(
        "warning", "x, y", f"a current of about {speed:.2g} m/s that is not on record (or wind that is not)", evidence,
        Remedy(nuisance=(("current", max(float(f"{speed:.2g}"), 0.05)),)), "quality", "current",
    )  # fmt: skip


def _logged_current(trial: Trial) -> tuple[float, float]:
    if not ("U_C" in trial and "gamma_C" in trial):
        return 0.0, 0.0
    return (float(np.nanmean(trial["U_C"] * np.cos(trial["gamma_C"]))),
            float(np.nanmean(trial["U_C"] * np.sin(trial["gamma_C"]))))  # fmt: skip


def _wind_speed(trial: Trial) -> float:
    if "U_T" in trial and np.isfinite(trial["U_T"]).any():
        return float(np.nanmedian(trial["U_T"]))
    return 0.0


# -- straight legs


@dataclass(frozen=True)
class _Leg:
    """A straight leg: heading [rad], speed ahead, sway over ground [m/s] and its standard error."""

    psi: float
    speed: float
    sway: float
    error: float


def _windy(trial: Trial, speed: float) -> bool:
    return _wind_speed(trial) > 0.6 * speed


def _leg(trial: Trial) -> _Leg | None:
    """The straight stretch at the beginning of a log."""
    if not has(trial, "psi", "u") or "v_m" not in trial or slides_unseen(trial):
        return None
    length, u, v = length_of(trial) or 100.0, trial["u"], trial["v_m"]
    r = trial["r"] if has(trial, "r") else _rate(trial, 2.0 * math.sqrt(length / GRAVITY))
    delta = trial["delta"] if "delta" in trial else np.zeros(len(trial))
    known = np.isfinite(r) & np.isfinite(u) & np.isfinite(v) & np.isfinite(trial["psi"])
    bent = np.flatnonzero(known & ~((np.abs(r) * length < 0.02 * np.abs(u)) & ~(np.abs(delta) > math.radians(4.0))))
    rows = np.flatnonzero(known[: int(bent[0]) if bent.size else len(trial)])
    if rows.size < max(12, 2.0 * math.sqrt(length / GRAVITY) / trial.dt):
        return None
    north, east = _logged_current(trial)
    psi, speed = float(np.mean(unwrapped(trial["psi"][rows]))), float(np.mean(u[rows]))
    sway = float(np.mean(v[rows])) - east * math.cos(psi) + north * math.sin(psi)
    error = max(float(np.std(v[rows])) / math.sqrt(rows.size), 0.002 * abs(speed), 1e-9)
    return _Leg(psi, speed, sway, error)


def _rate(trial: Trial, span: float) -> Array:
    """Rate of turn [rad/s] by the heading, over so many seconds."""
    psi, half = unwrapped(trial["psi"]), 0.5 * span
    known = np.isfinite(psi)
    after, before = (np.interp(trial.t + step, trial.t[known], psi[known]) for step in (half, -half))
    within = np.minimum(trial.t + half, trial.t[-1]) - np.maximum(trial.t - half, trial.t[0])
    return np.where(known, (after - before) / within, np.nan)


def _of_legs(legs: Sequence[_Leg]) -> Fault | None:
    """One side on every heading: the compass.  One point of the earth: a current."""
    spread = abs(sum(complex(math.cos(leg.psi), math.sin(leg.psi)) for leg in legs)) / max(len(legs), 1)
    if len(legs) < 4 or spread > 0.85:
        return None
    weight = np.array([1.0 / leg.error for leg in legs])
    sway = np.array([leg.sway for leg in legs]) * weight
    compass = np.array([[leg.speed] for leg in legs]) * weight[:, None]
    water = np.array([[-math.sin(leg.psi), math.cos(leg.psi)] for leg in legs]) * weight[:, None]
    alone = float(np.mean(sway**2))
    found = []
    for matrix in (compass, water):
        size, *_ = np.linalg.lstsq(matrix, sway, rcond=None)
        rest = float(np.mean((sway - matrix @ size) ** 2))
        errors = np.sqrt(np.diag(np.linalg.inv(matrix.T @ matrix)) * max(rest, 1.0))
        found.append((rest, size, errors))
    (one_side, bias, bias_error), (one_point, drift, drift_error) = found
    speed = float(np.median([leg.speed for leg in legs]))
    headings = ", ".join(f"{math.degrees(leg.psi) % 360:.0f}" for leg in legs)
    if one_side < 0.3 * one_point and one_side < 0.2 * alone and abs(bias[0]) > max(0.012, _SURE * bias_error[0]):
        degrees = -math.degrees(float(bias[0]))
        return _askew(degrees, f"straight legs on headings {headings} deg drift {-degrees:+.2f} +- "
                      f"{math.degrees(float(bias_error[0])):.2f} deg to one side")  # fmt: skip
    size = math.hypot(*drift)
    if one_point < 0.3 * one_side and one_point < 0.2 * alone and size > max(_PART * speed, _SURE * drift_error.max()):
        towards = math.degrees(math.atan2(drift[1], drift[0])) % 360.0
        return _current(size, towards, f"straight legs on headings {headings} deg drift {size:.3g} +- "
                        f"{drift_error.max():.1g} m/s towards {towards:.0f} deg")  # fmt: skip
    return None


def _askew(degrees: float, evidence: str) -> Fault:
    return Fault(
        "warning", "psi", f"heading bias of {degrees:+.2f} deg (or magnetic heading, or a log that is askew)", evidence,
        Remedy(steps=(Step(do="add", channels=("psi",), amount=(round(-degrees, 2),), unit="deg"),
                      Step(do="rotate", channels=("u", "v_m"), amount=(round(-degrees, 2),)))),
        "quality", "heading_bias",
    )  # fmt: skip


def _beside_turns(trials: Sequence[Trial], turns: dict[str, Drift]) -> Fault | None:
    """Legs that go aside of their heading where the closed turn of the same log knows the water: the compass.

    Told from one heading on, beyond what a propeller or a wind does to a ship that goes straight.
    """
    found = []
    for trial in trials:
        drift, leg = turns.get(trial.name), _leg(trial)
        if drift is None or leg is None or _windy(trial, leg.speed) or leg.speed <= 0.0:
            continue
        north, east = drift.north - _logged_current(trial)[0], drift.east - _logged_current(trial)[1]
        c, s = math.cos(leg.psi), math.sin(leg.psi)
        ahead, aside = leg.speed - north * c - east * s, leg.sway + north * s - east * c
        error = math.hypot(leg.error, drift.error)
        windy = 0.5 * math.hypot(north, east)  # a drift of the turn may be that of a wind, which a leg feels otherwise
        if abs(aside) < max(_ASKEW * leg.speed, _SURE * error, _LEEWAY * _wind_speed(trial), windy):
            return None
        found.append((math.degrees(math.atan2(aside, ahead)), trial.name))
    if not found:
        return None
    bias = float(np.median([one for one, _ in found]))
    if any(abs(one - bias) > 0.5 * abs(bias) for one, _ in found):
        return None
    words = "; ".join(f"{name} goes {one:+.1f} deg aside of it" for one, name in found[:4])
    return _askew(-bias, f"going straight, {words}, and the closed turn behind shows no such current")


# -- the wind on record


def _wind_axes(trials: Sequence[Trial]) -> Iterator[Fault]:
    """A true wind is steady over the earth; one that follows the bow is the apparent one."""
    names = ("U_T", "gamma_T", "psi", "u", "v_m")
    spreads: list[tuple[float, ...]] = []
    for trial in trials:
        if not all(name in trial for name in names) or not has(trial, "psi", "gamma_T"):
            continue
        rows = trial.rows(complete(trial, names))
        if len(rows) < 50 or np.ptp(unwrapped(rows["psi"])) < 0.5:
            continue
        speed, angle, psi = rows["U_T"], rows["gamma_T"], rows["psi"]
        ahead, aside = speed * np.cos(angle), speed * np.sin(angle)
        readings = (
            (ahead, aside),
            _turned(ahead - rows["u"], aside - rows["v_m"], psi),
            _turned(ahead, aside, psi),
        )
        spreads.append(tuple(float(np.std(n) ** 2 + np.std(e) ** 2) for n, e in readings))
    if not spreads:
        return
    told, apparent, relative = np.sum(spreads, axis=0)
    best = min(apparent, relative)
    if best < 0.4 * told:
        felt = apparent <= relative
        yield Fault(
            "error", "U_T, gamma_T", "the apparent wind is logged as the true one" if felt
            else "the direction of the true wind is counted from the bow",
            f"it scatters by {math.sqrt(told / len(spreads)):.3g} m/s over the earth, and by "
            f"{math.sqrt(best / len(spreads)):.2g} m/s so",
            Remedy(steps=(Step(do="rename", channels=("U_T", "gamma_T"), names=("U_A", "gamma_A")) if felt
                          else Step(do="from_bow", channels=("gamma_T",)),)), "axes", "apparent_as_true",
        )  # fmt: skip


def _turned(ahead: Array, aside: Array, psi: Array) -> tuple[Array, Array]:
    c, s = np.cos(psi), np.sin(psi)
    return ahead * c - aside * s, ahead * s + aside * c


def _wind_to(trials: Sequence[Trial], turns: dict[str, Drift]) -> Fault | None:
    """Turns to both sides drift to leeward of their wind; those that drift to windward have it turned round.

    Where the apparent wind was logged, it is the witness (`wind_faults`).
    """
    lee, drifts, winds, errors = [], [], [], []
    for trial in trials:
        drift = turns.get(trial.name)
        if drift is None or "gamma_T" not in trial or "gamma_A" in trial or not np.isfinite(trial["gamma_T"]).any():
            continue
        wind = _wind_speed(trial)
        if wind < max(3.0 * math.sqrt((length_of(trial) or 100.0) / 100.0), drift.speed / _DRIVEN):
            continue
        north, east = np.nanmean(np.cos(trial["gamma_T"])), np.nanmean(np.sin(trial["gamma_T"]))
        lee.append((-(drift.north * north + drift.east * east), drift.side))
        drifts.append(drift.speed)
        winds.append(wind)
        errors.append(drift.error)
    if {side for _, side in lee} != {1.0, -1.0} or any(abs(_logged_current(t)[0]) > 0 for t in trials):
        return None
    down = [np.mean([part for part, side in lee if side == which]) for which in (1.0, -1.0)]
    share = float(np.mean(down)) / float(np.mean(drifts))
    sure = -float(np.mean(down)) / float(np.linalg.norm(errors) / len(errors))
    if share < -0.5 and sure > 0.7 * _SURE:
        return Fault(
            "warning", "gamma_T", "wind direction is 'to', not 'from'",
            f"turns drift {np.mean(drifts):.2g} m/s, {-1e2 * share:.0f} % of it to windward ({np.mean(winds):.3g} m/s)",
            Remedy(steps=(Step(do="add", channels=("gamma_T",), amount=(180.0,), unit="deg"),)), "quality", "wind_to",
        )  # fmt: skip
    return None

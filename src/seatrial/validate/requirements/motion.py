"""Checks of the ship's motion: resistance, stability, plausibility, answer to rudder and propeller, wind and waves."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...core.parameters import ParameterError, update, values
from ...data import Array, Trial, unwrapped
from ...environment import Environment
from . import Judgement, Plot, given
from .probe import Probe

_NOTICEABLE = 0.01
_DEGREE = math.pi / 180.0


def resistance(p: Probe) -> Judgement:
    """Each velocity meets a resistance of its own."""
    held = p.slopes(p.U, p.controls(p.n_P))
    surge = p.rates(p.U, 0.0, 0.0, p.controls())[0]
    time_unit = p.unit_time
    found = {"surge": min(held[0, 0], surge / p.U), "sway": held[1, 1], "yaw": held[2, 2]}
    evidence = {f"damping in {name}": (-value * time_unit, "U/L") for name, value in found.items()}
    lacking = [name for name, value in found.items() if not value * time_unit < -1e-6]
    t, runs = p.drift(
        [p.state(u=p.U), p.state(p.U, v_m=0.2 * p.U), p.state(p.U, r=0.3 * p.U / p.ship.L_pp)],
        [p.controls(), p.controls(p.n_P), p.controls(p.n_P)], 15 * time_unit,
    )  # fmt: skip
    scales = (("u, propeller stopped", 0, 3, p.U), ("v_m from a push", 1, 4, 0.2 * p.U),
              ("r from a push", 2, 5, 0.3 * p.U / p.ship.L_pp))  # fmt: skip
    plot = Plot("Decay of each velocity", "t U/L", "over its initial value",
                tuple((label, t / time_unit, runs[k, :, c] / scale) for label, k, c, scale in scales))  # fmt: skip
    return given(
        not lacking, "surge, sway and yaw are each damped",
        f"no resistance in {' and '.join(lacking)}: the model has no such force", evidence, plot,
    )  # fmt: skip


def growth(p: Probe, u: float) -> float:
    """Fastest growth of a disturbance of the straight run at speed `u` [1/s]; negative where it dies out."""
    slopes = p.slopes(u, p.controls(p.n_P * u / p.U))[1:, 1:]
    moving = [k for k in range(2) if np.abs(slopes[k]).max() > 1e-12 / p.unit_time]
    block = slopes[np.ix_(moving, moving)]
    return float(np.linalg.eigvals(block).real.max()) if moving else 0.0


def stability(p: Probe) -> Judgement:
    """Course stability is a property of hull and speed, and may be lost."""
    speeds = [f * p.U for f in (0.25, 0.5, 0.75, 1.0)]
    rates = [growth(p, u) for u in speeds]
    unit = 1.0 / p.unit_time
    with_speed = max(rates) - min(rates) > _NOTICEABLE * max(map(abs, rates))
    effects = sorted(_effects(p, rates[-1]), reverse=True)
    effect, name = effects[0] if effects else (0.0, "")
    flip = _flip(p, rates[-1], [path for _, path in effects[:5]])
    evidence = {
        "growth of a disturbance at the approach": (rates[-1] / unit, "U/L"),
        "the same at a quarter of the speed": (rates[0] / unit, "U/L"),
        f"change by half of {name or 'any parameter'}": (effect / unit, "U/L"),
    }
    plot = Plot("Growth of a disturbance of the straight run", "speed [m/s]", "1/s",
                (("fastest root", np.array(speeds), np.array(rates)),))  # fmt: skip
    state = "unstable" if rates[-1] > 0 else "stable"
    other = f"; {flip} makes it {'stable' if rates[-1] > 0 else 'unstable'}" if flip else ""
    return given(
        with_speed and effect > _NOTICEABLE * abs(rates[-1]),
        f"{state} on course at {p.U:.3g} m/s; depends on speed and on the hull's numbers{other}",
        "course stability does not change with " + ("the hull's numbers" if with_speed else "speed"),
        evidence, plot,
    )  # fmt: skip


def _varied(p: Probe, path: str, factor: float) -> float | None:
    """Growth of a disturbance with one parameter multiplied; None where the ship cannot have it."""
    try:
        model = update(p.ship.model, {path: factor * values(p.ship.model)[path]})
        found = growth(replace(p, ship=replace(p.ship, model=model)), p.U)
    except (ParameterError, ArithmeticError, ValueError):
        return None
    return found if math.isfinite(found) else None


def _effects(p: Probe, usual: float) -> Iterator[tuple[float, str]]:
    """Effect of each parameter of the hull; of every parameter where the model does not separate those of the hull."""
    paths = [path for path, value in values(p.ship.model).items() if value]
    own = [path for path in paths if path.partition(".")[0] in ("hull", "damping", "derivatives")]
    for path in own or paths:
        found = _varied(p, path, 1.5)
        if found is not None:
            yield abs(found - usual), path


def _flip(p: Probe, usual: float, strongest: list[str]) -> str:
    """A change of one of the strongest parameters that makes stable unstable, or unstable stable; in words."""
    for factor in (0.8, 1.25, 0.5, 2.0, 0.2, -1.0):
        for path in strongest:
            found = _varied(p, path, factor)
            if found is not None and found * usual < 0:
                return f"{path} times {factor:g}"
    return ""


def plausible(p: Probe) -> Judgement:
    """Nothing happens that physics forbids: from rest, under any orders, and with all engines stopped."""
    evidence: dict[str, tuple[float, str]] = {}
    wrong: list[str] = []
    if p.allows("u", 0.0):
        push = p.rates(0.0, 0.0, 0.0, p.controls())
        size = float(np.abs(push * (1.0, 1.0, p.ship.L_pp)).max()) * p.ship.L_pp / p.U**2
        evidence["acceleration at rest without orders"] = (size, "U^2/L")
        wrong += ["starts to move from rest without any order"] if size > 1e-9 else []
    lowest = -1.0 if p.allows("n_P", -p.n_P) and p.allows("u", -0.1 * p.U) else 0.3
    orders = [(float(n), float(d)) for n in np.linspace(lowest, 1.0, 5) for d in np.linspace(-1.0, 1.0, 5)]
    controls = [p.controls(n * p.n_P, d * p.limit) for n, d in orders]
    _, runs = p.drift([p.state(u=p.U)] * len(controls), controls, 60 * p.unit_time)
    fastest = float(np.nanmax(np.hypot(runs[:, :, 3], runs[:, :, 4]))) / p.U
    turning = float(np.nanmax(np.abs(runs[:, :, 5]))) * p.unit_time
    evidence |= {"greatest speed under any steady orders": (fastest, "U"), "greatest rate of turn": (turning, "U/L")}
    if not np.isfinite(runs[:, :, 3:]).all() or fastest > 2.0 or turning > 10.0:
        wrong.append("runs away under steady orders")
    left = _energy_left(p)
    evidence["motion left 20 L/U after the engines stop, at most"] = (left, "of the start")
    wrong += ["gains motion with the engines stopped"] if not left <= 1.0 + 1e-9 else []
    several = tuple((f"{n:+.2f} n_P, {d * p.limit / _DEGREE:+.0f} deg", run[:, 1], run[:, 0])
                    for (n, d), run in zip(orders[::4], runs[::4], strict=True))  # fmt: skip
    plot = Plot("Tracks under steady orders", "east [m]", "north [m]", several, equal=True)
    return given(not wrong, "no motion that physics forbids was found", "; ".join(wrong), evidence, plot)


def _motion(p: Probe, runs: Array) -> Array:
    """Square of the motion of each row, yaw at 0.3 L [m^2/s^2]."""
    return runs[:, :, 3] ** 2 + runs[:, :, 4] ** 2 + (0.3 * p.ship.L_pp * runs[:, :, 5]) ** 2


def _energy_left(p: Probe) -> float:
    """Greatest share of the initial motion that is left 20 L/U after everything stopped."""
    rng = np.random.default_rng(1)
    lowest = -0.5 if p.allows("u", -0.5 * p.U) else 0.5
    states = [p.state(f * p.U, g * 0.2 * p.U, h * 0.2 * p.U / p.ship.L_pp)
              for f, g, h in rng.uniform((lowest, -1, -1), (1, 1, 1), (24, 3))]  # fmt: skip
    _, runs = p.drift(states, [p.controls()] * len(states), 20 * p.unit_time)
    motion = _motion(p, runs)
    return float(np.nanmax(np.where(np.isfinite(motion[:, -1]), motion[:, -1], np.inf) / motion[:, 0]))


def rest_is_stable(p: Probe) -> Judgement:
    """Left alone, the ship comes to rest."""
    rng = np.random.default_rng(2)
    size = 0.1 * p.U
    states = [p.state(size * a, size * b, 2 * size / p.ship.L_pp * c) for a, b, c in rng.uniform(-1, 1, (32, 3))]
    t, runs = p.drift(states, [p.controls()] * len(states), 300 * p.unit_time)
    motion = np.sqrt(_motion(p, runs))
    share = motion / motion[:, :1]
    half, end = float(np.nanmax(share[:, share.shape[1] // 2])), float(np.nanmax(share[:, -1]))
    holds = bool(np.isfinite(share).all()) and end < 0.5 and end < half
    evidence = {"motion left after 150 L/U, at most": (half, "of the start"),
                "after 300 L/U": (end, "of the start")}  # fmt: skip
    lines = tuple((f"start {k + 1}", t / p.unit_time, share[k]) for k in range(0, 32, 4))
    plot = Plot("Motion left without orders", "t U/L", "over its start", lines)
    return given(
        holds, "from every start it comes to rest; resistance that goes with the square takes its time",
        "left alone it does not come to rest: the model has no resistance there, or its origin is not at rest",
        evidence, plot,
    )  # fmt: skip


def turning(p: Probe) -> Judgement:
    """The rudder turns the ship, to its own side, and more of it turns more."""
    angles = [f * p.limit for f in (0.3, 0.6, 1.0)]
    runs = {a: p.run(p.n_P, a, 25 * p.unit_time) for one in angles for a in (one, -one)}
    bends = {a: _curvature(run) * p.ship.L_pp for a, run in runs.items()}
    halves = [0.5 * (bends[a] - bends[-a]) for a in angles]
    evidence = {f"steady circle at {a / _DEGREE:.0f} deg, mean of both sides": (2.0 / h if h else math.inf, "L")
                for a, h in zip(angles, halves, strict=True)}  # fmt: skip
    evidence["difference of the sides"] = (bends[angles[-1]] + bends[-angles[-1]], "1/L")
    tracks = tuple((f"{a / _DEGREE:+.0f} deg", run["y"], run["x"]) for a, run in runs.items())
    plot = Plot("Turning", "east [m]", "north [m]", tracks, equal=True)
    to_side = halves[0] > 0
    return given(
        to_side and all(b > a for a, b in pairwise(halves)),
        "turns to the side of the rudder, the tighter the larger the angle; how much follows from the hull's numbers",
        "more rudder does not turn tighter" if to_side else "the rudder does not turn the ship to its own side",
        evidence, plot,
    )  # fmt: skip


def _curvature(run: Trial) -> float:
    """Mean curvature of the track over the last fifth of a run, positive to starboard [1/m]."""
    tail = slice(-len(run) // 5, None)
    return float(np.mean(run["r"][tail]) / max(float(np.mean(np.hypot(run["u"][tail], run["v_m"][tail]))), 1e-12))


def lateral(p: Probe) -> Judgement:
    """A turning ship drifts."""
    run, mirrored = (p.run(p.n_P, side * p.limit, 25 * p.unit_time) for side in (1.0, -1.0))
    tail = slice(-len(run) // 5, None)
    beta, other = (float(np.mean(np.arctan2(-one["v_m"][tail], one["u"][tail]))) for one in (run, mirrored))
    plot = Plot("Sway speed in a turn", "t U/L", "v_m/U", (("v_m", run.t / p.unit_time, run["v_m"] / p.U),))
    return given(
        beta > 0.5 * _DEGREE and other < -0.5 * _DEGREE, "drifts with its bow inside the turn",
        "turns without drift, or with its bow outside the turn",
        {"drift angle to starboard": (beta / _DEGREE, "deg"), "to port": (other / _DEGREE, "deg")}, plot,
    )  # fmt: skip


def speed_by_revolutions(p: Probe) -> Judgement:
    """More revolutions, more speed."""
    if not p.propulsion:
        return Judgement("not applicable", "the ship has no propeller order n_P: " + ", ".join(p.ship.model.controls))
    shares = (0.5, 0.75, 1.0)
    t, runs = p.drift([p.state(u=p.U)] * 3, [p.controls(s * (p.n_P or 1.0)) for s in shares], 150 * p.unit_time)
    final = [float(u) for u in runs[:, -1, 3]]
    evidence = {f"speed at {s:g} of the revolutions": (u, "m/s") for s, u in zip(shares, final, strict=True)}
    lines = tuple((f"{s:g} n_P", t / p.unit_time, runs[k, :, 3]) for k, s in enumerate(shares))
    return given(
        all(b - a > _NOTICEABLE * p.U for a, b in pairwise(final)),
        "speed follows the revolutions", "speed does not follow the revolutions: no propeller and no resistance in it",
        evidence, Plot("Speed after a change of revolutions", "t U/L", "u [m/s]", lines),
    )  # fmt: skip


def answer_varies(p: Probe) -> Judgement:
    """The answer to the rudder depends on speed and on revolutions."""
    delta, span = 0.3 * p.limit, 2 * p.unit_time
    cases = {"usual": (p.U, p.n_P), "half the speed": (0.5 * p.U, p.n_P),
             "1.3 times the revolutions": (p.U, 1.3 * p.n_P)}  # fmt: skip
    states = [p.state(u=u) for u, _ in cases.values()]
    t, runs = p.drift(states, [p.controls(n, delta) for _, n in cases.values()], span)
    _, straight = p.drift(states, [p.controls(n) for _, n in cases.values()], span)
    gained = unwrapped(runs[:, -1, 2]) - straight[:, -1, 2]
    evidence = {f"heading after 2 L/U, {name}": (float(g) / _DEGREE, "deg")
                for name, g in zip(cases, gained, strict=True)}  # fmt: skip
    differs = [abs(g - gained[0]) > _NOTICEABLE * abs(gained[0]) for g in gained[1:]]
    lines = tuple((name, t / p.unit_time, runs[k, :, 2] / _DEGREE) for k, name in enumerate(cases))
    missing = " and ".join(n for n, d in zip(("speed", "revolutions"), differs, strict=True) if not d)
    return given(
        all(differs), "the answer to the rudder changes with speed and with revolutions",
        f"the answer to the rudder does not change with {missing}", evidence,
        Plot("Heading after a rudder order", "t U/L", "psi [deg]", lines),
    )  # fmt: skip


def wind(p: Probe) -> Judgement:
    """Wind from the beam carries the ship to leeward, or turns it."""
    return _carried(p, (("wind", Environment(wind_y=3.0 * p.U)),))


def wind_and_waves(p: Probe) -> Judgement:
    """Wind and waves from the beam carry the ship to leeward, or turn it."""
    waves = Environment(wave_y=0.02 * p.ship.L_pp, wave_T=math.sqrt(0.5 * p.ship.L_pp * 2 * math.pi / 9.81))
    return _carried(p, (("wind", Environment(wind_y=3.0 * p.U)), ("waves", waves)))


def _carried(p: Probe, cases: tuple[tuple[str, Environment], ...]) -> Judgement:
    """Both come from the east of a ship that heads north: to leeward is west."""
    moving = not p.allows("u", 0.0)
    start, control = p.state(u=p.U if moving else 0.0), p.controls(p.n_P if moving else 0.0)
    _, (calm,) = p.drift([start], [control], 20 * p.unit_time)
    evidence: dict[str, tuple[float, str]] = {"speed when it begins": (p.U if moving else 0.0, "m/s")}
    lines = [("calm", calm[:, 1], calm[:, 0])]
    without: list[str] = []
    for name, around in cases:
        _, (run,) = p.drift([start], [control], 20 * p.unit_time, around)
        away = float(calm[-1, 1] - run[-1, 1]) / p.ship.L_pp
        turned = math.degrees(float(run[-1, 2] - calm[-1, 2]))
        size = math.hypot(around.wind_y, around.wave_y)
        evidence[f"{name} from the beam"] = (size, "m/s" if around.wind_y else "m significant height")
        evidence |= {f"{name}: way to leeward in 20 L/U": (away, "L"), f"{name}: turned": (turned, "deg")}
        lines.append((name, run[:, 1], run[:, 0]))
        u = start[3]
        push = float((p.rates(u, 0.0, 0.0, control, around) - p.rates(u, 0.0, 0.0, control))[1])
        evidence[f"{name}: first push to leeward"] = (-push * p.ship.L_pp / p.U**2, "U^2/L")
        if not (push < 0 and (away > 1e-3 or abs(turned) > 0.1)) or not np.isfinite(run).all():
            without.append(name)
    return given(
        not without, "carried to leeward or turned by " + " and by ".join(name for name, _ in cases),
        f"{' and '.join(without)}: not carried to leeward; no [{'], ['.join(without)}] force in the ship's file, or a "
        "wrong one",
        evidence,
        Plot("Twenty L/U with wind and waves from the east", "east [m]", "north [m]", tuple(lines), equal=True),
    )  # fmt: skip

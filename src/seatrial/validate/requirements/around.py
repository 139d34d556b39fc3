"""Checks of what surrounds the ship: wind and waves carry it off."""

from __future__ import annotations

import math

import numpy as np

from ...environment import Environment
from . import Judgement, Plot, given
from .probe import Probe


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

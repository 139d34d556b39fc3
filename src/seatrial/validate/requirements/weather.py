"""Checks of wind and waves: from all directions, at two strengths, at rest and under way; gusts by their seed."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ...data import Array
from ...environment import Environment, Uniform
from . import Finding, Judgement, Plot, judged, ranged, typical, worst
from . import thresholds as limit
from .body import shares
from .probe import Probe

_ANGLES = np.radians(np.arange(-175.0, 181.0, 5.0))
_WIND, _HEIGHT = 3.0, 0.02
"""Wind over the approach speed, significant height of waves over the length."""


def wind(p: Probe) -> Judgement:
    """Wind drives the ship to leeward and turns it, from every direction."""
    return _judged(p, ("wind",))


def wind_and_waves(p: Probe) -> Judgement:
    """Wind and waves drive the ship to leeward, from every direction; wind turns it too."""
    return _judged(p, ("wind", "waves"))


def _judged(p: Probe, kinds: Sequence[str]) -> Judgement:
    found: list[Finding] = []
    plots: list[Plot] = []
    for kind in kinds:
        force = _forces(p, kind, 1.0)
        if not force.any():
            wrong = f"not carried to leeward by {kind}: no [{kind}] force in the ship's file"
            found.append(Finding(f"greatest force of {kind} from the beam", 0.0, "U^2/L", limit.SOME, wrong))
            continue
        found += _from_all_sides(kind, force, _forces(p, kind, 2.0))
        found += [*_headings(p, kind), *(_sized(p, kind, force) if p.rests else ())]
        if kind == "wind":
            found += [*_turned(force), *_under_way(p), *_adrift(p), *_gusts(p), *typical.areas(p)]
        lines = tuple((name, np.degrees(_ANGLES), force[:, k]) for k, name in enumerate(("surge", "sway", "yaw / L")))
        plots.append(
            Plot(f"Force of {kind} on the ship at rest", "from, relative to the bow [deg]", "over m U^2/L", lines)
        )
    good = " and ".join(kinds) + (" carries" if len(kinds) == 1 else " carry")
    return judged(f"{good} the ship to leeward from every direction; wind turns it", found, *plots)


def _around(p: Probe, kind: str, angles: Array, strength: float) -> Array:
    """Rows of the environment, wind or waves from `angles` [rad] of true direction."""
    rows = np.zeros((len(angles), len(Environment._fields)))
    if kind == "wind":
        rows[:, 0], rows[:, 1] = (strength * _WIND * p.U * f(angles) for f in (np.cos, np.sin))
    else:
        rows[:, 4], rows[:, 5] = (strength * _HEIGHT * p.ship.L_pp * f(angles) for f in (np.cos, np.sin))
        rows[:, 6] = math.sqrt(0.5 * p.ship.L_pp * 2 * math.pi / 9.81)  # waves of half a length
    return rows


def _speed(p: Probe) -> tuple[float, tuple[float, ...]]:
    """Speed at which a ship is tried: at rest where its file claims that, else at the approach."""
    return (0.0, p.controls()) if p.rests else (p.U, p.controls(p.n_P))


def _forces(p: Probe, kind: str, strength: float) -> Array:
    """Surge, sway and yaw (over L) by wind or waves from all angles, over m U^2/L, shape (angles, 3)."""
    u, control = _speed(p)
    change = p.at([(u, 0.0, 0.0)], control, _around(p, kind, _ANGLES, strength)) - p.at([(u, 0.0, 0.0)], control)
    L = p.ship.L_pp
    return (change * [1.0, 1.0, L]) @ shares(p).T * L / p.U**2


def _sized(p: Probe, kind: str, force: Array) -> Iterator[Finding]:
    """Forces over dynamic pressure and area, of waves over what a wall of the ship's length reflects."""
    m, L = float(p.ship.model.displaced), p.ship.L_pp
    X, Y, N = force.T * m * p.U**2 / L
    if not m > 0.0:
        return
    if kind == "waves":
        highest = float(np.abs(Y).max()) / (1025.0 * 9.81 * L * (_HEIGHT * L) ** 2 / 16.0)
        wrong = "the force of waves is that of no ship of this length: height, amplitude or density in another unit"
        yield from ranged("waves: beam force over rho g L H_S^2/16", highest, "-", limit.WAVE_DRIFT, wrong)
        return
    part: Any = p.ship.model.part("wind")
    A_T, A_L = (float(getattr(part, name, 0.0)) for name in ("A_T", "A_L"))
    pressure = 0.5 * 1.225 * (_WIND * p.U) ** 2
    ahead, beam = (int(np.argmin(np.abs(_ANGLES - math.radians(a)))) for a in (0.0, 90.0))
    for name, size, area, known in (("across", abs(Y[beam]), A_L, limit.WIND_ACROSS),
                                    ("along", abs(X[ahead]), A_T, limit.WIND_ALONG)):  # fmt: skip
        if area:
            wrong = f"the wind force {name} is that of no ship of this area: speed or coefficient in another unit"
            yield from ranged(
                f"wind: force {name} over pressure and area", float(size / (pressure * area)), "-", known, wrong
            )
    if Y[beam]:
        lever = float(N[beam] / Y[beam])
        wrong = "the wind force acts far from midship: the centre of the lateral area (s_L) or the yaw moment is wrong"
        yield from ranged("wind: lever of a beam wind", lever, "L", limit.PRESSURE_PLACE, wrong)


def _named(angles: Array) -> list[str]:
    return [f"from {math.degrees(a):+.0f} deg" for a in angles]


def _from_all_sides(kind: str, force: Array, twice: Array) -> Iterator[Finding]:
    """Leeward in sway and surge, the square of the strength, the two sides alike, no jumps."""
    X, Y, _ = force.T
    beam, ends = np.abs(np.sin(_ANGLES)) >= 0.49, np.abs(np.cos(_ANGLES)) >= 0.9
    for name, part, way, where in (("sway", Y, -np.sin(_ANGLES), beam), ("surge", X, -np.cos(_ANGLES), ends)):
        size = float(np.abs(part).max()) or 1.0
        points = [(at, float(f / size)) for at, f in zip(_named(_ANGLES[where]), (part * way)[where], strict=True)]
        wrong = f"{kind} pushes the ship to windward, or not at all, in {name}, {{at}}"
        bound = limit.LEEWARD if kind == "wind" else limit.WAVE_LEEWARD
        yield worst(f"{kind}: {name} to leeward", points, bound, wrong, "of the greatest")
    along = float(np.abs(X).max() / (np.abs(Y).max() or math.nan))
    yield Finding(f"{kind}: greatest surge over greatest sway", along, "-", limit.HEAD_WIND,
                  f"{kind} does not act along the ship")  # fmt: skip
    seen = np.linalg.norm(force, axis=1) > 0.05 * np.linalg.norm(force, axis=1).max()
    ratio = np.linalg.norm(twice, axis=1)[seen] / np.linalg.norm(force, axis=1)[seen]
    bound, of = (limit.WIND_SQUARE, "wind speed") if kind == "wind" else (limit.WAVE_SQUARE, "wave height")
    wrong = f"the force of {kind} does not go with the square of {of}, {{at}}"
    points = list(zip(_named(_ANGLES[seen]), ratio.tolist(), strict=True))
    yield worst(f"{kind}: force at twice the {of}", points, bound, wrong)
    size = np.maximum(np.abs(force).max(axis=0), 0.02 * np.abs(force[:, :2]).max())
    inner = _ANGLES[:-1]  # 180 deg has no mirror image
    apart = np.abs(force[:-1] - force[:-1][::-1] * [1.0, -1.0, -1.0]) / size
    points = list(zip(_named(inner), apart.max(axis=1).tolist(), strict=True))
    wrong = f"{kind} from port is no mirror image of {kind} from starboard, {{at}}"
    yield worst(f"{kind}: difference of the sides", points, limit.WIND_MIRROR, wrong, "of the greatest")
    jump = np.abs(np.diff(np.vstack([force, force[:1]]), axis=0)) / size
    points = list(zip(_named(_ANGLES), jump.max(axis=1).tolist(), strict=True))
    wrong = f"the force of {kind} jumps with its direction, {{at}}"
    yield worst(f"{kind}: change over 5 deg", points, limit.WIND_JUMP, wrong, "of the greatest")


def _turned(force: Array) -> Iterator[Finding]:
    """The centre of pressure: off midship, within the hull, and aft as the wind goes aft."""
    _, Y, N = force.T
    beam = np.abs(np.sin(_ANGLES)) >= 0.49
    lever = N[beam] / np.where(Y[beam], Y[beam], np.nan)
    greatest = float(np.nanmax(np.abs(lever))) if np.isfinite(lever).any() else math.nan
    yield Finding("wind: greatest lever of the side force", greatest, "L", limit.WIND_LEVER,
                  "wind has no yaw moment" if not N.any() else "no plausible yaw moment of the wind")  # fmt: skip
    points: list[tuple[str, float]] = []
    for side, name in ((1.0, "starboard"), (-1.0, "port")):
        bow, quarter = (int(np.argmin(np.abs(_ANGLES - side * math.radians(a)))) for a in (45.0, 135.0))
        points.append((name, float(N[bow] / (Y[bow] or math.nan) - N[quarter] / (Y[quarter] or math.nan))))
    wrong = "the yaw moment of the wind is reversed: its centre of pressure goes ahead as the wind goes aft, {at}"
    yield worst(
        "wind: travel of the centre of pressure from bow to quarter wind", points, limit.LEVER_TRAVELS, wrong, "L"
    )


def _under_way(p: Probe) -> Iterator[Finding]:
    """Under way, at every speed: beam wind to leeward; head wind felt more than tail wind of the same speed."""
    angles = np.radians([90.0, -90.0, 60.0, -60.0, 120.0, -120.0, 0.0, 180.0])
    points: list[tuple[str, float]] = []
    ends: list[tuple[str, float]] = []
    for f in (*p.astern, *p.ahead):
        motion, control = [(f * p.U, 0.0, 0.0)], p.controls(max(f, 0.0) * p.n_P)
        change = p.at(motion, control, _around(p, "wind", angles, 1.0)) - p.at(motion, control)
        size = float(np.abs(change[:, 1]).max()) or 1.0
        points += [(f"{f:g} U, {at}", float(x / size)) for at, x in
                   zip(_named(angles[:6]), -change[:6, 1] * np.sign(angles[:6]), strict=True)]  # fmt: skip
        ends += [(f"{f:g} U, {at}", float(x * s) * p.ship.L_pp / p.U**2)
                 for at, x, s in zip(_named(angles[6:]), change[6:, 0], (-1.0, 1.0), strict=True)]  # fmt: skip
        if f == 1.0:
            felt = abs(float(change[6, 0])) / (abs(float(change[7, 0])) or math.nan)
            wrong = "the wind force does not follow the apparent wind: the ship's own speed is not in it"
            yield Finding("wind: head wind over tail wind, at U", felt, "-", limit.APPARENT, wrong)
    wrong = "under way wind pushes the ship to windward, {at}"
    yield worst("wind: sway to leeward under way", points, limit.LEEWARD, wrong, "of the greatest")
    wrong = "under way head wind does not slow the ship, or tail wind does, {at}"
    yield worst("wind: surge to leeward under way", ends, limit.LEEWARD_SURGE, wrong, "U^2/L")


def _headings(p: Probe, kind: str) -> Iterator[Finding]:
    """Wind and waves are seen from the ship: turned with it, they have the same force."""
    u, control = _speed(p)
    angles = np.radians([30.0, 100.0, 200.0, 300.0])
    usual = p.at([(u, 0.0, 0.0)], control, _around(p, kind, angles, 1.0))
    size = float(np.abs(usual).max()) or 1.0
    points: list[tuple[str, float]] = []
    for psi in (0.7, math.pi / 2, 2.6, 4.0, 5.5):
        turned = p.at([(u, 0.0, 0.0)], control, _around(p, kind, angles + psi, 1.0), psi)
        points.append((f"heading {math.degrees(psi):.0f} deg", float(np.abs(turned - usual).max()) / size))
    wrong = f"the force of {kind} does not turn with the ship: it is fixed to the earth, {{at}}"
    yield worst(
        f"{kind}: force at other headings, from the same side", points, limit.SEEN_FROM_SHIP, wrong, "of the greatest"
    )


def _adrift(p: Probe) -> Iterator[Finding]:
    """Adrift in a beam wind the ship goes to leeward, at a small part of the wind speed."""
    if not p.rests:
        return
    points: list[tuple[str, float]] = []
    for y, name in ((1.0, "east"), (-1.0, "west")):
        around = Environment(wind_y=y * _WIND * p.U)
        t, (run,) = p.drift([p.state()], [p.controls()], 40 * p.unit_time, around)
        third = len(t) // 3
        made = -y * float(run[-1, 1] - run[-third, 1]) / float(t[-1] - t[-third])
        points.append((f"from {name}", made / (_WIND * p.U)))
    wrong = "adrift in a beam wind the ship is not carried to leeward at a plausible speed, wind {at}"
    yield worst("wind: leeway adrift", points, limit.LEEWAY, wrong, "of the wind speed")


def _gusts(p: Probe) -> Iterator[Finding]:
    """Gusts are a function of their seed."""
    base, dt, rows = Uniform(_WIND * p.U, 1.0), max(p.step, 0.1), 300
    first, again, other = (p.gusts(base, seed).series(dt, rows)[:, :2] for seed in (1, 1, 2))
    size = _WIND * p.U
    yield Finding("gusts: two winds of one seed, apart", float(np.abs(first - again).max()) / size, "of the wind",
                  limit.SEED, "gusts are not seeded: one seed gives two winds")  # fmt: skip
    yield Finding("gusts: winds of two seeds, apart", float(np.abs(first - other).max()) / size, "of the wind",
                  limit.GUSTING, "gusts do not change with their seed")  # fmt: skip

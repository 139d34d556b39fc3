"""Figures of a run in a harbour: how the ship touched, what the fenders took, and the water left under the keel.

Contact speed is held against 4 cm/s, the mean of 555 berthings of large tankers, and 8 cm/s, their limit (Koike 2023,
second hand: the source was not found).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..core.parameters import Scalars
from ..data import Array, Trial
from ..engine.trace import over_rows
from ..environment.chart import Chart, sides
from ..environment.grid import SMOOTH
from ..forces.squat import FORMS, OPEN, Hull
from ..harbour.energy import Berthed
from ..manoeuvres import Index
from ..models import STATES
from ..ships import Ship
from .place import Place

MEAN, LIMIT = 0.04, 0.08
"""Contact speeds of berthings: the usual one and the largest that is accepted [m/s]."""


def contact_indices(trial: Trial, ship: Ship, place: Place) -> dict[str, Index]:
    """Figures of the contacts of a run; empty where the ship touched no fender.

    `contact_speed` [m/s] towards the fender and `contact_angle` [rad] to the face at the first touch, `contact_energy`
    [J] stored at most, `fender_reaction` [N] and `fender_deflection` [-] of the fender that takes most, `contacts`,
    how often the ship came to touch, `berthing_energy` [J] by design practice for that touch, `speed_limit` [-] the
    contact speed over 8 cm/s.
    """
    if place.contact is None or place.grid is None or not place.contact.stops:
        return {}
    found = _touches(trial, place)
    delta, reaction, energy, closing, a = (found[:, k::5] for k in range(5))
    delta = np.where(reaction > 0.0, delta, 0.0)  # a cell with fewer fenders has empty places
    touching = (delta > 0.0).any(axis=1)
    if not touching.any():
        return {}
    first = int(np.argmax(touching))
    fender = int(np.argmax(delta[first]))
    speed = float(closing[max(first - 1, 0), fender])
    pose = [float(trial[name][first]) for name in STATES[:3]]
    angle = _angle(place.chart, *pose) if place.chart else math.nan
    taken, most = energy.sum(axis=1), np.unravel_index(int(np.argmax(reaction)), reaction.shape)
    heights = _heights(place, trial)
    out = {
        "contact_speed": Index(speed, "m/s"), "contact_angle": Index(angle, "rad"),
        "contact_energy": Index(float(taken.max()), "J"), "fender_reaction": Index(float(reaction[most]), "N"),
        "fender_deflection": Index(float(delta[most] / heights[most]), "-"),
        "contacts": Index(float((np.diff(touching.astype(int), prepend=0) > 0).sum()), "-"),
        "speed_limit": Index(abs(speed) / LIMIT, "-"),
    }  # fmt: skip
    hull = _hull(ship)
    if hull is not None:
        keel = float(place.chart.depth_at(*(np.array([x]) for x in pose[:2]))[0]) - hull.d if place.chart else math.inf
        aft = min(max(0.5 - float(a[first, fender]) / hull.L, 0.0), 1.0)
        design = Berthed(float(ship.model.displaced), hull.L, hull.B, hull.d, hull.C_b, aft, abs(angle), speed, keel)
        out["berthing_energy"] = Index(design.energy(), "J")
    return out


def keel_indices(trial: Trial, ship: Ship, form: str = "barrass2004") -> dict[str, Index]:
    """`under_keel` [m], the least clearance of a run with its squat, and `squat` [m] there; `aground` where below zero.

    Empty in deep water, or where the ship's dimensions are unknown.
    """
    hull = _hull(ship)
    if "depth" not in trial or hull is None:
        return {}
    depth = trial["depth"]
    S = _squat(trial["u"], depth, hull, form)
    clearance = depth - hull.d - S
    at = int(np.nanargmin(clearance))
    out = {"under_keel": Index(float(clearance[at]), "m"), "squat": Index(float(S[at]), "m")}
    if clearance[at] <= 0.0:
        out["aground"] = Index(float(trial.t[np.flatnonzero(clearance <= 0.0)[0]] - trial.t[0]), "s")
    return out


def shallows(trial: Trial, ship: Ship, margin: float, form: str = "barrass2004") -> Mapping[float, float]:
    """The alarm: clearance under the keel [m] by time [s], where it is below a margin [m]."""
    hull = _hull(ship)
    if "depth" not in trial or hull is None:
        return {}
    clearance = trial["depth"] - hull.d - _squat(trial["u"], trial["depth"], hull, form)
    return {float(trial.t[k]): float(clearance[k]) for k in np.flatnonzero(clearance < margin)}


def _squat(u: Array, depth: Array, hull: Hull, form: str) -> Array:
    known = np.where(np.isfinite(depth), depth, 1e6)
    return over_rows(lambda row: (FORMS[form](row[0], row[1], hull, OPEN),), np.column_stack([u, known]))[:, 0]


def _hull(ship: Ship) -> Hull | None:
    L, B, d, m = ship.L_pp, *(float(x) for x in (ship.model.breadth, ship.model.draught, ship.model.displaced))
    body = ship.model.part("body")
    rho = float(vars(body)["rho"]) if body is not None and "rho" in vars(body) else 1025.0
    return Hull(L, B, d, m / (rho * L * B * d)) if B and d and m else None


def _near(trial: Trial, place: Place) -> Array:
    grid = place.grid
    return grid.field.look(trial["x"], trial["y"])[0][:, len(SMOOTH) :] if grid else np.zeros((len(trial), 0))


def _heights(place: Place, trial: Trial) -> Array:
    count = place.grid.stops if place.grid else 0
    return np.maximum(_near(trial, place)[:, : count * 6].reshape(len(trial), count, 6)[:, :, 2], 1e-3)


def _touches(trial: Trial, place: Place) -> Array:
    """Compression, reaction, energy, closing speed and place along the hull of each stop, shape (rows, 5 stops)."""
    contact = place.contact
    states = np.column_stack([trial[name] for name in STATES])

    def figures(row: Scalars) -> Scalars:
        state, near = row[:6], row[6:]
        out: list[object] = []
        for touch in list(contact.touches(state, near))[: contact.stops] if contact else []:
            closing = -(touch.n_a * (state[3] - state[5] * touch.b) + touch.n_b * (state[4] + state[5] * touch.a))
            out += [touch.delta, touch.R, touch.E, closing, touch.a]
        return tuple(out)

    return over_rows(figures, np.hstack([states, _near(trial, place)]))


def _angle(chart: Chart, x: float, y: float, psi: float) -> float:
    """Angle between the ship and the nearest face of a quay, 0 to half a turn's half [rad]."""
    best, angle = math.inf, math.nan
    for quay in chart.quays:
        for p, t, length in zip(*sides(quay.line), strict=True):
            along = min(max((x - p[0]) * t[0] + (y - p[1]) * t[1], 0.0), float(length))
            off = math.hypot(x - p[0] - along * t[0], y - p[1] - along * t[1])
            if off < best:
                best, turn = off, math.remainder(psi - math.atan2(t[1], t[0]), math.pi)
                angle = abs(turn)
    return angle

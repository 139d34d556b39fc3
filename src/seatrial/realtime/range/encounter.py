"""A meeting of ships as a scenario: the own ship under way, others that behave, and the rules as criteria."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...core.errors import RequestError
from ...data.geodesy import Datum
from ...encounters.meeting import Meeting, seen_from
from ...encounters.sensing import Sensing
from ...environment import CALM, Environment
from ...ships import Ship
from .scenario import Criteria, Other, Own, Sailing, Scenario, Weather, ordinary

LONG = 2.2
"""A run lasts so many times the latest meeting."""
FAR = 5e5
"""Ships so far off are nobody's traffic [m]."""
_RATE = 2.0
"""Ticks a second, as often as a stack looks in `encounters.sailing` [Hz]."""
_PLACE = Datum(30.0, -40.0)
"""Where x and y are zero: open ocean, as positions on the wire are of the earth."""


def encountered(
    ship: Ship, meeting: Meeting, conducts: Sequence[str], *, length: float | None = None, seed: int = 1,
    around: Environment = CALM, sensing: Sensing | None = None, title: str = "An encounter",
    start: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Scenario:  # fmt: skip
    """The scenario of one meeting.

    Args:
        meeting: of one run, arrays of shape (targets,).
        conducts: of each other ship.
        length: of the others [m]; that of the own ship unless given.
        around: wind, current and waves from start to end.
        sensing: radar and AIS of the own ship; None: without error, delay or loss.
        start: place of the own ship north and east [m] and its course [rad].

    Raises:
        RequestError: a ship without way, which no rudder steers.
    """
    far = np.hypot(np.ravel(meeting.x), np.ravel(meeting.y)) >= FAR
    x, y, psi = (one[0] for one in seen_from(meeting, *np.array(start)[:, None]))
    U = np.ravel(meeting.U_target)
    L = length or ship.L_pp
    others: list[Other] = []
    for k in np.flatnonzero(~far).tolist():
        if not U[k] > 0.0:
            raise RequestError(f"target {k + 1} of {title} has a speed of {U[k]:g} m/s; a ship under way is met here")
        name = f"target {k + 1}"
        sailing = Sailing(float(x[k]), float(y[k]), float(psi[k]), float(U[k]))
        others.append(Other(name, ordinary(name, L, float(U[k])), sailing, conduct=conducts[k]))
    t = meeting.approach[1]
    latest = float(np.max(np.where(np.isfinite(t), t, 0.0), initial=0.0))
    if not latest > 0.0:
        raise RequestError(f"{title}: nobody is met; the ships draw apart from the first")
    own = Own(ship, Sailing(*start, float(np.ravel(meeting.U)[0])))
    return Scenario(title, LONG * latest, own, tuple(others), _RATE, seed, _PLACE,
                    weather=(Weather(0.0, 0.0, around),), criteria=Criteria(rules=True), sensing=sensing)  # fmt: skip

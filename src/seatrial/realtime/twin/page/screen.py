"""What the page of a twin shows: one picture of the present, without network; the twin writes, the page reads."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ....data import Array
from ....models import STATES
from ..ahead import LEVEL, forecast
from ..card import alarm, parameters, unseen
from ..follow import Follower
from ..live import Live

STATIC = Path(__file__).with_name("static")
"""The page's own files; nothing is fetched from elsewhere."""

# Time between two pictures by the clock, and between two forecasts [s].
_PERIOD, _AGAIN = 0.25, 2.0
# Points of a track, and of a strip of innovations.
_TRACK, _STRIP = 400, 240
_HOURS = 24


class Screen:
    """The pictures of a twin.

    Attributes:
        picture: the latest; empty before the first.
        over: whether the log has ended.
        looked: whether a browser is connected; without one no picture is made.
    """

    def __init__(self, live: Live, log: str) -> None:
        self.live, self.log = live, log
        self.picture: dict[str, Any] = {}
        self.over = self.looked = False
        self._last = self._made = -math.inf
        self._measured: deque[list[float]] = deque(maxlen=_TRACK)
        self._estimated: deque[list[float]] = deque(maxlen=_TRACK)
        self._misses: dict[str, deque[list[float]]] = {c: deque(maxlen=_STRIP) for c in live.machine.channels}
        ship, self._noted = live.machine.ship, -math.inf
        self._every = max(1.0, 0.1 * ship.L_pp / max(ship.speed, 1e-3))
        self._ahead: list[list[float]] = []

    def heard(self, t: float, values: Mapping[str, float]) -> None:
        """Note a row that the twin has taken in."""
        live = self.live
        if live.follower is None or live.last is None or live.last.t != t:
            return
        step = live.last
        if t - self._noted >= self._every:
            self._noted = t
            x, y = values.get("x", math.nan), values.get("y", math.nan)
            if math.isfinite(x + y):
                self._measured.append([round(x, 3), round(y, 3)])
            self._estimated.append([round(float(v), 3) for v in live.follower.mean[:2]])
            sizes = step.innovation / np.sqrt(np.diagonal(step.spread)) if step.rows.size else np.zeros(0)
            for k, size in zip(step.rows.tolist(), sizes.tolist(), strict=True):
                self._misses[live.machine.channels[k]].append([round(t, 1), round(max(min(size, 99.0), -99.0), 2)])
        self.look()

    def look(self, force: bool = False) -> None:
        """Make a new picture, if it is time."""
        now = time.monotonic()
        if not force and (not self.looked or now - self._last < _PERIOD):
            return
        self._last = now
        if self.live.follower is not None:
            self.picture = self._picture(self.live.follower, now, force)

    def pictures(self) -> Callable[[bool], dict[str, Any] | None]:
        """For one browser, as `pages.Source` says: the latest picture, once."""
        last: dict[str, Any] | None = None

        def following(closing: bool) -> dict[str, Any] | None:
            nonlocal last
            picture = self.picture
            if not picture or (picture is last and not closing):
                return None
            last = picture
            return {**picture, "over": picture["over"] or closing}

        return following

    def _picture(self, follower: Follower, now: float, force: bool) -> dict[str, Any]:
        live = self.live
        ship = live.machine.ship
        if force or now - self._made > _AGAIN:
            self._made = now
            self._ahead = _points(forecast(follower, live.acting, scores=live.trust.scores))
        sd = np.sqrt(np.maximum(np.diagonal(follower.cov), 0.0))
        settings = live.machine.settings
        return {
            "ship": ship.name, "log": self.log, "t": round(follower.t, 1), "over": self.over,
            "L": ship.L_pp, "B": float(ship.model.breadth or 0.15 * ship.L_pp), "level": LEVEL,
            "estimator": settings.estimator,
            "state": {name: [_round(follower.mean[k]), _round(sd[k])] for k, name in enumerate(STATES)},
            "controls": {name: _round(live.acting[k]) for k, name in enumerate(ship.model.controls)},
            "measured": list(self._measured), "estimated": list(self._estimated), "ahead": self._ahead,
            "unseen": [_rounded(one) for one in unseen(live)],
            "parameters": [_rounded(one) for one in parameters(live)],
            "alarms": [alarm(one) for one in live.alarms[-20:]], "masked": list(live.masked),
            "misses": {name: list(some) for name, some in self._misses.items() if some},
            "hours": [[one.start / 3600.0, _round(one.mean), *map(_round, one.band())]
                      for one in live.tally.hours[-_HOURS:] if one.readings],
            "trust": [[h, s.count, *(_none(v) for v in (s.rms, s.rival, s.held))]
                      for h, s in live.trust.scores.items()],
            "rows": vars(live.counts),
        }  # fmt: skip


def _points(ahead: Any) -> list[list[float]]:
    """Seconds from now, north, east, and the half width of the band across and along the course [m]."""
    out: list[list[float]] = []
    half: Array = ahead.half
    for k in range(len(ahead.t)):
        course = ahead.mean[k, 2] + math.atan2(ahead.mean[k, 4], ahead.mean[k, 3])
        c, s = math.cos(course), math.sin(course)
        across, along = np.array([-s, c]), np.array([c, s])
        cov, share = ahead.cov[k, :2, :2], half[k, 0] / max(math.sqrt(ahead.cov[k, 0, 0]), 1e-12)
        out.append([_round(v) for v in (
            ahead.t[k] - ahead.t[0], *ahead.mean[k, :2], share * math.sqrt(max(across @ cov @ across, 0.0)),
            share * math.sqrt(max(along @ cov @ along, 0.0)), ahead.mean[k, 2], half[k, 2])])  # fmt: skip
    return out


def _round(value: float) -> float:
    return float(f"{float(value):.6g}")


def _none(value: float) -> float | None:
    return _round(value) if math.isfinite(value) else None


def _rounded(one: Mapping[str, Any]) -> dict[str, Any]:
    return {name: _round(value) if isinstance(value, float) else value for name, value in one.items()}

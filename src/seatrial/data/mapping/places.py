"""What instruments give, brought to midship and to the axes of a trial: positions, speeds, the true wind."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .. import Array, unwrapped
from ..geodesy import Datum
from ..prepare import integral, to_body, true_wind
from ..sidecar import UNPLACED
from .schema import Apparent, Ground, Log, Mapping, Offset, Position

_WALKED, _OFF, _NEAR = 50.0, 0.7, 0.4
"""Shortest path that shows exchanged columns [m]; how far off it must be, and how much nearer the exchanged one."""
_TURNS = 2.5
"""Median steps of a heading over which a line is drawn."""


class Midship:
    """The channels of a trial on its way to midship, on common rows.

    Attributes:
        t: times of the rows [s].
        channels: as `measured` has them, x and y in place of latitude and longitude; then those of the trial.
        steps: what was done, in words.
        derived: channels that were made from others, and what of.
    """

    def __init__(self, t: Array, channels: dict[str, Array]) -> None:
        self.t, self.channels, self.steps, self.derived = t, channels, list[str](), dict[str, str]()

    def bring(self, mapping: Mapping) -> None:
        """Turn and move all channels of a mapping."""
        if "psi" in self.channels:
            self.channels["psi"] = unwrapped(self.channels["psi"])
            self.steps.append("psi made continuous")
        if mapping.frame.velocity == "earth":
            found = to_body(self.channels["u"], self.channels["v_m"], self.channels["psi"])
            self.channels["u"], self.channels["v_m"] = found
            self.steps.append("u, v_m turned from earth axes into body axes by psi")
        if mapping.position is not None:
            self._position(mapping.position)
        if mapping.ground is not None:
            self._ground(mapping.ground)
        if mapping.log is not None:
            self._through_water(mapping.log)
        if mapping.apparent is not None:
            self._wind(mapping.apparent)

    def _rate(self) -> Array:
        """Rate of turn [rad/s], measured or by differences of the heading."""
        if "r" not in self.channels:
            self.channels["r"] = np.gradient(self.channels["psi"], self.t)
            self.steps.append("r by central differences of psi")
            self.derived["r"] = "psi"
        return self.channels["r"]

    def _position(self, position: Position) -> None:
        if not any(position.antenna):
            self.steps += [UNPLACED] if not position.antenna else []
            return
        forward, starboard = position.antenna
        c, s = np.cos(self.channels["psi"]), np.sin(self.channels["psi"])
        self.channels["x"] = self.channels["x"] - (c * forward - s * starboard)
        self.channels["y"] = self.channels["y"] - (s * forward + c * starboard)
        self.steps.append(f"x, y from the antenna to midship: {_words(position.antenna)}")

    def _ground(self, ground: Ground) -> None:
        north, east = self.channels.pop("north"), self.channels.pop("east")
        if {"u", "v_m"} <= set(self.channels):
            return
        u, v = to_body(north, east, self._heading(np.isfinite(north + east)))
        if any(ground.antenna):
            forward, starboard = ground.antenna
            u, v = u + starboard * self._rate(), v - forward * self._rate()
        for name, values in (("u", u), ("v_m", v)):
            self.channels.setdefault(name, values)
        where = f" and moved to midship: {_words(ground.antenna)}" if any(ground.antenna) else ""
        self.steps.append(f"u, v_m from the speed over ground, turned by psi{where}")

    def _heading(self, rows: NDArray[np.bool_]) -> Array:
        """The heading; on lines between its readings where none of some rows holds one, as instruments took turns."""
        psi = self.channels["psi"]
        known = np.flatnonzero(np.isfinite(psi))
        if known.size < 2 or np.isfinite(psi[rows]).any():
            return psi
        own = self.t[known]
        after = np.clip(np.searchsorted(own, self.t), 1, own.size - 1)
        near = (own[after] - self.t) * (self.t - own[after - 1]) >= 0.0
        near &= own[after] - own[after - 1] <= _TURNS * float(np.median(np.diff(own)))
        self.steps.append("heading on lines between its readings, as no row holds it and the speed over ground")
        return np.where(near, np.interp(self.t, own, psi[known]), np.nan)

    def _through_water(self, log: Log) -> None:
        forward, starboard = log.place or (0.0, 0.0)
        found = {"u_w": self.channels.pop("u_w")}
        if "gamma_w" in self.channels:
            drift = self.channels.pop("gamma_w") - self.channels["psi"]
            found = {"u_w": found["u_w"] * np.cos(drift), "v_w": found["u_w"] * np.sin(drift)}
        if starboard:
            found["u_w"] = found["u_w"] + starboard * self._rate()
        if forward and "v_w" in found:
            found["v_w"] = found["v_w"] - forward * self._rate()
        if "u" in self.channels:
            self.channels |= found
            return
        self.channels["u"] = found["u_w"]
        if "v_w" in found:
            self.channels.setdefault("v_m", found["v_w"])
        names = "u, v_m" if "v_w" in found else "u"
        self.steps.append(f"doubt: {names} through the water, as the log has no speed over ground; no current is in it")

    def _wind(self, apparent: Apparent) -> None:
        angle = self.channels["gamma_A"]
        far = np.abs(angle) > math.pi
        self.channels["gamma_A"] = np.where(far, np.mod(angle + math.pi, 2.0 * math.pi) - math.pi, angle)
        if {"U_T", "gamma_T"} & set(self.channels):
            return
        if not {"psi", "u", "v_m"} <= set(self.channels):
            self.steps.append("no true wind: it needs psi, u and v_m beside the apparent one")
            return
        u, v = self.channels["u"], self.channels["v_m"]
        if any(apparent.mast):
            forward, starboard = apparent.mast
            u, v = u - starboard * self._rate(), v + forward * self._rate()
        north, east = true_wind(self.channels["U_A"], self.channels["gamma_A"], self.channels["psi"], u, v)
        self.channels["U_T"] = np.hypot(north, east)
        self.channels["gamma_T"] = np.mod(np.arctan2(east, north), 2.0 * math.pi)
        self.steps.append("U_T, gamma_T from the apparent wind, the heading and the speed over ground")

    def exchanged(self, datum: Datum) -> bool:
        """Whether the track fits heading and speeds only with latitude and longitude exchanged."""
        names = ("x", "y", "psi", "u", "v_m")
        if not set(names) <= set(self.channels) or abs(datum.longitude) >= 89.0:
            return False
        good = np.isfinite(sum(self.channels[name] for name in names))
        if good.sum() < 20:
            return False
        x, y, psi, u, v = (self.channels[name][good] for name in names)
        t = self.t[good]
        north, east = (
            integral(t, rate) for rate in (u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi))
        )
        k = np.linspace(0, len(t) - 1, 20).astype(int)
        walked, given = np.stack([np.diff(north[k]), np.diff(east[k])]), np.stack([np.diff(x[k]), np.diff(y[k])])
        if np.hypot(*walked).sum() < _WALKED:
            return False
        scale = np.array([[1.0 / math.cos(math.radians(datum.latitude))], [math.cos(math.radians(datum.longitude))]])
        size = float(np.sqrt(np.mean(walked**2)))
        as_given, other = (float(np.sqrt(np.mean((one - walked) ** 2))) for one in (given, given[::-1] * scale))
        return as_given > _OFF * size and other < _NEAR * as_given


def _words(place: Offset) -> str:
    return f"{place[0]:g} m forward, {place[1]:g} m to starboard"

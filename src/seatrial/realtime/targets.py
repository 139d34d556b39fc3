"""Other ships of a loop as a receiver of AIS hears them: position reports (VDM) on the wire of the own ship."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..data.nmea.ship import position
from .loop import Loop
from .on_wire import OnWire

PERIOD = 10.0
"""Time between two reports of a ship [simulated s]: that of ships up to 14 kn (ITU-R M.1371)."""

FIRST = 200_000_001
"""MMSI of the first other ship; no country has the digits 200, so it is never that of a real one."""


class Targets:
    """Reports of other ships, one after the other."""

    def __init__(self, loop: Loop, names: Sequence[str], on_wire: OnWire) -> None:
        """Report these ships from the next tick on, on the wire of another one."""
        self._names, self._on_wire = tuple(names), on_wire
        loop.after(self.tick)

    def tick(self, loop: Loop) -> None:
        """Send what is due."""
        fittings = self._on_wire.fittings
        for k, name in enumerate(self._names):
            due = math.floor((loop.t + k) / PERIOD) > math.floor((loop.t + k - 1.0 / loop.rate) / PERIOD)
            vessel = loop.vessels[name]
            if not due or vessel.failure is not None:
                continue
            plant = vessel.plant
            x, y, psi, u, v = (plant[state] for state in ("x", "y", "psi", "u", "v_m"))
            latitude, longitude = fittings.datum.place(x, y)
            said = {"t": loop.t, "psi": psi, "r": plant["r"], "latitude": latitude, "longitude": longitude,
                    "U": math.hypot(u, v), "chi": psi + math.atan2(v, u)}  # fmt: skip
            self._on_wire.say(loop, position(fittings, said, FIRST + k, "VDM"))

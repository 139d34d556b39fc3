"""What instruments without a fault say of a ship, for tests of sentences."""

from __future__ import annotations

from seatrial.data.nmea.ship import Fittings, Measured
from seatrial.realtime.on_wire import exact, told


def told_by_exact(fit: Fittings, now: dict[str, float]) -> Measured:
    """All of them at the time of `now`."""
    watch = exact((*fit.rudders, *fit.shafts), fit, 1.0).start()
    return {name: value for reading in watch.read(now["t"], now) for name, value in told(reading, fit).items()}

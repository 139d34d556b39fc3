"""The water of the chart below each ship: a warning where little of it is left, and felt by ships without a place.

A ship with a place (`simulate.place`) meets the chart within its own step; others are told the depth after each tick.
"""

from __future__ import annotations

import math

import numpy as np

from ...environment import CHANNELS, Environment
from ...environment.chart import Chart
from ...sensors.suite import draught
from ...ships.felt import feels
from ..loop import Loop
from ..plant import Plant

_LITTLE = 0.2
"""Water under the keel, over the draught, below which it is announced."""
# A change of the inverse depth by this share is passed on: depth areas have steps, and slopes go on for long.
_CHANGED = 1e-3
_STATES = ("deep", "little", "aground")


class Soundings:
    """Sounds the chart below every ship after each tick.

    What a ship feels comes a tick late, by the same way as weather from the page, so recordings can be repeated.
    Grounding is announced and stops nothing: no force of the ground is in the model.
    """

    def __init__(self, loop: Loop, chart: Chart) -> None:
        """Sound this chart from now on."""
        self._chart, self._said = chart, dict.fromkeys(loop.vessels, 0)
        loop.after(self.sound)

    def depth(self, plant: Plant) -> float:
        """Depth of the chart at midship [m]; infinite where it has none."""
        return float(self._chart.depth_at(np.array([plant["x"]]), np.array([plant["y"]]))[0])

    def under(self, plant: Plant) -> float:
        """Depth of the chart at midship less the draught [m]; infinite where either is unknown."""
        deep = draught(plant.ship)
        return self.depth(plant) - deep if deep > 0.0 and math.isfinite(plant["x"] + plant["y"]) else math.inf

    def sound(self, loop: Loop) -> None:
        """Pass the depth on to ships that feel it; announce little water and grounding, each once until it is over."""
        for name, vessel in loop.vessels.items():
            plant = vessel.plant
            if vessel.failure is not None or not math.isfinite(plant["x"] + plant["y"]):
                continue
            depth = self.depth(plant)
            wanted = 0.0 if math.isinf(depth) else 1.0 / max(depth, 0.05 * max(draught(plant.ship), 0.1))
            told = plant["per_depth"]
            if plant.place is None and feels(plant.ship, "per_depth") and abs(wanted - told) > _CHANGED * wanted:
                here = Environment(*(plant[channel] for channel in CHANNELS))
                loop.surround(name, here._replace(per_depth=wanted))
            self._announce(loop, name, plant, depth)

    def _announce(self, loop: Loop, name: str, plant: Plant, depth: float) -> None:
        deep = draught(plant.ship)
        left = depth - deep if deep > 0.0 else math.inf
        state = 2 if left <= 0.0 else 1 if left < _LITTLE * deep else 0
        if state > self._said[name]:
            words = f"aground by the chart: {depth:.3g} m of water, draught {deep:.3g} m" if state == 2 \
                else f"{left:.2g} m under the keel by the chart"
            loop.tell(name, _STATES[state], words)
        self._said[name] = state

"""A request for a run in an irregular sea: mean drift in the run, first-order motion upon it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...data import Trial
from ...environment.sea import Sea, encountered
from ...environment.sea.rao import MODES, Rao
from ...ships import Ship
from ...ships.felt import feels
from .. import RequestError
from ..request import Around, Note

if TYPE_CHECKING:
    from ...realtime.conning import SteeringControl
    from ...realtime.fleet import Vessel

_MOST_ROLL = math.radians(30.0)
_SLOWEST = 0.4
"""Lowest frequency of a wave filter [rad/s]: the floor of trackers of the encounter; slower is the rudder's own."""


@dataclass(frozen=True)
class Motion:
    """One motion in waves.

    Attributes:
        expected: standard deviation by spectrum and operator, on the first heading [m] or [rad].
        found: that of the run.
        greatest: greatest deviation of the run.
        unit: "m" or "rad".
    """

    expected: float
    found: float
    greatest: float
    unit: str


@dataclass(frozen=True)
class Seaway:
    """A sea and operators, or none; `around` is the weather with the sea's mean drift, `settings` what was asked."""

    around: Around
    sea: Sea | None = None
    rao: Rao | None = None
    settings: Mapping[str, object] = field(default_factory=dict[str, object])

    def seen(self, run: Trial, note: Note) -> tuple[Trial, Mapping[str, Motion]]:
        """The run with its motion in waves, and these motions; notes rolling beyond what operators are for."""
        from ...simulate.seaway import in_waves

        if self.sea is None or self.rao is None:
            return run, {}
        total = in_waves(run, self.sea, self.rao)
        variances = self.rao.variances(self.sea.waves, float(run["psi"][0]))
        c, s = np.cos(run["psi"]), np.sin(run["psi"])
        north, east = total["x"] - run["x"], total["y"] - run["y"]
        none = np.zeros_like(run.t)
        roll = total["phi"] - run.channels.get("phi", none)
        along, aside, yaw = c * north + s * east, c * east - s * north, total["psi"] - run["psi"]
        found = (along, aside, total["z"], roll, total["theta"], yaw)
        motions = {
            mode: Motion(math.sqrt(variances[k]), float(np.std(found[k])), float(np.abs(found[k]).max()),
                         "m" if k < 3 else "rad")
            for k, mode in enumerate(MODES)
        }  # fmt: skip
        if (most := motions["roll"].greatest) > _MOST_ROLL:
            note(f"warning: --rao: roll reaches {math.degrees(most):.3g} deg; operators hold for small angles "
                 "(computed ones lack the damping of keels and eddies; see --roll-damping)")  # fmt: skip
        return total, motions

    def rock(self, vessel: Vessel, control: SteeringControl) -> None:
        """Let the instruments of a running ship see its motion in waves, and its autopilot filter it out."""
        from ...realtime.wave_filter import WaveFilter
        from ...sensors.seaway import Seen

        if self.sea is None or self.rao is None:
            return
        plant = vessel.plant
        vessel.seen = Seen(plant, self.sea, self.rao).at(plant.t)
        chi = self.sea.gamma_W + math.pi - plant["psi"]
        met = encountered(np.array([self.sea.spectrum.omega_P]), math.hypot(plant["u"], plant["v_m"]), chi)
        control.filter = WaveFilter(max(abs(float(met[0])), _SLOWEST))


def bound_for(
    ship: Ship, sea: str | None, rao: str | Path | None, roll_damping: float | None, seed: int, around: Around,
    note: Note,
) -> Seaway:  # fmt: skip
    """A sea by `sea` and operators by the file `rao`; neither of them is calm water.

    The sea's height and mean period also make the mean drift of a ship that has a force for it.

    Raises:
        RequestError: one without the other, or waves given twice.
        DataError, WeatherError: a file that cannot be used.
    """
    from ...environment.sea.reading import read_rao, read_sea

    if sea is None and rao is None and roll_damping is None:
        return Seaway(around)
    if sea is None or rao is None:
        raise RequestError(
            "--sea and --rao go together: a sea, and the operators of the ship's motion in it; give both"
        )
    if around.get("waves") is not None:
        raise RequestError("--waves: the sea gives the mean drift already; leave one of --waves and --sea out")
    there, operators = read_sea(sea, seed), read_rao(rao, roll_damping)
    operators.covers(there)
    moments = there.moments
    asked = {"sea": {"height": moments.H_S, "period": 2.0 * math.pi / there.spectrum.omega_P,
                     "from": math.degrees(there.gamma_W), "rao": str(rao)}}  # fmt: skip
    if moments.m0 == 0.0:
        return Seaway(around, there, operators, asked)
    if not feels(ship, "wave_x"):
        note(f"note: --sea: {ship.name} has no force of waves; it moves in the sea and does not drift")
        return Seaway(around, there, operators, asked)
    drift = f"{moments.H_S!r},{moments.T_01!r},{math.degrees(there.gamma_W)!r}"
    return Seaway({**around, "waves": drift}, there, operators, asked)

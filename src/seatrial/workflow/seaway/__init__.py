"""A request for a run in an irregular sea: mean drift in the run, first-order motion upon it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...core.values import dataclass, field, replace
from ...data import Array, Trial
from ...environment.sea import Sea
from ...environment.sea.hydrodynamics import Hydrodynamics
from ...environment.sea.rao import MODES, Rao
from ...models.unified import Unified
from ...ships import Ship
from ...ships.felt import feels
from .. import RequestError
from ..asked import Around, InWaves
from ..request import Note

_MOST_ROLL = math.radians(30.0)

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
    """A sea and operators, or none; `around` is the weather with the sea's mean drift, `settings` what was asked.

    `forces` are wave forces for a ship in six degrees of freedom, which moves by them within the run.
    """

    around: Around
    sea: Sea | None = None
    rao: Rao | None = None
    forces: Rao | None = None
    settings: Mapping[str, object] = field(default_factory=dict[str, object])

    def seen(self, run: Trial, note: Note) -> tuple[Trial, Mapping[str, Motion]]:
        """The run with its motion in waves, and these motions; notes rolling beyond what operators are for."""
        from ...simulate.seaway import in_waves

        if self.sea is None or self.rao is None:
            return run, {}
        if self.forces is not None:
            return run, self._moved(run, self.sea, self.rao)
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

    def _moved(self, run: Trial, sea: Sea, rao: Rao) -> Mapping[str, Motion]:
        """Heave, roll and pitch of a run that has them; about their means, which drift and heel in a turn."""
        variances = rao.variances(sea.waves, float(run["psi"][0]))
        found = {"heave": run["z"], "roll": run["phi"], "pitch": run["theta"]}
        return {mode: Motion(math.sqrt(variances[MODES.index(mode)]), float(np.std(column)),
                             float(np.abs(column - column.mean()).max()), "m" if mode == "heave" else "rad")
                for mode, column in found.items()}  # fmt: skip


def bound_for(
    ship: Ship, waves: InWaves, seed: int, around: Around, note: Note, speed: float = 0.0
) -> Seaway:
    """A sea and a file of operators; neither of them is calm water.

    A ship in six degrees of freedom takes wave forces from the file, others the operators of their motion, at the speed
    ahead [m/s].  The sea's height and mean period also make the mean drift of a ship that has a force for it.

    Raises:
        RequestError: one without the other, or waves given twice.
        DataError, WeatherError: a file that cannot be used.
    """
    from ...environment.sea.reading import read_rao, read_sea

    sea, rao, roll_damping = waves.sea, waves.rao, waves.roll_damping
    if waves == InWaves():
        return Seaway(around)
    if sea is None or rao is None:
        raise RequestError(
            "--sea and --rao go together: a sea, and the operators of the ship's motion in it; give both"
        )
    if around.waves is not None:
        raise RequestError("--waves: the sea gives the mean drift already; leave one of --waves and --sea out")
    there, own = read_sea(sea, seed), _forces(ship, rao, roll_damping)
    operators = read_rao(rao, roll_damping, speed) if own is None else own.rao(speed, further=_further(ship))
    forces = None if own is None else own.forces
    operators.covers(there)
    moments = there.moments
    asked = {"sea": {"height": moments.H_S, "period": 2.0 * math.pi / there.spectrum.omega_P,
                     "from": math.degrees(there.gamma_W), "rao": str(rao)}}  # fmt: skip
    if moments.m0 == 0.0:
        return Seaway(around, there, operators, forces, asked)
    if not feels(ship, "wave_x"):
        note(f"note: --sea: {ship.name} has no force of waves; it moves in the sea and does not drift")
        return Seaway(around, there, operators, forces, asked)
    drift = f"{moments.H_S!r},{moments.T_01!r},{math.degrees(there.gamma_W)!r}"
    return Seaway(replace(around, waves=drift), there, operators, forces, asked)


def _forces(ship: Ship, path: str | Path, roll_damping: float | None) -> Hydrodynamics | None:
    """Coefficients about the point that a ship in six degrees of freedom moves about; None for other ships.

    Raises:
        RequestError: damping of roll, which such a ship has of its own.
    """
    from ...environment.sea.reading import read_hydrodynamics

    if not isinstance(ship.model, Unified):
        return None
    if roll_damping is not None:
        raise RequestError(f"--roll-damping: {ship.name} has its own; set it with seatrial seakeeping --roll-damping")
    data = read_hydrodynamics(path)
    return data.moved(0.0, 0.0, data.z_G)


def _further(ship: Ship) -> Array:
    """Damping of a ship in six degrees of freedom besides that of waves, as far as it is linear at rest."""
    model: Any = ship.model
    out = np.zeros((6, 6))
    out[2, 2], out[3, 3], out[4, 4] = model.heave.B_33, model.roll.B_1, model.heave.B_55
    return out

"""A manoeuvre of a fitted ship with bands: indices and tracks of draws, calibrated where a calibration is beside it.

Beyond the trials of the fit bands are refused; one that left-out trials have widened gives them for motions and
controls, as what the trials leave open then keeps the width of its prior.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...belief.posterior import Posterior
from ...core.files import packed, write_together
from ...core.values import dataclass, replace
from ...data.trialfile import write_trial
from ...manoeuvres import Index, by_demand
from ...models import STATES
from ...report.judging.bands import page
from ...report.page import write
from ...ships.steering import by_angle
from .. import RequestError
from ..asked import Approach, Around, Bands, Orders, Span
from ..request import Note, make_folder, silent, surroundings
from ..simulation import Simulated, simulate
from .drawn import Drawing, Sailed

# Rows of each track that are exported.
_EXPORTED = 201


@dataclass(frozen=True)
class Banded:
    """A simulated manoeuvre with its bands.

    Attributes:
        run: by the fitted numbers themselves.
        level: share of the draws within a band.
        posterior: what was drawn from.
        sailed: the draws, what their bands stand on, and what they do not say.
    """

    run: Simulated
    level: float
    posterior: Posterior
    sailed: Sailed

    @property
    def indices(self) -> Mapping[str, tuple[Index, Index, Index]]:
        """Value, lower and upper edge of each index; NaN edges where too few draws reach it."""
        nominal = self.run.policy.indices(self.run.trial, self.run.ship.L_pp)
        sides = [nominal, *({name: replace(one, value=self.sailed.bands.edges(name, self.level)[k])
                             for name, one in nominal.items()} for k in (0, 1))]  # fmt: skip
        value, low, high = (found if by_angle(self.run.ship) else by_demand(found) for found in sides)
        return {name: (value[name], low[name], high[name]) for name in value}


def simulate_with_bands(
    model: str, manoeuvre: str, asked: Bands, *, orders: Orders = Orders(), begin: Approach = Approach(),
    span: Span = Span(), around: Around = Around(), out: Path | None = None, note: Note = silent,
) -> Banded:  # fmt: skip
    """Run a manoeuvre of a fitted ship, and again with draws of what is not known of it.

    Args:
        asked: the bands; 1000 draws unless it says another number.  A run that leaves the ranges of the trials of the
            fit is refused unless it extrapolates, but for motions and controls of a fit whose posterior left-out trials
            have widened.
        out: trial file of the run; bands go beside it as .bands.npz, .bands.html and .bands.json.

    The others are those of `simulate`.

    Raises:
        RequestError: a level or number of draws that makes no band, or a run beyond the trials of the fit.
        StudyError: the model has no posterior, or the calibration of another fit.
    """
    drawing = Drawing.of(model, asked)
    if out is not None and out.suffix.lower() != ".csv":
        raise RequestError(f"{out}: a run with bands ends in .csv; its bands go beside it")
    # a ship of no file: where it leaves its trials is refused, or a caveat, of the bands
    fitted = replace(drawing.held.ship, file=None)
    ran = simulate(fitted, manoeuvre, orders=orders, begin=begin, span=span, around=around, note=note)
    place = surroundings(ran.ship, around, 1 if orders.seed is None else orders.seed)
    settings: Mapping[str, Any] = ran.settings
    sailed = drawing.sail(ran.ship, ran.policy, ran.trial, speed=settings["speed"], dt=settings["dt"],
                          weather=place.weather, balanced=begin.rps is None and begin.throttle is None)  # fmt: skip
    banded = Banded(ran, drawing.level, drawing.held, sailed)
    for line in banded.sailed.caveats:
        note(f"note: {line}")
    if out is not None:
        _write(banded, out, note)
    return banded


def _write(banded: Banded, out: Path, note: Note) -> None:
    make_folder(out.parent)
    write_trial(banded.run.trial, out)
    arrays = out.with_suffix(".bands.npz")
    write_together({arrays: packed(**_arrays(banded))})
    made = write(out.with_suffix(".bands.html"), page(
        f"{banded.run.ship.name}: {banded.run.policy.kind} with bands of {100 * banded.level:g} %", banded.sailed.bands,
        banded.level, banded.run.trial, banded.indices, banded.sailed.caveats, {
            "fit": banded.posterior.digest, "draws": str(len(banded.sailed.draws)),
            **{key: f"{value:.6g}" if isinstance(value, float) else str(value)
               for key, value in banded.run.settings.items() if isinstance(value, float | str)},
        }, banded.sailed.basis,
    ))  # fmt: skip
    note(f"wrote {out}, {arrays.name}, {made.name}")


def _arrays(banded: Banded) -> dict[str, Any]:
    """What the .npz holds: draws by parameter, indices of each draw, tracks and bands of each state, SI units."""
    found, every = banded.sailed.bands, max(1, -(-len(banded.sailed.bands.t) // _EXPORTED))
    edges = {f"{state}_{side}": edge[::every] for state in STATES
             for side, edge in zip(("low", "high"), found.band(state, banded.level), strict=True)}  # fmt: skip
    return {
        "level": banded.level, "digest": banded.posterior.digest, "basis": banded.sailed.basis.kind,
        "t": found.t[::every], "failed": found.failed,
        "parameters": np.array([one.path for one in banded.posterior.free]), "draws": banded.sailed.draws,
        "tracks": found.tracks[:, ::every], "states": np.array(STATES), **edges,
        **{f"index_{name}": values for name, values in found.indices.items()},
    }  # fmt: skip

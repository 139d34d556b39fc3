"""A manoeuvre of a fitted ship with bands: draws from the posterior of its fit.

Beyond the trials of the fit bands are refused where only the fit's own covariance is known; one that left-out trials
have widened gives them for motions and controls, as what the trials leave open then keeps the width of its prior.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from ...campaign.bands import Bands, bands
from ...core.files import packed, write_together
from ...data.trialfile import write_trial
from ...manoeuvres import Index, by_demand
from ...models import STATES
from ...report.judging.bands import LEFT_OUT, PARAMETERS_ONLY, page, reach
from ...report.page import write
from ...ships.steering import by_angle
from ...study.grounds import SURROUNDINGS, Beyond, beyond, kind_of
from ...study.store import load_fit_summary
from ...study.stored import Posterior, posterior
from .. import RequestError
from ..request import Around, Note, make_folder, silent, surroundings
from ..simulation import Simulated, simulate

DRAWS, _MOST = 1000, 20_000
# A quantile is worth its name with so many draws beyond it.
_TAIL = 5
# A parameter is left open where so much of its prior variance stays.
_LOOSE = 0.5
LEAVE_OUT = "; or let trials left out in turn widen them (seatrial identify STUDY -o RUN --left-out)"
# Rows of each track that are exported.
_EXPORTED = 201


@dataclass(frozen=True)
class Banded:
    """A simulated manoeuvre with its bands.

    Attributes:
        run: by the fitted numbers themselves.
        bands: of the draws.
        level: share of the draws within a band.
        posterior: what was drawn from.
        draws: parameters of each run, shape (draws, free).
        beyond: channels in which the run leaves the trials of the fit; empty unless that was accepted, or the posterior
            says what is open there.
        caveats: what the bands do not say, one line each, the first always.
    """

    run: Simulated
    bands: Bands
    level: float
    posterior: Posterior
    draws: np.ndarray[Any, np.dtype[np.float64]]
    beyond: tuple[Beyond, ...]
    caveats: tuple[str, ...]

    @property
    def indices(self) -> Mapping[str, tuple[Index, Index, Index]]:
        """Value, lower and upper edge of each index; NaN edges where too few draws reach it."""
        nominal = self.run.policy.indices(self.run.trial, self.run.ship.L_pp)
        sides = [nominal, *({name: replace(one, value=self.bands.edges(name, self.level)[k])
                             for name, one in nominal.items()} for k in (0, 1))]  # fmt: skip
        value, low, high = (found if by_angle(self.run.ship) else by_demand(found) for found in sides)
        return {name: (value[name], low[name], high[name]) for name in value}


def simulate_with_bands(
    model: str, manoeuvre: str, level: float, *, draws: int = DRAWS, extrapolate: bool = False, out: Path | None = None,
    rps: float | None = None, throttle: float | None = None, rudder: float | None = None, heading: float | None = None,
    side: str | None = None, seed: int | None = None, speed: float | None = None, duration: float | None = None,
    dt: float | None = None, steer: float | None = None, note: Note = silent, **around: Unpack[Around],
) -> Banded:  # fmt: skip
    """Run a manoeuvre of a fitted ship, and again with draws from its posterior.

    Args:
        level: of the bands [%].
        draws: number of runs.
        extrapolate: give bands where the run leaves the ranges of the trials of the fit; else it is refused, but for
            motions and controls of a fit whose posterior left-out trials have widened.
        out: trial file of the run; bands go beside it as .bands.npz, .bands.html and .bands.json.

    The others are the options of `seatrial simulate`.

    Raises:
        RequestError: a level or number of draws that makes no band, or a run beyond the trials of the fit.
        StudyError: the model has no posterior.
    """
    _check(level, draws)
    if out is not None and out.suffix.lower() != ".csv":
        raise RequestError(f"{out}: a run with bands ends in .csv; its bands go beside it")
    held = posterior(model)
    ran = simulate(model, manoeuvre, rudder=rudder, heading=heading, side=side, seed=seed, speed=speed, rps=rps,
                   duration=duration, dt=dt, steer=steer, throttle=throttle, note=note, **around)  # fmt: skip
    out_of = _beyond(held, ran, extrapolate)
    place = surroundings(ran.ship, 1 if seed is None else seed, **around)
    drawn = held.draws(draws, 1)
    settings: Mapping[str, Any] = ran.settings
    found = bands(
        ran.ship, ran.policy, [one.path for one in held.free], drawn, speed=settings["speed"],
        duration=ran.trial.duration, dt=settings["dt"], weather=place.weather, held=rps is None and throttle is None,
    )  # fmt: skip
    banded = Banded(ran, found, 0.01 * level, held, drawn, out_of, _caveats(model, held, ran, out_of, found))
    for line in banded.caveats:
        note(f"note: {line}")
    if out is not None:
        _write(banded, out, note)
    return banded


def _check(level: float, draws: int) -> None:
    if not 0.0 < level < 100.0:
        raise RequestError(f"--bands is {level:g} percent; it is above 0 and below 100, such as 95")
    least = round(_TAIL * 200.0 / (100.0 - level) + 0.5)
    if not least <= draws <= _MOST:
        raise RequestError(f"--draws is {draws}; bands of {level:g} percent take {least} to {_MOST}")


def _beyond(held: Posterior, ran: Simulated, extrapolate: bool) -> tuple[Beyond, ...]:
    """Where the run leaves the trials of the fit.

    Raises:
        RequestError: it does, and that was not accepted.
    """
    if not held.covered and not extrapolate:
        raise RequestError(
            f"--bands: the fit of {ran.ship.name} did not keep the ranges of its trials (an older version); fit it "
            "again, or accept bands of unknown validity with --extrapolate"
        )
    found = beyond(held.covered, ran.trial, ran.ship.model.controls)
    told = held.power is not None and not any(one.channel in SURROUNDINGS for one in found)
    if found and not extrapolate and not told:
        raise RequestError(
            f"--bands: the run leaves the trials of the fit: {'; '.join(map(reach, found))}; nothing is known of the "
            "error there; fit trials that go so far, or accept it with --extrapolate"
            f"{'' if held.power is not None else LEAVE_OUT}"
        )
    return found


def _caveats(
    model: str, held: Posterior, ran: Simulated, out_of: tuple[Beyond, ...], found: Bands
) -> tuple[str, ...]:  # fmt: skip
    if held.power is not None:
        lines = [LEFT_OUT, *held.power.words]
    else:
        lines = [PARAMETERS_ONLY]
        tested = load_fit_summary(Path(model).parent).get("diagnosis")
        if tested is not None and not tested.get("explained", True):
            lines.append("the model does not explain the trials of its fit: the bands are too narrow")
    if out_of:
        lines.append(f"extrapolated: {'; '.join(map(reach, out_of))}; {_open_there(held)}")
    kinds, kind = held.grounds.get("kinds", ()), kind_of(ran.trial)
    if kinds and kind not in kinds:
        lines.append(f"no trial of the fit is of this kind ({kind}); they are {', '.join(kinds)}")
    if lost := int(np.isfinite(found.failed).sum()):
        lines.append(f"{lost} of {len(found.failed)} draws left the validity of the ship file or blew up on their way")
    return tuple(lines)


def _open_there(held: Posterior) -> str:
    """What the bands count beyond the trials."""
    if held.power is None:
        return "the bands are not widened for it"
    loose = int((held.power.shares(held.free, held.covariance) > _LOOSE).sum())
    return (f"there the bands are as wide as the priors of what the trials leave open ({loose} of {len(held.free)} "
            "free parameters), which no trial has tested; what the study holds counts as exact")  # fmt: skip


def _write(banded: Banded, out: Path, note: Note) -> None:
    make_folder(out.parent)
    write_trial(banded.run.trial, out)
    arrays = out.with_suffix(".bands.npz")
    write_together({arrays: packed(**_arrays(banded))})
    made = write(out.with_suffix(".bands.html"), page(
        f"{banded.run.ship.name}: {banded.run.policy.kind} with bands of {100 * banded.level:g} %", banded.bands,
        banded.level, banded.run.trial, banded.indices, banded.caveats, {
            "fit": banded.posterior.digest, "draws": str(len(banded.draws)),
            **{key: f"{value:.6g}" if isinstance(value, float) else str(value)
               for key, value in banded.run.settings.items() if isinstance(value, float | str)},
        },
    ))  # fmt: skip
    note(f"wrote {out}, {arrays.name}, {made.name}")


def _arrays(banded: Banded) -> dict[str, Any]:
    """What the .npz holds: draws by parameter, indices of each draw, tracks and bands of each state, SI units."""
    found, every = banded.bands, max(1, -(-len(banded.bands.t) // _EXPORTED))
    edges = {f"{state}_{side}": edge[::every] for state in STATES
             for side, edge in zip(("low", "high"), found.band(state, banded.level), strict=True)}  # fmt: skip
    return {
        "level": banded.level, "digest": banded.posterior.digest, "t": found.t[::every], "failed": found.failed,
        "parameters": np.array([one.path for one in banded.posterior.free]), "draws": banded.draws,
        "tracks": found.tracks[:, ::every], "states": np.array(STATES), **edges,
        **{f"index_{name}": values for name, values in found.indices.items()},
    }  # fmt: skip

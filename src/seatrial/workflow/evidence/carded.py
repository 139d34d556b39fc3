"""What a card says of bands by the calibration beside a model: how often they held, and where they say less."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ...belief.bands.calibrating import LEVEL
from ...belief.bands.calibration import Calibration, beside, load
from ...belief.bands.crossed import crossed
from ...belief.bands.held import SHARES, Held, held, windows
from ...belief.bands.prediction import fan
from ...belief.posterior import Posterior
from ...core.errors import SeatrialError
from ...data import Trial
from ...engine import SimulationError
from ...report.judging.card import Calibrated
from ...report.judging.tested import reached
from ...simulate.replay import replay
from .. import Sink
from .calibrate import of_one_day

_DRAWS = 300


def calibrated_of(
    model: str, posterior: Posterior | None, unseen: Sequence[Trial], seconds: float, sink: Sink
) -> Calibrated | None:
    """Coverage of calibrated bands of 95 % on unseen trials and on those left out; None without a calibration.

    Args:
        seconds: time between restarts of the predictions.

    Raises:
        StudyError: the calibration is of another fit.
    """
    if posterior is None or not beside(model).is_file():
        return None
    found = load(model, posterior)
    try:
        far = found.reach(LEVEL)
    except SeatrialError as error:
        sink.note(f"warning: {error}")
        return None
    doubts = [*of_one_day(found)]
    rows = _unseen(found, posterior, unseen, seconds, far, doubts)
    kinds = tuple(sorted(set(found.left.kinds)))
    return Calibrated(
        len(set(found.left.groups)), kinds, far, rows, crossed(found, LEVEL), tuple(doubts), found.errors
    )


def _unseen(
    found: Calibration, posterior: Posterior, unseen: Sequence[Trial], seconds: float, far: float, doubts: list[str]
) -> tuple[Held, ...]:  # fmt: skip
    """Coverage on unseen trials; what cannot be judged, or lies beyond the trials of the fit, goes to `doubts`."""
    horizons = [share * min(far, seconds) for share in SHARES]
    made = []
    for trial in unseen:
        try:
            predicted = replay(posterior.ship, trial, restart=seconds)
            own = fan(posterior, found, trial, predicted, LEVEL, restart=seconds, draws=_DRAWS)
        except (SeatrialError, SimulationError) as error:
            doubts.append(f"{trial.name} has no bands: {error}")
            continue
        doubts.extend(_beyond(posterior, trial))
        doubts.extend(f"{trial.name}: {line}" for line in own.notes)
        made.append(windows(own, trial, horizons))
    return held(made)


def _beyond(posterior: Posterior, trial: Trial) -> Iterator[str]:
    if out := posterior.grounds.beyond(trial, posterior.ship.model.controls):
        yield f"{trial.name} leaves the trials of the fit: {reached(out)}"

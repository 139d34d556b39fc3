"""Members of a fit on trials of unequal length; `test_spread` has the long tier."""

from __future__ import annotations

import numpy as np
import pytest

from seatrial.belief.spread import Members, spreads
from seatrial.manoeuvres.turning import Turning
from seatrial.models import STATES
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

SHIP = load("mariner_nomoto")


def test_without_restarts_every_trial_is_sailed_in_one_go() -> None:
    """Of two ships that turn at K1 delta and K2 delta the headings part as (K1 - K2)/2 delta (t - T(1 - exp(-t/T)))."""
    trials = [simulate(SHIP, Turning(0.0, 0.1), duration=s, dt=1.0, name=f"{s:g} s") for s in (100.0, 400.0)]
    K, T = SHIP.model.K, SHIP.model.T
    drawn = np.array([[0.9 * K], [1.1 * K]])
    found = Members(("K",), np.array([K]), drawn, None, dict.fromkeys(STATES, 1.0), None, {"t": 1.0}, None)
    for trial, spread in zip(trials, spreads(found, SHIP, trials), strict=True):
        assert spread.deviation.shape[0] == 1, "one start"
        psi = spread.deviation[0, :, STATES.index("psi")]
        seconds = np.flatnonzero(np.isfinite(psi))
        assert seconds[-1] == trial.duration
        end = 0.1 * K * 0.1 * (trial.duration - T * -np.expm1(-trial.duration / T))
        assert psi[seconds[-1]] == pytest.approx(end, rel=0.03)

"""Forecasts of held-out trials from filtered states, by three rivals."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.belief import foresight
from seatrial.core.parameters import values
from seatrial.data import DataError, Trial
from seatrial.ships.files import load
from seatrial.study.schema import SmootherTable


def test_forecasts_are_made_by_three_rivals_and_stop_where_a_trial_ends(monkeypatch: Any) -> None:
    ship = load("kvlcc2_l7")
    asked: list[tuple[float, float, float]] = []

    smoother = SmootherTable(position=1.0, heading=0.1, parameters={"hull.Y_v": 0.1}, current=0.5,
                             process={"u": 0.1, "r": 0.2, "bias": 3.0})  # fmt: skip
    ran: list[Any] = []

    def kalman(smoother: Any, who: Any) -> Any:
        return SimpleNamespace(run=lambda one, trial: ran.append((one, trial, smoother)) or "run")

    def forecasts(run: Any, horizon: float, *, every: float, begin: float) -> Any:
        asked.append((horizon, every, begin))
        return SimpleNamespace(starts=[0] * int(horizon), rms=lambda: (horizon, 0.1 * horizon, 2.0 * horizon))

    monkeypatch.setattr(foresight, "kalman", kalman)
    monkeypatch.setattr(foresight, "forecasts", forecasts)
    monkeypatch.setattr(foresight, "own_samples", lambda trial: trial)
    flat = {name: np.ones(101) for name in ("n_P", "delta")}
    logs = [(smoother, Trial("long", np.arange(101.0) * 0.5, dict(flat))),
            (smoother, Trial("short", np.arange(101.0) * 0.49, dict(flat)))]  # fmt: skip
    monkeypatch.setattr(foresight, "readings", lambda study: logs)
    fitted = ship.having({"hull.Y_v": -0.5})
    study: Any = SimpleNamespace(problem=SimpleNamespace(ship=ship))
    found, notes = foresight.foreseen(study, fitted)
    assert notes == ()
    assert [(one.trial, one.label, one.horizon) for one in found if one.trial == "long"] == [
        ("long", label, h) for label in ("fitted", "untuned", "constant velocity") for h in (10.0, 30.0)]  # fmt: skip
    # twenty seconds to settle and thirty ahead do not fit in 49
    assert [one.horizon for one in found if one.trial == "short"] == [10.0] * 3
    assert set(asked) == {(10.0, 5.0, 20.0), (30.0, 5.0, 20.0)}
    first = found[0]
    assert (first.count, first.position, first.heading, first.end) == (10, 10.0, 1.0, 20.0)
    who = [one for one, _, _ in ran[:3]]
    start = float(values(ship.model)["hull.Y_v"])
    assert float(values(who[0].model)["hull.Y_v"]) == pytest.approx(start), "followed from the file's"
    assert who[1] == ship
    still: Any = who[2].model
    assert (1e-9, 1e6, ship.speed) == (still.K, still.T, still.U)
    bare = ran[2][2]
    assert (bare.current, bare.parameters, bare.process) == (0.0, {}, {"u": 0.1, "r": 0.2})
    assert (ran[2][1]["delta"] == 0.0).all()
    assert (ran[0][1]["delta"] == 1.0).all()

    def refuses(smoother: Any, who: Any) -> Any:
        raise DataError("no fixes")

    monkeypatch.setattr(foresight, "kalman", refuses)
    none, told = foresight.foreseen(study, fitted)
    assert none == ()
    assert told[0] == "no forecasts of long, fitted: no fixes"
    assert len(told) == 6

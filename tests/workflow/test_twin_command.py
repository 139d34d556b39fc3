"""`seatrial twin`: what it refuses, and what it leaves in its folder."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.workflow import RequestError
from seatrial.workflow.live.twin import CARD, MODEL, STATE, twin

SHIP = load("kvlcc2_l7")


@pytest.fixture
def log(tmp_path: Path) -> Path:
    """A zigzag of half a minute."""
    run = simulate(SHIP, Zigzag(10.42, 0.35, 0.35), dt=0.5, duration=30.0, name="zigzag")
    write_trial(run, tmp_path / "zigzag.csv")
    return tmp_path / "zigzag.csv"


def test_it_follows_one_log(log: Path) -> None:
    for given in ({}, {"trial": log, "nmea": "a.nmea"}):
        with pytest.raises(RequestError, match="give one log"):
            twin(SHIP, **given)  # type: ignore[arg-type]
    with pytest.raises(RequestError, match="not an address"):
        twin(SHIP, nmea="udp://somewhere")


def test_it_leaves_a_ship_a_card_and_its_state(log: Path, tmp_path: Path) -> None:
    said: list[str] = []
    outcome = twin(SHIP, trial=log, out=tmp_path / "out", free=("hull.N_r",), note=said.append)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {STATE, MODEL, CARD, "card.json"}
    again: Any = load(str(tmp_path / "out" / MODEL))
    assert outcome.result.follower is not None
    assert float(again.model.hull.N_r) == outcome.result.follower.value("hull.N_r")[0]
    twin(SHIP, trial=log, out=tmp_path / "out", free=("hull.N_r",), note=said.append)
    assert any("goes on from t = 30 s" in line for line in said)

"""A ship in real time on a chart: the same as in a simulation, kept from walls, reproduced bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatrial.data.trialfile import read_trial
from seatrial.environment import Uniform
from seatrial.environment.geojson import load_chart
from seatrial.manoeuvres import Given
from seatrial.realtime.plant import Plant
from seatrial.realtime.recording import Recording, rerun
from seatrial.ships import ShipError
from seatrial.ships.files import load
from seatrial.simulate.place import place_of
from seatrial.simulate.run import simulate
from seatrial.workflow import RequestError
from seatrial.workflow.realtime import others_of, placed

SHIP, CHART = load("kvlcc2_harbour"), load_chart("tanker_quay")
PLACE = place_of(SHIP, CHART)
START = (250.0, -32.0, 0.0, 0.0, 0.1, 0.0)
DT = 0.05


@pytest.mark.slow
def test_it_meets_the_fenders_as_a_simulation_does() -> None:
    """A berthing at 10 cm/s: the same track to rounding, and no way through the quay that open water would allow."""
    # the start is 10 cm/s, 1 m from the fenders
    plant, free = (Plant.of(SHIP, dt=DT, start=START, n_P=0.0, place=place) for place in (PLACE, None))
    steps = 1200
    for _ in range(steps):
        plant.step()
        free.step()
    run = simulate(SHIP, Given(), duration=steps * DT, start=START, dt=DT, place=PLACE)
    for name in ("x", "y", "psi", "u", "v_m", "r"):
        assert plant[name] == pytest.approx(run[name][-1], rel=1e-9, abs=1e-12)
    assert free["y"] > -29.0, "open water: half the beam is through the line of the quay"
    assert plant["y"] < -29.0


@pytest.mark.slow
def test_a_recording_on_a_chart_is_reproduced_with_its_place_and_not_without(tmp_path: Path) -> None:
    plant, path = Plant.of(SHIP, dt=DT, start=START, n_P=0.0, place=PLACE), tmp_path / "run.csv"
    recording = Recording(plant, path)
    for k in range(600):
        if k == 100:
            plant.order("delta", 0.2)
        recording.see(plant)
        plant.step()
    recording.close()
    again, told = rerun(path, SHIP, place=PLACE), read_trial(path)
    assert told["v_m"].min() < -0.01, "it has met the fenders and rebounds"
    for name in told.channels:
        assert np.array_equal(again[name], told[name], equal_nan=True), name
    with pytest.raises(ShipError, match="on a chart; give its place"):
        rerun(path, SHIP)


@pytest.mark.slow
@pytest.mark.parametrize(("y", "said"), [(-10.0, "starts inside quay 1"), (60.0, "")])
def test_a_start_in_a_wall_is_refused(y: float, said: str) -> None:
    if not said:
        with pytest.raises(RequestError, match=r"inside|aground"):
            placed(SHIP, CHART, (250.0, y, 0.0, 0.0, 0.0, 0.0))
        return
    with pytest.raises(RequestError, match=said):
        placed(SHIP, CHART, (250.0, y, 0.0, 0.0, 0.0, 0.0))
    with pytest.raises(RequestError, match=said):
        others_of([f"kvlcc2_harbour@250,{y:g},0"], 20.0, Uniform(), 1, CHART)


@pytest.mark.slow
def test_ships_of_a_kind_share_a_place_and_families_without_forces_have_none() -> None:
    noted: list[str] = []
    assert placed(load("mariner_nomoto"), CHART, START, noted.append) is None
    assert "knows no banks and quays" in noted[0]
    known = dict[str, object]()
    first, second = (placed(SHIP, CHART, START, places=known) for _ in range(2))  # type: ignore[arg-type]
    assert first is second

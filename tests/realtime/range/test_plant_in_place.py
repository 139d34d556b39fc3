"""A ship in real time on a chart: the same as in a simulation, kept from walls, reproduced bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from seatrial.data.trialfile import read_trial
from seatrial.environment.geojson import load_chart
from seatrial.manoeuvres import Given
from seatrial.realtime.loop import LoopError
from seatrial.realtime.plant import Plant
from seatrial.realtime.range.scenario import Other, Own, Sailing, Scenario
from seatrial.realtime.range.stage import Stage
from seatrial.realtime.recording import Recording, rerun
from seatrial.ships import ShipError
from seatrial.ships.files import load
from seatrial.simulate.place import place_of
from seatrial.simulate.run import simulate

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


def stage(start: tuple[float, ...], other: str = "kvlcc2_harbour") -> Stage:
    """A ship of the harbour on open water, and another on the chart."""
    own = Own(SHIP, Sailing(*START[:3], 0.0), piloted=False)
    others = (Other("other", load(other), Sailing(*start)),)
    return Stage(Scenario("a harbour", 60.0, own, others, chart=CHART))


@pytest.mark.slow
@pytest.mark.parametrize(("y", "said"), [(-10.0, "starts inside quay 1"), (60.0, "inside|aground")])
def test_a_start_in_a_wall_is_refused(y: float, said: str) -> None:
    with pytest.raises(LoopError, match=f"other: .*({said})"):
        stage((250.0, y, 0.0, 0.0))


@pytest.mark.slow
def test_ships_of_a_kind_share_a_place_and_families_without_forces_have_none() -> None:
    far = (250.0, -400.0, 0.0, 3.0)
    own, other = (vessel.plant.place for vessel in stage(far).loop.vessels.values())
    assert own is not None
    assert own is other
    without = stage(far, "mariner_nomoto").loop
    assert without.vessels["other"].plant.place is None
    assert "knows no banks and quays" in without.events[0].text

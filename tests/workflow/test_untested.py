"""Runs of a fitted ship that leave what its trials tested: said by simulate, predict and on the bridge, once."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fitted_run import saved, trial
from seatrial.core.parameters import values
from seatrial.data.trialfile import write_trials
from seatrial.environment import Environment
from seatrial.identify import StudyError
from seatrial.realtime.plant import Plant
from seatrial.realtime.range.stage import OWN, Stage
from seatrial.ships.files import load
from seatrial.workflow.afloat.scenarios import read_scenario
from seatrial.workflow.asked import Orders, Predicting
from seatrial.workflow.judging import imo, requirements
from seatrial.workflow.request import grounds_of, ship_of
from seatrial.workflow.simulation import simulate
from seatrial.workflow.validate import predict

pytestmark = pytest.mark.slow
BEYOND = "goes beyond the trials of the fit"


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return saved(tmp_path_factory.mktemp("fit"), [trial(20), trial(20, side=-1), trial(10)])


class Heard:
    def __init__(self) -> None:
        self.lines: list[str] = []

    def note(self, line: str) -> None:
        self.lines.append(line)


def simulated(ship: Path | str, rudder: float) -> list[str]:
    heard = Heard()
    simulate(str(ship), "turning", orders=Orders(rudder=rudder), note=heard.note)
    return [line for line in heard.lines if BEYOND in line]


def test_a_simulation_says_where_it_leaves_the_trials(model: Path) -> None:
    assert simulated(model, 20.0) == []
    (told,) = simulated(model, 35.0)
    assert told.startswith("warning: ")
    assert "rudder 0 to 35.0 ° (trials: −20.0 to 20.0)" in told
    assert simulated("kvlcc2_l7", 35.0) == [], "no trials are known of it"


def test_another_model_beside_the_fit_has_no_grounds_and_says_so(model: Path, tmp_path: Path) -> None:
    for name in ("model.toml", "fit.json"):
        (tmp_path / name).write_text((model.parent / name).read_text())
    edited = tmp_path / "model.toml"
    lines = edited.read_text().splitlines()
    at = next(k for k, one in enumerate(lines) if one.startswith("speed"))
    lines[at] = lines[at].replace("value = 1.", "value = 1.0", 1)
    edited.write_text("\n".join(lines))
    heard = Heard()
    assert grounds_of(edited, heard.note) is None
    assert heard.lines[0].startswith("warning: what its trials tested is not known: ")


def test_a_fitted_ship_that_was_changed_is_refused_by_whatever_takes_a_ship(model: Path, tmp_path: Path) -> None:
    for name in ("model.toml", "fit.json"):
        (tmp_path / name).write_text((model.parent / name).read_text())
    edited = tmp_path / "model.toml"
    changed = re.sub(r"(?m)^(N_r = .*?)-0\.0", r"\1-0.1", edited.read_text(), count=1)
    assert changed != edited.read_text()
    edited.write_text(changed)
    readers: tuple[Callable[[], object], ...] = (
        lambda: simulate(str(edited), "turning"), lambda: requirements(str(edited), "collision-avoidance"),
        lambda: imo(str(edited)), lambda: ship_of(edited),
    )  # fmt: skip
    for read in readers:
        with pytest.raises(StudyError, match=r"model\.toml: was changed after the fit that fit\.json"):
            read()
    elsewhere = tmp_path / "edited.toml"
    elsewhere.write_text(changed)
    assert ship_of(elsewhere).model != ship_of(model).model, "a copy is a ship of its own"


def test_a_ship_that_was_read_has_the_grounds_of_its_file_until_it_is_changed(model: Path) -> None:
    ship, heard = load(str(model)), Heard()
    own = grounds_of(model, heard.note)
    assert own is not None
    assert grounds_of(ship, heard.note) == own
    assert grounds_of(ship.having({"hull.N_v": 1.01 * values(ship.model)["hull.N_v"]}), heard.note) is None
    assert grounds_of(replace(ship, file=None), heard.note) is None
    assert grounds_of(load("kvlcc2"), heard.note) is None
    told = Heard()
    simulate(ship, "turning", orders=Orders(rudder=35.0), note=told.note)
    assert [line for line in told.lines if BEYOND in line] == simulated(model, 35.0) != []
    assert heard.lines == []


def test_a_prediction_says_which_trial_leaves_them(model: Path, tmp_path: Path) -> None:
    (tmp_path / "trials").mkdir()
    write_trials([replace(trial(20, seed=4), name="within"), replace(trial(35), name="hard")], tmp_path / "trials")
    heard = Heard()
    predict(str(model), [tmp_path / "trials"], tmp_path / "out", how=Predicting(restart=50.0), sink=heard)  # type: ignore[arg-type]
    told = [line for line in heard.lines if BEYOND in line]
    assert [line.split(" goes")[0] for line in told] == ["warning: hard"]


def test_a_plant_is_beyond_while_it_has_what_no_trial_had(model: Path) -> None:
    ship = load(str(model))
    plant = Plant.of(ship, dt=0.1)
    assert plant.untested() == ()
    plant.grounds = grounds_of(model, print)
    plant.order("delta", np.radians(20.0))
    while plant.t < 60.0:
        plant.step()
        assert plant.untested() == ()
    plant.order("delta", np.radians(34.0))
    for _ in range(50):
        plant.step()
    assert plant.untested()[0].channel == "delta"
    plant.order("delta", np.radians(20.0))
    plant.surround(Environment(per_depth=1.0 / 30.0))
    for _ in range(300):
        plant.step()
    (one,) = plant.untested()
    assert (one.channel, one.reached) == ("depth", pytest.approx((30.0, 30.0)))
    assert np.isinf(one.covered).all()


def test_the_bridge_tells_it_when_it_begins_and_when_it_is_over(model: Path, tmp_path: Path) -> None:
    file = tmp_path / "alone.toml"
    file.write_text(f'schema = "seatrial-scenario/1"\nduration = 100.0\n[own]\nship = "{model}"\npilot = "none"\n')
    played = read_scenario(file)
    assert played.own.grounds is not None
    stage = Stage(played)
    loop = stage.loop
    plant = loop.vessels[OWN].plant
    for order, seconds in ((34.0, 20.0), (0.0, 40.0)):
        plant.order("delta", np.radians(order))
        for _ in range(round(seconds * loop.rate)):
            loop.step()
    told = [one for one in loop.events if one.kind in ("untested", "tested")]
    assert [one.kind for one in told] == ["untested", "tested"] * (len(told) // 2)
    assert told[0].text.startswith("beyond the trials of the fit: rudder 31")
    assert "(trials: −20.0 to 20.0)" in told[0].text
    assert loop.t - told[-1].t > 10.0, "straight ahead again, where the trials began"
    assert len(told) <= 6

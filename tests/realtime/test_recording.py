"""Recordings: valid trial files at any moment, and the same run again from the orders, bit for bit."""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError
from seatrial.data.check import check
from seatrial.data.trialfile import read_trial, read_trials
from seatrial.environment import Uniform
from seatrial.environment.weather import Gust
from seatrial.models import STATES
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Compiled, Plant
from seatrial.realtime.recording import Recording, orders_path, rerun
from seatrial.ships import ShipError
from seatrial.ships.files import load
from seatrial.simulate.replay import replay

DT = 0.1


@pytest.fixture(scope="module")
def compiled() -> Compiled:
    return Compiled.of(load("kvlcc2_l7"), DT)


def steered(plant: Plant, path: Path, steps: int = 400, every: int = 1) -> Recording:
    """A run with orders and a current at odd moments."""
    rng = np.random.default_rng(2)
    recording = Recording(plant, path, every=every)
    for k in range(steps):
        if rng.random() < 0.05:
            plant.order("delta", rng.normal(0.0, 0.4))
            plant.order("n_P", abs(rng.normal(10.0, 3.0)))
        if k == 150 and not plant.changing:
            plant.surround(Uniform(U_C=0.2, gamma_C=1.0).now())
        recording.see(plant)
        plant.step()
    recording.close()
    return recording


def same(made, trial) -> None:
    assert made.t.tolist() == trial.t.tolist()
    for name in trial.channels:
        np.testing.assert_array_equal(made[name], trial[name], err_msg=name)


@pytest.mark.parametrize("every", [1, 7])
@pytest.mark.parametrize("started", [0, 37], ids=["from the start", "from under way"])
def test_the_recorded_orders_give_the_recorded_states_bit_for_bit(compiled, tmp_path, every, started):
    plant = compiled.plant(environment=Uniform(U_T=2.0, gamma_T=0.5))
    plant.order("delta", 0.2)
    for _ in range(started):
        plant.step()
    steered(plant, tmp_path / "run.csv", every=every)
    trial = read_trial(tmp_path / "run.csv")
    assert trial.t[0] == pytest.approx(started * DT)
    assert trial["x"][-1] == plant["x"]
    same(rerun(tmp_path / "run.csv", compiled.ship), trial)


@pytest.mark.slow
def test_in_gusts_the_same_weather_is_needed(compiled, tmp_path):
    weather = Gust(Uniform(U_T=3.0, gamma_T=0.5), seed=4)
    steered(compiled.plant(environment=weather), tmp_path / "run.csv")
    with pytest.raises(ShipError, match=r"run\.csv.*weather"):
        rerun(tmp_path / "run.csv", compiled.ship)
    same(rerun(tmp_path / "run.csv", compiled.ship, weather), read_trial(tmp_path / "run.csv"))


@pytest.mark.parametrize("name", ["milliampere", "suzaku", "kvlcc2_l7_arx"])
def test_other_ships_are_recorded_and_run_again(name, tmp_path):
    from seatrial.simulate.run import time_step

    ship = load(name)
    plant = Plant.of(ship, dt=time_step(ship))
    recording = Recording(plant, tmp_path / "run.csv")
    for k in range(60):
        if k % 20 == 5:
            for control in plant.controls:
                plant.order(control, 0.05 * (k + 1))
        recording.see(plant)
        plant.step()
    recording.close()
    same(rerun(tmp_path / "run.csv", ship), read_trial(tmp_path / "run.csv"))


@pytest.mark.slow
def test_a_recording_is_a_trial_like_any_other(compiled, tmp_path):
    steered(compiled.plant(), tmp_path / "run.csv")
    (trial,) = read_trials(tmp_path)  # the orders beside it are no trial
    assert trial.meta["ship"] == "kvlcc2_l7"
    assert {"U_C", "gamma_C", "delta", "delta_cmd"} <= set(trial.channels)
    assert not [finding for finding in check(trial) if finding.severity == "error"]
    predicted = replay(compiled.ship, trial)
    assert np.hypot(predicted["x"] - trial["x"], predicted["y"] - trial["y"]).max() < 0.05


def test_in_a_loop_orders_are_on_record_from_the_row_on_in_which_they_act(compiled, tmp_path):
    loop = Loop([compiled.plant()], 10.0, math.inf)
    (name,) = loop.vessels
    recording = Recording(loop.vessels[name].plant, tmp_path / "run.csv")
    loop.witness(name, recording)
    loop.order(name, "delta", 0.1)
    loop.run(2.0)
    loop.order(name, "delta", 0.2)
    loop.run(3.0)
    recording.close()
    trial = read_trial(tmp_path / "run.csv")
    assert len(trial) == 51
    assert trial["delta_cmd"].tolist() == [0.1] * 20 + [0.2] * 31
    same(rerun(tmp_path / "run.csv", compiled.ship), trial)


def test_a_reset_and_a_bottom_begin_a_new_file(compiled, tmp_path):
    loop = Loop([compiled.plant()], 10.0, math.inf)
    (name,) = loop.vessels
    recording = Recording(loop.vessels[name].plant, tmp_path / "run.csv")
    loop.witness(name, recording)
    loop.run(1.0)
    loop.reset()
    loop.run(2.0)
    loop.surround(name, Uniform(depth=5.0).now())
    loop.run(1.0)
    loop.dismiss(recording)
    recording.close()
    loop.run(1.0)
    assert [path.name for path in recording.paths] == ["run.csv", "run_2.csv", "run_3.csv"]
    first, second, third = (read_trial(path) for path in recording.paths)
    assert [len(first), len(second), len(third)] == [10, 20, 11]
    assert second.t[0] == 0.0
    assert third["depth"].tolist() == [5.0] * 11
    for path in recording.paths:
        same(rerun(path, compiled.ship), read_trial(path))


def test_nothing_is_overwritten_and_nothing_made_before_the_first_row(compiled, tmp_path):
    plant = compiled.plant()
    Recording(plant, tmp_path / "run.csv").close()
    assert not list(tmp_path.iterdir())
    steered(plant, tmp_path / "run.csv", steps=3)
    for path, text in (
        (tmp_path / "run.csv", r"run\.csv: exists"), (tmp_path / "run.parquet", "a .csv file"),
        (tmp_path / "none" / "run.csv", "no folder"),
    ):  # fmt: skip
        with pytest.raises(DataError, match=text):
            Recording(plant, path)


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.slow), 3])
def test_whatever_is_there_at_any_moment_is_a_trial(compiled, tmp_path, every):
    """Looked at after each step, as a process that is killed there would leave it."""
    plant = compiled.plant()
    recording = Recording(plant, tmp_path / "run.csv", every=every)
    for k in range(10):
        plant.order("delta", 0.01 * k)
        recording.see(plant)
        files = sorted(path.name for path in tmp_path.iterdir())
        if k < every:
            assert files == []
            assert recording.rows == 0
        else:
            assert files == ["run.csv", "run.orders.jsonl", "run.yaml"]
            assert len(read_trial(tmp_path / "run.csv")) == recording.rows == 1 + k // every
            same(rerun(tmp_path / "run.csv", compiled.ship), read_trial(tmp_path / "run.csv"))
        plant.step()


def test_a_single_row_is_no_trial_and_leaves_nothing(compiled, tmp_path):
    plant = compiled.plant()
    recording = Recording(plant, tmp_path / "run.csv")
    recording.see(plant)
    recording.close()
    assert not list(tmp_path.iterdir())
    assert recording.paths == []


def test_where_the_ship_blew_up_is_no_row(compiled, tmp_path):
    plant = compiled.plant()
    recording = Recording(plant, tmp_path / "run.csv")
    for _ in range(3):
        recording.see(plant)
        plant.step()
    saved = plant.snapshot()
    head, body = saved.split(b"\n", 1)
    plant.restore(head + b"\n" + np.full(len(body) // 8, np.nan).tobytes())
    plant.k += 1
    recording.close()
    trial = read_trial(tmp_path / "run.csv")
    assert len(trial) == 3
    assert np.isfinite(trial["x"]).all()


def test_no_room_for_the_first_rows_leaves_nothing_half_written(compiled, tmp_path, monkeypatch):
    plant = compiled.plant()
    recording = Recording(plant, tmp_path / "run.csv")
    recording.see(plant)
    plant.step()
    monkeypatch.setattr(os, "write", lambda file, data: 0)
    with pytest.raises(DataError, match="no room left"):
        recording.see(plant)
    assert not list(tmp_path.iterdir())


def test_a_full_disk_ends_the_recording_and_not_the_loop(compiled, tmp_path, monkeypatch):
    loop = Loop([compiled.plant()], 10.0, math.inf)
    (name,) = loop.vessels
    recording = Recording(loop.vessels[name].plant, tmp_path / "run.csv")
    loop.witness(name, recording)
    loop.run(1.0)
    write = os.write
    monkeypatch.setattr(os, "write", lambda file, data: write(file, data[: len(data) // 2]))
    loop.run(1.0)
    monkeypatch.undo()
    assert loop.k == 20
    assert [event.kind for event in loop.events] == ["dropped"]
    assert "no room left" in loop.events[0].text
    assert len(read_trial(tmp_path / "run.csv")) == 10


def test_orders_that_cannot_be_run_again_are_refused(compiled, tmp_path):
    path = tmp_path / "run.csv"
    steered(compiled.plant(), path, steps=30)
    with pytest.raises(ShipError, match="other numbers"):
        rerun(path, compiled.ship.having({"rudder.t_R": 0.1}))
    with pytest.raises(ShipError, match="other numbers"):
        rerun(path, load("kcs"))
    orders = orders_path(path)
    whole = orders.read_text()
    orders.write_text(whole + '{"k": 20, "ord')  # killed while it wrote
    rerun(path, compiled.ship)
    for text in ("", "nothing\n", "{}\n", json.dumps({"schema": "other/1"}) + "\n"):
        orders.write_text(text)
        with pytest.raises(DataError, match="not the orders of a recording"):
            rerun(path, compiled.ship)
    orders.unlink()
    with pytest.raises(DataError, match="no orders to read"):
        rerun(path, compiled.ship)


SAIL = """
import math, sys
from seatrial.realtime.loop import Loop
from seatrial.realtime.plant import Plant
from seatrial.realtime.recording import Recording, rerun
from seatrial.ships.files import load

loop = Loop({"own": Plant.of(load("kvlcc2_l7"), dt=0.1)}, 10.0, math.inf)
loop.witness("own", Recording(loop.vessels["own"].plant, sys.argv[1]))
loop.after(lambda loop: loop.order("own", "delta", 0.3 * math.sin(0.1 * loop.t)))
loop.run()
"""


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0.05, pytest.param(0.3, marks=pytest.mark.long)])
def test_a_killed_process_leaves_a_valid_trial_that_runs_again(compiled, tmp_path, delay):
    path = tmp_path / "run.csv"
    process = subprocess.Popen([sys.executable, "-c", SAIL, str(path)])
    end = time.monotonic() + 60.0
    while not path.exists() and time.monotonic() < end:
        time.sleep(0.01)
    time.sleep(delay)
    process.send_signal(signal.SIGKILL)
    process.wait()
    trial = read_trial(path)
    assert len(trial) > 2
    assert np.isfinite(trial.stack(*STATES)).all()
    same(rerun(path, compiled.ship), trial)

"""kill -9 at random moments: `identify` goes on from its folder and ends with the same numbers."""

import json
import math
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

pytestmark = pytest.mark.long
STUDY = """schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "{root}"
train = ["*"]
[free]
"hull.*" = {{ ratio = 0.5 }}
[estimator]
type = "shooting:Trajectory"
window = 20.0
method = "rk4"
every = 2
starts = 4
tolerance = 1e-10
iterations = 60
"""


EVOLUTION = STUDY[: STUDY.index("[estimator]")].replace('"hull.*"', '"hull.N_*"') + """[estimator]
type = "evolution:Evolution"
window = 20.0
runs = 3
agree = 3
generations = 120
"""


@pytest.fixture(scope="module")
def evolution(study):
    path = study.with_name("evolution.toml")
    path.write_text(EVOLUTION.format(root=study.parent / "trials"))
    return path


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    ship, rng = load("kvlcc2_l7"), np.random.default_rng(5)
    n_P, noise = approach(ship)[1], Sensors(noise={"u": 0.01, "v_m": 0.01, "r": 0.002, "psi": 0.005})
    policies = [Turning(n_P, math.radians(a)) for a in (35, -35, 20, -20)]
    policies += [Zigzag(n_P, math.radians(a), math.radians(a)) for a in (10, 20)]
    (folder / "trials").mkdir()
    for i, policy in enumerate(policies):
        run = noise.read(simulate(ship, policy, duration=200.0, dt=0.1, name=f"t{i}"), rng)
        write_trial(run, folder / "trials" / f"t{i}.csv")
    (folder / "study.toml").write_text(STUDY.format(root=folder / "trials"))
    return folder / "study.toml"


def identify(study, out):
    command = [sys.executable, "-m", "seatrial", "identify", str(study), "-o", str(out)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=os.environ, text=True)


def killed_after(run, iterations):
    """Kill a run once it has told of so many iterations; whether it was still alive."""
    told = 0
    with run:
        for line in run.stderr:
            told += line.startswith("iteration")
            if told == iterations:
                time.sleep(np.random.default_rng().uniform(0.0, 0.02))
                run.send_signal(signal.SIGKILL)
                break
    return run.returncode == -signal.SIGKILL


def values(out):
    return json.loads((out / "fit.json").read_text())["parameters"]


def test_killed_at_random_moments_it_ends_with_the_same_numbers(study, tmp_path):
    whole = identify(study, tmp_path / "whole")
    whole.communicate()
    assert whole.returncode == 0
    for _ in range(5):
        assert killed_after(identify(study, tmp_path / "killed"), int(np.random.default_rng().integers(1, 9)))
        assert not (tmp_path / "killed" / "fit.json").exists()
    last = identify(study, tmp_path / "killed")
    last.communicate()
    assert last.returncode == 0
    assert values(tmp_path / "killed") == values(tmp_path / "whole")


def test_a_search_by_generations_killed_twenty_times_ends_with_the_same_numbers(evolution, tmp_path):
    whole = identify(evolution, tmp_path / "whole")
    whole.communicate()
    assert whole.returncode == 0
    rng = np.random.default_rng()
    for _ in range(20):
        assert killed_after(identify(evolution, tmp_path / "killed"), int(rng.integers(1, 16)))
        assert not (tmp_path / "killed" / "fit.json").exists()
        assert not list((tmp_path / "killed").glob("*.partial*"))
    last = identify(evolution, tmp_path / "killed")
    last.communicate()
    assert last.returncode == 0
    assert values(tmp_path / "killed") == values(tmp_path / "whole")

"""kill -9 at random moments over ten kinds of long work: begun again, it ends with the same results.

``SEATRIAL_KILLS`` sets how many kills each kind suffers (5: fifty together).
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from campaign.killed import CAMPAIGN
from interrupted import STUDY, TRAJECTORY, lasting, seatrial, write_trials
from network_trials import untrained, virtual
from seatrial.data.trialfile import write_trial
from seatrial.ships.writing import save

pytestmark = pytest.mark.long
KILLS = int(os.environ.get("SEATRIAL_KILLS", "5"))
ENDS = (0, 1)
"""Exit status of a run that came to its end: 1 where the ship does not meet the requirements."""
EVOLUTION = STUDY.replace('"hull.*"', '"hull.N_*"') + """type = "evolution:Evolution"
window = 20.0
runs = 3
agree = 3
population = 6
generations = 20
"""
NETWORKS = """schema = "seatrial-series/1"
title = "One network"
[data]
root = "random"
test = { random = "random_3" }
validation = { random = "random_9" }
[fits.one]
ship = "untrained.toml"
train = ["random_1", "random_2"]
seeds = [1, 2]
[fits.one.estimator]
type = "training:Training"
epochs = 10
"""
SERIES = """schema = "seatrial-series/1"
title = "Two models, two seeds each"
[data]
root = "trials"
test = { zigzag = "t2" }
[fits.hull]
ship = "kvlcc2_l7"
train = ["t0", "t1"]
[fits.hull.free]
"hull.Y_*" = { ratio = 0.5 }
[fits.hull.estimator]
type = "shooting:Trajectory"
window = 20.0
starts = 3
tolerance = 1e-10
[fits.moments]
like = "hull"
[fits.moments.free]
"hull.N_*" = { ratio = 0.5 }
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    at = tmp_path_factory.mktemp("work")
    write_trials(at / "trials", 80.0, (35, -35), (20,))
    (at / "random").mkdir()
    for seed in (1, 2, 3, 9):
        write_trial(virtual(seed), at / "random" / f"random_{seed}.csv")
    save(untrained(), at / "untrained.toml")
    return at


def identify(name: str, text: str) -> Callable[[Path, Path], list[str | Path]]:
    def command(folder: Path, out: Path) -> list[str | Path]:
        (folder / name).write_text(text)
        return ["identify", folder / name, "-o", out]

    return command


def requirements(_: Path, out: Path) -> list[str | Path]:
    out.mkdir(exist_ok=True)
    return ["requirements", "esso_osaka_3m", "-o", out / "page.html"]


def campaign(folder: Path, out: Path) -> list[str | Path]:
    (folder / "campaign.toml").write_text(CAMPAIGN.format(runs=6000, chunk=500, duration=200.0))
    return ["campaign", folder / "campaign.toml", "-o", out, "--json"]


def sampling(folder: Path, out: Path) -> list[str | Path]:
    text = STUDY.replace('"hull.*"', '"hull.N_[rv]"').replace('["*"]', '["t2"]') + TRAJECTORY
    return [*identify("sampled.toml", text)(folder, out), "--sample", "400"]


def imported(folder: Path, out: Path) -> list[str | Path]:
    """Forty logs of a table of their own."""
    logs = folder / "logs"
    if not logs.exists():
        logs.mkdir()
        (folder / "logs.toml").write_text('schema = "seatrial-mapping/1"\ntime = { column = "time", unit = "s" }\n'
                                          '[channels]\npsi = { column = "heading", unit = "deg" }\n')  # fmt: skip
        for k in range(40):
            rows = "\n".join(f"{0.1 * j:.1f},{(30.0 + 0.01 * j * k) % 360.0:.3f}" for j in range(20_000))
            (logs / f"log_{k}.csv").write_text(f"time,heading\n{rows}\n")
    return ["import", "csv", logs, "--mapping", folder / "logs.toml", "-o", out]


def case(folder: Path, out: Path) -> list[str | Path]:
    """Four parts, by as many processes as there are processors."""
    (folder / "case.toml").write_text('schema = "seatrial-case/1"\nclaim = "it keeps clear"\nship = "kvlcc2_l7"\n'
                                      '[encounters]\nroles = ["give-way", "stand-on"]\nruns = 3200\n')  # fmt: skip
    return ["case", folder / "case.toml", "-o", out]


KINDS: dict[str, Callable[[Path, Path], list[str | Path]]] = {
    "trajectory": identify("trajectory.toml", STUDY + TRAJECTORY.replace("starts = 2", "starts = 4")),
    "evolution": identify("evolution.toml", EVOLUTION),
    "shooting": identify("shooting.toml", STUDY + 'type = "logo:Shooting"\n'),
    "networks": identify("networks.toml", NETWORKS),
    "series": identify("series.toml", SERIES),
    "requirements": requirements,
    "campaign": campaign,
    "sampling": sampling,
    "import": imported,
    "case": case,
}


def finished(command: list[str | Path]) -> float:
    """Run to the end; how long it took [s]."""
    began = time.perf_counter()
    run = seatrial(*command)
    _, said = run.communicate()
    assert run.returncode in ENDS, said
    return time.perf_counter() - began


def killed(command: list[str | Path], after: float) -> bool:
    """Kill a run after a time [s]; whether it had not ended before."""
    run = seatrial(*command)
    try:
        _, said = run.communicate(timeout=after)
    except subprocess.TimeoutExpired:
        run.kill()
        run.communicate()
        return run.returncode == -signal.SIGKILL
    assert run.returncode in ENDS, said
    return False


@pytest.mark.parametrize("kind", KINDS)
def test_killed_at_random_moments_it_ends_with_the_same_results(kind: str, folder: Path, tmp_path: Path) -> None:
    """Moments are even over a whole run; one that ends before its kill is judged, and another begins."""
    at, draw = tmp_path / "killed", np.random.default_rng()
    finished(KINDS[kind](folder, tmp_path / "first"))  # whatever has to be compiled
    usual, wanted = finished(KINDS[kind](folder, tmp_path / "whole")), lasting(tmp_path / "whole")
    assert wanted == lasting(tmp_path / "first")
    command, kills = KINDS[kind](folder, at), 0
    while kills < KILLS:
        if killed(command, draw.uniform(0.1, 1.0) * usual):
            kills += 1
        else:
            assert lasting(at) == wanted
            shutil.rmtree(at)
            KINDS[kind](folder, at)
    finished(command)
    assert lasting(at) == wanted

"""The fine-tuning study of Suyama 2023 as it stands: its bars, ten seeds, and kill -9 at random moments."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from seatrial.identify.tuning.ranges import within
from seatrial.study.study import read_study

pytestmark = pytest.mark.long
STUDY = Path(__file__).parents[2] / "studies" / "suyama2023.toml"


@pytest.fixture(scope="module")
def study():
    return read_study(STUDY)


def test_the_bars_of_the_study(study):
    tuning = study.estimator.tune(study.problem, study.test)
    assert max(r.apart for r in tuning.ranges) < 1e-4
    costs = [sum(r.tune.values()) for r in tuning.ranges]
    assert costs == sorted(costs, reverse=True)
    for r in tuning.ranges:
        assert all(r.test[name] < cost for name, cost in tuning.untuned_test.items())
    tests = [sum(r.test.values()) for r in tuning.ranges]
    assert tests[tuning.chosen] <= 1.05 * min(tests)
    assert {line.partition(" is ")[0] for line in tuning.residuals.warnings}  # wind and lag are not in the model


def test_the_methods_agree_from_nine_of_ten_seeds(study):
    one = replace(study.problem, free=within(study.problem, 0.6))
    agreed = 0
    for seed in range(10):
        gradient = replace(study.estimator, seed=seed, starts=5).gradient(600.0).fit(one).objective
        evolution = replace(study.estimator.evolution(), seed=seed).fit(one).objective
        agreed += abs(gradient - evolution) <= 1e-4 * min(gradient, evolution)
    assert agreed >= 9


def numbers(folder):
    """What a run came to, the seconds left out."""
    found = json.loads((folder / "report.json").read_text())
    for r in found["ranges"]:
        for method in r["methods"].values():
            del method["seconds"]
    del found["provenance"]
    return found


def test_kill_9_at_random_moments(tmp_path):
    text = STUDY.read_text(encoding="utf-8").replace("ratios = [0.2, 0.3, 0.4, 0.5, 0.6]", "ratios = [0.2, 0.5]")
    path = tmp_path / "study.toml"
    path.write_text(text)

    def start(out):
        command = [sys.executable, "-m", "seatrial", "identify", str(path), "-o", str(tmp_path / out)]
        return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=os.environ)

    began = time.perf_counter()
    assert start("whole").wait() == 0
    usual, draw, killed = time.perf_counter() - began, random.Random(5), 0
    for _ in range(6):  # together little more than one run, so that none of them ends by itself
        run = start("killed")
        time.sleep(draw.uniform(0.05, 0.3) * usual)
        if run.poll() is None:
            run.send_signal(signal.SIGKILL)
            killed += run.wait() == -signal.SIGKILL
    assert killed >= 5
    assert start("killed").wait() == 0
    assert numbers(tmp_path / "killed") == numbers(tmp_path / "whole")
    assert not list((tmp_path / "killed").glob("checkpoint.*"))

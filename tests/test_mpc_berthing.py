"""The example controller berths the exported tug: the last 40 s of its plan, with a shorter horizon."""

from __future__ import annotations

import importlib.util
import json
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.actuators import Actuators

EXAMPLE = Path(__file__).parents[1] / "examples" / "mpc_berthing.py"


@pytest.fixture(scope="module")
def example() -> Any:
    found = importlib.util.spec_from_file_location("mpc_berthing", EXAMPLE)
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    sys.modules["mpc_berthing"] = module
    found.loader.exec_module(module)
    return module


def test_the_plan_is_a_motion(example: Any) -> None:
    """Its speeds are the derivatives of its pose, without drift, and it ends at rest."""
    for t in (5.0, 30.0, 61.0):
        _, _, psi, u, v_m, r = example.plan(t)
        dx, dy, turn = (example.plan(t + 1e-4) - example.plan(t - 1e-4))[:3] / 2e-4
        assert (dx, dy) == pytest.approx((u * math.cos(psi), u * math.sin(psi)), abs=1e-6)
        assert (v_m, r) == pytest.approx((0.0, turn), abs=1e-6)
    assert example.plan(1e3) == pytest.approx((example.LENGTH, example.ASIDE, 0.0, 0.0, 0.0, 0.0))


@pytest.mark.slow
def test_the_true_tug_answers_whatever_the_model(example: Any, tmp_path: Path) -> None:
    """A model with other servos changes what the controller knows, not the tug."""
    from seatrial.ships.files import load, save

    tug = load("qiuxin5")
    servos = {**tug.actuators.by_name, "alpha_1": replace(tug.actuators.of("alpha_1"), rate=0.3)}
    save(replace(tug, name="other", actuators=Actuators(servos)), tmp_path / "other.toml")
    for folder, model in (("a", "qiuxin5"), ("b", str(tmp_path / "other.toml"))):
        (tmp_path / folder).mkdir()
        example.export(tmp_path / folder, model)
    assert json.loads((tmp_path / "b" / "turn.json").read_text()) == [0.3, 0.1161]
    true = [(tmp_path / folder / "true.casadi.json").read_text() for folder in "ab"]
    assert true[0] == true[1]
    with pytest.raises(ValueError, match="n_1"):
        example.export(tmp_path, "kvlcc2")


@pytest.mark.slow
def test_a_model_that_there_is_not_in_one_line(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, str(EXAMPLE), "nosuchmodel"], cwd=tmp_path, check=False,
                          capture_output=True, text=True)  # fmt: skip
    assert done.returncode != 0
    assert "nosuchmodel" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.long
def test_the_tug_comes_to_rest_at_the_berth(example: Any, tmp_path: Path) -> None:
    example.export(tmp_path)
    run = example.berth(tmp_path, begin=50.0, end=90.0, horizon=20)
    x, y, psi, u, v_m, _ = run.states[-1]
    assert math.hypot(x - example.LENGTH, y - example.ASIDE) < 0.02
    assert abs(math.degrees(psi)) < 1.0
    assert math.hypot(u, v_m) < 0.01
    assert np.abs(run.errors[20:]).max() < 0.05, "0.2 m aside at the start, on the plan 20 s later"
    assert run.missed <= 4, "of 40; the last plan goes on"
    assert run.orders[:, ::2].min() >= example.LEAST - 1e-6
    assert run.orders[:, ::2].max() <= example.MOST + 1e-6

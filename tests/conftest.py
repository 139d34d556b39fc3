"""A fit by the command line, made once for all rooms that read it; and what makes collection and tests quicker."""

from __future__ import annotations

import gc
import os
from dataclasses import replace
from pathlib import Path

import pytest

from shares import THREADS
from tiers import left_out

if "PYTEST_XDIST_WORKER" in os.environ:
    for name in THREADS:
        os.environ.setdefault(name, "1")

STUDY = """schema = "seatrial-study/1"
ship = "mine.toml"
[data]
root = "logs"
train = ["a", "b"]
[free]
"hull.N_r" = { prior = 0.5 }
[loss]
sigma = { x = 9.0, y = 9.0, psi = 0.5, u = 0.1, v_m = 0.1, r = 0.1 }
[nuisance]
current = 0.3
[estimator]
type = "shooting:Trajectory"
window = 30.0
iterations = 8
"""


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """A module of which `-m` takes no test is not imported."""
    if not (collection_path.name.startswith("test_") and collection_path.suffix == ".py"):
        return None
    return left_out(collection_path.read_text(encoding="utf-8"), config.option.markexpr) or None


def pytest_configure() -> None:
    """Collecting makes hardly any garbage, and much to look through for it."""
    gc.disable()
    # Nobody cuts the power: that files are synced, and what follows where they cannot be, tests see by their own.
    os.fsync = lambda fd: None


def pytest_collection_finish() -> None:
    gc.enable()
    gc.freeze()
    gc.set_threshold(200_000, 20, 20)


@pytest.fixture(scope="session")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of a fit that begins from a ship file of the user's own; `a` and `b` met an unlogged current."""
    from seatrial.cli.app import main
    from seatrial.data.trialfile import write_trial
    from seatrial.environment import Uniform
    from seatrial.manoeuvres.zigzag import Zigzag
    from seatrial.ships.files import load
    from seatrial.ships.writing import save
    from seatrial.simulate.run import approach, simulate

    at = tmp_path_factory.mktemp("own")
    ship = load("kvlcc2_l7")
    (at / "logs").mkdir()
    for name, side, towards in (("a", 1.0, 0.5), ("b", -1.0, 2.0)):
        run = simulate(ship, Zigzag(approach(ship)[1], 0.35, 0.35, side), duration=60.0, dt=0.1, every=5, name=name,
                       environment=Uniform(U_C=0.2, gamma_C=towards))  # fmt: skip
        kept = {k: v for k, v in run.channels.items() if k not in ("U_C", "gamma_C")}
        write_trial(replace(run, channels=kept), at / "logs" / f"{name}.csv")
    save(replace(ship.having({"hull.N_r": 1.3 * float(ship.model.hull.N_r)}), name="mine"), at / "mine.toml")
    (at / "study.toml").write_text(STUDY)
    assert main(["identify", str(at / "study.toml"), "-o", str(at / "run"), "--json"]) == 0
    return at

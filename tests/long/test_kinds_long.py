"""Recognised kinds: of real sets, whose file names tell the truth, and of every manoeuvre of the library with noise."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from seatrial.data.folder import read_folder
from seatrial.data.kinds import compared, recognised
from seatrial.sensors import Sensors
from seatrial.workflow.simulation import known, simulate

pytestmark = pytest.mark.long
ROOT = Path(os.environ.get("SEATRIAL_DATA", Path(__file__).parents[2].parent / "shared" / "data"))


@pytest.mark.skipif(not (ROOT / "esso_osaka_frt").is_dir(), reason="FRT-DS-ESSO absent: set SEATRIAL_DATA")
def test_every_recording_of_the_esso_osaka_is_recognised() -> None:
    table: Counter[tuple[str, str]] = Counter()
    for name, trial in read_folder(ROOT / "esso_osaka_frt" / "data").trials.items():
        found = recognised(trial)
        table[name.partition("/")[0], found.name] += 1
        assert compared(trial, found) == "agrees", (name, found)
    assert table == {("turning", "turning"): 14, ("zigzag", "zigzag"): 8, ("random", "mixed"): 8,
                     ("berthing", "berthing"): 5}  # fmt: skip


@pytest.mark.skipif(not (ROOT / "kvlcc2_hsva_simman2008").is_dir(), reason="SIMMAN 2008 absent: set SEATRIAL_DATA")
@pytest.mark.parametrize("folder", ["kvlcc2_hsva_simman2008/raw", "kvlcc2_marin_simman2008/raw"])
def test_zigzags_of_simman_have_the_rudder_of_their_names(folder: str) -> None:
    """The heading at which the rudder leaves is that of the name and what the ship turns meanwhile, below 3 deg."""
    for name, trial in read_folder(ROOT / folder).trials.items():
        found = recognised(trial)
        assert (found.name, found.doubts) == ("zigzag", ()), name
        meant = trial.meta["set_points"]
        assert found.settings["rudder"] == pytest.approx(meant["rudder"], abs=np.radians(0.5))
        assert -0.01 < found.settings["heading"] - meant["heading"] < np.radians(3.0)


APART = {
    # a first turn of 10 deg of which the log goes on: a turning circle
    ("initial-turning", "turning"),
    # the approach, with the rudder midships and the engine reversed once, is a stop
    ("berthing", "stopping"), ("berthing", "mixed"),
}  # fmt: skip


@pytest.mark.parametrize("ship", ["kvlcc2_l7", "esso_osaka_3m", "suzaku", "twin_virtual"])
def test_every_manoeuvre_of_the_library_is_recognised_under_noise(ship: str) -> None:
    skipped = ("crabbing", "thrust-steps")  # these need thrusters
    rng = np.random.default_rng(1)
    wrong: list[str] = []
    for kind in (one for one in known() if one not in skipped):
        clean = simulate(ship, kind).trial
        fast, turn = float(np.max(clean["u"])), float(np.quantile(np.abs(clean["r"]), 0.95))
        noise = {"x": 0.03, "y": 0.03, "psi": 0.003, "u": 0.01 * fast, "v_m": 0.01 * fast, "r": 0.02 * turn + 1e-5}
        noise |= {name: np.radians(0.2) for name in clean.channels if name.startswith("delta") and "cmd" not in name}
        trial = Sensors(noise).read(clean, rng)
        found = recognised(trial)
        if compared(trial, found) != "agrees" and (kind, found.name) not in APART:
            wrong.append(f"{kind}: {found.label} {found.evidence} {found.doubts}")
    assert not wrong, "\n".join(wrong)

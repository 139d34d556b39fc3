"""A survey of a folder names the manoeuvres of a file that holds several, and writes what cuts it."""

import math
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.folder import read_folder
from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.report.blocks import document, plain_text
from seatrial.ships.files import load
from seatrial.simulate.run import simulate
from seatrial.study.drafting.draft import draft
from seatrial.workflow import RequestError, Silent
from seatrial.workflow.data import mend
from seatrial.workflow.folders.survey import trials


@pytest.mark.slow
def test_two_zigzags_of_one_file_are_told_and_become_two_trials(tmp_path: Path) -> None:
    ship, deg = load("kvlcc2_l7"), math.radians(1.0)
    run = simulate(ship, Zigzag(10.4, 20.0 * deg, 20.0 * deg), duration=100.0, dt=0.5)
    rest = np.arange(0.0, 60.0, 0.5)
    calm = {"x": 1.1 * rest, "u": np.full(rest.size, 1.1), "n_P": np.full(rest.size, 10.4)}
    joined = {name: np.concatenate([run[name], calm.get(name, 0.0 * rest), run[name]])
              for name in ("x", "y", "psi", "u", "v_m", "r", "delta", "n_P")}  # fmt: skip
    t = 0.5 * np.arange(joined["x"].size)
    (logs := tmp_path / "logs").mkdir()
    write_trial(Trial("day", t, joined, meta={"L_pp": 7.0, "start": "2024-05-01T10:00:00+00:00"}), logs / "day.csv")
    heard: list[str] = []

    class Heard(Silent):
        def note(self, line: str) -> None:
            heard.append(line)

    trials(logs, sink=Heard())
    (said,) = heard
    assert said.endswith(f": seatrial trials {logs} --remedy steps.toml")
    drawn = draft("kvlcc2_l7", ship, read_folder(logs), tmp_path / "study.toml")
    assert [one.partition(":")[0] for one in drawn.notes if "--remedy" in one] == ["day"]
    outcome = trials(logs, remedy=tmp_path / "steps.toml")
    (told,) = [line for line in plain_text(outcome.shown) if "manoeuvres in one file" in line]
    assert "zigzag 20/21 starboard 10:00:00 to 10:01:" in told
    assert told.endswith("to 10:04:20")
    first, second = document(outcome.shown)["trials"]["day"]["parts"]  # type: ignore[index]
    assert (first["start"], second["stop"]) == (0.0, t[-1])
    assert first["stop"] < 130.0 < second["start"]
    made = mend([logs], tmp_path / "steps.toml", tmp_path / "cut")
    assert sorted(path.stem for path in made) == ["day_1", "day_2"]
    with pytest.raises(RequestError, match=r"ends in \.toml"):
        trials(logs, remedy=tmp_path / "steps.csv")

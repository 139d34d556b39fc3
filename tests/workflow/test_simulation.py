"""Workflows of one ship: they return values, print nothing, and pass warnings to who asks for them."""

from __future__ import annotations

from pathlib import Path

import pytest

from seatrial.data.trialfile import read_trial
from seatrial.ships.files import load
from seatrial.workflow import RequestError
from seatrial.workflow.asked import Orders
from seatrial.workflow.data import resample
from seatrial.workflow.judging import design
from seatrial.workflow.simulation import known, simulate


@pytest.mark.slow
def test_a_manoeuvre_is_a_value(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    notes: list[str] = []
    by_name = simulate("kvlcc2_l7", "turning", orders=Orders(20.0, side="port"), out=tmp_path / "run.csv",
                       note=notes.append)  # fmt: skip
    by_ship = simulate(load("kvlcc2_l7"), "turning", orders=Orders(20.0, side="port"))
    assert by_name.complete
    assert by_name.indices["advance"].value == by_ship.indices["advance"].value > 0.0
    assert by_name.settings["rudder"] == pytest.approx(20.0)
    assert read_trial(tmp_path / "run.csv")["delta"].min() < -0.3
    assert notes == [f"wrote {tmp_path / 'run.csv'}"]
    assert capsys.readouterr() == ("", "")
    (other,) = resample([tmp_path / "run.csv"], 0.5, tmp_path / "half")
    assert read_trial(other).dt == pytest.approx(0.5)


def test_what_a_manoeuvre_does_not_take_is_refused_with_what_it_takes() -> None:
    with pytest.raises(RequestError, match=r"--seed.*--rudder"):
        simulate("kvlcc2_l7", "turning", orders=Orders(seed=3))
    with pytest.raises(RequestError, match="zigzag"):
        simulate("kvlcc2_l7", "zagzig")
    assert "zigzag" in known()


@pytest.mark.slow
def test_a_design_says_what_it_assumed(capsys: pytest.CaptureFixture[str]) -> None:
    notes: list[str] = []
    made = design("mariner_nomoto", ["K", "T"], budget=30.0, note=notes.append)
    assert made.plan.length <= 30.0
    assert "good sensors" in notes[0]
    assert capsys.readouterr() == ("", "")

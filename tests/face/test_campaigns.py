"""`st.campaign`: orders in degrees and distributions to a lazy table."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest

import seatrial as st
from seatrial.campaign import CampaignError
from seatrial.campaign.folder import open_folder
from seatrial.core.errors import RequestError
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.workflow.campaigns import read_campaign

FILE = """schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = 40
[manoeuvre]
kind = "zigzag"
rudder = 10.0
heading = 10.0
duration = 40.0
dt = 0.2
[inputs]
"ship.hull.N_r" = { normal = [1.0, 0.1], factor = true }
"policy.delta" = { uniform = [9, 11], unit = "deg" }
"""
INPUTS = {"ship.hull.N_r": st.Draw.normal(1.0, 0.1, factor=True), "policy.delta": st.Draw.uniform(9, 11, unit="deg")}
TEN = st.Zigzag(rudder_deg=10, heading_deg=10)


@pytest.fixture(scope="module")
def table() -> st.Runs:
    return st.campaign("kvlcc2_l7", TEN, runs=40, inputs=INPUTS, duration=40.0, dt=0.2)


def test_it_is_the_campaign_of_the_file(table: st.Runs, tmp_path: Path) -> None:
    (tmp_path / "campaign.toml").write_text(FILE)
    assert replace(read_campaign(tmp_path / "campaign.toml")).digest == table.plan.digest


def test_memory_and_folder_hold_the_same_rows(table: st.Runs, tmp_path: Path) -> None:
    kept = table.run(tmp_path / "run", threads=1)
    assert kept.folder is not None
    assert not open_folder(kept.folder).missing
    assert kept.to_frame().equals(table.to_frame())
    assert kept.lazy().select(pl.len()).collect().item() == len(table) == 40
    assert pl.DataFrame(table).equals(table.to_frame())  # by Arrow
    assert math.radians(9) < table.to_frame()["policy.delta"].min() < math.radians(9.5)  # type: ignore[operator]


def test_it_shows_its_columns_in_a_notebook(table: st.Runs) -> None:
    assert "first_overshoot" in table._repr_html_()
    assert "40 runs" in repr(table)


@pytest.mark.slow
def test_manoeuvres_in_radians_and_several_ships() -> None:
    ten = math.radians(10.0)
    own = Zigzag(11.85, ten, ten)
    both = st.campaign(["kvlcc2_l7", "esso_osaka_3m"], [own], runs=2, duration=20.0, dt=0.2)
    assert both.to_frame()["case"].to_list() == [0, 0, 1, 1]
    with pytest.raises(RequestError, match="duration"):
        st.campaign("kvlcc2_l7", own, runs=2)


def test_what_cannot_be_run_is_said_at_once() -> None:
    with pytest.raises(RequestError, match="dag"):
        st.Draw.uniform(0, 1, unit="dag")
    with pytest.raises(CampaignError, match=r"ship\.hull\.N_q"):
        st.campaign("kvlcc2_l7", TEN, runs=2, inputs={"ship.hull.N_q": st.Draw.constant(1)}, duration=20.0)
    with pytest.raises(CampaignError, match="mean wind"):
        st.campaign("kvlcc2_l7", TEN, runs=2, weather=st.Weather(gusts="davenport"), duration=20.0)

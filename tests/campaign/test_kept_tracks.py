"""Tracks of a campaign: the samples of the very runs whose indices stand in the table, whatever computed them."""

from __future__ import annotations

import json
import math
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import seatrial as st
from seatrial.campaign import Campaign, CampaignError, Case, Tracks, usual_chunk
from seatrial.campaign.chunk import compute, replay
from seatrial.campaign.folder import begin, open_folder, part_name
from seatrial.campaign.inputs import Input
from seatrial.campaign.running import Shard, run
from seatrial.campaign.tables import merge, scan_tracks, wrong_parts
from seatrial.cli.app import main
from seatrial.core.executors import threads
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships.files import load

TEN = math.radians(10.0)
STATES = ("x", "y", "psi", "u", "v_m", "r")


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    ship = load("kvlcc2_l7")
    case = Case("case", ship, Zigzag(11.85, TEN, TEN), ship.speed, 30.0, 0.1, "rk4")
    other = replace(case, name="other", duration=20.0)
    inputs = {"ship.hull.N_r": Input("normal", (1.0, 0.1), factor=True), "U_C": Input("uniform", (0.0, 0.1))}
    return Campaign("test", (case, other), 90, inputs, chunk=40, tracks=Tracks(7, precision="double"))


@pytest.fixture(scope="module")
def whole(campaign: Campaign, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "run"
    computed(campaign, folder)
    return folder


def computed(campaign: Campaign, folder: Path | str, count: int = 2, shard: str = "1/1") -> int:
    with threads(count) as pool:
        return run(campaign, folder, pool=pool, shard=Shard.read(shard)).parts


@pytest.mark.parametrize("number", [pytest.param(3, marks=pytest.mark.slow), 89, 100])
def test_a_track_is_every_seventh_sample_of_the_run(campaign: Campaign, whole: Path, number: int) -> None:
    track = scan_tracks(open_folder(whole)).filter(pl.col("run") == number).collect()
    _, _, trial = replay(campaign, number)
    assert track.columns == ["run", "t", *STATES, *campaign.cases[0].ship.model.controls]
    assert track["t"].to_numpy() == pytest.approx(trial.t[::7], abs=1e-12)
    for name in track.columns[2:]:
        assert track[name].to_numpy() == pytest.approx(trial[name][::7], rel=1e-10, abs=1e-10), name


def test_tracks_change_no_index(campaign: Campaign) -> None:
    kept, bare = compute(campaign, 1), compute(replace(campaign, tracks=None), 1)
    assert len(kept.tracks["x"]) == 40 * 43
    assert not bare.tracks
    for name, column in bare.columns.items():
        assert kept.columns[name] == pytest.approx(column, rel=1e-12, abs=1e-12, nan_ok=True), name


@pytest.mark.parametrize("every", [1, 300, 301, 1000])
def test_any_stride(campaign: Campaign, every: int) -> None:
    part = compute(replace(campaign, runs=3, tracks=Tracks(every)), 0)
    trials = [replay(replace(campaign, runs=3), k)[2] for k in range(3)]
    assert part.tracks["psi"].dtype == np.float32
    assert part.tracks["psi"] == pytest.approx(np.concatenate([t["psi"][::every] for t in trials]), abs=1e-6)
    bare = compute(replace(campaign, runs=3, tracks=None), 0)
    assert part.columns["first_overshoot"] == pytest.approx(bare.columns["first_overshoot"], rel=1e-12, nan_ok=True)


@pytest.mark.slow
def test_stored_runs_have_the_same_tracks(campaign: Campaign) -> None:
    few = replace(campaign, cases=campaign.cases[:1], runs=5)
    tally, stored = compute(few, 0), compute(replace(few, cases=(replace(few.cases[0], whole=True),)), 0)
    assert tally.tracks.keys() == stored.tracks.keys()
    for name, column in tally.tracks.items():
        assert stored.tracks[name] == pytest.approx(column, rel=1e-10, abs=1e-10), name


@pytest.mark.parametrize("stored", [False, True])
def test_a_run_that_fails_keeps_what_came_before(campaign: Campaign, stored: bool) -> None:
    ship = replace(campaign.cases[0].ship, validity={"r": (-0.02, 1.0)})
    case = replace(campaign.cases[0], ship=ship, whole=stored)
    inputs = {"ship.hull.N_r": Input("uniform", (0.5, 1.5), factor=True)}
    part = compute(replace(campaign, cases=(case,), runs=4, inputs=inputs, tracks=Tracks(3)), 0)
    failed = part.columns["failed"]
    assert np.isfinite(failed).any()
    for number, end in enumerate(failed):
        t = part.tracks["t"][part.tracks["run"] == number]
        assert t[-1] < end <= t[-1] + 0.3 + 1e-9 if np.isfinite(end) else t[-1] == pytest.approx(30.0)
    assert part.tracks["r"].min() >= -0.02


@pytest.mark.slow
def test_shards_threads_and_chance_change_no_byte(campaign: Campaign, whole: Path, tmp_path: Path) -> None:
    for shard in (2, 1):
        computed(campaign, tmp_path / "run", shard, f"{shard}/2")
    assert open_folder(tmp_path / "run").digest() == open_folder(whole).digest()
    assert not list(wrong_parts(open_folder(whole)))


def test_a_part_without_its_tracks_is_computed_again(campaign: Campaign, whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    (folder / part_name(1, "tracks")).unlink()
    assert open_folder(folder).missing == [1]
    assert computed(campaign, folder) == 1
    assert open_folder(folder).digest() == open_folder(whole).digest()


def test_wrong_tracks_are_found(whole: Path, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    one, other, third = (folder / part_name(k, "tracks") for k in (0, 1, 2))
    held = open_folder(folder)
    about = pl.read_parquet_metadata(one)
    own = {name: text for name, text in about.items() if name.startswith("seatrial.")}
    pl.read_parquet(one)[:-1].write_parquet(one, metadata=own)  # a sample is missing
    shutil.copy(third, other)
    third.write_bytes(third.read_bytes()[:-9])
    faults = list(wrong_parts(held))
    assert len(faults) == 4
    assert "0000000.parquet: has other runs or samples" in faults[0]
    assert "another campaign or part" in faults[1]
    assert "cannot be read" in faults[3]


def test_merged_tracks_are_one_file(whole: Path, tmp_path: Path) -> None:
    runs, tracks = (pl.read_parquet(path) for path in merge(open_folder(whole), tmp_path / "all.parquet"))
    assert runs.height == 180
    assert (tmp_path / "all.tracks.parquet").exists()
    assert tracks["run"].is_sorted()
    assert tracks["run"].n_unique() == 180
    assert tracks.height == 90 * (43 + 29) == open_folder(whole).manifest.tracks.rows


def test_a_disk_too_small_for_the_tracks_is_refused(campaign: Campaign, tmp_path: Path) -> None:
    free = shutil.disk_usage(tmp_path).free
    fits = replace(campaign, runs=free // 2000, chunk=1000, tracks=None)
    begin(fits, tmp_path / "fits")
    with pytest.raises(CampaignError, match="rows of tracks take up to"):
        begin(replace(fits, tracks=Tracks()), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_parts_are_cut_by_their_tracks(campaign: Campaign) -> None:
    long = (replace(campaign.cases[0], duration=384.0),)
    assert usual_chunk(long, None) == usual_chunk(long, Tracks(100)) == 16384
    assert usual_chunk(long, Tracks(1)) == 512
    with pytest.raises(CampaignError, match="give chunk = 32543"):
        replace(campaign, cases=long, runs=10**6, chunk=10**6, tracks=Tracks(1))


def test_another_choice_is_another_campaign(campaign: Campaign) -> None:
    kinds = (None, Tracks(7), Tracks(8), Tracks(7, ("x",)), Tracks(7, precision="double"))
    assert len({replace(campaign, tracks=one).digest for one in kinds}) == len(kinds)


FILE = """
schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = 30
chunk = 16
tracks = { every = 5, columns = ["psi", "delta", "delta_cmd"] }
[manoeuvre]
kind = "zigzag"
rudder = 10.0
heading = 10.0
duration = 30.0
dt = 0.2
[inputs]
"ship.hull.N_r" = { normal = [1.0, 0.1], factor = true }
"policy.delta" = { uniform = [9, 11], unit = "deg" }
"""


@pytest.mark.slow
def test_the_command_keeps_shows_and_merges_them(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "campaign.toml").write_text(FILE)
    out = str(tmp_path / "run")
    assert main(["campaign", str(tmp_path / "campaign.toml"), "-o", out]) == 0
    assert main(["campaign", out, "--verify"]) == 0
    assert "every 5 samples: run, t, psi, delta, delta_cmd" in capsys.readouterr().out
    assert main(["campaign", out, "--merge", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    table = pl.read_parquet(told["tracks"])
    assert table.height == 30 * 31
    orders = table.group_by("run", maintain_order=True).agg(pl.col("delta_cmd").abs().max())
    asked = pl.read_parquet(told["file"])["policy.delta"].to_numpy()
    assert orders["delta_cmd"].to_numpy() == pytest.approx(asked, rel=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [("every = 5", "every = 0", "tracks.every"), ('"psi"', '"psj"', "psi"), ('"psi"', '"delta"', "stands twice"),
     ("every = 5", 'precision = "half"', "single")],
)  # fmt: skip
def test_wrong_choices_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, said: str
) -> None:
    (tmp_path / "campaign.toml").write_text(FILE.replace(old, new))
    assert main(["campaign", str(tmp_path / "campaign.toml"), "-o", str(tmp_path / "run")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_script_reads_one_run(tmp_path: Path) -> None:
    order = st.Zigzag(rudder_deg=10, heading_deg=10)
    kinds = {"ship.hull.N_r": st.Draw.normal(1.0, 0.1, factor=True), "policy.delta": st.Draw.uniform(9, 11, unit="deg")}
    runs = st.campaign("kvlcc2_l7", order, runs=20, inputs=kinds, duration=30.0, dt=0.2, tracks=st.Tracks(5, ("psi",)))
    mine = runs.tracks().filter(pl.col("run") == 4).collect()
    assert (mine.height, mine.columns) == (31, ["run", "t", "psi"])
    kept = runs.run(tmp_path / "run", threads=1)
    assert kept.tracks().collect().equals(runs.tracks().collect())
    with pytest.raises(CampaignError, match="keeps no tracks"):
        st.campaign("kvlcc2_l7", order, runs=20, duration=30.0, dt=0.2).tracks()


def test_parts_of_stored_runs_take_no_longer_than_others(campaign: Campaign) -> None:
    stored = (replace(campaign.cases[0], whole=True),)
    assert usual_chunk(stored, None) == 2048 < usual_chunk(campaign.cases, None)
